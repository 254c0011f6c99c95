// SPDX-License-Identifier: Apache-2.0
// RDF in the page, and names, units and numbers as text.

// ---- vocabularies

const space = (base) => (name) => base + name;
const rdf = space("http://www.w3.org/1999/02/22-rdf-syntax-ns#");
const rdfs = space("http://www.w3.org/2000/01/rdf-schema#");
const xsd = space("http://www.w3.org/2001/XMLSchema#");
const sh = space("http://www.w3.org/ns/shacl#");
const ldp = space("http://www.w3.org/ns/ldp#");
const dcterms = space("http://purl.org/dc/terms/");
const prov = space("http://www.w3.org/ns/prov#");
const vom = space("http://vocab.arvida.de/2015/06/vom/vocab#");
const qudt = space("http://qudt.org/schema/qudt/");
const spatial = space("http://vocab.arvida.de/2015/06/spatial/vocab#");
const http = space("http://www.w3.org/2011/http#");
const hybrit = space("https://hybr-it-projekt.de/ns/hybr-it#");
const lrt = space("https://w3id.org/lrt/ns#");

const UNIT_PREDICATES = [qudt("hasUnit"), vom("unit")];
const NUMBER_TYPES = ["decimal", "float", "double"].map(xsd);
const isIntegerType = (type) => /XMLSchema#\w*(int|integer|long|short|byte)$/i.test(type);

// ---- RDF: `g` is a Graph; a node is the text of its IRI or "_:label"; an object is { id } or { value, type, lang }

class Graph {
  about = new Map();

  add(subject, predicate, object) {
    if (!this.about.has(subject)) this.about.set(subject, []);
    this.about.get(subject).push([predicate, object]);
  }
  of(subject) { return this.about.get(subject) ?? []; }
  all(subject, predicate) { return this.of(subject).filter(([p]) => p === predicate).map(([, o]) => o); }
  one(subject, predicate) { return this.all(subject, predicate)[0]; }
  ids(subject, predicate) { return this.all(subject, predicate).flatMap((o) => o.id ?? []); }
  id(subject, predicate) { return this.ids(subject, predicate)[0]; }
  text(subject, predicate) { const o = this.one(subject, predicate); return o && (o.id ?? o.value); }
  /// The literal in the language that the reader prefers (RFC 4647 3.4), else without a language, else in English, else the first.
  said(subject, predicate) {
    const texts = this.all(subject, predicate).filter((o) => !o.id);
    for (const language of texts.length > 1 ? navigator.languages : []) {
      for (const parts = language.toLowerCase().split("-"); parts.length; parts.pop()) {
        const found = texts.find((o) => o.lang?.toLowerCase() === parts.join("-"));
        if (found) return found;
      }
    }
    return texts.find((o) => !o.lang) ?? texts.find((o) => /^en(-|$)/i.test(o.lang)) ?? texts[0];
  }
  number(subject, predicate) { const t = this.text(subject, predicate); return t === undefined ? undefined : toNumber(t); }
  is(subject, type) { return this.ids(subject, rdf("type")).includes(type); }
  subjects(predicate, id) {
    return [...this.about].filter(([, statements]) => statements.some(([p, o]) => p === predicate && o.id === id)).map(([s]) => s);
  }
  isList(node) { return node === rdf("nil") || this.one(node, rdf("first")) !== undefined; }
  list(head) {
    const items = [];
    for (let at = head; at && at !== rdf("nil") && items.length < 10000; at = this.id(at, rdf("rest"))) {
      const first = this.one(at, rdf("first"));
      if (first) items.push(first);
    }
    return items;
  }
}

const ESCAPES = { t: "\t", b: "\b", n: "\n", r: "\r", f: "\f" };
const characterOf = (code) => code < 0x110000 ? String.fromCodePoint(code) : "\ufffd";
const unescape = (text) => !text.includes("\\") ? text
  : text.replace(/\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))/g,
    (_, u, U, c) => c ? ESCAPES[c] ?? c : characterOf(parseInt(u ?? U, 16)));

function parse(text) {
  const g = new Graph();
  const term = /\s*(?:<([^>]*)>|(_:\S+)|"((?:[^"\\]|\\.)*)"(?:@([A-Za-z0-9-]+)|\^\^<([^>]*)>)?)/y;
  const next = (line) => {
    const found = term.exec(line);
    if (!found) return null;
    if (found[1] !== undefined) return { id: unescape(found[1]) };
    if (found[2] !== undefined) return { id: found[2] };
    return { value: unescape(found[3]), lang: found[4], type: found[4] ? rdf("langString") : unescape(found[5] ?? xsd("string")) };
  };
  for (const line of text.split("\n")) {
    term.lastIndex = 0;
    const s = next(line), p = s && next(line), o = p && next(line);
    if (o) g.add(s.id, p.id, o);
  }
  return g;
}

const isBlank = (id) => id.startsWith("_:");
/// Whether an object is a node inside the description of another one: a blank node, or a described fragment of the same document.
const isInside = (g, node, o) => g.about.has(o.id) && (isBlank(o.id) || (o.id !== withoutHash(node) && withoutHash(o.id) === withoutHash(node)));
const quoted = (text) => `"${text.replace(/["\\]/g, "\\$&").replace(/\n/g, "\\n").replace(/\r/g, "\\r")}"`;
const nTriplesOf = (o) => o.id ? (isBlank(o.id) ? o.id : `<${o.id}>`)
  : quoted(o.value) + (o.lang ? "@" + o.lang : o.type && o.type !== xsd("string") ? `^^<${o.type}>` : "");

function toNumber(text) {
  return text.trim() ? Number(text.replace(/INF$/, "Infinity")) : NaN;
}
const isNumeric = (o) => NUMBER_TYPES.includes(o.type) || isIntegerType(o.type);

// ---- names, units and numbers as text. Data may have any IRI, a malformed one, too.

const localName = (iri) => {
  const name = iri.replace(/[/#]+$/, "").split(/[/#]/).pop();
  try { return decodeURIComponent(name); } catch { return name; }
};
const humanised = (name) => name.replace(/([a-z0-9])([A-Z])(?![A-Z])/g, (_, a, b) => `${a} ${b.toLowerCase()}`).replaceAll("_", " ");

const UNITS = { RAD: "rad", DEG: "°", M: "m", MilliM: "mm", CentiM: "cm", KiloM: "km", SEC: "s", MilliSEC: "ms", MIN: "min", HR: "h",
  KiloGM: "kg", GM: "g", DEG_C: "°C", PERCENT: "%", UNITLESS: "", NUM: "", HZ: "Hz", PA: "Pa", OHM: "Ω", Radian: "rad", Degree: "°" };
const unitPart = (part) => {
  const [, name, power] = /^(.*?)([2-4]?)$/.exec(part) ?? ["", part, ""];
  return (Object.hasOwn(UNITS, name) ? UNITS[name] : name) + (power && "²³⁴"[power - 2]);
};
const unitText = (iri) => !iri ? "" : localName(iri).split("-PER-").map((side) => side.split("-").map(unitPart).join("·")).join("/");

/// A rounded number; the title attribute has all digits. A moving number has a fixed number of decimals, so that the text does not jump.
function numberText(o, moving) {
  const n = toNumber(o.value);
  if (!Number.isFinite(n) || isIntegerType(o.type)) return o.value;
  const size = Math.abs(n);
  if (size !== 0 && (size >= 1e6 || size < 1e-3) && !moving) return String(Number(n.toPrecision(5)));
  return moving ? n.toFixed(3) : String(Number(n.toFixed(4)));
}

function ago(ms) {
  const s = Math.round(ms / 1000);
  if (s < 2) return "now";
  if (s < 90) return `${s} s ago`;
  if (s < 5400) return `${Math.round(s / 60)} min ago`;
  return s < 129600 ? `${Math.round(s / 3600)} h ago` : `${Math.round(s / 86400)} days ago`;
}
