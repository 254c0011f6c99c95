# SPDX-License-Identifier: Apache-2.0
"""Clients that know nothing of lrt ask a robot in SPARQL.

    clients_test.py BAXTER rdflib                  SPARQLStore of rdflib
    clients_test.py BAXTER comunica FOLDER         Comunica as it is in FOLDER/node_modules, fetched there by npm once

Each asks a SELECT, an ASK, a CONSTRUCT and an error. The answers must be those of the graphs that GET gives.
"""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.error
import urllib.request

sys.dont_write_bytecode = True  # nothing is left in the source tree
try:
    import rdflib
    from rdflib.compare import isomorphic
    from rdflib.plugins.stores.sparqlstore import SPARQLStore
except ImportError:
    print("skipped: rdflib is not installed")
    sys.exit(77)

HERE = pathlib.Path(__file__).resolve().parent
PREFIXES = "PREFIX ros: <http://ros.org/#> PREFIX dcterms: <http://purl.org/dc/terms/> PREFIX lrt: <https://w3id.org/lrt/ns#> "
JOINTS = PREFIXES + "SELECT ?joint ?name { ?joint a ros:Joint ; dcterms:title ?name }"
ASK = PREFIXES + 'ASK { ?joint a ros:Joint ; dcterms:title "%s" }'
BUILD = PREFIXES + "CONSTRUCT { ?joint dcterms:title ?name } { ?joint a ros:Joint ; dcterms:title ?name }"
COMUNICA_TIMEOUT = 180  # seconds


class Robot:
    def __init__(self, program):
        self.process = subprocess.Popen([program, "--port", "0"], stdout=subprocess.PIPE, text=True)
        self.url = re.match(r"\S+://[^/]+/", re.search(r"http://\S+", self.process.stdout.readline()).group()).group()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(10)

    def get(self, path):
        request = urllib.request.Request(self.url + path, headers={"Accept": "application/n-triples"})
        with urllib.request.urlopen(request, timeout=30) as response:
            return rdflib.Graph().parse(data=response.read(), format="nt")


def joints_by_get(robot):
    """What the whole robot's document says."""
    graph = robot.get("all")
    found = graph.query(JOINTS)
    return {(str(joint), str(name)) for joint, name in found}


def ask_rdflib(robot, expected):
    store = SPARQLStore(robot.url + "sparql")
    remote = rdflib.Graph(store)
    for method in ("GET", "POST", "POST_FORM"):
        store.method = method
        for form in ("json", "xml", "csv"):
            store.returnFormat = form
            assert {(str(joint), str(name)) for joint, name in remote.query(JOINTS)} == expected, (method, form)
        store.returnFormat = "json"
        name = min(expected)[1]
        assert bool(remote.query(ASK % name)), method
        assert not bool(remote.query(ASK % "no such joint")), method
        store.returnFormat = "xml"  # RDF/XML: rdflib has no other for graphs
        built = remote.query(BUILD).graph
        wanted = rdflib.Graph()
        for joint, title in expected:
            wanted.add((rdflib.URIRef(joint), rdflib.DCTERMS.title, rdflib.Literal(title)))
        assert isomorphic(built, wanted), method
        print("rdflib", method, len(expected), "joints, ASK, CONSTRUCT")
    store.method = "GET"
    # The interface of a store: patterns, a graph's name.
    of_one = min(expected)[0]
    assert rdflib.Literal(min(expected)[1]) in set(remote.objects(rdflib.URIRef(of_one), rdflib.DCTERMS.title))
    named = rdflib.Graph(SPARQLStore(robot.url + "sparql", context_aware=True), identifier=rdflib.URIRef(of_one))
    assert len(set(named.predicates(rdflib.URIRef(of_one)))) > 3
    try:
        remote.query("SELECT ?a { ?a ?b }")
    except Exception as error:  # what rdflib makes of a 400
        print("rdflib, a wrong query:", type(error).__name__)
    else:
        raise AssertionError("a wrong query had an answer")


def ask_comunica(robot, expected, folder):
    queries = {"joints": JOINTS, "ask": ASK % min(expected)[1], "no": ASK % "no such joint", "build": BUILD}
    run = subprocess.run(["node", str(HERE / "comunica_sparql.mjs"), str(folder), robot.url + "sparql"], input=json.dumps(queries), capture_output=True, text=True,
                         timeout=COMUNICA_TIMEOUT)
    assert run.returncode == 0, run.stdout + run.stderr
    answers = json.loads(run.stdout)
    assert {tuple(row) for row in answers["joints"]} == expected, answers["joints"]
    assert answers["ask"] is True and answers["no"] is False
    assert {(s, o) for s, _, o in answers["build"]} == expected, answers["build"]
    print("Comunica:", len(expected), "joints, ASK, CONSTRUCT")


def main():
    if sys.argv[2] == "comunica":
        folder = pathlib.Path(sys.argv[3])
        if not shutil.which("node"):
            print("skipped: there is no node")
            sys.exit(77)
        if not (folder / "node_modules" / "@comunica" / "query-sparql" / "package.json").exists():
            print("skipped: Comunica is not in", folder, "- the test whole_robot_comunica fetches it")
            sys.exit(77)
    with Robot(sys.argv[1]) as robot:
        expected = joints_by_get(robot)
        assert len(expected) >= 7, expected
        if sys.argv[2] == "rdflib":
            ask_rdflib(robot, expected)
        else:
            ask_comunica(robot, expected, folder)


if __name__ == "__main__":
    main()
