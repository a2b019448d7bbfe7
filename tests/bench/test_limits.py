"""Limits that the pages state: of any estimator (Fisher), of the printed form, of each estimator's range and standard error."""

import math
from typing import Any

import numpy as np
import palpate
import pytest
from palpate import reference

from bench.accuracy.bound import Setup, bound, information
from bench.accuracy.extremes import ending, powers, stepped


@pytest.mark.parametrize(
    ("kind", "lost", "kept"),
    [(np.float32, 1e9, 1e8), (np.float32, 1e12, 1e7), (np.float64, 1e18, 1e15)],
)
def test_the_printed_covariance_is_lost_to_cancellation(
    kind: Any, lost: float, kept: float
) -> None:
    """P - P x^2 P / (lambda + x^2 P) is 0 where lambda / (lambda + x^2 P) is below half an eps: then no gain, for good."""

    def after_a_step(covariance: float) -> tuple[float, float]:
        samples = (part.astype(kind) for part in stepped())
        with np.errstate(all="ignore"):
            trace = reference.adaptive_rls(
                *samples, number=kind, initial_covariance=covariance, max_covariance=math.inf
            )
        return float(trace.covariance[0]), float(trace.ratio[-1])

    assert lost * 0.25**2 > 2 / np.finfo(kind).eps
    assert after_a_step(lost) == pytest.approx((0, 2.5), rel=1e-3)
    assert after_a_step(kept)[1] == pytest.approx(3, rel=1e-3)


RANGE = {"Rls": (152, 155), "AdaptiveRls": (152, 155), "HandoverRls": (139, 141), "Rls32": (18, 20), "AdaptiveRls32": (18, 20),
         "HandoverRls32": (15, 17)}  # fmt: skip
"""Powers of ten: right up to at least the first, refused from the second on."""


@pytest.mark.parametrize("name", RANGE)
def test_the_range_of_each_estimator_is_the_documented_one(name: str) -> None:
    kind, (largest, refused) = getattr(palpate, name), RANGE[name]
    ends = {power: ending(kind, 10.0**power) for power in powers(kind)}
    assert "wrong" not in ends.values()
    assert all(end == "right" for power, end in ends.items() if 0 <= power <= largest)
    assert all(end == "refused" for power, end in ends.items() if power >= refused)
    assert all(end in ("right", "unexcited") for power, end in ends.items() if power < 0)


def test_the_interval_needs_the_same_noise_at_all_depths() -> None:
    """With a noise in proportion to a regressor that jumps over two decades, it holds the quotient only."""
    hits = {"as it is": 0, "divided": 0}
    for seed in range(200):
        random = np.random.default_rng(seed)
        regressor = 10 ** random.uniform(-1, 1, 1000)
        output = 2.5 * regressor * (1 + 1e-3 * random.standard_normal(1000))
        for name, given in (
            ("as it is", (output, regressor)),
            ("divided", (output / regressor, np.ones(1000))),
        ):
            estimator = palpate.HandoverRls()
            estimator.process(*given)
            hits[name] += abs(estimator.ratio - 2.5) < 1.96 * estimator.standard_error
    assert 140 < hits["as it is"] < 175  # 157 +- 6
    assert hits["divided"] > 178  # 190 +- 3


def test_the_fisher_bound_without_tremor_is_that_of_least_squares() -> None:
    setup = Setup()
    hard = np.arange(0.010, 0.4, 0.026)
    times = np.sort(np.concatenate([hard, hard + 0.013]))
    found = information(setup, times, np.arange(len(times)) % 2 == 0)[-1]
    shape = [
        0.5 * (1 - np.cos(np.pi * np.minimum(t / setup.rise_s, 1))) for t in (hard, hard + 0.013)
    ]
    # A channel with amplitude a: J = (sum p^2 - (sum p)^2 / (n0 + n)) / sigma^2, from (I + 11' / n0)^-1.
    first, second = (
        (p @ p - p.sum() ** 2 / (setup.baseline + len(p))) / setup.noise_pF**2 for p in shape
    )
    # Ratio = a_hard / a_soft: relative variances add.
    expected = 1 / (first * (setup.ratio * setup.depth_pF) ** 2) + 1 / (second * setup.depth_pF**2)
    assert np.linalg.inv(found)[0, 0] / setup.ratio**2 == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("tremor", [0.0, 0.08])
def test_the_fisher_bound_by_an_independent_computation(tremor: float) -> None:
    # Another program, another spectrum of lines of 3 to 12 Hz with a width, and sway; two digits.
    expected = [0.0053, 0.0036, 0.0025, 0.0022] if not tremor else [0.0055, 0.0036, 0.0025, 0.0022]
    assert 100 * bound(Setup(tremor=tremor), [0.5, 1.0, 3.0, 6.0]) == pytest.approx(
        expected, rel=0.03
    )
