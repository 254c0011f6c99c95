# SPDX-License-Identifier: Apache-2.0
"""Counts the instructions of the hot paths with callgrind, and prints what differs from the table in git.

  instructions.py HOT_PATHS [--update]      --update writes tests/bench/instructions.txt

A count is the difference between a run and one with three times as many repetitions, for one repetition: start-up does not count. It depends on
the compiler and its options, so that counts are compared for one build (RelWithDebInfo) on one distribution. Nothing is asserted.
"""
import os
import re
import subprocess
import sys

TABLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "instructions.txt")


def instructions(program, path, count):
    done = subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", program, path, str(count)], capture_output=True,
                          text=True, timeout=600)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode != 0 or not found:
        sys.exit(f"{path} {count}: {done.stdout}{done.stderr}")
    return int(found[1])


def main():
    program = sys.argv[1]
    listed = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    counts = {}
    for path, count in (line.split() for line in listed.splitlines()):
        once = int(count)
        counts[path] = round((instructions(program, path, 3 * once) - instructions(program, path, once)) / (2 * once))
    known = {}
    if os.path.exists(TABLE):
        with open(TABLE, encoding="ascii") as file:
            known = {path: int(count) for path, count in (line.split() for line in file if not line.startswith("#"))}
    print(f"{'instructions':28} {'now':>11} {'table':>11} {'difference':>10}")
    for path, now in counts.items():
        before = known.get(path)
        print(f"{path:28} {now:11,} " + (f"{before:11,} {100 * (now - before) / before:+9.1f} %" if before else f"{'-':>11} {'-':>10}"))
    for path in known.keys() - counts.keys():
        print(f"{path}: in the table only")
    if "--update" in sys.argv[2:]:
        with open(TABLE, "w", encoding="ascii") as file:
            file.write("# Instructions of one repetition of each hot path (tests/bench/instructions.py), g++ 12, RelWithDebInfo, x86-64.\n")
            file.writelines(f"{path} {now}\n" for path, now in counts.items())


if __name__ == "__main__":
    main()
