# SPDX-License-Identifier: Apache-2.0
"""Large bodies: what they do to other clients, and to the control loop.

    large_bodies.py ROBOT [--transport NAME] [--bare PROGRAM]

16 connections send bodies of 1 MiB to resources that may have that much, one after the other. Meanwhile another client reads and commands, one
request at a time. Asserts that it gets its responses, and that the robot then does what it did before. Prints times, which depend on the machine:
of requests in milliseconds, of the control loop in microseconds. LRT_ATTACK_SECONDS says how long (2 for each way).

With --bare the same is measured with two processes of another program (bare_server.cpp): the attack meets the one, and the other, which nobody
attacks, serves the client and has the control loop. What that costs is the machine's: the attackers use its processors.
"""

import argparse
import http.client
import json
import multiprocessing
import os
import pathlib
import statistics
import subprocess
import sys
import time
import urllib.parse

sys.dont_write_bytecode = True  # nothing is left in the source tree

SECONDS = float(os.environ.get("LRT_ATTACK_SECONDS", "2"))
CONNECTIONS = 16
MIB = 1024 * 1024


def nested_contexts(size):
    one = '{"@context": {"a": "http://x/a", "b": {"@id": "a", "@type": "@id"}}, "a": 1},'
    return '{"@graph": [' + (one * (size // len(one)))[:-1] + "]}"


def numbers(size):
    return "[" + ",".join(["0.12345678"] * (size // 11)) + "]"


def turtle(size):
    one = "<#{}> <#p> 1.5, \"a text\", [ <#q> true ] . "
    return "".join(one.format(i) for i in range(size // 50))


def n_triples(size):
    return "<http://x/s> <http://x/p> \"0.5\" .\n" * (size // 34)


# What judges a body, path, media type, body.
BODIES = {
    "JSON-LD with contexts": ("note", "application/ld+json", nested_contexts(MIB)),
    "JSON, 90,000 numbers": ("path", "application/json", numbers(MIB)),
    "Turtle": ("note", "text/turtle", turtle(MIB)),
    "N-Triples": ("note", "application/n-triples", n_triples(MIB)),
}


def attack(url, path, media_type, body, stop, counts):
    """One connection, in a process of its own: its work is not that of who measures."""
    address = urllib.parse.urlsplit(url)
    body = body.encode()
    while not stop.is_set():
        connection = http.client.HTTPConnection(address.hostname, address.port, timeout=60)
        try:
            while not stop.is_set():
                connection.request("PUT", address.path + "arm/" + path, body, {"Content-Type": media_type})
                answer = connection.getresponse()
                answer.read()
                with counts.get_lock():
                    counts[answer.status // 100] += 1
        except (OSError, http.client.HTTPException):
            pass  # the server has refused it and closed
        finally:
            connection.close()


class Robot:
    def __init__(self, *command):
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.url = self.process.stdout.readline().strip()

    def loop(self):
        """What the control loop has measured since the last call."""
        self.process.stdin.write("\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        assert self.process.wait(timeout=60) == 0, self.process.returncode


def percentile(values, part):
    return sorted(values)[min(len(values) - 1, int(len(values) * part))]


def measure(robot, seconds):
    """Times of requests in ms, by kind."""
    address = urllib.parse.urlsplit(robot.url)
    connection = http.client.HTTPConnection(address.hostname, address.port, timeout=60)
    kinds = {
        "GET": ("GET", "arm/position", None, 200),
        "PUT of 100 bytes": ("PUT", "arm/angle", b"1.5".rjust(100), 204),
        "POST of stop": ("POST", "arm/actions/stop", b"", 204),
    }
    times = {kind: [] for kind in kinds}
    robot.loop()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        for kind, (method, path, body, status) in kinds.items():
            begun = time.monotonic()
            connection.request(method, address.path + path, body, {"Content-Type": "application/json"} if body else {})
            answer = connection.getresponse()
            text = answer.read()
            times[kind].append((time.monotonic() - begun) * 1000)
            assert answer.status == status, (kind, answer.status, text)
    connection.close()
    return times, robot.loop()


def under_attack(robot, path, media_type, body, attacked=None):
    stop, counts = multiprocessing.Event(), multiprocessing.Array("i", 6)
    attackers = [multiprocessing.Process(target=attack, args=((attacked or robot).url, path, media_type, body, stop, counts)) for _ in range(CONNECTIONS)]
    for attacker in attackers:
        attacker.start()
    try:
        times, loop = measure(robot, SECONDS)
    finally:
        stop.set()
        for attacker in attackers:
            attacker.join(timeout=60)
            if attacker.is_alive():
                attacker.kill()
    return times, loop, list(counts)


def show(what, times, loop, quiet=None):
    parts = []
    for kind, values in times.items():
        ratio = f" ({percentile(values, 0.99) / percentile(quiet[kind], 0.99):.1f} x)" if quiet else ""
        parts.append(f"{kind} {statistics.median(values):.2f} / {percentile(values, 0.99):.2f}{ratio}")
    print(f"{what}: p50/p99 ms: " + ", ".join(parts))
    print(f"    loop late p50/p99/p99.9/max us: {loop['late_p50']}/{loop['late_p99']}/{loop['late_p999']}/{loop['late_max']}, "
          f"poll p50/p99/p99.9/max us: {loop['poll_p50']}/{loop['poll_p99']}/{loop['poll_p999']}/{loop['poll_max']}, "
          f"its CPU: {loop['cpu_p50']}/{loop['cpu_p99']}/{loop['cpu_p999']}/{loop['cpu_max']}, {loop['steps']} steps", flush=True)


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("robot", type=pathlib.Path)
    arguments.add_argument("--transport", default="http")
    arguments.add_argument("--body-threads", default="1")
    arguments.add_argument("--bare", type=pathlib.Path)
    given = arguments.parse_args()
    for way in ([], ["--in-poll"]):
        if given.bare:
            with Robot(given.bare, *way) as alone, Robot(given.bare) as attacked:
                name = f"no lrt, {'in poll' if way else 'own thread'}"
                quiet, loop = measure(alone, SECONDS)
                show(f"{name}, quiet", quiet, loop)
                path, media_type, body = BODIES["JSON, 90,000 numbers"]
                times, loop, counts = under_attack(alone, path, media_type, body, attacked)
                show(f"{name}, attacked beside it", times, loop, quiet)
                times, loop, counts = under_attack(alone, path, media_type, body)
                show(f"{name}, attacked itself", times, loop, quiet)
        with Robot(given.robot, "--transport", given.transport, "--body-threads", given.body_threads, *way) as robot:
            name = f"{given.transport}, {'in poll' if way else 'own thread'}"
            quiet, loop = measure(robot, SECONDS)
            show(f"{name}, quiet", quiet, loop)
            for kind, (path, media_type, body) in BODIES.items():
                times, loop, counts = under_attack(robot, path, media_type, body)
                show(f"{name}, {kind}", times, loop, quiet)
                print(f"    the attack got {counts[2]} x 2xx, {counts[4]} x 4xx, {counts[5]} x 5xx", flush=True)
                assert sum(counts) > 0, "the attack did nothing"
            measure(robot, 0.2)
    return 0


if __name__ == "__main__":
    sys.exit(main())
