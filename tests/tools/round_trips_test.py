# SPDX-License-Identifier: Apache-2.0
"""How many requests the command needs, on robots that are small and large, the first time and later.

usage: round_trips_test.py [--times] LRT BAXTER LARGE_ROBOT [URDF_ROBOT SHARED]

--times: no test, but a table of times behind round trips of 30 and 200 ms, with the PR2 if there is one in SHARED.
"""

import json
import os
import resource
import signal
import stat
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from delay_proxy import DelayProxy  # noqa: E402
from robot_process import Program, Robot, http_request  # noqa: E402

LRT = None


class Command:
    """The command with a cache of its own."""

    def __init__(self, proxy, folder):
        self.proxy, self.folder = proxy, folder
        self.env = {k: v for k, v in os.environ.items() if not k.startswith("LRT_") and k != "NO_COLOR"}
        self.env.update(XDG_CACHE_HOME=folder, LC_ALL="C.UTF-8", LRT_ROBOT=proxy.url)

    def run(self, *words, status=0, **env):
        """Its standard output and the requests that it sent."""
        self.proxy.take()
        done = subprocess.run([LRT, *words], capture_output=True, text=True, timeout=300, env={**self.env, **env})
        assert done.returncode == status, f"lrt {' '.join(words)} ended with {done.returncode}: {done.stderr}"
        return done.stdout, self.proxy.take()

    def files(self):
        folder = os.path.join(self.folder, "lrt")
        return [os.path.join(folder, name) for name in sorted(os.listdir(folder))] if os.path.isdir(folder) else []


def at_most(requests, n, what):
    assert len(requests) <= n, f"{what}: expected at most {n} requests, found {len(requests)}: {requests[:20]}"


def counts(url, thing, name, number, action):
    """The command on one robot: the first time, and from then on."""
    with DelayProxy(url) as proxy, tempfile.TemporaryDirectory() as folder:
        command = Command(proxy, folder)
        out, requests = command.run("ls")
        assert thing in out.splitlines(), out
        at_most(requests, 3, "ls, first")
        listed, requests = command.run("ls", "--json")
        at_most(requests, 1, "ls, second")
        assert len(json.loads(listed)) == len(out.splitlines())
        at_most(command.run("ls", "-l")[1], 1, "ls -l")
        value, requests = command.run("get", name)
        at_most(requests, 2, "get")
        float(value)
        at_most(command.run("ls", thing)[1], 2 + 50, "ls of a Thing")  # what is not a simple value has a shape
        at_most(command.run("set", name, number)[1], 6, "set")
        at_most(command.run("invoke", "--async", action, number)[1], 6, "invoke")
        found, requests = command.run("__complete", "get", name[:-2])
        assert name in found.splitlines(), found
        assert requests == [], requests
        for file in command.files():
            os.utime(file, (1, 1))  # confirmed long ago
        at_most(command.run("__complete", "get", name[:-2])[1], 1, "completion after a while")


def disk(url, thing):
    """What is kept is the owner's alone, is replaced if it is broken, and is not used for others."""
    with DelayProxy(url) as proxy, tempfile.TemporaryDirectory() as folder:
        command = Command(proxy, folder)
        old = os.umask(0)
        try:
            first, requests = command.run("ls")
        finally:
            os.umask(old)
        assert len(requests) == 2, requests
        (file,) = command.files()
        assert stat.S_IMODE(os.stat(file).st_mode) == 0o600 and stat.S_IMODE(os.stat(os.path.dirname(file)).st_mode) == 0o700
        with open(file, "rb") as kept:
            whole = kept.read()
        for broken in (b"", whole[:-1], whole[: len(whole) // 2], b"x" + whole, whole.replace(thing.encode(), thing.upper().encode(), 1), b"\0" * 100):
            with open(file, "wb") as kept:
                kept.write(broken)
            out, requests = command.run("ls")
            assert out == first and len(requests) == 2, (requests, broken[:40])
            with open(file, "rb") as kept:
                assert kept.read() == whole
        assert len(command.run("ls")[1]) == 1

        # Other callers: what one has read is not what the next one sees.
        token = os.path.join(folder, "token")
        with open(token, "w") as text:
            text.write("token-0123456789abcdef\n")
        assert len(command.run("ls", "--token-file", token)[1]) == 2
        assert len(command.run("ls", "--header", "X-Who: me")[1]) == 2
        assert len(command.files()) == 3
        with open(token, "w") as text:
            text.write("other-0123456789abcdef\n")
        assert len(command.run("ls", "--token-file", token)[1]) == 2
        assert len(command.files()) == 4
        for path in command.files():
            with open(path, "rb") as kept:
                assert b"token-0123456789abcdef" not in kept.read()

        # A folder that others can write to, a link instead of a file, no folder at all.
        os.chmod(os.path.dirname(file), 0o770)
        assert len(command.run("ls")[1]) == 2
        os.chmod(os.path.dirname(file), 0o700)
        os.rename(file, os.path.join(folder, "elsewhere"))
        os.symlink(os.path.join(folder, "elsewhere"), file)
        assert len(command.run("ls")[1]) == 2 and not os.path.islink(file)
        with open(os.path.join(folder, "elsewhere"), "rb") as kept:
            assert kept.read() == whole
        assert len(command.run("ls", XDG_CACHE_HOME="relative", HOME="")[1]) == 2

        # It is bounded.
        for i in range(80):
            with open(os.path.join(os.path.dirname(file), f"{i:064x}"), "wb") as kept:
                kept.write(b"x")
            os.utime(kept.name, (i, i))
        command.run("ls", "--header", "X-Who: you")
        assert len(command.files()) <= 64, len(command.files())


def later(url_of):
    """A robot that has changed, and one that is another lrt than before."""
    with url_of(2, 3) as robot, DelayProxy(robot.url) as proxy, tempfile.TemporaryDirectory() as folder:
        command = Command(proxy, folder)
        first, _ = command.run("ls")
        assert first.split() == ["joint0", "joint1"], first
        with url_of(3, 3) as other:
            proxy.target = (proxy.target[0], other.port)
            second, requests = command.run("ls")
            assert second.split() == ["joint0", "joint1", "joint2"] and len(requests) == 1, (second, requests)
            assert len(command.run("ls")[1]) == 1


def measured(command, *words):
    """Time, processor time, and requests. Of watch: to the first value."""
    command.proxy.take()
    patience = () if words[0].startswith("__") else ("--timeout", "120")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    begin = time.monotonic()
    with subprocess.Popen([LRT, *words, *patience], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=command.env) as process:
        if words[0] == "watch":
            process.stdout.readline()
            end, requests = time.monotonic(), command.proxy.take()
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=600)
        else:
            process.communicate(timeout=600)
            end, requests = time.monotonic(), command.proxy.take()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    failed = " failed" if process.returncode not in (0, 130) else ""
    return f"{(end - begin) * 1000:.0f} ms, {cpu * 1000:.0f} ms, {len(requests)}{failed}"


def table(name, url, thing, property_, number, action, round_trips):
    for round_trip in round_trips:
        with DelayProxy(url, round_trip) as proxy:
            rows = [("ls",), ("ls", "-l"), ("ls", thing), ("get", property_), ("set", property_, number), ("watch", property_),
                    ("invoke", "--async", action, number), ("__complete", "get", property_[:-2])]
            for words in rows:
                with tempfile.TemporaryDirectory() as folder:
                    command = Command(proxy, folder)
                    first, second = measured(command, *words), measured(command, *words)
                    print(f"| {name} | {round_trip * 1000:.0f} ms | {' '.join(words)} | {first} | {second} |", flush=True)


def main():
    global LRT
    words = sys.argv[1:]
    times = words[0] == "--times"
    LRT, Robot.program, large = words[times:times + 3]

    def robot_of(things, properties):
        return Program(large, str(things), str(properties))

    if times:
        print("| robot | round trip | command | first: time, processor time, requests | second |\n|---|---|---|---|---|")
        round_trips = [float(t) for t in os.environ.get("LRT_ROUND_TRIPS", "0.03,0.2").split(",")]
        with Robot() as robot:
            table("Baxter", robot.url, "right_s1", "right_s1/position", "0.1", "right_s1/rotate", round_trips)
        shared = words[times + 4] if len(words) > times + 4 else ""
        pr2 = os.path.join(shared, "robots", "urdf", "pr2.urdf")
        if os.path.exists(pr2):
            with Program(words[times + 3], pr2, "--port", "0") as robot:
                table("PR2", robot.url, "head_pan_joint", "head_pan_joint/position", "0.1", "head_pan_joint/move", round_trips)
        else:
            print(f"skipped: no PR2, because there is no {pr2}")
        with robot_of(100, 100) as robot:
            table("100 x 100", robot.url, "joint7", "joint7/p42", "1", "joint7/turn", round_trips)
        with robot_of(1, 10_000) as robot:
            table("1 x 10,000", robot.url, "joint0", "joint0/p42", "1", "joint0/turn", round_trips)
        return
    with Robot() as robot:
        counts(robot.url, "right_s1", "right_s1/position", "0.1", "right_s1/rotate")
        disk(robot.url, "right_s1")
    with robot_of(40, 25) as robot:
        counts(robot.url, "joint7", "joint7/p12", "1", "joint7/turn")
        structure = http_request("GET", robot.url + "ns/structure", headers={"Accept": "application/json"}).expect(200)
        assert len(json.loads(structure.body)["things"]) == 40
    later(robot_of)


if __name__ == "__main__":
    main()
