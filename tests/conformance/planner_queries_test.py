# SPDX-License-Identifier: Apache-2.0
"""What a planner asks of a robot has one answer, whoever evaluates the query, and each row is there once.

    planner_queries_test.py [--long] FOLDER SHARED_DIR BAXTER EX_URDF_ROBOT EX_MOBILE_BASE MERGING_ROBOT

The queries are planner/*.rq, one text for all robots. Each is evaluated by the robot itself (lrt::query, if it has an endpoint), by rdflib over all
documents of the robot merged, and by Comunica over what its engine that follows links finds from the root on. npm fetches Comunica to FOLDER once. --long
adds the large robots of SHARED_DIR. Prints a table of rows and seconds.
"""

import collections
import json
import os
import pathlib
import shutil
import subprocess
import sys
import time

sys.dont_write_bytecode = True  # nothing is left in the source tree
try:
    import rdflib
except ImportError:
    print("skipped: rdflib is not installed (Debian: python3-rdflib)")
    sys.exit(77)
from merging_test import MergingRobot, fill_merging_robot
from robot_documents import Documents
from robot_process import Program, Robot, http_request

HERE = pathlib.Path(__file__).resolve().parent
COMUNICA = {"@comunica/query-sparql-link-traversal": "0.5.0", "@comunica/query-sparql": "4.4.1", "n3": "2.13.12"}
INSTALL_TIMEOUT, COMUNICA_TIMEOUT = 400, 400  # seconds
MOST_DOCUMENTS = 5000
QUERIES = {path.stem: path.read_text(encoding="utf-8") for path in sorted((HERE / "planner").glob("*.rq"))}


def skip(why):
    print("skipped:", why)
    sys.exit(77)


def install(folder):
    """Comunica, in a folder of the build, once: 900 packages."""
    if not shutil.which("node") or not shutil.which("npm"):
        skip("there is no node, or no npm")
    if all((folder / "node_modules" / name / "package.json").exists() for name in COMUNICA):
        return
    wanted = [f"{name}@{version}" for name, version in COMUNICA.items()]
    folder.mkdir(parents=True, exist_ok=True)
    command = ["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", *wanted]
    try:
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=INSTALL_TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        skip(f"npm has not installed Comunica in {INSTALL_TIMEOUT} s")
    if done.returncode != 0:
        skip(f"npm cannot install Comunica: {done.stderr.strip()[-300:]}")


def canonical(term):
    """A term as a text that is the same for each engine: numbers by their value, for an engine may write one in its own way."""
    if term is None:
        return None
    try:
        return f"{float(term):.9g}"
    except ValueError:
        return str(term)


Answer = collections.namedtuple("Answer", "rows seconds")  # rows: a Counter of tuples


def answer_of(rows, seconds):
    return Answer(collections.Counter(tuple(map(canonical, row)) for row in rows), seconds)


def robot_answers(robot):
    """By its own endpoint, or None if it has none."""
    if http_request("GET", robot.at("sparql"), headers={"Accept": "text/turtle"}).status == 404:
        return None
    found = {}
    for name, query in QUERIES.items():
        started = time.monotonic()
        answer = http_request("POST", robot.at("sparql"), query, {"Content-Type": "application/sparql-query", "Accept": "application/sparql-results+json"})
        result = json.loads(answer.expect(200).body)
        rows = [[row.get(v, {}).get("value") for v in result["head"]["vars"]] for row in result["results"]["bindings"]]
        found[name] = answer_of(rows, time.monotonic() - started)
    return found


def rdflib_answers(documents):
    graph = rdflib.Graph().parse(data="".join(f"{s} {p} {o} .\n" for s, p, o in documents.merged()), format="nt")
    found = {}
    for name, query in QUERIES.items():
        started = time.monotonic()
        rows = [[None if term is None else str(term) for term in row] for row in graph.query(query)]
        found[name] = answer_of(rows, time.monotonic() - started)
    return found


def comunica_answers(robot, folder):
    done = subprocess.run(["node", str(HERE / "planner.mjs"), str(folder), robot.url, str(MOST_DOCUMENTS)], input=json.dumps(QUERIES),
                          capture_output=True, text=True, timeout=COMUNICA_TIMEOUT, check=False)
    assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-3000:]
    read, *answers = [json.loads(line) for line in done.stdout.splitlines()]
    print(f"{robot.name}: Comunica has read {read['documents']} documents with {read['triples']} triples in {read['seconds']:.1f} s")
    return {a["name"]: answer_of(a["rows"], a["seconds"]) for a in answers}


def compare(robot, answers):
    """Prints the table of a robot. How many queries have differing answers or a row twice."""
    wrong = 0
    print(f"{robot:28} " + " ".join(f"{way:>18}" for way in answers))
    for name in QUERIES:
        of = {way: found[name] for way, found in answers.items()}
        print(f"{name:28} " + " ".join(f"{sum(a.rows.values()):>8} {a.seconds:7.2f} s" for a in of.values()))
        twice = {way: [row for row, count in a.rows.items() if count > 1] for way, a in of.items()}
        differ = [(way, (a.rows - reference.rows) + (reference.rows - a.rows)) for reference in [next(iter(of.values()))] for way, a in of.items()]
        if any(twice.values()) or any(d for _, d in differ):
            wrong += 1
        for way, rows in twice.items():
            if rows:
                print(f"    {way}: {len(rows)} rows more than once: {rows[:2]}")
        for way, rows in differ:
            if rows:
                print(f"    {way} differs by {sum(rows.values())} rows: {list(rows)[:2]}")
    sys.stdout.flush()
    return wrong


def main():
    words = sys.argv[1:]
    long = words[0] == "--long"
    folder, shared, baxter, ex_urdf_robot, ex_mobile_base, merging_robot = words[long:]
    folder = pathlib.Path(folder).resolve()
    install(folder)
    assert len(QUERIES) >= 20, QUERIES.keys()
    Robot.program = baxter
    wrong, empty = 0, set(QUERIES)
    commands = {"baxter": [baxter, "--port", "0"], "picker": [ex_urdf_robot, "--port", "0"], "ex_mobile_base": [ex_mobile_base, "--port", "0"],
                "merging_robot": [merging_robot]}
    for name in ("panda", "pr2") if long else ():
        urdf = os.path.join(shared, f"robots/urdf/{name}.urdf")
        if os.path.exists(urdf):
            commands[name] = [ex_urdf_robot, urdf, "--port", "0"]
        else:
            print("skipped:", urdf, "is not there")
    for name, command in commands.items():
        with (MergingRobot if name == "merging_robot" else Program)(*command) as robot:
            if name == "merging_robot":
                fill_merging_robot(robot)
            answers = {"the robot": robot_answers(robot)}
            if not answers["the robot"]:
                print(f"{name} has no endpoint: two ways")
                del answers["the robot"]
            documents = Documents().crawl(robot)
            answers["rdflib"] = rdflib_answers(documents)
            answers["Comunica"] = comunica_answers(robot, folder)
        print(f"{name}: {len(documents.of)} documents with {len(documents.merged())} triples are merged")
        wrong += compare(name, answers)
        empty -= {query for query in QUERIES if all(found[query].rows for found in answers.values())}
    print(f"{len(QUERIES)} queries; {wrong} times answers differ or have a row more than once")
    if empty:
        print("without an answer of any robot:", ", ".join(sorted(empty)))
    return 1 if wrong or empty else 0


if __name__ == "__main__":
    sys.exit(main())
