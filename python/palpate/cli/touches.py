"""Touches as rows of a table."""

import math
from typing import TYPE_CHECKING

from palpate import digits

if TYPE_CHECKING:
    from palpate import Touch

HEADER = "touch   start_s  samples     ratio  std. error  covariance  alarm  flags"


def row(number: int, touch: "Touch") -> str:
    """Return one touch as a line of the table; the numbers begin at 1."""
    error = touch.standard_error
    start = "-" if math.isnan(touch.start_s) else f"{touch.start_s:.3f}"
    return (
        f"{number:5} {start:>9} {touch.samples:8} {digits.number(touch.ratio, error):>9} {digits.error(error):>11} {touch.covariance:11.3g}"
        f" {touch.alarm_share:6.0%}  {' '.join(touch.flags)}".rstrip()
    )


def table(touches: "list[Touch]") -> str:
    """Return a header and a line for each touch; an empty text without touches."""
    lines = [HEADER, *(row(number, touch) for number, touch in enumerate(touches, 1))]
    return "\n".join(lines) + "\n" if touches else ""
