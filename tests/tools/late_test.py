# SPDX-License-Identifier: Apache-2.0
"""Commands through a link that freezes and thaws, by curl and by the command lrt; a robot that is started again meanwhile; a clock that is set.

usage: late_test.py LRT BAXTER

What passes is the robot's time, which is asked for: nothing is slept for.
"""

import os
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "conformance"))
from frozen_link import FrozenLink  # noqa: E402
from robot_process import PATIENCE, Program, Robot, Way, until  # noqa: E402

LRT = None
FAKETIME = "/usr/lib/x86_64-linux-gnu/faketime/libfaketime.so.1"


def stamp(robot):
    return robot.get("").field("Robot-Time")


def later(time, milliseconds):
    instance, number = time.split("/")
    return f"{instance}/{int(number) + milliseconds}"


def wait_for(robot, time):
    """Until the robot's clock has passed that."""
    until(lambda: int(stamp(robot).split("/")[1]) > int(time.split("/")[1]), f"the robot's time {time}")


def friction(robot):
    return robot.get("baxter/right_s1/friction", Accept="text/plain").expect(200).body


def curl(*words):
    return subprocess.Popen(["curl", "-s", "-m", str(PATIENCE), *words], stdout=subprocess.PIPE, text=True)


def put_by_curl(url, time, value):
    return curl("-X", "PUT", "-H", "Content-Type: application/json", "-H", f"Valid-Until: {time}", "-d", value, "-w", "%{http_code}", url + "baxter/right_s1/friction")


def lrt(url, *words):
    env = {k: v for k, v in os.environ.items() if not k.startswith("LRT_")}
    return subprocess.run([LRT, "--robot", url, *words], capture_output=True, text=True, timeout=60, env=env)


def by_curl():
    with Robot() as robot, FrozenLink(robot.port) as link:
        until_ = later(stamp(robot), 30_000)
        done, _ = put_by_curl(link.url, until_, "1.25").communicate(timeout=PATIENCE)
        assert done == "204" and friction(robot) == "1.25", done
        for directions in ((True, False), (True, True)):
            end = later(stamp(robot), 100)
            link.freeze(*directions)
            sent = put_by_curl(link.url, end, "7")
            wait_for(robot, end)
            link.thaw()
            done, _ = sent.communicate(timeout=PATIENCE)
            assert done.endswith("412") and "#LateCommand" in done, done
            assert friction(robot) == "1.25"


def by_command():
    with Robot() as robot, FrozenLink(robot.port) as link:
        assert lrt(link.url, "set", "right_s1/friction", "1.25").returncode == 0
        assert lrt(link.url, "--valid-for", "500ms", "set", "right_s1/friction", "1.5").returncode == 0
        link.freeze()
        began = stamp(robot)
        done = lrt(link.url, "--valid-for", "300ms", "set", link.url + "baxter/right_s1/friction", "7")
        assert done.returncode == 3 and done.stderr.count("\n") == 1, done
        wait_for(robot, later(began, 300))
        link.thaw()
        assert friction(robot) == "1.5"
        assert lrt(link.url, "set", "right_s1/friction", "1.75").returncode == 0
        assert friction(robot) == "1.75"
        # The answer alone is frozen: it was carried out, and the command says that it does not know.
        assert "between 0" not in lrt(link.url, "--help").stdout
        assert lrt(link.url, "--valid-for", "fast", "ls").returncode == 2


def restarted():
    with Robot() as before, Robot() as after, FrozenLink(before.port) as link:
        end = later(stamp(before), 3_600_000)
        link.freeze(True, False)
        link.target = after.port
        sent = put_by_curl(link.url, end, "7")
        link.thaw()
        done, _ = sent.communicate(timeout=PATIENCE)
        assert done.endswith("412"), done
        assert friction(after) != "7" and friction(before) != "7"


def with_another_clock():
    """The wall clock goes back and forth by an hour, and commands expire as before: only the monotonic clock counts."""
    if not os.path.exists(FAKETIME):
        print("skipped: the clock is not set, for there is no libfaketime (vendor/install.sh ci)")
        assert not os.environ.get("CI"), "CI has it"
        return
    with tempfile.TemporaryDirectory() as folder:
        clock = os.path.join(folder, "clock")

        def set_clock(text):
            with open(clock + ".new", "w", encoding="ascii") as file:
                file.write(text)
            os.replace(clock + ".new", clock)

        set_clock("+0")
        settings = [f"LD_PRELOAD={FAKETIME}", f"FAKETIME_TIMESTAMP_FILE={clock}", "FAKETIME_NO_CACHE=1", "FAKETIME_DONT_FAKE_MONOTONIC=1"]
        with Program("env", *settings, Robot.program, "--port", "0", *Way.arguments) as robot:
            def date():
                return robot.get("").field("Date")

            for number, by in enumerate(("+3600", "-3600", "+0")):
                end = later(stamp(robot), 100)
                old = date()
                set_clock(by)
                until(lambda: date()[:22] != old[:22], "another time of day")
                wait_for(robot, end)
                done, _ = put_by_curl(robot.url, end, "7").communicate(timeout=PATIENCE)
                assert done.endswith("412"), done
                done, _ = put_by_curl(robot.url, later(stamp(robot), 30_000), f"1.{number + 1}").communicate(timeout=PATIENCE)
                assert done == "204" and friction(robot) == f"1.{number + 1}", done


def main():
    global LRT
    LRT, Robot.program = sys.argv[1:3]
    if not shutil.which("curl"):
        print("skipped: there is no curl (vendor/install.sh tests)")
        sys.exit(77)
    for test in (by_curl, by_command, restarted, with_another_clock):
        test()
        print("ok", test.__name__)


if __name__ == "__main__":
    main()
