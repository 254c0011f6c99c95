// SPDX-License-Identifier: Apache-2.0
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
