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


def main():
    with open(sys.argv[2] + "/docs/queries.md", encoding="utf-8") as file:
        text = file.read()
    questions = re.findall(r"```sparql\n(.*?)```\n(?:```csv\n(.*?)```)?", text, re.S)
    if len(questions) != 5:
        sys.exit("expected five questions in docs/queries.md, found %d" % len(questions))
    robot = subprocess.Popen([sys.argv[1], "--port", "0"], stdout=subprocess.PIPE, text=True)
    wrong = 0
    try:
        url = re.search(r"http://\S+/", robot.stdout.readline()).group()
        for query, expected in questions:
            answer = ask(url + "sparql", query).replace(url, "http://127.0.0.1:8080/")
            if not expected:
                # What has changed just now: all that was published when the robot began, if that was less than a second ago. So something is made to change.
                until = time.monotonic() + 30
                while time.monotonic() < until and "/baxter/right_s1/friction," not in answer:
                    put = urllib.request.Request(url + "baxter/right_s1/friction", b"%f" % (1 + (until - time.monotonic()) / 100), {"Content-Type": "application/json"}, method="PUT")
                    urllib.request.urlopen(put, timeout=30).read()
                    answer = ask(url + "sparql", query)
                expected = answer if "/baxter/right_s1/friction," in answer else "a row for /baxter/right_s1/friction\n"
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
