"""Reference of the alignment: both channels on an even grid, filtered with the same response."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
_Reading = tuple[int, float]
"""Its time, ns, and its value, pF."""

PATIENCE = 8  # windows that do not fit a grid until they are interpolated
SLOWEST_NS = 40_000_000  # longest period of matched filters; they stay the same above it
SLOW_NS = 1_000_000_000 // 31  # above this period not all of a tremor's rest cancels
ALIASES_NS = 1_000_000_000 // 12  # above this one a tremor may look like a rest
FAST, SLOW, ALIASES = range(3)
LARGEST_GAP_NS = 1_000_000_000  # longest time between two soft readings for a pair
AVERAGED_NS = (
    25_000_000  # of a fast converter's readings: of one with a mean step below a third of this
)
STEPS = 32  # memory of this mean


class Pairs(NamedTuple):
    """Both channels at one time, for each reading, as arrays of shape (n,).

    Attributes
    ----------
    hard, soft : numpy.ndarray, shape (n,), pF
        nan where there is no pair.
    valid, matched : numpy.ndarray of bool, shape (n,)
        Whether there is a pair; whether both channels of it have the same response.
    pace : numpy.ndarray of int, shape (n,)
        How slow the pairs are: FAST, SLOW or ALIASES.

    Examples
    --------
    >>> matched_pair([0, 26, 52], [13, 39, 65], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]).valid
    array([False, False, False])
    """

    hard: Array
    soft: Array
    valid: NDArray[np.bool_]
    matched: NDArray[np.bool_]
    pace: NDArray[np.int64]


class Reading(NamedTuple):
    """A reading of each channel and the pair that is complete with it, or the means of many.

    Attributes
    ----------
    time : int, ns
        Of the hard channel.
    hard, soft : float, pF
    pair : tuple of (float, float, bool, bool)
        A row of `Pairs`, without its last number.
    size : int
        Number of readings of which it is the mean; 0: the mean is not complete.
    together : bool
        Both channels are read at once, so that the pair has the whole noise of the readings.
    pace : int
        As in `Pairs`.

    Examples
    --------
    >>> Reading(0, 1.0, 0.4, (1.0, 0.4, True, True)).size
    1
    """

    time: int
    hard: float
    soft: float
    pair: tuple[float, float, bool, bool]
    size: int = 1
    together: bool = False
    pace: int = FAST


def means(
    t_hard: ArrayLike,
    t_soft: ArrayLike,
    hard: ArrayLike,
    soft: ArrayLike,
    *,
    at_end: ArrayLike = False,
) -> list[Reading]:
    """Align both channels, and average those of a fast converter: reference of what comes first in the scene "handheld".

    Parameters
    ----------
    t_hard, t_soft, hard, soft : array_like, shape (n,)
        As of `matched_pair`.
    at_end : array_like of bool, shape (n,)
        Readings that are no values of a pair, as one is at the end of its range; they still show a
        contact.

    Returns
    -------
    list of Reading
        For each reading itself, or the mean of those before it.

    Examples
    --------
    >>> t = 1_000_000 * np.arange(60)
    >>> [made.size for made in means(t, t, np.zeros(60), np.zeros(60)) if made.size]
    [1, 1, 1, 1, 1, 1, 1, 23, 24]
    """
    times = np.asarray(t_hard)
    values = np.column_stack([np.asarray(hard, float), np.asarray(soft, float)])
    finite = np.isfinite(values).all(axis=1)
    whole = finite & ~np.asarray(at_end, bool)
    paces = _paces(times, whole)
    values[[bool(pace) and not there for pace, there in zip(paces, finite, strict=True)]] = np.nan
    usable = np.where(np.broadcast_to(at_end, times.shape)[:, None], np.nan, values)
    *columns, slowness = (column.tolist() for column in matched_pair(times, t_soft, *usable.T))
    pairs = zip(*columns, strict=True)
    made: list[Reading] = []
    block: list[Reading] = []  # of the mean that is not complete
    size = 1
    both = times == np.asarray(t_soft)
    rows = zip(times.tolist(), *values.T.tolist(), pairs, strict=True)
    states = zip(paces, whole, both.tolist(), slowness, strict=True)
    for row, (pace, there, together, slow) in zip(rows, states, strict=True):
        one = Reading(*row)._replace(together=together, pace=slow)
        if not pace:
            block = []
            size = 1
        if not (pace and there):
            made.append(one._replace(size=size))
            continue
        if block and not 0 <= one.time - block[0].time < AVERAGED_NS - pace // 2:
            complete = block
        else:
            complete = []
        block = [*([] if complete else block), one]
        size = len(complete) or size
        mean = _mean(complete) if complete else one._replace(size=0)
        made.append(mean._replace(pace=slow))
    return made


def _paces(times: NDArray[Any], whole: NDArray[np.bool_]) -> list[int]:
    """Return after each reading the mean step, ns, of a converter that is fast; 0 of others. `whole`: both have a value."""
    paces = []
    last = None
    pace = 0
    fast = False
    for time, there in zip(times.tolist(), whole, strict=True):
        if there:
            if last is not None and 0 < time - last <= 2 * AVERAGED_NS:
                step = time - last
            else:
                step = 2 * AVERAGED_NS
            pace = AVERAGED_NS // 5 * 2 if last is None else pace + step // STEPS - pace // STEPS
            fast = pace < AVERAGED_NS // 3 * (2 if fast else 1)
            last = time
        paces.append(pace if fast else 0)
    return paces


def _mean(block: list[Reading]) -> Reading:
    """Return the mean of readings and of their pairs."""
    begin = block[0].time
    valid = [one.pair for one in block if one.pair[2]]
    later, hard, soft = np.mean(
        [(one.time - begin, one.hard, one.soft) for one in block], axis=0
    ).tolist()
    pair = np.mean([pair[:2] for pair in valid], axis=0).tolist() if valid else (np.nan, np.nan)
    matched = all(matched for *_, matched in valid)
    return Reading(
        begin + int(later), hard, soft, (*pair, bool(valid), matched and bool(valid)), len(block)
    )


def matched_pair(t_hard: ArrayLike, t_soft: ArrayLike, hard: ArrayLike, soft: ArrayLike) -> Pairs:
    """Align two channels that are read one after the other: reference of the first stage of the scene "handheld".

    Parameters
    ----------
    t_hard, t_soft : array_like of int, shape (n,), ns
        Times of the readings.
    hard, soft : array_like, shape (n,), pF
        Readings; nan or infinite: a missing one.

    Returns
    -------
    Pairs
        For each reading the pair that is complete with it.

    Notes
    -----
    The window of a pair is the last four soft readings, the newest hard reading h between the two in the middle, and
    the hard readings before and after it. If its times fit an even grid, a and b weight the neighbours:
    y = (1 - 2 a) h(k) + a (h(k-1) + h(k+1)), x = (1/2 - b) (s(k-1) + s(k)) + b (s(k-2) + s(k+1)). The pair is matched
    up to a period of 40 ms.

    Examples
    --------
    >>> t = 26_000_000 * np.arange(6)
    >>> pairs = matched_pair(t, t + 13_000_000, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0], [0.5, 1.5, 2.5, 3.5, 4.5, 5.5])
    >>> pairs.hard, pairs.soft
    (array([nan, nan, nan,  2.,  3.,  4.]), array([nan, nan, nan,  2.,  3.,  4.]))
    """
    hards: list[_Reading] = []
    softs: list[_Reading] = []
    rows: list[tuple[float, float, bool, bool, int]] = []
    grid = _Grid()
    columns = (
        np.asarray(t_hard),
        np.asarray(t_soft),
        np.asarray(hard, float),
        np.asarray(soft, float),
    )
    for time, soft_time, value, soft_value in zip(*columns, strict=True):
        row = (np.nan, np.nan, False, False)
        if np.isfinite(soft_value):
            if softs and int(soft_time) <= softs[-1][0]:  # the time does not increase: begin again
                hards = []
                softs = []
            softs.append((int(soft_time), float(soft_value)))
        if np.isfinite(value):
            hards.append((int(time), float(value)))
        middle = _middle(hards, softs) if np.isfinite(soft_value) else None
        if middle is not None:
            row, grid = _pair(hards, softs[-4:], middle, grid)
        rows.append((*row, grid.pace))
    both = np.array(rows, float).reshape(-1, 5)
    hard_pairs, soft_pairs, valid, matched, pace = both.T
    return Pairs(hard_pairs, soft_pairs, valid > 0, matched > 0, pace.astype(int))


class _Grid(NamedTuple):
    """Windows since the last one on a grid, at most PATIENCE; and the pace."""

    uneven: int = 0
    pace: int = FAST


def _pair(
    hards: list[_Reading], softs: list[_Reading], middle: int, grid: _Grid
) -> tuple[tuple[float, float, bool, bool], _Grid]:
    """Return the row of a window with four soft readings and a hard one in the middle, and what is known of the grid."""
    now, value = hards[middle]
    if now == softs[2][0]:  # both channels at once
        return (value, softs[2][1], True, True), grid._replace(pace=FAST)
    around = hards[middle - 1 : middle + 2] if middle else []
    near = softs[2][0] - softs[1][0] <= LARGEST_GAP_NS
    pair = _filtered(around, softs) if near else None
    period = (softs[3][0] - softs[0][0]) // 3
    if len(around) == 3 and (pair is not None or grid.uneven == PATIENCE):
        grid = grid._replace(pace=int(period > SLOW_NS) + int(period > ALIASES_NS))
    if pair is not None:
        return (*pair, True, period <= SLOWEST_NS), grid._replace(uneven=0)
    grid = grid._replace(uneven=min(grid.uneven + 1, PATIENCE))
    if grid.uneven < PATIENCE or not near:
        return (np.nan, np.nan, False, False), grid
    weights = lagrange([time for time, _ in softs], now)
    return (value, float(weights @ [soft for _, soft in softs]), True, False), grid


def _middle(hards: list[_Reading], softs: list[_Reading]) -> int | None:
    """Return the place of the newest of the last three hard readings that is between the two soft ones in the middle."""
    if len(softs) < 4:
        return None
    last = range(max(len(hards) - 3, 0), len(hards))
    between = [i for i in last if softs[-3][0] < hards[i][0] <= softs[-2][0]]
    return between[-1] if between else None


def _filtered(hards: list[_Reading], softs: list[_Reading]) -> tuple[float, float] | None:
    """Return the filtered pair of three hard and four soft readings; None if their times do not fit a grid.

    The grid has the mean period of the soft readings, in whole ns, and the hard reading in the middle; it fits if every
    other reading is less than a quarter of the period from its place. Its deviation is corrected by the slope there.
    """
    if len(hards) < 3:
        return None
    period = (softs[3][0] - softs[0][0]) // 3
    places = {-2: -period, 2: period, -3: -period - period // 2, -1: -(period // 2), 1: period // 2}
    # in half periods from the middle: even ones hard, odd ones soft
    places[3] = period + period // 2
    readings = dict(zip((-2, 0, 2, -3, -1, 1, 3), [*hards, *softs], strict=True))
    late = {place: readings[place][0] - readings[0][0] - step for place, step in places.items()}
    if any(abs(ticks) >= period // 4 for ticks in late.values()):
        return None
    v = {place: value for place, (_, value) in readings.items()}
    slopes = {-2: v[0] - v[-2], 2: v[2] - v[0], -3: v[-1] - v[-3], 3: v[3] - v[1]}  # in a period
    slopes |= {-1: (v[1] - v[-3]) / 2, 1: (v[3] - v[-1]) / 2}
    on = {place: v[place] - slopes[place] * late[place] / period for place in late}
    a, b = sides(min(period, SLOWEST_NS))
    y = (1 - 2 * a) * v[0] + a * (on[-2] + on[2])
    x = (0.5 - b) * (on[-1] + on[1]) + b * (on[-3] + on[3])
    return y, x


def sides(period_ns: float) -> tuple[float, float]:
    """Return the weights a and b of the neighbours for a period: polynomials of its square, 1 for 26 ms."""
    u = (period_ns / 26e6) ** 2
    return 0.1875 + u * (0.0227 + u * 0.0003), 0.03125 + u * (0.0109 + u * 0.0027)


def lagrange(times: list[int], at: int) -> Array:
    """Return the weights of the interpolation at a time through values at other times, ns; their sum is 1."""
    t = np.array([time - at for time in times], float)
    return np.array([np.prod([other / (other - own) for other in t if other != own]) for own in t])
