#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`lrt check` on every example: no requirement fails, also with --strict.

    check_examples_test.py LRT PROGRAM...

Starts each program, lets `lrt check` read it, write the present values of its writable Properties back, and invoke its actions. baxter is checked
on each transport. What an HTTP server that is not lrt's does otherwise is in check_differences.txt, and nothing else may fail there.
"""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True  # nothing is left in the source tree
sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "examples"))
from ex_jwt_test import AUDIENCE, ISSUER, Key, token  # noqa: E402
from examples_graphs_test import ASKED, LEFT_OUT, PREFIXES, Lesson, start  # noqa: E402
from robot_process import HYBRIT, Program, Robot, Way, http_request, objects, plain  # noqa: E402

SERVERS = {"ex_httplib_host": "cpp_httplib", "ex_own_transport": "own_transport"}  # of check_differences.txt
CHECK_TIME = 100  # seconds of one program
MAX_WRITTEN = 8   # Properties of a program
CREDENTIALS = {"t22_rights": {"X-Badge": "bert"}}
WITH_CREDENTIALS = ("t22_rights", "ex_jwt")


def differences(server):
    """Checks that must fail on this server, by their ids."""
    with open(pathlib.Path(__file__).with_name("check_differences.txt")) as lines:
        split = (line.split(None, 2) for line in lines if line.strip() and not line.startswith("#"))
        return {name for of, name, _ in split if of == server}


def writable(program, headers):
    """URLs of Properties that have PUT in Allow."""
    found, known, todo = [], {program.url}, [program.url]
    while todo and len(found) < MAX_WRITTEN and len(known) < 200:
        url = todo.pop(0)
        answer = http_request("GET", url, None, {"Accept": "application/n-triples", **headers})
        if answer.status != 200:
            continue
        for name in ("property", "contains", "hasPart"):
            for namespace in (HYBRIT, "http://www.w3.org/ns/ldp#", "http://purl.org/dc/terms/"):
                for target in map(plain, objects(answer.body, namespace + name, url)):
                    if target in known or not target.startswith(program.url):
                        continue
                    known.add(target)
                    if name == "property":
                        if "PUT" in http_request("OPTIONS", target, None, headers).field("Allow"):
                            found.append(target)
                    else:
                        todo.append(target)
    return found[:MAX_WRITTEN]


def check(lrt, name, program, folder, headers, server=None):
    allowed = differences(server)
    command = [lrt, *(word for field, value in headers.items() for word in ("--header", f"{field}:{value}")),
               "check", program.url, "--format", "json", "--strict", "--resources", "60", "--for", str(CHECK_TIME)]
    for url in writable(program, headers):
        command += ["--write", url]
    for number, (target, turtle) in enumerate(ASKED.get(name, [])):
        body = folder / f"{name}-{number}.ttl"
        body.write_text(PREFIXES + turtle if turtle else "")
        command += ["--invoke", program.at(target), str(body)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=CHECK_TIME + 60, check=False)
    assert done.returncode in (0, 1), f"{name}: {done.returncode} {done.stderr}"
    report = json.loads(done.stdout)
    failed = {f["id"]: f for f in report["findings"] if f["outcome"] == "fail"}
    unexpected = {i: f for i, f in failed.items() if i not in allowed}
    counts = {outcome: sum(f["outcome"] == outcome for f in report["findings"]) for outcome in ("pass", "not_applicable", "not_testable")}
    print(f"{name}: {len(report['resources'])} resources, {report['requests']} requests, {counts['pass']} passed, {len(failed)} failed, "
          f"{counts['not_applicable']} not applicable, {counts['not_testable']} not testable; {command.count('--write')} written, {command.count('--invoke')} invoked")
    for f in unexpected.values():
        print(f"  {f['id']} ({f['level']}): {f['detail']}")
        for e in f["evidence"][:1]:
            print("    > " + e["sent"].replace("\n", "\n    > ") + "\n    < " + e["received"].replace("\n", "\n    < "))
    missing = allowed - set(failed)
    for i in missing:
        print(f"  {i} is listed as a difference of {server} and has not failed")
    return not unexpected and not missing


def main():
    lrt, programs = sys.argv[1], sys.argv[2:]
    good = True
    with tempfile.TemporaryDirectory() as path:
        folder = pathlib.Path(path)
        for program in programs:
            name = os.path.basename(program)
            if name in LEFT_OUT and name not in WITH_CREDENTIALS:
                print(f"{name} is left out: it {LEFT_OUT[name]}")
                continue
            headers = CREDENTIALS.get(name, {})
            if name == "ex_jwt" and not shutil.which("openssl"):
                print("ex_jwt is left out: there is no openssl")
                continue
            if name == "ex_jwt":
                key = Key(path, "provider")
                headers = {"Authorization": "Bearer " + token(key.sign)}
                running = Program(program, key.public, ISSUER, AUDIENCE, "0")
            elif name == "t22_rights":
                running = Lesson(program)
            else:
                running = start(program, folder)
            with running:
                good = check(lrt, name, running, folder, headers, SERVERS.get(name)) and good
            if name != "baxter":
                continue
            Robot.program = program
            Way.set("libwebsockets")
            try:
                running = Robot()
            except AssertionError:
                print("baxter on libwebsockets is left out: this build has no such transport")
            else:
                with running:
                    good = check(lrt, "baxter on libwebsockets", running, folder, {}) and good
            Way.arguments, Way.transport = [], None
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
