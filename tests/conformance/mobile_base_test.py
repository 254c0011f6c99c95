# SPDX-License-Identifier: Apache-2.0
"""ex_mobile_base as its operator uses it, with values alone: JSON in, JSON out.

    mobile_base_test.py EX_MOBILE_BASE
"""

import json
import sys

from robot_process import Program, http_request, until


class Base(Program):
    def json(self, path):
        return json.loads(self.get(path, Accept="application/json").expect(200).body)

    def send(self, method, path, value=None, **headers):
        fields = {"Accept": "application/json", **{k.replace("_", "-"): v for k, v in headers.items()}}
        if value is not None:
            fields["Content-Type"] = "application/json"
        return http_request(method, self.at(path), None if value is None else json.dumps(value), fields)

    def drive(self, x, y, **headers):
        return self.send("POST", "base/actions/driveTo", {"x": x, "y": y}, **headers)

    def soon(self):
        """Ten seconds from now, by the clock of the server."""
        instance, milliseconds = self.get("").field("Robot-Time").split("/")
        return f"{instance}/{int(milliseconds) + 10_000}"

    def invocation(self, started):
        path = started.field("Location")
        return json.loads(self.get(path, Accept="application/json").expect(200).body)


def main():
    with Base(sys.argv[1], "--port", "0") as base:
        # What the getters return is there by name.
        assert set(base.json("base/pose")) == {"x", "y", "heading"}, base.json("base/pose")
        assert set(base.json("base/battery")) == {"voltage", "charging"}
        assert len(base.json("base/scan")["ranges"]) == 360
        assert base.json("base/bumper") is False
        base.send("PUT", "base/pose", {"x": 0, "y": 0, "heading": 0}).expect(405)

        # Getters and setters: written, bounded, refused while it drives.
        base.send("PUT", "base/gains", {"p": 9, "i": 1, "d": 0.5}).expect(204)
        assert base.json("base/gains") == {"p": 9, "i": 1, "d": 0.5}, base.json("base/gains")
        base.send("PUT", "base/gains", {"p": -1, "i": 1, "d": 0.5}).expect(422)
        base.send("PUT", "base/gains", {"p": 1, "i": 1}).expect(422)

        # A drive is taken, reports how far it is, and ends well.
        far = base.drive(40, 0).expect(204)
        until(lambda: base.invocation(far).get("progress", 0) > 0, "the drive has progress")
        refused = base.send("PUT", "base/gains", {"p": 1, "i": 1, "d": 0}).expect(409)
        assert "while the base drives" in refused.body, refused

        # A second drive takes the place of the first.
        near = base.drive(base.json("base/pose")["x"] + 0.05, 0, Prefer="wait=30")
        assert near.status in (200, 204), near
        assert base.invocation(far)["status"] == "cancelled", base.invocation(far)
        assert base.invocation(near)["status"] == "succeeded", base.invocation(near)

        # A client that cancels stops the base.
        far = base.drive(-40, 0).expect(204)
        http_request("DELETE", far.field("Location")).expect(204)
        assert base.invocation(far)["status"] == "cancelled"
        until(lambda: base.json("base/speed") == 0, "the base stands")

        # A driver writes a speed again and again. When it is silent, the base stops by itself.
        life = json.loads(base.get("base", Accept="application/json").expect(200).body)["properties"]["drive"]["expiresAfter"]
        assert life == 0.2, life
        start = base.json("base/pose")

        def drives():
            base.send("PUT", "base/drive", 0.4).expect(204)
            return base.json("base/speed") > 0

        until(drives, "the base drives")
        until(lambda: base.json("base/drive") == 0, "the last command has lapsed")
        until(lambda: base.json("base/speed") == 0, "the base stands")
        assert base.json("base/pose") != start, start
        base.send("PUT", "base/drive", 5).expect(422)

        # The emergency stop, as `curl -d ''` sends it. What was under way fails, and what comes is refused at once.
        far = base.drive(40, 0).expect(204)
        http_request("POST", base.at("base/actions/emergencyStop"), "", {"Content-Type": "application/x-www-form-urlencoded"}).expect(204)
        assert base.json("base/stopped") is True
        until(lambda: base.invocation(far)["status"] == "failed", "the drive fails")
        assert "the robot was stopped" in json.dumps(base.invocation(far)), base.invocation(far)
        refused = base.drive(1, 1).expect(409)
        assert "ns#Stopped" in refused.body and "by somebody" in refused.body, refused
        base.send("PUT", "base/gains", {"p": 1, "i": 1, "d": 0}).expect(409)
        state = base.json("")["stopStates"][0]
        assert state["stopped"] and state["by"] == "somebody" and state["since"], state
        assert base.json("base/stopped-lrt") == {name: state[name] for name in ("stopped", "since", "by")}, state
        base.send("POST", "base/actions/release").expect(428)
        base.send("POST", "base/actions/release", Valid_Until=base.soon()).expect(204)
        assert base.json("base/stopped-lrt") == {"stopped": False}
        base.drive(base.json("base/pose")["x"] + 0.05, base.json("base/pose")["y"], Prefer="wait=30")

        # What cannot be meant is refused before the base sees it.
        for body in ({"x": 51, "y": 0}, {"x": "far", "y": 0}, {"x": 1}, {"x": 1, "y": 2, "z": 3}):
            base.send("POST", "base/actions/driveTo", body).expect(422)
    print("mobile base: read, tuned, driven, preempted, cancelled, stopped and released")


main()
