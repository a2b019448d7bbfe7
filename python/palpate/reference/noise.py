"""Reference of the noise model of `handover_rls`: scale and correlation of the innovations, and whether the ratio drifts."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

WARM_UP = 8  # samples before the detector starts
TRANSIENT = 3  # first innovations, dominated by the error of the initial ratio
FEWEST = 32  # fewest innovations for a standard error; also limits the factor from variance to long-run variance
MEMORY = 0.995  # forgetting factor of the noise model
ALLOWED_OFFSET = 2  # of the innovations, in units of their roughness; above it the ratio drifts
DRIFT_FROM = 16  # innovations
MOST = 0.9  # share of a new sample in the ratio, while the ratio drifts
DOUBTED = 64  # samples while the scale, a mean of few magnitudes, is taken 1 + 3 / (samples - 2) times as large


@dataclass
class Noise:
    """Noise model: scale and autocorrelation of the innovations."""

    number: Callable[[Any], Any]
    magnitude: Any  # running mean of |whitened innovation|
    lag0: Any  # weighted sums of e(k)^2, e(k) e(k-1), e(k) e(k-2), and of 1
    lag1: Any
    lag2: Any
    weight: Any
    before: Any  # e(k-1), e(k-2)
    before_that: Any
    rho: Any
    offset: Any  # running means of e(k) and |e(k) - e(k-1)|
    roughness: Any
    due: int = WARM_UP - TRANSIENT  # samples until rho is estimated again

    def scale(self, output: Any, seen: int) -> Any:
        """Return the standard deviation of the whitened innovation: sqrt(pi / 2) times its mean magnitude.

        It is larger for the first samples, and never less than the rounding error.
        """
        rounding = (abs(output) + self.number(1e-18)) * self.number(1e-15)
        doubt = 1 + self.number(3) / (seen - TRANSIENT + 1) if WARM_UP <= seen < DOUBTED else self.number(1)
        return max(self.number(1.2533141) * self.magnitude * doubt, rounding)

    def add(self, e: Any) -> None:
        """Add an innovation."""
        self.follow_offset(e)
        memory = self.number(MEMORY)
        self.lag0 = memory * self.lag0 + e * e
        self.lag1 = memory * self.lag1 + e * self.before
        self.lag2 = memory * self.lag2 + e * self.before_that
        self.weight = memory * self.weight + 1
        self.remember(e)

    def add_outlier(self, e: Any) -> None:
        """Add what noise could have made of an outlier: not to the sums; to the offset only if the ratio drifts."""
        if self.drifts():
            self.follow_offset(e)
        self.remember(e)

    def follow_offset(self, e: Any) -> None:
        """Update the running means of the innovation and of its steps."""
        self.offset += (e - self.offset) / 16
        self.roughness += (abs(e - self.before) - self.roughness) / 32

    def drifts(self) -> bool:
        """Return whether the innovations have an offset that their noise does not explain."""
        return bool(abs(self.offset) > self.number(ALLOWED_OFFSET) * self.roughness and self.weight >= DRIFT_FROM)

    def least_share(self) -> Any:
        """Return the least share of a new sample in the ratio, while the ratio drifts."""
        return min(abs(self.offset) / self.roughness - self.number(ALLOWED_OFFSET), self.number(MOST))

    def remember(self, e: Any) -> None:
        """Keep the innovation for the next forecast."""
        self.before, self.before_that = e, self.before

    def correlations(self) -> tuple[Any, Any]:
        """Return the autocorrelations at lag 1 and 2."""
        return (self.lag1 / self.lag0, self.lag2 / self.lag0) if self.lag0 > 0 else (0 * self.lag0, 0 * self.lag0)

    def corrected(self, correlation: Any) -> Any:
        """Return a correlation corrected for Kendall's bias, -(1 + 3 r1) / n, within +-(FEWEST - 1) / (FEWEST + 1)."""
        limit = self.number(FEWEST - 1) / self.number(FEWEST + 1)
        return min(max(correlation + (1 + 3 * self.correlations()[0]) / self.weight, -limit), limit)

    def update_forecast(self, seen: int) -> None:
        """Estimate the autocorrelation anew, after every sample at first, then after every eighth."""
        self.due = 1 if seen < 32 else 8
        self.rho = self.corrected(self.correlations()[0])

    def long_run_variance(self) -> Any:
        """Return n times the variance of the mean of n innovations, for large n."""
        r1, r2 = self.correlations()
        variance = self.lag0 / self.weight
        partial = (r2 - r1 * r1) / (1 - r1 * r1) if r1 * r1 < 1 else 0
        if self.weight * partial**2 < self.number(6.63):  # chi-squared, 1 %: not significant, AR(1)
            return variance * (1 + self.rho) / (1 - self.rho)
        r1, r2 = self.corrected(r1), self.corrected(r2)
        # Yule-Walker coefficients of AR(2)
        first, second = r1 * (1 - r2) / (1 - r1 * r1), (r2 - r1 * r1) / (1 - r1 * r1)
        gap = 1 - first - second
        if gap <= 0:
            return variance * FEWEST
        factor = (1 - first * r1 - second * r2) / gap**2
        return variance * min(max(factor, 1 / self.number(FEWEST)), FEWEST)
