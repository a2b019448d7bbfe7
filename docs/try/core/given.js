// What the functions use that are translated from Python: docs/try/javascript.py has the list.

import { number, plusMinus as parts } from "./page/formatting.js";

export const isinf = (x) => Math.abs(x) === Infinity;
export const has = (all, one) => (Array.isArray(all) ? all.includes(one) : one in all);
export const common = (left, right) => left.filter((one) => right.includes(one)).length;
export const largest = (key, ...all) => all.reduce((best, one) => (key(one) > key(best) ? one : best));
export const fixed = (x, decimals) => x.toFixed(decimals);
export const general = (x, digits) => String(Number(x.toPrecision(digits)));

const known = (uncertainty) => Number.isFinite(uncertainty) && uncertainty > 0;

// As palpate.digits.error and plus_minus: the page's own rule of rounding.
export const error = (uncertainty) => (uncertainty === 0 || known(uncertainty) ? number(uncertainty, uncertainty) : "-");
export function plusMinus(value, uncertainty) {
  const sure = known(uncertainty) && Number.isFinite(value);
  return sure ? parts(value, uncertainty).join(" ") : `${Number.isFinite(value) ? number(value) : "-"}, uncertainty not known`;
}

export const Now = (word, sub, tone = "idle", share = null) => ({ word, sub, tone, share });
export const Line = (what, level, title, text, said = "") => ({ what, level, title, text, said });
export const View = (line, now = null) => ({ line, now });

// As palpate.live.desk.words.sentence: a capital, unless it begins with the name of a file; a full stop.
export function sentence(given) {
  const text = given.trim(), first = text.split(" ")[0].replace(/\.+$/, "");
  const begin = /[./\\]/.test(first) ? text.slice(0, 1) : text.slice(0, 1).toUpperCase();
  return begin + text.slice(1) + (/[.!?]$/.test(text) ? "" : ".");
}
