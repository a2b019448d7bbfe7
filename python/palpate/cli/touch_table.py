"""Touches as rows of a table, as sentences, and as records of a JSON document."""

import math
from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING

from palpate import Touch, number_format
from palpate.cli.output import format_row
from palpate.flags import Flag, advice_at_end
from palpate.tracking import Touches
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from palpate.calibration import Modulus
    from palpate.offline_touches import OfflineTouch
    from palpate.recording.session import Entry

HEADER = (
    "touch",
    " start_s",
    "samples",
    "ratio ± uncertainty (k=1)",
    "covariance",
    "alarm",
    " result",
    "flags",
)
CALIBRATED_HEADER = ("touch", " start_s", "samples", "ratio ± (k=1)", "flags")
"""Beside a modulus: with it and a specimen the table has 80 columns; --json has the other values."""
OFFLINE_HEADER = (
    "touch",
    " start_s",
    "samples",
    "   ratio",
    "std. error",
    "     live",
    "std. error",
    "flags",
)


def touch_row(number: int, touch: Touch, uncertainty: Uncertainty) -> str:
    """Return one touch with its uncertainty as a line of the table; the numbers begin at 1.

    The result is "first", at the end of the touch, or "revised", with the baseline after the
    release; "-" in a scene that revises none.
    """
    if not touch.effects:
        result = "-"
    elif touch.revised:
        result = "revised"
    else:
        result = "first"
    covariance = f"{touch.covariance:.3g}"
    alarm = f"{touch.alarm_share:.0%}"
    return _row(HEADER, number, touch, [uncertainty, covariance, alarm, result])


def calibrated_row(number: int, touch: Touch, uncertainty: Uncertainty) -> str:
    """Return one touch as a line of the table with moduli: the scatter is the calibration's."""
    ratio = number_format.number(uncertainty.ratio)
    if number_format.is_known(uncertainty.uncertainty):
        ratio = number_format.plus_minus(uncertainty.ratio, uncertainty.uncertainty)
    return _row(CALIBRATED_HEADER, number, touch, [ratio])


def offline_row(number: int, touch: "OfflineTouch") -> str:
    """Return one touch that was estimated offline, with the live result."""
    return _row(OFFLINE_HEADER, number, touch, [*_ratio_cells(touch), *_ratio_cells(touch.live)])


def _row(
    header: Sequence[str], number: int, touch: "Touch | OfflineTouch", cells: Iterable[object]
) -> str:
    start = "-" if math.isnan(touch.start_s) else f"{touch.start_s:.3f}"
    flags = f"{' '.join(touch.flags):{len('flags')}}"
    return format_row(header, [number, start, touch.samples, *cells, flags])


def _ratio_cells(touch: "Touch | OfflineTouch") -> list[str]:
    error = touch.standard_error
    return [number_format.number(touch.ratio, error), number_format.error(error)]


def with_header(rows: Iterable[str], header: Sequence[str] = HEADER) -> list[str]:
    """Return rows below their header; no header without rows."""
    lines = [format_row(header, header), *rows]
    return lines if len(lines) > 1 else []


def add_column(lines: Sequence[str], column: Sequence[str]) -> list[str]:
    """Return the lines of a table with one more column, which begins with its name."""
    width = max(map(len, lines), default=0)
    return [f"{line:{width}}  {cell}" for line, cell in zip(lines, column, strict=True)]


def specimen_cell(entry: "Entry | None") -> str:
    """Return the specimen of a touch, and why the touch is left out."""
    if entry is None:
        return "-"
    name = entry.specimen or "-"
    return f"{name}, left out: {entry.left_out}" if entry.left_out else name


def modulus_cell(modulus: "Modulus") -> str:
    """Return a modulus with its interval, why there is none, and whether it is extrapolated."""
    cell = str(modulus)
    if modulus.reason:
        cell += f": {modulus.reason}"
    if modulus.extrapolated:
        cell += ", beyond the calibrated moduli"
    return cell


def offline_methods(touches: "Iterable[OfflineTouch]") -> list[str]:
    """Return a sentence for each method, with the numbers of its touches."""
    numbers: dict[str, list[str]] = {}
    for number, touch in enumerate(touches, 1):
        method = touch.method
        if touch.baselines:
            method += f", baseline {touch.baselines}"
        numbers.setdefault(method, []).append(str(number))
    return [f"touch {', '.join(which)}: {method}" for method, which in numbers.items()]


def touch_records(
    touches: Sequence[Touch], uncertainties: Sequence[Uncertainty], *, cut: int = 0
) -> list[dict[str, object]]:
    """Return touches for JSON: their fields, their advice, and their uncertainty.

    The last `cut` touches were running when the recording ended.
    """
    records = []
    advice = advice_at_end(touches, cut=cut)
    for touch, own_advice, uncertainty in zip(touches, advice, uncertainties, strict=True):
        sentences = list(map(str, own_advice))
        records.append({**touch.as_dict(), "advice": sentences, **uncertainty.as_dict()})
    return records


def advice_lines(touches: Sequence[Touch], *, first: int = 1, cut: int = 0) -> list[str]:
    """Return a line for each flag of each touch: what it means, and what to do.

    The touches are numbered from `first`; the last `cut` were running when the recording ended.
    What a note on all of them explains is left out: see `Touches.soft_later_s`.
    """
    explained: Collection[object] = ()
    if isinstance(touches, Touches) and touches.soft_later_s:
        explained = (Flag.OFFSET, Flag.LAG, Flag.CURVE)
    lines = []
    for number, advice in enumerate(advice_at_end(touches, cut=cut), first):
        lines += [f"touch {number}: {each}" for each in advice if each.flag not in explained]
    return lines
