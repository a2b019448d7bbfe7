"""Touches as rows of a table, as sentences, and as records of a JSON document."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from palpate import digits

if TYPE_CHECKING:
    from palpate import Touch
    from palpate.recording.session import Entry

HEADER = "touch   start_s  samples     ratio  std. error  covariance  alarm   result  flags"


def row(number: int, touch: "Touch") -> str:
    """Return one touch as a line of the table; the numbers begin at 1.

    The result is the "first", known at the end of the touch, or "revised" with the baseline after the release; "-" in a
    scene that revises none.
    """
    error = touch.standard_error
    start = "-" if math.isnan(touch.start_s) else f"{touch.start_s:.3f}"
    result = "-" if not touch.effects else "revised" if touch.revised else "first"
    return (
        f"{number:5} {start:>9} {touch.samples:8} {digits.number(touch.ratio, error):>9} {digits.error(error):>11}"
        f" {touch.covariance:11.3g} {touch.alarm_share:6.0%}  {result:>7}  {' '.join(touch.flags)}".rstrip()
    )


def table(touches: "list[Touch]") -> str:
    """Return a header and a line for each touch; an empty text without touches."""
    lines = [HEADER, *(row(number, touch) for number, touch in enumerate(touches, 1))]
    return "\n".join(lines) + "\n" if touches else ""


def with_specimens(table: str, entries: "Sequence[Entry | None]") -> str:
    """Return a table of touches with a column for what was touched, and why a touch is left out."""
    head, *rows = table.splitlines()
    width = max(len(line) for line in (head, *rows))
    told = [f"{row:{width}}  {_of(entry)}" for row, entry in zip(rows, entries, strict=True)]
    return "\n".join([f"{head:{width}}  specimen", *told]) + "\n"


def _of(entry: "Entry | None") -> str:
    name = (entry and entry.specimen) or "-"
    return f"{name}, left out: {entry.left_out}" if entry and entry.left_out else name


def advised(touches: "Sequence[Touch]", first: int = 1, *, cut: int = 0) -> str:
    """Return a line for each flag of each touch: what it means, and what to do.

    Parameters
    ----------
    touches : sequence of Touch
    first : int
        Number of the first one.
    cut : int
        How many of the last ones ran when the recording ended.
    """
    from palpate.sentences import advice_at_end

    whole = len(touches) - cut
    return "".join(
        f"touch {first + n}: {sentence}\n"
        for n, touch in enumerate(touches)
        for sentence in advice_at_end(touch, cut=n >= whole)
    )


def records(touches: "Sequence[Touch]", *, cut: int = 0) -> list[dict[str, Any]]:
    """Return touches for JSON: their fields, and `advice`, a sentence for each flag; `cut` as in `advised`."""
    from palpate.sentences import advice_at_end

    whole = len(touches) - cut
    return [{**touch.as_dict(), "advice": advice_at_end(touch, cut=n >= whole)} for n, touch in enumerate(touches)]


def notes(retaken: int) -> list[str]:
    """Return a note on how often the baseline was measured again; none for 0."""
    from palpate.samples import RETAKEN

    return [f"{RETAKEN} ({'once' if retaken == 1 else f'{retaken} times'})"] if retaken else []
