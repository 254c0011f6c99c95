// SPDX-License-Identifier: Apache-2.0
// ---- the current view

let view = { watches: new Set(), ticks: [], onStops: [] };

function newView() {
  view.isClosed = true;
  view.watches.forEach((w) => w.stop());
  view.observer?.disconnect();
  plots.clear();
  suspendedWatches = suspendedWatches.filter((w) => !view.watches.has(w));
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
  view = { watches: new Set(), ticks: [], onStops: [], observer, onVisibility,
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

const notice = (e) => h("p.bad", { role: "alert" }, problemText(e));
/// Loads a part of the view. An error is shown in `failed`. While the robot does not respond, `again` tries every 2 s.
function loadPart(failed, load, again = () => loadPart(failed, load)) {
  const here = view;
  return load().catch((e) => {
    if (here.isClosed) return;
    failed.replaceChildren(notice(e));
    if (e instanceof Unreachable) setTimeout(() => here.isClosed || again(), 2000);
  });
}
const wordsOf = (g, node) => ({ title: g.said(node, dcterms("title")), description: g.said(node, dcterms("description")) });
const titleOf = (g, node) => [dcterms("title"), rdfs("label"), sh("name")].map((p) => g.said(node, p)).find(Boolean)?.value ?? localName(g.id(node, sh("targetClass")) ?? node);
/// What people say of a resource, below its title: its name, if the title is another one, and its description.
const saidOf = ({ title, description }, name) => [title && title.value !== name && h("code.name", name), description && h("span", { lang: description.lang }, description.value)];
const isNamed = (link) => link.title ?? humanised(localName(link.href));
/// The same for a link of an overview, whose words the robot has chosen by Accept-Language.
const saidOfLink = ({ title, description, href }) => {
  const name = humanised(localName(href)), said = [title && title !== name && h("code.name", name), description && h("span", description)];
  return said.some(Boolean) && h("p.said.quiet", said);
};
const quiet = (...words) => h("p.quiet", ...words);
/// A button for a request. An error is shown in `failed`, and what the user has to know meanwhile: act() gets a function for it.
function command(words, act, failed, more) {
  const b = button(words, async () => {
    b.disabled = true;
    try {
      await act((told) => failed.replaceChildren(notice(new Error(told))));
      failed.replaceChildren();
    } catch (e) { failed.replaceChildren(notice(e)); }
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

/// The triples of a node, except for predicates that other parts of the page show. They are data: nothing of them is more than text or a link
/// that says where it leads.
function facts(g, node, hidden) {
  const rows = new Map();
  for (const [p, o] of g.of(node)) {
    if (hidden.includes(p)) continue;
    if (!rows.has(p)) rows.set(p, []);
    const shown = rows.get(p);
    if (shown.length < 50) shown.push(isInside(g, node, o) ? valueOf(g, o.id) : o.id ? iriIn(o.id) : h("span", { lang: o.lang }, o.value));
    else if (shown.length === 50) shown.push("…");
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
    for (const { href, type } of alternates(response).sort((a, b) => (b.type === JSON_TYPE) - (a.type === JSON_TYPE)))
      buttons.append(/^text|json|[+]xml|[/]n-|trig/.test(type) ? button(type, () => choose(type), { value: type }) : h("a", { href: local(href), rel: "alternate" }, type));
    choose(buttons.firstChild?.value ?? "text/turtle");
  } }, h("summary", "Formats and curl"), buttons, curl, h("pre", { tabindex: "0", "aria-label": "as text" }, code));
  return details;
}

// ---- properties

/// The form model for the body of a request to a resource, from the Blueprint of this robot that its Link rel=constrainedBy refers to.
async function bodyModelOf(iri, part = "") {
  const { constrainedBy } = await optionsOf(iri), blueprint = constrainedBy && withoutHash(constrainedBy);
  if (!blueprint || !isOurs(blueprint)) return nodeModel(new Graph());
  const { g } = await cachedRequest(blueprint), named = iri.replace(/-lrt(?=[/]|$)/g, "") + part;
  // The shape that targets the resource, or the shape of the Blueprint whose fragment is the path of the resource below its Thing.
  const shape = (!part && g.subjects(sh("targetNode"), iri)[0]) || [...g.about.keys()].find((s) => s.startsWith(blueprint + "#") && [iri + part, named].some((i) => i.endsWith("/" + s.split("#")[1])));
  return nodeModel(g, shape);
}

/// The image format that a property offers in its header fields. A change reloads it: one request at a time, at most ten a second. Formats that
/// the browser cannot display are left out.
function picture(name, iri) {
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
  return { element, update: async () => {
    const image = (await optionsOf(iri).catch(() => ({}))).alternates?.find(({ type }) => type.startsWith("image/"));
    if (!image) return;
    newest = local(image.href);
    if (!busy) load();
  } };
}

/// A property as a card: its value, age and plot; with a form if it is writable.
///
/// @param link  of the overview of its Thing
function propertyCard(link, large) {
  const iri = link.href, value = new ValueView(), plot = new Plot(), when = h("p.age.quiet"), write = h("div.write"), name = humanised(localName(iri)), image = picture(name, iri);
  const element = card(large ? "property.large" : "property", large ? 2 : 3, !large && iri, large ? "Value" : isNamed(link), !large && saidOfLink(link), image.element, value.element,
    link.frame && h("p.hint", "in the frame of ", isOurs(link.frame) ? linkTo(link.frame, localName(link.frame)) : iriIn(link.frame)), when, plot.element, write);
  let last, form;
  const tick = () => {
    const modified = last?.text(iri, dcterms("modified"));
    setText(when, modified ? age(modified) : "");
    when.title = modified ?? "";
  };
  view.ticks.push(tick);
  view.plot(plot);
  const here = view;
  const prefill = () => { if (form && last && !form.dirty && !form.whole.contains(document.activeElement)) form.read(last, iri); };
  const update = (g) => {
    const error = g.text(iri, lrt("error"));
    last = error ? undefined : g;
    if (error) return tick(), fail(new Error(error));
    const all = leaves(g, iri);
    plot.add(all);
    value.show(all, plot);
    image.update();
    tick();
    prefill();
  };
  const fail = (e) => {
    value.key = null;
    value.element.replaceChildren(notice(e));
  };
  loadPart(write, async () => {
    if (!(await optionsOf(iri)).allows("PUT")) return write.replaceChildren();
    form = formElement({ target: iri, model: await bodyModelOf(iri), method: "PUT", title: "Set", name: `Set ${name}`, done: async () => {
      const { g } = await sendRequest("GET", iri);
      update(g);
      form.read(g, iri);
      return "Set";
    } });
    write.replaceChildren(form.parts.length ? form.whole : quiet("There is no form for this shape."));
    showReasons(form, link, here);
    prefill();
  });
  return { iri, element, plot, update, fail };
}

/// Keeps the reason why the form of a property or a collection cannot be sent, while the robot is stopped and released.
function showReasons(form, link, here) {
  form.setReason(link.unavailable);
  here.onStops.push(() => reasonOf(link.href).then(form.setReason, () => {}));
}

/// A property in one line, for the card of a Thing.
function propertyRow(link) {
  const iri = link.href, value = new ValueView(), plot = Object.assign(new Plot(), { small: true });
  const element = h("div.row", h("a", { href: local(iri), title: [localName(iri), link.description].filter(Boolean).join(": ") }, isNamed(link)), value.element, plot.element);
  view.plot(plot);
  return { iri, element, plot, fail: () => {}, update: (g) => {
    const error = g.text(iri, lrt("error"));
    if (error) {
      value.key = null;
      return value.element.replaceChildren(h("span.bad", error));
    }
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
      const states = g.ids(iri, lrt("status")), name = states.length === 1 ? localName(states[0]) : "?", error = g.text(iri, lrt("error"));
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

/// An action with its form and its invocations. A POST to its own address invokes it.
///
/// @param link  of the overview of its Thing, or its own overview
function actionCard(link, large) {
  const iri = link.href, name = humanised(localName(iri)), body = h("div", quiet("…")), list = h("ul.invocations", { role: "list", "aria-label": "Invocations" }), seen = new Set(), maxInvocations = large ? 40 : 5;
  const element = card("action", large ? 2 : 3, !large && iri, large ? "Run" : isNamed(link), !large && saidOfLink(link), body, list);
  let form, unavailable = link.unavailable;
  const addInvocation = (invocation) => {
    if (seen.has(invocation)) return;
    seen.add(invocation);
    list.prepend(invocationRow(invocation));
    while (list.childElementCount > maxInvocations) list.lastChild.remove();
  };
  const update = (overview) => {
    unavailable = overview.unavailable;
    form?.setReason(unavailable);
    overview.invocations?.slice(-maxInvocations).forEach((i) => addInvocation(i.href));
  };
  const done = (response) => {
    const made = response.field("Location");
    if (isOurs(made)) addInvocation(made);
    return "Sent";
  };
  loadPart(body, async () => {
    if (!(await optionsOf(iri)).allows("POST")) return body.replaceChildren(quiet("You may not run it."));
    const model = link.input ? await bodyModelOf(iri, "/input") : nodeModel(new Graph());
    form = formElement({ target: iri, model, method: "POST", title: name, name: `Run ${name}`, done, mustBeHeld: () => link.release || isRelease(iri) });
    body.replaceChildren(form.whole);
    form.setReason(unavailable);
  });
  view.watch(element, iri, { g: update, problem: (e) => list.replaceChildren(notice(e)) }, { accept: JSON_TYPE });
  return element;
}

// ---- containers

/// Keeps one element for each member of a container. Containers are polled, because they cannot be observed.
function members(element, list, container, make, every) {
  const rows = new Map();
  return view.watch(element, container, { problem: (e) => list.replaceChildren(notice(e)), g: (g) => {
    const now = (g.members ?? []).map((m) => m.href);
    for (const [m, row] of rows) if (!now.includes(m)) { row.remove(); rows.delete(m); }
    for (const m of now) {
      if (rows.has(m)) continue;
      rows.set(m, make(m));
      list.append(rows.get(m));
    }
    element.classList.toggle("empty", !now.length);
  } }, { socket: false, every, accept: JSON_TYPE });
}

const SUBSCRIPTION = ["Resource", "To", "Delivered", "Dropped", "Since", "Last error", ""];
function subscriptionRow(iri, onCancelled) {
  const cells = SUBSCRIPTION.map((name) => h("td", { "data-label": name || null })), [what, how, delivered, dropped, since, error, last] = cells;
  const element = h("tr", cells);
  last.append(command("Cancel", async (tell) => { await sendCommand("DELETE", iri, { tell }); onCancelled(); }, error));
  view.watch(element, iri, { problem: () => {}, g: (g) => {
    const text = (p) => g.text(iri, p) ?? "", of = text(hybrit("onResource")), queue = text(lrt("queueLength"));
    if (what.title !== of) what.replaceChildren(iriIn(what.title = of));
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

function collectionCard(link, large) {
  const here = view, iri = link.href, name = humanised(localName(iri)), list = h("ul.members", { role: "list" }), form = h("div");
  const element = card("action", large ? 2 : 3, !large && iri, large ? "Members" : isNamed(link), !large && saidOfLink(link), list, h("p.none.quiet", "empty"), form);
  const watch = members(element, list, iri, (member) => {
    const value = h("div"), error = h("p"), remove = command("Remove", async (tell) => { await sendCommand("DELETE", member, { tell }); watch.schedule(0); }, error, { hidden: true });
    optionsOf(member).then((o) => { remove.hidden = !o.allows("DELETE"); }, () => {});
    sendRequest("GET", member).then((a) => value.append(valueOf(a.g, member)), () => {});
    return h("li", h("div.line", h("a", { href: local(member) }, localName(member)), remove), value, error);
  });
  loadPart(form, async () => {
    if (!(await optionsOf(iri)).allows("POST")) return form.replaceChildren();
    const its = formElement({ target: iri, model: await bodyModelOf(iri), method: "POST", title: "Add", name: `Add to ${name}`, done: () => { watch.schedule(0); return "Added"; } });
    form.replaceChildren(its.whole);
    showReasons(its, link, here);
  });
  return element;
}

// ---- things

/// Updates properties from the state of their Thing. If the state cannot be read, each property is watched by itself.
function watchState(element, state, shown, cancelled) {
  const watch = view.watch(element, state, { g: (g) => shown.forEach((p) => p.update(g)), state: (s) => cancelled?.(s === "cancelled"), silence: (from) => shown.forEach((p) => p.plot.silence(from)),
    problem: () => {
      watch.finished = true;
      watch.stop();
      shown.forEach(watchProperty);
    } });
  for (const p of shown) p.plot.watch = watch;
  return watch;
}
function watchProperty({ iri, element, plot, update, fail }) {
  plot.watch = view.watch(element, iri, { g: update, problem: fail, silence: (from) => plot.silence(from) });
}

/// A Thing as a card. It is requested when the card becomes visible.
function thingCard(link, level = 3) {
  const iri = link.href, failed = h("div"), element = card("thing", level, iri, isNamed(link), h("p", chips(link.types ?? [])), failed), here = view;
  let begun;
  view.onVisibility(element, () => {
    if (begun) return;
    begun = true;
    loadPart(failed, async () => {
      const { properties = {}, actions = {}, things = [], graphs = [], state } = await overviewOf(iri);
      if (here.isClosed) return;
      failed.remove();
      const shown = Object.values(properties).map(propertyRow), named = Object.values(actions), parts = things.length;
      element.append(...shown.map((p) => p.element));
      if (named.length) element.append(h("p.actions", h("span.quiet", "actions:"), " ", named.flatMap((a, i) => [i ? ", " : "", linkTo(a.href, humanised(localName(a.href)))])));
      if (parts) element.append(quiet(`${parts} parts`));
      if (graphs.length) element.append(quiet(`${graphs.length} graphs`));
      element.classList.toggle("plain", !shown.length && !named.length && !parts && !graphs.length);
      if (shown.length) watchState(element, state.href, shown);
    });
  }, () => {});
  return element;
}
const thingCards = (things, level) => h("div.cards", things.map((t) => thingCard(t, level)));

/// The page of a Thing: what its overview links to, and the triples about it as data.
function showThing(iri, overview, g) {
  const of = (part) => Object.values(overview[part] ?? {}), actions = of("actions"), collections = of("collections"), parts = of("things"), graphs = overview.graphs ?? [];
  const shown = of("properties").map((p) => propertyCard(p)), grid = h("div.cards", shown.map((p) => p.element));
  const stopped = h("p.bad", { hidden: true }, "This page's subscription was cancelled. ", button("Watch again", () => { watch.finished = false; watch.start(); }));
  const watch = shown.length && watchState(grid, overview.state.href, shown, (is) => { stopped.hidden = !is; });
  // Predicates whose objects are all shown elsewhere: ros:rotation in addition to hybrit:property.
  const all = [...of("properties"), ...actions, ...collections].map((l) => l.href), domain = g.of(iri).map(([p]) => p).filter((p) => g.all(iri, p).every((o) => all.includes(o.id)));
  const about = facts(g, iri, [...THING_PARTS, ...domain]), blueprints = ["blueprint", "boundsBlueprint", "ownBlueprint"].flatMap((b) => overview[b]?.href ?? []);
  return [overview.types?.includes(ros("Robot")) && g.id(iri, lrt("rootLink")) && section("Skeleton", skeleton(iri, overview, g)), shown.length && section("Properties", stopped, grid),
    actions.length && section("Actions", h("div.cards.wide", actions.map((a) => actionCard(a)))), collections.length && section("Collections", h("div.cards.wide", collections.map((c) => collectionCard(c)))),
    graphs.length && section("Graphs", h("div.cards", graphs.map(graphCard))), parts.length && section("Parts", thingCards(parts)), about && section("About", about),
    overview.subscriptions && subscriptionsOf(overview.subscriptions.href, blueprints)];
}
const THING_PARTS = [rdf("type"), lrt("state"), lrt("collection"), ldp("contains"), ...["title", "description", "hasPart", "isPartOf"].map(dcterms), ...["property", "action", "subscriptions", "blueprint", "websocketUrl"].map(hybrit)];
/// A graph that a client has made has a name of the client's: it is shown as the path that it is.
const graphCard = (link) => card("graph", 3, link.href, link.title ?? pathText(link.href), saidOfLink(link), quiet(`${link.triples} triples`));

function subscriptionsOf(container, blueprints) {
  const details = h("details", { ontoggle: () => { if (!details.children[1]) details.append(subscriptions(container)); } }, h("summary", "Subscribers"));
  return section("Subscriptions and shapes", details, h("p", linkTo(container, "All subscriptions"), blueprints.map((b, i) => [" · ", linkTo(b, "Blueprint" + (i ? ` ${i + 1}` : ""))])));
}

function showRoot(overview) {
  const { things = [] } = overview, here = view, box = h("div", thingCards(things, 2));
  // If there are few robots, their parts are shown, too.
  if (things.length <= 3) for (const t of things) overviewOf(t.href).then(({ things: parts = [] }) => {
    if (parts.length && !here.isClosed) box.append(section(`Parts of ${isNamed(t)}`, thingCards(parts)));
  }, () => {});
  return [box];
}

/// Triples as data: what others have written, too. Nothing of them decides what the page offers.
function showData(g, base) {
  const subjects = [...g.about.keys()].filter((s) => !isBlank(s)), whole = subjects.slice(0, 300);
  const name = (s) => s.startsWith(base + "#") ? s.slice(base.length) : isOurs(s) ? "/" + pathText(s) : s;
  return [h("p.note", "Data – the robot shows what is written here and does not judge it."), ...whole.map((s) => h("section.data", h("h2", h("code", name(s))), facts(g, s, []))),
    subjects.length > whole.length && quiet(`${subjects.length - whole.length} more subjects are in the formats below.`)];
}

function showBlueprint(g) {
  const rows = (model, before) => model.fields.flatMap((f) => {
    const name = [before, fieldName(f)].filter(Boolean).join(" › "), v = f.element ?? f;
    if (f.kind === "choice") return f.alternatives.flatMap((a) => {
      const tag = [before, fieldName(a)].filter(Boolean).join(" › "), its = rows({ fields: [a] }, before);
      return its.length ? its.map(([n, ...rest]) => [`one of: ${n}`, ...rest]) : [[`one of: ${tag}`, "nothing more", "", ""]];
    });
    if (f.kind === "node") return rows(f.node, name);
    return [[name || "value", (f.element ? "list of " : "") + (v.choices ? v.choices.map((c) => c.id ? localName(c.id) : c.value).join(" | ") : v.kind), hint({ ...v, kind: "", types: [], minValues: f.minValues }), f.unit]];
  });
  return g.subjects(rdf("type"), sh("NodeShape")).filter((s) => !isBlank(s)).map((s) => {
    const target = g.id(s, sh("targetNode")), lines = rows(nodeModel(g, s), "");
    return section(titleOf(g, s), target && h("p", h("span.quiet", "of "), iriIn(target)),
      lines.length ? table(["Property", "Kind", "Limits", "Unit"], lines.map((l) => h("tr", l.map((c) => h("td", c))))) : quiet("links and types"));
  });
}
