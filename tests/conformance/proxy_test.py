#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The baxter example behind the reverse proxies of others, with the configurations of examples/reverse_proxy.

usage: proxy_test.py [--transport NAME] NAME_OF_PROXY PATH_OF_BAXTER [WORD]...     only cases with one of the words

The proxy (nginx, haproxy or caddy) is a process of this test, on a free port of 127.0.0.1. It ends TLS. Each case is run three times: for
a public base without a path, and for one with a path that the proxy keeps in targets or removes. Exits with 77 if the proxy is not installed.
"""

import asyncio
import os
import re
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import traceback
import urllib.parse

sys.dont_write_bytecode = True  # nothing is left in the source tree
try:
    import websockets
except ImportError as missing:
    print(f"skipped: {missing}; apt-get install python3-websockets")
    sys.exit(77)
from event_streams_test import EventStream
from robot_process import LDP, LRT, PATIENCE, Receiver, Robot, Way, configuration, free_port, http_request, objects, plain, run_on_way, until

HERE = os.path.dirname(os.path.abspath(__file__))
THING = "baxter/right_s1"
POSITION = THING + "/position"
CASES = []


def case(function):
    CASES.append(function)
    return function


def nginx(folder, port, robot_port, prefix, keeps):
    changes = [("listen 443 ssl", f"listen 127.0.0.1:{port} ssl"), ("server_name robot.example", "server_name localhost"),
               ("127.0.0.1:8080", f"127.0.0.1:{robot_port}"), ("/etc/ssl/robot/", folder + "/")]
    if prefix:
        changes += [("location / {", f"location {prefix}/ {{")]
        changes += [] if keeps else [("proxy_pass http://robot;", "proxy_pass http://robot/;")]
    write(folder, "robot.conf", configuration("reverse_proxy", "nginx.conf", *changes))
    places = "".join(f"  {kind}_temp_path {folder}/{kind};\n" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
    user = "user root;\n" if os.getuid() == 0 else ""
    write(folder, "main.conf", f"{user}daemon off;\nworker_processes 1;\npid {folder}/pid;\nevents {{}}\nhttp {{\n  access_log off;\n{places}  include {folder}/robot.conf;\n}}\n")
    return ["nginx", "-p", folder, "-e", "stderr", "-c", folder + "/main.conf"]


def haproxy(folder, port, robot_port, prefix, keeps):
    with open(folder + "/server.pem") as certificate, open(folder + "/server-key.pem") as key:
        write(folder, "both.pem", certificate.read() + key.read())
    removes = f"\n  http-request replace-path {prefix}(/.*) \\1" if prefix and not keeps else ""
    write(folder, "haproxy.cfg", configuration("reverse_proxy", "haproxy.cfg", ("bind :443", f"bind 127.0.0.1:{port}"), ("/etc/haproxy/robot.pem", folder + "/both.pem"),
                                               ("server robot 127.0.0.1:8080", f"server robot 127.0.0.1:{robot_port}{removes}")))
    return ["haproxy", "-db", "-f", folder + "/haproxy.cfg"]


def caddy(folder, port, robot_port, prefix, keeps):
    begin, end = (f"{'handle' if keeps else 'handle_path'} {prefix}/* {{\n", "}\n") if prefix else ("", "")
    own = f"{{\nadmin off\nauto_https off\nstorage file_system {folder}/storage\n}}\n"
    write(folder, "Caddyfile", own + configuration("reverse_proxy", "Caddyfile", ("robot.example {", f"https://localhost:{port} {{\nbind 127.0.0.1"), ("/etc/ssl/robot/", folder + "/"),
                                                   ("reverse_proxy 127.0.0.1:8080", f"{begin}reverse_proxy 127.0.0.1:{robot_port}"), ("\t}\n}", "\t}\n" + end + "}")))
    return ["caddy", "run", "--adapter", "caddyfile", "--config", folder + "/Caddyfile"]


def write(folder, name, text):
    with open(os.path.join(folder, name), "w") as file:
        file.write(text)


class Proxy:
    """The program that stands between client and robot."""

    def __init__(self, make, folder, port, robot_port, prefix, keeps):
        self.log = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(make(folder, port, robot_port, prefix, keeps), stdin=subprocess.DEVNULL, stdout=self.log, stderr=self.log,
                                        env={**os.environ, "HOME": folder, "XDG_DATA_HOME": folder, "XDG_CONFIG_HOME": folder})
        try:
            until(lambda: self.accepts(port), "the proxy listens")
        except BaseException:
            self.__exit__()
            raise

    def accepts(self, port):
        if self.process.poll() is not None:
            self.log.seek(0)
            raise AssertionError(f"the proxy ended with {self.process.returncode}: {self.log.read()}")
        with socket.socket() as s:
            return s.connect_ex(("127.0.0.1", port)) == 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


class ProxiedRobot(Robot):
    """baxter with a public base; requests go to the proxy there."""

    def __init__(self, base, *arguments):
        super().__init__("--public-base", base, *arguments)
        self.direct_port = self.port
        self.url = base + "/"


def put(robot, number, **headers):
    return http_request("PUT", robot.at(POSITION), str(number), {"Content-Type": "application/json", **{k.replace("_", "-"): v for k, v in headers.items()}})


@case
def all_iris_are_below_the_public_base_and_lead_back_to_the_robot(robot):
    seen, open_ = set(), [robot.url]
    while open_:
        iri = open_.pop()
        answer = robot.get(iri, Accept="application/n-triples").expect(200)
        found = [plain(o) for p in (LDP + "contains", "http://purl.org/dc/terms/hasPart", "https://hybr-it-projekt.de/ns/hybr-it#property",
                                    "https://hybr-it-projekt.de/ns/hybr-it#action", "https://hybr-it-projekt.de/ns/hybr-it#blueprint", LRT + "state")
                 for o in objects(answer.body, p)]
        linked = re.findall(r'<([^>]*)>; rel="(?:up|related|alternate|describedby)"', answer.field("Link"))
        assert linked, answer
        for target in found + linked:
            assert target.startswith(robot.url), f"{iri} names {target}"
        open_ += [target for target in found if target not in seen]
        seen.update(found)
    assert robot.at(POSITION) in seen and len(seen) > 20, seen
    assert robot.get("ns/context.jsonld").status == robot.get("ns/lrt").status == 200
    page = robot.get(THING, Accept="text/html").expect(200)
    assert page.field("Content-Type").startswith("text/html") and "script-src" in page.field("Content-Security-Policy"), page


@case
def a_property_is_written_once_by_each_tag(robot):
    before = robot.get(POSITION).expect(200)
    put(robot, 0.25, If_Match=before.field("ETag")).expect(204)
    assert until(lambda: (now := robot.get(POSITION)).field("ETag") != before.field("ETag") and now, "the joint moves")
    put(robot, 0.5, If_Match=before.field("ETag")).expect(412)
    last = robot.get(POSITION, If_None_Match=before.field("ETag"))
    assert last.status == 200, last
    put(robot, '"far"').expect(422)


@case
def an_action_has_a_location_below_the_public_base(robot):
    done = robot.rotate("right_s1", 10)
    assert done.status in (202, 204), done
    assert done.field("Location").startswith(robot.at(THING + "/actions/rotate/")), done
    robot.get(done.field("Location")).expect(200)


@case
def waiting_for_an_action_is_not_cut_short(robot):
    waited = robot.rotate("right_s1", 20, Prefer="wait=30")
    assert waited.status in (200, 202, 204), waited


@case
def a_body_that_is_too_large_gets_the_robots_response(robot):
    refused = http_request("PUT", robot.at(POSITION), "1" * (1024 * 1024 + 1), {"Content-Type": "application/json"})
    assert refused.expect(413).field("Content-Type") == "application/problem+json", refused
    robot.get(POSITION).expect(200)


@case
def another_host_is_refused(robot):
    for host in ("evil.example", "evil.example:443", f"localhost.evil.example:{robot.port}"):
        answer = robot.get(POSITION, Host=host)
        # Caddy selects the site by Host, and so responds by itself, with an empty body.
        assert answer.status == 421 or (robot.proxy == "caddy" and answer.status == 200 and not answer.body), answer
    # Another port of this machine may be forwarded here; the document has the public base.
    assert f"<{robot.at(POSITION)}>" in robot.get(POSITION, Host="localhost:1", Accept="application/n-triples").expect(200).body
    direct = f"http://127.0.0.1:{robot.direct_port}/{POSITION}"
    http_request("GET", direct, headers={"Host": "evil.example"}).expect(421)
    local = http_request("GET", direct, headers={"Accept": "application/n-triples"}).expect(200)
    assert f"<{robot.at(POSITION)}>" in local.body, local


@case
def pages_of_the_robot_may_send_commands_and_others_may_not(robot):
    parts = urllib.parse.urlsplit(robot.url)
    put(robot, 0.1, Origin=f"{parts.scheme}://{parts.netloc}").expect(204)
    put(robot, 0.2, Origin="https://evil.example").expect(403)


@case
def a_websocket_passes(robot):
    async def run():
        trust = {"ssl": Way.context, "compression": None, "open_timeout": PATIENCE, "close_timeout": PATIENCE}
        async with websockets.connect("wss" + robot.at(POSITION)[5:], **trust) as ws:
            location = ws.response_headers["Location"]
            assert location.startswith(robot.at(THING + "/subscriptions/")), location
            first = await asyncio.wait_for(ws.recv(), PATIENCE)
            assert f"<{robot.at(POSITION)}>" in first or "@prefix" in first, first
            await asyncio.to_thread(lambda: put(robot, 0.7).expect(204))
            assert await asyncio.wait_for(ws.recv(), PATIENCE) != first
            robot.get(location).expect(200)
        until(lambda: robot.get(location).status == 404, "the subscription ends with the socket")

    asyncio.run(run())


@case
def a_handshake_of_another_version_is_told_the_version(robot):
    fields = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "8", "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    answer = robot.get(POSITION, **fields).expect(426)
    assert answer.field("Sec-WebSocket-Version") == "13", answer


@case
def events_arrive_while_the_stream_is_open(robot):
    with EventStream(robot, POSITION + "?accept=application/json") as stream:
        assert stream.status == 200
        assert stream.response.headers["Location"].startswith(robot.at(THING + "/subscriptions/"))
        tag, value = stream.event()
        put(robot, -0.3 if float(value) > 0 else 0.3).expect(204)
        assert stream.event()[0] != tag


@case
def a_callback_is_made_and_names_the_public_base(robot):
    with Receiver() as receiver:
        made = robot.call_back(POSITION, receiver.url, Connection="Upgrade").expect(201)
        assert made.field("Location").startswith(robot.at(THING + "/subscriptions/")), made
        request = receiver.wait()[0]
        assert any(target.startswith(robot.url) for target in request.links().values()), request.links()
        http_request("DELETE", made.field("Location")).expect(204)


@case
def many_clients_of_the_proxy_are_served(robot):
    """The proxy has one address, but limits.max_connections_per_address does not count this machine's."""
    streams = []
    try:
        for _ in range(40):
            streams.append(EventStream(robot, POSITION))
        assert all(stream.status == 200 and stream.event() for stream in streams)
        robot.get(POSITION).expect(200)
    finally:
        for stream in streams:
            stream.close()


def main(words):
    name, Robot.program, wanted = words[0], words[1], words[2:]
    os.environ["PATH"] += os.pathsep + "/usr/sbin"
    if not shutil.which(name):
        print(f"skipped: {name} is not installed (vendor/install.sh proxies)")
        return 77
    make = {"nginx": nginx, "haproxy": haproxy, "caddy": caddy}[name]
    failed = 0
    for prefix, keeps in (("", True), ("/cell7", True), ("/cell7", False)):
        way = "no path" if not prefix else "a path that the proxy keeps" if keeps else "a path that the proxy removes"
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([os.path.join(HERE, "..", "..", "examples", "make-certificate.sh"), folder], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            os.chmod(folder, 0o755)
            Way.context = ssl.create_default_context(cafile=os.path.join(folder, "ca.pem"))
            port = free_port()
            with ProxiedRobot(f"https://localhost:{port}{prefix}") as robot:
                robot.port, robot.proxy = port, name
                with Proxy(make, folder, port, robot.direct_port, prefix, keeps):
                    for run in CASES:
                        if wanted and not any(word in run.__name__ for word in wanted):
                            continue
                        try:
                            run(robot)
                            print(f"{run.__name__}, {way}: ok", flush=True)
                        except Exception:  # whatever it is, the others are run
                            failed += 1
                            print(f"{run.__name__}, {way}: FAILED\n{traceback.format_exc()}", flush=True)
    print(f"{failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(run_on_way(main, usage="proxy_test.py [--transport NAME] nginx|haproxy|caddy PATH_OF_BAXTER [WORD_OF_A_CASE...]"))
