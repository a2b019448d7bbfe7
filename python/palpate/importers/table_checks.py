"""Remarks about a table that was understood: its rate, and what looks wrong in its times and values."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_PACE = 5.0, 2000.0  # pairs a second of a probe
_SHOWN_PACE = 50  # rows that show it
_FEWEST = 20  # equal readings that are no chance, at an end of a range or in a row
_PILE = 5  # times as many as have the next values
_MOVED = 0.01  # of its range: a channel that changes; one at rest moves by a thousandth
_SAME = 3  # readings of a code that are no chance
_OFF_GRID, _ON_GRID = 0.1, 2 / 3  # of a step; of the steps, for a grid
_HOLE = 20  # steps; a longer one is a pause
_CODES = (0.0, -1.0, -9.0, -99.0, -999.0, -9999.0, 999.0, 9999.0, 99999.0)
_MOST = 0.2  # of the readings: a channel that rests at a value has it more often
_WINDOW = 256  # rows; longer than the bursts of a USB or serial port, shorter than a file
_SOME = 4096  # windows that show the step of all
_LEAST = 1e-30  # of any unit; smaller steps are none
_TAIL = 0.005  # of the other readings at each end: single wrong ones


def pace(rate: float) -> str:
    """Return the pairs a second as text."""
    return f"{rate:.4g} pairs a second" if rate else "rate unknown"


def typical_step(times: Array) -> float:
    """Return the median step over windows of rows, robust to bursts, gaps and equal stamps; 0 if no time is later."""
    rows = len(times)
    window = max(2, min(_WINDOW, (rows - 1) // 4)) if rows > 2 else 1
    every = max(1, rows // _SOME)
    steps = times[window::every] - times[:-window:every]
    later = steps[steps > _LEAST]
    return float(np.median(later)) / window if len(later) else 0.0


def rate_of(t: Array) -> float:
    """Return the pairs a second of some times, s, without the gaps; 0: unknown."""
    steps = np.diff(t)
    usual = steps[(steps > 0) & (steps <= 10 * typical_step(t))]
    return (len(t) - 1) / np.count_nonzero(steps > 0) / float(usual.mean()) if len(usual) else 0.0


def remarks(time_s: Array, soft_s: Array, hard: Array, soft: Array, rate: float) -> list[str]:
    """Return notes on times and missing values of two channels; `rate` is `rate_of` the times."""
    rows = len(hard)
    unusual = rate > 0 and rows >= _SHOWN_PACE and not _PACE[0] <= rate <= _PACE[1]
    missing = np.count_nonzero(~(np.isfinite(hard) & np.isfinite(soft)))
    back = np.count_nonzero(time_s[1:] < time_s[:-1])
    same = np.count_nonzero((time_s[1:] == time_s[:-1]) & (soft_s[1:] == soft_s[:-1]))
    untimed = rows > 0 and np.isnan(time_s).all()
    found = {
        f"{pace(rate)} are unusual for a probe: is the unit of the times right (--time-unit)?": unusual,
        f"{missing} of {rows} rows have no value in a channel: left out": missing,
        f"time goes back at {back} of {rows} rows: the order of the file is used": back,
        f"{same} of {rows} rows have the time of the row before: repeated, or several that came at once?": same,
        "no column of times found: start_s is unknown, pairs are taken for 26 ms apart; name it with time=COL, or give the rate (--rate)": untimed,
    }
    return [note for note, is_so in found.items() if is_so]


def lost(t: Array) -> list[str]:
    """Return a note if rows of an even grid of times, s, are missing."""
    steps = np.diff(t)
    step = float(np.median(steps)) if len(steps) >= _FEWEST else 0.0
    if not step > 0 or steps.max() < 1.5 * step:  # none is two
        return []
    times = steps / step
    count = np.rint(times)
    on_grid = np.abs(times - count) < _OFF_GRID
    missing = int(
        (count[on_grid & (count <= _HOLE)] - 1).sum()
    )  # one that comes late, and the next at once, is not
    if missing <= 0 or np.count_nonzero(on_grid & (count == 1)) < _ON_GRID * len(steps):
        return []
    return [
        f"{missing} of {len(t) + missing} rows are missing: the others are {1000 * step:.4g} ms apart"
    ]


def absent(name: str, values: Array) -> tuple[Array, list[str]]:
    """Return the values with nan for codes of "no value", as 0 and -999, equal and far from all other readings; and notes."""
    notes = []
    least, most = np.nanmin(values, initial=np.inf), np.nanmax(values, initial=-np.inf)
    for code in (each for each in _CODES if least <= each <= most):
        same = values == code
        count = np.count_nonzero(same)
        others = (
            values[np.isfinite(values) & ~same]
            if _SAME <= count <= _MOST * len(values)
            else np.empty(0)
        )
        if len(others) < _FEWEST or np.abs(others - code).min() <= np.ptp(
            np.quantile(others, [_TAIL, 1 - _TAIL])
        ):
            continue
        said = f"{count} readings are exactly {code:.6g}, far from all other readings"
        notes.append(
            f"{name}: {said} ({others.min():.4g} to {others.max():.4g}): taken as no value"
        )
        values = np.where(same, np.nan, values)
    return values, notes


def clipped(name: str, values: Array) -> list[str]:
    """Return a note if many readings have exactly the largest, or the smallest, value."""
    ends, notes = (
        {
            "largest": np.nanmax(values, initial=-np.inf),
            "smallest": np.nanmin(values, initial=np.inf),
        },
        [],
    )
    for side, end in ends.items():
        if np.count_nonzero(values == end) >= _FEWEST:
            counts = np.unique(np.abs(values[np.isfinite(values)] - end), return_counts=True)[1]
            if len(counts) >= _FEWEST and counts[0] > _PILE * counts[1:].max():
                said = f"{counts[0]} readings have exactly the {side} value, {end:.6g}"
                notes.append(f"{name}: {said}: is the channel clipped there?")
    return notes


def frozen(name: str, values: Array, other: Array) -> list[str]:
    """Return a note if a channel has the same reading for long while the other one moves, not at an end of its range."""
    some = values[:: _FEWEST // 4]  # any run of _FEWEST readings has four of them
    same = some[1:] == some[:-1]
    if not (same[2:] & same[1:-1] & same[:-2]).any():
        return []
    differs = values[1:] != values[:-1]  # nan differs from all
    edges = np.r_[0, np.flatnonzero(differs) + 1, len(values)]
    at = int(np.argmax(np.diff(edges)))
    first, end = edges[at : at + 2]
    runs, rest = len(edges) - 2, len(values) - (end - first)
    moves = _span(other[first:end]) > _MOVED * _span(other)
    is_coarse = rest > 2 * runs  # elsewhere, too, most readings equal the one before
    if (
        end - first < _FEWEST
        or is_coarse
        or not moves
        or values[first] in (np.nanmin(values), np.nanmax(values))
    ):
        return []
    said = f"rows {first + 1} to {end} of the samples have exactly {values[first]:.6g}, while the other channel changes"
    return [f"{name}: {said}: is the channel frozen there?"]


def _span(values: Array) -> float:
    return float(np.nanmax(values, initial=-np.inf) - np.nanmin(values, initial=np.inf))
