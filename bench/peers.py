"""The same estimation with other libraries and methods: (output, regressor) -> (ratio, alarm) if not said otherwise.

Each library is set as its user would set it for pF: forgetting 0.995, and an initial covariance that does not matter.
"""

from typing import Any

import numpy as np

COVARIANCE = 1e12  # P0, 1/pF^2: 1 / P0 is far below x^2 of a sample of the lightest press, 4e-8 pF^2


def padasip_rls(
    output: Any, regressor: Any, covariance: float = COVARIANCE, forgetting: float = 0.995, initial: float = 0.0
) -> Any:
    """Estimate with padasip's FilterRLS. `run` returns the weights before each update."""
    from padasip.filters import FilterRLS

    # eps is 1 / P0; its default of 0.001 is for data near 1.
    model, ratio = FilterRLS(1, mu=forgetting, eps=1 / covariance, w=np.array([initial])), np.empty(len(output))
    for k, (y, x) in enumerate(zip(output, regressor[:, None], strict=True)):
        model.adapt(y, x)
        ratio[k] = model.w[0]
    return ratio, np.zeros(len(output), bool)


def river_regression(
    output: Any, regressor: Any, covariance: float = COVARIANCE, forgetting: float = 0.995, initial: float = 0.0
) -> Any:
    """Estimate with river's BayesianLinearRegression, its prior mean of 0 moved to `initial`."""
    from river.linear_model import BayesianLinearRegression

    # A sample adds (1 - smoothing) beta x^2 to a prior precision of 1: that factor is P0. The default beta of 1 is for
    # data near 1.
    model = BayesianLinearRegression(beta=covariance / (1 - forgetting), smoothing=forgetting)
    ratio = np.empty(len(output))
    for k, (y, x) in enumerate(zip(output.tolist(), regressor.tolist(), strict=True)):
        model.learn_one({"x": x}, y - initial * x)
        ratio[k] = initial + model.predict_one({"x": 1.0})
    return ratio, np.zeros(len(output), bool)


def filterpy_kalman(
    output: Any, regressor: Any, covariance: float = COVARIANCE, forgetting: float = 0.995, initial: float = 1.0
) -> Any:
    """Estimate with filterpy's FadingKalmanFilter, alpha^2 = 1 / forgetting."""
    from filterpy.kalman import FadingKalmanFilter

    kalman, ratio = FadingKalmanFilter(alpha=forgetting**-0.5, dim_x=1, dim_z=1), np.empty(len(output))
    kalman.x, kalman.P = np.array([[initial]]), np.array([[covariance]])
    kalman.Q = np.zeros((1, 1))  # alpha is the forgetting; the default Q of 1 would be a random walk on top of it
    for k, (y, x) in enumerate(zip(output.tolist(), regressor.tolist(), strict=True)):
        kalman.H = np.array([[x]])
        kalman.predict()
        kalman.update(y)
        ratio[k] = kalman.x[0, 0]
    return ratio, np.zeros(len(output), bool)


def lfilter_ratio(output: Any, regressor: Any, forgetting: float = 0.995) -> Any:
    """Estimate with two filters of scipy: fixed forgetting only."""
    from scipy.signal import lfilter

    numerator = lfilter([1.0], [1.0, -forgetting], output * regressor)
    return numerator / lfilter([1.0], [1.0, -forgetting], regressor**2), np.zeros(len(output), bool)


def numpy_loop(output: Any, regressor: Any) -> Any:
    """Estimate with the equations of the paper, sample by sample, with numpy scalars."""
    from palpate.reference import adaptive_rls

    return adaptive_rls(output, regressor).ratio, np.zeros(len(output), bool)


def awtls(output: Any, regressor: Any, output_noise: float, regressor_noise: float, forgetting: float = 0.995) -> Any:
    """Estimate by recursive approximate weighted total least squares with fading memory; the noise has to be known.

    Plett, J. Power Sources 196 (2011) 2319: with both channels scaled to equal noise, the minimum over r of
    sum of forgetting^age (y - r x)^2 (r^2 / noise_x^2 + 1 / noise_y^2) / (1 + r^2)^2, a root of a quartic.
    """
    from scipy.signal import lfilter

    scale = output_noise / regressor_noise
    x, y = regressor / regressor_noise, output / output_noise  # in units of the noise: its six sums are three, twice
    xx, xy, yy = (lfilter([1.0], [1.0, -forgetting], product) for product in (x * x, x * y, y * y))
    c1, c2, c3, c4, c5, c6 = xx, xy, yy, xx, xy, yy
    quartic = np.stack([2 * c4 - c1 - c6, 3 * (c2 - c5), c1 - 2 * c3 + c6, -c2]) / c5
    companion = np.zeros((len(x), 4, 4))
    companion[:, 0] = -quartic.T
    companion[:, [1, 2, 3], [0, 1, 2]] = 1
    roots = np.linalg.eigvals(companion)
    q = np.where(np.abs(roots.imag) < 1e-6 * np.abs(roots), roots.real, np.nan).T
    cost = (c4 * q**4 - 2 * c5 * q**3 + (c1 + c6) * q**2 - 2 * c2 * q + c3) / (1 + q**2) ** 2
    best = q[np.nanargmin(cost, axis=0), np.arange(len(x))]
    return best * scale, np.zeros(len(x), bool)


def simdkalman_streams(output: Any, regressor: Any, forgetting: float = 0.995, initial: float = 1.0) -> Any:
    """Estimate many streams, arrays of (rows, streams), with simdkalman's steps; fading memory as its process noise."""
    from simdkalman import primitives

    one, ratio = np.ones((1, 1)), np.empty(output.shape)
    mean = np.full((output.shape[1], 1, 1), initial)
    covariance = np.full(mean.shape, COVARIANCE)
    for k, (y, x) in enumerate(zip(output, regressor, strict=True)):
        mean, covariance = primitives.predict(mean, covariance, one, covariance * (1 / forgetting - 1))
        mean, covariance = primitives.update(mean, covariance, x[:, None, None], one, y[:, None, None])
        ratio[k] = mean[:, 0, 0]
    return ratio, np.zeros(output.shape, bool)


def spline_block(t_hard: Any, hard: Any, t_soft: Any, soft: Any) -> float:
    """Return one ratio for a whole press, offline: least squares on a cubic spline through the second channel."""
    from scipy.interpolate import CubicSpline

    regressor = CubicSpline(t_soft, soft)(t_hard)
    return float(hard @ regressor / (regressor @ regressor))


def spline_ratio(run: Any, *, after: bool) -> float:
    """Return the ratio of one press, offline: least squares on a cubic spline through all readings of the soft channel.

    It knows when the press begins and ends. `after`: the baseline is a line between before and after the press.
    """
    from scipy.interpolate import CubicSpline

    press, channels = run.presses[0], []
    for times, values in ((run.t_hard_s, run.hard), (run.t_soft_s, run.soft)):
        known = np.isfinite(values)
        t, c = times[known], values[known]
        before, behind = t < press.start_s, t > press.stop_s
        base = np.full(len(t), c[before].mean())
        if after:
            ends = [[part.mean() for part in (t[side], c[side])] for side in (before, behind)]
            base = np.interp(t, *np.transpose(ends))
        channels.append((t, c - base))
    (t, hard), soft = channels
    inside = (t >= press.start_s) & (t <= press.stop_s)
    regressor = CubicSpline(*soft)(t[inside])
    return float(hard[inside] @ regressor / (regressor @ regressor))


def numba_step() -> Any:
    """Return the step of AdaptiveRls by numba, as a function of [ratio, information, signed statistic] and two floats."""
    from numba import njit

    @njit  # type: ignore[untyped-decorator, unused-ignore]
    def step(state: Any, y: float, x: float) -> float:
        e = y - x * state[0]
        g = max(0.0, abs(state[2]) + (abs(e) - 0.01))
        alarm = g > (0.0 if state[2] < 0 else 0.05)
        information = (0.9 if alarm else 0.995) * state[1] + x * x
        state[0] += x / information * e
        state[1], state[2] = information, -g if alarm else g
        return float(state[0])

    return step


def numba_block() -> Any:
    """Return `numba_step` over a block, as the other libraries: (output, regressor) -> (ratio, alarm)."""
    from numba import njit

    step = numba_step()

    @njit  # type: ignore[untyped-decorator, unused-ignore]
    def loop(state: Any, output: Any, regressor: Any, ratio: Any, alarm: Any) -> None:
        for k in range(len(output)):
            ratio[k] = step(state, output[k], regressor[k])
            alarm[k] = state[2] < 0

    def estimate(output: Any, regressor: Any) -> Any:
        ratio, alarm = np.empty(len(output)), np.empty(len(output), bool)
        loop(np.array([1.0, 1e-12, 0.0]), output, regressor, ratio, alarm)
        return ratio, alarm

    return estimate


PEERS = {"padasip": padasip_rls, "river": river_regression, "filterpy": filterpy_kalman}
