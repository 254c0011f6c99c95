# SPDX-License-Identifier: Apache-2.0
"""How terms are to be used: known, of the right kind, with subjects of their domain and objects of their range, and none that is deprecated."""

import collections

RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
RDFS = "http://www.w3.org/2000/01/rdf-schema#"
OWL = "http://www.w3.org/2002/07/owl#"
XSD = "http://www.w3.org/2001/XMLSchema#"
SH = "http://www.w3.org/ns/shacl#"
LDP = "http://www.w3.org/ns/ldp#"
PROV = "http://www.w3.org/ns/prov#"
HTTP = "http://www.w3.org/2011/http#"
SOSA = "http://www.w3.org/ns/sosa/"
SSN = "http://www.w3.org/ns/ssn/"
QUDT = "http://qudt.org/schema/qudt/"
DCTERMS = "http://purl.org/dc/terms/"
DCAT = "http://www.w3.org/ns/dcat#"
SD = "http://www.w3.org/ns/sparql-service-description#"
XHV = "http://www.w3.org/1999/xhtml/vocab#"
TYPE = RDF + "type"

# Vocabularies of terms.tsv. Without that file they are judged by prefix, like the following ones.
LISTED = (RDF, RDFS, SH, LDP, PROV, HTTP, SOSA, SSN, QUDT, DCTERMS, DCAT, SD, XHV, "http://rdfs.org/ns/void#", "http://www.w3.org/ns/auth/acl#")

# Vocabularies that terms.tsv does not cover, with what lrt or an example has of them.
BY_PREFIX = {
    OWL: "the term lists are ontologies",
    XSD: "datatypes",
    "http://schema.org/": "statements of examples; schema.org is not in the list",
    "http://purl.org/vocab/vann/": "the preferred prefix of the term list",
    "http://qudt.org/vocab/unit/": "units",
    "http://qudt.org/vocab/quantitykind/": "kinds of quantity",
    "http://www.w3.org/2011/http-methods#": "the methods of HTTP in RDF",
    "http://www.w3.org/ns/formats/": "media types, as sd:resultFormat wants them",
    "http://xmlns.com/foaf/0.1/": "foaf:primaryTopic of a description of the dataset",
    "http://www.ontologydesignpatterns.org/ont/dul/DUL.owl#": "statements of examples",
    "http://www.ease-crc.org/ont/SOMA.owl#": "rdfs:seeAlso of the terms of robot descriptions",
    "http://example.org/": "the terms of examples' own",
}

# Deprecated terms and what is used in place of them.
DEPRECATED = {
    QUDT + "dataType": "it left the schema in January 2025: lrt:datatype",
    QUDT + "unit": "qudt:hasUnit",
    SSN + "forProperty": "sosa:forProperty",
    SSN + "hasProperty": "sosa:hasProperty",
}

# Terms of listed vocabularies that are not in terms.tsv: kind, domains, ranges, and where they are from.
ADDED = {
    SOSA + "forProperty": ("property", [], [], "SSN, the edition after 2017"),
    SOSA + "hasProperty": ("property", [], [], "SSN, the edition after 2017"),
    HTTP + "statusCodeValue": ("property", [HTTP + "Response"], [RDFS + "Literal"], "HTTP Vocabulary in RDF 1.0"),
    HTTP + "reasonPhrase": ("property", [HTTP + "Response"], [RDFS + "Literal"], "HTTP Vocabulary in RDF 1.0"),
}

# Superclasses, as the vocabularies state them; terms.tsv has none.
SUPERCLASSES = {
    LDP + "RDFSource": [LDP + "Resource"], LDP + "NonRDFSource": [LDP + "Resource"], LDP + "Container": [LDP + "RDFSource"],
    LDP + "BasicContainer": [LDP + "Container"], LDP + "DirectContainer": [LDP + "Container"], LDP + "IndirectContainer": [LDP + "Container"],
    SH + "NodeShape": [SH + "Shape"], SH + "PropertyShape": [SH + "Shape"], SH + "Shape": [RDFS + "Resource"],
    SH + "ValidationResult": [SH + "AbstractResult"],
    HTTP + "Request": [HTTP + "Message"], HTTP + "Response": [HTTP + "Message"],
    **{HTTP + name: [HTTP + "MessageHeader"] for name in ("EntityHeader", "GeneralHeader", "RequestHeader", "ResponseHeader")},
    SD + "Dataset": [SD + "GraphCollection"],
    OWL + "Class": [RDFS + "Class"], OWL + "ObjectProperty": [RDF + "Property"], OWL + "DatatypeProperty": [RDF + "Property"],
    OWL + "Ontology": [], RDFS + "Datatype": [RDFS + "Class"],
}

# RFC 2616, whose division HTTP Vocabulary in RDF 1.0 has: 7.1 and 4.5. All others are fields of a request.
ENTITY_HEADERS = {"allow", "content-encoding", "content-language", "content-length", "content-location", "content-md5", "content-range", "content-type",
                  "expires", "last-modified"}
GENERAL_HEADERS = {"cache-control", "connection", "date", "pragma", "trailer", "transfer-encoding", "upgrade", "via", "warning"}

# SHACL 2.3.2: of property shapes only.
OF_PROPERTY_SHAPES = [SH + name for name in ("name", "description", "order", "group", "defaultValue")]

DERIVED = {"integer": ["decimal"], "long": ["integer"], "int": ["long"], "short": ["int"], "byte": ["short"], "nonNegativeInteger": ["integer"],
           "unsignedLong": ["nonNegativeInteger"], "unsignedInt": ["unsignedLong"], "unsignedShort": ["unsignedInt"], "unsignedByte": ["unsignedShort"],
           "positiveInteger": ["nonNegativeInteger"], "dayTimeDuration": ["duration"], "dateTimeStamp": ["dateTime"]}


def iri(term):
    return term[1:-1] if term.startswith("<") else None


def is_literal(term):
    return term.startswith('"')


def datatype(literal):
    end = literal.rpartition('"')[2]
    return end[3:-1] if end.startswith("^^") else RDF + "langString" if end.startswith("@") else XSD + "string"


def text(literal):
    return literal[1:literal.rindex('"')]


def space_of(term):
    return term[:max(term.rfind("#"), term.rfind("/")) + 1]


class Definition:
    def __init__(self, kind, domains=(), ranges=()):
        self.kind, self.domains, self.ranges = kind, list(domains), list(ranges)


def standard_terms(shared):
    """By IRI, from SHARED/suites/terms; None without it."""
    path = shared / "suites" / "terms" / "terms.tsv"
    if not path.exists():
        return None
    rows = [line.split("\t") for line in path.read_text(encoding="utf-8").splitlines()]
    terms = {row[0]: Definition(row[1], row[3].split(), row[4].split()) for row in rows}
    assert len(terms) > 1500 and not any(row[2] for row in rows), f"{path} is not as its README says"
    terms.update({term: Definition(*rest[:3]) for term, rest in ADDED.items()})
    return terms


class Judge:
    """Of the documents of a robot, merged.

    @param documents  robot_documents.Documents
    @param lists      URLs of the documents that define terms; the first is that of lrt's terms
    @param standard   standard_terms(); None: their vocabularies are judged by prefix
    """

    def __init__(self, documents, url, lists, standard):
        self.documents, self.url, self.standard = documents, url, standard
        self.wrong = collections.OrderedDict()  # a text: a document that has it
        self.types, self.above, self.subjects = collections.defaultdict(set), collections.defaultdict(set), collections.defaultdict(set)
        for term, above in SUPERCLASSES.items():
            self.above[term].update(above)
        self.defined = collections.defaultdict(lambda: Definition("individual"))
        for triples in documents.of.values():
            for s, p, o in triples:
                p = iri(p)
                self.subjects[s].add(p)
                if p == TYPE:
                    self.types[s].add(iri(o))
                if p == RDFS + "subClassOf":
                    self.above[iri(s)].add(iri(o))
        self.own = {s for url in lists for s, p, _ in documents.of[url] if iri(p) == RDFS + "label"}
        # A Blueprint of a kind is a class, too.
        self.own |= {s for s in self.types if s.startswith(f"<{url}") and RDFS + "Class" in self.types[s]}
        for s in self.own:
            kinds = {upper for stated in self.types[s] for upper in self.closure(stated)}
            self.defined[iri(s)].kind = "class" if RDFS + "Class" in kinds else "property" if RDF + "Property" in kinds else "individual"
        for triples in documents.of.values():
            for s, p, o in triples:
                if s in self.own and iri(p) == RDFS + "domain":
                    self.defined[iri(s)].domains.append(iri(o))
                if s in self.own and iri(p) == RDFS + "range":
                    self.defined[iri(s)].ranges.append(iri(o))

    def closure(self, class_):
        found, todo = {class_}, [class_]
        while todo:
            new = self.above[todo.pop()] - found
            found |= new
            todo += new
        return found

    def report(self, what, where):
        self.wrong.setdefault(what, where)

    def definition(self, term):
        """None: by prefix only."""
        if term in self.defined:
            return self.defined[term]
        if self.standard is not None and term in self.standard:
            return self.standard[term]
        return None

    def is_known(self, term):
        if term in self.defined or (self.standard is not None and term in self.standard):
            return True
        return term.startswith(tuple(BY_PREFIX)) or (self.standard is None and term.startswith(LISTED))

    def has_class(self, node, wanted):
        """False: what is stated of it says otherwise."""
        if wanted in (RDFS + "Resource",):
            return True
        if wanted == RDFS + "Literal" or wanted in (XSD + "anySimpleType", XSD + "anyAtomicType"):
            return is_literal(node)
        if wanted.startswith(XSD) or wanted in (RDF + "langString", RDF + "HTML"):
            return is_literal(node) and self.is_derived(datatype(node), wanted)
        if is_literal(node):
            return False
        known = self.definition(iri(node)) if iri(node) else None
        if wanted == RDFS + "Class" and known:
            return known.kind == "class" or node == f"<{RDF}langString>"
        if wanted == RDF + "Property" and known:
            return known.kind == "property"
        if wanted == RDFS + "Datatype":
            return iri(node) is not None and (iri(node).startswith(XSD) or RDFS + "Datatype" in self.types[node] or node == f"<{RDF}langString>")
        if wanted == RDF + "List":
            return node == f"<{RDF}nil>" or RDF + "first" in self.subjects[node]
        stated = self.types[node]
        return not stated or any(wanted in self.closure(c) for c in stated)

    def is_derived(self, found, wanted):
        if found == wanted:
            return True
        return found.startswith(XSD) and any(self.is_derived(XSD + above, wanted) for above in DERIVED.get(found[len(XSD):], []))

    def judge_end(self, kind, predicate, node, classes, where):
        if not classes or any(self.has_class(node, c) for c in classes):
            return
        stated = datatype(node) if is_literal(node) else " and ".join(sorted(filter(None, self.types[node]))) or "no list, class or property"
        self.report(f"{predicate}: {kind} {' or '.join(classes)}, found {stated}", f"{node[:120]} in {where}")

    def judge_triple(self, s, p, o, where):
        predicate, object_ = iri(p), iri(o)
        for term in filter(None, (predicate, object_, datatype(o) if is_literal(o) else None)):
            if term in DEPRECATED:
                self.report(f"{term} is deprecated: {DEPRECATED[term]}", where)
        definition = self.definition(predicate)
        if predicate not in DEPRECATED:
            if not self.is_known(predicate):
                self.report(f"{predicate} is used as a property and defined nowhere", where)
            elif definition and definition.kind != "property":
                self.report(f"{predicate} is a {definition.kind}, and is used as a property", where)
        if is_literal(o):
            if not datatype(o).startswith((XSD, RDF)) or not self.is_known(datatype(o)):
                self.report(f"{datatype(o)} is no datatype", where)
        elif object_:
            known = self.definition(object_)
            if predicate == TYPE and not self.is_known(object_):
                self.report(f"{object_} is used as a class and defined nowhere", where)
            elif predicate == TYPE and known and known.kind != "class":
                self.report(f"{object_} is a {known.kind}, and is used as a class", where)
            elif self.standard is not None and space_of(object_) in LISTED and object_ != space_of(object_) and not known and object_ not in DEPRECATED:
                self.report(f"{object_} is used as an object and is no term of its vocabulary", where)
        if definition:
            self.judge_end("domain", predicate, s, definition.domains, where)
            self.judge_end("range", predicate, o, definition.ranges, where)
        if predicate in OF_PROPERTY_SHAPES and SH + "path" not in self.subjects[s]:
            self.report(f"{predicate} is of property shapes only", f"{s} in {where}")
        if predicate == HTTP + "fieldName":
            name = text(o).lower()
            wanted = HTTP + ("EntityHeader" if name in ENTITY_HEADERS else "GeneralHeader" if name in GENERAL_HEADERS else "RequestHeader")
            if self.types[s] != {wanted}:
                self.report(f"the field {text(o)} is a {wanted}, found {' and '.join(sorted(self.types[s]))}", where)

    def judge_list(self, url):
        """Each term of lrt's list has label, comment and a vocabulary, and its texts are in English."""
        about = collections.defaultdict(lambda: collections.defaultdict(list))
        for s, p, o in self.documents.of[url]:
            if iri(s):
                about[iri(s)][iri(p)].append(o)
        for term, facts in about.items():
            is_ontology = f"<{OWL}Ontology>" in facts[TYPE]
            for name in (DCTERMS + "title" if is_ontology else RDFS + "label", RDFS + "comment"):
                if [o.endswith('"@en') and len(text(o)) > 0 for o in facts[name]] != [True]:
                    self.report(f"{term} has no {name} in English, or several", url)
            if not is_ontology and len(facts[RDFS + "isDefinedBy"]) != 1:
                self.report(f"{term} has no vocabulary", url)

    def run(self, lrt_list):
        self.judge_list(lrt_list)
        for url, triples in self.documents.of.items():
            for s, p, o in triples:
                self.judge_triple(s, p, o, url)
        return self.wrong
