"""Two channels with their own times, joined to pairs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.tables.times.steps import typical_step
from palpate.tables.times.times import Times

Floats = NDArray[np.float64]
Indices = NDArray[np.intp]

_TIE = 1e-6  # of a period: order of readings with equal stamps
_STEADY = 0.5  # of 1: the channels have a steady distance in time


@dataclass(frozen=True, eq=False)
class Pairs:
    """Readings of both channels, pair by pair, with the true times of each.

    Attributes
    ----------
    t_hard_s, t_soft_s, hard, soft : numpy.ndarray, shape (n,)
    notes : list of str
        How many readings have none of the other channel near in time.
    """

    t_hard_s: Floats
    t_soft_s: Floats
    hard: Floats
    soft: Floats
    notes: list[str]


def joined(t_hard: Times, hard: Floats, t_soft: Times, soft: Floats) -> Pairs:
    """Join the readings of two channels: each with the nearest one of the other channel, and once only.

    A steady distance in time between the channels, as that of a converter that reads them in turn, is not counted for the
    nearest one. A channel with twice the rate loses every second reading.

    Parameters
    ----------
    t_hard, t_soft : Times
        Of n and m readings, in the order of time except for jitter.
    hard, soft : numpy.ndarray, shapes (n,) and (m,)

    Returns
    -------
    Pairs
        In the order of the hard channel's time; none is further apart than half a period, plus that distance.

    Raises
    ------
    ValueError
        The times do not overlap, or one channel has dates and the other has none.
    """
    t_soft = t_soft.since(t_hard)
    hard_s, soft_s = t_hard.seconds, t_soft.seconds
    by_hard, by_soft = (np.argsort(seconds, kind="stable") for seconds in (hard_s, soft_s))
    in_hard, in_soft = partners(hard_s[by_hard], soft_s[by_soft])
    if not len(in_hard):
        raise ValueError(
            f"time: got {t_hard.described} for the hard and {t_soft.described} for the soft channel, "
            "allowed: times that overlap, of one clock"
        )
    left = len(hard_s) - len(in_hard), len(soft_s) - len(in_soft)
    counts = f"{left[0]} of {len(hard_s)} hard and {left[1]} of {len(soft_s)} soft readings"
    notes = [f"{counts} have none of the other channel near in time: left out"]
    at_hard, at_soft = by_hard[in_hard], by_soft[in_soft]
    return Pairs(hard_s[at_hard], soft_s[at_soft], hard[at_hard], soft[at_soft], notes if any(left) else [])


def partners(hard_s: Floats, soft_s: Floats) -> tuple[Indices, Indices]:
    """Return the positions of the pairs in two ascending sequences of times.

    Examples
    --------
    >>> hard, soft = partners(np.array([0.0, 1, 2, 3]), np.array([0.4, 1.4, 3.4]))
    >>> hard.tolist(), soft.tolist()
    ([0, 1, 3], [0, 1, 2])
    """
    if not (len(hard_s) and len(soft_s)):
        return np.empty(0, np.intp), np.empty(0, np.intp)
    steps = [step for step in (typical_step(hard_s), typical_step(soft_s)) if step]
    offset = _distance(hard_s, soft_s, min(steps)) if steps else 0.0
    tie = _TIE * min(steps, default=1.0)
    return _nearest(_spread(hard_s, tie), _spread(soft_s, tie) - offset, max(steps, default=0.0) / 2)


def _distance(hard_s: Floats, soft_s: Floats, period: float) -> float:
    """Return the steady distance from the hard to the soft readings, above -period / 2 and at most that; 0 if it drifts.

    The distances to the next reading, as angles of a circle of one period: their sum is long if they are the same.
    """
    few, many, sign = (hard_s, soft_s, 1) if len(hard_s) <= len(soft_s) else (soft_s, hard_s, -1)
    following = np.searchsorted(many, few)
    inside = following < len(many)
    turns = (many[following[inside]] - few[inside]) / period
    direction = np.exp(2j * np.pi * turns[turns < 1]).mean() if (turns < 1).any() else 0j
    part = float(np.angle(direction)) / (2 * np.pi) * sign
    return (0.5 if part <= -0.5 else part) * period if abs(direction) > _STEADY else 0.0


def _spread(times: Floats, tie: float) -> Floats:
    """Return ascending times of which equal ones are this much apart, in their order."""
    begins = np.r_[True, np.diff(times) > 0]
    first = np.maximum.accumulate(np.where(begins, np.arange(len(times)), 0))
    return times + (np.arange(len(times)) - first) * tie


def _nearest(hard_s: Floats, soft_s: Floats, most: float) -> tuple[Indices, Indices]:
    """Return the pairs that are each other's nearest, not further apart than `most`."""
    to_soft, to_hard = _nearest_in(soft_s, hard_s), _nearest_in(hard_s, soft_s)
    each = np.arange(len(hard_s))
    mutual = (to_hard[to_soft] == each) & (np.abs(soft_s[to_soft] - hard_s) <= most)
    return each[mutual], to_soft[mutual]


def _nearest_in(times: Floats, wanted: Floats) -> Indices:
    """Return the position of the time that is nearest to each wanted one; the earlier of two at the same distance."""
    after = np.clip(np.searchsorted(times, wanted), 1, max(len(times) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(times) - 1)
    return np.where(times[after] - wanted < wanted - times[before], after, before)
