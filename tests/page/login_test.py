# SPDX-License-Identifier: Apache-2.0
"""Logging in on the page, and what pages elsewhere try with the session of its user, in a real browser.

   login_test.py BAXTER PAGE_ROBOT [FOLDER FOR SCREENSHOTS [CASE]...]
"""

import http.server
import os
import sys
import tempfile
import threading

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "conformance"))

import webdriver  # noqa: E402
from robot_process import Robot, Way, http_request, objects, plain  # noqa: E402
from webdriver import Browser  # noqa: E402

READER, OPERATOR = "reader-0123456789abcdef", "operator-0123456789abcdef"
FRICTION = "baxter/right_s1/friction"
VALUE = "http://vocab.arvida.de/2015/06/vom/vocab#numericalValue"

folder = None


class Guarded(Robot):
    """baxter with tokens, of which each test knows one of each role."""

    def __init__(self, *arguments):
        self.tokens = tempfile.NamedTemporaryFile("w", suffix=".tokens")
        self.write_tokens(f"anna reader {READER}\nbert operator {OPERATOR}\n")
        super().__init__("--tokens", self.tokens.name, *arguments)
        self.origin = self.url[:-1]

    def write_tokens(self, text):
        self.tokens.seek(0)
        self.tokens.truncate()
        self.tokens.write(text)
        self.tokens.flush()

    def read(self, path, token=READER, **headers):
        return http_request("GET", self.at(path), None, {"Authorization": f"Bearer {token}", **headers})

    def friction(self):
        return float(plain(objects(self.read(FRICTION, Accept="application/n-triples").expect(200).body, VALUE)[0]))

    def subscriptions(self, thing="baxter/right_s1"):
        answer = self.read(thing + "/subscriptions", Accept="application/n-triples").expect(200)
        return objects(answer.body, "http://www.w3.org/ns/ldp#contains")


class Open(Guarded):
    """page_robot, where everybody may read."""

    def __init__(self):
        Robot.program, baxter = Open.binary, Robot.program
        try:
            super().__init__()
        finally:
            Robot.program = baxter


class Elsewhere:
    """A page of another origin: an HTTP server of its own on this machine, by an address or a name."""

    def __init__(self, host="127.0.0.1"):
        elsewhere = self
        self.html = "<!doctype html><title>Elsewhere</title><p>A page of another origin."
        self.fields = {}

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                data = (elsewhere.html if self.path == "/" else "").encode()
                self.send_response(200)
                self.send_header("Content-Type", "text/html; charset=utf-8")
                self.send_header("Content-Length", str(len(data)))
                for name, value in elsewhere.fields.items():
                    self.send_header(name, value)
                self.end_headers()
                self.wfile.write(data)

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.url = f"http://{host}:{self.server.server_port}/"
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.server.shutdown()
        self.server.server_close()


def shot(browser, name):
    if folder:
        browser.run("scrollTo(0, 0)")
        browser.screenshot(os.path.join(folder, name + ".png"))


def log_in(browser, robot, token=OPERATOR, path="baxter/right_s1"):
    browser.open(robot.at(path))
    browser.type("#token", token)
    browser.click("form button")
    browser.until("return !document.getElementById('token') && document.querySelector('header button')", "the page after the login")


def result(browser, script, *arguments):
    """What a promise of the page gives, or its error."""
    browser.run("window.outcome = undefined; (async () => { " + script + " })().then(v => { outcome = [v ?? null]; }, e => { outcome = ['failed: ' + e]; })", *arguments)
    return browser.until("return window.outcome", "an outcome")[0]


# ---- what must hold


def a_user_logs_in_reads_writes_watches_and_logs_out(browser):
    with Guarded("--demo") as robot:
        browser.open(robot.at("baxter/right_s1"))
        assert browser.text("h1") == "Log in"
        assert browser.run("return document.activeElement.id") == "token"
        shot(browser, "login-1280")
        browser.type("#token", "wrong-0123456789abcdef")
        browser.click("form button")
        browser.until("return document.querySelector('[role=alert]').innerText === 'This token is not valid.'", "what is wrong")
        browser.type("#token", OPERATOR)
        browser.click("form button")
        browser.until("return document.querySelector('h1')?.textContent === 'right_s1' && location.pathname === '/baxter/right_s1'", "the page that was asked for")
        browser.until("return document.querySelector('header').innerText.includes('bert')", "who is logged in")
        browser.until("return document.getElementById('link').textContent === 'Live'", "the page is live")
        assert "token" not in browser.url() and OPERATOR not in browser.run("return document.documentElement.outerHTML")
        shot(browser, "logged-in-1280")
        value = browser.until("return document.querySelector('.number')?.innerText", "a value")
        browser.until("return document.querySelector('.number').innerText !== arguments[0]", "the value changes", value)
        assert result(browser, "return (await fetch('/baxter/right_s1/friction', {method: 'PUT', headers: {'Content-Type': 'application/json'}, body: '0.9'})).status") == 204
        assert robot.friction() == 0.9
        browser.run("[...document.querySelectorAll('header button')].find(b => b.innerText === 'Log out').click()")
        browser.until("return document.querySelector('h1')?.textContent === 'Log in'", "the form again")
        assert not browser.send("GET", "/cookie")


def a_page_elsewhere_cannot_command_with_the_session_of_its_reader(browser):
    """By a form, by fetch() in each of its ways, by a WebSocket, an event stream, a picture, a script."""
    with Guarded() as robot, Elsewhere() as elsewhere:
        log_in(browser, robot)
        cookie = browser.send("GET", "/cookie")[0]
        assert cookie["httpOnly"] and cookie["sameSite"] == "Strict" and cookie["path"] == "/", cookie
        browser.open(elsewhere.url)
        # The browser sends it along: this host is the same site, whatever the port is. The robot has to refuse.
        assert browser.send("GET", "/cookie"), "the cookie of the other port"
        target, ws = robot.at(FRICTION), "ws" + robot.url[4:]
        for options in ("{method: 'PUT', body: '0.9', headers: {'Content-Type': 'application/json'}}",
                        "{method: 'PUT', body: '0.9', headers: {'Content-Type': 'application/json'}, credentials: 'include'}",
                        "{method: 'POST', body: '90', credentials: 'include'}", "{credentials: 'include'}", "{}"):
            assert result(browser, f"await fetch(arguments[0], {options}); return 'readable'", target).startswith("failed:"), options
        browser.run("performance.clearResourceTimings()")
        for method in ("GET", "POST"):  # simple requests: sent, and not readable
            found = result(browser, "const r = await fetch(arguments[0], {method: arguments[1], mode: 'no-cors', credentials: 'include', body: arguments[1] === 'POST' ? '90' : undefined}); return r.type + r.status", robot.at("baxter/right_s1/actions/rotate"), method)
            assert found == "opaque0" or found.startswith("failed:"), found
        assert result(browser, "return await new Promise(done => { const s = new WebSocket(arguments[0]); s.onopen = () => done('open'); s.onerror = () => done('refused'); })", ws + FRICTION) == "refused"
        for credentials in ("true", "false"):
            assert result(browser, f"return await new Promise(done => {{ const s = new EventSource(arguments[0], {{withCredentials: {credentials}}}); s.onopen = () => done('open'); s.onerror = () => done('refused'); }})", target) == "refused"
        for element in ("img", "script", "video"):
            assert result(browser, "return await new Promise(done => { const e = document.createElement(arguments[1]); e.onload = e.onloadeddata = () => done('loaded'); e.onerror = () => done('refused'); e.src = arguments[0]; document.body.append(e); })", target, element) == "refused", element
        for action in (robot.at("baxter/right_s1/actions/rotate"), target, robot.at("ns/session")):
            for kind in ("application/x-www-form-urlencoded", "text/plain", "multipart/form-data"):
                browser.open(elsewhere.url)
                browser.run("const f = document.createElement('form'); f.method = 'post'; f.action = arguments[0]; f.enctype = arguments[1]; const i = document.createElement('input'); i.name = '90'; f.append(i); document.body.append(f); f.submit()", action, kind)
                browser.until("return location.href === arguments[0] && document.readyState === 'complete'", "the answer to the form", action)
                assert "403 Forbidden" in browser.text() or "Log in" in browser.text(), browser.text()
        assert robot.friction() == 0.7
        assert not robot.subscriptions()
        assert not objects(robot.read("baxter/right_s1/actions/rotate", Accept="application/n-triples").body, "http://www.w3.org/ns/ldp#contains")
        # The user's own page works as before.
        browser.open(robot.at("baxter/right_s1"))
        browser.until("return document.getElementById('link').textContent === 'Live'", "the page is live")
        assert result(browser, "return (await fetch('/baxter/right_s1/friction', {method: 'PUT', headers: {'Content-Type': 'application/json'}, body: '0.8'})).status") == 204
        assert result(browser, "return await new Promise(done => { const s = new EventSource('/baxter/right_s1/friction'); s.onmessage = () => { s.close(); done('open'); }; s.onerror = () => done('refused'); })") == "open"


def a_page_of_another_site_has_no_cookie_to_send(browser):
    with Guarded() as robot, Elsewhere("localhost") as elsewhere:  # localhost and 127.0.0.1 are two sites
        log_in(browser, robot)
        browser.open(elsewhere.url)
        assert not browser.send("GET", "/cookie")
        assert result(browser, "await fetch(arguments[0], {credentials: 'include'}); return 'readable'", robot.at(FRICTION)).startswith("failed:")
        browser.run("location = arguments[0]", robot.at("baxter"))  # a link to the robot: SameSite=Strict
        browser.until("return document.querySelector('h1')?.textContent === 'Log in'", "the form")
        browser.run("location.reload()")
        browser.open(robot.at("baxter"))
        browser.until("return document.querySelector('header button')", "the session is still there")


def no_page_can_be_framed(browser):
    with Guarded() as robot, Elsewhere() as elsewhere:
        log_in(browser, robot)
        for page in ("", "baxter/right_s1", "ns/session", "nothing"):
            browser.open(elsewhere.url)
            loaded = result(browser, "return await new Promise(done => { const f = document.createElement('iframe'); f.onload = () => done(f); f.src = arguments[0]; document.body.append(f); }).then(f => { try { return f.contentDocument?.body?.innerText ?? 'kept apart'; } catch { return 'kept apart'; } })", robot.at(page))
            assert loaded == "kept apart", loaded
            frames = browser.devtools("Page.getFrameTree")["frameTree"]["childFrames"]
            assert all(f["frame"].get("unreachableUrl") for f in frames), frames  # an error page of the browser's
        browser.open(robot.at("baxter/right_s1"))  # nor by a page of the same origin
        browser.find("header button")
        result(browser, "return await new Promise(done => { const f = document.createElement('iframe'); f.onload = () => done(1); f.src = '/baxter'; document.body.append(f); })")
        frames = browser.devtools("Page.getFrameTree")["frameTree"].get("childFrames", [])
        assert all(f["frame"].get("unreachableUrl") for f in frames), frames


def another_name_of_this_machine_has_neither_page_nor_session(browser):
    """Rebinding: a name of a stranger's that leads to the robot."""
    with Guarded() as robot:
        log_in(browser, robot)
        name = f"http://rebound.example:{robot.port}/"  # main() tells the browser that this name is 127.0.0.1
        browser.open(name + FRICTION)
        assert "421 Misdirected Request" in browser.text(), browser.text()
        assert not browser.send("GET", "/cookie")
        assert result(browser, "return (await fetch('/ns/session', {method: 'POST', headers: {Authorization: 'Bearer ' + arguments[0]}})).status", OPERATOR) == 421
        assert result(browser, "return (await fetch('/baxter/right_s1/friction', {method: 'PUT', headers: {'Content-Type': 'application/json', Authorization: 'Bearer ' + arguments[0]}, body: '0.9'})).status", OPERATOR) == 421
        assert result(browser, "return await new Promise(done => { const s = new WebSocket('ws://' + location.host + '/baxter/right_s1/friction'); s.onopen = () => done('open'); s.onerror = () => done('refused'); })") == "refused"
        assert not browser.send("GET", "/cookie") and robot.friction() == 0.7


def nobody_is_logged_in_by_a_page_elsewhere(browser):
    """Login CSRF: the page would give its reader the session of somebody else."""
    with Guarded() as robot, Elsewhere() as elsewhere:
        browser.open(elsewhere.url)
        session = robot.at("ns/session")
        for options in ("{method: 'POST', headers: {Authorization: 'Bearer ' + arguments[1]}, credentials: 'include'}", "{method: 'POST', headers: {Authorization: 'Bearer ' + arguments[1]}}"):
            assert result(browser, f"await fetch(arguments[0], {options}); return 'readable'", session, OPERATOR).startswith("failed:")
        for body in ("new URLSearchParams({token: arguments[1]})", "'token=' + arguments[1]", "undefined"):
            result(browser, f"await fetch(arguments[0], {{method: 'POST', mode: 'no-cors', credentials: 'include', body: {body}}})", session, OPERATOR)
        browser.run("const f = document.createElement('form'); f.method = 'post'; f.action = arguments[0]; const i = document.createElement('input'); i.name = 'token'; i.value = arguments[1]; f.append(i); document.body.append(f); f.submit()", session, OPERATOR)
        browser.until("return location.href === arguments[0] && document.readyState === 'complete'", "the answer to the form", session)
        assert not browser.send("GET", "/cookie")


def a_cookie_that_was_set_beforehand_stays_unknown(browser):
    """Session fixation: another server of this host sets the cookie, and waits for its victim to log in."""
    with Guarded() as robot, Elsewhere() as elsewhere:
        name, fixed = f"lrt-session-{robot.port}", "a" * 64
        elsewhere.fields = {"Set-Cookie": f"{name}={fixed}; Path=/"}
        browser.open(elsewhere.url)
        assert browser.send("GET", "/cookie")[0]["value"] == fixed
        browser.open(robot.at("baxter"))
        assert browser.text("h1") == "Log in"
        log_in(browser, robot)
        own = browser.send("GET", "/cookie")[0]["value"]
        assert own != fixed and len(own) == 64
        assert http_request("GET", robot.at("baxter"), None, {"Cookie": f"{name}={fixed}"}).status == 401
        assert http_request("GET", robot.at("baxter"), None, {"Cookie": f"{name}={own}"}).status == 200


def no_script_reads_the_cookie_or_the_token(browser):
    with Guarded() as robot:
        log_in(browser, robot)
        secret = browser.send("GET", "/cookie")[0]["value"]
        assert browser.run("return document.cookie") == ""
        kept = browser.run("return JSON.stringify([{...localStorage}, {...sessionStorage}, history.state, location.href, document.documentElement.outerHTML, performance.getEntries().map(e => e.name)])")
        assert secret not in kept and OPERATOR not in kept
        assert result(browser, "return JSON.stringify([...(await fetch('/ns/session')).headers])").find(secret) < 0
        browser.open(robot.at("baxter"))
        assert OPERATOR not in browser.url()


def a_session_ends_with_its_token_and_the_page_asks_anew(browser):
    with Guarded("--demo") as robot:
        log_in(browser, robot)
        browser.until("return document.querySelector('header').innerText.includes('bert')", "the page knows its session, whose end it then notices")
        robot.write_tokens(f"anna reader {READER}\n")
        browser.until("return document.querySelector('h1')?.textContent === 'Log in'", "the form, at the same address: its WebSockets have ended")
        assert browser.url() == robot.at("baxter/right_s1")
        log_in(browser, robot, READER)
        browser.until("return document.querySelector('header').innerText.includes('anna')", "somebody else")


def a_session_that_ends_before_the_page_knows_its_user_ends_too(browser):
    with Guarded("--demo") as robot:
        log_in(browser, robot)
        script = browser.devtools("Page.addScriptToEvaluateOnNewDocument", source="const request = fetch; window.fetch = (iri, ...more) => String(iri).endsWith('/ns/session') ? Promise.reject(TypeError()) : request(iri, ...more);")
        try:
            browser.open(robot.at("baxter/right_s1"))
            browser.until("return [...document.querySelectorAll('header button')].some(b => b.innerText === 'Log in')", "the page does not know its user")
            browser.until("return document.getElementById('link').textContent === 'Live'", "the page is live")
            robot.write_tokens(f"anna reader {READER}\n")
            browser.until("return document.querySelector('h1')?.textContent === 'Log in'", "the form, at the same address")
            assert browser.url() == robot.at("baxter/right_s1")
        finally:
            browser.devtools("Page.removeScriptToEvaluateOnNewDocument", identifier=script["identifier"])


def a_login_at_the_address_of_the_session_leads_to_this_robot_only(browser):
    with Guarded() as robot, Elsewhere() as elsewhere:
        for fragment, place in (("#/baxter/right_s1", "/baxter/right_s1"), ("", "/"), ("#" + elsewhere.url, "/"), ("#//" + elsewhere.url[7:], "/"), ("#javascript:alert(1)", "/")):
            browser.open("about:blank")
            browser.devtools("Network.clearBrowserCookies")
            browser.open(robot.at("ns/session" + fragment))
            browser.type("#token", READER)
            browser.click("form button")
            browser.until("return location.href === arguments[0] && document.querySelector('header button')", f"{fragment} leads to {place}", robot.origin + place)


def where_everybody_may_read_the_page_offers_a_login(browser):
    with Open() as robot:
        browser.open(robot.at("sample"))
        browser.until("return document.getElementById('link').textContent === 'Live'", "the page is live for everybody")
        assert result(browser, "return (await fetch('/sample/armed', {method: 'PUT', headers: {'Content-Type': 'application/json'}, body: 'true'})).status") == 401
        assert browser.text("h1") != "Log in"
        shot(browser, "everybody-1280")
        browser.until("const b = [...document.querySelectorAll('header button')].find(b => b.innerText === 'Log in'); b?.click(); return !!b", "the button")
        browser.type("#token", OPERATOR)
        browser.click("form button")
        browser.until("return location.pathname === '/sample' && document.querySelector('header').innerText.includes('bert')", "back where it began")
        assert result(browser, "return (await fetch('/sample/armed', {method: 'PUT', headers: {'Content-Type': 'application/json'}, body: 'true'})).status") == 204


def who_may_see_a_part_alone_logs_out_there(browser):
    with tempfile.NamedTemporaryFile("w", suffix=".ttl") as policy:
        policy.write("@prefix acl: <http://www.w3.org/ns/auth/acl#> . @prefix lrt: <https://w3id.org/lrt/ns#> . <#anna> a acl:Authorization ; "
                     "acl:accessTo </baxter/right_s1> ; acl:default </baxter/right_s1> ; acl:agent <#anna> ; acl:mode acl:Read, lrt:Subscribe .")
        policy.flush()
        with Guarded("--policy", policy.name) as robot:
            log_in(browser, robot, READER)
            browser.until("return document.querySelector('header').innerText.includes('anna')", "who is logged in")
            browser.until("return document.getElementById('link').textContent === 'Live'", "the page is live")
            browser.click("header button.small")
            browser.until("return document.querySelector('h1')?.textContent === 'Log in'", "the form again")


def a_script_elsewhere_watches_with_a_ticket(browser):
    with Elsewhere() as elsewhere, Guarded("--demo", "--allowed-origin", elsewhere.url[:-1]) as robot:
        browser.open(elsewhere.url)
        ticket = "const ticket = async () => (await (await fetch(arguments[0] + 'ns/ticket', {method: 'POST', headers: {Authorization: 'Bearer ' + arguments[1]}})).json()).ticket; "
        watch = "const watch = (kind, url) => new Promise(done => { const s = new kind(url); s.onmessage = e => { s.close(); done(e.data); }; s.onerror = () => { s.close(); done('refused'); }; }); "
        socket, stream = "new URL('baxter/right_s1/position?accept=application/json&ticket=' + t, arguments[0].replace('http', 'ws'))", "arguments[0] + 'baxter/right_s1/position?accept=application/json&ticket=' + t"
        for kind, url in (("WebSocket", socket), ("EventSource", stream)):
            first, second, without = result(browser, ticket + watch + f"const t = await ticket(); return [await watch({kind}, {url}), await watch({kind}, {url}), await watch({kind}, {url}.toString().replace(/&ticket.*/, ''))]", robot.url, READER)
            assert float(first) and second == without == "refused", (kind, first, second, without)
        assert result(browser, ticket + "return (await fetch(arguments[0] + 'baxter?ticket=' + await ticket())).status", robot.url, READER) == 401
        # Its reader is logged in at the robot, which is nothing to this page.
        log_in(browser, robot)
        browser.open(elsewhere.url)
        assert result(browser, "return (await fetch(arguments[0] + 'baxter/right_s1/friction', {method: 'PUT', body: '0.9', headers: {'Content-Type': 'application/json', Authorization: 'Bearer ' + arguments[1]}})).status", robot.url, OPERATOR) == 204
        assert result(browser, "await fetch(arguments[0] + 'baxter/right_s1/friction', {method: 'PUT', body: '0.8', headers: {'Content-Type': 'application/json'}, credentials: 'include'}); return 'readable'", robot.url).startswith("failed:")
        assert result(browser, watch + "return await watch(WebSocket, new URL('baxter/right_s1/position', arguments[0].replace('http', 'ws')))", robot.url) == "refused"
        assert robot.friction() == 0.9


def over_tls_the_session_is_of_this_host_alone(browser):
    with tempfile.TemporaryDirectory() as certificates:
        before = Way.arguments, Way.ca_file, Way.context
        Way.set(tls_folder=certificates)
        try:
            with Guarded("--demo") as robot:
                browser.open(robot.url)
                name = f"__Host-lrt-session-{robot.port}"
                browser.run("document.cookie = `${arguments[0]}=${'a'.repeat(64)}; Path=/; Secure`; document.cookie = `lrt-session-${location.port}=${'a'.repeat(64)}; Path=/`", name)
                browser.open(robot.url)
                assert browser.text("h1") == "Log in"
                log_in(browser, robot)
                cookie = next(c for c in browser.send("GET", "/cookie") if c["name"] == name)
                assert cookie["secure"] and cookie["httpOnly"] and cookie["value"] != "a" * 64, cookie
                browser.until("return document.getElementById('link').textContent === 'Live'", "the page is live")
                assert result(browser, "return (await fetch('/baxter/right_s1/friction', {method: 'PUT', headers: {'Content-Type': 'application/json'}, body: '0.9'})).status") == 204
        finally:
            Way.arguments, Way.ca_file, Way.context = before


def the_form_fits_a_phone_and_the_dark(browser):
    with Guarded() as robot:
        for width, scheme in ((390, "light"), (390, "dark"), (1280, "light")):
            browser.size(width, 844, phone=width == 390)
            browser.prefer(color_scheme=scheme)
            browser.open(robot.url)
            browser.find("#token")
            assert browser.run("return document.documentElement.scrollWidth") <= width
            shot(browser, f"login-{scheme}-{width}")


CASES = [a_user_logs_in_reads_writes_watches_and_logs_out, a_page_elsewhere_cannot_command_with_the_session_of_its_reader, a_page_of_another_site_has_no_cookie_to_send,
         no_page_can_be_framed, another_name_of_this_machine_has_neither_page_nor_session, nobody_is_logged_in_by_a_page_elsewhere, a_cookie_that_was_set_beforehand_stays_unknown,
         no_script_reads_the_cookie_or_the_token, a_session_ends_with_its_token_and_the_page_asks_anew, a_session_that_ends_before_the_page_knows_its_user_ends_too,
         a_login_at_the_address_of_the_session_leads_to_this_robot_only,
         where_everybody_may_read_the_page_offers_a_login, who_may_see_a_part_alone_logs_out_there, a_script_elsewhere_watches_with_a_ticket, over_tls_the_session_is_of_this_host_alone, the_form_fits_a_phone_and_the_dark]


def main():
    global folder
    Robot.program, Open.binary = sys.argv[1:3]
    folder = sys.argv[3] if len(sys.argv) > 3 else None
    options = ["--host-resolver-rules=MAP rebound.example 127.0.0.1", "--ignore-certificate-errors"]
    return webdriver.run_cases(CASES, folder, sys.argv[4:], extra=options)


if __name__ == "__main__":
    sys.exit(main())
