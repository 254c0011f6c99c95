#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""The example ex_urdf_robot as a process: a client that knows RDF and nothing of URDF finds its kinematic tree, and sees joints move.

    ex_urdf_robot_test.py EX_URDF_ROBOT SOURCE_DIR SHARED_DIR
"""

import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from robot_process import RDF_TYPE, LRT, Robot, http_request, objects, plain, triples, until  # noqa: E402

ROS = "http://ros.org/#"
DCAT = "http://www.w3.org/ns/dcat#"
DCTERMS = "http://purl.org/dc/terms/"
VOM = "http://vocab.arvida.de/2015/06/vom/vocab#"


def tree(robot, thing):
    """Links, and per joint the links before and after it, as RDF says: {joint: (before, after)}, root."""
    top = robot.n_triples(thing)
    root = plain(objects(top, LRT + "rootLink")[0])
    parts = [plain(o) for o in objects(top, DCTERMS + "hasPart")]
    kinds = {p: set(objects(top, RDF_TYPE, p)) for p in parts}
    links = {p for p in parts if f"<{ROS}Link>" in kinds[p]}
    joints = {}
    for part in parts:
        if f"<{ROS}Joint>" in kinds[part]:
            said = robot.n_triples(part)
            joints[part] = (plain(objects(said, ROS + "preceedingLink")[0]), plain(objects(said, ROS + "succeedingLink")[0]))
    assert len(links) + len(joints) == len(parts), parts
    reached = {root}
    while True:
        more = {after for before, after in joints.values() if before in reached} - reached
        if not more:
            break
        reached |= more
    assert reached == links, links - reached
    return links, joints, root


def counts(urdf):
    top = ElementTree.parse(urdf).getroot()
    return len(top.findall("link")), len(top.findall("joint"))


def number(robot, path):
    return float(plain(objects(robot.n_triples(path), VOM + "numericalValue")[0].split("^^")[0]))


def translation(robot, link):
    """Of the link's pose, found by its predicate."""
    said = triples(robot.n_triples(plain(objects(robot.n_triples(link), LRT + "pose")[0])))
    node = next(o for _, p, o in said if p.endswith("spatial/vocab#translation>"))
    node = next(o for s, p, o in said if s == node and p.endswith("vom/vocab#quantityValue>"))
    return {p[-2]: float(plain(o.split("^^")[0])) for s, p, o in said if s == node and p[-3:] in ("#x>", "#y>", "#z>")}


def by_default(source):
    with Robot() as robot:
        links, joints, root = tree(robot, "picker")
        assert (len(links), len(joints)) == counts(os.path.join(source, "examples/ex_urdf_robot/picker.urdf"))
        assert root == robot.at("picker/rail")
        before = translation(robot, robot.at("picker/hand"))
        answer = http_request("PUT", robot.at("picker/slide/position"),
                              f"<> a <http://vocab.arvida.de/2015/06/maths/vocab#Scalar> ; <{VOM}numericalValue> 0.05 ; "
                              "<http://qudt.org/schema/qudt/hasUnit> <http://qudt.org/vocab/unit/M> .", {"Content-Type": "text/turtle"})
        answer.expect(204)
        until(lambda: abs(translation(robot, robot.at("picker/hand"))["x"] - before["x"] - 0.05) < 1e-9, "the hand 0.05 m further")
        assert number(robot, "picker/slide/position") == 0.05


def recorded(shared):
    urdf, csv = os.path.join(shared, "robots/urdf/panda.urdf"), os.path.join(shared, "robots/trajectories/panda_exciting_100hz.csv")
    if not (os.path.exists(urdf) and os.path.exists(csv)):
        print("skipped:", urdf, "or", csv, "is not there")
        return
    with Robot(urdf, csv) as robot:
        links, joints, _ = tree(robot, "panda")
        assert (len(links), len(joints)) == counts(urdf)
        first = number(robot, "panda/panda_joint4/position")
        until(lambda: abs(number(robot, "panda/panda_joint4/position") - first) > 1e-3, "a joint that has moved")
        assert number(robot, "panda/panda_joint2/effort") != 0
        assert number(robot, "panda/panda_finger_joint1/position") == 0  # has no column


def others(shared):
    for name in ("baxter", "pr2", "turtlebot3_burger"):
        urdf = os.path.join(shared, f"robots/urdf/{name}.urdf")
        if not os.path.exists(urdf):
            print("skipped:", urdf, "is not there")
            continue
        with Robot(urdf, "--argument", "namespace=") as robot:
            links, joints, _ = tree(robot, name)
            assert (len(links), len(joints)) == counts(urdf), name


def meshes():
    """A web client finds the bytes of a mesh by its link, with curl."""
    with tempfile.TemporaryDirectory() as folder:
        package = os.path.join(folder, "arm")
        os.mkdir(package)
        data = bytes(range(256)) * 4
        with open(os.path.join(package, "hand.stl"), "wb") as out:
            out.write(data)
        with open(os.path.join(folder, "secret.stl"), "w") as out:
            out.write("secret")
        os.symlink(os.path.join(folder, "secret.stl"), os.path.join(package, "leak.stl"))
        urdf = os.path.join(folder, "r.urdf")
        with open(urdf, "w") as out:
            shapes = "".join(f'<visual><geometry><mesh filename="package://arm/{f}"/></geometry></visual>' for f in ("hand.stl", "leak.stl", "../secret.stl"))
            out.write(f'<robot name="r"><link name="root">{shapes}</link></robot>')
        with Robot(urdf, "--package", "arm=" + package) as robot:
            def curl(*arguments):
                return subprocess.run(["curl", "-sS", "--path-as-is", *arguments], check=True, capture_output=True, timeout=60).stdout
            shape = robot.n_triples("r/root/visual/1")
            assert objects(shape, LRT + "mesh") == ["<package://arm/hand.stl>"]
            url = plain(objects(shape, DCAT + "downloadURL")[0])
            assert curl(url) == data
            fields = curl("-I", url).decode().lower()
            assert "content-type: model/stl" in fields, fields
            tag = next(line.split(" ", 1)[1].strip() for line in curl("-I", url).decode().splitlines() if line.lower().startswith("etag:"))
            assert curl("-o", os.devnull, "-w", "%{http_code}", "-H", "If-None-Match: " + tag, url) == b"304"
            assert curl("-r", "1020-", url) == data[1020:]
            for out in ("2", "3"):
                assert not objects(robot.n_triples("r/root/visual/" + out), DCAT + "downloadURL"), out
            for path in ("leak.stl", "../secret.stl", "%2e%2e/secret.stl", "..%2fsecret.stl", "/etc/passwd", "%2fetc%2fpasswd"):
                code = curl("-o", os.devnull, "-w", "%{http_code}", robot.at("r/meshes/arm/" + path))
                assert code in (b"404", b"400"), (path, code)


def main():
    Robot.program, source, shared = sys.argv[1:]
    by_default(source)
    recorded(shared)
    others(shared)
    meshes()
    print("ex_urdf_robot: all as expected")


main()
