"""What was wrong by per cents: the end of a touch, tilt, creep, coarse codes; on a simulator that shares nothing with palpate's.

The bounds are what the product promises (docs/numbers.md); 20 touches a row, 200 by night.
"""

import math
import pickle
from dataclasses import replace

import numpy as np
import palpate
import pytest
from effort import Tally, draws
from palpate.simulation import Press, Scenario, simulate

from bench.accuracy.modulus import (
    CREEPS,
    LEVEL,
    SILENT,
    SOURCES,
    AGE_s,
    drawn,
    found,
    longest_touch,
    rms,
    scatter,
)
from bench.accuracy.other_probe import Way, touch

SEEDS = range(draws(20, nightly=200, at_least=20))
BOUNDS = {  # rms of the level ratio, %
    "level and still, flat": 0.02,
    "level and still, domes": 0.04,
    "level, trembling, flat": 0.2,
    "level, trembling, domes": 0.25,
    "0.5 degrees, flat": 0.2,
    "0.5 degrees, domes": 0.3,
    "2 degrees, domes": 0.5,
}
HARD = 0.8  # the same of the other rows


@pytest.mark.parametrize("name", SILENT)
def test_a_wrong_result_is_never_silent(name: str) -> None:
    assert found(SILENT[name], SEEDS).silent <= 0.02


@pytest.mark.parametrize("fall", [0.2, 1.0, 3.0])
@pytest.mark.parametrize("period", [0.026, 0.006, 0.05])
def test_a_lift_with_another_ratio_changes_nothing(fall: float, period: float) -> None:
    """At 20 pairs a second without tremor, which they would alias."""
    way = Way(
        lifted_ratio=0.9,
        hold=3.0,
        fall=fall,
        period=period,
        tremor=0.03 if period < 0.03 else 0.0,
        before=3.0,
    )
    assert rms(found(way, SEEDS).ratio) < 0.01


@pytest.mark.parametrize("fall", [0.2, 1.0, 2.0, 3.0])
def test_a_lift_with_another_ratio_at_10_pairs_a_second(fall: float) -> None:
    """There the ratio drifts already in the hold: what is left of the rise, which few pairs saw."""
    made = found(
        Way(lifted_ratio=0.9, hold=3.0, fall=fall, period=0.1, tremor=0.0, before=5.0, after=5.0),
        SEEDS,
    )
    assert made.silent == 0
    assert rms(made.ratio) < 0.15


def test_a_change_before_the_end_is_the_result_once_it_lasted() -> None:
    """0.2 s before the lift the ratio before it is the result, with both said; 1 s before it the one after."""
    late, early = (longest_touch(Way(hold=4.0, change=(before, 1.3)), 1) for before in (4.1, 3.3))
    assert late.ratio == pytest.approx(2.8, rel=1e-3)
    assert late.ratio_after == pytest.approx(1.3 * 2.8, abs=4 * late.after_standard_error)
    assert "changed" in late.flags
    assert early.ratio == pytest.approx(1.3 * 2.8, rel=1e-3)
    assert early.ratio_before == pytest.approx(2.8, abs=4 * early.before_standard_error)
    assert "changed" in early.flags
    assert np.isnan([early.ratio_after, late.ratio_before]).all()
    assert [pickle.loads(pickle.dumps(touch)) for touch in (early, late)] == [early, late]


@pytest.mark.parametrize("steps", [(1.3,), (1.3, 1.0), (1.01,), (0.7, 0.71)])
def test_a_touch_that_saw_two_objects_says_so(steps: tuple[float, ...]) -> None:
    """The farthest of the ratios before the last one is reported; 20 runs each."""
    for seed in SEEDS:
        ratios = [(0.0, 2.8), *((1.3 * (n + 1), 2.8 * step) for n, step in enumerate(steps))]
        [made] = palpate.touches(
            simulate(Scenario([Press(1.5, ratios, hold_s=5.0)], duration_s=10.0), seed)
        )
        farthest = max([1.0, *steps[:-1]], key=lambda step: abs(step - steps[-1]))
        assert made.ratio == pytest.approx(2.8 * steps[-1], rel=1e-3)
        assert made.ratio_before == pytest.approx(2.8 * farthest, rel=5e-3)
        assert "changed" in made.flags


def test_readings_that_are_swapped_amid_a_touch_change_nothing() -> None:
    run = touch(Way(hold=4.0), 3)
    for pairs in ([120], [120, 150], [120, 121, 122]):
        hard = run.hard.copy()
        soft = run.soft.copy()
        hard[pairs] = run.soft[pairs]
        soft[pairs] = run.hard[pairs]
        [made] = palpate.touches(replace(run, hard=hard, soft=soft))
        assert made.ratio == pytest.approx(2.8, rel=1e-4)


def test_the_level_ratio_keeps_its_bounds_and_its_intervals_hold(tally: Tally) -> None:
    covered = []
    for name, way in LEVEL.items():
        made = found(way, SEEDS)
        assert rms(made.level) <= BOUNDS.get(name, HARD), name
        covered.append(made.covered)
    share = float(np.concatenate(covered).mean())
    tally.say(f"95 % intervals of the level ratio: {100 * share:.1f} %")
    assert 0.9 <= share <= 0.99


def test_a_tilt_is_flagged() -> None:
    """Angles of 0.5 degrees rms, those from 0.3 on, rises of 0.2 to 0.5 s, flat bumps and domes."""
    flagged = []
    for seed in SEEDS:
        random = np.random.default_rng((seed, 11))
        angle = float(random.normal(0, 0.5))
        way = Way(
            angle=angle,
            trembling=0.03,
            rise=random.uniform(0.2, 0.5),
            exponent=random.choice([1.0, 1.5]),
        )
        if abs(angle) >= 0.3:
            flagged.append(
                bool({"tilt", "offset"} & {*longest_touch(drawn(way, seed), seed).flags})
            )
    assert np.mean(flagged) >= 0.95


@pytest.mark.parametrize("bend", [0.0, 0.005])
def test_a_healthy_touch_has_no_flag(bend: float) -> None:
    count = draws(100, nightly=2000, at_least=100)
    made = found(Way(bend=bend, rise=0.3), range(count))
    flags = {flag: times for flag, times in made.flags.items() if flag != "short"}
    assert sum(flags.values()) <= 0.002 * count, flags


@pytest.mark.parametrize("fall", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("period", [0.034, 0.026, 0.018, 0.01, 0.0055, 0.004, 0.002])
def test_a_healthy_touch_is_right_at_any_rate(period: float, fall: float) -> None:
    """Means of a fast converter included; a slow lift is no creep, and the standard error is of the size of the error."""
    way = Way(period=period, fall=fall, tremor=0.08 if period < 0.03 else 0.03, after=4.0)
    touches = [longest_touch(drawn(way, seed), seed) for seed in SEEDS]
    assert not {flag for touch in touches for flag in touch.flags} - {"short"}
    off = np.array(
        [
            touch.ratio / drawn(way, seed).ratio - 1
            for touch, seed in zip(touches, SEEDS, strict=True)
        ]
    )
    errors = np.array([touch.standard_error / touch.ratio for touch in touches])
    assert rms(off) < 0.008 * max(period / 0.026, 0.5)
    assert 0.5 < np.median(errors) / np.sqrt(np.mean(off**2)) < 3
    level = found(way, SEEDS)
    assert rms(level.level) < (0.04 if period < 0.03 else 0.08)
    assert np.mean(level.covered) >= 0.85


@pytest.mark.parametrize("period", [0.026, 0.01, 0.006, 0.002])
def test_a_touch_whose_length_ends_in_the_lift_is_right_or_says_so(period: float) -> None:
    assert found(Way(period=period, hold=5.6, fall=3.0, lifted_ratio=0.9), SEEDS).silent == 0


@pytest.mark.parametrize("code", [0.01, 0.001])
@pytest.mark.parametrize("period", [0.05, 0.026, 0.01])
def test_a_steady_press_of_coarse_codes_knows_its_error(
    period: float, code: float, tally: Tally
) -> None:
    """On a stand all readings of the hold, and of the baseline, may be the same: only the way down and up shows the step."""
    way = Way(period=period, code=code, tremor=0.0, total=0.95)
    z = []
    for seed in SEEDS:
        made = longest_touch(drawn(way, seed), seed)
        z.append((made.ratio - drawn(way, seed).ratio) / made.standard_error)
        assert math.isnan(made.level_ratio)
    held = np.mean(np.abs(z) < 1.96)
    tally.say(
        f"95 % intervals of a steady press, codes of {1000 * code:g} fF, {period} s: {100 * held:.0f} %"
    )
    assert held >= 0.8


@pytest.mark.parametrize("name", list(CREEPS)[:2])
def test_creep_is_the_same_at_one_age(name: str) -> None:
    """Of the bumps, and of the object; a touch that does not reach the age says so."""
    made = found(CREEPS[name], SEEDS, age=AGE_s)
    assert scatter(made.ratio) < 0.1 < scatter(found(CREEPS[name], SEEDS).ratio)
    reached, missed = (longest_touch(Way(hold=hold), 1, age=AGE_s) for hold in (2.0, 1.0))
    assert (reached.age_s, "short" in reached.flags) == (AGE_s, False)
    assert "short" in missed.flags
    # at its length, before this age
    assert "short" in longest_touch(Way(hold=9.0), 1, age=60.0).flags


@pytest.mark.parametrize("period", [0.01, 0.0125, 0.016, 0.02])
def test_a_ratio_that_comes_and_goes_is_said(period: float) -> None:
    """At each rate, whether the result follows it or not."""
    assert found(Way(pulse=0.02, period=period), SEEDS).silent <= 0.05


def test_the_level_ratio_of_a_light_press_is_not_smaller() -> None:
    """The noise of the soft channel is a fiftieth of the depth, or less: then there is no level ratio, or a right one."""
    for way in (
        Way(total=0.1, noise=1e-3),
        Way(total=0.1, noise=1e-3, exponent=1.5),
        Way(total=0.05, noise=1e-3),
    ):
        made = [longest_touch(replace(way, tremor=0.0, code=1e-9), seed) for seed in SEEDS]
        errors = np.array([one.level_ratio / 2.8 - 1 for one in made])
        known = np.isfinite(errors)
        assert not any("tilt" in one.flags for one in made)
        if known.sum() > 5:
            assert abs(errors[known].mean()) < 0.05
            inside = [abs(one.level_ratio - 2.8) < 1.96 * one.level_standard_error for one in made]
            assert np.mean(np.array(inside)[known]) > 0.75


def test_a_touch_in_the_first_baseline_is_found_or_said() -> None:
    """It begins while the first baseline is measured; the next touch is right."""
    for before in np.arange(0.1, 1.05, 0.1):
        run = touch(Way(before=float(before), hold=2.0, after=3.0), 1) + touch(
            Way(before=0.3, hold=3.0), 2
        )
        made = palpate.tracking.tracked(run)
        assert made.touches[-1].ratio == pytest.approx(2.8, rel=1e-4)
        assert len(made.touches) == 2 or made.retaken, before


def test_a_change_is_found_in_four_pairs() -> None:
    """Of 30 % either way, under a tremor of 8 %: pairs until the ratio is within 2 %.

    Beside the two for which each reading waits in the screen.
    """
    pairs = []
    for seed in range(draws(300, nightly=3000, at_least=300)):
        ratio = float(np.random.default_rng(seed).uniform(1.5, 6))
        way = Way(ratio=ratio, hold=4.5, tremor=0.08, change=(2.0, 0.7 if seed % 2 else 1.3))
        run = touch(way, seed)
        rows = palpate.Tracker("handheld").process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
        since = rows["ratio"][np.searchsorted(run.t_hard_s, way.before + 2.0) + 2 :]
        pairs.append(int(np.argmax(np.abs(since / (ratio * way.change[1]) - 1) < 0.02)))
    assert np.median(pairs) <= 4
    assert np.mean(np.array(pairs) > 6) <= 0.025
    assert max(pairs) <= 10


def test_no_level_ratio_without_a_sweep_or_from_coarse_codes() -> None:
    for way in (Way(rise=0.03, fall=0.03, exponent=1.5), SILENT["codes of 1/4 pF"]):
        made = found(way, SEEDS)
        known = np.isfinite(made.level)
        assert np.all(np.abs(made.level[known]) < 4 * made.level_error[known])
        assert known.mean() < 0.5 or rms(made.level) < HARD
    [slid] = palpate.touches(touch(Way(), 1), scene="sliding")
    assert slid.contact_exponent == 0
    assert np.isnan(slid.level_ratio)


def test_sources_of_error_are_as_told() -> None:
    """The ratio is off by per cents, the level ratio by tenths of one."""
    for name, way in SOURCES.items():
        made = found(way, SEEDS)
        assert rms(made.level) < 0.5, name
