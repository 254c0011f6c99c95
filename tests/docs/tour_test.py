# SPDX-License-Identifier: Apache-2.0
"""The commands of docs/tour.md give the outputs that the page shows.

  tour_test.py ROOT EXAMPLES

EXAMPLES is the folder of the built examples. Servers get a free port in place of 8080. "…" in an output stands for any text of a line, or for any lines.
"""
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path

root, examples = Path(sys.argv[1]), sys.argv[2]
for tool in ("bash", "curl", "jq"):
    if shutil.which(tool) is None:
        print("skipped: %s is not installed" % tool)
        sys.exit(77)
with socket.socket() as probe:
    probe.bind(("127.0.0.1", 0))
    port = str(probe.getsockname()[1])

# Commands with the outputs that are expected.
text = (root / "docs/tour.md").read_text(encoding="utf-8").replace("8080", port)
steps = []
for block in re.findall(r"```console\n(.*?)```", text, re.S):
    for line in block.splitlines():
        if line.startswith("$ "):
            steps.append([line[2:], []])
        elif line.startswith("> "):
            steps[-1][0] += "\n" + line[2:]
        else:
            steps[-1][1].append(line)
if len(steps) < 20:
    sys.exit("docs/tour.md has lost its commands: %d" % len(steps))

script = []
for number, (command, _) in enumerate(steps):
    command = command.replace("build/release/examples", examples)
    script.append("echo '=== step %d ==='" % number)
    if command.endswith("&"):  # the next command needs the server
        script.append("%s >/dev/null 2>&1 &" % command[:-1])
        script.append("for i in $(seq 100); do curl -s -o /dev/null http://127.0.0.1:%s/ && break; sleep 0.1; done" % port)
    elif command.startswith("kill"):  # the next server needs the port
        script.append(command + "; wait $! 2>/dev/null")
    else:
        script.append(command)
script.append("echo '=== step %d ==='" % len(steps))
process = subprocess.Popen(["bash", "-c", "\n".join(script)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True)
try:
    output = process.communicate(timeout=100)[0]
finally:
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass

failed = 0
for number, (command, expected) in enumerate(steps):
    found = re.search(r"=== step %d ===\n(.*?)=== step %d ===" % (number, number + 1), output, re.S)
    found = found.group(1).strip("\n") if found else "(it was not reached)"
    pattern = re.escape("\n".join(expected)).replace("…\n", "\0").replace("…", ".*")
    pattern = pattern.replace("…\\\n", "\0").replace("\0", "(?:.*\n)*?")
    if not re.fullmatch(pattern, found):
        failed += 1
        print("$ %s\nexpected:\n%s\nfound:\n%s\n" % (command, "\n".join(expected), found))
print("%d commands, %d failed" % (len(steps), failed))
sys.exit(1 if failed else 0)
