#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Generated Turtle documents, some of them damaged, as lrt and rdflib read them.

    turtle_test.py EXCHANGE [DOCUMENTS] [SEED]

EXCHANGE is turtle_exchange. Without rdflib it exits with 77. Every document as generated must be the same graph for both. Of the damaged
ones, those that both accept must be the same graph; rdflib accepts more than the grammar does.
"""
import logging
import random
import re
import subprocess
import sys
import warnings

PREFIXES = ["@prefix p: <http://e/p#> .", "@prefix\nq: <q/> .", "PREFIX\n: <http://e/n/>", "@prefix xsd: <http://www.w3.org/2001/XMLSchema#> ."]
IRIS = ["<http://e/a>", "<http://e/c?q>", "<http://e/d#f>", "<http://e/\u00e9>", "<http://e/\\u0041>", "<http://e/x/../y>", "<x>", "<#f>", "<>", "<../p>",
        "<a/b>", "</r>", "<//o/p>"]  # without <?q>, which rdflib 6.1.1 resolves wrongly
NAMES = ["", "a", "x1", "_u", "\u00e9", "a.b", "a-b", "0a", "a:b", "A%41", "a\\~b", "\u65e5\u672c"]  # without a\., which it refuses
LABELS = ["_:a", "_:c1", "_:0", "_:_x", "_:\u00e9", "_:a.b", "_:a-b"]
BARE = ["1", "-5", "+7", "007", "1.5", "-.5", "+0.25", "1e0", "1.5E-3", "-1.e5", ".5e+1", "true", "false"]
PIECES = ["a", "\u00e9", "\U0001f600", " ", "#", "<", "\\n", "\\t", "\\\\", "\\\"", "\\'", "\\u00e9", "\\U0001F600", "\\b", "\\f", "\\r"]
DAMAGE = "\"'@.,;:[]()#^_ \n\\a1e\u00e9%-+?/u0041Ptrue{}|"


class Generator:
    def __init__(self, seed):
        self.random = random.Random(seed)
        self.any = self.random.choice

    def space(self):
        return self.any([" ", " ", "  ", "\n", "\t", "\r\n", " # c\n"])

    def some(self, least, most, part, separator=""):
        return separator.join(part() for _ in range(self.random.randint(least, most)))

    def iri(self):
        return self.any([self.any(IRIS), self.any(["p:", "q:", ":"]) + self.any(NAMES)])

    def literal(self):
        quotes = self.any(['"', "'", '"""', "'''"])
        text = quotes + self.some(0, 5, lambda: self.any(PIECES + (["\n"] if len(quotes) == 3 else []))) + quotes
        return self.any([self.any(BARE), text, text + self.any(["@en", "@en-gb"]), text + self.any(["^^p:dt", "^^<http://e/dt>", "^^xsd:token"])])

    def object(self, depth):
        kind = self.random.randrange(10 if depth else 8)
        if kind < 8:
            return self.any([self.iri(), self.iri(), self.any(LABELS), self.literal(), self.literal(), "[]"])
        if kind < 9:
            return "(" + self.some(0, 3, lambda: self.space() + self.object(depth - 1)) + self.space() + ")"
        return "[" + self.space() + self.predicates(depth - 1) + self.space() + "]"

    def predicates(self, depth):
        def one():
            verb = self.any(["a", self.iri(), self.iri()])
            return verb + self.space() + self.some(1, 2, lambda: self.object(depth), self.space() + ",")

        return self.some(1, 3, one, self.space() + ";" + self.space()) + self.any(["", "", "", " ;"])

    def statement(self):
        subject = self.any([self.iri(), self.iri(), self.any(LABELS), "( 1 " + self.object(1) + " )", "[ " + self.predicates(1) + " ]"])
        return self.any(["", "", "", "@base <http://b/c/d> . "]) + subject + self.space() + self.predicates(2) + " ."

    def document(self):
        return self.space().join(PREFIXES) + "\n" + self.some(1, 4, self.statement, self.space())

    def damaged(self, text):
        parts = re.split("(<[^<>\\s]*>)", text)  # IRIs stay: rdflib resolves odd ones by rules of its own
        for _ in range(self.random.randint(1, 2)):
            n = self.random.randrange(0, len(parts), 2)
            at = self.random.randrange(len(parts[n]) + 1)
            parts[n] = parts[n][:at] + self.any(["", self.any(DAMAGE)]) + parts[n][at + self.any([0, 1]):]
        return "".join(parts)


def main():
    try:
        import rdflib
        from rdflib.compare import isomorphic
    except ImportError:
        print("skipped: rdflib is not installed (Debian: python3-rdflib)")
        return 77
    warnings.simplefilter("ignore")
    logging.disable(logging.CRITICAL)  # of rdflib, about IRIs and literals
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 300
    generator = Generator(int(sys.argv[3]) if len(sys.argv) > 3 else 13)
    documents = [generator.document() for _ in range(count)]
    documents += [generator.damaged(document) for document in documents]
    output = subprocess.run([sys.argv[1]], input="\0".join(documents).encode(), capture_output=True, timeout=100, check=True).stdout
    ours = output.decode().split("\0")
    accepted = same = wrong = 0
    for n, document in enumerate(documents):
        refused = ours[n].startswith("error: ")
        accepted += not refused
        try:
            theirs = rdflib.Graph().parse(data=document.encode(), format="turtle", publicID="http://base/a/b")
        except Exception:  # rdflib raises what its parts raise
            theirs = None
        if n >= count and (refused or theirs is None):
            continue
        if not refused and theirs is not None and isomorphic(theirs, rdflib.Graph().parse(data=ours[n], format="nt")):
            same += 1
            continue
        wrong += 1
        print(f"--- document {n}, {'refused' if theirs is None else 'accepted'} by rdflib\n{document}\n--- lrt\n{ours[n]}")
    print(f"rdflib {rdflib.__version__}: {len(documents)} documents, lrt accepts {accepted}, {same} the same graph for both, {wrong} not")
    return wrong != 0


if __name__ == "__main__":
    sys.exit(main())
