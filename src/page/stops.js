// SPDX-License-Identifier: Apache-2.0
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
