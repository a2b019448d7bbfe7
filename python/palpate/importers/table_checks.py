"""The rate of a table whose channels were found, and notes on what looks wrong in it."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_USUAL_RATES = (5.0, 2000.0)  # pairs a second of a probe
_ROWS_OF_A_RATE = 50  # fewer do not show an unusual rate
_LONG_RUN = 20  # equal readings, in a row or at an end of a range, that are no coincidence
# A value at an end of the range is clipped if it is this many times as frequent as any other.
_PILE = 5
_MOVES = 0.01  # of its range, for a channel that changes; at rest it moves by a thousandth
_NO_VALUE_CODES = (0.0, -1.0, -9.0, -99.0, -999.0, -9999.0, 999.0, 9999.0, 99999.0)
_FEWEST_CODES = 3  # readings of a code that are no coincidence
_LARGEST_SHARE = 0.2  # of the readings: a channel that rests at a value has it more often
_TAIL = 0.005  # of the other readings, at each end: single wrong ones
_OFF_GRID = 0.1  # of a step
_ON_GRID = 2 / 3  # of the steps
_PAUSE = 20  # steps
_WINDOW = 256  # rows: longer than the bursts of a USB or serial port, shorter than a file
_WINDOWS = 4096  # that show the step of all
_SMALLEST_STEP = 1e-30  # of any unit; smaller ones are none


def rate_text(rate: float) -> str:
    """Return the pairs a second as text; 0 is unknown."""
    if not rate:
        return "rate unknown"
    return f"{rate:.4g} pairs a second"


def typical_step(times: Array) -> float:
    """Return the median step over windows of rows; 0 if no time is later than another one.

    Bursts, gaps and equal stamps do not change it.
    """
    rows = len(times)
    window = 1
    if rows > 2:
        window = max(2, min(_WINDOW, (rows - 1) // 4))
    every = max(1, rows // _WINDOWS)
    steps = times[window::every] - times[:-window:every]
    later = steps[steps > _SMALLEST_STEP]
    if not len(later):
        return 0.0
    return float(np.median(later)) / window


def rate_of(times: Array) -> float:
    """Return the pairs a second of some times, s, without the gaps; 0 if unknown."""
    steps = np.diff(times)
    forward = steps > 0
    usual = steps[forward & (steps <= 10 * typical_step(times))]
    if not len(usual):
        return 0.0
    return (len(times) - 1) / np.count_nonzero(forward) / float(usual.mean())


def channel_notes(
    t_hard_s: Array, t_soft_s: Array, hard: Array, soft: Array, rate: float
) -> list[str]:
    """Return notes on the times and missing values of two channels; `rate` comes from `rate_of`."""
    rows = len(hard)
    slowest, fastest = _USUAL_RATES
    notes = []
    if rate > 0 and rows >= _ROWS_OF_A_RATE and not slowest <= rate <= fastest:
        question = "is the unit of the times right (--time-unit)?"
        notes.append(f"{rate_text(rate)} are unusual for a probe: {question}")
    missing = np.count_nonzero(~(np.isfinite(hard) & np.isfinite(soft)))
    if missing:
        notes.append(f"{missing} of {rows} rows have no value in a channel: left out")
    backward = np.count_nonzero(t_hard_s[1:] < t_hard_s[:-1])
    if backward:
        order = "the order of the file is used"
        notes.append(f"time goes back at {backward} of {rows} rows: {order}")
    equal = (t_hard_s[1:] == t_hard_s[:-1]) & (t_soft_s[1:] == t_soft_s[:-1])
    same = np.count_nonzero(equal)
    if same:
        question = "repeated, or several that came at once?"
        notes.append(f"{same} of {rows} rows have the time of the row before: {question}")
    if rows and np.isnan(t_hard_s).all():
        unknown = "start_s is unknown, pairs are taken for 26 ms apart"
        advice = "name it with time=COL, or give the rate (--rate)"
        notes.append(f"no column of times found: {unknown}; {advice}")
    return notes


def missing_rows(times: Array) -> list[str]:
    """Return a note if rows of an even grid of times, s, are missing."""
    steps = np.diff(times)
    if len(steps) < _LONG_RUN:
        return []
    step = float(np.median(steps))
    if not step > 0 or steps.max() < 1.5 * step:
        return []
    in_steps = steps / step
    count = np.rint(in_steps)
    on_grid = np.abs(in_steps - count) < _OFF_GRID
    # A row that comes late, and the next one early, add a count of 2 and one of 0.
    missing = int((count[on_grid & (count <= _PAUSE)] - 1).sum())
    even = np.count_nonzero(on_grid & (count == 1)) >= _ON_GRID * len(steps)
    if missing <= 0 or not even:
        return []
    apart = f"the others are {1000 * step:.4g} ms apart"
    return [f"{missing} of {len(times) + missing} rows are missing: {apart}"]


def without_codes(name: str, values: Array) -> tuple[Array, list[str]]:
    """Return the values with nan for codes of "no value", as 0 and -999, and notes on them.

    Such a code occurs several times, and is far from all other readings.
    """
    notes = []
    smallest, largest = _ends(values)
    for code in _NO_VALUE_CODES:
        if not smallest <= code <= largest:
            continue
        same = values == code
        count = np.count_nonzero(same)
        if not _FEWEST_CODES <= count <= _LARGEST_SHARE * len(values):
            continue
        others = values[np.isfinite(values) & ~same]
        if len(others) < _LONG_RUN:
            continue
        usual_range = np.ptp(np.quantile(others, [_TAIL, 1 - _TAIL]))
        if np.abs(others - code).min() <= usual_range:
            continue
        found = f"{count} readings are exactly {code:g}, far from all other readings"
        span = f"{others.min():.4g} to {others.max():.4g}"
        notes.append(f"{name}: {found} ({span}): taken as no value")
        values = np.where(same, np.nan, values)
    return values, notes


def clipped(name: str, values: Array) -> list[str]:
    """Return notes if many readings have exactly the largest, or the smallest, value."""
    smallest, largest = _ends(values)
    notes = []
    for side, end in (("largest", largest), ("smallest", smallest)):
        if np.count_nonzero(values == end) < _LONG_RUN:
            continue
        distances = np.abs(values[np.isfinite(values)] - end)
        counts = np.unique(distances, return_counts=True)[1]
        if len(counts) >= _LONG_RUN and counts[0] > _PILE * counts[1:].max():
            found = f"{counts[0]} readings have exactly the {side} value, {end:.6g}"
            notes.append(f"{name}: {found}: is the channel clipped there?")
    return notes


def frozen(name: str, values: Array, other: Array) -> list[str]:
    """Return a note if a channel keeps one reading while the other channel moves.

    A reading at an end of its range is `clipped`.
    """
    some = values[:: _LONG_RUN // 4]  # any run of _LONG_RUN readings has four of them
    same = some[1:] == some[:-1]
    if not (same[2:] & same[1:-1] & same[:-2]).any():
        return []
    changes = np.flatnonzero(values[1:] != values[:-1]) + 1  # nan differs from all
    edges = np.r_[0, changes, len(values)]
    longest = int(np.argmax(np.diff(edges)))
    first = edges[longest]
    end = edges[longest + 1]
    if end - first < _LONG_RUN:
        return []
    rows_elsewhere = len(values) - (end - first)
    runs_elsewhere = len(edges) - 2
    if rows_elsewhere > 2 * runs_elsewhere:  # there, too, most readings equal the one before
        return []
    if not _span(other[first:end]) > _MOVES * _span(other):
        return []
    if values[first] in _ends(values):
        return []
    rows = f"rows {first + 1} to {end} of the samples have exactly {values[first]:.6g}"
    question = "while the other channel changes: is the channel frozen there?"
    return [f"{name}: {rows}, {question}"]


def _ends(values: Array) -> tuple[float, float]:
    """Return the smallest and the largest value; inf and -inf if there is none."""
    smallest = float(np.nanmin(values, initial=np.inf))
    largest = float(np.nanmax(values, initial=-np.inf))
    return smallest, largest


def _span(values: Array) -> float:
    smallest, largest = _ends(values)
    return largest - smallest
