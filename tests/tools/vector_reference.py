"""Reference of VectorRls: normal equations, solved anew for each sample, and all samples kept."""

from dataclasses import dataclass
from decimal import Decimal
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

WARM_UP = 8  # innovations before the detector starts
WINDOW = 32  # most samples of a hand-over
ROUNDING = 2.0**-48
TOLERANCE = 4 * ROUNDING


class VectorTrace(NamedTuple):
    """State of `vector_rls` after each sample; standard errors are nan, and degrees of freedom 0, until they are known."""

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
        x, rest, discounted = original.copy(), original.copy(), forgetting * self.information
        for i in range(len(x)):
            before = solved(discounted[:i, :i], discounted[:i, i]) if i else x[:0]
            rest[i] = x[i] - (x[:i] @ before if i else 0)
            if rest[i] ** 2 * self.count_squares < Decimal(TOLERANCE) ** 2 * self.squares[i, i]:
                x[i], rest[i] = x[i] - rest[i], 0 * rest[i]
        weight = 1 / (1 + x @ solved(discounted, x))
        fit = _Fit(0 * weight, self.coefficients)
        fit.information = discounted + np.outer(x, x)
        fit.moments = forgetting * self.moments + x * output
        fit.coefficients = solved(fit.information, fit.moments)
        fit.squares = forgetting**2 * self.squares + np.outer(original, original)
        fit.residuals = forgetting * self.residuals + weight * (output - x @ self.coefficients) ** 2
        fit.count, fit.count_squares = (
            forgetting * self.count + 1,
            forgetting**2 * self.count_squares + 1,
        )
        return rest, weight, fit

    def strengthened(self, information: Any) -> None:
        self.information = self.information + information * np.eye(len(self.moments), dtype=int)
        self.moments = self.information @ self.coefficients

    def errors(self, prior: Any) -> tuple[Any, Any]:
        """Return the variances of the coefficients and the degrees of freedom; `prior`: information without a sample."""
        size = len(self.moments)
        inverse = solved(
            self.information, np.eye(size, dtype=int).astype(object) + 0 * self.information
        )
        determined = np.trace(inverse @ self.squares)
        left = self.count - determined
        if not (self.count > size + 3.5 and left > 0):
            return np.full(size, np.nan), 0.0
        variances = np.diag(inverse @ self.squares @ inverse) * self.residuals / left
        unknown: Any = Decimal("nan")
        variances = np.where(prior * np.diag(inverse) < Decimal("0.01"), variances, unknown)
        return variances, left * self.count / self.count_squares


@dataclass
class _Detector:
    """A two-sided CUSUM for each coefficient, then one of magnitudes, and the scale of what they add up."""

    drift: Any
    threshold: Any
    clip: Any
    switches: bool
    sides: Any
    mean: Any
    alarm: bool = False
    seen: int = 0

    def scale(self, output: Any) -> Any:
        scale = (
            Decimal("1.2533141")
            * self.mean
            * (1 + Decimal(3) / self.seen if WARM_UP <= self.seen < 64 else 1)
        )
        return max(scale, abs(output) * Decimal(ROUNDING) + Decimal("1e-280"))

    def take(self, z: Any, scale: Any, rest: Any, weight: Any) -> bool:
        """Return whether z is an outlier."""
        limit = self.clip * scale
        outlier = self.seen >= WARM_UP and abs(z) > limit
        clipped = (limit if z > 0 else -limit) if outlier else z
        if self.seen >= WARM_UP:
            sides = 0 * self.sides if self.alarm and not self.switches else self.sides
            signed = np.array([-clipped if r < 0 else clipped for r in rest], object) / scale
            magnitude = abs(clipped) / scale - (self.drift + Decimal("0.8"))
            steps = [*(signed - self.drift), *(-signed - self.drift), magnitude]
            self.sides = np.array(
                [max(0 * s, s + step) for s, step in zip(sides, steps, strict=True)], object
            )
            self.alarm = bool(
                max(self.sides) > self.threshold / (4 if self.alarm and self.switches else 1)
            )
        if weight > Decimal("0.1"):
            self.seen += 1
            share = Decimal("0.02") if self.seen * Decimal("0.02") >= 1 else Decimal(1) / self.seen
            self.mean += share * (abs(clipped) - self.mean)
        return bool(outlier)


def _handed_over(fit: _Fit, samples: list[Any], least: Any, scale: Any) -> tuple[int, _Fit]:
    """Return how many of the last samples make a change before them most likely, and their fit."""
    latest, gain, found = _Fit(2 * least, fit.coefficients), Decimal(0), []
    for m, (output, regressors) in enumerate(reversed(samples), 1):
        gain += (output - regressors @ fit.coefficients) ** 2
        _, weight, latest = latest.add(Decimal(1), (output, regressors))
        gain -= 2 * scale**2 * (1 - weight) / (1 + weight)
        found.append((gain - latest.residuals, m, latest))
    _, m, best = max(found, key=lambda one: one[0])
    return m, best


def vector_rls(
    output: ArrayLike,
    regressors: ArrayLike,
    *,
    steady: float = 0.995,
    drift: float = 0.75,
    threshold: float = 12.0,
    clip: float = 3.0,
    alarmed: float = 0.0,
    initial_covariance: float = 1e280,
    max_covariance: float = 1e280,
) -> VectorTrace:
    """Return the trace of outputs, shape (n,), and regressors, shape (n, size), as Decimals; settings as of `palpate.VectorRls`."""
    forgetting, fast, least = Decimal(steady), Decimal(alarmed), 1 / Decimal(max_covariance)
    y = np.array([Decimal(v) for v in np.asarray(output, object)], object)
    x = np.array(
        [[Decimal(v) for v in row] for row in np.asarray(regressors, object)], object
    ).reshape(len(y), -1)
    guarded, held = max(1 / Decimal(initial_covariance), least), 0
    fit = _Fit(guarded, 0 * x[0])
    sides = np.array([Decimal(0)] * (2 * x.shape[1] + 1), object)
    detector = _Detector(
        Decimal(drift), Decimal(threshold), Decimal(clip), bool(fast), sides, Decimal(0)
    )
    rows: list[tuple[Any, ...]] = []
    for k, sample in enumerate(zip(y, x, strict=True)):
        innovation = sample[0] - sample[1] @ fit.coefficients
        rest, weight, following = fit.add(forgetting, sample)
        scale, held = detector.scale(sample[0]), min(held + 1, WINDOW)
        outlier = detector.take(innovation * Decimal(weight) ** Decimal("0.5"), scale, rest, weight)
        if detector.alarm and not fast:
            samples = list(zip(y, x, strict=True))[k + 1 - held : k + 1]
            held, fit = _handed_over(fit, samples, least, scale)
            guarded = 2 * least
        elif fast or not outlier:
            factor = fast if detector.alarm else forgetting
            fit = fit.add(factor, sample)[2] if detector.alarm else following
            guarded *= factor
            if guarded < least:
                fit.strengthened(2 * least - guarded)
                guarded = 2 * least
        variances, degrees = fit.errors(guarded)
        errors = variances ** Decimal("0.5") if degrees else variances
        rows.append(
            (fit.coefficients, errors, innovation, max(detector.sides), degrees, detector.alarm)
        )
    numbers = [np.array(column, float) for column in zip(*rows, strict=True)]
    return VectorTrace(
        numbers[0], numbers[1], numbers[2], numbers[3], numbers[4], numbers[5].astype(bool)
    )
