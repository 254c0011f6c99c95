# SPDX-License-Identifier: Apache-2.0
"""What the page says of stops, late commands, dead links and control, in real browsers.

   state_test.py BAXTER PAGE_ROBOT [FOLDER FOR SCREENSHOTS [CASE]...]
"""

import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "conformance"))

import webdriver  # noqa: E402
from frozen_link import FrozenLink  # noqa: E402
from robot_process import Robot, http_request, until  # noqa: E402
from webdriver import Browser  # noqa: E402

JSON = {"Accept": "application/json"}
ESCAPE = "\ue00c"
FRICTION = "baxter/right_s1/friction"

folder = None


class Sample(Robot):
    """page_robot on a port of its own."""

    def __init__(self):
        Robot.program, baxter = Sample.binary, Robot.program
        try:
            super().__init__()
        finally:
            Robot.program = baxter


def value(robot, path):
    return json.loads(http_request("GET", robot.at(path), None, JSON).expect(200).body)


def stop_of(robot):
    return value(robot, "")["stopStates"][0]


def valid_until(robot, ms=5000):
    run, now = http_request("GET", robot.url, None, JSON).field("Robot-Time").split("/")
    return {"Valid-Until": f"{run}/{int(now) + ms}"}


def release(robot):
    http_request("POST", stop_of(robot)["release"], None, valid_until(robot))
    until(lambda: not stop_of(robot)["stopped"], "it is released")


def shot(browser, name):
    if folder:
        browser.run("scrollTo(0, 0)")
        browser.screenshot(os.path.join(folder, name + ".png"))


def live(browser):
    browser.until("return document.getElementById('link').textContent === 'Live'", "the page is live")


def loaded(browser, address):
    """Opens the page of a property, and waits until it has nothing more to ask for: a browser has six connections to one host, which a frozen link fills."""
    browser.open(address)
    live(browser)
    browser.until("return document.querySelector('form input[type=text]')?.value && document.querySelector('#tree [aria-current]') && document.querySelector('#stops button')", "the page")
    browser.until("const now = performance.getEntriesByType('resource').length; if (window.before !== now) { window.before = now; window.since = performance.now(); } return performance.now() - since > 500", "no further request")


def held(browser, words="Stopped since", shown=True):
    return browser.until("const held = document.getElementById('stop-notice'); return held.hidden !== arguments[1] && (!arguments[1] || held.innerText.includes(arguments[0])) && (held.innerText || true)", f"{words}: {shown}", words, shown)


def submit(browser, text, path=FRICTION):
    """Writes a property by its form."""
    browser.until("return document.querySelector('form input[type=text]')", "the form")
    browser.type("form input[type=text]", text)
    browser.run("document.querySelector('form button.primary').click()")


def hold(browser, selector, long_enough):
    """Presses a button with the mouse, until `long_enough` says so."""
    origin = browser.find(selector)
    browser.run("arguments[0].scrollIntoView({block: 'center'})", origin)
    pointer = {"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}}
    browser.send("POST", "/actions", {"actions": [{**pointer, "actions": [{"type": "pointerMove", "origin": origin, "x": 0, "y": 0}, {"type": "pointerDown", "button": 0}]}]})
    long_enough()
    browser.send("DELETE", "/actions")


# ---- what must hold


def a_stop_is_seen_everywhere_and_ends_by_a_held_release(browser):
    with Robot("--demo") as robot, Browser() as second:
        for reader, path in ((browser, "baxter"), (second, "nowhere")):
            reader.open(robot.at(path))
            reader.until("return document.querySelector('#stops button')", f"the stop at {path}")
            live(reader)
            held(reader, shown=False)
        assert "404 Not Found" in second.text("main")
        browser.click("#stops button")
        for reader in (browser, second):
            told = held(reader)
            assert "by somebody" in told, told
        shot(second, "stopped-404-1280")
        for path in ("baxter/right_s1", FRICTION, "ns/lrt", "nowhere", "baxter/actions/release", "baxter/subscriptions"):
            second.open(robot.at(path))
            assert "by somebody" in held(second), path
        # What moves says why it cannot be commanded.
        browser.open(robot.at("baxter/right_s1"))
        reason = browser.until("return [...document.querySelectorAll('.reason')].filter(r => !r.hidden).map(r => r.innerText)[0]", "the reason")
        assert "stopped" in reason.lower(), reason
        enabled = browser.run("return [...document.querySelectorAll('main article')].map(a => [a.querySelector('h3')?.innerText, a.querySelector('button.primary')?.disabled]).filter(([, d]) => d === false)")
        assert enabled in ([], [["Friction", False]]), enabled  # it is harmless
        shot(browser, "stopped-thing-1280")
        browser.size(390, 844, phone=True)
        shot(browser, "stopped-thing-390")
        assert browser.run("return document.documentElement.scrollWidth <= innerWidth")
        browser.size(1280, 900)
        # A release asks for a second, deliberate gesture, and is nowhere near the stop.
        assert "release" not in [b.lower() for b in browser.run("return [...document.querySelectorAll('header button')].map(b => b.innerText)")]
        browser.open(robot.at("baxter/actions/release"))
        browser.click("form button.primary")
        browser.find(".guard .hold")
        shot(browser, "release-1280")
        browser.click(".guard .hold")  # a click is no hold
        assert stop_of(robot)["stopped"], "a click released it"
        hold(browser, ".guard .hold", lambda: until(lambda: not stop_of(robot)["stopped"], "it is released"))
        for reader in (browser, second):
            held(reader, shown=False)
        usable = "return document.querySelector('form button.primary')?.disabled === arguments[0]"
        browser.open(robot.at("baxter/right_s1/position"))
        browser.until(usable, "it can be written again", False)
        second.keys(ESCAPE)
        held(browser)
        browser.until(usable, "and not while it is stopped", True)
        release(robot)  # by curl, so to say
        for reader in (browser, second):
            held(reader, shown=False)
        browser.until(usable, "and again", False)


def a_command_on_a_frozen_link_is_told_and_never_carried_out_late(browser):
    browser.gives_again = False
    with Robot() as robot, FrozenLink(robot.port) as link:
        before = value(robot, FRICTION)
        for to_robot, to_browser in ((True, False), (True, True)):
            loaded(browser, link.url + FRICTION)
            link.freeze(to_robot, to_browser)
            submit(browser, "1.5")
            browser.until("return document.querySelector('[role=alert].answer').innerText.startsWith('Not confirmed')", "its sender is told")
            shot(browser, "not-confirmed-1280")
            link.thaw()
            browser.until("return document.querySelector('[role=alert].answer').innerText.startsWith('Too late')", "that it came too late")
            assert value(robot, FRICTION) == before
        shot(browser, "too-late-1280")
        # The response freezes: the command is carried out, once, and its sender is told that it is not confirmed.
        loaded(browser, link.url + FRICTION)
        link.freeze(to_robot=False)
        submit(browser, "2.5")
        until(lambda: value(robot, FRICTION) == 2.5, "it is carried out")
        http_request("PUT", robot.at(FRICTION), b"0.5", {"Content-Type": "application/json"}).expect(204)
        browser.until("return document.querySelector('[role=alert].answer').innerText.startsWith('Not confirmed')", "its sender is told")
        link.thaw()
        browser.until("return document.querySelector('form [role=status]').innerText === 'Set'", "the confirmation")
        assert value(robot, FRICTION) == 0.5, "it was sent again"
        # A stop is carried out when it arrives.
        link.freeze()
        browser.keys(ESCAPE)
        browser.until("return document.getElementById('stopped').innerText.startsWith('Stopping')", "the stop is on its way")
        assert not stop_of(robot)["stopped"]
        link.thaw()
        until(lambda: stop_of(robot)["stopped"], "the stop has come")
        held(browser)


def a_dead_link_is_not_live_and_plots_have_a_gap(browser):
    with Robot("--demo") as robot, FrozenLink(robot.port) as link:
        browser.open(link.url + "baxter/right_s1/rotation")
        live(browser)
        browser.until("return [...document.querySelectorAll('.plot')].some(p => !p.hidden)", "a plot")
        assert browser.run("return document.querySelector('.plot canvas').dataset.gaps") == "0"
        link.freeze(to_robot=False)
        browser.until("return /^No word for \\d+ s$/.test(document.getElementById('link').textContent) && document.body.classList.contains('lost')", "it says that it hears nothing")
        shot(browser, "no-word-1280")
        link.thaw()
        live(browser)
        browser.until("return Number(document.querySelector('.plot canvas').dataset.gaps) >= 1", "a gap where nothing was heard")
        shot(browser, "gap-1280")
        # A value that does not change is live, because the robot says so each second.
        browser.open(link.url + FRICTION)
        live(browser)
        began = browser.run("return performance.now()")
        browser.until("return performance.now() > arguments[0] + 4500", "4.5 s", began)
        assert browser.text("#link") == "Live"


def a_restarted_robot_takes_no_command_of_before(browser):
    browser.gives_again = False
    robot = Robot()
    browser.open(robot.at(FRICTION))
    live(browser)
    old = valid_until(robot)
    robot.kill()
    with Robot(port=robot.port) as again:
        assert http_request("PUT", again.at(FRICTION), b"1.5", {"Content-Type": "application/json", **old}).status == 412
        live(browser)
        submit(browser, "1.25")  # the page has learnt the new time
        until(lambda: value(again, FRICTION) == 1.25, "a command of now")
    robot.process.stdout.close()


def who_has_control_is_seen_and_commands_of_others_are_refused(browser):
    with Sample() as robot, Browser() as second:
        if "control" not in value(robot, "door"):
            print("  skipped: no Thing of this robot can be controlled by one client at a time")
            return
        for reader in (browser, second):
            reader.open(robot.at("door/actions/shut"))
            reader.until("return document.querySelector('.control')?.innerText.includes('Nobody has control of Door')", "nobody has control")
        press = "const b = [...document.querySelectorAll('main button')].find(b => b.innerText === arguments[0] && !b.hidden && !b.disabled); b?.click(); return !!b"
        browser.until(press, "the button", "Take control")
        browser.until("return document.querySelector('.control.mine')", "it is the first one's")
        second.until("return document.querySelector('.control').innerText.includes('Another client has control of Door')", "the second one sees it")
        shot(second, "control-1280")
        second.until(press, "a command", "shut")
        second.until("return document.querySelector('form [role=alert]').innerText.includes('has control')", "why it is refused")
        browser.until(press, "a command", "shut")
        browser.until("return document.querySelector('.status')?.innerText === 'succeeded'", "the command of the one who has control")
        browser.run("location.reload()")
        browser.until("return document.querySelector('.control.mine')", "still, after a reload")
        browser.until(press, "the button", "Give back")
        second.until("return document.querySelector('.control').innerText.includes('Nobody has control')", "it is given back")


CASES = [who_has_control_is_seen_and_commands_of_others_are_refused, a_stop_is_seen_everywhere_and_ends_by_a_held_release, a_command_on_a_frozen_link_is_told_and_never_carried_out_late, a_dead_link_is_not_live_and_plots_have_a_gap,
         a_restarted_robot_takes_no_command_of_before]


def main():
    global folder
    Robot.program, Sample.binary = sys.argv[1:3]
    folder = sys.argv[3] if len(sys.argv) > 3 else None
    return webdriver.run_cases(CASES, folder, sys.argv[4:])


if __name__ == "__main__":
    sys.exit(main())
