// Holds our foxglove.proto against the official schemas: prints a line for each message, field, number,
// type or enumerator of ours that is not theirs. node foxglove_schemas.js OUR.proto
"use strict";
const internal = require("@foxglove/schemas/internal");
const protobuf = require("protobufjs");

const ours = protobuf.loadSync(process.argv[2]).lookup("foxglove");
const short = type => type.replace(/^foxglove\./, "");
let count = 0;
function differ(text) {
  console.log(text);
}
for (const message of ours.nestedArray) {
  const schema = internal.foxgloveMessageSchemas[message.name];
  if (!schema) {
    differ(`${message.name} is not a message of theirs`);
    continue;
  }
  const enums = Object.values(internal.foxgloveEnumSchemas)
      .filter(each => each.parentSchemaName === message.name);
  const text = internal.generateProto(schema, enums).replace(/^import .*$/gm, "");
  const theirs = protobuf.parse(text, {keepCase: true}).root.lookupType("foxglove." + message.name);
  for (const field of message.fieldsArray) {
    const other = theirs.fields[field.name.replace(/[A-Z]/g, c => "_" + c.toLowerCase())];
    ++count;
    if (!other) differ(`${message.name}.${field.name} is not a field of theirs`);
    else if (other.id !== field.id || other.repeated !== field.repeated ||
             short(other.type) !== short(field.type)) {
      differ(`${message.name}.${field.name}: ${field.type} = ${field.id}, theirs is ` +
             `${other.type} = ${other.id}`);
    }
  }
  for (const nested of message.nestedArray) {
    const other = theirs.lookupEnum(nested.name);
    if (JSON.stringify(other.values) !== JSON.stringify(nested.values)) {
      differ(`${message.name}.${nested.name} has other values`);
    }
  }
}
console.log(`${count} fields compared`);
