# SPDX-License-Identifier: Apache-2.0
"""The command lrt against the baxter example and a hostile robot: the tour of docs/command.md, errors, pipes, servers that die, terminals, completion.

usage: command_test.py LRT BAXTER SOURCE_DIR MOBILE_BASE
"""

import contextlib
import fcntl
import http.server
import json
import os
import pty
import re
import select
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import threading
import time
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from graph_store import GraphStore  # noqa: E402
from robot_process import PATIENCE, Program, Receiver, Robot, http_request, until  # noqa: E402

LRT = SOURCE = MOBILE_BASE = None
CACHE = tempfile.TemporaryDirectory()  # of what robots are
LONG = "-120"  # degrees: to the other end of the joint's range, two seconds
UUID = r"[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}"


def environment(url=None, **more):
    names = ("LRT_ROBOT", "LRT_TOKEN_FILE", "LRT_PASSWORD", "NO_COLOR", "LC_CTYPE", "LANG")
    env = {k: v for k, v in os.environ.items() if k not in names}
    env.update({"XDG_CACHE_HOME": CACHE.name, "LC_ALL": "C.UTF-8", "TERM": "xterm-256color", "PATH": os.path.dirname(LRT) + ":" + env["PATH"]}, **more)
    if url:
        env["LRT_ROBOT"] = url
    return env


class Done:
    def __init__(self, status, out, err):
        self.status, self.out, self.err = status, out, err

    def __repr__(self):
        return f"status {self.status}\nstdout: {self.out!r}\nstderr: {self.err!r}"


def lrt(url, *words, stdin=None, **env):
    done = subprocess.run([LRT, *words], input=stdin, capture_output=True, text=True, timeout=60, env=environment(url, **env))
    return Done(done.returncode, done.stdout, done.stderr)


def expect(done, status, out=None, err=None):
    assert done.status == status, f"expected status {status}: {done}"
    if out is not None:
        assert re.fullmatch(out, done.out, re.S), f"expected on stdout {out!r}: {done}"
    if err is not None:
        assert re.fullmatch(err, done.err, re.S), f"expected on stderr {err!r}: {done}"
    return done


def expect_error(done, status, err):
    """One sentence on stderr, nothing on stdout."""
    expect(done, status, "", "lrt: [^\n]*\n")
    assert re.search(err, done.err), f"expected {err!r}: {done}"


# --- the tour


def pattern(expected):
    """Of a line of the tour: "…" stands for anything but a line feed."""
    return ".*".join(re.escape(part) for part in expected.split("…"))


def tour():
    with open(os.path.join(SOURCE, "docs", "command.md")) as file:
        lines = file.read().split("\n")
    steps, inside = [], False
    for line in lines:
        if line.startswith("```"):
            inside = line == "```console"
        elif inside and line.startswith("$ "):
            steps.append((line[2:], []))
        elif inside:
            steps[-1][1].append(line)
    assert len(steps) > 30, "docs/command.md has lost its tour"
    with Robot() as robot, GraphStore() as store, tempfile.TemporaryDirectory() as folder:
        env = environment()
        # The URLs of the tour, and their names as parameters.
        places = [("http://127.0.0.1:8080/", robot.url), ("http://127.0.0.1:3030/robots/data", store.url),
                  ("http%3A%2F%2F127.0.0.1%3A8080%2F", urllib.parse.quote(robot.url, safe=""))]
        for command, expected in steps:
            if match := re.fullmatch(r"export (\w+)=(\S+)", command):
                env[match[1]] = match[2].replace("http://127.0.0.1:8080/", robot.url)
                continue
            for ours, theirs in places:
                command = command.replace(ours, theirs)
            done = subprocess.run(["bash", "-c", command], env=env, cwd=folder, text=True, timeout=60,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            found = done.stdout.replace(robot.url, "http://127.0.0.1:8080/")
            wanted = "".join(line + "\n" for line in expected)
            assert re.fullmatch(pattern(wanted), found), f"$ {command}\nexpected:\n{wanted}\nfound:\n{found}"


# --- errors, options


def errors():
    with Robot() as robot:
        url = robot.url
        expect_error(lrt(None, "ls"), 2, "no robot is given")
        expect_error(lrt(url), 2, "a command is missing")
        expect_error(lrt(url, "fly"), 2, 'there is no command "fly"')
        expect_error(lrt(url, "get", "right_s1/position", "--unit", "furlong"), 1, "furlong")
        expect_error(lrt(url, "get", "position"), 1, "ambiguous")
        expect_error(lrt(url, "get", "right_s1/position", "--accept", "image/png"), 1, "406")
        expect_error(lrt(url, "set", "right_s1/friction", "fast"), 1, "expected a number, found \"fast\"")
        expect_error(lrt(url, "set", "right_s1/friction", "1.5 parsec"), 1, "parsec")
        expect_error(lrt(url, "set", "right_s1/friction", "@/no/such/file"), 2, "No such file")
        expect_error(lrt(url, "set", "right_s1/friction", "<> a 1", "--type", "text/turtle"), 1, "expected")
        expect_error(lrt(url, "invoke", "right_s1/rotate"), 1, "takes a number in deg, from -123.01 to 59.98")
        expect_error(lrt(url, "invoke", "--cancel", robot.at("baxter/nothing")), 1, "404")
        judged = lrt(url, "validate", "right_s1/rotate", '{"value": 400, "unit": "deg"}')  # JSON by its form; each fault once
        assert judged.status == 1 and judged.out.count("\n") == 1 and "expected at most 59.98, found 400" in judged.out, judged
        expect_error(lrt(url, "ls", "--type", "ros:Gripper"), 1, "no Thing of type")
        expect_error(lrt(url, "watch", "right_s1/position", "--plot"), 2, "terminal")
        expect_error(lrt(url, "watch", "right_s1/position", "--csv", "--json"), 2, "excludes")
        expect_error(lrt(url, "ls", "--header", "nonsense"), 2, "NAME:VALUE")
        expect_error(lrt(url, "ls", "--token-file", "/no/such/file"), 2, "token")
        expect_error(lrt(url, "subs", "--cancel", "nothing"), 1, "no subscription")
        expect_error(lrt(url, "blueprint", "nothing"), 1, "no Thing, property or action")
        expect_error(lrt(url, "replay", "/no/such/file"), 2, "No such file")
        expect_error(lrt(url, "generate", "--check", "/no/such/header"), 2, "No such file")
        expect_error(lrt(url, "generate", "/no/such/file"), 2, "No such file")
        expect_error(lrt(url, "generate", "--namespace", "std", "-o", "/dev/null"), 2, "namespace")
        expect_error(lrt("http://127.0.0.1:1/", "ls"), 3, "refused")
        assert robot.n_triples("baxter/right_s1/friction").count('"0.7"') == 1, "something was written"
        # A file of an editor that begins a text with a byte order mark.
        with tempfile.TemporaryDirectory() as folder:
            def saved(name, text):
                with open(os.path.join(folder, name), "w", encoding="utf-8-sig", newline="\r\n") as file:
                    file.write(text)
                return "@" + file.name
            expect(lrt(url, "query", saved("question.rq", "ASK {}\n")), 0, "true\n", "")
            expect(lrt(url, "set", "right_s1/friction", saved("value", "0.9\n")), 0, "", "")
            expect(lrt(url, "set", "right_s1/friction", saved("value.json", "0.7\n")), 0, "", "")
            expect(lrt(url, "get", "right_s1/friction"), 0, "0.7\n", "")
        # A robot in place of LRT_ROBOT: before the names, or by an option; and a property by its URL alone.
        expect(lrt("http://127.0.0.1:1/", "get", url, "right_s1/friction"), 0, "0.7\n", "")
        expect(lrt(None, "get", "right_s1/friction", "--robot", url), 0, "0.7\n", "")
        expect(lrt(None, "get", robot.at("baxter/right_s1/friction")), 0, "0.7\n", "")
        expect(lrt(None, "set", robot.at("baxter/right_s1/friction"), "0.8"), 0, "", "")
        expect(lrt(None, "ls", url), 0, "Baxter's right arm\nWhat Baxter sees and has to do\nright_s0\n.*", "")
        expect(lrt(None, "invoke", url, "right_s1/rotate", "1"), 0, "", "")
        expect(lrt(None, "invoke", robot.at("baxter/right_s1/actions/rotate"), "2"), 0, "", "")
        expect(lrt(url, "set", "right_s1/position", "-1.5"), 0, "", "")  # no option
        said = expect(lrt(url, "-v", "get", "right_s1/friction"), 0, "0.8\n").err
        assert re.search(rf"GET {re.escape(url)}(ns/structure)?: (200|304)\n", said), said
        turtle = "<> <http://vocab.arvida.de/2015/06/vom/vocab#numericalValue> 3.5e0 ; <http://qudt.org/schema/qudt/hasUnit> <http://qudt.org/vocab/unit/N-M-SEC-PER-RAD> ."
        turtle += " <> a <http://vocab.arvida.de/2015/06/maths/vocab#Scalar> ."
        expect(lrt(url, "set", "right_s1/friction", "-", "--type", "text/turtle", stdin=turtle), 0, "", "")
        expect(lrt(url, "get", "right_s1/friction"), 0, "3.5\n")
        json.loads(expect(lrt(url, "ls", "right_s1", "--json"), 0).out)
        json.loads(expect(lrt(url, "ls", "--json"), 0).out)
        json.loads(expect(lrt(url, "subs", "--json"), 0).out)
        assert "sh:NodeShape" in expect(lrt(url, "blueprint", "right_s1"), 0, err="").out
        for command in re.findall(r"^  (\w+)  ", expect(lrt(url, "--help"), 0, err="").out.split("Subcommands:")[1], re.M):
            expect(lrt(url, command, "--help"), 0, ".*Usage: lrt " + command + ".*", "")
        expect(lrt(url, "--version"), 0, r"lrt \d+\.\d+\.\d+\n", "")


def words():
    """Titles and descriptions are in the language of the locale, or of --language."""
    with Program(MOBILE_BASE, "--port", "0") as robot:
        url = robot.url
        expect(lrt(url, "ls"), 0, "Mobile base\n", "")
        for locale in ({"LANG": "de_CH.UTF-8"}, {"LC_MESSAGES": "de_DE", "LANG": "en_US.UTF-8"}, {"LC_ALL": "de", "LC_MESSAGES": "fr"}):
            expect(lrt(url, "ls", **{"LC_ALL": "", **locale}), 0, "Mobile Plattform\n", "")
        expect(lrt(url, "ls", LC_ALL="C", LANG="de_DE.UTF-8"), 0, "Mobile base\n", "")
        expect(lrt(url, "ls", "--language", "de-AT", LANG="en_US.UTF-8"), 0, "Mobile Plattform\n", "")
        expect(lrt(url, "ls", "--language", "fr"), 0, "Mobile base\n", "")
        # Both titles are names, and the names that a program uses stay.
        for name in ("Mobile base", "Mobile Plattform", "base"):
            listed = expect(lrt(url, "ls", name, "--language", "de"), 0, err="").out
            assert re.search("^driveTo\\(\\)\t.*\tFahren nach\tFährt geradeaus zu einem Punkt auf dem Boden.$", listed, re.M), listed
            assert re.search("^bumper\t.*\tStoßleiste gedrückt\t$", listed, re.M), listed
        found = json.loads(expect(lrt(url, "ls", "base", "--json"), 0).out)
        assert found["title"] == "Mobile base" and "description" not in found, found
        pose = next(p for p in found["properties"] if p["name"] == "pose")
        assert (pose["title"], pose["description"]) == ("Pose", "Where the base is, seen from where it was switched on."), pose


def identity():
    with tempfile.TemporaryDirectory() as folder:
        tokens, mine = os.path.join(folder, "tokens"), os.path.join(folder, "mine")
        with open(tokens, "w") as file:
            file.write("alice operator 0123456789abcdef0123456789abcdef\n")
        os.chmod(tokens, 0o600)
        with open(mine, "w") as file:
            file.write("0123456789abcdef0123456789abcdef\n")
        with Robot("--tokens", tokens) as robot:
            expect_error(lrt(robot.url, "get", "right_s1/friction"), 1, "401")
            expect(lrt(robot.url, "get", "right_s1/friction", "--token-file", mine), 0, "0.7\n", "")
            expect(lrt(robot.url, "set", "right_s1/friction", "1", LRT_TOKEN_FILE=mine), 0, "", "")
            expect(lrt(robot.url, "get", "right_s1/friction", "--header", "Authorization: Bearer 0123456789abcdef0123456789abcdef"), 0, "1\n", "")


def subscriptions():
    with Robot() as robot, Receiver() as receiver:
        robot.call_back("baxter/right_s1/friction", receiver.url).expect(201)
        listed = expect(lrt(robot.url, "subs", "right_s1"), 0, err="").out
        match = re.fullmatch(f"({UUID})\tWebCallback\tright_s1/friction\t{re.escape(receiver.url)}\t\\d+\t\\d+\t-\n", listed)
        assert match, listed
        expect(lrt(robot.url, "subs", "--cancel", match[1]), 0, "", "")
        expect(lrt(robot.url, "subs"), 0, "", "lrt: no subscriptions\n")


# --- pipes, servers that die


def pipes():
    with Robot("--demo") as robot:
        for command, status in ((f"{LRT} ls -l | head -1", "0"), (f"{LRT} watch right_s1/position | head -3", "141"),
                                (f"{LRT} record right_s1/position -o - | head -3", "141")):
            done = subprocess.run(["bash", "-c", f"{command}; echo ${{PIPESTATUS[0]}} >&2"], capture_output=True, text=True, timeout=60, env=environment(robot.url))
            assert done.stderr.strip() in (status, "141"), (command, done)
            assert len(done.stdout.split("\n")) in (2, 4), (command, done)
        if os.path.exists("/dev/full"):
            done = subprocess.run(f"{LRT} ls > /dev/full", shell=True, capture_output=True, text=True, timeout=60, env=environment(robot.url))
            assert done.returncode == 1 and "No space left" in done.stderr, done


class Running:
    """lrt with pipes, whose lines are waited for."""

    def __init__(self, url, *words):
        self.process = subprocess.Popen([LRT, *words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment(url))
        self.received = b""

    def line(self):
        end = time.monotonic() + PATIENCE
        while b"\n" not in self.received:
            ready, _, _ = select.select([self.process.stdout], [], [], max(0, end - time.monotonic()))
            data = os.read(self.process.stdout.fileno(), 65536) if ready else b""
            assert data, f"no line, but {self.received!r}"
            self.received += data
        line, self.received = self.received.split(b"\n", 1)
        return line.decode()

    def rest(self):
        """What it still prints, when it ends by itself."""
        rest = (self.received + self.process.communicate(timeout=PATIENCE)[0]).decode()
        return self.process.returncode, rest

    def end(self, a_signal=signal.SIGINT):
        self.process.send_signal(a_signal)
        return self.rest()


def killed_server():
    robot = Robot()
    port = robot.port
    watching = Running(robot.url, "watch", "right_s1/friction", "--json")
    assert json.loads(watching.line())["value"] == 0.7
    turning = Running(robot.url, "invoke", "right_s1/rotate", LONG)
    until(lambda: "running" in robot.n_triples("baxter/right_s1/actions/rotate") or "invocation" in robot.n_triples("baxter/right_s1/actions/rotate"), "an invocation")
    robot.kill()
    status, rest = turning.rest()
    assert status == 3 and re.fullmatch("lrt: [^\n]+\n", rest), (status, rest)
    assert "the connection is lost" in watching.line()
    with Robot(port=port):  # it comes back
        lines = [json.loads(watching.line()), json.loads(watching.line())]
        assert "gap" in lines[0] and lines[0]["name"] == "right_s1/friction", lines
        assert lines[1]["value"] == 0.7, lines
        status, rest = watching.end()
        assert status == 130, (status, rest)
    robot.stop()


def recordings():
    with Robot() as robot, tempfile.TemporaryDirectory() as folder:
        name = os.path.join(folder, "file.jsonl")
        recording = Running(robot.url, "record", "right_s1/friction", "right_s1/velocity", "-o", name)
        until(lambda: os.path.exists(name) and open(name).read().count("\n") >= 3, "the present values")
        for value in (1, 2, 3):
            robot_put(robot, value)
            until(lambda: f'"value":{value},' in open(name).read(), f"the value {value}")
        assert recording.end() == (130, ""), "record"
        expect_error(lrt(robot.url, "record", "right_s1/friction", "-o", name), 2, "exists")
        with open(name, "a") as file:  # as after a full disk
            file.write('{"at":9,"name":"right_s1/fri')
        robot_put(robot, 7)
        with contextlib.ExitStack() as stack:
            watching = Running(robot.url, "watch", "right_s1/friction", "--json")
            assert json.loads(watching.line())["value"] == 7
            # Slow enough that no value is late.
            done = lrt(None, "replay", name, "--to", robot.url, "--speed", "0.5")
            expect(done, 0, "", ".*1 damaged line is left out\n.*\"right_s1/velocity\" is left out: it cannot be written\n")
            values = [json.loads(watching.line())["value"] for _ in range(4)]
            assert values == [0.7, 1, 2, 3], values
            stack.callback(watching.end)
        expect_error(lrt(None, "replay", name), 2, "no robot is given")
        with open(name, "w") as file:
            file.write('{"lrt":"recording","version":1}\n{"at":0,"name":"right_s1/friction","value":99}\n{"at":0.1,"name":"right_s1/friction","value":180,"unit":"deg"}\n'
                       '{"at":0.2,"name":"right_s1/friction","value":4}\n')
        expect_error(lrt(robot.url, "replay", name), 1, "expected at most 60")
        done = expect(lrt(robot.url, "replay", name, "--keep-going"), 1, "")
        assert done.err.count("\n") == 2 and lrt(robot.url, "get", "right_s1/friction").out == "4\n", done


def robot_put(robot, value):
    expect(lrt(robot.url, "set", "right_s1/friction", str(value)), 0, "", "")


# --- terminals


class Terminal:
    """lrt on a pseudo-terminal."""

    def __init__(self, url, *words, columns=80, rows=24):
        self.seen = b""
        self.process, self.master = None, None
        self.master, slave = pty.openpty()
        self.resize(columns, rows, slave)
        self.before = termios.tcgetattr(slave)
        self.slave = slave

        def lead():
            os.setsid()
            fcntl.ioctl(slave, termios.TIOCSCTTY, 0)

        self.process = subprocess.Popen([LRT, *words], stdin=slave, stdout=slave, stderr=slave, env=environment(url), preexec_fn=lead)

    def resize(self, columns, rows, descriptor=None):
        fcntl.ioctl(self.master if descriptor is None else descriptor, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def read(self, condition, what):
        end = time.monotonic() + PATIENCE
        while not condition(self.seen):
            ready, _, _ = select.select([self.master], [], [], max(0, end - time.monotonic()))
            assert ready, f"no {what}: {self.seen!r}"
            try:
                data = os.read(self.master, 65536)
            except OSError:
                data = b""
            if not data:
                break
            self.seen += data
        assert condition(self.seen), f"no {what}: {self.seen!r}"

    def write(self, data):
        os.write(self.master, data)

    def end(self):
        deadline = time.monotonic() + PATIENCE
        while self.process.poll() is None:
            assert time.monotonic() < deadline, f"it does not end: {self.seen!r}"
            if select.select([self.master], [], [], 0.02)[0]:
                self.seen += os.read(self.master, 65536)
        while select.select([self.master], [], [], 0)[0]:
            data = os.read(self.master, 65536)
            if not data:
                break
            self.seen += data
        after = termios.tcgetattr(self.slave)
        assert after[:4] == self.before[:4], "the terminal's mode is not restored"
        os.close(self.slave)
        os.close(self.master)
        return self.process.returncode


def progress_and_ctrl_c():
    with Robot() as robot:
        terminal = Terminal(robot.url, "invoke", "right_s1/rotate", LONG)
        terminal.read(lambda seen: re.search("rotate running [█▏▎▍▌▋▊▉]+ +[0-9]+ %".encode(), seen), "progress bar")
        terminal.write(b"\x03")
        assert terminal.end() == 130, terminal.seen
        assert terminal.seen.endswith(b'\r\x1b[Klrt: "rotate" is cancelled\r\n'), terminal.seen
        ended = re.findall(f"actions/rotate/({UUID})", robot.n_triples("baxter/right_s1/actions/rotate"))
        assert "lrt/ns#cancelled" in robot.n_triples(f"baxter/right_s1/actions/rotate/{ended[0]}"), ended
        # Cancelled by somebody else.
        terminal = Terminal(robot.url, "invoke", "right_s1/rotate", LONG)
        terminal.read(lambda seen: b"running" in seen, "progress")
        found = set(re.findall(f"actions/rotate/({UUID})", robot.n_triples("baxter/right_s1/actions/rotate"))) - set(ended)
        for one in found:
            http_request("DELETE", robot.at(f"baxter/right_s1/actions/rotate/{one}")).expect(204)
        assert terminal.end() == 4, terminal.seen
        assert b"was cancelled" in terminal.seen, terminal.seen
        # To the end: the bar is gone.
        terminal = Terminal(robot.url, "invoke", "right_s1/rotate", "10")
        assert terminal.end() == 0, terminal.seen
        assert terminal.seen.endswith(b"\r\x1b[K"), terminal.seen
        # Units and colours are for people.
        terminal = Terminal(robot.url, "get", "right_s1/friction")
        terminal.read(lambda seen: b"\n" in seen, "value")
        assert terminal.seen == b"0.7 \x1b[2mN.m.s/rad\x1b[0m\r\n", terminal.seen
        assert terminal.end() == 0
        terminal = Terminal(robot.url, "get", "right_s1/friction", "--color", "never")
        terminal.read(lambda seen: b"\n" in seen, "value")
        assert terminal.seen == b"0.7 N.m.s/rad\r\n", terminal.seen
        assert terminal.end() == 0
        # A table is cut to the width.
        terminal = Terminal(robot.url, "ls", "right_s1", "--color", "never", columns=60)
        assert terminal.end() == 0
        assert all(len(line) <= 60 for line in terminal.seen.decode().split("\r\n")), terminal.seen
        assert "…" in terminal.seen.decode()


BRAILLE = re.compile("[\u2801-\u28ff]")


def plot():
    with Robot("--demo") as robot:
        for end, status in ((b"q", 0), (b"\x03", 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)):
            terminal = Terminal(robot.url, "watch", "right_s0/position", "right_s1/position", "--plot", "--window", "2")
            terminal.read(lambda seen: BRAILLE.search(seen.decode(errors="ignore")), "curve")
            assert b"\x1b[?1049h" in terminal.seen and b"\x1b[?25l" in terminal.seen, terminal.seen
            assert "right_s0/position  " in terminal.seen.decode(errors="ignore")
            if end == b"q":  # another size
                terminal.seen = b""
                terminal.resize(40, 10)
                terminal.read(lambda seen: b"\x1b[10;1H" in seen and b"\x1b[24;1H" not in seen.split(b"\x1b[2J")[-1], "frame of ten rows")
            if isinstance(end, bytes):
                terminal.write(end)
            else:
                terminal.process.send_signal(end)
            assert terminal.end() == status, (end, terminal.seen)
            assert terminal.seen.endswith(b"\x1b[?25h\x1b[?1049l"), terminal.seen[-200:]


# --- a hostile robot

EVIL = "\x1b]0;owned\x07\x1b[2J\x9b31m\u202eevil\u2066\x7f\r\n\x00"
PREFIXES = """@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix dcterms: <http://purl.org/dc/terms/> . @prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> .
@prefix lrt: <https://w3id.org/lrt/ns#> . @prefix ldp: <http://www.w3.org/ns/ldp#> . @prefix sh: <http://www.w3.org/ns/shacl#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> . @prefix ex: <http://example.org/> . @prefix http-core: <http://www.w3.org/2011/http#> . @prefix http-methods: <http://www.w3.org/2011/http-methods#> .
"""


def turtle_string(text):
    return '"' + "".join(f"\\U{ord(c):08X}" if ord(c) < 0x20 or ord(c) > 0x7e or c in '"\\' else c for c in text if c != "\0") + '"'


class Hostile:
    """A robot whose every text has escape sequences."""

    def __enter__(self):
        evil = turtle_string(EVIL)
        mode = "ok"
        pages = {
            "/": f"<> a hybrit:RoboticThing ; dcterms:title {evil} ; hybrit:property </value>, </loop>, </mode> ; hybrit:action </act> ; hybrit:subscriptions </subs> .",
            "/value": f"<> a hybrit:Property ; rdfs:label {evil} ; rdf:value {evil} .",
            "/loop": f"<> a hybrit:Property ; ex:a [ ex:b <> ; ex:c {evil} ] ; ex:d ( 1 2 {evil} ) .",
            "/mode": f"<> a hybrit:Property ; rdf:value {turtle_string(mode)} ; hybrit:binding [ http-core:mthd http-methods:PUT ; http-core:requestURI </mode> ;"
                     f" http-core:body [ dcterms:conformsTo </mode#shape> ] ] . </mode#shape> a sh:NodeShape ; sh:property [ sh:path rdf:value ; sh:minCount 1 ; sh:maxCount 1 ;"
                     f" sh:datatype xsd:string ; sh:in ( \"ok\" {evil} ) ; sh:message {evil} ] .",
            "/act": f"<> a hybrit:Action ; rdfs:label {evil} .",
            "/run": f"<> a lrt:Invocation ; lrt:status lrt:failed ; lrt:error {evil} .",
            "/subs": "<> a ldp:BasicContainer ; ldp:contains </sub> .",
            "/sub": f"<> a hybrit:Subscription, hybrit:WebCallback ; hybrit:onResource </value> ; hybrit:callbackURL {evil} ; lrt:lastError {evil} .",
        }

        class Server(http.server.ThreadingHTTPServer):
            daemon_threads = True

            def handle_error(self, *_):
                pass  # the other end has gone

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def reply(self, status, body, content_type="text/turtle", **fields):
                self.send_response(status)
                for name, value in fields.items():
                    self.send_header(name, value)
                self.send_header("Content-Type", content_type)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def do_GET(self):
                if "x-evil" in self.headers.get("Accept", ""):
                    return self.reply(200, EVIL.encode(), "text/plain")
                page = pages.get(self.path)
                if page is None:
                    return self.reply(404, json.dumps({"detail": EVIL}).encode(), "application/problem+json")
                return self.reply(200, (PREFIXES + page).encode())

            def do_POST(self):
                self.reply(202, b"", Location="/run")

            def do_PUT(self):
                self.reply(409, json.dumps({"detail": EVIL}).encode(), "application/problem+json")

            def log_message(self, *_):
                pass

        self.server = Server(("127.0.0.1", 0), Handler)
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        return f"http://127.0.0.1:{self.server.server_port}/"

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()


def harmless(text, what):
    bad = [c for c in text if (ord(c) < 0x20 and c not in "\n\t") or 0x7f <= ord(c) <= 0x9f or c in "\u202e\u2066\u2028"]
    assert not bad, f"{what}: {bad} in {text!r}"


def hostile_robot():
    commands = (["ls"], ["ls", "-l"], ["ls", "--json"], ["get", "value"], ["get", "value", "--json"], ["get", "loop"], ["get", "mode"], ["set", "mode", "ok"],
                ["set", "mode", "no"], ["invoke", "act"], ["subs"], ["subs", "--json"], ["get", "nothing"], ["blueprint", "mode"], ["blueprint", "mode", "-p"],
                ["validate", "mode", "no"], ["watch", "value", "--count", "1", "--via", "polling"], ["watch", "value", "--count", "1", "--via", "polling", "--json"],
                ["watch", "value", "--count", "1", "--via", "polling", "--csv"], ["record", "value", "--count", "1", "--via", "polling", "-o", "-"], ["-v", "ls", "x"],
                ["check", "--no-subscriptions", "--for", "3"],
                ["generate"], ["__complete", "get", ""])
    with Hostile() as url:
        for command in [*commands, ["ls", url], ["get", url + "nothing"], ["get", url + "value"], ["watch", url + "nothing", "--count", "1"]]:
            done = lrt(url, *command)
            assert done.status in (0, 1), (command, done)
            harmless(done.out, command)
            harmless(done.err, command)
            if "--json" in command:
                json.loads(done.out)
        done = lrt(url, "get", "value")
        assert "\\x1b]0;owned\\x07" in done.out and "\\u202eevil" in done.out, done
        assert lrt(url, "get", url + "nothing").status == 1
        terminal = Terminal(url, "get", "value", "--accept", "text/x-evil")
        terminal.end()
        harmless(terminal.seen.decode().replace("\r\n", "\n"), "a terminal")
        terminal = Terminal(url, "ls", url, "--color", "never")
        terminal.end()
        harmless(terminal.seen.decode().replace("\r\n", "\n"), "a terminal")


# --- completion, manual


def completion():
    with Robot() as robot:
        def bash(*words, cursor=None):
            script = ('eval "$(lrt completion bash)"; COMP_WORDS=("$@"); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _lrt lrt; printf "%s\\n" "${COMPREPLY[@]}"')
            done = subprocess.run(["bash", "--norc", "-c", script, "-", "lrt", *words], capture_output=True, text=True, timeout=60, env=environment(robot.url))
            assert done.returncode == 0 and not done.stderr, done
            return done.stdout.split()

        assert "watch" in bash("") and "__complete" not in bash("")
        assert bash("inv") == ["invoke"]
        assert bash("get", "right_s1/p") == ["right_s1/position"]
        assert bash("invoke", "right_s1/") == ["right_s1/rotate"]
        assert bash("ls", "right_s") == ["right_s0", "right_s1"]
        assert bash("watch", "right_s1/position", "right_s0/pos") == ["right_s0/position"]
        assert bash("watch", "--pl") == ["--plot"]
        assert bash("watch", "--via", "po") == ["polling"]
        assert bash("--color", "=", "a") == ["always", "auto"]
        scheme, rest = robot.url.split(":", 1)
        host, port = rest.rsplit(":", 1)
        assert bash("ls", "--robot", scheme, ":", host, ":", port, "right_s") == ["right_s0", "right_s1"]
        assert bash("get", "right_s1/friction", "") == []
        registered = subprocess.run(["bash", "--norc", "-c", 'eval "$(lrt completion bash)"; complete -p lrt; compgen -A function _lrt'], capture_output=True, text=True,
                                    timeout=60, env=environment(robot.url))
        assert registered.stdout == "complete -o default -F _lrt lrt\n_lrt\n", registered
        # A robot that is not there costs two seconds at most, and nothing is said.
        expect(lrt("http://127.0.0.1:1/", "__complete", "get", ""), 0, "", "")
        if shutil.which("zsh"):
            script = 'compdef() { :; }; compadd() { shift; print -l -- "$@"; }; eval "$(lrt completion zsh)"; words=("$@"); CURRENT=$#; _lrt'
            done = subprocess.run(["zsh", "-f", "-c", script, "-", "lrt", "get", "right_s1/p"], capture_output=True, text=True, timeout=60, env=environment(robot.url))
            assert done.stdout == "right_s1/position\n" and not done.stderr, done
        if shutil.which("shellcheck"):
            done = subprocess.run(["shellcheck", "--shell=bash", "-"], input=lrt(None, "completion", "bash").out, capture_output=True, text=True, timeout=60)
            assert done.returncode == 0, done.stdout


def manual():
    page = os.path.join(SOURCE, "tools", "lrt", "lrt.1")
    with open(page) as file:
        text = file.read()
    said = expect(lrt(None, "--help"), 0).out
    for command in re.findall(r"^  (\w+)  ", said.split("Subcommands:")[1], re.M):
        assert f".Ss {command}\n" in text or f".It Cm {command}" in text, f"lrt.1 has no {command}"
        for option in re.findall(r"--([a-z][a-z-]+)", lrt(None, command, "--help").out.split("Options:")[1].split("Examples:")[0]):
            assert f"Fl -{option}" in text, f"lrt.1 has no --{option} of {command}"
    if shutil.which("mandoc"):
        done = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", page], capture_output=True, text=True, timeout=60)
        assert done.returncode == 0, done.stdout


def main():
    global LRT, SOURCE, MOBILE_BASE
    LRT, Robot.program, SOURCE, MOBILE_BASE = os.path.abspath(sys.argv[1]), sys.argv[2], os.path.abspath(sys.argv[3]), sys.argv[4]
    wanted = sys.argv[5:]
    for case in (tour, errors, words, identity, subscriptions, pipes, killed_server, recordings, progress_and_ctrl_c, plot, hostile_robot, completion, manual):
        if wanted and case.__name__ not in wanted:
            continue
        begin = time.monotonic()
        case()
        print(f"{case.__name__}: {time.monotonic() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main()
