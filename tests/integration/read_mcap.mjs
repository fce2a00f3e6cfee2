// Reads a recording with the public JavaScript library for MCAP and prints a line of JSON for each
// message, decoded by the schema that the file holds. Used by test_recording.py, which installs the
// library: NODE_MODULES=FOLDER node read_mcap.mjs FILE
import {createRequire} from "node:module";
import {open} from "node:fs/promises";

const need = createRequire(process.env.NODE_MODULES + "/");
const {McapIndexedReader, McapStreamReader} = need("@mcap/core");
const {decompress} = need("fzstd");
const protobuf = need("protobufjs");
const descriptor = need("protobufjs/ext/descriptor");

const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    await file.read(bytes, 0, bytes.length, Number(offset));
    return bytes;
  },
};
const decompressHandlers = {zstd: (bytes, size) => decompress(bytes, new Uint8Array(Number(size)))};
const reader = await McapIndexedReader.Initialize({readable, decompressHandlers});

const types = new Map();
for (const [id, schema] of reader.schemasById) {
  const set = descriptor.FileDescriptorSet.decode(schema.data);
  types.set(id, protobuf.Root.fromDescriptor(set).lookupType(schema.name));
}
let count = 0n;
for await (const message of reader.readMessages({validateCrcs: true})) {
  ++count;
  const channel = reader.channelsById.get(message.channelId);
  const type = types.get(channel.schemaId);
  const content = type.toObject(type.decode(message.data), {bytes: String, longs: Number});
  console.log(JSON.stringify({topic: channel.topic, schema: type.fullName.replace(/^\./, ""),
                              time_ns: String(message.logTime), content}));
}

// The same again from beginning to end, with every CRC; and what the summary says.
const stream = new McapStreamReader({decompressHandlers, validateCrcs: true});
stream.append(await readable.read(0n, await readable.size()));
let streamed = 0n;
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === "Message") ++streamed;
}
const {messageCount, chunkCount} = reader.statistics;
if (!stream.done() || streamed !== count || messageCount !== count ||
    chunkCount !== reader.chunkIndexes.length) {
  throw new Error(`read ${count} by index, ${streamed} in a stream; ` +
                  `the summary says ${messageCount} in ${chunkCount} chunks`);
}
await file.close();
