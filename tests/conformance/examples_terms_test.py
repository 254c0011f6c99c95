#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every term that an example uses is known, and is used as its vocabulary defines it.

    examples_terms_test.py [--long] SHARED PROGRAM...

Starts each program as examples_graphs_test.py does, reads all its documents by links, an error and a validation report, and merges them. terms.py
judges each triple: the terms of SHARED/suites/terms one by one, with kind, domain and range; other vocabularies by prefix; the terms of lrt, of the
paper and of the server by the documents /ns/lrt and /ns/vocabulary, whose terms have label and comment in English. None is deprecated. Without
SHARED, standard terms are judged by prefix. --long adds the robots of SHARED to ex_urdf_robot's own.

In the documents of the first program that has an Action with an input it then makes one mistake after another, and each must be found.
"""
import contextlib
import os
import pathlib
import re
import sys
import tempfile

sys.dont_write_bytecode = True  # nothing is left in the source tree
from examples_graphs_test import LEFT_OUT, fill, start  # noqa: E402
from robot_documents import N_TRIPLES, Documents  # noqa: E402
from robot_process import HYBRIT, LRT, Program, Receiver, http_request  # noqa: E402
from terms import HTTP, LDP, OWL, QUDT, RDF, RDFS, SH, SOSA, SSN, TYPE, XSD, Judge, iri, standard_terms  # noqa: E402

TERM_LISTS = ("ns/lrt", "ns/vocabulary")
LONG = ("panda.urdf", "pr2.urdf", "turtlebot3_burger.urdf")
LEAST_TERMS = {"baxter": 100}  # that its documents use: fewer would be no robot
MOST_SHOWN = 30


def of_error(turtle):
    """The N-Triples of an error: predicates and objects of one blank node, which only Turtle has."""
    prefixes = dict(re.findall(r"@prefix ([\w-]*): <([^>]*)> \.", turtle))
    pairs = re.findall(r'(\ba|[\w-]+:\w+) ("(?:[^"\\]|\\.)*"|\d+|[\w-]+:\w+)', re.sub("@prefix.*", "", turtle))
    assert len(pairs) == 4, turtle

    def expanded(term):
        prefix, colon, name = term.partition(":")
        if term == "a":
            return f"<{TYPE}>"
        if term.startswith('"') or not colon:
            return term if term.startswith('"') else f'"{term}"^^<{XSD}integer>'
        return f"<{prefixes[prefix]}{name}>"

    return "".join(f"_:error {expanded(p)} {expanded(o)} .\n" for p, o in pairs)


def refusals(program, documents):
    """An error as RDF, and the report on a body that is refused."""
    missing = program.get("there/is/nothing", Accept="text/turtle").expect(404)
    documents.add(program.at("there/is/nothing"), of_error(missing.body))
    binding = next((s for triples in documents.of.values() for s, p, o in triples if p == f"<{HTTP}body>"), None)
    target = next((iri(o) for triples in documents.of.values() for s, p, o in triples if s == binding and p == f"<{HTTP}requestURI>"), None)
    method = next((iri(o) for triples in documents.of.values() for s, p, o in triples if s == binding and p == f"<{HTTP}mthd>"), "")
    if target:
        body = f"<> <{RDFS}comment> \"no value\" ."
        refused = http_request(method.rpartition("#")[2], target, body, {"Content-Type": "text/turtle", "Accept": N_TRIPLES})
        if refused.status == 422:
            documents.add(target + "?refused", refused.body)


def read(program):
    documents = Documents().crawl(program)
    for path in TERM_LISTS:
        url = program.at(path)
        if url not in documents.of:
            documents.add(url, program.get(path, Accept=N_TRIPLES).expect(200).body)
    refusals(program, documents)
    return documents


def judge(documents, url, standard):
    lists = [url + path for path in TERM_LISTS]
    return Judge(documents, url, lists, standard).run(lists[0])


def mistakes(documents, url, has_list):
    """What is wrong, with the documents that have it and a part of what must be reported."""
    lists, somewhere = url + TERM_LISTS[0], min(documents.of)

    def with_triple(s, p, o, at=somewhere):
        changed = Documents()
        changed.of = {**documents.of, at: [*documents.of[at], (s, f"<{p}>", o)]}
        return changed

    def instead(of, change):
        """The first triple that is `of` becomes `change` of it."""
        changed, done = Documents(), False
        changed.of = {}
        for where, triples in documents.of.items():
            kept = []
            for triple in triples:
                if not done and of(where, *triple):
                    done, new = True, change(*triple)
                    kept += [new] if new else []
                else:
                    kept.append(triple)
            changed.of[where] = kept
        assert done, "there is nothing to change"
        return changed

    def text_of(term, predicate):
        return lambda where, s, p, o: where == lists and s == f"<{term}>" and p == f"<{predicate}>"

    def field(name):
        subjects = {s for triples in documents.of.values() for s, p, o in triples if p == f"<{HTTP}fieldName>" and o == f'"{name}"'}
        return lambda where, s, p, o: s in subjects and p == f"<{TYPE}>"

    action = next(s for triples in documents.of.values() for s, p, o in triples if p == f"<{TYPE}>" and o == f"<{HYBRIT}Action>")
    shape = next(s for triples in documents.of.values() for s, p, o in triples if p == f"<{TYPE}>" and o == f"<{SH}NodeShape>")
    yield "a term without a label", instead(text_of(LRT + "state", RDFS + "label"), lambda *_: None), "ns#state has no"
    yield "a term of lrt that is used and has no label", instead(text_of(LRT + "state", RDFS + "label"), lambda *_: None), "ns#state is used as a property and"
    yield "a term of the paper without a comment", instead(text_of(HYBRIT + "Action", RDFS + "comment"), lambda *_: None), "hybr-it#Action has no"
    yield "a label without a language", instead(text_of(LRT + "policy", RDFS + "label"), lambda s, p, o: (s, p, o.replace("@en", ""))), "ns#policy has no"
    yield "a term without a vocabulary", instead(text_of(LRT + "policy", RDFS + "isDefinedBy"), lambda *_: None), "ns#policy has no vocabulary"
    for term in (QUDT + "dataType", QUDT + "unit", SSN + "forProperty", SSN + "hasProperty"):
        yield f"{term}, which is deprecated", with_triple(action, term, f"<{XSD}double>"), f"{term} is deprecated"
    yield "a deprecated term in a shape", with_triple(shape, SH + "path", f"<{QUDT}dataType>"), "dataType is deprecated"
    yield "a term of lrt that does not exist", with_triple(action, LRT + "unknown", '"x"'), "ns#unknown is used as a property and defined nowhere"
    yield "a term of the paper that does not exist", with_triple(action, HYBRIT + "unknown", '"x"'), "hybr-it#unknown is used as a property and"
    yield "a class of lrt as a property", with_triple(action, LRT + "Invocation", '"x"'), "ns#Invocation is a class, and"
    yield "a property of the paper as a class", with_triple(action, TYPE, f"<{HYBRIT}property>"), "hybr-it#property is a property, and"
    yield "a text where lrt's term wants a resource", with_triple(action, LRT + "invocation", '"x"'), "ns#invocation: range"
    yield "a subject outside the domain of a term of the paper", with_triple(shape, HYBRIT + "consumes", shape), "hybr-it#consumes: domain"
    yield "a name of a node shape", with_triple(shape, SH + "name", '"x"'), "shacl#name is of property shapes only"
    yield "Content-Type as a field of requests", instead(field("Content-Type"), lambda s, p, o: (s, p, f"<{HTTP}RequestHeader>")), "the field Content-Type"
    yield "Accept as a field of a body", instead(field("Accept"), lambda s, p, o: (s, p, f"<{HTTP}EntityHeader>")), "the field Accept"
    yield "an unknown vocabulary", with_triple(action, "http://example.com/term", '"x"'), "http://example.com/term is used as a property and"
    yield "an unknown datatype", with_triple(action, OWL + "versionInfo", '"x"^^<http://example.com/type>'), "http://example.com/type is no datatype"
    if has_list:
        yield "a standard term that does not exist", with_triple(action, LDP + "contians", action), "ldp#contians is used as a property and"
        yield "a standard class that does not exist", with_triple(action, TYPE, f"<{SOSA}Sensr>"), "sosa/Sensr is used as a class and"
        yield "a standard object that does not exist", with_triple(shape, SH + "nodeKind", f"<{SH}Iri>"), "shacl#Iri is used as an object and"
        yield "a standard class as a property", with_triple(action, LDP + "Container", action), "ldp#Container is a class, and"
        yield "a standard property as a class", with_triple(action, TYPE, f"<{LDP}contains>"), "ldp#contains is a property, and"
        yield "a subject outside the domain of a standard term", with_triple(action, LDP + "contains", action), "ldp#contains: domain"
        yield "a text where a standard term wants a resource", with_triple(action, RDFS + "subClassOf", '"x"'), "rdf-schema#subClassOf: range"
        yield "a resource where a standard term wants a text", with_triple(action, RDFS + "comment", action), "rdf-schema#comment: range"
        yield "no list where a standard term wants one", with_triple(shape, SH + "in", action), "shacl#in: range"
        yield "a date of another datatype", with_triple(action, "http://www.w3.org/ns/prov#endedAtTime", '"today"'), "prov#endedAtTime: range"


def check_judge(documents, url, standard):
    """How many mistakes are not found."""
    missed = 0
    number = 0
    for number, (name, changed, wanted) in enumerate(mistakes(documents, url, standard is not None), 1):
        if not any(wanted in found for found in judge(changed, url, standard)):
            print(f"  {name} is not found: {wanted}")
            missed += 1
    print(f"{number} mistakes are made, and {number - missed} found")
    return missed


@contextlib.contextmanager
def running(path, arguments, folder):
    with Receiver() as receiver:
        if arguments:
            with Program(path, "--port", "0", *arguments) as program:
                yield program
        else:
            with start(path, folder) as program:
                fill(program, os.path.basename(path), receiver)
                yield program


def main():
    arguments = sys.argv[1:]
    is_long = arguments[0] == "--long"
    shared, programs = pathlib.Path(arguments[is_long]), [(path, []) for path in arguments[is_long + 1:]]
    standard = standard_terms(shared)
    if standard is None:
        print("skipped: standard terms one by one: there is no SHARED/suites/terms/terms.tsv; they are judged by prefix")
    if is_long:
        robots = [shared / "robots" / "urdf" / name for name in LONG]
        if all(robot.exists() for robot in robots):
            given = [[str(robot), "--argument", "namespace="] for robot in robots]
            programs = [(path, more) for path, _ in programs for more in (given if os.path.basename(path) == "ex_urdf_robot" else [[]])]
        else:
            print("skipped: the robots of SHARED: they are not all there")
    wrong = missed = 0
    is_checked = False
    for path, more in programs:
        name = " ".join([os.path.basename(path), *(os.path.basename(word) for word in more[:1])])
        if name in LEFT_OUT:
            print(f"{name} is left out: it {LEFT_OUT[name]}")
            continue
        with tempfile.TemporaryDirectory() as folder, running(path, more, pathlib.Path(folder)) as program:
            documents = read(program)
        used = {term for triples in documents.of.values() for _, p, o in triples for term in ([p, o] if p == f"<{TYPE}>" else [p])}
        found = judge(documents, program.url, standard)
        print(f"{name}: {len(documents.of)} documents, {sum(map(len, documents.of.values()))} triples, {len(used)} properties and classes, {len(found)} faults")
        for what, where in list(found.items())[:MOST_SHOWN]:
            print(f"  {what}; {where}")
        assert len(used) >= LEAST_TERMS.get(name, 10), f"{name} uses too few terms"
        wrong += len(found)
        if not is_checked and not found and any(o == '"Content-Type"' for triples in documents.of.values() for _, _, o in triples):
            missed += check_judge(documents, program.url, standard)
            is_checked = True
    assert is_checked or wrong, "no program has an Action with an input, in which mistakes could be made"
    return 1 if wrong or missed else 0


if __name__ == "__main__":
    sys.exit(main())
