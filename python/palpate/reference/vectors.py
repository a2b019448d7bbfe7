"""Reference of `palpate.VectorRls`: normal equations, solved anew for each sample, and all samples kept."""

from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.reference.adaptive import FEWEST, FORGETTING, Innovation, Noise

WARM_UP = 8  # innovations before the detector starts
FIRST = 16  # innovations in which nothing is suspected
SUSPICION = 2  # a side of the CUSUM above it: noise is not learned
WINDOW = 32  # most samples of a hand-over
DIGITS = 80
ROUNDING = 2.0**-48
TOLERANCE = 4 * ROUNDING
EPS = Decimal(2) ** -52
MEMORY = Decimal(FORGETTING)  # of the influences
MOST = Decimal(FEWEST - 1) / (FEWEST + 1)  # the largest correlation of influences


class VectorTrace(NamedTuple):
    """State of `vector_rls` after each sample.

    Attributes
    ----------
    coefficients : numpy.ndarray, shape (n, size), output / regressor
    standard_errors : numpy.ndarray, shape (n, size)
        Of the coefficients; nan until they are known.
    innovation : numpy.ndarray, shape (n,)
        Output minus its prediction with the coefficients before the sample.
    statistic : numpy.ndarray, shape (n,)
        Largest of the CUSUM sides, in units of the scale of the innovations.
    degrees_of_freedom : numpy.ndarray, shape (n,)
        Of Student's t for the standard errors; 0 until they are known.
    alarm : numpy.ndarray of bool, shape (n,)

    Examples
    --------
    >>> vector_rls([1.0, 2.0, 3.0], [[1.0], [2.0], [3.0]]).alarm
    array([False, False, False])
    """

    coefficients: NDArray[Any]
    standard_errors: NDArray[Any]
    innovation: NDArray[Any]
    statistic: NDArray[Any]
    degrees_of_freedom: NDArray[Any]
    alarm: NDArray[np.bool_]


def solved(matrix: Any, right: Any) -> Any:
    """Return the solution of a positive definite system, by elimination in the arithmetic of its elements."""
    rows = np.column_stack([matrix, right]).astype(object)
    for i in range(len(rows)):
        rows[i] = rows[i] / rows[i, i]
        for k in range(len(rows)):
            if k != i:
                rows[k] = rows[k] - rows[k, i] * rows[i]
    return rows[:, len(matrix) :].reshape(np.shape(right))


class _Fit:
    """Weighted least squares: sums, and what follows from them."""

    def __init__(self, information: Any, about: Any) -> None:
        zero = 0 * information
        self.coefficients = about
        self.information = information * np.eye(len(about), dtype=int).astype(object)
        self.moments = information * about
        self.squares = zero * self.information
        self.residuals = self.count = self.count_squares = zero

    def add(self, forgetting: Any, sample: Any) -> tuple[Any, Any, "_Fit"]:
        """Return the rotated regressors, the weight of the residual, and the fit with the sample."""
        output, original = sample
        x = original.copy()
        rest = original.copy()
        discounted = forgetting * self.information
        for i in range(len(x)):
            before = solved(discounted[:i, :i], discounted[:i, i]) if i else x[:0]
            rest[i] = x[i] - (x[:i] @ before if i else 0)
            if rest[i] ** 2 * self.count_squares < Decimal(TOLERANCE) ** 2 * self.squares[i, i]:
                x[i] = x[i] - rest[i]
                rest[i] = 0 * rest[i]
        weight = 1 / (1 + x @ solved(discounted, x))
        fit = _Fit(0 * weight, self.coefficients)
        fit.information = discounted + np.outer(x, x)
        fit.moments = forgetting * self.moments + x * output
        fit.coefficients = solved(fit.information, fit.moments)
        fit.squares = forgetting**2 * self.squares + np.outer(original, original)
        fit.residuals = forgetting * self.residuals + weight * (output - x @ self.coefficients) ** 2
        fit.count = forgetting * self.count + 1
        fit.count_squares = forgetting**2 * self.count_squares + 1
        return rest, weight, fit

    def strengthened(self, information: Any) -> None:
        self.information = self.information + information * np.eye(len(self.moments), dtype=int)
        self.moments = self.information @ self.coefficients

    def number(self) -> Any:
        """Return the number of samples with equal weights that have the same variance."""
        return self.count**2 / self.count_squares

    def errors(self, prior: Any, factors: list[Decimal], recent: "_Fit") -> tuple[Any, Any]:
        """Return the variances of the coefficients and the degrees of freedom.

        `prior`: information without a sample. `recent`: a fit of the newest samples, which may show more than noise.
        """
        size = len(self.moments)
        inverse = solved(
            self.information, np.eye(size, dtype=int).astype(object) + 0 * self.information
        )
        determined = np.trace(inverse @ self.squares)
        left = self.count - determined
        if not (self.count > size + 3.5 and left > 0):
            return np.full(size, np.nan), 0.0
        variances = np.diag(inverse @ self.squares @ inverse) * self.residuals / left * factors
        apart = (recent.coefficients - self.coefficients) ** 2
        of_noise = variances * (self.number() / recent.number() - 1)
        variances = variances + np.maximum(apart - of_noise, 0 * apart)
        variances = variances + (EPS * self.coefficients) ** 2 * self.count_squares / 12
        unknown: Any = Decimal("nan")
        variances = np.where(prior * np.diag(inverse) < Decimal("0.01"), variances, unknown)
        return variances, left * self.count / self.count_squares


class _Influences:
    """The influences of samples on the coefficients: sums of their products over 0 and over 1 samples."""

    def __init__(self, size: int) -> None:
        self.last = self.lag0 = self.lag1 = np.array([Decimal(0)] * size, object)
        self.count = Decimal(0)

    def add(self, influences: Any) -> None:
        """Add those of a sample."""
        self.lag0 = MEMORY * self.lag0 + influences**2
        self.lag1 = MEMORY * self.lag1 + influences * self.last
        self.count = MEMORY * self.count + 1
        self.last = influences

    def factors(self) -> list[Decimal]:
        """Return by how much the variances of the coefficients are larger."""
        factors = []
        for lag0, lag1 in zip(self.lag0, self.lag1, strict=True):
            factor = Decimal(1)
            if lag1 > 0:
                estimate = lag1 / lag0
                real = estimate**2 / (estimate**2 + 1 / self.count)
                rho = min(MOST, estimate * real * (1 + 4 / (self.count + 4)))
                factor = (1 + rho) / (1 - rho)
            factors.append(factor)
        return factors


@dataclass(frozen=True)
class _Judged:
    """A whitened innovation, limited, and the innovation that belongs to it."""

    limited: Any
    counted: Any
    scale: Any
    watched: bool
    outlier: bool


@dataclass
class _Detector:
    """A two-sided CUSUM for each coefficient, then one of magnitudes, and the noise of what they add up."""

    drift: Any
    threshold: Any
    clip: Any
    switches: bool
    sides: Any
    noise: Noise
    alarm: bool = False
    seen: int = 0

    def judge(self, z: Any, output: Any) -> _Judged:
        """Return the whitened innovation, limited."""
        scale = self.noise.scale()
        if WARM_UP <= self.seen < 64:
            scale *= 1 + Decimal(3) / self.seen
        scale = max(scale, abs(output) * Decimal(ROUNDING) + Decimal("1e-280"))
        forecast = self.noise.forecast()
        limit = self.clip * scale
        watched = self.seen >= WARM_UP
        outlier = watched and abs(z - forecast) > limit
        limited = z - forecast
        if outlier:
            limited = limit.copy_sign(limited)
        return _Judged(limited, forecast + limited, scale, watched, outlier)

    def watch(self, judged: _Judged, rest: Any) -> None:
        """Update the sides and the alarm."""
        sides = self.sides
        threshold = self.threshold
        if self.alarm and self.switches:
            threshold = threshold / 4
        elif self.alarm:
            sides = 0 * sides
        z = judged.limited / judged.scale
        signed = np.array([-z if r < 0 else z for r in rest], object)
        magnitude = abs(z) - (self.drift + Decimal("0.8"))
        steps = [*(signed - self.drift), *(-signed - self.drift), magnitude]
        self.sides = np.array(
            [max(0 * s, s + step) for s, step in zip(sides, steps, strict=True)], object
        )
        self.alarm = bool(max(self.sides) > threshold)

    def learn(self, judged: _Judged, rest: Any, weight: Any) -> None:
        """Learn the noise."""
        if self.alarm and not self.switches:
            self.noise.waiting = []
            self.noise.before = Decimal(0)
        elif weight > Decimal("0.1"):
            self.seen += 1
            watches = self.seen >= FIRST and not self.switches
            suspected = watches and max(self.sides) > SUSPICION
            size = len(rest)
            larger = np.maximum(self.sides[:size], self.sides[size:-1])
            most = int(np.argmax(larger))
            falls = larger[most] > 0 and rest[most] < 0
            rise = suspected and bool((judged.limited > 0) != falls)
            one = Innovation(
                judged.limited, judged.counted, self.noise.before, rise, judged.outlier
            )
            self.noise.add(one, self.seen, suspected=suspected)
            self.noise.before = judged.counted

    def dismiss(self) -> None:
        """Begin anew: the alarm was noise."""
        self.alarm = False
        self.sides = 0 * self.sides
        if self.noise.waiting:
            self.noise.learn(self.seen)


def _shows_change(explained: Any, fit: _Fit, detector: _Detector) -> bool:
    """Return whether samples explain more than noise of the size of their residuals would."""
    left = fit.count - len(fit.moments)
    limit = 2 * detector.drift * detector.threshold
    return bool(left >= 2 and explained * left >= limit * fit.residuals)


def _handed_over(
    fit: _Fit, samples: list[Any], least: Any, scale: Any, detector: _Detector
) -> tuple[int, _Fit] | None:
    """Return how many of the last samples make a change before them most likely, and their fit; None if there is no change."""
    latest = _Fit(2 * least, fit.coefficients)
    squares = price = Decimal(0)
    found = []
    explained = []
    for m, (output, regressors) in enumerate(reversed(samples), 1):
        squares += (output - regressors @ fit.coefficients) ** 2
        _, weight, latest = latest.add(Decimal(1), (output, regressors))
        price += 2 * scale**2 * (1 - weight) / (1 + weight)
        explained.append(squares - latest.residuals)
        found.append((explained[-1] - price, m, latest))
    suspected = min(len(detector.noise.waiting) + 1, len(samples))
    if suspected >= len(fit.moments) + 2:
        _, m, best = max(found[:suspected], key=lambda one: one[0])
        shown = _shows_change(explained[m - 1] / 4, best, detector)
        if not (
            shown or _shows_change(explained[suspected - 1], found[suspected - 1][2], detector)
        ):
            return None
    _, m, best = max(found, key=lambda one: one[0])
    return m, best


class _Vector:
    """The estimator, with all of its samples."""

    def __init__(self, detector: _Detector, size: int, limits: tuple[Any, ...]) -> None:
        self.forgetting, self.fast, self.least, initial = limits
        self.detector = detector
        self.guarded = max(initial, self.least)
        self.fit = _Fit(self.guarded, np.array([Decimal(0)] * size, object))
        self.recent = self.fit
        self.recent_guarded = self.guarded
        self.influences = _Influences(size)
        self.samples: list[Any] = []
        self.held = 0

    def update(self, sample: Any) -> tuple[Any, ...]:
        """Take a sample; return the row of the trace."""
        innovation = sample[0] - sample[1] @ self.fit.coefficients
        rest, weight, following = self.fit.add(self.forgetting, sample)
        self.samples.append(sample)
        self.held = min(self.held + 1, WINDOW)
        judged = self.detector.judge(innovation * Decimal(weight) ** Decimal("0.5"), sample[0])
        if judged.watched:
            self.detector.watch(judged, rest)
        if not (self.detector.alarm and self.adapts(sample, judged.scale)):
            self.follow(following, sample, judged, weight)
        self.detector.learn(judged, rest, weight)
        variances, degrees = self.fit.errors(self.guarded, self.influences.factors(), self.recent)
        errors = variances ** Decimal("0.5") if degrees else variances
        statistic = max(self.detector.sides)
        return self.fit.coefficients, errors, innovation, statistic, degrees, self.detector.alarm

    def adapts(self, sample: Any, scale: Any) -> bool:
        """Return whether there is a change, and take it."""
        if self.fast:
            self.fit = self.fit.add(self.fast, sample)[2]
            self.guard(self.fast)
            self.follow_recent(sample)
            return True
        last = self.samples[-self.held :]
        found = _handed_over(self.fit, last, self.least, scale, self.detector)
        if found is None:
            self.detector.dismiss()
            return False
        self.held, self.fit = found
        self.guarded = 2 * self.least
        self.recent = self.fit
        self.recent_guarded = self.guarded
        return True

    def follow(self, following: _Fit, sample: Any, judged: _Judged, weight: Any) -> None:
        """Take the fit with the sample, unless it is an outlier."""
        if judged.outlier and not self.fast:
            return
        if judged.watched and weight > Decimal("0.1"):
            change = following.coefficients - self.fit.coefficients
            self.influences.add(change * following.count / judged.scale)
        self.fit = following
        self.guard(self.forgetting)
        self.follow_recent(sample)

    def guard(self, forgetting: Any) -> None:
        """Keep the least information."""
        self.guarded = self.guard_of(self.fit, self.guarded * forgetting)

    def follow_recent(self, sample: Any) -> None:
        """Add a sample to the fit with a quarter of the memory."""
        forgetting = 1 - 4 / (self.fit.count + 8 * len(self.fit.moments))
        self.recent = self.recent.add(forgetting, sample)[2]
        self.recent_guarded = self.guard_of(self.recent, self.recent_guarded * forgetting)

    def guard_of(self, fit: _Fit, guarded: Any) -> Any:
        """Keep the least information of a fit; return how much it has now."""
        if guarded >= self.least:
            return guarded
        fit.strengthened(2 * self.least - guarded)
        return 2 * self.least


def vector_rls(
    output: ArrayLike,
    regressors: ArrayLike,
    *,
    steady: float = 0.995,
    drift: float = 0.75,
    threshold: float = 12.0,
    clip: float = 3.0,
    alarmed: float = 0.0,
    initial_covariance: float = 1e30,
    max_covariance: float = 1e30,
) -> VectorTrace:
    """Coefficients of several regressors by recursive least squares with a change detector: reference of `palpate.VectorRls`.

    Parameters
    ----------
    output : array_like, shape (n,)
    regressors : array_like, shape (n, size)
        With an intercept, its regressor is a column of 1.
    steady : float
        Forgetting factor.
    drift, threshold, clip : float, standard deviations
        Slack and limit of the CUSUM, and the limit of an innovation in it.
    alarmed : float
        Forgetting factor during an alarm; 0: an alarm is a hand-over.
    initial_covariance, max_covariance : float, 1 / regressor^2

    Returns
    -------
    VectorTrace

    Notes
    -----
    All calculations have 80 digits: enough for covariances up to 1e30 times the inverse square of the regressors.

    Examples
    --------
    >>> from palpate.reference import vector_rls
    >>> rows = vector_rls([3.0, 5.0, 7.0], [[1.0, 1.0], [2.0, 1.0], [3.0, 1.0]])
    >>> rows.coefficients[-1].round(6)
    array([2., 1.])
    """
    settings = (drift, threshold, clip, steady, alarmed, initial_covariance, max_covariance)
    with localcontext(prec=DIGITS):
        return _trace(output, regressors, *map(Decimal, settings))


def _trace(
    output: ArrayLike,
    regressors: ArrayLike,
    drift: Decimal,
    threshold: Decimal,
    clip: Decimal,
    steady: Decimal,
    alarmed: Decimal,
    initial_covariance: Decimal,
    max_covariance: Decimal,
) -> VectorTrace:
    y = np.array([Decimal(v) for v in np.asarray(output, object)], object)
    x = np.array(
        [[Decimal(v) for v in row] for row in np.asarray(regressors, object)], object
    ).reshape(len(y), -1)
    size = x.shape[1]
    sides = np.array([Decimal(0)] * (2 * size + 1), object)
    noise = Noise(Decimal, Decimal(0))
    detector = _Detector(drift, threshold, clip, alarmed > 0, sides, noise)
    limits = (steady, alarmed, 1 / max_covariance, 1 / initial_covariance)
    vector = _Vector(detector, size, limits)
    rows = [vector.update(sample) for sample in zip(y, x, strict=True)]
    numbers = [np.array(column, float) for column in zip(*rows, strict=True)]
    return VectorTrace(
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5].astype(bool)
    )
