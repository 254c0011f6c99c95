// SPDX-License-Identifier: Apache-2.0
// ---- control: a lease of a Thing and of what is below it. This tab of the browser keeps the ids of its leases, and renews them while it is open.

const LEASE = 10;  // [s]
const LEASE_KEY = "lease ";

/// The leases of this tab: address of the Thing -> { control, id }. A user who is logged in needs no id.
const leases = new Map(Object.entries(sessionStorage).flatMap(([key, value]) => key.startsWith(LEASE_KEY) ? [[key.slice(LEASE_KEY.length), JSON.parse(value)]] : []));
function keepLease(thing, lease) {
  if (lease) {
    leases.set(thing, lease);
    sessionStorage.setItem(LEASE_KEY + thing, JSON.stringify(lease));
  } else {
    leases.delete(thing);
    sessionStorage.removeItem(LEASE_KEY + thing);
  }
}
/// The id that a command to a resource carries.
const controlFor = (iri) => [...leases].find(([thing]) => iri === thing || iri.startsWith(thing + "/"))?.[1].id;

const controlRequest = (method, control, id, more) => sendRequest(method, control, { accept: JSON_TYPE, fields: { ...id && { "Control-Id": id }, ...more } });
async function takeControl(thing, control, takeOver) {
  const until = validUntil(), { g, field } = await controlRequest("POST", `${control}?life=${LEASE}`, controlFor(thing), { ...until && { "Valid-Until": until }, ...takeOver && { "Take-Over": "?1" } });
  keepLease(thing, { control, id: field("Control-Id") || g.controlId });
}
async function giveControlBack(thing) {
  const { control, id } = leases.get(thing);
  keepLease(thing);
  await controlRequest("DELETE", control, id);
}
// A lease that is not renewed ends, and so does one that somebody has taken over.
setInterval(() => {
  for (const [thing, { control, id }] of leases) {
    controlRequest("PUT", control, id).catch((e) => {
      if ([403, 404, 409, 428].includes(e.status)) keepLease(thing);
    });
  }
}, LEASE * 300);

/// Who has control of a Thing, and the buttons to take it and to give it back.
function controlLine(thing, { href: control }, title) {
  const said = h("span"), failed = h("div"), act = (words, what) => command(words, what, failed, { hidden: true }), take = act("Take control", () => takeControl(thing, control)), back = act("Give back", () => giveControlBack(thing)),
    over = act("Take over", () => takeControl(thing, control, true)), element = h("div.control", h("div.line", said, take, back, over), failed);
  let last = {};
  const tick = () => {
    const { held, heldBy, until } = last, isMine = held && leases.has(thing);
    setText(said, isMine ? `You have control of ${title}.` : held ? `${heldBy ? `“${heldBy}”` : "Another client"} has control of ${title} until ${new Date(Date.parse(until) - clockOffset).toLocaleTimeString([], { hourCycle: "h23" })} or longer.`
      : `Nobody has control of ${title}${last.required ? " – it takes no command without" : ""}.`);
    take.hidden = !!held;
    back.hidden = !isMine;
    over.hidden = !held || isMine;
    element.classList.toggle("mine", !!isMine);
  };
  view.ticks.push(tick);
  view.watch(element, control, { g: (g) => { last = g; tick(); }, problem: (e) => failed.replaceChildren(notice(e)) }, { accept: JSON_TYPE });
  return element;
}
/// The controls of a resource: of its Thing and of those above.
async function controlLines(chain) {
  const found = await Promise.all(chain.map(async (iri) => {
    const is = await optionsOf(iri), overview = is.isA(hybrit("RoboticThing")) || is.isA(lrt("World")) ? await overviewOf(iri) : {};
    return overview.control && controlLine(iri, overview.control, isNamed(overview));
  }));
  return found.filter(Boolean);
}
