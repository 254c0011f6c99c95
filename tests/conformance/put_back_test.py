# SPDX-License-Identifier: Apache-2.0
"""What GET shows can be PUT back: each Property that can be written, in each of its media types.

    put_back_test.py PROGRAM...

Finds Properties by links. The representation that GET returns is sent back as it is, guarded by its entity tag: 204, and the same bytes are
there afterwards. random_bodies_robot has a Property of each type; it gets values that are at an edge first.
"""

import json
import os
import pathlib
import signal
import sys
import tempfile
import urllib.error
import urllib.request

sys.dont_write_bytecode = True  # nothing is left in the source tree
from examples_graphs_test import resources, start
from robot_process import Program

FORMATS = ("text/turtle", "application/n-triples", "application/ld+json", "application/rdf+xml", "application/trig", "application/n-quads",
           "application/json", "application/cbor", "text/plain", "application/octet-stream")
LEAST_FORMATS = 5  # of each Property

VOM = "@prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> . "
ODD = "\"quoted\" \\ back\n\r\n\t<b>&amp; ]]> '''\"\"\" \u00e9 \u65e5 \U0001f916 {} @en ^^ # , ; . "
# Values of random_bodies_robot: JSON, or Turtle for what JSON cannot say. Several of one Property: one after the other.
VALUES = {
    "on": ["true", "false"],
    "count": ["-9223372036854775808", "9223372036854775807"],
    "large": ["18446744073709551615"],
    "small": ["-5"],
    "steps": ["65535"],
    "single": ["0.1", "-0.0", "3.4028234e38", "1e-45"],
    "any": [VOM + f'<> vom:numericalValue "{n}"^^xsd:float .' for n in ("NaN", "INF", "-INF")],
    "boundOrNone": [VOM + '<> vom:numericalValue "NaN"^^xsd:double .', "0"],
    "below": ["3", "-1.7976931348623157e308", "5e-324"],
    "text": [json.dumps(ODD), '""', json.dumps("\ufeffmark"), json.dumps(" "), json.dumps("true"), json.dumps("1e3"), json.dumps("\x7f\u0085\u2028")],
    "gear": ['"reverse"'],
    "period": ['"PT0.000000001S"', '"-P106751DT23H"', '"PT0S"'],
    "since": ['"2026-02-28T23:59:59.999999999Z"', '"1677-09-22T00:00:00Z"', '"1970-01-01T00:00:00Z"'],
    "numbers": ["[]", "[1]", "[2147483647,-2147483648,0,0]"],
    "table": ["[]", "[[]]", "[[],[1.5],[],[2,3]]"],
    "three": ["[-90,0,90]"],
    "named": ["{}", json.dumps({"": 1, "a/b": 2.5, "\u00e9 \"x\"": -1e300})],
    "maybe": ["1.5", None],
    "maybeCount": ["7", None],
    "maybePoint": ['{"x":-10,"y":1e-30}', None],
    "job": [json.dumps({"name": "\"a\"\n\u00e9", "urgent": True, "repeats": 0, "way": [], "colour": [0, 255, 1]}),
            json.dumps({"name": "x", "urgent": False, "repeats": 20, "speed": 1.25, "start": {"x": 0, "y": 2}, "way": [{"x": 1, "y": 2}, {"x": 3, "y": 4}],
                        "colour": [1, 2, 3], "pause": "PT1.5S"})],
    "tuning": ['{"limit":1}', json.dumps({"gain": 0, "limit": -1e300, "count": 2147483647, "name": "\u00e9 \"x\"", "gear": "first", "active": True,
                                          "offset": 50, "steps": [], "limits": {"low": -100, "high": 1e-30}, "extra": {"": 1, "a/b": 2}})],
    "twin": ['{"limit":2,"steps":[-1,0]}'],
}


class Typed(Program):
    ends_with = (-signal.SIGTERM,)  # it has no handler


def request(method, url, body=None, **headers):
    """Status, header fields and the bytes of the body."""
    made = urllib.request.Request(url, body, {k.replace("_", "-"): v for k, v in headers.items()}, method=method)
    try:
        with urllib.request.urlopen(made, timeout=60) as answer:
            return answer.status, answer.headers, answer.read()
    except urllib.error.HTTPError as refused:
        return refused.code, refused.headers, refused.read()


def writable(program):
    """Properties, by links from the root."""
    return sorted(url for url, answer in resources(program, r"/(all|state|subscriptions)$|/ns/|/blueprints/")
                  if "PUT" in answer.field("Allow").split(", ") and "hybr-it#Property>" in answer.body)


def put_back(url, faults):
    """The number of its media types."""
    count = 0
    for media_type in FORMATS:
        status, headers, body = request("GET", url, Accept=media_type)
        if status == 406:
            continue
        count += 1
        assert status == 200, (url, media_type, status, body)
        sent, _, why = request("PUT", url, body, Content_Type=headers["Content-Type"], If_Match=headers["ETag"])
        _, after, again = request("GET", url, Accept=media_type)
        if sent != 204 or again != body or after["ETag"] != headers["ETag"]:
            faults.append((url, media_type, sent, body, why if sent != 204 else again))
    if count < LEAST_FORMATS:
        faults.append((url, f"has {count} media types", "", "", ""))
    return count


def main():
    faults, properties, values, representations = [], 0, 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for path in sys.argv[1:]:
            name = os.path.basename(path)
            typed = name == "random_bodies_robot"
            with Typed(path) if typed else start(path, pathlib.Path(folder)) as program:
                found = writable(program)
                assert found, f"{name}: no Property can be written"
                for url in found:
                    properties += 1
                    for value in VALUES[url.rsplit("/", 1)[1]] if typed else [""]:
                        values += 1
                        if value is None:  # no value: an empty description
                            status, _, why = request("PUT", url, b"", Content_Type="text/turtle")
                        elif value:
                            kind = "text/turtle" if value.startswith("@prefix") else "application/json"
                            status, _, why = request("PUT", url, value.encode(), Content_Type=kind)
                        assert not typed or status == 204, (url, value, status, why)
                        representations += put_back(url, faults)
                assert not typed or {u.rsplit("/", 1)[1] for u in found} == set(VALUES), found
    for url, media_type, status, body, why in faults:
        print(f"{url} as {media_type}: {status}\n  {body!r}\n  {why!r}")
    print(f"{properties} properties, {values} values, {representations} representations put back, {len(faults)} faults")
    assert not faults


main()
