# SPDX-License-Identifier: Apache-2.0
"""The options of lrt-ros2, its configuration file, its man page and its completion. Nobody else is in the domain.

  program_test.py LRT_ROS2 SOURCE
"""
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile

from robot_in_domain import PATIENCE, Domain, Process

PROGRAM, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
DOMAIN = Domain()


def run(*words, **environment):
    return subprocess.run([PROGRAM, *words], env=DOMAIN.environment(**environment), capture_output=True, text=True, timeout=PATIENCE)


def refuses(words, *parts, status=2, **environment):
    done = run(*words, **environment)
    assert done.returncode == status, (words, done)
    assert done.stdout == "" and done.stderr.startswith("lrt-ros2: ") and done.stderr.count("\n") == 1, (words, done)
    for part in parts:
        assert part in done.stderr, (words, part, done.stderr)


def options():
    text = run("--help")
    assert text.returncode == 0 and text.stderr == "" and text.stdout.startswith("usage: lrt-ros2 "), text
    assert max(len(line) for line in text.stdout.splitlines()) <= 132, text.stdout
    names = re.findall(r"^  (--[\w-]+)", text.stdout, re.M)
    assert len(names) > 30 and len(set(names)) == len(names), names
    assert run("-h").stdout == text.stdout
    version = run("--version")
    assert re.fullmatch(r"lrt-ros2 \d+\.\d+\.\d+\n", version.stdout), version
    refuses(["--doman", "3"], 'no option "--doman"', 'did you mean "--domain"?')
    refuses(["--domain"], "--domain needs a value: N")
    refuses(["--domain", "300"], "--domain: expected a number from 0 to 232", '"300"')
    refuses(["--domain=7x"], "7x")
    refuses(["--list=yes"], "--list takes no value")
    refuses(["arm"], 'found "arm"', "--help")
    refuses(["--port", "70000"], "from 0 to 65535")
    refuses(["--namespace", "arm"], "begins with '/'")
    refuses(["--allow-topics", "cmd_vel"], "'/cmd_vel'")
    refuses(["--log", "loud"], "debug, info, warning or error")
    refuses(["--transport", "carrier-pigeon"], "http")
    refuses(["--completion", "fish"], "bash or zsh")
    refuses(["--definitions", "/nowhere"], "/nowhere")
    refuses(["--mapping", "/nowhere.toml"], "/nowhere.toml")
    refuses(["--config", "/nowhere.toml"], "/nowhere.toml")
    refuses(["--bind", "0.0.0.0", "--port", "0"], "0.0.0.0")  # without rights
    refuses([], "ROS_DOMAIN_ID", "many", ROS_DOMAIN_ID="many")
    refuses(["--mqtt", "broker", "--port", "0"], "--mqtt", "--identity", "--public-base")
    refuses(["--mqtt", "broker:many", "--port", "0", "--public-base", "http://r7.example"], "--mqtt: expected HOST")
    refuses(["--identity", "/nowhere/identity.json"], "--identity", "/nowhere/identity.json")
    refuses(["--\x1b[31m"], r"\x1b[31m")  # not to the terminal as it is
    return names


def configuration(folder):
    path = os.path.join(folder, "lrt.toml")

    def write(text):
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)

    for text, *parts in (
        ("[server]\nprot = 1\n", ":2:1: ", '[server] has no key "prot"', 'did you mean "port"?'),
        ("[server]\nport = \"x\"\n", ":2:", "port: expected a number"),
        ("[server]\nport = 70000\n", ":2:", "port: ", "70000"),
        ("[sever]\n", ":1:", 'no table "sever"', 'did you mean "server"?'),
        ("server = 1\n", ":1:", "[server]: expected a table"),
        ("[security]\nanyone = [\"read\", \"fly\"]\n", ":2:", "anyone", '"fly"'),
        ("[security]\nanyone = [1]\n", ":2:", "expected a list of texts"),
        ("[security]\ncertificate = \"a.pem\"\n", "both certificate and key"),
        ("[log]\nlevel = true\n", ":2:", "level: expected a text"),
        ("[graph]\ndomain = 700\n", "domain"),
        ("[graph]\ndomian = 7\n", "domian"),
        ("[[topic]]\nname = \"/a\"\nunti = \"m\"\n", "unti"),
        ("[server\n", ":1:"),
        ("[@server]\n", ":1:"),
        ("[server]\ntitle = 'R\u00e4der'\n", ":2:11: ", "double quotes"),
    ):
        write(text)
        refuses(["--config", path], *([path] if parts[0].startswith(":") else []), *parts)
    write("[graph]\ndomain = 7\n")
    refuses(["--config", path, "--config", path], "given twice")
    # What counts more: the command line, the file, the environment.
    for words, environment, domain in (([], {}, 7), (["--domain", "9"], {}, 9), ([], {"ROS_DOMAIN_ID": "8"}, 7)):
        done = run("--config", path, "--list", *words, **environment)
        assert done.returncode == 1 and f"nobody is in domain {domain} " in done.stderr, done
    # All of the page are keys.
    with open(os.path.join(SOURCE, "docs", "ros2.md"), encoding="utf-8") as file:
        page = file.read()
    with open(os.path.join(SOURCE, "tools", "lrt-ros2", "settings.cpp"), encoding="utf-8") as file:
        keys = set(re.findall(r'^    \{"(server|security|mqtt|log)", "(\w+)"', file.read(), re.M))
    said = set()
    for table, row in re.findall(r"^\| `\[(server|security|mqtt|log)\]` \| (.*) \|$", page, re.M):
        said |= {(table, key) for key in re.findall(r"`(\w+)`", row)}
    assert keys and keys == said, keys ^ said


def man_page(names):
    page = os.path.join(SOURCE, "tools", "lrt-ros2", "lrt-ros2.1")
    with open(page, encoding="utf-8") as file:
        text = file.read()
    for name in names:
        assert "Fl -" + name[2:] in text, "lrt-ros2.1 has no " + name
    if shutil.which("mandoc"):
        done = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", page], capture_output=True, text=True, timeout=PATIENCE)
        assert done.stdout == "", done.stdout
    else:
        print("skipped: mandoc is not installed")


def completion():
    script = run("--completion", "bash").stdout
    asked = script + '\nCOMP_WORDS=(lrt-ros2 --allow-t); COMP_CWORD=1; _lrt_ros2; echo "${COMPREPLY[@]}"\n'
    done = subprocess.run(["bash", "-c", asked], capture_output=True, text=True, timeout=PATIENCE)
    assert done.stdout == "--allow-topics\n" and done.stderr == "", done
    if shutil.which("zsh"):
        done = subprocess.run(["zsh", "-n", "/dev/stdin"], input=run("--completion", "zsh").stdout, capture_output=True, text=True, timeout=PATIENCE)
        assert done.returncode == 0, done
    else:
        print("skipped: zsh is not installed")


def signals():
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        with Process([PROGRAM, "--port", "0"], DOMAIN.environment()) as program:
            program.wait_for(r"domain %d of ROS 2 is at http://127\.0\.0\.1:\d+/" % DOMAIN.number)
            assert program.end(number) == 0
    with Process([PROGRAM, "--port", "0"], DOMAIN.environment()) as program:
        program.wait_for("nobody is in domain %d on this machine" % DOMAIN.number)
        assert program.end() == 0
    # A port that is in use.
    with Process([PROGRAM, "--port", "0"], DOMAIN.environment()) as program:
        port = program.wait_for(r"127\.0\.0\.1:(\d+)/").group(1)
        refuses(["--port", port], port, status=1)


def main():
    names = options()
    man_page(names)
    completion()
    with tempfile.TemporaryDirectory() as folder:
        configuration(folder)
    signals()
    print("ok: %d options" % len(names))


main()
