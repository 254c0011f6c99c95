# SPDX-License-Identifier: Apache-2.0
"""What the system tests share: the baxter example as a process, a plain HTTP client, a receiver of web callbacks."""

import asyncio
import collections
import http.client
import http.server
import os
import re
import select
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse

PATIENCE = 60  # seconds, for whatever must come; nothing is slept for. Long, so that a busy machine fails no test

HYBRIT = "https://hybr-it-projekt.de/ns/hybr-it#"
LRT = "https://w3id.org/lrt/ns#"
LDP = "http://www.w3.org/ns/ldp#"
RDF_TYPE = "http://www.w3.org/1999/02/22-rdf-syntax-ns#type"


def free_port():
    """A loopback port that was free just now."""
    with socket.create_server(("127.0.0.1", 0)) as s:
        return s.getsockname()[1]


def configuration(folder, name, *changes):
    """The user's configuration in examples/FOLDER with what differs here. Each change must apply."""
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", folder, name)) as file:
        text = file.read()
    for old, new in changes:
        assert old in text, f"{name} lacks {old!r}"
        text = text.replace(old, new)
    return text


def until(condition, what, patience=PATIENCE):
    """Asks again and again: for what is seen from outside only by asking."""
    end = time.monotonic() + patience
    while True:
        found = condition()
        if found:
            return found
        assert time.monotonic() < end, f"not within {patience} s: {what}"
        time.sleep(0.01)


class Answer:
    def __init__(self, status, headers, body):
        self.status, self.headers, self.body = status, headers, body

    def __repr__(self):
        return f"{self.status} {dict(self.headers)} {self.body[:300]!r}"

    def field(self, name):
        return self.headers.get(name, "")

    def expect(self, status):
        assert self.status == status, f"expected {status}: {self}"
        return self


class Way:
    """How the programs under test are reached: arguments that all of them get, and whom to trust. Plain HTTP until set() says otherwise."""

    arguments = []
    transport = None
    ca_file = None
    context = None

    @classmethod
    def set(cls, transport=None, tls_folder=None):
        cls.transport = transport
        if transport:
            cls.arguments = [*cls.arguments, "--transport", transport]
        if tls_folder:
            script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "examples", "make-certificate.sh")
            subprocess.run([script, tls_folder], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            cls.arguments = [*cls.arguments, "--tls", tls_folder]
            cls.ca_file = os.path.join(tls_folder, "ca.pem")
            cls.context = ssl.create_default_context(cafile=cls.ca_file)

    @classmethod
    def streams(cls, port):
        """asyncio's reader and writer."""
        return asyncio.open_connection("127.0.0.1", port, ssl=cls.context)

    @classmethod
    def connected(cls, s, port):
        """A socket that was not connected yet."""
        s.connect(("127.0.0.1", port))
        return cls.context.wrap_socket(s, server_hostname="127.0.0.1") if cls.context else s


def run_on_way(main, *, usage):
    """Calls main(words) with --transport NAME and --tls taken out of the command line."""
    words, transport, tls = sys.argv[1:], None, False
    while words and words[0].startswith("--"):
        word = words.pop(0)
        if word == "--tls":
            tls = True
        elif word == "--transport" and words:
            transport = words.pop(0)
        else:
            sys.exit(f"usage: {usage}")
    if not words:
        sys.exit(f"usage: {usage}")
    with tempfile.TemporaryDirectory() as folder:
        Way.set(transport, folder if tls else None)
        return main(words)


def exceptions(name):
    """What differs on the present transport, a case a line with its reason: NAME-TRANSPORT.txt beside this file, if there is one."""
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), f"{name}-{Way.transport}.txt")
    if not os.path.exists(path):
        return {}
    with open(path) as lines:
        return dict(line.strip().split(": ", 1) for line in lines if line.strip() and not line.startswith("#"))


def http_request(method, url, body=None, headers=None):
    parts = urllib.parse.urlsplit(url)
    if parts.scheme == "https":
        connection = http.client.HTTPSConnection(parts.hostname, parts.port, timeout=PATIENCE, context=Way.context)
    else:
        connection = http.client.HTTPConnection(parts.hostname, parts.port, timeout=PATIENCE)
    try:
        target = parts.path + ("?" + parts.query if parts.query else "")
        connection.request(method, target, body.encode() if isinstance(body, str) else body, headers or {})
        response = connection.getresponse()
        return Answer(response.status, response.headers, response.read().decode())
    finally:
        connection.close()


def triples(n_triples):
    found = set()
    for line in n_triples.splitlines():
        match = re.match(r"(\S+) (\S+) (.*) \.$", line)
        if match:
            found.add(match.groups())
    return found


def objects(n_triples, predicate, subject=None):
    return [o for s, p, o in triples(n_triples) if p == f"<{predicate}>" and (subject is None or s == f"<{subject}>")]


def plain(literal):
    """A literal's text, an IRI's."""
    return literal[1:-1] if literal.startswith("<") else re.match(r'"(.*)"', literal).group(1)


class Program:
    """A program that says in its first line where it serves."""

    ends_with = (0,)  # after SIGTERM

    url_pattern = r"https?://[^/\s]+/"  # in the line that says where it listens

    def __init__(self, *command):
        self.name = os.path.basename(command[0])
        self.log = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=self.log, text=True)
        ready, _, _ = select.select([self.process.stdout], [], [], PATIENCE)
        line = self.process.stdout.readline() if ready else ""
        match = re.search(self.url_pattern, line)
        assert match, f"{self.name} did not start: {line!r} {self.said()}"
        self.url = match.group()
        self.port = urllib.parse.urlsplit(self.url).port

    def said(self):
        self.log.seek(0)
        return self.log.read()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def stop(self):
        """SIGTERM; it must end well."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(PATIENCE)
        self.process.stdout.close()
        assert code in (*self.ends_with, -signal.SIGKILL), f"{self.name} ended with {code}: {self.said()}"

    def kill(self):
        self.process.kill()
        self.process.wait(PATIENCE)

    def at(self, path):
        return self.url + path

    def get(self, path, **headers):
        return http_request("GET", path if path.startswith("http") else self.at(path), headers={k.replace("_", "-"): v for k, v in headers.items()})

    def post(self, path, turtle, **headers):
        return http_request("POST", self.at(path), turtle, {"Content-Type": "text/turtle", **headers})

    def n_triples(self, path):
        return self.get(path, Accept="application/n-triples").expect(200).body


class Robot(Program):
    """baxter on a port of its own."""

    program = None

    def __init__(self, *arguments, port=0):
        super().__init__(Robot.program, "--port", str(port), *Way.arguments, *arguments)

    def ws(self, path):
        return "ws" + self.url[4:] + path

    def members(self, thing):
        return [plain(o) for o in objects(self.n_triples(thing + "/subscriptions"), LDP + "contains")]

    def counter(self, subscription, name):
        found = objects(self.n_triples(subscription), LRT + name)
        return int(plain(found[0])) if found else None

    def last_error(self, subscription):
        answer = self.get(subscription, Accept="application/n-triples")
        found = objects(answer.body, LRT + "lastError") if answer.status == 200 else []
        return plain(found[0]) if found else None

    def is_sanitized(self):
        with open(f"/proc/{self.process.pid}/maps", encoding="ascii", errors="replace") as maps:
            return any("libasan" in line or "libtsan" in line for line in maps)

    def resident_kib(self):
        with open(f"/proc/{self.process.pid}/status") as status:
            return int(re.search(r"VmRSS:\s+(\d+)", status.read()).group(1))

    def rotate(self, joint, degrees, **headers):
        body = ("@prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . "
                f"<> a maths:Scalar ; vom:numericalValue {degrees} ; vom:unit maths:Degree .")
        return self.post(f"baxter/{joint}/actions/rotate", body, **headers)

    def call_back(self, path, url, upgrade="callback", **headers):
        """Subscribes by the Upgrade form."""
        return self.get(path, Upgrade=upgrade, Callback=url, **headers)

    def post_subscription(self, path, url, more="", container=None):
        body = (f"@prefix hybrit: <{HYBRIT}> . @prefix lrt: <{LRT}> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . "
                f"<> a hybrit:Subscription, hybrit:WebCallback ; hybrit:onResource <{self.at(path)}> ; hybrit:callbackURL \"{url}\"^^xsd:anyURI {more} .")
        container = container or "/".join(path.split("/")[:2]) + "/subscriptions"
        return self.post(container, body)


class Request:
    def __init__(self, handler):
        self.path, self.headers = handler.path, handler.headers
        self.body = handler.rfile.read(int(handler.headers.get("Content-Length", 0)))
        self.text = self.body.decode()

    def links(self):
        return {rel: target for target, rel in re.findall(r'<([^>]*)>; rel="([^"]*)"', ", ".join(self.headers.get_all("Link", [])))}


class Receiver:
    """A stranger's HTTP server on loopback. `answer(handler, request)` says what it does; without one it answers 204."""

    def __init__(self, answer=None, tls=None):
        receiver = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_POST(self):
                request = Request(self)
                receiver.came(request)
                if answer:
                    answer(self, request)
                else:
                    self.status(204)

            def do_GET(self):
                receiver.came(Request(self))
                self.status(204)

            def status(self, code, **fields):
                self.send_response(code)
                for name, value in fields.items():
                    self.send_header(name, value)
                if code != 204:
                    self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *_):
                pass

        class Server(http.server.ThreadingHTTPServer):
            daemon_threads = True
            request_queue_size = 256

            def handle_error(self, *_):
                receiver.broken += 1  # the other end has gone, or did not like the certificate

        self.requests = []
        self.broken = 0
        self.news = threading.Condition()
        self.server = Server(("127.0.0.1", 0), Handler)
        if tls:
            self.server.socket = tls.wrap_socket(self.server.socket, server_side=True)
        self.url = f"http{'s' if tls else ''}://127.0.0.1:{self.server.server_port}/"
        self.thread = threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
        self.thread.start()

    def came(self, request):
        with self.news:
            self.requests.append(request)
            self.news.notify_all()

    def wait(self, condition=lambda requests: requests, what="a notification", patience=PATIENCE):
        with self.news:
            assert self.news.wait_for(lambda: condition(self.requests), patience), \
                f"not within {patience} s: {what}; {len(self.requests)} came, the last {self.requests[-1].text[:600] if self.requests else ''}"
            return list(self.requests)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()


def self_signed(folder):
    """A certificate that nobody has signed but itself, as a server's context."""
    key, certificate = os.path.join(folder, "key.pem"), os.path.join(folder, "certificate.pem")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout", key, "-out", certificate,
                    "-days", "2", "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1"], check=True, stderr=subprocess.DEVNULL)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    return context


Case = collections.namedtuple("Case", "name run")
