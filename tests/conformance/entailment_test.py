#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Entailment under RDFS gives no resource of a robot a class that it does not have.

    entailment_test.py DIR SHARED PROGRAM...

Starts each program, finds all its documents by links, and adds the term list (/ns/lrt) and the server's vocabulary (/ns/vocabulary). Apache Jena's
RDFS reasoner computes what follows from all of them together. A resource may become an instance of a superclass (rdfs:subClassOf) of a class that
is stated of it, and of nothing else: then a domain or a range of a term does not hold. What the axioms of RDF say of classes, properties, datatypes
and lists is left out. Standard terms of which one of ours is a subproperty have the domains and ranges of SHARED/suites/terms. DIR is for the
documents that Jena reads. Without Jena it exits with 77.
"""
import os
import pathlib
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True  # nothing is left in the source tree
import jena  # noqa: E402
from examples_graphs_test import MOST, fill, linked, start  # noqa: E402
from robot_process import Receiver, triples  # noqa: E402

RDFS = "http://www.w3.org/2000/01/rdf-schema#"
TERM_LISTS = ("ns/lrt", "ns/vocabulary")
LEAST_CLASSES = 200  # memberships that a robot states: fewer would be no robot
LIMIT = 300  # seconds, for Jena on a busy machine; it needs about 10

# What the reasoner must find wrong, or the test finds nothing: a domain, and a range of a property above.
PLANTED = f"""<urn:part> <urn:links> <urn:other> .
<urn:links> <{RDFS}domain> <urn:Whole> .
<urn:links> <{RDFS}subPropertyOf> <urn:leads> .
<urn:leads> <{RDFS}range> <urn:Goal> .
"""
FOUND = ("WRONG: urn:part becomes urn:Whole, as subject of urn:links", "WRONG: urn:other becomes urn:Goal, as object of urn:links")


def documents(program):
    """The N-Triples of each resource; a subscription may have ended meanwhile."""
    found = {}
    todo = [program.url, *(program.url + path for path in TERM_LISTS)]
    known = set(todo)
    while todo:
        url = todo.pop()
        answer = program.get(url, Accept="application/n-triples")
        if answer.status == 404:
            continue
        found[url] = answer.expect(200).body
        new = linked(program, url, answer) - known
        known |= new
        todo += sorted(new)
        assert len(known) <= MOST, f"{program.name} has no end"
    return found


def standard_terms(shared):
    """Domain and range of each standard property, by its IRI. Several classes are a union, which RDFS cannot say."""
    path = shared / "suites" / "terms" / "terms.tsv"
    if not path.exists():
        print("skipped: the domains and ranges of standard terms: there is no SHARED/suites/terms/terms.tsv")
        return None
    rows = (line.split("\t") for line in path.read_text().splitlines())
    return {row[0]: list(zip(("domain", "range"), row[3:])) for row in rows if row[1] == "property"}


def standard_triples(graphs, standard):
    """What the owners of the properties above ours say of them."""
    above = {o[1:-1] for graph in graphs for _, p, o in triples(graph) if p == f"<{RDFS}subPropertyOf>"}
    described = {s[1:-1] for graph in graphs for s, p, _ in triples(graph) if p == f"<{RDFS}label>"}
    lines = []
    for term in sorted(above - described):
        assert term in standard, f"a term is a subproperty of {term}, which is no standard term"
        lines += [f"<{term}> <{RDFS}{kind}> <{classes}> .\n" for kind, classes in standard[term] if classes and " " not in classes]
    return "".join(lines)


def write(folder, graphs):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for number, graph in enumerate(graphs):
        (folder / f"{number}.nt").write_text(graph)


def main():
    folder, shared = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    command = jena.command("Entailment.java", folder)
    standard = standard_terms(shared)
    write(folder / "planted", [PLANTED])
    names = []
    for path in sys.argv[3:]:
        with Receiver() as receiver, start(path, folder) as program:
            fill(program, os.path.basename(path), receiver)
            graphs = documents(program)
        assert all(program.url + path in graphs for path in TERM_LISTS), f"{program.name} has no {' or no '.join(TERM_LISTS)}"
        graphs = list(graphs.values())
        write(folder / program.name, graphs + ([standard_triples(graphs, standard)] if standard is not None else []))
        names.append(program.name)
    folders = [str(folder / name) for name in ["planted", *names]]
    done = subprocess.run([*command, *folders], capture_output=True, text=True, timeout=LIMIT, check=False)
    assert done.returncode == 0, f"Jena ended with {done.returncode}: {done.stderr[-1000:]}"
    planted, *reports = done.stdout.split("\n= ")
    assert all(line in planted for line in FOUND), f"Jena does not find what is wrong in {folder / 'planted'}: {planted}"
    assert len(reports) == len(names), done.stdout
    for name, report in zip(names, reports):
        print(report.rstrip())
        stated = int(report.partition(" classes stated")[0].rsplit(" ", 1)[1])
        assert report.startswith(name + ":") and stated >= LEAST_CLASSES, f"{name} states the classes of too few resources"
    wrong = sum(report.count("WRONG: ") for report in reports)
    print(f"{len(names)} programs: {wrong} classes follow that are not stated and no superclasses")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
