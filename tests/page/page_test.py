# SPDX-License-Identifier: Apache-2.0
"""The page for people in a real browser: Chromium without a window, driven by WebDriver.

   page_test.py BAXTER PAGE_ROBOT [FOLDER FOR SCREENSHOTS]
"""

import json
import math
import os
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "conformance"))

import webdriver  # noqa: E402
from robot_process import Robot, http_request, objects, plain, until  # noqa: E402
from webdriver import Browser  # noqa: E402

VALUE = "http://vocab.arvida.de/2015/06/vom/vocab#numericalValue"
LATEST = "<https://w3id.org/lrt/ns#latest>"
CARD = "[...document.querySelectorAll('article')].find(a => [...a.querySelectorAll('h2,h3,.said .name')].some(e => e.textContent === arguments[0]))"
TAB, ENTER, RIGHT, ESCAPE = "\ue004", "\ue007", "\ue014", "\ue00c"

folder = None


def blueprints(robot, thing):
    """The paths of the Blueprints of a Thing: that of its kind, and the one of its bounds, whose IRI is longer."""
    text = http_request("GET", robot.at(thing), headers={"Accept": "application/n-triples"}).body
    found = [plain(o) for o in objects(text, "https://hybr-it-projekt.de/ns/hybr-it#blueprint", robot.at(thing))]
    return [iri.removeprefix(robot.at("")) for iri in sorted(found, key=len)]


class Sample(Robot):
    """page_robot on a port of its own."""

    def __init__(self, *arguments, port=0):
        Robot.program, baxter = Sample.binary, Robot.program
        try:
            super().__init__(*arguments, port=port)
        finally:
            Robot.program = baxter


def card(browser, name, script, what, *arguments):
    """What a script says of the card with that heading, as `card`, once it says something."""
    try:
        return browser.until(f"const card = {CARD}; card?.scrollIntoView({{block: 'nearest'}}); return card && (() => {{ {script} }})()", what, name, *arguments)
    except AssertionError as error:
        looks = browser.run(f"const card = {CARD}; return card && [card.innerText, ...[...card.querySelectorAll('input')].map((i) => `${{i.type}} ${{i.value}}`)].join('; ')", name)
        raise AssertionError(f"{error}; the card {name}: {looks}") from None


def fill(browser, name, text, index=0):
    """Types into the nth text field of a card, as a person would."""
    field = f"card.querySelectorAll('input[type=text]')[{index}]"
    card(browser, name, f"const i = {field}; if (i) {{ i.focus(); i.select(); }} return !!i", f"a field of {name}")
    browser.keys(text)
    card(browser, name, f"return {field}.value === {json.dumps(text)}", f"{text} is in a field of {name}")


def press(browser, name, words):
    card(browser, name, f"const b = [...card.querySelectorAll('button')].find(b => b.innerText.trim() === {json.dumps(words)} && !b.disabled && b.getClientRects().length); b?.click(); return !!b", f"the button {words} of {name}")


def live(browser):
    browser.until("return document.getElementById('link').textContent === 'Live'", "the page is live")


def shot(browser, name):
    if folder:
        browser.run("scrollTo(0, 0)")
        browser.screenshot(os.path.join(folder, name + ".png"))


def check_clean(browser, robot, provoked=()):
    """No complaint of the browser but about answers that were provoked, and no request to anybody else."""
    for m in browser.messages():
        told = m["message"]
        if m["source"] == "network" and any(p in told for p in provoked):
            continue
        if "Page entered Back-Forward Cache" in told:  # before a socket that was being closed had said good-bye
            continue
        assert m["level"] not in ("SEVERE", "WARNING"), told
    names = browser.run("return performance.getEntriesByType('resource').map(e => e.name)")
    foreign = [n for n in names if not n.startswith((robot.url, robot.ws(""), "data:"))]
    assert not foreign, foreign


def number(robot, path):
    return float(plain(objects(robot.n_triples(path), VALUE)[0]))


def subscriptions(robot, thing):
    """What the robot says of each; nothing of those that are gone before they are asked."""
    answers = [http_request("GET", member, None, {"Accept": "application/n-triples"}) for member in robot.members(thing)]
    return [a.body for a in answers if a.status == 200]


# ---- what must hold


def shows_the_tree_and_live_values(browser):
    with Robot("--demo") as robot:
        browser.open(robot.url)
        browser.until("return document.querySelectorAll('#tree a').length === 17", "17 things in the tree")
        assert "right_w2" in browser.text("#tree")
        live(browser)
        now = "return card.querySelector('.row .number')?.innerText"
        first = card(browser, "right_s0", now, "a value")
        browser.until(f"return {CARD}.querySelector('.row .number').innerText !== arguments[1]", "the value changes", "right_s0", first)
        sockets = "return performance.getEntriesByType('resource').length"
        assert browser.run(sockets) < 80
        open_sockets = sum(len(robot.members(thing)) for thing in ("baxter", *(f"baxter/right_{j}" for j in ("s0", "s1", "e0", "e1", "w0", "w1", "w2"))))
        assert 1 <= open_sockets <= 6, open_sockets
        browser.click("#tree li li:nth-child(2) a")
        browser.until("return location.pathname === '/baxter/right_s1' && document.querySelector('h1').textContent === 'right_s1'", "a real address")
        card(browser, "rotation", "return !card.querySelector('.plot').hidden && /now|s ago/.test(card.querySelector('.age').innerText)", "a plot and an age")
        assert browser.run("return document.querySelector('#tree [aria-current]').textContent") == "right_s1"
        assert browser.run("return document.activeElement.tagName") == "H1"
        browser.run("history.back()")
        browser.until("return document.querySelector('h1').textContent === 'Robotic Things'", "back again")
        until(lambda: not robot.members("baxter/right_w2"), "what is out of sight is let go")
        until(lambda: robot.members("baxter/right_s0"), "what is in sight is watched")
        browser.open(robot.at("baxter/right_wrist"))  # a page anew, which the browser may keep the old one beside
        until(lambda: not robot.members("baxter/right_s0"), "a page that was left is let go")
        browser.run("history.back()")
        until(lambda: robot.members("baxter/right_s0"), "and watches again on the way back")
        live(browser)
        check_clean(browser, robot)


def every_address_shows_its_resource(browser):
    with Robot() as robot:
        made = robot.rotate("right_s1", 10).expect(204).field("Location")
        robot.call_back("baxter/right_s1", "http://127.0.0.1:9/").expect(201)
        member = robot.members("baxter/right_s1")[0]
        kind, bounds = blueprints(robot, "baxter/right_s1")
        for path, title, inside, element in (
                ("baxter/right_s1/rotation", "Rotation", "rotation angle", ".property.large"), ("baxter/right_s1/actions/rotate", "Rotate", "-123.01 to 59.98", ".action form"),
                (kind, "Blueprint of RevoluteJoint", "rotation angle", "table"), (bounds, "Blueprint of RevoluteJoint", "-123.01 to 59.98", "table"), ("baxter/right_s1/state", "right_s1", "friction", ".property"),
                ("baxter/right_s1/subscriptions", "Subscriptions of right_s1", "http://127.0.0.1:9/", "td button"), (member, "Subscription", "127.0.0.1:9", "td button"),
                (made, "Invocation of rotate", "input", ".status"), ("baxter", "Baxter's right arm", "right_s1", ".thing"), ("ns/lrt", "Terms of Linked Robotic Things", "progress", ".facts")):
            browser.open(path if path.startswith("http") else robot.at(path))
            browser.until("return document.querySelector('h1')?.textContent === arguments[0]", f"the title of {path}", title)
            browser.until("return document.querySelector('main').innerText.includes(arguments[0])", f"{inside} on {path}", inside)
            browser.find("main " + element)
            check_clean(browser, robot)
        browser.open(robot.at("nowhere"))
        assert "404 Not Found" in browser.text() and "there is no resource at" in browser.text()
        browser.click("main a")
        browser.until("return document.querySelector('h1')?.textContent === 'Robotic Things'", "from an error to the list of things")
        browser.messages()


def a_list_of_terms_is_a_page_with_anchors(browser):
    shows = "return document.querySelector('h1')?.textContent === arguments[0]"
    in_sight = ("const term = document.getElementById(arguments[0])?.getBoundingClientRect(), top = document.querySelector('header').getBoundingClientRect().bottom; "
                "return !!term && term.top >= top && term.bottom <= innerHeight")
    with Robot() as robot:
        for path, title, term in (("ns/lrt", "Terms of Linked Robotic Things", "queueLength"), ("ns/lrt", "Terms of Linked Robotic Things", "hybrit:Action"),
                                  ("ns/vocabulary", "Terms of this robot", None)):
            browser.open(robot.at(path + (f"#{term}" if term else "")))
            browser.until(shows, path, title)
            if term:
                browser.until(in_sight, f"{term} below the header section", term)
            browser.until("return document.querySelector('#tree a')", "the tree of Things")
            assert browser.run("return [...document.querySelectorAll('main a[href^=\"#\"]')].every(a => document.getElementById(a.getAttribute('href').slice(1)))"), path
            shot(browser, "terms-" + path.replace("/", "-"))
            check_clean(browser, robot)
        browser.click("#tree a")
        browser.until("return document.querySelector('h1')?.textContent.includes('Baxter')", "from the terms to a Thing")
        browser.run("history.back()")
        browser.until(shows, "and back", "Terms of this robot")
        browser.open(robot.url)
        browser.until(shows, "the list of Things", "Robotic Things")
        browser.run("const a = document.createElement('a'); a.href = '/ns/lrt'; document.querySelector('main').append(a); a.click()")
        browser.until("return document.querySelector('article#state')", "from a Thing to the terms")
        for width, height in ((390, 844), (320, 568)):
            browser.size(width, height, phone=True)
            browser.open(robot.at("ns/lrt"))
            browser.until("return document.querySelector('article#state')", "the terms on a phone")
            assert browser.run("return document.documentElement.scrollWidth <= innerWidth"), width
            shot(browser, f"terms-{width}")
        browser.size(1280, 900)
        browser.devtools("Emulation.setScriptExecutionDisabled", value=True)
        try:
            browser.open(robot.at("ns/lrt#state"))
            browser.find("article#state")
            assert "From a Thing to the resource that represents it" in browser.text("article#state")
        finally:
            browser.devtools("Emulation.setScriptExecutionDisabled", value=False)
        check_clean(browser, robot)


def data_can_be_read_and_copied(browser):
    with Robot() as robot:
        browser.open(robot.at("baxter/right_s1/rotation"))
        browser.click(".source summary")
        browser.until("return document.querySelector('.source pre').innerText.includes('rotationAngle')", "JSON")
        assert f"curl -H 'Accept: application/json' '{robot.at('baxter/right_s1/rotation')}'" in browser.text(".source")
        browser.run("[...document.querySelectorAll('.source button')].find(b => b.value === 'text/turtle').click()")
        browser.until("return document.querySelector('.source pre').innerText.includes('@prefix')", "Turtle")
        browser.run("[...document.querySelectorAll('.source button')].find(b => b.value === 'application/n-triples').click()")
        browser.until("return document.querySelector('.source pre').innerText.includes('^^<http')", "N-Triples")
        check_clean(browser, robot)
        browser.open(robot.at("baxter/right_s1/friction"))
        live(browser)
        browser.until("return document.querySelector('input[type=text]')?.value === '0.7'", "the form has the present value")
        browser.run("document.querySelector('details.curl summary').click()")  # wherever a plot that appears moves it
        browser.until("return document.querySelector('details.curl').innerText.includes(arguments[0])", "the command as a line for curl",
                      f"curl -X PUT -H 'Content-Type: application/json' -d '0.7' '{robot.at('baxter/right_s1/friction')}'")
        check_clean(browser, robot)


def a_slider_and_a_field_write_a_property(browser):
    with Robot() as robot:
        browser.open(robot.at("baxter/right_s1"))
        live(browser)
        card(browser, "friction", "return card.querySelector('input[type=text]')?.value === '0.7'", "the form has the present value")
        card(browser, "friction", "card.querySelector('input[type=range]').focus(); return true", "the slider")
        browser.keys(RIGHT * 4)
        moved = float(card(browser, "friction", "return card.querySelector('input[type=text]').value !== '0.7' && card.querySelector('input[type=text]').value", "the slider moves the field"))
        press(browser, "friction", "Set")
        card(browser, "friction", f"return Number(card.querySelector('.big .number').innerText) === {moved}", "the new value")
        assert number(robot, "baxter/right_s1/friction") == moved
        for bad, words in (("99", "60"), ("fast", "fast")):
            fill(browser, "friction", bad)
            press(browser, "friction", "Set")
            told = card(browser, "friction", f"const e = card.querySelector('.entry .error').innerText; return e.includes({json.dumps(words)}) ? e : ''", f"what is wrong with {bad}")
            assert "expected" in told, told
            assert card(browser, "friction", "return card.querySelector('input[aria-invalid]') === document.activeElement && card.querySelector('[role=alert]').innerText", "it is marked").startswith("Not accepted (422)")
        assert number(robot, "baxter/right_s1/friction") == moved
        shot(browser, "refused-1280")
        fill(browser, "friction", "1.5")
        press(browser, "friction", "Set")
        card(browser, "friction", "return card.querySelector('.big .number').innerText === '1.5' && !card.querySelector('[aria-invalid]')", "mended")
        check_clean(browser, robot, provoked=["422"])


def an_action_runs_to_its_end_and_is_cancelled(browser):
    with Robot() as robot:
        browser.open(robot.at("baxter/right_s1"))
        live(browser)
        fill(browser, "rotate", "30")
        press(browser, "rotate", "rotate")
        card(browser, "rotate", "const s = card.querySelector('.status'), p = card.querySelector('progress'); return s?.innerText === 'running' && p.value > 0 && p.value < 1", "progress")
        card(browser, "rotate", "return card.querySelector('.status').innerText === 'succeeded' && !card.querySelector('progress').getClientRects().length", "its end")
        card(browser, "rotation", "return Math.abs(Number.parseFloat(card.querySelector('.number').innerText) - 0.5236) < 0.001", "the new value")
        fill(browser, "rotate", "-60")
        press(browser, "rotate", "rotate")
        card(browser, "rotate", "return card.querySelectorAll('.status').length === 2 && card.querySelector('.status').innerText === 'running'", "the second one, above")
        # The newest state only: a queue of what is past would tell the end long after it.
        until(lambda: any("/actions/rotate/" in s and LATEST in s for s in subscriptions(robot, "baxter/right_s1")), "it is watched without a queue")
        press(browser, "rotate", "Cancel")
        card(browser, "rotate", "return card.querySelector('.status').innerText === 'cancelled'", "it is cancelled")
        fill(browser, "rotate", "-120")
        press(browser, "rotate", "rotate")
        card(browser, "rotate", "return card.querySelector('.status').innerText === 'running'", "the third one")
        http_request("PUT", robot.at("baxter/right_s1/position"), b"0.1", {"Content-Type": "application/json"}).expect(204)
        card(browser, "rotate", "return [...card.querySelectorAll('li')][0].innerText.includes('by a later command')", "why it failed")
        shot(browser, "actions-1280")
        check_clean(browser, robot)


def a_subscription_is_cancelled(browser):
    with Robot("--demo") as robot:
        browser.size(1280, 3000)  # what is out of sight is neither watched nor listed anew: here all is in sight
        browser.open(robot.at("baxter/right_s1"))
        live(browser)
        browser.click("section:last-of-type > details > summary")
        browser.until("return [...document.querySelectorAll('td[data-label=Delivered]')].some(c => Number(c.innerText) > 3)", "counters move")
        shot(browser, "subscriptions-1280")
        browser.until("const row = [...document.querySelectorAll('.subscriptions tbody tr')].find(r => r.innerText.includes('state')); row?.querySelector('button').click(); "
                      "return [...document.querySelectorAll('p.bad')].some(p => p.getClientRects().length && p.innerText.includes('was cancelled'))", "it is cancelled, and told")
        assert not [s for s in subscriptions(robot, "baxter/right_s1") if "state" in s]
        browser.run("[...document.querySelectorAll('button')].find(b => b.innerText === 'Watch again').click()")
        live(browser)
        value = card(browser, "rotation", "return card.querySelector('.number').innerText", "a value")
        card(browser, "rotation", f"return card.querySelector('.number').innerText !== {json.dumps(value)}", "it moves again")
        check_clean(browser, robot, provoked=["404"])  # of the list, which had heard of the cancelled one


def a_lost_robot_comes_back(browser):
    robot = Robot("--demo")
    browser.open(robot.at("baxter/right_s1"))
    live(browser)
    robot.kill()
    browser.until("return document.getElementById('link').textContent.startsWith('Connection lost')", "the loss is told")
    shot(browser, "lost-1280")
    with Robot("--demo", port=robot.port):
        live(browser)
        value = card(browser, "rotation", "return card.querySelector('.number').innerText", "a value")
        card(browser, "rotation", f"return card.querySelector('.number').innerText !== {json.dumps(value)}", "it moves again")
        fill(browser, "rotate", "20")
        press(browser, "rotate", "rotate")
        card(browser, "rotate", "return card.querySelector('.status')?.innerText === 'running'", "commands again")
    robot.process.stdout.close()
    browser.messages()  # connections that failed


def a_form_comes_when_the_robot_responds_again(browser):
    """What could not be loaded is loaded again: forms, Things, the skeleton."""
    browser.devtools("Network.enable")
    try:
        with Robot("--demo") as robot:
            for page, blocked, failed, there in (
                    ("baxter/right_s1", "*/blueprints/*", ".action p.bad:not(.answer)", ".action input[type=text]"),
                    ("baxter", "*/right_s1*", ".skeleton p.bad:not(.answer)", ".skeleton fieldset.joints input"),
                    ("", "*/baxter*", ".thing p.bad:not(.answer)", ".thing p.quiet")):
                browser.devtools("Network.setBlockedURLs", urls=[blocked])
                browser.open(robot.at(page))
                browser.until(f"return document.querySelector('{failed}')?.innerText === 'the robot does not respond'", f"the loss at /{page}")
                browser.devtools("Network.setBlockedURLs", urls=[])
                browser.until(f"return document.querySelector('{there}') && !document.querySelector('{failed}')", f"what was lost at /{page}")
    finally:
        browser.devtools("Network.setBlockedURLs", urls=[])
        browser.devtools("Network.disable")
    browser.messages()  # requests that were blocked


def without_websocket_it_asks(browser):
    refuse = browser.devtools("Page.addScriptToEvaluateOnNewDocument",
                              source="window.WebSocket = class { constructor() { setTimeout(() => this.onclose({code: 1006})); } close() {} };")
    try:
        with Robot("--demo") as robot:
            browser.open(robot.at("baxter/right_s1"))
            browser.until("return document.getElementById('link').textContent.includes('polling')", "it says so")
            value = card(browser, "rotation", "return card.querySelector('.number').innerText", "a value")
            card(browser, "rotation", f"return card.querySelector('.number').innerText !== {json.dumps(value)}", "it changes")
            check_clean(browser, robot)
    finally:
        browser.devtools("Page.removeScriptToEvaluateOnNewDocument", identifier=refuse["identifier"])


def a_form_is_used_by_keyboard_alone(browser):
    with Robot() as robot:
        browser.open(robot.at("baxter/right_s1/actions/rotate"))
        browser.find("form input[type=text]")
        browser.keys(TAB)
        assert browser.run("return document.activeElement.className") == "skip"
        for _ in range(60):
            if browser.run("return document.activeElement.matches('form input[type=text]')"):
                break
            browser.keys(TAB)
        else:
            raise AssertionError("the field is not reached by Tab")
        outline = browser.run("return getComputedStyle(document.activeElement).outlineStyle")
        assert outline == "solid", outline
        browser.keys("15" + ENTER)
        card(browser, "Run", "return card.querySelector('.status')?.innerText === 'succeeded'", "it has run")
        labels = browser.run("return [...document.querySelectorAll('input, select, button, canvas, progress')].filter(e => !(e.labels?.length || e.innerText || e.getAttribute('aria-label'))).map(e => e.outerHTML)")
        assert not labels, labels
        check_clean(browser, robot)


def structs_lists_enums_and_booleans_are_written(browser):
    with Sample() as robot:
        browser.open(robot.at("sample"))
        browser.until("return document.querySelector('h1')?.textContent === arguments[0]", "a title is only text", '<b>Sample</b> & "robot"')
        live(browser)
        value = "http://www.w3.org/1999/02/22-rdf-syntax-ns#value"
        card(browser, "armed", "const b = card.querySelector('input[type=checkbox]'); b?.click(); return b?.checked", "a check box")
        press(browser, "armed", "Set")
        card(browser, "armed", "return card.querySelector('.big').innerText.trim() === 'yes'", "yes")
        assert 'true' in plain(objects(robot.n_triples("sample/armed"), value)[0])
        card(browser, "mode", "const s = card.querySelector('select'); if (!s || s.options.length !== 3) return false; s.value = [...s.options].find(o => o.text === 'active').value; s.dispatchEvent(new Event('input', {bubbles: true})); return true", "choices")
        press(browser, "mode", "Set")
        card(browser, "mode", "return card.querySelector('.big').innerText.trim() === 'active'", "the choice")
        card(browser, "pose", "return [...card.querySelectorAll('input')].some(i => i.value === 'base')", "the fields of the struct")
        fill(browser, "pose", "1.25", 0)
        fill(browser, "pose", "-0.5", 3)
        press(browser, "pose", "Set")
        told = card(browser, "pose", "return [...card.querySelectorAll('.entry')].map(f => f.querySelector('.error').innerText ? f.querySelector('label').innerText : '').join('')", "what is wrong, at its field")
        assert told.startswith("tolerance"), told
        fill(browser, "pose", "0.5", 3)
        shot(browser, "struct-1280")
        press(browser, "pose", "Set")
        card(browser, "pose", "return card.querySelector('dl').innerText.includes('1.25') && !card.querySelector('[aria-invalid]')", "the struct")
        press(browser, "gains", "Add a row")
        fill(browser, "gains", "7.5", 2)
        press(browser, "gains", "Set")
        card(browser, "gains", "return card.querySelector('.big').innerText.trim() === '[1, 2.5, 7.5]'", "the list")
        fill(browser, "gains", "much", 1)
        press(browser, "gains", "Set")
        card(browser, "gains", "return card.querySelector('form').innerText.includes('expected')", "what is wrong with the list")
        # The shape of a list is in the Blueprint only, which the card reads.
        press(browser, "sum", "Add a row")
        fill(browser, "sum", "2.25")
        press(browser, "sum", "sum")
        card(browser, "sum", "return /result\\s*2.25/.test(card.innerText)", "the result of the list")
        press(browser, "measure", "measure")
        card(browser, "measure", "return /result\\s*2.5 m/.test(card.innerText)", "a result")
        check_clean(browser, robot, provoked=["422"])


def a_picture_is_shown_and_follows_its_property(browser):
    with Sample() as robot:
        browser.open(robot.at("sample/eye"))
        live(browser)
        wide = "const i = card.querySelector('img'); return i && !i.hidden && i.complete && i.naturalWidth"
        assert card(browser, "image", wide, "a picture") == 60
        assert card(browser, "image", "return card.querySelector('img').alt", "its words") == "image as it is now"
        press(browser, "shoot", "shoot")
        card(browser, "image", wide + " === 120", "the next one")
        assert "format" not in card(browser, "image", "return card.innerText", "the card")
        browser.open(robot.at("sample/eye/image"))
        card(browser, "Value", wide + " === 120", "on its own page")
        browser.until("return document.querySelector('.property a')?.innerText === 'optical_frame'", "its frame")
        browser.click(".source summary")
        browser.until("return document.querySelector('.source button')", "the formats")
        browser.run("[...document.querySelectorAll('.source button')].find(b => b.value === 'text/turtle').click()")
        browser.until("return document.querySelector('.source pre').innerText.includes('byteSize')", "what it says of its formats")
        offered = browser.run("return [...document.querySelectorAll('.source button')].map(b => b.value).filter(Boolean)")
        assert offered == ["application/json", "text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json", "application/trig", "application/n-quads", "text/plain", "image/svg+xml"], offered
        links = browser.run("return [...document.querySelectorAll('.source a')].map(a => [a.innerText, a.href])")
        assert links == [["application/cbor", robot.at("sample/eye/image?accept=application/cbor")]], links
        browser.run("[...document.querySelectorAll('.source button')].find(b => b.value === 'application/json').click()")
        browser.until("return document.querySelector('.source pre').innerText === '{\"number\":2}'", "JSON")
        check_clean(browser, robot)


def a_robot_is_a_skeleton_that_moves_and_turns(browser):
    def tip(near):
        return browser.until("const at = document.querySelector('canvas').dataset.end?.split(',').map(Number); return at && arguments[0].every((n, i) => Math.abs(n - at[i]) < 0.005)", f"the last link is at {near}", near)

    def move(joint, position):
        http_request("PUT", robot.at(f"gantry/joint{joint}/position"), str(position).encode(), {"Content-Type": "application/json"}).expect(204)

    def picture():
        return browser.run("return document.querySelector('.skeleton canvas').toDataURL()")

    with Sample() as robot:
        browser.open(robot.at("gantry"))
        tip([0, 0, 1.7])
        words = browser.run("return document.querySelector('.skeleton canvas').getAttribute('aria-label')")
        assert words.startswith("Skeleton of 4 joints and 5 links"), words
        browser.until("return document.querySelectorAll('.joints input[type=range]').length === 4", "a slider for each joint")
        before = picture()
        move(2, 0.5)
        tip([-1.0 * 0.4794, 0, 0.7 + 0.8776])
        assert picture() != before
        browser.until("return [...document.querySelectorAll('.joints input[type=text]')][1].value === '0.5'", "its field follows")
        before = picture()
        browser.drag(".skeleton canvas", 90, 40)
        browser.until("return document.querySelector('.skeleton canvas').toDataURL() !== arguments[0]", "it is turned", before)
        before = picture()
        browser.run("document.querySelector('.skeleton canvas').focus()")
        browser.keys(RIGHT + "+")
        browser.until("return document.querySelector('.skeleton canvas').toDataURL() !== arguments[0]", "by keys too", before)
        move(2, 0)
        tip([0, 0, 1.7])
        assert browser.run("return [...document.querySelectorAll('.joints input')].every(i => i.matches(':disabled'))"), "nothing moves before it is enabled"
        browser.click(".motion input")
        browser.run("[...document.querySelectorAll('.joints input[type=range]')][3].focus()")
        browser.keys(RIGHT * 5)
        moved = browser.until("return Number([...document.querySelectorAll('.joints input[type=text]')][3].value)", "the slider moves the field")
        tip([0, 0, 1.7 + moved])
        until(lambda: number(robot, "gantry/joint4/position") == moved, "and the robot")
        browser.run("[...document.querySelectorAll('.joints input[type=text]')][3].select()")
        browser.keys("7" + TAB)
        browser.until("return [...document.querySelectorAll('.joints .error')].some(e => e.innerText.includes('0.4'))", "why it did not move")
        move(2, 0.7)
        move(3, -1.2)
        for width, scheme in ((1280, "light"), (390, "dark")):
            browser.size(width, 844, phone=width == 390)
            browser.prefer(color_scheme=scheme)
            browser.until("return document.documentElement.scrollWidth <= innerWidth && innerWidth === arguments[0]", "it fits", width)
            browser.run("document.querySelector('.skeleton input').click(); document.querySelectorAll('.skeleton input')[1].click()")
            assert not browser.run(CONTRAST)
            shot(browser, f"skeleton-{scheme}-{width}")
        browser.size(1280, 900)
        browser.prefer(color_scheme="light")
        check_clean(browser, robot, provoked=["422"])


def a_scroll_moves_nothing_and_a_slider_moves_by_release(browser):
    place = "const r = document.querySelectorAll('.joints input[type=range]')[3].getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2]"

    def touch(kind, *points):
        browser.devtools("Input.dispatchTouchEvent", type=kind, touchPoints=[{"x": x, "y": y} for x, y in points])

    def swipe(x, y, right, down):
        touch("touchStart", (x, y))
        for part in range(1, 11):
            touch("touchMove", (x + right * part / 10, y + down * part / 10))

    def scrolled(x, y):
        browser.run("scrollTo(0, 0); window.top0 = scrollY")
        swipe(x, y, 3, -200)
        touch("touchEnd")
        browser.until("return scrollY > 100", "the finger scrolls")

    with Sample() as robot:
        browser.size(390, 500, phone=True)
        browser.devtools("Emulation.setTouchEmulationEnabled", enabled=True)
        browser.open(robot.at("gantry"))
        browser.until("return document.querySelectorAll('.joints input[type=range]').length === 4", "a slider for each joint")
        browser.run("const own = fetch; window.puts = 0; window.fetch = (url, how) => { puts += how.method === 'PUT'; return own(url, how); }")
        x, y = browser.run("const r = document.querySelector('.skeleton canvas').getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2]")
        scrolled(x, y)
        browser.run("document.body.style.paddingBottom = '2000px'; document.querySelector('.motion input').click()")
        browser.run("scrollTo(0, 0); document.querySelector('.motion').scrollIntoView({block: 'start'}); window.before = scrollY")
        x, y = browser.run(place)
        swipe(x, y, 2, -150)
        touch("touchEnd")
        browser.until("return scrollY > before + 50", "a slider does not hold the page")
        browser.run("document.querySelectorAll('.joints input[type=range]')[3].scrollIntoView({block: 'center'})")
        x, y = browser.run(place)
        swipe(x, y, 60, 0)
        browser.until("return Number(document.querySelectorAll('.joints input[type=text]')[3].value) > 0.2", "the slider moves")
        assert browser.run("return puts") == 0, "it was written before the release"
        assert number(robot, "gantry/joint4/position") == 0
        touch("touchEnd")
        until(lambda: number(robot, "gantry/joint4/position") > 0.2, "the robot moves at the release")
        assert browser.run("return puts") == 1
        browser.devtools("Emulation.setTouchEmulationEnabled", enabled=False)
        browser.size(1280, 900)
        check_clean(browser, robot)


def motion_is_enabled_for_a_minute(browser):
    with Sample() as robot:
        browser.open("about:blank")
        browser.devtools("Page.enable")
        script = browser.devtools("Page.addScriptToEvaluateOnNewDocument", source="window.timers = []; const own = setTimeout; window.setTimeout = (f, ms, ...more) => { if (ms === 60000) timers.push(f); return own(f, ms, ...more); }")
        browser.open(robot.at("gantry"))
        browser.until("return document.querySelectorAll('.joints input[type=range]').length === 4", "a slider for each joint")
        browser.run("timers.length = 0")
        browser.click(".motion input")
        assert browser.run("return !document.querySelector('.joints').disabled && timers.length === 1")
        browser.run("timers[0]()")
        assert browser.run("return document.querySelector('.joints').disabled && !document.querySelector('.motion input').checked")
        browser.devtools("Page.removeScriptToEvaluateOnNewDocument", **script)


def a_stop_is_in_sight_on_every_page_and_works_while_the_robot_hangs(browser):
    in_sight = ("const b = document.querySelector('#stops button'), r = b?.getBoundingClientRect(); "
                "return !!r && r.top >= 0 && r.bottom <= innerHeight && r.left >= 0 && r.right <= innerWidth && document.elementFromPoint(r.left + r.width / 2, r.top + r.height / 2) === b")
    with Sample() as robot:
        def stops():
            return int(http_request("GET", robot.at("sample/stops"), None, {"Accept": "application/json"}).expect(200).body)

        for width, height in ((1280, 900), (390, 844), (320, 568)):
            browser.size(width, height, phone=width < 1000)
            for path in ("", "sample", "sample/stops", "sample/actions/stop", "gantry", "gantry/joint1/position", "ns/lrt"):
                browser.open(robot.at(path))
                browser.until(in_sight, f"the stop at {path}, {width} px")
                browser.until("return document.querySelector('h1')", "the page")
                browser.run("scrollTo(0, document.body.scrollHeight)")
                browser.until(in_sight, f"the stop at the end of {path}, {width} px")
                assert browser.run("return document.documentElement.scrollWidth <= innerWidth"), (path, width)
            browser.open(robot.at("gantry"))
            browser.until("return document.querySelectorAll('.joints input[type=range]').length === 4", "a slider for each joint")
            browser.click(".motion input")
            before = stops()
            browser.click("#stops button")
            until(lambda: stops() == before + 1, "one tap stops")
            browser.until("return document.getElementById('stopped').textContent.startsWith('Stopped at')", "it says so")
            assert browser.run("return document.querySelector('.joints').disabled"), "nothing moves after a stop"
            shot(browser, f"stop-{width}")
            browser.keys(ESCAPE)
            until(lambda: stops() == before + 2, "a key stops")
        browser.open(robot.at("sample"))
        press(browser, "hang", "hang")
        until(lambda: http_request("GET", robot.at("sample/hangs"), None, {"Accept": "application/json"}).body == "true", "the robot's program hangs")
        before = stops()
        browser.keys(ESCAPE)
        until(lambda: stops() > before, "a key stops while the robot hangs")
        browser.size(1280, 900)


def the_skeleton_of_a_description_ends_where_its_last_link_is(browser):
    with Robot() as robot:
        def wrist():
            pose = json.loads(http_request("GET", robot.at("baxter/right_wrist/pose"), None, {"Accept": "application/json"}).expect(200).body)
            return [pose["translation"][axis] for axis in "xyz"]

        def arrived():  # the wrist is asked for first: until the arm begins to move, its position is what was written
            at = wrist()
            return math.dist(at, before) > 0.1 and number(robot, "baxter/right_s1/position") == position and at

        browser.open(robot.at("baxter"))
        for position in (0.4, -0.9):
            before = wrist()
            http_request("PUT", robot.at("baxter/right_s1/position"), str(position).encode(), {"Content-Type": "application/json"}).expect(204)
            browser.until("const at = document.querySelector('canvas').dataset.end?.split(',').map(Number); return at && arguments[0].every((n, i) => Math.abs(n - at[i]) < 0.002)",
                          "the wrist", until(arrived, "the joint is there"))
        browser.until("return document.querySelectorAll('.joints input[type=range]').length === 7", "a slider for each joint")
        check_clean(browser, robot)


def a_property_that_fails_spoils_no_other(browser):
    with Sample() as robot:
        browser.open(robot.at("arm"))
        card(browser, "broken", "return card.innerText.includes('the encoder does not answer')", "the problem, in its place")
        card(browser, "speed", "return card.querySelector('.big .number')?.innerText === '1.5'", "the others")
        press(browser, "fail", "fail")
        card(browser, "fail", "return card.innerText.includes('the motor is hot')", "why an action failed")
        press(browser, "grip", "grip")
        press(browser, "grip", "Cancel")
        card(browser, "grip", "return card.querySelector('.status').innerText === 'cancelled'", "cancelled")
        fill(browser, "waypoints", "3", 0)
        fill(browser, "waypoints", "4", 1)
        fill(browser, "waypoints", "map", 2)
        press(browser, "waypoints", "Add")
        card(browser, "waypoints", "return card.querySelector('.members li')?.innerText.includes('map')", "a member")
        press(browser, "waypoints", "Remove")
        card(browser, "waypoints", "return !card.querySelector('.members li')", "none again")
        shot(browser, "sample-1280")
        check_clean(browser, robot, provoked=["500"])


def a_robot_is_seen_by_another_name_than_its_public_one(browser):
    with Sample("http://robot.example:1234") as robot:
        here = f"http://127.0.0.1:{robot.port}/"
        assert "http://robot.example:1234/sample" in robot.get("").body
        browser.open(here + "sample")
        browser.until("return document.querySelector('h1')?.textContent.includes('Sample')", "the thing")
        live(browser)
        card(browser, "mode", "return card.querySelector('.big')?.innerText.trim() === 'idle'", "a value")
        assert browser.run("return document.querySelector('article h3 a').href") == here + "sample/armed"
        browser.until("return document.querySelectorAll('#tree a').length >= 2", "the tree")
        browser.messages()
        names = browser.run("return performance.getEntriesByType('resource').map(e => e.name)")
        assert names and all(n.startswith((here, "ws://127.0.0.1", "data:")) for n in names), names


def it_fits_a_phone_and_the_dark(browser):
    with Robot("--demo") as robot:
        for width, scheme, name, path in ((390, "light", "root", ""), (390, "dark", "thing", "baxter/right_s1"), (390, "light", "subscriptions", "baxter/right_s1/subscriptions"),
                                          (390, "light", "blueprint", ""), (1280, "dark", "thing", "baxter/right_s1"), (1280, "light", "thing", "baxter/right_s1"),
                                          (1280, "light", "root", ""), (1280, "light", "property", "baxter/right_s1/rotation"), (1280, "light", "blueprint", "")):
            browser.size(width, 844, phone=width == 390)
            browser.prefer(color_scheme=scheme)
            browser.open(robot.at(blueprints(robot, "baxter/right_s1")[0] if name == "blueprint" else path))
            browser.until("return document.querySelector('.source')", "the page")
            if name in ("root", "thing", "property"):
                browser.until("return [...document.querySelectorAll('.plot')].some(p => !p.hidden)", "a plot")
            over = browser.run("return [document.documentElement.scrollWidth, innerWidth, [...document.querySelectorAll('main *')].filter(e => e.getBoundingClientRect().right > innerWidth + 1 && !e.closest('.scroll, pre')).slice(0, 3).map(e => e.outerHTML.slice(0, 200))]")
            assert over[0] <= over[1] == width and not over[2], (path, over)
            back = [int(c) for c in browser.run("return getComputedStyle(document.body).backgroundColor").strip("rgb()").split(",")]
            assert (sum(back) < 150) == (scheme == "dark"), back
            weak = browser.run(CONTRAST)
            assert not weak, (path, scheme, weak)
            if width == 390:
                assert not browser.run("return document.querySelector('#tree').getClientRects().length")
                small = browser.run("return [...document.querySelectorAll('main button, main input, #menu')].filter(e => e.getClientRects().length && e.getBoundingClientRect().height < 20).map(e => e.outerHTML)")
                assert not small, small
                browser.click("#menu")
                browser.until("return document.querySelector('#tree').getClientRects().length", "the menu")
                browser.click("#menu")
            if folder:
                end = time.monotonic() + 4  # for the pictures only: so that a plot has something to show
                while name in ("thing", "property", "root") and time.monotonic() < end:
                    time.sleep(0.1)
                shot(browser, f"{name}-{scheme}-{width}")
            check_clean(browser, robot)


# Text whose contrast with what is behind it is below 4.5 (WCAG 2 AA).
CONTRAST = """
const parse = c => (c.match(/[\\d.]+/g) ?? []).map(Number), light = c => { const [r, g, b] = c.map(v => (v /= 255) <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4); return .2126 * r + .7152 * g + .0722 * b; };
const back = e => { for (; e; e = e.parentElement) { const c = parse(getComputedStyle(e).backgroundColor); if (c.length === 3 || c[3] > .5) return c.slice(0, 3); } return [255, 255, 255]; };
return [...document.querySelectorAll('body *')].filter(e => e.getClientRects().length && [...e.childNodes].some(n => n.nodeType === 3 && n.data.trim()) && !e.disabled && !e.matches('.skip, option')).map(e => {
  const a = light(parse(getComputedStyle(e).color).slice(0, 3)), b = light(back(e));
  return [(Math.max(a, b) + .05) / (Math.min(a, b) + .05), e.outerHTML.slice(0, 120)];
}).filter(([c]) => c < 4.5);
"""


def only_its_own_script_runs_and_it_is_small(browser):
    with Robot() as robot:
        browser.open(robot.at("baxter/right_s1"))
        live(browser)
        size = browser.run("return performance.getEntriesByType('navigation')[0].encodedBodySize")
        print(f"  {size} bytes")
        assert 0 < size <= 100000, size
        browser.run("const s = document.createElement('script'); s.textContent = 'window.intruder = 1'; document.body.append(s);"
                    "document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=\"window.intruder = 2\">');")
        browser.until("return document.querySelector('img').complete", "the picture")
        assert browser.run("return window.intruder") is None
        assert any("Content Security Policy" in m["message"] for m in browser.messages())


def a_picture_that_is_opened_runs_no_script(browser):
    with Sample() as robot:
        address = robot.at("sample/eye/image?accept=image/svg%2Bxml")
        answer = http_request("GET", address)
        assert "<script>" in answer.body and "sandbox" in answer.headers["Content-Security-Policy"], answer
        browser.open(address)
        browser.until("return document.readyState === 'complete' && document.documentElement.nodeName === 'svg'", "the picture")
        assert any("sandbox" in m["message"] or "Content Security Policy" in m["message"] for m in browser.messages())
        assert "width='60'" in http_request("GET", address).body, "the script of the picture has shot another"


def words_are_in_the_language_of_the_browser(browser):
    with Sample() as robot, Browser(extra=("--lang=de", "--accept-lang=de-CH,de")) as german:
        said = "return [...card.querySelectorAll('h2,h3,.said > *')].map(e => e.innerText)"
        bytes_of = "return performance.getEntriesByType('navigation')[0].encodedBodySize"
        sizes = []
        for reader, door, opening, shut, width, hinge in (
                (browser, "Door", ["Opening", "opening", "What the door closes."], ["Shut", "shut", "Schließt die Tür."], "Width (width)", "On the left (left)"),
                (german, "Tür", ["Öffnung", "opening", "Was die Tür verschließt."], ["Schließen", "shut", "Schließt die Tür."], "Breite (width)", "Links (left)")):
            reader.open(robot.at("door"))
            reader.until("return document.querySelector('h1')?.textContent === arguments[0]", "the title of the Thing", door)
            assert reader.run("return document.querySelector('h1').lang") == ("de" if reader is german else "en")
            assert reader.text("#main > .said") == "The way into the cell.", reader.text("#main")
            for name, expected in (("opening", opening), ("shut", shut)):
                card(reader, name, said + ".join('|') === arguments[1]", f"the words of {name}", "|".join(expected))
            card(reader, "opening", "return [...card.querySelectorAll('label')].some(l => l.textContent === arguments[1])", "a field", width)
            card(reader, "opening", "return [...card.querySelectorAll('option')].map(o => o.textContent).slice(1).join() === arguments[1] + ',right'", "choices", hinge)
            reader.open(robot.at("door/opening"))
            reader.until("return document.querySelector('h1')?.textContent === arguments[0]", "the title of the property", opening[0])
            assert [reader.text("#main > .said .name"), reader.text("#main > .said span")] == opening[1:]
            sizes.append(reader.run(bytes_of))
        assert sizes[0] == sizes[1], "one document for all"
        check_clean(german, robot)


CASES = [shows_the_tree_and_live_values, every_address_shows_its_resource, a_list_of_terms_is_a_page_with_anchors, data_can_be_read_and_copied, a_slider_and_a_field_write_a_property,
         an_action_runs_to_its_end_and_is_cancelled, a_subscription_is_cancelled, a_lost_robot_comes_back, a_form_comes_when_the_robot_responds_again, without_websocket_it_asks,
         a_form_is_used_by_keyboard_alone, structs_lists_enums_and_booleans_are_written, a_picture_is_shown_and_follows_its_property,
         a_robot_is_a_skeleton_that_moves_and_turns, a_scroll_moves_nothing_and_a_slider_moves_by_release, motion_is_enabled_for_a_minute,
         a_stop_is_in_sight_on_every_page_and_works_while_the_robot_hangs, the_skeleton_of_a_description_ends_where_its_last_link_is, a_property_that_fails_spoils_no_other,
         only_its_own_script_runs_and_it_is_small, a_picture_that_is_opened_runs_no_script, a_robot_is_seen_by_another_name_than_its_public_one, it_fits_a_phone_and_the_dark,
         words_are_in_the_language_of_the_browser]


def main():
    global folder
    Robot.program, Sample.binary = sys.argv[1:3]
    folder = sys.argv[3] if len(sys.argv) > 3 else None
    wanted = sys.argv[4:]
    missing = [name for name, path in zip(("chromium", "chromedriver"), webdriver.programs()) if not path]
    if missing:
        print(f"skipped: there is no {' and no '.join(missing)} (vendor/install.sh browser)")
        return 77
    if folder:
        os.makedirs(folder, exist_ok=True)
    failed = 0
    with Browser() as browser:
        for case in CASES:
            if wanted and case.__name__ not in wanted:
                continue
            began = time.monotonic()
            browser.open("about:blank")
            browser.size(1280, 900)
            browser.messages()  # of the one before, whose robot is gone
            try:
                case(browser)
                print(f"ok   {case.__name__} ({time.monotonic() - began:.1f} s)", flush=True)
            except (AssertionError, webdriver.Refused) as error:
                failed += 1
                print(f"FAIL {case.__name__}: {error}", flush=True)
                shot(browser, "failed-" + case.__name__)
                browser.messages()
    print(f"{failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
