"""The level ratio of a touch afterwards, for any exponent of the contact: a line with an intercept over rise, hold and fall.

A probe held off by an angle presses one bump deeper by g: hard = r K (z + g)^p, soft = K (z - g)^p at depth z. So
hard^(1/p) = r^(1/p) soft^(1/p) + c, whatever g is. As in palpate/stage/level_ratio.hpp.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from palpate.afterwards.fit import HARD, Aligned

Array = NDArray[np.float64]
_SETTLED_S, _GROWS = 0.1, 1.1  # the press has settled if for so long it has not grown by a tenth
_HELD, _LEAST = 0.75, 1 / 8  # shares of the height: the hold, and the ends of rise and fall
_FEWEST = 3  # pairs of the hold, and of the rise or the fall
_OUTLIER = 8.0 * 1.4826  # median absolute residuals of a pair that is left out
_LARGEST = 0.1  # relative error of a level ratio


@dataclass(frozen=True)
class Sweep:
    """The pairs of a touch from contact to the end of its fall: hard and soft, pF, and which are of rise, hold and fall."""

    hard: Array
    soft: Array
    rise: NDArray[np.bool_]
    hold: NDArray[np.bool_]
    fall: NDArray[np.bool_]

    def result(self, ratio: float, exponent: float) -> tuple[float, float]:
        """Return the level ratio and its standard error, beside the ratio of the hold; nan: there is none."""
        falls, rises = self.fall.sum() >= _FEWEST, self.rise.sum() >= _FEWEST
        if self.hold.sum() < _FEWEST or not (rises or falls):
            return math.nan, math.nan
        used = self.rise | self.hold | (self.fall & falls)
        size = np.abs(self._line(used, exponent)[2])
        used[used] = size <= max(_OUTLIER * float(np.median(size)), size.max() * 1e-9)  # without spikes
        slope, variance, _ = self._line(used, exponent)
        apart = 0.0
        if falls and rises:
            apart = self._line(used & ~self.fall, exponent)[0] - self._line(used & ~self.rise, exponent)[0]
        if not slope > 0:
            return math.nan, math.nan
        # 9 and 3 times the variance by the residuals, which are not independent; of what the intercept changes 5 and 2 %.
        level = slope**exponent
        shift = (0.02 if falls else 0.05) * (level - ratio) / level
        own = (3 if falls else 9) * variance + apart**2 / 4
        error = math.sqrt(exponent**2 * own / slope**2 + shift**2)
        return (level, level * error) if error < _LARGEST else (math.nan, math.nan)

    def _line(self, which: NDArray[np.bool_], exponent: float) -> tuple[float, float, Array]:
        """Return the slope by least squares, its variance from the residuals, and these."""
        x, y = (values[which] ** (1 / exponent) for values in (self.soft, self.hard))
        x, y = x - x.mean(), y - y.mean()
        square = float(x @ x) or math.inf
        slope = float(x @ y) / square
        rest = y - slope * x
        return slope, float(rest @ rest) / max(len(rest) - 2, 1) / square, rest


def sweep(pairs: Aligned | None, begin_s: float, end: int) -> Sweep | None:
    """Return the sweep of the pairs of a touch from a time on, s, whose last sample is in row `end`; None: there is none."""
    # A lag is not removed: a tilt looks like one.
    if pairs is None:
        return None
    good = pairs.good & (pairs.x > 0) & (pairs.y > 0)
    hard, soft, row = pairs.y[good], pairs.x[good], pairs.row[good]
    t = pairs.hard.readings.t[pairs.hard.at[good, HARD // 2]]
    count, height = _settled(soft, t)
    if not count:
        return None
    number = np.arange(len(soft))
    pressed, rising = soft > _HELD * height, number < count
    inside = t >= begin_s
    return Sweep(
        hard,
        soft,
        inside & rising & (soft > _LEAST * height),
        inside & ~rising & pressed & (row <= end),
        inside & ~rising & ~pressed & (soft > _LEAST * height),
    )


def _settled(soft: Array, t: Array) -> tuple[int, float]:
    """Return the number of pairs until the press has settled, and its height, pF; 0: it has not."""
    highest, grown_s = 0.0, 0.0
    for number, (value, at_s) in enumerate(zip(soft, t, strict=True), 1):
        if value > _GROWS * highest:
            highest, grown_s = float(value), float(at_s)
        elif at_s - grown_s > _SETTLED_S:
            return number, highest
    return 0, 0.0
