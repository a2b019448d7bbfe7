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


def one_way_anova(groups: Sequence[Sequence[float]]) -> Repeatability:
    """Return the repeatability of finite values in groups, by a one-way analysis of variance.

    A group without a value does not count; one group at least has a value.
    """
    # ICC(1,1) = (MSB - MSW) / (MSB + (k - 1) MSW), with k values in a group. With different numbers
    # n_i of values k is n_0 = (N - sum n_i^2 / N) / (groups - 1). The interval follows from
    # F = MSB / MSW (McGraw and Wong, Table 7): exact for groups of one size, else approximate.
    filled = list(filter(len, groups))
    sizes = np.array(list(map(len, filled)), float)
    values = np.concatenate(filled).astype(float)
    means = np.array(list(map(np.mean, filled)))
    freedom = len(sizes) - 1
    within_freedom = len(values) - len(sizes)
    spread = float(((values - np.repeat(means, sizes.astype(int))) ** 2).sum())
    apart = float(sizes @ (means - values.mean()) ** 2)
    within = between = nan
    per_specimen = float(sizes[0])
    if within_freedom:
        within = spread / within_freedom
    if freedom:
        between = apart / freedom
        total = sizes.sum()
        per_specimen = float((total - (sizes**2).sum() / total) / freedom)
    quotient, lowest, highest = _quotients(within, between, freedom, within_freedom)
    icc = _correlation(quotient, per_specimen)
    low = _correlation(lowest, per_specimen)
    high = _correlation(highest, per_specimen)
    return Repeatability(
        len(sizes), len(values), within_freedom, per_specimen, within, between, icc, low, high
    )


def _correlation(quotient: float, per_specimen: float) -> float:
    """Return ICC(1,1) for a quotient F = MSB / MSW."""
    if quotient == inf:
        return 1.0
    return (quotient - 1) / (quotient + per_specimen - 1)


def _quotients(
    within: float, between: float, freedom: int, within_freedom: int
) -> tuple[float, float, float]:
    """Return F = MSB / MSW, and both ends of its interval."""
    if not (isfinite(within) and isfinite(between)) or within == between == 0:
        return nan, nan, nan
    if within == 0:
        return inf, inf, inf
    quantile = need("scipy.special", "science").fdtri
    quotient = between / within
    above = float(quantile(freedom, within_freedom, 0.975))
    below = float(quantile(within_freedom, freedom, 0.975))
    return quotient, quotient / above, quotient * below
