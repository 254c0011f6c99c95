#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prometheus with the configuration and the alert rules of examples/fleet_operations: it scrapes a robot with a bridge, a robot with a kept graph, and a mirror; alerts fire
when a robot is stopped, a disk is full, a store does not respond and a broker is gone, and not before.

    prometheus_test.py BAXTER LRT KEPT_WORLD FULL_DISK MOSQUITTO

Exit status 77: skipped, with a reason.
"""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import urllib.parse

sys.dont_write_bytecode = True  # nothing is left in the source tree
HERE = pathlib.Path(__file__).resolve().parent
for folder in ("conformance", "tools", "operations"):
    sys.path.insert(0, str(HERE.parent / folder))
from robot_process import Program, Receiver, configuration, free_port, http_request, until  # noqa: E402
from broker import Broker  # noqa: E402
from graph_store import GraphStore  # noqa: E402

EXAMPLE = "fleet_operations"
FILES = ("prometheus.yml", "robots.yml", "alerts.yml", "alerts_test.yml")


def promtool(*words, text=None):
    """What it says to a text or to files, all of it; it must be content."""
    done = subprocess.run(["promtool", *words], input=text, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, (words, done.stdout, done.stderr)
    return done.stdout + done.stderr


def files_are_right(folder):
    """As the user has them: promtool accepts them, and each rule fires when it should."""
    for name in FILES:
        (folder / name).write_text(configuration(EXAMPLE, name))
    assert "17 rules found" in promtool("check", "config", str(folder / "prometheus.yml"))
    promtool("test", "rules", str(folder / "alerts_test.yml"))
    rules = re.findall(r"alert: (\w+)", (folder / "alerts.yml").read_text())
    tested = set(re.findall(r"alertname: (\w+)", (folder / "alerts_test.yml").read_text()))
    assert len(rules) == 17 and set(rules) == tested, set(rules) ^ tested
    print("promtool accepts the configuration; 17 rules fire when their tests say so")


def page_shows_the_files():
    """A block of docs/fleet.md that begins with the name of a file has lines of that file, in their order."""
    root = HERE.parent.parent
    count = 0
    for block in re.findall(r"^```\w*\n# (\S+)\n(.*?)^```$", (root / "docs" / "fleet.md").read_text(encoding="utf-8"), re.M | re.S):
        rest = iter([line.strip() for line in configuration(EXAMPLE, block[0]).splitlines()])
        for line in block[1].splitlines():
            assert line.strip() in rest, f"{block[0]} lacks, or has before: {line}"
        count += 1
    assert count >= 6, f"{count} blocks"


def families(text):
    return set(re.findall(r"^# TYPE (\S+) ", text, re.M))


def rules_name_metrics_that_exist(folder, texts):
    known = {"up"} | {name + end for text in texts for name in families(text) for end in ("", "_bucket", "_count", "_sum")}
    for expression in re.findall(r"expr: (.*)", (folder / "alerts.yml").read_text()):
        for name in re.findall(r"\b(?:lrt_\w+|up)\b", expression):
            assert name in known, f"{expression}: no program has {name}"


class Mirror(Program):
    ends_with = (0, 128 + signal.SIGTERM)


class Store(GraphStore):
    """One that can be told to respond 503 to everything."""

    def __init__(self):
        super().__init__()
        self.is_down = False
        handler = self.server.RequestHandlerClass
        for name in ("do_GET", "do_HEAD", "do_PUT", "do_DELETE"):
            if hasattr(handler, name):
                setattr(handler, name, self.unless_down(getattr(handler, name)))

    def unless_down(self, respond):
        def respond_or_refuse(handler):
            if not self.is_down:
                return respond(handler)
            handler.rfile.read(int(handler.headers.get("Content-Length", 0)))
            return handler.reply(503)

        return respond_or_refuse


class Prometheus:
    """With the user's files. What differs: addresses, and all times, so that the test takes seconds."""

    def __init__(self, folder, robots, mirror, manager):
        self.port = free_port()
        (folder / "prometheus.yml").write_text(configuration(
            EXAMPLE, "prometheus.yml", ("scrape_interval: 15s", "scrape_interval: 500ms"), ("scrape_timeout: 10s", "scrape_timeout: 500ms"),
            ("evaluation_interval: 15s", "evaluation_interval: 250ms"), ("127.0.0.1:9464", mirror),
            ("127.0.0.1:9093", manager)))
        lines = "".join(f"- targets: ['{address}']\n  labels: {{robot: {name}, site: hall2}}\n" for name, address in robots.items())
        (folder / "robots.yml").write_text(lines)
        rules = configuration(EXAMPLE, "alerts.yml", ("lrt_mirror_lag_seconds > 60", "lrt_mirror_lag_seconds > 2"))
        rules = re.sub(r"for: \d+[sm]", "for: 500ms", rules).replace("[5m]", "[5s]").replace("[10m]", "[10s]")
        (folder / "alerts.yml").write_text(rules)
        self.log = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(["prometheus", "--config.file", str(folder / "prometheus.yml"), "--storage.tsdb.path", str(folder / "data"),
                                         "--web.listen-address", f"127.0.0.1:{self.port}", "--log.level", "warn"], stdout=self.log, stderr=subprocess.STDOUT)
        try:
            until(self.is_ready, "Prometheus is ready")
        except BaseException:
            self.stop()
            raise

    def said(self):
        self.log.seek(0)
        return self.log.read()

    def is_ready(self):
        assert self.process.poll() is None, self.said()
        try:
            return http_request("GET", f"http://127.0.0.1:{self.port}/-/ready").status == 200
        except OSError:
            return False

    def api(self, path):
        return json.loads(http_request("GET", f"http://127.0.0.1:{self.port}/api/v1/{path}").expect(200).body)["data"]

    def ask(self, query):
        """The samples: their labels and values."""
        return [(one["metric"], float(one["value"][1])) for one in self.api("query?query=" + urllib.parse.quote(query))["result"]]

    def firing(self):
        return {(alert["labels"]["alertname"], alert["labels"].get("robot", "")) for alert in self.api("alerts")["alerts"] if alert["state"] == "firing"}

    def until_firing(self, alert, robot=""):
        until(lambda: (alert, robot) in self.firing(), f"{alert} of {robot!r} fires\n{self.firing()}\n{self.said()}")

    def until_quiet(self, *alerts):
        until(lambda: not [name for name, _ in self.firing() if name in alerts], f"{alerts} end")

    def stop(self):
        self.process.terminate()
        self.process.wait(60)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()


def address(program):
    return f"127.0.0.1:{program.port}"


def scrapes_and_alerts(folder, baxter, lrt, kept_world, full_disk, mosquitto):
    switch = folder / "full"
    os.environ.update({"LD_PRELOAD": full_disk, "LRT_FULL_DISK": str(switch)})
    try:
        keeper = Program(kept_world, str(folder / "map.ttl"), "0")
    finally:
        del os.environ["LD_PRELOAD"], os.environ["LRT_FULL_DISK"]
    with keeper, Broker(mosquitto, folder) as broker, Store() as store, \
            Program(baxter, "--port", "0", "--demo", "--metrics", "--mqtt", f"127.0.0.1:{broker.port}") as robot, \
            Mirror(lrt, "mirror", robot.url, "--to", store.url, "--metrics", "0", "--rate", "0") as mirror:
        texts = [program.get("server/metrics").expect(200).body for program in (robot, keeper, mirror)]
        for text in texts:
            assert promtool("check", "metrics", text=text) == "", text
        rules_name_metrics_that_exist(folder, texts)
        print("promtool has nothing to say to the metrics of a robot with a bridge, of a World and of a mirror")

        with Receiver() as manager, \
                Prometheus(folder, {"cell7": address(robot), "cell8": address(keeper)}, address(mirror), f"127.0.0.1:{manager.server.server_port}") as prometheus:
            until(lambda: len(prometheus.ask("up == 1")) == 3, f"three targets are up\n{prometheus.said()}")
            # What the bridge, the mirror and the server count.
            until(lambda: prometheus.ask('lrt_mqtt_online{robot="cell7"} == 1'), "the bridge is online")
            for query in ('lrt_mqtt_published_total{robot="cell7"} > 0', 'lrt_mqtt_published_bytes_total > 0', 'lrt_mqtt_left_out_total >= 0', 'lrt_mqtt_lag_seconds >= 0', 'lrt_mirror_graphs > 10',
                          'lrt_mirror_sent_bytes_total > 0', 'lrt_start_time_seconds{robot="cell8"} > 0', 'lrt_poll_seconds_count{robot="cell7"} > 0'):
                until(lambda query=query: prometheus.ask(query), query)
            labels = until(lambda: prometheus.ask('lrt_mqtt_online{robot="cell7"}'), "the labels of a bridge")[0][0]
            assert labels["broker"] == f"mqtt://127.0.0.1:{broker.port}" and labels["prefix"] == "robots/baxter", labels
            until(lambda: [count for _, count in prometheus.ask("count by (version) (lrt_build_info)")] == [3], "three programs have one version")
            robot.get("sparql?query=ASK%7B%7D")
            until(lambda: prometheus.ask('lrt_queries_total{robot="cell7"} >= 1'), "a query is counted")
            until(lambda: not prometheus.firing(), f"no alert while all is well: {prometheus.firing()}")

            switch.touch()
            prometheus.until_firing("DiskFull", "cell8")
            switch.unlink()
            store.is_down = True
            prometheus.until_firing("MirrorLags")
            store.is_down = False
            broker.stop()
            prometheus.until_firing("BridgeOffline", "cell7")
            prometheus.until_quiet("DiskFull", "MirrorLags")
            with Broker(mosquitto, folder, broker.port):
                prometheus.until_quiet("BridgeOffline")
                os.kill(robot.process.pid, signal.SIGSTOP)  # it hangs: its port accepts, and nobody responds
                prometheus.until_firing("RobotDown", "cell7")
                os.kill(robot.process.pid, signal.SIGCONT)
                prometheus.until_quiet("RobotDown")
                robot.kill()
                prometheus.until_firing("RobotDown", "cell7")
                until(lambda: ("RobotDown", "cell8") not in prometheus.firing(), "the other robot responds")
                manager.wait(lambda requests: any("Robot cell7 does not respond" in one.text for one in requests), "Alertmanager is told")
            mirror.kill()
            prometheus.until_firing("MirrorDown")
    print("Prometheus scrapes a robot, its bridge, a World and a mirror; alerts: a full disk, a store and a broker that are gone, a robot that hangs, that is killed, a mirror that is killed")


def main():
    baxter, lrt, kept_world, full_disk, mosquitto = sys.argv[1:6]
    for program in ("prometheus", "promtool"):
        if not shutil.which(program):
            print(f"skipped: {program} is not installed; vendor/install.sh fleet")
            return 77
    if not mosquitto:
        print("skipped: mosquitto is not installed; vendor/install.sh mqtt")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        files_are_right(pathlib.Path(folder))
        page_shows_the_files()
        scrapes_and_alerts(pathlib.Path(folder), baxter, lrt, kept_world, full_disk, mosquitto)
    return 0


if __name__ == "__main__":
    sys.exit(main())
