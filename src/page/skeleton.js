// SPDX-License-Identifier: Apache-2.0
// ---- the skeleton of a robot, drawn from its kinematic tree. A place is [x, y, z], a rotation is a quaternion [x, y, z, w], a pose is
// [place, rotation].

const ros = space("http://ros.org/#");
const maths = space("http://vocab.arvida.de/2015/06/maths/vocab#");
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const addScaled = (from, by, way) => from.map((n, i) => n + by * way[i]);
const rotated = (q, v) => {
  const once = cross(q, v);
  return addScaled(addScaled(v, 2 * q[3], once), 2, cross(q, once));
};
const product = (q, r) => [...addScaled(addScaled(cross(q, r), q[3], r), r[3], q), q[3] * r[3] - q[0] * r[0] - q[1] * r[1] - q[2] * r[2]];
const posedIn = ([at, q], [place, rotation]) => [addScaled(at, 1, rotated(q, place)), product(q, rotation)];
const ORIGIN = [0, 0, 0], NO_ROTATION = [...ORIGIN, 1], AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], AXIS_COLORS = ["#e5484d", "#30a46c", "#3b82f6"];

const vector = (g, node, names) => node && [...names].map((n) => g.number(node, maths(n)));
/// The pose in the representation of a property.
const poseOf = (g, iri) => [["translation", "xyz", ORIGIN], ["rotation", "xyzw", NO_ROTATION]].map(([part, names, none]) => vector(g, g.id(g.id(iri, spatial(part)), vom("quantityValue")), names) ?? none);
/// Calls `work` for each item, four at a time: more requests would delay other work of the robot and of the page.
async function forEachLimited(items, work) {
  const left = [...items];
  await Promise.all([1, 2, 3, 4].map(async () => { while (left.length) await work(left.shift()); }));
}

/// Lines between joints, drawn at the robot's present positions. Dragging or the arrow keys turn the view. Writable joints have sliders.
function skeleton(iri, overview, robot) {
  const here = view, root = robot.id(iri, lrt("rootLink")), order = robot.list(robot.id(iri, lrt("positionsOf"))).map((o) => o.id), joints = [], steps = [], pointers = new Map();
  let positions = [], yaw = 0.9, pitch = 0.3, zoom = 1, frameRequest, centre, size;
  const redraw = () => { frameRequest ||= requestAnimationFrame(draw); };
  const orbit = (x, y, closer = 1) => {
    yaw -= x;
    pitch = Math.max(-1.5, Math.min(1.5, pitch + y));
    zoom = Math.max(0.2, Math.min(12, zoom * closer));
    redraw();
  };
  const KEYS = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1], "+": [0, 0, 1.15], "-": [0, 0, 0.87] };
  const canvas = h("canvas", { tabindex: "0", role: "img",
    onpointerdown: (e) => { canvas.setPointerCapture(e.pointerId); pointers.set(e.pointerId, e); },
    onpointermove: (e) => {
      const from = pointers.get(e.pointerId), other = [...pointers.values()].find((p) => p.pointerId !== e.pointerId), apart = (p) => Math.hypot(p.clientX - other.clientX, p.clientY - other.clientY);
      if (!from) return;
      pointers.set(e.pointerId, e);
      if (other) orbit(0, 0, apart(e) / (apart(from) || 1));
      else orbit((e.clientX - from.clientX) / 150, (e.clientY - from.clientY) / 150);
    },
    onlostpointercapture: (e) => pointers.delete(e.pointerId),
    onwheel: (e) => { if (e.ctrlKey) { e.preventDefault(); orbit(0, 0, 0.999 ** e.deltaY); } },
    onkeydown: (e) => { if (KEYS[e.key]) { e.preventDefault(); orbit(...KEYS[e.key]); } } });
  const [frames, names] = [true, false].map((checked) => h("input", { type: "checkbox", checked, onchange: redraw })), note = h("span.hint"), sliders = h("fieldset.joints", { disabled: true }), motion = h("input", { type: "checkbox", onchange: () => enableMotion(motion.checked) }), motionLine = h("label.line.motion", { hidden: true }, motion, h("b", "Enable motion"), h("span.hint", "for one minute – a slider moves its joint when it is released"));
  const element = h("div.card.skeleton", canvas, h("div.line", h("label.line", frames, "Frames"), h("label.line", names, "Names"), note), motionLine, sliders);

  function draw() {
    frameRequest = 0;
    const { pen, width, height, color } = drawingContext(canvas);
    if (!pen || !steps.length) return;
    const links = new Map([[root, [ORIGIN, NO_ROTATION]]]), segments = [];
    for (const { from, to, origin, axis, slides, index, pose } of steps) {
      const joint = posedIn(links.get(from), origin), n = positions[index] ?? 0;
      const moved = slides ? [addScaled(ORIGIN, n, axis), NO_ROTATION] : [ORIGIN, [...addScaled(ORIGIN, Math.sin(n / 2), axis), Math.cos(n / 2)]];
      links.set(to, pose ?? posedIn(joint, moved));
      segments.push([links.get(from)[0], joint[0], "--text"], [joint[0], links.get(to)[0], "--accent"]);
    }
    const places = [...links.values()].map(([p]) => p), bounds = (side) => ORIGIN.map((_, i) => Math[side](...places.map((p) => p[i]))), low = bounds("min");
    canvas.dataset.end = places.at(-1).map((n) => n.toFixed(3));
    if (!size) {  // from the first pose
      centre = addScaled(low, 1, bounds("max")).map((n) => n / 2);
      size = Math.max(0.01, ...places.map((p) => Math.hypot(...addScaled(p, -1, centre))));
    }
    // Perspective projection: nearer parts are larger.
    const project = (p) => {
      const [x, y, z] = addScaled(p, -1, centre), deep = y * Math.cos(yaw) - x * Math.sin(yaw), depth = 3 * size / zoom + deep * Math.cos(pitch) - z * Math.sin(pitch), scale = 1.45 * Math.min(width, height) / depth;
      return depth > size / 20 && [width / 2 + scale * (x * Math.cos(yaw) + y * Math.sin(yaw)), height / 2 - scale * (deep * Math.sin(pitch) + z * Math.cos(pitch))];
    };
    const line = (from, to, style, thick) => {
      const [a, b] = [from, to].map(project);
      if (!a || !b) return;
      pen.strokeStyle = style;
      pen.lineWidth = thick;
      pen.beginPath();
      pen.moveTo(...a);
      pen.lineTo(...b);
      pen.stroke();
    };
    pen.lineCap = "round";
    const cell = 10 ** Math.round(Math.log10(size / 4)), cells = Math.min(20, Math.ceil(1.5 * size / cell)), [x, y] = centre.map((n) => Math.round(n / cell));
    for (let i = -cells; i <= cells; ++i) {
      const at = (a, b) => [(x + a) * cell, (y + b) * cell, Math.min(0, low[2])];
      line(at(i, -cells), at(i, cells), color("--line"), 1);
      line(at(-cells, i), at(cells, i), color("--line"), 1);
    }
    for (const [from, to, name] of segments) line(from, to, color(name), 4);
    pen.fillStyle = color("--text");
    pen.font = "12px system-ui, sans-serif";
    for (const [link, [place, rotation]] of links) {
      if (frames.checked) AXES.forEach((a, i) => line(place, addScaled(place, size / 16, rotated(rotation, a)), AXIS_COLORS[i], 1.5));
      const at = project(place);
      if (at && names.checked) pen.fillText(localName(link), at[0] + 6, at[1] - 6);
    }
    setText(note, `grid of ${Number(cell.toPrecision(1))} m – drag to turn – Ctrl and wheel to zoom`);
  }

  /// Motion is disabled again one minute after the last command.
  let motionEnds;
  enableMotion = (yes) => {
    motion.checked = yes;
    sliders.disabled = !yes;
    clearTimeout(motionEnds);
    if (yes) motionEnds = setTimeout(() => enableMotion(false), 60000);
    else steps.forEach((s) => s.showPosition?.());
  };

  /// Adds the field of a joint. Its release sends the newest value, one request at a time. A touch that becomes a scroll sends nothing.
  async function addField(step) {
    if (!step.position || !(await optionsOf(step.position)).allows("PUT")) return;
    const model = await bodyModelOf(step.position), alert = h("p.error", { role: "alert" });
    model.fields.forEach((f) => { f.name = localName(step.iri); });
    const form = new Form(step.position, model);
    let busy, newer, scrolled, held;
    const send = async () => {
      held = false;
      if (scrolled || sliders.disabled) return;
      enableMotion(true);
      newer = true;
      if (busy) return;
      for (busy = true; newer;) {
        newer = false;
        form.clear();
        try {
          await sendCommand("PUT", step.position, { body: form.body(), tell: (words) => setText(alert, words) });
          setText(alert, "");
        } catch (e) { setText(alert, e.report ? form.showReport(e.report) : problemText(e)); }
      }
      busy = false;
    };
    step.field = h("div", { onchange: send, onkeydown: () => { scrolled = false; }, onfocusout: () => { held = false; },
      onpointerdown: () => { held = true; scrolled = false; }, onpointerup: () => { held = false; },
      onpointercancel: (e) => {
        scrolled = true;
        held = false;
        e.target.blur();
        step.showPosition();
      } }, form.element, alert);
    step.showPosition = () => {  // not while the user operates the field
      const value = String(Number(positions[step.index]?.toFixed(4)));
      if (value !== "NaN" && !held && !step.field.contains(document.activeElement)) form.read({ one: () => ({ value }), id: () => step.position }, step.position);
    };
  }
  const failed = h("div"), load = async () => {
    await forEachLimited(overview.things.filter((part) => part.types?.includes(ros("Joint"))), async ({ href: joint, types }) => {
      const { properties = {}, state } = await overviewOf(joint), { g } = await sendRequest("GET", state.href), id = (p) => g.id(joint, ros(p)), is = (type) => types.includes(ros(type));
      joints.push({ iri: joint, from: id("preceedingLink"), to: id("succeedingLink"), origin: poseOf(g, id("jointReferenceFrame")), axis: vector(g, g.id(joint, lrt("axis")), "xyz") ?? ORIGIN,
        slides: is("PrismaticJoint"), free: is("FloatingJoint") || is("PlanarJoint"), index: order.indexOf(joint), position: Object.values(properties).find((p) => p.href === id("position"))?.href });
    });
    const links = [root];
    for (const link of links) for (const j of joints) if (j.from === link && !links.includes(j.to)) {
      steps.push(j);
      links.push(j.to);
    }
    if (here.isClosed) return;
    canvas.setAttribute("aria-label", `Skeleton of ${steps.length} joints and ${links.length} links. Arrow keys turn it – plus and minus zoom.`);
    new ResizeObserver(redraw).observe(canvas);
    for (const step of steps) if (step.free) {  // its position is a pose, not a number: lrt:pose of its link
      const pose = (await cachedRequest(step.to)).g.id(step.to, lrt("pose"));
      if (pose) here.watch(canvas, pose, { g: (g) => {
        step.pose = poseOf(g, pose);
        redraw();
      } });
    }
    const all = robot.id(iri, lrt("positions"));
    if (all) here.watch(element, all, { g: (numbers) => {
      if (!Array.isArray(numbers)) return;
      if (!positions.length) size = 0;
      positions = numbers;
      redraw();
      steps.forEach((s) => s.showPosition?.());
    } }, { accept: JSON_TYPE, interval: 0.04 });
    await forEachLimited(steps, addField);
    sliders.append(...joints.sort((a, b) => a.index - b.index).flatMap((j) => j.field ?? []));
    motionLine.hidden = !sliders.firstChild;
    steps.forEach((s) => s.showPosition?.());
  };
  element.append(failed);
  loadPart(failed, load, () => element.replaceWith(skeleton(iri, overview, robot)));
  redrawSkeleton = redraw;
  return element;
}
let redrawSkeleton, enableMotion;
matchMedia("(prefers-color-scheme: dark)").onchange = () => redrawSkeleton?.();
