# SPDX-License-Identifier: Apache-2.0
"""The examples on an MQTT broker: baxter --mqtt and ex_fleet, seen by mosquitto_sub.

  examples_test.py MOSQUITTO EX_FLEET [BAXTER]

Exit status 77: skipped, with a reason.
"""
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time

DEADLINE = 60


def skip(reason):
    print("skipped: " + reason)
    sys.exit(77)


def wait_until(condition, what):
    end = time.monotonic() + DEADLINE
    while time.monotonic() < end:
        if (found := condition()) is not None:
            return found
        time.sleep(0.02)
    raise AssertionError("not in %d s: %s" % (DEADLINE, what))


class Broker:
    """A Mosquitto on a loopback port that was free just now."""

    def __init__(self, program, folder):
        for _ in range(20):
            with socket.socket() as s:
                s.bind(("127.0.0.1", 0))
                self.port = s.getsockname()[1]
            path = os.path.join(folder, "mosquitto.conf")
            with open(path, "w", encoding="utf-8") as file:
                file.write("listener %d 127.0.0.1\nallow_anonymous true\n" % self.port + ("user root\n" if os.geteuid() == 0 else ""))
            self.process = subprocess.Popen([program, "-c", path], stderr=subprocess.DEVNULL)
            if self.accepts():
                return
        raise AssertionError("mosquitto does not start")

    def accepts(self):
        end = time.monotonic() + DEADLINE
        while time.monotonic() < end and self.process.poll() is None:
            try:
                socket.create_connection(("127.0.0.1", self.port), 1).close()
                return True
            except OSError:
                time.sleep(0.01)
        return False


def watch(port, topic, count):
    """`count` messages of a filter: topic, content type and payload of each."""
    said = subprocess.run(["mosquitto_sub", "-V", "5", "-p", str(port), "-t", topic, "-C", str(count), "-W", str(DEADLINE), "-F", "%t\t%C\t%p"],
                          capture_output=True, text=True, check=False)
    lines = [line.split("\t", 2) for line in said.stdout.splitlines() if line.count("\t") >= 2]
    assert len(lines) >= count, "%s: expected %d messages, found %r %s" % (topic, count, said.stdout, said.stderr)
    return lines


def main():
    broker_program, fleet, baxter = (sys.argv[1:] + [""])[:3]
    if not broker_program or not shutil.which("mosquitto_sub"):
        skip("there is no mosquitto or no mosquitto_sub (vendor/install.sh mqtt)")
    processes = []
    with tempfile.TemporaryDirectory() as folder:
        broker = Broker(broker_program, folder)
        processes.append(broker.process)
        try:
            processes.append(subprocess.Popen([fleet, "--mqtt", "localhost:%d" % broker.port, "--robots", "3", "--rate", "20"], stdout=subprocess.DEVNULL))
            robots = {topic.split("/")[1] for topic, _, _ in watch(broker.port, "robots/+/base/x", 60)}
            assert robots == {"r0", "r1", "r2"}, robots
            for topic, content_type, payload in watch(broker.port, "robots/+/ns/status", 3):
                assert content_type == "application/json" and json.loads(payload)["online"] is True, (topic, payload)
                assert json.loads(payload)["identity"]["iri"] == "urn:lrt:" + topic.split("/")[1], (topic, payload)

            if baxter:
                file = os.path.join(folder, "identity.json")
                with open(file, "w", encoding="utf-8") as identity:
                    json.dump({"iri": "https://robots.example/b1", "serialNumber": "A-1"}, identity)
                robot = subprocess.Popen([baxter, "--port", "0", "--demo", "--identity", file, "--mqtt", "127.0.0.1:%d" % broker.port, "--mqtt-prefix",
                                          "cell/b1"],
                                         stdout=subprocess.PIPE, text=True)
                processes.append(robot)
                url = re.search(r"http://\S+", robot.stdout.readline()).group(0)
                positions = watch(broker.port, "cell/b1/baxter/+/position", 60)
                assert positions[0][1] == "application/json" and isinstance(json.loads(positions[0][2]), (float, int)), positions
                # One form of each value.
                topics = {topic.rsplit("/", 1)[1] for topic, _, _ in watch(broker.port, "cell/b1/baxter/#", 300)}
                assert "position" in topics and not topics & {"rotation", "positions", "state"}, topics
                wait_until(lambda: "RoboticThing" in subprocess.run(
                    ["mosquitto_sub", "-V", "5", "-p", str(broker.port), "-t", "cell/b1/ns/description", "-C", "1", "-W", "10"],
                    capture_output=True, text=True, check=False).stdout or None, "a description")
                # A Linked Data client finds the broker by itself.
                topic = positions[0][0]
                position = url.rstrip("/") + topic[len("cell/b1"):]
                text = subprocess.run(["curl", "-sS", "-H", "Accept: application/n-triples", position], capture_output=True, text=True, check=True).stdout
                assert 'mqttTopic> "%s"' % topic in text and "mqtt://127.0.0.1:%d" % broker.port in text, text
                online = json.loads(watch(broker.port, "cell/b1/ns/status", 1)[0][2])
                assert online["identity"] == {"iri": "https://robots.example/b1", "serialNumber": "A-1"}, online
                root = subprocess.run(["curl", "-sS", "-H", "Accept: application/json", url], capture_output=True, text=True, check=True).stdout
                assert json.loads(root)["identity"] == online["identity"], root
                robot.terminate()
                robot.wait(DEADLINE)
                status = wait_until(lambda: next((p for _, _, p in watch(broker.port, "cell/b1/ns/status", 1) if not json.loads(p)["online"]), None), "the Last Will")
                assert json.loads(status)["online"] is False
        finally:
            for process in processes:
                process.kill()
                process.wait()
    print("ok")


if __name__ == "__main__":
    main()
