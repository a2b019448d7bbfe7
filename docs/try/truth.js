// The bundled simulated touches: their true ratios, beside what was estimated.

import { $, put } from "./page/dom.js";
import { number, signed } from "./page/formatting.js";

// What the core says of them, with the truth in place of specimens: what it is, and how far each estimate is from it.
export function simulated(got) {
  const truths = new Map(got.truth.map((one) => [one.touch, one]));
  const rows = got.touches.rows.map((row) => {
    const truth = truths.get(row.number);
    return truth ? { ...row, specimen: truth.name, deviation: row.ratio / truth.ratio - 1 } : row;
  });
  const word = { word: "Demo", sub: "simulated touches: nothing is measured", tone: "idle", share: null };
  const text = "A simulated hand touched objects of known ratio. Drop a recording here, or connect your probe.";
  const said = { what: "simulation", level: "note", title: "This is a simulation.", text, since_s: null };
  const { hello, block, events, session } = got;
  return { hello, block, events, session, truth: got.truth, touches: { ...got.touches, rows }, state: { ...got.state, now: word, line: said, announce: `${said.title} ${text}` } };
}

// Beside the estimate of the shown touch: its truth, and how far it is away, in standard errors, too.
export class Truth {
  tell(_, { truth, touches, chosen }) {
    const touch = touches.rows.find((one) => one.number === chosen) ?? touches.rows.at(-1), found = truth?.find((one) => one.touch === touch?.number);
    $("truth").hidden = !found;
    $("next").hidden = Boolean(found);
    if (!found) return;
    put("truthname", `True ratio, ${found.name}`);
    put("true", number(found.ratio, touch.standard_error));
    const off = touch.ratio - found.ratio, errors = Math.abs(off / touch.standard_error);
    put("off", `estimate ${signed((100 * off) / found.ratio, 2)} %${Number.isFinite(errors) ? `, ${errors.toFixed(1)} standard errors` : ""}`);
  }
}
