# SPDX-License-Identifier: Apache-2.0
"""The figures of the paper on the live server: each triple of figures/*.ttl is there, and what conforms there conforms to the Blueprint.

    figures_test.py BAXTER
"""

import pathlib
import sys

import rdflib

from robot_process import Receiver, Robot, until

FIGURES = pathlib.Path(__file__).parent / "figures"
S1 = "baxter/right_s1"


def graph_of(text, base):
    return rdflib.Graph().parse(data=text, format="turtle", publicID=base)


def missing(pattern, graph):
    """The first triple of the pattern that no reading of its blank nodes finds in the graph; None: all are there."""
    triples = sorted(pattern, key=lambda t: sum(isinstance(x, rdflib.BNode) for x in t))
    # A blank node is bound by the triples that lead to it first.
    ordered, known = [], set()
    while triples:
        best = next((t for t in triples if not isinstance(t[0], rdflib.BNode) or t[0] in known), triples[0])
        triples.remove(best)
        ordered.append(best)
        known.update(x for x in best if isinstance(x, rdflib.BNode))
    furthest = [0]

    def search(at, bound):
        furthest[0] = max(furthest[0], at)
        if at == len(ordered):
            return True
        s, p, o = (bound.get(x, x) for x in ordered[at])
        for found in graph.triples((None if isinstance(s, rdflib.BNode) and s not in bound.values() else s, p, None)):
            if not isinstance(o, rdflib.BNode) or o in bound.values():
                if found[2] != o:
                    continue
            more = dict(bound)
            for wanted, have in ((ordered[at][0], found[0]), (ordered[at][2], found[2])):
                if isinstance(wanted, rdflib.BNode):
                    more[wanted] = have
            if search(at + 1, more):
                return True
        return False

    return None if search(0, {}) else ordered[min(furthest[0], len(ordered) - 1)]


def figure(name, robot, replacements=()):
    text = (FIGURES / f"{name}.ttl").read_text(encoding="utf-8")
    for old, new in replacements:
        text = text.replace(old, new)
    return graph_of(text, robot.at("baxter/"))


def check(name, robot, path, replacements=()):
    graph = graph_of(robot.get(path, Accept="text/turtle").expect(200).body, robot.at(path))
    wanted = figure(name, robot, replacements)
    lacks = missing(wanted, graph)
    assert lacks is None, f"Figure {name}: not at /{path}: {' '.join(x.n3() for x in lacks)}"
    # Not any graph has them: each triple that is taken away is noticed.
    for triple in wanted:
        if any(isinstance(x, rdflib.BNode) for x in triple):
            continue
        graph.remove(triple)
        assert missing(wanted, graph) is not None, triple
        graph.add(triple)
    print(f"Figure {name}: {len(wanted)} triples at /{path}")


def kind_of(robot):
    """The path of the Blueprint that the joint is an instance of, and not that of its bounds, which is longer."""
    graph = graph_of(robot.get(S1, Accept="text/turtle").expect(200).body, robot.at(S1))
    paths = [str(kind)[len(robot.at("")):] for kind in graph.objects(rdflib.URIRef(robot.at(S1)), rdflib.RDF.type) if "/blueprints/" in kind]
    return min(paths, key=len)


def main():
    Robot.program = sys.argv[1]
    with Robot("--allow-callback", "127.0.0.1") as robot, Receiver() as receiver:
        kind = kind_of(robot)
        check("2a", robot, kind, [("KIND", kind)])
        check("2b", robot, S1, [("KIND", kind)])
        check("3", robot, f"{S1}/rotation")
        made = robot.post_subscription(f"{S1}/rotation", receiver.url, container=f"{S1}/subscriptions").expect(201)
        identifier = made.field("Location").rsplit("/", 1)[1]
        check("4", robot, f"{S1}/subscriptions", (("ID", identifier), ("RECEIVER", receiver.url)))
        check("5a", robot, f"{S1}/actions/rotate")
        # 5b is a request: it is taken, and the joint turns.
        body = figure("5b", robot).serialize(format="turtle")
        robot.post(f"{S1}/actions/rotate", body).expect(204)
        until(lambda: "lrt:invocation" in robot.get(f"{S1}/actions/rotate", Accept="text/turtle").body, "an invocation")
        print("Figure 5b: taken by /" + f"{S1}/actions/rotate")


if __name__ == "__main__":
    main()
