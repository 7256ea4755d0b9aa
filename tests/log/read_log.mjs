// Reads MCAP files with @mcap/core, in the way of a stream or through the index, and prints what it found as JSON.
//
//     node read_log.mjs NODE_MODULES stream|index LOG

import { createHash } from "node:crypto";
import { open, readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const [modules, way, path] = process.argv.slice(2);
const { McapIndexedReader, McapStreamReader } = await import(
  pathToFileURL(`${modules}/@mcap/core/dist/esm/index.js`)
);
const lz4 = createRequire(`${modules}/`)("@foxglove/wasm-lz4");
await lz4.isLoaded;
const decompressHandlers = { lz4: (data, size) => lz4(data, Number(size)) };

const schemas = new Map();
const channels = new Map();
const found = { topics: {}, metadata: {}, attachments: {}, first: null, last: null, footer: false };
const digest = createHash("sha256");

function see(record) {
  if (record.type === "Schema") {
    schemas.set(record.id, record);
  } else if (record.type === "Channel") {
    channels.set(record.id, record);
    found.topics[record.topic] ??= { messages: 0, schema: schemas.get(record.schemaId).name };
  } else if (record.type === "Message") {
    found.topics[channels.get(record.channelId).topic].messages += 1;
    found.first ??= record.logTime.toString();
    found.last = record.logTime.toString();
    digest.update(record.data);
  } else if (record.type === "Metadata") {
    found.metadata[record.name] = Object.fromEntries(record.metadata);
  } else if (record.type === "Attachment") {
    found.attachments[record.name] = createHash("sha256").update(record.data).digest("hex");
  } else if (record.type === "Footer") {
    found.footer = true;
  }
}

if (way === "stream") {
  const reader = new McapStreamReader({ decompressHandlers });
  reader.append(await readFile(path));
  for (let record; (record = reader.nextRecord()); ) {
    see(record);
  }
  found.done = reader.done();
} else {
  const file = await open(path);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, size) => {
      const data = new Uint8Array(Number(size));
      await file.read(data, 0, data.length, Number(offset));
      return data;
    },
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  reader.schemasById.forEach(see);
  reader.channelsById.forEach(see);
  for (const records of [reader.readMetadata(), reader.readAttachments(), reader.readMessages()]) {
    for await (const record of records) {
      see(record);
    }
  }
  found.footer = found.done = reader.footer !== undefined;
  await file.close();
}
console.log(JSON.stringify({ ...found, digest: digest.digest("hex") }));
