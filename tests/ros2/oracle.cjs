// SPDX-License-Identifier: Apache-2.0
// node oracle.cjs PEER MODULES FOLDER...: each type below the FOLDERs (of a .msg with definitions in a row, or of the files of a package) by
// @foxglove/rosmsg and @foxglove/rosmsg2-serialization and by codec_peer, with random values, byte for byte, both ways.
const fs = require("fs"), path = require("path"), { spawnSync } = require("child_process");
const [peer, modules, ...folders] = process.argv.slice(2);
const from = (name) => require(path.join(modules, "node_modules", "@foxglove", name));
const { parse } = from("rosmsg"), { MessageReader, MessageWriter } = from("rosmsg2-serialization");
const row = "=".repeat(80), times = 4;

// A generator of its own: a failure repeats.
let state = 20261129;
function random(n) {
  state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
  return Math.floor((state / 4294967296) * n);
}

const hex = (bytes) => Buffer.from(bytes).toString("hex");
const types = []; // {name, text}: text with definitions in a row

function files(folder) {
  return fs.readdirSync(folder, { withFileTypes: true }).flatMap((e) => {
    const p = path.join(folder, e.name);
    return e.isDirectory() ? files(p) : /\.(msg|srv|action)$/.test(p) ? [p] : [];
  });
}
/// The text of a message with those that it refers to, of files that have one definition each.
function gathered(text, pkg, texts, seen = new Set()) {
  let all = text;
  for (const line of text.split("\n")) {
    const m = /^\s*([A-Za-z]\w*(?:\/\w+)?)(?:\[.*?\])?\s+\w/.exec(line.split("#")[0]);
    if (!m) continue;
    const name = m[1].includes("/") ? m[1] : `${pkg}/${m[1]}`;
    if (!texts.has(name) || seen.has(name)) continue;
    seen.add(name);
    all += `\n${row}\nMSG: ${name}\n${gathered(texts.get(name), name.split("/")[0], texts, seen)}`;
  }
  return all;
}
for (const folder of folders) {
  const texts = new Map();
  const found = files(folder).map((f) => {
    const kind = path.extname(f).slice(1), name = path.basename(f, `.${kind}`), pkg = path.basename(path.dirname(path.dirname(f)));
    const text = fs.readFileSync(f, "utf8");
    if (kind === "msg") texts.set(`${pkg}/${name}`, text);
    return { kind, name, pkg, text };
  });
  for (const { kind, name, pkg, text } of found) {
    const parts = { msg: [""], srv: ["_Request", "_Response"], action: ["_Goal", "_Result", "_Feedback"] }[kind];
    const sections = kind === "msg" ? [text] : text.split(/^---\s*$/m);
    if (sections.length !== parts.length) throw new Error(`${name}: ${sections.length} sections`);
    sections.forEach((section, i) => {
      const whole = section.includes(row) ? section : gathered(section, pkg, texts);
      types.push({ name: `${pkg}/msg/${name}${parts[i].replace("_", "")}`, text: whole, folder });
    });
  }
}

const float = Buffer.alloc(8);
function real(x) {
  if (Number.isNaN(x)) return "fnan";
  float.writeDoubleBE(x);
  return "f" + float.toString("hex");
}
function one(value, field, all, out) {
  if (field.isComplex) return dump(value, all.get(field.type), all, out);
  switch (field.type) {
    case "bool": return out.push(value ? "b1" : "b0");
    case "float32": case "float64": return out.push(real(value));
    case "string": case "wstring": return out.push("s" + hex(Buffer.from(value, "utf8")));
    case "time": case "duration": return out.push("i" + value.sec, "i" + (value.nanosec ?? value.nsec));
    default: return out.push("i" + value);
  }
}
function dump(message, fields, all, out) {
  for (const f of fields.filter((d) => !d.isConstant)) {
    if (!f.isArray) { one(message[f.name], f, all, out); continue; }
    const members = Array.from(message[f.name]);
    out.push("[" + members.length);
    for (const m of members) one(m, f, all, out);
  }
  return out;
}
function randomOne(f, all) {
  if (f.isComplex) return randomMessage(all.get(f.type), all);
  const bits = () => random(2 ** 32);
  switch (f.type) {
    case "bool": return random(2) === 1;
    case "int8": return random(256) - 128;
    case "uint8": return random(256);
    case "int16": return random(65536) - 32768;
    case "uint16": return random(65536);
    case "int32": return bits() - 2 ** 31;
    case "uint32": return bits();
    case "int64": return BigInt.asIntN(64, (BigInt(bits()) << 32n) | BigInt(bits()));
    case "uint64": return (BigInt(bits()) << 32n) | BigInt(bits());
    case "float32": return [0, -0, NaN, Infinity, Math.fround((bits() - 2 ** 31) / 1000)][random(8)] ?? Math.fround(bits() / 7);
    case "float64": return [0, -0, NaN, -Infinity, (bits() - 2 ** 31) / 1000][random(8)] ?? bits() / 7;
    case "time": case "duration": return { sec: random(2 ** 31), nanosec: random(1e9) };
    case "string": {
      let s = "";
      for (let n = random(12); n > 0 && (f.upperBound === undefined || s.length < f.upperBound); --n) s += String.fromCharCode(32 + random(95));
      return s;
    }
    default: throw new Error("no random value of " + f.type);
  }
}
function randomMessage(fields, all) {
  const m = {};
  for (const f of fields.filter((d) => !d.isConstant)) {
    if (!f.isArray) { m[f.name] = randomOne(f, all); continue; }
    const n = f.arrayLength ?? Math.min(random(5), f.arrayUpperBound ?? 5);
    m[f.name] = Array.from({ length: n }, () => randomOne(f, all));
  }
  return m;
}

const questions = [], judges = [];
const ask = (question, judge) => { questions.push(question.join("\t")); judges.push(judge); };
const faults = [];
const counts = { types: 0, read: 0, made: 0, fields: 0, constants: 0, wide: 0 };

for (const t of types) {
  let definitions;
  try {
    definitions = parse(t.text, { ros2: true });
  } catch (e) {
    throw new Error(`${t.name}: ${e.message}`);
  }
  const text = hex(Buffer.from(t.text, "utf8")), all = new Map(definitions.map((d) => [d.name ?? "", d.definitions]));
  const root = all.get("") ?? definitions[0].definitions;
  const where = `${t.name} of ${t.folder}`;
  const fault = (what) => faults.push(`${where}: ${what}`);
  ask(["show", t.name, text], (got) => {
    const mine = [];
    for (const f of root) {
      const raw = (v, of) => one(v, { ...f, isArray: false, isComplex: false, type: of }, all, mine.scratch = []) && mine.scratch.join(" ");
      const value = (v) => (f.isArray && !f.isConstant ? [`[${v.length}`, ...v.map((x) => raw(x, f.type))].join(" ") : raw(v, f.type));
      const rounded = (v) => (f.type === "float32" ? (Array.isArray(v) ? v.map(Math.fround) : Math.fround(v)) : v);
      if (f.isConstant) {
        mine.push(`constant ${f.name} ${value(rounded(f.value))}`);
        counts.constants++;
        continue;
      }
      const arity = !f.isArray ? 0 : f.arrayLength !== undefined ? 1 : f.arrayUpperBound !== undefined ? 2 : 3;
      mine.push(`field ${f.name} ${arity} ${f.arrayLength ?? f.arrayUpperBound ?? 0} ${f.upperBound ?? 0} ` +
                (f.defaultValue === undefined ? "-" : value(rounded(f.defaultValue))));
      counts.fields++;
    }
    const theirs = (got[1] ?? "").split(";").filter((s) => s !== "").map((s) => {
      const words = s.split(" ");
      return words[0] === "field" ? [words[0], words[1], ...words.slice(3)].join(" ") : [words[0], words[1], ...words.slice(3)].join(" ");
    });
    const sorted = (list) => [...list].sort().join("\n");
    if (got[0] !== "shown" || sorted(mine) !== sorted(theirs)) fault(`definitions differ:\n  expected ${sorted(mine)}\n  found ${got[0]} ${sorted(theirs)}`);
  });
  if (definitions.some((d) => d.definitions.some((f) => f.type === "wstring" && !f.isConstant))) {
    counts.wide++; // no oracle for it here: cdr_test.cpp has Fast CDR
    continue;
  }
  if (root.length > 0 && root.every((f) => f.isConstant)) {
    types.push({ name: "holder/msg/Holder", text: `${t.name.replace("/msg/", "/")} inner\n${row}\nMSG: ${t.name.replace("/msg/", "/")}\n${t.text}`, folder: t.folder });
    continue; // the oracle takes constants alone for no message; as a member it is one
  }
  counts.types++;
  const writer = new MessageWriter(definitions), reader = new MessageReader(definitions);
  for (let i = 0; i < times; ++i) {
    const message = randomMessage(root, all), payload = hex(writer.writeMessage(message)), expected = dump(message, root, all, []).join(" ");
    ask(["read", t.name, text, payload], (got) => {
      counts.read++;
      if (got[0] !== "read" || got[1] !== expected) fault(`read differently:\n  expected ${expected}\n  found ${got.join(" ")}\n  payload ${payload}`);
      else if (got[2] !== payload) fault(`written differently:\n  expected ${payload}\n  found ${got[2]}`);
    });
    ask(["make", t.name, text, String(state)], (got) => {
      if (got[0] !== "made") return fault(got.join(" "));
      for (const bytes of [got[2], got[3]]) {
        counts.made++;
        const message = reader.readMessage(Buffer.from(bytes, "hex"));
        const found = dump(message, root, all, []).join(" ");
        if (found !== got[1]) fault(`made differently:\n  made ${got[1]}\n  read ${found}\n  payload ${bytes}`);
        if (reader.lastReadHadTrailingBytes()) fault(`bytes are left: ${bytes}`);
      }
      const again = hex(writer.writeMessage(reader.readMessage(Buffer.from(got[2], "hex"))));
      if (again !== got[2] && !got[1].includes("fnan")) fault(`written differently:\n  made ${got[2]}\n  theirs ${again}`);
    });
  }
}

const run = spawnSync(peer, { input: questions.join("\n") + "\n", encoding: "utf8", maxBuffer: 1 << 30 });
if (run.status !== 0) throw new Error(`${peer} ended with ${run.status ?? run.signal}: ${run.stderr}`);
const answers = run.stdout.trimEnd().split("\n");
if (answers.length !== judges.length) throw new Error(`${answers.length} answers to ${judges.length} questions`);
answers.forEach((a, i) => judges[i](a.split("\t")));
console.log(JSON.stringify(counts));
for (const f of faults.slice(0, 20)) console.log("FAULT " + f);
if (faults.length > 0) console.log(`${faults.length} faults`);
process.exit(faults.length > 0 ? 1 : 0);
