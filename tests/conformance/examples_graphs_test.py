#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every resource of every example, as parsers that are not ours read it.

    examples_graphs_test.py DIR PROGRAM...

Starts each program, finds its resources by the links of their headers and the IRIs of their graphs, and GETs each in all RDF syntaxes.
N-Triples are the graph; rdflib must read the same one from Turtle, JSON-LD and RDF/XML, n3 from Turtle, jsonld.js from JSON-LD. DIR is that of
json_ld_test.py, which compares. Without rdflib, node, npm or the registry it exits with 77.
"""
import os
import pathlib
import re
import shutil
import signal
import sys
import urllib.parse

sys.dont_write_bytecode = True  # nothing is left in the source tree
from json_ld_test import check_node, check_rdflib, node_modules  # noqa: E402
from robot_process import Program, Receiver, Robot, triples, until  # noqa: E402

MOST = 1000  # resources of an example; more would be links without end

INLINE = 'application/ld+json;profile="https://w3id.org/lrt/ns#inlineContext"'
SYNTAXES = {".nt": "application/n-triples", ".ttl": "text/turtle", ".jsonld": INLINE, ".ref.jsonld": "application/ld+json",
            ".rdf": "application/rdf+xml"}

LEFT_OUT = {"t10_testing_without_a_port": "asks in process", "t12_validator": "validates, and serves nothing", "lrt-shacl": "serves nothing",
                "t22_rights": "shows nothing to a reader without credentials", "ex_jwt": "shows nothing to a reader without credentials",
                "t23_client": "is a client and ends by itself", "ex_conductor": "is tested with its robots by conductor_test.py",
                "ex_conductor_arm": "is tested with the conductor", "ex_fleet": "is tested with a broker"}

PREFIXES = """@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . @prefix maths: <http://vocab.arvida.de/2015/06/maths/vocab#> .
@prefix qudt: <http://qudt.org/schema/qudt/> . @prefix unit: <http://qudt.org/vocab/unit/> .
"""
METRE = "<> vom:numericalValue 1 ; qudt:hasUnit unit:M ."
ASKED = {  # invocations and members: what exists only after somebody has asked for it
    "t01_first_thing": [("baxter/right_s1/actions/rotate", "<> vom:numericalValue 0.75 ; qudt:hasUnit unit:RAD .")],
    "t05_actions": [("lift/actions/home", ""), ("lift/actions/moveTo", METRE), ("lift/actions/timeTo", METRE)],
    "t07_collections": [("rover/waypoints", "<> maths:x 1.5 ; maths:y 2 ; qudt:hasUnit unit:M .")],
    "t13_watching": [("arm/joint/actions/turn", "<> vom:numericalValue 1 .")],
}


class Lesson(Program):
    ends_with = (-signal.SIGTERM,)  # a lesson has no handler

    def __init__(self, path):
        super().__init__(path, "--serve", "0")


class Mounted(Program):
    url_pattern = r"https?://[^/\s]+/robot/"


def start(path, folder):
    name = os.path.basename(path)
    if name == "baxter":
        Robot.program = path
        return Robot()
    if name == "ex_ros_node":
        os.environ.update(ROS_MASTER_URI="http://127.0.0.1:1/", ROS_IP="127.0.0.1", ROS_HOME=str(folder), ROS_LOG_DIR=str(folder))
        print("ex_ros_node has no joints, for there is no master")
    if name in ("ex_mobile_base", "ex_own_transport", "ex_lws_host", "ex_ros_node", "ex_urdf_robot",
                "ex_parameter_table", "ex_protobuf_host"):
        return Program(path, "--port", "0")
    if name == "ex_redland_host":
        return Program(path, os.path.join(str(folder), "tasks.db"), "--port", "0")
    if name == "ex_httplib_host":
        return Mounted(path, "0")
    assert re.match(r"t\d\d_", name), f"how is {name} started?"
    return Lesson(path)


def fill(program, name, receiver):
    """Commands, members and a subscription, so that there is a resource of each kind."""
    for target, turtle in ASKED.get(name, []):
        answer = program.post(target, PREFIXES + turtle if turtle else "")
        assert answer.status in (200, 201, 204), answer
    if name == "baxter":
        program.rotate("right_s1", 10).expect(204)
        program.post_subscription("baxter/right_s1/rotation", receiver.url).expect(201)


def consistent(program, url):
    """A resource in every syntax, all of one moment; None if it has changed meanwhile."""
    found = {extension: program.get(url, Accept=accepted).expect(200) for extension, accepted in SYNTAXES.items()}
    tag = found[".nt"].field("ETag")
    return found if program.get(url, Accept=SYNTAXES[".nt"], If_None_Match=tag).status == 304 else None


def linked(program, url, answer):
    """What the head and the graph name of this server, without fragments, and without the formats of one resource."""
    targets = re.findall(r"<([^>]*)>", ", ".join(answer.headers.get_all("Link", [])) + answer.body)
    absolute = (urllib.parse.urldefrag(urllib.parse.urljoin(url, target)).url for target in targets)
    return {target for target in absolute if target.startswith(program.url) and "accept=" not in target}


def resources(program, left_out):
    """URL and response in N-Triples of each resource that links from the root lead to; `left_out` is a pattern of URLs."""
    known, todo = {program.url}, [program.url]
    while todo:
        url = todo.pop()
        answer = program.get(url, Accept="application/n-triples")
        if answer.status != 200:
            continue
        yield url, answer
        new = {u for u in linked(program, url, answer) if not re.search(left_out, u)} - known
        known |= new
        todo += sorted(new)


def crawl(program, folder):
    """Writes what json_ld_test.py compares; how many resources and triples there are."""
    (folder / "context.jsonld").write_text(program.get("ns/context.jsonld", Accept="application/ld+json").expect(200).body)
    known, todo, count = {program.url}, [program.url], 0
    while todo:
        url = todo.pop()
        documents = until(lambda: consistent(program, url), f"{url} at rest")
        graph = documents[".nt"]
        number = sum(1 for _ in folder.glob("*.nt"))
        for extension, document in documents.items():
            (folder / f"{number}{extension}").write_text(document.body)
        with open(folder / "index.txt", "a") as index:
            print(number, program.name, url, file=index)
        count += len(triples(graph.body))
        new = linked(program, url, graph) - known
        known |= new
        todo += sorted(new)
        assert len(known) <= MOST, f"{program.name} has no end"
    return len(known), count


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    node_modules(folder)
    documents = folder / "examples"
    shutil.rmtree(documents, ignore_errors=True)
    documents.mkdir()
    all_resources = all_triples = 0
    for path in sys.argv[2:]:
        name = os.path.basename(path)
        if name in LEFT_OUT:
            print(f"{name} is left out: it {LEFT_OUT[name]}")
            continue
        with Receiver() as receiver, start(path, folder) as program:
            fill(program, name, receiver)
            resources, count = crawl(program, documents)
        print(f"{name}: {resources} resources, {count} triples")
        all_resources, all_triples = all_resources + resources, all_triples + count
    print(f"in all {all_resources} resources, {all_triples} triples; {documents}/index.txt says which document is which")
    sys.stdout.flush()
    differ = check_rdflib(documents)
    return 1 if check_node(folder, documents) or differ else 0


if __name__ == "__main__":
    sys.exit(main())
