# SPDX-License-Identifier: Apache-2.0
"""What can happen to a store and to the state of `lrt mirror`: afterwards the store has what the robot says, each time, and what is equal costs one request
for each graph. The store is a GraphStore or a Virtuoso."""

import collections
import decimal
import functools
import os
import re
import shutil
import struct
import subprocess
import sys

try:
    import rdflib
    import rdflib.compare
except ImportError:
    print("skipped: rdflib is not installed")
    sys.exit(77)

from robot_process import http_request

MARK = "#mirror"
CHANGED = "<urn:somebody> a <urn:Visitor> ."


# Paths of a robot: a Property that takes a number, another one, and what it has not.
Paths = collections.namedtuple("Paths", "property other ghost")
BAXTER = Paths("baxter/right_s1/friction", "baxter/right_s1/position", "baxter/ghost")
ODD_ROBOT = Paths("types/angle", "types/speed", "types/ghost")


def number(literal):
    """By twelve digits, because a store has its own forms of numbers; "0.3"^^xsd:float is the number that it has in memory, 0.300000012."""
    value = float(literal)
    if literal.datatype == rdflib.XSD.float:
        value = struct.unpack("f", struct.pack("f", value))[0]
    return f"{value:.12g}"


@functools.lru_cache(maxsize=None)
def canonical(turtle):
    """What is equal for equal graphs."""
    given, graph = rdflib.Graph(), rdflib.Graph()
    given.parse(data=turtle, format="turtle")
    for subject, predicate, found in given:
        is_number = isinstance(found, rdflib.Literal) and isinstance(found.value, (int, float, decimal.Decimal)) and not isinstance(found.value, bool)
        graph.add((subject, predicate, rdflib.Literal(number(found)) if is_number else found))
    return frozenset(rdflib.compare.to_canonical_graph(graph))


def mirrored(lrt, robot, store, state, *more):
    """The numbers of the last line of --once: sent, deleted, unchanged, lost, changed."""
    words = [lrt, "mirror", *([robot.url] if hasattr(robot, "url") else robot), "--to", store.url, "--once", "--rate", "0", *more]
    if state:
        words += ["--state", state]
    env = dict(os.environ)
    if hasattr(store, "user"):
        words += ["--to-user", store.user]
        env["LRT_STORE_PASSWORD"] = store.password
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, env=env)
    assert done.returncode == 0, done
    line = done.stdout.splitlines()[-1]
    numbers = re.fullmatch(r"(\d+) graphs? sent, (\d+) deleted, (\d+) unchanged(?:; put right: (\d+) lost, (\d+) changed by others)?", line)
    assert numbers, done
    return [int(number or 0) for number in numbers.groups()]


def differences(content):
    """The names of the graphs of a store that are not what their robots say."""
    wrong = []
    for name, turtle in content.items():
        if name.endswith(MARK):
            continue
        answer = http_request("GET", name, headers={"Accept": "application/n-triples"})
        if answer.status != 200 or canonical(answer.body) != canonical(turtle):
            wrong.append(name)
    return wrong


def check(lrt, make_robot, paths, store, folder, title, all_rows=True):
    """Prints a table.
    @param make_robot  starts a robot
    @param paths  Paths of it
    @param all_rows  false: without combinations of two faults and the options, which say nothing of a store"""
    state = os.path.join(folder, "state")
    rows = []

    def count(what, robot, state=state, *more):
        store.take_methods()
        sent, deleted, unchanged, lost, changed = mirrored(lrt, robot, store, state, *more)
        methods = store.take_methods()
        requests = len(methods) - methods.count("401")
        assert methods.count("401") <= 8, methods.count("401")  # a few requests at a time may be the first, and a nonce may be too old
        rows.append((what, requests, methods.count("GET"), methods.count("PUT"), methods.count("DELETE"), sent, deleted, unchanged, lost, changed))
        return sent, deleted, unchanged, lost, changed, requests

    with make_robot() as robot:
        sent, *_ = count("an empty store", robot)
        content = store.content()
        names = set(content)
        assert len(names) == sent and sent > 50, (sent, len(names))
        assert differences(content) == []
        property, other, ghost = (robot.at(path) for path in paths)
        assert {property, other, robot.at(MARK)} <= names, names

        def equal(what, *, lost=None, changed=None, deleted=0, state=state, more=()):
            """One copy makes all equal; the next one finds that."""
            found = count(what, robot, state, *more)
            content = store.content()
            assert set(content) == names, (what, set(content) ^ names)
            assert differences(content) == [], what
            assert lost is None or found[3] == lost, (what, found)
            assert changed is None or found[4] == changed, (what, found)
            assert found[1] == deleted, (what, found)

        def unchanged():
            *found, requests = count("  again: nothing", robot)
            assert found == [0, 0, len(names), 0, 0], found
            assert requests == len(names), (requests, len(names))

        unchanged()
        saved, old_state = store.save(), os.path.join(folder, "old state")
        shutil.copy(state, old_state)

        store.empty()
        equal("emptied", lost=len(names), changed=0)
        unchanged()
        if all_rows:
            store.empty()
            os.remove(state)
            equal("emptied, and no state")
            unchanged()
        store.delete(property)
        equal("a graph deleted", lost=1, changed=0)
        unchanged()
        store.put(property, CHANGED)
        equal("a graph changed", lost=0, changed=1)
        unchanged()
        if all_rows:
            store.delete(robot.at(MARK))
            equal("the list deleted", lost=1, changed=0)
            unchanged()
        os.remove(state)
        equal("no state", lost=0, changed=0)
        unchanged()
        if all_rows:
            store.put(property, CHANGED)
            os.remove(state)
            equal("a graph changed, and no state")
            unchanged()

        # An older copy: a value of then. Then the state of that time, too.
        assert http_request("PUT", property, "7", {"Content-Type": "application/json"}).status in (200, 204)
        assert mirrored(lrt, robot, store, state)[:2] == [1, 0]
        store.restore(saved)
        equal("restored from an older copy", lost=0, changed=1)
        unchanged()
        shutil.copy(old_state, state)
        equal("an older state")
        unchanged()
        if all_rows:
            store.restore(saved)
            shutil.copy(old_state, state)
            equal("restored, and the state of then")
            unchanged()

        # The state of another robot.
        with open(state) as file:
            lines = [line.split("\t") for line in file.read().split("\n")]
        assert sum(len(line) > 2 and line[2] == robot.url for line in lines) >= len(names)
        with open(state, "w") as file:
            file.write("\n".join("\t".join([*line[:2], "http://127.0.0.1:9/", *line[3:]] if line[2:3] == [robot.url] else line) for line in lines))
        store.delete(other)
        equal("a state of another robot")
        unchanged()

        if all_rows:
            equal("--verify", lost=0, changed=0, more=("--verify",))
            store.put(property, CHANGED)
            equal("--force", more=("--force",))
            unchanged()

        # What the robot no longer has goes, also if nobody knows that it was sent.
        for title_of_row, has_state in (("restored: a graph that the robot no longer has", True), ("the same, and no state", False)):
            if not has_state and not all_rows:
                break
            store.put(ghost, CHANGED)
            mark = store.content()[robot.at(MARK)]
            store.put(robot.at(MARK), mark + f"\n<{robot.at(MARK)}> <http://purl.org/dc/terms/hasPart> <{ghost}> .")
            if not has_state:
                os.remove(state)
            equal(title_of_row, deleted=1)
            unchanged()

    print(f"{title}: {len(names)} graphs")
    print(f"{'what happened to the store':50} {'requests':>8} {'GET':>5} {'PUT':>5} {'DELETE':>6} | {'sent':>5} {'deleted':>7} {'unchanged':>9} {'lost':>5} {'changed':>7}")
    for what, *numbers in rows:
        print(f"{what:50} {numbers[0]:8} {numbers[1]:5} {numbers[2]:5} {numbers[3]:6} | {numbers[4]:5} {numbers[5]:7} {numbers[6]:9} {numbers[7]:5} {numbers[8]:7}")
