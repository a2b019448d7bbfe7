"""Bumps and gauges against their formulas."""

import math

import numpy as np
import pytest
from palpate.simulation import Bumps, Gauge, Press
from palpate.simulation.first_order import follow, recursion
from quiet import QUIET, STEP_PF, changes, held, quiet

RATIO, DEPTH_PF = 2.5, 0.25


@pytest.mark.parametrize("offset", [0.02, 0.05, -0.1])
def test_bumps_that_are_not_level_have_an_offset(offset: float) -> None:
    """C1 = r (C2 - c0) wherever both touch, tremor and rise included; the truth is r."""
    run = quiet(bumps=Bumps(offset=offset), tremor=0.05)
    hard, soft = changes(run)
    # A conversion during which a bump is reached averages a corner: 11 ms after the contact it is left out.
    both = (hard > 0.02) & (soft > 0.02)
    assert both.sum() > 250
    assert hard[both] == pytest.approx(RATIO * (soft[both] - offset * DEPTH_PF), abs=2 * STEP_PF)
    assert (run.true_ratio[both] == RATIO).all()
    first, second = (soft, hard) if offset > 0 else (hard, soft)
    assert ((first > 10 * STEP_PF) & (np.abs(second) < STEP_PF)).any()


def test_a_bump_bottoms_out_at_its_limit() -> None:
    limit = 0.75 * RATIO * DEPTH_PF
    hard, soft = changes(quiet(bumps=Bumps(bottoms_pF=(limit, math.inf))))
    assert hard.max() == pytest.approx(limit, abs=STEP_PF)
    assert soft.max() == pytest.approx(DEPTH_PF, abs=STEP_PF)
    below = (soft > 0.01) & (hard < 0.9 * limit)
    assert below.any()
    assert hard[below] == pytest.approx(RATIO * soft[below], abs=3 * STEP_PF)


def test_cross_talk_adds_a_share_of_the_other_channel() -> None:
    run = quiet(bumps=Bumps(cross_talk=0.03), tremor=0.05)
    hard, soft = changes(run)
    touching = soft > 0.1
    assert hard[touching] / soft[touching] == pytest.approx((RATIO + 0.03) / (1 + 0.03 * RATIO), rel=1e-5)


@pytest.mark.parametrize("depth", [0.125, 0.25, 0.5])
def test_a_power_gauge_is_right_at_its_reference(depth: float) -> None:
    """Soft ~ F^0.9, calibrated at 0.25 pF: at another depth d the ratio is r (d / 0.25)^0.1."""
    press = Press(2.0, [(0.0, RATIO)], depth_pF=depth)
    run = quiet(presses=[press], gauges=(Gauge(), Gauge(exponent=0.9, reference_pF=0.25)))
    hard, soft = (change[held(run)] for change in changes(run))
    assert hard / soft == pytest.approx(RATIO * (depth / 0.25) ** 0.1, rel=1e-5)
    assert (run.true_ratio[held(run)] == RATIO).all()


@pytest.mark.parametrize(("depth", "reference"), [(0.25, 0.5), (0.25, 0.25), (0.5, 0.25), (0.25, 0.0)])
def test_a_quadratic_gauge_is_right_at_its_reference(depth: float, reference: float) -> None:
    """Least squares of c against f and f^2: c = f (1 + q f) / (1 + q reference)."""
    press = Press(2.0, [(0.0, RATIO)], depth_pF=depth)
    run = quiet(presses=[press], gauges=(Gauge(), Gauge(quadratic_per_pF=0.4, reference_pF=reference)))
    force, soft = changes(run)[0] / RATIO, changes(run)[1]
    linear, square = np.linalg.lstsq(np.stack((force, force**2), axis=1), soft, rcond=None)[0]
    # A conversion on the rise averages the square: q (slope 11 ms)^2 / 12 = 3e-5 pF in a few of 385 pairs.
    assert linear == pytest.approx(1 / (1 + 0.4 * reference), rel=1e-3)
    assert square == pytest.approx(0.4 / (1 + 0.4 * reference), rel=1e-2)


def test_creep_is_the_step_response_of_a_standard_linear_solid() -> None:
    """After a step at t0: 1 + share (1 - exp(-(t - t0) / tau)); after the release the same backwards."""
    share, tau = 0.05, 2.0
    press = Press(2.0, [(0.0, RATIO)], rise_s=0.01, hold_s=6.0, fall_s=0.01)
    run = quiet(presses=[press], duration_s=14.0, gauges=(Gauge(), Gauge(creep=share, creep_s=tau)))
    begun, ended = 2.005, 8.015  # middles of rise and fall
    t, (hard, soft) = run.t_soft_s, changes(run)
    pressed, after = held(run), run.t_hard_s > 8.1
    grown = share * (1 - np.exp(-(t - begun) / tau))
    # The rise of 10 ms shifts the begin by less than (10 ms / tau)^2 of the share: 3e-7 pF.
    assert soft[pressed] == pytest.approx(DEPTH_PF * (1 + grown[pressed]), abs=4 * STEP_PF)
    left = share * (1 - math.exp(-(ended - begun) / tau)) * np.exp(-(t - ended) / tau)
    assert soft[after] == pytest.approx(DEPTH_PF * left[after], abs=4 * STEP_PF)
    assert hard[pressed] == pytest.approx(RATIO * DEPTH_PF, abs=STEP_PF)


def test_a_lag_is_an_exponential_approach() -> None:
    """A conversion of length T averages the exponential: exp(-t / tau) sinh(T / 2 tau) / (T / 2 tau)."""
    tau, span = 0.1, QUIET.converter.span_s
    press = Press(2.0, [(0.0, RATIO)], rise_s=0.01, hold_s=6.0, fall_s=0.01)
    run = quiet(presses=[press], gauges=(Gauge(lag_s=tau), Gauge()))
    average = math.sinh(span / 2 / tau) / (span / 2 / tau)
    t, (hard, soft) = run.t_hard_s, changes(run)
    pressed = held(run)
    expected = RATIO * DEPTH_PF * (1 - average * np.exp(-(t - 2.005) / tau))
    # The rise, with a variance of 0.047 (10 ms)^2, scales the exponential by 1 + variance / (2 tau^2): 2.4e-4.
    assert hard[pressed] == pytest.approx(expected[pressed], abs=2.5e-4 * RATIO * DEPTH_PF)
    assert hard[pressed][0] < 0.6 * RATIO * DEPTH_PF
    assert soft[pressed] == pytest.approx(DEPTH_PF, abs=STEP_PF)


def test_creep_and_lag_on_one_bump_follow_each_other() -> None:
    """A transfer function of DC gain 1 + share; with equal lags of both bumps the ratio stays."""
    solid = Gauge(creep=0.1, creep_s=0.3, lag_s=0.05)
    run = quiet(gauges=(solid, solid))
    hard, soft = (change[held(run)] for change in changes(run))
    assert soft[-1] == pytest.approx(1.1 * DEPTH_PF, rel=1e-5)
    assert hard == pytest.approx(RATIO * soft, abs=3 * STEP_PF)


@pytest.mark.parametrize("tau", [0.0003, 0.02, 3.0])
def test_the_recursion_is_the_sample_by_sample_one(tau: float) -> None:
    """X from a random walk; reference: the differential equation on a grid a thousand times finer, x linear between."""
    step, fine = 0.001, 1000
    x = np.cumsum(np.random.default_rng(2).standard_normal(60))
    found, y, decay = follow(x, step, tau), x[0], math.exp(-step / fine / tau)
    for n in range(1, x.size):
        middles = x[n - 1] + (np.arange(fine) + 0.5) / fine * (x[n] - x[n - 1])
        for value in middles:
            y = value + (y - value) * decay
        # The midpoint rule: (1 / fine)^2 of a step, with tau / step up to 3 of it.
        assert found[n] == pytest.approx(y, abs=2e-5)


def test_the_recursion_of_any_length() -> None:
    random = np.random.default_rng(3)
    for size in (0, 1, 2, 3, 7, 8, 9, 100):
        start, pole, y = random.standard_normal(size), 0.97, 0.0
        expected = [y := pole * y + value for value in start]
        assert recursion(start, pole) == pytest.approx(np.array(expected), abs=1e-13)


def test_settings_out_of_range() -> None:
    with pytest.raises(ValueError, match=r"reference_pF: got 0 with exponent 0\.9, allowed: above 0, or exponent 1"):
        Gauge(exponent=0.9)
    with pytest.raises(ValueError, match=r"creep_s: got 0\.0, allowed: a finite number above 0"):
        Gauge(creep_s=0.0)
    with pytest.raises(ValueError, match=r"offset: got 1\.5, allowed: -1 to 1"):
        Bumps(offset=1.5)
    with pytest.raises(ValueError, match=r"bottoms_pF: got \(-1\.0, inf\), allowed: 0 or more"):
        Bumps(bottoms_pF=(-1.0, math.inf))
    with pytest.raises(ValueError, match=r"relaxation_s: got 0\.0, allowed: a finite number above 0"):
        Press(0.0, [(0.0, 1.0)], relaxation_s=0.0)
