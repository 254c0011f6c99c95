// SPDX-License-Identifier: Apache-2.0
// ---- the tree of Things

const BRANCH = 200;  // Things that a branch shows at first

let treeRoot;

/// Things as nodes { href, title, parts }. The structure of the robot has all in one document; where there is none, the parts are asked for.
async function nodesOf(root) {
  const all = [], pages = async (first, use) => {
    for (let page = first, n = 0; page && n < 50; ++n) {
      const overview = await overviewOf(page);
      use(overview.things ?? []);
      page = overview.next?.href;
    }
  };
  const { structure } = await overviewOf(root);
  if (!structure) {
    await pages(root, (things) => all.push(...things));
    return all;
  }
  const byPath = new Map();
  await pages(structure.href, (things) => {
    for (const { path, title, parent } of things) {
      const node = { href: robotOrigin + path, title, parts: [] };
      byPath.set(path, node);
      (byPath.get(parent)?.parts ?? all).push(node);
    }
  });
  return all;
}
async function tree(root, current) {
  const nav = $("tree");
  if (treeRoot !== root) {
    const all = await nodesOf(root);
    treeRoot = root;
    $("home").href = local(root);
    nav.shownPath = current;
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
    item.querySelector(":scope > a")?.removeAttribute("aria-current");
    if (!item.iri || !shownPath?.includes(item.iri)) continue;
    nearest = item;
    item.expand(true);
  }
  nearest?.children[1].setAttribute("aria-current", "page");
}
function branch(nodes, expanded) {
  const first = nodes.filter((node, n) => n < BRANCH || $("tree").shownPath?.includes(node.href)), list = h("ul", first.map((node) => leafOf(node, expanded)));
  if (nodes.length > first.length) {
    const more = h("li", button(`${nodes.length - first.length} more`, () => more.replaceWith(...nodes.filter((node) => !first.includes(node)).map((node) => leafOf(node)))));
    list.append(more);
  }
  return list;
}
function leafOf({ href: iri, title, parts }, expanded) {
  const name = title ?? localName(iri), a = h("a", { href: local(iri) }, name), twist = h("button.twist", { type: "button", "aria-expanded": "false", "aria-label": `Parts of ${name}`, hidden: true });
  const item = Object.assign(h("li", twist, a), { iri, expand(yes) {
    if (yes && !item.children[2] && item.parts?.length) {
      item.append(branch(item.parts));
      markCurrent();
    }
    if (item.children[2]) item.children[2].hidden = !yes;
    twist.setAttribute("aria-expanded", String(yes));
  } });
  const know = (its) => {
    item.parts = its;
    twist.hidden = !its.length;
    if (expanded) item.expand(true);
  };
  twist.addEventListener("click", () => item.expand(twist.getAttribute("aria-expanded") !== "true"));
  if (parts) know(parts);
  else overviewOf(iri).then(({ things = [] }) => {
    know(things);
    markCurrent();
  }, () => {});
  return item;
}
function menu(shown) {
  document.body.classList.toggle("menu", shown);
  $("menu").setAttribute("aria-expanded", String(shown));
}
$("menu").addEventListener("click", () => menu(!document.body.classList.contains("menu")));
