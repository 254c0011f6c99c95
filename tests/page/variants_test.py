# SPDX-License-Identifier: Apache-2.0
"""Values that are one of several alternatives on the page, in a real browser: the active one is shown, one is chosen, and exactly one is written.

   variants_test.py MOVER_ROBOT [FOLDER FOR SCREENSHOTS [CASE]...]
"""

import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "conformance"))

import webdriver  # noqa: E402
from robot_process import Program, http_request, until  # noqa: E402

CARD = "[...document.querySelectorAll('article')].find(a => a.querySelector('h2,h3')?.textContent === arguments[0])"

folder = MOVER = None


def value(robot, path):
    return json.loads(http_request("GET", robot.at(path), headers={"Accept": "application/json"}).body)


def write(robot, path, json_value):
    http_request("PUT", robot.at(path), json.dumps(json_value), {"Content-Type": "application/json"}).expect(204)


def card(browser, name, script, what, *arguments):
    return browser.until(f"const card = {CARD}; return card && (() => {{ {script} }})()", what, name, *arguments)


def shown_fields(browser, name):
    """The labels of what can be filled in now."""
    return card(browser, name, "const l = [...card.querySelectorAll('form label, form legend')].filter(e => e.getClientRects().length).map(e => e.innerText); return l.length && l", f"the form of {name}")


def choose(browser, name, tag, index=0):
    card(browser, name, "const s = card.querySelectorAll('.choice > .entry select')[arguments[2]], o = s && [...s.options].find(o => o.text === arguments[1]); if (!o) return false; "
         "s.value = o.value; s.dispatchEvent(new Event('input', { bubbles: true })); s.dispatchEvent(new Event('change', { bubbles: true })); return true", f"the alternative {tag}", tag, index)


def fill(browser, name, text, index):
    card(browser, name, "const i = [...card.querySelectorAll('input[type=text]')].filter(e => e.getClientRects().length)[arguments[1]]; if (!i) return false; "
         "i.focus(); i.value = arguments[2]; i.dispatchEvent(new Event('input', { bubbles: true })); return true", f"field {index} of {name}", index, text)


def press(browser, name, words):
    card(browser, name, "const b = [...card.querySelectorAll('button')].find(b => b.innerText.trim() === arguments[1] && !b.disabled); b?.click(); return !!b", f"the button {words}", words)


def set_value(browser, name):
    """Presses Set and waits for its answer: then the form has what the robot has."""
    press(browser, name, "Set")
    card(browser, name, "return card.querySelector('form [role=status]').innerText === 'Set' && !card.querySelector('form .primary').disabled", f"{name} is set")


def chosen(browser, name):
    return card(browser, name, "const s = card.querySelector('.choice > .entry select'); return s && s.selectedOptions[0].text", f"the choice of {name}")


def answer(browser, name):
    return card(browser, name, "return [...card.querySelectorAll('[role=status], [role=alert]')].map(e => e.innerText).join('')", f"the answer to {name}")


def shot(browser, name):
    if folder:
        browser.run("scrollTo(0, 0)")
        browser.screenshot(os.path.join(folder, name + ".png"))


def the_active_alternative_is_shown_and_exactly_one_is_written(browser):
    with Program(MOVER) as robot:
        browser.open(robot.at("mover"))
        card(browser, "target", "const t = card.querySelector('.value').innerText; return t.includes('x') && t.includes('1') && t.includes('2')", "the present value")
        card(browser, "target", "return card.querySelector('.choice select')?.selectedOptions[0].text === 'moveTo'", "the form has the active alternative")
        fields = shown_fields(browser, "target")
        assert "x [m]" in fields and not any("height" in f for f in fields if f != "moveTo"), fields
        shot(browser, "variants-moveTo")
        choose(browser, "target", "height")
        fields = shown_fields(browser, "target")
        assert any("height" in f for f in fields) and "x [m]" not in fields, fields
        fill(browser, "target", "1.25", 0)
        set_value(browser, "target")
        until(lambda: value(robot, "mover/target") == {"height": 1.25}, "one alternative is written, and no other")
        card(browser, "target", "const v = card.querySelector('.value').innerText; return v.includes('height') && v.includes('1.25') && !v.includes('move')", "the new alternative")
        shot(browser, "variants-height")
        choose(browser, "target", "hold")
        set_value(browser, "target")
        until(lambda: value(robot, "mover/target") == {"hold": {}}, "an alternative without content")
        card(browser, "target", "const v = card.querySelector('.value').innerText; return v.trim() === 'hold'", "it is shown by its name")
        shot(browser, "variants-hold")
        choose(browser, "target", "grip")
        card(browser, "target", "const s = [...card.querySelectorAll('.alternative select')].find(e => e.getClientRects().length); if (!s) return false; s.value = [...s.options].find(o => o.text === 'closed').value; "
             "s.dispatchEvent(new Event('input', { bubbles: true })); return true", "the names of the grip")
        set_value(browser, "target")
        until(lambda: value(robot, "mover/target") == {"grip": "closed"}, "an enumeration")
        # Another client's write is shown, in the form too.
        write(robot, "mover/target", {"moveTo": {"x": 3, "y": 4, "speed": 2}})
        card(browser, "target", "return card.querySelector('.value').innerText.includes('3')", "what another client has written")
        card(browser, "target", "if (document.activeElement.closest('form')) document.activeElement.blur(); return card.querySelector('.choice select').selectedOptions[0].text === 'moveTo'", "and the form follows")


def what_is_wrong_is_said_at_its_field(browser):
    with Program(MOVER) as robot:
        write(robot, "mover/target", {"hold": {}})
        browser.open(robot.at("mover/target"))
        card(browser, "Value", "return card.querySelector('.choice select')?.selectedOptions[0].text === 'hold'", "the form")
        choose(browser, "Value", "moveTo")
        fill(browser, "Value", "1", 0)
        fill(browser, "Value", "99", 1)
        press(browser, "Value", "Set")
        card(browser, "Value", "const e = [...card.querySelectorAll('[aria-invalid]')]; return e.length === 1 && e[0].value === '99' && e[0].getClientRects().length > 0", "the field with the wrong number")
        assert "422" in answer(browser, "Value")
        shot(browser, "variants-refused")
        choose(browser, "Value", "choose …")
        press(browser, "Value", "Set")
        card(browser, "Value", "const e = card.querySelector('.choice > .entry .error').innerText; return e.includes('moveTo') && e.includes('hold')", "that one has to be chosen, and which there are")
        assert value(robot, "mover/target") == {"hold": {}}
        browser.run("document.querySelector('details.curl summary').click()")
        choose(browser, "Value", "hold")
        browser.until("return document.querySelector('details.curl').innerText.includes(arguments[0])", "the line for curl", "-d '{\"hold\":{}}'")
        browser.messages()


def variants_within_lists_records_and_inputs(browser):
    with Program(MOVER) as robot:
        browser.open(robot.at("mover"))
        card(browser, "job", "return card.querySelector('.choice select')?.selectedOptions[0].text === 'moveTo'", "the form of the record")
        choose(browser, "job", "hold")
        set_value(browser, "job")
        until(lambda: value(robot, "mover/job") == {"name": "first", "target": {"hold": {}}}, "a field of a record")
        press(browser, "plan", "Add a row")
        choose(browser, "plan", "height")
        fill(browser, "plan", "0.5", 0)
        press(browser, "plan", "Add a row")
        choose(browser, "plan", "hold", 1)
        set_value(browser, "plan")
        until(lambda: value(robot, "mover/plan") == [{"height": 0.5}, {"hold": {}}], "members of a list")
        assert chosen(browser, "next") == "none"
        choose(browser, "next", "hold")
        set_value(browser, "next")
        until(lambda: value(robot, "mover/next") == {"hold": {}}, "one that may be absent")
        choose(browser, "next", "none")
        set_value(browser, "next")
        until(lambda: value(robot, "mover/next") is None, "and is absent again")
        choose(browser, "go", "moveTo")
        fill(browser, "go", "2", 0)
        fill(browser, "go", "0", 1)
        press(browser, "go", "go")
        card(browser, "go", "return card.querySelector('.status')?.innerText === 'succeeded' && card.querySelector('.io')?.parentElement.innerText.includes('2')", "the action has run")
        shot(browser, "variants-thing")
        for width, height in ((390, 844), (320, 568)):
            browser.size(width, height, phone=True)
            browser.open(robot.at("mover"))
            card(browser, "target", "return !!card.querySelector('.choice select')", "the form on a phone")
            assert browser.run("return document.documentElement.scrollWidth <= innerWidth"), width
        browser.size(1280, 900)
        blueprint = [b for b in (http_request("GET", robot.at("mover"), headers={"Accept": "application/n-triples"}).body.split()) if "/blueprints/" in b][0].strip("<>")
        browser.open(blueprint)
        browser.until("return document.querySelector('table')?.innerText.includes('one of: ')", "the alternatives of a Blueprint")


CASES = [the_active_alternative_is_shown_and_exactly_one_is_written, what_is_wrong_is_said_at_its_field, variants_within_lists_records_and_inputs]


def main():
    global folder, MOVER
    MOVER = sys.argv[1]
    folder = sys.argv[2] if len(sys.argv) > 2 else None
    return webdriver.run_cases(CASES, folder, sys.argv[3:])


if __name__ == "__main__":
    sys.exit(main())
