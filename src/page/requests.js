// SPDX-License-Identifier: Apache-2.0
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
