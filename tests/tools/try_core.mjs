// The core of docs/try in node: a request in each line of standard input, JSON; its answer in a line of standard output.

import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const folder = pathToFileURL(`${process.argv[2]}/`);
const { load, Refused } = await import(new URL("core.js", folder));
const lines = await import(new URL("lines.js", folder)), tables = await import(new URL("tables.js", folder));
const core = await load(readFileSync(new URL("palpate.wasm", folder)));

const base64 = (array) => Buffer.from(array.buffer, array.byteOffset, array.byteLength).toString("base64");
const packed = (block) => Object.fromEntries(Object.entries(block).map(([name, value]) => [name, ArrayBuffer.isView(value) ? base64(value) : value]));
const told = (got) => ({ hello: got.hello, state: got.state, touches: got.touches, events: got.events, session: got.session, truth: got.truth });
const all = (got, blocks = [got.block]) => ({ blocks: blocks.map(packed), ...told(got) });
const exact = (values) => Object.fromEntries(Object.entries(values).map(([name, value]) => [name, typeof value === "bigint" ? String(value) : Number.isNaN(value) ? "nan" : value]));

const DO = {
  open: async ({ files }) => all(await core.open(files.map(({ name, base64 }) => ({ name, bytes: new Uint8Array(Buffer.from(base64, "base64")) })))),
  sample: async () => all(await core.sample()),
  play: async ({ times }) => {
    const got = await core.play();
    return all(got, times.map((time) => got.until(time)));
  },
  // pieces: [text, arrival in s]; a refusal ends them
  serial: async ({ pieces, tare = -1, close = "" }) => {
    const got = await core.serial("port"), blocks = [];
    let refused = null;
    try {
      pieces.forEach(([text, at_s], i) => {
        blocks.push(got.take(Buffer.from(text, "latin1"), at_s));
        if (i === tare) got.tare();
      });
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      refused = error.message;
    }
    const before = got.state;
    got.close(close);
    return { ...all(got, blocks), refused, before };
  },
  lines: async ({ lines: some }) => some.map((line) => {
    try {
      const values = new lines.Format(line).read(line);
      return { values: exact(values), sample: exact(lines.sampleOf(values)) };
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      return { refused: error.message };
    }
  }),
  // numbers that JSON does not have are written as text
  call: async ({ name, args }) => args.map((one) => tables[name](...JSON.parse(one, (_, value) => ({ NaN, Infinity, "-Infinity": -Infinity })[value] ?? value))),
};

for await (const line of createInterface({ input: process.stdin })) {
  const request = JSON.parse(line);
  let answer;
  try {
    answer = await DO[request.do](request);
  } catch (error) {
    answer = error instanceof Refused ? { refused: error.message } : { broken: String(error.stack) };
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}
