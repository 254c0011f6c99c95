// SPDX-License-Identifier: Apache-2.0
// The HTML page of the robot. It is the same for every resource: it requests its own address as N-Triples and follows the links in the
// response. It assumes no paths. Changes arrive by WebSocket, or by polling if there is none.

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
const unescape = (text) => !text.includes("\\") ? text
  : text.replace(/\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))/g,
    (_, u, U, c) => c ? ESCAPES[c] ?? c : String.fromCodePoint(parseInt(u ?? U, 16)));

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

// ---- names, units and numbers as text

const localName = (iri) => {
  const name = iri.replace(/[/#]+$/, "").split(/[/#]/).pop();
  try { return decodeURIComponent(name); } catch { return name; }
};
const humanised = (name) => name.replace(/([a-z0-9])([A-Z])(?![A-Z])/g, (_, a, b) => `${a} ${b.toLowerCase()}`).replaceAll("_", " ");

const UNITS = { RAD: "rad", DEG: "°", M: "m", MilliM: "mm", CentiM: "cm", KiloM: "km", SEC: "s", MilliSEC: "ms", MIN: "min", HR: "h",
  KiloGM: "kg", GM: "g", DEG_C: "°C", PERCENT: "%", UNITLESS: "", NUM: "", HZ: "Hz", PA: "Pa", OHM: "Ω", Radian: "rad", Degree: "°" };
const unitPart = (part) => {
  const [, name, power] = /^(.+?)([2-4]?)$/.exec(part);
  return (UNITS[name] ?? name) + (power && "²³⁴"[power - 2]);
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

// ---- elements. Text is only inserted as text. The markup has no style attributes and no event handlers.

/// Creates an element: h("p.quiet", { title }, children ...). The second argument is optional. A property "on..." is an event handler.
function h(selector, properties, ...children) {
  const [tag, ...classes] = selector.split(".");
  const element = document.createElement(tag);
  if (classes.length) element.className = classes.join(" ");
  if (properties?.constructor !== Object) children.unshift(properties);
  else for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value ?? false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat(3).filter((c) => c ?? false));
  return element;
}
const button = (words, onclick, more) => h("button.small", { type: "button", onclick, ...more }, words);
const $ = (id) => document.getElementById(id);
const setText = (element, text) => { if (element.textContent !== text) element.textContent = text; };
let lastId = 0;
const freshId = () => "i" + ++lastId;

const isWeb = (iri) => /^https?:/i.test(iri);
function linkTo(iri, text) {
  if (isOurs(iri)) return h("a", { href: local(iri), title: iri }, text ?? pathText(iri));
  return isWeb(iri) ? h("a", { href: iri, title: iri, rel: "noreferrer" }, text ?? localName(iri)) : h("span", { title: iri }, text ?? iri);
}
/// The types of a node, without classes that are its Blueprints.
const chips = (g, node) => g.ids(node, rdf("type")).filter((t) => !g.ids(node, hybrit("blueprint")).includes(withoutHash(t))).map((t) => h("span.chip", { title: t }, localName(t)));

function copyable(text) {
  const code = h("code", text), copy = button("Copy", async () => {
    try {
      await navigator.clipboard.writeText(text);
    } catch {  // the clipboard requires a secure context
      getSelection().selectAllChildren(code);
      document.execCommand("copy");
    }
    setText(copy, "Copied");
    setTimeout(() => setText(copy, "Copy"), 1500);
  });
  return h("div.copyable", code, copy);
}

// ---- requests to the robot

const N_TRIPLES = "application/n-triples", JSON_TYPE = "application/json", PROBLEM = "application/problem+json;q=0.9";
const parseBody = (type, text) => type === N_TRIPLES ? parse(text) : type === JSON_TYPE ? JSON.parse(text) : null;
let robotOrigin = location.origin;  // origin of the IRIs in representations; differs from location.origin with a public base
let user;                           // the session of the user that is logged in
let clockOffset = 0;                // robot's clock minus ours [ms]; 0 below 3 s, because a Date field has only seconds

const isOurs = (iri) => { try { return [location.origin, robotOrigin].includes(new URL(iri).origin); } catch { return false; } };
const local = (iri) => iri.startsWith(robotOrigin + "/") ? location.origin + iri.slice(robotOrigin.length) : iri;
const withoutHash = (iri) => iri.split("#")[0];
const pathText = (iri) => { try { return decodeURIComponent(new URL(iri).pathname.slice(1)) || "Robotic Things"; } catch { return iri; } };

class Unreachable extends Error {}
class Problem extends Error {
  constructor(status, title, detail, report) { super(detail || title); Object.assign(this, { status, title, report }); }
}

let abortController = new AbortController();  // aborts all pending requests
/// Sends a request and returns the response. Throws a Problem for a status of 400 or more, and Unreachable if there is no response.
async function sendRequest(method, iri, { accept = `${N_TRIPLES}, ${PROBLEM}`, body, etag, signal = abortController.signal } = {}) {
  const headers = { Accept: accept };
  if (body !== undefined) headers["Content-Type"] = N_TRIPLES;
  if (etag) headers["If-None-Match"] = etag;
  let response, text;
  try {  // no-store: the browser's cache has the page for this address
    response = await fetch(local(withoutHash(iri)), { method, headers, body, signal, cache: "no-store" });
    text = await response.text();
    // The session has ended. If the page does not know its user yet: if its own address, which was readable, is refused, too.
    if (response.status === 401 && (user || (await fetch("", { method: "HEAD" })).status === 401)) location.reload();
  } catch { throw new Unreachable("the robot does not respond"); }
  const off = Date.parse(response.headers.get("Date")) - Date.now();
  if (Number.isFinite(off)) clockOffset = Math.abs(off) < 3000 ? 0 : off;
  const type = (response.headers.get("Content-Type") ?? "").split(";")[0];
  const g = parseBody(type, text) ?? new Graph();
  if (response.status >= 400) {
    let detail = "";
    if (type.endsWith("json")) try { detail = JSON.parse(text).detail; } catch { /* the status is sufficient */ }
    throw new Problem(response.status, `${response.status} ${response.statusText}`, detail, type === N_TRIPLES ? g : null);
  }
  return { status: response.status, g, text, type, etag: response.headers.get("ETag"), field: (name) => response.headers.get(name) ?? "" };
}

/// Targets of Link fields by relation (RFC 8288).
function links(response, rel) {
  return [...response.field("Link").matchAll(/<([^>]*)>\s*;\s*rel="([^"]*)"/g)].filter((l) => l[2].split(" ").includes(rel)).map((l) => l[1]);
}

const requestCache = new Map();
/// Sends a request, or returns the recent response to the same request. Several parts of a page share it. OPTIONS is cached longer, because
/// it depends on the structure only.
function cachedRequest(iri, method = "GET", ms = 5000) {
  const key = method + iri;
  if (!requestCache.has(key)) {
    const sent = sendRequest(method, iri);
    sent.catch(() => requestCache.delete(key));
    requestCache.set(key, sent);
    setTimeout(() => requestCache.delete(key), ms);
  }
  return requestCache.get(key);
}
/// The methods and links of a resource. OPTIONS reads no value of the robot.
async function optionsOf(iri) {
  const response = await cachedRequest(iri, "OPTIONS", 60000), methods = response.field("Allow").split(/[\s,]+/);
  return { allows: (m) => methods.includes(m), up: links(response, "up")[0], constrainedBy: links(response, ldp("constrainedBy"))[0] };
}

/// The resources above a resource (Link rel=up), the root first.
async function ancestorsOf(iri) {
  const chain = [];
  for (let at = iri; chain.length < 20;) {
    const { up } = await optionsOf(at);
    if (!up || chain.includes(up)) break;
    chain.unshift(at = up);
  }
  return chain;
}

/// Watches a resource by WebSocket, else polls every 2 s. Reconnects after a loss.
///
/// @param on  callbacks: g(graph or JSON, response if polled), state(text), problem(Problem)
class Watch {
  static maxSockets = 6;  // open sockets; further resources are polled
  static all = new Set();
  static onchange = () => {};

  constructor(iri, on, { socket = true, every = 2000, accept = N_TRIPLES, interval = 0.1 } = {}) {
    Object.assign(this, { iri, on, every, accept, interval, allowsSocket: socket, tries: 0, socketAfter: 0 });
  }

  start() {
    if (this.running) return;
    this.running = true;
    Watch.all.add(this);
    this.openOrPoll();
  }
  stop() {
    this.running = false;
    Watch.all.delete(this);
    clearTimeout(this.timer);
    const { socket } = this;
    if (socket?.readyState === 0) socket.onopen = () => socket.close();  // close() while connecting makes the browser log a warning
    else socket?.close();
    this.socket = null;
    Watch.onchange();
  }
  setState(state) {
    this.state = state;
    this.on.state?.(state);
    Watch.onchange();
  }
  schedule(ms) {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.running && this.openOrPoll(), ms);
  }
  retryLater() {
    const pause = Math.min(8000, 500 * 2 ** this.tries++) * (0.75 + Math.random() / 2);
    this.setState("lost");
    this.schedule(pause);
  }
  openOrPoll() {
    const open = [...Watch.all].filter((w) => w.socket).length;
    if (this.allowsSocket && open < Watch.maxSockets && Date.now() >= this.socketAfter) this.open();
    else this.poll();
  }
  open() {
    const url = new URL(local(this.iri));
    url.protocol = url.protocol.replace("http", "ws");
    url.searchParams.set("accept", this.accept);
    url.searchParams.set("minimumInterval", this.interval);
    url.searchParams.set("queueLength", "0");  // latest value only: queued states of an invocation would arrive late
    let socket, opened = false;
    try { socket = this.socket = new WebSocket(url); } catch {  // a browser in which 'self' of connect-src does not include ws:
      this.socketAfter = Infinity;
      return this.poll();
    }
    socket.onopen = () => {
      opened = true;
      this.tries = 0;
      if (this.socket === socket) this.setState("live");
    };
    socket.onmessage = (event) => { if (this.socket === socket) this.on.g(parseBody(this.accept, event.data)); };
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.socket = null;
      if (event.code === 1000) {  // the subscription was cancelled, by this page or another client
        this.finished = true;
        this.stop();
        this.setState("cancelled");
      } else {
        if (!opened) this.socketAfter = Date.now() + 30000;  // The handshake failed. Polling shows the reason.
        this.poll();
      }
    };
  }
  async poll() {
    try {
      const response = await sendRequest("GET", this.iri, { accept: `${this.accept}, ${PROBLEM}`, etag: this.etag });
      if (!this.running) return;
      const back = this.state === "lost" && this.allowsSocket;
      if (back) this.socketAfter = 0;
      this.tries = 0;
      this.setState("polling");
      if (response.status === 200) {
        this.etag = response.etag;
        this.on.g(response.g, response);
      }
      this.schedule(back ? 0 : this.every);
    } catch (e) {
      if (!this.running) return;
      if (e instanceof Unreachable) return this.retryLater();
      this.setState("polling");
      this.on.problem?.(e);
      if (e.status === 404) this.stop();
      else this.schedule(this.every);
    }
  }
}

Watch.onchange = () => {
  const states = [...Watch.all].map((w) => w.state);
  const state = states.includes("lost") ? "lost" : states.includes("live") ? "live" : states.includes("polling") ? "polling" : "";
  const words = { lost: "Connection lost – trying again", live: "Live", polling: "Live by polling" };
  $("link").className = state;
  setText($("link"), words[state] ?? "");
  document.body.classList.toggle("lost", state === "lost");
};

// Hidden pages close their connections after a delay, and left pages at once: browsers keep left pages for the Back button.
let hiddenTimer, suspendedWatches = [];
const suspendWatches = () => { suspendedWatches.push(...Watch.all); suspendedWatches.forEach((w) => w.stop()); };
const resumeWatches = () => suspendedWatches.splice(0).forEach((w) => w.start());
document.addEventListener("visibilitychange", () => {
  clearTimeout(hiddenTimer);
  if (document.hidden) hiddenTimer = setTimeout(suspendWatches, 20000);
  else resumeWatches();
});
addEventListener("pagehide", suspendWatches);
addEventListener("pageshow", resumeWatches);

// ---- values

const NOT_VALUES = new Set([rdf("type"), rdfs("seeAlso"), rdfs("label"), rdfs("comment"), dcterms("modified"), dcterms("title"),
  dcterms("description"), dcterms("hasFormat"), vom("quantityKind"), ...["dataType", "hasQuantityKind"].map(qudt), ...["frame", "datatype", "elementType"].map(lrt),
  ...["source", "target"].map((end) => spatial(end + "CoordinateSystem")), ...UNIT_PREDICATES]);
const UNNAMED = new Set([vom("numericalValue"), vom("quantityValue"), rdf("value")]);

/// The values of a node as a flat list of { path: [words], objects, names, unit }. A vector or a list of scalars is one entry.
function leaves(g, node, path = [], seen = new Set(), outer) {
  if (seen.has(node)) return [];
  seen.add(node);
  const unit = unitText(UNIT_PREDICATES.map((p) => g.id(node, p)).find(Boolean)) || outer;
  return g.of(node).filter(([p]) => !NOT_VALUES.has(p) && !p.startsWith(hybrit(""))).flatMap(([p, o]) => {
    const here = UNNAMED.has(p) ? path : [...path, humanised(localName(p))];
    if (o.id && g.isList(o.id)) {
      const items = g.list(o.id).map((item) => g.isList(item.id) ? [{ path: [], objects: g.list(item.id), isList: true }]
        : isInside(g, node, item) ? leaves(g, item.id, [], seen) : [{ path: [], objects: [item], unit }]);
      if (items.every((i) => i.length === 1 && i[0].objects.length === 1)) return [{ path: here, objects: items.map((i) => i[0].objects[0]), isList: true, unit: unit || items[0]?.[0].unit }];
      return items.flatMap((inner, i) => inner.map((leaf) => ({ ...leaf, path: [...here, String(i + 1), ...leaf.path] })));
    }
    if (!isInside(g, node, o)) return [{ path: here, objects: [o], unit }];
    const inner = leaves(g, o.id, here, seen, unit), names = inner.map((l) => l.path.at(-1));
    const isVector = inner.length > 1 && inner.length < 5 && inner.every((l) => l.path.length === here.length + 1 && l.path.at(-1).length < 3 && l.unit === inner[0].unit && l.objects.length === 1 && !l.isList);
    return isVector ? [{ path: here, objects: inner.map((l) => l.objects[0]), names, unit: inner[0].unit }] : inner;
  });
}
const isTrue = (o) => o.value === "true" || o.value === "1";
const objectText = (o, moves) => o.id ? localName(o.id) : isNumeric(o) ? numberText(o, moves) : o.type === xsd("boolean") ? (isTrue(o) ? "yes" : "no") : o.value;

/// Shows leaves in an element. If their names have not changed, only text is replaced.
class ValueView {
  element = h("div.value");
  show(all, plot) {
    const key = JSON.stringify(all.map((l) => l.path));
    if (key !== this.key) {
      this.key = key;
      this.cells = all.map(() => [h("span.number"), " ", h("span.unit")]);
      this.element.replaceChildren(!all.length ? quiet("no value to show") : all.length === 1 && !all[0].path.length ? h("p.big", this.cells)
        : h("dl", all.map((l, i) => [h("dt", l.path.join(" › ") || "value"), h("dd", this.cells[i])])));
    }
    all.forEach(({ objects, names, isList, unit, ...leaf }, i) => {
      const [number, , units] = this.cells[i], moves = plot?.moves(leaf);
      const shown = objects.slice(0, 12).map((o, n) => (names ? names[n] + "\u00a0" : "") + objectText(o, moves)).join(names ? "  " : ", ") + (objects.length > 12 ? `, … (${objects.length})` : "");
      setText(number, isList ? `[${shown}]` : shown);
      number.title = objects.slice(0, 50).map((o) => o.id ?? o.value).join(" ");
      setText(units, unit ?? "");
    });
  }
}

// ---- plots: the last minute of each number

/// Resizes a canvas to the screen's resolution and clears it. `pen` is its 2D context; undefined while the canvas has no layout.
function drawingContext(canvas) {
  const scale = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight, pen = width && canvas.getContext("2d"), style = getComputedStyle(canvas);
  if (!pen) return {};
  const [wide, high] = [width, height].map((n) => Math.round(n * scale));
  if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height, color: (name) => style.getPropertyValue(name) };
}

const MINUTE = 60000;
const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
const plots = new Set();  // the visible ones

class Plot {
  series = new Map();  // name -> [[time, number], ...]
  constructor() {
    this.canvas = h("canvas", { role: "img", "aria-label": "the last minute" });
    this.legend = h("p.legend", { "aria-hidden": "true" });
    this.element = h("figure.plot", { hidden: true }, this.canvas, this.legend);
  }
  add(all) {
    const now = performance.now();
    for (const { path, objects, names, isList } of all) objects.slice(0, 8).forEach((o, i) => {
      const n = isNumeric(o) ? toNumber(o.value) : NaN, name = [...path, names?.[i] ?? (isList ? `${i + 1}` : "")].filter(Boolean).join(" › ");
      if (!Number.isFinite(n)) return;
      if (!this.series.has(name)) this.series.set(name, []);
      const points = this.series.get(name);
      points.push([now, n]);
      // One point older than a minute is kept: the line begins there.
      while (points.length > 2 && points[1][0] < now - MINUTE) points.shift();
    });
  }
  moved() { return [...this.series].filter(([, points]) => points.some((p) => p[1] !== points[0][1])); }
  moves({ path, words = path }) { return this.moved().some(([name, points]) => points.length > 5 && name.startsWith(words.join(" › "))); }
  draw() {
    // The series that have moved. Without one: a single series is drawn, several are not.
    const moved = this.moved().slice(0, 6), lines = moved.length || this.series.size > 1 || this.small ? moved : [...this.series];
    this.element.hidden = lines.length === 0;
    if (!lines.length) return;
    const { canvas } = this, { pen, width, height, color } = drawingContext(canvas);
    if (!pen) return;
    const now = performance.now(), numbers = lines.flatMap(([, points]) => points.map((p) => p[1]));
    let low = Math.min(...numbers), high = Math.max(...numbers);
    if (low === high) { low -= Math.abs(low) * 0.1 || 1; high += Math.abs(high) * 0.1 || 1; }
    const label = (n) => String(Number(n.toPrecision(3)));
    pen.font = "11px system-ui, sans-serif";
    const left = Math.max(pen.measureText(label(low)).width, pen.measureText(label(high)).width) + 6, top = 7, bottom = height - 7;
    const x = (t) => width - ((now - t) / MINUTE) * (width - left) - 2, y = (n) => bottom - ((n - low) / (high - low)) * (bottom - top);
    pen.fillStyle = color("--quiet");
    pen.strokeStyle = color("--line");
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    for (const n of [low, high]) {
      pen.fillText(label(n), left - 5, y(n));
      pen.beginPath();
      pen.moveTo(left, Math.round(y(n)) + 0.5);
      pen.lineTo(width, Math.round(y(n)) + 0.5);
      pen.stroke();
    }
    pen.save();
    pen.beginPath();
    pen.rect(left, 0, width - left, height);
    pen.clip();
    pen.lineWidth = 1.8;
    pen.lineJoin = "round";
    lines.forEach(([, points], i) => {
      pen.strokeStyle = color(`--series${i}`);
      pen.beginPath();
      points.forEach(([t, n], j) => {
        // Unchanged values are not sent: a value is valid until the next one.
        if (j > 0 && t - points[j - 1][0] > 700) pen.lineTo(x(t), y(points[j - 1][1]));
        if (j === 0) pen.moveTo(x(t), y(n));
        else pen.lineTo(x(t), y(n));
      });
      pen.lineTo(x(now), y(points.at(-1)[1]));
      pen.stroke();
    });
    pen.restore();
    const key = lines.map(([name]) => name).join();
    if (this.key !== key && (this.key = key) !== undefined)
      this.legend.replaceChildren(...(lines.length > 1 || this.series.size > 1 ? lines.map(([name], i) => {
        const key = h("span.key", name);
        key.style.color = `var(--series${i})`;
        return key;
      }) : []));
    canvas.setAttribute("aria-label", `between ${label(low)} and ${label(high)} in the last minute`);
  }
}
let drawn = 0;
function drawPlots(now) {
  if (now - drawn > (reducedMotion.matches ? 1000 : 66)) {
    drawn = now;
    for (const plot of plots) plot.draw();
  }
  requestAnimationFrame(drawPlots);
}
requestAnimationFrame(drawPlots);

// ---- forms from shapes

/// The form model of a node shape: { fields, fixed, classes, unit }. Constraints that a form cannot express are checked by the robot only.
function nodeModel(g, shape, depth = 0) {
  const model = { fields: [], fixed: [], classes: [], unit: "" }, shapes = shape ? [shape] : [], byPath = new Map();
  if (depth > 6) return model;
  for (const s of shapes) {
    const more = [...g.ids(s, sh("node")), ...listed(g, s, "and")];
    // The last alternative with properties: lrt writes optional parts as "nothing, or this".
    more.push(listed(g, s, "or").filter((id) => g.id(id, sh("property"))).pop());
    shapes.push(...more.filter((m) => m && !shapes.includes(m) && shapes.length < 50));
    model.classes.push(...g.ids(s, sh("targetClass")), ...g.ids(s, sh("class")));
    for (const p of g.ids(s, sh("property"))) {
      const path = g.id(p, sh("path"));
      if (path && !g.about.has(path)) byPath.set(path, [...(byPath.get(path) ?? []), p]);
    }
  }
  for (const [path, parts] of byPath) {
    const field = { ...valueModel(g, parts, depth), path }, only = field.choices?.length === 1 && field.choices[0];
    if (field.maxValues === 0) continue;
    if (!only) model.fields.push(field);
    else {
      model.fixed.push([path, only]);
      if (UNIT_PREDICATES.includes(path)) model.unit = unitText(only.id);
    }
  }
  for (const field of model.fields) field.unit ||= model.unit;
  return model;
}
/// The members of the lists in sh:or or sh:and.
const listed = (g, s, which) => g.ids(s, sh(which)).flatMap((l) => g.list(l).flatMap((o) => o.id ?? []));

/// The field of a form for all property shapes with one path.
function valueModel(g, parts, depth) {
  const field = { minValues: 0, maxValues: Infinity, kind: "text", name: "", words: new Map() }, types = [];
  for (const p of parts) {
    const said = g.said(p, sh("name"))?.value, name = g.all(p, sh("name")).find((o) => !o.lang)?.value;
    field.name ||= said && name && said !== name ? `${said} (${name})` : said ?? "";
    field.description ??= g.said(p, sh("description"))?.value;
    field.minValues = Math.max(field.minValues, g.number(p, sh("minCount")) ?? 0);
    field.maxValues = Math.min(field.maxValues, g.number(p, sh("maxCount")) ?? Infinity);
    for (const w of g.ids(p, rdfs("seeAlso"))) field.words.set(g.text(w, rdf("value")), wordsOf(g, w));
    field.choices ??= [...g.ids(p, sh("in")).map((l) => g.list(l)), ...g.all(p, sh("hasValue")).map((o) => [o])][0];
    // Datatypes and bounds are in the shape itself or in its alternatives.
    for (const c of [p, ...listed(g, p, "or"), ...listed(g, p, "or").flatMap((o) => listed(g, o, "or"))]) {
      types.push(...g.ids(c, sh("datatype")));
      for (const side of ["min", "max"]) for (const kind of ["Inclusive", "Exclusive"]) {
        const n = g.number(c, sh(side + kind));
        if (n !== undefined && Math.abs(n) < 2e9) Object.assign(field, { [side]: n, [side + "Exclusive"]: kind === "Exclusive" });  // larger bounds are those of a datatype and are not shown
      }
    }
    if (g.ids(p, sh("nodeKind")).includes(sh("IRI"))) field.kind = "iri";
    const inner = [p, ...g.ids(p, sh("node"))].flatMap((n) => g.ids(n, sh("property")));
    const element = inner.find((q) => g.list(g.id(q, sh("path"))).at(-1)?.id === rdf("first"));
    const cells = inner.find((q) => g.id(g.id(q, sh("path")), sh("zeroOrMorePath")));
    if (element) Object.assign(field, { kind: "list", element: valueModel(g, [element], depth + 1), minItems: (g.number(cells, sh("minCount")) ?? 1) - 1, maxItems: (g.number(cells, sh("maxCount")) ?? Infinity) - 1 });
    else if (inner.length) Object.assign(field, { kind: "node", node: nodeModel(g, p, depth + 1) });
  }
  if (field.kind === "text") {
    field.types = types;
    if (types.some((t) => NUMBER_TYPES.includes(t)) || (!types.length && (field.min ?? field.max) !== undefined)) field.kind = "number";
    else if (types.length && types.every(isIntegerType)) field.kind = "integer";
    else if (types.includes(xsd("boolean"))) field.kind = "boolean";
  }
  return field;
}

function hint(field) {
  const { min, max, minValues, kind } = field, bound = (n) => String(Number(n.toPrecision(6)));
  const above = field.minExclusive ? "above " : "", below = field.maxExclusive ? "below " : "";
  return [kind === "integer" && "whole number",
    min !== undefined && max !== undefined ? `${above}${bound(min)} to ${below}${bound(max)}` : min !== undefined ? `${above || "at least "}${bound(min)}` : max !== undefined && `${below || "at most "}${bound(max)}`,
    minValues === 0 && "optional",
    kind === "iri" && "an IRI", field.description].filter(Boolean).join(", ");
}
const fieldName = (field) => field.name || (UNNAMED.has(field.path) ? "" : humanised(localName(field.path)));

/// The literal for a text. An invalid number is sent as it was typed; the robot reports the error.
function literalOf(text, { types = [], kind }) {
  if (types.length === 1 || !["number", "integer"].includes(kind)) return { value: text, type: types[0] };
  if (/^[+-]?\d+$/.test(text)) return { value: text, type: xsd("integer") };
  return { value: text, type: Number.isFinite(Number(text)) ? xsd("double") : undefined };
}
function niceStep(range) {
  const power = 10 ** Math.floor(Math.log10(range / 200));
  return [1, 2, 5, 10].map((n) => n * power).find((s) => range / s <= 200.01);
}

/// A form for one model. Each control has its node and predicate, by which showReport() finds the control for a result of a SHACL report. Parts
/// are { element, write(triples, subject), read(graph, subject) }.
class Form {
  controls = [];

  constructor(target, model) {
    Object.assign(this, { target, model, parts: model.fields.map((f) => this.part(f, () => target)) });
    this.element = h("div", this.parts.map((p) => p.element));
  }
  part(field, subject) {
    return field.kind === "node" ? this.node(field) : field.kind === "list" ? this.rows(field, subject) : this.single(field, subject);
  }
  /// Nodes have IRIs, so that a SHACL report can refer to them.
  node(field) {
    let node;
    const { fields, fixed, classes } = field.node, alone = fields.length === 1;  // a node with one value is shown as that value
    const inner = fields.map((f) => this.part(alone ? { ...f, name: fieldName(field), outer: field.path, minValues: field.minValues && f.minValues } : f, () => node));
    const error = h("p.error");
    const element = alone ? inner[0].element : h("fieldset", h("legend", fieldName(field)), inner.map((p) => p.element), error);
    if (!alone) this.controls.push({ subject: () => node, outer: field.path, error });
    return { element,
      write: (triples, s) => {
        node = `${this.target}#n${++this.nodes}`;
        const own = [];
        inner.forEach((p) => p.write(own, node));
        if (own.length || field.minValues) triples.push([s, field.path, { id: node }], ...classes.map((c) => [node, rdf("type"), { id: c }]), ...fixed.map(([p, o]) => [node, p, o]), ...own);
      },
      read: (g, s) => { const n = g.id(s, field.path); if (n) inner.forEach((p) => p.read(g, n)); } };
  }
  rows(field, subject) {
    const error = h("p.error"), list = h("ol"), parts = [], open = field.minItems !== field.maxItems, name = fieldName(field);
    const changed = () => list.dispatchEvent(new Event("input", { bubbles: true }));
    const add = () => {
      const part = this.part({ ...field.element, path: rdf("first"), name: `${name} ${parts.length + 1}`, minValues: 1 }, () => null);
      part.row = h("li", part.element, open && button("Remove", () => {
        parts.splice(parts.indexOf(part), 1);
        part.row.remove();
        changed();
      }));
      parts.push(part);
      list.append(part.row);
    };
    const resize = (n) => {
      while (parts.length < n) add();
      while (parts.length > n) parts.pop().row.remove();
    };
    resize(Math.max(0, field.minItems));
    this.controls.push({ subject, path: field.path, isList: true, error });
    return {
      element: h("fieldset", h("legend", name || "values"), list, open && button("Add a row", () => { add(); changed(); list.lastChild.querySelector("input, select")?.focus(); }), error),
      write: (triples, s) => {
        const cell = (i) => ({ id: i < parts.length ? `_:c${s.length}x${at}x${i}` : rdf("nil") }), at = ++this.nodes;
        triples.push([s, field.path, cell(0)]);
        parts.forEach((p, i) => {
          p.write(triples, cell(i).id);
          triples.push([cell(i).id, rdf("rest"), cell(i + 1)]);
        });
      },
      read: (g, s) => {
        let at = g.id(s, field.path);
        if (!at) return;
        resize(g.list(at).length);
        for (const p of parts) { p.read(g, at); at = g.id(at, rdf("rest")); }
      } };
  }
  single(field, subject) {
    const id = freshId(), error = h("p.error", { id: id + "e" }), note = hint(field), { kind, choices, path, minValues } = field;
    const common = { id, "aria-describedby": `${id}h ${id}e`, "aria-required": minValues > 0 && kind !== "boolean" && "true" };
    const label = h("label", { for: id }, fieldName(field) || "value", field.unit && ` [${field.unit}]`);
    let input, slider, get, set;
    if (choices) {
      input = h("select", common, h("option", { value: "" }, minValues ? "choose …" : "none"), choices.map((o, i) => {
        const { title, description } = field.words.get(o.value) ?? {};
        return h("option", { value: String(i), lang: title?.lang, title: description?.value }, o.id ? localName(o.id) : title && title.value !== o.value ? `${title.value} (${o.value})` : o.value);
      }));
      get = () => choices[input.value];
      set = (o) => { input.value = choices.findIndex((c) => nTriplesOf(c) === nTriplesOf(o)); };
    } else if (kind === "boolean") {
      input = h("input", { ...common, type: "checkbox" });
      get = () => ({ value: String(input.checked), type: xsd("boolean") });
      set = (o) => { input.checked = isTrue(o); };
    } else {
      const isNumber = kind === "number" || kind === "integer", range = field.max - field.min;
      // A text field: a number field hides invalid input from scripts, and the robot could not report the error.
      input = h(isNumber ? "input.short" : "input", { ...common, type: "text", inputmode: isNumber && "decimal", autocomplete: "off", spellcheck: "false" });
      get = () => {
        const text = isNumber ? input.value.trim().replace(",", ".") : input.value;
        if (text === "" && (kind !== "text" || !minValues)) return;
        return kind === "iri" ? { id: text } : literalOf(text, field);
      };
      if (isNumber && range > 0 && range <= 1e6) {
        const step = kind === "integer" ? 1 : niceStep(range);
        slider = h("input", { type: "range", min: String(field.min + (field.minExclusive ? step : 0)), max: String(field.max - (field.maxExclusive ? step : 0)), step: String(step), value: String(field.min),
          "aria-label": `slider of ${label.textContent}`, oninput: () => { input.value = slider.value; } });
        input.addEventListener("input", () => { if (Number.isFinite(toNumber(input.value))) slider.value = input.value; });
      }
      set = (o) => {
        input.value = o.id ?? o.value;
        if (slider) slider.value = input.value;
      };
    }
    this.controls.push({ subject, path, outer: field.outer, input, error });
    return { element: h("div.entry", kind === "boolean" ? h("div.line", input, label) : [label, h("div.line", slider, input)], h("p.hint", { id: id + "h" }, note), error),
      write: (triples, s) => { const o = get(); if (o) triples.push([s, path, o]); },
      read: (g, s) => { const o = g.one(s, path); if (o) set(o); } };
  }

  /// The request body: N-Triples about the target.
  body() {
    this.nodes = 0;
    const { target, model } = this, triples = [...model.classes.map((c) => [target, rdf("type"), { id: c }]), ...model.fixed.map(([p, o]) => [target, p, o])];
    this.parts.forEach((p) => p.write(triples, target));
    return triples.map(([s, p, o]) => `${nTriplesOf({ id: s })} <${p}> ${nTriplesOf(o)} .\n`).join("");
  }
  read(g, subject) { this.parts.forEach((p) => p.read(g, subject)); }
  clear() {
    for (const c of this.controls) {
      setText(c.error, "");
      c.input?.removeAttribute("aria-invalid");
    }
  }
  /// Shows each result of a SHACL report at its control. Returns the messages of the results that have no control.
  showReport(report) {
    const unplaced = [], { controls } = this;
    let first;
    for (const result of report.subjects(rdf("type"), sh("ValidationResult"))) {
      if (report.subjects(sh("detail"), result).length) continue;
      const path = report.id(result, sh("resultPath")), focus = report.id(result, sh("focusNode")), candidates = controls.filter((c) => c.subject() === focus);
      const words = report.all(result, sh("resultMessage")).map((m) => m.value).join("; ");
      const found = candidates.find((c) => c.path === path) ?? candidates.find((c) => !c.path) ?? controls.find((c) => path && (c.outer === path || c.path === path)) ?? controls.find((c) => c.isList && report.about.has(path))
        ?? (controls.length === 1 ? controls[0] : undefined);
      if (!found) { unplaced.push(words); continue; }
      if (!found.error.textContent.includes(words)) found.error.append(`${words}. `);
      found.input?.setAttribute("aria-invalid", "true");
      first ??= found.input;
    }
    first?.focus();
    return unplaced.join("; ");
  }
}

/// Converts a node or literal of a body to JSON.
function jsonOf(g, o) {
  const { id, value } = o;
  if (!id) return isNumeric(o) || o.type === xsd("boolean") ? value : JSON.stringify(value);
  if (id === rdf("nil") || g.id(id, rdf("rest"))) return `[${g.list(id).map((m) => jsonOf(g, m))}]`;
  const parts = [...g.of(id)].filter(([p]) => ![rdf("type"), ...UNIT_PREDICATES].includes(p));
  return UNNAMED.has(parts[0]?.[0]) ? jsonOf(g, parts[0][1]) : `{${parts.map(([p, v]) => `"${localName(p)}":${jsonOf(g, v)}`)}}`;
}
const shellQuoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;

/// A form with its submit button and the result of the request. done(response) may return the text of the result.
function formElement({ target, model, method, title, name, done }) {
  const form = new Form(withoutHash(target), model), result = h("p.answer", { role: "status" }), alert = h("p.answer.bad", { role: "alert" });
  const submit = h("button.primary", { type: "submit" }, title);
  const bodyOf = () => model.fields.length || model.fixed.length ? form.body() : undefined;
  const showCurl = () => {
    const body = bodyOf();
    if (curl.open) curl.lastChild.replaceChildren(copyable(`curl -X ${method} ${body ? `-H 'Content-Type: ${JSON_TYPE}' -d ${shellQuoted(jsonOf(parse(body), { id: form.target }))} ` : ""}${shellQuoted(local(target))}`));
  };
  const curl = h("details.curl", { ontoggle: showCurl }, h("summary", "as curl"), h("div"));
  const element = h("form", { novalidate: true, "aria-label": name, oninput: () => { form.dirty = true; showCurl(); }, onsubmit: async (event) => {
    event.preventDefault();
    setText(result, "");
    setText(alert, "");
    form.clear();
    submit.disabled = true;
    try {
      const response = await sendRequest(method, target, { body: bodyOf() });
      form.dirty = false;
      setText(result, await done(response, form) ?? "Done");
    } catch (e) {
      setText(alert, e.report ? `Not accepted (${e.status}). ${form.showReport(e.report)}` : problemText(e));
    }
    submit.disabled = false;
  } }, form.element, h("div.line", submit, curl), result, alert);
  return Object.assign(form, { whole: element });
}

// ---- the current view

let view = { watches: new Set(), ticks: [] };

function newView() {
  view.isClosed = true;
  view.watches.forEach((w) => w.stop());
  view.observer?.disconnect();
  plots.clear();
  suspendedWatches = [];
  const seen = new Map();  // element -> [called when it becomes visible, called when it is hidden], ...
  const observer = new IntersectionObserver((entries) => {
    for (const e of entries) seen.get(e.target).forEach((act) => act[e.isIntersecting ? 0 : 1]());
  }, { rootMargin: "80px" });
  const onVisibility = (element, begin, end) => {
    if (!seen.has(element)) seen.set(element, []);
    seen.get(element).push([begin, end]);
    observer.unobserve(element);  // observe() then reports its visibility again
    observer.observe(element);
  };
  view = { watches: new Set(), ticks: [], observer, onVisibility,
    /// Watches a resource while an element is visible.
    watch(element, iri, on, options) {
      const w = new Watch(iri, on, options);
      this.watches.add(w);
      onVisibility(element, () => { if (!this.isClosed && !w.finished) w.start(); }, () => w.stop());
      return w;
    },
    plot(plot) { onVisibility(plot.element.parentElement, () => plots.add(plot), () => plots.delete(plot)); } };
  return view;
}
setInterval(() => view.ticks.forEach((tick) => tick()), 1000);

const problemText = (e) => e instanceof Problem && e.message !== e.title ? `${e.title}: ${e.message}` : e.message;
const notice = (e) => h("p.bad", { role: "alert" }, problemText(e));
const wordsOf = (g, node) => ({ title: g.said(node, dcterms("title")), description: g.said(node, dcterms("description")) });
const titleOf = (g, node) => [dcterms("title"), rdfs("label"), sh("name")].map((p) => g.said(node, p)).find(Boolean)?.value ?? localName(g.id(node, sh("targetClass")) ?? node);
/// What people say of a resource, below its title: its name, if the title is another one, and its description.
const saidOf = ({ title, description }, name) => [title && title.value !== name && h("code.name", name), description && h("span", { lang: description.lang }, description.value)];
/// Shows the words of a property or action in its card, whose heading has the name until its description has come.
function showWords(element, g, iri) {
  const words = wordsOf(g, iri), heading = element.querySelector("h3"), { title } = words;
  if (element.said || !(title || words.description)) return;
  element.said = h("p.said.quiet", saidOf(words, humanised(localName(iri))));
  if (title && heading) Object.assign(heading.querySelector("a") ?? heading, { textContent: title.value, lang: title.lang ?? "" });
  if (heading) heading.after(element.said);
}
const quiet = (...words) => h("p.quiet", ...words);
/// A button for a request. An error is shown in `failed`.
function command(words, act, failed, more) {
  const b = button(words, async () => {
    b.disabled = true;
    try { await act(); } catch (e) { failed.replaceChildren(notice(e)); }
    b.disabled = false;
  }, more);
  return b;
}
const age = (iso) => ago(Math.max(0, Date.now() + clockOffset - Date.parse(iso)));
function valueOf(g, node) {
  const value = new ValueView();
  value.show(leaves(g, node));
  return value.element;
}

/// The triples of a node, except for predicates that other parts of the page show.
function facts(g, node, hidden) {
  const rows = new Map();
  for (const [p, o] of g.of(node)) {
    if (!hidden.includes(p)) rows.set(p, [...(rows.get(p) ?? []), isInside(g, node, o) ? valueOf(g, o.id) : o.id ? linkTo(o.id) : h("span", { lang: o.lang }, o.value)]);
  }
  return rows.size ? h("dl.facts", [...rows].map(([p, os]) => [h("dt", { title: p }, humanised(localName(p))), h("dd", os.flatMap((o, i) => i ? [", ", o] : o))])) : null;
}
function section(title, ...children) {
  const id = freshId();
  return h("section", { "aria-labelledby": id }, h("h2", { id }, title), children);
}
function card(kind, level, iri, name, ...children) {
  const id = freshId();
  return h(`article.card.${kind}`, { "aria-labelledby": id }, h("h" + level, { id }, iri ? h("a", { href: local(iri) }, name) : name), children);
}
function table(columns, rows, more = "") {
  return h("div.scroll", h("table" + more, h("thead", h("tr", columns.map((c) => h("th", { scope: "col" }, c)))), h("tbody", rows)));
}

/// The representation in all offered formats. Text formats are shown with a curl command; other formats are links.
function source(response, iri) {
  const code = h("code"), curl = h("div"), buttons = h("div.line", { role: "group", "aria-label": "Media type" });
  const choose = async (type) => {
    for (const b of buttons.children) b.setAttribute("aria-pressed", String(b.value === type));
    curl.replaceChildren(copyable(`curl -H 'Accept: ${type}' ${shellQuoted(local(iri))}`));
    try { setText(code, (await sendRequest("GET", iri, { accept: type })).text); } catch (e) { setText(code, problemText(e)); }
  };
  const details = h("details.source", { ontoggle: () => {
    if (!details.open || buttons.firstChild) return;
    const named = [...response.field("Link").matchAll(/<([^>]*)>;\s*rel="alternate";\s*type="([^"]*)"/g)];
    for (const [, href, type] of named.sort((a, b) => (b[2] === JSON_TYPE) - (a[2] === JSON_TYPE)))
      buttons.append(/^text|json|[+]xml|[/]n-|trig/.test(type) ? button(type, () => choose(type), { value: type }) : h("a", { href: local(href), rel: "alternate" }, type));
    choose(buttons.firstChild?.value ?? "text/turtle");
  } }, h("summary", "Formats and curl"), buttons, curl, h("pre", { tabindex: "0", "aria-label": "as text" }, code));
  return details;
}

// ---- properties

/// The form model for the body of a request to a resource, from the shapes that its Link rel=constrainedBy refers to.
async function bodyModelOf(iri) {
  const { constrainedBy } = await optionsOf(iri);
  const g = (await cachedRequest(constrainedBy)).g;
  // The shape that targets the resource, or the shape whose fragment is the path of the resource below its Thing.
  const shape = g.subjects(sh("targetNode"), iri)[0] ?? [...g.about.keys()].find((s) => s.includes("#") && iri.endsWith("/" + s.split("#")[1]));
  return nodeModel(g, shape);
}

/// The image format of a property. A change reloads it: one request at a time, at most ten a second. Formats that the browser cannot display
/// are left out.
function picture(name) {
  let at = 0, busy, newest;
  const load = () => {
    busy = newest;
    newest = null;
    if (busy) element.setAttribute("src", `${busy}&at=${++at}`);
  };
  const next = (shown) => () => {
    element.hidden = !shown;
    setTimeout(load, 100);
  };
  const element = h("img.picture", { alt: `${name} as it is now`, hidden: true, onload: next(true), onerror: next(false) });
  return { element, update: (g, iri) => {
    newest = g.ids(iri, dcterms("hasFormat")).filter((f) => g.text(f, dcterms("format"))?.startsWith("image/")).map(local)[0];
    if (!busy) load();
  } };
}

/// A property as a card: its value, age and plot; with a form if it is writable.
function propertyCard(iri, large) {
  const value = new ValueView(), plot = new Plot(), when = h("p.age.quiet"), write = h("div.write"), name = humanised(localName(iri)), image = picture(name), frame = h("p.hint");
  const element = card(large ? "property.large" : "property", large ? 2 : 3, !large && iri, large ? "Value" : name, image.element, value.element, frame, when, plot.element, write);
  let last, form;
  const tick = () => {
    const modified = last?.text(iri, dcterms("modified"));
    setText(when, modified ? age(modified) : "");
    when.title = modified ?? "";
  };
  view.ticks.push(tick);
  view.plot(plot);
  const prefill = () => { if (form && last && !form.dirty && !form.whole.contains(document.activeElement)) form.read(last, iri); };
  const update = (g) => {
    last = g;
    showWords(element, g, iri);
    const all = leaves(g, iri);
    plot.add(all);
    value.show(all, plot);
    image.update(g, iri);
    const base = g.id(iri, lrt("frame")) ?? g.id(iri, spatial("sourceCoordinateSystem"));
    if (base && !frame.firstChild) frame.append("in the frame of ", linkTo(base, localName(base)));
    tick();
    prefill();
  };
  const fail = (e) => {
    value.key = null;
    value.element.replaceChildren(notice(e));
  };
  (async () => {
    if (!(await optionsOf(iri)).allows("PUT")) return;
    form = formElement({ target: iri, model: await bodyModelOf(iri), method: "PUT", title: "Set", name: `Set ${name}`, done: async () => {
      const { g } = await sendRequest("GET", iri);
      update(g);
      form.read(g, iri);
      return "Set";
    } });
    write.append(form.parts.length ? form.whole : quiet("There is no form for this shape."));
    prefill();
  })().catch((e) => write.replaceChildren(notice(e)));
  return { element, update, fail };
}

/// A property in one line, for the card of a Thing.
function propertyRow(iri) {
  const value = new ValueView(), plot = Object.assign(new Plot(), { small: true }), name = humanised(localName(iri)), link = h("a", { href: local(iri) }, name);
  const element = h("div.row", link, value.element, plot.element);
  view.plot(plot);
  return { element, fail: () => {}, update: (g) => {
    const { title, description } = wordsOf(g, iri);
    if (title) Object.assign(link, { title: [name, description?.value].filter(Boolean).join(": "), lang: title.lang ?? "" });
    setText(link, title?.value ?? name);
    const all = leaves(g, iri);
    plot.add(all);
    const one = all.find((l) => plot.moves(l)) ?? all[0];
    value.show(one ? [{ ...one, words: one.path, path: [] }] : [], plot);
  } };
}

// ---- actions

function invocationRow(iri, large) {
  const status = h("span.status"), bar = h("progress", { max: "1", "aria-label": "Progress" }), percent = h("span.number"), note = h("div"), when = h("span.quiet");
  const cancel = command("Cancel", () => sendRequest("DELETE", iri), note, { hidden: true });
  const element = h(large ? "div" : "li", h("div.line", status, bar, percent, cancel, when, !large && h("a.quiet", { href: local(iri) }, "details")), note);
  let last;
  const tick = () => {
    if (!last) return;
    const time = (p) => last.text(iri, p), from = time(prov("startedAtTime")) ?? time(dcterms("created")), to = time(prov("endedAtTime"));
    setText(when, to ? `${((Date.parse(to) - Date.parse(from)) / 1000).toFixed(1)} s, ${age(to)}` : `since ${Math.max(0, Math.round((Date.now() + clockOffset - Date.parse(from)) / 1000))} s`);
  };
  view.ticks.push(tick);
  const showStatus = (name, over) => {
    setText(status, name);
    status.className = `status ${name}`;
    bar.hidden = percent.hidden = cancel.hidden = over;
  };
  const watch = view.watch(element, iri, {
    g: (g) => {
      last = g;
      const name = localName(g.id(iri, lrt("status")) ?? "?"), error = g.text(iri, lrt("error"));
      watch.finished = ["succeeded", "failed", "cancelled"].includes(name);
      showStatus(name, watch.finished);
      bar.value = g.number(iri, lrt("progress")) ?? 0;
      setText(percent, `${Math.round(bar.value * 100)} %`);
      tick();
      note.replaceChildren(...["input", "result"].flatMap((part) => {
        const node = g.id(iri, lrt(part));
        return node ? h("div.io", h("span.quiet", part), valueOf(g, node)) : [];
      }), ...(error ? [h("p.bad", error)] : []));
      if (watch.finished) watch.stop();
    },
    problem: (e) => {
      if (e.status !== 404) return note.replaceChildren(notice(e));
      watch.finished = true;
      showStatus("removed", true);
    },
  });
  return element;
}

function actionCard(iri, large, first) {
  const name = humanised(localName(iri)), body = h("div"), list = h("ul.invocations", { role: "list", "aria-label": "Invocations" }), seen = new Set(), maxInvocations = large ? 40 : 5;
  const element = card("action", large ? 2 : 3, !large && iri, large ? "Run" : name, body, list);
  const addInvocation = (invocation) => {
    if (seen.has(invocation)) return;
    seen.add(invocation);
    list.prepend(invocationRow(invocation));
    while (list.childElementCount > maxInvocations) list.lastChild.remove();
  };
  const update = (g) => {
    showWords(element, g, iri);
    if (!body.firstChild) {
      const binding = g.id(iri, hybrit("binding")), shape = g.id(iri, hybrit("consumes"));
      const show = (shapes) => body.replaceChildren(formElement({ target: g.text(binding, http("requestURI")) ?? iri, method: localName(g.id(binding, http("mthd")) ?? "POST"),
        model: nodeModel(shapes, shape), title: name, name: `Run ${name}`, done: (response) => {
          const made = response.field("Location");
          if (made) addInvocation(made);
          return "Sent";
        } }).whole);
      // The shape of a list is in the Blueprint only.
      if (!shape || g.about.has(shape)) show(g);
      else {
        body.append(quiet("…"));
        cachedRequest(shape.split("#")[0]).then((response) => show(response.g)).catch((e) => body.replaceChildren(notice(e)));
      }
    }
    g.ids(iri, lrt("invocation")).slice(-maxInvocations).forEach(addInvocation);
  };
  if (first) update(first);
  view.watch(element, iri, { g: update, problem: (e) => list.replaceChildren(notice(e)) });
  return element;
}

// ---- containers

/// Keeps one element for each member of a container. Containers are polled, because they cannot be observed.
function members(element, list, container, make, every) {
  const rows = new Map();
  return view.watch(element, container, { problem: (e) => list.replaceChildren(notice(e)), g: (g) => {
    const now = g.ids(container, ldp("contains"));
    for (const [m, row] of rows) if (!now.includes(m)) { row.remove(); rows.delete(m); }
    for (const m of now) {
      if (rows.has(m)) continue;
      rows.set(m, make(m));
      list.append(rows.get(m));
    }
    element.classList.toggle("empty", !now.length);
  } }, { socket: false, every });
}

const SUBSCRIPTION = ["Resource", "To", "Delivered", "Dropped", "Since", "Last error", ""];
function subscriptionRow(iri, onCancelled) {
  const cells = SUBSCRIPTION.map((name) => h("td", { "data-label": name || null })), [what, how, delivered, dropped, since, error, last] = cells;
  const element = h("tr", cells);
  last.append(command("Cancel", async () => { await sendRequest("DELETE", iri); onCancelled(); }, error));
  view.watch(element, iri, { problem: () => {}, g: (g) => {
    const text = (p) => g.text(iri, p) ?? "", of = text(hybrit("onResource")), queue = text(lrt("queueLength"));
    if (what.title !== of) what.replaceChildren(linkTo(what.title = of));
    setText(how, [text(hybrit("callbackURL")) || "WebSocket", text(hybrit("mediaType")), queue ? `queue of ${queue}` : "latest value", text(lrt("suspended")) && "suspended", text(lrt("confirmed")) === "false" && "unconfirmed"].filter(Boolean).join(", "));
    setText(delivered, text(lrt("delivered")));
    setText(dropped, text(lrt("dropped")));
    setText(since, age(text(dcterms("created"))));
    setText(error, text(lrt("lastError")));
  } }, { socket: false, every: 1000 });
  return element;
}
function subscriptions(container) {
  const whole = table(SUBSCRIPTION, [], ".subscriptions"), element = h("div", whole, h("p.none.quiet", "There are no subscriptions."));
  const watch = members(element, whole.querySelector("tbody"), container, (iri) => subscriptionRow(iri, () => watch.schedule(0)), 1500);
  return element;
}

function collectionCard(iri, large) {
  const name = humanised(localName(iri)), list = h("ul.members", { role: "list" }), form = h("div");
  const element = card("action", large ? 2 : 3, !large && iri, large ? "Members" : name, list, h("p.none.quiet", "empty"), form);
  const watch = members(element, list, iri, (member) => {
    const value = h("div"), error = h("p"), remove = command("Remove", async () => { await sendRequest("DELETE", member); watch.schedule(0); }, error, { hidden: true });
    optionsOf(member).then((o) => { remove.hidden = !o.allows("DELETE"); }, () => {});
    sendRequest("GET", member).then((a) => value.append(valueOf(a.g, member)), () => {});
    return h("li", h("div.line", h("a", { href: local(member) }, localName(member)), remove), value, error);
  });
  (async () => {
    if ((await optionsOf(iri)).allows("POST"))
      form.append(formElement({ target: iri, model: await bodyModelOf(iri), method: "POST", title: "Add", name: `Add to ${name}`, done: () => { watch.schedule(0); return "Added"; } }).whole);
  })().catch((e) => form.replaceChildren(notice(e)));
  return element;
}

// ---- things

/// Updates properties from the state of their Thing. If the state fails because of one property, each property is watched by itself.
function watchState(element, state, shown, cancelled) {
  const watch = view.watch(element, state, { g: (g) => shown.forEach((p) => p.update(g)), state: (s) => cancelled?.(s === "cancelled"),
    problem: () => {
      watch.finished = true;
      watch.stop();
      for (const p of shown) view.watch(p.element, p.iri, { g: p.update, problem: p.fail });
    } });
  return watch;
}
const shownProperties = (g, iri, make) => g.ids(iri, hybrit("property")).map((p) => ({ iri: p, ...make(p) }));

/// A Thing as a card. It is requested when the card becomes visible.
function thingCard(iri, g, level = 3) {
  const element = card("thing", level, iri, titleOf(g, iri), h("p", chips(g, iri).slice(1))), here = view;
  let begun;
  view.onVisibility(element, async () => {
    if (begun) return;
    begun = true;
    try {
      const thingGraph = (await cachedRequest(iri)).g;
      if (here.isClosed) return;
      setText(element.querySelector("a"), titleOf(thingGraph, iri));
      const shown = shownProperties(thingGraph, iri, propertyRow), actions = thingGraph.ids(iri, hybrit("action")), parts = thingGraph.ids(iri, dcterms("hasPart")).length;
      element.append(...shown.map((p) => p.element));
      if (actions.length) element.append(h("p.actions", h("span.quiet", "actions:"), " ", actions.flatMap((a, i) => [i ? ", " : "", linkTo(a, humanised(localName(a)))])));
      if (parts) element.append(quiet(`${parts} parts`));
      element.classList.toggle("plain", !shown.length && !actions.length && !parts);
      if (shown.length) watchState(element, thingGraph.id(iri, lrt("state")), shown);
    } catch (e) { element.append(notice(e)); }
  }, () => {});
  return element;
}
const thingCards = (g, things, level) => h("div.cards", things.map((t) => thingCard(t, g, level)));

function showThing(iri, g) {
  const shown = shownProperties(g, iri, propertyCard), ids = (p) => g.ids(iri, p), actions = ids(hybrit("action")), collections = ids(lrt("collection")), parts = ids(dcterms("hasPart"));
  const stopped = h("p.bad", { hidden: true }, "This page's subscription was cancelled. ", button("Watch again", () => { watch.finished = false; watch.start(); }));
  const grid = h("div.cards", shown.map((p) => p.element));
  const watch = shown.length && watchState(grid, g.id(iri, lrt("state")), shown, (is) => { stopped.hidden = !is; });
  const list = subscriptionsOf(g.id(iri, hybrit("subscriptions")), g.ids(iri, hybrit("blueprint")));
  // Predicates whose objects are all shown elsewhere: ros:rotation in addition to hybrit:property.
  const all = [...ids(hybrit("property")), ...actions, ...collections], domain = g.of(iri).map(([p]) => p).filter((p) => g.all(iri, p).every((o) => all.includes(o.id)));
  const about = facts(g, iri, [...THING_PARTS, ...domain]);
  return [g.is(iri, ros("Robot")) && g.id(iri, lrt("rootLink")) && section("Skeleton", skeleton(iri, g)), shown.length && section("Properties", stopped, grid), actions.length && section("Actions", h("div.cards.wide", actions.map((a) => actionCard(a)))),
    collections.length && section("Collections", h("div.cards.wide", collections.map((c) => collectionCard(c)))), parts.length && section("Parts", thingCards(g, parts)),
    about && section("About", about), list];
}
const THING_PARTS = [rdf("type"), lrt("state"), lrt("collection"), ...["title", "description", "hasPart", "isPartOf"].map(dcterms), ...["property", "action", "subscriptions", "blueprint", "websocketUrl"].map(hybrit)];

function subscriptionsOf(container, blueprints) {
  const details = h("details", { ontoggle: () => { if (!details.children[1]) details.append(subscriptions(container)); } }, h("summary", "Subscribers"));
  return section("Subscriptions and shapes", details, h("p", linkTo(container, "All subscriptions"), blueprints.map((b, i) => [" · ", linkTo(b, "Blueprint" + (i ? ` ${i + 1}` : ""))])));
}

function showRoot(iri, g) {
  const things = g.ids(iri, ldp("contains")), here = view, box = h("div", thingCards(g, things, 2));
  // If there are few robots, their parts are shown, too.
  if (things.length <= 3) for (const t of things) cachedRequest(t).then(({ g }) => {
    const parts = g.ids(t, dcterms("hasPart"));
    if (parts.length && !here.isClosed) box.append(section(`Parts of ${titleOf(g, t)}`, thingCards(g, parts)));
  }, () => {});
  return [box];
}

function showBlueprint(g) {
  const rows = (model, before) => model.fields.flatMap((f) => {
    const name = [before, fieldName(f)].filter(Boolean).join(" › "), v = f.element ?? f;
    if (f.kind === "node") return rows(f.node, name);
    return [[name || "value", (f.element ? "list of " : "") + (v.choices ? v.choices.map((c) => c.id ? localName(c.id) : c.value).join(" | ") : v.kind), hint({ ...v, kind: "", types: [], minValues: f.minValues }), f.unit]];
  });
  return g.subjects(rdf("type"), sh("NodeShape")).filter((s) => !isBlank(s)).map((s) => {
    const target = g.id(s, sh("targetNode")), lines = rows(nodeModel(g, s), "");
    return section(titleOf(g, s), target && h("p", h("span.quiet", "of "), linkTo(target)),
      lines.length ? table(["Property", "Kind", "Limits", "Unit"], lines.map((l) => h("tr", l.map((c) => h("td", c))))) : quiet("links and types"));
  });
}

// ---- the content for a resource, by its types

async function show(focus) {
  const here = newView(), main = $("main"), address = withoutHash(location.href), plain = address.split("?")[0];
  main.setAttribute("aria-busy", "true");
  try {
    const response = await sendRequest("GET", address), g = response.g;
    // The IRI of the resource: its address, or the same path below the robot's public base.
    const self = g.about.has(plain) ? plain : [...g.about.keys()].find((s) => isWeb(s) && plain.endsWith(new URL(s).pathname)) ?? plain;
    if (g.about.has(self)) robotOrigin = new URL(self).origin;
    const subject = g.subjects(lrt("state"), self)[0] ?? g.subjects(rdf("type"), "http://www.w3.org/2002/07/owl#Ontology")[0] ?? self, chain = await ancestorsOf(self);
    const up = chain.at(-1), is = (t) => g.is(subject, t), upper = is(ldp("Container")) && up ? (await cachedRequest(up)).g : new Graph();
    if (here.isClosed) return;
    const name = humanised(localName(subject)), isMember = is(hybrit("Property")) || is(hybrit("Action")), words = wordsOf(g, subject);
    let content, title = isMember ? words.title?.value ?? name : titleOf(g, subject);
    if (is(hybrit("RoboticThing"))) content = showThing(subject, g);
    else if (is(hybrit("Property"))) {
      const shown = propertyCard(subject, true);
      here.watch(shown.element, subject, { g: shown.update, problem: shown.fail });
      content = [shown.element];
    } else if (is(hybrit("Action"))) {
      content = [actionCard(subject, true, g)];
    } else if (is(lrt("Invocation"))) {
      title = `Invocation of ${humanised(localName(up))}`;
      content = [h("div.card", invocationRow(subject, true))];
    } else if (is(hybrit("Subscription"))) {
      title = "Subscription";
      content = [table(SUBSCRIPTION, subscriptionRow(subject, () => navigate(local(up))), ".subscriptions")];
    } else if (is(ldp("Container"))) {
      const isSubscriptions = upper.subjects(hybrit("subscriptions"), subject).length;
      if (isSubscriptions) title = `Subscriptions of ${titleOf(upper, up)}`;
      content = !up ? showRoot(subject, g) : isSubscriptions ? [subscriptions(subject)] : [collectionCard(subject, true)];
      content.push(h("nav.line", { "aria-label": "Pages" }, ["first", "prev", "next", "last"].flatMap((rel) => links(response, rel).map((l) => linkTo(l, rel)))));
    } else if (g.subjects(rdf("type"), sh("NodeShape")).length) {
      title = `Blueprint of ${plain.includes("/blueprints") ? titleOf(g, self) : localName(up)}`;
      content = showBlueprint(g);
    } else {  // a member of a collection, the vocabulary, or a resource of an unknown type
      content = [g.about.has(subject) && h("div.card", self === subject ? valueOf(g, subject) : facts(g, subject, [])), ...[...g.about.keys()].filter((s) => !isBlank(s) && s !== subject && withoutHash(s) !== self).slice(0, 300).map((s) => section(localName(s), facts(g, s, [])))];
    }
    document.title = `${title} – robot`;
    const heading = h("h1", { tabindex: "-1", lang: title === words.title?.value && words.title.lang }, title), said = saidOf(isMember ? words : { description: words.description }, name);
    main.replaceChildren(...[h("nav.crumbs", { "aria-label": "Breadcrumbs" }, chain.flatMap((c, i) => [i ? " › " : "", linkTo(c, i ? localName(c) : "Things")])), heading, h("p", up && chips(g, subject)), said.some(Boolean) && h("p.said", said), ...content.flat(), source(response, address)].filter(Boolean));
    if (focus) heading.focus({ preventScroll: true });
    tree(chain[0] ?? self, [...chain, self]).catch(() => {});
  } catch (e) {
    if (here.isClosed) return;
    main.replaceChildren(h("h1", e instanceof Unreachable ? "The robot does not respond" : "This resource could not be read"), notice(e), h("p", h("a", { href: "/" }, "Back to the list of Things")));
    if (!(e instanceof Unreachable || e instanceof Problem)) throw e;
    here.watch(main.firstChild, address, { g: () => show(), problem: () => {} }, { socket: false });
  } finally { if (!here.isClosed) main.removeAttribute("aria-busy"); }
}

// ---- the tree of Things

let treeRoot;

async function tree(root, current) {
  const nav = $("tree");
  if (treeRoot !== root) {
    const things = [];
    for (let page = root, n = 0; page && n < 20; ++n) {
      const response = await sendRequest("GET", page);
      things.push(...response.g.ids(root, ldp("contains")));
      page = links(response, "next")[0];
    }
    treeRoot = root;
    $("home").href = local(root);
    nav.replaceChildren(branch(things, things.length <= 3));
  }
  nav.shownPath = current;
  markCurrent();
}
/// Expands the branches above the shown resource, and marks its Thing as current.
function markCurrent() {
  const { shownPath } = $("tree");
  let nearest;
  for (const item of $("tree").querySelectorAll("li")) {
    item.firstChild.nextSibling.removeAttribute("aria-current");
    if (!shownPath?.includes(item.iri)) continue;
    nearest = item;
    item.expand(true);
  }
  nearest?.children[1].setAttribute("aria-current", "page");
}
function branch(things, expanded) {
  return h("ul", things.map((iri) => {
    const a = h("a", { href: local(iri) }, localName(iri)), twist = h("button.twist", { type: "button", "aria-expanded": "false", "aria-label": `Parts of ${localName(iri)}`, hidden: true });
    const item = Object.assign(h("li", twist, a), { iri, expand(yes) {
      if (yes && !item.children[2] && item.parts?.length) {
        item.append(branch(item.parts));
        markCurrent();
      }
      if (item.children[2]) item.children[2].hidden = !yes;
      twist.setAttribute("aria-expanded", String(yes));
    } });
    twist.addEventListener("click", () => item.expand(twist.getAttribute("aria-expanded") !== "true"));
    cachedRequest(iri).then(({ g }) => {
      setText(a, titleOf(g, iri));
      item.parts = g.ids(iri, dcterms("hasPart"));
      twist.hidden = !item.parts.length;
      if (expanded) item.expand(true);
      markCurrent();
    }, () => {});
    return item;
  }));
}
function menu(shown) {
  document.body.classList.toggle("menu", shown);
  $("menu").setAttribute("aria-expanded", String(shown));
}
$("menu").addEventListener("click", () => menu(!document.body.classList.contains("menu")));

// ---- stops: the buttons in the header section of every page, and the Escape key

let stops = [];
async function invokeStops(iris) {
  enableMotion?.(false);
  abortController.abort();  // browsers limit parallel requests, and pending commands must not continue
  abortController = new AbortController();
  setText($("stopped"), "Stopping …");
  const ends = await Promise.allSettled(iris.map((iri) => sendRequest("POST", iri, { signal: null }))), failed = ends.find((e) => e.reason);
  setText($("stopped"), failed ? `Not stopped: ${problemText(failed.reason)}` : `Stopped at ${new Date().toLocaleTimeString()}`);
  $("stopped").className = failed ? "bad" : "succeeded";
}
async function findStops() {
  const at = withoutHash(location.href);
  try {
    let top = await cachedRequest((await ancestorsOf(at))[0] ?? at);
    if (!top.g.subjects(rdf("type"), ldp("Container"))[0]) top = await cachedRequest("/");
    const { g } = top, [iri] = links(top, lrt("session")), make = (words, iris) => h("button", { type: "button", onclick: () => invokeStops(iris) }, words);
    if (iri && !user) findUser(iri);
    const named = (iri) => humanised(localName(iri));
    stops = [...g.about.keys()].flatMap((s) => isBlank(s) ? [] : g.ids(s, lrt("stop")));
    if (stops[0]) $("stops").append(make(`${stops[1] ? "stop all" : named(stops[0])} (Esc)`, stops), ...(stops[1] ? stops.map((iri) => make(`${named(iri)} ${pathText(iri).split("/actions/")[0]}`, [iri])) : []), h("span", { id: "stopped", role: "alert" }));
  } catch { setTimeout(findStops, 2000); }
}
findStops();
addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || event.repeat || !stops.length) return;
  event.preventDefault();
  invokeStops(stops);
});

// ---- the user that is logged in

async function findUser(iri) {
  let node;
  try {
    user = (await sendRequest("GET", iri, { accept: JSON_TYPE })).g;
    node = user.session && button("Log out", async () => {
      await sendRequest("DELETE", iri);
      location.reload();
    });
  } catch { node = button("Log in", () => { location = local(iri) + "#" + location.pathname; }); }
  $("link").after(h("span", user?.name, " ", node));
}

// ---- navigation: the address of the page is that of the resource

/// Lists of terms are loaded as pages.
const isTermList = (path) => /\/ns\/(lrt|vocabulary)$/.test(path);
let shownAddress = withoutHash(location.href);
function showAddress(focus) {
  shownAddress = withoutHash(location.href);
  menu(false);
  scrollTo(0, 0);
  return show(focus);
}
function navigate(href) {
  history.pushState(null, "", href);
  showAddress(true);
}
document.addEventListener("click", (event) => {
  const a = event.target.closest("a[href]");
  if (!a || event.button || event.metaKey || event.ctrlKey || event.shiftKey || event.altKey || a.origin !== location.origin || a.rel === "alternate" || a.getAttribute("href").startsWith("#") || isTermList(a.pathname)) return;
  event.preventDefault();
  navigate(a.href);
});
addEventListener("popstate", () => {
  if (withoutHash(location.href) === shownAddress) return;
  if (isTermList(location.pathname)) location.reload();
  else showAddress();
});
// The server writes the content of a list of terms, for readers without scripts.
const listOfTerms = $("main").dataset.of;
if (listOfTerms) {
  robotOrigin = new URL(listOfTerms).origin;
  tree(`${robotOrigin}/`, []).catch(() => {});
} else show();
