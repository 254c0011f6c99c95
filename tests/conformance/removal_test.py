# SPDX-License-Identifier: Apache-2.0
"""What is taken away from the state of a Thing, its Blueprint notices.

    removal_test.py LRT_SHACL PROGRAM...

Starts each program. From the state of one Thing of each kind, every kind of triple (subject, predicate; for rdf:type the class) is taken away
in turn. The validator must find that the rest does not conform, except for the stated kinds, of which each must be needed. Prints what the
Blueprints and the states amount to, and how often a stated kind was not noticed.
"""

import collections
import os
import pathlib
import subprocess
import sys
import tempfile
import urllib.parse
from concurrent.futures import ThreadPoolExecutor

sys.dont_write_bytecode = True  # nothing is left in the source tree
import rdflib
from rdflib.namespace import RDF

from examples_graphs_test import LEFT_OUT, fill, start
from robot_process import HYBRIT, LRT, Receiver

QUDT = "http://qudt.org/schema/qudt/"
VOM = "http://vocab.arvida.de/2015/06/vom/vocab#"
BLUEPRINT = rdflib.URIRef(HYBRIT + "blueprint")
STATE = rdflib.URIRef(LRT + "state")

CAN_GO_AWAY = "can go away, so that an old Blueprint does not require it"
MAY_BE_ABSENT = "a pushed Property may have no value"
OPTIONAL_IN_URDF = "optional in a URDF"
OF_A_GEOMETRY = "which of them there are depends on lrt:geometryType"

# What a state has and no Blueprint requires, with the reason.
STATED = {
    "in the user's Turtle": "the Blueprint requires the link to a blank node of the user's own Turtle, not what the user says there",
    "hasUnit beside vom:unit": "either of two vocabularies says the unit; the Blueprint requires the first",
    "datatype beside a value": "sh:datatype of the value in the Blueprint",
    "elementType beside a value": "sh:datatype of the elements in the Blueprint",
    QUDT + "hasQuantityKind": "follows from the unit, which the Blueprint requires",
    VOM + "quantityKind": "follows from the class, which the Blueprint requires",
    LRT + "matrix": "repeats the quaternion in full precision; optional in what clients send",
    LRT + "lowerLimit": OPTIONAL_IN_URDF,
    LRT + "upperLimit": OPTIONAL_IN_URDF,
    LRT + "velocityLimit": OPTIONAL_IN_URDF,
    LRT + "effortLimit": OPTIONAL_IN_URDF,
    LRT + "materialName": OPTIONAL_IN_URDF,
    LRT + "colour": OPTIONAL_IN_URDF,
    LRT + "size": OF_A_GEOMETRY,
    LRT + "radius": OF_A_GEOMETRY,
    "http://vocab.arvida.de/2015/06/spatial/vocab#scaling": OF_A_GEOMETRY,
    "Grip/item": "std::optional in t04_structs_and_enums",
    "acme.Status/at": "a message within a message may be absent in Protocol Buffers",
    "class of a member of a map": "follows from its schema:name, which the Blueprint requires",
    "http://purl.org/dc/terms/hasFormat": "the formats depend on the value",
    "description of a Thing": "what is said of one Thing for people; its kind does not demand it",
    "class of the Blueprint": "by this the Blueprint finds its Things",
    "http://purl.org/dc/terms/hasPart": CAN_GO_AWAY,
    "http://purl.org/dc/terms/isPartOf": CAN_GO_AWAY,
    HYBRIT + "action": CAN_GO_AWAY,
    LRT + "all": CAN_GO_AWAY,
    LRT + "stop": CAN_GO_AWAY,
    LRT + "release": CAN_GO_AWAY,
    "http://purl.org/dc/terms/modified": MAY_BE_ABSENT,
    "numericalValue of a Property": MAY_BE_ABSENT,
    "value of a Property": MAY_BE_ABSENT,
    "of a World": "its types and graphs are what every World has; its Blueprint has what the Thing adds",
}


def stated(state, subject, what, predicate, of):
    """The entry of STATED for a removal, or None."""
    name = str(predicate)
    has_value = (subject, rdflib.URIRef(VOM + "numericalValue"), None) in state or (subject, RDF.value, None) in state
    if what == "Turtle":
        entry = "in the user's Turtle"
    elif of and "/blueprints/" in of:
        entry = "class of the Blueprint"
    elif what == "Property" and predicate in (RDF.value, rdflib.URIRef(VOM + "numericalValue")):
        entry = name.rpartition("#")[2] + " of a Property"
    elif (subject, RDF.type, rdflib.URIRef(LRT + "World")) in state and predicate in (RDF.type, rdflib.URIRef("http://www.w3.org/ns/ldp#contains"),
                                                                                    rdflib.URIRef(LRT + "allGraphs")):
        entry = "of a World"
    elif predicate == RDF.type and str(of) == "http://schema.org/PropertyValue":
        entry = "class of a member of a map"
    elif name == "http://purl.org/dc/terms/description":
        entry = "description of a Thing" if what == "Thing" else None
    elif name == QUDT + "hasUnit":
        entry = "hasUnit beside vom:unit" if (subject, rdflib.URIRef(VOM + "unit"), None) in state else None
    elif name in (LRT + "datatype", LRT + "elementType"):
        entry = name.replace("/", "#").rpartition("#")[2] + " beside a value" if has_value else None
    else:
        entry = name.rpartition("/ns/vocabulary#")[2] if "/ns/vocabulary#" in name else name
    return entry if entry in STATED else None


def graph_of(program, url):
    return rdflib.Graph().parse(data=program.get(url, Accept="text/turtle").expect(200).body, format="turtle", publicID=url)


def things_below(program, url, seen):
    graph = graph_of(program, url)
    for part in list(graph.objects(None, rdflib.URIRef("http://www.w3.org/ns/ldp#contains"))) + list(
            graph.objects(rdflib.URIRef(url), rdflib.URIRef("http://purl.org/dc/terms/hasPart"))):
        if str(part) not in seen:
            seen[str(part)] = None
            things_below(program, str(part), seen)
    return seen


def shapes_of(program, thing):
    """The Blueprints of a Thing."""
    shapes = rdflib.Graph()
    for blueprint in graph_of(program, thing).objects(rdflib.URIRef(thing), BLUEPRINT):
        shapes += graph_of(program, str(blueprint))
    return shapes


def n_triple(triple):
    return " ".join(term.n3() for term in triple) + " ."


class Validator:
    """Judges states by the Blueprints of one Thing."""

    def __init__(self, program, shapes, folder):
        self.program, self.shapes = program, pathlib.Path(folder) / "shapes.nt"
        self.shapes.write_text("\n".join(map(n_triple, shapes)))

    def conforms(self, data):
        """Whether the triples conform, and the report."""
        done = subprocess.run([self.program, "-", self.shapes], input="\n".join(map(n_triple, data)), capture_output=True, text=True, timeout=60,
                              check=False)
        assert done.returncode in (0, 1), done
        return done.returncode == 0, done.stdout


def removals(thing, state):
    """What can be taken away: subject, what it is, predicate, class if the predicate is rdf:type."""
    # The Thing, its Properties, and the nodes of their values, which are fragments of them; what is linked to is described elsewhere.
    # Of the members of a list two are enough.
    reached = [rdflib.URIRef(thing), *state.objects(rdflib.URIRef(thing), rdflib.URIRef(HYBRIT + "property"))]
    ways = {node: (node,) for node in reached}  # the predicates that lead to a node
    followed = collections.Counter()
    todo = list(reached)
    for node in todo:
        for predicate, o in state.predicate_objects(node):
            if not str(o).startswith(urllib.parse.urldefrag(str(node)).url + "#") or o in ways:
                continue
            ways[o] = ways[node] if predicate == RDF.rest else (*ways[node], predicate)
            todo.append(o)
            if predicate != RDF.rest:
                followed[ways[o]] += 1
                if followed[ways[o]] <= 2:
                    reached.append(o)
    for subject in reached:
        if "#" not in subject:
            what = "Thing" if str(subject) == thing else "Property"
        else:
            what = "Turtle" if str(ways[subject][0]) == thing else "value"
        for predicate, of in sorted({(p, o if p == RDF.type else None) for p, o in state.predicate_objects(subject)}, key=str):
            yield subject, what, predicate, of


def try_all(lrt_shacl, program, folder, counts):
    """Tries the removals of a program. Counts those that are stated: (noticed, not noticed). Returns whether all others are noticed."""
    kinds = {}  # a Thing of each kind
    for thing in things_below(program, program.url, {}):
        kind = graph_of(program, thing).value(rdflib.URIRef(thing), BLUEPRINT)
        if kind:
            kinds.setdefault(kind, thing)
    unnoticed, tried, in_shapes, in_states = {}, 0, 0, 0
    for thing in kinds.values():
        shapes = shapes_of(program, thing)
        state = graph_of(program, str(graph_of(program, thing).value(rdflib.URIRef(thing), STATE)))
        in_shapes, in_states = in_shapes + len(shapes), in_states + len(state)
        validator = Validator(lrt_shacl, shapes, folder)
        good, report = validator.conforms(state)
        assert good, f"{thing}: {report}"

        def is_noticed(removal, state=state, validator=validator):
            subject, _, predicate, of = removal
            return not validator.conforms(t for t in state if not (t[0] == subject and t[1] == predicate and of in (None, t[2])))[0]

        all_removals = list(removals(thing, state))
        tried += len(all_removals)
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            for (subject, what, predicate, of), noticed in zip(all_removals, pool.map(is_noticed, all_removals)):
                entry = stated(state, subject, what, predicate, of)
                if entry:
                    counts[entry, noticed] += 1
                elif not noticed:
                    unnoticed.setdefault((what, predicate.n3(), of.n3() if of else ""), []).append(f"{thing} {subject.n3()}")
    print(f"{program.name}: {len(kinds)} kinds of Things, {tried} removals; Blueprints {in_shapes} triples, states {in_states}: "
          f"{in_shapes / max(in_states, 1):.2f}")
    for (what, predicate, of), where in sorted(unnoticed.items()):
        print(f"  not noticed: {what} {predicate} {of} ({len(where)}, first {where[0]})")
    sys.stdout.flush()
    return not unnoticed


def shapes_without_a_shape_judge_nothing(lrt_shacl):
    with tempfile.TemporaryDirectory() as folder:
        shapes = os.path.join(folder, "shapes.ttl")
        with open(shapes, "w", encoding="ascii") as file:
            file.write("<urn:a> <urn:b> <urn:c> .")
        done = subprocess.run([lrt_shacl, shapes, shapes], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2 and "there is no shape" in done.stderr and not done.stdout, done


def main():
    lrt_shacl, *programs = sys.argv[1:]
    shapes_without_a_shape_judge_nothing(lrt_shacl)
    good, counts = True, collections.Counter()
    for path in programs:
        name = os.path.basename(path)
        if name in LEFT_OUT:
            print(f"{name} is left out: it {LEFT_OUT[name]}")
            continue
        with tempfile.TemporaryDirectory() as folder, Receiver() as receiver, start(path, pathlib.Path(folder)) as program:
            fill(program, name, receiver)
            good &= try_all(lrt_shacl, program, folder, counts)
    print("Stated, not noticed:")
    for entry, reason in STATED.items():
        noticed, not_noticed = counts[entry, True], counts[entry, False]
        print(f"  {not_noticed} of {noticed + not_noticed}: {entry}: {reason}")
        if noticed and not not_noticed:
            print("    the Blueprints notice it: it need not be stated")
            good = False
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
