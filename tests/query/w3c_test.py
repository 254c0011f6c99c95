# SPDX-License-Identifier: Apache-2.0
"""The evaluation tests of SPARQL 1.1 and 1.0: w3c_test.py RUN_QUERY SUITE [PATTERN]

Runs each test whose IRI contains PATTERN through run_query, and compares the answer with the expected one. Fails if a test fails that is not
in known_failures.txt, or if one of these passes.
"""
import csv
import io
import itertools
import json
import os
import subprocess
import sys
import xml.etree.ElementTree as ET

try:
    import rdflib
    from rdflib.collection import Collection
    from rdflib.compare import isomorphic
except ImportError:
    print("skipped: rdflib is not installed")
    sys.exit(77)

MF = rdflib.Namespace("http://www.w3.org/2001/sw/DataAccess/tests/test-manifest#")
QT = rdflib.Namespace("http://www.w3.org/2001/sw/DataAccess/tests/test-query#")
RS = rdflib.Namespace("http://www.w3.org/2001/sw/DataAccess/tests/result-set#")
XSD = str(rdflib.XSD)
NUMBERS = {XSD + name: kind for kind, names in {
    int: "integer int long short byte nonNegativeInteger positiveInteger unsignedInt unsignedLong unsignedShort unsignedByte "
         "nonPositiveInteger negativeInteger",
    "decimal": "decimal", float: "float double"}.items() for name in names.split()}


def load(path):
    graph = rdflib.Graph()
    graph.parse(path, format="xml" if path.endswith(".rdf") else "turtle", publicID="file://" + path)
    return graph


def path_of(iri):
    return str(iri)[len("file://"):]


def tests(path, seen):
    """(manifest's graph, node) of each entry, in order."""
    if path in seen:
        return
    seen.add(path)
    manifest = load(path)
    for includes in manifest.objects(None, MF.include):
        for included in Collection(manifest, includes):
            yield from tests(path_of(included), seen)
    for entries in manifest.objects(None, MF.entries):
        for entry in Collection(manifest, entries):
            yield manifest, entry


# A term is a tuple: ("iri", text), ("blank", label), ("literal", text, datatype, language).
def literal(text, datatype=None, language=None):
    language = language.lower() if language else None
    datatype = str(datatype) if datatype else (str(rdflib.RDF.langString) if language else XSD + "string")
    kind = NUMBERS.get(datatype)
    try:  # equal values have several forms, of which the answer may have any
        if kind is float:
            text = repr(float(text.replace("INF", "inf")))
        elif kind == "decimal":
            import decimal
            text = str(decimal.Decimal(text).normalize() + 0)
        elif kind is int:
            text = str(int(text))
    except (ValueError, ArithmeticError):
        pass
    return ("literal", text, datatype, language)


def term(node):
    if isinstance(node, rdflib.URIRef):
        return ("iri", str(node))
    if isinstance(node, rdflib.BNode):
        return ("blank", str(node))
    return literal(str(node), node.datatype, node.language)


class Table:
    def __init__(self, variables, rows):
        self.variables, self.rows = variables, rows  # a row: {variable: term}


def of_json(text):
    document = json.loads(text)
    if "boolean" in document:
        return document["boolean"]
    rows = []
    for binding in document["results"]["bindings"]:
        row = {}
        for name, value in binding.items():
            kind = value["type"]
            if kind == "uri":
                row[name] = ("iri", value["value"])
            elif kind == "bnode":
                row[name] = ("blank", value["value"])
            else:
                row[name] = literal(value["value"], value.get("datatype"), value.get("xml:lang"))
        rows.append(row)
    return Table(document["head"]["vars"], rows)


def of_xml(text):
    ns = "{http://www.w3.org/2005/sparql-results#}"
    root = ET.fromstring(text)
    boolean = root.find(ns + "boolean")
    if boolean is not None:
        return boolean.text.strip() == "true"
    rows = []
    for result in root.iter(ns + "result"):
        row = {}
        for binding in result.findall(ns + "binding"):
            value = binding[0]
            kind, content = value.tag[len(ns):], value.text or ""
            if kind == "uri":
                row[binding.get("name")] = ("iri", content)
            elif kind == "bnode":
                row[binding.get("name")] = ("blank", content)
            else:
                row[binding.get("name")] = literal(content, value.get("datatype"), value.get("{http://www.w3.org/XML/1998/namespace}lang"))
        rows.append(row)
    return Table([v.get("name") for v in root.iter(ns + "variable")], rows)


def of_tsv(text):
    lines = text.split("\n")
    variables = [name.strip()[1:] for name in lines[0].split("\t")] if lines[0].strip() else []
    rows = []
    for line in lines[1:]:
        if not line and variables:
            continue
        if not line:
            continue
        cells, row = line.split("\t"), {}
        for name, cell in zip(variables, cells):
            if cell:
                graph = rdflib.Graph()
                graph.parse(data="<urn:s> <urn:p> " + cell + " .", format="turtle")
                row[name] = term(next(graph.objects()))
        rows.append(row)
    return Table(variables, rows)


def of_graph(graph):
    """A result set as RDF, or None."""
    results = list(graph.subjects(rdflib.RDF.type, RS.ResultSet))
    if not results:
        return None
    boolean = graph.value(results[0], RS.boolean)
    if boolean is not None:
        return str(boolean) in ("true", "1")
    solutions = sorted(graph.objects(results[0], RS.solution), key=lambda s: int(graph.value(s, RS["index"]) or 0))
    rows = []
    for solution in solutions:
        rows.append({str(graph.value(b, RS.variable)): term(graph.value(b, RS.value)) for b in graph.objects(solution, RS.binding)})
    return Table([str(v) for v in graph.objects(results[0], RS.resultVariable)], rows)


def same_row(a, b, there, back):
    """Whether the rows are equal; extends the mapping of blank nodes."""
    if a.keys() != b.keys():
        return False
    added = []
    for name, x in a.items():
        y = b[name]
        if x[0] == "blank" and y[0] == "blank":
            if x[1] in there or y[1] in back:
                if there.get(x[1]) == y[1] and back.get(y[1]) == x[1]:
                    continue
            else:
                there[x[1]], back[y[1]] = y[1], x[1]
                added.append((x[1], y[1]))
                continue
        elif x == y:
            continue
        for p, q in added:
            del there[p], back[q]
        return False
    return added + [True]


def match(expected, found, ordered, there, back):
    if not expected:
        return not found
    row = expected[0]
    for i in range(1 if ordered else len(found)):
        if i >= len(found):
            return False
        added = same_row(row, found[i], there, back)
        if not added:
            continue
        if match(expected[1:], found[:i] + found[i + 1:], ordered, there, back):
            return True
        for p, q in added[:-1]:
            del there[p], back[q]
    return False


def equal_tables(expected, found, ordered, lax):
    if set(expected.variables) != set(found.variables):
        return False
    if lax:
        distinct = [dict(t) for t in {tuple(sorted(row.items())) for row in expected.rows}]
        of_found = [dict(t) for t in {tuple(sorted(row.items())) for row in found.rows}]
        return len(found.rows) <= len(expected.rows) and match(distinct, of_found, False, {}, {})
    if len(expected.rows) != len(found.rows):
        return False
    def key(row):  # rows without blank nodes first: they can be equal in one way only
        return sum(t[0] == "blank" for t in row.values()), sorted((n, t if t[0] != "blank" else ()) for n, t in row.items())
    if ordered:
        return match(expected.rows, found.rows, True, {}, {})
    return match(sorted(expected.rows, key=key), sorted(found.rows, key=key), False, {}, {})


def of_csv(text):
    lines = list(csv.reader(io.StringIO(text)))
    rows = []
    for line in lines[1:]:
        row = {}
        for name, cell in zip(lines[0], line):
            if cell.startswith("_:"):
                row[name] = ("blank", cell)
            elif cell:
                row[name] = ("text", cell)
        rows.append(row)
    return Table(lines[0], rows)


class Runner:
    def __init__(self, program):
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def run(self, fields):
        self.process.stdin.write(("\t".join(fields) + "\n").encode())
        self.process.stdin.flush()
        header = self.process.stdout.readline().split()
        if len(header) != 2:
            raise RuntimeError("run_query ended")
        size = int(header[1])
        text = self.process.stdout.read(size + 1)[:size].decode()
        return header[0].decode(), text


def check(runner, manifest, entry):
    """None: passed; else what is wrong."""
    action = manifest.value(entry, MF.action)
    query = path_of(manifest.value(action, QT.query))
    fields = [query, "file://" + query]
    for data in manifest.objects(action, QT.data):
        fields.append("default=" + path_of(data))
    for data in manifest.objects(action, QT.graphData):
        name = data
        if isinstance(data, rdflib.BNode):
            name = manifest.value(data, rdflib.RDFS.label)
            data = manifest.value(data, QT.graph)
        fields.append("named=" + path_of(data) + "=" + str(name))
    kind, answer = runner.run(fields)
    if kind == "error":
        return answer
    result = path_of(manifest.value(entry, MF.result))
    with open(query, encoding="utf-8") as file:
        ordered = "order by" in " ".join(file.read().lower().split())
    lax = manifest.value(entry, MF.resultCardinality) == MF.LaxCardinality
    if kind == "nt":
        found = rdflib.Graph().parse(data=answer, format="nt")
        expected = load(result)
        return None if isomorphic(found, expected) else "expected\n" + expected.serialize(format="nt") + "found\n" + answer
    found = of_json(answer)
    if result.endswith((".ttl", ".rdf")):
        expected = of_graph(load(result))
        ordered = ordered and (None, RS["index"], None) in load(result)  # `RS.index` would be a function of texts
    else:
        with open(result, encoding="utf-8", newline="") as file:
            text = file.read().replace("\r\n", "\n")
        if result.endswith(".csv"):
            expected = of_csv(text)
            plain = json.loads(answer)
            rows = []
            for binding in plain["results"]["bindings"]:
                rows.append({n: ("blank" if v["type"] == "bnode" else "text", v["value"]) for n, v in binding.items() if v["value"] != ""})
            found = Table(plain["head"]["vars"], rows)
        else:
            expected = {".srx": of_xml, ".srj": of_json, ".tsv": of_tsv}[os.path.splitext(result)[1]](text)
    if isinstance(expected, bool) or isinstance(found, bool):
        good = expected is found
    else:
        good = equal_tables(expected, found, ordered, lax)
    if good:
        return None
    def show(t):
        return str(t) if isinstance(t, bool) else "\n".join(map(str, [t.variables] + t.rows))
    return "expected\n" + show(expected) + "\nfound\n" + show(found)


def main():
    program, suite = sys.argv[1], os.path.abspath(sys.argv[2])
    pattern = sys.argv[3] if len(sys.argv) > 3 else ""
    here = os.path.dirname(os.path.abspath(__file__))
    paths = [os.path.join(here, "..", "conformance", "suites", "sparql", "manifest.ttl")]  # a few of our own
    if os.path.isdir(suite):
        names = ["manifest-sparql11-query.ttl", "manifest-sparql11-results.ttl", "sparql10/manifest-evaluation.ttl"]
        paths += [os.path.join(os.path.realpath(suite), name) for name in names]
    else:
        print("skipped: there is no " + suite)
    known = {}
    with open(os.path.join(here, "known_failures.txt"), encoding="utf-8") as file:
        for line in file:
            line = line.strip()
            if line and not line.startswith("#"):
                iri, _, reason = line.partition(" ")
                known[iri] = reason
    runner, seen, unexpected = Runner(program), set(), []
    sys.setrecursionlimit(10000)
    counts, fixed, total = {}, [], 0
    for manifest, entry in itertools.chain(*(tests(os.path.realpath(path), seen) for path in paths)):
        kinds = set(manifest.objects(entry, rdflib.RDF.type))
        if not kinds & {MF.QueryEvaluationTest, MF.CSVResultFormatTest}:
            continue
        iri = str(entry)
        if pattern not in iri:
            continue
        try:
            wrong = check(runner, manifest, entry)
        except Exception as error:  # one test must not hide the others
            wrong = repr(error)
        folder = "own" if "/conformance/suites/" in iri else "sparql10" if "/data-r2/" in iri else "sparql11"
        passed, failed = counts.get(folder, (0, 0))
        counts[folder] = (passed + (wrong is None), failed + (wrong is not None))
        total += 1
        if wrong is None and iri in known:
            fixed.append(iri)
        if wrong is not None and iri not in known:
            unexpected.append(iri)
            print(iri + "\n  " + wrong.strip().replace("\n", "\n  "))
    for folder, (passed, failed) in sorted(counts.items()):
        print(f"{folder}: {passed} pass, {failed} fail")
    for iri in unexpected:
        print("FAIL " + iri)
    for iri in fixed:
        print("PASSES, but is in known_failures.txt: " + iri)
    sys.exit(1 if unexpected or fixed or total == 0 else 0)


main()
