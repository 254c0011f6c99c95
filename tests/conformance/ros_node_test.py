#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The node of examples/ex_ros_node among others: a master of its own on loopback, and rospy, which publishes joints and hears commands.

    ros_node_test.py PROGRAM LRT_SHACL

Without rospy, rosmaster or the messages it exits with 77.
"""
import os
import signal
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # nothing is left in the source tree
from robot_process import Program, objects, plain, until  # noqa: E402

try:
    import rosmaster  # noqa: F401  (in a process of its own)
    import rospy
    from sensor_msgs.msg import JointState
except ImportError as missing:
    print(f"skipped: {missing}; apt-get install python3-rosmaster python3-rospy python3-sensor-msgs")
    sys.exit(77)

MASTER = """
import rosmaster.master, threading
master = rosmaster.master.Master(0)
master.start()
print(master.uri, flush=True)
threading.Event().wait()
"""
VALUE = "http://vocab.arvida.de/2015/06/vom/vocab#numericalValue"
UNIT = "http://qudt.org/schema/qudt/hasUnit"
BLUEPRINT = "https://hybr-it-projekt.de/ns/hybr-it#blueprint"
UNITS = "http://qudt.org/vocab/unit/"


class Master(Program):
    ends_with = (-signal.SIGTERM,)

    def __init__(self):
        super().__init__(sys.executable, "-c", MASTER)


class Node(Program):
    """joint_states is /arm/joint_states; shoulder has limits, and lift slides."""

    def __init__(self, path):
        super().__init__(path, "--port", "0", "--limits", "shoulder", "-1", "1", "--linear", "lift", "joint_states:=/arm/joint_states")

    def value(self, path):
        """The number and its unit; None if there is no such property."""
        answer = self.get("robot/" + path, Accept="application/n-triples")
        if answer.status == 404:
            return None
        body = answer.expect(200).body
        return float(plain(objects(body, VALUE)[0])), plain(objects(body, UNIT)[0])[len(UNITS):]

    def shows(self, path, number, unit):
        until(lambda: self.value(path) == (number, unit), f"{path} is {number} {unit}")

    def check_blueprint(self, thing, validator):
        with tempfile.TemporaryDirectory() as folder:
            # That of its kind and, if it has one, that of its bounds.
            blueprints = {plain(o).removeprefix(self.at("")) for o in objects(self.get(f"robot/{thing}", Accept="application/n-triples").expect(200).body, BLUEPRINT)}
            assert blueprints, "the Thing has no Blueprint"
            files = []
            for part in (f"robot/{thing}/state", *blueprints):
                files.append(os.path.join(folder, f"{len(files)}.ttl"))
                with open(files[-1], "w") as file:
                    file.write(self.get(part).expect(200).body)
            report = subprocess.run([validator, *files, "--format", "text"], capture_output=True, text=True, check=False)
            assert report.returncode == 0, report.stdout + report.stderr

    def command(self, joint, number, unit="RAD"):
        return self.post(f"robot/{joint}/actions/command", f"<> <{VALUE}> {number} ; <{UNIT}> <{UNITS}{unit}> .")


def among_others(path, validator):
    with Master() as master:
        os.environ["ROS_MASTER_URI"] = master.url
        rospy.init_node("others", disable_signals=True)
        states = rospy.Publisher("arm/joint_states", JointState, queue_size=10)
        with Node(path) as node:
            until(states.get_num_connections, "the node listens")
            states.publish(JointState(name=["shoulder", "lift"], position=[0.25, 0.5], effort=[1.5]))
            node.shows("shoulder/position", 0.25, "RAD")
            node.shows("shoulder/effort", 1.5, "N-M")
            node.shows("lift/position", 0.5, "M")
            assert node.value("shoulder/velocity") is None and node.value("lift/effort") is None, "the message had none"

            # Later ones: a name that cannot be a path, a joint that is new, more numbers than names.
            states.publish(JointState(name=["", "shoulder", "wrist left"], position=[9, 0.75, 0.125, 8], velocity=[7, 6, float("nan")]))
            node.shows("shoulder/position", 0.75, "RAD")
            node.shows("wrist%20left/position", 0.125, "RAD")
            node.check_blueprint("wrist%20left", validator)  # with a velocity that is not known
            assert "joint  is left out" in node.said(), node.said()
            assert node.value("lift/position") == (0.5, "M")

            answer = node.command("shoulder", 0.5).expect(409)
            assert "nobody listens to /joint_commands" in answer.body, answer
            heard = []
            rospy.Subscriber("joint_commands", JointState, heard.append)
            until(lambda: node.command("shoulder", 0.5).status == 204, "a command is sent")
            node.command("shoulder", 1.5).expect(422)
            node.command("lift", 0.5, "RAD").expect(422)
            node.command("lift", 1.5, "M").expect(204)

            def commands():
                return [(command.name, list(command.position)) for command in heard]

            until(lambda: len(heard) == 2, "two commands are heard")
            assert commands() == [(["shoulder"], [0.5]), (["lift"], [1.5])], commands()
            assert all(command.header.stamp.to_sec() > 0 and not command.velocity for command in heard), heard

            # What is connected stays so without the master.
            master.kill()
            states.publish(JointState(name=["shoulder"], position=[-0.5]))
            node.shows("shoulder/position", -0.5, "RAD")
            node.command("shoulder", -1).expect(204)
            until(lambda: len(heard) == 3, "a third command is heard")
            assert commands()[2] == (["shoulder"], [-1]), commands()


def without_a_master(path):
    os.environ["ROS_MASTER_URI"] = "http://127.0.0.1:1/"
    with Node(path) as node:
        until(lambda: "Failed to contact master" in node.said(), "the node waits for the master")
        node.get("robot").expect(200)


def main():
    with tempfile.TemporaryDirectory() as folder:
        os.environ.update(ROS_IP="127.0.0.1", ROS_HOME=folder, ROS_LOG_DIR=folder)
        os.environ.pop("ROS_HOSTNAME", None)
        among_others(*sys.argv[1:])
        without_a_master(sys.argv[1])
    print("all holds")


if __name__ == "__main__":
    main()
