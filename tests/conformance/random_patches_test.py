# SPDX-License-Identifier: Apache-2.0
"""Random values with fields left out, and random patches of them: what they mean.

    random_patches_test.py RANDOM_BODIES_ROBOT

The declared defaults are written anew here, and so are the merge patch of RFC 7396 and the update of a graph. After each request the C++ value, which GET
reads, is the one that follows from these; a PATCH is accepted exactly if a PUT of the merged document to a second Property is, and gives the same value.
(Which bodies are accepted, random_bodies_test.py compares with three other SHACL engines.) LRT_RANDOM_PATCHES_SEED and LRT_RANDOM_PATCHES: see there.
"""

import copy
import json
import os
import random
import sys

sys.dont_write_bytecode = True  # nothing is left in the source tree
from robot_process import Program, http_request

SEED = int(os.environ.get("LRT_RANDOM_PATCHES_SEED", "3"))
PATCHES = int(os.environ.get("LRT_RANDOM_PATCHES", "600"))
DEFAULTS = {"gain": 1.5, "count": 3, "name": "none", "gear": "second", "active": False, "steps": [4, 5], "limits": {"low": -2.0, "high": 2.0}, "extra": {}}
INNER = {"low": -1.0}
VALUES = {
    "gain": [0.25, 9, 0, 10, {"value": 2, "unit": "m"}, 11, -1, {"value": 2, "unit": "cm"}, "x", {}],
    "limit": [0.1, 1e300, -7, True, "1", [], {"value": 3}],
    "count": [0, 7, 7.0, 2**31 - 1, 2**31, -1, 1.5, "7"],
    "name": ["", "a", "\u00e9\"\\", "12345678", "123456789", 1],
    "gear": ["first", "reverse", "fourth", 1],
    "active": [True, False, 0, "true"],
    "offset": [1, -1e-7, 50, 50.5, "NaN"],
    "steps": [[], [1], [1, 2, 3], [1.5], ["x"], [None], {"0": 1}, 5],
    "extra": [{"a": 1}, {"b": 2.5, "a": 0}, {}, {"a": "x"}, {"a": {"value": 1}}, [], 1],
    "limits": [{"low": -3, "high": 3}, {"high": 8}, {"low": -5}, {}, {"low": 1}, {"other": 1}, 1, []],
}


def merged(target, patch):
    """RFC 7396, 2."""
    if not isinstance(patch, dict):
        return patch
    result = dict(target) if isinstance(target, dict) else {}
    for name, value in patch.items():
        if value is None:
            result.pop(name, None)
        else:
            result[name] = merged(result.get(name), value)
    return result


def plain(value):
    return value["value"] if isinstance(value, dict) and set(value) <= {"value", "unit"} and "value" in value else value


def meaning(document):
    """The value of a document that was accepted."""
    value = {**copy.deepcopy(DEFAULTS), **{name: plain(part) for name, part in document.items() if part is not None}}
    if "limits" in document:
        value["limits"] = {**INNER, **value["limits"]}
    value["extra"] = {name: plain(part) for name, part in value["extra"].items()}
    return value


def document(rng):
    names = [name for name in VALUES if name == "limit" or rng.random() < 0.5]
    return {name: rng.choice(VALUES[name][:3] if rng.random() < 0.93 else VALUES[name]) for name in names}


def patch(rng):
    made = {name: rng.choice(VALUES[name][:3] if rng.random() < 0.8 else VALUES[name]) for name in rng.sample(list(VALUES), rng.randint(0, 3))}
    for name in rng.sample(list(VALUES), rng.choice((0, 0, 1, 2))):
        made[name] = None
    if rng.random() < 0.2:
        made["extra"] = {name: rng.choice((None, 1, 2)) for name in rng.sample("abc", 2)}
    if rng.random() < 0.2:
        made["limits"] = {name: rng.choice((None, -4, 0)) for name in rng.sample(("low", "high"), rng.choice((1, 2)))}
    if rng.random() < 0.03:
        made["nosuch"] = rng.choice((None, 1))
    return rng.choice((made,) * 40 + (5, None, [], "x"))


class Robot:
    def __init__(self, program):
        self.program = program

    def read(self, name):
        return json.loads(http_request("GET", f"{self.program.url}machine/{name}", None, {"Accept": "application/json"}).expect(200).body)

    def send(self, method, name, body, media_type="application/json"):
        text = body if isinstance(body, str) and media_type == "application/sparql-update" else json.dumps(body)
        answer = http_request(method, f"{self.program.url}machine/{name}", text, {"Content-Type": media_type, "Accept": "application/json"})
        assert answer.status in (204, 422), f"{method} {name} {text}: {answer}"
        return answer.status == 204, text


def number(value):
    return f'"{value!r}"^^<http://www.w3.org/2001/XMLSchema#double>' if isinstance(value, float) else str(value)


def by_sparql(rng, robot, value):
    """Replaces "limit" or "offset", which are literals at the node itself; returns the value that must follow."""
    name = rng.choice(("limit", "offset"))
    new = rng.choice((1.25, 7.5, None, 60.5))
    rows = http_request("GET", f"{robot.program.url}machine/tuning", None, {"Accept": "application/n-triples"}).expect(200).body.splitlines()
    old = [row for row in rows if f"#Tuning/{name}> " in row and row.startswith(f"<{robot.program.url}machine/tuning> ")]
    predicate = f"<{robot.program.url}ns/vocabulary#Tuning/{name}>"
    old.append(f"<> {predicate} 123456789.0")  # the value does not have it: no effect
    text = " ; ".join([f"DELETE DATA {{ {row} }}" for row in old] + [f"INSERT DATA {{ <> {predicate} {number(new)} }}"] * (new is not None))
    wanted = dict(value)
    wanted.pop(name, None)
    if new is not None:
        wanted[name] = new
    fits = (name == "offset" or new is not None) and not (name == "offset" and new == 60.5)
    done, _ = robot.send("PATCH", "tuning", text, "application/sparql-update")
    assert done == fits, f"{text}: {done}"
    return wanted if fits else value


def main():
    rng = random.Random(SEED)
    counts = {"PUT": [0, 0], "merge patch": [0, 0], "update": [0, 0]}
    program = Program(sys.argv[1])
    try:
        robot = Robot(program)
        value = meaning({"limit": 1.0})
        assert robot.send("PUT", "tuning", {"limit": 1.0})[0]
        for _ in range(PATCHES):
            assert robot.read("tuning") == value, f"found {robot.read('tuning')}, expected {value}"
            kind = rng.random()
            if kind < 0.3:
                body = document(rng)
                done, text = robot.send("PUT", "tuning", body)
                after = meaning(body) if done else value
                counts["PUT"][done] += 1
            elif kind < 0.4:
                after = by_sparql(rng, robot, value)
                counts["update"][after != value] += 1
                done, text = True, "update"
            else:
                change = patch(rng)
                whole = merged(value, change)
                done, text = robot.send("PATCH", "tuning", change, "application/merge-patch+json")
                # RFC 7396 ignores null for a member that is not there; lrt refuses a name that no field has.
                misnamed = isinstance(change, dict) and "nosuch" in change
                other = robot.send("PUT", "twin", whole)[0] and not misnamed
                assert done == other, f"PATCH of {value} by {text}: {done}, PUT of {whole}: {other}"
                after = meaning(whole) if done else value
                if done:
                    assert robot.read("twin") == after, (whole, robot.read("twin"))
                counts["merge patch"][done] += 1
            found = robot.read("tuning")
            assert found == after, f"{text} of {value}: found {found}, expected {after}"
            value = after
    finally:
        program.kill()
    for what, (refused, accepted) in counts.items():
        print(f"{what}: {accepted} changed the value, {refused} did not")
        assert accepted > 5 and refused > 5
    return 0


if __name__ == "__main__":
    sys.exit(main())
