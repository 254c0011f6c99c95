# SPDX-License-Identifier: Apache-2.0
"""What a client of few rights writes, and what the page makes of it for one of more rights, in a real browser.

Mallory may write a graph of a World, create graphs there, write a text and add members to a collection. Olga may do everything. Whatever Mallory
writes, Olga's page shows it as data.

   hostile_test.py PAGE_ROBOT [FOLDER FOR SCREENSHOTS [CASE]...]
"""

import json
import os
import sys
import tempfile
import urllib.parse

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "conformance"))

import webdriver  # noqa: E402
from robot_process import Robot, http_request  # noqa: E402
from webdriver import Browser  # noqa: E402

MALLORY, OLGA = "mallory-0123456789abcdef", "olga-0123456789abcdef"
POLICY = """
@prefix acl: <http://www.w3.org/ns/auth/acl#> . @prefix lrt: <https://w3id.org/lrt/ns#> .
<#readers> a acl:Authorization ; acl:accessTo </> ; acl:default </> ; acl:agentClass acl:AuthenticatedAgent ; acl:mode acl:Read, lrt:Subscribe .
<#olga> a acl:Authorization ; acl:accessTo </> ; acl:default </> ; acl:agent <#olga> ; acl:mode acl:Read, acl:Write, acl:Control, lrt:Invoke, lrt:Subscribe .
""" + "".join(f"""
<#{name}> a acl:Authorization ; acl:accessTo <{path}> ; acl:default <{path}> ; acl:agent <#mallory>, <#olga> ; acl:mode acl:Read, acl:Write, lrt:Subscribe .
<#{name}-read> a acl:Authorization ; acl:accessTo <{path}> ; acl:default <{path}> ; acl:agentClass acl:AuthenticatedAgent ; acl:mode acl:Read, lrt:Subscribe .
""" for name, path in (("board", "/board"), ("note", "/sample/note"), ("remarks", "/sample/remarks")))
PREFIXES = """
@prefix rdf: <http://www.w3.org/1999/02/22-rdf-syntax-ns#> . @prefix rdfs: <http://www.w3.org/2000/01/rdf-schema#> . @prefix sh: <http://www.w3.org/ns/shacl#> .
@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix lrt: <https://w3id.org/lrt/ns#> . @prefix http: <http://www.w3.org/2011/http#> .
@prefix dcterms: <http://purl.org/dc/terms/> . @prefix ldp: <http://www.w3.org/ns/ldp#> . @prefix ros: <http://ros.org/#> . @prefix owl: <http://www.w3.org/2002/07/owl#> .
@prefix qudt: <http://qudt.org/schema/qudt/> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . @prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
@prefix prov: <http://www.w3.org/ns/prov#> . @prefix spatial: <http://vocab.arvida.de/2015/06/spatial/vocab#> .
"""

# Graphs of Mallory's: name -> Turtle about <> at /board/NAME. {robot} is the address of the robot.
GRAPHS = {
    "action": "<> a hybrit:Action ; dcterms:title \"open the door\" ; hybrit:binding [ http:requestURI \"{robot}/gantry/joint1/position\" ; http:mthd <http://www.w3.org/2011/http-methods#PUT> ] ; hybrit:consumes <#s> . "
              "<#s> a sh:NodeShape ; sh:property [ sh:path rdf:value ; sh:datatype xsd:double ; sh:minCount 1 ] .",
    "delete": "<> a hybrit:Action ; dcterms:title \"show more\" ; hybrit:binding [ http:requestURI \"{robot}/board/victim\" ; http:mthd <http://www.w3.org/2011/http-methods#DELETE> ] .",
    "thing": "<> a hybrit:RoboticThing ; dcterms:title \"Door\" ; hybrit:property </gantry/joint1/position>, </sample/armed> ; hybrit:action </sample/actions/hang>, </door/actions/shut> ; lrt:collection </sample/remarks> ; "
             "lrt:state </gantry/state> ; hybrit:subscriptions </sample/subscriptions> ; hybrit:blueprint </board/notes> ; dcterms:hasPart </gantry> .",
    "robot": "<> a hybrit:RoboticThing, ros:Robot ; lrt:rootLink </gantry/link0> ; lrt:positions </gantry/positions> ; lrt:positionsOf (</gantry/joint1>) ; dcterms:hasPart </gantry/joint1> . </gantry/joint1> a ros:Joint .",
    "property": "<> a hybrit:Property ; vom:numericalValue 1.0 ; dcterms:hasFormat <http://elsewhere.example/p.png>, </sample/eye/image?accept=image/svg%2Bxml> ; lrt:frame <javascript:alert(1)> . "
                "</sample/eye/image?accept=image/svg%2Bxml> dcterms:format \"image/svg+xml\" . <http://elsewhere.example/p.png> dcterms:format \"image/png\" .",
    "invocation": "<> a lrt:Invocation ; lrt:status lrt:running ; lrt:progress 0.5 ; dcterms:created \"2026-01-01T00:00:00Z\"^^xsd:dateTime .",
    "subscription": "<> a hybrit:Subscription ; hybrit:onResource </sample> ; hybrit:callbackURL \"javascript:alert(1)\" ; dcterms:created \"2026-01-01T00:00:00Z\"^^xsd:dateTime .",
    "container": "<> a ldp:Container, ldp:BasicContainer ; ldp:contains </sample/remarks>, </board/victim>, </gantry> ; dcterms:title \"Robotic Things\" ; lrt:stop </sample/actions/hang> .",
    "shape": "<> a sh:NodeShape ; sh:targetNode </sample/actions/stop> ; sh:property [ sh:path rdf:value ; sh:name \"Stop\" ] .",
    "of-state": "</gantry> lrt:state <> ; a hybrit:RoboticThing ; hybrit:property </gantry/joint1/position> ; hybrit:action </door/actions/shut> .",
    "ontology": "</door/actions/shut> a owl:Ontology, hybrit:Action ; rdfs:label \"Everything is fine\" .",
    "words": "<> dcterms:title \"Stopped since 12:03 by olga\" ; rdfs:label \"release\" . </sample/actions/stop> lrt:unavailable \"nobody may stop\" . </sample/stopped> lrt:stopped false . <{robot}/> lrt:stop </sample/actions/hang> .",
    "elsewhere": "<http://elsewhere.example/board/elsewhere> a hybrit:RoboticThing ; hybrit:action <http://elsewhere.example/sample/actions/hang> ; dcterms:title \"Door\" .",
    "malformed": "<http://[> rdfs:seeAlso <http://[:::]/x>, <http://a:99999999/>, <http:>, <http:///>, <x:>, <//[>, <ws://x>, <urn:> . <> rdfs:seeAlso <http://user:word@elsewhere.example/> .",
    "schemes": "<> rdfs:seeAlso <javascript:alert(1)>, <JavaScript:alert(1)>, <data:text/html,hello>, <blob:x>, <file:///etc/passwd>, <vbscript:x>, <http://elsewhere.example/sample/actions/stop>, </sample/actions/stop>, "
               "<https://127.0.0.1/>, <http://127.0.0.1.elsewhere.example/> .",
    "units": "<> qudt:hasUnit <http://x/->, <http://x/constructor>, <http://x/-PER-> ; vom:numericalValue 1.0, \"much\"^^xsd:double, \"INF\"^^xsd:double ; <http://x/__proto__> 1 ; <http://x/%FF> 2 .",
    "deep": "<#0> rdf:value <#1> . " + "".join(f"<#{n}> rdf:value <#{n + 1}> . " for n in range(1, 4000)) + "_:a rdf:first 1 ; rdf:rest _:a . <> rdf:value _:a .",
    "texts": "<> rdfs:label \"<img src=x onerror=alert(1)>\", \"\\u202Epots\", \"</script><script>alert(1)</script>\", \"" + "long " * 2000 + "\" ; rdfs:comment \"stop\"@x-evil .",
}

folder = None


class Shared(Robot):
    """page_robot with a policy and the tokens of two."""

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()
        files = {"tokens": f"mallory reader {MALLORY}\nolga administrator {OLGA}\n", "policy": POLICY}
        for name, text in files.items():
            with open(os.path.join(self.folder.name, name), "w") as file:
                file.write(text)
        os.chmod(os.path.join(self.folder.name, "tokens"), 0o600)
        Robot.program = Shared.binary
        super().__init__("--tokens", os.path.join(self.folder.name, "tokens"), "--policy", os.path.join(self.folder.name, "policy"))
        self.origin = self.url[:-1]

    def stop(self):
        super().stop()
        self.folder.cleanup()

    def mallory(self, method, path, body=None, kind="text/turtle"):
        return http_request(method, self.at(path), body.encode() if body else None, {"Authorization": f"Bearer {MALLORY}", "Content-Type": kind})

    def put_graph(self, name):
        text = PREFIXES + GRAPHS[name].replace("{robot}", self.origin)
        answer = self.mallory("PUT", f"board/{name}", text)
        assert answer.status in (201, 204), f"{name}: {answer}"

    def value(self, path):
        return http_request("GET", self.at(path), None, {"Authorization": f"Bearer {OLGA}", "Accept": "application/json"}).expect(200).body


def log_in(browser, robot):
    browser.open(robot.at("sample"))
    browser.type("#token", OLGA)
    browser.click("form button")
    browser.until("return !document.getElementById('token') && document.querySelector('header button.small')", "Olga is logged in")


# What may command: a control in the content, except those that show formats and copy.
CONTROLS = "return [...document.querySelectorAll('main form, main input, main select, main canvas, main button, main img')].filter(e => !e.closest('.source, .copyable')).map(e => e.outerHTML.slice(0, 150))"
# The links of the content, except those of formats: [text, address, classes].
LINKS = "return [...document.querySelectorAll('main a')].filter(a => !a.closest('.source, .crumbs')).map(a => [a.innerText, a.href, a.className, a.getAttribute('rel') ?? ''])"
STOP = "return [...document.querySelectorAll('#stops button')].filter(b => { const r = b.getBoundingClientRect(); return document.elementFromPoint(r.left + r.width / 2, r.top + r.height / 2) === b; }).map(b => b.innerText)"


def shown(browser, robot, path):
    """Opens a page, and waits until it has its content."""
    browser.open(robot.at(path))
    browser.until("return document.querySelector('main .source') && !document.querySelector('main[aria-busy]')", f"the page of /{path}")
    browser.until("return document.querySelector('#stops button')", f"the stop at /{path}")


def check_links(browser, robot, path):
    """A link says where it leads: here by its path, elsewhere in full and marked."""
    for text, address, classes, rel in browser.run(LINKS):
        assert address.startswith(("http://", "https://")), (path, address)
        if address.startswith(robot.url) and "foreign" not in classes:
            assert urllib.parse.unquote(address) == robot.origin + text, (path, text, address)
        else:
            assert "foreign" in classes and "noreferrer" in rel and text.startswith("http"), (path, text, address, classes)


# ---- what must hold


def a_graph_is_data_whatever_it_says(browser):
    with Shared() as robot:
        log_in(browser, robot)
        robot.mallory("PUT", "board/victim", "<> <http://x/p> 1 .").expect(201)
        assert robot.mallory("PUT", "gantry/joint1/position", "1", "application/json").status == 403, "Mallory may not move"
        assert robot.mallory("POST", "sample/actions/hang").status == 403
        faults = []
        for name in GRAPHS:
            robot.put_graph(name)
            try:
                shown(browser, robot, f"board/{name}")
                controls = browser.run(CONTROLS)
                assert not controls, controls
                assert browser.text("h1") == f"board/{name}", browser.text("h1")
                assert browser.run(STOP) == ["STOP (ESC)"], browser.run(STOP)
                assert browser.run("return document.querySelectorAll('#tree li > a').length") >= 3
                check_links(browser, robot, name)
            except AssertionError as error:
                faults.append(f"{name}: {str(error)[:300]}")
            if folder and name in ("action", "thing", "schemes", "texts"):
                browser.run("scrollTo(0, 0)")
                browser.screenshot(os.path.join(folder, f"hostile-{name}.png"))
        assert not faults, "\n     " + "\n     ".join(faults)
        for path in ("board", "board?default", "board/notes", "sample", ""):  # all graphs together, and pages that link to them
            shown(browser, robot, path)
            assert browser.run(STOP) == ["STOP (ESC)"], path
        shown(browser, robot, "board?default")
        assert not browser.run(CONTROLS), browser.run(CONTROLS)
        check_links(browser, robot, "board?default")
        assert robot.value("gantry/joint1/position") in ("0", "0.0") and "error" not in robot.value("board/victim")


def a_click_commands_its_own_address_only(browser):
    """Olga presses whatever there is."""
    with Shared() as robot:
        log_in(browser, robot)
        robot.mallory("PUT", "board/victim", "<> <http://x/p> 1 .").expect(201)
        for name in GRAPHS:
            robot.put_graph(name)
        robot.mallory("PUT", "sample/note", '"</p><button>release</button> javascript:alert(1)"', "application/json").expect(204)
        made = robot.mallory("POST", "sample/remarks", '{"text": "Stopped at 12:03", "status": "https://w3id.org/lrt/ns#running"}', "application/json").expect(201).field("Location")
        for path in [f"board/{name}" for name in GRAPHS] + ["board?default", "sample/note", made.removeprefix(robot.url)]:
            shown(browser, robot, path)
            sent = browser.run("""
                const own = fetch, sent = [];
                window.fetch = (iri, how) => { if (!["GET", "HEAD", "OPTIONS"].includes(how?.method ?? "GET")) { sent.push(how.method + " " + iri); return new Promise(() => {}); } return own(iri, how); };
                for (const b of document.querySelectorAll("main button, main input[type=submit]")) b.click();
                for (const f of document.querySelectorAll("main form")) f.requestSubmit();
                window.fetch = own;
                return sent""")
            assert all(s.endswith(" " + browser.url()) and path == "sample/note" for s in sent), (path, sent)
        assert robot.value("gantry/joint1/position") in ("0", "0.0") and robot.value("sample/hangs") == "false"


def a_text_and_a_member_are_text(browser):
    texts = ['<img src=x onerror="document.title=1">', "javascript:alert(1)", "Stopped since 12:03 by olga", "\u202eesaeler", "http://elsewhere.example/", "x" * 5000, "a\nb", "{{title}}"]
    with Shared() as robot:
        log_in(browser, robot)
        for text in texts:
            robot.mallory("PUT", "sample/note", json.dumps(text), "application/json").expect(204)
            robot.mallory("POST", "sample/remarks", json.dumps({"text": text, "status": "https://w3id.org/lrt/ns#succeeded"}), "application/json").expect(201)
            for path in ("sample/note", "sample", "sample/remarks"):
                shown(browser, robot, path)
                start = text.split("\n")[0].replace("\u202e", "")[:40]
                browser.until("return document.querySelector('main').innerText.includes(arguments[0])", f"{start} at {path}", start)
                assert browser.run("return [...document.querySelectorAll('.value a, .members .value button, .value img')].length") == 0
                assert browser.text("h1") in ("Note", "note", "Remarks", "remarks", '<b>Sample</b> & "robot"'), browser.text("h1")
                assert browser.run("return document.documentElement.scrollWidth <= innerWidth"), (path, text[:20])
                assert browser.run(STOP) == ["STOP (ESC)"], path
        heading = browser.run("return [...document.querySelectorAll('h1, h2, h3')].map(e => e.innerText)")
        assert not any("Stopped" in h for h in heading), heading


CASES = [a_graph_is_data_whatever_it_says, a_click_commands_its_own_address_only, a_text_and_a_member_are_text]


def main():
    global folder
    Shared.binary = sys.argv[1]
    folder = sys.argv[2] if len(sys.argv) > 2 else None
    return webdriver.run_cases(CASES, folder, sys.argv[3:])


if __name__ == "__main__":
    sys.exit(main())
