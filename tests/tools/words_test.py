# SPDX-License-Identifier: Apache-2.0
"""What people type. Wrong commands and what they are told, in wrong_commands.tsv; values of every form, in every subcommand and option; names as people write
them; profiles; signals that end a command.

usage: words_test.py LRT BAXTER ODD_ROBOT [CASE... | --write]     --write: makes the messages of the table anew, to be read
"""

import json
import os
import shlex
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import PATIENCE, Program, Robot, http_request, until  # noqa: E402

LRT = ODD = None
HERE = os.path.dirname(os.path.abspath(__file__))
TABLE = os.path.join(HERE, "wrong_commands.tsv")


def environment(url=None, **more):
    names = ("LRT_ROBOT", "LRT_TOKEN_FILE", "LRT_PASSWORD", "NO_COLOR", "LC_CTYPE", "LANG", "XDG_CONFIG_HOME")
    env = {k: v for k, v in os.environ.items() if k not in names}
    env.update({"LC_ALL": "C.UTF-8", "TERM": "xterm-256color", "HOME": "/nonexistent"}, **more)
    if url:
        env["LRT_ROBOT"] = url
    return env


def lrt(url, *words, stdin="", **env):
    return subprocess.run([LRT, *words], input=stdin, capture_output=True, text=True, timeout=60, env=environment(url, **env))


def said(done, status, out=None, err=""):
    assert done.returncode == status, f"expected status {status}: {done}"
    assert out is None or done.stdout == out, f"expected {out!r}: {done}"
    assert err is None or done.stderr == err, f"expected on standard error {err!r}: {done}"
    return done


# --- wrong commands


def rows():
    """Robot, command, exit status, message."""
    with open(TABLE, encoding="utf-8") as file:
        return [line.rstrip("\n").split("\t") for line in file if line.strip() and not line.startswith("#")]


def wrong_commands(write=False):
    table = rows()
    assert len(table) >= 60, "the table has lost its commands"
    faults, made = [], []
    with Robot() as baxter, Program(ODD) as odd, tempfile.TemporaryDirectory() as folder:
        places = {"{baxter}": baxter.url, "{odd}": odd.url, "{folder}": folder}
        robots = {"baxter": baxter.url, "odd": odd.url, "gone": "http://127.0.0.1:1/", "-": None}
        with open(os.path.join(folder, "robots.toml"), "w"):
            pass
        for row in table:
            robot, command = row[0], row[1]
            for name, place in places.items():
                command = command.replace(name, place)
            done = lrt(robots[robot], *shlex.split(command))
            message = done.stderr.rstrip("\n")
            for name, place in places.items():
                message = message.replace(place, name)
            found = [robot, row[1], str(done.returncode), message.replace("\t", "\\t").replace("\n", "\\n")]
            made.append(found)
            assert done.returncode != 0, f"not refused: {found} {done.stdout!r}"
            assert done.stdout == "", f"a refused command prints something on standard output: {found} {done.stdout!r}"
            if found != row:
                faults.append(f"lrt {row[1]}\n  expected: {' '.join(row[2:])}\n  found:    {' '.join(found[2:])}")
    if write:
        with open(TABLE, encoding="utf-8") as file:
            head = [line for line in file if line.startswith("#")]
        with open(TABLE, "w", encoding="utf-8") as file:
            file.writelines(head + ["\t".join(one) + "\n" for one in made])
    else:
        assert not faults, "\n".join(faults)


# --- values

TEXTS = ["hello", "[hello]", "[1,2,3]", "[]", "[", "]", "[[a],[b]]", "{}", '{"a":1}', "a=b", "=", "a,b", ",", "'", '"quoted"', "-0.5", "-1e3", "-", "a b", " ",
         "100%", "a\\nb", "*", "?", "$HOME", "#", "&", "ünïcödé", "\u4e2d\u6587", "set", "help", "true", "null", "\u00b0"]


def texts():
    """Each text arrives as it was typed, wherever it stands."""
    with Program(ODD) as odd:
        url, of_text, echo = odd.url, odd.at("types/text"), odd.at("types/actions/echo")
        for text in TEXTS:
            if text == "-":
                continue  # is standard input
            if TEXTS.index(text) % 3 == 0:
                said(lrt(None, "invoke", echo, text), 0, text + "\n")
            else:
                said(lrt(None, "set", of_text, text), 0, "")
                assert http_request("GET", of_text, headers={"Accept": "text/plain"}).body == text, text
        for text in TEXTS[:7]:
            said(lrt(None, "set", of_text, text), 0, "")
            said(lrt(None, "get", of_text), 0, text + "\n")
            said(lrt(url, "validate", "types/text", text), 0, "")
            said(lrt(None, "set", url, "types/text", text), 0, "")
        for text in ("", "--help", "--", "-x", "--json", "-minus", "[a]"):  # after "--" there are no options
            said(lrt(None, "set", "--", of_text, text), 0, "")
            said(lrt(None, "get", of_text), 0, text + "\n")
        said(lrt(url, "set", "types/text", ""), 0, "")
        said(lrt(url, "set", "types/text", "-", stdin="[from stdin]\n"), 0, "")
        said(lrt(url, "get", "types/text"), 0, "[from stdin]\n")
        with tempfile.TemporaryDirectory() as folder:
            name = os.path.join(folder, "[a]")
            with open(name, "w") as file:
                file.write("[from a file]")
            said(lrt(url, "invoke", "types/echo", "@" + name), 0, "[from a file]\n")
        said(lrt(url, "set", "types/text", "@@home"), 0, "")
        said(lrt(url, "get", "types/text"), 0, "@home\n")
        for value in ("[1,2,3]", "[1]", "[]", "[-1,0.5]"):
            said(lrt(url, "set", "types/numbers", value), 0, "")
            said(lrt(url, "get", "types/numbers"), 0, value + "\n")
            said(lrt(url, "validate", "types/numbers", value), 0, "")
        for value in ('["a,b"]', '["[x]","-1"]', "[]"):
            said(lrt(url, "set", "types/texts", value), 0, "")
            said(lrt(url, "get", "types/texts"), 0, value + "\n")
        said(lrt(url, "set", "types/map", '{"a=b":1}'), 0, "")
        said(lrt(url, "get", "types/map"), 0, '{"a=b":1}\n')
        said(lrt(url, "set", "types/pose", '{"x":-1,"list":[1,2]}'), 0, "")
        said(lrt(url, "get", "types/pose"), 0, '{"x":-1,"list":[1,2]}\n')
        for value, number in (("-0.5", "-0.5"), ("-.5", "-0.5"), ("-0.5rad", "-0.5"), ("-90 deg", "-1.5707963267948966"), ("90 DEG", "1.5707963267948966"),
                              ("250 mrad", "0.25"), ("0.5turn", "3.141592653589793"), ("30\u00b0", "0.5235987755982988")):
            said(lrt(url, "set", "types/angle", value), 0, "")
            found = float(said(lrt(url, "get", "types/angle"), 0).stdout)
            assert abs(found - float(number)) < 1e-15 * max(1, abs(found)), (value, found)
        said(lrt(url, "set", "types/speed", "-36 km/h"), 0, "")
        said(lrt(url, "get", "types/speed"), 0, "-10\n")
        said(lrt(url, "set", "types/mode", "busy"), 0, "")
        said(lrt(url, "set", "types/flag", "true"), 0, "")
        said(lrt(url, "set", "types/integer", "-7"), 0, "")


def option_values():
    """No option of a subcommand takes a value apart."""
    gone = "http://127.0.0.1:1/"  # what is looked for is seen before a robot is needed
    for value in ("[a,b]", "[]", "-x", "a,b", ""):
        for words in (["get", "types/angle", "--unit", value], ["ls", "--type", value], ["ls", "--header", "X-Test: " + value], ["watch", "types/angle", "--via", value],
                      ["generate", "--namespace", value], ["generate", "--check", value], ["subs", "--cancel", value], ["ls", "--token-file", value],
                      ["record", "types/angle", "-o", value, "--count", value], ["query", "ASK {}", "--endpoint", value], ["set", "types/text", "x", "--type", value],
                      ["set", "types/text", "x", "--if-match", value], ["invoke", "--cancel", value], ["check", "--format", value], ["mirror", "--to", value, "--requests", value]):
            at = next(i for i, word in enumerate(words) if word.startswith("-"))
            for tried in (words, [*words[:at], (words[at] + "=" if words[at].startswith("--") else words[at]) + value, *words[at + 2:]]):
                done = lrt(gone, *tried)
                bad = [text for text in ("received", "At Most", "At Least", "Excess", "Mismatch", "terminate", "\x01") if text in done.stderr]
                assert not bad and done.returncode in (1, 2, 3), (tried, done)
    with Program(ODD) as odd:
        said(lrt(odd.url, "set", "types/text", "x", "--if-match", "[x]"), 1, "", None)
        said(lrt(odd.url, "subs", "--cancel", "[a,b]"), 1, "", 'lrt: there is no subscription "[a,b]"\n')
        said(lrt(odd.url, "ls", "--header", "[nonsense]"), 2, "", 'lrt: --header "[nonsense]": expected NAME:VALUE\n')
        said(lrt(odd.url, "generate", "[a,b]"), 2, "", 'lrt: cannot read "[a,b]": No such file or directory\n')
        done = lrt(odd.url, "get", "types/angle", "--unit", "[in_i]")
        assert done.returncode == 1 and '"rad" to "[in_i]"' in done.stderr, done
        done = lrt(odd.url, "check", "--no-subscriptions", "--for", "1", "--invoke", odd.at("types/actions/echo"), "", odd.url)
        assert "FILE" not in done.stderr and done.returncode in (0, 1), done


# --- names


def names():
    with Program(ODD) as odd, Robot() as baxter:
        url = odd.url
        for name in ("x y", "\u00e9t\u00e9", "\u4e2d\u6587", "a+b", "50%", "#hash", "q?x=1", "comma,s", "[b]", 'quote"s', "tilde~"):
            said(lrt(url, "set", name + "/val ue+", "1.5"), 0, "")
            said(lrt(url, "get", name + "/val ue+"), 0, "1.5\n")
            assert lrt(url, "ls", name).stdout.startswith("val ue+\t1.5\t"), name
            found = lrt(url, "watch", name + "/val ue+", "--count", "1")
            assert found.stdout.split("\t")[1:] == [name + "/val ue+", "1.5", "\n"], found
            assert json.loads(lrt(url, "get", name + "/val ue+", "--json").stdout)["name"] == name + "/val ue+"
        said(lrt(url, "get", "--", "-minus/val ue+"), 0, "0\n")
        said(lrt(url, "get", "x%20y/val%20ue+"), 0, "1.5\n")
        state = http_request("GET", url + "x%20y/state", headers={"Accept": "application/json"})
        assert json.loads(state.body) == {"val ue+": 1.5}, state
        # Several names, patterns, whole Things.
        url = baxter.url
        said(lrt(url, "get", "right_s0/position", "right_s1/position"), 0, "right_s0/position\t0\trad\nright_s1/position\t0\trad\n")
        both = lrt(url, "get", "right_s?/position")
        assert both.stdout == "right_s0/position\t0\trad\nright_s1/position\t0\trad\n", both
        assert lrt(url, "get", "*/position").stdout.count("\n") == 7
        assert lrt(url, "get", "baxter/right_s1").stdout.startswith("right_s1/position\t0\trad\n")
        assert lrt(url, "get", "right_s1", "--json").stdout.startswith('[{"name":"right_s1/position","url":')
        said(lrt(url, "get", "right_s1/effort", "right_s1/friction"), 0, "right_s1/effort\t\tN.m\nright_s1/friction\t0.7\tN.m.s/rad\n")
        said(lrt(url, "get", "right_s1/friction", "--json", "--unit-iri"), 0,
             f'{{"name":"right_s1/friction","url":"{url}baxter/right_s1/friction","value":0.7,"unit":"http://qudt.org/vocab/unit/N-M-SEC-PER-RAD"}}\n')
        watched = lrt(url, "watch", "right_s1", "--count", "5")
        assert {line.split("\t")[1].split("/")[0] for line in watched.stdout.splitlines()} == {"right_s1"}, watched
        assert len({line.split("\t")[1] for line in watched.stdout.splitlines()}) == 5, watched
        assert len(lrt(url, "watch", "*_s?/position", "--count", "2").stdout.splitlines()) == 2
        # The command's names of members are those of the server's JSON, and read back.
        limits = lrt(url, "get", "right_s1/limits").stdout
        plain = http_request("GET", baxter.at("baxter/right_s1/limits"), headers={"Accept": 'application/json;profile="https://w3id.org/lrt/ns#withUnits"'})
        assert json.loads(limits) == json.loads(plain.body), (limits, plain.body)
        said(lrt(None, "get", baxter.at("baxter/right_s1/limits")), 0, limits)
        assert "limits.lower\t" in lrt(url, "blueprint", "right_s1/limits", "-p").stdout
        # A URL is the robot, whatever LRT_ROBOT says.
        other = "http://127.0.0.1:1/"
        for words in (["ls", url], ["ls", baxter.at("baxter/right_s1")], ["subs", url], ["blueprint", baxter.at("baxter/right_s1")], ["get", baxter.at("baxter/right_s1")],
                      ["get", url, "right_s1/position"], ["watch", baxter.at("baxter/right_s1/position"), "--count", "1"], ["watch", baxter.at("baxter/right_s1"), "--count", "1"],
                      ["blueprint", baxter.at("baxter/right_s1/limits")], ["blueprint", url, "right_s1/limits"], ["validate", baxter.at("baxter/right_s1/friction"), "1"],
                      ["invoke", baxter.at("baxter/right_s1/actions/rotate"), "1"], ["query", url, "ASK {}"], ["get", baxter.at("baxter/right_s1/friction"), url + "baxter/right_s0/friction"]):
            done = lrt(other, *words)
            assert done.returncode == 0 and (not done.stderr or "no subscriptions" in done.stderr), (words, done)
        assert lrt(other, "ls", baxter.at("baxter/right_s1")).stdout.startswith("position\t")


def resources():
    """What is neither a value nor a Thing."""
    with Program(ODD) as odd, Robot() as baxter, tempfile.TemporaryDirectory() as folder:
        state = lrt(baxter.url, "get", "right_s1/state")
        assert json.loads(state.stdout)["limits"]["lower"] == {"value": -2.147, "unit": "rad"}, state
        assert lrt(None, "get", baxter.at("baxter/right_s1/state")).stdout == state.stdout
        assert json.loads(lrt(baxter.url, "get", "baxter/all").stdout)["right_s1"]["friction"]["value"] == 0.7
        assert json.loads(lrt(None, "get", baxter.at("all")).stdout)["baxter"], "all"
        said(lrt(None, "get", baxter.url), 0, baxter.at("baxter") + "\n" + baxter.at("world") + "\n")
        image = os.path.join(folder, "image.png")
        said(lrt(odd.url, "get", "camera/image", "--accept", "image/png", "-o", image), 0, "")
        with open(image, "rb") as file:
            assert file.read() == b"\x89PNG\r\n\x1a\n\0\x1b[2J\0"[:14], "the image"
        said(lrt(odd.url, "get", "types/nothing"), 1, "", 'lrt: "types/nothing" has no value now\n')
        assert json.loads(lrt(odd.url, "get", "types/nothing", "--json").stdout)["value"] is None
        # One line for each value, whatever it is.
        said(lrt(odd.url, "set", "types/text", "-", stdin="a\tb\nc"), 0, "")
        said(lrt(odd.url, "get", "types/text"), 0, "a\tb\nc\n")
        assert "\ntext\ta\\x09b\\x0ac\t\t" in lrt(odd.url, "ls", "types").stdout
        said(lrt(odd.url, "get", "types/text", "types/flag"), 0, "types/text\ta\\x09b\\x0ac\t\ntypes/flag\tfalse\t\n")
        assert lrt(odd.url, "watch", "types/text", "--count", "1").stdout.endswith("\ttypes/text\ta\\x09b\\x0ac\t\n")
        assert "types/text,\"a\tb\nc\"," in lrt(odd.url, "watch", "types/text", "--csv", "--count", "1").stdout
        said(lrt(odd.url, "get", "types/number"), 0, "0.30000000000000004\n")  # nothing is lost
        said(lrt(odd.url, "get", "types/single"), 0, "0.3\n")
        # Nothing is an answer that says so.
        said(lrt(odd.url, "subs"), 0, "", "lrt: no subscriptions\n")
        said(lrt(odd.url, "ls", "empty"), 0, "", None)
        said(lrt(baxter.url, "query", "SELECT ?a { ?a a <urn:none> }"), 0, "", "lrt: no rows\n")
        said(lrt(baxter.url, "query", "ASK { GRAPH ?g { ?joint a ros:RevoluteJoint } }"), 0, "true\n")
        said(lrt(baxter.url, "query", "prefix ros: <http://example.org/>\nASK { GRAPH ?g { ?joint a ros:RevoluteJoint } }"), 0, "false\n")
        # Stops have their own names.
        assert "\nhalt()\t\t\tavailable, a stop\n" in lrt(odd.url, "ls", "types").stdout, lrt(odd.url, "ls", "types").stdout
        said(lrt(odd.url, "invoke", "types/halt"), 0, "")
        assert lrt(odd.url, "help").stdout == lrt(odd.url, "--help").stdout != ""
        assert lrt(odd.url, "help", "get").stdout == lrt(odd.url, "get", "--help").stdout != ""


# --- profiles


def profiles():
    with Program(ODD) as odd, tempfile.TemporaryDirectory() as home:
        tokens = os.path.join(home, "tokens")
        with open(tokens, "w") as file:
            file.write("alice operator 0123456789abcdef0123456789abcdef\n")
        os.chmod(tokens, 0o600)
        folder = os.path.join(home, "lrt")
        os.mkdir(folder)
        config, token = os.path.join(folder, "robots.toml"), os.path.join(folder, "arm.token")

        def write(text, mode=0o600):
            with open(config, "w") as file:
                file.write(text)
            os.chmod(config, mode)

        with open(token, "w") as file:
            file.write("0123456789abcdef0123456789abcdef\n")
        os.chmod(token, 0o600)
        with Robot("--tokens", tokens) as arm:
            env = {"XDG_CONFIG_HOME": home}
            text = f'robot = "odd"\n\n[arm]\nrobot = "{arm.url}"\ntoken-file = "arm.token"\n\n[odd]\nrobot = "{odd.url}"\n'
            write(text)
            said(lrt(None, "get", "types/single", **env), 0, "0.3\n")
            said(lrt(None, "get", "right_s1/friction", "-r", "arm", **env), 0, "0.7\n")
            said(lrt("arm", "get", "right_s1/friction", **env), 0, "0.7\n")
            said(lrt("arm", "get", arm.at("baxter/right_s1/friction"), **env), 0, "0.7\n")
            said(lrt("arm", "get", odd.at("types/single"), **env), 0, "0.3\n")
            said(lrt(arm.url, "get", "right_s1/friction", **env), 1, "", None)  # a URL has no profile
            # The token of the profile does not go to another robot.
            seen = lrt("arm", "-v", "ls", odd.url, **env)
            assert seen.returncode == 0 and "Bearer" not in seen.stderr, seen
            done = lrt("amr", "ls", **env)
            assert done.returncode == 2 and 'neither a URL nor a profile' in done.stderr and 'did you mean "arm"?' in done.stderr, done
            os.chmod(token, 0o644)
            done = lrt("arm", "ls", **env)
            assert done.returncode == 2 and "others can read" in done.stderr and "chmod 600" in done.stderr, done
            said(lrt("odd", "get", "types/single", **env), 0, "0.3\n")
            os.chmod(token, 0o600)
            write(text, 0o666)
            done = lrt("odd", "ls", **env)
            assert done.returncode == 2 and "others can write" in done.stderr, done
            write(text.replace("token-file", "tokenfile"))
            done = lrt("odd", "ls", **env)
            assert done.returncode == 2 and 'unknown key "tokenfile"; did you mean "token-file"?' in done.stderr, done
            write('[arm]\nrobot = "arm.example"\n')
            done = lrt("arm", "ls", **env)
            assert done.returncode == 2 and "begins with http:// or https://" in done.stderr, done
            os.remove(config)
            done = lrt(None, "ls", **env)
            assert done.returncode == 2 and "no robot is given" in done.stderr, done


# --- signals


def signals():
    """An invocation is cancelled when whoever waits for it is told to end, or loses the terminal."""
    with Program(ODD) as odd:
        for name in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            running = subprocess.Popen([LRT, "invoke", "types/drive"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment(odd.url))
            until(lambda: "true" in lrt(odd.url, "get", "types/driving").stdout, "a robot that drives")
            running.send_signal(name)
            out, err = running.communicate(timeout=PATIENCE)
            assert (running.returncode, out, err) == (128 + name, "", 'lrt: "drive" is cancelled\n'), (name, running.returncode, out, err)
            until(lambda: "false" in lrt(odd.url, "get", "types/driving").stdout, f"a robot that stands after {name}")
        # A shell that is closed: its terminal goes, and the command gets SIGHUP.
        master, slave = os.openpty()

        def lead():
            import fcntl
            import termios
            os.setsid()
            fcntl.ioctl(slave, termios.TIOCSCTTY, 0)

        running = subprocess.Popen([LRT, "invoke", "types/drive"], stdin=slave, stdout=slave, stderr=slave, env=environment(odd.url), preexec_fn=lead)
        os.close(slave)
        until(lambda: "true" in lrt(odd.url, "get", "types/driving").stdout, "a robot that drives")
        os.close(master)
        assert running.wait(PATIENCE) == 129, running.returncode
        until(lambda: "false" in lrt(odd.url, "get", "types/driving").stdout, "a robot that stands without a terminal")


# --- a robot that has another name


def public_base():
    """Commands at the address of a robot with a public base say which URL is its own, and do not end as if something had been done."""
    own = "https://robots.example/cell7"
    with Robot("--public-base", own) as robot, tempfile.TemporaryDirectory() as folder:
        def is_told(*words, name="/"):
            url = robot.url.rstrip("/")
            done = lrt(robot.url, *words)
            assert done.returncode == 1, f"expected status 1: {done}"
            assert done.stderr == f'lrt: "{url}{name}" is a robot whose public base is another one: use "{own}{name}"\n', done
            assert not done.stdout, done

        thing = "/baxter/right_s0"
        at = robot.url.rstrip("/") + thing
        for words in (["ls"], ["ls", "right_s0"], ["get", "right_s0/position"], ["get", "right_s0"], ["get", "right_*/position"], ["set", "right_s0/friction", "1"],
                      ["invoke", "right_s0/rotate", "0.1"], ["watch", "right_s0/position", "--count", "1"], ["subs"], ["subs", "right_s0"],
                      ["blueprint", "right_s0"], ["validate", "right_s0/friction", "1"], ["generate"], ["check", "--no-subscriptions"],
                      ["record", "right_s0/position", "-o", os.path.join(folder, "a"), "--count", "1"]):
            is_told(*words)
        for words in (["get", at], ["watch", at, "--count", "1"], ["check", at], ["record", at, "-o", os.path.join(folder, "b"), "--count", "1"]):
            is_told(*words, name=thing)
        is_told("watch", at + "/position", "--count", "1", name=thing + "/position")
        assert os.listdir(folder) == [], os.listdir(folder)
        with open(os.path.join(HERE, "..", "..", "docs", "fleet.md"), encoding="utf-8") as page:
            assert f'`"http://10.0.0.7:8080/" is a robot whose public base is another one: use "{own}/"`' in page.read()
        # A value is read by the address that was typed.
        done = lrt(None, "get", at + "/position")
        assert done.returncode == 0 and '"unit":"rad"' in done.stdout, done
        done = lrt(robot.url, "query", "ASK {?s ?p ?o}")
        assert done.returncode == 1 and own + "/sparql" in done.stderr, done


def nothing_done():
    """What did nothing says so by its status."""
    with tempfile.TemporaryDirectory() as folder, Program(ODD) as odd:
        empty, header = os.path.join(folder, "empty.ttl"), os.path.join(folder, "robot.hpp")
        with open(empty, "w", encoding="ascii") as file:
            file.write("<urn:a> <urn:b> <urn:c> .")
        sentence = "lrt: there is nothing to generate: the documents describe no Thing and no shape that a type can express\n"
        said(lrt(None, "generate", empty), 1, "", sentence)
        said(lrt(None, "generate", empty, "-o", header), 1, "", sentence)
        assert not os.path.exists(header)
        with open(header, "w", encoding="ascii") as file:
            file.write("// Made by `lrt generate`\n")
        said(lrt(None, "generate", empty, "--check", header), 1, "", sentence)
        recording = os.path.join(folder, "none.jsonl")
        done = lrt(odd.url, "record", "types/angle", "-o", recording, "--for", "0")
        assert done.returncode == 1 and "no value has come" in done.stderr, done


def main():
    global LRT, ODD
    LRT, Robot.program, ODD = os.path.abspath(sys.argv[1]), sys.argv[2], sys.argv[3]
    if sys.argv[4:] == ["--write"]:
        return wrong_commands(write=True)
    for case in (wrong_commands, texts, option_values, names, resources, profiles, signals, public_base, nothing_done):
        if sys.argv[4:] and case.__name__ not in sys.argv[4:]:
            continue
        begin = time.monotonic()
        case()
        print(f"{case.__name__}: {time.monotonic() - begin:.1f} s", flush=True)
    return None


if __name__ == "__main__":
    main()
