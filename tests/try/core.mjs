// The core of docs/try in node: a request in each line of standard input, JSON; its answer in a line of standard output.

import { readFileSync } from "node:fs";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const from = (name) => import(new URL(name, pathToFileURL(`${process.argv[2]}/`)));
const [{ ADVICE, Core, Refused }, { recordingOf }] = await Promise.all(["core.js", "recording.js"].map(from));
const compiled = await WebAssembly.compile(readFileSync(`${process.argv[2]}/palpate.wasm`));

const COLUMNS = ["t", "hard", "soft", "ratio", "error", "statistic", "flags"];
const joined = (parts) => Object.fromEntries(COLUMNS.map((name) => [name, parts.flatMap((block) => [...block[name]])]));
const told = (got) => ({ rows: joined(got.parts.splice(0)), hello: got.hello, state: got.state, touches: got.touches.rows, events: got.events, lost: got.lost });

// What a function returns, or why it refuses.
async function refusing(act) {
  try {
    return await act();
  } catch (error) {
    return error instanceof Refused ? { refused: error.message } : { broken: String(error.stack) };
  }
}

const DO = {
  advice: () => ADVICE,
  open: async ({ files }) => told(recordingOf(await Core.of(compiled), files.map(({ name, base64 }) => ({ name, bytes: new Uint8Array(Buffer.from(base64, "base64")) })))),
};

for await (const line of createInterface({ input: process.stdin })) {
  const request = JSON.parse(line);
  process.stdout.write(`${JSON.stringify(await refusing(() => DO[request.do](request)))}\n`);
}
