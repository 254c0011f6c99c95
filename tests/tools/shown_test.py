# SPDX-License-Identifier: Apache-2.0
"""What the command shows on a terminal: screens of tmux with 80 and 160 columns are those in shown/, which people have read.

usage: shown_test.py LRT BAXTER ODD_ROBOT [--write]     --write: makes the files in shown/ anew

A port is shown as "PORT_" and the time of day as "hh:mm:ss.mmm", because they differ each time and these take as many columns.
"""

import difflib
import itertools
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import PATIENCE, Program, Robot  # noqa: E402

NUMBERS = itertools.count()
SHOWN = os.path.join(os.path.dirname(os.path.abspath(__file__)), "shown")
# The name of the file: the robot and the commands on it.
SCREENS = {
    "ls": ("baxter", ["lrt ls", "lrt ls -l --type ros:RevoluteJoint", "lrt ls right_s1", "lrt ls baxter"]),
    "ls_odd": ("odd", ["lrt ls", "lrt ls types", "lrt ls 'x y'", "lrt ls empty"]),
    "get": ("baxter", ["lrt get right_s1/position", "lrt get right_s1/position --unit deg", "lrt get right_s1/limits", "lrt get right_s1/effort",
                       "lrt get right_s1", "lrt get 'right_s?/friction' --unit-iri", "lrt get right_s1/state", "lrt get right_s1/dynamics --json"]),
    "get_odd": ("odd", ["lrt get types/number", "lrt get types/number --full", "lrt get types", "lrt get camera/image --accept image/png", "lrt get 'x y/val ue+'"]),
    "watch": ("baxter", ["lrt watch right_s1/position --count 1", "lrt watch right_s1/limits --count 1", "lrt watch right_s1/friction --count 1 --csv | tail -1 | cut -d, -f2-"]),
    "other": ("baxter", ["lrt blueprint right_s1 -p", "lrt subs", "lrt query 'SELECT ?joint { GRAPH ?joint { ?joint a ros:RevoluteJoint } } ORDER BY ?joint LIMIT 3'",
                         "lrt validate right_s1/friction 1", "lrt validate right_s1/friction 70"]),
    "errors": ("baxter", ["lrt", "lrt gte", "lrt ls right_s9", "lrt get right_s1/positon", "lrt get position", "lrt get right_s1/rotate", "lrt set right_s1 1",
                          "lrt set right_s1/friction 70", "lrt set right_s1/friction fast", "lrt invoke right_s1/rotate", "lrt ls --robot http://127.0.0.1:1/",
                          "lrt get right_s1/colour", "lrt get 'left_*'"]),
    "help": ("baxter", ["lrt help", "lrt help get"]),
}

WIDE = ("ls", "get", "watch", "errors")  # also with 160 columns


class Screen:
    """A terminal of tmux, with a server of its own."""

    def __init__(self, folder, columns, rows=250):
        self.base = ["tmux", "-f", "/dev/null", "-S", os.path.join(folder, f"tmux{next(NUMBERS)}")]  # one server for each: it ends in its own time
        self.columns, self.rows = columns, rows

    def run(self, *words):
        return subprocess.run([*self.base, *words], capture_output=True, text=True, timeout=PATIENCE, check=True).stdout

    def show(self, commands, env):
        """Each command with what it prints and its status."""
        script = "".join(f"export {name}={shlex.quote(value)}; " for name, value in env.items()) + "stty -echo; clear; "
        script += "".join(f"echo {shlex.quote('$ ' + command)}; {command}; echo \"[$?]\"; echo; " for command in commands) + "echo [end]; read -r line"
        self.run("new-session", "-d", "-x", str(self.columns), "-y", str(self.rows), "bash", "--norc", "-c", script)
        end = time.monotonic() + 3 * PATIENCE
        while True:
            lines = [line.rstrip() for line in self.run("capture-pane", "-p").split("\n")]
            while lines and not lines[-1]:
                lines.pop()
            if lines and lines[-1] == "[end]":
                break
            assert time.monotonic() < end, f"{commands} do not end: {lines}"
            time.sleep(0.05)
        self.run("kill-server")
        return lines[:-1]


def screens(name, columns, url, lrt):
    env = {"LRT_ROBOT": url, "LC_ALL": "C.UTF-8", "PATH": os.path.dirname(lrt) + ":" + os.environ["PATH"], "HOME": "/nonexistent", "NO_COLOR": "1"}
    port = re.search(r":(\d+)/", url)[1]
    with tempfile.TemporaryDirectory() as folder:
        lines = Screen(folder, columns).show(SCREENS[name][1], env)
    shown = "\n".join(lines).replace(":" + port + "/", ":PORT_/")
    return re.sub(r"\b\d\d:\d\d:\d\d\.\d{3}\b", "hh:mm:ss.mmm", shown) + "\n"


def main():
    lrt, Robot.program, odd_robot = os.path.abspath(sys.argv[1]), sys.argv[2], sys.argv[3]
    if not shutil.which("tmux"):
        print("skipped: tmux is not installed")
        return 77
    faults = 0
    with Robot() as baxter, Program(odd_robot) as odd:
        for robot in (baxter, odd):
            assert len(str(robot.port)) == 5, robot.port
        for name, (robot, _) in SCREENS.items():
            for columns in (80, 160) if name in WIDE else (80,):
                found = screens(name, columns, baxter.url if robot == "baxter" else odd.url, lrt)
                file = os.path.join(SHOWN, f"{name}-{columns}.txt")
                if "--write" in sys.argv:
                    os.makedirs(SHOWN, exist_ok=True)
                    with open(file, "w", encoding="utf-8") as out:
                        out.write(found)
                    continue
                with open(file, encoding="utf-8") as stored:
                    wanted = stored.read()
                if found != wanted:
                    faults += 1
                    print("\n".join(difflib.unified_diff(wanted.split("\n"), found.split("\n"), file, "found", lineterm="")))
    print(f"{len(SCREENS)} screens at 80 columns, {len(WIDE)} at 160, {faults} differ")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
