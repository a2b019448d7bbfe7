"""Tables of a calibration: for the terminal, as JSON, and for a page."""

from collections.abc import Sequence
from math import isfinite, nan, sqrt
from typing import Any

from palpate import number_format
from palpate.calibration.model import Calibration
from palpate.calibration.specimen_fit import SpecimenTouches, rises
from palpate.repeatability import objections

# Columns of the table: the ratio of the touch with the smallest P (the paper's choice), and so on.
RATIOS = {
    "smallest P": "covariance",
    "smallest error": "standard_error",
    "nearest to mean": "agreement",
    "mean": "mean",
}


def specimen_records(specimens: Sequence[SpecimenTouches]) -> list[dict[str, Any]]:
    """Return a record for each specimen; a ratio is None if no touch is usable for it."""
    return [
        {
            "specimen": specimen.name,
            "modulus_MPa": specimen.modulus,
            "touches": len(specimen.touches),
            "usable": sum(
                not objections(touch, specimen.accept, specimen.ratio_of)
                for touch in specimen.touches
            ),
            **{name: _ratio(specimen, by) for name, by in RATIOS.items()},
            "spread": specimen.spread if isfinite(specimen.spread) else None,
        }
        for specimen in specimens
    ]


def _ratio(specimen: SpecimenTouches, by: str) -> float | None:
    try:
        return specimen.choose(by).ratio
    except ValueError:
        return None


def specimen_rows(specimens: Sequence[SpecimenTouches]) -> list[list[str]]:
    """Return the table of the specimens as text: a header, a row for each, and whether each column rises."""
    records = specimen_records(specimens)
    rows = [["specimen", "MPa", "touches", *RATIOS, "spread"]]
    for record in records:
        ratios = ["-" if record[name] is None else _text(record, name) for name in RATIOS]
        spread = (
            "-" if record["spread"] is None else f"{number_format.error(100 * record['spread'])} %"
        )
        rows.append(
            [
                record["specimen"],
                f"{record['modulus_MPa']:g}",
                str(record["touches"]),
                *ratios,
                spread,
            ]
        )
    columns = [[record[name] for record in records] for name in RATIOS]
    verdicts = ["-" if None in column else "yes" if rises(column) else "no" for column in columns]
    return [*rows, ["rises", "", "", *verdicts, ""]]


def _text(record: dict[str, Any], name: str) -> str:
    """Return a ratio to two digits of what it scatters by: a touch as the touches, a mean less."""
    scatter = (record["spread"] or nan) * abs(record[name])
    return number_format.number(
        record[name], scatter / sqrt(record["usable"]) if name == "mean" else scatter
    )


def parameter_rows(calibration: Calibration) -> list[tuple[str, str, str]]:
    """Return name, value and 95 % interval of each parameter as text."""
    units = {"rigid_ratio": "", "half_modulus": " MPa", "soft_ratio": ""}
    rows = []
    for name, (low, high) in calibration.parameter_intervals().items():
        value = getattr(calibration.probe, name)
        if high > low:
            text, *ends = number_format.between(value, low, high)
            rows.append((name, f"{text}{units[name]}", f"{' to '.join(ends)}{units[name]}"))
        else:
            rows.append((name, f"{value:g}{units[name]}", "not fitted"))
    return rows
