# SPDX-License-Identifier: Apache-2.0
"""lrt-ros2 on the simulated mobile manipulator of examples/ros2_robot, as people and programs use it: by the command lrt, by curl, by a broker.

  robot_test.py LRT_ROS2 LRT ROS2_ROBOT SOURCE [MOSQUITTO]
"""
import json
import math
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

from robot_in_domain import PATIENCE, Domain, Process, until

PROGRAM, LRT, ROBOT, SOURCE = (os.path.abspath(word) for word in sys.argv[1:5])
MOSQUITTO = (sys.argv[5:] + [""])[0]
DOMAIN = Domain()
CONFIG = os.path.join(SOURCE, "examples", "ros2_robot", "robot.toml")
SHARE = os.path.join(SOURCE, "examples", "ros2_robot", "share")
PAN = "shoulder_pan_joint"
figures = {}


def robot(*words):
    process = Process([ROBOT, *words], DOMAIN.environment())
    process.wait_for(r"\d+ nodes in domain %d" % DOMAIN.number)
    return process


class Gateway(Process):
    """lrt-ros2, when it has settled."""

    def __init__(self, *words, port=0):
        super().__init__([PROGRAM, "--port", str(port), *words], DOMAIN.environment())
        self.port = int(self.wait_for(r"domain %d of ROS 2 is at https?://[\w.]+:(\d+)/" % DOMAIN.number).group(1))
        self.url = "http://127.0.0.1:%d" % self.port

    def settled(self):
        self.wait_for(r"\d+ nodes?: \d+ Things?|nobody is in domain")
        return self

    def get(self, path, accept="application/json", **fields):
        """Status and body. JSON is parsed."""
        request = urllib.request.Request(self.url + path, headers={"Accept": accept, **fields})
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE) as response:
                status, kind, body = response.status, response.headers["Content-Type"], response.read()
        except urllib.error.HTTPError as error:
            status, kind, body = error.code, error.headers["Content-Type"] or "", error.read()
        return status, json.loads(body) if kind.startswith("application/") and "json" in kind else body

    def value(self, path):
        status, value = self.get(path)
        assert status == 200, (path, status, value)
        return value

    def lrt(self, *words, status=0):
        done = subprocess.run([LRT, "--robot", self.url + "/", *words], env=DOMAIN.environment(), capture_output=True, text=True, timeout=PATIENCE)
        assert status is None or done.returncode == status, (words, done)
        return done


def listed(*words, status=0, nothing=False):
    """The rows of --list: kind and name in ROS -> type, what it is, path, reason."""
    done = subprocess.run([PROGRAM, "--list", *words], env=DOMAIN.environment(), capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == status, done
    rows = [line.split("\t") for line in done.stdout.splitlines()]
    assert nothing == (not rows) and all(len(row) == 6 for row in rows), done.stdout
    return {(row[0], row[1]): dict(zip(("type", "is", "path", "reason"), row[2:])) for row in rows}


def joint(gateway, name=PAN):
    """The path of the Thing of a joint."""
    return until(lambda: next((path for path in gateway_things(gateway) if path.endswith("/" + name)), None), "a Thing for the joint " + name)


def gateway_things(gateway):
    status, body = gateway.get("/all", "application/n-triples")
    assert status == 200, body
    marker = b"<http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <"
    return sorted({line.split(b">")[0][1:].decode()[len(gateway.url):] for line in body.splitlines() if marker in line and b"RoboticThing" in line})


def first_value():
    """From the start of the program to the first value, without any option but the port; measured, not judged."""
    began = time.monotonic()
    with Gateway() as gateway:
        until(lambda: gateway.get("/odom/value")[0] == 200, "the first value")
        figures["first value"] = "%.2f s" % (time.monotonic() - began)
        gateway.settled()
        figures["all settled"] = "%.2f s" % (time.monotonic() - began)
        return gateway_things(gateway)


def what_is_there():
    rows = listed()
    for kind, name, type_ in (("topic", "/joint_states", "sensor_msgs/msg/JointState"), ("topic", "/camera/image_raw", "sensor_msgs/msg/Image"),
                              ("topic", "/map", "nav_msgs/msg/OccupancyGrid"), ("topic", "/cmd_vel", "geometry_msgs/msg/Twist"),
                              ("service", "/gripper/move", "ros2_robot/srv/MoveGripper"),
                              ("action", "/arm_controller/follow_joint_trajectory", "control_msgs/action/FollowJointTrajectory")):
        assert rows[kind, name]["type"] == type_, rows[kind, name]
    assert ("node", "/arm_controller") in rows
    # Read-only by default: what is not allowed says so.
    assert "--allow-actions /arm_controller/follow_joint_trajectory" in rows["action", "/arm_controller/follow_joint_trajectory"]["reason"], rows
    assert not any("get_parameters" in name for _, name in rows), rows  # of which the bridge makes parameters
    rows = listed("--config", CONFIG)
    for kind, name in (("topic", "/cmd_vel"), ("service", "/gripper/move"), ("action", "/arm_controller/follow_joint_trajectory")):
        assert rows[kind, name]["path"].startswith("/"), rows[kind, name]
    assert rows["topic", "/cmd_vel"]["is"] == "writable Property"
    return rows


def reads(gateway):
    """Values with units, limits, frames and times."""
    path = joint(gateway)
    status, state = gateway.get(path + "/state")
    assert status == 200 and abs(state["position"]) < 3, state
    text = gateway.lrt("get", PAN + "/position").stdout
    assert math.isfinite(float(text.split()[0])), text
    text = gateway.lrt("ls", PAN).stdout
    assert "position" in text and "velocity" in text and "rad" in text, text
    limits = gateway.value(path + "/limits")
    assert (limits["lower"], limits["upper"]) == (-2.9, 2.9), limits  # of the URDF
    scan = gateway.value("/scan/value")
    assert len(scan["ranges"]) == 360, scan
    status, png = gateway.get("/camera/image_raw/image", "image/png")
    assert status == 200 and png[:8] == b"\x89PNG\r\n\x1a\n", (status, png[:100])
    status, png = gateway.get("/map/image", "image/png")
    assert status == 200 and png[:8] == b"\x89PNG\r\n\x1a\n", (status, png[:100])
    battery = gateway.value("/battery_state/value")
    assert battery["power_supply_status"] in ("DISCHARGING", "POWER_SUPPLY_STATUS_DISCHARGING"), battery
    diagnostics = gateway.value("/diagnostics/value")
    assert diagnostics["status"][0]["level"] == "OK", diagnostics


def describes(gateway):
    """Each Blueprint is there, whether or not values are."""
    _, everything = gateway.get("/all", "application/n-triples")
    blueprints = set(re.findall(r"<%s(/blueprints/[^>/]+)>" % re.escape(gateway.url), everything.decode()))
    assert len(blueprints) > 20, blueprints
    for path in sorted(blueprints):
        status, why = gateway.get(path, "text/turtle")
        assert status == 200, (path, status, why)


def refuses_all(gateway):
    """Without options nothing can be changed."""
    for path in ("/cmd_vel/value", "/odom/value"):
        request = urllib.request.Request(gateway.url + path, data=b"{}", method="PUT", headers={"Content-Type": "application/json"})
        try:
            urllib.request.urlopen(request, timeout=PATIENCE)
            raise AssertionError(path)
        except urllib.error.HTTPError as error:
            assert error.code in (404, 405, 503), (path, error.code)


def twist(linear, angular=0.0):
    return json.dumps({"linear": {"x": linear, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": angular}})


def drives(gateway):
    """A command has a life: the base moves, and stops by itself."""
    before = gateway.value("/odom/value")["pose"]["pose"]["position"]["x"]
    gateway.lrt("set", gateway.url + "/cmd_vel/value", twist(0.3))
    until(lambda: gateway.value("/odom/value")["pose"]["pose"]["position"]["x"] > before + 0.01, "the base moves")
    until(lambda: gateway.value("/odom/value")["twist"]["twist"]["linear"]["x"] == 0, "the base stops")
    until(lambda: gateway.value("/cmd_vel/value")["linear"]["x"] == 0, "zero is written")
    refused = gateway.lrt("set", gateway.url + "/cmd_vel/value", twist(5), status=1)
    assert "0.8" in refused.stderr, refused


def trajectory(position, seconds):
    return json.dumps({"trajectory": {"joint_names": [PAN], "points": [{"positions": [position], "time_from_start": "PT%sS" % seconds}]}})


def moves_the_arm(gateway, action):
    """A goal with progress, its result, one that is rejected, one that is cancelled."""
    path = joint(gateway)
    done = gateway.lrt("invoke", gateway.url + action, trajectory(0.5, 1))
    assert "SUCCESSFUL" in done.stdout or "0" in done.stdout, done
    assert abs(gateway.value(path + "/position") - 0.5) < 1e-6
    refused = gateway.lrt("invoke", gateway.url + action, trajectory(7, 1), status=1)
    assert refused.stderr, refused
    url = gateway.lrt("invoke", "--async", gateway.url + action, trajectory(-2.5, 60)).stdout.strip()
    invocation = url[len(gateway.url):]
    progress = until(lambda: gateway.value(invocation).get("progress") or None, "progress")
    assert 0 < progress < 1, progress
    until(lambda: gateway.value("/arm_controller/follow_joint_trajectory/feedback")["desired"]["positions"], "feedback")
    gateway.lrt("invoke", "--cancel", url)
    until(lambda: "cancel" in json.dumps(gateway.value(invocation)["status"]).lower(), "the invocation is cancelled")
    stopped = until(lambda: gateway.value(path + "/position"), "the position")
    assert stopped > -2.4, stopped
    # Ctrl-C cancels the goal, too.
    with Process([LRT, "--robot", gateway.url + "/", "invoke", gateway.url + action, trajectory(2.5, 60)], DOMAIN.environment()) as invoking:
        until(lambda: gateway.value(path + "/position") > stopped + 0.01, "the arm moves")
        assert invoking.end(signal.SIGINT) == 130, (invoking.lines, invoking.errors)
    until(lambda: gateway.value(path + "/velocity") == 0, "the arm stops")


def calls_services(gateway, move, calibrate):
    done = gateway.lrt("invoke", gateway.url + move, '{"width": 0.02, "max_force": 10}')
    assert json.loads(done.stdout)["reached"] is True, done
    refused = gateway.lrt("invoke", gateway.url + move, '{"width": 2, "max_force": 10}', status=1)
    assert "0.16" in refused.stderr, refused
    done = gateway.lrt("invoke", gateway.url + calibrate)
    assert "calibrated" in done.stdout, done


def sets_parameters(gateway, rows, simulated):
    path = rows["parameter", "/base:max_linear_velocity"]["path"]
    assert gateway.value(path) == 0.8
    gateway.lrt("set", gateway.url + path, "0.5")
    until(lambda: gateway.value(path) == 0.5, "the parameter is set")
    refused = gateway.lrt("set", gateway.url + path, "3", status=1)
    assert "1.2" in refused.stderr, refused  # the range of the descriptor
    text = rows["parameter", "/base:operator"]["path"]
    gateway.lrt("set", gateway.url + text, "anna")
    until(lambda: gateway.value(text) == "anna", "the text is set")
    gateway.lrt("set", gateway.url + rows["parameter", "/base:model"]["path"], "other", status=1)  # read-only
    # A node that is busy for a while takes the value afterwards.
    simulated.send_signal(signal.SIGSTOP)
    try:
        setting = subprocess.Popen([LRT, "--robot", gateway.url + "/", "set", gateway.url + path, "0.25"], env=DOMAIN.environment(),
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        time.sleep(1.5)  # longer than a loop would wait, shorter than a thread does
    finally:
        simulated.send_signal(signal.SIGCONT)
    said = setting.communicate(timeout=PATIENCE)[0]
    assert setting.returncode == 0, said
    until(lambda: gateway.value(path) == 0.25, "the busy node has the value")


def changes_states(gateway):
    """The lidar is a managed node: what it publishes ends with its state, and begins again."""
    node = gateway.url + "/nodes/lidar"
    assert gateway.value("/nodes/lidar/lifecycle") == "active"
    gateway.lrt("invoke", node + "/actions/deactivate")
    until(lambda: gateway.value("/nodes/lidar/lifecycle") == "inactive", "the lidar is inactive")
    until(lambda: gateway.value("/diagnostics/value")["status"][1]["level"] == "STALE", "the diagnostics say so")
    gateway.lrt("invoke", node + "/actions/deactivate", status=1)  # which is not possible now
    gateway.lrt("invoke", node + "/actions/activate")
    until(lambda: gateway.value("/nodes/lidar/lifecycle") == "active", "the lidar is active")


def two_robots():
    """Two robots of one kind in one domain have namespaces, and one of them may be all that is wanted. Another domain is another world."""
    other = Domain()
    with robot("--namespace", "/r1"), robot("--namespace", "/r2", "--only", "base"):
        names = {name for _, name in listed()}
        assert {"/r1/odom", "/r2/odom", "/r1/base", "/r2/base"} <= names, names
        names = {name for _, name in listed("--namespace", "/r2")}
        assert "/r2/odom" in names and not any(name.startswith("/r1/") for name in names), names
        with Gateway("--path", "fleet") as gateway:
            gateway.settled()
            until(lambda: gateway.get("/fleet/r1/odom/value")[0] == gateway.get("/fleet/r2/odom/value")[0] == 200, "both robots")
        listed("--domain", str(other.number), status=1, nothing=True)


def comes_and_goes(gateway):
    """A node that ends and returns; its URI is the same."""
    with robot("--only", "lidar") as lidar:
        until(lambda: gateway.get("/scan/value")[0] == 200, "the scan")
        lidar.process.kill()
        lidar.process.wait()
        status, why = until(lambda: (lambda got: got if got[0] == 503 else None)(gateway.get("/scan/value")), "the scan is unavailable")
        assert "lidar" in json.dumps(why), why
        assert gateway.get("/odom/value")[0] == 200
    with robot("--only", "lidar"):
        until(lambda: gateway.get("/scan/value")[0] == 200, "the scan is back")


def judged(gateway):
    done = gateway.lrt("check", gateway.url + "/", "--strict", "--no-subscriptions", status=None)
    assert done.returncode == 0, done.stdout + done.stderr


def humble():
    """Without descriptions of nodes, types of the user's own come from a folder."""
    with robot("--humble"):
        rows = listed("--config", CONFIG)
        assert rows["service", "/gripper/move"]["path"] == "" and "ros2_robot/srv/MoveGripper" in rows["service", "/gripper/move"]["reason"], rows
        rows = listed("--config", CONFIG, "--definitions", SHARE)
        assert rows["service", "/gripper/move"]["path"], rows["service", "/gripper/move"]


def rights(folder):
    tokens = os.path.join(folder, "tokens.txt")
    with open(tokens, "w", encoding="utf-8") as file:
        file.write("anna operator ThisIsTheTokenOfAnna\nrita reader ThisIsTheTokenOfRita\n")
    audit = os.path.join(folder, "audit.jsonl")
    with Gateway("--config", CONFIG, "--tokens", tokens, "--audit", audit) as gateway:
        gateway.settled()
        until(lambda: gateway.get("/odom/value", Authorization="Bearer ThisIsTheTokenOfRita")[0] == 200, "a reader reads")
        assert gateway.get("/odom/value")[0] == 401
        token = os.path.join(folder, "token")
        for who, status in (("Rita", 1), ("Anna", 0)):
            with open(token, "w", encoding="utf-8") as file:
                file.write("ThisIsTheTokenOf%s\n" % who)
            gateway.lrt("--token-file", token, "set", gateway.url + "/cmd_vel/value", twist(0), status=status)
        assert gateway.end() == 0
    with open(audit, encoding="utf-8") as file:
        lines = [json.loads(line) for line in file]
    assert any(line.get("principal") == "anna" and line.get("resource") == "/cmd_vel/value" and line.get("status") in (200, 204) for line in lines), lines


def encrypted(folder):
    """HTTPS; SIGHUP reads the certificate again and does not end the program."""
    missing = [tool for tool in ("curl", "openssl") if shutil.which(tool) is None]
    if missing:
        print("skipped: TLS: %s is not installed" % ", ".join(missing))
        return
    keys = os.path.join(folder, "keys")
    subprocess.run([os.path.join(SOURCE, "examples", "make-certificate.sh"), keys], check=True, capture_output=True, timeout=PATIENCE)
    with Gateway("--tls", keys) as gateway:
        def get():
            return subprocess.run(["curl", "-s", "--cacert", os.path.join(keys, "ca.pem"), "https://localhost:%d/odom/value" % gateway.port],
                                  capture_output=True, text=True, timeout=PATIENCE).stdout
        until(lambda: "Odometry" in get(), "the odometry over TLS")
        gateway.process.send_signal(signal.SIGHUP)
        os.remove(os.path.join(keys, "server.pem"))
        gateway.process.send_signal(signal.SIGHUP)
        gateway.wait_for("the old certificate stays")
        assert "Odometry" in get()
        assert gateway.end() == 0


def broker(folder):
    if not MOSQUITTO or not shutil.which("mosquitto_sub"):
        print("skipped: there is no mosquitto or no mosquitto_sub (vendor/install.sh mqtt)")
        return
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    path = os.path.join(folder, "mosquitto.conf")
    with open(path, "w", encoding="utf-8") as file:
        file.write("listener %d 127.0.0.1\nallow_anonymous true\n" % port + ("user root\n" if os.geteuid() == 0 else ""))
    with Process([MOSQUITTO, "-c", path], DOMAIN.environment()) as mosquitto:
        mosquitto.wait_for("running|Opening ipv4 listen socket")
        identity = os.path.join(folder, "identity.json")
        with open(identity, "w", encoding="utf-8") as file:
            json.dump({"iri": "https://robots.example/picker", "model": "Simulated"}, file)
        with Gateway("--mqtt", "127.0.0.1:%d" % port, "--identity", identity) as gateway:
            assert gateway.get("/")[1]["identity"]["iri"] == "https://robots.example/picker"
            watch = ["mosquitto_sub", "-V", "5", "-p", str(port), "-t", "robots/picker/odom/value", "-C", "1", "-W", str(PATIENCE)]
            # The first may be null: no sample has come yet.
            until(lambda: "position" in subprocess.run(watch, capture_output=True, text=True, check=False).stdout, "the odometry at the broker")
            assert gateway.end() == 0


def follows_the_page(gateway):
    """The commands of docs/ros2.md, with the outputs that it shows."""
    tools = [tool for tool in ("curl", "jq") if shutil.which(tool) is None]
    if tools:
        print("skipped: docs/ros2.md: %s is not installed" % ", ".join(tools))
        return
    with open(os.path.join(SOURCE, "docs", "ros2.md"), encoding="utf-8") as file:
        blocks = re.findall(r"^```console\n(.*?)^```$", file.read(), re.M | re.S)
    steps = []
    for line in "".join(blocks).replace("http://127.0.0.1:8080", gateway.url).splitlines():
        if line.startswith("$ "):
            steps.append([line[2:], []])
        elif line.startswith("> "):
            steps[-1][0] += "\n" + line[2:]
        else:
            steps[-1][1].append(line)
    assert len(steps) >= 10, steps
    script = "".join("%s\necho '=== %d ==='\n" % (command, number) for number, (command, _) in enumerate(steps))
    path = os.path.dirname(LRT) + os.pathsep + os.environ["PATH"]
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(["bash", "-c", "exec 2>&1\n" + script], env=DOMAIN.environment(PATH=path), cwd=folder, capture_output=True, text=True,
                              timeout=PATIENCE)
    output = done.stdout
    for number, (command, expected) in enumerate(steps):
        found, _, output = output.partition("=== %d ===\n" % number)
        assert found.splitlines() == expected, (command, expected, found)


def main():
    with tempfile.TemporaryDirectory() as folder:
        with robot() as simulated:
            things = first_value()
            rows = what_is_there()
            with Gateway() as gateway:
                gateway.settled()
                reads(gateway)
                describes(gateway)
                refuses_all(gateway)
                assert gateway_things(gateway) == things, "the URIs differ after a restart"
                judged(gateway)
                assert gateway.end(signal.SIGINT) == 0
            with Gateway("--config", CONFIG, "--metrics") as gateway:
                gateway.settled()
                follows_the_page(gateway)
                drives(gateway)
                moves_the_arm(gateway, rows["action", "/arm_controller/follow_joint_trajectory"]["path"])
                calls_services(gateway, rows["service", "/gripper/move"]["path"], rows["service", "/gripper/calibrate"]["path"])
                sets_parameters(gateway, rows, simulated.process)
                changes_states(gateway)
                assert gateway.get("/server/metrics", "text/plain")[0] == 200
                assert gateway.end() == 0
            rights(folder)
            encrypted(folder)
            broker(folder)
        with robot("--only", "base,arm_controller,robot_state_publisher"), Gateway() as gateway:
            gateway.settled()
            comes_and_goes(gateway)
        two_robots()
        humble()
    print("ok: " + ", ".join("%s %s" % pair for pair in figures.items()))


main()
