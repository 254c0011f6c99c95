# SPDX-License-Identifier: Apache-2.0
"""examples/mosquitto with four principals: what each may read and write is what the table of docs/mqtt.md says.

  acl_test.py MOSQUITTO SOURCE [EX_FLEET]

Each cell is tried by a client of its own over TLS: what it writes is seen, or not, by a principal that may read all, and what that principal writes is
seen, or not, by a client that subscribes to everything. Nothing waits for something that does not come: a message that must come follows it.
Exit status 77: skipped, with a reason.
"""
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

DEADLINE = 60
PASSWORDS = {"anna": "a-secret", "dana": "d-secret", "writer": "w-secret", "observer": "o-secret"}
ROBOTS = ("r7", "r8")
# What no row of the table may be, because a client that subscribes to everything uses it to know that nothing else comes.
MARKERS = {"r7": "robots/r7/ns/put/marker", "r8": "robots/r8/ns/put/marker", "anna": "replies/anna/r7/marker", "dana": "robots/r7/marker"}


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


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Broker:
    """The files of examples/mosquitto, with the paths and ports of this test, and two principals that may do everything."""

    def __init__(self, program, source, folder):
        self.program, self.folder = program, folder
        examples = source / "examples"
        subprocess.run([examples / "make-certificate.sh", folder], check=True, stdout=subprocess.DEVNULL)
        for robot in ROBOTS:
            subprocess.run([examples / "make-robot-certificate.sh", folder, robot], check=True)
        subprocess.run([examples / "make-robot-certificate.sh", folder, "r9", "urn:lrt:r9", "0"], check=True)  # it has expired
        passwords = folder / "passwords"
        passwords.write_text("".join("%s:%s\n" % pair for pair in PASSWORDS.items()), encoding="utf-8")
        os.chmod(passwords, 0o600)
        subprocess.run(["mosquitto_passwd", "-U", passwords], check=True, capture_output=True)
        rules = (examples / "mosquitto" / "fleet.acl").read_text(encoding="utf-8")
        (folder / "fleet.acl").write_text(rules + "\nuser writer\ntopic readwrite #\n\nuser observer\ntopic readwrite #\n", encoding="utf-8")
        text = (examples / "mosquitto" / "mosquitto.conf").read_text(encoding="utf-8")
        for _ in range(20):
            self.robots, self.people = free_port(), free_port()
            own = text.replace("/etc/mosquitto/fleet", str(folder)).replace("listener 8883", "listener %d 127.0.0.1" % self.robots)
            own = own.replace("listener 8884", "listener %d 127.0.0.1" % self.people)
            assert own.count("127.0.0.1") == 2, "mosquitto.conf no longer has the listeners 8883 and 8884"
            if os.geteuid() == 0:
                own = "user root\n" + own
            (folder / "mosquitto.conf").write_text(own + "log_dest file %s\nlog_type all\n" % (folder / "log"), encoding="utf-8")
            self.process = subprocess.Popen([program, "-c", folder / "mosquitto.conf"], stderr=subprocess.DEVNULL)
            if self.accepts():
                return
        raise AssertionError("mosquitto does not start: " + self.log())

    def log(self):
        path = self.folder / "log"
        return path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""

    def accepts(self):
        end = time.monotonic() + DEADLINE
        while time.monotonic() < end and self.process.poll() is None:
            try:
                for port in (self.robots, self.people):
                    socket.create_connection(("127.0.0.1", port), 1).close()
                return True
            except OSError:
                time.sleep(0.01)
        return False

    def client(self, principal):
        """The arguments with which a principal connects."""
        common = ["-V", "5", "-h", "localhost", "--cafile", str(self.folder / "ca.pem")]
        if principal in PASSWORDS:
            return common + ["-p", str(self.people), "-u", principal, "-P", PASSWORDS[principal]]
        return common + ["-p", str(self.robots), "--cert", str(self.folder / (principal + ".pem")), "--key", str(self.folder / (principal + "-key.pem"))]


class Reader:
    """A principal that subscribes to topics and prints what comes."""

    def __init__(self, broker, principal, topics, more=()):
        command = ["stdbuf", "-oL", "mosquitto_sub", *broker.client(principal), "-q", "1", "-v", "-d", *more]
        for topic in topics:
            command += ["-t", topic]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1)
        self.lines = []
        try:
            self.until(lambda line: line.startswith("Subscribed"))
        except BaseException:
            self.__exit__()
            raise

    def until(self, fits):
        """Lines up to the first that fits."""
        start = len(self.lines)
        timer = threading.Timer(DEADLINE, self.process.kill)
        timer.start()
        try:
            for line in self.process.stdout:
                self.lines.append(line.rstrip("\n"))
                if fits(self.lines[-1]):
                    return self.lines[start:]
        finally:
            timer.cancel()
        raise AssertionError("the reader has ended, or the message has not come in %d s: %r" % (DEADLINE, self.lines[-20:]))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


def publish(broker, principal, topic, payload, more=()):
    """The text of mosquitto_pub; empty: the broker has accepted the message."""
    said = subprocess.run(["mosquitto_pub", *broker.client(principal), "-q", "1", "-t", topic, "-m", payload, *more], capture_output=True, text=True,
                          timeout=DEADLINE, check=False)
    return (said.stdout + said.stderr).strip()


def table(source):
    """The table: of each topic what each principal may do."""
    text = (source / "docs" / "mqtt.md").read_text(encoding="utf-8")
    section = text[text.index("### Who may do what"):]
    lines = [line for line in section.split("\n## ")[0].splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    principals = [re.search("`([^`]+)`", cell).group(1) for cell in cells[0][1:]]
    rows = {}
    for row in cells[2:]:
        topic = row[0].strip("`")
        assert topic not in MARKERS.values() and len(row) == 5, row
        rows[topic] = dict(zip(principals, row[1:]))
    assert set(principals) == set(MARKERS) and len(rows) >= 15, rows
    for row in rows.values():
        assert all(cell in ("read", "write", "read, write", "") for cell in row.values()), row
    return principals, rows


def check_reading(broker, principals, rows):
    for principal in principals:
        with Reader(broker, principal, ["#", MARKERS[principal], *rows]) as reader:
            for number, topic in enumerate(rows):
                said = publish(broker, "writer", topic, "reading-%d" % number)
                assert not said or topic.startswith("$"), said  # the broker itself writes those
            publish(broker, "writer", MARKERS[principal], "end")
            seen = "\n".join(reader.until(lambda line: line == MARKERS[principal] + " end"))
        for number, topic in enumerate(rows):
            expected = "read" in rows[topic][principal]
            text = topic + " " if topic.startswith("$") else "%s reading-%d\n" % (topic, number)
            found = text in seen + "\n"
            assert found == expected, "%s %s read %s" % (principal, "does not" if expected else "can", topic)


def check_writing(broker, principals, rows):
    with Reader(broker, "observer", ["#"]) as observer:
        for principal in principals:
            answers = {}
            for number, topic in enumerate(rows):
                answers[topic] = publish(broker, principal, topic, "writing-%d" % number)
            publish(broker, "writer", "end", principal)
            seen = "\n".join(observer.until(lambda line, end="end " + principal: line == end)) + "\n"
            for number, topic in enumerate(rows):
                expected = "write" in rows[topic][principal]
                found = "%s writing-%d\n" % (topic, number) in seen
                assert found == expected, "%s %s write %s" % (principal, "does not" if expected else "can", topic)
                assert expected or "uthor" in answers[topic], "%s is not told that it may not write %s: %r" % (principal, topic, answers[topic])


def check_client_ids(broker):
    """A client id that another client has asked for is not taken from its owner; the same credentials do end the connection."""
    with Reader(broker, "r7", ["robots/r7/ns/put/#"], ["-i", "r7"]) as robot:
        for thief in ("anna", "r8"):
            said = publish(broker, thief, "replies/anna/r8/1" if thief == "r8" else "robots/r7/ns/put/a", "of " + thief, ["-i", "r7"])
            assert not said, said
        publish(broker, "writer", MARKERS["r7"], "end", ["-i", "r7"])
        robot.until(lambda line: line == MARKERS["r7"] + " end")
        assert robot.process.poll() is None
    # The Last Will of a connection with another's client id says nothing in the other's name.
    with Reader(broker, "dana", ["robots/+/ns/status"]) as dashboard:
        thief = subprocess.Popen(["stdbuf", "-oL", "mosquitto_sub", *broker.client("r8"), "-i", "r7", "-t", "robots/r8/ns/put/#", "--will-topic", "robots/r7/ns/status",
                                  "--will-payload", "forged", "--will-retain", "-d"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        try:
            for line in thief.stdout:
                if line.startswith("Subscribed") or "efused" in line or "uthor" in line:
                    break
            thief.kill()
            thief.wait()
            # The broker has seen the end of the connection when it lets the same user connect and write.
            assert not publish(broker, "r8", "robots/r8/ns/status", "own")
            publish(broker, "writer", "robots/r7/ns/status", "end")
            seen = dashboard.until(lambda line: line == "robots/r7/ns/status end")
            assert not any("forged" in line for line in seen), seen
        finally:
            thief.kill()
            thief.wait()
            thief.stdout.close()


def check_refused_connections(broker):
    """Who has no credentials, those of another listener, or a certificate that has expired, has no connection."""
    ca = ["-V", "5", "-h", "localhost", "--cafile", str(broker.folder / "ca.pem"), "-p"]
    nobody = {
        "no certificate": [*ca, str(broker.robots)],
        "a password instead of a certificate": [*ca, str(broker.robots), "-u", "anna", "-P", PASSWORDS["anna"]],
        "no password": [*ca, str(broker.people)],
        "a wrong password": [*ca, str(broker.people), "-u", "anna", "-P", "guess"],
        "the certificate of a robot instead of a password": [*ca, str(broker.people), "--cert", str(broker.folder / "r7.pem"), "--key",
                                                             str(broker.folder / "r7-key.pem"), "-u", "r7"],
        "an expired certificate": broker.client("r9"),
        "no TLS": ["-V", "5", "-h", "localhost", "-p", str(broker.people), "-u", "anna", "-P", PASSWORDS["anna"]],
    }
    for who, arguments in nobody.items():
        said = subprocess.run(["mosquitto_pub", *arguments, "-q", "1", "-t", "robots/r9/a", "-m", "1"], capture_output=True, text=True, timeout=DEADLINE,
                              check=False)
        assert said.returncode != 0, "the broker accepts a client with " + who


def check_reload(broker, rows):
    """After SIGHUP a user that was added may connect, and the rules are those of the file."""
    subprocess.run(["mosquitto_passwd", "-b", broker.folder / "passwords", "emil", "e-secret"], check=True, capture_output=True)
    PASSWORDS["emil"] = "e-secret"
    with open(broker.folder / "fleet.acl", "a", encoding="utf-8") as file:
        file.write("\nuser emil\ntopic write robots/+/ns/put/#\n")
    broker.process.send_signal(signal.SIGHUP)
    topic = next(topic for topic in rows if "/ns/put/" in topic)
    wait_until(lambda: True if not publish(broker, "emil", topic, "new") else None, "the new user may write a command")


def check_robots(broker, fleet):
    """Robots of ours: a command and its response pass through these rules, and each robot is where it may be."""
    command = [fleet, "--mqtt", "localhost:%d" % broker.robots, "--mqtt-ca", str(broker.folder / "ca.pem"), "--mqtt-certificate",
               str(broker.folder / "r{}.pem"), "--mqtt-key", str(broker.folder / "r{}-key.pem"), "--robots", "2", "--first-number", "7", "--commands"]
    robots = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        with Reader(broker, "dana", ["robots/#"]) as dashboard:
            for robot in ROBOTS:
                dashboard.until(lambda line, topic="robots/%s/base/x " % robot: line.startswith(topic))
        for robot in ROBOTS:
            said = subprocess.run(["mosquitto_rr", *broker.client("anna"), "-q", "1", "-t", "robots/%s/ns/post/base/actions/stop" % robot, "-n", "-e",
                                   "replies/anna/%s/1" % robot, "-W", str(DEADLINE), "-F", "%J"], capture_output=True, text=True, check=False)
            assert re.search(r'"status"\W+(?:"value"\W+)?2\d\d', said.stdout) and robot in said.stdout, said
        assert robots.poll() is None
    finally:
        robots.kill()
        robots.wait()


def main():
    program, source, fleet = (sys.argv[1:] + [""])[:3]
    tools = ("stdbuf", "mosquitto_sub", "mosquitto_pub", "mosquitto_rr", "mosquitto_passwd", "openssl")
    if not program or not all(shutil.which(tool) for tool in tools):
        skip("there is no mosquitto, or one of %s (vendor/install.sh mqtt tests)" % ", ".join(tools))
    principals, rows = table(pathlib.Path(source))
    with tempfile.TemporaryDirectory() as name:
        broker = Broker(program, pathlib.Path(source), pathlib.Path(name))
        try:
            check_refused_connections(broker)
            check_reading(broker, principals, rows)
            check_writing(broker, principals, rows)
            check_client_ids(broker)
            check_reload(broker, rows)
            if fleet:
                check_robots(broker, fleet)
            else:
                print("without ex_fleet: the robots of the test are mosquitto_pub and mosquitto_sub")
        except BaseException:
            print("\n".join(broker.log().splitlines()[-40:]))
            raise
        finally:
            broker.process.kill()
            broker.process.wait()
    print("%d topics, %d principals: ok" % (len(rows), len(principals)))


if __name__ == "__main__":
    main()
