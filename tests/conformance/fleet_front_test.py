#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Caches before robots, with the configurations of examples/fleet_front: how often the robot is asked, and who gets what.

usage: fleet_front_test.py nginx|varnish PATH_OF_AGED_ROBOT

Exits with 77 if the cache is not installed.
"""

import os
import sys
import time
import traceback
import xml.dom.minidom

sys.dont_write_bytecode = True  # nothing is left in the source tree
from fleet_front import CONFIGURATIONS, AgedRobot, Front, base, free_port, many_readers
from robot_process import until

AGE = 1  # s, as the robot states it
SECRET = "only-for-anna"
CASES = []


def case(function):
    CASES.append(function)
    return function


class Fleet:
    """A front with a robot for all, and one that needs a token."""

    def __init__(self, name, more=0):
        ports = free_port(), free_port()
        self.front = Front(name, *ports)
        self.ports = ports
        self.open = AgedRobot("--port", str(ports[0]), "--public-base", base(self.front, "cell7"), "--age", str(AGE), "--more", str(more))
        self.closed = AgedRobot("--port", str(ports[1]), "--public-base", base(self.front, "cell8"), "--age", str(AGE), "--token", SECRET)

    def __enter__(self):
        self.front.start()
        return self

    def __exit__(self, *_):
        self.front.stop()
        self.open.stop()
        self.closed.stop()

    def reads(self):
        return int(self.open.direct(self.ports[0], "/cell7/arm/reads", Host=f"localhost:{self.front.port}"))

    def reads_of_closed(self):
        return int(self.closed.direct(self.ports[1], "/cell8/arm/reads", Host=f"localhost:{self.front.port}", Authorization="Bearer " + SECRET))


@case
def two_hundred_readers_cost_one_request_for_each_interval(name):
    for more in (0, 1):
        with Fleet(name, more) as fleet:
            fleet.front.get("/cell7/arm/battery", Accept="text/plain")
            before, began = fleet.reads(), time.monotonic()
            results = many_readers(fleet.front, "/cell7/arm/battery", 200, 5)
            passed = time.monotonic() - began
            asked = fleet.reads() - before
            assert len(results) > 400 and all(status == 200 and body == b"0.5" for status, body in results), results[:3]
            # The reads of the beginning and the end of the last interval count, too. nginx makes readers of a value that has expired wait for one
            # another only where it may answer with the old value: without stale-while-revalidate all that come until the robot has answered ask it.
            most = passed / AGE + 2 if more or name != "nginx" else len(results) / 20
            assert 1 <= asked <= most, f"{asked} requests for {len(results)} reads in {passed:.1f} s"
            print(f"    {len(results)} reads by 200 readers in {passed:.1f} s, {asked} requests to the robot (max-age={AGE}, stale-while-revalidate={more})")


@case
def a_value_without_an_age_is_read_from_the_robot_each_time(name):
    with Fleet(name) as fleet:
        for number in (1.5, 2.5, 3.5):
            assert fleet.front.get("/cell7/arm/angle", "PUT", str(number), Content_Type="application/json")[0] == 204
            status, fields, body = fleet.front.get("/cell7/arm/angle", Accept="text/plain")
            assert (status, body) == (200, str(number)) and fields["cache-control"] == "no-cache", (status, fields, body)


@case
def each_media_type_is_kept_for_itself(name):
    with Fleet(name) as fleet:
        for _ in range(2):
            for media_type, begin in (("text/plain", "0.5"), ("text/turtle", "@prefix"), ("application/ld+json", "{")):
                status, fields, body = fleet.front.get("/cell7/arm/battery", Accept=media_type)
                assert status == 200 and fields["content-type"].startswith(media_type) and body.startswith(begin), (fields, body[:80])
                assert fields["cache-control"].startswith(f"max-age={AGE}") and "Accept" in fields["vary"], fields


@case
def what_a_token_protects_is_not_given_to_others(name):
    with Fleet(name) as fleet:
        path = "/cell8/arm/battery"
        for _ in range(3):
            status, fields, body = fleet.front.get(path, Accept="text/plain", Authorization="Bearer " + SECRET)
            assert (status, body) == (200, "0.5") and "private" in fields["cache-control"], (status, fields, body)
            status, fields, body = fleet.front.get(path, Accept="text/plain")
            assert status == 401 and "0.5" not in body, (status, fields, body)
            status, fields, body = fleet.front.get(path, Accept="text/plain", Authorization="Bearer other")
            assert status == 401, (status, fields, body)
        assert fleet.reads_of_closed() == 3
        # Nor does a refusal stay for those who may read.
        assert fleet.front.get(path, Accept="text/plain", Authorization="Bearer " + SECRET)[0] == 200


@case
def a_request_with_credentials_is_neither_answered_nor_kept_by_the_cache(name):
    with Fleet(name) as fleet:
        before = fleet.reads()
        for _ in range(4):
            assert fleet.front.get("/cell7/arm/battery", Accept="text/plain", Authorization="Bearer x")[0] == 200
        assert fleet.reads() - before == 4


@case
def an_event_stream_passes_while_others_read(name):
    with Fleet(name) as fleet:
        import http.client
        make = http.client.HTTPSConnection if fleet.front.tls else http.client.HTTPConnection
        stream = make("localhost", fleet.front.port, timeout=30, **({"context": fleet.front.tls} if fleet.front.tls else {}))
        stream.request("GET", "/cell7/arm/angle", headers={"Accept": "text/event-stream"})
        response = stream.getresponse()
        assert response.status == 200 and response.getheader("Content-Type").startswith("text/event-stream"), response.getheaders()
        assert fleet.front.get("/cell7/arm/angle", "PUT", "7.25", Content_Type="application/json")[0] == 204
        assert fleet.front.get("/cell7/arm/angle", Accept="text/plain")[2] == "7.25"
        text = b""
        while b"7.25" not in text:
            line = response.fp.readline()
            assert line, text
            text += line
        stream.close()


@case
def a_robot_that_leaves_is_not_answered_for(name):
    with Fleet(name) as fleet:
        assert fleet.front.get("/cell7/arm/battery", Accept="text/plain")[0] == 200
        fleet.open.stop()
        until(lambda: fleet.front.get("/cell7/arm/battery", Accept="text/plain")[0] in (502, 503, 504), "the age has passed")
        assert fleet.front.get("/cell8/arm/battery", Accept="text/plain", Authorization="Bearer " + SECRET)[0] == 200


@case
def the_service_file_of_avahi_is_well_formed(_):
    document = xml.dom.minidom.parse(os.path.join(CONFIGURATIONS, "lrt.service"))
    texts = {node.tagName: node.firstChild.data for node in document.getElementsByTagName("service")[0].childNodes if node.nodeType == node.ELEMENT_NODE}
    assert document.documentElement.tagName == "service-group"
    assert texts["type"] == "_lrt._tcp" and texts["port"].isdigit() and texts["txt-record"] == "path=/", texts


def main():
    name, AgedRobot.program = sys.argv[1:3]
    if not Front.is_installed(name):
        print(f"skipped: {name} is not installed; vendor/install.sh proxies")
        sys.exit(77)
    failed = 0
    for function in CASES:
        title = function.__name__.replace("_", " ")
        try:
            function(name)
            print(f"passed: {title}", flush=True)
        except Exception:
            failed += 1
            print(f"FAILED: {title}\n{traceback.format_exc()}", flush=True)
    print(f"{len(CASES) - failed} of {len(CASES)} passed")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
