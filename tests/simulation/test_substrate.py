"""A tilted substrate against the equations of two springs on one plate, and the hand that holds it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from palpate.simulation import Press, Simulation, Substrate
from palpate.simulation.hand import Hand
from quiet import STEP_PF, changes, held, quiet

RATIO, DEPTH_PF, RIGID = 2.5, 0.25, 10.0
STIFFNESS = 0.3 * (1 - 1 / RATIO) / (1 - 1 / RIGID)
"""Of the soft bump and the object in series, pF/mm, by eq. (2)."""


def tilted(along: float, across: float = 0.0, *, tremor: float = 0.05, seed: int = 0, **substrate: float) -> Simulation:
    press = Press(2.0, [(0.0, RATIO)], depth_pF=DEPTH_PF, tilt_deg=(along, across))
    return quiet(seed, presses=[press], substrate=Substrate(**substrate), tremor=tremor)


@pytest.mark.parametrize("along", [0.5, 2.0, -0.5])
def test_flat_bumps_have_the_same_force_and_an_offset(along: float) -> None:
    """F1 + F2 is the hand's, and F1 = r F2 + r K g, g = 3 mm tan(angle); the truth is that of level bumps."""
    run, level = tilted(along), tilted(0.0)
    (hard, soft), (first, second) = changes(run), changes(level)
    normal = math.cos(math.radians(along))
    assert hard + soft == pytest.approx(normal * (first + second), abs=4 * STEP_PF)
    gap = 3.0 * math.tan(math.radians(along))
    # A conversion during which a bump is reached averages a corner.
    both = (hard > 0.02) & (soft > 0.02)
    assert both.sum() > 200
    assert hard[both] == pytest.approx(RATIO * soft[both] + RATIO * STIFFNESS * gap, abs=4 * STEP_PF)
    assert (run.true_ratio[both] == RATIO).all()


def test_a_tilt_across_takes_only_the_part_of_the_force_that_is_not_normal() -> None:
    hard, soft = changes(tilted(0.0, 10.0))
    first, second = changes(tilted(0.0))
    assert hard == pytest.approx(math.cos(math.radians(10)) * first, abs=2 * STEP_PF)
    assert soft == pytest.approx(math.cos(math.radians(10)) * second, abs=2 * STEP_PF)


def test_domes_differ_in_depth_by_the_gap() -> None:
    """F = k d^1.5 (Hertz) with k = r K and K: d1 - d2 = g at every force, and the force is the hand's."""
    run = tilted(1.0, exponent=1.5, tremor=0.0)
    hard, soft = (change[held(run)] for change in changes(run))
    first, second = changes(tilted(0.0, tremor=0.0))
    assert hard + soft == pytest.approx(math.cos(math.radians(1)) * (first + second)[held(run)], abs=4 * STEP_PF)
    apart = (hard / (RATIO * STIFFNESS)) ** (2 / 3) - (soft / STIFFNESS) ** (2 / 3)
    assert apart == pytest.approx(3.0 * math.tan(math.radians(1)), rel=1e-4)
    force = np.linspace(0, 0.3, 50)  # with one bump in contact, with two, and with none
    shares = [Substrate(exponent=1.5).pressed(force, 4.0, 3.0, hard=hard) for hard in (True, False)]
    assert 4.0 * shares[0] + shares[1] == pytest.approx(5.0 * force, abs=1e-9)
    assert (shares[1][:3] == 0).all()
    assert shares[1][-1] > 0


@pytest.mark.parametrize("ratio", [0.8, 1.0])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_on_nothing_the_tilt_moves_nothing(ratio: float, exponent: float) -> None:
    """At r = 1 the object has no stiffness."""
    force, substrate = np.linspace(0, 0.3, 5), Substrate(exponent=exponent)
    assert substrate.pressed(force, ratio, 1.0, hard=False) == pytest.approx(force, rel=1e-2)


def test_level_bumps_are_as_before_bit_for_bit() -> None:
    run, other = quiet(tremor=0.05), tilted(0.0, exponent=1.5, settles=1.0, spacing_mm=9.0)
    assert np.array_equal(run.hard_raw, other.hard_raw)
    assert np.array_equal(run.soft_raw, other.soft_raw)


def test_a_tremor_of_the_angle_moves_force_between_the_bumps() -> None:
    long = Press(0.0, [(0.0, RATIO)], depth_pF=DEPTH_PF, hold_s=60.0)
    run = quiet(1, presses=[long], duration_s=58.0, tremor=0.0, substrate=Substrate(tremor_deg=0.05))
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


def test_a_hand_that_does_not_tilt_is_as_before() -> None:
    """The random numbers of a session without a tilt stay the same."""
    presses = [hand.touches(RATIO, 3, np.random.default_rng(1)).presses for hand in (Hand(), Hand(shallow=1.0))]
    assert presses[0] == presses[1]
    tilted_hand = replace(Hand(), tilt_deg=0.5).touches(RATIO, 3, np.random.default_rng(1)).presses
    assert [press.depth_pF for press in tilted_hand] == [press.depth_pF for press in presses[0]]


def test_settings_out_of_range() -> None:
    with pytest.raises(ValueError, match=r"tilt_deg: got \(60\.0, 0\.0\), allowed: -45 to 45"):
        Press(0.0, [(0.0, 1.0)], tilt_deg=(60.0, 0.0))
    with pytest.raises(ValueError, match="rigid_ratio: got 1, allowed: above 1"):
        Substrate(rigid_ratio=1)
    with pytest.raises(ValueError, match=r"exponent: got 0\.5, allowed: 1 to 3"):
        Substrate(exponent=0.5)
    with pytest.raises(ValueError, match="settles: got -1, allowed: 0 or more"):
        Substrate(settles=-1)
