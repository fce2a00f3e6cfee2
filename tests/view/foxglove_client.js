// Receives and decodes every channel that swarmtalk-view advertises, with the official client.
// node foxglove_client.js PORT SUBPROTOCOL; prints one JSON object: what each channel sent first.
"use strict";
const {FoxgloveClient} = require("@foxglove/ws-protocol");
const protobuf = require("protobufjs");
const descriptor = require("protobufjs/ext/descriptor");
const WebSocket = require("ws");

const [port, subprotocol] = process.argv.slice(2);
const socket = new WebSocket(`ws://localhost:${port}/`, [subprotocol]);
const client = new FoxgloveClient({ws: socket});
const types = new Map(), received = {}, wanted = new Set();
const give_up = setTimeout(() => fail("timed out waiting for " + [...wanted].join(" ")), 20000);

function fail(text) {
  console.error(text);
  process.exit(1);
}
client.on("error", error => fail(String(error)));
client.on("status", status => fail(status.message));
client.on("advertise", channels => {
  for (const channel of channels) {
    const set = descriptor.FileDescriptorSet.decode(Buffer.from(channel.schema, "base64"));
    const type = protobuf.Root.fromDescriptor(set).lookupType(channel.schemaName);
    types.set(client.subscribe(channel.id), {channel, type});
    wanted.add(channel.topic);
  }
});
client.on("message", event => {
  const {channel, type} = types.get(event.subscriptionId);
  const message = type.decode(new Uint8Array(event.data.buffer, event.data.byteOffset,
                                             event.data.byteLength));
  received[channel.topic] = type.toObject(message, {longs: Number, enums: String});
  wanted.delete(channel.topic);
  if (wanted.size) return;
  clearTimeout(give_up);
  console.log(JSON.stringify(received));
  socket.terminate();
  process.exit(0);
});
