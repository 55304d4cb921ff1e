// A viewer not written here: `@foxglove/ws-protocol` connects, subscribes to topics, and decodes each by the schema that the server
// sent, with `protobufjs`. Prints one JSON line for the first message of every topic, and ends when all have come.
//
//   NODE_PATH is not looked at by modules: run it with the folder of node_modules as the first argument.
//   node foxglove_client.mjs NODE_MODULES ws://127.0.0.1:8765 /tf /estimate
import { createRequire } from "node:module";
import path from "node:path";

const [modules, url, ...topics] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(modules), "..", "package.json"));
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const { WebSocket } = require("ws");
const protobuf = require("protobufjs");
const descriptor = require("protobufjs/ext/descriptor");

const decoders = {
    json: () => (bytes) => JSON.parse(new TextDecoder().decode(bytes)),
    protobuf: (channel) => {
        const set = descriptor.FileDescriptorSet.decode(Buffer.from(channel.schema, "base64"));
        const type = protobuf.Root.fromDescriptor(set).lookupType(channel.schemaName);
        return (bytes) => type.toObject(type.decode(bytes), { longs: Number, bytes: (value) => value.length });
    },
};

// The protocol's name since the server is part of Foxglove's SDK; the messages are those that the client knows.
const client = new FoxgloveClient({ ws: new WebSocket(url, ["foxglove.sdk.v1"]) });
const wanted = new Map();
client.on("error", (error) => {
    console.error(error);
    process.exit(1);
});
client.on("advertise", (channels) => {
    for (const channel of channels.filter((one) => topics.includes(one.topic))) {
        const decode = decoders[channel.encoding](channel);
        wanted.set(client.subscribe(channel.id), { topic: channel.topic, decode });
    }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
    const one = wanted.get(subscriptionId);
    if (one === undefined || one.came) {
        return;
    }
    one.came = true;
    const bytes = new Uint8Array(data.buffer, data.byteOffset, data.byteLength);
    console.log(JSON.stringify({ topic: one.topic, stamp_ns: String(timestamp), message: one.decode(bytes) }));
    const all = [...wanted.values()];
    if (all.length === topics.length && all.every((each) => each.came)) {
        client.close();
        process.exit(0);
    }
});
