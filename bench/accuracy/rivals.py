"""Other estimators of the same ratio, for the benches: usual methods, and other libraries if they are installed.

Each takes outputs and regressors, pF, as arrays of shape (n,), and returns the ratio after each pair. Each library is set as
its user would set it for pF: forgetting 0.995, and an initial covariance that does not matter.
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
WALK = 0.5623  # variance of the ratio's random walk / variance of the noise, 1/pF^2: the best over all scenarios, other seeds


def padasip(output: Array, regressor: Array) -> Array:
    """Estimate with padasip's FilterRLS."""
    from padasip.filters import FilterRLS

    # eps is 1 / P0; its default of 0.001 is for data near 1.
    model, ratio = (
        FilterRLS(1, mu=FORGETTING, eps=1 / COVARIANCE, w=np.zeros(1)),
        np.empty(len(output)),
    )
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
        kalman, ratio = (
            FadingKalmanFilter(alpha=FORGETTING**-0.5, dim_x=1, dim_z=1),
            np.empty(len(output)),
        )
    kalman.x, kalman.P = np.ones((1, 1)), np.array([[COVARIANCE]])
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

    one, ratio = np.ones((1, 1)), np.empty(output.shape)
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


def kalman_walk(output: Array, regressor: Array) -> Array:
    """Estimate with a Kalman filter whose state, the ratio, is a random walk.

    r(k) = r(k-1) + w, y(k) = x(k) r(k) + v; with p = P / var v and walk = var w / var v, 1/pF^2:
    p' = p + walk; K = p' x / (1 + x^2 p'); p = p' / (1 + x^2 p'). Only the quotient of the two variances matters.
    """
    ratio, p, found = 1.0, COVARIANCE, []
    for y, x in zip(output.tolist(), regressor.tolist(), strict=True):
        p = p + WALK
        scale = 1 + x * x * p
        ratio = ratio + p * x / scale * (y - x * ratio)
        p = p / scale
        found.append(ratio)
    return np.array(found)


def sums(output: Array, regressor: Array) -> Array:
    """Estimate by the sum of the outputs over the sum of the regressors, from contact on: it forgets nothing."""
    return np.asarray(np.cumsum(output) / np.cumsum(regressor))


# less follows a slow change, more survives a converter with three times the noise
DRIFT, THRESHOLD = (4.0, 16.0)


def restarted(output: Array, regressor: Array) -> Array:
    """Estimate by least squares of all samples since the last alarm of a two-sided CUSUM in units of the noise.

    With the sums before a sample, r = sum(x y) / sum(x^2), the innovation e = y - r x has the variance
    noise^2 (1 + r^2) (1 + x^2 / sum(x^2)). An alarm begins with its sample.
    """
    xy, xx, up, down, found = 0.0, 0.0, 0.0, 0.0, []
    for y, x in zip(output.tolist(), regressor.tolist(), strict=True):
        if xx:
            ratio = xy / xx
            units = (y - ratio * x) / (NOISE_PF[0] * math.sqrt((1 + ratio**2) * (1 + x**2 / xx)))
            up, down = max(up + units - DRIFT, 0.0), max(down - units - DRIFT, 0.0)
            if max(up, down) > THRESHOLD:
                xy = xx = up = down = 0.0
        xy, xx = xy + x * y, xx + x * x
        found.append(xy / xx)
    return np.array(found)


METHODS: dict[str, Callable[..., Array]] = {
    "Kalman walk": kalman_walk,
    "sum / sum": sums,
    "restarted": restarted,
}
LIBRARIES: dict[str, Callable[..., Array]] = {
    f.__name__: f for f in (scipy, padasip, river, filterpy, simdkalman)
}


def installed() -> dict[str, Callable[..., Any]]:
    """Return the libraries that are installed."""
    return {name: estimate for name, estimate in LIBRARIES.items() if find_spec(name)}
