# SPDX-License-Identifier: Apache-2.0
"""What lrt-ros2 says of the simulated robot is one graph without a contradiction: three SHACL engines, two of which nobody here wrote, judge the union of
all its documents by all shapes in it. The robot is still: of one that moves, two documents have two values.

  strangers_test.py FOLDER LRT_SHACL LRT_ROS2 ROS2_ROBOT SOURCE

FOLDER has the packages of npm, as for merging_test.py. Without Node.js or the registry it exits with 77.
"""
import os
import pathlib
import sys

sys.dont_write_bytecode = True  # nothing is left in the source tree
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, os.pardir, "conformance"))
from merging_test import ENGINES, Judge, report_doubles, show  # noqa: E402
from random_bodies_test import node_packages  # noqa: E402
from robot_documents import Documents, entailed  # noqa: E402
from robot_process import Program  # noqa: E402

from robot_in_domain import Domain, Process, until  # noqa: E402


def settled(program):
    """All that is known of the robot is served: the last part is read from its nodes."""
    until(lambda: "nodes/lidar/parameters/range_max" in program.n_triples("all"), "the parameters of the nodes")
    until(lambda: "robot/elbow_joint/position" in program.n_triples("all"), "the joints")
    return program


def main():
    folder, lrt_shacl, lrt_ros2, ros2_robot, source = sys.argv[1:]
    folder = pathlib.Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    node_packages(folder)
    graphs = folder / "ros2"
    graphs.mkdir(exist_ok=True)
    domain = Domain()
    os.environ.update(domain.environment())
    config = os.path.join(source, "examples", "ros2_robot", "robot.toml")
    judge, read, good = Judge(graphs, lrt_shacl), {}, True
    with Process([ros2_robot, "--still"], domain.environment()) as robot:
        robot.wait_for("nodes in domain")
        with settled(Program(lrt_ros2, "--port", "0")) as only_read, settled(Program(lrt_ros2, "--port", "0", "--config", config)) as commanded:
            read["read-only"] = Documents().crawl(only_read)
            read["with commands"] = Documents().crawl(commanded)
            last = commanded.url + "lidar/transition_event/value"  # nothing has come there yet
            assert commanded.get(last).status == 503, commanded.get(last)
            url = commanded.url
    for name, documents in read.items():
        good &= report_doubles(name, documents)
    judge.add("read-only", read["read-only"].merged())
    judge.add("with commands, with what RDFS entails", entailed(read["with commands"].merged()))
    # What must be found, or the engines judge nothing.
    value = f"<{url}robot/elbow_joint/position>"
    graph = list(read["with commands"].merged())
    numerical = "<http://vocab.arvida.de/2015/06/vom/vocab#numericalValue>"
    assert any(s == value and p == numerical for s, p, _ in graph)
    judge.add("a position that is a text", [(s, p, '"a text"' if s == value and p == numerical else o) for s, p, o in graph])
    judge.run()
    for (engine, name), results in judge.found.items():
        if name == "a position that is a text":
            good &= any(value[1:-1] in result for result in results)
        elif results:
            good = False
            show(f"{engine} judges {name}", results)
    print(f"{len(judge.files)} graphs, {len(ENGINES)} engines: " + ("0 results" if good else "failed"))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
