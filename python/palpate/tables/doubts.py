"""What in the values of a channel looks wrong."""

import math

import numpy as np
from numpy.typing import NDArray

FEWEST = 20  # readings at the end of a range that are no chance
PILE = 5  # times as many as have the next values
SAME = 3  # equal readings that are no chance
_MOST = 0.2  # of the readings: a channel that rests at a value has it more often
APART = 5  # standard deviations of the other readings
MOVED = 0.05  # of its range: a channel that changes
TAIL = 0.005  # of the other readings at each end: single wrong ones

Array = NDArray[np.float64]


def absent(name: str, values: Array) -> tuple[Array, list[str]]:
    """Return the values without those that a logger writes for "no value", as 0 and -999: nan; and notes.

    Such readings are exactly equal, and far from all others.

    Examples
    --------
    >>> values, [note] = absent("hard", np.r_[np.linspace(8, 9, 400), np.zeros(12)])
    >>> int(np.isnan(values).sum()), note
    (12, 'hard: 12 readings are exactly 0, far from all others (8 to 9): taken as no value')
    >>> absent("hard", np.r_[np.linspace(0, 9, 400), np.zeros(12)])[1]
    []
    """
    kept, found = values, list[tuple[float, int]]()
    while (end := _lonely_end(kept)) is not None:
        same = kept == end
        found.append((end, int(same.sum())))
        kept = np.where(same, math.nan, kept)
    if not found:
        return values, []
    others = f"{np.nanmin(kept):.4g} to {np.nanmax(kept):.4g}"
    return kept, [
        f"{name}: {count} readings are exactly {value:.6g}, far from all others ({others}): taken as no value"
        for value, count in found
    ]


def _lonely_end(values: Array) -> float | None:
    """Return the smallest or the largest value, the one that is farther from the others, if it is far from them."""
    finite = _finite(values)
    ends = (float(finite.min()), float(finite.max())) if len(finite) else ()
    often = [end for end in ends if SAME <= np.count_nonzero(finite == end) <= _MOST * len(finite)]
    for end in sorted(often, key=lambda each: -abs(each - float(np.median(finite)))):
        others = finite[finite != end]
        if len(others) >= FEWEST:
            low, high = np.quantile(others, [TAIL, 1 - TAIL])
            spread = float(np.std(np.clip(others, low, high)))
            if spread > 0 and np.abs(others - end).min() > APART * spread:
                return end
    return None


def _finite(values: Array) -> Array:
    finite = np.isfinite(values)
    return values if finite.all() else values[finite]


def clipped(name: str, values: Array) -> list[str]:
    """Return a note if many readings have exactly the largest, or the smallest, value.

    Examples
    --------
    >>> clipped("hard", np.r_[np.linspace(0, 8, 400), np.full(30, 8.192)])
    ['hard: 30 readings have exactly the largest value, 8.192: is the channel clipped there?']
    >>> clipped("hard", np.linspace(0, 8, 400))
    []
    """
    finite = _finite(values)
    if not len(finite) or max(np.count_nonzero(finite == end) for end in (finite.min(), finite.max())) < FEWEST:
        return []
    found, counts = np.unique(finite, return_counts=True)
    if len(found) < FEWEST:
        return []
    notes = []
    for side, at, near in (("largest", -1, slice(-6, -1)), ("smallest", 0, slice(1, 6))):
        if counts[at] >= FEWEST and counts[at] > PILE * counts[near].max():
            notes.append(
                f"{name}: {counts[at]} readings have exactly the {side} value, {found[at]:.6g}: is the channel clipped there?"
            )
    return notes


def frozen(name: str, values: Array, other: Array) -> list[str]:
    """Return a note if a channel has the same reading for long while the other channel changes, not at an end of its range.

    Examples
    --------
    >>> rising = np.linspace(6, 9, 430)
    >>> frozen("soft", np.r_[np.linspace(4, 5, 400), np.full(30, 4.5)], rising)
    ['soft: rows 401 to 430 of the samples have exactly 4.5, while the other channel changes: is the channel frozen there?']
    >>> frozen("soft", np.round(np.linspace(4, 5, 430), 1), rising)
    []
    """
    few = (values[1:] == values[:-1])[:: FEWEST // 3]
    if not (few[2:] & few[1:-1] & few[:-2]).any():
        return []
    edges = np.r_[-1, np.flatnonzero(values[1:] != values[:-1]), len(values) - 1]  # nan differs from all
    lengths = np.diff(edges)
    at = int(np.argmax(lengths)) if len(values) else 0
    if not len(values) or lengths[at] < FEWEST or np.isnan(other).all():
        return []
    first, end = int(edges[at]) + 1, int(edges[at + 1]) + 1
    coarse = len(values) - lengths[at] > 2 * (len(lengths) - 1)  # elsewhere, too, most readings equal the one before
    meanwhile = other[first:end]
    moved = np.nanmax(meanwhile) - np.nanmin(meanwhile) if not np.isnan(meanwhile).all() else 0.0
    still = moved <= MOVED * (np.nanmax(other) - np.nanmin(other))
    if coarse or still or values[first] in (np.nanmin(values), np.nanmax(values)):
        return []
    said = f"{name}: rows {first + 1} to {end} of the samples have exactly {values[first]:.6g}, while the other channel changes"
    return [f"{said}: is the channel frozen there?"]
