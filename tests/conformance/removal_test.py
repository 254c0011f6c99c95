"""What is taken away from the state of a Thing, its Blueprint notices.

    removal_test.py LRT_SHACL PROGRAM [ARGUMENT...]

From the state of one Thing of each kind, every kind of triple (subject, predicate; for rdf:type the class) is taken away in turn. The
validator must find that the rest does not conform, except for the stated kinds. Prints what the Blueprints and the states amount to.
"""

import collections
import pathlib
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # nothing is left in the source tree
import rdflib
from rdflib.namespace import RDF

from robot_process import HYBRIT, LRT, Program

SH = rdflib.Namespace("http://www.w3.org/ns/shacl#")
QUDT = "http://qudt.org/schema/qudt/"
BLUEPRINT = rdflib.URIRef(HYBRIT + "blueprint")

# What a state has and no Blueprint requires, with the reason.
STATED = {
    QUDT + "hasUnit": "vom:unit or the shape's other constraints say the unit; one of two vocabularies suffices",
    QUDT + "hasQuantityKind": "follows from the unit",
    QUDT + "dataType": "is sh:datatype in the Blueprint",
    LRT + "elementType": "is sh:datatype in the Blueprint",
    LRT + "matrix": "repeats the quaternion in full precision; optional in what clients send",
    "http://vocab.arvida.de/2015/06/vom/vocab#quantityKind": "follows from the class",
    LRT + "lowerLimit": "optional in a URDF",
    LRT + "upperLimit": "optional in a URDF",
    LRT + "velocityLimit": "optional in a URDF",
    LRT + "effortLimit": "optional in a URDF",
    str(RDF.first): "of a list in the user's Turtle",
    str(RDF.rest): "of a list in the user's Turtle",
    HYBRIT + "websocketUrl": "depends on the transport",
    "http://www.w3.org/ns/dcat#": "formats depend on the value",
    "http://purl.org/dc/terms/hasFormat": "formats depend on the value",
    "http://purl.org/dc/terms/format": "formats depend on the value",
}


def stated(predicate):
    return any(predicate == s or (s.endswith("#") and predicate.startswith(s)) for s in STATED)


class Robot(Program):
    def graph(self, url):
        return rdflib.Graph().parse(data=self.get(url, Accept="text/turtle").expect(200).body, format="turtle", publicID=url)


def things_below(robot, url, seen):
    graph = robot.graph(url)
    for part in list(graph.objects(None, rdflib.URIRef("http://www.w3.org/ns/ldp#contains"))) + list(
            graph.objects(rdflib.URIRef(url), rdflib.URIRef("http://purl.org/dc/terms/hasPart"))):
        if str(part) not in seen:
            seen[str(part)] = None
            things_below(robot, str(part), seen)
    return seen


def shapes_of(robot, thing):
    """The Blueprints of a Thing, which judge this Thing alone."""
    shapes = rdflib.Graph()
    for blueprint in robot.graph(thing).objects(rdflib.URIRef(thing), BLUEPRINT):
        one = robot.graph(str(blueprint))
        one.remove((None, SH.targetClass, None))
        one.remove((blueprint, SH.targetNode, None))
        one.add((blueprint, SH.targetNode, rdflib.URIRef(thing)))
        shapes += one
    return shapes


class Validator:
    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)

    def conforms(self, data, shapes):
        for name, graph in (("data.ttl", data), ("shapes.ttl", shapes)):
            graph.serialize(self.folder / name, format="turtle", encoding="utf-8")
        done = subprocess.run([self.program, self.folder / "data.ttl", self.folder / "shapes.ttl"], capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode in (0, 1), done
        return done.returncode == 0, done.stdout


def main():
    with tempfile.TemporaryDirectory() as folder, Robot(*sys.argv[2:]) as robot:
        validator = Validator(sys.argv[1], folder)
        kinds = {}  # a Thing of each kind
        for thing in things_below(robot, robot.url, {}):
            kinds.setdefault(next(robot.graph(thing).objects(rdflib.URIRef(thing), BLUEPRINT)), thing)
        unnoticed, tried, in_shapes, in_states = {}, 0, 0, 0
        for kind, thing in kinds.items():
            shapes, state = shapes_of(robot, thing), robot.graph(thing + "/state")
            in_shapes, in_states = in_shapes + len(shapes), in_states + len(state)
            good, said = validator.conforms(state, shapes)
            assert good, f"{thing}: {said}"
            # The Thing, its Properties, and the blank nodes of their values; what is linked to is described elsewhere.
            # Of the members of a list two are enough.
            reached = [rdflib.URIRef(thing), *state.objects(rdflib.URIRef(thing), rdflib.URIRef(HYBRIT + "property"))]
            ways = {node: (node,) for node in reached}  # the predicates that lead to a node
            followed = collections.Counter()
            todo = list(reached)
            for node in todo:
                for predicate, o in state.predicate_objects(node):
                    if not isinstance(o, rdflib.BNode) or o in ways:
                        continue
                    ways[o] = ways[node] if predicate == RDF.rest else (*ways[node], predicate)
                    todo.append(o)
                    if predicate != RDF.rest:
                        followed[ways[o]] += 1
                        if followed[ways[o]] <= 2:
                            reached.append(o)
            for subject in reached:
                what = "Thing" if str(subject) == thing else "Property" if isinstance(subject, rdflib.URIRef) else "value"
                for predicate, classes in sorted({(p, o if p == RDF.type else None) for p, o in state.predicate_objects(subject)}, key=str):
                    if stated(str(predicate)):
                        continue
                    rest = rdflib.Graph()
                    for triple in state:
                        if not (triple[0] == subject and triple[1] == predicate and classes in (None, triple[2])):
                            rest.add(triple)
                    tried += 1
                    if validator.conforms(rest, shapes)[0]:
                        unnoticed.setdefault((what, predicate.n3(), classes.n3() if classes else ""), []).append(f"{thing} {subject.n3()}")
        print(f"{pathlib.Path(sys.argv[2]).name}: {len(kinds)} kinds of Things, {tried} removals; Blueprints {in_shapes} triples, states {in_states}: "
              f"{in_shapes / in_states:.2f}")
        for (what, predicate, of), where in sorted(unnoticed.items()):
            print(f"  not noticed: {what} {predicate} {of} ({len(where)}, first {where[0]})")
        assert not unnoticed


if __name__ == "__main__":
    main()
