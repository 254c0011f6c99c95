// SPDX-License-Identifier: Apache-2.0
// ---- the tree of Things

let treeRoot;

async function tree(root, current) {
  const nav = $("tree");
  if (treeRoot !== root) {
    const all = [];
    for (let page = root, n = 0; page && n < 20; ++n) {
      const { things = [], next } = await overviewOf(page);
      all.push(...things);
      page = next?.href;
    }
    treeRoot = root;
    $("home").href = local(root);
    nav.replaceChildren(branch(all, all.length <= 3));
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
  return h("ul", things.map((link) => {
    const iri = link.href, name = link.title ?? localName(iri), a = h("a", { href: local(iri) }, name), twist = h("button.twist", { type: "button", "aria-expanded": "false", "aria-label": `Parts of ${name}`, hidden: true });
    const item = Object.assign(h("li", twist, a), { iri, expand(yes) {
      if (yes && !item.children[2] && item.parts?.length) {
        item.append(branch(item.parts));
        markCurrent();
      }
      if (item.children[2]) item.children[2].hidden = !yes;
      twist.setAttribute("aria-expanded", String(yes));
    } });
    twist.addEventListener("click", () => item.expand(twist.getAttribute("aria-expanded") !== "true"));
    overviewOf(iri).then(({ things: parts = [] }) => {
      item.parts = parts;
      twist.hidden = !parts.length;
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
