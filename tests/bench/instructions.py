# SPDX-License-Identifier: Apache-2.0
"""Counts the instructions of the hot paths with callgrind, and judges them by the table in git.

  instructions.py HOT_PATHS [PATH ...]                 all paths, or those named
  instructions.py HOT_PATHS --update REASON            writes tests/bench/instructions.txt

A path that needs more than 2 % more than in the table is a failure. If that is intended, update the table in the same commit: the reason is kept
beside each count that has grown. A path that needs more than 2 % less is reported, so that the table can follow.

A count is the difference between a run and one with three times as many repetitions, for one repetition: start-up does not count. It is the same in
each run of one program: hot_paths has fixed seeds and a fixed clock, valgrind fixed addresses, and here the environment and the functions that libc
chooses by the processor are fixed. It depends on the compiler and on libc, which hot_paths names: with others than those of the table nothing is
judged.

Exit status: 0, 1: a path became more expensive, or path and table differ, 77: not judged.
"""
import argparse
import os
import re
import subprocess
import sys

TABLE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "instructions.txt")
LIMIT = 0.02
# Without these libc takes its functions for any x86-64.
BY_PROCESSOR = ("AVX512F", "AVX512VL", "AVX512BW", "AVX2", "AVX", "ERMS", "FSRM", "BMI2", "SSE4_2", "SSE4_1", "SSSE3", "RTM", "AVX_Fast_Unaligned_Load",
                "Fast_Unaligned_Copy", "Fast_Unaligned_Load", "Fast_Copy_Backward", "Fast_Rep_String", "Slow_BSF", "Prefer_No_VZEROUPPER")
ENVIRONMENT = {"PATH": "/usr/bin:/bin", "LC_ALL": "C", "GLIBC_TUNABLES": "glibc.cpu.hwcaps=" + ",".join("-" + name for name in BY_PROCESSOR)}


def instructions(program, path, count):
    done = subprocess.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", program, path, str(count)], capture_output=True,
                          text=True, timeout=600, check=False, env=ENVIRONMENT)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode != 0 or not found:
        sys.exit(f"{path} {count}: {done.stdout}{done.stderr}")
    return int(found[1])


def count_all(program, listed, names):
    unknown = set(names) - {line.split()[0] for line in listed}
    if unknown:
        sys.exit("no such path: " + ", ".join(sorted(unknown)))
    counts = {}
    for path, count in (line.split() for line in listed):
        if not names or path in names:
            once = int(count)
            counts[path] = round((instructions(program, path, 3 * once) - instructions(program, path, once)) / (2 * once))
    return counts


def read_table():
    """What built the program that was counted, the counts, and the reasons."""
    build, counts, reasons = "", {}, {}
    with open(TABLE, encoding="utf-8") as file:
        for line in file:
            if line.startswith("# build: "):
                build = line[len("# build: "):].strip()
            elif not line.startswith("#"):
                row, _, reason = line.partition("#")
                path, count = row.split()
                counts[path], reasons[path] = int(count), reason.strip()
    return build, counts, reasons


def write_table(build, counts, reasons):
    with open(TABLE, "w", encoding="utf-8") as file:
        file.write("# Instructions of one repetition of each hot path (tests/bench/instructions.py), RelWithDebInfo; why a count has grown.\n")
        file.write(f"# build: {build}\n")
        file.writelines(f"{path} {now}" + (f"  # {reasons[path]}" if reasons.get(path) else "") + "\n" for path, now in counts.items())


def judge(counts, known, all_paths):
    """Prints the table beside the counts, and returns what is wrong."""
    faults, cheaper = [], []
    print(f"{'instructions':28} {'now':>11} {'table':>11} {'difference':>10}")
    for path, now in counts.items():
        before = known.get(path)
        if before is None:
            print(f"{path:28} {now:11,} {'-':>11} {'-':>10}")
            faults.append(f"{path}: it is not in the table")
            continue
        growth = (now - before) / before
        print(f"{path:28} {now:11,} {before:11,} {100 * growth:+9.1f} %")
        if growth > LIMIT:
            faults.append(f"{path}: {now:,} instructions, {100 * growth:.1f} % more than the {before:,} of the table")
        elif growth < -LIMIT:
            cheaper.append(f"{path} takes {-100 * growth:.1f} % less than in the table")
    faults += [f"{path}: it is in the table only" for path in known if path not in all_paths]
    if cheaper:
        print("\n".join(cheaper) + "\nUpdate the table, so that this is kept.")
    return faults


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("program")
    parser.add_argument("paths", nargs="*")
    parser.add_argument("--update", metavar="REASON")
    arguments = parser.parse_args()
    if arguments.update is not None and (arguments.paths or not arguments.update.strip()):
        sys.exit("--update REASON: expected a reason, and no paths")
    listed = subprocess.run([arguments.program], capture_output=True, text=True, check=True).stdout.splitlines()
    build = listed.pop(0).lstrip("# ")
    known_build, known, reasons = read_table()
    is_judged = build == known_build
    if not is_judged and arguments.update is None:
        print(f"skipped: {TABLE} is of {known_build}, and this program of {build}")
        return 77
    counts = count_all(arguments.program, listed, arguments.paths)
    faults = judge(counts, known, {line.split()[0] for line in listed})
    if arguments.update is not None:
        grown = {path for path, now in counts.items() if is_judged and now > known.get(path, now) * (1 + LIMIT)}
        write_table(build, counts, {path: arguments.update.strip() if path in grown else reasons.get(path, "") for path in counts})
        return 0
    if faults:
        print("\n".join(faults))
        print("If this is intended, say why in the same commit:\n"
              f"  python3 {os.path.relpath(__file__)} {arguments.program} --update 'the reason'")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
