// The table of touches as text: with all digits, for a spreadsheet.

const COLUMNS = [
  ["touch", (one) => one.number], ["specimen", (one) => one.specimen ?? ""], ["start_s", (one) => one.start_s], ["end_s", (one) => one.end_s],
  ["samples", (one) => one.samples], ["ratio", (one) => one.ratio], ["standard_error", (one) => one.standard_error],
  ["uncertainty", (one) => one.uncertainty], ["covariance", (one) => one.covariance], ["alarm_share", (one) => one.alarm_share],
  ["modulus_MPa", (one) => one.modulus?.value_MPa], ["low_MPa", (one) => one.modulus?.low_MPa], ["high_MPa", (one) => one.modulus?.high_MPa],
  ["deviation", (one) => one.deviation], ["kept", (one) => (one.kept === false ? "no" : "yes")], ["flags", (one) => one.flags.join(" ")],
  ["remark", (one) => one.why || one.advice.join(". ")],
];

export function asText(rows, separator) {
  const cell = (value) => quoted(String(value ?? ""), separator);
  return [COLUMNS.map(([name]) => name), ...rows.map((one) => COLUMNS.map(([, of]) => of(one)))]
    .map((line) => line.map(cell).join(separator) + "\r\n").join("");
}

// A spreadsheet would run a text that begins so as a formula.
function quoted(text, separator) {
  const safe = /^[=+\-@\t\r]/.test(text) && Number.isNaN(Number(text)) ? `'${text}` : text;
  return safe.includes(separator) || /["\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}
