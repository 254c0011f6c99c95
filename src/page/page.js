// SPDX-License-Identifier: Apache-2.0
// The HTML page of the robot. It is the same for every resource: it requests its own address as N-Triples and follows the links in the
// response. It assumes no paths. Changes arrive by WebSocket, or by polling if there is none.

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
