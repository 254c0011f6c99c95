# SPDX-License-Identifier: Apache-2.0
"""Fills the disk of a host whose model of Redland is in an SQLite file: 507, and nothing has changed. Then kills such a host at random moments while clients
write its model, and while the host counts in it. After each restart the model must have what was acknowledged last, a PATCH is there as a whole or not at
all, and so is a change of the host.

LRT_KILLS says how many times; the default is short.
"""

import http.client
import os
import random
import re
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import PATIENCE, Program, http_request, until  # noqa: E402

CLIENTS = 4
UPDATE = {"Content-Type": "application/sparql-update"}


class Tasks(Program):
    program = None

    def __init__(self, file):
        super().__init__(Tasks.program, "serve", file, "--port", "0")

    def patch(self, update):
        return http_request("PATCH", self.at("world/tasks"), update, UPDATE)

    def values(self):
        """subject: its values"""
        body = self.get("world/tasks", Accept="application/n-triples").expect(200).body
        found = {}
        for subject, value in re.findall(r'<urn:(\w+)> <urn:p> "(\d+)"', body):
            found.setdefault(subject, set()).add(int(value))
        return found


class Clients:
    """Threads that each replace two values together, on connections of their own, until the host goes."""

    def __init__(self, port, known):
        self.lock = threading.Lock()
        self.known = known  # by client: the value that is acknowledged, the one that was asked for last
        self.acknowledged, self.refused, self.wrong = 0, 0, []
        self.ends = False
        self.threads = [threading.Thread(target=self.run, args=(port, number), daemon=True) for number in range(CLIENTS)]
        for thread in self.threads:
            thread.start()

    def run(self, port, number):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
        try:
            while not self.ends:
                have = self.known.get(number, (None, None))[0]
                new = (have or 0) + 1
                self.known[number] = (have, new)
                names = [f"<urn:c{number}{half}>" for half in "ab"]
                body = "" if have is None else "DELETE DATA { " + " . ".join(f"{name} <urn:p> '{have}'" for name in names) + " } ; "
                body += "INSERT DATA { " + " . ".join(f"{name} <urn:p> '{new}'" for name in names) + " }"
                connection.request("PATCH", "/world/tasks", body, UPDATE)
                response = connection.getresponse()
                said = response.read().decode()
                with self.lock:
                    if response.status == 204:
                        self.known[number] = (new, new)
                        self.acknowledged += 1
                    elif response.status == 503 and "nothing has changed" in said:
                        self.known[number] = (have, have)
                        self.refused += 1
                    elif response.status in (202, 503):  # a slow disk: it may still be done; once more is the same
                        self.refused += 1
                    else:
                        self.wrong.append((response.status, said))
                        return
        except (OSError, http.client.HTTPException):
            pass  # the host was killed
        finally:
            connection.close()

    def join(self):
        self.ends = True
        for thread in self.threads:
            thread.join(PATIENCE)
            assert not thread.is_alive(), "a client hangs"


def check(values, known):
    """How many clients miss what was acknowledged, or have half of a change."""
    lost = 0
    for number in sorted(known):
        halves = [values.get(f"c{number}{half}", set()) for half in "ab"]
        allowed = [{value} if value is not None else set() for value in known[number]]
        if halves[0] != halves[1] or halves[0] not in allowed:
            print(f"client {number}: {halves} is there; acknowledged {known[number][0]}, asked for {known[number][1]}")
            lost += 1
        value = max(halves[0], default=None)
        known[number] = (value, value)
    pair = [values.get(name, set()) for name in ("host1", "host2")]
    if pair[0] != pair[1] or len(pair[0]) > 1:
        print(f"half of a change of the host: {pair}")
        lost += 1
    return lost


def fill_disk(folder, library):
    """By a library that refuses to write (tests/attack/full_disk.cpp)."""
    switch, file = os.path.join(folder, "full"), os.path.join(folder, "on_full_disk.db")
    os.environ.update({"LD_PRELOAD": library, "LRT_FULL_DISK": switch})
    try:
        with Tasks(file) as host:
            host.patch("INSERT DATA { <urn:f> <urn:p> '1' }").expect(204)
            with open(switch, "w"):
                pass
            refused = host.patch("INSERT DATA { <urn:f> <urn:p> '2', '3' }").expect(507)
            assert "disk is full" in refused.body, refused
            until(lambda: host.get("world/tasks").status == 200, "the graph is shown on a full disk")
            assert host.values()["f"] == {1}, host.values()
            os.remove(switch)
            until(lambda: host.patch("INSERT DATA { <urn:f> <urn:p> '4' }").status == 204, "the disk takes writes again")
            assert host.values()["f"] == {1, 4}, host.values()
    finally:
        del os.environ["LD_PRELOAD"], os.environ["LRT_FULL_DISK"]
    print("a full disk, by a library: 507 with the message of SQLite; nothing refused is there", flush=True)


def main(program, library=None):
    Tasks.program = program
    seed = int(os.environ.get("LRT_SEED", random.randrange(1 << 32)))
    random.seed(seed)
    kills = int(os.environ.get("LRT_KILLS", "3"))
    print(f"LRT_SEED={seed}")
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "tasks.db")
        if library:
            fill_disk(folder, library)
        else:
            print("skipped: a full disk, because the library for it is not built (sanitizers come first)")
        known, lost, acknowledged = {}, 0, 0
        for _ in range(kills):
            host = Tasks(file)
            lost += check(host.values(), known)
            clients = Clients(host.port, known)
            until(lambda: clients.acknowledged >= CLIENTS or clients.wrong, "the clients are served")
            time.sleep(random.uniform(0, 0.3))
            host.kill()
            clients.join()
            assert not clients.wrong, clients.wrong
            acknowledged += clients.acknowledged
        with Tasks(file) as host:
            lost += check(host.values(), known)
    print(f"{kills} kills: of {acknowledged} acknowledged changes of {CLIENTS} clients {lost} were lost or partly there", flush=True)
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
