# SPDX-License-Identifier: Apache-2.0
"""Random bodies: the server judges them as three other SHACL engines do by the shapes that it publishes.

    random_bodies_test.py DIR PROGRAM...

Finds what can be written or invoked by links, as a client does, and makes bodies from the published shapes: some as the shape wants them, most
changed. Each is sent to the server as Turtle. Some programs have variants, most of them of types that they draw; what was accepted is compared
with what the C++ value has. The engines get the same body after the rules by which the server completes it
(docs/modelling.md, "What a body may leave out"), which are written anew here and know the shape alone. A body is accepted or refused by all, or
the test fails. DIR is for what the engines read, and for the Node packages, which are fetched there by npm once. Without node, npm, its
registry, or Apache Jena it exits with 77. LRT_RANDOM_BODIES_SEED, LRT_RANDOM_BODIES and LRT_RANDOM_VARIANTS are the seed, the number of bodies and that of further ones for variants.
"""

import collections
import fractions
import itertools
import math
import os
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import urllib.parse

sys.dont_write_bytecode = True  # nothing is left in the source tree
import jena
from examples_graphs_test import linked, start
from robot_process import HYBRIT, Program, http_request, triples

SEED = int(os.environ.get("LRT_RANDOM_BODIES_SEED", "15"))
BODIES = int(os.environ.get("LRT_RANDOM_BODIES", "1050"))
VARIANTS = int(os.environ.get("LRT_RANDOM_VARIANTS", "300"))
LEAST_JUDGED, LEAST_OF_EACH = 700, 150

PACKAGES = {"rdf-validate-shacl": "0.6.5", "shacl-engine": "0.1.5", "n3": "2.13.12"}
NODE_ENGINES = ("rdf-validate-shacl", "shacl-engine")
HERE = os.path.dirname(os.path.abspath(__file__))

# Whose shape is the user's own: it judges bodies as they are.
LITERAL = {"t11_own_shapes"}

# What draws types of variants.
VARIANT_PROGRAM = "random_variants"

SH, XSD, RDF = "http://www.w3.org/ns/shacl#", "http://www.w3.org/2001/XMLSchema#", "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
VOM, QUDT, UNIT = "http://vocab.arvida.de/2015/06/vom/vocab#", "http://qudt.org/schema/qudt/", "http://qudt.org/vocab/unit/"
MATHS, HTTP = "http://vocab.arvida.de/2015/06/maths/vocab#", "http://www.w3.org/2011/http#"


def iri(text):
    return f"<{text}>"


def sh(name):
    return iri(SH + name)


TYPE, FIRST, REST, NIL, RDF_VALUE = (iri(RDF + name) for name in ("type", "first", "rest", "nil", "value"))
NUMERICAL, VOM_UNIT, HAS_UNIT, FORMER_UNIT = iri(VOM + "numericalValue"), iri(VOM + "unit"), iri(QUDT + "hasUnit"), iri(QUDT + "unit")
QUATERNION = iri(MATHS + "Quaternion")
SELF = "<>"
OTHER_UNITS = {VOM_UNIT: iri(MATHS + "Gon"), HAS_UNIT: iri(UNIT + "FT")}


def literal(text, datatype="string"):
    return f'"{text}"' if datatype == "string" else f'"{text}"^^{iri(XSD + datatype)}'


def is_literal(term):
    return term.startswith('"')


def parts(term):
    """Text and the local name of the XSD datatype, or None."""
    match = re.fullmatch(r'"(.*)"(?:\^\^<' + re.escape(XSD) + r"(\w+)>)?", term, re.S)
    return (match.group(1), match.group(2) or "string") if match else (term, None)


def skip(why):
    print("skipped:", why)
    sys.exit(77)


# ---- numbers

INTEGERS = {
    "integer": (None, None), "long": (-2**63, 2**63 - 1), "int": (-2**31, 2**31 - 1), "short": (-2**15, 2**15 - 1), "byte": (-128, 127),
    "nonNegativeInteger": (0, None), "positiveInteger": (1, None), "nonPositiveInteger": (None, 0), "negativeInteger": (None, -1),
    "unsignedLong": (0, 2**64 - 1), "unsignedInt": (0, 2**32 - 1), "unsignedShort": (0, 2**16 - 1), "unsignedByte": (0, 255),
}
LARGEST = {"double": sys.float_info.max, "float": (2 - 2**-23) * 2.0**127}
REALS = tuple(LARGEST)
NUMBERS = {*INTEGERS, *REALS, "decimal"}
DOUBLE = r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|[+-]?INF|NaN"
DECIMAL = r"[+-]?(\d+(\.\d*)?|\.\d+)"


# Other literals: two that the server takes, and some that it may not.
TEXTS = {
    "boolean": ("true", "0", "false", "1", "TRUE", "yes", "2", ""),
    "dateTime": ("2026-01-02T03:04:05Z", "1999-12-31T23:59:59.25+02:00", "2026-01-02T03:04:05", "2026-02-32T00:00:00Z", "2026-01-02T24:00:00Z",
                 "1600-01-01T00:00:00Z", "2262-04-11T23:47:16Z", "2262-04-11T23:47:17Z", "2026-01-02", "02026-01-02T03:04:05Z",
                 "2026-01-02T03:04:05.1234567891Z", "-0001-01-01T00:00:00Z", "2026-01-02T03:04:05+15:00", "2026-01-02T03:04:60Z"),
    "dayTimeDuration": ("PT1.5S", "-P1DT2H3M", "PT0S", "P1Y", "P1M", "P", "PT", "P1DT", "P1D", "1S", "PT1,5S", "PT1.S", "P1000000D"),
    "duration": ("PT2S", "P1D", "P1Y", "P1M2D", "P0Y", "P", "P1DT", "-PT1M"),
}


def within(number, datatype):
    low, high = INTEGERS[datatype]
    return (low is None or number >= low) and (high is None or number <= high)


def is_number(text, datatype):
    """Whether a literal is well-formed and a number."""
    if datatype in INTEGERS:
        return bool(re.fullmatch(r"[+-]?\d+", text)) and within(int(text), datatype)
    return datatype in NUMBERS and bool(re.fullmatch(DECIMAL if datatype == "decimal" else DOUBLE, text))


def whole(text, datatype):
    """The digits of an integer that is written as 5.0 or 5e0; None: there is a fraction, or no integer type has so many digits."""
    if re.search("N", text) or abs(float(text)) >= 1e20:
        return None
    exact = fractions.Fraction(text)
    if exact.denominator != 1:
        return None
    value = {"decimal": lambda: exact, "double": lambda: float(text), "float": lambda: struct.unpack("f", struct.pack("f", float(text)))[0]}
    return str(int(value[datatype]()))


def holds(wanted, text, datatype):
    """Rule "numbers": whether a number of one datatype has a value of another one."""
    if not is_number(text, datatype):
        return False
    if wanted in INTEGERS:
        digits = text if datatype in INTEGERS else whole(text, datatype)
        return digits is not None and within(int(digits), wanted)
    if "N" in text:
        return True
    if wanted == "float":
        return abs(float(text)) <= LARGEST["float"]
    return datatype == "float" or abs(float(text)) != float("inf")


# ---- shapes

class Shapes:
    """A Blueprint."""

    def __init__(self, text):
        self.text = text
        self.of = collections.defaultdict(list)
        for s, p, o in sorted(triples(text)):
            self.of[s, p].append(o)

    def all(self, node, name):
        return self.of.get((node, sh(name)), [])

    def one(self, node, name):
        found = self.all(node, name)
        return found[0] if found else None

    def count(self, node, name, default):
        found = self.one(node, name)
        return int(parts(found)[0]) if found else default

    def members(self, head):
        found = []
        while head != NIL:
            found.append(self.of[head, FIRST][0])
            head = self.of[head, REST][0]
        return found

    def fields(self, shape):
        """Property shapes with a predicate for a path."""
        return [(path, p) for p in self.all(shape, "property") for path in self.all(p, "path") if path.startswith("<")]

    def list_of(self, shape):
        """The property shapes of the cells and of the members, if the value is a list."""
        cells = members = None
        for p in self.all(shape, "property"):
            path = self.one(p, "path")
            if path.startswith("<"):
                continue
            if self.one(path, "zeroOrMorePath"):
                cells = p
            else:
                members = p
        return (cells, members) if members else None

    def alternatives(self, shape):
        return [a for head in self.all(shape, "or") for a in self.members(head)]

    def variant(self, shape):
        """If the value is exactly one of several: the property shapes of the alternatives by their predicates, and whether there may be none."""
        for head in self.all(shape, "xone"):
            required = [path for m in self.members(head) for path, p in self.fields(m) if self.count(p, "minCount", 0) > 0]
            is_optional = len(self.members(head)) > len(required)
            return {path: p for path, p in self.fields(shape) if path in required}, is_optional
        return {}, False

    def datatypes(self, shape):
        return self.all(shape, "datatype") + [d for a in self.alternatives(shape) for d in self.all(a, "datatype")]


# ---- bodies

class Body:
    def __init__(self, focus):
        self.focus, self.triples, self.blanks = focus, [], 0

    def add(self, *triple):
        if triple not in self.triples:
            self.triples.append(triple)

    def blank(self):
        self.blanks += 1
        return f"_:n{self.blanks}"

    def objects(self, subject, predicate):
        return [o for s, p, o in self.triples if s == subject and p == predicate]

    def subjects(self):
        return list(dict.fromkeys(s for s, _, _ in self.triples))

    def replace(self, old, *new):
        at = self.triples.index(old)
        self.triples[at:at + 1] = [t for t in new if t not in self.triples]

    def remove(self, predicate_holds):
        kept = [t for t in self.triples if not predicate_holds(t)]
        found = len(kept) < len(self.triples)
        self.triples = kept
        return found

    def n_triples(self, url):
        return "".join(" ".join(iri(url) if term == SELF else term for term in t) + " .\n" for t in self.triples)

    def turtle(self, rng):
        """Numbers are written without quotes half of the time."""
        lines = []
        for s, p, o in self.triples:
            text, datatype = parts(o)
            if rng.random() < 0.5 and (
                    (datatype == "integer" and re.fullmatch(r"[+-]?\d+", text)) or (datatype == "decimal" and re.fullmatch(r"[+-]?\d*\.\d+", text)) or
                    (datatype == "double" and re.fullmatch(r"[+-]?(\d+(\.\d*)?|\.\d+)[eE][+-]?\d+", text))):
                o = text
            lines.append(f"{s} {'a' if p == TYPE else p} {o} .\n")
        return "".join(lines)


class Maker:
    """Makes bodies as a shape wants them."""

    def __init__(self, shapes, rng):
        self.shapes, self.rng = shapes, rng

    def body(self, shape, focus):
        body = Body(focus)
        self.node(body, focus, shape)
        return body

    def node(self, body, node, shape):
        classes = self.shapes.all(shape, "class")
        for c in classes:
            body.add(node, TYPE, c)
        alternatives = self.shapes.alternatives(shape)
        if alternatives:
            self.node(body, node, self.rng.choice(alternatives))
        variant, is_optional = self.shapes.variant(shape)
        active = self.rng.choice([*variant, None] if is_optional else list(variant)) if variant else None
        if active:
            body.add(node, active, self.value(body, variant[active]))
        for path, p in self.shapes.fields(shape):
            if path in variant:
                continue
            least, most = self.shapes.count(p, "minCount", 0), self.shapes.count(p, "maxCount", 1)
            if most > 0 and (least > 0 or self.rng.random() < 0.5):
                body.add(node, path, self.value(body, p))
        if QUATERNION in classes and self.rng.random() < 0.8:
            numbers = [(t, float(parts(t[2])[0])) for t in body.triples if t[0] == node and parts(t[2])[1] in REALS]
            length = math.hypot(*(n for _, n in numbers))
            for t, number in numbers:
                body.replace(t, (t[0], t[1], literal(repr(number / length), parts(t[2])[1])))

    def value(self, body, p):
        shapes = self.shapes
        if shapes.one(p, "hasValue"):
            return shapes.one(p, "hasValue")
        if shapes.one(p, "in"):
            return self.rng.choice(shapes.members(shapes.one(p, "in")))
        datatypes = shapes.datatypes(p)
        if datatypes:
            return self.literal(p, self.rng.choice(datatypes))
        of_list = shapes.list_of(p)
        if of_list:
            low, high = shapes.count(of_list[0], "minCount", 1) - 1, shapes.count(of_list[0], "maxCount", 5) - 1
            return self.list(body, [self.value(body, of_list[1]) for _ in range(self.rng.randint(low, high))])
        node = body.blank()
        self.node(body, node, p)
        return node

    @staticmethod
    def list(body, members):
        head = NIL
        for member in reversed(members):
            cell = body.blank()
            body.add(cell, FIRST, member)
            body.add(cell, REST, head)
            head = cell
        return head

    def bounds(self, p):
        found = {name: parts(self.shapes.one(of, name))[0] for name in ("minInclusive", "maxInclusive", "minExclusive", "maxExclusive")
                 for of in [p, *self.shapes.alternatives(p)] if self.shapes.one(of, name)}
        return (float(found.get("minInclusive", found.get("minExclusive", -100))), float(found.get("maxInclusive", found.get("maxExclusive", 100))),
                [found[n] for n in ("minInclusive", "maxInclusive") if n in found])

    def literal(self, p, datatype):
        name = datatype[1:-1].rsplit("#", 1)[-1]
        if name == "string":
            least, most = self.shapes.count(p, "minLength", 0), self.shapes.count(p, "maxLength", 12)
            return literal("".join(self.rng.choice("ab \u00e9") for _ in range(self.rng.randint(least, most))))
        if name == "boolean":
            return literal(self.rng.choice(("true", "false", "1", "0")), name)
        if name in TEXTS:
            return literal(self.rng.choice(TEXTS[name][:2]), name)
        low, high, ends = self.bounds(p)
        if name in INTEGERS:
            low, high = max(low, INTEGERS[name][0] or low), min(high, INTEGERS[name][1] or high)
            return literal(self.rng.randint(int(low), int(high)), name)
        if ends and self.rng.random() < 0.1:
            return literal(self.rng.choice(ends), name)
        if name in REALS:
            number = low + (high - low) * self.rng.uniform(0.01, 0.99)
            return literal(self.rng.choice((f"{number:.6f}", f"{number:.3e}", repr(number))), name)
        raise AssertionError(f"no body for {datatype}")


# ---- changes: each returns False if the body has nothing of the kind

def pick(rng, body, holds_for):
    found = [t for t in body.triples if holds_for(t)]
    return rng.choice(found) if found else None


def numbers_of(t):
    return parts(t[2])[1] in NUMBERS


def change_number(make):
    def change(rng, body, maker):
        t = pick(rng, body, numbers_of)
        if not t:
            return False
        new = make(rng, *parts(t[2]))
        if new is None:
            return False
        body.replace(t, (t[0], t[1], new))
        return True
    return change


def other_datatype(rng, text, datatype):
    if not is_number(text, datatype) or "N" in text:
        return None
    number = float(text)
    made = rng.choice([d for d in sorted(NUMBERS) if d != datatype])
    if made in INTEGERS:
        low, high = INTEGERS[made]
        whole = int(number)
        return literal(max(low if low is not None else whole, min(high if high is not None else whole, whole)), made)
    return literal(f"{number:.4f}", made)


def far(rng, text, datatype):
    return literal(rng.choice(("1000000", "-1000000", "-0.001", "360", "3.5", "-3.5", "60.001")) if datatype in REALS else "99999999999", datatype)


def one_of(*texts, datatype=None):
    return lambda rng, _, own: literal(rng.choice(texts), datatype or own)


def wrong_literal(rng, _, __):
    return rng.choice((literal("1"), literal("true", "boolean"), '"1"@en', literal("2026-01-02T03:04:05Z", "dateTime"),
                       f'"1"^^{iri("urn:example:type")}', iri("urn:example:value"), "_:value"))


def no_class_at_focus(_, body, __):
    return body.remove(lambda t: t[0] == body.focus and t[1] == TYPE)


def no_class(rng, body, _):
    nodes = [s for s in body.subjects() if s != body.focus and body.objects(s, TYPE)]
    node = rng.choice(nodes) if nodes else None
    return body.remove(lambda t: t[0] == node and t[1] == TYPE)


def no_class_at_all(_, body, __):
    return body.remove(lambda t: t[1] == TYPE)


def one_class_less(rng, body, _):
    t = pick(rng, body, lambda t: t[1] == TYPE and len(body.objects(t[0], TYPE)) > 1)
    return bool(t) and body.remove(lambda u: u == t)


def wrong_class(rng, body, _):
    t = pick(rng, body, lambda t: t[1] == TYPE)
    if not t:
        return False
    body.remove(lambda u: u[0] == t[0] and u[1] == TYPE)
    body.add(t[0], TYPE, iri("urn:example:Other"))
    return True


def further_class(rng, body, _):
    t = pick(rng, body, lambda t: True)
    if not t:
        return False
    body.add(t[0], TYPE, iri("urn:example:Other"))
    return True


def missing(rng, body, _):
    t = pick(rng, body, lambda t: t[1] != TYPE)
    return bool(t) and body.remove(lambda u: u == t)


def two_values(rng, body, maker):
    t = pick(rng, body, lambda t: t[1] not in (TYPE, FIRST, REST))
    if not t:
        return False
    _, datatype = parts(t[2])
    if datatype in NUMBERS:
        body.add(t[0], t[1], literal("1", datatype))
        body.add(t[0], t[1], literal("2", datatype))
    elif is_literal(t[2]):
        body.add(t[0], t[1], literal("another", datatype or "string"))
    elif t[1] in OTHER_UNITS:
        body.add(t[0], t[1], OTHER_UNITS[t[1]])
    else:
        copy = body.blank()
        for s, p, o in list(body.triples):
            if s == t[2]:
                body.add(copy, p, o)
        body.add(t[0], t[1], copy)
    return True


def unit_places(body, maker):
    """Nodes with a unit, and its names in both vocabularies as the shapes have them."""
    pairs = {}
    for (_, predicate), found in maker.shapes.of.items():
        if predicate != sh("property"):
            continue
        wanted = {path: maker.shapes.one(p, "hasValue") or (maker.shapes.members(maker.shapes.one(p, "in"))[0] if maker.shapes.one(p, "in") else None)
                  for p in found for path in maker.shapes.all(p, "path") if path in OTHER_UNITS}
        for path, unit in wanted.items():
            if unit:
                pairs[path, unit] = {k: v for k, v in wanted.items() if v}
    return [(t, pairs[t[1], t[2]]) for t in body.triples if (t[1], t[2]) in pairs]


def change_unit(make):
    def change(rng, body, maker):
        places = unit_places(body, maker)
        if not places:
            return False
        t, names = rng.choice(places)
        body.remove(lambda u: u[0] == t[0] and u[1] in OTHER_UNITS)
        for predicate, unit in make(rng, names):
            body.add(t[0], predicate, unit)
        return True
    return change


def both_units(_, names):
    return list(names.items())


def qudt_unit(_, names):
    return [(HAS_UNIT, names[HAS_UNIT])] if HAS_UNIT in names else list(names.items())


def former_unit(_, names):
    return [(FORMER_UNIT, names[HAS_UNIT])] if HAS_UNIT in names else list(names.items())


def wrong_unit(rng, names):
    p = rng.choice(list(names))
    return [(p, OTHER_UNITS[p])]


def units_disagree(rng, names):
    p = rng.choice(list(OTHER_UNITS))
    return [(p, OTHER_UNITS[p]), *((q, u) for q, u in names.items() if q != p)]


def two_units(rng, names):
    p = rng.choice(list(names))
    return [*names.items(), (p, OTHER_UNITS[p])]


def text_unit(rng, names):
    return [(rng.choice(list(names)), literal("deg"))]


def extra_triples(rng, body, _):
    node = rng.choice(body.subjects()) if body.triples else SELF
    body.add(node, iri("urn:example:more"), rng.choice((literal("more"), iri("urn:example:x"), literal("3", "integer"))))
    if rng.random() < 0.5:
        body.add(iri("urn:example:elsewhere"), iri("urn:example:more"), literal("more"))
    if rng.random() < 0.5 and body.focus == SELF:
        body.add(SELF, iri("http://purl.org/dc/terms/modified"), literal("2026-01-02T03:04:05Z", "dateTime"))
        body.add(SELF, TYPE, iri(HYBRIT + "Property"))
    return True


def list_change(rng, body, _):
    t = pick(rng, body, lambda t: t[1] == REST)
    if not t:
        return False
    cell, _, rest = t
    kind = rng.randrange(7)
    if kind == 0:  # longer
        body.replace(t, (cell, REST, "_:more"), ("_:more", FIRST, body.objects(cell, FIRST)[0]), ("_:more", REST, rest))
    elif kind == 1:  # shorter
        body.replace(t, (cell, REST, NIL)) if rest != NIL else body.remove(lambda u: u[0] == cell)
    elif kind == 2:  # no end
        body.remove(lambda u: u == t)
    elif kind == 3:  # in a circle
        body.replace(t, (cell, REST, cell))
    elif kind == 4:  # two rests
        body.add(cell, REST, NIL if rest != NIL else "_:more")
    elif kind == 5:  # a member that is a literal
        first = body.objects(cell, FIRST)
        if not first:
            return False
        body.replace((cell, FIRST, first[0]), (cell, FIRST, literal("x")))
    else:  # two members in a cell
        body.add(cell, FIRST, literal("1.5", "double"))
    return True


def wrong_node(rng, body, _):
    t = pick(rng, body, lambda t: t[1] not in (TYPE, FIRST, REST))
    if not t:
        return False
    body.replace(t, (t[0], t[1], rng.choice((literal("x"), literal("1.5", "double"), iri("urn:example:x"), "_:nothing"))))
    return True


def wrong_text(rng, body, _):
    t = pick(rng, body, lambda t: parts(t[2])[1] == "string")
    if not t:
        return False
    body.replace(t, (t[0], t[1], rng.choice((literal("nothing of the kind"), literal(""), '"idle"@en', literal("1", "integer")))))
    return True


def other_text(rng, body, _):
    t = pick(rng, body, lambda t: parts(t[2])[1] in TEXTS)
    if not t:
        return False
    _, datatype = parts(t[2])
    made = "duration" if "uration" in datatype and rng.random() < 0.3 else datatype
    body.replace(t, (t[0], t[1], literal(rng.choice(TEXTS[made]), made)))
    return True


def second_candidate(rng, body, _):
    for _, p, o in [t for t in body.triples if t[0] == body.focus]:
        body.add("_:second", p, o)
    return body.focus != SELF or rng.random() < 0.5


def nothing(_, body, __):
    return body.remove(lambda t: True)


def alternatives_in(body, maker):
    """The triples of alternatives, with the others of the same variant."""
    of = {}
    for shape in [s for s, p in maker.shapes.of if p == sh("xone")]:
        variant, _ = maker.shapes.variant(shape)
        of.update({path: variant for path in variant})
    return [(t, of[t[1]]) for t in body.triples if t[1] in of]


def several_alternatives(rng, body, maker):
    found = [(t, variant) for t, variant in alternatives_in(body, maker) if len(variant) > 1]
    if not found:
        return False
    t, variant = rng.choice(found)
    others = [path for path in variant if path != t[1]]
    for path in rng.sample(others, rng.choice((1, 1, 1, len(others)))):
        body.add(t[0], path, maker.value(body, variant[path]))
    return True


def no_alternative(rng, body, maker):
    found = alternatives_in(body, maker)
    if not found:
        return False
    t, _ = rng.choice(found)
    return body.remove(lambda u: u == t)


def another_alternative(rng, body, maker):
    """Under the predicate of one, what another one has."""
    found = [(t, variant) for t, variant in alternatives_in(body, maker) if len(variant) > 1]
    if not found:
        return False
    t, variant = rng.choice(found)
    body.replace(t, (t[0], rng.choice([path for path in variant if path != t[1]]), t[2]))
    return True


UNCHANGED = "as the shape wants it"
OVERFLOW = "number too large for its datatype"
CHANGES = {
    "no class at the focus": no_class_at_focus,
    "no class inside": no_class,
    "no class at all": no_class_at_all,
    "one class less": one_class_less,
    "wrong class": wrong_class,
    "further class": further_class,
    "missing value": missing,
    "two values": two_values,
    "other number type": change_number(other_datatype),
    "wrong literal": change_number(wrong_literal),
    "ill-typed number": change_number(one_of("abc", "", "1,5", "0x10", "1e", "--1", " ")),
    "out of bounds": change_number(far),
    "NaN or infinity": change_number(one_of("NaN", "INF", "-INF")),
    "NaN of the other type": change_number(lambda rng, _, own: literal(rng.choice(("NaN", "INF")), "float" if own == "double" else "double")),
    OVERFLOW: change_number(lambda rng, _, own: literal("1e400", own) if own in REALS else None),
    "other unit name": change_unit(qudt_unit),
    "former unit name": change_unit(former_unit),
    "both unit names": change_unit(both_units),
    "wrong unit": change_unit(wrong_unit),
    "units disagree": change_unit(units_disagree),
    "two units": change_unit(two_units),
    "no unit": change_unit(lambda rng, names: []),
    "unit as text": change_unit(text_unit),
    "extra triples": extra_triples,
    "list": list_change,
    "wrong node": wrong_node,
    "wrong text": wrong_text,
    "other boolean, time or duration": other_text,
    "several alternatives": several_alternatives,
    "no alternative": no_alternative,
    "another alternative's content": another_alternative,
    "second candidate": second_candidate,
    "nothing": nothing,
}


# ---- the server's rules, by the shape

def focus_of(body, wanted):
    """Rule "focus": <>, also of an empty body, else the one node of the class, else the one blank node that has no class and is no object."""
    if SELF in body.subjects() or not body.triples:
        return SELF
    found = [s for s in body.subjects() if wanted and wanted in body.objects(s, TYPE)]
    if not found:
        found = [s for s in body.subjects() if s.startswith("_:") and not body.objects(s, TYPE) and all(o != s for _, _, o in body.triples)]
    return found[0] if len(found) == 1 else None


class Completion:
    def __init__(self, shapes, body):
        self.shapes, self.body, self.added, self.replaced = shapes, body, [], {}
        for s, p, o in list(body.triples):  # rule "former unit"
            if p == FORMER_UNIT:
                body.add(s, HAS_UNIT, o)

    def run(self, shape, focus):
        self.node(shape, focus, set())
        done = Body(focus)
        for t in self.body.triples:
            done.add(*self.replaced.get(t, t))
        for t in self.added:
            done.add(*t)
        return done

    def node(self, shape, node, way):
        if (shape, node) in way:
            return
        way = way | {(shape, node)}
        wanted, found = self.shapes.all(shape, "class"), self.body.objects(node, TYPE)
        if not found or any(c in found for c in wanted):  # rule "classes"
            self.added += [(node, TYPE, c) for c in wanted if c not in found]
        fields = self.shapes.fields(shape)
        vom = next((self.shapes.one(p, "hasValue") for path, p in fields if path == VOM_UNIT), None)
        qudt = next((self.shapes.members(self.shapes.one(p, "in"))[0] for path, p in fields if path == HAS_UNIT and self.shapes.one(p, "in")), None)
        if vom and qudt and qudt in self.body.objects(node, HAS_UNIT) and not self.body.objects(node, VOM_UNIT):  # rule "units"
            self.added.append((node, VOM_UNIT, vom))
        for path, p in fields:
            for o in self.body.objects(node, path):
                self.value(p, (node, path, o), way)
        for alternative in self.shapes.alternatives(shape):
            if any(self.body.objects(node, path) for path, p in self.shapes.fields(alternative) if self.shapes.count(p, "maxCount", 1) > 0):
                self.node(alternative, node, way)

    def value(self, p, t, way):
        o = t[2]
        if is_literal(o):
            text, datatype = parts(o)
            wanted = [d[1:-1].rsplit("#", 1)[-1] for d in self.shapes.datatypes(p)]
            if len(wanted) == 1 and wanted[0] in NUMBERS and datatype != wanted[0] and datatype in NUMBERS and holds(wanted[0], text, datatype):
                if wanted[0] in INTEGERS and datatype not in INTEGERS:
                    text = whole(text, datatype)
                self.replaced[t] = (t[0], t[1], literal(text, wanted[0]))  # rule "numbers"
            return
        of_list = self.shapes.list_of(p)
        if not of_list:
            return self.node(p, o, way)
        cells, known = [o], set()
        while cells:
            cell = cells.pop()
            if cell in known:
                continue
            known.add(cell)
            for member in self.body.objects(cell, FIRST):
                self.value(of_list[1], (cell, FIRST, member), way)
            cells += self.body.objects(cell, REST)


# ---- what a body means

def said(shapes, p, body, o):
    """The names of the alternatives in a value, from outside, as the robot says them of its C++ value."""
    if is_literal(o) or shapes.datatypes(p) or shapes.one(p, "in"):
        return ""
    of_list = shapes.list_of(p)
    if of_list:
        members = []
        while o != NIL:
            members.append(said(shapes, of_list[1], body, body.objects(o, FIRST)[0]))
            o = body.objects(o, REST)[0]
        return f"[{','.join(members)}]"
    return said_of_node(shapes, p, body, o)


def said_of_node(shapes, shape, body, node):
    fields = shapes.fields(shape)
    if any(path == NUMERICAL for path, _ in fields):
        return ""
    if any(path == RDF_VALUE for path, _ in fields):
        found = body.objects(node, RDF_VALUE)
        return said(shapes, dict(fields)[RDF_VALUE], body, found[0]) if found else "absent"
    variant, _ = shapes.variant(shape)
    if variant:
        active = [path for path in variant if body.objects(node, path)]
        assert len(active) <= 1, active
        if not active:
            return "absent"
        inner = said(shapes, variant[active[0]], body, body.objects(node, active[0])[0])
        return re.split("[/#]", active[0][:-1])[-1] + (f"/{inner}" if inner else "")
    # The shapes have no order of their own; the names of fields are compared sorted.
    texts = []
    for path, p in fields:
        found = body.objects(node, path)
        inner = said(shapes, p, body, found[0]) if found else "absent"
        texts.append(f"{re.split('[/#]', path[:-1])[-1]}:{inner}")
    return "{" + ",".join(sorted(texts)) + "}" if texts else ""


def sorted_fields(text):
    """What the robot says, with the fields of each record sorted."""
    def read(at):
        pieces, piece, close = [], "", {"{": "}", "[": "]"}
        while at < len(text) and text[at] not in "}]":
            if text[at] in close:
                inner, end = read(at + 1)
                piece += text[at] + ",".join(sorted(inner) if text[at] == "{" else inner) + close[text[at]]
                at = end + 1
            elif text[at] == ",":
                pieces.append(piece)
                piece, at = "", at + 1
            else:
                piece += text[at]
                at += 1
        return [*pieces, piece], at
    return ",".join(read(0)[0])


def check_meaning(target, body, turtle):
    """The C++ value has what an accepted body says."""
    if target.program.name != VARIANT_PROGRAM or target.method != "PUT":
        return False
    found = sorted_fields(http_request("GET", target.url + "Said", None, {"Accept": "text/plain"}).expect(200).body)
    expected = said_of_node(target.shapes, target.shape, body, body.focus) if body.triples else "absent"
    assert found == expected, f"the C++ value of {target.url} has {found}, the body says {expected}\n{turtle}"
    return True


# ---- what is published

Target = collections.namedtuple("Target", "program method url shapes shape wanted file")


def targets_of(program, folder):
    """What has a binding with a body that conforms to a shape, by links from the root."""
    known, todo, found, blueprints = {program.url}, [program.url], [], {}
    while todo:
        url = todo.pop()
        answer = program.get(url, Accept="application/n-triples").expect(200)
        graph = Shapes(answer.body)
        for binding in graph.of[iri(url), iri(HYBRIT + "binding")]:
            method = graph.of[binding, iri(HTTP + "mthd")][0][1:-1].rsplit("#", 1)[-1]
            for body in graph.of[binding, iri(HTTP + "body")]:
                for shape in graph.of[body, iri("http://purl.org/dc/terms/conformsTo")]:
                    document = urllib.parse.urldefrag(shape[1:-1]).url
                    if document not in blueprints:
                        blueprint = Shapes(program.n_triples(document))
                        name = f"{program.name}-{len(blueprints)}.nt"
                        (folder / name).write_text(blueprint.text)
                        blueprints[document] = blueprint, name
                    shapes, name = blueprints[document]
                    # An action's resource has sh:targetClass, a Property's binding the class of the body.
                    classes = graph.of.get((shape, sh("targetClass"))) or graph.of.get((body, TYPE)) or [None]
                    found.append(Target(program, method, graph.of[binding, iri(HTTP + "requestURI")][0][1:-1], shapes, shape, classes[0], name))
        new = {u for u in linked(program, url, answer) if not re.search(r"/(all|state|subscriptions)$|/ns/", u)} - known
        known |= new
        todo += sorted(new)
    return found


def made(rng, targets):
    """An input, a body for it and what was changed."""
    for attempt in itertools.count():
        if attempt % 100 == 0:  # not all targets have something of each kind
            name = rng.choice(list(CHANGES)) if rng.random() < 0.85 else UNCHANGED
        target = rng.choice(rng.choice(targets))
        maker = Maker(target.shapes, rng)
        body = maker.body(target.shape, rng.choice((SELF, SELF, "_:focus", iri("urn:example:focus"))))
        if name == UNCHANGED:
            return target, body, name
        if not CHANGES[name](rng, body, maker):
            continue
        if name != OVERFLOW and rng.random() < 0.15:
            CHANGES[rng.choice([n for n in CHANGES if n != OVERFLOW])](rng, body, maker)
            name = "two changes"
        return target, body, name


# ---- the engines

# What an engine judges otherwise than the specifications say, with the reason. Such a body is compared with the others alone. (That a month has at
# most 31 days is all that any of the three checks.)
FAULTS = {
    ("rdf-validate-shacl", "takes a number with two signs for well-formed (XML Schema 1.1 part 2, 3.3.3.1 and 3.3.5.2)"):
        lambda body: any(re.match(r"[+-]{2}", text) for text, datatype in literals(body) if datatype in NUMBERS),
    ("rdf-validate-shacl", "counts the digits of a time and does not read them (the same, 3.3.7.2)"):
        lambda body: any(re.search(r":60|\+15:00", text) for text, datatype in literals(body) if datatype == "dateTime"),
    ("shacl-engine", "judges no focus node when the data graph is empty (SHACL 2.1.3: a focus node need not be in it)"):
        lambda body: not body.triples,
}


def literals(body):
    return [parts(o) for _, _, o in body.triples]


def node_packages(folder):
    """The Node packages, in a folder of the build."""
    if not shutil.which("node") or not shutil.which("npm"):
        skip("there is no node, or no npm")
    if not all((folder / "node_modules" / name / "package.json").exists() for name in PACKAGES):
        wanted = [f"{name}@{version}" for name, version in PACKAGES.items()]
        done = subprocess.run(["npm", "install", "--prefix", str(folder), "--no-save", "--no-audit", "--no-fund", "--ignore-scripts", *wanted],
                              cwd=folder, capture_output=True, text=True, timeout=200, check=False)
        if done.returncode != 0:
            skip(f"npm cannot install {' '.join(wanted)}: {done.stderr.strip()[-300:]}")


def engines(folder):
    node_packages(folder)
    found = {name: ["node", os.path.join(HERE, "random_bodies_node.mjs"), str(folder)] for name in NODE_ENGINES}
    found["Apache Jena"] = jena.command("RandomBodies.java", folder)
    return found


def judged_by(engine, command, documents):
    words = [*command, str(documents), *([engine] if engine in NODE_ENGINES else [])]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, f"{engine} ended with {done.returncode}: {done.stderr[-1000:]}"
    return {int(number): verdict for number, verdict in (line.split(" ", 1) for line in done.stdout.splitlines())}


Sent = collections.namedtuple("Sent", "number target change turtle status judged accepted beyond faulty has_meaning")


def beyond_shapes(body):
    """What the server refuses and no SHACL Core shape can state (docs/modelling.md): the reason, or None."""
    for node in body.subjects():
        if QUATERNION in body.objects(node, TYPE):
            numbers = [parts(o)[0] for c in "xyzw" for o in body.objects(node, iri(MATHS + c))]
            if all(is_number(n, "double") for n in numbers) and abs(math.hypot(*map(float, numbers)) - 1) > 1e-9:
                return "the norm of a quaternion is not 1"
    names = [o for node in body.subjects() for o in body.objects(node, iri("http://schema.org/name"))]
    if len(names) > len(set(names)):
        return "a map has a key twice"
    for text, datatype in literals(body):
        if datatype in REALS and is_number(text, datatype) and "N" not in text and abs(float(text)) > LARGEST[datatype]:
            return "a number overflows its datatype"
        days = re.match(r"-?P(\d+)D", text)
        if datatype in ("duration", "dayTimeDuration") and days and int(days.group(1)) > 106751:
            return "a duration is longer than 292 years"
    return None


def send(number, target, body, change, rng, out):
    turtle = body.turtle(rng)
    answer = http_request(target.method, target.url, turtle, {"Content-Type": "text/turtle", "Accept": "text/turtle"})
    assert answer.status in (200, 202, 204, 409, 422), f"{target.method} {target.url}: {answer}\n{turtle}"
    focus = focus_of(body, target.wanted)
    beyond, faulty, has_meaning = None, set(), False
    if focus:
        literally = target.program.name in LITERAL
        done = body if literally or not body.triples else Completion(target.shapes, body).run(target.shape, focus)
        beyond = beyond_shapes(done)
        faulty = {fault for fault, holds_for in FAULTS.items() if holds_for(done)}
        done.add(iri("urn:example:marker"), iri("urn:focus"), focus)
        out.write(f"= {number} {target.file} {target.shape[1:-1]}\n{done.n_triples(target.url)}")
        if answer.status == 204:
            done.focus = focus
            has_meaning = check_meaning(target, done, turtle)
    return Sent(number, target, change, turtle, answer.status, bool(focus), answer.status != 422, beyond, faulty, has_meaning)


def main():
    folder = pathlib.Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    commands = engines(folder)
    documents = folder / "bodies"
    shutil.rmtree(documents, ignore_errors=True)
    documents.mkdir()
    rng = random.Random(SEED)
    programs, sent = [], []
    try:
        for path in sys.argv[2:]:
            if os.path.basename(path) == "random_bodies_robot":
                programs += [Program(path), Program(path, str(SEED))]
                programs[-1].name = VARIANT_PROGRAM
            else:
                programs.append(start(path, documents))
        targets = {program.name: targets_of(program, documents) for program in programs}
        assert all(targets.values()), {name: len(found) for name, found in targets.items()}
        variants = targets[VARIANT_PROGRAM]
        with open(documents / "bodies.txt", "w", encoding="utf-8") as out:
            for number in range(BODIES):
                sent.append(send(number, *made(rng, list(targets.values())), rng, out))
            for number in range(BODIES, BODIES + VARIANTS):
                sent.append(send(number, *made(rng, [variants]), rng, out))
    finally:
        for program in programs:
            program.kill()
    return compare(sent, commands, documents, sum(map(len, targets.values())))


def compare(sent, commands, documents, inputs):
    verdicts = {engine: judged_by(engine, command, documents) for engine, command in commands.items()}
    totals, beyond, faults, differ = collections.defaultdict(collections.Counter), collections.Counter(), collections.Counter(), 0
    for s in sent:
        said = {engine: found.get(s.number) for engine, found in verdicts.items() if engine not in {name for name, _ in s.faulty}} if s.judged else {}
        faults.update(s.faulty)
        if s.beyond and not s.accepted and set(said.values()) == {"1"}:
            beyond[s.beyond] += 1
            continue
        verdict = "accepted" if s.accepted else "refused"
        totals[s.change][verdict if s.judged else f"{verdict} without a focus node"] += 1
        if (s.judged and any(v != str(int(s.accepted)) for v in said.values())) or (not s.judged and s.accepted):
            differ += 1
            print(f"{s.number} ({s.change}): {s.target.method} {s.target.url} is {s.status}, {said or 'no focus node'}\n{s.turtle}")
    for change, counts in sorted(totals.items()):
        print(f"{change:35} {', '.join(f'{n} {what}' for what, n in sorted(counts.items()))}")
    for reason, n in beyond.items():
        print(f"not compared, for no shape can state it: {reason}: {n} conform and are refused")
    for (engine, reason), n in faults.items():
        print(f"not compared with {engine}, which {reason}: {n}")
    accepted, refused = (sum(counts[verdict] for counts in totals.values()) for verdict in ("accepted", "refused"))
    print(f"seed {SEED}: {len(sent)} bodies to {inputs} inputs; the server and {', '.join(commands)} judged {accepted + refused}: "
          f"{accepted} accepted, {refused} refused, {differ} differ")
    meant = sum(s.has_meaning for s in sent)
    print(f"of {meant} accepted bodies the C++ values have the alternatives that the bodies say")
    assert meant >= VARIANTS // 4
    assert accepted + refused >= LEAST_JUDGED and accepted >= LEAST_OF_EACH and refused >= LEAST_OF_EACH
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
