// What the public npm packages `@mcap/core` and `protobufjs` find in a recording, as JSON: the same document as read_python.py.
//
// In: a recording; the descriptors come out of the file. Out: topics with counts, first and last message, attachments, metadata.
// Knows nothing of sollwert. Usage: node read_node.mjs FILE      (npm install in tests/readers)
import { createHash } from "node:crypto";
import { open } from "node:fs/promises";
import { McapIndexedReader } from "@mcap/core";
import { decompress } from "fzstd";
import protobuf from "protobufjs";
import descriptor from "protobufjs/ext/descriptor/index.js";

/** A file as @mcap/core wants it. */
class FileReadable {
  constructor(handle) {
    this.handle = handle;
  }
  async size() {
    return BigInt((await this.handle.stat()).size);
  }
  async read(offset, length) {
    const buffer = new Uint8Array(Number(length));
    const { bytesRead } = await this.handle.read(buffer, 0, buffer.length, Number(offset));
    if (bytesRead !== buffer.length) {
      throw new Error(`only ${bytesRead} of ${length} bytes at ${offset}`);
    }
    return buffer;
  }
}

/** The fields that are present (or cannot be told from absent ones), by their names in the .proto file. */
function fields(type, message) {
  const found = {};
  for (const field of type.fieldsArray) {
    field.resolve();
    // A member of a oneof, as every `optional` field is, or a message: absent means absent.
    const hasPresence = field.partOf != null || field.resolvedType instanceof protobuf.Type;
    if (hasPresence && (!Object.hasOwn(message, field.name) || message[field.name] == null)) {
      continue;
    }
    const value = message[field.name];
    if (field.resolvedType instanceof protobuf.Type) {
      found[field.name] = fields(field.resolvedType, value);
    } else {
      found[field.name] = protobuf.util.Long?.isLong(value) ? value.toNumber() : value;
    }
  }
  return found;
}

async function main(path) {
  const handle = await open(path);
  const decompressHandlers = { zstd: (packed, size) => decompress(packed, new Uint8Array(Number(size))) };
  const reader = await McapIndexedReader.Initialize({ readable: new FileReadable(handle), decompressHandlers });
  const types = new Map();
  const typeOf = (channel) => {
    if (!types.has(channel.id)) {
      const schema = reader.schemasById.get(channel.schemaId);
      const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
      types.set(channel.id, { name: schema.name, type: root.lookupType(schema.name) });
    }
    return types.get(channel.id);
  };
  const topics = {};
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    const { name, type } = typeOf(channel);
    const metadata = Object.fromEntries(channel.metadata);
    const topic = (topics[channel.topic] ??= { schema: name, messages: 0, metadata, type });
    topic.messages += 1;
    topic.first ??= message;
    topic.last = message;
  }
  for (const topic of Object.values(topics)) {
    for (const end of ["first", "last"]) {
      const { logTime, sequence, data } = topic[end];
      topic[end] = { log_time_ns: Number(logTime), sequence, fields: fields(topic.type, topic.type.decode(data)) };
    }
    delete topic.type;
  }
  const counts = {};
  for (const [id, count] of reader.statistics.channelMessageCounts) {
    counts[reader.channelsById.get(id).topic] = Number(count);
  }
  const metadata = {};
  for await (const record of reader.readMetadata()) {
    metadata[record.name] = { ...metadata[record.name], ...Object.fromEntries(record.metadata) };
  }
  const attachments = [];
  for await (const { name, mediaType, data } of reader.readAttachments()) {
    const sha256 = createHash("sha256").update(data).digest("hex");
    attachments.push({ name, media_type: mediaType, bytes: data.length, sha256 });
  }
  await handle.close();
  return { library: reader.header.library, topics, counts, attachments, metadata };
}

if (process.argv.length !== 3) {
  console.error("usage: node read_node.mjs FILE");
  process.exit(2);
}
console.log(JSON.stringify(await main(process.argv[2])));
