"""Substrate, bumps and gauges against their formulas."""

import math
from typing import Any

import numpy as np
import pytest
from numeric import QUIET, STEP_PF, changes, held, quiet
from palpate.simulation import Bumps, Gauge, Press, Simulation, Substrate
from palpate.simulation.hand import Hand

RATIO = 2.5
DEPTH_PF = 0.25
RIGID = 10.0
STIFFNESS = 0.3 * (1 - 1 / RATIO) / (1 - 1 / RIGID)
"""Of the soft bump and the object in series, pF/mm, by eq. (2)."""


def tilted(
    along: float, across: float = 0.0, *, tremor: float = 0.05, seed: int = 0, **substrate: Any
) -> Simulation:
    press = Press(2.0, [(0.0, RATIO)], depth_pF=DEPTH_PF, tilt_deg=(along, across))
    return quiet(seed, presses=[press], substrate=Substrate(**substrate), tremor=tremor)


@pytest.mark.parametrize("along", [0.5, 2.0, -0.5])
def test_flat_bumps_have_the_same_force_and_an_offset(along: float) -> None:
    """F1 + F2 is the hand's, and F1 = r F2 + r K g, g = 3 mm tan(angle); the truth is the ratio of level bumps."""
    run = tilted(along)
    level = tilted(0.0)
    (hard, soft), (first, second) = changes(run), changes(level)
    normal = math.cos(math.radians(along))
    assert hard + soft == pytest.approx(normal * (first + second), abs=4 * STEP_PF)
    gap = 3.0 * math.tan(math.radians(along))
    # A conversion during which a bump is reached averages a corner.
    both = (hard > 0.02) & (soft > 0.02)
    assert both.sum() > 200
    assert hard[both] == pytest.approx(
        RATIO * soft[both] + RATIO * STIFFNESS * gap, abs=4 * STEP_PF
    )
    assert (run.true_ratio[both] == RATIO).all()


def test_domes_differ_in_depth_by_the_gap() -> None:
    """F = k d^1.5 (Hertz) with k = r K and K: d1 - d2 = g at every force, and the force is the hand's."""
    run = tilted(1.0, exponent=1.5, tremor=0.0)
    hard, soft = (change[held(run)] for change in changes(run))
    first, second = changes(tilted(0.0, tremor=0.0))
    assert hard + soft == pytest.approx(
        math.cos(math.radians(1)) * (first + second)[held(run)], abs=4 * STEP_PF
    )
    apart = (hard / (RATIO * STIFFNESS)) ** (2 / 3) - (soft / STIFFNESS) ** (2 / 3)
    assert apart == pytest.approx(3.0 * math.tan(math.radians(1)), rel=1e-4)
    force = np.linspace(0, 0.3, 50)  # with one bump in contact, with two, and with none
    shares = [Substrate(exponent=1.5).pressed(force, 4.0, 3.0, hard=hard) for hard in (True, False)]
    assert 4.0 * shares[0] + shares[1] == pytest.approx(5.0 * force, abs=1e-9)
    assert (shares[1][:3] == 0).all()
    assert shares[1][-1] > 0


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize(("misplaced", "unequal"), [(0.0, 0.0), (0.05, 0.0), (-0.05, 0.2)])
def test_a_split_soft_bump_adds_the_forces_of_its_halves(
    exponent: float, misplaced: float, unequal: float
) -> None:
    """F1 = r K (d + m g)^s gives d, and then F2 = K sum w (d +- g)^s, a half that is lifted off without force."""
    split = Substrate(
        layout="soft-hard-soft", exponent=exponent, misplaced=misplaced, unequal=unequal
    )
    level = np.linspace(0, DEPTH_PF, 200)
    gap = 3.0 * math.tan(math.radians(2))
    first, soft = (split.pressed(level, RATIO, 2.0, hard=hard) for hard in (True, False))
    assert RATIO * first + soft == pytest.approx((1 + RATIO) * level, abs=1e-9)
    touches = first > 0
    depth = (first[touches] / STIFFNESS) ** (1 / exponent) - misplaced * gap
    halves = [
        np.maximum(depth + side * gap, 0) ** exponent * (1 + side * unequal) / 2 for side in (-1, 1)
    ]
    assert soft[touches] == pytest.approx(STIFFNESS * sum(halves), abs=1e-9)
    assert (depth < gap).any()
    if exponent == 1 and not (misplaced or unequal):  # the gap cancels
        assert first[touches][depth > gap] == pytest.approx(level[touches][depth > gap], abs=1e-9)


def test_a_tremor_of_the_angle_moves_force_between_the_bumps() -> None:
    long = Press(0.0, [(0.0, RATIO)], depth_pF=DEPTH_PF, hold_s=60.0)
    run = quiet(
        1, presses=[long], duration_s=58.0, tremor=0.0, substrate=Substrate(tremor_deg=0.05)
    )
    hard, soft = (change[held(run)] for change in changes(run))
    assert hard + soft == pytest.approx((1 + RATIO) * DEPTH_PF, abs=4 * STEP_PF)
    moved = RATIO * STIFFNESS * 3.0 * math.radians(0.05) / (1 + RATIO)
    # A conversion of 11 ms averages the tremor by 1 %; over 58 s the rms of 24 sines is known to a few per cent.
    assert soft.std() == pytest.approx(moved, rel=0.1)
    assert hard.mean() == pytest.approx(RATIO * DEPTH_PF, abs=0.1 * moved)


def test_a_tilt_settles() -> None:
    run = tilted(0.5, settles=1.0, settle_s=0.5, tremor=0.0)
    inside = held(run)
    hard, soft = (change[inside] for change in changes(run))
    angle = 0.5 * (1 + np.exp(-(run.t_hard_s[inside] - 2.0) / 0.5))
    offset = RATIO * STIFFNESS * 3.0 * np.tan(np.radians(angle))
    # A conversion averages the exponential: (11 ms / 0.5 s)^2 / 24 = 2e-5 of it.
    assert hard - RATIO * soft == pytest.approx(offset, abs=5 * STEP_PF)


def test_a_hand_tilts_as_it_says() -> None:
    hand = Hand(tilt_deg=0.5, shallow=0.5, press_spread=0.0, substrate=Substrate(tremor_deg=0.1))
    scenario = hand.touches(RATIO, 4000, np.random.default_rng(1))
    angles = np.array([press.tilt_deg for press in scenario.presses])
    # 8,000 of them: an s.d. is known to 0.8 %; 4 of it.
    assert angles.std() == pytest.approx(0.5, rel=0.032)
    assert abs(np.corrcoef(angles.T)[0, 1]) < 4 / math.sqrt(4000)
    depths = np.array([press.depth_pF for press in scenario.presses])
    assert depths * (1 + RATIO) == pytest.approx(np.exp(-0.5 * np.hypot(*angles.T) / 0.5))
    assert scenario.substrate.tremor_deg == 0.1


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
    assert hard[touching] / soft[touching] == pytest.approx(
        (RATIO + 0.03) / (1 + 0.03 * RATIO), rel=1e-5
    )


@pytest.mark.parametrize("depth", [0.125, 0.25, 0.5])
@pytest.mark.parametrize(
    ("exponent", "quadratic", "reference"),
    [(0.9, 0.0, 0.25), (1.0, 0.4, 0.5), (1.0, 0.4, 0.0), (1.2, 0.4, 0.25)],
)
def test_a_gauge_is_right_at_its_reference(
    depth: float, exponent: float, quadratic: float, reference: float
) -> None:
    """Of a force f = C1 / r: c = f (f / reference)^(p - 1) (1 + q f) / (1 + q reference); the truth stays r."""
    gauge = Gauge(exponent=exponent, quadratic_per_pF=quadratic, reference_pF=reference)
    run = quiet(presses=[Press(2.0, [(0.0, RATIO)], depth_pF=depth)], gauges=(Gauge(), gauge))
    hard, soft = (change[held(run)] for change in changes(run))
    force = hard / RATIO
    share = (force / reference) ** (exponent - 1) if reference else 1.0
    expected = force * share * (1 + quadratic * force) / (1 + quadratic * reference)
    assert soft == pytest.approx(expected, abs=2 * STEP_PF)  # a step of either channel
    assert (run.true_ratio[held(run)] == RATIO).all()


def test_creep_is_the_step_response_of_a_standard_linear_solid() -> None:
    """After a step at t0: 1 + share (1 - exp(-(t - t0) / tau)); after the release the same backwards."""
    share = 0.05
    tau = 2.0
    press = Press(2.0, [(0.0, RATIO)], rise_s=0.01, hold_s=6.0, fall_s=0.01)
    run = quiet(presses=[press], duration_s=14.0, gauges=(Gauge(), Gauge(creep=share, creep_s=tau)))
    # middles of rise and fall
    begun = 2.005
    ended = 8.015
    t, (hard, soft) = run.t_soft_s, changes(run)
    pressed = held(run)
    after = run.t_hard_s > 8.1
    grown = share * (1 - np.exp(-(t - begun) / tau))
    # The rise of 10 ms shifts the begin by less than (10 ms / tau)^2 of the share: 3e-7 pF.
    assert soft[pressed] == pytest.approx(DEPTH_PF * (1 + grown[pressed]), abs=4 * STEP_PF)
    left = share * (1 - math.exp(-(ended - begun) / tau)) * np.exp(-(t - ended) / tau)
    assert soft[after] == pytest.approx(DEPTH_PF * left[after], abs=4 * STEP_PF)
    assert hard[pressed] == pytest.approx(RATIO * DEPTH_PF, abs=STEP_PF)


def test_a_lag_is_an_exponential_approach() -> None:
    """A conversion of length T averages the exponential: exp(-t / tau) sinh(T / 2 tau) / (T / 2 tau)."""
    tau = 0.1
    span = QUIET.converter.span_s
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
