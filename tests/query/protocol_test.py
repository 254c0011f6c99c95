# SPDX-License-Identifier: Apache-2.0
"""The tests of the SPARQL 1.1 Protocol and of the Service Description of the W3C: protocol_test.py QUERY_SERVER SUITE

SUITE has the folders protocol and service-description. The graphs that a test presumes are graphs of a World: the tests' IRIs of them are replaced by
those of this server, in requests and data alike. Prints each test. Fails if one differs that is not in READ_ONLY, or if one of these does not.
"""
import http.client
import json
import os
import re
import subprocess
import sys
import tempfile
import urllib.parse
import xml.etree.ElementTree as ET

try:
    import rdflib
    from rdflib.collection import Collection
except ImportError:
    print("skipped: rdflib is not installed")
    sys.exit(77)

MF = rdflib.Namespace("http://www.w3.org/2001/sw/DataAccess/tests/test-manifest#")
HT = rdflib.Namespace("http://www.w3.org/2011/http#")
CNT = rdflib.Namespace("http://www.w3.org/2011/content#")
SD = rdflib.Namespace("http://www.w3.org/ns/sparql-service-description#")
DATA = "http://kasei.us/2009/09/sparql/data/"
# What differs, and why.
READ_ONLY = dict.fromkeys(
    ["update_dataset_default_graph", "update_dataset_default_graphs", "update_dataset_named_graphs", "update_dataset_full", "update_post_form",
     "update_post_direct", "update_base_uri"],
    "an update is refused with 403: the endpoint only reads (SPARQL 1.1 Protocol 2.2 is optional)")
ENCODINGS = {"UTF-8": "utf-8", "UTF-16": "utf-16"}


def load(path):
    graph = rdflib.Graph()
    graph.parse(path, format="turtle", publicID="file://" + path)
    return graph


class Server:
    def __init__(self, program, suite):
        self.folder = tempfile.TemporaryDirectory()
        arguments = []
        for n in (1, 2, 3):
            with open(os.path.join(suite, "protocol", "data%d.nt" % n)) as data:
                text = data.read().replace("<" + DATA, "<")  # relative to the graph's IRI, which ends with the same name
            copy = os.path.join(self.folder.name, "data%d.ttl" % n)
            with open(copy, "w") as out:
                out.write(text)
            arguments += ["--graph", "data%d.rdf" % n, copy]
        self.process = subprocess.Popen([program, *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.url = re.search(r"http://\S+", self.process.stdout.readline()).group()
        self.authority = urllib.parse.urlsplit(self.url).netloc

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.communicate(timeout=20)
        self.folder.cleanup()

    def placed(self, text):
        """With the IRIs of this server's graphs."""
        ours = self.url + "world/"
        return text.replace(DATA, ours).replace(urllib.parse.quote(DATA, safe=""), urllib.parse.quote(ours, safe=""))

    def ask(self, method, target, headers, body=None):
        connection = http.client.HTTPConnection(self.authority, timeout=20)
        connection.putrequest(method, target, skip_accept_encoding=True)
        for name, value in headers:
            connection.putheader(name, value)
        if body is not None:
            connection.putheader("Content-Length", str(len(body)))
        connection.endheaders(body)
        response = connection.getresponse()
        return response.status, response.getheader("Content-Type", "").split(";")[0], response.read()


def boolean_in(content_type, body):
    if content_type == "application/sparql-results+json":
        return json.loads(body)["boolean"]
    if content_type == "application/sparql-results+xml":
        return ET.fromstring(body).find("{http://www.w3.org/2005/sparql-results#}boolean").text == "true"
    raise ValueError("a boolean in " + content_type)


def check_format(wanted, content_type, body):
    if wanted == "boolean":
        boolean_in(content_type, body)
    elif wanted == "tabular":
        rdflib.query.Result.parse(__import__("io").BytesIO(body), content_type=content_type).bindings
    else:
        assert wanted == "RDF", wanted
        rdflib.Graph().parse(data=body, format=content_type)


def run(server, manifest, test):
    """What differs; empty: nothing."""
    action = manifest.value(test, MF.action)
    for request in Collection(manifest, manifest.value(action, HT.requests)):
        one = lambda predicate: manifest.value(request, predicate)
        target = server.placed(re.sub("^/sparql/", "/sparql", str(one(HT.absolutePath))))
        headers = [(str(manifest.value(h, HT.fieldName)), str(manifest.value(h, HT.fieldValue))) for h in Collection(manifest, one(HT.headers))] if one(HT.headers) else []
        body = None
        if one(HT.body) is not None:
            encoding = ENCODINGS[str(manifest.value(one(HT.body), CNT.characterEncoding))]
            body = server.placed(str(manifest.value(one(HT.body), CNT.chars))).encode(encoding)
        status, content_type, answer = server.ask(str(one(HT.methodName)), target, headers, body)
        expected = one(HT.resp)
        classes = [str(s)[-3] for s in manifest.objects(expected, MF.expectedStatus)]
        if str(status)[0] not in classes:
            return "status %d instead of %s: %r" % (status, "xx or ".join(sorted(classes)) + "xx", answer[:120])
        if (form := manifest.value(expected, MF.expectedFormat)) is not None:
            check_format(str(form), content_type, answer)
        if (truth := manifest.value(expected, MF.expectedBoolean)) is not None and boolean_in(content_type, answer) != truth.toPython():
            return "%s instead of %s" % (boolean_in(content_type, answer), truth)
    return ""


def describe(server, name):
    """The tests of the service description have no data: their names say what is expected."""
    status, content_type, body = server.ask("GET", "/sparql", [("Accept", "text/turtle")])
    if status != 200:
        return "status %d" % status
    graph = rdflib.Graph().parse(data=body, format=content_type, publicID=server.url)
    endpoint = rdflib.URIRef(server.url + "sparql")
    services = list(graph.subjects(rdflib.RDF.type, SD.Service))
    if name == "returns-rdf":
        return "" if len(graph) else "no triples"
    if name == "has-endpoint-triple":
        return "" if (None, SD.endpoint, endpoint) in graph else "no sd:endpoint of " + endpoint
    assert name == "conforms-to-schema", name
    # Domains and ranges of SPARQL 1.1 Service Description 3.
    ranges = {SD.endpoint: None, SD.feature: SD.Feature, SD.resultFormat: None, SD.supportedLanguage: SD.Language, SD.defaultDataset: SD.Dataset}
    for predicate, kind in ranges.items():
        for subject, object_ in graph.subject_objects(predicate):
            if subject not in services:
                return "%s of what is no sd:Service" % predicate
            if isinstance(object_, rdflib.Literal) or (isinstance(object_, rdflib.BNode) and (object_, rdflib.RDF.type, kind) not in graph):
                return "%s of %s" % (predicate, object_)
    for subject, object_ in graph.subject_objects(SD.defaultGraph):
        if (subject, rdflib.RDF.type, SD.Dataset) not in graph or (object_, rdflib.RDF.type, SD.Graph) not in graph:
            return "sd:defaultGraph of no sd:Dataset"
    return "" if len(services) == 1 else "%d services" % len(services)


def main():
    program, suite = sys.argv[1], os.path.abspath(sys.argv[2])
    if not os.path.exists(os.path.join(suite, "protocol", "manifest.ttl")):
        print("skipped: there is no", suite)
        sys.exit(77)
    wrong = passed = known = 0
    with Server(program, suite) as server:
        for folder in ("protocol", "service-description"):
            manifest = load(os.path.join(suite, folder, "manifest.ttl"))
            for entries in manifest.objects(None, MF.entries):
                for test in Collection(manifest, entries):
                    name = str(test).rsplit("#", 1)[1]
                    difference = run(server, manifest, test) if folder == "protocol" else describe(server, name)
                    if name in READ_ONLY:
                        good = "status 403" in difference
                        known += good
                        print("differs" if good else "FAILED", name, "-", READ_ONLY[name] if good else difference or "passes now")
                    else:
                        good = not difference
                        passed += good
                        print("passed" if good else "FAILED", name, difference)
                    wrong += not good
    print("%d passed, %d differ as listed, %d failed" % (passed, known, wrong))
    sys.exit(1 if wrong or not passed else 0)


if __name__ == "__main__":
    main()
