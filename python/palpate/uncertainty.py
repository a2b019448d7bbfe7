"""The uncertainty of the ratio of one touch, and its parts: what stands after ± wherever a ratio is printed.

The standard error is what the readings of one touch show: noise, tremor, baseline. It does not contain the linearity of the
converter, and not that each touch is held in another way: these are larger, and more readings do not reduce them.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import hypot, inf, isfinite, log, nan, sqrt
from statistics import pvariance
from typing import NamedTuple

from palpate import number_format
from palpate._core import Touch
from palpate.repeatability import TOUCH_SCATTER, Agreement, RatioOf, hold

Known = tuple[float, float]
"""A ratio and its standard error."""


def within_groups(named: Iterable[tuple[str | None, Known]]) -> tuple[float, int, list[Known]]:
    """Return the pooled variance of the logarithms of ratios within groups, its degrees of freedom, and the ratios that count.

    A ratio counts with the name of a group, above 0 and finite. Without degrees of freedom the variance is inf.
    """
    groups: dict[str, list[Known]] = {}
    for name, known in named:
        if name and 0 < known[0] < inf:
            groups.setdefault(name, []).append(known)
    used = [known for group in groups.values() for known in group]
    freedom = len(used) - len(groups)
    squares = sum(
        len(group) * pvariance([log(ratio) for ratio, _ in group]) for group in groups.values()
    )
    return squares / freedom if freedom else inf, freedom, used


class Scatter(NamedTuple):
    """Scatter of the ratio from touch to touch, and where it comes from.

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
        """Return the scatter by a relative variance that was estimated; the assumed one if that shows too little.

        An estimate s^2 with v degrees of freedom leaves a t distribution, whose standard deviation is s sqrt(v / (v - 2))
        (JCGM 101:2008, 6.4.9.4): two of these hold 95 % from v = 3 on. With fewer it has none.
        """
        return cls(sqrt(variance * freedom / (freedom - 2)), source) if freedom > 2 else cls()

    @classmethod
    def of_session(
        cls, touches: Iterable[tuple[str | None, Touch]], ratio_of: RatioOf = hold
    ) -> "Scatter":
        """Return the scatter within the specimens of a session, pooled, without the part of the standard errors.

        Parameters
        ----------
        touches : iterable of (str or None, Touch)
            The kept touches, each with the name of its specimen. Without a name, or a ratio above 0, one does not count.
        ratio_of : callable
            As in `agreement`.

        Returns
        -------
        Scatter
            The assumed one with fewer than 3 degrees of freedom, which are the touches less the specimens.

        Examples
        --------
        >>> import palpate
        >>> from palpate.simulation.hand import session
        >>> four = palpate.touches(session(0, moduli={"gel": 1.1})["gel"])
        >>> Scatter.of_session(("gel", touch) for touch in four).source
        'session'
        """
        variance, freedom, used = within_groups((name, ratio_of(touch)) for name, touch in touches)
        noise = sum((error / ratio) ** 2 for ratio, error in used if isfinite(error)) / max(
            len(used), 1
        )
        return cls.of(max(variance - noise, 0.0), freedom, "session")


ASSUMED = Scatter()


def with_scatter(found: Agreement, scatter: Scatter) -> Agreement:
    """Return an agreement whose mean has the scatter of the session, if it is known, as its touches have."""
    return replace(found, scatter=scatter.share) if scatter.source == "session" else found


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
        touch: Touch,
        scatter: Scatter = ASSUMED,
        linearity_pF: float = 0.0,
        ratio_of: RatioOf = hold,
    ) -> "Uncertainty":
        """Return the uncertainty of a touch.

        Parameters
        ----------
        touch : Touch
        scatter : Scatter
            Of the calibration (`Calibration.touch_scatter`) or of the session; default: assumed.
        linearity_pF : float, pF
            Standard deviation of a reading by the linearity of the converter, `palpate.ad7746.registers.linearity_pF`.
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
        >>> found = Uncertainty.of(touch, linearity_pF=linearity_pF(SATURATED_PF))
        >>> print(found, f"{found.noise:.1g} {found.linearity:.1g} {found.scatter:.1g}")
        2.843 ± 0.085 (assumed) 7e-05 0.003 0.09
        """
        if not isinstance(scatter, Scatter):
            raise TypeError(
                f"scatter: got {scatter!r}, allowed: a palpate.uncertainty.Scatter, as Scatter(0.02)"
            )
        if scatter.by_level and ratio_of is hold:
            raise ValueError(
                "scatter: got one of level ratios, allowed with it: ratio_of=calibration.ratio_of"
            )
        # With d in both channels the ratio y / x changes by d sqrt(1 + r^2) / x. The mean square of x is at least
        # 1 / (P n): P is 1 / sum w x^2, and no weight w is above 1. In `handheld` it is hardly more.
        ratio, error = ratio_of(touch)
        linear = (
            linearity_pF * hypot(1, ratio) * sqrt(touch.covariance * touch.samples)
            if linearity_pF
            else 0.0
        )
        return cls.of_ratio(ratio, error, scatter, linear)

    @property
    def uncertainty(self) -> float:
        """The whole: the root of the sum of squares; nan if the standard error is not known."""
        return hypot(self.noise, self.linearity, self.scatter) if isfinite(self.noise) else nan

    def __str__(self) -> str:
        """Return the ratio, its uncertainty, and where the scatter comes from; a few digits if it is not known."""
        if not number_format.known(self.uncertainty):
            return number_format.number(self.ratio)
        return f"{number_format.plus_minus(self.ratio, self.uncertainty)} ({self.source})"

    def as_dict(self) -> dict[str, float | str | None]:
        """Return `uncertainty` (None: not known) and `uncertainty_from`, for JSON."""
        return {
            **number_format.plain({"uncertainty": self.uncertainty}),
            "uncertainty_from": self.source,
        }
