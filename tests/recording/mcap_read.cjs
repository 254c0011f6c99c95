// SPDX-License-Identifier: Apache-2.0
// Reads MCAP files whole with @mcap/core and @mcap/support, in a folder of npm, and prints what they have as JSON. Each way of reading must find the same.
//
//   node mcap_read.cjs FOLDER FILE [--cut]
//
// --cut: the file was not ended; it is read as a stream, up to its last chunk.
const fs = require("fs");
const path = require("path");

const [folder, file, mode] = process.argv.slice(2);
const load = (name) => require(require.resolve(name, { paths: [path.resolve(folder)] }));
const { McapStreamReader, McapIndexedReader } = load("@mcap/core");
const { loadDecompressHandlers } = load("@mcap/support");

function fail(text) {
  console.error(text);
  process.exit(1);
}

/** Whether a JSON value has the types that a schema names. */
function fits(value, schema) {
  switch (schema.type) {
    case undefined: return true;
    case "null": return value === null;
    case "integer": return Number.isInteger(value);
    case "number": return typeof value === "number" || value === null || typeof value === "string"; // no value at present, "NaN"
    case "string": return typeof value === "string";
    case "boolean": return typeof value === "boolean";
    case "array": return Array.isArray(value) && value.every((item) => fits(item, schema.items ?? {}));
    case "object":
      return typeof value === "object" && value !== null && !Array.isArray(value) && (schema.required ?? []).every((name) => name in value) &&
        Object.entries(schema.properties ?? {}).every(([name, of]) => !(name in value) || fits(value[name], of));
    default: return false;
  }
}

async function main() {
  const decompressHandlers = await loadDecompressHandlers();
  const bytes = fs.readFileSync(file);
  const result = { channels: [], messages: [], metadata: [], compression: [] };
  const schemas = new Map(), channels = new Map();
  const see = (record) => {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Metadata") result.metadata.push({ name: record.name, ...Object.fromEntries(record.metadata) });
    if (record.type === "Chunk" && !result.compression.includes(record.compression)) result.compression.push(record.compression);
    if (record.type !== "Message") return;
    const channel = channels.get(record.channelId);
    const schema = schemas.get(channel.schemaId);
    if (channel.messageEncoding !== "json" || schema.encoding !== "jsonschema") fail("a channel that is no JSON");
    const of = JSON.parse(new TextDecoder().decode(schema.data));
    const value = JSON.parse(new TextDecoder().decode(record.data));
    if (of.type !== "object" || !fits(value, of)) fail(`${schema.name} does not fit ${JSON.stringify(value)}`);
    result.messages.push({ topic: channel.topic, iri: channel.metadata.get("iri"), schema: schema.name, sequence: record.sequence,
      logTime: record.logTime.toString(), publishTime: record.publishTime.toString(), message: value });
  };
  // As it comes, in pieces.
  const reader = new McapStreamReader({ includeChunks: true, decompressHandlers, validateCrcs: true });
  for (let at = 0; at < bytes.length; at += 1000) {
    reader.append(bytes.subarray(at, at + 1000));
    for (let record; (record = reader.nextRecord());) see(record);
  }
  if (mode !== "--cut") {
    if (!reader.done()) fail("the file is not complete");
    // By its summary and indexes.
    const readable = {
      size: async () => BigInt(bytes.length),
      read: async (offset, size) => new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(size)),
    };
    const indexed = await McapIndexedReader.Initialize({ readable, decompressHandlers });
    let count = 0, last = 0n;
    const seen = new Map();
    for await (const message of indexed.readMessages()) {
      if (message.logTime < last) fail("the messages of the index are not in order");
      last = message.logTime;
      ++count;
      seen.set(message.channelId, (seen.get(message.channelId) ?? 0) + 1);
      if (indexed.channelsById.get(message.channelId).topic !== channels.get(message.channelId).topic) fail("another channel in the summary");
    }
    const statistics = indexed.statistics;
    if (count !== result.messages.length) fail(`the index has ${count} messages, the file ${result.messages.length}`);
    if (Number(statistics.messageCount) !== count || statistics.chunkCount !== indexed.chunkIndexes.length) fail("the statistics are wrong");
    for (const [id, number] of seen)
      if (Number(statistics.channelMessageCounts.get(id)) !== number) fail("the statistics of a channel are wrong");
    if (statistics.messageEndTime !== last) fail("the last time is wrong");
    if (statistics.metadataCount !== result.metadata.length || indexed.metadataIndexes.length !== result.metadata.length) fail("the index of metadata is wrong");
    if (indexed.schemasById.size !== schemas.size || statistics.schemaCount !== schemas.size) fail("the schemas of the summary are wrong");
    for await (const metadata of indexed.readMetadata()) if (!metadata.name.startsWith("lrt:")) fail("other metadata");
    // A part of the time.
    const middle = (BigInt(result.messages[0].logTime) + last) / 2n;
    let later = 0;
    for await (const message of indexed.readMessages({ startTime: middle })) {
      if (message.logTime < middle) fail("a message before the wanted time");
      ++later;
    }
    if (later !== result.messages.filter((m) => BigInt(m.logTime) >= middle).length) fail("seeking by time finds others");
    result.library = indexed.header.library;
  }
  for (const channel of channels.values()) result.channels.push({ topic: channel.topic, schema: schemas.get(channel.schemaId).name, metadata: Object.fromEntries(channel.metadata) });
  console.log(JSON.stringify(result));
}

main().catch((error) => fail(error.stack));
