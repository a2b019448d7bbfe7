"""The Fisher bound: against its closed form, the scatter of the score, and an independent computation."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from bench.accuracy.bound import Line, Setup, bound, information

Array = NDArray[np.float64]
HARD = np.arange(0.010, 0.4, 0.026)
SOFT = HARD + 0.013
TIMES = np.sort(np.concatenate([HARD, SOFT]))
IS_HARD = np.arange(len(TIMES)) % 2 == 0


def moments(setup: Setup, ratio: float, depth: float) -> tuple[Array, Array]:
    """Return mean and covariance of the readings, element by element."""
    shape = [0.5 - 0.5 * math.cos(math.pi * min(t / setup.rise_s, 1)) for t in (*HARD, *SOFT)]
    gain = [ratio] * len(HARD) + [1.0] * len(SOFT)
    mean = np.array([g * depth * p for g, p in zip(gain, shape, strict=True)])
    covariance = np.zeros((len(mean), len(mean)))
    for i, a in enumerate((*HARD, *SOFT)):
        for j, b in enumerate((*HARD, *SOFT)):
            lines = sum(
                line.share
                * math.cos(2 * math.pi * line.centre_hz * (a - b))
                * math.exp(-((2 * math.pi * line.width_hz * (a - b)) ** 2) / 2)
                for line in setup.lines
            )
            noise = setup.noise_pF**2 * ((i == j) + (gain[i] == gain[j]) / setup.baseline)
            covariance[i, j] = mean[i] * mean[j] * setup.tremor**2 * lines + noise
    return mean, covariance


def test_without_tremor_it_is_that_of_least_squares() -> None:
    setup = Setup()
    found = information(setup, TIMES, IS_HARD)[-1]
    shape = [0.5 * (1 - np.cos(np.pi * np.minimum(t / setup.rise_s, 1))) for t in (HARD, SOFT)]
    # A channel with amplitude a: J = (sum p^2 - (sum p)^2 / (n0 + n)) / sigma^2, from (I + 11' / n0)^-1.
    hard, soft = ((p @ p - p.sum() ** 2 / (setup.baseline + len(p))) / setup.noise_pF**2 for p in shape)
    # Ratio = a_hard / a_soft: relative variances add.
    expected = 1 / (hard * (setup.ratio * setup.depth_pF) ** 2) + 1 / (soft * setup.depth_pF**2)
    assert np.linalg.inv(found)[0, 0] / setup.ratio**2 == pytest.approx(expected, rel=1e-9)


def test_later_readings_change_nothing_before_them() -> None:
    setup = Setup(tremor=0.08)
    whole = information(setup, TIMES, IS_HARD)
    for count in (3, 10, len(TIMES) - 1):
        part = information(setup, TIMES[:count], IS_HARD[:count])
        assert part == pytest.approx(whole[:count], rel=1e-9, abs=1e-9 * np.abs(whole[count - 1]).max())


def test_the_information_is_the_scatter_of_the_score() -> None:
    setup = Setup(tremor=0.08, noise_pF=1e-3)
    mean, covariance = moments(setup, setup.ratio, setup.depth_pF)
    samples = np.random.default_rng(5).multivariate_normal(mean, covariance, 4000, method="cholesky")

    def likelihood(ratio: float, depth: float) -> Array:
        m, c = moments(setup, ratio, depth)
        return np.asarray(
            -0.5 * (np.linalg.slogdet(c)[1] + np.sum((samples - m) * np.linalg.solve(c, (samples - m).T).T, axis=1))
        )

    step = 1e-4
    by_ratio = likelihood(setup.ratio * (1 + step), setup.depth_pF) - likelihood(
        setup.ratio * (1 - step), setup.depth_pF
    )
    by_depth = likelihood(setup.ratio, setup.depth_pF * (1 + step)) - likelihood(
        setup.ratio, setup.depth_pF * (1 - step)
    )
    score = np.stack([by_ratio / setup.ratio, by_depth / setup.depth_pF]) / (2 * step)
    expected = np.cov(score)
    found = information(setup, TIMES, IS_HARD)[-1]
    # A variance of 4,000 samples scatters by sqrt(2 / 4000) = 2.2 %, a covariance by as much of the geometric mean.
    scale = np.sqrt(np.outer(np.diag(found), np.diag(found)))
    assert np.all(np.abs(found - expected) < 0.1 * scale)


@pytest.mark.parametrize("tremor", [0.0, 0.08])
def test_an_independent_computation(tremor: float) -> None:
    # Another program, another spectrum of lines of 3 to 12 Hz with a width, and sway; two digits.
    early, *later = 100 * bound(Setup(tremor=tremor), [0.2, 0.5, 1.0, 3.0, 6.0])
    expected = [0.0053, 0.0036, 0.0025, 0.0022] if not tremor else [0.0055, 0.0036, 0.0025, 0.0022]
    assert later == pytest.approx(expected, rel=0.03)
    # After 0.2 s a pair more or less, which is the phase of the readings, changes (0.2 s)^2.5 by 26 %.
    assert early == pytest.approx(0.0194 if not tremor else 0.0252, rel=0.26)


def test_more_noise_tremor_and_less_baseline_cost() -> None:
    best = bound(Setup(), 1.0)[0]
    assert bound(Setup(noise_pF=80e-6), 1.0)[0] == pytest.approx(2 * best, rel=1e-6)
    assert bound(replace(Setup(), baseline=20), 1.0)[0] > 1.2 * best
    wide = Setup(tremor=0.08, lines=(Line(8.0, 4.0, 1.0),))
    assert bound(wide, 0.2)[0] > 1.3 * bound(Setup(), 0.2)[0]
