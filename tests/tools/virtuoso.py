# SPDX-License-Identifier: Apache-2.0
"""Virtuoso (Debian: virtuoso-opensource-7) as a store of a test: a database of its own in a folder, on free ports of 127.0.0.1."""

import http.client
import http.server
import json
import os
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.parse
import urllib.request

INI = """
[Database]
DatabaseFile = {folder}/v.db
ErrorLogFile = {folder}/v.log
LockFile = {folder}/v.lck
TransactionFile = {folder}/v.trx
xa_persistent_file = {folder}/v.pxa
FileExtend = 200
MaxCheckpointRemap = 2000
[TempDatabase]
DatabaseFile = {folder}/t.db
TransactionFile = {folder}/t.trx
[Parameters]
ServerPort = 127.0.0.1:{sql}
DisableUnixSocket = 1
MaxClientConnections = 10
NumberOfBuffers = 10000
MaxDirtyBuffers = 6000
DirsAllowed = .
[HTTPServer]
ServerPort = 127.0.0.1:{http}
ServerRoot = {folder}
MaxClientConnections = 20
ServerThreads = 20
MaxKeepAlives = 20
KeepAliveTimeout = 10
[Client]
SQL_QUERY_TIMEOUT = 0
[SPARQL]
ResultSetMaxRows = 100000
"""


def skip_if_missing():
    if not shutil.which("virtuoso-t"):
        print("skipped: Virtuoso is not installed; vendor/install.sh stores")
        sys.exit(77)


def free_port():
    """A port that the system gives to no connection: nobody takes it while the store is away."""
    with open("/proc/sys/net/ipv4/ip_local_port_range", encoding="ascii") as file:
        first = int(file.read().split()[0])
    while True:
        port = random.randrange(10_000, first) if first > 20_000 else 0
        try:
            with socket.create_server(("127.0.0.1", port)) as s:
                return s.getsockname()[1]
        except OSError:
            pass  # somebody has it


class Virtuoso:
    user, password = "dba", "dba"  # of a new database

    def __init__(self, folder):
        self.folder, self.http = folder, free_port()
        with open(os.path.join(folder, "v.ini"), "w") as file:
            file.write(INI.format(folder=folder, sql=free_port(), http=self.http))
        self.start()

    def start(self, patience=120):
        self.log = open(os.path.join(self.folder, "out"), "w+")
        self.process = subprocess.Popen(["virtuoso-t", "+foreground", "+configfile", os.path.join(self.folder, "v.ini")], cwd=self.folder,
                                        stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)
        end = time.monotonic() + patience
        while not self.responds():
            assert self.process.poll() is None and time.monotonic() < end, f"Virtuoso does not start: {self.said()}"
            time.sleep(0.1)

    def responds(self):
        try:
            return self.select("SELECT ?g WHERE { GRAPH ?g { ?s ?p ?o } } LIMIT 1") is not None
        except (OSError, urllib.error.URLError):
            return False

    def said(self):
        self.log.flush()
        self.log.seek(0)
        return self.log.read()[-4000:]

    @property
    def endpoint(self):
        return f"http://127.0.0.1:{self.http}/sparql-graph-crud-auth"

    def select(self, query):
        """Rows, each a dictionary of texts."""
        url = f"http://127.0.0.1:{self.http}/sparql?" + urllib.parse.urlencode({"query": query, "format": "application/sparql-results+json"})
        with urllib.request.urlopen(url, timeout=60) as response:
            found = json.load(response)
        return [{name: value["value"] for name, value in row.items()} for row in found["results"]["bindings"]]

    def resident_mib(self):
        with open(f"/proc/{self.process.pid}/status") as status:
            return next(int(line.split()[1]) for line in status if line.startswith("VmRSS")) // 1024

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.log.close()


class CountedVirtuoso(Virtuoso):
    """A Virtuoso whose requests by `url` are counted, challenges of Digest as "401", and whose database is copied and restored by its files, as its operator
    would do it."""

    def __init__(self, folder):
        super().__init__(folder)
        store = self
        self.methods = []
        self.lock = threading.Lock()

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"
            disable_nagle_algorithm = True  # else each body waits 40 ms for the acknowledgement of its header

            def forward(self):
                body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
                connection = http.client.HTTPConnection("127.0.0.1", store.http, timeout=60)
                try:
                    connection.request(self.command, self.path, body, {name: value for name, value in self.headers.items() if name.lower() not in ("host", "connection")})
                    response = connection.getresponse()
                    content = response.read()
                    with store.lock:
                        store.methods.append("401" if response.status == 401 else self.command)
                    self.send_response(response.status)
                    for name, value in response.getheaders():
                        if name.lower() not in ("connection", "transfer-encoding", "content-length", "date", "server"):
                            self.send_header(name, value)
                    if response.status not in (204, 304):
                        self.send_header("Content-Length", str(len(content)))
                    self.end_headers()
                    self.wfile.write(content)
                finally:
                    connection.close()

            do_GET = do_PUT = do_DELETE = do_HEAD = forward

            def log_message(self, *_):
                pass

        class Server(http.server.ThreadingHTTPServer):
            daemon_threads = True

            def handle_error(self, *_):
                pass  # the other end has gone

        self.server = Server(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/sparql-graph-crud-auth"
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        self.blank = self.save()

    def __exit__(self, *arguments):
        self.server.shutdown()
        self.server.server_close()
        super().__exit__(*arguments)

    def take_methods(self):
        with self.lock:
            taken, self.methods = self.methods, []
        return taken

    def names(self):
        """Of the graphs of robots, and of their lists; a database has some of its own. Asked without a type, Virtuoso takes 17 s."""
        query = "SELECT DISTINCT ?g WHERE { { GRAPH ?g { ?s a ?o } } UNION { GRAPH ?g { ?s <http://purl.org/dc/terms/hasPart> ?o } } }"
        return [row["g"] for row in self.select(query) if row["g"].startswith("http://127.0.0.1:")]

    def target(self, name, endpoint):
        return f"http://127.0.0.1:{self.http}/{endpoint}?graph=" + urllib.parse.quote(name, safe="")

    def change(self, method, name, body=None):
        target = self.target(name, "sparql-graph-crud-auth")
        passwords = urllib.request.HTTPPasswordMgrWithDefaultRealm()
        passwords.add_password(None, target, self.user, self.password)
        opener = urllib.request.build_opener(urllib.request.HTTPDigestAuthHandler(passwords))
        with opener.open(urllib.request.Request(target, body, {"Content-Type": "text/turtle"}, method=method), timeout=60):
            pass

    def text(self, name):
        with urllib.request.urlopen(urllib.request.Request(self.target(name, "sparql-graph-crud"), headers={"Accept": "text/turtle"}), timeout=60) as response:
            return response.read().decode()

    def content(self):
        found = {}
        for name in self.names():
            try:
                found[name] = self.text(name)
            except urllib.error.HTTPError as error:  # a PUT is between deleting and inserting
                assert error.code == 404, error
        return found

    def put(self, name, turtle):
        self.change("PUT", name, turtle.encode())

    def delete(self, name):
        self.change("DELETE", name)

    def files(self, folder):
        return [os.path.join(folder, name) for name in os.listdir(folder) if name.startswith("v.") and name not in ("v.ini", "v.lck", "v.log")]

    def save(self):
        """Nobody writes: the file of the last checkpoint and the log of what came afterwards are a whole copy, without a stop."""
        copy = tempfile.mkdtemp(dir=self.folder)
        for file in self.files(self.folder):
            shutil.copy(file, copy)
        return copy

    def restore(self, saved):
        self.process.kill()  # what it would save is not wanted
        self.process.wait()
        self.log.close()
        for file in self.files(self.folder):
            os.remove(file)
        for file in self.files(saved):
            shutil.copy(file, self.folder)
        self.start()

    def empty(self):
        self.restore(self.blank)
