"""Clients that know nothing of lrt read the whole Baxter: from the root, by links, in few requests.

    whole_robot_test.py BAXTER rdflib
    whole_robot_test.py BAXTER comunica FOLDER      with Comunica in FOLDER/node_modules

Prints the number of requests for the angle and unit of all joints.
"""

import os
import pathlib
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True  # nothing is left in the source tree
from robot_process import LRT, Robot

MAX_REQUESTS = 10
JOINTS = 7
COMUNICA = "@comunica/query-sparql@4.4.1"  # 5 needs a newer Node than Debian has
PREFIXES = """
PREFIX hybrit: <https://hybr-it-projekt.de/ns/hybr-it#>
PREFIX lrt: <https://w3id.org/lrt/ns#>
PREFIX ros: <http://ros.org/#>
PREFIX spatial: <http://vocab.arvida.de/2015/06/spatial/vocab#>
PREFIX vom: <http://vocab.arvida.de/2015/06/vom/vocab#>
"""
ALL = PREFIXES + "SELECT ?all WHERE { ?root lrt:all ?all }"
ANGLES = PREFIXES + """SELECT ?joint ?angle ?unit WHERE {
  ?joint a ros:RevoluteJoint ; ros:rotation ?rotation .
  ?rotation spatial:rotationAngle [ vom:numericalValue ?angle ; vom:unit ?unit ] .
}"""
# The same with the graph that each is from: that of the Property.
ANGLES_BY_GRAPH = PREFIXES + """SELECT ?rotation ?angle ?unit WHERE {
  GRAPH ?rotation { ?rotation spatial:rotationAngle [ vom:numericalValue ?angle ; vom:unit ?unit ] }
}"""


def skip(why):
    print("skipped:", why)
    sys.exit(77)


def check(client, rows, requests):
    print(f"{client}: {len(rows)} joints with angle and unit in {requests} requests")
    assert len(rows) == JOINTS, rows
    assert requests <= MAX_REQUESTS, requests


def rdflib_reads(robot):
    try:
        import rdflib
    except ImportError:
        skip("rdflib is not installed (Debian: python3-rdflib)")
    requests = 0

    def read(url, syntax, store=None):
        nonlocal requests
        requests += 1
        media_types = {"turtle": "text/turtle", "nquads": "application/n-quads", "trig": "application/trig"}
        answer = robot.get(url, Accept=media_types[syntax]).expect(200)
        return (store if store is not None else rdflib.Graph()).parse(data=answer.body, format=syntax, publicID=url)

    root = read("", "turtle")
    every = str(next(root.objects(None, rdflib.URIRef(LRT + "all"))))
    turtle = read(every, "turtle")
    check(f"rdflib {rdflib.__version__}", list(turtle.query(ANGLES)), requests)

    # As N-Quads and TriG the default graph is the same, and each resource has a graph.
    for syntax in ("nquads", "trig"):
        quads = rdflib.ConjunctiveGraph()
        read(every, syntax, quads)
        names = {str(g.identifier) for g in quads.contexts()}
        for joint in turtle.subjects(rdflib.RDF.type, rdflib.URIRef("http://ros.org/#RevoluteJoint")):
            assert str(joint) in names and str(joint) + "/rotation" in names, (syntax, joint)
        rows = {(str(r[0]), str(r[1])) for r in quads.query(ANGLES_BY_GRAPH)}
        assert len(rows) == JOINTS, (syntax, rows)
    return 0


def comunica_reads(robot, folder):
    if not shutil.which("node"):
        skip("there is no node")
    if not (folder / "node_modules" / "@comunica" / "query-sparql" / "package.json").exists():
        skip(f"Comunica is not there: npm install --prefix {folder} --ignore-scripts {COMUNICA}")
    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "comunica.mjs")
    arguments = ["node", script, str(folder), robot.url, ALL, ANGLES, ANGLES_BY_GRAPH]
    made = subprocess.run(arguments, capture_output=True, text=True, timeout=120, check=False)
    print(made.stdout, made.stderr, sep="", end="")
    assert made.returncode == 0, made.returncode
    rows, by_graph, requests = (int(word) for word in made.stdout.splitlines()[-1].split())
    check("Comunica", [None] * rows, requests)
    assert by_graph == JOINTS, by_graph
    return 0


def main():
    Robot.program = sys.argv[1]
    with Robot() as robot:
        if sys.argv[2] == "rdflib":
            return rdflib_reads(robot)
        return comunica_reads(robot, pathlib.Path(sys.argv[3]).resolve())


if __name__ == "__main__":
    sys.exit(main())
