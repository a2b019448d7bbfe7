"""The level ratio of a touch from its readings: a line over rise, hold and fall."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from palpate.touch_readings.channel_readings import Array, Mask, median_size
from palpate.touch_readings.windows import Aligned

# The level ratio, for any exponent of the contact: a line with an intercept over rise, hold and
# fall. A probe held off by an angle presses one bump deeper than the other by g:
# hard = r K (z + g/2)^p, soft = K (z - g/2)^p at depth z. So hard^(1/p) = r^(1/p) soft^(1/p) + c,
# whatever g is. As in palpate/stage/level_ratio.hpp.
# The press has settled if for so long it has not grown by a tenth.
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


class _Line(NamedTuple):
    """A line: its slope, the variance of that, the share of noise in x, and the residuals."""

    slope: float
    variance: float
    noise: float
    rest: Array


@dataclass(frozen=True)
class Sweep:
    """The pairs of a touch from contact to the end of its fall.

    Attributes
    ----------
    t : numpy.ndarray, shape (n,)
        Time, s.
    hard, soft : numpy.ndarray, shape (n,)
        Changes from the baseline, pF.
    noise : numpy.ndarray, shape (n,)
        Variance of `soft`, which makes a slope too small, pF^2.
    rise, hold, fall : numpy.ndarray of bool, shape (n,)
        Pairs of each part of the touch.
    """

    t: Array
    hard: Array
    soft: Array
    noise: Array
    rise: Mask
    hold: Mask
    fall: Mask

    def result(self, ratio: float, exponent: float) -> tuple[float, float]:
        """Return the level ratio and its standard error, given the ratio of the hold; nan: none."""
        none = (math.nan, math.nan)
        falls = self.fall.sum() >= _FEWEST
        rises = self.rise.sum() >= _FEWEST
        if self.hold.sum() < _FEWEST or not (rises or falls):
            return none
        used = self.rise | self.hold | (self.fall & falls)
        size = np.abs(self._line(used, exponent).rest)
        limit = max(_SPIKE * median_size(size), size.max() * 1e-9)
        used[used] = size <= limit  # without spikes
        line = self._line(used, exponent)
        apart = 0.0
        if falls and rises:
            without_fall = self._line(used & ~self.fall, exponent)
            without_rise = self._line(used & ~self.rise, exponent)
            apart = without_fall.slope - without_rise.slope
        if not line.slope > 0:
            return none
        # 9 and 3 times the variance by the residuals, which are not independent; and 5 and 2 % of
        # what the intercept changes.
        excess = 9
        open_share = 0.05
        if falls:
            excess = 3
            open_share = 0.02
        level = line.slope**exponent
        shift = open_share * (level - ratio) / level
        own = excess * line.variance + apart**2 / 4
        relative2 = own / line.slope**2 + line.noise**2 / 16
        error = math.sqrt(exponent**2 * relative2 + shift**2)
        if not error < _LARGEST:
            return none
        return level, level * error

    def _line(self, which: Mask, exponent: float) -> _Line:
        """Return the line by least squares.

        The variation in the hold has the weight `_OF_HOLD`. The noise is taken out of the sum of
        squares; if it is most of that, the slope is 0.
        """
        x = self.soft[which] ** (1 / exponent)
        y = self.hard[which] ** (1 / exponent)
        held = self.hold[which]
        noise = self.noise[which] * (x ** (1 - exponent) / exponent) ** 2
        x = x - x.mean()
        y = y - y.mean()
        middle = x[held].mean()
        swept = np.where(held, middle + _OF_HOLD * (x - middle), x)
        weight = np.where(held, _OF_HOLD, 1.0)
        square = float(swept @ x) or math.inf
        share = float(noise @ weight) / square
        slope = float(swept @ y) / square
        rest = y - slope * x
        freedom = max(len(rest) - 2, 1)
        variance = float(rest @ rest) / freedom / square / (1 - share) ** 2
        corrected = 0.0
        if share < _MOST_NOISE:
            corrected = slope / (1 - share)
        return _Line(corrected, variance, share, rest)


def sweep(pairs: Aligned | None, noise: float, begin_s: float, end: int) -> Sweep | None:
    """Return the sweep of the pairs of a touch from a time on, s; None: there is none.

    The last sample of the touch is in row `end`.
    """
    # noise: of a soft reading, pF. A lag is not removed: a tilt looks like one.
    if pairs is None:
        return None
    good = pairs.good & (pairs.x > 0) & (pairs.y > 0)
    soft = pairs.x[good]
    t = pairs.t[good]
    count, height = _settled(soft, t)
    if not count:
        return None
    inside = t >= begin_s
    pressed = soft > _HELD * height
    higher = soft > _EDGE * height
    rising = np.arange(len(soft)) < count
    before_end = pairs.row[good] <= end
    gain = (pairs.soft.weight[good] ** 2).sum(axis=1)
    return Sweep(
        t=t,
        hard=pairs.y[good],
        soft=soft,
        noise=noise**2 * gain,
        rise=inside & rising & higher,
        hold=inside & ~rising & pressed & before_end,
        fall=inside & ~rising & ~pressed & higher,
    )


def _settled(soft: Array, t: Array) -> tuple[int, float]:
    """Return the pairs until the press has settled, and its height, pF; 0: it has not."""
    highest = 0.0
    grown_s = 0.0
    for number, (value, at_s) in enumerate(zip(soft, t, strict=True), 1):
        if value > _GROWS * highest:
            highest = float(value)
            grown_s = float(at_s)
        elif at_s - grown_s > _SETTLED_S:
            return number, highest
    return 0, 0.0
