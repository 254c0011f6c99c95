// SPDX-License-Identifier: Apache-2.0
// ---- requests to the robot

const N_TRIPLES = "application/n-triples", JSON_TYPE = "application/json", PROBLEM = "application/problem+json;q=0.9";
const parseBody = (type, text) => type === N_TRIPLES ? parse(text) : type === JSON_TYPE ? JSON.parse(text) : null;
let robotOrigin = location.origin;  // origin of the robot's own IRIs; differs from location.origin with a public base
let user;                           // the session of the user that is logged in
let clockOffset = 0;                // robot's clock minus ours [ms]; 0 below 3 s, because a Date field has only seconds

const originOf = (iri) => { try { return new URL(iri).origin; } catch { return ""; } };
const isOurs = (iri) => [location.origin, robotOrigin].includes(originOf(iri));
const local = (iri) => iri.startsWith(robotOrigin + "/") ? location.origin + iri.slice(robotOrigin.length) : iri;
const withoutHash = (iri) => iri.split("#")[0];
const decodedOr = (text) => { try { return decodeURIComponent(text); } catch { return text; } };
const pathText = (iri) => { try { return decodeURIComponent(new URL(iri).pathname.slice(1)) || "Robotic Things"; } catch { return iri; } };

class Unreachable extends Error {}
class Problem extends Error {
  constructor(status, title, { detail, type = "" }, report) { super(detail || title); Object.assign(this, { status, title, type, report }); }
}
/// What a problem says, in JSON.
function problemIn(text) {
  try { return JSON.parse(text) ?? {}; } catch { return {}; }
}

let abortController = new AbortController();  // aborts all pending requests
/// Sends a request and returns the response. Throws a Problem for a status of 400 or more, and Unreachable if there is no response.
async function sendRequest(method, iri, { accept = `${N_TRIPLES}, ${PROBLEM}`, body, etag, signal = abortController.signal, fields } = {}) {
  const headers = { Accept: accept, ...fields };
  if (body !== undefined) headers["Content-Type"] = N_TRIPLES;
  if (etag) headers["If-None-Match"] = etag;
  let response, text;
  try {  // no-store: the browser's cache has the page for this address
    response = await fetch(local(withoutHash(iri)), { method, headers, body, signal, cache: "no-store" });
    text = await response.text();
    // The session has ended. If the page does not know its user yet: if its own address, which was readable, is refused, too.
    if (response.status === 401 && (user || (await fetch("", { method: "HEAD" })).status === 401)) location.reload();
  } catch { throw new Unreachable("the robot does not respond"); }
  const field = (name) => response.headers.get(name) ?? "";
  hearTime(field("Robot-Time"));
  const off = Date.parse(field("Date")) - Date.now();
  if (Number.isFinite(off)) clockOffset = Math.abs(off) < 3000 ? 0 : off;
  const type = field("Content-Type").split(";")[0];
  const g = parseBody(type, text) ?? new Graph();
  if (response.status >= 400)
    throw new Problem(response.status, `${response.status} ${response.statusText}`, type.endsWith("json") ? problemIn(text) : {}, type === N_TRIPLES ? g : null);
  return { status: response.status, g, text, type, etag: response.headers.get("ETag"), field };
}

// ---- commands. A command says until when it is worth carrying out, by the robot's own clock. A stop and the cancelling of an invocation do not.

const COMMAND_LIFE = 2000;  // [ms]
let robotTime;              // the newest time of the robot that was heard: { run, ms, at }, `at` by our clock

/// Hears a time of the robot: "run/milliseconds since the run began". Of one run, the newest counts.
function hearTime(text) {
  const [, run, ms] = /^(\w+)\/(\d+)$/.exec(text) ?? [];
  if (run && !(robotTime?.run === run && robotTime.ms > Number(ms))) robotTime = { run, ms: Number(ms), at: performance.now() };
}
/// The robot's time when the command is no longer worth anything. Only our own elapsed time is added: an old time makes it earlier, never later.
const validUntil = () => robotTime && `${robotTime.run}/${Math.floor(robotTime.ms + performance.now() - robotTime.at + COMMAND_LIFE)}`;

const NOT_CONFIRMED = "Not confirmed – the robot has not answered within 2 s. The page does not send the command again. Look at the robot before you do.";

/// Sends a command, once. `tell` gets what the user has to know while there is no response.
async function sendCommand(method, iri, { body, tell } = {}) {
  const until = validUntil(), control = controlFor(iri), fields = { ...until && { "Valid-Until": until }, ...control && { "Control-Id": control } };
  const timer = setTimeout(() => tell?.(NOT_CONFIRMED), COMMAND_LIFE);
  try { return await sendRequest(method, iri, { body, fields }); } catch (e) {
    throw e instanceof Unreachable ? new Unreachable("Not confirmed – the robot does not respond. The page does not send the command again.") : e;
  } finally { clearTimeout(timer); }
}

const TOO_LATE = "Too late – the command came to the robot after its time and was not carried out. Give it again if you still want it.";
const problemText = (e) => e.type === lrt("LateCommand") ? TOO_LATE : e instanceof Problem && e.message !== e.title ? `${e.title}: ${e.message}` : e.message;

// ---- what a resource is and may do. Its response's own header fields and the documents that the robot writes say it, never the triples of a
// representation: clients write some of them.

/// Targets of Link fields by relation (RFC 8288).
function links(response, rel) {
  return [...response.field("Link").matchAll(/<([^>]*)>\s*;\s*rel="([^"]*)"/g)].filter((l) => l[2].split(" ").includes(rel)).map((l) => l[1]);
}
/// The media types and addresses of other representations.
const alternates = (response) => [...response.field("Link").matchAll(/<([^>]*)>;\s*rel="alternate";\s*type="([^"]*)"/g)].map(([, href, type]) => ({ href, type }));

const requestCache = new Map();
/// Sends a request, or returns the recent response to the same request. Several parts of a page share it. OPTIONS is cached longer, because
/// it depends on the structure only.
function cachedRequest(iri, method = "GET", ms = 5000, accept = undefined) {
  const key = method + iri + accept;
  if (!requestCache.has(key)) {
    const sent = sendRequest(method, iri, { accept });
    sent.catch(() => requestCache.delete(key));
    requestCache.set(key, sent);
    setTimeout(() => requestCache.delete(key), ms);
  }
  return requestCache.get(key);
}
/// The class, methods and links of a resource. OPTIONS reads no value of the robot.
async function optionsOf(iri) {
  const response = await cachedRequest(iri, "OPTIONS", 60000), methods = response.field("Allow").split(/[\s,]+/), types = links(response, "type"), one = (rel) => links(response, rel)[0];
  return { allows: (m) => methods.includes(m), isA: (type) => types.includes(type), up: one("up"), constrainedBy: one(ldp("constrainedBy")), origin: originOf(one("up") ?? one("describedby") ?? one("alternate")),
    alternates: alternates(response) };
}
/// The document without triples in which the robot says what a Thing, a container or an action has. Others have values there, so it is asked for
/// only when the class of the resource is known.
const overviewOf = async (iri) => (await cachedRequest(iri, "GET", 5000, JSON_TYPE)).g;
const forgetOverviews = () => { for (const key of requestCache.keys()) if (key.endsWith(JSON_TYPE)) requestCache.delete(key); };
/// The link of an overview to a resource.
const linkIn = (overview, iri) => ["properties", "actions", "collections", "graphs"].flatMap((part) => Object.values(overview[part] ?? {})).find((l) => l.href === iri);

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
