// SPDX-License-Identifier: Apache-2.0
// ---- forms from shapes

/// The form model of a node shape: { fields, fixed, classes, unit }. Constraints that a form cannot express are checked by the robot only.
function nodeModel(g, shape, depth = 0) {
  const model = { fields: [], fixed: [], classes: [], unit: "" }, shapes = shape ? [shape] : [], byPath = new Map(), tagged = new Map();
  let mayBeAbsent = false;
  if (depth > 6) return model;
  for (const s of shapes) {
    const more = [...g.ids(s, sh("node")), ...listed(g, s, "and")];
    // The last alternative with properties: lrt writes optional parts as "nothing, or this".
    more.push(listed(g, s, "or").filter((id) => g.id(id, sh("property")) || g.id(id, sh("xone"))).pop());
    const own = alternativesOf(g, s);
    mayBeAbsent ||= own.mayBeAbsent;
    for (const [path, p] of own) tagged.set(path, [...(tagged.get(path) ?? []), p]);
    shapes.push(...more.filter((m) => m && !shapes.includes(m) && shapes.length < 50));
    model.classes.push(...g.ids(s, sh("targetClass")), ...g.ids(s, sh("class")));
    for (const p of g.ids(s, sh("property"))) {
      const path = g.id(p, sh("path"));
      if (path && !g.about.has(path)) byPath.set(path, [...(byPath.get(path) ?? []), p]);
    }
  }
  const choices = [...tagged].map(([path, parts]) => {
    const all = [...parts, ...(byPath.get(path) ?? [])], field = { ...valueModel(g, all, depth), path, minValues: 1 };
    byPath.delete(path);
    const isEmpty = field.kind === "text" && !field.types.length && !field.choices;
    return isEmpty ? { ...field, kind: "node", node: nodeModel(g, all.find((p) => g.id(p, sh("class"))) ?? all[0], depth + 1) } : field;
  });
  if (choices.length) model.fields.push({ kind: "choice", alternatives: choices, path: "", minValues: mayBeAbsent ? 0 : 1, name: "" });
  for (const [path, parts] of byPath) {
    const field = { ...valueModel(g, parts, depth), path }, only = field.choices?.length === 1 && field.choices[0];
    if (field.maxValues === 0) continue;
    if (!only) model.fields.push(field);
    else {
      model.fixed.push([path, only]);
      if (UNIT_PREDICATES.includes(path)) model.unit = unitText(only.id);
    }
  }
  for (const field of model.fields) field.unit ||= model.unit;
  return model;
}
/// The alternatives of sh:xone, [predicate, property shape], if each requires one predicate, or that there is none; else nothing.
function alternativesOf(g, s) {
  const all = listed(g, s, "xone").map((m) => g.id(m, sh("path")) ? [m] : g.ids(m, sh("property"))), present = all.filter((ps) => !ps.length || ps.some((p) => g.number(p, sh("maxCount")) !== 0));
  const required = present.map((ps) => ps.filter((p) => g.number(p, sh("minCount")) > 0));
  const found = required.every((ps) => ps.length === 1 && !g.about.has(g.id(ps[0], sh("path")))) ? required.map(([p]) => [g.id(p, sh("path")), p]) : [];
  return Object.assign(found, { mayBeAbsent: found.length > 0 && found.length < all.length });
}
/// The members of the lists in sh:or or sh:and.
const listed = (g, s, which) => g.ids(s, sh(which)).flatMap((l) => g.list(l).flatMap((o) => o.id ?? []));

/// The field of a form for all property shapes with one path.
function valueModel(g, parts, depth) {
  const field = { minValues: 0, maxValues: Infinity, kind: "text", name: "", words: new Map() }, types = [];
  for (const p of parts) {
    const said = g.said(p, sh("name"))?.value, name = g.all(p, sh("name")).find((o) => !o.lang)?.value;
    field.name ||= said && name && said !== name ? `${said} (${name})` : said ?? "";
    field.description ??= g.said(p, sh("description"))?.value;
    field.minValues = Math.max(field.minValues, g.number(p, sh("minCount")) ?? 0);
    const withUnit = g.id(p, sh("defaultValue"));
    field.default ??= withUnit ? g.text(withUnit, vom("numericalValue")) : g.text(p, sh("defaultValue"));
    field.maxValues = Math.min(field.maxValues, g.number(p, sh("maxCount")) ?? Infinity);
    for (const w of g.ids(p, rdfs("seeAlso"))) field.words.set(g.text(w, rdf("value")), wordsOf(g, w));
    field.choices ??= [...g.ids(p, sh("in")).map((l) => g.list(l)), ...g.all(p, sh("hasValue")).map((o) => [o])][0];
    // Datatypes and bounds are in the shape itself or in its alternatives.
    for (const c of [p, ...listed(g, p, "or"), ...listed(g, p, "or").flatMap((o) => listed(g, o, "or"))]) {
      types.push(...g.ids(c, sh("datatype")));
      for (const side of ["min", "max"]) for (const kind of ["Inclusive", "Exclusive"]) {
        const n = g.number(c, sh(side + kind));
        if (n !== undefined && Math.abs(n) < 2e9) Object.assign(field, { [side]: n, [side + "Exclusive"]: kind === "Exclusive" });  // larger bounds are those of a datatype and are not shown
      }
    }
    if (g.ids(p, sh("nodeKind")).includes(sh("IRI"))) field.kind = "iri";
    const inner = [p, ...g.ids(p, sh("node"))].flatMap((n) => g.ids(n, sh("property")));
    const element = inner.find((q) => g.list(g.id(q, sh("path"))).at(-1)?.id === rdf("first"));
    const cells = inner.find((q) => g.id(g.id(q, sh("path")), sh("zeroOrMorePath")));
    if (element) Object.assign(field, { kind: "list", element: valueModel(g, [element], depth + 1), minItems: (g.number(cells, sh("minCount")) ?? 1) - 1, maxItems: (g.number(cells, sh("maxCount")) ?? Infinity) - 1 });
    else if (inner.length || [p, ...g.ids(p, sh("node"))].some((n) => alternativesOf(g, n).length)) Object.assign(field, { kind: "node", node: nodeModel(g, p, depth + 1) });
  }
  if (field.kind === "text") {
    field.types = types;
    if (types.some((t) => NUMBER_TYPES.includes(t)) || (!types.length && (field.min ?? field.max) !== undefined)) field.kind = "number";
    else if (types.length && types.every(isIntegerType)) field.kind = "integer";
    else if (types.includes(xsd("boolean"))) field.kind = "boolean";
  }
  return field;
}

function hint(field) {
  const { min, max, minValues, kind } = field, bound = (n) => String(Number(n.toPrecision(6)));
  const above = field.minExclusive ? "above " : "", below = field.maxExclusive ? "below " : "";
  return [kind === "integer" && "whole number",
    min !== undefined && max !== undefined ? `${above}${bound(min)} to ${below}${bound(max)}` : min !== undefined ? `${above || "at least "}${bound(min)}` : max !== undefined && `${below || "at most "}${bound(max)}`,
    minValues === 0 && (field.default !== undefined ? `if empty: ${field.default || "an empty text"}` : "optional"),
    kind === "iri" && "an IRI", field.description].filter(Boolean).join(", ");
}
const fieldName = (field) => field.name || (UNNAMED.has(field.path) ? "" : humanised(localName(field.path)));

/// The literal for a text. An invalid number is sent as it was typed; the robot reports the error.
function literalOf(text, { types = [], kind }) {
  if (types.length === 1 || !["number", "integer"].includes(kind)) return { value: text, type: types[0] };
  if (/^[+-]?\d+$/.test(text)) return { value: text, type: xsd("integer") };
  return { value: text, type: Number.isFinite(Number(text)) ? xsd("double") : undefined };
}
function niceStep(range) {
  const power = 10 ** Math.floor(Math.log10(range / 200));
  return [1, 2, 5, 10].map((n) => n * power).find((s) => range / s <= 200.01);
}

/// A form for one model. Each control has its node and predicate, by which showReport() finds the control for a result of a SHACL report. Parts
/// are { element, write(triples, subject), read(graph, subject) }.
class Form {
  controls = [];

  constructor(target, model) {
    Object.assign(this, { target, model, parts: model.fields.map((f) => this.part(f, () => target)) });
    this.element = h("div", this.parts.map((p) => p.element));
  }
  part(field, subject) {
    return field.kind === "choice" ? this.choice(field, subject) : field.kind === "node" ? this.node(field) : field.kind === "list" ? this.rows(field, subject) : this.single(field, subject);
  }
  /// Nodes have IRIs, so that a SHACL report can refer to them.
  node(field) {
    let node;
    const { fields, fixed, classes } = field.node, alone = fields.length === 1 && fields[0].kind !== "choice";  // a node with one value is shown as that value
    const inner = fields.map((f) => this.part(alone ? { ...f, name: fieldName(field), outer: field.path, minValues: field.minValues && f.minValues } : f, () => node));
    const error = h("p.error");
    const element = alone ? inner[0].element : h("fieldset", h("legend", fieldName(field)), inner.map((p) => p.element), error);
    if (!alone) this.controls.push({ subject: () => node, outer: field.path, error });
    return { element,
      write: (triples, s) => {
        node = `${this.target}#n${++this.nodes}`;
        const own = [];
        inner.forEach((p) => p.write(own, node));
        if (own.length || field.minValues) triples.push([s, field.path, { id: node }], ...classes.map((c) => [node, rdf("type"), { id: c }]), ...fixed.map(([p, o]) => [node, p, o]), ...own);
      },
      read: (g, s) => { const n = g.id(s, field.path); if (n) inner.forEach((p) => p.read(g, n)); } };
  }
  /// One of several alternatives. The others stay as they were filled in, and are not written.
  choice(field, subject) {
    const id = freshId(), error = h("p.error", { id: id + "e" }), { alternatives } = field;
    const parts = alternatives.map((f) => this.part(f, subject)), rows = parts.map((p) => h("div.alternative", { hidden: true }, p.element));
    const input = h("select", { id, "aria-describedby": id + "e", "aria-required": field.minValues > 0 && "true", onchange: () => show() }, h("option", field.minValues ? "choose …" : "none"), alternatives.map((f) => h("option", fieldName(f))));
    const now = () => input.selectedIndex - 1, show = () => rows.forEach((row, i) => { row.hidden = now() !== i; });
    this.controls.push({ subject, input, error });
    return { element: h("div.choice", h("div.entry", h("label", { for: id }, "one of"), h("div.line", input), error), rows),
      write: (triples, s) => parts[now()]?.write(triples, s),
      read: (g, s) => {
        const found = alternatives.findIndex((f) => g.one(s, f.path));
        if (found < 0 && field.minValues) return;
        input.selectedIndex = found + 1;
        show();
        parts[found]?.read(g, s);
      } };
  }
  rows(field, subject) {
    const error = h("p.error"), list = h("ol"), parts = [], open = field.minItems !== field.maxItems, name = fieldName(field);
    const changed = () => list.dispatchEvent(new Event("input", { bubbles: true }));
    const add = () => {
      const part = this.part({ ...field.element, path: rdf("first"), name: `${name} ${parts.length + 1}`, minValues: 1 }, () => null);
      part.row = h("li", part.element, open && button("Remove", () => {
        parts.splice(parts.indexOf(part), 1);
        part.row.remove();
        changed();
      }));
      parts.push(part);
      list.append(part.row);
    };
    const resize = (n) => {
      while (parts.length < n) add();
      while (parts.length > n) parts.pop().row.remove();
    };
    resize(Math.max(0, field.minItems));
    this.controls.push({ subject, path: field.path, isList: true, error });
    return {
      element: h("fieldset", h("legend", name || "values"), list, open && button("Add a row", () => { add(); changed(); list.lastChild.querySelector("input, select")?.focus(); }), error),
      write: (triples, s) => {
        const cell = (i) => ({ id: i < parts.length ? `_:c${s.length}x${at}x${i}` : rdf("nil") }), at = ++this.nodes;
        triples.push([s, field.path, cell(0)]);
        parts.forEach((p, i) => {
          p.write(triples, cell(i).id);
          triples.push([cell(i).id, rdf("rest"), cell(i + 1)]);
        });
      },
      read: (g, s) => {
        let at = g.id(s, field.path);
        if (!at) return;
        resize(g.list(at).length);
        for (const p of parts) { p.read(g, at); at = g.id(at, rdf("rest")); }
      } };
  }
  single(field, subject) {
    const id = freshId(), error = h("p.error", { id: id + "e" }), note = hint(field), { kind, choices, path, minValues } = field;
    const common = { id, "aria-describedby": `${id}h ${id}e`, "aria-required": minValues > 0 && kind !== "boolean" && "true" };
    const label = h("label", { for: id }, fieldName(field) || "value", field.unit && ` [${field.unit}]`);
    let input, slider, get, set;
    if (choices) {
      input = h("select", common, h("option", { value: "" }, minValues ? "choose …" : "none"), choices.map((o, i) => {
        const { title, description } = field.words.get(o.value) ?? {};
        return h("option", { value: String(i), lang: title?.lang, title: description?.value }, o.id ? localName(o.id) : title && title.value !== o.value ? `${title.value} (${o.value})` : o.value);
      }));
      get = () => choices[input.value];
      set = (o) => { input.value = choices.findIndex((c) => nTriplesOf(c) === nTriplesOf(o)); };
    } else if (kind === "boolean") {
      input = h("input", { ...common, type: "checkbox" });
      get = () => ({ value: String(input.checked), type: xsd("boolean") });
      set = (o) => { input.checked = isTrue(o); };
    } else {
      const isNumber = kind === "number" || kind === "integer", range = field.max - field.min;
      // A text field: a number field hides invalid input from scripts, and the robot could not report the error.
      input = h(isNumber ? "input.short" : "input", { ...common, type: "text", inputmode: isNumber && "decimal", autocomplete: "off", spellcheck: "false" });
      get = () => {
        const text = isNumber ? input.value.trim().replace(",", ".") : input.value;
        if (text === "" && (kind !== "text" || !minValues)) return;
        return kind === "iri" ? { id: text } : literalOf(text, field);
      };
      if (isNumber && range > 0 && range <= 1e6) {
        const step = kind === "integer" ? 1 : niceStep(range);
        slider = h("input", { type: "range", min: String(field.min + (field.minExclusive ? step : 0)), max: String(field.max - (field.maxExclusive ? step : 0)), step: String(step), value: String(field.min),
          "aria-label": `slider of ${label.textContent}`, oninput: () => { input.value = slider.value; } });
        input.addEventListener("input", () => { if (Number.isFinite(toNumber(input.value))) slider.value = input.value; });
      }
      set = (o) => {
        input.value = o.id ?? o.value;
        if (slider) slider.value = input.value;
      };
    }
    this.controls.push({ subject, path, outer: field.outer, input, error });
    return { element: h("div.entry", kind === "boolean" ? h("div.line", input, label) : [label, h("div.line", slider, input)], h("p.hint", { id: id + "h" }, note), error),
      write: (triples, s) => { const o = get(); if (o) triples.push([s, path, o]); },
      read: (g, s) => { const o = g.one(s, path); if (o) set(o); } };
  }

  /// The request body: N-Triples about the target.
  body() {
    this.nodes = 0;
    const { target, model } = this, triples = [...model.classes.map((c) => [target, rdf("type"), { id: c }]), ...model.fixed.map(([p, o]) => [target, p, o])];
    this.parts.forEach((p) => p.write(triples, target));
    return triples.map(([s, p, o]) => `${nTriplesOf({ id: s })} <${p}> ${nTriplesOf(o)} .\n`).join("");
  }
  read(g, subject) { this.parts.forEach((p) => p.read(g, subject)); }
  clear() {
    for (const c of this.controls) {
      setText(c.error, "");
      c.input?.removeAttribute("aria-invalid");
    }
  }
  /// Shows each result of a SHACL report at its control. Returns the messages of the results that have no control.
  showReport(report) {
    const unplaced = [], controls = this.controls.filter((c) => !c.error.closest(".alternative[hidden]"));
    let first;
    for (const result of report.subjects(rdf("type"), sh("ValidationResult"))) {
      if (report.subjects(sh("detail"), result).length) continue;
      const path = report.id(result, sh("resultPath")), focus = report.id(result, sh("focusNode")), candidates = controls.filter((c) => c.subject() === focus);
      const words = report.all(result, sh("resultMessage")).map((m) => m.value).join("; ");
      const found = candidates.find((c) => c.path === path) ?? candidates.find((c) => !c.path) ?? controls.find((c) => path && (c.outer === path || c.path === path)) ?? controls.find((c) => c.isList && report.about.has(path))
        ?? (controls.length === 1 ? controls[0] : undefined);
      if (!found) { unplaced.push(words); continue; }
      if (!found.error.textContent.includes(words)) found.error.append(`${words}. `);
      found.input?.setAttribute("aria-invalid", "true");
      first ??= found.input;
    }
    first?.focus();
    return unplaced.join("; ");
  }
}

/// Converts a node or literal of a body to JSON.
function jsonOf(g, o) {
  const { id, value } = o;
  if (!id) return isNumeric(o) || o.type === xsd("boolean") ? value : JSON.stringify(value);
  if (id === rdf("nil") || g.id(id, rdf("rest"))) return `[${g.list(id).map((m) => jsonOf(g, m))}]`;
  const parts = [...g.of(id)].filter(([p]) => ![rdf("type"), ...UNIT_PREDICATES].includes(p));
  return UNNAMED.has(parts[0]?.[0]) ? jsonOf(g, parts[0][1]) : `{${parts.map(([p, v]) => `"${localName(p)}":${jsonOf(g, v)}`)}}`;
}
const shellQuoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;

/// A button that acts only if it is held for a second, by pointer or by key.
function holdButton(words, act) {
  let timer;
  const release = () => {
    clearTimeout(timer);
    element.classList.remove("held");
  };
  const hold = () => {
    release();
    element.classList.add("held");
    timer = setTimeout(() => { release(); act(); }, 1000);
  };
  const isKey = (event) => [" ", "Enter"].includes(event.key);
  const element = h("button.hold", { type: "button", onpointerdown: hold, onpointerup: release, onpointerleave: release, onpointercancel: release, onblur: release, oncontextmenu: (event) => event.preventDefault(),
    onkeydown: (event) => { if (isKey(event) && !event.repeat) hold(); }, onkeyup: (event) => { if (isKey(event)) release(); } }, words);
  return element;
}

/// A form with its submit button and the result of the command. Its target is the address of the resource.
///
/// @param done        gets the response; may return the text of the result
/// @param mustBeHeld  whether the command needs a second, deliberate gesture now
function formElement({ target, model, method, title, name, done, mustBeHeld = () => false }) {
  const form = new Form(withoutHash(target), model), result = h("p.answer", { role: "status" }), alert = h("p.answer.bad", { role: "alert" });
  const submit = h("button.primary", { type: "submit" }, title), reason = h("p.reason", { hidden: true, id: freshId() }), guard = h("div.guard", { hidden: true });
  const askToHold = () => {
    guard.hidden = false;
    guard.replaceChildren(h("p", "After this the robot moves when it is told to. Is everybody clear of it?"), h("div.line", holdButton(`Hold for a second to ${title}`, send), button("Leave it as it is", () => { guard.hidden = true; })));
    guard.querySelector("button").focus();
  };
  const bodyOf = () => model.fields.length || model.fixed.length ? form.body() : undefined;
  const showCurl = () => {
    const body = bodyOf();
    if (curl.open) curl.lastChild.replaceChildren(copyable(`curl -X ${method} ${body ? `-H 'Content-Type: ${JSON_TYPE}' -d ${shellQuoted(jsonOf(parse(body), { id: form.target }))} ` : ""}${shellQuoted(local(target))}`));
  };
  const curl = h("details.curl", { ontoggle: showCurl }, h("summary", "as curl"), h("div"));
  const element = h("form", { novalidate: true, "aria-label": name, oninput: () => { form.dirty = true; showCurl(); }, onsubmit: (event) => {
    event.preventDefault();
    if (mustBeHeld()) askToHold();
    else send();
  } }, form.element, h("div.line", submit, curl), reason, guard, result, alert);
  let busy = false;
  const send = async () => {
    guard.hidden = true;
    setText(result, "");
    setText(alert, "");
    form.clear();
    submit.disabled = busy = true;
    try {
      const response = await sendCommand(method, target, { body: bodyOf(), tell: (words) => setText(alert, words) });
      form.dirty = false;
      setText(alert, "");
      setText(result, await done(response, form) ?? "Done");
    } catch (e) {
      setText(alert, e.report ? `Not accepted (${e.status}). ${form.showReport(e.report)}` : problemText(e));
    }
    busy = false;
    submit.disabled = !reason.hidden;
  };
  /// Why the command cannot be given now; nothing: it can.
  const setReason = (words) => {
    reason.hidden = !words;
    setText(reason, words ?? "");
    submit.disabled = busy || !!words;
    if (words) submit.setAttribute("aria-describedby", reason.id);
    else submit.removeAttribute("aria-describedby");
  };
  return Object.assign(form, { whole: element, setReason });
}
