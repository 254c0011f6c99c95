# SPDX-License-Identifier: Apache-2.0
"""Three arms and a conductor: the rules of examples/ex_conductor/rules.ttl move robots that no rule names, also one that joins later.

    conductor_test.py CONDUCTOR ARM RULES
"""
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from robot_process import until  # noqa: E402

conductor, arm, rules = sys.argv[1:4]


class Running:
    """A program that prints its URL in its first line."""

    def __init__(self, *command):
        self.file = tempfile.NamedTemporaryFile("w+")
        self.process = subprocess.Popen(command, stdout=self.file, stderr=subprocess.STDOUT)
        self.url = until(lambda: re.search(r"http://\S+(?=\n)", self.printed()), "its URL").group()

    def printed(self):
        with open(self.file.name) as text:
            return text.read()

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(20) == 0, self.process.returncode


def request(url, method="GET", body=None):
    data = None if body is None else json.dumps(body).encode()
    asked = urllib.request.Request(url, data, {"Accept": "application/json", "Content-Type": "application/json"}, method=method)
    with urllib.request.urlopen(asked, timeout=20) as response:
        text = response.read().decode()
        return response.headers.get("Location"), json.loads(text) if text else None


def position(robot, name):
    return request(robot.url + name + "/position")[1]


def move(robot, name, to):
    request(robot.url + name + "/actions/moveTo", "POST", to)


def main():
    left, right, third = (Running(arm, name) for name in ("left", "right", "third"))
    leader = Running(conductor, rules, "--port", "0")
    joined = {}
    for name, robot in (("left", left), ("right", right)):
        joined[name], _ = request(leader.url + "conductor/robots", "POST", {"url": robot.url})
        until(lambda robot=robot: f"{robot.url} has joined" in leader.printed(), "the robot joins")

    move(left, "left", 1.5)  # crosses 1.0
    until(lambda: abs(position(right, "right") - 0.5) < 1e-9, "the follower moves")
    assert position(third, "third") == 0, "the third robot has not joined yet"

    request(leader.url + "conductor/robots", "POST", {"url": third.url})
    until(lambda: f"{third.url} has joined" in leader.printed(), "the robot joins")
    fired = request(leader.url + "conductor/rulesFired")[1]
    assert fired == 1, f"expected one rule, found {fired}"
    move(third, "third", -1.5)  # crosses -1.0: the others rest
    until(lambda: abs(position(left, "left")) < 1e-9 and abs(position(right, "right")) < 1e-9, "the follower moves")
    move(right, "right", 1.2)
    until(lambda: abs(position(third, "third") - 0.5) < 1e-9 and abs(position(left, "left") - 0.5) < 1e-9, "the follower moves")

    request(joined["left"], "DELETE")  # leaves: it is not moved any more
    move(third, "third", -1.2)
    until(lambda: abs(position(right, "right")) < 1e-9, "the follower moves")
    assert position(left, "left") == 0.5, position(left, "left")

    # A robot that ends while it is a member, and one that never was.
    right.stop()
    request(leader.url + "conductor/robots", "POST", {"url": "http://127.0.0.1:1/"})
    until(lambda: "http://127.0.0.1:1/ cannot join" in leader.printed(), "the refusal is printed")
    for robot in (left, third, leader):
        robot.stop()

    with tempfile.NamedTemporaryFile("w", suffix=".ttl") as broken:
        broken.write("@prefix c: <http://example.org/conductor#> . <#r> a c:Rule ; c:when [ c:above 1 ] .")
        broken.flush()
        result = subprocess.run([conductor, broken.name], capture_output=True, text=True, timeout=20)
        assert result.returncode == 1 and "expected at least 1 value" in result.stderr, result.stderr
    print("the conductor moved two robots, then three, and one less after it had left")


main()
