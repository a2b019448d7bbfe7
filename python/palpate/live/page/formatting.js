// Formats numbers and times.

const FEW = 3, MOST_PLACES = 8, LARGEST = 1e9, LARGEST_ROUNDED = 1e6, SMALLEST = 1e-4, DOUBLE = 15;

// Rounds a value to two digits of its uncertainty; to 3 digits if that is not known, with a power of ten
// below 1e-4. The rule of palpate/number_format.py.
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

export const settings = { unit: "MPa" }; // by the names of the dialog

// A text with moduli in MPa, in the unit that is set: with the same digits.
export function inUnit(text) {
  if (settings.unit === "MPa") return String(text);
  return String(text).replace(/\d+(\.\d+)?(e-?\d+)?/g, (mega) => (1000 * mega).toFixed(Math.max(0, places(mega) - 3))).replaceAll("MPa", settings.unit);
}

// A sentence with moduli in MPa, in the unit that is set; its other numbers stay.
export function sentenceInUnit(text) {
  return String(text).replace(/[\d.]+(e-?\d+)?((,| and| to) [\d.]+(e-?\d+)?)* MPa/g, (moduli) => inUnit(moduli));
}

// Shore A of a rubber with this modulus, MPa; null outside 1 to 95. The rule of palpate.shore_a_of_modulus.
export function shoreA(modulus) {
  const hardness = (254 * 0.137505 * modulus - 56 * 0.0981) / (7.62336 * 0.0981 + 2.54 * 0.137505 * modulus);
  return modulus !== null && hardness >= 1 && hardness <= 95 ? hardness : null;
}

// A modulus in parts: its value and its interval, or only what is known of it; and its Shore hardness, if that is wanted.
export function modulusOf(modulus) {
  if (!modulus) return { value: "–", interval: "", unit: "", shore: "" };
  const more = modulus.extrapolated ? ", beyond the calibration" : "", text = inUnit(modulus.text), hardness = settings.shore === "on" && shoreA(modulus.value_MPa);
  const [, value = "–", unit = "", interval] = text.match(/^(.*) ([kM]Pa) \((.*)\)$/) ?? [], shore = hardness ? `${hardness.toFixed(0)} A` : "";
  return { value, interval: unit ? `${interval} ${unit}` : text, unit, more, shore };
}

// Low and high end of an interval of `modulusOf`, the unit at the high one.
export function endsOf(interval) {
  return interval.split(" to ");
}

// With its sign, and a true minus.
export function signed(value, decimals) {
  const text = Math.abs(value).toFixed(decimals);
  return (Number(text) === 0 ? "" : value < 0 ? "−" : "+") + text;
}

// mm:ss, or h:mm:ss, as a clock shows it.
export function clock(seconds, places = 0) {
  const units = Math.floor(Math.abs(seconds) * 10 ** places + 1e-6), all = Math.floor(units / 10 ** places);
  const [h, m, s] = [Math.floor(all / 3600), Math.floor(all / 60) % 60, all % 60].map((v) => String(v).padStart(2, "0"));
  const part = places ? `.${String(units % 10 ** places).padStart(places, "0")}` : "";
  return `${seconds < 0 && units ? "−" : ""}${all >= 3600 ? `${Number(h)}:` : ""}${m}:${s}${part}`;
}

export function grouped(count) {
  return String(count).replace(/\B(?=(\d{3})+$)/g, "\u202f");
}

// Digits behind the point, the point not counted.
export function places(text) {
  return (String(text).split(".")[1] ?? "").length;
}

const SCATTERS = {
  assumed: "the scatter from touch to touch is assumed until touches are repeated or calibrated",
  session: "the scatter from touch to touch is that of the repeated touches",
  calibration: "the scatter from touch to touch is that of the calibration",
};

// Where the scatter in an uncertainty comes from.
export function scatterWords(source) {
  return SCATTERS[source] ?? "";
}
