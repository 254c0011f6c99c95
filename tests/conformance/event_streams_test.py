#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Event streams as the http.client of Python reads them from the baxter example.

usage: event_streams_test.py [--transport NAME] [--tls] PATH_OF_BAXTER [WORD]...     only cases with one of the words
"""

import http.client
import json
import sys
import traceback
import urllib.parse

sys.dont_write_bytecode = True  # nothing is left in the source tree
from robot_process import LRT, PATIENCE, RDF_TYPE, Robot, Way, http_request, objects, run_on_way, until

CASES = []
ROTATION = "baxter/right_s1/rotation"
THING = "baxter/right_s1"


def case(function):
    CASES.append(function)
    return function


class EventStream:
    """Reads a response line by line, as WHATWG HTML 9.2.6 says."""

    def __init__(self, robot, path, **headers):
        parts = urllib.parse.urlsplit(robot.at(path))
        tls = {"context": Way.context} if parts.scheme == "https" else {}
        self.connection = (http.client.HTTPSConnection if tls else http.client.HTTPConnection)(parts.hostname, parts.port, timeout=PATIENCE, **tls)
        target = parts.path + ("?" + parts.query if parts.query else "")
        self.connection.request("GET", target, headers={"Accept": "text/event-stream", **{k.replace("_", "-"): v for k, v in headers.items()}})
        self.response = self.connection.getresponse()
        self.status = self.response.status

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.response.close()
        self.connection.close()

    def event(self):
        """(id, data) of the next event; None at the end of the stream."""
        tag, data = None, []
        while True:
            line = self.response.readline()
            if not line:
                return None
            line = line.decode().rstrip("\n")
            if not line and data:
                return tag, "\n".join(data)
            name, _, value = line.partition(":")
            value = value[1:] if value.startswith(" ") else value
            if name == "data":
                data.append(value)
            if name == "id":
                tag = value


@case
def the_first_event_is_what_get_responds(robot, demo):
    for path in (ROTATION, THING, THING + "/state", THING + "/actions/rotate", ROTATION + "?accept=application/json"):
        with EventStream(robot, path) as stream:
            assert stream.status == 200, f"{path}: {stream.status}"
            assert stream.response.headers["Content-Type"] == "text/event-stream"
            got = robot.get(path).expect(200)
            assert stream.event() == (got.field("ETag"), got.body), path


@case
def events_come_while_it_moves(robot, demo):
    with EventStream(demo, ROTATION + "?accept=application/json") as stream:
        values = [stream.event() for _ in range(5)]
        assert len({tag for tag, _ in values}) == 5, values
        assert len({json.loads(data)["rotationAngle"] for _, data in values}) == 5, values


@case
def a_client_that_has_the_value_gets_the_next(robot, demo):
    got = robot.get(ROTATION)
    with EventStream(robot, ROTATION, Last_Event_ID=got.field("ETag")) as stream:
        robot.rotate("right_s1", 20).expect(204)
        tag, data = stream.event()
        assert tag != got.field("ETag") and data != got.body


@case
def delete_of_its_subscription_ends_it(robot, demo):
    with EventStream(robot, ROTATION) as stream:
        stream.event()
        location = stream.response.headers["Location"]
        assert location in robot.members(THING)
        assert "<" + LRT + "EventStream>" in objects(robot.n_triples(location), RDF_TYPE)
        http_request("DELETE", location).expect(204)
        while stream.event():  # what was on its way
            pass
        assert location not in robot.members(THING)


@case
def a_client_that_closes_is_no_subscriber(robot, demo):
    stream = EventStream(robot, ROTATION)
    stream.event()
    location = stream.response.headers["Location"]
    stream.close()
    until(lambda: location not in robot.members(THING), "the subscription ends")


@case
def what_is_no_text_or_not_observable_is_refused(robot, demo):
    for path in (ROTATION + "?accept=application/cbor", "", THING + "/blueprint"):
        with EventStream(robot, path) as stream:
            assert stream.status == 406, f"{path}: {stream.status}"


def main(arguments):
    Robot.program = arguments[0]
    words = arguments[1:]
    failed = 0
    with Robot() as robot, Robot("--demo") as demo:
        for run in CASES:
            if words and not any(word in run.__name__ for word in words):
                continue
            try:
                run(robot, demo)
                print(f"{run.__name__}: ok", flush=True)
            except Exception:  # whatever it is, the others are run
                failed += 1
                print(f"{run.__name__}: FAILED\n{traceback.format_exc()}", flush=True)
    print(f"{failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(run_on_way(main, usage="event_streams_test.py [--transport NAME] [--tls] PATH_OF_BAXTER [WORD_OF_A_CASE...]"))
