// SPDX-License-Identifier: Apache-2.0
// ---- elements. Text is only inserted as text. The markup has no style attributes and no event handlers.

/// Creates an element: h("p.quiet", { title }, children ...). The second argument is optional. A property "on..." is an event handler.
function h(selector, properties, ...children) {
  const [tag, ...classes] = selector.split(".");
  const element = document.createElement(tag);
  if (classes.length) element.className = classes.join(" ");
  if (properties?.constructor !== Object) children.unshift(properties);
  else for (const [name, value] of Object.entries(properties)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value ?? false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat(3).filter((c) => c ?? false));
  return element;
}
const button = (words, onclick, more) => h("button.small", { type: "button", onclick, ...more }, words);
const $ = (id) => document.getElementById(id);
const setText = (element, text) => { if (element.textContent !== text) element.textContent = text; };
let lastId = 0;
const freshId = () => "i" + ++lastId;

const isWeb = (iri) => /^https?:/i.test(iri);
function linkTo(iri, text) {
  if (isOurs(iri)) return h("a", { href: local(iri), title: iri }, text ?? pathText(iri));
  return isWeb(iri) ? h("a", { href: iri, title: iri, rel: "noreferrer" }, text ?? localName(iri)) : h("span", { title: iri }, text ?? iri);
}
/// The types of a node, without classes that are its Blueprints.
const chips = (g, node) => g.ids(node, rdf("type")).filter((t) => !g.ids(node, hybrit("blueprint")).includes(withoutHash(t))).map((t) => h("span.chip", { title: t }, localName(t)));

function copyable(text) {
  const code = h("code", text), copy = button("Copy", async () => {
    try {
      await navigator.clipboard.writeText(text);
    } catch {  // the clipboard requires a secure context
      getSelection().selectAllChildren(code);
      document.execCommand("copy");
    }
    setText(copy, "Copied");
    setTimeout(() => setText(copy, "Copy"), 1500);
  });
  return h("div.copyable", code, copy);
}
