# SPDX-License-Identifier: Apache-2.0
"""The example ex_redland_host as its comment says: a client reads the task list, adds a task, and watches the robot do it; the program's own file has all of it."""

import os
import sqlite3
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import Program, http_request, until  # noqa: E402

TASK = """PREFIX schema: <http://schema.org/>
INSERT DATA { <urn:task:3> a schema:Action ; schema:name "water the plants" ; schema:actionStatus schema:PotentialActionStatus }"""
STATUS, DONE = "http://schema.org/actionStatus", "http://schema.org/CompletedActionStatus"


def main(program):
    with tempfile.TemporaryDirectory() as folder:
        file = os.path.join(folder, "tasks.db")
        with Program(program, file, "--port", "0") as host:
            first = host.get("world/tasks", Accept="application/n-triples").expect(200)
            assert '"fetch the red cup"' in first.body and first.body.count(STATUS) == 2, first
            http_request("PATCH", host.at("world/tasks"), TASK, {"Content-Type": "application/sparql-update"}).expect(204)
            until(lambda: f"<urn:task:3> <{STATUS}> <{DONE}>" in host.get("world/tasks", Accept="application/n-triples").body,
                  "the robot does the client's task")
        # What Redland has kept, by a reader that is neither Redland nor lrt.
        with sqlite3.connect(file) as kept:
            states = kept.execute("SELECT o.uri FROM triples JOIN uris p ON triples.predicateUri = p.id "
                                  "JOIN uris o ON triples.objectUri = o.id WHERE p.uri = ?", (STATUS,)).fetchall()
        assert states == [(DONE,)] * 3, states
        with Program(program, file, "--port", "0") as host:
            again = host.get("world/tasks", Accept="application/n-triples").expect(200)
            assert again.body.count(DONE) == 3, again
    print("three tasks, one of a client, were done; a restart shows them")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
