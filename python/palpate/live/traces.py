"""The course of the estimate in a completed touch, in few points."""

import numpy as np
from numpy.typing import NDArray

from palpate.live.feed import Flag, extremes
from palpate.live.levels import Levels
from palpate.live.protocol import ROWS

MOST = 160
"""Points of a course."""
_SLACK_S = 1e-6  # the times of rows and of touches are rounded


def trace_of(number: int, start_s: float, end_s: float, levels: Levels) -> dict[str, object]:
    """Return the course of a touch: at each time the ratio, its standard error and the statistic; lists.

    Parameters
    ----------
    number : int
        Of the touch.
    start_s, end_s : float
        Its first and last sample.
    levels : Levels
    """
    rows = levels.view(start_s, end_s, ROWS)
    inside = (rows["t_s"] >= start_s - _SLACK_S) & (rows["t_s"] <= end_s + _SLACK_S)
    rows = rows[inside & (rows["flags"] & int(Flag.MEASURED) != 0)]
    if len(rows) > MOST:
        rows = extremes(rows, np.arange(MOST // 2) * len(rows) // (MOST // 2))
    return {
        "touch": number,
        "t": _rounded(rows["t_s"] - start_s),
        "ratio": _rounded(rows["ratio"]),
        "error": _rounded(rows["standard_error"]),
        "statistic": _rounded(rows["statistic"]),
    }


def _rounded(values: NDArray[np.float64]) -> list[float]:
    return [float(f"{value:.7g}") for value in values.tolist()]
