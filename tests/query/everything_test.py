# SPDX-License-Identifier: Apache-2.0
"""Queries of a whole robot see each document that GET returns, with the same triples: everything_test.py BAXTER

Follows all links from the list of Things. Blank nodes are compared by what is said of them without their labels.
"""

import re
import subprocess
import sys
import urllib.error
import urllib.request

ATTEMPTS = 20  # for values that change between the two requests


def get(url, body=None, kind=None):
    fields = {"Accept": "application/n-triples"}
    if kind:
        fields["Content-Type"] = kind
    try:
        with urllib.request.urlopen(urllib.request.Request(url, body, fields), timeout=30) as response:
            return response.status, response.headers, response.read().decode()
    except urllib.error.HTTPError as error:
        error.read()
        return error.code, error.headers, ""


def triples(text):
    return sorted(re.sub(r"_:[^\s.]+", "_:", line) for line in text.splitlines() if line.strip())


def main():
    robot = subprocess.Popen([sys.argv[1], "--port", "0"], stdout=subprocess.PIPE, text=True)
    same = other = 0
    try:
        root = re.search(r"http://\S+/", robot.stdout.readline()).group()
        known, todo, left_out = {root}, [root], 0
        names = get(root + "sparql", b"CONSTRUCT { ?g a ?g } { GRAPH ?g {} }", "application/sparql-query")[2]
        while todo:
            url = todo.pop()
            status, headers, body = get(url)
            links = set(re.findall(r"<([^>]*)>;", ", ".join(headers.get_all("Link") or []))) | set(re.findall(r"<([^>]*)>", body))
            new = {re.split("[#?]", link)[0] for link in links if link.startswith(root)} - known
            known |= new
            todo += sorted(new)
            if status != 200 or not headers["Content-Type"].startswith("application/n-triples"):
                continue
            if re.search(r"/(state|all)$|/ns/structure$", url):
                left_out += 1
                if f"<{url}>" in names:
                    print(f"{url} is a graph, although it repeats others")
                    other += 1
                continue
            query = "CONSTRUCT { ?s ?p ?o } { GRAPH <%s> { ?s ?p ?o } }" % url
            for _ in range(ATTEMPTS):
                asked = get(root + "sparql", query.encode(), "application/sparql-query")[2]
                if triples(asked) == triples(body):
                    same += 1
                    break
                body = get(url)[2]
            else:
                other += 1
                print(f"{url}: GET has {len(triples(body))} triples, its graph has {len(triples(asked))}")
                for line in sorted(set(triples(body)) ^ set(triples(asked)))[:5]:
                    print("   ", line)
    finally:
        robot.terminate()
        robot.wait(10)
    print(f"{same} documents are graphs, {left_out} repeat others, {other} are different")
    sys.exit(0 if other == 0 and same > 100 else 1)


if __name__ == "__main__":
    main()
