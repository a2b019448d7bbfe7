"""The ratio of one touch with its uncertainty: the number that follows ± in all outputs.

The standard error is what the readings of one touch show: noise, tremor, baseline. It contains
neither the linearity of the converter nor the differences between touches, each of which is held in
another way: these are larger, and more readings do not reduce them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import hypot, isfinite, nan, sqrt
from typing import TYPE_CHECKING, NamedTuple

from palpate import number_format

if TYPE_CHECKING:
    from palpate.touch import Touch

TOUCH_SCATTER = 0.03
"""Relative standard deviation of the ratio from touch to touch, until something has measured it.

This is a choice, not a measurement. The paper (Sec. IV, Fig. 10) observes "a considerable amount of
standard deviation" between four touches by hand, likely from oblique contact, and gives no number;
nobody has measured a hand with this probe yet. 3 % is an order of magnitude: far above the standard
error of a touch, so that no modulus looks better than a hand is; for ratios of 1 to 10 it is 7 % of
the modulus in the middle of the range. The simulated hand (`palpate.simulation.hand.Hand`) scatters
by the same share, so simulations do not confirm it. A calibration, or a session with repeated
touches, replaces it by a measurement.
"""
LEVEL_SCATTER = 0.006
"""The same of the level ratio, which a tilt does not change: creep and alignment cause so much."""
RatioOf = Callable[["Touch"], tuple[float, float]]
"""A ratio of a touch with its standard error (nan: not known): `hold_ratio`, `level_ratio`, or
`Calibration.ratio_of`."""


def hold_ratio(touch: "Touch") -> tuple[float, float]:
    """Return the ratio of a touch, and its standard error."""
    return touch.ratio, touch.standard_error


def level_ratio(touch: "Touch") -> tuple[float, float]:
    """Return the ratio of a touch over the swept depth, and its standard error; nan: none."""
    return touch.level_ratio, touch.level_standard_error


RATIOS: Mapping[str, RatioOf] = {"hold": hold_ratio, "level": level_ratio}
"""The ratios of a touch by name."""


class Scatter(NamedTuple):
    """Scatter of the ratio from touch to touch, and its source.

    Attributes
    ----------
    share : float
        Standard deviation, relative to the ratio, 0 or more.
    source : str
        "calibration", "session" (its repeated touches), or "assumed".
    by_level : bool
        Whether it is the scatter of level ratios: smaller than the scatter of the hold.

    Examples
    --------
    >>> Scatter()
    Scatter(share=0.03, source='assumed', by_level=False)
    """

    share: float = TOUCH_SCATTER
    source: str = "assumed"
    by_level: bool = False

    @classmethod
    def of(cls, variance: float, freedom: float, source: str) -> "Scatter":
        """Return the scatter with an estimated relative variance, or the assumed one.

        An estimate s^2 with v degrees of freedom leaves a t distribution, whose standard deviation
        is s sqrt(v / (v - 2)) (JCGM 101:2008, 6.4.9.4): two of these contain 95 % from v = 3 on.
        With fewer degrees of freedom it has no standard deviation, and the scatter is assumed.
        """
        if freedom <= 2:
            return cls()
        return cls(sqrt(variance * freedom / (freedom - 2)), source)


ASSUMED = Scatter()


@dataclass(frozen=True)
class Uncertainty:
    """Parts of the uncertainty of a ratio, each as one standard deviation of it.

    Attributes
    ----------
    ratio : float
    noise : float
        Its standard error: noise, tremor and baseline; nan if it is not known.
    linearity : float
        Of the converter, by its data sheet; 0 for another converter.
    scatter : float
        From touch to touch.
    source : str
        Where the scatter comes from, as in `Scatter`.

    Examples
    --------
    >>> print(Uncertainty.of_ratio(8.39891, 0.00092))
    8.40 ± 0.25 (assumed)
    """

    ratio: float
    noise: float
    linearity: float
    scatter: float
    source: str

    @classmethod
    def of_ratio(
        cls, ratio: float, standard_error: float, scatter: Scatter = ASSUMED, linearity: float = 0.0
    ) -> "Uncertainty":
        """Return the uncertainty of a ratio with this standard error (nan: not known)."""
        return cls(ratio, standard_error, linearity, abs(scatter.share * ratio), scatter.source)

    @classmethod
    def of(
        cls,
        touch: "Touch",
        scatter: Scatter = ASSUMED,
        linearity_pF: float = 0.0,
        ratio_of: RatioOf = hold_ratio,
    ) -> "Uncertainty":
        """Return the uncertainty of a touch.

        Parameters
        ----------
        touch : Touch
        scatter : Scatter
            Of the calibration (`Calibration.touch_scatter`) or of the session; default: assumed.
        linearity_pF : float, pF
            Standard deviation of a reading by the linearity of the converter,
            `palpate.ad7746.registers.linearity_pF`.
        ratio_of : callable
            As in `agreement`: for touches with a calibration its `ratio_of`.

        Returns
        -------
        Uncertainty

        Raises
        ------
        ValueError
            The scatter is of level ratios, and the ratio is of the hold.

        Examples
        --------
        >>> import palpate
        >>> from palpate.ad7746.registers import SATURATED_PF, linearity_pF
        >>> touch = palpate.touches(palpate.read("tests/data/four-specimens.csv"))[1]
        >>> known = Uncertainty.of(touch, linearity_pF=linearity_pF(SATURATED_PF))
        >>> print(known, f"{known.noise:.1g} {known.linearity:.1g} {known.scatter:.1g}")
        2.843 ± 0.085 (assumed) 7e-05 0.003 0.09
        """
        if not isinstance(scatter, Scatter):
            raise TypeError(
                f"scatter: got {scatter!r}, allowed: a palpate.uncertainty.Scatter, "
                "as Scatter(0.02)"
            )
        if scatter.by_level and ratio_of is hold_ratio:
            raise ValueError(
                "scatter: got one of level ratios, allowed with it: ratio_of=calibration.ratio_of"
            )
        # With d in both channels the ratio y / x changes by d sqrt(1 + r^2) / x. The mean square of
        # x is at least 1 / (P n): P is 1 / sum w x^2, and no weight w is above 1. In `handheld` it
        # is hardly more.
        ratio, error = ratio_of(touch)
        linearity = 0.0
        if linearity_pF:
            linearity = linearity_pF * hypot(1, ratio) * sqrt(touch.covariance * touch.samples)
        return cls.of_ratio(ratio, error, scatter, linearity)

    @property
    def uncertainty(self) -> float:
        """The root of the sum of squares of all parts; nan if the standard error is not known."""
        if not isfinite(self.noise):
            return nan
        return hypot(self.noise, self.linearity, self.scatter)

    def __str__(self) -> str:
        """Return the ratio, its uncertainty and the source of the scatter; else a few digits."""
        if not number_format.is_known(self.uncertainty):
            return number_format.number(self.ratio)
        return f"{number_format.plus_minus(self.ratio, self.uncertainty)} ({self.source})"

    def as_dict(self) -> dict[str, float | str | None]:
        """Return `uncertainty` (None: not known) and `uncertainty_from`, for JSON."""
        uncertainty = self.uncertainty if isfinite(self.uncertainty) else None
        return {"uncertainty": uncertainty, "uncertainty_from": self.source}
