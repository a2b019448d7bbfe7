// Formats numbers and times.

const FEW = 3, MOST_PLACES = 8, LARGEST = 1e9, LARGEST_ROUNDED = 1e6, SMALLEST = 1e-4, DOUBLE = 15;

// Rounds a value to two digits of its uncertainty; to 3 digits if that is not known, with a power of ten
// below 1e-4. The rule of palpate/digits.py.
export function number(value, uncertainty) {
  if (value === null || value === undefined) return "–";
  const sure = uncertainty > 0 && Number.isFinite(uncertainty);
  const last = sure ? exponent(uncertainty, 1) - 1 : exponent(value, FEW - 1) - FEW + 1;
  if (!sure && value !== 0 && Math.abs(value) < SMALLEST) return powered(value, last);
  return written(value, last, sure ? Math.max(Math.abs(value), uncertainty) : Math.abs(value));
}

// Returns "value ± uncertainty" in two parts with the same decimals; the second is empty if it is not known.
export function plusMinus(value, uncertainty) {
  if (value === null || value === undefined || !(uncertainty > 0)) return [number(value), ""];
  const last = exponent(uncertainty, 1) - 1, top = Math.max(Math.abs(value), uncertainty);
  return [written(value, last, top), `± ${written(uncertainty, last, top)}`];
}

function exponent(value, decimals) {
  return Number(value.toExponential(decimals).split("e")[1]);
}

function written(value, last, top) {
  if (last >= -MOST_PLACES && top < (last <= 0 ? LARGEST : LARGEST_ROUNDED)) {
    const text = last > 0 ? String(Math.round(value / 10 ** last) * 10 ** last) : value.toFixed(-last);
    return Number(text) === 0 ? text.replace("-", "") : text;
  }
  return powered(value, last);
}

function powered(value, last) {
  const digits = exponent(value, DOUBLE) - last;
  return value === 0 || digits < 0 ? "0" : value.toExponential(Math.min(digits, DOUBLE)).replace("e+", "e");
}

// A modulus in parts: its value and its interval, or only what is known of it.
export function modulusOf(modulus) {
  if (!modulus) return { value: "–", interval: "", unit: "" };
  const more = modulus.extrapolated ? ", beyond the calibration" : "";
  const [, value, interval] = modulus.text.match(/^(.*) MPa \((.*)\)$/) ?? [];
  return value ? { value, interval: `${interval} MPa`, unit: "MPa", more } : { value: "–", interval: modulus.text, unit: "", more };
}

// With its sign, and a true minus.
export function signed(value, decimals) {
  const text = Math.abs(value).toFixed(decimals);
  return (Number(text) === 0 ? "" : value < 0 ? "−" : "+") + text;
}

export function clock(seconds) {
  const whole = Math.max(0, Math.floor(seconds)), two = (n) => String(n).padStart(2, "0");
  const rest = `${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
  return whole >= 3600 ? `${Math.floor(whole / 3600)}:${rest}` : rest;
}

export function grouped(count) {
  return String(count).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

// Digits behind the point, the point not counted.
export function places(text) {
  return (String(text).split(".")[1] ?? "").length;
}

// A number whose point stands under the point above it: its fraction is as wide as the longest of its column.
export function aligned(text, longest) {
  const [whole, part] = String(text).split("."), span = document.createElement("span"), fraction = document.createElement("i");
  span.className = "pt";
  fraction.textContent = part === undefined ? "" : `.${part}`;
  fraction.style.width = `${longest ? longest + 0.45 : 0}ch`;
  span.append(whole, fraction);
  return span;
}
