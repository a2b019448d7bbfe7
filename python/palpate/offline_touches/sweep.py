"""The level ratio of a touch from its readings: a line over rise, hold and fall."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.offline_touches.fit import HARD, Aligned

Array = NDArray[np.float64]

# The level ratio, for any exponent of the contact: a line with an intercept over rise, hold and fall. A probe held off by
# an angle presses one bump deeper than the other by g: hard = r K (z + g/2)^p, soft = K (z - g/2)^p at depth z. So
# hard^(1/p) = r^(1/p) soft^(1/p) + c, whatever g is. As in palpate/stage/level_ratio.hpp.
# the press has settled if for so long it has not grown by a tenth
_SETTLED_S = 0.1
_GROWS = 1.1
# shares of the height: the hold, and the ends of rise and fall
_HELD = 0.75
_EDGE = 1 / 8
_FEWEST = 3  # pairs of the hold, and of the rise or the fall
_SPIKE = 8.0 * 1.4826  # median absolute residuals of a pair that is left out
_LARGEST = 0.1  # relative error of a level ratio
_MOST_NOISE = 0.3  # share of the variation of the soft channel
# Weight of the variation in the hold: a tremor moves force and angle together.
_OF_HOLD = 0.25


@dataclass(frozen=True)
class Sweep:
    """The pairs of a touch from contact to the end of its fall.

    Attributes
    ----------
    hard, soft : numpy.ndarray, shape (n,)
        Changes from the baseline, pF.
    noise : numpy.ndarray, shape (n,)
        Variance of `soft`, which makes a slope too small, pF^2.
    rise, hold, fall : numpy.ndarray of bool, shape (n,)
        Pairs of each part of the touch.
    """

    hard: Array
    soft: Array
    noise: Array
    rise: NDArray[np.bool_]
    hold: NDArray[np.bool_]
    fall: NDArray[np.bool_]

    def result(self, ratio: float, exponent: float) -> tuple[float, float]:
        """Return the level ratio and its standard error, beside the ratio of the hold; nan: there is none."""
        falls = self.fall.sum() >= _FEWEST
        rises = self.rise.sum() >= _FEWEST
        if self.hold.sum() < _FEWEST or not (rises or falls):
            return math.nan, math.nan
        used = self.rise | self.hold | (self.fall & falls)
        size = np.abs(self._line(used, exponent)[3])
        limit = max(_SPIKE * float(np.median(size)), size.max() * 1e-9)
        used[used] = size <= limit  # without spikes
        slope, variance, noise, _ = self._line(used, exponent)
        apart = 0.0
        if falls and rises:
            without_fall = self._line(used & ~self.fall, exponent)[0]
            without_rise = self._line(used & ~self.rise, exponent)[0]
            apart = without_fall - without_rise
        if not slope > 0:
            return math.nan, math.nan
        # 9 and 3 times the variance by the residuals, which are not independent; of what the intercept changes 5 and 2 %.
        level = slope**exponent
        shift = (0.02 if falls else 0.05) * (level - ratio) / level
        own = (3 if falls else 9) * variance + apart**2 / 4
        error = math.sqrt(exponent**2 * (own / slope**2 + noise**2 / 16) + shift**2)
        if not error < _LARGEST:
            return math.nan, math.nan
        return level, level * error

    def _line(self, which: NDArray[np.bool_], exponent: float) -> tuple[float, float, float, Array]:
        """Return the slope by least squares, its variance from the residuals, the share of noise in x, and the residuals.

        The variation in the hold has the weight `_OF_HOLD`. The noise is taken out of the sum of squares; if it is most
        of that, the slope is 0.
        """
        x = self.soft[which] ** (1 / exponent)
        y = self.hard[which] ** (1 / exponent)
        held = self.hold[which]
        noise = self.noise[which] * (x ** (1 - exponent) / exponent) ** 2
        x = x - x.mean()
        y = y - y.mean()
        swept = np.where(held, x[held].mean() + _OF_HOLD * (x - x[held].mean()), x)
        square = float(swept @ x) or math.inf
        share = float(noise @ np.where(held, _OF_HOLD, 1.0)) / square
        slope = float(swept @ y) / square
        rest = y - slope * x
        variance = float(rest @ rest) / max(len(rest) - 2, 1) / square / (1 - share) ** 2
        return (slope / (1 - share) if share < _MOST_NOISE else 0.0), variance, share, rest


def sweep(pairs: Aligned | None, noise: float, begin_s: float, end: int) -> Sweep | None:
    """Return the sweep of the pairs of a touch from a time on, s, whose last sample is in row `end`; None: there is none."""
    # noise: of a soft reading, pF. A lag is not removed: a tilt looks like one.
    if pairs is None:
        return None
    good = pairs.good & (pairs.x > 0) & (pairs.y > 0)
    hard = pairs.y[good]
    soft = pairs.x[good]
    row = pairs.row[good]
    t = pairs.hard.readings.t[pairs.hard.at[good, HARD // 2]]
    count, height = _settled(soft, t)
    if not count:
        return None
    pressed = soft > _HELD * height
    rising = np.arange(len(soft)) < count
    inside = t >= begin_s
    higher = soft > _EDGE * height
    return Sweep(
        hard,
        soft,
        noise=noise**2 * (pairs.soft.weight[good] ** 2).sum(axis=1),
        rise=inside & rising & higher,
        hold=inside & ~rising & pressed & (row <= end),
        fall=inside & ~rising & ~pressed & higher,
    )


def _settled(soft: Array, t: Array) -> tuple[int, float]:
    """Return the number of pairs until the press has settled, and its height, pF; 0: it has not."""
    highest = 0.0
    grown_s = 0.0
    for number, (value, at_s) in enumerate(zip(soft, t, strict=True), 1):
        if value > _GROWS * highest:
            highest = float(value)
            grown_s = float(at_s)
        elif at_s - grown_s > _SETTLED_S:
            return number, highest
    return 0, 0.0
