#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every predicate and class that an example shows is defined somewhere.

    examples_terms_test.py PROGRAM...

Starts each program as examples_graphs_test.py does, GETs all its resources as N-Triples and collects their predicates and classes. Each is
described by the term list (/ns/lrt), by the vocabulary of the server (/ns/vocabulary), or belongs to a standard vocabulary.
"""
import os
import pathlib
import sys
import tempfile

sys.dont_write_bytecode = True  # nothing is left in the source tree
from examples_graphs_test import MOST, LEFT_OUT, fill, linked, start  # noqa: E402
from robot_process import Receiver, triples  # noqa: E402

# Vocabularies whose owners publish them.
STANDARD = ("http://www.w3.org/1999/02/22-rdf-syntax-ns#", "http://www.w3.org/2000/01/rdf-schema#", "http://www.w3.org/2002/07/owl#",
            "http://purl.org/dc/terms/", "http://www.w3.org/ns/dcat#", "http://www.w3.org/ns/ldp#", "http://www.w3.org/ns/prov#",
            "http://www.w3.org/ns/shacl#", "http://www.w3.org/ns/sparql-service-description#", "http://rdfs.org/ns/void#", "http://www.w3.org/ns/sosa/", "http://www.w3.org/ns/ssn/", "http://www.w3.org/2011/http#",
            "http://www.w3.org/1999/xhtml/vocab#", "http://qudt.org/schema/qudt/", "http://schema.org/", "http://purl.org/vocab/vann/",
            "http://www.ontologydesignpatterns.org/ont/dul/DUL.owl#")
EXAMPLE = "http://example.org/"  # terms of t08_saying_more's own
RDF_TYPE = "<http://www.w3.org/1999/02/22-rdf-syntax-ns#type>"
LABEL = "<http://www.w3.org/2000/01/rdf-schema#label>"


def graph(program, url):
    return triples(program.get(url, Accept="application/n-triples").expect(200).body)


def described(program, path):
    """The terms with a label in a document; none if there is no document."""
    answer = program.get(path, Accept="application/n-triples")
    return {s[1:-1] for s, p, _ in triples(answer.body) if p == LABEL} if answer.status == 200 else set()


def terms_of(program):
    """The predicates and classes of all resources: each with one of them."""
    known, todo, found = {program.url}, [program.url], {}
    while todo:
        url = todo.pop()
        answer = program.get(url, Accept="application/n-triples")
        if answer.status == 404:  # a subscription that has ended
            continue
        for _, predicate, object_ in triples(answer.expect(200).body):
            found.setdefault(object_ if predicate == RDF_TYPE and object_.startswith("<") else predicate, url)
        new = linked(program, url, answer) - known
        known |= new
        todo += sorted(new)
        assert len(known) <= MOST, f"{program.name} has no end"
    return {term[1:-1]: url for term, url in found.items()}


def main():
    undefined = 0
    for path in sys.argv[1:]:
        name = os.path.basename(path)
        if name in LEFT_OUT:
            continue
        with tempfile.TemporaryDirectory() as folder, Receiver() as receiver, start(path, pathlib.Path(folder)) as program:
            fill(program, name, receiver)
            terms = terms_of(program)
            known = described(program, "ns/lrt") | described(program, "ns/vocabulary")
            known |= {t for t in terms if t.startswith(program.url) and t in described(program, t.split("#")[0])}  # Blueprints are classes
            missing = {t: url for t, url in terms.items() if t not in known and not t.startswith((*STANDARD, EXAMPLE))}
        print(f"{name}: {len(terms)} predicates and classes")
        for term, url in sorted(missing.items()):
            print(f"  {term} is defined nowhere; it stands in {url}")
        undefined += len(missing)
    return 1 if undefined else 0


if __name__ == "__main__":
    sys.exit(main())
