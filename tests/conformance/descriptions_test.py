# SPDX-License-Identifier: Apache-2.0
"""What Actions say of themselves against what they do.

    descriptions_test.py PROGRAM...
    descriptions_test.py --long URDF_DIR EX_URDF_ROBOT

Finds the Actions of each program by links. Of each, inputs are drawn from the range that its shape publishes: each is accepted, or the Action says in
its document that it is not available, and the refusal has that reason. Inputs just outside of each published bound are refused with 422. Some
inputs are carried out to the end; then what the effects say of the properties holds. Last come the stops: what they exclude says so. With --long
the robots of URDF_DIR are loaded. LRT_DESCRIPTIONS_SEED, LRT_DESCRIPTIONS and LRT_DESCRIPTIONS_EFFECTS are the seed, the number of inputs of
each Action and how many of them are carried out to the end.
"""

import collections
import math
import os
import pathlib
import random
import re
import struct
import sys
import tempfile
import urllib.parse

sys.dont_write_bytecode = True  # nothing is left in the source tree
from examples_graphs_test import LEFT_OUT, resources, start
from random_bodies_test import HAS_UNIT, INTEGERS, MATHS, NUMERICAL, RDF_VALUE, SELF, TYPE, UNIT, VOM_UNIT, Maker, Shapes, iri, literal, parts, sh
from robot_process import HYBRIT, LRT, Program, http_request, plain, until

SEED = int(os.environ.get("LRT_DESCRIPTIONS_SEED", "23"))
INPUTS = int(os.environ.get("LRT_DESCRIPTIONS", "200"))
EFFECTS = int(os.environ.get("LRT_DESCRIPTIONS_EFFECTS", "2"))

SOSA, DCTERMS = "http://www.w3.org/ns/sosa/", "http://purl.org/dc/terms/"
ENDED = {"succeeded", "failed", "cancelled"}
RADIANS = {"RAD": 1, "DEG": math.pi / 180}
METRES = {"M": 1, "MilliM": 0.001}

LEFT_OUT = {name: why for name, why in LEFT_OUT.items() if name != "ex_conductor_arm"}
# What must be done before an Action is of use.
FIRST = {"t05_actions": ["lift/actions/home"]}
# Actions that are not invoked.
BUSY = {"t19_emergency_stop/plan": "keeps its program busy for 10 s, which is what the lesson shows"}
# Shares of the published range within which inputs are carried out to the end, where the whole range takes minutes.
SHARE = {"ex_mobile_base": 0.01}


class Document(Shapes):
    """A graph."""

    def objects(self, node, predicate):
        return self.of.get((node, predicate), [])

    def object(self, node, predicate):
        found = self.objects(node, predicate)
        return found[0] if found else None


class Action:
    def __init__(self, program, url):
        self.program, self.url = program, url
        self.read()
        self.shape = self.document.object(iri(url), iri(HYBRIT + "consumes"))
        self.input = None
        if self.shape:
            self.input = Document(program.n_triples(urllib.parse.urldefrag(self.shape[1:-1]).url) + self.document.text)
        self.effects = [s for s in self.document.objects(iri(url), iri(HYBRIT + "produces")) if self.document.object(s, iri(SOSA + "forProperty"))]
        self.properties = {self.document.object(s, iri(SOSA + "forProperty")) for s in self.effects}
        self.is_stop = iri(LRT + "StopAction") in self.document.objects(iri(url), TYPE)

    def read(self):
        self.document = Document(self.program.n_triples(self.url))

    def unavailable(self):
        self.read()
        reason = self.document.object(iri(self.url), iri(LRT + "unavailable"))
        return plain(reason) if reason else None

    def send(self, rng, body, **headers):
        if iri(LRT + "ReleaseAction") in self.document.objects(iri(self.url), TYPE):  # it must say until when it is valid
            instance, milliseconds = self.program.get("").field("Robot-Time").split("/")
            headers = {"Valid-Until": f"{instance}/{int(milliseconds) + 10_000}", **headers}
        fields = {"Content-Type": "text/turtle", **headers} if body else headers
        return http_request("POST", self.url, body.turtle(rng) if body else None, fields)

    def status(self, location):
        return plain(Document(self.program.n_triples(location)).object(iri(location), iri(LRT + "status"))).rsplit("#", 1)[1]


class Near(Maker):
    """Makes bodies with small numbers where there is no bound: a wheel turns by any angle, which takes its time."""

    def bounds(self, p):
        low, high, ends = super().bounds(p)
        return (-3 if low == -100 and high > -3 else low, 3 if high == 100 and low < 3 else high, ends)


class Outside(Maker):
    """Makes a body as the shape wants it, with one number just outside of a bound."""

    SIDES = {"minInclusive": (-1, False), "maxInclusive": (1, False), "minExclusive": (-1, True), "maxExclusive": (1, True)}

    def __init__(self, shapes, rng, wanted):
        super().__init__(shapes, rng)
        self.wanted, self.seen = wanted, 0

    def literal(self, p, datatype):
        name = datatype[1:-1].rsplit("#", 1)[-1]
        for side, (sign, exclusive) in self.SIDES.items():
            bound = self.shapes.one(p, side)
            if not bound or (name not in INTEGERS and name not in ("float", "double")):
                continue
            self.seen += 1
            if self.seen - 1 == self.wanted:
                return literal(beyond(parts(bound)[0], name, sign, exclusive), name)
        return super().literal(p, datatype)


def beyond(bound, datatype, sign, exclusive):
    """The nearest number of the type that the bound excludes."""
    if datatype in INTEGERS:
        limit = math.floor(float(bound)) if sign > 0 else math.ceil(float(bound))
        return str(limit if exclusive and limit == float(bound) else limit + sign)
    number = float(bound)
    if datatype == "double":
        return repr(number if exclusive else math.nextafter(number, sign * math.inf))
    (single,) = struct.unpack("f", struct.pack("f", number))  # a float is compared with the bound as a float
    if exclusive:
        return repr(single)
    if single == 0:
        return repr(sign * 1e-45)
    (bits,) = struct.unpack("i", struct.pack("f", single))
    (single,) = struct.unpack("f", struct.pack("i", bits + (1 if (single > 0) == (sign > 0) else -1)))
    return repr(single)


def actions_of(program):
    """The Actions that can be found now, by links from the root. An Action that is not available is not linked."""
    found = [url for url, answer in resources(program, r"/(all|state|subscriptions)$|/ns/")
             if (iri(url), TYPE, iri(HYBRIT + "Action")) in [(s, p, o) for (s, p), all_o in Shapes(answer.body).of.items() for o in all_o]]
    return [Action(program, url) for url in sorted(found)]


# ---- effects

def unit_of(graph, node):
    """The local name in QUDT. A body may name it in the other vocabulary only."""
    unit = graph.object(node, HAS_UNIT)
    return unit[len(UNIT) + 1:-1] if unit else {iri(MATHS + "Degree"): "DEG", iri(MATHS + "Radian"): "RAD"}.get(graph.object(node, VOM_UNIT))


def number(graph, node):
    """A number and its unit: a literal, or a node with one; None: it is none."""
    if node.startswith('"'):
        text = parts(node)[0]
        return (float(text), None) if re.fullmatch(r"[-+.\deE]+|[-+]?INF|NaN", text) else None
    found = graph.object(node, NUMERICAL)
    return (float(parts(found)[0]), unit_of(graph, node)) if found else None


def converted(value, unit, to):
    for table in (RADIANS, METRES):
        if unit in table and to in table:
            return value * table[unit] / table[to]
    assert unit == to or unit is None or to is None, (unit, to)
    return value


def fault_of_input_value(effects, shape, state, node, sent):
    """Why a value is not that of the input; None: it is."""
    field = effects.object(shape, iri(LRT + "inputField"))
    source = sent.object(sent.focus, field) if field else sent.focus
    got, wanted = number(state, node), number(sent, source)
    if got is None or wanted is None:
        got, wanted = (g.object(n, RDF_VALUE) or n for g, n in ((state, node), (sent, source)))
        return None if got == wanted else f"{got} is not {wanted}"
    limits = []
    for name in ("tolerance", "period"):
        stated = effects.object(shape, iri(LRT + name))
        value, unit = number(effects, stated) if stated else (0, got[1])
        limits.append(converted(value, unit, got[1]))
    tolerance, period = limits
    difference = got[0] - converted(*wanted, got[1])
    if period:
        difference = math.remainder(difference, period)
    rounding = 1e-15 * abs(got[0]) if wanted[1] != got[1] else 0  # of the conversion here
    return None if abs(difference) <= tolerance + rounding else f"{got} is {difference} away from {wanted}, which is more than {tolerance}"


def fault_of(effects, shape, state, node, sent):
    """Why a node of a property does not conform to the shape of an effect; None: it does."""
    if effects.object(shape, iri(LRT + "valueFrom")):
        fault = fault_of_input_value(effects, shape, state, node, sent)
        if fault:
            return fault
    for p in effects.objects(shape, sh("property")):
        values = state.objects(node, effects.object(p, sh("path")))
        wanted, inner = effects.object(p, sh("hasValue")), effects.object(p, sh("qualifiedValueShape"))
        if wanted and wanted not in values:
            return f"{effects.object(p, sh('path'))}: {values} without {wanted}"
        if inner and all(fault_of(effects, inner, state, v, sent) for v in values):
            return f"{effects.object(p, sh('path'))}: {values} do not conform"
        if not wanted and not inner:
            faults = [fault_of(effects, p, state, v, sent) for v in values]
            if not values or any(faults):
                return f"{effects.object(p, sh('path'))}: {faults or 'no value'}"
    return None


class Sent(Document):
    """A body as a graph."""

    def __init__(self, body):
        super().__init__("")
        self.focus = SELF
        for s, p, o in body.triples if body else []:
            self.of[s, p].append(o)


# ---- what is done

class Run:
    def __init__(self, program, rng):
        self.program, self.rng = program, rng
        self.counts, self.faults = collections.Counter(), []

    def fault(self, action, what, body=None):
        self.faults.append(f"{action.url}: {what}" + (f"\n{body.turtle(self.rng)}" if body else ""))

    def body(self, action, ends_soon=False):
        if not action.shape:
            return None
        body = (Near if ends_soon else Maker)(action.input, self.rng).body(action.shape, SELF)
        share = SHARE.get(self.program.name, 1) if ends_soon else 1
        for t in list(body.triples) if share != 1 else []:
            text, datatype = parts(t[2])
            if datatype in ("float", "double"):
                body.replace(t, (t[0], t[1], literal(repr(float(text) * share), datatype)))
        return body

    def is_taken(self, action, answer, body):
        """Whether a command was accepted. If not, the Action says why."""
        if 200 <= answer.status < 300:
            self.counts["accepted"] += 1
            return True
        reason = action.unavailable()
        if answer.status == 409 and reason and reason in answer.body:
            self.counts["unavailable, with the reason"] += 1
        else:
            self.fault(action, f"an input of its published range is refused: {answer}", body)
        return False

    def draw(self, action):
        """Inputs of its range, which are cancelled if they take time."""
        for _ in range(INPUTS if action.shape else 1):
            body = self.body(action)
            answer = action.send(self.rng, body)
            if self.is_taken(action, answer, body) and action.status(answer.field("Location")) not in ENDED:
                http_request("DELETE", answer.field("Location"))
            if self.faults:
                return

    def exceed(self, action):
        """Inputs just outside of each bound."""
        wanted = 0
        while action.shape:
            maker, misses = None, 0
            while misses < 20:  # a bound of an optional field may be absent
                maker = Outside(action.input, self.rng, wanted)
                body = maker.body(action.shape, SELF)
                if maker.seen > wanted:
                    break
                misses += 1
            else:
                return
            answer = action.send(self.rng, body)
            self.counts["just outside"] += 1
            if answer.status != 422:
                self.fault(action, f"an input outside of its published range is not refused: {answer}", body)
            wanted += 1

    def carry_out(self, actions):
        """Commands that concern different properties run at the same time. When they have succeeded, their effects hold."""
        batches = []
        for action in actions:
            for batch in batches:
                if all(not (action.properties & other.properties) for other in batch):
                    batch.append(action)
                    break
            else:
                batches.append([action])
        for batch in batches:
            for _ in range(EFFECTS if any(a.shape for a in batch) else 1):
                begun = []
                for action in batch:
                    body = self.body(action, ends_soon=True)
                    answer = action.send(self.rng, body)
                    if self.is_taken(action, answer, body):
                        begun.append((action, body, answer.field("Location")))
                for action, body, location in begun:
                    until(lambda: action.status(location) in ENDED, f"the end of {location}")  # noqa: B023: called at once
                    if action.status(location) != "succeeded":
                        self.fault(action, f"an input of its range did not succeed: {self.program.n_triples(location)}", body)
                        continue
                    for effect in action.effects:
                        self.check_effect(action, effect, body)

    def check_effect(self, action, effect, body):
        url = action.document.object(effect, iri(SOSA + "forProperty"))
        fault = fault_of(action.document, effect, Document(self.program.n_triples(url[1:-1])), url, Sent(body))
        self.counts["effects"] += 1
        if fault:
            self.fault(action, f"its effect on {url} does not hold: {fault}", body)

    def all(self):
        for first in FIRST.get(self.program.name, []):
            http_request("POST", self.program.at(first))
        actions = []
        while True:  # some are available after others
            new = [a for a in actions_of(self.program) if all(a.url != known.url for known in actions)]
            if not new:
                break
            actions += new
            self.carry_out([a for a in new if a.effects and not a.is_stop])
        usual = [a for a in actions if not a.is_stop and f"{self.program.name}/{a.url.rsplit('/', 1)[1]}" not in BUSY]
        for action in usual:
            self.draw(action)
            self.exceed(action)
        for stop in (a for a in actions if a.is_stop):
            assert self.is_taken(stop, stop.send(self.rng, None), None), stop.url
            for effect in stop.effects:
                self.check_effect(stop, effect, None)
        if len(usual) < len(actions):
            for action in usual:
                if action.shape:
                    body = self.body(action, ends_soon=True)
                    self.is_taken(action, action.send(self.rng, body), body)
        self.counts["actions"] = len(actions)
        return actions


def begin(path, folder):
    if os.path.basename(path) == "ex_conductor_arm":
        return Program(path, "joint", "--port", "0")
    return start(path, folder)


def report(name, run):
    print(f"{name}: " + ", ".join(f"{n} {what}" for what, n in sorted(run.counts.items())))
    for fault in run.faults[:10]:
        print(fault)
    if len(run.faults) > 10:
        print(f"and {len(run.faults) - 10} further faults")
    sys.stdout.flush()
    return bool(run.faults)


def main():
    words, totals, faulty = sys.argv[1:], collections.Counter(), 0
    if words[0] == "--long":
        folder, program = words[1:]
        for urdf in sorted(pathlib.Path(folder).glob("*.urdf")):
            arguments = ["--argument", "namespace="] if "turtlebot" in urdf.name else []  # it still contains xacro
            with Program(program, str(urdf), "--port", "0", *arguments) as robot:
                run = Run(robot, random.Random(SEED))
                run.all()
            faulty += report(urdf.name, run)
            totals += run.counts
    else:
        with tempfile.TemporaryDirectory() as folder:
            for path in words:
                name = os.path.basename(path)
                if name in LEFT_OUT:
                    print(f"{name} is left out: it {LEFT_OUT[name]}")
                    continue
                with begin(path, pathlib.Path(folder)) as program:
                    run = Run(program, random.Random(SEED))
                    actions = run.all()
                if name == "ex_mobile_base":  # what moves is unavailable after a stop, with the reason
                    assert run.counts["unavailable, with the reason"], [a.url for a in actions]
                faulty += report(name, run)
                totals += run.counts
    print(f"seed {SEED}: " + ", ".join(f"{n} {what}" for what, n in sorted(totals.items())))
    assert totals["effects"] and totals["just outside"]
    return 1 if faulty else 0


sys.exit(main())
