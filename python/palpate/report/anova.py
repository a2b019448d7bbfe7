"""Repeatability of touches: coefficient of variation, ICC(1,1), minimal detectable change.

One-way random effects, y_ij = mean + a_i + e_ij: specimen i, touch j. The logarithm of the ratio is
compared, because the scatter from touch to touch is proportional to the ratio. The model has one
way, because no touch of one specimen belongs to a touch of another: there are no judges whose
differences could be taken out. That is ICC(1,1) of Shrout and Fleiss.

References
----------
P. E. Shrout, J. L. Fleiss, "Intraclass correlations: uses in assessing rater reliability",
Psychol. Bull. 86 (1979) 420-428.

K. O. McGraw, S. P. Wong, "Forming inferences about some intraclass correlation coefficients",
Psychol. Methods 1 (1996) 30-46.

S. R. Searle, G. Casella, C. E. McCulloch, "Variance Components", Wiley 1992, Sec. 3.6: the
unbalanced case.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import inf, isfinite, nan, sqrt
from typing import NamedTuple

import numpy as np

from palpate import number_format
from palpate.errors import need

_BOTH = 1.96 * sqrt(2)  # 95 % of the differences of two touches, in standard errors of measurement


@dataclass(frozen=True)
class Repeatability:
    """How touches on the same specimen agree, compared with how specimens differ; nan: unknown.

    Attributes
    ----------
    specimens, touches : int
    within_freedom : int
        Touches less specimens; 0: no specimen was touched twice.
    per_specimen : float
        n_0, the touches of a specimen; a little less than the mean if the numbers differ.
    within, between : float
        Mean squares within and between the specimens.
    icc, low, high : float
        ICC(1,1), and its 95 % interval; below 0 if specimens differ by less than their touches
        scatter.
    """

    specimens: int
    touches: int
    within_freedom: int
    per_specimen: float
    within: float
    between: float
    icc: float
    low: float
    high: float

    @property
    def error(self) -> float:
        """Standard deviation of a touch around its specimen; of logarithms it is the CV."""
        return sqrt(self.within)

    def detectable(self, touches: int = 1) -> float:
        """Return the minimal detectable change between means of touches: 1.96 sqrt(2) errors."""
        return _BOTH * self.error / sqrt(touches)

    def as_dict(self) -> dict[str, object]:
        """Return all values as plain numbers; None for nan."""
        derived = {"error": self.error, "detectable": self.detectable()}
        return number_format.plain({**asdict(self), **derived})


class _Freedom(NamedTuple):
    """Degrees of freedom between the groups, and within them."""

    between: int
    within: int


def one_way_anova(groups: Sequence[Sequence[float]]) -> Repeatability:
    """Return the repeatability of finite values in groups, by a one-way analysis of variance.

    A group without a value does not count; one group at least has a value.
    """
    # ICC(1,1) = (MSB - MSW) / (MSB + (k - 1) MSW), with k values in a group. With different numbers
    # n_i of values k is n_0 = (N - sum n_i^2 / N) / (groups - 1). The interval follows from
    # F = MSB / MSW (McGraw and Wong, Table 7): exact for groups of one size, else approximate.
    filled = [group for group in groups if len(group)]
    sizes = np.array([len(group) for group in filled], float)
    values = np.concatenate(filled).astype(float)
    means = np.array([np.mean(group) for group in filled])
    freedom = _Freedom(len(sizes) - 1, len(values) - len(sizes))
    spread = float(((values - np.repeat(means, sizes.astype(int))) ** 2).sum())
    apart = float(sizes @ (means - values.mean()) ** 2)
    within = spread / freedom.within if freedom.within else nan
    between = nan
    per_specimen = float(sizes[0])
    if freedom.between:
        between = apart / freedom.between
        total = sizes.sum()
        per_specimen = float((total - (sizes**2).sum() / total) / freedom.between)
    quotients = _quotients(within, between, freedom)
    icc, low, high = (_correlation(quotient, per_specimen) for quotient in quotients)
    return Repeatability(
        len(sizes), len(values), freedom.within, per_specimen, within, between, icc, low, high
    )


def _correlation(quotient: float, per_specimen: float) -> float:
    """Return ICC(1,1) for a quotient F = MSB / MSW."""
    if quotient == inf:
        return 1.0
    return (quotient - 1) / (quotient + per_specimen - 1)


def _quotients(within: float, between: float, freedom: _Freedom) -> tuple[float, float, float]:
    """Return F = MSB / MSW, and both ends of its interval."""
    if not (isfinite(within) and isfinite(between)) or within == between == 0:
        return nan, nan, nan
    if within == 0:
        return inf, inf, inf
    quantile = need("scipy.special", "science").fdtri
    quotient = between / within
    above = float(quantile(freedom.between, freedom.within, 0.975))
    below = float(quantile(freedom.within, freedom.between, 0.975))
    return quotient, quotient / above, quotient * below
