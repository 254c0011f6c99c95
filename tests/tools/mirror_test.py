# SPDX-License-Identifier: Apache-2.0
"""`lrt mirror` with a store in this process, with and without entity tags: what happens to stores and states, URLs that are not those of a robot, and
the exit statuses for what was not done. mirror_stores_test.py does the same with Virtuoso.

usage: mirror_test.py LRT BAXTER ODD_ROBOT
"""

import os
import subprocess
import sys
import tempfile

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "conformance"))
from robot_process import Program, Robot, free_port  # noqa: E402
from graph_store import GraphStore  # noqa: E402
import mirror_faults  # noqa: E402


def faults(make_robot, paths, all_rows=True):
    for tags in (False, True):
        with tempfile.TemporaryDirectory() as folder, GraphStore(tags) as store:
            mirror_faults.check(LRT, make_robot, paths, store, folder, "a store with entity tags" if tags else "a store without entity tags", all_rows)


def lrt(*words):
    return subprocess.run([LRT, "mirror", *words], capture_output=True, text=True, timeout=60)


def statuses():
    """What was not done has a status, and a sentence that says what to do."""
    port = free_port()
    based = f"http://127.0.0.1:{port}/"
    with GraphStore() as store, Robot() as robot, Robot("--public-base", "https://robots.example/cell7", "--allowed-host", "127.0.0.1", port=port):
        to = ["--to", store.url, "--once", "--rate", "0"]
        rows = [
            ("a robot", [robot.url], 0, ""),
            ("by the URL of its host", [robot.url.rstrip("/")], 0, ""),
            ("a public base", [based], 1, 'is a robot whose public base is another one: use "https://robots.example/cell7/"'),
            ("a public base, and a robot", [based, robot.url], 1, 'use "https://robots.example/cell7/"'),
            ("nobody there", ["http://127.0.0.1:1/"], 3, "is not reachable and is marked"),
            ("no such page", [robot.at("nothing")], 3, "404"),
        ]
        for what, urls, status, sentence in rows:
            done = lrt(*urls, *to)
            print(f"{what:30} {done.returncode}  {done.stderr.strip()}")
            assert done.returncode == status and sentence in done.stderr, (what, done)
            assert "1 resources" not in done.stdout, (what, done)
        # A mirror that runs ends too, if there is nothing that it could do.
        done = lrt(based, "--to", store.url)
        assert done.returncode == 1 and "robots.example" in done.stderr, done
        assert not any("robots.example" in name for name in store.content()), store.content().keys()


def identities():
    """Robots with one identity are mirrored, and named: the sentence is that of docs/fleet.md. Robots without one are mirrored by their URLs."""
    with tempfile.TemporaryDirectory() as folder:
        names = {}
        for name in ("r7", "r8"):
            names[name] = os.path.join(folder, name)
            with open(names[name], "w", encoding="ascii") as file:
                file.write('{"iri": "https://robots.example/%s"}' % name)
        with GraphStore() as store, Robot("--identity", names["r7"]) as one, Robot("--identity", names["r7"]) as copied, \
                Robot("--identity", names["r8"]) as third, Robot() as stranger:
            done = lrt(one.url, third.url, stranger.url, "--to", store.url, "--once", "--rate", "0")
            assert done.returncode == 0 and not done.stderr, done
            done = lrt(one.url, copied.url, third.url, "--to", store.url, "--once", "--rate", "0")
            assert done.returncode == 0, done
            with open(os.path.join(HERE, "..", "..", "docs", "fleet.md"), encoding="utf-8") as page:
                text = page.read()
            said = [line[len("lrt: "):] for line in done.stderr.splitlines()]
            assert len(said) == 1, done
            written = [said[0].replace(a, "http://cell8.example:8080/").replace(b, "http://cell7.example:8080/")
                       for a, b in ((one.url, copied.url), (copied.url, one.url))]
            assert any("`" + sentence + "`" in text for sentence in written), said
            content = store.content()
            for robot in (one, copied, third, stranger):
                assert robot.url in content, content.keys()
            assert not any(name.startswith("https://robots.example/") for name in content), content.keys()


def main():
    faults(lambda: Program(ODD_ROBOT), mirror_faults.ODD_ROBOT)  # values of all types
    faults(Robot, mirror_faults.BAXTER, all_rows=False)  # the table of docs/fleet.md
    statuses()
    identities()
    print("passed")


if __name__ == "__main__":
    LRT, Robot.program, ODD_ROBOT = sys.argv[1:4]
    main()
