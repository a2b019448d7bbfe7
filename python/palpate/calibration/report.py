"""Tables of a calibration: for the terminal, as JSON, and as a self-contained HTML page."""

from collections.abc import Sequence
from html import escape
from math import isfinite
from string import Template
from typing import Any

from palpate.calibration.calibration import Calibration
from palpate.calibration.characterise import Specimen, choose, rises
from palpate.calibration.plot import svg

RATIOS = {
    "smallest P": "covariance",
    "smallest error": "standard_error",
    "nearest to mean": "agreement",
    "mean": "mean",
}
"""Columns of the table: the ratio of the touch with the smallest P (the paper's choice), and so on."""


def specimen_records(specimens: Sequence[Specimen]) -> list[dict[str, Any]]:
    """Return a record for each specimen; a ratio is None if no touch is usable for it."""
    return [
        {
            "specimen": specimen.name,
            "modulus_MPa": specimen.modulus,
            "touches": len(specimen.touches),
            **{name: _ratio(specimen, by) for name, by in RATIOS.items()},
            "spread": specimen.spread if isfinite(specimen.spread) else None,
        }
        for specimen in specimens
    ]


def _ratio(specimen: Specimen, by: str) -> float | None:
    try:
        return choose(specimen.touches, by).ratio
    except ValueError:
        return None


def specimen_rows(specimens: Sequence[Specimen]) -> list[list[str]]:
    """Return the table of the specimens as text: a header, a row for each, and whether each column rises."""
    records = specimen_records(specimens)
    rows = [["specimen", "MPa", "touches", *RATIOS, "spread"]]
    for record in records:
        ratios = ["-" if record[name] is None else f"{record[name]:.4f}" for name in RATIOS]
        spread = "-" if record["spread"] is None else f"{100 * record['spread']:.2f} %"
        rows.append([record["specimen"], f"{record['modulus_MPa']:g}", str(record["touches"]), *ratios, spread])
    columns = [[record[name] for record in records] for name in RATIOS]
    verdicts = ["-" if None in column else "yes" if rises(column) else "no" for column in columns]
    return [*rows, ["rises", "", "", *verdicts, ""]]


def parameter_rows(calibration: Calibration) -> list[tuple[str, str, str]]:
    """Return name, value and 95 % interval of each parameter as text."""
    units = {"rigid_ratio": "", "half_modulus": " MPa", "soft_ratio": ""}
    rows = []
    for name, (low, high) in calibration.parameter_intervals().items():
        between = f"{low:.4g} to {high:.4g}{units[name]}" if high > low else "not fitted"
        rows.append((name, f"{getattr(calibration.probe, name):.4g}{units[name]}", between))
    return rows


_PAGE = Template("""<!doctype html>
<html lang="en"><meta charset="utf-8"><title>palpate: calibration</title>
<style>
body { font: 15px/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
table { border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .8rem; text-align: right; border-bottom: 1px solid #ddd; }
th:first-child, td:first-child { text-align: left; }
svg { max-width: 100%; height: auto; }
</style>
<h1>Calibration</h1>
<p><strong>$verdict</strong></p>
$plot
<h2>Parameters of eq. (2)</h2>
<table><tr><th>parameter<th>value<th>95 % interval</tr>$parameters</table>
<h2>Specimens</h2>
<p>Ratios of the touch with the smallest covariance P (the paper's choice), the smallest standard error, the one
nearest to the mean, and the mean; spread from touch to touch. Last row: does the column rise with the modulus?</p>
<table><tr>$head</tr>$specimens</table>
<h2>Distance from the curve</h2>
<table><tr><th>MPa<th>touches<th>ratio<th>curve<th>distance<th>in std. errors</tr>$residuals</table>
<p>palpate $version; $about</p>
</html>
""")


def html(calibration: Calibration, specimens: Sequence[Specimen]) -> str:
    """Return the report as one HTML page without external files."""
    head, *rows = specimen_rows(specimens)
    residuals = [
        (f"{r.modulus:g}", str(r.touches), f"{r.ratio:.4f}", f"{r.fitted:.4f}", f"{100 * r.relative:+.2f} %",
         f"{r.standardised:+.1f}")
        for r in calibration.residuals
    ]  # fmt: skip
    return _PAGE.substitute(
        verdict=escape(calibration.verdict),
        plot=svg(calibration),
        parameters="".join(_row(row) for row in parameter_rows(calibration)),
        head="".join(f"<th>{escape(cell)}" for cell in head),
        specimens="".join(_row(row) for row in rows),
        residuals="".join(_row(row) for row in residuals),
        version=escape(calibration.version),
        about=escape(", ".join(f"{key}: {value}" for key, value in calibration.about.items())),
    )


def _row(cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<td>{escape(cell)}" for cell in cells) + "</tr>"
