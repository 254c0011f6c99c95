# SPDX-License-Identifier: Apache-2.0
"""lrt record and lrt replay against robots whose values are counted, and MCAP as the libraries of its makers read it (npm: @mcap/core, @mcap/support).

usage: recording_test.py LRT RECORDED_ROBOT NODE_FOLDER [CASE...]

Without node, npm or its registry the cases with MCAP's own libraries are left out, and the reason is printed; in CI (LRT_CI) that is a failure.
"""

import contextlib
import gzip
import json
import os
import pathlib
import queue
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import PATIENCE, Program, http_request, until  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
PACKAGES = ("@mcap/core@2.2.2", "@mcap/support@1.1.0")
LRT = ROBOT = None
NODE = None  # the folder of the packages; None: there are none
FORMATS = ("jsonl", "mcap")


def node_modules(folder):
    """Why MCAP's own libraries are not there; None: they are."""
    if not shutil.which("node") or not shutil.which("npm"):
        return "there is no node, or no npm"
    folder.mkdir(parents=True, exist_ok=True)
    if all((folder / "node_modules" / name.rsplit("@", 1)[0] / "package.json").exists() for name in PACKAGES):
        return None
    made = subprocess.run(["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", *PACKAGES],
                          cwd=folder, capture_output=True, text=True, timeout=200, check=False)
    return None if made.returncode == 0 else "npm cannot install @mcap/core and @mcap/support: " + made.stderr.strip()[-300:]


def read_by_mcap(name, *more):
    done = subprocess.run(["node", str(HERE / "mcap_read.cjs"), str(NODE), name, *more], capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def environment():
    env = {k: v for k, v in os.environ.items() if k not in ("LRT_ROBOT", "LRT_TOKEN_FILE")}
    env.update({"LC_ALL": "C.UTF-8"})
    return env


def lrt(*words, status=0, stdin=None):
    done = subprocess.run([LRT, *map(str, words)], input=stdin, capture_output=True, timeout=PATIENCE, env=environment(), check=False)
    assert done.returncode == status, f"lrt {words}: expected {status}, found {done.returncode}: {done.stderr.decode()}"
    done.out, done.err = done.stdout.decode(), done.stderr.decode()
    return done


class Robot(Program):
    def __init__(self, port=0):
        # Program gives no standard input: a named pipe is one.
        self.folder = tempfile.TemporaryDirectory()
        pipe = os.path.join(self.folder.name, "commands")
        os.mkfifo(pipe)
        self.write_end = os.open(pipe, os.O_RDWR)
        super().__init__("/bin/sh", "-c", 'exec "$0" "$1" <"$2"', ROBOT, str(port), pipe)
        self.published = 1
        self.lines = queue.Queue()
        self.reader = threading.Thread(target=lambda: [self.lines.put(line.strip()) for line in self.process.stdout], daemon=True)
        self.reader.start()

    ends_with = (0, -signal.SIGTERM)

    def line(self):
        return self.lines.get(timeout=PATIENCE)

    def burst(self, count, wait=True):
        os.write(self.write_end, f"burst {count}\n".encode())
        if wait:
            self.wait_for_burst(count)

    def wait_for_burst(self, count):
        self.published += count
        line = self.line()
        assert line == f"published {self.published}", line

    def stop(self):
        if self.write_end is not None:
            os.close(self.write_end)
            self.write_end = None
            self.reader.join(PATIENCE)  # it has ended
        super().stop()

    def kill(self):
        os.close(self.write_end)
        self.write_end = None
        self.process.kill()
        self.reader.join(PATIENCE)
        super().kill()


class Recorder:
    def __init__(self, *words):
        self.log = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen([LRT, "record", *map(str, words)], stdout=subprocess.DEVNULL, stderr=self.log, env=environment())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.kill()
            self.process.wait(PATIENCE)

    def end(self, number=signal.SIGTERM):
        self.process.send_signal(number)
        status = self.process.wait(PATIENCE)
        assert status == 128 + number, (status, self.said())

    def said(self):
        self.log.seek(0)
        return self.log.read()

    def largest_mib(self):
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as status:
            return int(re.search(r"VmHWM:\s+(\d+)", status.read()).group(1)) // 1024


def info(name):
    return json.loads(lrt("record", "info", name, "--json").out)


def values_in(name):
    """How many values a file that is being written has, or has counted as missing."""
    return sum(p["values"] + p["leftOut"] for p in info(name)["properties"]) if os.path.exists(name) and os.path.getsize(name) > 100 else 0


def changes_of(name):
    """The lines of a file, or the messages of an MCAP in the same form."""
    if name.endswith(".jsonl"):
        with open(name, encoding="utf-8") as file:
            return [json.loads(line) for line in file][1:]
    return [dict(m["message"], url=m["message"].get("iri") or m["iri"]) for m in read_by_mcap(name)["messages"]]


def check_numbers(changes):
    """Each number from the first to the last is that of a value, or in a gap. Returns values and missing ones."""
    last, values, missing, gap = None, 0, 0, None
    for change in changes:
        if "gap" in change:
            gap = change
            continue
        number = change["sequence"]
        if last is not None and number != last + 1:
            assert gap, f"{last} and {number} without a gap"
            assert gap["leftOut"] == number - last - 1 and gap["from"]["sequence"] == last and gap["to"]["sequence"] == number, (gap, last, number)
            assert gap["cause"] in ("left out", "not taken"), gap
            assert gap["to"]["time"] == change["sourceTime"], (gap, change)
            missing += gap["leftOut"]
        gap = None
        values += 1
        last = number
    return values, missing


def stalled():
    """A recorder that is stopped under 1,000 values a second: each value is in the file, or counted in a gap."""
    for form in FORMATS:
        with Robot() as robot, tempfile.TemporaryDirectory() as folder:
            name = os.path.join(folder, "file." + form)
            with Recorder(robot.at("arm/wave"), "-o", name) as recorder:
                until(lambda: values_in(name) == 1, "the present value")
                robot.burst(100)
                until(lambda: values_in(name) == 101, "the values before")
                recorder.process.send_signal(signal.SIGSTOP)
                robot.burst(3_000)
                recorder.process.send_signal(signal.SIGCONT)
                robot.burst(100)

                until(lambda: values_in(name) >= robot.published, "the values after")
                assert recorder.largest_mib() < 300, recorder.largest_mib()
                recorder.end()
            found = info(name)
            one = found["properties"][0]
            assert found["complete"] and found["damaged"] == 0, found
            assert one["values"] + one["leftOut"] == robot.published == 3_201 and one["gapsOfUnknownLength"] == 0 and one["series"] == 1, found
            assert one["leftOut"] > 0 and one["gaps"] > 0, f"the robot held all values: {found}"
            if form == "jsonl" or NODE:
                changes = changes_of(name)
                values, missing = check_numbers(changes)
                assert (values, missing) == (one["values"], one["leftOut"]), (values, missing, found)
                published = [(change["value"][0], seconds_of(change["sourceTime"])) for change in changes if "value" in change]
                assert all(abs(at - published[0][1] - i / 1000) < 2e-6 for i, at in published), "the times are not the robot's"
            print(f"  {form}: {one['values']} values, {one['leftOut']} missing in {one['gaps']} gaps, {found['bytes']} bytes", flush=True)


def blocked():
    """A recorder whose output is not read: what it does not take in time is counted, too."""
    with Robot() as robot:
        process = subprocess.Popen([LRT, "record", robot.at("arm/wave"), "-o", "-", "--queue", "20"], stdout=subprocess.PIPE, text=True, env=environment())
        with process:
            changes = [json.loads(process.stdout.readline()) for _ in range(2)][1:]
            robot.burst(4_000)  # a pipe holds some hundred lines, and 100 values wait
            lines = queue.Queue()
            reader = threading.Thread(target=lambda: [lines.put(line) for line in process.stdout], daemon=True)
            reader.start()
            robot.burst(1)
            while changes[-1].get("sequence") != robot.published:
                changes.append(json.loads(lines.get(timeout=PATIENCE)))
            process.send_signal(signal.SIGTERM)
            reader.join(PATIENCE)
        assert process.returncode == 128 + signal.SIGTERM, process.returncode
        values, missing = check_numbers(changes)
        assert values + missing == robot.published, (values, missing, robot.published)
        causes = [change["cause"] for change in changes if "gap" in change]
        assert "not taken" in causes, causes
        print(f"  {values} values, {missing} missing: {causes}", flush=True)


def restarted():
    """A robot that is killed and started again begins another series."""
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        name = os.path.join(folder, "file.jsonl")
        robot = stack.enter_context(Robot())
        recorder = stack.enter_context(Recorder(robot.at("arm/wave"), "-o", name))
        until(lambda: values_in(name) == 1, "the present value")
        robot.burst(20)
        until(lambda: values_in(name) == 21, "the values before")
        robot.kill()
        until(lambda: "connection is lost" in recorder.said(), "the loss")
        again = stack.enter_context(Robot(robot.port))
        until(lambda: values_in(name) >= 22, "a value after")
        again.kill()
        recorder.end()
        changes = changes_of(name)
        gaps = [change for change in changes if change.get("cause") not in (None, "left out")]
        assert [gap["cause"] for gap in gaps] == ["restart", "connection"] and "leftOut" not in gaps[0], gaps
        assert gaps[0]["from"]["sequence"] == 21 and gaps[0]["to"]["sequence"] >= 1, gaps
        assert "to" not in gaps[1] or "sequence" not in gaps[1]["to"], gaps
        assert len({change["series"] for change in changes if "series" in change}) == 2, changes
        assert info(name)["properties"][0]["series"] == 2


def two_robots():
    """Two robots in one file, told apart by their IRIs; one of them, and its times, for a third."""
    with Robot() as left, Robot() as right, Robot() as third, tempfile.TemporaryDirectory() as folder:
        for form in FORMATS:
            name = os.path.join(folder, "file." + form)
            with Recorder(left.url, "arm/goal", "arm/wave", right.url, "arm", "-o", name) as recorder:  # two names, and all of a Thing
                until(lambda: values_in(name) == 5, "the present values")
                for i in (1, 2, 3):
                    for robot, value in ((left, i), (right, i + (0.5 if form == "jsonl" else 10))):
                        before = values_in(name)
                        lrt("set", robot.url, "arm/goal", value)
                        assert robot.line() == f"goal {value:g}"
                        until(lambda b=before: values_in(name) > b, "the value")
                recorder.end(signal.SIGHUP)
            found = info(name)
            assert found["robots"] == [left.url, right.url] and found["complete"], found
            assert {p["url"] for p in found["properties"]} == {left.at("arm/goal"), left.at("arm/wave"), right.at("arm/goal"), right.at("arm/wave"), right.at("arm/hand/goal")}
            assert all(p["robot"] == (left if p["url"].startswith(left.url) else right).url for p in found["properties"]), found
            assert {p["name"] for p in found["properties"]} >= {"arm/goal", "arm/wave"}, found
            if form == "mcap" and NODE:
                read = read_by_mcap(name)
                assert read["library"].startswith("lrt ") and read["compression"] in (["zstd"], [""]), (read["library"], read["compression"])
                assert {c["topic"] for c in read["channels"]} == {p["url"] for p in found["properties"]}, read["channels"]
                assert {c["schema"] for c in read["channels"]} == {"lrt.number", "lrt.list"}, read["channels"]
                assert [m["iri"] for m in read["metadata"] if m["name"] == "lrt:robot"] == found["robots"], read["metadata"]
                waves = [m for m in read["messages"] if m["iri"] == left.at("arm/wave")]
                assert len(waves) == 1 and int(waves[0]["publishTime"]) < int(waves[0]["logTime"]), waves
                assert all(abs(int(m["publishTime"]) / 1e9 - seconds_of(m["message"]["sourceTime"])) < 1e-5 for m in read["messages"])
                assert all(m["message"]["sequence"] == m["sequence"] for m in read["messages"] if "sequence" in m["message"])

            # What is written, and when: the order and the intervals are those of the times in the recording.
            assert "same name" in lrt("replay", name, "--to", third.url, status=1).err
            wanted = ("--select", right.url + "*", "--rename", "arm/goal=hand/goal", "--select", "nothing")
            assert "same name" in lrt("replay", name, *wanted, "--to", third.url, status=1).err  # the hand has a goal, too
            wanted = ("--select", right.at("arm/goal"), "--rename", "arm=hand", "--speed", 50, "--to", third.url)
            plan = [line.split("\t") for line in lrt("replay", name, *wanted, "--dry-run").out.splitlines()]
            assert [(n, float(v)) for _, n, v, _ in plan] == [("hand/goal", v) for v in ((0, 1.5, 2.5, 3.5) if form == "jsonl" else (3.5, 11, 12, 13))], plan
            if form == "jsonl" or NODE:
                times = [m["sourceTime"] for m in changes_of(name) if m["url"] == right.at("arm/goal") and "value" in m]
                offsets = [seconds_of(t) - seconds_of(times[0]) for t in times]
                assert all(abs(float(p[0]) - o) < 2e-6 for p, o in zip(plan, offsets)) and len(plan) == len(offsets), (plan, offsets)
            lrt("replay", name, *wanted)
            # A value that is late is skipped; the last one is not.
            written = [third.line()]
            while written[-1] != f"other {float(plan[-1][2]):g}":
                written.append(third.line())
            order, rest = [line.removeprefix("other ") for line in written], iter(f"{float(p[2]):g}" for p in plan)
            assert all(value in rest for value in order), (order, plan)  # a part of them, in their order
            one = lrt("replay", name, "--select", left.at("arm/goal"), "--dry-run", "--from", 0, "--until", 1e6).out.splitlines()
            assert len(one) == 4, one
            assert lrt("replay", name, "--from", 1e6, "--dry-run", status=1).err.endswith("has no such values\n")


def seconds_of(text):
    main, _, rest = text.rstrip("Z").partition(".")
    import calendar
    return calendar.timegm(time.strptime(main, "%Y-%m-%dT%H:%M:%S")) + float("0." + (rest or "0"))


def compressed_input():
    """zcat FILE | lrt replay -"""
    with Robot() as robot, tempfile.TemporaryDirectory() as folder:
        for form in FORMATS:
            name = os.path.join(folder, "file." + form)
            lrt("record", robot.at("arm/goal"), "--count", 1, "-o", name)
            with open(name, "rb") as file, gzip.open(name + ".gz", "wb") as packed:
                shutil.copyfileobj(file, packed)
            piped = subprocess.run(["bash", "-c", 'set -o pipefail; zcat "$0" | "$1" replay - --to "$2"', name + ".gz", LRT, robot.url], capture_output=True,
                                   text=True, timeout=PATIENCE, env=environment(), check=False)
            assert piped.returncode == 0 and not piped.stderr, piped
            assert robot.line() == "goal 0"
        # Another name at this robot, but the same path.
        other = '{"lrt":"recording","version":2,"robot":"http://x/","started":"2026-11-23T15:31:19Z"}\n{"at":0,"name":"Arm/target","url":"http://x/arm/goal","value":1}\n'
        lrt("replay", "-", "--to", robot.url, stdin=other.encode())
        assert robot.line() == "goal 1"
        former = ('{"lrt":"recording","version":1,"robot":"http://x/","started":"2026-11-23T15:31:19Z"}\n{"at":0,"name":"arm/goal","value":2,"unit":"rad"}\n')
        lrt("replay", "-", "--to", robot.url, stdin=former.encode())
        assert robot.line() == "goal 2"


def failures():
    """Full disks, files that cannot be written, damaged files, recorders that are killed: a sentence, a status, and what can be read is read."""
    with Robot() as robot, tempfile.TemporaryDirectory() as folder:
        goal = robot.at("arm/goal")
        for form in FORMATS:
            full = lrt("record", goal, "-o", "/dev/full", "-f", "--format", form, "--count", 1, status=1)
            assert re.fullmatch(r'lrt: cannot write "/dev/full": No space left on device\n', full.err), full.err
            assert "No such file" in lrt("record", goal, "-o", os.path.join(folder, "no", "file." + form), status=2).err
            name = os.path.join(folder, "file." + form)
            lrt("record", goal, "--count", 1, "-o", name)
            assert "exists" in lrt("record", goal, "-o", name, status=2).err
            closed = subprocess.run(["bash", "-c", f'"{LRT}" record {robot.at("arm/wave")} {goal} -o - --format {form} --for 20 | head -c 10; echo "${{PIPESTATUS[0]}}"'],
                                    capture_output=True, text=False, timeout=PATIENCE, env=environment(), check=False, stdin=subprocess.DEVNULL) if form == "jsonl" else None
            assert closed is None or closed.stdout.endswith(b"141\n"), closed
        assert "--output is required" in lrt("record", goal, status=2).err
        assert "not a recording" in lrt("record", "info", LRT, status=2).err
        assert "no such" in lrt("record", "info", os.path.join(folder, "nothing"), status=2).err.lower()
        assert "unknown" not in lrt("record", robot.url, "arm/nothing", "-o", os.path.join(folder, "x"), status=1).err
        assert "no property fits" in lrt("record", robot.url, "foot/*", "-o", os.path.join(folder, "x"), status=1).err

        # Killed: the chunks before the last second are there.
        name = os.path.join(folder, "killed.mcap")
        with Recorder(robot.at("arm/wave"), "-o", name) as recorder:
            until(lambda: values_in(name) == 1, "the present value")
            robot.burst(50)
            until(lambda: values_in(name) == 51, "the values")
            recorder.process.kill()
            recorder.process.wait(PATIENCE)
        with open(name, "ab") as file:  # a chunk that was being written
            file.write(b"\x06\x00\x10\x00\x00\x00\x00\x00\x00abc")
        found = info(name)
        assert not found["complete"] and found["damaged"] == 0, found
        assert "not complete" in lrt("record", "info", name).out
        assert "what is before it is replayed" in lrt("replay", name, "--dry-run").err
        if NODE:
            assert len(read_by_mcap(name, "--cut")["messages"]) == sum(p["values"] + p["gaps"] for p in found["properties"])

        # Without compression; a longer queue than the robot has.
        name = os.path.join(folder, "plain.mcap")
        lrt("record", robot.url, "--no-compression", "--queue", 5_000, "--count", 3, "-o", name)
        assert info(name)["compression"] == "" and info(name)["properties"][0]["gaps"] == 0, info(name)
        if NODE:
            read = read_by_mcap(name)
            assert {c["topic"] for c in read["channels"]} == {"/arm/wave", "/arm/goal", "/arm/hand/goal"}, read["channels"]  # one robot: paths
        text = lrt("record", "info", name).out
        assert re.search(r"^file\t.*MCAP, not compressed\t[\d,]+ bytes$", text, re.M) and re.search(r"^arm/goal\t1\t0\t0\t", text, re.M), text


def main():
    global LRT, ROBOT, NODE
    LRT, ROBOT = os.path.abspath(sys.argv[1]), sys.argv[2]
    folder = pathlib.Path(sys.argv[3]).resolve()
    why = node_modules(folder)
    if why is None:
        NODE = folder
    elif os.environ.get("LRT_CI"):
        sys.exit(why)
    else:
        print("skipped:", why, flush=True)
    for case in (failures, compressed_input, restarted, two_robots, stalled, blocked):
        if sys.argv[4:] and case.__name__ not in sys.argv[4:]:
            continue
        begin = time.monotonic()
        case()
        print(f"{case.__name__}: {time.monotonic() - begin:.1f} s", flush=True)


if __name__ == "__main__":
    main()
