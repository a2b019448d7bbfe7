"""Reference of the screen: readings are judged before anything pairs them."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.reference.judgement import Judgement

Floats = NDArray[np.float64]

AHEAD = 2  # readings for which one waits until it is judged
LAST_CHANGES = 12
LAST_BENDS = 40
OF_NOISE = 0.1573
OF_CHANGES = 0.125
OF_MOVES = 0.7
OF_CODES = 2.5
FADING = 0.97  # of what was usual, from reading to reading
EDGE = 1.5  # limits: range of the neighbours at a contact
ALIKE = 0.4  # limits: both channels did the same
SLOW_NS = 40_000_000

ENDS = (4.096, 8.192, 15.0)  # pF
COARSEST = 0.02  # pF
AT_END = 8  # readings
USUAL = 12  # equal readings in a row: the codes are coarse
MORE = 8  # times as many as ever before
# of a channel that stands still
SHORTEST = 20
SHORTEST_S = 1.0
NEVER_S = 10.0
FEWEST = 40  # readings before that


class Screened(NamedTuple):
    """Readings after the screen.

    Attributes
    ----------
    hard, soft : numpy.ndarray, shape (n,), pF
        nan where a reading is an outlier.
    outlier : numpy.ndarray of bool, shape (n, 2)
        Of the hard and the soft channel.
    at_end : numpy.ndarray of bool, shape (n,)
        Whether one of them is at a known end of the range.
    judgements : list of Judgement

    Examples
    --------
    >>> t = 26_000_000 * np.arange(40)
    >>> noise = 1e-4 * np.sin(7.0 * np.arange(40) ** 2)
    >>> hard = 9 + noise
    >>> hard[20] = 8.0
    >>> np.flatnonzero(screen(t, t, hard, 5 + noise).outlier[:, 0])
    array([20])
    """

    hard: Floats
    soft: Floats
    outlier: NDArray[np.bool_]
    at_end: NDArray[np.bool_]
    judgements: list[Judgement]


class Deviation(NamedTuple):
    """A reading against its neighbours, pF: from their median, their range, and a limit from their moves.

    Examples
    --------
    >>> Deviation(-1.0, 0.1, 0.01).range
    0.1
    """

    off: float = 0.0
    range: float = 0.0
    moves: float = 0.0


@dataclass
class Outliers:
    """The test of one channel for outliers; `values`: all of its readings.

    Examples
    --------
    >>> test = Outliers(np.array([1.0, 1.1, 5.0, 1.05, 1.1]))
    >>> test.kept = [1.0, 1.1]
    >>> round(float(test.deviation(2).off), 3)
    3.9
    """

    values: Floats
    kept: list[float] = field(default_factory=list)
    usual: float = 0.0

    def changes(self, number: int) -> Floats:
        """Return all changes that are known when a reading is judged: up to the second one after it."""
        known = self.values[: number + AHEAD + 1]
        return np.diff(known[np.isfinite(known)])

    def suspects(self, number: int) -> bool:
        """Return whether a reading differs by more than usual from those beside it."""
        value = self.values[number]
        beside = np.array([*self.kept[-1:], *self.values[number + 1 : number + 2]])
        apart = float(np.abs(value - beside).sum()) if len(beside) == AHEAD else np.nan
        self.usual *= FADING
        if not apart > self.usual:
            return False
        for size in (2 * apart, apart):
            if not (self.above_changes(size, number) and self.above_noise(size, number)):
                self.usual = size
                return False
        return True

    def above_changes(self, size: float, number: int) -> bool:
        """Return whether a size is above 8 times the quantile of the last changes."""
        return _quantile_below(np.abs(self.changes(number))[-LAST_CHANGES:], size * OF_CHANGES)

    def above_noise(self, size: float, number: int) -> bool:
        """Return whether a size is above 6 noises, from the quantile of the second differences."""
        bends = np.abs(np.diff(self.changes(number)))[-LAST_BENDS:]
        many = len(bends)
        return _quantile_below(bends, size * (OF_NOISE * (many / (many + 6))))

    def deviation(self, number: int) -> Deviation:
        """Return how far a reading is off."""
        value = self.values[number]
        beside = np.array([*self.kept[-2:], *self.values[number + 1 : number + AHEAD + 1]])
        beside = beside[np.isfinite(beside)]
        if not np.isfinite(value) or len(beside) < 2:
            return Deviation()
        off = value - _median(np.append(beside, value))
        return Deviation(off, float(np.ptp(beside)), OF_MOVES * _median(np.abs(np.diff(beside))))

    def is_far(self, size: float, found: Deviation, number: int) -> bool:
        """Return whether a size is above each limit."""
        sizes = np.abs(self.changes(number))
        code = float(sizes[sizes > 0].min(initial=np.inf))
        return (
            size > found.moves
            and (code == np.inf or size > OF_CODES * code)
            and self.above_changes(size, number)
            and self.above_noise(size, number)
        )

    def judged(self, number: int, *, outlier: bool) -> None:
        """Keep a reading that is no outlier."""
        if not outlier and np.isfinite(self.values[number]):
            self.kept.append(float(self.values[number]))


def _quantile_below(sizes: Floats, limit: float) -> bool:
    return bool(10 * np.count_nonzero(sizes < limit) > 3 * len(sizes))


def _median(values: Floats) -> float:
    """Return the middle one, or the mean of both; each is halved first, as their sum may be too large."""
    ordered = np.sort(values)
    last = len(ordered) - 1
    return float(ordered[last // 2] / 2 + ordered[(last + 1) // 2] / 2)


def find_outliers(both: tuple[Outliers, Outliers], number: int, *, slow: bool) -> tuple[bool, bool]:
    """Return which channels have an outlier; `slow`: a tap may be one reading long."""
    found = [test.deviation(number) for test in both]
    sizes = [abs(deviation.off) for deviation in found]

    def far(channel: int, size: float) -> bool:
        return both[channel].is_far(size, found[channel], number)

    is_alike = (found[0].off > 0) == (found[1].off > 0) and all(
        far(k, 1 / ALIKE * sizes[k]) for k in (0, 1)
    )
    if is_alike and (slow or not any(far(k, sizes[k] / 2) for k in (0, 1))):
        return False, False

    def is_outlier(own: int, other: int) -> bool:
        moves = far(other, found[other].range / EDGE)
        return far(own, sizes[own]) and (sizes[own] > found[own].range or not moves)

    return is_outlier(0, 1), is_outlier(1, 0)


def standstill(
    channel: str, times_ns: NDArray[np.int64], values: Floats, codes: Floats
) -> Iterator[tuple[int, bool, Judgement | None, Judgement | None]]:
    """Yield number, whether it is at a known end, and what is judged, for each reading with a value.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,), pF
        Without outliers: nan.
    codes : numpy.ndarray, shape (n,), pF
        Smallest change that was seen when the reading was judged; 0: none.
    """
    at_end = 0
    was_frozen = False
    longest = moved = equal = first = 0
    seen = list[float]()
    for number in np.flatnonzero(np.isfinite(values)):
        value = float(values[number])
        code = float(codes[number])
        seen.append(value)
        ends = [end for end in _known_ends(seen, code) if abs(value - end) <= _tolerance(code)]
        at_end = at_end + 1 if ends else 0
        if len(seen) > 1 and value == seen[-2]:
            equal += 1
        else:
            longest = longest if was_frozen else max(longest, equal)
            moved += 1
            equal = 0
            first = int(number)
            was_frozen = False
        time = int(times_ns[number])
        ended = Judgement("saturated", channel, time, value) if at_end == AT_END else None
        stands_s = float(times_ns[number] - times_ns[first]) / 1e9
        is_last = bool(number + AHEAD >= len(values))
        frozen = None
        if equal >= SHORTEST and not was_frozen:
            if min(seen) == max(seen):
                was_frozen = stands_s >= NEVER_S or is_last
            else:
                is_new = longest < USUAL and equal > MORE * longest
                was_frozen = moved >= FEWEST and is_new and stands_s >= SHORTEST_S
            if was_frozen:
                frozen = Judgement("frozen", channel, int(times_ns[first]), value)
        yield int(number), at_end >= AT_END, ended, frozen


def _tolerance(code: float) -> float:
    return 0.55 * code + 1e-4


def _known_ends(seen: list[float], code: float) -> list[float]:
    """Return the known ends at which the highest and the lowest of these readings stop."""
    found = []
    for sign, most in ((1, max(seen)), (-1, -min(seen))):
        found += [
            sign * end
            for end in ENDS
            if end - _tolerance(code) <= most <= end + COARSEST and code <= COARSEST
        ]
    return found


def screen(
    t_hard: ArrayLike,
    t_soft: ArrayLike,
    hard: ArrayLike,
    soft: ArrayLike,
    *,
    range_is_known: bool = False,
) -> Screened:
    """Judge readings: reference of the first stage of the scenes "handheld" and "sliding".

    Parameters
    ----------
    t_hard, t_soft : array_like of int, shape (n,), ns
    hard, soft : array_like, shape (n,), pF
        Readings; nan or infinite: a missing one.
    range_is_known : bool
        Whether the range of the converter is known otherwise, so that no end is guessed.

    Returns
    -------
    Screened

    Examples
    --------
    >>> t = 26_000_000 * np.arange(30)
    >>> [judgement] = screen(t, t, np.full(30, 4.096), np.arange(30.0)).judgements[:1]
    >>> judgement.what, judgement.channel
    ('saturated', 'hard')
    """
    times = np.column_stack([np.asarray(t_hard, np.int64), np.asarray(t_soft, np.int64)])
    values = np.column_stack([np.asarray(hard, float), np.asarray(soft, float)])
    values[~np.isfinite(values)] = np.nan
    both = Outliers(values[:, 0]), Outliers(values[:, 1])
    outlier = np.zeros(values.shape, bool)
    codes = np.zeros(values.shape)
    steps = np.diff(times[:, 0], append=times[-1:, 0])
    for number in range(len(values)):
        if np.any([test.suspects(number) for test in both]):  # each remembers what it saw
            outlier[number] = find_outliers(both, number, slow=bool(steps[number] > SLOW_NS))
        for channel, test in enumerate(both):
            test.judged(number, outlier=bool(outlier[number, channel]))
            sizes = np.abs(test.changes(number))
            codes[number, channel] = sizes[sizes > 0].min(initial=np.inf)
    codes[np.isinf(codes)] = 0.0
    clean = np.where(outlier, np.nan, values)
    at_end = np.zeros(values.shape, bool)
    judged = list[tuple[int, int, Judgement]]()
    for channel, name in enumerate(("hard", "soft")):
        stands = standstill(name, times[:, channel], clean[:, channel], codes[:, channel])
        for number, ends, ended, frozen in stands:
            at_end[number:, channel] = ends and not range_is_known
            if ended and not range_is_known:
                judged.append((number, channel, ended))
            if frozen:
                judged.append((number, channel, frozen))
    judged.sort(key=lambda each: each[:2])
    judgements = [judgement for _, _, judgement in judged]
    return Screened(clean[:, 0], clean[:, 1], outlier, at_end[:, 0] | at_end[:, 1], judgements)
