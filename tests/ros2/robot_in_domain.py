# SPDX-License-Identifier: Apache-2.0
"""What the tests of lrt-ros2 share: a domain of their own on the loopback interface, the simulated robot, the program."""
import fcntl
import os
import queue
import re
import signal
import socket
import subprocess
import threading
import time

PATIENCE = 60  # [s] for what has to happen; nothing waits this long where all is well


def until(condition, what):
    """The first result of `condition` that is neither None nor False."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        found = condition()
        if found is not None and found is not False:
            return found
        time.sleep(0.02)
    raise AssertionError("not within %d s: %s" % (PATIENCE, what))


class Domain:
    """A domain that no other test of this machine has: by the files of tests/ros2/peer.hpp, and the port of its multicast, which other programs have."""

    def __init__(self):
        folder = "/tmp/lrt_test_ros2_domains_%d" % os.geteuid()
        os.makedirs(folder, mode=0o700, exist_ok=True)
        for i in range(100):
            number = 1 + (os.getpid() + 50 + i) % 100
            self.lock = open(os.path.join(folder, str(number)), "w", encoding="utf-8")
            try:
                fcntl.flock(self.lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                    probe.bind(("", 7400 + 250 * number))
                self.number = number
                return
            except OSError:
                self.lock.close()
        raise AssertionError("all domains are in use")

    def environment(self, **more):
        """Without what a user of lrt or ROS has set."""
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("LRT_", "ROS_", "AMENT_", "CYCLONEDDS", "RMW_"))}
        return {**kept, "ROS_DOMAIN_ID": str(self.number), "ROS_LOCALHOST_ONLY": "1", **more}


class Process:
    """A program whose lines are kept."""

    def __init__(self, command, environment):
        self.command = command
        self.process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace")
        self.lines, self.errors = [], []
        self.arrived = queue.Queue()
        self.threads = [threading.Thread(target=self.read, args=(self.process.stdout, self.lines)),
                        threading.Thread(target=self.read, args=(self.process.stderr, self.errors))]
        for thread in self.threads:
            thread.start()

    def read(self, stream, into):
        for line in stream:
            into.append(line.rstrip("\n"))
            self.arrived.put(None)
        self.arrived.put(None)

    def wait_for(self, pattern):
        """The match of a line of standard output or standard error."""
        end = time.monotonic() + PATIENCE
        while True:
            for line in [*self.lines, *self.errors]:
                if found := re.search(pattern, line):
                    return found
            if self.process.poll() is not None and not any(thread.is_alive() for thread in self.threads):
                break
            try:
                self.arrived.get(timeout=max(0.0, min(1.0, end - time.monotonic())))
            except queue.Empty:
                pass
            if time.monotonic() > end:
                break
        raise AssertionError("%s: no line with %r\n%s\n%s" % (" ".join(self.command), pattern, "\n".join(self.lines), "\n".join(self.errors)))

    def end(self, number=signal.SIGTERM):
        """The exit status."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            status = self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise AssertionError("%s does not end after signal %d" % (" ".join(self.command), number)) from None
        finally:
            for thread in self.threads:
                thread.join(PATIENCE)
        return status

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for thread in self.threads:
            thread.join(PATIENCE)


def port_of(line):
    return int(re.search(r":(\d+)/", line).group(1))
