# SPDX-License-Identifier: Apache-2.0
"""A robot behind a cache of others with the configurations of examples/fleet_front: for fleet_front_test.py and tests/bench/fleet_front.py."""

import asyncio
import http.client
import os
import shutil
import socket
import ssl
import subprocess
import tempfile
import time
import urllib.parse

from robot_process import Program, configuration, free_port

HERE = os.path.dirname(os.path.abspath(__file__))
CONFIGURATIONS = os.path.join(HERE, "..", "..", "examples", "fleet_front")


def write(folder, name, text):
    path = os.path.join(folder, name)
    with open(path, "w") as file:
        file.write(text)
    return path


def certificate(folder):
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout", folder + "/server-key.pem",
                    "-out", folder + "/server.pem", "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"], check=True,
                   stderr=subprocess.DEVNULL)
    return ssl.create_default_context(cafile=folder + "/server.pem")


class Front:
    """nginx or Varnish with the user's configuration before robots on these ports, each below /cell7 or /cell8."""

    def __init__(self, name, seven=None, eight=None):
        self.name = name
        self.folder = tempfile.mkdtemp()
        os.chmod(self.folder, 0o755)  # Varnish runs as a user of its own
        self.port = free_port()
        self.tls = certificate(self.folder) if name == "nginx" else None
        self.ports = (seven or free_port(), eight or free_port())
        self.url = f"http{'s' if self.tls else ''}://localhost:{self.port}"
        self.process = self.log = None

    @staticmethod
    def is_installed(name):
        return shutil.which("nginx" if name == "nginx" else "varnishd") is not None

    def start(self, workers=1, connections=512):
        command = (self.nginx if self.name == "nginx" else self.varnish)(workers, connections)
        self.log = open(os.path.join(self.folder, "log"), "w+")
        self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log)
        end = time.monotonic() + 60
        while True:
            assert self.process.poll() is None and time.monotonic() < end, f"{self.name} does not start: {self.said()}"
            with socket.socket() as s:
                if s.connect_ex(("127.0.0.1", self.port)) == 0:
                    return
            time.sleep(0.02)

    def nginx(self, workers, connections):
        folder = self.folder
        write(folder, "robots.conf", configuration("fleet_front", "nginx.conf", ("listen 443 ssl", f"listen 127.0.0.1:{self.port} ssl"), ("robots.example;", "localhost;"),
                                                   ("/etc/ssl/robots/", folder + "/"), ("/var/cache/nginx/robots", folder + "/cache"),
                                                   ("127.0.0.1:8080", f"127.0.0.1:{self.ports[0]}"), ("127.0.0.1:8081", f"127.0.0.1:{self.ports[1]}")))
        places = "".join(f"  {kind}_temp_path {folder}/{kind};\n" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
        user = "user root;\n" if os.getuid() == 0 else ""
        main = (f"{user}daemon off;\nworker_processes {workers};\npid {folder}/pid;\nevents {{ worker_connections {connections}; }}\n"
                f"http {{\n  access_log off;\n{places}  include {folder}/robots.conf;\n}}\n")
        return ["nginx", "-p", folder, "-e", "stderr", "-c", write(folder, "main.conf", main)]

    def varnish(self, *_):
        text = configuration("fleet_front", "robots.vcl", ('.port = "8080"', f'.port = "{self.ports[0]}"'), ('.port = "8081"', f'.port = "{self.ports[1]}"'))
        path = write(self.folder, "robots.vcl", text)
        os.chmod(path, 0o644)
        os.mkdir(self.folder + "/varnish")
        jail = ["-j", "none"] if os.getuid() == 0 else []
        return ["varnishd", "-F", *jail, "-n", self.folder + "/varnish", "-f", path, "-a", f"127.0.0.1:{self.port}", "-s", "malloc,16m",
                "-p", "timeout_idle=60"]  # readers that pause keep their connections

    def said(self):
        self.log.flush()
        self.log.seek(0)
        return self.log.read()[-4000:]

    def get(self, path, method="GET", body=None, **headers):
        """Status, fields and body."""
        make = http.client.HTTPSConnection if self.tls else http.client.HTTPConnection
        connection = make("localhost", self.port, timeout=30, **({"context": self.tls} if self.tls else {}))
        try:
            connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
            response = connection.getresponse()
            return response.status, {name.lower(): value for name, value in response.getheaders()}, response.read().decode()
        finally:
            connection.close()

    def stop(self):
        if self.process:
            self.process.terminate()
            try:
                self.process.wait(30)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
            self.log.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()


class AgedRobot(Program):
    program = None

    def __init__(self, *arguments):
        super().__init__(AgedRobot.program, *arguments)
        self.port = None

    def direct(self, port, path, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        try:
            connection.request("GET", path, headers={"Accept": "text/plain", **headers})
            return connection.getresponse().read().decode()
        finally:
            connection.close()


async def read_repeatedly(front, path, seconds, pause, results):
    """One reader: a connection that is kept, and a request each `pause` seconds."""
    reader, writer = await asyncio.open_connection("localhost", front.port, ssl=front.tls)
    request = f"GET {path} HTTP/1.1\r\nHost: localhost:{front.port}\r\nAccept: text/plain\r\n\r\n".encode()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        writer.write(request)
        head = await reader.readuntil(b"\r\n\r\n")
        length = int(next(line.split(b":")[1] for line in head.split(b"\r\n") if line.lower().startswith(b"content-length:")))
        body = await reader.readexactly(length)
        results.append((int(head.split(b" ", 2)[1]), body))
        await asyncio.sleep(pause)
    writer.close()


def many_readers(front, path, count, seconds, pause=0.2):
    """Statuses and bodies that so many readers get."""
    results = []

    async def run():
        await asyncio.gather(*(read_repeatedly(front, path, seconds, pause, results) for _ in range(count)))

    asyncio.run(run())
    return results


def base(front, cell):
    return f"{front.url}/{cell}"


def parse(url):
    return urllib.parse.urlsplit(url)
