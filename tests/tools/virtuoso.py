# SPDX-License-Identifier: Apache-2.0
"""Virtuoso (Debian: virtuoso-opensource-7) as a store of a test: a database of its own in a folder, on free ports of 127.0.0.1."""

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
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
    with socket.create_server(("127.0.0.1", 0)) as s:
        return s.getsockname()[1]


class Virtuoso:
    user, password = "dba", "dba"  # of a new database

    def __init__(self, folder, patience=120):
        self.folder, self.http = folder, free_port()
        ini = os.path.join(folder, "v.ini")
        with open(ini, "w") as file:
            file.write(INI.format(folder=folder, sql=free_port(), http=self.http))
        self.log = open(os.path.join(folder, "out"), "w+")
        self.process = subprocess.Popen(["virtuoso-t", "+foreground", "+configfile", ini], cwd=folder, stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)
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
        self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.log.close()
