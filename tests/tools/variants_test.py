# SPDX-License-Identifier: Apache-2.0
"""The command lrt and values that are one of several alternatives: get, set, invoke, watch, record, ls, blueprint, completion, what is told of wrong words.

usage: variants_test.py LRT MOVER_ROBOT
"""

import json
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import Program  # noqa: E402

LRT = MOVER = None


def lrt(url, *words, stdin="", **env):
    names = ("LRT_ROBOT", "LRT_TOKEN_FILE", "LRT_PASSWORD", "NO_COLOR", "LC_CTYPE", "LANG", "XDG_CONFIG_HOME")
    all_ = {k: v for k, v in os.environ.items() if k not in names}
    all_.update({"LC_ALL": "C.UTF-8", "TERM": "xterm-256color", "HOME": "/nonexistent", "LRT_ROBOT": url}, **env)
    return subprocess.run([LRT, *words], input=stdin, capture_output=True, text=True, timeout=60, env=all_)


def said(done, status, out=None, err=""):
    assert done.returncode == status, f"expected status {status}: {done}"
    assert out is None or done.stdout == out, f"expected {out!r}: {done}"
    assert err is None or done.stderr == err, f"expected on standard error {err!r}: {done}"
    return done


def value(url, name):
    return json.loads(said(lrt(url, "get", name, "--json"), 0).stdout)["value"]


def get_and_set():
    with Program(MOVER) as robot:
        url = robot.url
        said(lrt(url, "get", "target"), 0, '{"moveTo":{"x":{"value":1,"unit":"m"},"y":{"value":2,"unit":"m"}}}\n')
        for words, expected in (
                (["grip=closed"], {"grip": "closed"}),
                (["hold"], {"hold": {}}),
                (["hold="], {"hold": {}}),
                (["height=0.5"], {"height": {"value": 0.5, "unit": "m"}}),
                (["height=150cm"], {"height": {"value": 1.5, "unit": "m"}}),
                (['{"grip": "open"}'], {"grip": "open"}),
                (['moveTo={"x": 1, "y": -1}'], {"moveTo": {"x": {"value": 1, "unit": "m"}, "y": {"value": -1, "unit": "m"}}}),
                (['{"moveTo": {"x": 0, "y": 0, "speed": 2}}'], {"moveTo": {"x": {"value": 0, "unit": "m"}, "y": {"value": 0, "unit": "m"}, "speed": 2}})):
            said(lrt(url, "set", "target", *words), 0, "")
            assert value(url, "target") == expected, (words, value(url, "target"))
        said(lrt(url, "set", "target", "-", stdin='{"hold": {}}\n'), 0, "")
        said(lrt(url, "get", "target"), 0, '{"hold":{}}\n')
        said(lrt(url, "set", "next", "grip=open"), 0, "")
        assert value(url, "next") == {"grip": "open"}
        said(lrt(url, "set", "plan", '[{"hold": {}}, {"height": 1}]'), 0, "")
        assert [list(one) for one in value(url, "plan")] == [["hold"], ["height"]]
        said(lrt(url, "set", "job", '{"name": "x", "target": {"grip": "closed"}}'), 0, "")
        assert value(url, "job")["target"] == {"grip": "closed"}
        said(lrt(url, "set", "limit", "text=a=b"), 0, "")
        assert value(url, "limit") == {"text": "a=b"}
        said(lrt(url, "set", "limit", "number=2.5"), 0, "")
        said(lrt(url, "validate", "target", "hold"), 0)


def wrong_words():
    """Nothing of it is sent, and the names of the alternatives are told."""
    with Program(MOVER) as robot:
        url = robot.url
        for name, words, told in (
                ("target", "gripp=open", 'lrt: there is no alternative "gripp"; did you mean "grip"?\n'),
                ("target", '{"moveto": {"x": 1, "y": 2}}', 'lrt: there is no alternative "moveto"; did you mean "moveTo"?\n'),
                ("target", "fly", 'lrt: there is no alternative "fly"; expected one of moveTo, grip, height, hold\n'),
                ("target", "grip", 'lrt: "grip" needs a value: grip=VALUE, open | closed\n'),
                ("target", "moveTo=", 'lrt: "moveTo" needs a value: moveTo=VALUE, {x, y, speed}\n'),
                ("target", "hold=1", 'lrt: "hold" has no content, found "1"\n'),
                ("plan", '[{"hold": {}}, {"hight": 1}]', 'lrt: there is no alternative "hight"; did you mean "height"?\n'),
                ("job", '{"name": "x", "target": {"hodl": {}}}', 'lrt: there is no alternative "hodl"; did you mean "hold"?\n')):
            said(lrt(url, "set", name, words), 1, "", told)
        for words, parts in (('{"grip": "open", "hold": {}}', ["grip", "hold"]), ("{}", ["moveTo", "grip", "height", "hold"]),
                             ("grip=half", ["open", "closed"]), ("height=3", ["2"]), ("height=1deg", ["deg", "m"]),
                             ('moveTo={"x": 1}', ["y"])):
            done = lrt(url, "set", "target", words)
            assert done.returncode == 1 and done.stdout == "" and done.stderr.startswith("lrt: "), (words, done)
            for part in parts:
                assert part in done.stderr, (words, done)
        assert value(url, "target")["moveTo"]["y"]["value"] == 2


def invoke():
    with Program(MOVER) as robot:
        url = robot.url
        said(lrt(url, "invoke", "go", 'moveTo={"x": 3, "y": 0}'), 0, '{"number":3}\n')
        said(lrt(url, "invoke", "go", "hold"), 0, '{"text":"done"}\n')
        done = lrt(url, "invoke", "go", "hodl")
        said(done, 1, "", 'lrt: there is no alternative "hodl"; did you mean "hold"?\n')
        done = lrt(url, "invoke", "go")
        assert done.returncode == 1 and "moveTo" in done.stderr, done


def watch_and_record():
    with Program(MOVER, "--turn") as robot, tempfile.TemporaryDirectory() as folder:
        seen = set()
        done = lrt(robot.url, "watch", "target", "--count", "12", "--json")
        assert done.returncode == 0, done
        for line in done.stdout.splitlines():
            found = json.loads(line)["value"]
            assert len(found) == 1, found
            seen.update(found)
        assert seen == {"moveTo", "grip", "height", "hold"}, seen
        file = os.path.join(folder, "target.mcap")
        done = lrt(robot.url, "record", "target", "-o", file, "--count", "12", "--no-compression")
        assert done.returncode == 0, done
        # A viewer knows the members of all alternatives from the schema, whichever came first.
        with open(file, "rb") as bag:
            bytes_ = bag.read()
        start = bytes_.index(b'{"type":"object","properties":{"value":')
        schema, _ = json.JSONDecoder().raw_decode(bytes_[start:].decode("utf-8", "replace"))
        members = schema["properties"]["value"]["properties"]
        assert set(members) == {"moveTo", "grip", "height", "hold"}, schema
        assert members["height"]["properties"]["value"] == {"type": "number"}, schema
        assert members["moveTo"]["properties"]["speed"] == {"type": "number"}, schema


def shown():
    with Program(MOVER) as robot:
        url = robot.url
        listed = lrt(url, "ls", "mover").stdout
        assert "one of moveTo {x, y, speed} | grip (open | closed) | height number | hold" in listed, listed
        table = lrt(url, "blueprint", "mover/target", "--for-people").stdout.splitlines()
        assert any(line.split("\t")[:2] == ["target", "variant"] for line in table), table
        assert any(line.split("\t")[0] == "target.hold" and "no content" in line and "one of these" in line for line in table), table
        assert any(line.split("\t")[0] == "target.moveTo.x" and "\tm\t" in line and "required" in line for line in table), table


def completion():
    with Program(MOVER) as robot:
        def complete(*words):
            return lrt(robot.url, "__complete", *words).stdout.split()
        assert complete("set", "target", "") == ["grip=", "height=", "hold=", "moveTo="]
        assert complete("set", "mover/target", "mo") == ["moveTo="]
        assert complete("invoke", "go", "h") == ["height=", "hold="]
        script = 'eval "$(lrt completion bash)"; COMP_WORDS=(lrt set target mo); COMP_CWORD=3; compopt() { echo "option $*"; }; _lrt; echo "${COMPREPLY[@]}"'
        done = subprocess.run(["bash", "--norc", "-c", script], capture_output=True, text=True, timeout=60,
                              env={**os.environ, "PATH": os.path.dirname(LRT) + ":" + os.environ["PATH"], "LRT_ROBOT": robot.url, "HOME": "/nonexistent"})
        assert done.stdout == "option -o nospace\nmoveTo=\n", done


def check():
    with Program(MOVER) as robot, tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "hold.json")
        with open(file, "w") as input_:
            input_.write('{"hold": {}}')
        done = lrt(robot.url, "check", "--no-subscriptions", "--format", "json", "--write", robot.at("mover/target"), "--write", robot.at("mover/plan"),
                   "--invoke", robot.at("mover/actions/go"), file, robot.at("mover"))
        assert done.returncode == 0, done
        outcomes = {one["id"]: one["outcome"] for one in json.loads(done.stdout)["findings"]}
        assert outcomes["write.alternatives"] == outcomes["blueprint.alternatives"] == "pass", outcomes
        assert "fail" not in outcomes.values(), outcomes


CASES = [get_and_set, wrong_words, invoke, watch_and_record, shown, completion, check]

if __name__ == "__main__":
    LRT, MOVER = sys.argv[1:3]
    os.environ["XDG_CACHE_HOME"] = (cache := tempfile.TemporaryDirectory()).name
    chosen = sys.argv[3:]
    for case in CASES:
        if not chosen or case.__name__ in chosen:
            print(case.__name__, flush=True)
            case()
