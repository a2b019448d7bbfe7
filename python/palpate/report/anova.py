"""Repeatability of the touches on several specimens: coefficient of variation, ICC(1,1), minimal detectable change.

One-way random effects, y_ij = mean + a_i + e_ij: specimen i, touch j. The logarithm of the ratio is compared, as the scatter
from touch to touch is proportional to the ratio. The model has one way, as no touch of one specimen belongs to a touch of
another: there are no judges whose differences could be taken out. That is ICC(1,1) of Shrout and Fleiss.

References
----------
P. E. Shrout, J. L. Fleiss, "Intraclass correlations: uses in assessing rater reliability", Psychol. Bull. 86 (1979) 420-428.
K. O. McGraw, S. P. Wong, "Forming inferences about some intraclass correlation coefficients", Psychol. Methods 1 (1996) 30-46.
S. R. Searle, G. Casella, C. E. McCulloch, "Variance Components", Wiley 1992, Sec. 3.6: the unbalanced case.
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
    """How touches on the same specimen agree, compared with how specimens differ; nan: unknown."""

    # within_freedom: touches - specimens; 0: no specimen was touched twice.
    # per_specimen: n_0, the touches of a specimen; a little less than the mean if the numbers differ.
    # within, between: mean squares within and between the specimens.
    # icc, low, high: ICC(1,1), and its 95 % interval; below 0 if specimens differ by less than their touches scatter.

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
        """Standard error of measurement: the standard deviation of a touch around its specimen. Of logarithms the CV."""
        return sqrt(self.within)

    def detectable(self, touches: int = 1) -> float:
        """Return the minimal detectable change between two means of so many touches: 1.96 sqrt(2) standard errors."""
        return _BOTH * self.error / sqrt(touches)

    def as_dict(self) -> dict[str, object]:
        """Return all values as plain numbers; None for what is unknown."""
        return number_format.plain(
            {**asdict(self), "error": self.error, "detectable": self.detectable()}
        )


def one_way_anova(groups: Sequence[Sequence[float]]) -> Repeatability:
    """Return the repeatability of values in groups, finite and one at least, by a one-way analysis of variance."""
    # ICC(1,1) = (MSB - MSW) / (MSB + (k - 1) MSW), with k values in a group. With different numbers n_i of values k is
    # n_0 = (N - sum n_i^2 / N) / (groups - 1). The interval follows from F = MSB / MSW (McGraw and Wong, Table 7), exact
    # for groups of one size and approximate for other ones. A group without a value does not count.
    sizes = np.array([len(group) for group in groups if len(group)], float)
    values = np.array([value for group in groups for value in group], float)
    means = np.array([np.mean(group) for group in groups if len(group)])
    freedom = (len(sizes) - 1, len(values) - len(sizes))
    spread = float(((values - np.repeat(means, sizes.astype(int))) ** 2).sum())
    apart = float(sizes @ (means - values.mean()) ** 2)
    within = spread / freedom[1] if freedom[1] else nan
    between = apart / freedom[0] if freedom[0] else nan
    per = (
        float((sizes.sum() - (sizes**2).sum() / sizes.sum()) / freedom[0])
        if freedom[0]
        else float(sizes[0])
    )
    correlation = (
        1.0 if f == inf else (f - 1) / (f + per - 1) for f in _quotients(within, between, freedom)
    )
    return Repeatability(len(sizes), len(values), freedom[1], per, within, between, *correlation)


def _quotients(
    within: float, between: float, freedom: tuple[int, int]
) -> tuple[float, float, float]:
    """Return F = MSB / MSW, and both ends of its interval."""
    if not (isfinite(within) and isfinite(between)) or within == between == 0:
        return nan, nan, nan
    if within == 0:
        return inf, inf, inf
    quantile, found = need("scipy.special", "science").fdtri, between / within
    return (
        found,
        found / float(quantile(*freedom, 0.975)),
        found * float(quantile(*freedom[::-1], 0.975)),
    )
