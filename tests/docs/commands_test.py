# SPDX-License-Identifier: Apache-2.0
"""The commands of the pages give the outputs that the pages show.

  commands_test.py ROOT EXAMPLES[:FOLDER...] PAGE...     PAGE is relative to ROOT
  commands_test.py ROOT                                  only looks that no page has commands that no test runs

EXAMPLES is the folder of the built examples; its programs and those of each FOLDER are found by their names. All blocks of a page with lines that begin with "$ " run one after the other in one shell, on the robot that
the page names: `examples/run.sh PROGRAM ARGUMENTS` is EXAMPLES/PROGRAM, and `examples/run.sh` alone is Baxter's arm. A page without it starts its robots
itself. Servers get a free port in place of 8080. A line that begins with "> " continues a command. "…" in an output stands for any text of a line, or for
any lines.
"""
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(sys.argv[1]).resolve()
# Page: how many commands it has at least. Those of docs/command.md have a test of their own.
PAGES = {"README.md": 4, "docs/actions.md": 3, "docs/check.md": 7, "docs/porting/webthing-cpp.md": 3, "docs/queries.md": 1, "docs/subscriptions.md": 2, "docs/things.md": 8, "docs/tour.md": 20, "docs/types.md": 4}
ELSEWHERE = {"docs/command.md": "tests/tools/command_test.py", "docs/ros2.md": "tests/ros2/robot_test.py"}
# Programs that serve the code of a page.
ROBOTS = {"docs/porting/webthing-cpp.md": "docs_snippets_porting --serve 8080"}


def blocks_of(page):
    return re.findall(r"^```(\w*)\n((?:.*\n)*?)```$", (ROOT / page).read_text(encoding="utf-8"), re.M)


def steps_of(page, port):
    """Commands with the outputs that are expected."""
    steps = []
    for language, block in blocks_of(page):
        if language != "console":
            continue
        for line in block.replace("8080", port).splitlines():
            if line.startswith("$ "):
                steps.append([line[2:], []])
            elif line.startswith("> "):
                steps[-1][0] += "\n" + line[2:]
            else:
                steps[-1][1].append(line)
    return steps


def robot_of(page, examples):
    """The command that starts the robot of the page; empty: its commands do."""
    if page in ROBOTS:
        return ROBOTS[page]
    found = re.search(r"examples/run\.sh(?: (t\d\d_\w+)((?: [\w.-]+)*))?", (ROOT / page).read_text(encoding="utf-8"))
    if not found or page == "docs/tour.md":
        return ""
    if found.group(1):
        return "%s/%s%s" % (examples, found.group(1), found.group(2))
    return "%s/baxter/baxter --port 8080" % examples


def pattern_of(expected):
    lines = "\n".join(expected).strip("\n").split("\n")
    return "".join(r"(?:.*\n)*?" if line.strip() == "…" else re.escape(line).replace("…", ".*") + r"\n" for line in lines)


def run(page, examples):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = str(probe.getsockname()[1])
    steps = steps_of(page, port)
    if len(steps) < PAGES[page]:
        print("%s has lost its commands: %d" % (page, len(steps)))
        return 1
    wait = "for i in $(seq 300); do curl -s -o /dev/null http://127.0.0.1:%s/ && break; sleep 0.1; done" % port
    script = []
    robot = robot_of(page, examples).replace("8080", port)
    if robot:
        script += ["%s >/dev/null 2>&1 &" % robot, wait]
    for number, (command, _) in enumerate(steps):
        command = command.replace("build/release/examples", examples)
        script.append("echo '=== step %d ==='" % number)
        if command.endswith("&"):  # the next command needs the server
            script += ["%s >/dev/null 2>&1 &" % command[:-1], wait]
        elif command.startswith("kill"):  # the next server needs the port
            script.append(command + "; wait $! 2>/dev/null")
        else:
            script.append("{ %s\n} 2>&1" % command)
    script.append("echo; echo '=== step %d ==='" % len(steps))
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(["bash", "-c", "\n".join(script)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, cwd=folder,
                                   env={**os.environ, "PATH": ":".join([*FOLDERS, os.environ["PATH"]])}, start_new_session=True)
        try:
            output = process.communicate(timeout=150)[0]
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output = process.communicate()[0]
        finally:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass

    failed = 0
    for number, (command, expected) in enumerate(steps):
        found = re.search(r"=== step %d ===\n(.*?)=== step %d ===" % (number, number + 1), output, re.S)
        found = found.group(1).replace("\r", "").strip("\n") if found else "(it was not reached)"
        if not re.fullmatch(pattern_of(expected), found + "\n"):
            failed += 1
            print("%s: $ %s\nexpected:\n%s\nfound:\n%s\n" % (page, command, "\n".join(expected), found))
    print("%s: %d commands, %d failed" % (page, len(steps), failed))
    return failed


def check_pages():
    """Pages of the guide with commands that no test runs."""
    failed = 0
    for path in sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]):
        page = path.relative_to(ROOT).as_posix()
        for language, block in blocks_of(page):
            if re.search(r"^\$ ", block, re.M) and ((page not in PAGES and page not in ELSEWHERE) or language != "console"):
                print("%s: no test runs this block; mark it as console, and list the page in tests/docs/commands_test.py:\n%s" % (page, block))
                failed += 1
    for page, test in ELSEWHERE.items():
        if Path(page).name not in (ROOT / test).read_text(encoding="utf-8"):
            print("%s does not read %s" % (test, page))
            failed += 1
    return failed


if len(sys.argv) == 2:
    sys.exit(1 if check_pages() else 0)
for tool in ("bash", "curl", "jq"):
    if shutil.which(tool) is None:
        print("skipped: %s is not installed" % tool)
        sys.exit(77)
FOLDERS = sys.argv[2].split(":")
sys.exit(1 if sum(run(page, FOLDERS[0]) for page in sys.argv[3:]) else 0)
