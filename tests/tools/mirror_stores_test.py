# SPDX-License-Identifier: Apache-2.0
"""`lrt mirror` with Virtuoso: two robots, one query over both, changes, a robot that leaves and returns, a restart with the state; a store that is emptied,
restored and changed by others, while a mirror runs and before it starts.

usage: mirror_stores_test.py [--long] LRT BAXTER ODD_ROBOT

With --long all faults of stores and states, and with baxter, which has more graphs: it prints the table of docs/fleet.md.

Exits with 77 if Virtuoso is not installed (vendor/install.sh stores).
"""

import functools
import json
import os
import signal
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "conformance"))
from robot_process import Program, Robot, http_request  # noqa: E402
import mirror_faults  # noqa: E402
from virtuoso import CountedVirtuoso, skip_if_missing  # noqa: E402

PATIENCE = 180  # a database starts and fills anew, on a busy machine
ALL_POSITIONS = """
PREFIX ros: <http://ros.org/#>
PREFIX vom: <http://vocab.arvida.de/2015/06/vom/vocab#>
PREFIX hybrit: <https://hybr-it-projekt.de/ns/hybr-it#>
SELECT ?joint ?position ?value WHERE {
  GRAPH ?joint { ?joint a ros:RevoluteJoint ; ros:position ?position }
  GRAPH ?position { ?position vom:numericalValue ?value }
} ORDER BY ?joint
"""
MARKS = "SELECT ?robot ?since WHERE { GRAPH ?g { ?robot <https://w3id.org/lrt/ns#unreachableSince> ?since } }"


def until(condition, what):
    end = time.monotonic() + PATIENCE
    while True:
        found = condition()
        if found:
            return found
        assert time.monotonic() < end, f"not within {PATIENCE} s: {what() if callable(what) else what}"
        time.sleep(0.1)


def lrt(*words):
    done = subprocess.run([LRT, *words], capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, f"lrt {words}: {done.returncode} {done.stdout} {done.stderr}"
    return done.stdout


@functools.lru_cache(maxsize=None)
def joints_of(robot):
    return [joint["url"] for joint in json.loads(lrt("ls", "--json", "--type", "ros:RevoluteJoint", "--robot", robot))]


def positions_by_the_robots(robots):
    """What each joint of each robot says itself."""
    return {joint: json.loads(http_request("GET", joint + "/position", headers={"Accept": "application/json"}).expect(200).body)
            for robot in robots for joint in joints_of(robot.url)}


def positions_by_the_store(store):
    return {row["joint"]: float(row["value"]) for row in store.select(ALL_POSITIONS)}


class Mirror:
    def __init__(self, store, state, robots, *more):
        self.log = open(state + ".log", "a+")
        self.words = [LRT, "mirror", *robots, "--to", store.endpoint, "--to-user", store.user, "--state", state, "--interval", "0.05", "--refresh", "2",
                      "--rate", "0", *more]
        self.process = subprocess.Popen(self.words, stdout=self.log, stderr=self.log, env={**os.environ, "LRT_STORE_PASSWORD": store.password})

    def said(self):
        self.log.flush()
        self.log.seek(0)
        return self.log.read()[-3000:]

    def stop(self, by=signal.SIGINT):
        self.process.send_signal(by)
        status = self.process.wait(PATIENCE)
        assert status == (130 if by == signal.SIGINT else -by), f"{status}: {self.said()}"
        self.log.close()


def once(store, state, robots):
    done = subprocess.run([LRT, "mirror", *robots, "--to", store.endpoint, "--to-user", store.user, "--state", state, "--once", "--rate", "0"],
                          capture_output=True, text=True, timeout=PATIENCE, env={**os.environ, "LRT_STORE_PASSWORD": store.password})
    return done


def two_robots(store, folder):
    """Two robots, one query, a restart, and a robot that leaves and returns."""
    state = os.path.join(folder, "state of two robots")
    print(f"Virtuoso is ready and has {store.resident_mib()} MiB")
    with Robot() as one, Robot() as two:
        urls = [one.url, two.url]

        began = time.monotonic()
        done = once(store, state, urls)
        assert done.returncode == 0, done
        print(f"--once: {done.stdout.splitlines()[-1]}, in {time.monotonic() - began:.1f} s")
        expected = positions_by_the_robots([one, two])
        assert len(expected) >= 14 and positions_by_the_store(store) == expected, (expected, positions_by_the_store(store))
        print(f"one SELECT gives the position of {len(expected)} joints of two robots as the robots do")
        content = store.content()
        assert len(content) > 200 and mirror_faults.differences(content) == [], mirror_faults.differences(content)

        # A wrong password is said, and nothing is tried again.
        wrong = subprocess.run([LRT, "mirror", one.url, "--to", store.endpoint, "--to-user", "dba", "--once"], capture_output=True, text=True, timeout=PATIENCE,
                               env={**os.environ, "LRT_STORE_PASSWORD": "wrong"})
        assert wrong.returncode == 1 and "the store refuses the user" in wrong.stderr, wrong

        # A restart with the state sends nothing, then only what has changed.
        done = once(store, state, urls)
        assert done.returncode == 0 and done.stdout.splitlines()[-1].startswith("0 graphs sent, 0 deleted"), done
        lrt("set", "right_s1/friction", "1.25", "--robot", two.url)
        done = once(store, state, urls)
        assert done.returncode == 0 and done.stdout.splitlines()[-1].startswith("1 graph sent, 0 deleted"), done

        # While it runs, what changes is in the store.
        mirror = Mirror(store, state, urls)
        for number in (0.25, -0.5):
            lrt("set", "right_s1/position", str(number), "--robot", one.url)
            until(lambda: positions_by_the_store(store) == positions_by_the_robots([one, two]), lambda: f"the store has {number}: {mirror.said()}")
        joint = one.at("baxter/right_s1")
        assert abs(positions_by_the_store(store)[joint] + 0.5) < 1e-6
        print("changes are in the store")

        # A robot that leaves is marked and keeps its graphs.
        assert store.select(MARKS) == []
        port = two.port
        two.stop()
        mark = until(lambda: store.select(MARKS), "the mark")
        assert [row["robot"] for row in mark] == [two.url], mark
        assert len(positions_by_the_store(store)) == len(expected)
        mirror.stop(signal.SIGKILL)  # and a killed mirror goes on where it was
        mirror = Mirror(store, state, urls)
        with Robot(port=port) as again:
            until(lambda: store.select(MARKS) == [], lambda: f"no mark: {mirror.said()}")
            lrt("set", "right_s1/position", "0.75", "--robot", again.url)
            until(lambda: positions_by_the_store(store) == positions_by_the_robots([one, again]), lambda: f"the store has the robot's values: {mirror.said()}")
        print("a robot left, was marked, and returned")
        mirror.stop()


def running(store, state):
    """The store loses its content, and others change it, while a mirror runs."""
    with Program(ODD_ROBOT) as robot:
        property = robot.at(mirror_faults.ODD_ROBOT.property)
        mirror_faults.mirrored(LRT, robot, store, None)
        names = {name for name in store.names() if name.startswith(robot.url)}  # there are graphs of a robot that has left
        mirror = Mirror(store, state, [robot.url])
        until(lambda: robot.url + ": mirrored" in mirror.said(), "the mirror runs")
        store.empty()  # it is away for a second or two
        until(lambda: set(store.names()) == names, lambda: f"all graphs again: {mirror.said()}")
        store.put(property, mirror_faults.CHANGED)
        until(lambda: "urn:somebody" not in store.content().get(property, "urn:somebody"), lambda: f"the robot's version again: {mirror.said()}")
        until(lambda: mirror_faults.differences(store.content()) == [], lambda: f"the store has what the robot says: {mirror.said()}")
        assert "the store had lost them" in mirror.said(), mirror.said()
        mirror.stop()
    print("a store that was emptied and changed while a mirror ran has all again")


def main():
    with tempfile.TemporaryDirectory() as folder, CountedVirtuoso(folder) as store:
        title = "Virtuoso, which gives no entity tags"
        if IS_LONG:
            mirror_faults.check(LRT, Robot, mirror_faults.BAXTER, store, folder, title)
        else:
            mirror_faults.check(LRT, lambda: Program(ODD_ROBOT), mirror_faults.ODD_ROBOT, store, folder, title, all_rows=False)
            running(store, os.path.join(folder, "state of a running mirror"))
            store.empty()
            two_robots(store, folder)
    print("passed")


if __name__ == "__main__":
    IS_LONG = sys.argv[1] == "--long"
    LRT, Robot.program, ODD_ROBOT = sys.argv[-3:]
    skip_if_missing()
    main()
