"""Touches as rows of a table."""

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from palpate import Touch

HEADER = "touch   start_s  samples     ratio  std. error  covariance  alarm  flags"


def row(number: int, touch: "Touch") -> str:
    """Return one touch as a line of the table; the numbers begin at 1."""
    start = "-" if math.isnan(touch.start_s) else f"{touch.start_s:.3f}"
    error = "-" if math.isnan(touch.standard_error) else f"{touch.standard_error:.2g}"
    return (
        f"{number:5} {start:>9} {touch.samples:8} {touch.ratio:9.4f} {error:>11} {touch.covariance:11.3g}"
        f" {touch.alarm_share:6.0%}  {' '.join(touch.flags)}".rstrip()
    )


def table(touches: "list[Touch]") -> str:
    """Return a header and a line for each touch; an empty text without touches."""
    lines = [HEADER, *(row(number, touch) for number, touch in enumerate(touches, 1))]
    return "\n".join(lines) + "\n" if touches else ""
