# SPDX-License-Identifier: Apache-2.0
"""lrt::Client reads an LDP server of others: members of a container, types and values, entity tags.

    solid_test.py PROBE DIR      PROBE is ldp_probe; DIR is for the server's Node packages, fetched there by npm once

The server is the Community Solid Server, unmodified, on loopback with its data in memory. Without node, npm or the registry it exits with 77.
"""
import os
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from robot_process import free_port, until  # noqa: E402

SERVER = "@solid/community-server@7.2.0"
INSTALL_TIMEOUT = 300

probe, folder = sys.argv[1], Path(sys.argv[2])


def skip(why):
    print("skipped:", why)
    sys.exit(77)


def program():
    script = folder / "node_modules/@solid/community-server/bin/server.js"
    for needed in ("node", "npm"):
        if not shutil.which(needed):
            skip(f"there is no {needed}")
    if not script.exists():
        folder.mkdir(parents=True, exist_ok=True)
        command = ["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", SERVER]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=INSTALL_TIMEOUT)
        except subprocess.TimeoutExpired:
            skip(f"npm has not installed the server in {INSTALL_TIMEOUT} s")
        if done.returncode != 0:
            skip("npm cannot install the server: " + done.stderr.strip()[-300:])
    return script


def send(url, method, turtle=None, slug=None):
    fields = {"Content-Type": "text/turtle"}
    if slug:
        fields["Slug"] = slug
    asked = urllib.request.Request(url, None if turtle is None else turtle.encode(), fields, method=method)
    with urllib.request.urlopen(asked, timeout=20) as response:
        return response.headers.get("Location")


def probed(url):
    done = subprocess.run([probe, url], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def main():
    script, port = program(), free_port()
    base = f"http://localhost:{port}/"
    server = subprocess.Popen(["node", str(script), "-p", str(port), "--loggingLevel", "error"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        def responds():
            assert server.poll() is None, "the server has ended"
            try:
                return urllib.request.urlopen(base, timeout=5)
            except OSError:
                return None
        until(responds, "the server responds", 120)

        prefixes = ("@prefix hybrit: <https://hybr-it-projekt.de/ns/hybr-it#> . @prefix vom: <http://vocab.arvida.de/2015/06/vom/vocab#> . "
                    "@prefix ros: <http://ros.org/#> . @prefix ex: <http://example.org/#> .\n")
        arm = send(base, "POST", prefixes + "<> a hybrit:RoboticThing, ros:Joint, ex:Machine ; hybrit:property <#angle> ; ros:rotation <#angle> ; "
                   "ex:weight <weight> . <#angle> vom:numericalValue 4.5 .", "arm")
        weight = send(base, "POST", prefixes + "<> a hybrit:Property ; vom:numericalValue 12 .", "weight")
        lines = probed(base)
        print("\n".join(lines))
        members = int(lines[0].split()[1])
        assert f"thing {arm} https://hybr-it-projekt.de/ns/hybr-it#RoboticThing http://ros.org/#Joint http://example.org/#Machine" in lines
        assert f"value {arm}#angle 4.5" in lines
        assert f"value {weight} 12" in lines
        assert "kept yes" in lines, "the entity tag was not used"

        second = send(base, "POST", prefixes + "<> a hybrit:RoboticThing .", "tool")
        send(weight, "PUT", prefixes + "<> a hybrit:Property ; vom:numericalValue 13 .")
        lines = probed(base)
        assert int(lines[0].split()[1]) == members + 1, lines
        assert any(line.startswith(f"thing {second} ") for line in lines)
        assert f"value {weight} 13" in lines
        send(second, "DELETE")
        assert not any(line.startswith(f"thing {second} ") for line in probed(base))
        print(f"{members + 1} members, two Things and their values were read")
    finally:
        server.terminate()
        server.wait(20)


main()
