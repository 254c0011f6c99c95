// SPDX-License-Identifier: Apache-2.0
// ---- values

const NOT_VALUES = new Set([rdf("type"), rdfs("seeAlso"), rdfs("label"), rdfs("comment"), dcterms("modified"), dcterms("title"),
  dcterms("description"), dcterms("hasFormat"), vom("quantityKind"), ...["dataType", "hasQuantityKind"].map(qudt), ...["frame", "datatype", "elementType", "unavailable"].map(lrt),
  ...["source", "target"].map((end) => spatial(end + "CoordinateSystem")), ...UNIT_PREDICATES]);
const MAX_DEPTH = 20;  // of nodes inside each other: data of others may have any depth
const UNNAMED = new Set([vom("numericalValue"), vom("quantityValue"), rdf("value")]);

/// The values of a node as a flat list of { path: [words], objects, names, unit }. A vector or a list of scalars is one entry.
function leaves(g, node, path = [], seen = new Set(), outer = "", depth = 0) {
  if (seen.has(node) || depth > MAX_DEPTH) return [];
  seen.add(node);
  const unit = unitText(UNIT_PREDICATES.map((p) => g.id(node, p)).find(Boolean)) || outer;
  return g.of(node).filter(([p]) => !NOT_VALUES.has(p) && !p.startsWith(hybrit(""))).flatMap(([p, o]) => {
    const here = UNNAMED.has(p) ? path : [...path, humanised(localName(p))];
    if (o.id && g.isList(o.id)) {
      const items = g.list(o.id).map((item) => g.isList(item.id) ? [{ path: [], objects: g.list(item.id), isList: true }]
        : isInside(g, node, item) ? leaves(g, item.id, [], seen, "", depth + 1) : [{ path: [], objects: [item], unit }]);
      if (items.every((i) => i.length === 1 && i[0].objects.length === 1)) return [{ path: here, objects: items.map((i) => i[0].objects[0]), isList: true, unit: unit || items[0]?.[0].unit }];
      return items.flatMap((inner, i) => inner.map((leaf) => ({ ...leaf, path: [...here, String(i + 1), ...leaf.path] })));
    }
    // A node without content, such as an alternative that is only there.
    const isHollow = o.id && !g.about.has(o.id) && (isBlank(o.id) || o.id.startsWith(withoutHash(node) + "#"));
    if (isHollow || !isInside(g, node, o)) return [{ path: here, objects: isHollow ? [] : [o], unit }];
    const inner = leaves(g, o.id, here, seen, unit, depth + 1), names = inner.map((l) => l.path.at(-1));
    if (!inner.length) return [{ path: here, objects: [] }];
    const isVector = inner.length > 1 && inner.length < 5 && inner.every((l) => l.path.length === here.length + 1 && l.path.at(-1).length < 3 && l.unit === inner[0].unit && l.objects.length === 1 && !l.isList);
    return isVector ? [{ path: here, objects: inner.map((l) => l.objects[0]), names, unit: inner[0].unit }] : inner;
  });
}
const isTrue = (o) => o.value === "true" || o.value === "1";
const objectText = (o, moves) => o.id ? localName(o.id) : isNumeric(o) ? numberText(o, moves) : o.type === xsd("boolean") ? (isTrue(o) ? "yes" : "no") : o.value;

/// Shows leaves in an element. If their names have not changed, only text is replaced.
class ValueView {
  element = h("div.value");
  show(all, plot) {
    const key = JSON.stringify(all.map((l) => l.path));
    if (key !== this.key) {
      this.key = key;
      this.cells = all.map(() => [h("span.number"), " ", h("span.unit")]);
      this.element.replaceChildren(!all.length ? quiet("no value to show") : all.length === 1 && !all[0].path.length ? h("p.big", this.cells)
        : h("dl", all.map((l, i) => [h("dt", l.path.join(" › ") || "value"), h("dd", this.cells[i])])));
    }
    all.forEach(({ objects, names, isList, unit, ...leaf }, i) => {
      const [number, , units] = this.cells[i], moves = plot?.moves(leaf);
      const shown = objects.slice(0, 12).map((o, n) => (names ? names[n] + "\u00a0" : "") + objectText(o, moves)).join(names ? "  " : ", ") + (objects.length > 12 ? `, … (${objects.length})` : "");
      setText(number, isList ? `[${shown}]` : shown);
      number.title = objects.slice(0, 50).map((o) => o.id ?? o.value).join(" ");
      setText(units, unit ?? "");
    });
  }
}

// ---- plots: the last minute of each number

/// Resizes a canvas to the screen's resolution and clears it. `pen` is its 2D context; undefined while the canvas has no layout.
function drawingContext(canvas) {
  const scale = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight, pen = width && canvas.getContext("2d"), style = getComputedStyle(canvas);
  if (!pen) return {};
  const [wide, high] = [width, height].map((n) => Math.round(n * scale));
  if (canvas.width !== wide || canvas.height !== high) [canvas.width, canvas.height] = [wide, high];
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height, color: (name) => style.getPropertyValue(name) };
}

const MINUTE = 60000;
const reducedMotion = matchMedia("(prefers-reduced-motion: reduce)");
const plots = new Set();  // the visible ones

class Plot {
  series = new Map();  // name -> [[time, number], ...]
  constructor() {
    this.canvas = h("canvas", { role: "img", "aria-label": "the last minute" });
    this.legend = h("p.legend", { "aria-hidden": "true" });
    this.element = h("figure.plot", { hidden: true }, this.canvas, this.legend);
  }
  add(all) {
    const now = performance.now(), seen = new Set();
    for (const { path, objects, names, isList } of all) objects.slice(0, 8).forEach((o, i) => {
      const n = isNumeric(o) ? toNumber(o.value) : NaN, name = [...path, names?.[i] ?? (isList ? `${i + 1}` : "")].filter(Boolean).join(" › ");
      if (!Number.isFinite(n)) return;
      seen.add(name);
      if (!this.series.has(name)) this.series.set(name, []);
      const points = this.series.get(name);
      points.push([now, n]);
      // One point older than a minute is kept: the line begins there.
      while (points.length > 2 && points[1][0] < now - MINUTE) points.shift();
    });
    // What is no longer part of the value ends: another alternative is there now, or an optional part has gone.
    for (const [name, points] of this.series) if (!seen.has(name) && !Number.isNaN(points.at(-1)[1])) points.push([now, NaN]);
  }
  /// Nothing was heard since that time: the lines end there, and begin anew with the next value.
  silence(from) {
    for (const points of this.series.values()) points.push([Math.max(from, points.at(-1)[0]), NaN]);
  }
  moved() {
    return [...this.series].filter(([, points]) => {
      const numbers = points.map((p) => p[1]).filter(Number.isFinite);
      return numbers.some((n) => n !== numbers[0]);
    });
  }
  moves({ path, words = path }) { return this.moved().some(([name, points]) => points.length > 5 && name.startsWith(words.join(" › "))); }
  draw() {
    // The series that have moved. Without one: a single series is drawn, several are not.
    const moved = this.moved().slice(0, 6), lines = moved.length || this.series.size > 1 || this.small ? moved : [...this.series];
    this.element.hidden = lines.length === 0;
    if (!lines.length) return;
    const { canvas } = this, { pen, width, height, color } = drawingContext(canvas);
    if (!pen) return;
    const now = performance.now(), numbers = lines.flatMap(([, points]) => points.map((p) => p[1])).filter(Number.isFinite);
    let low = Math.min(...numbers), high = Math.max(...numbers);
    if (low === high) { low -= Math.abs(low) * 0.1 || 1; high += Math.abs(high) * 0.1 || 1; }
    const label = (n) => String(Number(n.toPrecision(3)));
    pen.font = "11px system-ui, sans-serif";
    const left = Math.max(pen.measureText(label(low)).width, pen.measureText(label(high)).width) + 6, top = 7, bottom = height - 7;
    const x = (t) => width - ((now - t) / MINUTE) * (width - left) - 2, y = (n) => bottom - ((n - low) / (high - low)) * (bottom - top);
    pen.fillStyle = color("--quiet");
    pen.strokeStyle = color("--line");
    pen.lineWidth = 1;
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    for (const n of [low, high]) {
      pen.fillText(label(n), left - 5, y(n));
      pen.beginPath();
      pen.moveTo(left, Math.round(y(n)) + 0.5);
      pen.lineTo(width, Math.round(y(n)) + 0.5);
      pen.stroke();
    }
    pen.save();
    pen.beginPath();
    pen.rect(left, 0, width - left, height);
    pen.clip();
    pen.lineWidth = 1.8;
    pen.lineJoin = "round";
    lines.forEach(([, points], i) => {
      pen.strokeStyle = color(`--series${i}`);
      pen.beginPath();
      let last = NaN, since;
      for (const [t, n] of [...points, [Math.max(this.watch?.knownUntil() ?? now, points.at(-1)[0]), NaN]]) {
        const begins = Number.isNaN(last), ends = Number.isNaN(n);
        // Unchanged values are not sent: a value is valid until the next one, or until nothing was heard.
        if (!begins && (ends || t - since > 700)) pen.lineTo(x(t), y(last));
        if (!ends) pen[begins ? "moveTo" : "lineTo"](x(t), y(n));
        [last, since] = [n, t];
      }
      pen.stroke();
    });
    pen.restore();
    const key = lines.map(([name]) => name).join();
    if (this.key !== key && (this.key = key) !== undefined)
      this.legend.replaceChildren(...(lines.length > 1 || this.series.size > 1 ? lines.map(([name], i) => {
        const key = h("span.key", name);
        key.style.color = `var(--series${i})`;
        return key;
      }) : []));
    canvas.dataset.gaps = lines.reduce((sum, [, points]) => sum + points.filter((p) => Number.isNaN(p[1])).length, 0);
    canvas.setAttribute("aria-label", `between ${label(low)} and ${label(high)} in the last minute`);
  }
}
let drawn = 0;
function drawPlots(now) {
  if (now - drawn > (reducedMotion.matches ? 1000 : 66)) {
    drawn = now;
    for (const plot of plots) plot.draw();
  }
  requestAnimationFrame(drawPlots);
}
requestAnimationFrame(drawPlots);
