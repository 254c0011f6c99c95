# SPDX-License-Identifier: Apache-2.0
"""What SPARQL over HTTP costs: query_http.py QUERY_SERVER BAXTER [--seconds 5]

Prints the time of a query about all joints, the CPU of a standing query, and the times of other clients' GETs beside queries that explode. The
figures depend on the machine and what else runs there: the load average is printed, nothing is asserted.
"""
import argparse
import contextlib
import os
import re
import socket
import statistics
import subprocess
import threading
import time
import urllib.parse

JOINTS = """PREFIX : <http://example.org/robot#> PREFIX vom: <http://vocab.arvida.de/2015/06/vom/vocab#>
SELECT ?joint ?angle { ?joint a :Joint ; :lower ?lower ; :upper ?upper ; :position ?p . ?p vom:numericalValue ?angle
  FILTER(?angle > ?upper - 0.05 * (?upper - ?lower) || ?angle < ?lower + 0.05 * (?upper - ?lower)) }"""
POSITIONS = JOINTS.split("FILTER")[0] + "}"
OF_BAXTER = """PREFIX ros: <http://ros.org/#> PREFIX lrt: <https://w3id.org/lrt/ns#> PREFIX vom: <http://vocab.arvida.de/2015/06/vom/vocab#>
PREFIX spatial: <http://vocab.arvida.de/2015/06/spatial/vocab#>
SELECT ?joint ?angle { ?joint a ros:Joint ; ros:rotation ?r ; lrt:limits [ lrt:lowerLimit [ vom:numericalValue ?lower ] ; lrt:upperLimit [ vom:numericalValue ?upper ] ] .
  ?r spatial:rotationAngle [ vom:numericalValue ?angle ] FILTER(?angle > ?lower && ?angle < ?upper) }"""
EXPLOSIVE = ["SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i . ?j ?k ?l }", "SELECT * { ?a ?b ?c . ?d ?e ?f } ORDER BY ?f ?b",
             'SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f FILTER(REGEX(CONCAT(STR(?c), STR(?f)), "(a*)*(x+x+)+y")) }']


class Client:
    """One connection."""

    def __init__(self, port):
        self.port, self.connection, self.received = port, socket.create_connection(("127.0.0.1", port), timeout=60), b""
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def get(self, target, accept="*/*"):
        self.connection.sendall(f"GET {target} HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\nAccept: {accept}\r\n\r\n".encode())
        while True:
            header, end, body = self.received.partition(b"\r\n\r\n")
            length = re.search(rb"\r\nContent-Length: (\d+)", header)
            size = int(length[1]) if length else 0
            if end and len(body) >= size:
                self.received = body[size:]
                return int(header[9:12]), body[:size]
            self.received += self.connection.recv(1 << 20)


@contextlib.contextmanager
def server(*command):
    process = subprocess.Popen([str(c) for c in command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        port = int(re.search(r"http://[^/:]+:(\d+)/", process.stdout.readline())[1])
        yield port, process.pid
    finally:
        process.terminate()
        process.wait(20)


def cpu_seconds(pid):
    with open(f"/proc/{pid}/stat") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def target(query):
    return "/sparql?query=" + urllib.parse.quote(query, safe="")


def timed(call):
    start = time.perf_counter()
    result = call()
    return (time.perf_counter() - start) * 1000, result


def percentile(values, share):
    return sorted(values)[min(len(values) - 1, int(len(values) * share))]


def joints(name, aim, query, count, *command):
    with server(*command) as (port, _):
        client = Client(port)
        cold, (status, body) = timed(lambda: client.get(target(query), "text/csv"))
        assert status == 200, body
        rows = body.count(b"\r\n") - 1
        times = []
        for _ in range(count):
            took, (status, body) = timed(lambda: client.get(target(query), "text/csv"))
            assert status == 200 and body, (status, body)
            times.append(took)
        print(f"{name:58} {rows:6} rows, first {cold:8.2f} ms, then median {statistics.median(times):7.2f}, p99 {percentile(times, 0.99):7.2f} ms (aim {aim})", flush=True)


def standing(program, seconds, rounds=3):
    for joint_count in (50,):
        with server(program, "--joints", joint_count, "--publish-hz", 1000) as (port, pid):
            def load():
                before, start = cpu_seconds(pid), time.monotonic()
                time.sleep(seconds)
                return (cpu_seconds(pid) - before) / (time.monotonic() - start) * 100
            without, with_one = [], []
            for _ in range(rounds):
                without.append(load())
                stream = Client(port)
                stream.connection.sendall(f"GET {target(POSITIONS)}&minimumInterval=0.1 HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nAccept: text/event-stream\r\n\r\n".encode())
                events = [0]
                def read():
                    with contextlib.suppress(OSError):
                        while data := stream.connection.recv(1 << 20):
                            events[0] += data.count(b"\nid:") + data.startswith(b"id:")
                reader = threading.Thread(target=read)
                reader.start()
                time.sleep(0.5)
                seen = events[0]
                with_one.append(load())
                rate = (events[0] - seen) / seconds
                stream.connection.shutdown(socket.SHUT_RDWR)
                stream.connection.close()
                reader.join()
                time.sleep(0.5)
            a, b = statistics.median(without), statistics.median(with_one)
            print(f"{joint_count} joints published at 1 kHz: {a:.1f} % of a core; with a standing query at 10 Hz ({rate:.1f} events/s): {b:.1f} %, "
                  f"so {b - a:.1f} % more (aim < 10)", flush=True)


def beside(program, seconds):
    with server(program, "--joints", 50, "--limit-ms", 500) as (port, _):
        def gets():
            client, times, end = Client(port), [], time.monotonic() + seconds
            while time.monotonic() < end:
                took, (status, _) = timed(lambda: client.get("/robot/joint7/position"))
                assert status == 200
                times.append(took)
                time.sleep(0.001)
            return times
        gets()
        quiet = gets()
        over, ends = threading.Event(), []
        def explode():
            client = Client(port)
            while not over.is_set():
                for query in EXPLOSIVE:
                    ends.append(client.get(target(query))[0])
        attackers = [threading.Thread(target=explode) for _ in range(3)]
        for attacker in attackers:
            attacker.start()
        time.sleep(0.2)
        loud = gets()
        over.set()
        for attacker in attackers:
            attacker.join()
        show = lambda times: f"p50 {statistics.median(times):.3f} ms, p99 {percentile(times, 0.99):.3f} ms of {len(times)}"
        print(f"GETs of another client, quiet: {show(quiet)}")
        print(f"  while 3 clients explode ({len(ends)} queries, {sum(s == 503 for s in ends)} with 503): {show(loud)}; "
              f"p99 {percentile(loud, 0.99) / percentile(quiet, 0.99):.2f} times that (aim <= 2)", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("query_server")
    parser.add_argument("baxter")
    parser.add_argument("--seconds", type=float, default=5)
    given = parser.parse_args()
    print(f"{os.cpu_count()} cores, load average {' '.join(f'{x:.1f}' for x in os.getloadavg())}")
    joints("joints of Baxter", "1 ms", OF_BAXTER, 300, given.baxter, "--port", 0)
    joints("50 joints: within 5 % of a limit", "5 ms", JOINTS, 300, given.query_server, "--joints", 50)
    joints("50 joints published at 1 kHz", "5 ms", JOINTS, 300, given.query_server, "--joints", 50, "--publish-hz", 1000)
    joints("50 joints and 9,950 other Things", "50 ms", JOINTS, 30, given.query_server, "--joints", 50, "--things", 9950)
    joints("10,000 joints", "50 ms", JOINTS, 30, given.query_server, "--joints", 10000)
    standing(given.query_server, given.seconds)
    beside(given.query_server, given.seconds)
    print(f"load average {' '.join(f'{x:.1f}' for x in os.getloadavg())}")


if __name__ == "__main__":
    main()
