// SPDX-License-Identifier: Apache-2.0
// ---- stops: the buttons in the header section of every page, the Escape key, and what is stopped

let stops = [], stopStates = [];  // addresses of the actions; states as `/` has them, { thing, state, stopped, since, by, release }

async function invokeStops(iris) {
  enableMotion?.(false);
  abortController.abort();  // browsers limit parallel requests, and pending commands must not continue
  abortController = new AbortController();
  const said = $("stopped");
  said.className = "";
  setText(said, "Stopping …");
  const ends = await Promise.allSettled(iris.map((iri) => sendRequest("POST", iri, { signal: null }))), failed = ends.find((e) => e.reason);
  // Where the robot says whether it is stopped, the page leaves it to the robot.
  setText(said, failed ? `Not stopped: ${problemText(failed.reason)}` : stopStates.length ? "" : `Stopped at ${new Date().toLocaleTimeString()}`);
  said.className = failed ? "bad" : "succeeded";
}

/// The list of Things: the page of an error says where it is.
async function findRoot() {
  const { home } = $("main").dataset, at = withoutHash(location.href);
  if (home) return new URL(new URL(home).pathname, location.href).href;
  try { return (await ancestorsOf(at))[0] ?? ((await optionsOf(at)).isA(ldp("Container")) ? at : "/"); } catch { return "/"; }
}
async function findStops() {
  try {
    const root = new URL(await findRoot(), location.href).href, { g: overview, ...top } = await cachedRequest(root, "GET", 5000, JSON_TYPE);
    robotOrigin = originOf(overview.href);
    const [session] = links(top, lrt("session"));
    if (session && !user) findUser(session);
    stops = (overview.stops ?? []).map((s) => s.href);
    showStopButtons();
    watchStopStates(root, overview.stopStates ?? []);
  } catch { setTimeout(findStops, 2000); }
}
function showStopButtons() {
  const make = (words, iris) => h("button", { type: "button", onclick: () => invokeStops(iris) }, words), named = (iri) => humanised(localName(iri));
  if (!stops.length) return;
  const each = stops[1] ? stops.map((iri) => make(`${named(iri)} ${pathText(iri).split("/actions")[0]}`, [iri])) : [];
  $("stops").replaceChildren(make(`${stops[1] ? "stop all" : named(stops[0])} (Esc)`, stops), ...each, h("span", { id: "stopped", role: "alert" }));
}

// What is stopped. A few states are watched one by one; of many, the list of Things is asked.

function watchStopStates(root, states) {
  const set = (next) => {
    const held = (states) => states.filter((s) => s.stopped).map((s) => s.state).join(), isChange = held(next) !== held(stopStates);
    stopStates = next;
    showStopStates();
    if (!isChange) return;
    forgetOverviews();
    view.onStops.forEach((act) => act());
  };
  set(states);
  if (!states.length) return;
  if (states.length > 2) new Watch(root, { g: (overview) => set(overview.stopStates ?? []) }, { socket: false, every: 1000, accept: JSON_TYPE }).start();
  else for (const { state } of states) {
    // A state that cannot be read counts as stopped.
    const update = (now) => set(stopStates.map((s) => s.state === state ? { thing: s.thing, state, release: s.release, ...now } : s));
    new Watch(state, { g: update, problem: (e) => update({ stopped: true, unknown: problemText(e) }) }, { accept: JSON_TYPE }).start();
  }
}
function timeText(iso) {
  const at = new Date(Date.parse(iso) - clockOffset), isToday = at.toDateString() === new Date().toDateString();
  return Number.isNaN(at.valueOf()) ? "" : isToday ? at.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", hourCycle: "h23" }) : at.toLocaleString([], { dateStyle: "medium", timeStyle: "short", hourCycle: "h23" });
}
/// "Stopped since 12:03 by alice"
const stoppedText = ({ since, by, unknown }) => ["Stopped", since && `since ${timeText(since)}`, by && `by ${by}`, unknown && `(whether it still is cannot be read – ${unknown})`].filter(Boolean).join(" ");
function showStopStates() {
  const held = stopStates.filter((s) => s.stopped), line = $("stop-notice");
  line.hidden = !held.length;
  line.replaceChildren(...held.slice(0, 4).map((s) => h("p", h("b", stoppedText(s)), " – ", linkTo(s.thing), s.release && [" · its release is ", linkTo(s.release)])),
    ...(held.length > 4 ? [h("p", `and ${held.length - 4} more Things`)] : []));
}
/// Why a property or a collection cannot be changed now: its Thing says it.
async function reasonOf(iri) {
  const { up } = await optionsOf(iri);
  return linkIn(await overviewOf(up), iri)?.unavailable;
}
const isRelease = (iri) => stopStates.some((s) => s.release === iri);
findStops();
addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || event.repeat || !stops.length) return;
  event.preventDefault();
  invokeStops(stops);
});
