// Reads recordings with the official MCAP reader, by its index and as a stream, and decodes every message by the schema
// in the file alone. Prints one line of JSON for each file; exit status 1 where one cannot be read.
//
//   node official_reader.mjs FOLDER_OF_NODE_MODULES RECORDING.mcap ...
import { open, readFile } from "node:fs/promises";
import { createRequire } from "node:module";

const [modules, ...files] = process.argv.slice(2);
const require = createRequire(`${modules}/package.json`);
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { decompress } = require("fzstd");
const protobuf = require("protobufjs");
const descriptor = require("protobufjs/ext/descriptor");

const decompressHandlers = { zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size))) };

function typeOf(schema) {
  const set = descriptor.FileDescriptorSet.decode(schema.data);
  return protobuf.Root.fromDescriptor(set).lookupType(schema.name);
}

class Content {
  constructor() {
    this.messages = 0;
    this.rows = 0;
    this.events = 0;
    this.columns = 0;
  }
  add(schema, types, message) {
    if (!types.has(schema.id)) types.set(schema.id, typeOf(schema));
    const decoded = types.get(schema.id).decode(message.data);
    ++this.messages;
    if (schema.name === "hapticd.v1.TelemetryBlock") {
      if (decoded.columns.length > 0) this.columns = decoded.columns.length;
      if (decoded.rows.length % (8 * this.columns) !== 0) throw new Error("a block has half a row");
      this.rows += decoded.rows.length / (8 * this.columns);
    } else {
      if (!decoded.kind) throw new Error("an event has no kind");
      ++this.events;
    }
  }
}

async function byIndex(path) {
  const file = await open(path);
  try {
    const readable = {
      size: async () => BigInt((await file.stat()).size),
      read: async (offset, length) => {
        const bytes = new Uint8Array(Number(length));
        const { bytesRead } = await file.read(bytes, 0, bytes.length, Number(offset));
        if (bytesRead !== bytes.length) throw new Error("the file is too short");
        return bytes;
      },
    };
    const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
    const content = new Content();
    const types = new Map();
    for await (const message of reader.readMessages()) {
      const channel = reader.channelsById.get(message.channelId);
      content.add(reader.schemasById.get(channel.schemaId), types, message);
    }
    const counted = Number(reader.statistics.messageCount);
    if (counted !== content.messages) throw new Error(`the summary counts ${counted}, there are ${content.messages}`);
    content.metadata = [];
    for await (const one of reader.readMetadata()) content.metadata.push(one.name);
    return content;
  } finally {
    await file.close();
  }
}

async function asStream(path) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(await readFile(path));
  const content = new Content();
  const schemas = new Map();
  const channels = new Map();
  const types = new Map();
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Message") content.add(schemas.get(channels.get(record.channelId).schemaId), types, record);
  }
  if (!reader.done()) throw new Error("the stream does not end");
  return content;
}

let failed = false;
for (const path of files) {
  try {
    const content = await byIndex(path);
    const streamed = await asStream(path);
    if (streamed.rows !== content.rows || streamed.events !== content.events) {
      throw new Error(`index: ${content.rows} rows, stream: ${streamed.rows}`);
    }
    console.log(JSON.stringify({ file: path, ...content }));
  } catch (error) {
    failed = true;
    console.log(JSON.stringify({ file: path, failed: String(error) }));
  }
}
process.exit(failed ? 1 : 0);
