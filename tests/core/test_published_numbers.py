"""Numbers that others published or certified, from the same input: least squares, curve fits, run lengths, noise on both sides."""

import math

import numpy as np
import palpate
import pytest
from numpy.typing import NDArray
from palpate.calibration import Calibration
from palpate.design import run_length

from bench.peers import awtls

Array = NDArray[np.float64]
EPS = np.finfo(float).eps
CHAIN = 5e-4  # error of a run length by a chain of 400 states, relative, where nothing is clipped


# Least squares: NIST Statistical Reference Datasets, https://www.itl.nist.gov/div898/strd.


@pytest.mark.parametrize(
    ("regressor", "output", "slope", "deviation"),
    [
        (np.arange(60.0, 71), np.arange(130.0, 141), 2.07438016528926, 0.0165289256198347),  # NoInt1
        (np.array([4.0, 5, 6]), np.array([3.0, 4, 4]), 0.727272727272727, 0.0420827318078432),  # NoInt2
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
    assert math.sqrt(squares * rls.covariance) == pytest.approx(deviation, rel=1e-14 + 1e3 * EPS + relative)


def test_misra1d() -> None:
    # y = b1 b2 x / (1 + b2 x) is eq. (2) with ratio 0 at modulus 0. Equal standard errors above the scatter of 0.0686
    # leave all weights equal, as certified; the deviations are scaled from one to the other.
    pressure = np.array([77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760])
    volume = np.array([10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.4, 75.47, 81.78])
    given = 0.08
    found = Calibration.fit(volume, pressure, standard_errors=np.full(14, given), soft_ratio=0.0)
    # The sum of squares is flat to the square of the parameters' error: sqrt(eps) of it is all that a fit can see.
    flat = math.sqrt(EPS)
    assert found.probe.rigid_ratio == pytest.approx(437.36970754, rel=flat)
    assert 1 / found.probe.half_modulus == pytest.approx(3.0227324449e-4, rel=flat)
    squares = sum((y - found.probe.ratio(x)) ** 2 for x, y in zip(pressure, volume, strict=True))
    assert squares == pytest.approx(5.6419295283e-2, rel=1e-10)
    deviations = np.sqrt(np.diag(found.fitted.covariance)[:2]) * math.sqrt(squares / 12) / given
    assert deviations[0] == pytest.approx(3.6489174345, rel=10 * flat)
    assert deviations[1] / found.probe.half_modulus == pytest.approx(2.9334354479e-6, rel=10 * flat)


# Run lengths, without clipping. Those printed in the examples of xcusum.arl of the R package spc (S. Knoth).


def one_sided(drift: float, threshold: float, shift: float) -> float:
    return run_length(drift, threshold, shift=shift, clip=100.0)


def two_sided(drift: float, threshold: float, shift: float) -> float:
    # From 0 the rates add (Kemp 1961): when one side alarms, the other one is at 0.
    return 1 / (1 / one_sided(drift, threshold, shift) + 1 / one_sided(drift, threshold, -shift))


@pytest.mark.parametrize(
    ("drift", "threshold", "shift", "published", "unit"),
    [
        (0.5, 3.0, 0.0, 117.59, 0.01),  # Brook and Evans, Biometrika 59 (1972), section 4.3
        (0.5, 3.0, 1.0, 6.40, 0.01),
        (0.5, 3.0, 1.5, 3.75, 0.01),
        (0.5, 5.0, 0.0, 930.9, 0.1),  # Montgomery's table 9.3, two-sided 465 and 10.4
        (0.5, 5.0, 1.0, 10.38, 0.01),
        (0.0, 10.0, -0.25, 2071.51, 0.01),  # Vance, J. Quality Technology 18 (1986), table 1
        (0.0, 10.0, -0.125, 400.28, 0.01),
        (0.0, 10.0, 0.0, 124.66, 0.01),
        (0.0, 10.0, 0.125, 59.30, 0.01),
        (0.0, 10.0, 0.25, 36.71, 0.01),
        (0.0, 10.0, 0.5, 20.37, 0.01),
        (0.0, 10.0, 0.75, 14.06, 0.01),
        (0.0, 10.0, 1.0, 10.75, 0.01),
        (0.5, 3.0, -0.5, 1963, 1),  # Waldmann, Technometrics 28 (1986), tables 3 and 5
        (0.5, 3.0, 0.5, 17.35, 0.01),
    ],
)
def test_one_sided_run_lengths(drift: float, threshold: float, shift: float, published: float, unit: float) -> None:
    assert one_sided(drift, threshold, shift) == pytest.approx(published, abs=unit / 2 + CHAIN * published)


@pytest.mark.parametrize(
    ("shift", "published", "unit"),
    [
        (0.0, 168, 1),
        (0.25, 74.2, 0.1),
        (0.5, 26.6, 0.1),
        (0.75, 13.3, 0.1),
        (1.0, 8.38, 0.01),
        (1.5, 4.75, 0.01),
        (2.0, 3.34, 0.01),
        (2.5, 2.62, 0.01),
        (3.0, 2.19, 0.01),
        (4.0, 1.71, 0.01),
        (5.0, 1.31, 0.01),
    ],
)
def test_lucas_and_crosier(shift: float, published: float, unit: float) -> None:
    # Technometrics 24 (1982), table 1: drift 0.5, threshold 4, two sides, no head start.
    assert two_sided(0.5, 4.0, shift) == pytest.approx(published, abs=unit / 2 + CHAIN * published)


def test_waldmann_two_sided() -> None:
    assert two_sided(0.6, 3.0, -0.2) == pytest.approx(65.4, abs=0.05 + CHAIN * 65.4)  # table 6


def test_noise_on_both_channels() -> None:
    """Plett's total least squares knows both variances; HandoverRls, which knows neither, has no more bias."""
    ratio, noise, size, seeds = 3.0, 0.03, 250, 200
    ends = []
    for seed in range(seeds):
        random = np.random.default_rng(seed)
        level = 0.25 * (1 + 0.2 * np.sin(2 * np.pi * (np.arange(size) / 200 + random.uniform())))
        output, regressor = (
            ratio * level + noise * random.standard_normal(size),
            level + noise * random.standard_normal(size),
        )
        least = palpate.Rls(forgetting=0.995).process(output, regressor)
        handover = palpate.HandoverRls().process(output, regressor)
        ends.append(
            [estimate[-1] / ratio - 1 for estimate in (awtls(output, regressor, noise, noise)[0], handover, least)]
        )
    known, ours, least_squares = np.mean(ends, axis=0)
    allowed = 4 * np.std(ends, axis=0) / math.sqrt(seeds)  # 0.25 %; a bias of 2nd order, the variance, is 0.01 %
    assert abs(known) < allowed[0]
    assert abs(ours) < allowed[1]
    assert abs(ours - known) < 1e-3  # their errors come from the same noise: the difference scatters far less
    # Least squares: the regressor's noise adds to sum x^2 alone. E[level^2] = 0.25^2 (1 + 0.2^2 / 2).
    expected = -(noise**2) / (0.25**2 * (1 + 0.2**2 / 2) + noise**2)
    assert abs(least_squares - expected) < allowed[2]
    assert least_squares < -0.01
