# SPDX-License-Identifier: Apache-2.0
"""Kills the robot at random moments while clients make and cancel web callbacks. After each restart every acknowledged callback must be
there, and no callback whose cancellation was acknowledged.

LRT_KILLS says how many times; the default is short.
"""

import http.client
import os
import random
import socket
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import HYBRIT, LRT, PATIENCE, Robot, run_on_way, until  # noqa: E402

CLIENTS = 8
S1 = "baxter/right_s1"
CONTAINER = f"/{S1}/subscriptions"


class Clients:
    """Threads that make and cancel callbacks on connections of their own until the robot goes."""

    def __init__(self, robot, receiver, count, present=()):
        self.receiver = receiver
        self.body = (f"@prefix hybrit: <{HYBRIT}> . @prefix lrt: <{LRT}> . <> a hybrit:WebCallback ; "
                     f"hybrit:onResource <{robot.at(S1 + '/rotation')}> ; hybrit:callbackURL \"%s\" ; lrt:secret \"secret\" .")
        self.lock = threading.Lock()
        self.present = set(present)    # acknowledged with 201, and no DELETE was sent
        self.uncertain = set()         # DELETE was sent, no response
        self.gone = set()              # DELETE was acknowledged
        self.created = self.deleted = 0
        self.refused = {}              # other statuses
        self.ends = False
        self.threads = [threading.Thread(target=self.run, args=(robot.port, random.Random(random.random()), number), daemon=True)
                        for number in range(count)]
        for thread in self.threads:
            thread.start()

    def run(self, port, chance, number):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
        try:
            connection.connect()
            connection.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            while not self.ends:
                with self.lock:
                    victim = None
                    if len(self.present) > 100 or (self.present and chance.random() < 0.5):
                        victim = chance.choice(sorted(self.present))
                        self.present.discard(victim)
                        self.uncertain.add(victim)
                if victim:
                    status = self.request(connection, "DELETE", "/" + victim.split("/", 3)[3])[0]
                    with self.lock:
                        if status == 204:
                            self.uncertain.discard(victim)
                            self.gone.add(victim)
                            self.deleted += 1
                        else:
                            self.refused[status] = self.refused.get(status, 0) + 1
                else:
                    status, location = self.request(connection, "POST", CONTAINER, self.body % f"{self.receiver}{number}")
                    with self.lock:
                        if status == 201:
                            self.present.add(location)
                            self.created += 1
                        else:
                            self.refused[status] = self.refused.get(status, 0) + 1
        except (OSError, http.client.HTTPException):
            pass  # the robot was killed
        finally:
            connection.close()

    @staticmethod
    def request(connection, method, target, body=None):
        connection.request(method, target, body, {"Content-Type": "text/turtle", "Prefer": "return=minimal"} if body else {})
        response = connection.getresponse()
        response.read()
        return response.status, response.getheader("Location", "")

    def join(self):
        self.ends = True
        for thread in self.threads:
            thread.join(PATIENCE)
            assert not thread.is_alive(), "a client hangs"


def measure(file, receiver, count, seconds=1.5):
    with Robot("--subscriptions", file) as robot:
        start = time.monotonic()
        clients = Clients(robot, receiver, count)
        time.sleep(seconds)
        clients.join()
        took = time.monotonic() - start
        assert not clients.refused, clients.refused
    return (clients.created + clients.deleted) / took


def main(words):
    kills = int(os.environ.get("LRT_KILLS", "6"))
    Robot.program = words[0]
    seed = int(os.environ.get("LRT_SEED", random.randrange(1 << 32)))
    random.seed(seed)
    print(f"LRT_SEED={seed}")
    lost = back = created = deleted = 0
    with tempfile.TemporaryDirectory() as folder, socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))  # does not listen
        receiver = f"http://127.0.0.1:{nobody.getsockname()[1]}/"
        for count in (1, 32):
            print(f"{measure(os.path.join(folder, f'measured{count}'), receiver, count):.0f} acknowledged changes/s from {count} clients", flush=True)
        file = os.path.join(folder, "state", "subscriptions.ttl")
        os.mkdir(os.path.dirname(file), 0o700)
        port, present = 0, set()
        for _ in range(kills):
            robot = Robot("--subscriptions", file, port=port)
            port = robot.port
            clients = Clients(robot, receiver, CLIENTS, present)
            until(lambda: clients.created + clients.deleted >= CLIENTS, "the clients are served")
            time.sleep(random.uniform(0, 0.3))
            robot.kill()
            clients.join()
            assert not clients.refused, clients.refused
            again = Robot("--subscriptions", file, port=port)
            there = set(again.members(S1))
            again.kill()
            lost += len(clients.present - there)
            back += len(clients.gone & there)
            created += clients.created
            deleted += clients.deleted
            present = there
    print(f"{kills} kills: of {created} acknowledged callbacks {lost} were lost, of {deleted} acknowledged cancellations {back} came back")
    return 1 if lost or back else 0


if __name__ == "__main__":
    sys.exit(run_on_way(main, usage="kill_test.py [--transport NAME] PATH_OF_BAXTER"))
