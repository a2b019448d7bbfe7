"""Touches as a table, as sentences, and as records of a JSON document; with moduli, or estimated afterwards."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from palpate import Touch, number_format
from palpate.cli.output import format_row
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from palpate.calibration import Modulus
    from palpate.offline_touches import OfflineTouch
    from palpate.recording.session import Entry

HEADER = (
    "touch",
    " start_s",
    "samples",
    "      ratio ± uncertainty",
    "covariance",
    "alarm",
    " result",
    "flags",
)
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


def row(number: int, touch: "Touch", known: Uncertainty) -> str:
    """Return one touch with its uncertainty as a line of the table; the numbers begin at 1.

    The result is the "first", known at the end of the touch, or "revised" with the baseline after the release; "-" in a
    scene that revises none.
    """
    result = "-" if not touch.effects else "revised" if touch.revised else "first"
    return _row(
        HEADER, number, touch, known, f"{touch.covariance:.3g}", f"{touch.alarm_share:.0%}", result
    )


def offline_row(number: int, touch: "OfflineTouch") -> str:
    """Return one touch with the live result beside."""
    return _row(OFFLINE_HEADER, number, touch, *_ratio(touch), *_ratio(touch.live))


def _row(header: Sequence[str], number: int, touch: "Touch | OfflineTouch", *more: object) -> str:
    start = "-" if math.isnan(touch.start_s) else f"{touch.start_s:.3f}"
    flags = f"{' '.join(touch.flags):{len('flags')}}"
    return format_row(header, [number, start, touch.samples, *more, flags])


def _ratio(touch: "Touch | OfflineTouch") -> tuple[str, str]:
    return number_format.number(touch.ratio, touch.standard_error), number_format.error(
        touch.standard_error
    )


def table(lines: Sequence[str], header: Sequence[str] = HEADER) -> list[str]:
    """Return lines with their header; none without lines."""
    return [format_row(header, header), *lines] if lines else []


def methods(touches: "Iterable[OfflineTouch]") -> list[str]:
    """Return a sentence for each method, with the numbers of its touches."""
    found: dict[str, list[str]] = {}
    for number, touch in enumerate(touches, 1):
        method = f"{touch.method}, baseline {touch.baselines}" if touch.baselines else touch.method
        found.setdefault(method, []).append(str(number))
    return [f"touch {', '.join(numbers)}: {method}" for method, numbers in found.items()]


def beside(lines: Sequence[str], column: Sequence[str]) -> list[str]:
    """Return lines of a table with one column more, which begins with its name."""
    width = max(map(len, lines), default=0)
    return [f"{line:{width}}  {cell}" for line, cell in zip(lines, column, strict=True)]


def specimen_of(entry: "Entry | None") -> str:
    """Return what was touched, and why a touch is left out."""
    name = (entry and entry.specimen) or "-"
    return f"{name}, left out: {entry.left_out}" if entry and entry.left_out else name


def advised(records: Iterable[Mapping[str, Any]], first: int = 1) -> list[str]:
    """Return a line for each flag of each touch, whose first one has this number: what it means, and what to do."""
    return [
        f"touch {number}: {each}"
        for number, touch in enumerate(records, first)
        for each in touch["advice"]
    ]


def records(
    touches: "Sequence[Touch]", uncertainties: Sequence[Uncertainty], *, cut: int = 0
) -> list[dict[str, Any]]:
    """Return touches for JSON: their fields, `advice`, a sentence for each flag, and their uncertainty.

    The last `cut` touches ran when the recording ended.
    """
    from palpate.flags import advice_at_end

    rows = []
    for touch, advice, known in zip(
        touches, advice_at_end(touches, cut=cut), uncertainties, strict=True
    ):
        texts = [str(each) for each in advice]
        rows.append({**touch.as_dict(), "advice": texts, **known.as_dict()})
    return rows


def modulus_cell(modulus: "Modulus") -> str:
    """Return a modulus with its interval; why it is not known, and whether it is beyond the calibration."""
    reason = f": {modulus.reason}" if modulus.reason else ""
    return f"{modulus}{reason}" + ", beyond the calibrated moduli" * modulus.extrapolated
