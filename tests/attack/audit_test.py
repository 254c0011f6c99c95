# SPDX-License-Identifier: Apache-2.0
"""Kills two robots that append to one audit at random moments, while clients send commands, and fills the disk below an audit.

Each command that was acknowledged must have its line, each line must be JSON, and what is missing must be counted in the file.
LRT_KILLS says how many times the robots are killed; the default is short.
"""

import collections
import http.client
import json
import os
import random
import resource
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import HYBRIT, LRT, PATIENCE, Robot, run_on_way, until  # noqa: E402

CLIENTS = 4
S1 = "baxter/right_s1"
CONTAINER = f"/{S1}/subscriptions"


class Clients:
    """Threads that make and cancel callbacks, each from an address of its own, by which its lines are known."""

    def __init__(self, robot, first_address, receiver):
        self.body = (f"@prefix hybrit: <{HYBRIT}> . @prefix lrt: <{LRT}> . <> a hybrit:WebCallback ; "
                     f"hybrit:onResource <{robot.at(S1 + '/rotation')}> ; hybrit:callbackURL \"{receiver}\" ; lrt:secret \"secret\" .")
        self.lock = threading.Lock()
        self.acknowledged = collections.Counter()  # by address, method and status
        self.unsaved = 0                           # 503: carried out, and its line could not be saved
        self.ends = False
        self.threads = [threading.Thread(target=self.run, args=(robot.port, f"127.0.0.{first_address + n}"), daemon=True) for n in range(CLIENTS)]
        for thread in self.threads:
            thread.start()

    def run(self, port, address):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE, source_address=(address, 0))
        try:
            connection.connect()
            connection.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            mine = []
            while not self.ends:
                if mine:
                    self.request(connection, address, "DELETE", mine.pop())
                else:
                    location = self.request(connection, address, "POST", CONTAINER, self.body)
                    if location:
                        mine.append("/" + location.split("/", 3)[3])
        except (OSError, http.client.HTTPException):
            pass  # the robot was killed
        finally:
            connection.close()

    def request(self, connection, address, method, target, body=None):
        connection.request(method, target, body, {"Content-Type": "text/turtle", "Prefer": "return=minimal"} if body else {})
        response = connection.getresponse()
        response.read()
        with self.lock:
            if response.status == 503:
                self.unsaved += 1
                return None
            assert response.status in (201, 204), (method, response.status)
            self.acknowledged[address, method, response.status] += 1
        return response.getheader("Location")

    def count(self):
        with self.lock:
            return sum(self.acknowledged.values())

    def join(self):
        self.ends = True
        for thread in self.threads:
            thread.join(PATIENCE)
            assert not thread.is_alive(), "a client hangs"


def lines_of(path):
    """Each line, which must be JSON. The last one may be torn: a robot that is killed while it writes cannot end it."""
    with open(path, encoding="utf-8") as file:
        text = file.read()
    whole, torn = text[:text.rfind("\n") + 1], text[text.rfind("\n") + 1:]
    return [json.loads(line) for line in whole.splitlines()], torn


def kill(folder, receiver, kills):
    path = os.path.join(folder, "audit.jsonl")
    acknowledged, torn = collections.Counter(), 0
    for _ in range(kills):
        robots = [Robot("--audit", path), Robot("--audit", path)]
        clients = [Clients(robot, 10 + 10 * n, receiver) for n, robot in enumerate(robots)]
        until(lambda: all(c.count() >= CLIENTS for c in clients), "the clients are served")
        time.sleep(random.uniform(0, 0.2))
        for robot in robots:
            robot.kill()
        for c in clients:
            c.join()
            assert c.unsaved == 0
            acknowledged += c.acknowledged
        torn += bool(lines_of(path)[1])
    lines, _ = lines_of(path)
    found = collections.Counter((line["address"], line["method"], line["status"]) for line in lines if line["event"] in ("request", "subscription_made"))
    lost = sum((acknowledged - found).values())
    print(f"{kills} kills of two robots with one audit: of {sum(acknowledged.values())} acknowledged commands {lost} have no line; "
          f"{len(lines)} lines, {torn} torn at a kill", flush=True)
    return lost


def fill(folder, receiver, fill_disk, free_disk):
    """The disk is full while commands come, and has space again."""
    path = os.path.join(folder, "audit.jsonl")
    with Robot("--audit", path) as robot:
        clients = Clients(robot, 50, receiver)
        until(lambda: clients.count() >= 50, "the clients are served")
        fill_disk(robot)
        until(lambda: clients.unsaved >= CLIENTS, "commands are not acknowledged")
        free_disk(robot)
        before = clients.count()
        until(lambda: clients.count() >= before + 50, "commands are acknowledged again")
        clients.join()
    lines, torn = lines_of(path)
    assert not torn, torn
    found = collections.Counter((line["address"], line["method"], line["status"]) for line in lines if line["event"] in ("request", "subscription_made"))
    lost = sum(line["count"] for line in lines if line["event"] == "lost")
    missing = sum((clients.acknowledged - found).values())
    sent = clients.count() + clients.unsaved
    print(f"full disk: {clients.count()} acknowledged commands, {missing} without a line; {clients.unsaved} refused with 503; "
          f"{sum(found.values())} lines and {lost} counted as lost of {sent}", flush=True)
    assert sum(found.values()) + lost == sent, (found, lost, sent)
    return missing


def fill_file_system(folder, receiver):
    """In a mount namespace of its own: a file system with 256 KiB."""
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", folder], check=True)
    filler = os.path.join(folder, "filler")

    def fill_disk(_):
        with open(filler, "wb", buffering=0) as file:
            try:
                while True:
                    file.write(b"x" * 512)
            except OSError:
                pass

    try:
        return fill(folder, receiver, fill_disk, lambda _: os.remove(filler))
    finally:
        subprocess.run(["umount", folder], check=True)


def fill_by_limit(folder, receiver):
    unlimited = resource.RLIM_INFINITY
    path = os.path.join(folder, "audit.jsonl")
    return fill(folder, receiver, lambda robot: resource.prlimit(robot.process.pid, resource.RLIMIT_FSIZE, (os.path.getsize(path) + 100, unlimited)),
                lambda robot: resource.prlimit(robot.process.pid, resource.RLIMIT_FSIZE, (unlimited, unlimited)))


def may_mount():
    if not shutil.which("unshare"):
        return False
    test = ["unshare", "-rm", "sh", "-c", "mount -t tmpfs -o size=64k tmpfs /mnt"]
    return subprocess.run(test, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0


def main(words):
    Robot.program = words[0]
    with tempfile.TemporaryDirectory() as folder, socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))  # does not listen
        receiver = f"http://127.0.0.1:{nobody.getsockname()[1]}/"
        if words[1:] == ["mounted"]:
            return fill_file_system(folder, receiver)
        seed = int(os.environ.get("LRT_SEED", random.randrange(1 << 32)))
        random.seed(seed)
        print(f"LRT_SEED={seed}", flush=True)
        lost = kill(folder, receiver, int(os.environ.get("LRT_KILLS", "4")))
        os.mkdir(os.path.join(folder, "small"))
        if may_mount():
            lost += subprocess.run(["unshare", "-rm", sys.executable, "-B", *sys.argv, "mounted"]).returncode
        else:
            print("no file system may be mounted here: a limit of the size of files in its place")
            lost += fill_by_limit(os.path.join(folder, "small"), receiver)
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(run_on_way(main, usage="audit_test.py [--transport NAME] PATH_OF_BAXTER"))
