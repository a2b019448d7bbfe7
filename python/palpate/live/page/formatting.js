// Formats numbers and table rows.

export function short(value, digits = 3) {
  return value === null || value === undefined ? "–" : Number(value.toPrecision(digits)).toString();
}

// Rounds a value to two digits of its standard error; to 5 digits if the standard error is not known.
export function precise(value, error) {
  if (value === null || value === undefined) return "–";
  if (!error) return Math.abs(value) < 1e6 ? value.toPrecision(5) : value.toExponential(3);
  const places = Math.min(Math.max(1 - Math.floor(Math.log10(error)), 0), 8);
  return Math.abs(value) < 1e6 ? value.toFixed(places) : value.toExponential(3);
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
    precise(touch.ratio, touch.standard_error),
    short(touch.standard_error),
    short(touch.covariance),
    `${Math.round(100 * touch.alarm_share)} %`,
    touch.modulus?.text ?? "–",
    remarks(touch),
  ];
  row.append(...cells.map((text) => Object.assign(document.createElement("td"), { textContent: text })));
  row.cells[7].className = "modulus";
  row.cells[8].className = "remark";
  return row;
}

function remarks({ flags, refused, saturated }) {
  return [...flags, refused ? `${refused} refused` : "", saturated ? `${saturated} saturated` : ""].filter(Boolean).join(", ");
}
