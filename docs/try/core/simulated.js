// The simulated session, unpacked: docs/try/core_sample.py packs it.

import { SAMPLE } from "./sample.js";
import { TABLES } from "./tables.js";

export async function samplesOf() {
  const packed = Uint8Array.from(atob(SAMPLE.packed), (char) => char.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer()), { rows, step_ns: step } = SAMPLE;
  const [hard, apart, hardCode, softCode] = [0, 1, 2, 3].map((column) => summed(bytes.subarray(3 * rows * column, 3 * rows * (column + 1)), rows));
  const { zero, per_pF } = TABLES.codes;
  return hard.map((at, seq) => ({
    seq, t_hard_ns: at * step, t_soft_ns: (at + apart[seq]) * step, hard_raw: hardCode[seq] + zero, soft_raw: softCode[seq] + zero,
    hard: hardCode[seq] / per_pF, soft: softCode[seq] / per_pF, status: 0,
  }));
}

// Integers from their differences, whose bytes are in three planes, with the sign as the lowest bit.
function summed(bytes, rows) {
  let sum = 0;
  return Array.from({ length: rows }, (_, i) => {
    const value = bytes[i] + 256 * bytes[rows + i] + 65536 * bytes[2 * rows + i];
    return (sum += value & 1 ? -(value >> 1) : value >> 1);
  });
}

// As a recording has them.
export function text(samples) {
  const seconds = (ns) => (ns / 1e9).toFixed(9);
  const lines = samples.map((one) => [one.seq, seconds(one.t_hard_ns), seconds(one.t_soft_ns), one.hard_raw, one.soft_raw, one.hard, one.soft, -1, 0].join(","));
  return new TextEncoder().encode([TABLES.columns.join(","), ...lines, ""].join("\n"));
}

export function sampled(got) {
  got.truth = SAMPLE.truth;
  got.device = "simulated probe";
  if (got.file) {
    got.notes = [];
    Object.assign(got.file, { name: "simulated touches", end: "simulated" });
  }
  return Object.assign(got, { name: "simulated touches" });
}
