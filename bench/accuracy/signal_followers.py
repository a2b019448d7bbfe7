"""Estimators of the ratio of any two signals for the bench any_two_signals: palpate's, and rivals with settings that suit it.

The rivals know two numbers that palpate does not know: the standard deviation of the noise, and the rms of the regressor.
The signals are divided by them, so that the settings of the rivals have no unit. These settings have the smallest errors in
the worlds where the ratio changes, with other seeds. The rivals that loop over samples are there if numba is installed.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
import palpate
from numpy.typing import NDArray

from bench.accuracy.rivals import Method, compiled
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


def in_own_units(estimate: Method, signals: Signals) -> Array:
    """Run a rival on signals whose noise is 1 and whose regressor has an rms of 1; its rows: ratio, error, any more."""
    regressor_rms = math.sqrt(float(np.mean(signals.regressor**2)))
    found = estimate(signals.output / signals.noise, signals.regressor / regressor_rms)
    found[:2] *= signals.noise / regressor_rms
    return found


WALK = (
    0.02  # standard deviation of a step of the ratio, in standard errors of the ratio of one sample
)
UNKNOWN = 1e12  # variance of a ratio before the first sample


@compiled
def _kalman_walk(output: Array, regressor: Array) -> Array:
    """Return ratio and error of a ratio that is a random walk."""
    found = np.empty((2, len(output)))
    ratio = 0.0
    p = UNKNOWN
    for k, x in enumerate(regressor):
        p += WALK**2
        variance = x * x * p + 1
        ratio += p * x / variance * (output[k] - x * ratio)
        p /= variance
        found[0, k] = ratio
        found[1, k] = math.sqrt(p)
    return found


def kalman_walk(signals: Signals) -> Trace:
    """Follow with a Kalman filter whose state, the ratio, is a random walk."""
    found = in_own_units(_kalman_walk, signals)
    return without_alarm(found[0], found[1])


# With this limit there are as few false alarms as palpate has. A lower limit has smaller errors.
GLR_LIMIT = 33.0
GLR_WINDOW = 400
GLR_SHORTEST = 4
GLR_CLIP = 4.0


@compiled
def _robust_glr(output: Array, regressor: Array) -> Array:
    """Return ratio, error and alarm of least squares since the most likely step.

    With the ratios d apart before and after a split, 2 ln(likelihood ratio) is d^2 / (1 / sum_before(x^2) +
    1 / sum_after(x^2)). Robust: an innovation counts at most `GLR_CLIP` standard deviations.
    """
    found = np.full((3, len(output)), np.nan)
    xx = regressor * regressor
    xy = regressor * output
    start = 0
    all_xx = all_xy = 0.0
    for k, x in enumerate(regressor):
        if k - start >= GLR_SHORTEST and all_xx > 0:
            most = GLR_CLIP * math.sqrt(1 + xx[k] / all_xx)
            prediction = x * all_xy / all_xx
            innovation = output[k] - prediction
            xy[k] = x * (prediction + min(max(innovation, -most), most))
        all_xx += xx[k]
        all_xy += xy[k]
        best = GLR_LIMIT
        split = -1
        after_xx = after_xy = 0.0
        for i in range(k, max(start + GLR_SHORTEST, k - GLR_WINDOW) - 1, -1):
            after_xx += xx[i]
            after_xy += xy[i]
            apart = after_xy * all_xx - all_xy * after_xx  # d * sum_before * sum_after
            product = after_xx * (all_xx - after_xx) * all_xx
            if apart**2 > best * product:
                best = apart**2 / product
                split = i
        if split >= 0:
            start = split
            all_xx = xx[start : k + 1].sum()
            all_xy = xy[start : k + 1].sum()
        found[0, k] = all_xy / all_xx
        found[1, k] = 1 / math.sqrt(all_xx)
        found[2, k] = split >= 0
    return found


def robust_glr(signals: Signals) -> Trace:
    """Follow with the generalised likelihood ratio of a step at each of the last 400 samples: Willsky and Jones, 1976."""
    found = in_own_units(_robust_glr, signals)
    return Trace(found[0], found[1], found[2] > 0)


# probability of a transition, for each sample
TO_MOVING = 1e-4
TO_STILL = 0.1
# standard deviation of a step of the ratio, as `WALK`
STILL = 0.01
JUMP = 1.0


@compiled
def _imm(output: Array, regressor: Array) -> Array:
    """Return ratio, error and the probability that the ratio moves, of two interacting models."""
    found = np.empty((3, len(output)))
    still = moving = 0.0
    still_p = moving_p = UNKNOWN
    share = 0.5  # probability that it moves
    for k, x in enumerate(regressor):
        prior = TO_MOVING * (1 - share) + (1 - TO_STILL) * share
        apart = moving - still
        # each model begins with the mixture of both
        from_moving = TO_STILL * share / (1 - prior)
        mixed = still + from_moving * apart
        mixed_p = still_p + from_moving * (moving_p - still_p + (1 - from_moving) * apart**2)
        mixed_p += STILL**2
        from_still = TO_MOVING * (1 - share) / prior
        moved = moving - from_still * apart
        moved_p = moving_p + from_still * (still_p - moving_p + (1 - from_still) * apart**2)
        moved_p += JUMP**2
        still_s = x * x * mixed_p + 1
        moving_s = x * x * moved_p + 1
        still_e = output[k] - x * mixed
        moving_e = output[k] - x * moved
        still = mixed + mixed_p * x / still_s * still_e
        moving = moved + moved_p * x / moving_s * moving_e
        still_p = mixed_p / still_s
        moving_p = moved_p / moving_s
        log_odds = 0.5 * (still_e**2 / still_s - moving_e**2 / moving_s)
        odds = math.exp(min(max(log_odds, -300.0), 300.0)) * math.sqrt(still_s / moving_s)
        share = odds * prior / (odds * prior + 1 - prior)
        share = min(max(share, 1e-12), 1 - 1e-12)
        apart = moving - still
        found[0, k] = still + share * apart
        spread = still_p + share * (moving_p - still_p + (1 - share) * apart**2)
        found[1, k] = math.sqrt(spread)
        found[2, k] = share
    return found


def imm(signals: Signals) -> Trace:
    """Follow with two interacting models, still and moving: Blom and Bar-Shalom, 1988. Moving more likely is an alarm."""
    found = in_own_units(_imm, signals)
    return Trace(found[0], found[1], found[2] > 0.5)


WALKS = np.array([0.0, 1e-3, 0.01, 0.1, 1.0, 30.0])  # as `WALK`
REMEMBERED = 0.995


@compiled
def _dma(output: Array, regressor: Array) -> Array:
    """Return ratio and error of the mean over random walks, each weighted by how well it predicted."""
    found = np.empty((2, len(output)))
    mean = np.zeros(len(WALKS))
    p = np.full(len(WALKS), UNKNOWN)
    weights = np.zeros(len(WALKS))  # logarithms
    for k, x in enumerate(regressor):
        for i, walk in enumerate(WALKS):
            before = p[i] + walk**2
            variance = x * x * before + 1
            e = output[k] - x * mean[i]
            weights[i] = REMEMBERED * weights[i] - 0.5 * (e * e / variance + math.log(variance))
            mean[i] += before * x / variance * e
            p[i] = before / variance
        weights -= weights.max()
        shares = np.exp(weights)
        shares /= shares.sum()
        ratio = (shares * mean).sum()
        found[0, k] = ratio
        found[1, k] = math.sqrt((shares * (p + (mean - ratio) ** 2)).sum())
    return found


def dma(signals: Signals) -> Trace:
    """Follow with dynamic model averaging over random walks: Raftery, Karny and Ettler, 2010."""
    found = in_own_units(_dma, signals)
    return without_alarm(found[0], found[1])


COMPILED: dict[str, Follower] = {
    "Kalman": kalman_walk,
    "GLR": robust_glr,
    "IMM": imm,
    "DMA": dma,
}
RIVALS: dict[str, Follower] = {"VectorRls(1)": one_regressor, "Rls .98": plain}
"""Whose numbers are printed beside those of HandoverRls; VectorRls and Rls are palpate's, too."""
if find_spec("numba"):
    RIVALS |= COMPILED
