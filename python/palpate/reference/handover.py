"""Reference of the estimator of the scene "handheld": instrumental variables, a two-sided CUSUM, a hand-over at an alarm.

The core keeps sums since a CUSUM side was last 0; this keeps the samples, and adds them up at an alarm.
"""

from dataclasses import dataclass, field
from itertools import pairwise

WARM_UP = 8  # samples before the detector starts
TRANSIENT = 3  # first innovations, dominated by the error of the initial ratio
FEWEST = 32  # fewest innovations for a standard error; also limits the factor from variance to long-run variance
MEMORY = 0.995  # forgetting factor of the noise model
ALLOWED_OFFSET = 2  # of the innovations, in units of their roughness; above it the ratio drifts
# innovations: until a drift is seen; until what the press itself disturbs is past
DRIFT_FROM = 16
MATURE = 48
EXPECTED = 64  # innovations after a drift until the whole offset is allowed again, from half of it
MOST = 0.9  # share of a new sample in the ratio, while the ratio drifts
DOUBTED = 64  # samples while the scale, a mean of few magnitudes, is taken 1 + 3 / (samples - 2) times as large


@dataclass
class Noise:
    """Noise model: scale and autocorrelation of the innovations."""

    magnitude: float = 0.0  # running mean of |whitened innovation|
    lag0: float = 0.0  # weighted sums of e(k)^2, e(k) e(k-1), e(k) e(k-2), and of 1
    lag1: float = 0.0
    lag2: float = 0.0
    weight: float = 0.0
    before: float = 0.0  # e(k-1), e(k-2)
    before_that: float = 0.0
    rho: float = 0.0
    offset: float = 0.0  # running means of sign(x) e(k) and |e(k) - e(k-1)|
    roughness: float = 0.0
    due: int = WARM_UP - TRANSIENT  # samples until rho is estimated again
    since: int = EXPECTED  # innovations after a drift

    def scale(self, output: float, seen: int) -> float:
        """Return the standard deviation of the whitened innovation: sqrt(pi / 2) times its mean magnitude.

        It is larger for the first samples, and never less than the rounding error.
        """
        rounding = (abs(output) + 1e-18) * 1e-15
        doubt = 1 + 3 / (seen - TRANSIENT + 1) if WARM_UP <= seen < DOUBTED else 1
        return max(1.2533141 * self.magnitude * doubt, rounding)

    def add(self, e: float, sign: int) -> None:
        """Add an innovation, of a regressor of this sign."""
        self.follow_offset(e, sign)
        self.lag0 = MEMORY * self.lag0 + e * e
        self.lag1 = MEMORY * self.lag1 + e * self.before
        self.lag2 = MEMORY * self.lag2 + e * self.before_that
        self.weight = MEMORY * self.weight + 1
        self.remember(e)

    def add_outlier(self, e: float, sign: int) -> None:
        """Add what noise could have made of an outlier: not to the sums; to the offset only if the ratio drifts."""
        if self.drifts():
            self.follow_offset(e, sign)
        self.remember(e)

    def follow_offset(self, e: float, sign: int) -> None:
        """Update the running means of the innovation and of its steps."""
        self.since += 1
        self.offset += (sign * e - self.offset) / 16
        self.roughness += (abs(e - self.before) - self.roughness) / 32

    def allowed(self) -> float:
        """Return the offset, in units of the roughness, above which the ratio drifts."""
        return min(ALLOWED_OFFSET / 2 + self.since / EXPECTED, ALLOWED_OFFSET)

    def drifts(self) -> bool:
        """Return whether the innovations have an offset that their noise does not explain."""
        return bool(
            abs(self.offset) > self.allowed() * self.roughness and self.weight >= DRIFT_FROM
        )

    def least_share(self) -> float:
        """Return the least share of a new sample in the ratio, while the ratio drifts."""
        return min(abs(self.offset) / self.roughness - self.allowed(), MOST)

    def remember(self, e: float) -> None:
        """Keep the innovation for the next forecast."""
        self.before, self.before_that = e, self.before

    def correlations(self) -> tuple[float, float]:
        """Return the autocorrelations at lag 1 and 2."""
        if not self.lag0 > 0:
            return 0.0, 0.0
        return self.lag1 / self.lag0, self.lag2 / self.lag0

    def corrected(self, correlation: float) -> float:
        """Return a correlation corrected for Kendall's bias, -(1 + 3 r1) / n, within +-(FEWEST - 1) / (FEWEST + 1)."""
        limit = (FEWEST - 1) / (FEWEST + 1)
        return min(max(correlation + (1 + 3 * self.correlations()[0]) / self.weight, -limit), limit)

    def update_forecast(self, seen: int) -> None:
        """Estimate the autocorrelation anew, after every sample at first, then after every eighth."""
        self.due = 1 if seen < 32 else 8
        self.rho = self.corrected(self.correlations()[0])

    def long_run_variance(self, *, aliases: bool = False) -> float:
        """Return n times the variance of the mean of n innovations, for large n; `aliases`: no oscillation cancels."""
        r1, r2 = self.correlations()
        variance = self.lag0 / self.weight
        partial = (r2 - r1 * r1) / (1 - r1 * r1) if r1 * r1 < 1 else 0
        if aliases or self.weight * partial**2 < 6.63:  # chi-squared, 1 %: not significant, AR(1)
            return variance * (1 + self.rho) / (1 - self.rho)
        r1 = self.corrected(r1)
        r2 = self.corrected(r2)
        # Yule-Walker coefficients of AR(2)
        first = r1 * (1 - r2) / (1 - r1 * r1)
        second = (r2 - r1 * r1) / (1 - r1 * r1)
        gap = 1 - first - second
        if gap <= 0:
            return variance * FEWEST
        factor = (1 - first * r1 - second * r2) / gap**2
        return variance * min(max(factor, 1 / FEWEST), FEWEST)


SETTLED = 16  # fewest samples since the last change for a standard error


@dataclass
class _Side:
    """A CUSUM side, with the (weight, output, regressor) of each sample since it was last 0."""

    statistic: float = 0.0
    samples: list[tuple[float, float, float]] = field(default_factory=list)

    def after(self, step: float, sample: tuple[float, float, float]) -> "_Side":
        total = self.statistic + step
        return _Side(total, [*self.samples, sample]) if total > 0 else _Side()


class _Handover:
    """The estimator, with the defaults of the scene."""

    def __init__(self, initial_covariance: float = 1e10) -> None:
        self.steady = 0.9995
        self.drift = 0.75
        self.threshold = 10.0
        self.clip = 3.0
        self.smoothing = 0.0625
        self.guard = 5
        self.base = 1.0
        self.information = 1 / initial_covariance
        self.least = 1e-12  # information: 1 / max_covariance
        # The sums of (lambda^k w)^2 and of lambda^k; the mean regressor.
        self.squares = self.weight = self.instrument = 0.0
        self.noise = Noise()
        self.up = _Side()
        self.down = _Side()
        self.seen = 0
        self.outlier = False  # the last sample
        self.drifting = False  # the ratio, before the last sample
        self.row: list[tuple[float, float]] = []  # innovations of the last outliers in a row
        # while the ratio drifts: the mean innovation, and what it adds to the ratio
        self.lag = self.lead = 0.0

    @property
    def ratio(self) -> float:
        return self.base + self.lead

    def statistic(self) -> float:
        return max(self.up.statistic, self.down.statistic)

    def alarm(self) -> bool:
        return bool(self.statistic() > self.threshold)

    def update(self, output: float, regressor: float) -> None:
        e = output - regressor * self.base
        # The mean of the earlier regressors; the regressor itself if the two differ by more than a factor of 4.
        size = abs(self.instrument)
        x = abs(regressor)
        leads = self.instrument * regressor > 0 and size < 4 * x and x < 4 * size
        w = self.instrument if leads else regressor
        whitened = e - self.noise.rho * self.noise.before
        scale = self.noise.scale(output, self.seen)
        watching = self.seen >= WARM_UP
        outlier = watching and abs(whitened) > self.clip * scale
        if watching:
            clipped = min(max(whitened, -self.clip * scale), self.clip * scale)
        else:
            clipped = whitened
        if self.alarm():
            self.up, self.down = _Side(), _Side()
        if watching:
            z = clipped / scale if regressor >= 0 else -clipped / scale
            self.up = self.up.after(z - self.drift, (w, output, regressor))
            self.down = self.down.after(-z - self.drift, (w, output, regressor))
        self.row = [*self.row, (e, regressor)] if outlier else []
        if self.alarm() and self._differ():
            self.up, self.down = _Side(), _Side()
        self.outlier, self.drifting = outlier, bool(self.noise.drifts())
        limited = self.noise.rho * self.noise.before + clipped if outlier else e
        gain = 0.0
        if self.alarm():
            self._hand_over()
        elif not outlier or self.noise.drifts():
            gain = self._follow(w, regressor, limited)
        self._learn(limited, clipped, outlier, -1 if regressor < 0 else 1)
        # The instrument: the mean of the first 1 / smoothing regressors, then an exponential mean.
        self.instrument += max(self.smoothing, 1 / self.seen) * (regressor - self.instrument)
        self._follow_lag(limited, gain)

    def _follow(self, w: float, regressor: float, e: float) -> float:
        """Update the information and the ratio, R' = lambda R + w x, r' = r + (w / R') e; return w / R'.

        While the ratio drifts, lambda is so small that a sample as large as the mean has at least the least share.
        """
        forgetting = self.steady
        if self.noise.drifts():
            forgetting = min(
                forgetting,
                self._recent_square() * (1 / self.noise.least_share() - 1) / self.information,
            )
        left = forgetting * self.information
        bounded = max(left, min(self.least, self.information))
        self.information = left + w * regressor if w * regressor > 0 else bounded
        self.base += w / self.information * e
        self.squares = forgetting**2 * self.squares + w * w
        self.weight = forgetting * self.weight + 1
        return w / self.information

    def _recent_square(self) -> float:
        """Return the square of the mean of the last regressors; where their signs differ, the mean of squares."""
        return max(self.instrument**2, self.squares / self.weight)

    def _follow_lag(self, e: float, gain: float) -> None:
        """While the ratio drifts, add what the recursion is behind: the mean innovation, less the share that is corrected."""
        noise = self.noise
        drifts = self.drifting and not self.alarm()
        mature = noise.weight >= MATURE
        if drifts and mature:
            noise.since = 0
        if drifts and mature and self._recent_square():
            share = min(max(gain * self.instrument, 0), 1)
            self.lag += share * (e - self.lag)
            self.lead = (1 - share) * self.lag * self.instrument / self._recent_square()
        else:
            self.lag = self.lead = 0.0

    def _differ(self) -> bool:
        """Return whether outliers in a row are not as large as their regressors: in a burst; after a change they are."""
        steps = size = 0.0
        for (before, x_before), (e, x) in pairwise([*self.row[:1], *self.row]):
            steps = steps / 2 + abs(e * x_before - before * x)
            size = size / 2 + abs(e * x)
        return bool(3 * steps > size)

    def _hand_over(self) -> None:
        """Estimate again: from the samples since the CUSUM side was last 0, without the first `guard`, at least from one."""
        since = (self.up if self.up.statistic > self.down.statistic else self.down).samples
        samples = since[self.guard :] or since[-1:]
        self.squares = sum((w * w for w, _, _ in samples), 0.0)
        self.information = sum((w * x for w, _, x in samples), 0.0)
        self.base = sum((w * y for w, y, _ in samples), 0.0) / self.information
        self.weight = float(len(samples))

    def _learn(self, e: float, clipped: float, outlier: bool, sign: int) -> None:
        self.seen += 1
        if (count := self.seen - TRANSIENT) <= 0:
            return
        noise = self.noise
        noise.magnitude += max(0.02, 1 / count) * (abs(clipped) - noise.magnitude)
        if outlier:
            noise.add_outlier(e, sign)
        else:
            noise.add(e, sign)
            noise.due -= 1
            if noise.due <= 0:
                noise.update_forecast(self.seen)
        if self.alarm():
            noise.before = noise.before_that = noise.offset = 0.0
            noise.since = EXPECTED
