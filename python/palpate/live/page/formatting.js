// Formats numbers and table rows.

const FEW = 3, MOST_PLACES = 8, LARGEST = 1e9, LARGEST_ROUNDED = 1e6, DOUBLE = 15;

// Rounds a value to two digits of its uncertainty; to 3 digits if that is not known. The rule of palpate/digits.py.
export function number(value, uncertainty) {
  if (value === null || value === undefined) return "–";
  const sure = uncertainty > 0 && Number.isFinite(uncertainty);
  const last = sure ? exponent(uncertainty, 1) - 1 : exponent(value, FEW - 1) - FEW + 1;
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
  const digits = exponent(value, DOUBLE) - last;
  return value === 0 || digits < 0 ? "0" : value.toExponential(Math.min(digits, DOUBLE)).replace("e+", "e");
}

// Returns the headline of a modulus, and its interval.
export function modulusOf(modulus) {
  if (!modulus) return ["–", ""];
  const [, value, interval] = modulus.text.match(/^(.*) MPa \((.*)\)$/) ?? [];
  const more = modulus.extrapolated ? ", extrapolated" : "";
  return value ? [`${value} MPa`, `${interval} MPa, 95 %${more}`] : ["–", modulus.text + more];
}

export function bySource({ source, device, scene }) {
  return [source, device, `scene ${scene}`].filter(Boolean).join(" · ");
}

export function counted({ dropped, lost, refused, late }) {
  return `${dropped} dropped, ${refused} refused, ${lost} lost, ${late} late`;
}

export function touchRow(touch, best) {
  const row = document.createElement("tr");
  row.classList.toggle("best", best);
  const cells = [
    touch.number,
    touch.start_s.toFixed(2),
    touch.samples,
    number(touch.ratio, touch.standard_error),
    number(touch.standard_error, touch.standard_error),
    number(touch.covariance),
    `${Math.round(100 * touch.alarm_share)} %`,
    touch.modulus?.text ?? "–",
    remarks(touch),
  ];
  row.append(...cells.map((text) => Object.assign(document.createElement("td"), { textContent: text })));
  row.cells[7].className = "modulus";
  row.cells[8].className = "remark";
  row.cells[8].append(...touch.advice.map((sentence) => Object.assign(document.createElement("p"), { className: "advice", textContent: sentence })));
  return row;
}

function remarks({ flags, refused, saturated, revised }) {
  return [...flags, revised ? "revised" : "", refused ? `${refused} refused` : "", saturated ? `${saturated} saturated` : ""].filter(Boolean).join(", ");
}
