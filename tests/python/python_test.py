# SPDX-License-Identifier: Apache-2.0
"""tools/python/lrt.py with examples/baxter, examples/ex_mobile_base and a robot whose values are one of several alternatives.

    python_test.py BAXTER MOBILE_BASE MOVER_ROBOT [NAME...]
"""

import asyncio
import contextlib
import os
import re
import subprocess
import sys
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "..", "tools", "python"), os.path.join(HERE, "..", "conformance")]

import lrt  # noqa: E402
from frozen_link import FrozenLink  # noqa: E402

PATIENCE = 30  # [s] for what has to come
CASES = []


def case(function):
    CASES.append(function)
    return function


@contextlib.contextmanager
def program(*arguments):
    process = subprocess.Popen([*arguments, "--port", "0"], stdout=subprocess.PIPE, text=True)
    try:
        yield re.search(r"http://\S+/", process.stdout.readline()).group()
    finally:
        process.terminate()
        process.wait(PATIENCE)


def baxter():
    return program(sys.argv[1])


def mobile_base():
    return program(sys.argv[2])


def port(url):
    return int(re.search(r":(\d+)/", url)[1])


def until(condition):
    """Waits for what a robot does in a moment."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it does not come"
        time.sleep(0.01)


def raised(error, call, *words):
    """The error that a call raises, whose text has all these words."""
    try:
        result = call()
    except error as found:
        for word in words:
            assert word in str(found), "expected %r in %r" % (word, str(found))
        return found
    raise AssertionError("expected %s, got %r" % (error.__name__, result))


@case
def thirty_lines_drive_baxter():
    example = os.path.join(HERE, "drive_baxter.py")
    with baxter() as url, open(example, encoding="utf-8") as file:
        assert len(file.readlines()) <= 30
        path = {**os.environ, "PYTHONPATH": os.path.dirname(lrt.__file__)}
        done = subprocess.run([sys.executable, "-B", example, url], env=path, capture_output=True, text=True, timeout=2 * PATIENCE)
        assert done.returncode == 0, done.stderr
        for expected in ("joints: baxter/right_s0 baxter/right_s1", "at 10.0 deg", "at 20.0 deg", "at 0.0 deg", "beyond 5 deg at 2", "at most 59.98"):
            assert expected in done.stdout, done.stdout


@case
def the_example_of_the_documentation_runs():
    with baxter() as url, open(os.path.join(HERE, "..", "..", "docs", "clients.md"), encoding="utf-8") as file:
        text = re.search(r"## In Python\n.*?```python\n(.*?)```", file.read(), re.S)[1]
        exec(text.replace("http://127.0.0.1:8080/", url), {})


@case
def names_are_those_that_people_write():
    with baxter() as url:
        robot = lrt.open(url)
        joint = robot["right_s1"]
        assert joint.name == "baxter/right_s1" and joint.name in robot.names()
        assert robot["baxter/right_s1"].url == robot[joint.url].url == robot["/baxter/right_s1/"].url == joint.url
        assert robot["Baxter's right arm"].name == "baxter"
        assert joint.read("Friction") == joint.read("friction")
        raised(lrt.NotFound, lambda: robot["right_s9"], "no Thing right_s9", "is it baxter/right_s1")
        raised(lrt.NotFound, lambda: joint.read("frictoin"), "no Property frictoin", "is it friction?")
        raised(lrt.NotFound, lambda: joint.invoke("fly"), "it has rotate")
        raised(KeyError, lambda: robot["nobody"])


@case
def values_have_the_unit_that_is_asked_for():
    with baxter() as url:
        joint = lrt.open(url)["right_s1"]
        joint.invoke("rotate", 10 / 360, "turn").wait(PATIENCE)
        assert abs(joint.read("position") - 0.17453292519943295) < 1e-6
        assert abs(joint.read("position", "°") - 10) < 1e-4
        joint.write("position", 20, "deg")
        until(lambda: abs(joint.read("position", "turn") - 20 / 360) < 1e-6)  # its loop moves it there
        assert joint.read("limits")["lower"] == -2.147 and joint.read()["friction"] == joint.read("friction")
        raised(lrt.Error, lambda: joint.read("position", "kg"), "is in rad", "cannot be in kg", "deg")
        raised(lrt.Error, lambda: joint.read("limits", "deg"), "no number with a unit")
        raised(lrt.Error, lambda: joint.write("velocity", 1), "cannot be written")
        assert lrt._factor({"type": "number", "unit": "K"}, "°F")[0] * 212 + lrt._factor({"type": "number", "unit": "K"}, "°F")[1] - 373.15 < 1e-9


@case
def errors_carry_the_report():
    with baxter() as url:
        joint = lrt.open(url)["right_s1"]
        error = raised(lrt.Refused, lambda: joint.write("friction", "x"), 'expected a number, found "x"')
        assert error.status == 422 and error.report["errors"][0]["constraint"] == "sh:DatatypeConstraintComponent"
        tag = joint.tag("friction")
        joint.write("friction", 0.5, if_match=tag)
        assert raised(lrt.Refused, lambda: joint.write("friction", 0.6, if_match=tag)).status == 412
        assert joint.read("friction") == 0.5
        raised(ValueError, lambda: joint.write("friction", float("nan")))
    raised(lrt.NotReached, lambda: lrt.open(url), "refused")
    raised(lrt.Error, lambda: lrt.open("ftp://robot/"), "expected the URL of a robot")


@case
def a_run_is_waited_for_watched_and_cancelled():
    with mobile_base() as url:
        robot = lrt.open(url)
        base = robot["base"]
        run = base.invoke("driveTo", {"x": 0.1, "y": 0})
        statuses = [status["status"] for status in run.changes()]
        assert statuses[-1] == "succeeded", statuses
        assert run.wait(PATIENCE) is None and abs(base.read("pose")["x"] - 0.1) < 0.01
        run = base.invoke("driveTo", {"x": 50, "y": 0})
        raised(TimeoutError, lambda: run.wait(0.05), "has not ended")
        run.cancel()
        assert raised(lrt.Failed, lambda: run.wait(PATIENCE)).status["status"] == "cancelled"
        run.cancel()  # it has ended: nothing happens
        try:
            with base.invoke("driveTo", {"x": 50, "y": 0}) as run:
                raise RuntimeError("the program fails")
        except RuntimeError:
            raised(lrt.Failed, lambda: run.wait(PATIENCE))


@case
def a_lost_connection_is_a_gap_with_its_number():
    with baxter() as url, FrozenLink(port(url)) as link:
        direct, joint = lrt.open(url)["right_s1"], lrt.open(link.url)["right_s1"]
        witness, changes = direct.watch("friction", queue=10), joint.watch("friction", queue=10)
        first = [next(witness), next(changes)][1]
        direct.write("friction", 1)
        second = [next(witness), next(changes)][1]
        assert (second.value, second.sequence, second.left_out) == (1, first.sequence + 1, 0) and second.time, second
        link.freeze()
        for value in (2, 3, 4):
            direct.write("friction", value)
            assert next(witness).value == value
        link.cut()
        link.thaw()
        gap, last = next(changes), next(changes)
        assert isinstance(gap, lrt.Gap) and gap.left_out == 2 and gap.reason, gap
        assert last.value == 4 and last.sequence == second.sequence + 3, last
        changes.close()
        once = joint.watch("friction", reconnect=False)
        next(once)
        link.cut()
        raised(lrt.NotReached, lambda: next(once), "ended the stream")


@case
def values_are_watched_in_asyncio_too():
    async def follow(joint):
        found = []
        async for change in joint.watch_async("position", "deg"):
            found.append(change)
            if change.value > 9.9:
                return found

    with baxter() as url:
        robot = lrt.open(url)
        joint = robot["right_s1"]
        joint.invoke("rotate", 10)
        found = asyncio.run(asyncio.wait_for(follow(joint), PATIENCE))
        assert found and [f.sequence for f in found] == sorted(f.sequence for f in found)

        async def wrong():
            async for _ in joint.watch_async("position", "kg"):
                pass

        raised(lrt.Error, lambda: asyncio.run(wrong()), "cannot be in kg")


@case
def a_command_without_an_answer_is_unconfirmed_and_sent_once():
    with baxter() as url, FrozenLink(port(url)) as link:
        direct, robot = lrt.open(url)["right_s1"], lrt.open(link.url, valid_for=0.3)
        joint = robot["right_s1"]
        direct.write("friction", 1)
        link.freeze(to_robot=False)  # the command arrives, its answer does not
        before = link.connections
        raised(lrt.Unconfirmed, lambda: joint.write("friction", 2), "no answer within 0.3 s")
        assert link.connections == before + 1
        link.thaw()
        assert direct.read("friction") == 2


@case
def a_command_is_not_carried_out_after_its_time_and_a_stop_is():
    with baxter() as url, FrozenLink(port(url)) as link:
        direct, robot = lrt.open(url), lrt.open(link.url, valid_for=0.3)
        shoulder, joint = direct["right_s1"], robot["right_s1"]
        shoulder.write("friction", 1)
        link.freeze(to_client=False)
        raised(lrt.Unconfirmed, lambda: joint.write("friction", 2), "no answer within 0.3 s")
        answered = link.answered
        link.thaw()
        until(lambda: link.answered > answered)  # 412, which nobody reads
        assert shoulder.read("friction") == 1
        passed = {"Valid-Until": direct._http.clock.after(0)}  # over when the robot reads it
        raised(lrt.Late, lambda: direct._command("PUT", shoulder.url + "/friction", 2, expires=False, fields=passed), "412")

        robot.timeout = 0.3
        link.freeze(to_client=False)
        raised(lrt.Unconfirmed, robot.stop)
        assert not direct.stopped()[0]["stopped"]
        link.thaw()
        until(lambda: direct.stopped()[0]["stopped"])
        raised(lrt.Stopped, lambda: shoulder.invoke("rotate", 1), "is stopped since", "somebody")
        direct["baxter"].invoke("release")
        until(lambda: not direct.stopped()[0]["stopped"])
        assert shoulder.invoke("rotate", 1).wait(PATIENCE) is None
        assert direct.stop()[0].url and direct.stopped()[0]["by"] == "somebody"


@case
def what_a_robot_is_is_the_same_with_and_without_its_structure_document():
    def known(things):
        names = lambda table: {name: (each["href"], each.get("methods", [])[-1:]) for name, each in table.items()}  # noqa: E731
        return {t["href"]: (t["title"], t["state"]["href"], names(t["properties"]).keys(), names(t["actions"]).keys()) for t in things}

    with baxter() as url:
        robot = lrt.open(url)
        short = robot._structure()
        assert len(short) == 17
        until(lambda: known(short) == known(robot._crawl()))  # a Thing has no action until the robot has said that it is not stopped
        long = robot._crawl()
        for one, other in zip(sorted(short, key=lambda t: t["href"]), sorted(long, key=lambda t: t["href"])):
            for name, each in one["properties"].items():
                same = other["properties"][name]
                assert each["href"] == same["href"] and ("PUT" in each["methods"]) == ("PUT" in same["methods"]), (each, same)
                assert each["schema"].get("unit") == same["schema"].get("unit")
            for name, each in one["actions"].items():
                assert each["href"] == other["actions"][name]["href"] and each.get("stop") == other["actions"][name].get("stop")


@case
def one_robot_serves_many_threads():
    with baxter() as url:
        joint, wrong = lrt.open(url)["right_s1"], []

        def use():
            try:
                for _ in range(20):
                    assert joint.read("friction") > 0
                    joint.write("friction", 0.5)
            except Exception as error:  # it is reported by the main thread
                wrong.append(error)

        threads = [threading.Thread(target=use) for _ in range(8)]
        for each in threads:
            each.start()
        for each in threads:
            each.join(PATIENCE)
        assert not wrong, wrong


@case
def a_value_is_one_of_several_alternatives():
    with program(sys.argv[3]) as url:
        mover = lrt.open(url)["mover"]
        assert mover.read("target") == {"moveTo": {"x": 1, "y": 2}}
        for value in ({"grip": "closed"}, {"height": 0.5}, {"hold": {}}, {"moveTo": {"x": 0, "y": 1, "speed": 2}}):
            mover.write("target", value)
            assert mover.read("target") == value
        changes = mover.watch("target", queue=10)
        assert next(changes).value == {"moveTo": {"x": 0, "y": 1, "speed": 2}}
        mover.write("target", {"hold": {}})
        assert next(changes).value == {"hold": {}}
        for wrong, names in (({"grip": "open", "hold": {}}, ("grip", "hold")), ({}, ("moveTo", "height")), ({"grab": "open"}, ("grab",))):
            refused = raised(lrt.Refused, lambda: mover.write("target", wrong), "")
            assert refused.status == 422 and all(name in str(refused) for name in names), refused
        assert mover.invoke("go", {"moveTo": {"x": 2, "y": 0}}).wait(PATIENCE) == {"number": 2}
        assert mover.invoke("go", {"hold": {}}).wait(PATIENCE) == {"text": "done"}
        mover.write("plan", [{"hold": {}}, {"height": 1}])
        assert [list(each) for each in mover.read("plan")] == [["hold"], ["height"]]


@case
def nothing_is_sent_to_another_host():
    with baxter() as url:
        robot = lrt.open(url, token="secret")
        raised(lrt.Error, lambda: robot._get("http://127.0.0.1:1/x"), "is not at http://127.0.0.1")


def main():
    chosen = [each for each in CASES if not sys.argv[4:] or each.__name__ in sys.argv[4:]]
    for each in chosen:
        begin = time.monotonic()
        each()
        print("%5.1f s  %s" % (time.monotonic() - begin, each.__name__.replace("_", " ")), flush=True)
    print("%d cases" % len(chosen))


if __name__ == "__main__":
    main()
