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

const isWeb = (iri) => /^https?:[/][/]/i.test(iri) && originOf(iri) !== "";
/// A link to a resource of this robot.
const linkTo = (iri, text) => h("a", { href: local(iri), title: iri }, text ?? pathText(iri));
/// An IRI in data. The text of a link is where it leads: a resource of this robot by its path, an address elsewhere in full. Others are text.
function iriIn(iri) {
  if (isOurs(iri)) return linkTo(iri, decodedOr(iri.slice(originOf(iri).length)));
  return isWeb(iri) ? h("a.foreign", { href: iri, title: `elsewhere: ${iri}`, rel: "noreferrer noopener" }, iri) : h("span", { title: iri }, iri);
}
const chips = (types) => types.map((t) => h("span.chip", { title: t }, localName(t)));

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
