#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What clients of the web send by themselves is understood: default Accept fields, queries by POST from pages, a forwarded port.

    web_clients_test.py BAXTER DIR

axios comes from npm, which installs it once in DIR; fetch is that of Node. Without node, npm or its registry this part is left out, and the reason is printed. The other requests
are the bytes that the clients send.
"""
import json
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import threading

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from robot_process import Program, http_request  # noqa: E402

DIR = pathlib.Path(sys.argv[2]).resolve()
PACKAGE = "axios@1.7.9"
PAGE = "http://page.example"
FRICTION = "baxter/right_s1/friction"
QUERY = "query=SELECT%20%3Fs%20%7B%20%3Fs%20a%20%3Chttp%3A%2F%2Fros.org%2F%23Joint%3E%20%7D"
FORM = {"Content-Type": "application/x-www-form-urlencoded"}

CLIENTS = """
const axios = require('axios'), url = process.argv[1], seen = {};
(async () => {
  seen.axios = (await axios.get(url)).data;
  await axios.put(url, 1.5, {headers: {'Content-Type': 'application/json'}});
  seen.put = (await axios.get(url)).data;
  const got = await fetch(url);
  seen.fetch = [got.status, got.headers.get('content-type')];
  seen.json = await (await fetch(url, {headers: {Accept: 'application/json'}})).json();
  seen.written = (await fetch(url, {method: 'PUT', headers: {'Content-Type': 'application/json'}, body: '2e0'})).status;
  console.log(JSON.stringify(seen));
})();
"""


class Forwarder:
    """Another port of this machine that leads to the robot, as `ssh -L` makes one."""

    def __init__(self, port):
        self.to = port
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.port = self.listening.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                client, _ = self.listening.accept()
            except OSError:
                return
            robot = socket.create_connection(("127.0.0.1", self.to))
            for source, sink in ((client, robot), (robot, client)):
                threading.Thread(target=self.pump, args=(source, sink), daemon=True).start()

    @staticmethod
    def pump(source, sink):
        try:
            while data := source.recv(65536):
                sink.sendall(data)
            sink.shutdown(socket.SHUT_WR)
        except OSError:
            pass


def default_fields(robot):
    for accept, wanted in (("application/json, text/plain, */*", "application/json"),  # axios, Angular
                           ("*/*", "text/turtle"),  # curl, requests, aiohttp, fetch
                           ("application/ld+json, */*;q=0.1", "application/ld+json"),
                           ("text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8", "text/html")):  # browsers
        answer = robot.get(FRICTION, Accept=accept).expect(200)
        assert answer.field("Content-Type").startswith(wanted), (accept, answer.field("Content-Type"))
    for number in ("1.0", "1e0", "10E-1", "1"):
        http_request("PUT", robot.at(FRICTION), number, {"Content-Type": "application/json"}).expect(204)


def queries(robot):
    """As YASGUI and Comunica send them from a page of another origin."""
    for accept in ("application/sparql-results+json,*/*;q=0.9", "application/sparql-results+json;q=1.0,application/sparql-results+xml;q=0.7"):
        answer = http_request("POST", robot.at("sparql"), QUERY, {**FORM, "Accept": accept, "Origin": PAGE}).expect(200)
        assert len(json.loads(answer.body)["results"]["bindings"]) >= 7, answer.body
        assert answer.field("Access-Control-Allow-Origin") in ("*", PAGE)
    preflight = http_request("OPTIONS", robot.at("sparql"), None, {"Origin": PAGE, "Access-Control-Request-Method": "POST",
                                                                   "Access-Control-Request-Headers": "content-type"})
    assert preflight.status in (200, 204) and "POST" in preflight.field("Access-Control-Allow-Methods"), preflight
    http_request("POST", robot.at("baxter/right_s1/actions/rotate"), "1", {"Content-Type": "application/json", "Origin": PAGE}).expect(403)
    http_request("PUT", robot.at(FRICTION), "1", {"Content-Type": "application/json", "Origin": PAGE}).expect(403)


def forwarded(robot):
    forwarder = Forwarder(robot.port)
    try:
        there = f"http://127.0.0.1:{forwarder.port}/"
        answer = http_request("GET", there + FRICTION, None, {"Accept": "application/n-triples"}).expect(200)
        assert f"<{there}{FRICTION}>" in answer.body
        put = {"Content-Type": "application/json"}
        http_request("PUT", there + FRICTION, "1", {**put, "Origin": there.rstrip("/")}).expect(204)
        http_request("PUT", there + FRICTION, "1", {**put, "Origin": robot.url.rstrip("/")}).expect(403)
        http_request("GET", there + FRICTION, None, {"Host": f"evil.example:{forwarder.port}"}).expect(421)
    finally:
        forwarder.listening.close()


def missing():
    if not shutil.which("node") or not shutil.which("npm"):
        return "there is no node, or no npm"
    if (DIR / "node_modules/axios/package.json").exists():
        return None
    DIR.mkdir(parents=True, exist_ok=True)
    try:
        done = subprocess.run(["npm", "install", "--prefix", str(DIR), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", PACKAGE], cwd=DIR, capture_output=True,
                              text=True, timeout=300, check=False)
    except subprocess.TimeoutExpired:
        return "npm has not installed axios in 300 s"
    return None if done.returncode == 0 else "npm cannot install axios: " + done.stderr.strip()[-300:]


def scripts(robot):
    done = subprocess.run(["node", "-e", CLIENTS, robot.at(FRICTION)], cwd=DIR, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    seen = json.loads(done.stdout)
    assert isinstance(seen["axios"], (int, float)) and seen["put"] == 1.5 and seen["json"] == 1.5, seen
    assert seen["fetch"] == [200, "text/turtle"] and seen["written"] == 204, seen


def main():
    with Program(os.path.abspath(sys.argv[1]), "--port", "0", "--cors", "*") as robot:
        default_fields(robot)
        queries(robot)
        forwarded(robot)
        print("fields of curl, browsers, axios and Angular; queries of pages; a forwarded port: as they expect")
        reason = missing()
        if reason:
            print("axios and fetch are left out: " + reason)
            return 77
        scripts(robot)
        print("axios and fetch read and write")
    return 0


if __name__ == "__main__":
    sys.exit(main())
