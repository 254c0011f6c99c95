#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What a robot pays for 0, 1, 100 and 1,000 readers behind a cache: CPU and requests, with the configurations of examples/fleet_front.

usage: fleet_front.py PATH_OF_AGED_ROBOT [SECONDS]

Each reader keeps a connection and reads one value four times in a second (1,000 readers: once), which the robot states to be good for one second. The last rows are without a cache. CPU is
what the scheduler has counted for all threads of the robot (ns). Aim: flat within 5 %, that is, the robot's CPU does not grow with the readers.
"""

import asyncio
import glob
import os
import resource
import sys
import time

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from fleet_front import AgedRobot, Front, base, free_port  # noqa: E402


def cpu_ns(pid):
    total = 0
    for path in glob.glob(f"/proc/{pid}/task/*/schedstat"):
        with open(path) as file:
            total += int(file.read().split()[0])
    return total


class Direct:
    """No cache: the robot itself."""

    tls = None

    def __init__(self, port):
        self.port = port


async def reader(front, path, host, pause, opened, go, end, count):
    async with opened:  # not all handshakes at once
        stream, writer = await asyncio.open_connection("localhost", front.port, ssl=front.tls)
    request = f"GET {path} HTTP/1.1\r\nHost: {host}\r\nAccept: text/plain\r\n\r\n".encode()
    await go.wait()
    await asyncio.sleep(hash(id(writer)) % 1000 / 1000)  # spread over the second
    while time.monotonic() < end[0]:
        writer.write(request)
        head = await stream.readuntil(b"\r\n\r\n")
        length = int(next(line.split(b":")[1] for line in head.split(b"\r\n") if line.lower().startswith(b"content-length:")))
        await stream.readexactly(length)
        assert head.split(b" ", 2)[1] == b"200", head
        count[0] += 1
        await asyncio.sleep(pause)
    writer.close()


async def measure(front, robot, path, host, readers, seconds, reads):
    opened, go, end, count = asyncio.Semaphore(50), asyncio.Event(), [0], [0]
    tasks = [asyncio.ensure_future(reader(front, path, host, 1 if readers >= 1000 else 0.25, opened, go, end, count)) for _ in range(readers)]
    await asyncio.sleep(1 + readers / 200)
    end[0] = time.monotonic() + seconds
    before, asked, began = cpu_ns(robot.process.pid), reads(), time.monotonic()
    go.set()
    await asyncio.sleep(seconds)
    passed = time.monotonic() - began
    used, asked = cpu_ns(robot.process.pid) - before, reads() - asked
    await asyncio.gather(*tasks)
    return used / passed / 1e6, (asked - 1) / passed, count[0] / passed


def main():
    AgedRobot.program, seconds = sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 10
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    print(f"{'front':8} {'readers':>7} {'reads/s':>8} {'requests to the robot/s':>24} {'CPU of the robot, ms/s':>23}")
    for name in ("nginx", "varnish", "none"):
        if name != "none" and not Front.is_installed(name):
            print(f"{name:8} left out: it is not installed")
            continue
        port = free_port()
        front = Front(name, port) if name != "none" else None
        public = base(front, "cell7") if front else f"http://127.0.0.1:{port}"
        robot = AgedRobot("--port", str(port), "--public-base", public, "--age", "1", "--more", "1")
        host = f"localhost:{front.port}" if front else f"127.0.0.1:{port}"
        prefix = "/cell7" if front else ""
        try:
            if front:
                front.start(connections=4096)
            for count in (0, 1, 100, 1000):
                # `reads` is read past the cache, at the robot itself.
                row = asyncio.run(measure(front or Direct(port), robot, prefix + "/arm/battery", host, count, seconds,
                                          lambda: int(robot.direct(port, prefix + "/arm/reads", Host=host))))
                print(f"{name:8} {count:7} {row[2]:8.0f} {max(row[1], 0):24.2f} {row[0]:23.2f}", flush=True)
        finally:
            if front:
                front.stop()
            robot.stop()


if __name__ == "__main__":
    main()
