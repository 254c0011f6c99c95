# SPDX-License-Identifier: Apache-2.0
"""Kills the robot at random moments while clients and code write a graph that is kept in a file, and fills its disk. After each restart the graph must
have what was acknowledged last, and what was refused must not be there.

LRT_KILLS says how many times; the default is short.
"""

import errno
import http.client
import os
import random
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import PATIENCE, Program, Way, run_on_way, until  # noqa: E402

CLIENTS = 8
UPDATE = {"Content-Type": "application/sparql-update"}


class World(Program):
    program = None

    def __init__(self, file, *arguments, port=0, triples=0):
        super().__init__(World.program, file, str(triples), "--port", str(port), *Way.arguments, *arguments)

    def map(self):
        answer = self.get("world/map", Accept="application/n-triples").expect(200)
        return answer.body

    def values(self, name):
        """The numbers of a subject."""
        return {int(value) for value in re.findall(rf'/map#{name}> <p:is> "(\d+)"', self.map())}

    def unsaved(self):
        return self.metric("lrt_graph_changes_unsaved")

    def metric(self, name):
        return int(re.search(rf"^{name} (\d+)$", self.get("server/metrics").expect(200).body, re.M).group(1))


class Clients:
    """Threads that write on connections of their own until the robot goes. Each has triples of its own, and replaces and adds them."""

    def __init__(self, world, count, known):
        self.lock = threading.Lock()
        self.known = known  # by client: the numbers that are acknowledged, those that were asked for last
        self.acknowledged = 0
        self.refused = {}
        self.ends = False
        self.threads = [threading.Thread(target=self.run, args=(world.port, number), daemon=True) for number in range(count)]
        for thread in self.threads:
            thread.start()

    def run(self, port, number):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
        chance = random.Random(random.random())
        try:
            connection.connect()
            connection.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            while not self.ends:
                have, _ = self.known.get(number, (set(), set()))
                new = max(have, default=0) + chance.randrange(1, 10)
                gone = set(chance.sample(sorted(have), min(len(have), chance.randrange(3))))
                wanted = have - gone | {new}
                self.known[number] = (have, wanted)
                body = "".join(f"DELETE DATA {{ <#c{number}> <p:is> {value} }} ; " for value in sorted(gone))
                connection.request("PATCH", "/world/map", body + f"INSERT DATA {{ <#c{number}> <p:is> {new} }}", UPDATE)
                response = connection.getresponse()
                response.read()
                with self.lock:
                    if response.status == 204:
                        self.known[number] = (wanted, wanted)
                        self.acknowledged += 1
                    else:
                        if response.status in (503, 507):
                            self.known[number] = (have, have)
                        self.refused[response.status] = self.refused.get(response.status, 0) + 1
        except (OSError, http.client.HTTPException):
            pass  # the robot was killed
        finally:
            connection.close()

    def join(self):
        self.ends = True
        for thread in self.threads:
            thread.join(PATIENCE)
            assert not thread.is_alive(), "a client hangs"


def check(world, known):
    """How many clients miss what was acknowledged, or have what was refused. What they have now is what is acknowledged from now on."""
    wrong = 0
    for number in sorted(known):
        there = world.values(f"c{number}")
        if there not in known[number]:
            print(f"client {number}: {sorted(there)} is there; acknowledged {sorted(known[number][0])}, asked for {sorted(known[number][1])}")
            wrong += 1
        known[number] = (there, there)
    return wrong


def kill(folder, kills):
    file = os.path.join(folder, "map.journal")
    port, known, wrong, acknowledged = 0, {}, 0, 0
    for _ in range(kills):
        world = World(file, port=port)
        port = world.port
        wrong += check(world, known)
        clients = Clients(world, CLIENTS, known)
        until(lambda: clients.acknowledged >= CLIENTS, "the clients are served")
        time.sleep(random.uniform(0, 0.3))
        world.kill()
        clients.join()
        assert not clients.refused, clients.refused
        acknowledged += clients.acknowledged
    with World(file, port=port) as world:
        wrong += check(world, known)
    print(f"{kills} kills: of {acknowledged} acknowledged changes of {CLIENTS} clients {wrong} were lost or partly there", flush=True)
    return wrong


def rate(folder, count, seconds=1.5):
    with World(os.path.join(folder, f"rate{count}")) as world:
        clients = Clients(world, count, {})
        start = time.monotonic()
        time.sleep(seconds)
        clients.join()
        took = time.monotonic() - start
        assert not clients.refused, clients.refused
    return clients.acknowledged / took


def expect_full(world, status, fill, free):
    """A disk that refuses, and takes writes again."""
    def write(value):
        headers = {}
        connection = http.client.HTTPConnection("127.0.0.1", world.port, timeout=PATIENCE)
        connection.request("PATCH", "/world/map", f"INSERT DATA {{ <#f> <p:is> {value} }}", UPDATE)
        response = connection.getresponse()
        response.read()
        headers = response.headers
        connection.close()
        return response.status, headers

    assert write(1)[0] == 204
    fill()
    refused, headers = until(lambda: (lambda found: found if found[0] != 204 else None)(write(1000)), "the disk refuses")
    assert refused == status, f"expected {status}, got {refused}"
    assert headers["Retry-After"], "no Retry-After"
    for value in range(2, 6):
        assert write(value)[0] == status
    there = world.values("f")
    assert 1 in there and not there & {2, 3, 4, 5}, there
    before = max(world.values("host"))
    until(lambda: max(world.values("host")) > before, "what code changes is shown on a full disk")
    until(lambda: world.unsaved() > 0, "the counter says that it is not saved")
    until(lambda: world.metric("lrt_graph_file_errors_total") > 0, "the attempts that failed are counted")
    said = world.said().count(" not saved: ")
    assert said == 1, f"{said} lines in one interval"
    free()
    until(lambda: write(6)[0] == 204, "the disk takes writes again")
    until(lambda: world.unsaved() == 0, "all is saved")
    return there | {6}


def full_by_library(folder, library):
    switch, file = os.path.join(folder, "full"), os.path.join(folder, "on_full_disk")
    os.environ.update({"LD_PRELOAD": library, "LRT_FULL_DISK": switch})
    try:
        for status, error in ((507, errno.ENOSPC), (507, errno.EDQUOT), (503, errno.EIO)):
            def fill():
                with open(switch + "~", "w") as made:
                    made.write(str(error))
                os.rename(switch + "~", switch)
            world = World(file)
            there = expect_full(world, status, fill, lambda: os.remove(switch))
            world.kill()
            with World(file) as again:
                assert again.values("f") == there, (again.values("f"), there)
                assert again.values("host"), "what code has changed is lost"
            os.remove(file)
    finally:
        del os.environ["LD_PRELOAD"], os.environ["LRT_FULL_DISK"]
    print("a disk that refuses, by a library: 507 (ENOSPC, EDQUOT), 503 (EIO); nothing refused is there", flush=True)


def full_by_file_system(folder):
    place = os.path.join(folder, "small")
    os.mkdir(place)
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", place], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    if mounted.returncode:
        print(f"skipped: a small file system, which this machine does not allow ({mounted.stderr.strip()}); the library stands for it", flush=True)
        return
    try:
        file, filler = os.path.join(place, "map"), os.path.join(place, "filler")

        def fill():
            with open(filler, "wb", buffering=0) as made:
                try:
                    while made.write(b"x" * 4096):
                        pass
                except OSError:
                    pass
        world = World(file)
        there = expect_full(world, 507, fill, lambda: os.remove(filler))
        world.kill()
        with World(file) as again:
            assert again.values("f") == there
    finally:
        subprocess.run(["umount", place], check=True)
    print("a full file system of 64 KiB: 507; nothing refused is there", flush=True)


def main(words):
    World.program, library = words
    seed = int(os.environ.get("LRT_SEED", random.randrange(1 << 32)))
    random.seed(seed)
    print(f"LRT_SEED={seed}")
    with tempfile.TemporaryDirectory() as folder:
        for count in (1, 32):
            print(f"{rate(folder, count):.0f} acknowledged changes/s from {count} clients", flush=True)
        full_by_library(folder, library)
        full_by_file_system(folder)
        return 1 if kill(folder, int(os.environ.get("LRT_KILLS", "5"))) else 0


if __name__ == "__main__":
    sys.exit(run_on_way(main, usage="kill_graphs_test.py [--transport NAME] PATH_OF_KEPT_WORLD PATH_OF_FULL_DISK"))
