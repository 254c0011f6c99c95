# SPDX-License-Identifier: Apache-2.0
"""The questions of docs/queries.md, asked of the example baxter: each has the answer that the document shows.

    questions_test.py BAXTER SOURCE_DIR
"""

import re
import subprocess
import sys
import time
import urllib.request


def ask(endpoint, query):
    request = urllib.request.Request(endpoint, query.encode(), {"Accept": "text/csv", "Content-Type": "application/sparql-query"})
    with urllib.request.urlopen(request, timeout=30) as response:
        return response.read().decode().replace("\r\n", "\n")


def change(url, number):
    """The friction of a joint becomes another one."""
    put = urllib.request.Request(url + "baxter/right_s1/friction", b"%f" % number, {"Content-Type": "application/json"}, method="PUT")
    urllib.request.urlopen(put, timeout=30).read()


# Each of these asks again when the answer is known, and returns what it lacks.


def changed(url, query):
    """What has changed just now: all that was published when the robot began, if that was less than a second ago. So something is made to change."""
    until, answer = time.monotonic() + 30, ""
    while time.monotonic() < until and "/baxter/right_s1/friction," not in answer:
        change(url, 1 + (until - time.monotonic()) / 100)
        answer = ask(url + "sparql", query)
    return "" if "/baxter/right_s1/friction," in answer else "a row for /baxter/right_s1/friction\n"


def stale(url, query):
    """What is older than no time is all that was published."""
    every = ask(url + "sparql", query.replace("PT10S", "PT0S"))
    return "" if "/baxter/right_s1/friction,P" in every else "a row for /baxter/right_s1/friction\n"


def drops(url, query):
    """A subscriber with a queue of one that wants a message each minute: of five changes, four are dropped, a moment after they were made."""
    wanted = url + "baxter/right_s1/friction?minimumInterval=60&queueLength=1"
    with urllib.request.urlopen(urllib.request.Request(wanted, headers={"Accept": "text/event-stream"}), timeout=30) as stream:
        stream.readline()
        for i in range(5):
            change(url, 2 + i)
            urllib.request.urlopen(url + "baxter/right_s1/friction", timeout=30).read()
        until, rows = time.monotonic() + 30, []
        while time.monotonic() < until and [row[2] for row in rows] != ["4"]:
            rows = [line.split(",") for line in ask(url + "sparql", query).split("\n")[1:] if line]
        if [row[2] for row in rows] != ["4"]:
            return "one row, of four changes that were dropped; %s\n" % rows
        subscription = urllib.request.Request(rows[0][0], headers={"Accept": "application/n-triples"})
        with urllib.request.urlopen(subscription, timeout=30) as got:
            return "" if '<https://w3id.org/lrt/ns#dropped> "4"' in got.read().decode() else "the counter of " + rows[0][0]


ALIVE = {"PT1S": changed, "PT10S": stale, "lrt:dropped": drops}  # questions whose answer changes: by what is in them


def main():
    with open(sys.argv[2] + "/docs/queries.md", encoding="utf-8") as file:
        text = file.read()
    questions = re.findall(r"```sparql\n(.*?)```\n(?:```csv\n(.*?)```)?", text, re.S)
    if len(questions) != 7:
        sys.exit("expected seven questions in docs/queries.md, found %d" % len(questions))
    robot = subprocess.Popen([sys.argv[1], "--port", "0"], stdout=subprocess.PIPE, text=True)
    wrong = 0
    try:
        url = re.search(r"http://\S+/", robot.stdout.readline()).group()
        for query, expected in questions:
            answer = ask(url + "sparql", query).replace(url, "http://127.0.0.1:8080/")
            if not expected:
                lacks = next(check for part, check in ALIVE.items() if part in query)(url, query)
                expected = lacks or answer
            if answer != expected:
                wrong += 1
                print("%s\nexpected:\n%s\nfound:\n%s" % (query, expected, answer))
    finally:
        robot.terminate()
        robot.wait(10)
    print("%d questions, %d wrong" % (len(questions), wrong))
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
