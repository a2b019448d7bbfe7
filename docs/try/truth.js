// The bundled simulated touches: the true ratio of each, beside what was estimated. A hand holds each touch at its own
// angle, so it is not the ratio of its specimen; and as its gauges are slightly curved, no estimate is without a bias.

import { $, put } from "./page/dom.js";
import { number, signed } from "./page/formatting.js";
import { running } from "./page/now.js";

const WORD = { word: "Demo", sub: "simulated touches: nothing is measured", tone: "idle", share: null };
const TITLE = "This is a simulation.", TEXT = "A hard and a soft bump press on rubber: their ratio tells how elastic it is. Drop a recording, or connect your probe.";

// What is told of them, with what they are in place of a specimen, and how far each estimate is from its truth.
export function compared(kind, message, truth) {
  if (kind === "touches") return { ...message, rows: message.rows.map((row) => beside(row, truth)) };
  if (kind !== "state" || message.state !== "ended") return message;
  return { ...message, now: WORD, line: { what: "simulation", level: "note", title: TITLE, text: TEXT, since_s: null }, announce: `${TITLE} ${TEXT}` };
}

function beside(row, truth) {
  const found = truth.find(({ touch }) => touch === row.number);
  return found ? { ...row, specimen: found.name, deviation: row.ratio / found.touch_ratio - 1 } : row;
}

// The truth of the shown touch, and how far its estimate is away.
export class Truth {
  tell(_, { truth, state, touches, chosen }) {
    const last = touches.rows.at(-1), one = running(state) ? { ...state, number: (last?.number ?? 0) + 1 } : touches.rows.find(({ number: n }) => n === chosen) ?? last;
    const found = truth?.find(({ touch }) => touch === one?.number);
    $("truth").hidden = !truth;
    $("next").hidden = Boolean(truth);
    put("truthname", found ? `True ratio, ${found.name}` : "True ratio");
    put("true", found ? number(found.touch_ratio, one.standard_error) : "–");
    put("off", found ? `as it was held; the estimate is ${signed(100 * (one.ratio / found.touch_ratio - 1), 2)} % away. Upright: ${number(found.ratio)}` : "");
  }
}
