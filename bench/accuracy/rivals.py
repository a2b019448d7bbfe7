"""Other estimators of the same ratio, for the benches: usual methods, and other libraries if they are installed.

Each takes outputs and regressors, pF, as arrays of shape (n,), and returns the ratio after each pair. Each library is set as
its user would set it for pF: forgetting 0.995, and an initial covariance that does not matter. The methods that loop over
samples are compiled if numba is installed. Their settings are the best over all scenarios, with other seeds, on aligned pairs.
"""

import math
import warnings
from collections.abc import Callable
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate.ad7746.registers import NOISE_PF

Array = NDArray[np.float64]
COVARIANCE = (
    1e12  # P0, 1/pF^2: 1 / P0 is far below x^2 of a sample of the lightest press, 4e-8 pF^2
)
FORGETTING = 0.995
WALK = 0.5623  # variance of the ratio's random walk / variance of the noise, 1/pF^2
NOISE = NOISE_PF[0]
Method = Callable[[Array, Array], Array]


def compiled(estimate: Method) -> Method:
    """Compile an estimator when it is first called; without numba it stays a loop in Python."""
    if not find_spec("numba"):
        return estimate
    from numba import njit

    compiled_estimate: Method = njit(error_model="numpy")(estimate)
    return compiled_estimate


def padasip(output: Array, regressor: Array) -> Array:
    """Estimate with padasip's FilterRLS."""
    from padasip.filters import FilterRLS

    # eps is 1 / P0; its default of 0.001 is for data near 1.
    model = FilterRLS(1, mu=FORGETTING, eps=1 / COVARIANCE, w=np.zeros(1))
    ratio = np.empty(len(output))
    for k, (y, x) in enumerate(zip(output, regressor[:, None], strict=True)):
        model.adapt(y, x)
        ratio[k] = model.w[0]
    return ratio


def river(output: Array, regressor: Array) -> Array:
    """Estimate with river's BayesianLinearRegression."""
    from river.linear_model import BayesianLinearRegression

    # A sample adds (1 - smoothing) beta x^2 to a prior precision of 1: that factor is P0. The default beta of 1 is for
    # data near 1.
    model = BayesianLinearRegression(beta=COVARIANCE / (1 - FORGETTING), smoothing=FORGETTING)
    ratio = np.empty(len(output))
    for k, (y, x) in enumerate(zip(output.tolist(), regressor.tolist(), strict=True)):
        model.learn_one({"x": x}, y)
        ratio[k] = model.predict_one({"x": 1.0})
    return ratio


def filterpy(output: Array, regressor: Array) -> Array:
    """Estimate with filterpy's FadingKalmanFilter, alpha^2 = 1 / forgetting."""
    from filterpy.kalman import FadingKalmanFilter

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of filterpy itself
        kalman = FadingKalmanFilter(alpha=FORGETTING**-0.5, dim_x=1, dim_z=1)
        ratio = np.empty(len(output))
    kalman.x = np.ones((1, 1))
    kalman.P = np.array([[COVARIANCE]])
    # alpha is the forgetting; the default Q of 1 would be a random walk on top of it
    kalman.Q = np.zeros((1, 1))
    for k, (y, x) in enumerate(zip(output.tolist(), regressor.tolist(), strict=True)):
        kalman.H = np.array([[x]])
        kalman.predict()
        kalman.update(y)
        ratio[k] = kalman.x[0, 0]
    return ratio


def simdkalman(output: Array, regressor: Array) -> Array:
    """Estimate with simdkalman's steps, fading memory as process noise; also many streams, arrays of shape (n, streams)."""
    from simdkalman import primitives

    one = np.ones((1, 1))
    ratio = np.empty(output.shape)
    outputs, regressors = (values.reshape(len(values), -1, 1, 1) for values in (output, regressor))
    mean = np.ones(outputs.shape[1:])
    covariances = np.full(mean.shape, COVARIANCE)
    for k, (y, x) in enumerate(zip(outputs, regressors, strict=True)):
        mean, covariances = primitives.predict(
            mean, covariances, one, covariances * (1 / FORGETTING - 1)
        )
        mean, covariances = primitives.update(mean, covariances, x, one, y)
        ratio[k] = mean[:, 0, 0] if output.ndim > 1 else mean[0, 0, 0]
    return ratio


def scipy(output: Array, regressor: Array) -> Array:
    """Estimate with two filters of scipy: least squares with forgetting."""
    from scipy.signal import lfilter

    sums = (
        lfilter([1.0], [1.0, -FORGETTING], products)
        for products in (output * regressor, regressor**2)
    )
    return np.asarray(np.divide(*sums))


@compiled
def kalman_walk(output: Array, regressor: Array) -> Array:
    """Estimate with a Kalman filter whose state, the ratio, is a random walk.

    r(k) = r(k-1) + w, y(k) = x(k) r(k) + v; with p = P / var v and walk = var w / var v, 1/pF^2:
    p' = p + walk; K = p' x / (1 + x^2 p'); p = p' / (1 + x^2 p'). Only the quotient of the two variances matters.
    """
    found = np.empty(len(output))
    ratio = 1.0
    p = COVARIANCE
    for k, x in enumerate(regressor):
        p += WALK
        scale = 1 + x * x * p
        ratio += p * x / scale * (output[k] - x * ratio)
        p /= scale
        found[k] = ratio
    return found


def sums(output: Array, regressor: Array) -> Array:
    """Estimate by the sum of the outputs over the sum of the regressors, from contact on: it forgets nothing."""
    return np.asarray(np.cumsum(output) / np.cumsum(regressor))


# less follows a slow change, more survives a converter with three times the noise
DRIFT = 4.0
THRESHOLD = 16.0


@compiled
def restarted(output: Array, regressor: Array) -> Array:
    """Estimate by least squares of all samples since the last alarm of a two-sided CUSUM in units of the noise.

    With the sums before a sample, r = sum(x y) / sum(x^2), the innovation e = y - r x has the variance
    noise^2 (1 + r^2) (1 + x^2 / sum(x^2)). An alarm begins with its sample.
    """
    found = np.empty(len(output))
    xy = xx = up = down = 0.0
    for k, x in enumerate(regressor):
        y = output[k]
        if xx:
            ratio = xy / xx
            units = (y - ratio * x) / (NOISE * math.sqrt((1 + ratio**2) * (1 + x**2 / xx)))
            up = max(up + units - DRIFT, 0.0)
            down = max(down - units - DRIFT, 0.0)
            if max(up, down) > THRESHOLD:
                xy = xx = up = down = 0.0
        xy += x * y
        xx += x * x
        found[k] = xy / xx
    return found


GLR_LIMIT = 30.0
GLR_WINDOW = 60
GLR_SHORTEST = 4
CLIP = 4.0
GLR_NOISE = 2.2 * NOISE


@compiled
def robust_glr(output: Array, regressor: Array) -> Array:
    """Estimate by least squares since the most likely step of the ratio: generalised likelihood ratio of each split.

    With the ratios d apart before and after the split, 2 ln(likelihood ratio) is d^2 / (var v (1 / sum_before(x^2) +
    1 / sum_after(x^2))). Robust: an innovation counts at most `CLIP` standard deviations. Willsky and Jones, 1976.
    """
    found = np.empty(len(output))
    xx = regressor * regressor
    xy = regressor * output
    start = 0
    all_xx = all_xy = 0.0
    for k, x in enumerate(regressor):
        ratio = all_xy / all_xx if all_xx else output[k] / x
        variance = GLR_NOISE**2 * (1 + ratio**2)
        if k - start >= GLR_SHORTEST:
            most = CLIP * math.sqrt(variance * (1 + xx[k] / all_xx))
            innovation = output[k] - ratio * x
            xy[k] = x * (ratio * x + min(max(innovation, -most), most))
        all_xx += xx[k]
        all_xy += xy[k]
        best = GLR_LIMIT * variance
        after_xx = after_xy = 0.0
        for split in range(k, max(start + GLR_SHORTEST, k - GLR_WINDOW) - 1, -1):
            after_xx += xx[split]
            after_xy += xy[split]
            before_xx = all_xx - after_xx
            step = after_xy / after_xx - (all_xy - after_xy) / before_xx
            likely = step**2 * after_xx * before_xx / all_xx
            if likely > best:
                best = likely
                start = split
        if best > GLR_LIMIT * variance:
            all_xx = xx[start : k + 1].sum()
            all_xy = xy[start : k + 1].sum()
        found[k] = all_xy / all_xx
    return found


IMM_NOISE = 3 * NOISE
# probability of a transition, for each pair
TO_MOVING = 1e-3
TO_STILL = 0.003
JUMP = 1.0  # standard deviation of the step of a ratio that moves, relative


@compiled
def imm(output: Array, regressor: Array) -> Array:
    """Estimate with two interacting models, a ratio that is still and one that moves: Blom and Bar-Shalom, 1988."""
    found = np.empty(len(output))
    found[0] = best = output[0] / regressor[0]
    still = moving = best
    still_p = moving_p = IMM_NOISE**2 * (1 + best**2) / regressor[0] ** 2
    share = 0.5  # probability that it moves
    for k in range(1, len(output)):
        x = regressor[k]
        variance = IMM_NOISE**2 * (1 + best**2)
        prior = TO_MOVING * (1 - share) + (1 - TO_STILL) * share
        apart = moving - still
        # each model begins with the mixture of both
        from_moving = TO_STILL * share / (1 - prior)
        mixed = still + from_moving * apart
        mixed_p = still_p + from_moving * (moving_p - still_p + (1 - from_moving) * apart**2)
        from_still = TO_MOVING * (1 - share) / prior
        moved = moving - from_still * apart
        moved_p = moving_p + from_still * (still_p - moving_p + (1 - from_still) * apart**2)
        moved_p += (JUMP * best) ** 2
        still_s = x * x * mixed_p + variance
        moving_s = x * x * moved_p + variance
        still_e = output[k] - x * mixed
        moving_e = output[k] - x * moved
        still = mixed + mixed_p * x / still_s * still_e
        moving = moved + moved_p * x / moving_s * moving_e
        still_p = mixed_p * variance / still_s
        moving_p = moved_p * variance / moving_s
        log_odds = 0.5 * (still_e**2 / still_s - moving_e**2 / moving_s)
        odds = math.exp(min(log_odds, 300.0)) * math.sqrt(still_s / moving_s)
        share = odds * prior / (odds * prior + 1 - prior)
        best = still + share * (moving - still)
        found[k] = best
    return found


DMA_NOISE = 2 * NOISE
WALKS = (0.0, 1e-13, 1.0)  # variance of a step of the ratio, relative
REMEMBERED = 0.995
OUTLIERS = 1e-3  # share of the samples
OUTLIER_VARIANCE = 900.0  # in variances of the noise


@compiled
def dma(output: Array, regressor: Array) -> Array:
    """Estimate with dynamic model averaging over random walks, with outliers: Raftery, Karny and Ettler, 2010."""
    found = np.empty(len(output))
    found[0] = best = output[0] / regressor[0]
    ratios = np.full(len(WALKS), best)
    p = np.full(len(WALKS), DMA_NOISE**2 * (1 + best**2) / regressor[0] ** 2)
    weights = np.zeros(len(WALKS))  # logarithms
    for k in range(1, len(output)):
        x = regressor[k]
        variance = DMA_NOISE**2 * (1 + best**2)
        for i, walk in enumerate(WALKS):
            before = p[i] + walk * best**2
            spread = x * x * before + variance
            wide = spread + OUTLIER_VARIANCE * variance
            e = output[k] - x * ratios[i]
            likely = -0.5 * (e * e / spread + math.log(spread))  # logarithms
            outlier = -0.5 * (e * e / wide + math.log(wide)) + math.log(OUTLIERS)
            used = 1 / (1 + math.exp(min(outlier - likely, 300.0)))
            weights[i] = REMEMBERED * weights[i] + likely - math.log(used)
            gain = before * x / spread
            ratios[i] += used * gain * e
            p[i] = before * (1 - used * gain * x) + used * (1 - used) * (gain * e) ** 2
        weights -= weights.max()
        shares = np.exp(weights)
        best = (shares * ratios).sum() / shares.sum()
        found[k] = best
    return found


COMPILED: dict[str, Method] = {
    "Kalman walk": kalman_walk,
    "restarted": restarted,
    "robust GLR": robust_glr,
    "IMM": imm,
    "DMA": dma,
}
METHODS: dict[str, Method] = {"sum / sum": sums} | COMPILED
LIBRARIES: dict[str, Callable[..., Array]] = {
    f.__name__: f for f in (scipy, padasip, river, filterpy, simdkalman)
}


def installed() -> dict[str, Callable[..., Any]]:
    """Return the libraries that are installed."""
    return {name: estimate for name, estimate in LIBRARIES.items() if find_spec(name)}


def timed() -> dict[str, Method]:
    """Return the methods and libraries whose run time is measured: a loop in Python beside compiled ones says nothing."""
    methods = METHODS if find_spec("numba") else {"sum / sum": sums}
    return methods | installed()
