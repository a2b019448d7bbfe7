"""The ranges of the touches that calibrated, and the cost of a touch outside of them.

A calibration holds for touches like those that made it. A touch that is held more obliquely,
pressed deeper or more lightly, or faster or more slowly, has a further error; here is its size.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import copysign, hypot, isfinite, log, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from palpate.calibration.evidence import (
    OF_GROWTH,
    TILT_COSTS,
    TouchEvidence,
    table_of,
    tilt_growth,
)

BEND = 0.007
"""Standard deviation of the slope of log(ratio) against the depth, 1/pF, before it is measured: the
gauges bend."""
_RISE = 0.005  # of log(ratio), for a rise that differs by a factor e: bumps creep meanwhile
_USUAL_TILT = 0.9  # quantile of the tilts that calibrated
# What exceeds a range by more is mentioned.
_MORE_TILT = 1.5
_LEAST_TILT = 0.003
_FACTOR = 1.3


class Range(NamedTuple):
    """Smallest and largest value of the touches that calibrated; nan: unknown."""

    low: float = nan
    high: float = nan

    @classmethod
    def of(cls, values: ArrayLike) -> "Range":
        """Return the range of values; unknown if one of them is."""
        if not np.isfinite(values).all():
            return cls()
        return cls(float(np.min(values)), float(np.max(values)))

    @property
    def is_known(self) -> bool:
        """Whether both ends are known."""
        return isfinite(self.low) and isfinite(self.high)

    def beyond(self, value: float) -> float:
        """Return how far a value is above the range, or below it: negative; 0: inside, or unknown."""
        if not (self.is_known and isfinite(value)):
            return 0.0
        return value - min(max(value, self.low), self.high)


_UNKNOWN = Range()


@dataclass(frozen=True)
class Ranges:
    """Ranges of the touches that calibrated.

    Attributes
    ----------
    tilt : float
        Usual largest tilt, |log(hold / level ratio)| at exponent 1; nan: unknown.
    depth_pF, rise_s : Range
        Of both channels together where the press had settled; of the time until then.
    middle_pF : float
        Median of the depths.

    Examples
    --------
    >>> found = Ranges(tilt=0.004, depth_pF=Range(0.5, 1.5), rise_s=Range(0.3, 0.5), middle_pF=1.0)
    >>> found.depth_pF.beyond(2.0), found.rise_s.beyond(0.4)
    (0.5, 0.0)
    """

    tilt: float = nan
    depth_pF: Range = _UNKNOWN
    rise_s: Range = _UNKNOWN
    middle_pF: float = nan

    @classmethod
    def of(cls, touches: Sequence[TouchEvidence]) -> "Ranges":
        """Return the ranges of touches."""
        table = table_of(touches)
        return cls(
            tilt=float(np.quantile(abs(table.tilt), _USUAL_TILT)),
            depth_pF=Range.of(table.depth_pF),
            rise_s=Range.of(table.rise_s),
            middle_pF=float(np.median(table.depth_pF)),
        )

    @property
    def unknown(self) -> list[str]:
        """Names of the ranges that are not known."""
        names = []
        if not isfinite(self.tilt):
            names.append("tilt")
        if not self.depth_pF.is_known:
            names.append("depth")
        if not self.rise_s.is_known:
            names.append("rise")
        return names

    def differences(self, touch: TouchEvidence) -> list[str]:
        """Return sentences about how a touch differs from those that calibrated."""
        sentences = []
        if abs(touch.tilt) > _MORE_TILT * self.tilt + _LEAST_TILT:
            sentences.append("held more obliquely than in the calibration")
        if touch.depth_pF > _FACTOR * self.depth_pF.high:
            sentences.append("pressed deeper than in the calibration")
        if touch.depth_pF < self.depth_pF.low / _FACTOR:
            sentences.append("pressed more lightly than in the calibration")
        if touch.rise_s > _FACTOR * self.rise_s.high:
            sentences.append("pressed more slowly than in the calibration")
        if touch.rise_s < self.rise_s.low / _FACTOR:
            sentences.append("pressed faster than in the calibration")
        return sentences


def wider(difference: str) -> str:
    """Return a sentence of `Ranges.differences` with its effect."""
    return f"{difference}; the interval is wider for it"


class DifferenceErrors(NamedTuple):
    """Errors of log(ratio) by what differs from the calibration, each as a standard deviation.

    They have signs: in a mean of several touches the errors of one cause add up with them.
    """

    tilt: float = 0.0
    contact_exponent: float = 0.0
    depth: float = 0.0
    rise: float = 0.0


def differences_of(
    touch: TouchEvidence,
    number: int,
    exponent: float,
    ranges: Ranges,
    *,
    kind: str,
    depth_slope_error: float,
) -> DifferenceErrors:
    """Return the errors of a touch at the exponent with this number, by its differences.

    Parameters
    ----------
    touch : TouchEvidence
    number : int
        Place in `touch.log_ratio`.
    exponent : float
        The exponent of this place.
    ranges : Ranges
        A range that is not known widens: a tilt counts as beyond it.
    kind : str
        "hold" or "level".
    depth_slope_error : float, 1/pF
        Standard deviation of the slope of log(ratio) against the depth.

    Returns
    -------
    DifferenceErrors
    """
    cost = TILT_COSTS[kind]
    by_tilt = 0.0
    if isfinite(touch.tilt) and touch.tilt:
        usual = ranges.tilt if isfinite(ranges.tilt) else 0.0
        beyond_share = max(1 - usual / abs(touch.tilt), 0.0)
        tilt = touch.tilt * float(tilt_growth(exponent))
        by_tilt = tilt * hypot(cost.within, cost.beyond * beyond_share)
    by_depth = 0.0
    if isfinite(touch.depth_pF):
        middle = ranges.middle_pF if isfinite(ranges.middle_pF) else 0.0
        beyond = ranges.depth_pF.beyond(touch.depth_pF)
        away = touch.depth_pF - middle
        by_depth = copysign(hypot(depth_slope_error * away, BEND * beyond), away)
    by_rise = 0.0
    if ranges.rise_s.is_known and ranges.rise_s.beyond(touch.rise_s):
        nearest = touch.rise_s - ranges.rise_s.beyond(touch.rise_s)
        by_rise = _RISE * log(touch.rise_s / nearest)
    return DifferenceErrors(
        tilt=by_tilt,
        contact_exponent=OF_GROWTH * float(touch.derived[number]),
        depth=by_depth,
        rise=by_rise,
    )
