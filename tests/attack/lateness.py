# SPDX-License-Identifier: Apache-2.0
"""How late the steps of a control loop at 1 kHz begin, idle and under each attack.

    lateness.py ROBOT [--transport NAME ...] [--only TEXT] [--real-time]
    lateness.py ROBOT --fifo

Each attack meets a server of its own, with lrt's thread and in poll(). One process attacks; another one reads and commands as an honest client does.
Asserts that the attack did something, that the honest client gets the responses that it should get, also afterwards, and that the loop went on. Prints a table;
the times depend on the machine, and nothing is asserted of them. LRT_ATTACK_SECONDS says how long each attack is measured (0.3).

Times are in microseconds: p50/p99/p99.9/max. "poll, CPU" is the processor time of the control loop's thread in poll(): what lrt did. "poll" is the time that
passed meanwhile, with that of other programs that had the processor.

With --real-time the loop has SCHED_FIFO and is bound to one CPU, so that no other program's use of the processors is measured.

With --fifo the loop has SCHED_FIFO, is bound to one CPU, and creates the server: once with lrt's own options of threads, and once with threads that inherit
policy, priority and CPU, as lrt's threads did before they had options. Asserts their policy. Exits with 77 if the system allows no SCHED_FIFO.
"""

import argparse
import base64
import collections
import http.client
import multiprocessing
import os
import pathlib
import re
import resource
import selectors
import socket
import struct
import sys
import threading
import time
import urllib.parse

sys.dont_write_bytecode = True  # nothing is left in the source tree
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from large_bodies import MIB, Robot, nested_contexts, numbers, percentile, turtle, n_triples  # noqa: E402

SECONDS = float(os.environ.get("LRT_ATTACK_SECONDS", "0.3"))
SET_UP = 30  # seconds at most until an attack is complete
PAUSE = 0.005  # between requests of the honest client


# --------------------------------------------------------------------------------------------------------------- the attacks

class Attacker:
    """What an attack knows of its target, and what it tells of itself. Runs in a process of its own."""

    def __init__(self, url, stop, ready, counts):
        self.address = (urllib.parse.urlsplit(url).hostname, urllib.parse.urlsplit(url).port)
        self.host = f"{self.address[0]}:{self.address[1]}"
        self.stop, self.ready, self.counts = stop, ready, counts  # counts: responses by hundreds; 0: what else the attack counts

    def count(self, status):
        self.counts[status // 100] += 1

    def connect(self, receive_buffer=0):
        s = socket.socket()
        if receive_buffer:
            s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        s.settimeout(5)
        try:
            s.connect(self.address)
        except OSError:
            s.close()
            return None
        s.setblocking(False)
        return s

    def request(self, method, target, fields="", body=b""):
        length = f"Content-Length: {len(body)}\r\n" if method in ("PUT", "POST") else ""
        return f"{method} /{target} HTTP/1.1\r\nHost: {self.host}\r\n{fields}{length}\r\n".encode() + body


class Flood:
    """Connections that send one text after the other, each when `responses` have come, and connect again when they are closed."""

    def __init__(self, attacker, text, connections=16, responses=1):
        self.attacker, self.text, self.responses = attacker, text, responses
        self.selector = selectors.DefaultSelector()
        for _ in range(connections):
            self.open()

    def open(self):
        s = self.attacker.connect()
        if s:
            self.selector.register(s, selectors.EVENT_READ | selectors.EVENT_WRITE, [memoryview(self.text), b"", self.responses])

    def close(self, s):
        self.selector.unregister(s)
        s.close()

    def receive(self, key):
        state = key.data
        part = key.fileobj.recv(65536)
        if not part:
            raise OSError("closed")
        text = state[1] + part
        end = 0
        for found in re.finditer(rb"HTTP/1\.1 (\d\d\d)", text):
            self.attacker.count(int(found[1]))
            state[2] -= 1
            end = found.end()
        state[1] = text[max(end, len(text) - 11):]
        if state[2] <= 0:
            state[0], state[2] = memoryview(self.text), self.responses
            self.selector.modify(key.fileobj, selectors.EVENT_READ | selectors.EVENT_WRITE, state)

    def run(self):
        self.attacker.ready.set()
        # Until the first response in any case: a busy machine may need longer than SECONDS for it.
        while not self.attacker.stop.is_set() or not any(self.attacker.counts):
            for key, events in self.selector.select(0.05):
                state = key.data
                try:
                    if events & selectors.EVENT_WRITE:
                        state[0] = state[0][key.fileobj.send(state[0][:256 * 1024]):]
                        if not state[0]:
                            self.selector.modify(key.fileobj, selectors.EVENT_READ, state)
                    if events & selectors.EVENT_READ:
                        self.receive(key)
                except BlockingIOError:
                    pass
                except OSError:  # refused, and perhaps reset before the response was read
                    self.attacker.counts[0] += 1
                    self.close(key.fileobj)
                    self.open()
            if not self.selector.get_map():
                self.open()
        for key in list(self.selector.get_map().values()):
            self.close(key.fileobj)


def body(path, media_type, text):
    """16 connections send this body without a pause."""
    text = text.encode() if isinstance(text, str) else text
    return lambda a: Flood(a, a.request("PUT", "arm/" + path, f"Content-Type: {media_type}\r\n", text)).run()


def get_flood(a):
    Flood(a, a.request("GET", "arm/position") * 64, responses=64).run()


def hold(a, count, text, tick=b"", receive_buffer=0, status=0):
    """Connections that are kept: each sends `text`, then a byte of `tick` again and again, and reads nothing.

    Counts those that are open at the end, by the status of their response if there should be one."""
    sockets = []
    for _ in range(count):
        s = a.connect(receive_buffer)
        if s is None:
            break
        try:
            s.send(text)
        except OSError:
            s.close()
            continue
        sockets.append(s)
    a.ready.set()
    at = 0
    while not a.stop.wait(0.01):
        for s in sockets[at % 100::100] if tick else ():
            try:
                s.send(tick[at // 100 % len(tick):][:1])
            except OSError:
                pass
        at += 1
    for s in sockets:
        try:
            first = s.recv(12, socket.MSG_PEEK)
            if first:
                a.count(int(first[9:12] or b"0"))
        except BlockingIOError:
            a.counts[0] += 1
        except OSError:
            pass
        s.close()


def unfinished(a):
    text = b'"' + b"x" * (MIB - 2)  # a byte is missing
    hold_large(a, 500, a.request("PUT", "arm/note", "Content-Type: application/json\r\n", text + b'"')[:-1])


def hold_large(a, count, text):
    """As hold(), of a text that does not fit into the buffers of a socket."""
    flood = Flood(a, text, 0)
    for _ in range(count):
        flood.open()
    end = time.monotonic() + 3
    while flood.selector.get_map() and time.monotonic() < end and not a.stop.is_set():
        writing = False
        for key, events in flood.selector.select(0.05):
            state = key.data
            try:
                if events & selectors.EVENT_WRITE:
                    writing = True
                    state[0] = state[0][key.fileobj.send(state[0][:256 * 1024]):]
                    if not state[0]:
                        flood.selector.modify(key.fileobj, selectors.EVENT_READ, state)
                if events & selectors.EVENT_READ:
                    flood.receive(key)
                    flood.close(key.fileobj)
            except BlockingIOError:
                pass
            except OSError:
                flood.close(key.fileobj)
        if not writing:
            break
        if time.monotonic() > end - 2:
            a.ready.set()  # the measurement sees a part of the sending
    a.ready.set()
    a.stop.wait()
    a.counts[0] += len(flood.selector.get_map())
    for key in list(flood.selector.get_map().values()):
        flood.close(key.fileobj)


def churn(a):
    """Connects and closes, every second time with a reset."""
    a.ready.set()
    while not a.stop.is_set():
        s = a.connect()
        if s is None:
            continue
        a.counts[0] += 1
        if a.counts[0] % 2:
            s.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        s.close()


def websocket_fields():
    return f"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {base64.b64encode(b'0123456789abcdef').decode()}\r\n"


SUBSCRIPTION = """@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> .
<> a hybrit:WebCallback ; hybrit:onResource <http://%s/arm/position> ; hybrit:callbackURL "%s" ."""


def subscribe(a, connection, receiver):
    connection.request("POST", "/arm/subscriptions", SUBSCRIPTION % (a.host, receiver), {"Content-Type": "text/turtle", "Prefer": "return=minimal"})
    response = connection.getresponse()
    response.read()
    a.count(response.status)
    return response.getheader("Location")


def callbacks(a, receivers):
    connection = http.client.HTTPConnection(*a.address, timeout=30)
    for receiver in receivers:
        subscribe(a, connection, receiver)
    a.ready.set()
    a.stop.wait()


def dead_receivers(a):
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))  # does not listen
        callbacks(a, [f"http://127.0.0.1:{nobody.getsockname()[1]}/{i}" for i in range(150)])


def hanging_receivers(a):
    with socket.create_server(("127.0.0.1", 0), backlog=200) as silent:  # accepts nothing
        callbacks(a, [f"http://127.0.0.1:{silent.getsockname()[1]}/{i}" for i in range(150)])


def hanging_names(a):
    callbacks(a, [f"http://r{i}.d{i % 20}.hanging/" for i in range(150)])


def subscription_churn(a):
    a.ready.set()
    connection = http.client.HTTPConnection(*a.address, timeout=30)
    while not a.stop.is_set():
        made = subscribe(a, connection, "http://127.0.0.1:9/")
        if made is None:
            continue
        connection.request("DELETE", urllib.parse.urlsplit(made).path)
        response = connection.getresponse()
        response.read()
        a.count(response.status)


def websocket_churn(a):
    """Opens WebSockets, reads the response, and goes."""
    a.ready.set()
    while not a.stop.is_set():
        s = a.connect()
        if s is None:
            continue
        s.settimeout(10)
        try:
            s.send(a.request("GET", "arm/position", websocket_fields()))
            first = s.recv(12, socket.MSG_WAITALL)
            if len(first) == 12:
                a.count(int(first[9:12]))
        except OSError:
            pass
        s.close()


def colliding():
    """Triples that a hash without a seed puts into a few slots (tests/attack/parsers_test.cpp)."""
    terms, window, slots, all64 = 400, 256, 32768, (1 << 64) - 1

    def unseeded(s, o):
        product = ((s << 32 | 1) ^ 0xA0761D6478BD642F) * (o ^ 0xE7037ED1A0B428DB)
        return ((product & all64) ^ (product >> 64)) & (slots - 1)

    names = ["<p>" if k == 1 else f"<{k}>" for k in range(terms)]
    text = names[0] + names[1] + ",".join(names[2:]) + "."
    for s in range(terms):
        text += "".join(names[s] + names[1] + names[o] + "." for o in range(2, terms) if s != 1 and unseeded(s, o) < window)
    return text


def cbor_numbers(size):
    count = size // 9
    return b"\x9a" + struct.pack(">I", count) + b"\xfb\x3f\xbf\x9a\xdd\x37\x39\x63\x5f" * count


def rdf_xml(size):
    one = '<rdf:Description rdf:about="http://x/s"><p xmlns="http://x/">a text</p></rdf:Description>'
    return f'<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">{one * (size // len(one))}</rdf:RDF>'


def own_contexts(size):
    return '{"@context":"CONTEXT","http://e/p":[' + '{"@context":[{},"CONTEXT"]},' * (size // 28) + "1]}"


def own_context_bodies(a):
    text = own_contexts(MIB - 64 * 1024)
    text = text.replace("CONTEXT", f"http://{a.host}/ns/context.jsonld")[:MIB - 3].rsplit("},", 1)[0] + "}]}"
    body("note", "application/ld+json", text)(a)


ALL_TAKEN = "all connections taken"
ATTACKS = {
    "1 MiB JSON, numbers": body("path", "application/json", numbers(MIB)),
    "1 MiB CBOR, numbers": body("path", "application/cbor", cbor_numbers(MIB - 64)),
    "1 MiB JSON-LD, contexts": body("note", "application/ld+json", nested_contexts(MIB - 64)),
    "1 MiB Turtle": body("note", "text/turtle", turtle(MIB - 64)),
    "1 MiB TriG": body("note", "application/trig", turtle(MIB - 64)),
    "1 MiB N-Triples": body("note", "application/n-triples", n_triples(MIB - 64)),
    "1 MiB N-Quads": body("note", "application/n-quads", n_triples(MIB - 64)),
    "1 MiB RDF/XML": body("note", "application/rdf+xml", rdf_xml(MIB - 256)),
    "1 MiB text": body("note", "text/plain", "x" * MIB),
    "refused at the header section: 1 MiB for a number": body("angle", "application/json", numbers(MIB)),
    "quadratic pattern, 128 KiB": body("label", "text/plain", "1" * 131072 + "ygx"),
    "references to lrt's context, 1 MiB JSON-LD": own_context_bodies,
    "colliding triples, Turtle": body("note", "text/turtle", colliding()),
    "500 unfinished bodies of 1 MiB": unfinished,
    "900 clients, a byte of a header at a time": lambda a: hold(a, 900, b"GET / HTTP/1.1\r\nX: ", tick=b"abc"),
    "900 clients that read nothing": lambda a: hold(a, 900, a.request("GET", "") * 100, receive_buffer=4096, status=200),
    ALL_TAKEN: lambda a: hold(a, 2200, b"GET / HTTP/1.1\r\nX: "),
    "connections opened and closed": churn,
    "pipelined GETs": get_flood,
    "500 WebSockets that read nothing": lambda a: hold(a, 500, a.request("GET", "arm/position?queueLength=100", websocket_fields()), receive_buffer=4096, status=101),
    "500 event streams that read nothing": lambda a: hold(a, 500, a.request("GET", "arm/position?queueLength=100", "Accept: text/event-stream\r\n"),
                                                          receive_buffer=4096, status=200),
    "WebSockets opened and closed": websocket_churn,
    "150 callbacks to a dead receiver": dead_receivers,
    "150 callbacks to a receiver that hangs": hanging_receivers,
    "150 callbacks, the name server hangs": hanging_names,
    "subscriptions made and cancelled": subscription_churn,
}


# ----------------------------------------------------------------------------------------------------------- the measurement

class Client(threading.Thread):
    """Reads and commands, one request at a time, on a connection that it keeps."""

    KINDS = {
        "GET": ("GET", "arm/position", None, 200),
        "PUT": ("PUT", "arm/angle", b"1.5".rjust(100), 204),
        "stop": ("POST", "arm/actions/stop", b"", 204),
    }

    def __init__(self, url):
        super().__init__(daemon=True)
        self.address = urllib.parse.urlsplit(url)
        self.times = {kind: [] for kind in self.KINDS}
        self.statuses = {kind: collections.Counter() for kind in self.KINDS}
        self.ended = threading.Event()

    def run(self):
        connection = None
        while not self.ended.is_set():
            for kind, (method, path, text, _) in self.KINDS.items():
                begun = time.monotonic()
                try:
                    connection = connection or http.client.HTTPConnection(self.address.hostname, self.address.port, timeout=30)
                    connection.request(method, "/" + path, text, {"Content-Type": "application/json"} if text else {})
                    response = connection.getresponse()
                    response.read()
                    self.statuses[kind][response.status] += 1
                    self.times[kind].append((time.monotonic() - begun) * 1e6)
                except (OSError, http.client.HTTPException) as error:
                    connection.close()
                    connection = None
                    self.statuses[kind][type(error).__name__] += 1
            self.ended.wait(PAUSE)
        if connection:
            connection.close()

    def finish(self):
        self.ended.set()
        self.join(60)
        assert not self.is_alive(), "the honest client waits for a response"


def honest(robot, seconds):
    """The control loop meanwhile, and the honest client."""
    client = Client(robot.url)
    robot.loop()
    client.start()
    time.sleep(seconds)
    loop = robot.loop()
    client.finish()
    return loop, client


def check(transport, name, client):
    """The honest client got what it should get."""
    if name == ALL_TAKEN:  # a connection between two requests is closed for another client, and a new one serves stops only
        assert client.statuses["stop"][204] > 0, (transport, name, client.statuses)
        return
    for kind, (_, _, _, status) in Client.KINDS.items():
        assert set(client.statuses[kind]) == {status}, (transport, name, kind, client.statuses[kind])


def under(attack, robot):
    """What the loop and the honest client measure during an attack, and the counts of the attack."""
    stop, ready, counts = multiprocessing.Event(), multiprocessing.Event(), multiprocessing.Array("l", 6, lock=False)
    process = multiprocessing.Process(target=lambda: attack(Attacker(robot.url, stop, ready, counts)), daemon=True)
    process.start()
    try:
        assert ready.wait(SET_UP), "the attack is not complete"
        loop, client = honest(robot, SECONDS)
        stop.set()
        process.join(SET_UP)
        assert process.exitcode == 0, f"the attack ended with {process.exitcode}"
    finally:
        if process.is_alive():
            process.kill()
    return loop, client, list(counts)


FIGURES = ("p50", "p99", "p999", "max")


def figures(loop, what):
    return "/".join(str(loop[f"{what}_{figure}"]) for figure in FIGURES)


def row(name, loop, client, idle, outcome):
    ratio = "/".join(f"{loop['late_' + f] / max(1, idle['late_' + f]):.1f}" for f in FIGURES[:3])
    gets = client.times["GET"] or [0]
    print(f"| {name} | {figures(loop, 'late')} | {ratio} | {figures(loop, 'poll')} | {figures(loop, 'cpu')} | "
          f"{percentile(gets, 0.5) / 1000:.1f}/{percentile(gets, 0.99) / 1000:.1f} | {outcome} |", flush=True)


def outcome(counts):
    parts = [f"{counts[h]} x {h}xx" for h in range(1, 6) if counts[h]]
    return ", ".join(parts + ([f"{counts[0]} connections"] if counts[0] else []))


HEADER = """
| attack | late | ratio to idle (p50/p99/p99.9) | poll | poll, CPU | others' GET, ms (p50/p99) | the attack got |
|---|---|---|---|---|---|---|"""


REAL_TIME = ["--fifo", "50", "--cpu", str(min(os.sched_getaffinity(0)))]


def measure(program, transport, way, only):
    command = [program, "--transport", transport, "--callbacks", *way]
    print(f"\n{transport}, {'in poll' if '--in-poll' in way else 'own thread'}{', the loop has SCHED_FIFO' if '--fifo' in way else ''}:\n{HEADER}")
    with Robot(*command) as robot:
        idle, client = honest(robot, max(SECONDS, 0.5))
        check(transport, "none", client)
    row("none", idle, client, idle, "")
    for name, attack in ATTACKS.items():
        if only not in name:
            continue
        with Robot(*command) as robot:
            loop, client, counts = under(attack, robot)
            row(name, loop, client, idle, outcome(counts))
            check(transport, name, client)
            assert sum(counts) > 0, f"{name}: the attack did nothing"
            assert loop["steps"] > 0, name
            _, client = honest(robot, 0.05)
            check(transport, name, client)


FIFO_ATTACKS = ("1 MiB JSON-LD, contexts", "1 MiB Turtle", "pipelined GETs", "connections opened and closed")


def policies(robot):
    """The policy and the CPUs of each thread of lrt's."""
    found = {}
    for thread in pathlib.Path(f"/proc/{robot.process.pid}/task").iterdir():
        name = (thread / "comm").read_text().strip()
        if name.startswith("lrt-"):
            found[name] = (os.sched_getscheduler(int(thread.name)), os.sched_getaffinity(int(thread.name)))
    return found


def measure_fifo(program, transport):
    """False: the system allows no SCHED_FIFO."""
    every_cpu = os.sched_getaffinity(0)
    cpu = min(every_cpu)  # as in REAL_TIME
    print("\n| threads of lrt | attack | late | poll | steps | others' GET, ms (p50/p99) |\n|---|---|---|---|---|---|")
    for name, way, policy, cpus in (("inherit the loop's policy and CPU", ["--inherit"], os.SCHED_FIFO, {cpu}), ("as they are", [], os.SCHED_OTHER, every_cpu)):
        for attacked in ("none", *FIFO_ATTACKS):
            robot = Robot(program, "--transport", transport, *REAL_TIME, *way)
            if not robot.url:
                assert robot.process.wait() == 77, robot.process.returncode
                print("skipped: the system allows no SCHED_FIFO here (CAP_SYS_NICE or RLIMIT_RTPRIO)")
                return False
            with robot:
                if attacked == "none":
                    loop, client = honest(robot, SECONDS)
                else:
                    loop, client, counts = under(ATTACKS[attacked], robot)
                    assert sum(counts) > 0, f"{attacked}: the attack did nothing"
                gets = client.times["GET"] or [0]
                print(f"| {name} | {attacked} | {figures(loop, 'late')} | {figures(loop, 'poll')} | {loop['steps']} | "
                      f"{percentile(gets, 0.5) / 1000:.1f}/{percentile(gets, 0.99) / 1000:.1f} |", flush=True)
                check(transport, attacked, client)
                threads = policies(robot)
                assert "lrt-io" in threads and set(threads) <= {"lrt-io", "lrt-body"}, threads
                assert all(found == (policy, cpus) for found in threads.values()), (name, threads)
    return True


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("robot", type=pathlib.Path)
    arguments.add_argument("--transport", nargs="*", default=["http"])
    arguments.add_argument("--only", default="", help="attacks whose name has this")
    arguments.add_argument("--real-time", action="store_true")
    arguments.add_argument("--fifo", action="store_true")
    given = arguments.parse_args()
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    if given.fifo:
        return 0 if measure_fifo(given.robot, given.transport[0]) else 77
    for transport in given.transport:
        for way in ([], ["--in-poll"]):
            measure(given.robot, transport, way + (REAL_TIME if given.real_time else []), given.only)
    return 0


if __name__ == "__main__":
    multiprocessing.set_start_method("fork")
    sys.exit(main())
