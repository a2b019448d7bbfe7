"""Rivals of the scene handheld: usual estimators on pairs that are aligned as in that scene ("+A" in the tables).

Each has one setting for all scenarios. Each knows when the press begins; the scene has to find it.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate.benchmark import ErrorTrace, Estimate, Row, summarise
from palpate.simulation import Simulation, scenarios

from bench.aligned import contact
from bench.peers import COVARIANCE, spline_ratio

Array = NDArray[np.float64]
WALK = 0.5623  # q / r of the random walk, 1/pF^2: python -m bench.accuracy.tune_walk


def no_alarm(estimate: Callable[[Array, Array], Any]) -> Estimate:
    """Return an estimator without a detector as one with alarms."""
    return lambda output, regressor: (estimate(output, regressor), np.zeros(len(output), bool))


def paper(output: Array, regressor: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Estimate as the paper does, with its forgetting factors, drift and threshold."""
    rows = palpate.AdaptiveRls(initial_covariance=COVARIANCE, max_covariance=COVARIANCE).trace(output, regressor)
    return rows["ratio"], rows["alarm"]


def fixed(forgetting: float) -> Estimate:
    """Return recursive least squares with one forgetting factor."""
    settings = {"forgetting": forgetting, "initial_covariance": COVARIANCE, "max_covariance": COVARIANCE}
    return no_alarm(lambda output, regressor: palpate.Rls(**settings).process(output, regressor))


def kalman_walk(output: Array, regressor: Array, walk: Any = WALK) -> Array:
    """Estimate with a Kalman filter whose state, the ratio, is a random walk; `walk`: one value, or an array of them.

    r(k) = r(k-1) + w, y(k) = x(k) r(k) + v; with p = P / var v and walk = var w / var v, 1/pF^2:
    p' = p + walk; K = p' x / (1 + x^2 p'); p = p' / (1 + x^2 p'). Only the quotient of the two variances matters.
    """
    ratio, p, found = 1.0, COVARIANCE, []
    for y, x in zip(output.tolist(), regressor.tolist(), strict=True):
        p = p + walk
        scale = 1 + x * x * p
        ratio = ratio + p * x / scale * (y - x * ratio)
        p = p / scale
        found.append(ratio)
    return np.array(found)


def sums(output: Array, regressor: Array) -> Array:
    """Estimate by the sum of the outputs over the sum of the regressors, from contact on: it forgets nothing."""
    return np.asarray(np.cumsum(output) / np.cumsum(regressor))


RIVALS: dict[str, Estimate] = {
    "paper +A": paper,
    "fixed 0.995 +A": fixed(0.995),
    "fixed 0.9 +A": fixed(0.9),
    "Kalman walk +A": no_alarm(kalman_walk),
    "sum / sum +A": no_alarm(sums),
}
"""Name -> function of (output, regressor) that returns (ratio, alarm)."""
OFFLINE = "spline, offline"


def rival_trace(estimate: Estimate, run: Simulation) -> ErrorTrace:
    """Return the error of a rival on the first press of a simulation, after each aligned pair."""
    at, output, regressor = contact(run)
    ratio, alarm = estimate(output, regressor)
    return trace(run, at, ratio, alarm)


def spline_trace(run: Simulation) -> ErrorTrace:
    """Return the error of one ratio for the whole press, offline: a spline, least squares, baselines before and after."""
    at, *_ = contact(run)
    return trace(run, at, np.full(len(at), spline_ratio(run, after=True)))


def trace(run: Simulation, at: NDArray[np.intp], ratio: Array, alarm: NDArray[np.bool_] | None = None) -> ErrorTrace:
    """Return the error of the ratio that is known at each of some pairs of readings."""
    since, none = run.t_hard_s[at] - run.presses[0].start_s, np.zeros(len(at), bool)
    error = ratio / run.true_ratio[at] - 1
    return ErrorTrace(since, error, none if alarm is None else alarm, np.full(len(at), math.nan))


def rival_rows(scenario: str, seeds: int) -> list[Row]:
    """Return the rows of all rivals on one scenario. Their run time is that of the same estimator without alignment."""
    runs = [scenarios.run(scenario, seed) for seed in range(seeds)]
    traces = {name: [rival_trace(estimate, run) for run in runs] for name, estimate in RIVALS.items()}
    traces[OFFLINE] = [spline_trace(run) for run in runs]
    return [summarise(scenario, name, found, math.nan) for name, found in traces.items()]
