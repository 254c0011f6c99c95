# SPDX-License-Identifier: Apache-2.0
"""What one document of a robot says stays true in the union of all documents: of this robot, of several robots, with Blueprints of an earlier moment.

    merging_test.py [--long] FOLDER SHARED_DIR LRT_SHACL BAXTER EX_URDF_ROBOT EX_MOBILE_BASE MERGING_ROBOT

Reads all documents of each robot by links and merges them into one graph, in which blank nodes of two documents are different nodes.
- Conformance: three SHACL engines judge the graph by all shapes that are in it, and find nothing, also with what RDFS entails. What is changed in the
  graph, they find.
- Doubles: no two documents give one place (a subject and a predicate with IRIs) a blank node of the same content.
- Moments: Blueprints from before an action was withdrawn, Things were removed, added again, and values were published, judge the robot of afterwards.
FOLDER is for what the engines read, and for the Node packages, which npm fetches there once. --long adds the large robots of SHARED_DIR.
"""

import collections
import contextlib
import json
import os
import pathlib
import re
import subprocess
import sys
import time

sys.dont_write_bytecode = True  # nothing is left in the source tree
from random_bodies_test import NODE_ENGINES, node_packages
from robot_documents import RDF, Documents, doubles, entailed, is_blank, parsed
from robot_process import HYBRIT, LRT, Program, Receiver, Robot, http_request, until

HERE = os.path.dirname(os.path.abspath(__file__))
LRT_SHACL = "lrt-shacl"
ENGINES = (*NODE_ENGINES, LRT_SHACL)
ENGINE_TIMEOUT = 400  # seconds for all graphs
MOST_SHOWN = 8
VOM = "http://vocab.arvida.de/2015/06/vom/vocab#"
SH = "http://www.w3.org/ns/shacl#"
QUDT = "http://qudt.org/schema/qudt/"

# Documents whose blank nodes are in another document, too.
STATED = {"?default": "the union of the graphs of a World, for the Graph Store Protocol: what clients have put there has their blank nodes"}


FLEET_VOCABULARY = "http://example.org/fleet#"
EVERYWHERE = "no Thing has its state, and each Property that is a number is a text"


class MergingRobot(Program):
    ends_with = (-15,)  # it has no handler

    def switch(self, name, wanted):
        http_request("PUT", self.at("switch/" + name), json.dumps(wanted), {"Content-Type": "application/json"}).expect(204)


def fill_merging_robot(robot):
    """A member, an invocation with input and output, so that there is a resource of each kind."""
    plan = {"gear": "first", "legs": [{"name": "out", "from": {"x": 0, "y": 0}, "to": {"x": 1, "y": 1}, "way": [{"x": 1, "y": 0}], "pause": "PT0S"}]}
    for target, body in (("rig/actions/estimate", plan), ("rig/legs", plan["legs"][0]), ("rig/left/actions/move", 0.5)):
        answer = http_request("POST", robot.at(target), json.dumps(body), {"Content-Type": "application/json"})
        assert answer.status in (200, 201, 204), answer


def results_of(report):
    """The results of a report as the other engines are asked to print them."""
    of = collections.defaultdict(dict)
    for s, p, o in report:
        of[s][p] = o[1:-1] if o.startswith("<") else "_" if is_blank(o) else o.partition('"')[2].rpartition('"')[0]
    names = [f"<{SH}{name}>" for name in ("focusNode", "resultPath", "value", "sourceConstraintComponent", "resultMessage")]
    found = ([of[o].get(name, "") for name in names] for _, p, o in report if p == f"<{SH}result>")
    return [" ".join((focus, path, f"({value})", component.rpartition("#")[2], message)) for focus, path, value, component, message in found]


class Judge:
    """Graphs for three engines. They are asked once, all at the same time."""

    def __init__(self, folder, lrt_shacl):
        self.folder, self.lrt_shacl = folder, lrt_shacl
        self.files = {}
        self.found = {}  # (engine, name): list of results, each a text

    def add(self, name, triples):
        path = self.folder / f"graph{len(self.files)}.nt"
        path.write_text("".join(f"{s} {p} {o} .\n" for s, p, o in triples), encoding="utf-8")
        self.files[name] = path

    def run(self):
        tasks = self.folder / "tasks.json"
        tasks.write_text(json.dumps([{"name": name, "data": str(path), "shapes": str(path)} for name, path in self.files.items()]))
        running = {}
        for engine in NODE_ENGINES:
            with open(tasks, encoding="utf-8") as given:
                running[engine] = subprocess.Popen(["node", os.path.join(HERE, "merging_node.mjs"), str(self.folder.parent), engine], stdin=given,
                                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        try:
            started = time.monotonic()
            for name, path in self.files.items():
                done = subprocess.run([self.lrt_shacl, "--format", "n-triples", path, path], capture_output=True, text=True, timeout=ENGINE_TIMEOUT, check=False)
                assert done.returncode in (0, 1), f"{name}: {done.stderr}"
                self.found[LRT_SHACL, name] = results_of(parsed(done.stdout))
                assert bool(self.found[LRT_SHACL, name]) == bool(done.returncode), done.stdout[:1000]
            print(f"{LRT_SHACL}: {len(self.files)} graphs in {time.monotonic() - started:.1f} s")
            for engine, process in running.items():
                out, errors = process.communicate(timeout=ENGINE_TIMEOUT)
                assert process.returncode == 0, f"{engine} ended with {process.returncode}: {errors[-2000:]}"
                answers = [json.loads(line) for line in out.splitlines()]
                for answer in answers:
                    self.found[engine, answer["name"]] = [" ".join((focus, path, f"({value})", component.rpartition("#")[2], message))
                                                          for focus, path, value, component, _, message in answer["results"]]
                assert len(answers) == len(self.files), engine
                print(f"{engine}: {len(answers)} graphs in {sum(a['seconds'] for a in answers):.1f} s")
        finally:
            for process in running.values():
                process.kill()
                process.wait()


# What is changed in the graph of merging_robot: each must be found. Of a triple: the one that is put in its place, or None to take it away.
def changed(triples, chosen, instead=None):
    at = next((t for t in triples if chosen(*t)), None)
    assert at, "there is nothing to change"
    return [t for t in triples if t != at] + ([instead(*at)] if instead else [])


def lists_cell(graph, robot, name):
    """The first cell of a list that is the value of a Property."""
    return next(o for s, p, o in graph if s == f"<{robot}rig/{name}>" and p == f"<{RDF}value>")


def changes_of(graph, robot):
    """Changed graphs by what was changed."""
    of = lambda path: f"<{robot}{path}>"
    predicate = {name: iri for name, iri in (("numerical", f"<{VOM}numericalValue>"), ("unit", f"<{QUDT}hasUnit>"), ("type", f"<{RDF}type>"),
                                             ("first", f"<{RDF}first>"))}
    number = '"{}"^^<http://www.w3.org/2001/XMLSchema#double>'
    cell = lists_cell(graph, robot, "numbers")
    yield "a value beyond the bounds of this Thing, and within those of its sister", changed(
        graph, lambda s, p, o: s == of("rig/left/position") and p == predicate["numerical"], lambda s, p, o: (s, p, number.format("1.5")))
    yield "a second value", [*graph, (of("rig/speed"), predicate["numerical"], number.format("0.75"))]
    yield "a value without its unit", changed(graph, lambda s, p, o: s == of("rig/speed") and p == predicate["unit"])
    yield "another unit", changed(graph, lambda s, p, o: s == of("rig/right/position") and p == predicate["unit"],
                                  lambda s, p, o: (s, p, "<http://qudt.org/vocab/unit/DEG>"))
    yield "a Thing without a link to a Property", changed(graph, lambda s, p, o: s == of("rig") and p == f"<{HYBRIT}property>" and o == of("rig/gear"))
    yield "a member of a list of another datatype", changed(graph, lambda s, p, o: s == cell and p == predicate["first"], lambda s, p, o: (s, p, '"one"'))
    yield "a list without its end", changed(graph, lambda s, p, o: s == cell and p == f"<{RDF}rest>")
    yield "a text that a shape of the user refuses", changed(graph, lambda s, p, o: s == of("rig/name") and p == f"<{RDF}value>",
                                                              lambda s, p, o: (s, p, '"Rig"'))
    error, reason = f"<{LRT}error>", '"it could not be read"'
    yield "a failed Property without its error", changed(graph, lambda s, p, o: s == of("rig/unread") and p == error)
    yield "a failed record without its error", changed(graph, lambda s, p, o: s == of("rig/unreadPlan") and p == error)
    yield "a failed Property with a value", [*graph, (of("rig/unread"), predicate["numerical"], number.format("0.75"))]
    yield "a Property with a value and an error", [*graph, (of("rig/name"), error, reason)]
    yield "a Property with two errors", [*graph, (of("rig/unread"), error, reason)]
    yield "an unknown enumerator", changed(graph, lambda s, p, o: s == of("rig/gear") and p == f"<{RDF}value>", lambda s, p, o: (s, p, '"fourth"'))


def change_everywhere(triples):
    """A graph in which no Thing has its state and each Property that is a number is a text, and what must be found: these Things and Properties."""
    state, number = f"<{LRT}state>", f"<{VOM}numericalValue>"
    things = {s for s, p, o in triples if p == f"<{RDF}type>" and o == f"<{HYBRIT}RoboticThing>"}
    properties = {o for s, p, o in triples if p == f"<{HYBRIT}property>"}
    numbers = {s for s, p, o in triples if p == number and s in properties}
    return [(s, p, '"a text"' if p == number and s in numbers else o) for s, p, o in triples if p != state], things | numbers


def show(title, lines):
    counted = collections.Counter(lines)
    print(f"{title}:")
    for line, count in counted.most_common(MOST_SHOWN):
        print(f"    {line[:300]}" + (f" ({count})" if count > 1 else ""))
    if len(counted) > MOST_SHOWN:
        print(f"    and {len(counted) - MOST_SHOWN} more")


def report_doubles(name, documents):
    """Prints figures. Whether there are no doubles."""
    merged, found = documents.merged(), doubles(documents, STATED)
    print(f"{name}: {len(documents.of)} documents, {sum(map(len, documents.of.values()))} triples, merged {len(merged)}; {len(documents.blanks())} blank nodes; "
          f"{len({(d.subject, d.predicate) for d in found})} places with doubles: {sum(d.too_many for d in found)} nodes, {sum(d.triples for d in found)} triples too many")
    for end, reason in STATED.items():
        stated = len(doubles(documents)) - len(found)
        if stated:
            print(f"    and {stated} nodes in {end}, {reason}")
    if found:
        show("  doubles by predicate", [d.predicate for d in found])
    return not found


def main():
    words = sys.argv[1:]
    long = words[0] == "--long"
    folder, shared, lrt_shacl, baxter, ex_urdf_robot, ex_mobile_base, merging_robot = words[long:]
    folder = pathlib.Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    node_packages(folder)
    graphs = folder / ("merging_long" if long else "merging")
    graphs.mkdir(exist_ok=True)
    judge, good = Judge(graphs, lrt_shacl), True
    read = {}  # documents by name

    Robot.program = baxter
    with contextlib.ExitStack() as running:
        receiver = running.enter_context(Receiver())
        robots = {"baxter": running.enter_context(Robot()), "another baxter": running.enter_context(Robot()),
                  "ex_mobile_base": running.enter_context(Program(ex_mobile_base, "--port", "0")),
                  "picker": running.enter_context(Program(ex_urdf_robot, "--port", "0"))}
        for name in ("turtlebot3_burger", "panda", "pr2") if long else ():
            urdf = os.path.join(shared, f"robots/urdf/{name}.urdf")
            if os.path.exists(urdf):
                robots[name] = running.enter_context(Program(ex_urdf_robot, urdf, "--port", "0", "--argument", "namespace="))
            else:
                print("skipped:", urdf, "is not there")
        rotated = robots["baxter"].rotate("right_s1", 10).expect(204).field("Location")
        until(lambda: "endedAtTime" in robots["baxter"].n_triples(rotated), "the joint at rest")
        robots["baxter"].post_subscription("baxter/right_s1/rotation", receiver.url).expect(201)
        for name, robot in robots.items():
            read[name] = Documents().crawl(robot)
        fleet = []  # robots of one kind and one vocabulary, at different moments
        for switches in ({}, {"present": False, "published": True, "available": False}):
            member = running.enter_context(MergingRobot(merging_robot, FLEET_VOCABULARY))
            fill_merging_robot(member)
            for name, wanted in switches.items():
                member.switch(name, wanted)
            fleet.append(Documents().crawl(member))
        read["a fleet with one vocabulary"] = Documents.union(*fleet)
        moving = running.enter_context(MergingRobot(merging_robot))
        fill_merging_robot(moving)
        read["merging_robot"] = Documents().crawl(moving)
        moments = dict(moments_of(moving, read["merging_robot"]))
        url = moving.url

    everything = Documents.union(*read.values())
    for name, documents in (*read.items(), ("all robots", everything)):
        good &= report_doubles(name, documents)
        judge.add(name, documents.merged())
    judge.add("all robots, with what RDFS entails", entailed(everything.merged()))
    several = Documents.union(*(documents for name, documents in read.items() if name in ("baxter", "ex_mobile_base", "picker", "merging_robot")))
    everywhere, to_be_found = change_everywhere(several.merged())
    judge.add(EVERYWHERE, everywhere)
    judge.add("two baxters", Documents.union(read["baxter"], read["another baxter"]).merged())
    for name, documents in moments.items():
        judge.add(name, documents.merged())
    changes = dict(changes_of(list(read["merging_robot"].merged()), url))
    for what, graph in changes.items():
        judge.add(what, graph)
    judge.run()
    return 0 if verdict(judge, changes, to_be_found) and good else 1


def blueprints_of(documents):
    found = {url: triples for url, triples in documents.of.items() if f"<{url}>" in documents.objects(HYBRIT + "blueprint")}
    assert len(found) >= 3, found.keys()
    return found


def moments_of(robot, before):
    """All documents of a moment, with the Blueprints of all moments before it."""
    earlier = [blueprints_of(before)]
    for what, name, wanted in (("an action is withdrawn", "available", False), ("Things are removed", "present", False),
                               ("they are added again", "present", True), ("the action is available again", "available", True),
                               ("values are published", "published", True)):
        robot.switch(name, wanted)
        documents = Documents().crawl(robot)
        now = blueprints_of(documents)
        for number, blueprints in enumerate(earlier):
            documents.take(blueprints, f"m{number}")
        earlier.append(now)
        yield f"Blueprints from before {what}", documents


def verdict(judge, changes, to_be_found):
    """Prints what the engines have found. Whether it is nothing, but in the changed graphs."""
    good = True
    for name in judge.files:
        found = {engine: judge.found[engine, name] for engine in ENGINES if (engine, name) in judge.found}
        if name == EVERYWHERE:
            for engine, results in found.items():
                named = set(re.findall(r"https?://[^\s<>()]+", "\n".join(results)))
                missing = sorted(iri for iri in to_be_found if iri[1:-1] not in named)
                print(f"changed: {name}: {engine} finds {len(to_be_found) - len(missing)} of {len(to_be_found)} Things and Properties")
                if missing:
                    good = False
                    show("  NOT FOUND", missing)
        elif name in changes:
            new = {engine: len(collections.Counter(results) - collections.Counter(judge.found[engine, "merging_robot"])) for engine, results in found.items()}
            print(f"changed: {name}: found by {', '.join(f'{engine} ({count})' for engine, count in new.items() if count)}")
            if not all(new.values()):
                good = False
                print("    NOT FOUND BY", ", ".join(engine for engine, count in new.items() if not count))
        else:
            print(f"{name}: results of {', '.join(f'{engine}: {len(results)}' for engine, results in found.items())}")
            results = next((results for results in found.values() if results), [])
            if results:
                good = False
                show("  the first says, without focus nodes", [result.partition(" ")[2] for result in results])
    return good


if __name__ == "__main__":
    sys.exit(main())
