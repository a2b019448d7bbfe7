"""Tables of a calibration: for the terminal, as JSON, and as a self-contained HTML page."""

from collections.abc import Sequence
from math import isfinite, nan, sqrt
from typing import Any

from palpate import digits
from palpate.calibration.calibration import Calibration
from palpate.calibration.characterise import Specimen, rises
from palpate.calibration.picture import Seen, picture
from palpate.calibration.verdict import percent
from palpate.display import page
from palpate.display.markup import Markup, element
from palpate.several import objections

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
            "usable": _usable(specimen),
            **{name: _ratio(specimen, by) for name, by in RATIOS.items()},
            "spread": specimen.spread if isfinite(specimen.spread) else None,
        }
        for specimen in specimens
    ]


def _usable(specimen: Specimen) -> int:
    return sum(not objections(touch, specimen.accept) for touch in specimen.touches)


def _ratio(specimen: Specimen, by: str) -> float | None:
    try:
        return specimen.choose(by).ratio
    except ValueError:
        return None


def specimen_rows(specimens: Sequence[Specimen]) -> list[list[str]]:
    """Return the table of the specimens as text: a header, a row for each, and whether each column rises."""
    records = specimen_records(specimens)
    rows = [["specimen", "MPa", "touches", *RATIOS, "spread"]]
    for record in records:
        ratios = ["-" if record[name] is None else _text(record, name) for name in RATIOS]
        spread = "-" if record["spread"] is None else f"{digits.error(100 * record['spread'])} %"
        rows.append([record["specimen"], f"{record['modulus_MPa']:g}", str(record["touches"]), *ratios, spread])
    columns = [[record[name] for record in records] for name in RATIOS]
    verdicts = ["-" if None in column else "yes" if rises(column) else "no" for column in columns]
    return [*rows, ["rises", "", "", *verdicts, ""]]


def _text(record: dict[str, Any], name: str) -> str:
    """Return a ratio to two digits of what it scatters by: a touch as the touches, a mean less."""
    scatter = (record["spread"] or nan) * abs(record[name])
    return digits.number(record[name], scatter / sqrt(record["usable"]) if name == "mean" else scatter)


def parameter_rows(calibration: Calibration) -> list[tuple[str, str, str]]:
    """Return name, value and 95 % interval of each parameter as text."""
    units = {"rigid_ratio": "", "half_modulus": " MPa", "soft_ratio": ""}
    rows = []
    for name, (low, high) in calibration.parameter_intervals().items():
        value = getattr(calibration.probe, name)
        if high > low:
            text, *ends = digits.between(value, low, high)
            rows.append((name, f"{text}{units[name]}", f"{' to '.join(ends)}{units[name]}"))
        else:
            rows.append((name, f"{value:g}{units[name]}", "not fitted"))
    return rows


def html(calibration: Calibration, specimens: Sequence[Specimen]) -> str:
    """Return the report as one HTML page without external files."""
    head, *rows = specimen_rows(specimens)
    about = ", ".join(f"{key}: {value}" for key, value in calibration.about.items())
    choices = (
        "Ratios of the touch with the smallest covariance P (the paper's choice), the smallest standard error, the one "
        "nearest to the mean, and the mean; spread from touch to touch. Last row: does the column rise with the modulus?"
    )
    return page.document(
        "palpate: calibration",
        element("h1", "Calibration of a probe"),
        element("p", element("b", calibration.verdict), class_="verdict"),
        fitted(calibration),
        page.section("Specimens", element("p", choices), page.table(dict(zip(head, _STYLES, strict=True)), rows)),
        element("p", f"palpate {calibration.version}; {about}", class_="quiet"),
        footer=f"palpate {calibration.version}, calibration",
    )


_STYLES = ["name", "", "", *[""] * len(RATIOS), ""]


def fitted(calibration: Calibration, seen: Sequence[Seen] = ()) -> Markup:
    """Return what a page says of a calibration: its picture, eq. (2), its parameters, its data and their distances.

    Parameters
    ----------
    calibration : Calibration
    seen : sequence of Seen
        Objects measured with it, for the picture.
    """
    low, high = calibration.range
    rings = " Rings: this session, with the 95 % interval of the modulus." if seen else ""
    caption = (
        f"Dots: the data of the fit. Band: 95 % of touches.{rings} Used from {low:g} to {high:g} MPa; outside, a modulus is "
        "beyond the specimens."
    )
    parameters = page.table({"Parameter": "n", "Value": "n", "95 % interval": "n"}, parameter_rows(calibration))
    return page.section(
        "Calibration",
        element("figure", picture(calibration, seen), element("figcaption", EQUATION, element("p", caption))),
        parameters,
        _distances(calibration),
    )


EQUATION = Markup(
    "Eq. (2): <i>E</i> = <i>E</i><sub>½</sub> (<i>r</i> \N{MINUS SIGN} <i>r</i><sub>0</sub>) / (<i>r</i><sub>∞</sub> \N{MINUS SIGN} <i>r</i>). "
    "<i>r</i>: ratio; <i>r</i><sub>∞</sub>: rigid_ratio; <i>E</i><sub>½</sub>: half_modulus; <i>r</i><sub>0</sub>: soft_ratio."
)


def _distances(calibration: Calibration) -> Markup:
    """Return the table of the data: each value of a specimen, their mean, and its distance from the curve."""
    rows = [
        (f"{r.modulus:g}", str(r.touches), digits.number(r.ratio, r.standard_error),
         digits.number(r.fitted, r.standard_error), percent(r), f"{r.standardised:+.1f}", _values(calibration, r.modulus))
        for r in calibration.residuals
    ]  # fmt: skip
    columns = {
        "MPa": "",
        "Touches": "",
        "Ratio": "",
        "Curve": "",
        "Distance, %": "",
        "In std. errors": "",
        "Values": "w",
    }
    return page.table(columns, rows)


def _values(calibration: Calibration, modulus: float) -> str:
    """Return the fitted values of a specimen, each to two digits of what it scatters by."""
    values = calibration.ratios[calibration.moduli == modulus].tolist()
    return ", ".join(digits.number(value, calibration.touch_spread * value) for value in values)
