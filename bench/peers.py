"""What users of other libraries write for the same job: (output, regressor) -> (ratio, alarm)."""

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


PEERS = {"padasip": padasip_rls, "river": river_regression, "filterpy": filterpy_kalman}
