#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`lrt check` on servers that are not lrt's: the findings must be what these servers really do.

    check_others_test.py LRT DIR

Python's http.server with files in Turtle, and the Community Solid Server, an LDP server, which npm installs once in DIR. Without node, npm or its
registry the second part is left out, and the reason is printed.
"""
import functools
import http.server
import json
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request

SOLID = "@solid/community-server@7.2.0"
INSTALL_TIMEOUT = 400  # seconds
START_TIMEOUT = 60
CHECK_TIMEOUT = 150

PREFIXES = "@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix ldp: <http://www.w3.org/ns/ldp#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix dcterms: <http://purl.org/dc/terms/> .\n"
FILES = {"arm.ttl": '<> a hybrit:RoboticThing ; rdfs:label "arm" ; dcterms:title "arm" ; rdfs:seeAlso <angle.ttl> ; hybrit:property <angle.ttl> ; hybrit:subscriptions <subscriptions.ttl> .',
         "angle.ttl": '<> a hybrit:Property ; rdfs:label "angle" .', "subscriptions.ttl": "<> a ldp:BasicContainer ."}


def check(lrt, url, *, passes, fails, only=False):
    """`only`: no other `must` has failed. `http.` is not counted there: versions of the servers differ."""
    def run(form):
        return subprocess.run([lrt, "check", url, "--format", form, "--for", "100"], capture_output=True, text=True, timeout=CHECK_TIMEOUT, check=False)
    done = run("json")
    assert done.returncode == 1, (done.returncode, done.stderr)
    report = json.loads(done.stdout)
    of = {f["id"]: f for f in report["findings"]}
    failed = {i for i, f in of.items() if f["outcome"] == "fail"}
    print(f"{url} ({report['product']}): {len(report['resources'])} resources, {report['requests']} requests, {len(failed)} failed: {', '.join(sorted(failed))}")
    for name in passes:
        assert of[name]["outcome"] == "pass", (name, of[name])
    for name in fails:
        assert of[name]["outcome"] == "fail" and of[name]["evidence"], (name, of[name])
    if only:
        more = {i for i in failed - set(fails) if of[i]["level"] == "must" and not i.startswith("http.")}
        assert not more, {i: of[i]["detail"] for i in more}
    assert not report["is_robotic_thing"] and not report["is_linked_robotic_thing"]
    earl = run("earl").stdout
    assert earl.count("a earl:Assertion") == len(of), earl[:2000]
    try:
        import rdflib
    except ImportError:
        print("  rdflib is not installed, and EARL was not read by others")
    else:
        graph = rdflib.Graph().parse(data=earl, format="turtle")
        outcome = rdflib.URIRef("http://www.w3.org/ns/earl#outcome")
        assert len(list(graph.subject_objects(outcome))) == len(of)


def static_files(lrt):
    class Handler(http.server.SimpleHTTPRequestHandler):
        extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".ttl": "text/turtle"}

        def log_message(self, *_):
            pass

    with tempfile.TemporaryDirectory() as folder:
        for name, text in FILES.items():
            pathlib.Path(folder, name).write_text(PREFIXES + text)
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=folder)) as server:
            thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
            thread.start()
            check(lrt, f"http://127.0.0.1:{server.server_port}/arm.ttl", only=True,
                  passes=("root.get", "methods.get", "uri.get", "uri.named", "status.not-found", "rdf.turtle", "rdf.accept-turtle", "rdf.valid", "rdf.type",
                          "subscriptions.triple", "subscriptions.container", "property.triples", "rdf.vocabularies", "metadata", "http.head", "http.date"),
                  fails=("http.version", "http.host-missing", "link.related", "options.success", "etag.get", "ws.handshake", "callback.created"))
            server.shutdown()


def installed(folder):
    if not shutil.which("node") or not shutil.which("npm"):
        return "there is no node, or no npm"
    if (folder / "node_modules" / "@solid" / "community-server" / "package.json").exists():
        return None
    folder.mkdir(parents=True, exist_ok=True)
    command = ["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", SOLID]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=INSTALL_TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        return f"npm has not installed it in {INSTALL_TIMEOUT} s"
    return None if done.returncode == 0 else "npm cannot install it: " + done.stderr.strip()[-300:]


def solid_server(lrt, folder):
    reason = installed(folder)
    if reason:
        print("the Community Solid Server is left out: " + reason)
        return
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    url = f"http://127.0.0.1:{port}/"
    with tempfile.TemporaryFile("w+") as log:
        script = folder / "node_modules" / "@solid" / "community-server" / "bin" / "server.js"
        server = subprocess.Popen(["node", str(script), "-p", str(port), "-b", url, "-c", "@css:config/default.json"], stdout=log, stderr=log, cwd=folder)
        try:
            end = time.monotonic() + START_TIMEOUT
            while True:
                try:
                    urllib.request.urlopen(url, timeout=5).read()
                    break
                except OSError as error:
                    if server.poll() is not None or time.monotonic() > end:
                        log.seek(0)
                        print(f"the Community Solid Server is left out: it does not start: {error} {re.sub(chr(27) + '[^m]*m', '', log.read())[-500:]}")
                        return
                time.sleep(0.1)
            # An LDP server: representations, entity tags and containers are right; what is of Robotic Things is missing.
            check(lrt, url,
                  passes=("root.get", "methods.get", "status.not-found", "rdf.turtle", "rdf.accept-turtle", "rdf.valid", "rdf.type",
                          "negotiate.accept", "negotiate.quality", "negotiate.vary", "etag.get", "etag.head", "etag.304", "etag.stable", "etag.media-types",
                          "http.version", "http.framing", "http.persistent", "http.pipelining", "http.host-missing", "http.two-lengths", "ws.accept"),
                  fails=("subscriptions.triple", "ws.handshake", "callback.created", "options.allow"))
        finally:
            server.terminate()
            server.wait(20)


def main():
    lrt, folder = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
    static_files(lrt)
    solid_server(os.path.abspath(lrt), folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
