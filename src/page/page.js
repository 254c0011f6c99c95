// SPDX-License-Identifier: Apache-2.0
// The HTML page of the robot. It is the same for every resource: it asks for the header fields and the content of its own address. What the
// resource is and may do is in the fields, and in the documents of the robot they link to; the content is shown as data. The page assumes no
// paths. Changes arrive by WebSocket, or by polling if there is none.

// ---- the content for a resource, by its class

/// What the page of a resource shows: { title, lang, name, said, types, content }. `self` is its IRI, `is` its header fields, `up` the resource above.
async function contentOf({ self, is, g, up }) {
  const name = humanised(localName(self)), above = up && await optionsOf(up), isThing = (o) => o?.isA(hybrit("RoboticThing")) || o?.isA(lrt("World"));
  if (isThing(is)) return thingContent(self, g);
  const parent = isThing(above) ? await overviewOf(up) : {}, link = linkIn(parent, self) ?? { href: self };
  const member = { title: isNamed(link), name, said: saidOfLink(link), types: link.types };
  if (is.isA(hybrit("Property"))) {
    const shown = propertyCard(link, true);
    watchProperty(shown);
    return { ...member, content: [shown.element] };
  }
  if (is.isA(hybrit("Action"))) return { ...member, content: [actionCard({ ...link, ...await overviewOf(self) }, true)] };
  if (is.isA(lrt("Invocation"))) return { title: `Invocation of ${humanised(localName(up))}`, content: [h("div.card", invocationRow(self, true))] };
  if (is.isA(hybrit("Subscription"))) return { title: "Subscription", content: [table(SUBSCRIPTION, subscriptionRow(self, () => navigate(local(up))), ".subscriptions")] };
  if (is.isA(sh("NodeShape"))) return { title: `Blueprint of ${localName(self)}`.replace(/(-[0-9a-f]{8})+$/, ""), content: showBlueprint(g) };
  if (parent.state?.href === self) return thingContent(up, g);
  if (is.isA(ldp("Container")) && !up) return { title: "Robotic Things", content: showRoot(await overviewOf(withoutHash(location.href))) };
  if (is.isA(ldp("Container"))) return parent.subscriptions?.href === self ? { title: `Subscriptions of ${isNamed(parent)}`, content: [subscriptions(self)] } : { ...member, content: [collectionCard(link, true)] };
  return { ...member, title: link.title ?? pathText(self), content: showData(g, self) };  // the graph of a World, a member of a collection, or a document
}
async function thingContent(iri, g) {
  const overview = await overviewOf(iri), { title, description } = wordsOf(g, iri), name = humanised(localName(iri));
  return { title: title?.value ?? isNamed(overview), lang: title?.lang, said: description && h("p.said", h("span", { lang: description.lang }, description.value)), name, types: overview.types, content: showThing(iri, overview, g) };
}

async function show(focus) {
  const here = newView(), main = $("main"), address = withoutHash(location.href);
  main.setAttribute("aria-busy", "true");
  try {
    const [response, is] = await Promise.all([sendRequest("GET", address), optionsOf(address)]), plain = new URL(address.split("?")[0]);
    if (is.origin) robotOrigin = is.origin;
    // The IRI of the resource: the robot writes it into its header fields. If there are too many, it is the address below the public origin.
    const self = is.alternates[0]?.href.split("?")[0] ?? robotOrigin + plain.pathname, chain = await ancestorsOf(address), up = chain.at(-1);
    const { title, lang, said, types, content } = await contentOf({ self, is, g: response.g, up }), controls = await controlLines([...chain, self]);
    if (here.isClosed) return;
    document.title = `${title} – robot`;
    const heading = h("h1", { tabindex: "-1", lang }, title), pages = ["first", "prev", "next", "last"].flatMap((rel) => links(response, rel).map((l) => linkTo(l, rel)));
    main.replaceChildren(...[h("nav.crumbs", { "aria-label": "Breadcrumbs" }, chain.flatMap((c, i) => [i ? " › " : "", linkTo(c, i ? localName(c) : "Things")])), heading, up && types && h("p", chips(types)), said, ...controls, ...content.flat(),
      pages.length && h("nav.line", { "aria-label": "Pages" }, pages), source(response, address)].filter(Boolean));
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
// The server writes the content of a list of terms and of an error, for readers without scripts.
const { of: listOfTerms, home } = $("main").dataset;
if (listOfTerms ?? home) {
  robotOrigin = originOf(listOfTerms ?? home);
  tree(home ?? `${robotOrigin}/`, []).catch(() => {});
} else show();
