"""Published or certified numbers, from the same input: least squares, curve fits, run lengths, noise on both sides."""

import math
from collections.abc import Callable

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray
from palpate.design import run_length

Array = NDArray[np.float64]
EPS = np.finfo(float).eps
CHAIN = 5e-4  # error of a run length by a chain of 400 states, relative, where nothing is clipped


# Least squares: NIST Statistical Reference Datasets, https://www.itl.nist.gov/div898/strd.


@pytest.mark.parametrize(
    ("regressor", "output", "slope", "deviation"),
    [
        # NoInt1
        (np.arange(60.0, 71), np.arange(130.0, 141), 2.07438016528926, 0.0165289256198347),
        # NoInt2
        (np.array([4.0, 5, 6]), np.array([3.0, 4, 4]), 0.727272727272727, 0.0420827318078432),
    ],
)
@pytest.mark.parametrize("covariance", [1e6, 1e300])
def test_a_line_through_the_origin(
    regressor: Array, output: Array, slope: float, deviation: float, covariance: float
) -> None:
    rls = palpate.Rls(forgetting=1.0, initial_covariance=covariance, max_covariance=covariance)
    rls.process(output, regressor)
    # The prior counts as one sample of ratio 1 and regressor covariance^-1/2. 15 digits are certified: 5e-15 of 0.7.
    prior = abs(1 - slope) / (covariance * (regressor**2).sum())
    assert rls.ratio == pytest.approx(slope, abs=prior + 5e-16 + 8 * EPS * slope)
    squares = ((output - rls.ratio * regressor) ** 2).sum() / (len(output) - 1)
    relative = prior / slope + 1 / (covariance * (regressor**2).sum())
    assert math.sqrt(squares * rls.covariance) == pytest.approx(
        deviation, rel=1e-14 + 1e3 * EPS + relative
    )


# Run lengths, without clipping. Those printed in the examples of xcusum.arl of the R package spc (S. Knoth).


def one_sided(drift: float, threshold: float, shift: float) -> float:
    return run_length(drift, threshold, shift=shift, clip=100.0)


def two_sided(drift: float, threshold: float, shift: float) -> float:
    # From 0 the rates add (Kemp 1961): when one side alarms, the other one is at 0.
    return 1 / (1 / one_sided(drift, threshold, shift) + 1 / one_sided(drift, threshold, -shift))


@pytest.mark.parametrize(
    ("length", "drift", "threshold", "shift", "published", "unit"),
    [
        (
            one_sided,
            0.5,
            3.0,
            0.0,
            117.59,
            0.01,
        ),  # Brook and Evans, Biometrika 59 (1972), section 4.3
        (one_sided, 0.5, 3.0, 1.0, 6.40, 0.01),
        (one_sided, 0.5, 5.0, 0.0, 930.9, 0.1),  # Montgomery's table 9.3, two-sided 465 and 10.4
        (
            one_sided,
            0.0,
            10.0,
            -0.25,
            2071.51,
            0.01,
        ),  # Vance, J. Quality Technology 18 (1986), table 1
        (one_sided, 0.0, 10.0, 1.0, 10.75, 0.01),
        (
            two_sided,
            0.5,
            4.0,
            0.0,
            168,
            1,
        ),  # Lucas and Crosier, Technometrics 24 (1982), table 1, no head start
        (two_sided, 0.5, 4.0, 1.0, 8.38, 0.01),
        (two_sided, 0.6, 3.0, -0.2, 65.4, 0.1),  # Waldmann, Technometrics 28 (1986), table 6
    ],
)
def test_run_lengths(
    length: Callable[..., float],
    drift: float,
    threshold: float,
    shift: float,
    published: float,
    unit: float,
) -> None:
    assert length(drift, threshold, shift) == pytest.approx(
        published, abs=unit / 2 + CHAIN * published
    )


def test_noise_on_both_channels() -> None:
    """HandoverRls has no bias; least squares has the bias by the regressor's noise, which adds to sum x^2 alone."""
    ratio = 3.0
    noise = 0.03
    size = 250
    ends = []
    for seed in range(200):
        random = np.random.default_rng(seed)
        level = 0.25 * (1 + 0.2 * np.sin(2 * np.pi * (np.arange(size) / 200 + random.uniform())))
        samples = [gain * level + noise * random.standard_normal(size) for gain in (ratio, 1)]
        estimates = (
            palpate.HandoverRls().process(*samples),
            palpate.Rls(forgetting=0.995).process(*samples),
        )
        ends.append([estimate[-1] / ratio - 1 for estimate in estimates])
    # 0.25 %; a bias of 2nd order, the variance, is 0.01 %
    allowed = 4 * np.std(ends, axis=0) / math.sqrt(len(ends))
    # E[level^2] = 0.25^2 (1 + 0.2^2 / 2)
    biased = -(noise**2) / (0.25**2 * (1 + 0.2**2 / 2) + noise**2)
    assert biased < -0.01
    assert (np.abs(np.mean(ends, axis=0) - [0, biased]) < allowed).all()
