# SPDX-License-Identifier: Apache-2.0
"""What lrt costs, beside the least that any program could do on this machine, in one run.

  run.py BUILD_FOLDER [--json FILE] [--parts get,push,rates,publish,memory,scale,read,compile,rights,client] [--rounds 3] [--seconds 3]

tests/bench/run.sh builds the programs and calls this. Each row is a figure of lrt, the same figure of a bare program that does nothing but the
system calls ("limit"), and their ratio: the median of the ratios of rounds, in each of which both run one after the other. Servers run on
core 0, clients on core 1, where there are two. Everything is on loopback and bounded in count and time. Nothing is asserted.
"""
import argparse
import contextlib
import json
import os
import platform
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
PATH = "/arm/joint/angle"


class Bench:
    def __init__(self, build, rounds, seconds):
        self.programs, self.rounds, self.seconds = os.path.join(build, "tests", "bench"), rounds, seconds
        self.rows = []
        self.cores = sorted(os.sched_getaffinity(0))

    def command(self, core, name, *arguments):
        program = [os.path.join(self.programs, name), *map(str, arguments)]
        return ["taskset", "-c", str(self.cores[core]), *program] if len(self.cores) > 1 else program

    @contextlib.contextmanager
    def server(self, name, *arguments):
        """Runs a server: gives its port and process id."""
        with tempfile.TemporaryFile() as errors:
            process = subprocess.Popen(self.command(0, name, *arguments), stdout=subprocess.PIPE, stderr=errors, text=True)
            try:
                line = process.stdout.readline()
                port = re.match(r"listening on https?://127\.0\.0\.1:(\d+)/", line)
                if not port:
                    errors.seek(0)
                    raise RuntimeError(f"{name} does not listen: {line}{errors.read().decode()}")
                yield int(port[1]), process.pid
            finally:
                process.terminate()
                process.communicate(timeout=20)

    def client(self, name, *arguments):
        """What a client prints."""
        done = subprocess.run(self.command(1, name, *arguments), capture_output=True, text=True, timeout=600)
        if done.returncode != 0:
            raise RuntimeError(f"{name} {arguments}: {done.stdout}{done.stderr}")
        return done.stdout

    def row(self, part, work, unit, lrt, limit=None, aim=None):
        """lrt, limit: a figure for each round. aim: what the ratio should be at most, or the figure where there is no limit."""
        row = {"part": part, "work": work, "unit": unit, "lrt": statistics.median(lrt), "runs": {"lrt": lrt}}
        if limit:
            row.update(limit=statistics.median(limit), ratio=statistics.median(a / b for a, b in zip(lrt, limit)))
            row["runs"]["limit"] = limit
        if aim is not None:
            row["aim"] = aim
        self.rows.append(row)
        show = lambda number: "-" if number is None else f"{number:.4g}" if abs(number) < 1e4 else f"{number:,.0f}"
        print(f"{part:8} {work:52} {unit:10} {show(row['lrt']):>9} {show(row.get('limit')):>9} {show(row.get('ratio')):>6} {show(aim):>7}", flush=True)


def number(pattern, text):
    found = re.search(pattern, text)
    if not found:
        raise RuntimeError(f"no {pattern!r} in {text!r}")
    return float(found[1].replace(",", ""))


def raw_response(port, fields=""):
    """The bytes of a response to a GET on a connection of its own."""
    with socket.create_connection(("127.0.0.1", port), timeout=10) as connection:
        connection.sendall(f"GET {PATH} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n{fields}\r\n".encode())
        received = b""
        while True:
            received += connection.recv(65536)
            header, end, body = received.partition(b"\r\n\r\n")
            length = re.search(rb"\r\nContent-Length: (\d+)", header)
            if end and len(body) >= (int(length[1]) if length else 0):
                return received


def get(bench):
    """GET of a Property: CPU of the server for a request. The bare program sends the same bytes."""
    requests = int(20_000 * bench.seconds)
    with bench.server("pushed_server") as quiet, bench.server("pushed_server", "--publish") as changing, tempfile.TemporaryDirectory() as folder:
        tag = re.search(rb"\r\nETag: (\S+)", raw_response(quiet[0]))[1].decode()
        files = [os.path.join(folder, name) for name in ("ok", "not_modified")]
        for file, fields in zip(files, ("", f"If-None-Match: {tag}\r\n")):
            with open(file, "wb") as out:
                out.write(raw_response(quiet[0], fields))
        with bench.server("epoll_constant", "--response", files[0]) as constant, bench.server("epoll_constant", "--response", files[1]) as not_modified:
            load = lambda at, connections, *more: number(r"server CPU ([\d.]+)", bench.client(
                "http_load", "--port", at[0], "--pid", at[1], "--path", PATH, "--connections", connections, "--requests", requests, *more))
            for connections in (1, 8, 64):
                rounds = [[load(at, connections) for at in (constant, quiet, changing)] for _ in range(bench.rounds)]
                limit, same, other = map(list, zip(*rounds))
                bench.row("get", f"{connections} connections, the value stays", "CPU us", same, limit, 1.15)
                bench.row("get", f"{connections} connections, published at 1 kHz", "CPU us", other, limit)
                rounds = [[load(at, connections, "--if-none-match", tag) for at in (not_modified, quiet)] for _ in range(bench.rounds)]
                limit, same = map(list, zip(*rounds))
                bench.row("get", f"{connections} connections, 304", "CPU us", same, limit, 1.05)


def push(bench):
    """One property at 1 kHz to many WebSockets."""
    with bench.server("pushed_server", "--publish", "--keep", 64) as lrt:
        with bench.server("epoll_broadcast", "--payload", len(raw_response(lrt[0]).partition(b"\r\n\r\n")[2])) as bare:
            for clients, path, aims in ((1, PATH, (75, 100)), (50, PATH, (7, 250)), (200, PATH, (None, None)), (1000, PATH, (None, None)),
                                        (1000, PATH + "?queueLength=256", (None, None))):
                texts = [[bench.client("push_load", "--port", at[0], "--pid", at[1], "--clients", clients, "--seconds", bench.seconds,
                                       "--path", path) for at in (lrt, bare)] for _ in range(bench.rounds)]
                what = f"{clients} clients" + (", each value (queueLength)" if "?" in path else "")
                figures = lambda pattern: ([number(pattern, text) for text in column] for column in zip(*texts))
                bench.row("push", what, "messages/s", *figures(r"([\d.]+) messages/s"))
                bench.row("push", what, "CPU us", *figures(r"server CPU ([\d.]+)"), aims[0])
                latency = [[1000 * value for value in column] for column in figures(r"latency median ([\d.]+)")]
                bench.row("push", what, "p50 us", *latency, aims[1])
                few, many = zip(*(map(float, re.search(r"each client (\d+) to (\d+)", mine).groups()) for mine, _ in texts))
                bench.row("push", what + ": fewest of the most", "%", [100 * a / b for a, b in zip(few, many)])
    for clients in (20, 200):
        with bench.server("pushed_server", "--publish", "--in-poll") as lrt:
            texts = [bench.client("push_load", "--port", lrt[0], "--pid", lrt[1], "--clients", clients, "--seconds", bench.seconds)
                     for _ in range(bench.rounds)]
        what = f"{clients} clients, in poll, 200 us of each ms"
        bench.row("push", what, "messages/s", [number(r"([\d.]+) messages/s", text) for text in texts])
        few, many = zip(*(map(float, re.search(r"each client (\d+) to (\d+)", text).groups()) for text in texts))
        bench.row("push", what + ": fewest of the most", "%", [100 * a / b for a, b in zip(few, many)])


def rates(bench):
    """Sources of other rhythms, to one WebSocket: how the server learns when to look, urgent(), and a look each half millisecond."""
    for rhythm, given in (("10 Hz", ("--period", 100_000)), ("100 Hz", ("--period", 10_000)), ("1 kHz", ("--period", 1000)),
                          ("irregular, 1 to 40 ms", ("--irregular",))):
        for way, option in (("learned", ()), ("urgent()", ("--urgent",)), ("each 0.5 ms", ("--tick",))):
            latency, cpu = [], []
            with bench.server("pushed_server", "--publish", *given, *option) as lrt:
                for _ in range(bench.rounds):
                    before, start = cpu_seconds(lrt[1]), time.monotonic()
                    text = bench.client("push_load", "--port", lrt[0], "--clients", 1, "--seconds", bench.seconds)
                    latency.append(1000 * number(r"latency median ([\d.]+)", text))
                    cpu.append(100 * (cpu_seconds(lrt[1]) - before) / (time.monotonic() - start))
            bench.row("rates", f"{rhythm}, {way}", "p50 us", latency)
            bench.row("rates", f"{rhythm}, {way}", "% of core", cpu)


def cpu_seconds(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def publish(bench):
    """publish() of a double in the control loop."""
    for line in bench.client("publish_bench").splitlines():
        found = re.match(r" *(\d+) subscribers, (.*?) +median +(-?\d+) ns .* (\d+) allocations +(\d+) system calls in (\d+)", line)
        if found:
            clients, rhythm, median, allocations, calls, steps = found.groups()
            bench.row("publish", f"{clients} subscribers, {rhythm}", "ns", [float(median)], aim=50)
            bench.row("publish", f"{clients} subscribers, {rhythm}", "allocations", [float(allocations)], aim=0)
            bench.row("publish", f"{clients} subscribers, {rhythm}, of {steps}", "calls", [float(calls)])


def memory(bench):
    """Resident memory of the server for each idle connection."""
    rounds = []
    for _ in range(bench.rounds):
        each = []
        for name in ("pushed_server", "epoll_constant"):
            with bench.server(name) as at:
                each.append(max(0.0, number(r"([\d.-]+) KiB each", bench.client("idle_memory", "--port", at[0], "--pid", at[1], "--path", PATH))))
        rounds.append(each)
    bench.row("memory", "an idle connection", "KiB", [mine for mine, _ in rounds], aim=0.5)


def scale(bench):
    """Many Things with three properties: the time until the server has them, and the memory of each. A server that nobody talks to."""
    for things in (10, 1000, 10_000, 100_000):
        runs = {how: [json.loads(bench.client("scale", "--things", things, "--json", *how.split())) for _ in range(bench.rounds)]
                for how in ("", "--at-once")}
        for how, text in (("", "one by one"), ("--at-once", "at once")):
            bench.row("scale", f"{things} Things added {text}", "s", [run["seconds"] for run in runs[how]], aim=2 if things == 100_000 else None)
        bench.row("scale", f"{things} Things: allocated for each", "bytes", [run["allocated_bytes_per_thing"] for run in runs[""]], aim=4096)
        if things >= 1000:  # below, the pages that the allocator has already suffice
            bench.row("scale", f"{things} Things: resident for each", "bytes", [run["resident_bytes_per_thing"] for run in runs[""]], aim=4096)
    for arguments, text in (((), "a thread of lrt's"), (("--in-poll",), "in poll")):
        runs = [json.loads(bench.client("idle_cpu", "--seconds", bench.seconds, "--json", *arguments)) for _ in range(bench.rounds)]
        bench.row("scale", f"idle beside a loop at 1 kHz, {text}", "% of core", [run["percent_of_core"] for run in runs], aim=0.1)


def read(bench):
    """RDF read into a graph."""
    for line in bench.client("read_bench").splitlines():
        found = re.match(r"(.*?) {2,}([\d.]+) us +(\d+) bytes +(\d+) triples +([\d.]+) MB/s", line)
        if found:
            bench.row("read", found[1], "us", [float(found[2])])
            bench.row("read", found[1], "MB/s", [float(found[5])])
    for line in bench.client("shacl_bench", 10_000).splitlines():
        found = re.match(r"(.*?): +([\w +]*?) *([\d.]+) us", line)
        if found:
            bench.row("read", f"{found[1]}: {found[2]}".rstrip(": "), "us", [float(found[3])])


def compile(bench):
    """CPU time of compiling a user's file, and of its standard headers."""
    text = subprocess.run([os.path.join(HERE, "compile_time.sh")], capture_output=True, text=True, check=True).stdout
    bench.row("compile", "#include <lrt/lrt.hpp>", "s", [number(r": ([\d.]+) s, ", text)], [number(r"in it: ([\d.]+) s", text)], 1.5)


def rights(bench):
    """Who may do what: a decision, and a GET with a token and rules beside one of a server without."""
    text = bench.client("rights_bench", 100)
    bench.row("rights", "a decision with 100 rules", "ns", [number(r"100 rules: (\d+) ns", text)], aim=1000)
    bench.row("rights", "a token among 100", "ns", [number(r"among 100: (\d+) ns", text)])
    requests = int(20_000 * bench.seconds)
    with tempfile.TemporaryDirectory() as folder:
        tokens, policy = os.path.join(folder, "tokens"), os.path.join(folder, "policy.ttl")
        with open(tokens, "w", encoding="utf-8") as out:
            out.writelines(f"name{i} operator token-0123456789-{i}\n" for i in range(100))
        with open(policy, "w", encoding="utf-8") as out:
            out.write("@prefix acl: <http://www.w3.org/ns/auth/acl#> .\n")
            out.write("[] a acl:Authorization ; acl:accessTo </> ; acl:default </> ; acl:agentClass acl:AuthenticatedAgent ; acl:mode acl:Read .\n")
            out.writelines(f"[] a acl:Authorization ; acl:default </other{i}> ; acl:agentGroup <#operator> ; acl:mode acl:Write .\n" for i in range(99))
        with bench.server("pushed_server") as free, bench.server("pushed_server", "--tokens", tokens, "--policy", policy) as guarded:
            load = lambda at, connections, *more: number(r"server CPU ([\d.]+)", bench.client(
                "http_load", "--port", at[0], "--pid", at[1], "--path", PATH, "--connections", connections, "--requests", requests, *more))
            field = "Authorization: Bearer token-0123456789-50"
            for connections in (8, 64):
                rounds = [[load(free, connections), load(guarded, connections, "--field", field)] for _ in range(bench.rounds)]
                without, with_token = map(list, zip(*rounds))
                bench.row("rights", f"GET with a token and rules, {connections} connections", "CPU us", with_token, without, 1.05)


def client(bench):
    """A client that watches 100 robots of one process at 10 Hz, and the way of a value from one robot into the loop of another at 1 kHz."""
    runs = [json.loads(bench.client("client_bench", "--robots", 100, "--seconds", max(1, int(bench.seconds)), "--json")) for _ in range(bench.rounds)]
    for name, work, unit in (("messages_per_second", "100 robots watched at 10 Hz", "1/s"), ("server_cpu_us", "each robot: CPU of its server", "us/s"),
                             ("client_cpu_us", "each robot: CPU of the client", "us/s"), ("server_kib", "each robot: memory of its server", "KiB"),
                             ("client_kib", "each robot: memory of the client", "KiB"), ("received_p50_us", "1 kHz, robot to robot: decoded, p50", "us"),
                             ("received_p99_us", "1 kHz, robot to robot: decoded, p99", "us"), ("taken_p50_us", "1 kHz, robot to robot: in its loop, p50", "us"),
                             ("taken_p99_us", "1 kHz, robot to robot: in its loop, p99", "us")):
        bench.row("client", work, unit, [run[name] for run in runs])


PARTS = {part.__name__: part for part in (get, push, rates, publish, memory, scale, read, compile, rights, client)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--json")
    parser.add_argument("--parts", default=",".join(PARTS))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=3)
    given = parser.parse_args()
    unknown = set(given.parts.split(",")) - set(PARTS)
    if unknown:
        parser.error(f"no part {', '.join(sorted(unknown))}; there are {', '.join(PARTS)}")
    bench = Bench(given.build, given.rounds, given.seconds)
    print(f"{'part':8} {'work':52} {'unit':10} {'lrt':>9} {'limit':>9} {'ratio':>6} {'aim':>7}")
    start = time.monotonic()
    for name in given.parts.split(","):
        PARTS[name](bench)
    print(f"{time.monotonic() - start:.0f} s; medians of {given.rounds} rounds")
    if given.json:
        described = subprocess.run(["git", "-C", HERE, "describe", "--always", "--dirty"], capture_output=True, text=True)
        with open(given.json, "w", encoding="utf-8") as file:
            json.dump({"lrt": described.stdout.strip(), "time": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime()), "cores": len(bench.cores),
                       "machine": platform.machine(), "kernel": platform.release(), "rounds": given.rounds, "seconds": given.seconds,
                       "rows": bench.rows}, file, indent=1)
            file.write("\n")


if __name__ == "__main__":
    sys.exit(main())
