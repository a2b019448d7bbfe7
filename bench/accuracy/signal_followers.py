"""Estimators of the ratio of any two signals for the bench any_two_signals: palpate's, and rivals with settings that suit it.

The rivals know two numbers that palpate does not know: the standard deviation of the noise, and the rms of the regressor.
With them their settings have no unit: the noise over the rms is the error of a ratio of one sample. They are compiled if
numba is installed.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import palpate
from numpy.typing import NDArray

from bench.accuracy.rivals import compiled
from bench.accuracy.signal_worlds import SeveralSignals, Signals

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trace:
    """What an estimator knows after each sample.

    Attributes
    ----------
    ratio : NDArray, shape (n,)
    error : NDArray, shape (n,)
        The interval of 95 % is `ratio` +- 1.96 `error`; nan where it is unknown.
    alarm : NDArray of bool, shape (n,)
    detects : bool
        Whether it has alarms at all.
    """

    ratio: Array
    error: Array
    alarm: NDArray[np.bool_]
    detects: bool = True


@dataclass(frozen=True)
class SeveralTrace:
    """What an estimator of several coefficients knows: as `Trace`, coefficients and errors have the shape (n, size)."""

    coefficients: Array
    error: Array
    alarm: NDArray[np.bool_]


Follower = Callable[[Signals], Trace]
ANY_START = 1e30
"""Initial covariance that says nothing about the ratio at the start."""


def handover(signals: Signals) -> Trace:
    """Follow with HandoverRls as it is."""
    return handover_trace(palpate.HandoverRls(), signals)


def handover_trace(estimator: palpate.HandoverRls, signals: Signals) -> Trace:
    """Follow with a HandoverRls of some settings."""
    rows = estimator.trace(signals.output, signals.regressor)
    return Trace(rows["ratio"], rows["standard_error"], rows["alarm"])


BLOCK = 10  # samples for which the degrees of freedom at their end count


def vector_trace(estimator: palpate.VectorRls, signals: SeveralSignals) -> SeveralTrace:
    """Follow with VectorRls; its intervals have the quantile of Student's t for its degrees of freedom."""
    from scipy.stats import t

    size = len(signals.output)
    blocks = []
    freedoms = []
    for begin in range(0, size, BLOCK):
        part = slice(begin, begin + BLOCK)
        blocks.append(estimator.trace(signals.output[part], signals.regressors[part]))
        freedoms.append(estimator.degrees_of_freedom)
    rows = np.concatenate(blocks)
    quantiles = t.ppf(0.975, np.maximum(freedoms, 1e-9))
    widening = np.repeat(quantiles / 1.96, BLOCK)[:size]
    error = rows["standard_errors"] * widening[:, None]
    return SeveralTrace(rows["coefficients"], error, rows["alarm"])


def one_regressor(signals: Signals) -> Trace:
    """Follow with VectorRls of one regressor."""
    several = SeveralSignals(
        signals.output, signals.regressor[:, None], signals.ratio[:1], intercept=False
    )
    found = vector_trace(palpate.VectorRls(1), several)
    return Trace(found.coefficients[:, 0], found.error[:, 0], found.alarm)


FORGETTING = 0.98


def plain(signals: Signals) -> Trace:
    """Follow with Rls(.98). With weights w(i) = .98^age, var(ratio) = noise^2 sum(w^2 x^2) / sum(w x^2)^2."""
    from scipy.signal import lfilter

    estimator = palpate.Rls(
        forgetting=FORGETTING, initial_covariance=ANY_START, max_covariance=ANY_START
    )
    rows = estimator.trace(signals.output, signals.regressor)
    squares = signals.regressor**2
    once = lfilter([1.0], [1.0, -FORGETTING], squares)
    twice = lfilter([1.0], [1.0, -(FORGETTING**2)], squares)
    error = signals.noise * np.sqrt(twice) / np.maximum(once, 1e-300)
    return without_alarm(rows["ratio"], error)


def without_alarm(ratio: Array, error: Array) -> Trace:
    """Return the trace of an estimator that has no detector."""
    return Trace(ratio, error, np.zeros(len(ratio), bool), detects=False)


def one_sample(signals: Signals) -> float:
    """Return the standard deviation of the ratio of one sample: noise over rms of the regressor."""
    return signals.noise / math.sqrt(float(np.mean(signals.regressor**2)))


WALK = 0.03  # standard deviation of a step of the ratio, in units of `one_sample`


@compiled
def _kalman_walk(output: Array, regressor: Array, noise: float, unit: float) -> tuple[Array, Array]:
    """Return ratio and error of a ratio that is a random walk."""
    ratios = np.empty(len(output))
    errors = np.empty(len(output))
    ratio = 0.0
    p = (1e6 * unit) ** 2
    for k, x in enumerate(regressor):
        p += (WALK * unit) ** 2
        variance = x * x * p + noise**2
        ratio += p * x / variance * (output[k] - x * ratio)
        p *= noise**2 / variance
        ratios[k] = ratio
        errors[k] = math.sqrt(p)
    return ratios, errors


def kalman_walk(signals: Signals) -> Trace:
    """Follow with a Kalman filter whose state, the ratio, is a random walk."""
    unit = one_sample(signals)
    return without_alarm(
        *_kalman_walk(signals.output, signals.regressor, signals.noise, unit)  # type: ignore[call-arg]
    )


GLR_LIMIT, GLR_WINDOW, GLR_SHORTEST, GLR_CLIP = (33.0, 400, 4, 4.0)


@compiled
def _robust_glr(output: Array, regressor: Array, noise: float) -> tuple[Array, Array, Array]:
    """Return ratio, error and alarm of least squares since the most likely step.

    With the ratios d apart before and after a split, 2 ln(likelihood ratio) is d^2 / (noise^2 (1 / sum_before(x^2) +
    1 / sum_after(x^2))). Robust: an innovation counts at most `GLR_CLIP` standard deviations.
    """
    ratios = np.zeros(len(output))
    errors = np.full(len(output), np.nan)
    alarms = np.zeros(len(output), np.bool_)
    xx = regressor * regressor
    xy = regressor * output
    start = 0
    all_xx = all_xy = 0.0
    for k, x in enumerate(regressor):
        if k - start >= GLR_SHORTEST and all_xx > 0:
            ratio = all_xy / all_xx
            most = GLR_CLIP * noise * math.sqrt(1 + xx[k] / all_xx)
            innovation = output[k] - ratio * x
            xy[k] = x * (ratio * x + min(max(innovation, -most), most))
        all_xx += xx[k]
        all_xy += xy[k]
        best = GLR_LIMIT * noise**2
        split = -1
        after_xx = after_xy = 0.0
        for i in range(k, max(start + GLR_SHORTEST, k - GLR_WINDOW) - 1, -1):
            after_xx += xx[i]
            after_xy += xy[i]
            before_xx = all_xx - after_xx
            apart = after_xy * all_xx - all_xy * after_xx  # step * before * after
            if apart**2 > best * after_xx * before_xx * all_xx:
                best = apart**2 / (after_xx * before_xx * all_xx)
                split = i
        if split >= 0:
            start = split
            all_xx = xx[start : k + 1].sum()
            all_xy = xy[start : k + 1].sum()
            alarms[k] = True
        if all_xx > 0:
            ratios[k] = all_xy / all_xx
            errors[k] = noise / math.sqrt(all_xx)
    return ratios, errors, alarms


def robust_glr(signals: Signals) -> Trace:
    """Follow with the generalised likelihood ratio of a step at each of the last 400 samples: Willsky and Jones, 1976."""
    return Trace(*_robust_glr(signals.output, signals.regressor, signals.noise))  # type: ignore[call-arg]


TO_MOVING, TO_STILL = (1e-3, 0.1)  # probability of a transition, for each sample
STILL, JUMP = (0.01, 3.0)  # standard deviation of a step of the ratio, in units of `one_sample`


@compiled
def _imm(output: Array, regressor: Array, noise: float, unit: float) -> tuple[Array, Array, Array]:
    """Return ratio, error and the probability that the ratio moves, of two interacting models."""
    ratios = np.empty(len(output))
    errors = np.empty(len(output))
    shares = np.empty(len(output))
    still = moving = 0.0
    still_p = moving_p = (1e6 * unit) ** 2
    share = 0.5  # probability that it moves
    for k, x in enumerate(regressor):
        prior = TO_MOVING * (1 - share) + (1 - TO_STILL) * share
        apart = moving - still
        # each model begins with the mixture of both
        from_moving = TO_STILL * share / (1 - prior)
        mixed = still + from_moving * apart
        mixed_p = still_p + from_moving * (moving_p - still_p + (1 - from_moving) * apart**2)
        mixed_p += (STILL * unit) ** 2
        from_still = TO_MOVING * (1 - share) / prior
        moved = moving - from_still * apart
        moved_p = moving_p + from_still * (still_p - moving_p + (1 - from_still) * apart**2)
        moved_p += (JUMP * unit) ** 2
        still_s = x * x * mixed_p + noise**2
        moving_s = x * x * moved_p + noise**2
        still_e = output[k] - x * mixed
        moving_e = output[k] - x * moved
        still = mixed + mixed_p * x / still_s * still_e
        moving = moved + moved_p * x / moving_s * moving_e
        still_p = mixed_p * noise**2 / still_s
        moving_p = moved_p * noise**2 / moving_s
        log_odds = 0.5 * (still_e**2 / still_s - moving_e**2 / moving_s)
        odds = math.exp(min(max(log_odds, -300.0), 300.0)) * math.sqrt(still_s / moving_s)
        share = odds * prior / (odds * prior + 1 - prior)
        share = min(max(share, 1e-12), 1 - 1e-12)
        apart = moving - still
        ratios[k] = still + share * apart
        spread = still_p + share * (moving_p - still_p + (1 - share) * apart**2)
        errors[k] = math.sqrt(spread)
        shares[k] = share
    return ratios, errors, shares


def imm(signals: Signals) -> Trace:
    """Follow with two interacting models, still and moving: Blom and Bar-Shalom, 1988. Moving more likely is an alarm."""
    found = _imm(signals.output, signals.regressor, signals.noise, one_sample(signals))  # type: ignore[call-arg]
    ratio, error, share = found
    return Trace(ratio, error, share > 0.5)


WALKS = np.array([0.0, 1e-3, 0.01, 0.1, 1.0, 30.0])  # as `WALK`
REMEMBERED = 0.99


@compiled
def _dma(output: Array, regressor: Array, noise: float, unit: float) -> tuple[Array, Array]:
    """Return ratio and error of the mean over random walks, each weighted by how well it predicted."""
    ratios = np.empty(len(output))
    errors = np.empty(len(output))
    mean = np.zeros(len(WALKS))
    p = np.full(len(WALKS), (1e6 * unit) ** 2)
    weights = np.zeros(len(WALKS))  # logarithms
    for k, x in enumerate(regressor):
        for i, walk in enumerate(WALKS):
            before = p[i] + (walk * unit) ** 2
            variance = x * x * before + noise**2
            e = output[k] - x * mean[i]
            weights[i] = REMEMBERED * weights[i] - 0.5 * (e * e / variance + math.log(variance))
            mean[i] += before * x / variance * e
            p[i] = before * noise**2 / variance
        weights -= weights.max()
        shares = np.exp(weights)
        shares /= shares.sum()
        ratios[k] = (shares * mean).sum()
        errors[k] = math.sqrt((shares * (p + (mean - ratios[k]) ** 2)).sum())
    return ratios, errors


def dma(signals: Signals) -> Trace:
    """Follow with dynamic model averaging over random walks: Raftery, Karny and Ettler, 2010."""
    unit = one_sample(signals)
    return without_alarm(
        *_dma(signals.output, signals.regressor, signals.noise, unit)  # type: ignore[call-arg]
    )


RIVALS: dict[str, Follower] = {
    "VectorRls(1)": one_regressor,
    "Rls .98": plain,
    "Kalman": kalman_walk,
    "GLR": robust_glr,
    "IMM": imm,
    "DMA": dma,
}
"""Whose numbers are printed beside those of HandoverRls; VectorRls is palpate's, too."""
