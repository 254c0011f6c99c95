# SPDX-License-Identifier: Apache-2.0
"""Clients that know nothing of lrt read whole robots: from the root, by links, in few requests.

    whole_robot_test.py BAXTER EX_URDF_ROBOT SOURCE_DIR SHARED_DIR rdflib
    whole_robot_test.py BAXTER EX_URDF_ROBOT SOURCE_DIR SHARED_DIR comunica FOLDER      with Comunica in FOLDER/node_modules,
                                                                                       fetched there by npm once

One SPARQL query for each question about all joints (QUESTIONS) is asked of Baxter, of Panda and of PR2. The answers must be what the URDF says, as
ElementTree reads it. Prints rows, requests and seconds for each robot and question.
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import time
import urllib.parse
import xml.etree.ElementTree as ElementTree

sys.dont_write_bytecode = True  # nothing is left in the source tree
from robot_process import LRT, Program, until

MAX_REQUESTS = 10
COMUNICA = "@comunica/query-sparql@4.4.1"  # 5 needs a newer Node than Debian has
INSTALL_TIMEOUT = 400  # seconds
COMUNICA_TIMEOUT = 180  # seconds for all questions about one robot
ROS = "http://ros.org/#"
UNIT = "http://qudt.org/vocab/unit/"
PREFIXES = """
PREFIX dcterms: <http://purl.org/dc/terms/>
PREFIX hybrit: <https://hybr-it-projekt.de/ns/hybr-it#>
PREFIX lrt: <https://w3id.org/lrt/ns#>
PREFIX qudt: <http://qudt.org/schema/qudt/>
PREFIX ros: <http://ros.org/#>
PREFIX spatial: <http://vocab.arvida.de/2015/06/spatial/vocab#>
PREFIX vom: <http://vocab.arvida.de/2015/06/vom/vocab#>
"""
ALL = PREFIXES + "SELECT ?all WHERE { ?root lrt:all ?all }"
QUESTIONS = {name: PREFIXES + query for name, query in {
    "angle": """SELECT ?name ?angle ?unit WHERE {
  ?joint a ros:Joint ; dcterms:title ?name ; ros:rotation ?rotation .
  ?rotation spatial:rotationAngle [ vom:numericalValue ?angle ; qudt:hasUnit ?unit ] .
}""",
    "limits": """SELECT ?name ?limit ?value ?unit WHERE {
  VALUES ?limit { lrt:lowerLimit lrt:upperLimit lrt:velocityLimit lrt:effortLimit }
  ?joint a ros:Joint ; dcterms:title ?name ; lrt:limits ?limits .
  ?limits ?limit [ vom:numericalValue ?value ; qudt:hasUnit ?unit ] .
}""",
    "units": """SELECT ?name ?quantity ?unit WHERE {
  VALUES ?quantity { ros:position ros:velocity ros:effort }
  ?joint a ros:Joint ; dcterms:title ?name ; ?quantity ?property .
  ?property qudt:hasUnit ?unit .
}""",
    "links": """SELECT ?name ?before ?after WHERE {
  ?joint a ros:Joint ; dcterms:title ?name ; ros:preceedingLink/dcterms:title ?before ; ros:succeedingLink/dcterms:title ?after .
}""",
    "actions": """SELECT ?name ?action WHERE {
  ?joint a ros:Joint ; dcterms:title ?name ; hybrit:action ?action .
  ?action a hybrit:Action .
}""",
}.items()}
# The angles by the graph that each is from: that of the Property.
ANGLES_BY_GRAPH = PREFIXES + """SELECT ?rotation ?angle ?unit WHERE {
  GRAPH ?rotation { ?rotation spatial:rotationAngle [ vom:numericalValue ?angle ; qudt:hasUnit ?unit ] }
}"""


def skip(why):
    print("skipped:", why)
    sys.exit(77)


class Description:
    """What the answers must be, from the XML of a URDF alone."""

    def __init__(self, urdf, action):
        self.joints = ElementTree.parse(urdf).getroot().findall("joint")
        self.action = action  # of each joint that moves by itself

    def units(self, joint):
        """Of position, velocity and effort. Joints of other types are in metres, too."""
        angular = joint.get("type") in ("revolute", "continuous")
        return [UNIT + name for name in (("RAD", "RAD-PER-SEC", "N-M") if angular else ("M", "M-PER-SEC", "N"))]

    def moving(self):
        return [j for j in self.joints if j.get("type") in ("revolute", "continuous", "prismatic")]

    def check(self, question, rows):
        getattr(self, "check_" + question)(rows)

    def check_angle(self, rows):
        angular = [j for j in self.joints if j.get("type") in ("revolute", "continuous")]
        assert sorted((name, unit) for name, _, unit in rows) == sorted((j.get("name"), UNIT + "RAD") for j in angular), rows
        angles = {name: float(angle) for name, angle, _ in rows}
        for joint in angular:
            limit = joint.find("limit")
            if joint.get("type") == "revolute" and joint.find("mimic") is None:
                assert float(limit.get("lower")) - 1e-6 <= angles[joint.get("name")] <= float(limit.get("upper")) + 1e-6, joint.attrib

    def check_limits(self, rows):
        expected = {}
        for joint in self.joints:
            limit = joint.find("limit")
            if limit is None:
                continue
            position, velocity, effort = self.units(joint)
            bounded = joint.get("type") in ("revolute", "prismatic")
            for name, unit in (("lower", position), ("upper", position), ("velocity", velocity), ("effort", effort)):
                if limit.get(name) is not None and (bounded or unit != position):
                    expected[joint.get("name"), LRT + name + "Limit", unit] = float(limit.get(name))
        assert {(name, which, unit): float(value) for name, which, value, unit in rows} == expected and len(rows) == len(expected), rows

    def check_units(self, rows):
        expected = [(j.get("name"), ROS + quantity, unit)
                    for j in self.moving() for quantity, unit in zip(("position", "velocity", "effort"), self.units(j))]
        assert sorted(map(tuple, rows)) == sorted(expected), rows

    def check_links(self, rows):
        expected = [(j.get("name"), j.find("parent").get("link"), j.find("child").get("link")) for j in self.joints]
        assert sorted(map(tuple, rows)) == sorted(expected), rows

    def check_actions(self, rows):
        found = sorted((name, "/".join(urllib.parse.urlsplit(action).path.split("/")[2:])) for name, action in rows)
        expected = [(j.get("name"), f"{j.get('name')}/actions/{self.action}") for j in self.moving() if j.find("mimic") is None]
        assert found == sorted(expected), rows


def report(client, robot, question, rows, requests, seconds):
    print(f"{client}: {robot}: {question}: {len(rows)} rows, {requests} requests, {seconds:.2f} s")
    sys.stdout.flush()
    assert requests <= MAX_REQUESTS, requests


def wait_for_actions(robot, description):
    """A Thing has no actions until the robot's program has said that it is not stopped."""
    until(lambda: f"/actions/{description.action}>" in robot.get(robot.url + "all", Accept="application/n-triples").expect(200).body, "the actions")


def rdflib_reads(name, robot, description):
    import rdflib
    client = f"rdflib {rdflib.__version__}"
    requests = 0

    def read(url, syntax, store=None):
        nonlocal requests
        requests += 1
        media_types = {"turtle": "text/turtle", "nquads": "application/n-quads", "trig": "application/trig"}
        answer = robot.get(url, Accept=media_types[syntax]).expect(200)
        return (store if store is not None else rdflib.Graph()).parse(data=answer.body, format=syntax, publicID=url)

    wait_for_actions(robot, description)
    started = time.monotonic()
    every = str(next(read("", "turtle").objects(None, rdflib.URIRef(LRT + "all"))))
    turtle = read(every, "turtle")
    print(f"{client}: {name}: {len(turtle)} triples read in {time.monotonic() - started:.2f} s")
    for question, query in QUESTIONS.items():
        started = time.monotonic()
        rows = [[str(term) for term in row] for row in turtle.query(query)]
        report(client, name, question, rows, requests, time.monotonic() - started)
        description.check(question, rows)

    # As N-Quads and TriG the default graph is the same, and each resource has a graph.
    joints = list(turtle.subjects(rdflib.RDF.type, rdflib.URIRef(ROS + "Joint")))
    rotations = {str(o) for o in turtle.objects(None, rdflib.URIRef(ROS + "rotation"))}
    assert len(joints) == len(description.joints), joints
    for syntax in ("nquads", "trig"):
        quads = rdflib.ConjunctiveGraph()
        read(every, syntax, quads)
        graphs = {str(g.identifier) for g in quads.contexts()}
        assert {str(j) for j in joints} | rotations <= graphs, syntax
        found = [str(r[0]) for r in quads.query(ANGLES_BY_GRAPH)]
        assert set(found) == rotations and len(found) == len(rotations), (syntax, found)


def install_comunica(folder):
    """In a folder of the build, once: 500 packages."""
    if not shutil.which("npm"):
        skip("there is no npm")
    folder.mkdir(parents=True, exist_ok=True)
    command = ["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", COMUNICA]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=INSTALL_TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        skip(f"npm has not installed Comunica in {INSTALL_TIMEOUT} s")
    if done.returncode != 0:
        skip("npm cannot install Comunica: " + done.stderr.strip()[-300:])


def comunica_reads(name, robot, description, folder):
    wait_for_actions(robot, description)
    script = os.path.join(os.path.dirname(os.path.abspath(__file__)), "comunica.mjs")
    queries = json.dumps({"all": ALL, "questions": {**QUESTIONS, "angle by graph": ANGLES_BY_GRAPH}})
    done = subprocess.run(["node", script, str(folder), robot.url], input=queries, capture_output=True, text=True, timeout=COMUNICA_TIMEOUT, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    rows = {}
    for line in done.stdout.splitlines():
        answer = json.loads(line)
        question, rows[answer["name"]] = answer["name"], answer["rows"]
        if question == "angle":
            print("  " + "\n  ".join(answer["requests"]))
        report("Comunica", name, question, answer["rows"], len(answer["requests"]), answer["seconds"])
    for question in QUESTIONS:
        description.check(question, rows[question])
    assert len(rows["angle by graph"]) == len(rows["angle"]), rows["angle by graph"]


def main():
    baxter, ex_urdf_robot, source, shared, client = sys.argv[1:6]
    if client == "rdflib":
        try:
            import rdflib  # noqa: F401
        except ImportError:
            skip("rdflib is not installed (Debian: python3-rdflib)")
        ask = rdflib_reads
    else:
        folder = pathlib.Path(sys.argv[6]).resolve()
        if not shutil.which("node"):
            skip("there is no node")
        if not (folder / "node_modules" / "@comunica" / "query-sparql" / "package.json").exists():
            install_comunica(folder)

        def ask(name, robot, description):
            comunica_reads(name, robot, description, folder)

    with Program(baxter, "--port", "0") as robot:
        ask("Baxter", robot, Description(os.path.join(source, "examples/baxter/right_arm.urdf"), "rotate"))
    for name in ("Panda", "PR2"):
        urdf = os.path.join(shared, f"robots/urdf/{name.lower()}.urdf")
        if not os.path.exists(urdf):
            print("skipped:", urdf, "is not there")
            continue
        with Program(ex_urdf_robot, urdf, "--port", "0") as robot:
            ask(name, robot, Description(urdf, "move"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
