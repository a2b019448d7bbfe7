"""The baseline of a touch from all idle readings near it, before and after."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.touch_readings.channel_readings import Array, Mask, Readings, median_size

_FEWEST = 8  # readings of a mean
_NEAR_S = 4.0  # they span at most this time
_MARGIN_S = 0.05  # before a touch: it may begin before it is above the noise
# Standard deviations of a reading: a baseline that was measured again, and was wrong before.
_JUMP = 25.0
_OUTLIER = 6.0
_MAD = 1.4826  # standard deviation / median of the absolute values
_BATCHES = 8  # of a mean: their scatter shows noise that is not white
# Weights of the first and last readings: less of a periodic disturbance is left.
_ENDS = np.array([1 / 3, 2 / 3])


def variance_of_sum(values: Array, batches: int, freedom: int) -> float:
    """Return the variance of a sum, from the scatter of the sums of its batches."""
    sums = np.array([batch.sum() for batch in np.array_split(values, batches)])
    return float(sums @ sums) * batches / freedom


@dataclass(frozen=True)
class IdleLevel:
    """The baseline of a touch: a line between two means of idle readings, or one mean.

    Attributes
    ----------
    t, value, variance : numpy.ndarray, shape (1,) or (2,)
        Time, s, value, pF, and variance, pF^2, of each mean.
    noise : float
        Standard deviation of a reading, pF.
    side : str
        "before", "after", or "before and after" the touch; or "given".
    """

    t: Array
    value: Array
    variance: Array
    noise: float
    side: str

    def share(self, t: Array) -> Array:
        """Return the part of the later mean in the level at times t."""
        if len(self.t) == 1:
            return np.zeros_like(t)
        return np.interp(t, self.t, [0.0, 1.0])

    def at(self, t: Array) -> Array:
        """Return the level at times t."""
        return np.interp(t, self.t, self.value)


def pause(rows: NDArray[Any], last: int, end: int, collected: int, *, measured: bool) -> int:
    """Return the first row of the baseline after a touch; `end`: it was not measured.

    `last` is the last row of the touch. With so many readings, `collected`, the tracker measures a
    new baseline; they begin after the release.
    """
    # The tracker measures it from the last of these readings on. If it is exactly the old one, the
    # first row is not known, and as many rows after the release are left out.
    out = np.flatnonzero(~rows["contact"][last:end])
    if not len(out):
        return end
    released = last + int(out[0])
    hard = rows["hard_baseline"][released:end]
    soft = rows["soft_baseline"][released:end]
    new = np.flatnonzero((hard != hard[0]) | (soft != soft[0]))
    if len(new):
        return released + max(int(new[0]) - collected + 1, 0)
    if measured:
        return min(released + collected, end)
    return end


def idle(
    rows: NDArray[Any], hard: Readings, starts: list[int], pauses: list[int], collected: int
) -> Mask:
    """Return which rows have a baseline; `collected` as in `pause`.

    They are not in a touch, and not before a wrong baseline was measured again.
    """
    # Such a baseline jumps, by more than 25 standard deviations of the hard readings.
    free = np.ones(len(rows), bool)
    noise = 1.0484 * median_size(np.diff(hard.value))  # 1.4826 / sqrt(2)
    steps = np.diff(rows["hard_baseline"], prepend=np.nan)
    jumps = np.abs(steps) > _JUMP * noise
    for start, end, before in zip(starts, pauses, [0, *pauses], strict=False):
        free[start:end] = False
        again = np.flatnonzero(jumps[before + collected : start])
        if len(again):
            free[before : before + again[-1] + 1] = False
    return free


class _Mean(NamedTuple):
    """A mean of readings: its time, value and variance, and the noise of a reading."""

    t: float
    value: float
    variance: float
    noise: float


def level_of(before: Readings, after: Readings, begin_s: float, next_s: float) -> IdleLevel | None:
    """Return the baseline of one channel from idle readings around a touch; None: too few."""
    last_s = before.t[-1:]
    first_s = after.t[:1]
    near = {
        "before": before[(before.t > last_s - _NEAR_S) & (before.t < begin_s - _MARGIN_S)],
        "after": after[(after.t < first_s + _NEAR_S) & (after.t < next_s - _MARGIN_S)],
    }
    means = {side: _mean(some) for side, some in near.items() if len(some.t) >= _FEWEST}
    if not means:
        return None
    t, value, variance, noise = np.array(list(means.values())).T
    rms_noise = float(np.sqrt(np.mean(noise**2)))
    return IdleLevel(t, value, variance, rms_noise, side=" and ".join(means))


def _mean(readings: Readings) -> _Mean:
    """Return the mean of the values that are near their median."""
    steps = np.diff(np.unique(readings.value))
    code = float(steps.min(initial=math.inf))
    if not math.isfinite(code):
        code = 0.0
    off = readings.value - np.median(readings.value)
    limit = max(_OUTLIER * _MAD * median_size(off), 1.5 * code)
    near = readings[np.abs(off) <= limit]
    count = len(near.t)
    around = near.t - near.t.mean()
    rest = near.value - near.value.mean()
    square = max(float(around @ around), 1e-30)
    rest -= around * (around @ rest) / square
    noise2 = float(rest @ rest) / (count - 2)
    weight = np.ones(count)
    weight[: len(_ENDS)] *= _ENDS
    weight[-len(_ENDS) :] *= _ENDS[::-1]
    weight /= weight.sum()
    scatter = variance_of_sum(rest, _BATCHES, freedom=_BATCHES - 2)
    variance = max(noise2 * float(weight @ weight), scatter / count**2)
    return _Mean(
        t=float(near.t @ weight),
        value=float(near.value @ weight),
        variance=variance + _rounding(code, noise2),
        noise=math.sqrt(noise2),
    )


def _rounding(code: float, noise2: float) -> float:
    """Return the variance of the mean of rounded values.

    It is half the square of code / pi exp(-2 pi^2 noise^2 / code^2).
    """
    # The noise before rounding: rounding adds code^2 / 12 to the variance.
    if code == 0:
        return 0.0
    before = max(noise2 / code**2 - 1 / 12, 0)
    rest = math.exp(-4 * math.pi**2 * before)
    return (code / math.pi) ** 2 / 2 * rest
