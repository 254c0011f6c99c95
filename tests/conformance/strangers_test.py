#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The command `lrt` on servers that are not lrt's: what they have is listed, read, watched, written and commanded.

    strangers_test.py LRT DIR

`paper_server.py` was written from the text of the paper alone, by somebody who has not seen lrt. Besides: Python's http.server with files, Express and the Community Solid Server,
which npm installs once in DIR. Without node, npm or its registry these two are left out, and the reason is printed.
"""
import contextlib
import functools
import http.server
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import urllib.request

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from robot_process import free_port, until  # noqa: E402

PACKAGES = ("@solid/community-server@7.2.0", "express@4.21.2")
PATIENCE = 60  # seconds
LRT, DIR = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2]).resolve()
HERE = pathlib.Path(__file__).resolve().parent

EXPRESS = """
const app = require('express')(); app.use(require('express').json({strict: false}));
let level = 4; const links = {'/': '/lamp', '/lamp': '/lamp/level'};
app.use((q, a, next) => { if (links[q.path]) a.set('Link', `<${links[q.path]}>; rel="related"`); next(); });
app.get('/', (q, a) => a.json(['lamp'])); app.get('/lamp', (q, a) => a.json({name: 'lamp'}));
app.route('/lamp/level').all((q, a, next) => { a.set('Allow', 'GET, HEAD, PUT'); next(); })
  .get((q, a) => a.json(level)).put((q, a) => { if (typeof q.body !== 'number') return a.status(422).json({title: 'expected a number'}); level = q.body; a.status(204).end(); });
const server = app.listen(+process.argv[1], '127.0.0.1');
"""


def lrt(url, *words, fails=None):
    """What it prints; `fails`: a part of what it says when it does not succeed."""
    done = subprocess.run([LRT, *words], capture_output=True, text=True, timeout=PATIENCE, env={**os.environ, "LRT_ROBOT": url}, check=False)
    if fails is not None:
        assert done.returncode != 0 and fails in done.stderr, (words, done)
        return done.stderr
    assert done.returncode == 0, (words, done)
    return done.stdout


def column(text, number=0):
    return [line.split("\t")[number] for line in text.splitlines()]


def watched(url, name, change, before, after):
    """The value before and after a change are reported, by the protocol that the server has."""
    watch = subprocess.Popen([LRT, "watch", name, "--json"], stdout=subprocess.PIPE, text=True, env={**os.environ, "LRT_ROBOT": url})
    watchdog = threading.Timer(PATIENCE, watch.kill)
    watchdog.start()
    try:
        assert before in watch.stdout.readline()
        change()
        for line in watch.stdout:
            if after in line:
                return
        raise AssertionError(f"{name}: the watch has ended without {after}")
    finally:
        watchdog.cancel()
        watch.terminate()
        watch.wait(20)


def from_the_paper():
    with subprocess.Popen([sys.executable, "-B", str(HERE / "paper_server.py"), "--port", "0"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:
        try:
            url = server.stdout.readline().strip()
            assert column(lrt(url, "ls")) == ["arm", "joint1", "joint2"]
            parts = column(lrt(url, "ls", "joint1"))
            assert {"rotation", "speedLimit", "turn()"} <= set(parts), parts
            assert json.loads(lrt(url, "get", "joint1/position"))["rotationAngle"]["numericalValue"] == 0
            assert json.loads(lrt(url, "get", "joint1/speedLimit"))["numericalValue"] == 25
            lrt(url, "set", "joint1/speedLimit", "3")
            assert json.loads(lrt(url, "get", "joint1/speedLimit"))["numericalValue"] == 3
            lrt(url, "set", "joint1/speedLimit", "-3", fails="400")
            with tempfile.TemporaryDirectory() as folder:
                def target(angle):
                    file = pathlib.Path(folder, "target.ttl")
                    file.write_text("@prefix vom: <http://vocab.arvida.de/2015/06/vom#> . @prefix maths: <http://vocab.arvida.de/2015/06/maths#> .\n"
                                    f"<> a maths:Scalar ; vom:numericalValue {angle} ; vom:unit maths:Radian .\n")
                    return "@" + str(file)
                lrt(url, "invoke", "joint1/turn", target(1.5))  # it ends, although the server states no status that lrt knows
                until(lambda: json.loads(lrt(url, "get", "joint1/position"))["rotationAngle"]["numericalValue"] == 1.5 or None, "the joint is there", PATIENCE)
                lrt(url, "invoke", "joint1/turn", target(7), fails="400")
                watched(url, "joint2/position", lambda: lrt(url, "invoke", "joint2/turn", target(-1)), ":0", "-1")
        finally:
            server.stdin.close()
            server.wait(20)
    print("paper_server.py: 3 Things, read, written, watched, 2 commands that ended and one that was refused")


def static_files():
    class Handler(http.server.SimpleHTTPRequestHandler):
        extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".ttl": "text/turtle"}

        def log_message(self, *_):
            pass

    with tempfile.TemporaryDirectory() as folder:
        angle = pathlib.Path(folder, "angle.ttl")
        pathlib.Path(folder, "arm.ttl").write_text("<> <http://example.org/angle> <angle.ttl> .")
        angle.write_text("<> <http://example.org/value> 5 .")
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=folder)) as server:
            threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
            url = f"http://127.0.0.1:{server.server_port}/arm.ttl"
            assert column(lrt(url, "ls")) == ["arm.ttl"]
            assert column(lrt(url, "ls", "arm.ttl")) == ["angle"]
            assert "5" in lrt(url, "get", "angle")
            watched(url, "angle", lambda: angle.write_text("<> <http://example.org/value> 6 . # longer"), "5", "6")
            lrt(url, "set", "angle", "7", fails="cannot be written")
            server.shutdown()
    print("http.server: one Thing, read and watched")


def missing_packages():
    if not shutil.which("node") or not shutil.which("npm"):
        return "there is no node, or no npm"
    if all((DIR / "node_modules" / package.rsplit("@", 1)[0] / "package.json").exists() for package in PACKAGES):
        return None
    DIR.mkdir(parents=True, exist_ok=True)
    command = ["npm", "install", "--prefix", str(DIR), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", *PACKAGES]
    try:
        done = subprocess.run(command, cwd=DIR, capture_output=True, text=True, timeout=400, check=False)
    except subprocess.TimeoutExpired:
        return "npm has not installed them in 400 s"
    return None if done.returncode == 0 else "npm cannot install them: " + done.stderr.strip()[-300:]


@contextlib.contextmanager
def node(url, *command):
    server = subprocess.Popen(["node", *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=DIR)

    def responds():
        assert server.poll() is None, "the server has ended"
        with contextlib.suppress(OSError):
            return urllib.request.urlopen(url, timeout=5)
        return None

    try:
        until(responds, "the server responds", 2 * PATIENCE)
        yield
    finally:
        server.terminate()
        server.wait(20)


def express():
    port = free_port()
    url = f"http://127.0.0.1:{port}/"
    with node(url, "-e", EXPRESS, str(port)):
        assert column(lrt(url, "ls")) == ["lamp"]
        assert column(lrt(url, "ls", "lamp")) == ["level"]
        assert lrt(url, "get", "level").strip() == "4"
        lrt(url, "set", "level", "5")
        assert lrt(url, "get", "level").strip() == "5"
        lrt(url, "set", "level", "dim", fails="expected")
    print("Express: one Thing by its links, JSON read and written")


def solid():
    port = free_port()
    url = f"http://localhost:{port}/"
    with node(url, str(DIR / "node_modules/@solid/community-server/bin/server.js"), "-p", str(port), "--loggingLevel", "error"):
        def send(path, turtle):
            request = urllib.request.Request(url + path, turtle.encode(), {"Content-Type": "text/turtle"}, method="PUT")
            urllib.request.urlopen(request, timeout=20).close()
        send("arm", "<> a <http://example.org/Arm> ; <http://example.org/weight> </weight> .")
        document = '<> <http://example.org/maker> "Ada" ; <http://qudt.org/schema/qudt/numericValue> %s ; <http://example.org/limits> [ <http://example.org/low> 1 ] .'
        send("weight", document % 12)
        assert "weight" in column(lrt(url + "arm", "ls", "arm"))
        lrt(url + "arm", "set", "weight", "13")
        now = urllib.request.urlopen(urllib.request.Request(url + "weight", headers={"Accept": "text/turtle"}), timeout=20).read().decode()
        assert re.search(r"numericValue>? \"?13", now) and "Ada" in now and re.search(r"low>? \"?1", now), now
        watched(url + "arm", "weight", lambda: send("weight", document % 14), "13", "14")
    print("Community Solid Server: one Thing, a value written beside the others of its document, watched without its WebSockets")


def main():
    from_the_paper()
    static_files()
    reason = missing_packages()
    if reason:
        print("Express and the Community Solid Server are left out: " + reason)
        return 77
    express()
    solid()
    return 0


if __name__ == "__main__":
    sys.exit(main())
