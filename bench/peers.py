"""The same estimation with other libraries and methods: (output, regressor) -> (ratio, alarm) if not said otherwise."""

from typing import Any

import numpy as np


def padasip_rls(output: Any, regressor: Any) -> Any:
    """Estimate with padasip's FilterRLS, mu = 0.995."""
    from padasip.filters import FilterRLS

    weights = FilterRLS(1, mu=0.995, eps=1e-4, w="zeros").run(output, regressor[:, None])[2]
    return weights[:, 0], np.zeros(len(output), bool)


def river_regression(output: Any, regressor: Any) -> Any:
    """Estimate with river's BayesianLinearRegression, smoothing 0.995."""
    from river.linear_model import BayesianLinearRegression

    model, ratio = BayesianLinearRegression(smoothing=0.995), np.empty(len(output))
    for k, (y, x) in enumerate(zip(output.tolist(), regressor.tolist(), strict=True)):
        model.learn_one({"x": x}, y)
        ratio[k] = model.predict_one({"x": 1.0})
    return ratio, np.zeros(len(output), bool)


def filterpy_kalman(output: Any, regressor: Any) -> Any:
    """Estimate with filterpy's FadingKalmanFilter, alpha^2 = 1 / 0.995."""
    from filterpy.kalman import FadingKalmanFilter

    kalman, ratio = FadingKalmanFilter(alpha=0.995**-0.5, dim_x=1, dim_z=1), np.empty(len(output))
    kalman.x, kalman.P = np.array([[1.0]]), np.array([[1e4]])
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


def paper_literally(output: Any, regressor: Any) -> Any:
    """Estimate with eq. (3) and steps 1-4 of the paper, in float64, as printed."""
    r, p, g, alarm, ratio = np.float64(1), np.float64(1e12), np.float64(0), False, np.empty(len(output))
    for k, (y, x) in enumerate(zip(output, regressor, strict=True)):
        e = y - x * r
        g = np.maximum(0, g + np.abs(e) - 0.01)
        alarm = g > (0.0 if alarm else 0.05)
        forgetting = 0.9 if alarm else 0.995
        gain = p * x / (forgetting + x * p * x)
        p = (p - p * x * x * p / (forgetting + x * x * p)) / forgetting
        r = r + gain * e
        ratio[k] = r
    return ratio, np.zeros(len(output), bool)


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


PEERS = {"padasip": padasip_rls, "river": river_regression, "filterpy": filterpy_kalman}
