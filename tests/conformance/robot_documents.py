# SPDX-License-Identifier: Apache-2.0
"""All documents of a robot, and what they say together."""

import collections
import re
import urllib.parse

N_TRIPLES = "application/n-triples"
MOST = 20000  # documents of a robot; more would be links without end
RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
TRIPLE = re.compile(r'(<[^>]*>|_:\S+) (<[^>]*>) (<[^>]*>|_:\S+|"(?:[^"\\]|\\.)*"(?:\^\^<[^>]*>|@[\w-]+)?) \.$')


def parsed(n_triples):
    """The triples of a document, in its order."""
    found = []
    for line in n_triples.splitlines():
        if line and not line.startswith("#"):
            match = TRIPLE.match(line)
            assert match, f"not a triple: {line}"
            found.append(match.groups())
    return found


def is_blank(term):
    return term.startswith("_:")


class Documents:
    """What a crawler has read of one robot or of several, document by document. A blank node of one document is no blank node of another."""

    def __init__(self):
        self.of = {}  # by URL: a list of triples

    def add(self, url, n_triples):
        number = len(self.of)
        kept = [tuple(f"_:d{number}x{term[2:]}" if is_blank(term) else term for term in triple) for triple in parsed(n_triples)]
        assert url not in self.of, url
        self.of[url] = kept
        return kept

    @staticmethod
    def union(*several):
        """Of several robots. They have different URLs."""
        together = Documents()
        for number, documents in enumerate(several):
            together.take(documents.of, f"r{number}")
        return together

    def take(self, documents, name):
        """Adds documents that were read elsewhere, or at another time: their blank nodes are others."""
        for url, triples in documents.items():
            self.of[url if url not in self.of else f"{url} {name}"] = [tuple(f"_:{name}{t[2:]}" if is_blank(t) else t for t in triple) for triple in triples]

    def objects(self, predicate):
        return {o for triples in self.of.values() for _, p, o in triples if p == f"<{predicate}>"}

    def crawl(self, program):
        """Reads all that the links of header fields and documents lead to."""
        known, todo = {program.url}, [program.url]
        while todo:
            url = todo.pop()
            answer = program.get(url, Accept=N_TRIPLES)
            if answer.status != 200 or not answer.field("Content-Type").startswith(N_TRIPLES):
                # A getter that throws; a value that is unavailable.
                is_unread = {500: "could not be read", 503: "property "}.get(answer.status, "nothing") in str(answer.body)
                assert answer.status in (200, 404, 406) or is_unread, f"{url}: {answer}"  # 404: an example of a template; 406: no RDF
                continue
            triples = self.add(url, answer.body)
            named = re.findall(r"<([^>]*)>", ", ".join(answer.headers.get_all("Link", [])))
            named += [term[1:-1] for triple in triples for term in triple if term.startswith("<")]
            new = {urllib.parse.urldefrag(urllib.parse.urljoin(url, target)).url for target in named} - known
            new = {target for target in new if target.startswith(program.url) and "accept=" not in target}
            known |= new
            todo += sorted(new)
            assert len(known) <= MOST, f"{program.name} has no end"
        return self

    def merged(self):
        return {triple: None for triples in self.of.values() for triple in triples}

    def blanks(self):
        return {term for triples in self.of.values() for triple in triples for term in triple if is_blank(term)}


class Content:
    """What a blank node says: its triples, and those of the blank nodes that it leads to. Equal texts are equal contents."""

    def __init__(self, triples):
        self.about = collections.defaultdict(list)
        for s, p, o in triples:
            if is_blank(s):
                self.about[s].append((p, o))
        self.known = {}

    def text(self, node, above=()):
        if node in above:
            return f"^{above.index(node)}"
        if node not in self.known:
            self.known[node] = " ; ".join(sorted(f"{p} {self.text(o, (*above, node)) if is_blank(o) else o}" for p, o in self.about[node]))
        return f"[ {self.known[node]} ]"

    def size(self, node):
        """How many triples are about it, and about the blank nodes that it leads to."""
        todo, reached = [node], {node}
        for at in todo:
            new = {o for _, o in self.about[at] if is_blank(o)} - reached
            reached |= new
            todo += new
        return sum(len(self.about[at]) for at in reached)


class Double:
    """A place, which is a subject and a predicate with IRIs, to which several documents give a blank node of the same content."""

    def __init__(self, subject, predicate, nodes, size):
        self.subject, self.predicate = subject, predicate
        self.documents = len(nodes)
        self.too_many = len(nodes) - 1
        self.triples = self.too_many * (size + 1)  # about the nodes too many, and those that lead to them


def doubles(documents, without=()):
    """Without documents whose URLs end so."""
    places = collections.defaultdict(dict)  # (subject, predicate, content): {document: node}
    contents = {}
    for url, triples in documents.of.items():
        if url.endswith(tuple(without)):
            continue
        content = contents[url] = Content(triples)
        for s, p, o in triples:
            if not is_blank(s) and is_blank(o):
                places[s, p, content.text(o)][url] = o
    return [Double(s, p, nodes, contents[min(nodes)].size(nodes[min(nodes)])) for (s, p, _), nodes in places.items() if len(nodes) > 1]


def entailed(triples):
    """The triples, and what follows by the rules rdfs2, 3, 5, 7, 9 and 11 of RDFS from what they say of properties and classes."""
    rdfs, rdf_type = "http://www.w3.org/2000/01/rdf-schema#", f"<{RDF}type>"
    kinds = {f"<{rdfs}{name}>": name for name in ("domain", "range", "subClassOf", "subPropertyOf")}
    said = {name: collections.defaultdict(set) for name in kinds.values()}
    for s, p, o in triples:
        if p in kinds:
            said[kinds[p]][s].add(o)
    found, todo = set(triples), list(triples)
    for s, p, o in todo:  # grows
        new = {(s, rdf_type, c) for c in said["domain"][p]} | {(s, above, o) for above in said["subPropertyOf"][p]}
        if not o.startswith('"'):
            new |= {(o, rdf_type, c) for c in said["range"][p]}
        if p == rdf_type:
            new |= {(s, rdf_type, c) for c in said["subClassOf"][o]}
        todo += new - found
        found |= new
    return found
