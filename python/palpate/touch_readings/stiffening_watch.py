"""A tracker whose touches have the flag `stiffens`: it keeps the readings of a touch for the test."""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate._core import Tracker
from palpate.flags import Flag
from palpate.touch import Touch
from palpate.touch_readings.channel_readings import Array, Mask, Readings, readings_of, smooth
from palpate.touch_readings.stiffening import Stiffening, stiffening
from palpate.touch_readings.sweep import sweep
from palpate.touch_readings.windows import aligned

Column = NDArray[np.number[Any]]
"""Times, ns as integers or s, or readings of one channel."""
TrackerRows = NDArray[np.void]

_LEAD = 5  # rows before a touch: windows of its first pairs reach so far
_IDLE = 32  # rows that are kept without contact: a touch begins up to 6 rows before its contact
_MOST_ROWS = 2**16  # kept; a longer touch is not tested
_LONGEST_S = 60.0  # of a touch that is tested, with its fall and the baseline after it
_STEP_S = 0.02  # pairs that are closer are averaged
_IN_HOLD = 0.8  # quantile of a channel that is in the hold, also of a short one
_LEAST_HEIGHT = 0.08  # share of the height; the fit uses pairs from 1/8 on
_ENDS_S = 1.0  # at both ends of a touch each reading counts
_EACH = 4  # every fourth reading of a long hold is enough: they are alike
# Flags of touches without this flag, like those without a ratio: a channel that is late changes the
# ratio in rise and fall.
_UNTESTED = (Flag.STEP, Flag.GAP, Flag.LAG)


@dataclass(frozen=True)
class _FedPairs:
    """Consecutive pairs that were fed to the tracker, with its rows."""

    t_hard: Column
    t_soft: Column
    hard: Column
    soft: Column
    rows: TrackerRows

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, which: slice) -> "_FedPairs":
        return _FedPairs(
            self.t_hard[which],
            self.t_soft[which],
            self.hard[which],
            self.soft[which],
            self.rows[which],
        )


def _joined(parts: Sequence[_FedPairs]) -> _FedPairs:
    """Return consecutive parts as one."""
    return _FedPairs(
        np.concatenate([part.t_hard for part in parts]),
        np.concatenate([part.t_soft for part in parts]),
        np.concatenate([part.hard for part in parts]),
        np.concatenate([part.soft for part in parts]),
        np.concatenate([part.rows for part in parts]),
    )


class StiffeningWatch:
    """Feeds a tracker, and tests each touch for an object that stiffens with depth.

    A touch is tested when it ends, and again when the baseline after it is known, with its fall.
    This last result depends on the readings only, not on the blocks in which they come.

    Parameters
    ----------
    tracker : Tracker
        Only touches with a level ratio are tested: of the scene "handheld".

    Examples
    --------
    >>> from palpate.simulation import scenarios
    >>> run = scenarios.run("stiff-steady")
    >>> watch = StiffeningWatch(Tracker())
    >>> rows = watch.process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    >>> [touch.flags for touch in watch.touches]
    [()]
    """

    def __init__(self, tracker: Tracker) -> None:
        self.tracker = tracker
        self._kept = deque[_FedPairs]()
        self._first = tracker.readings  # number of the first row that is kept
        self._found: dict[int, Stiffening | None] = {}  # by the numbers of touches
        self._ended = tracker.touch_count  # touches that are tested
        self._last_revised = self._ended
        self._revised = tracker.revision_count
        settings = tracker.settings
        self._is_used = settings.get("contact_exponent", 0.0) > 0
        self._revises = settings.get("baseline", "measured") == "measured"
        if self._is_used:
            self._sign = -1.0 if settings["falling"] else 1.0
            self._soft_later_s = float(settings["soft_later"])
            self._is_host_stamped = bool(settings["host_stamps"])
            self._full_scale = float(settings["full_scale"])

    @property
    def touches(self) -> list[Touch]:
        """The touches of the tracker, those on objects that stiffen with the flag."""
        return self.touches_since(0)

    def touches_since(self, count: int) -> list[Touch]:
        """Return the touches after the first `count` ones, as `touches`."""
        found = self.tracker.touches_since(count)
        return [self._flagged(number, touch) for number, touch in enumerate(found, count + 1)]

    def process(self, t_hard: Column, t_soft: Column, hard: Column, soft: Column) -> TrackerRows:
        """Feed pairs to the tracker as `Tracker.process` does, and return its rows."""
        rows = self.tracker.process(t_hard, t_soft, hard, soft)
        if self._is_used and len(rows):
            self._kept.append(_FedPairs(t_hard, t_soft, hard, soft, rows))
            self._test_new()
            self._forget()
        return rows

    def finish(self) -> None:
        """End a touch that is running, as `Tracker.finish` does, and test it."""
        self.tracker.finish()
        if self._is_used and self._kept:
            self._test_new()

    def _test_new(self) -> None:
        """Test the touches that ended or were revised in the last rows."""
        ended = range(self._ended + 1, self.tracker.touch_count + 1)
        revised = self.tracker.revisions_since(self._revised)
        if not ended and not revised:
            return
        self._ended += len(ended)
        self._revised += len(revised)
        self._last_revised = max(revised, default=self._last_revised)
        kept = _joined(self._kept)
        places = np.flatnonzero(kept.rows["revised"])[-len(revised) :]
        known_until = dict(zip(revised, places.tolist(), strict=False))
        for number in {*ended, *revised}:
            samples = np.flatnonzero(kept.rows["touch"] == number)
            if len(samples):
                last = int(samples[-1])
                self._test(kept, number, last, max(known_until.get(number, 0), last))

    def _test(self, kept: _FedPairs, number: int, last: int, known_until: int) -> None:
        """Test the touch whose last sample and last known reading are in these rows."""
        touch = self.tracker.touches_since(number - 1)[0]
        begin = touch.start - _LEAD - self._first
        if begin >= 0:
            result = self._result(kept[begin : known_until + 1], last - begin)
            self._found[number] = result

    def _result(self, pairs: _FedPairs, last: int) -> Stiffening | None:
        """Return the result of a touch that begins with pair `_LEAD`; its last sample is `last`."""
        t_hard = _since_s(pairs.t_hard, pairs.t_hard[0])
        t_soft = _since_s(pairs.t_soft, pairs.t_hard[0]) + self._soft_later_s
        step_s = float(np.median(np.diff(t_hard)))
        if not (step_s > 0 and t_hard[-1] < _LONGEST_S):
            return None
        if self._is_host_stamped:
            t_hard = smooth(t_hard)
            t_soft = smooth(t_soft)
        count = max(int(_STEP_S / step_s), 1)
        hard = self._change(t_hard, pairs.hard, pairs.rows["hard_baseline"], count)
        soft = self._change(t_soft, pairs.soft, pairs.rows["soft_baseline"], count)
        changes = aligned(hard, soft, _needed(hard))
        swept = sweep(changes, 0.0, -math.inf, last // count)
        return stiffening(swept) if swept else None

    def _change(self, t: Array, values: Column, baseline: Array, count: int) -> Readings:
        """Return the change of one channel from its baseline before the touch.

        `count` consecutive readings are averaged.
        """
        inside = np.where(np.abs(values) < self._full_scale, values, np.nan)
        change = self._sign * (inside - baseline[_LEAD])
        return readings_of(_means(t, count), _means(change, count), math.inf)

    def _forget(self) -> None:
        """Forget the parts before the last touch if it waits for its revision, else the idle ones."""
        last = self._kept[-1]
        needed = _IDLE
        is_waiting = self._revises and self._ended > self._last_revised
        if last.rows["contact"][-1] or is_waiting:
            needed = _MOST_ROWS
        number = sum(map(len, self._kept))
        while number - len(self._kept[0]) >= needed:
            number -= len(self._kept[0])
            self._first += len(self._kept.popleft())

    def _flagged(self, number: int, touch: Touch) -> Touch:
        """Return a touch with the flag, if it is on an object that stiffens."""
        found = self._found.get(number)
        if found is None or not found.is_significant:
            return touch
        if any(flag.meaning.no_ratio or flag in _UNTESTED for flag in touch.flags):
            return touch
        effects = touch.effects | {"stiffening": found.share}
        return replace(touch, flags=(*touch.flags, Flag.STIFFENS), effects=effects)


def _since_s(t: Column, first: Any) -> Array:
    """Return times, ns as integers or s, as seconds since the first one."""
    since = t - first
    if np.issubdtype(since.dtype, np.integer):
        return np.asarray(since * 1e-9, float)
    return np.asarray(since, float)


def _means(values: Array, count: int) -> Array:
    """Return the means of `count` consecutive values; the last incomplete ones are left out."""
    if count == 1:
        return values
    whole = len(values) // count * count
    return np.asarray(values[:whole].reshape(-1, count).mean(axis=1))


def _needed(hard: Readings) -> Mask:
    """Return which readings of the hard channel the test needs.

    They are those of rise and fall, and in a long hold some of them.
    """
    if not len(hard.t):
        return np.zeros(0, bool)
    height = float(np.quantile(hard.value, _IN_HOLD))
    pressed = hard.value > _LEAST_HEIGHT * height
    first_s = float(hard.t[0]) + _ENDS_S
    last_s = float(hard.t[pressed].max(initial=0.0)) - _ENDS_S
    inside = (hard.t > first_s) & (hard.t < last_s)
    some = np.arange(len(hard.t)) % _EACH == 0
    return np.asarray(pressed & (some | ~inside))
