# SPDX-License-Identifier: Apache-2.0
"""Processes that end while clients are served: none crashes, none hangs.

  exit_test.py EXIT_HOST TRANSPORT...     LRT_EXIT_RUNS: runs of each way to end (2, to say something 30); LRT_EXIT_ENDS: which ways
"""
import os
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time

ENDS = "exit static quick_exit lambda fork_static fork_use fork_exec".split()
RUNS = int(os.environ.get("LRT_EXIT_RUNS", "2"))
LIMIT = 20  # [s] for each step; a process that has not ended by then hangs

TURTLE = b"@prefix v: <http://vocab.arvida.de/2015/06/vom/vocab#> . [] v:numericalValue 1.5e0 ."
RDF_XML = b"""<rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#" xmlns:v="http://vocab.arvida.de/2015/06/vom/vocab#">
<rdf:Description><v:numericalValue rdf:datatype="http://www.w3.org/2001/XMLSchema#double">2.5</v:numericalValue></rdf:Description></rdf:RDF>"""
JSON_LD = b'{"http://vocab.arvida.de/2015/06/vom/vocab#numericalValue": {"@type": "http://www.w3.org/2001/XMLSchema#double", "@value": "3.5"}}'


def request(method, path, fields=(), body=b""):
    lines = [f"{method} {path} HTTP/1.1", "Host: localhost:PORT", *fields]
    if body:
        lines.append(f"Content-Length: {len(body)}")
    return "\r\n".join(lines).encode() + b"\r\n\r\n" + body


def with_port(text, port):
    return text.replace(b":PORT", f":{port}".encode())


TYPES = ["text/turtle", "application/ld+json", "application/rdf+xml", "application/json", "application/cbor", "application/trig", "text/html", "image/png"]
PATHS = ["/", "/arm", "/arm/state", "/arm/angle", "/arm/mode", "/arm/pose", "/arm/blueprint", "/arm/actions/turn", "/all", "/ns/vocabulary", "/ns/lrt", "/none"]
REQUESTS = [request("GET", path, [f"Accept: {kind}"]) for path in PATHS for kind in TYPES]
REQUESTS += [request("PUT", "/arm/angle", [f"Content-Type: {kind}"], body) for kind, body in
             [("text/turtle", TURTLE), ("application/rdf+xml", RDF_XML), ("application/ld+json", JSON_LD), ("application/json", b"4.5"), ("text/csv", b"1")]]


class Clients:
    """Send without a pause, each a whole batch before it reads."""

    def __init__(self, port, context, count=4):
        self.port, self.context, self.ended = port, context, False
        self.requests = [with_port(r, port) for r in REQUESTS]
        self.answered = 0
        self.threads = [threading.Thread(target=self.run, args=(i,), daemon=True) for i in range(count)]
        for thread in self.threads:
            thread.start()

    def connect(self):
        client = socket.create_connection(("127.0.0.1", self.port), timeout=LIMIT)
        return self.context.wrap_socket(client) if self.context else client

    def run(self, number):
        turn = number * 31
        while not self.ended:
            try:
                with self.connect() as client:
                    while not self.ended:
                        batch = [self.requests[(turn + i) % len(self.requests)] for i in range(16)]
                        turn += 16
                        client.sendall(b"".join(batch))
                        got = b""
                        while got.count(b"HTTP/1.1 ") < len(batch):
                            more = client.recv(65536)
                            if not more:
                                raise OSError
                            got += more
                        self.answered += len(batch)
            except OSError:
                time.sleep(0.001)

    def wait(self, more):
        goal, end = self.answered + more, time.monotonic() + LIMIT
        while self.answered < goal:
            if time.monotonic() > end:
                return False
            time.sleep(0.001)
        return True

    def end(self):
        self.ended = True
        for thread in self.threads:
            thread.join()


# A process that ends by exit() frees nothing that its threads still use, joins none that has ended in exit(), and its robot is never destroyed:
# none of that is a leak.
ENVIRONMENT = dict(os.environ)
for variable, option in (("ASAN_OPTIONS", "detect_leaks=0"), ("TSAN_OPTIONS", "report_thread_leaks=0")):
    ENVIRONMENT[variable] = ":".join(filter(None, (os.environ.get(variable), option)))


def run_once(program, transport, io, end, tls, errors):
    """What went wrong, or nothing. `errors` takes what the process writes to its standard error."""
    host = subprocess.Popen([program, transport, io, end, *(tls or ())], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors,
                            start_new_session=True, env=ENVIRONMENT)
    clients = None
    try:
        port = int(host.stdout.readline())
        context = None
        if tls:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
            context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
        clients = Clients(port, context)
        if not clients.wait(50 + os.getpid() % 50):
            return "no responses"
        if end == "lambda":
            with clients.connect() as client:
                client.sendall(with_port(request("POST", "/arm/actions/exit", ["Content-Length: 0"]), port))
                try:
                    client.recv(1)
                except OSError:
                    pass
        else:
            host.stdin.write(b"\n")
            host.stdin.flush()
        if end.startswith("fork"):
            if not clients.wait(200):  # the parent serves while and after its child ends
                return f"no responses after fork (exit status {host.poll()})"
            host.stdin.write(b"\n")
            host.stdin.flush()
        status = host.wait(LIMIT)
        return "" if status == 0 else f"ended with {status}"
    except subprocess.TimeoutExpired:
        return "hangs"
    except (BrokenPipeError, ValueError):
        return f"ended with {host.wait()}"
    finally:
        try:
            os.killpg(host.pid, signal.SIGKILL)  # also a child that hangs
        except ProcessLookupError:
            pass
        host.wait()
        if clients:
            clients.end()


def main():
    program, transports = sys.argv[1], sys.argv[2:]
    ends = os.environ.get("LRT_EXIT_ENDS", " ".join(ENDS)).split()
    folder = tempfile.mkdtemp()
    failed = False
    try:
        files = [os.path.join(folder, name) for name in ("certificate.pem", "key.pem")]
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "1", "-subj", "/CN=localhost",
                        "-out", files[0], "-keyout", files[1]], check=True, stderr=subprocess.DEVNULL)
        for transport in transports:
            for io in ("own_thread", "in_poll"):
                for end in ends:
                    for tls in (None, files):
                        with tempfile.TemporaryFile() as errors:
                            wrong = [what for what in (run_once(program, transport, io, end, tls, errors) for _ in range(RUNS)) if what]
                            print(f"{transport:14} {io:10} {end:11} {'TLS' if tls else '   '}  {len(wrong):2} of {RUNS} runs failed", *sorted(set(wrong)),
                                  flush=True)
                            if wrong:
                                errors.seek(0)
                                print(errors.read(8192).decode(errors="replace"), flush=True)
                        failed |= bool(wrong)
    finally:
        shutil.rmtree(folder)
    return failed


if __name__ == "__main__":
    sys.exit(main())
