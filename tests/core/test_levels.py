"""Jumps at rest, steps within a press, channels that do not follow, probes that fall: named, dated, and survived."""

from dataclasses import replace
from typing import Any

import numpy as np
import palpate
import pytest
from hand_presses import HARD, SOFT, Press, Session, session
from palpate import Touch, Tracker
from palpate.judgements import Judgement

NEW = {"step", "jumped", "saturated"}
SEEDS = range(4)


def judged(tracker: Tracker) -> list[Judgement]:
    return [each for each in tracker.judgements if each.name != "frozen"]


def track(made: Session, scene: Any = "handheld", **settings: Any) -> Tracker:
    tracker: Tracker = Tracker(scene, **settings)
    tracker.process(*made.columns)
    tracker.finish()
    return tracker


def touch_of(press: Press, tracker: Tracker) -> Touch | None:
    near = [t for t in tracker.touches if abs(t.start_s - press.begin) < 0.35]
    return near[0] if near else None


def measured(made: Session, tracker: Tracker) -> list[bool]:
    """Return of each press whether its touch is right within 2 %, and has none of the new flags."""
    touches = [touch_of(press, tracker) for press in made.presses]
    return [
        t is not None and abs(t.ratio / made.ratio - 1) < 0.02 and not NEW & set(t.flags)
        for t in touches
    ]


@pytest.mark.parametrize("pairs_per_s", [38.0, 115.0, 500.0])
@pytest.mark.parametrize("depth", [0.05, 0.25])
def test_healthy_presses_of_a_hand_are_not_judged(pairs_per_s: float, depth: float) -> None:
    for seed in SEEDS:
        made = session(seed, pairs_per_s=pairs_per_s, depth=depth, count=4)
        tracker = track(made)
        assert not judged(tracker)
        assert len(tracker.touches) == 4
        assert not any(NEW & set(touch.flags) for touch in tracker.touches)


@pytest.mark.parametrize("hold_s", [0.1, 3.0, 8.0])
def test_presses_of_a_stage_are_not_judged(hold_s: float) -> None:
    presses = [Press(3 + (hold_s + 4) * k, 0.1 + 0.1 * k, hold=hold_s) for k in range(3)]
    for seed in SEEDS:
        tracker = track(session(seed, presses, tremor=0.0))
        assert not judged(tracker)
        assert len(tracker.touches) == 3


def test_slow_approaches_and_relaxing_objects_are_not_judged() -> None:
    presses = [Press(3 + 20 * k, 0.25, rise=3.0, hold=12.0, fall=2.0) for k in range(2)]
    for seed in SEEDS:
        made = session(seed, presses, tremor=0.0)
        t = made.t_hard - np.select([made.t_hard > 22], [20], 0)
        relaxed = 1 - 0.2 * (1 - np.exp(-np.clip(t - 6, 0, None) / 3))
        hard = HARD + (made.hard - HARD) * relaxed
        tracker = track(replace(made, hard=hard, soft=SOFT + (made.soft - SOFT) * relaxed))
        assert not judged(tracker)


@pytest.mark.parametrize("size", [0.02, 0.3, 3.0, -0.02, -0.3])
@pytest.mark.parametrize("channel", ["hard", "soft"])
def test_a_channel_that_jumps_at_rest_costs_one_touch_at_most(channel: str, size: float) -> None:
    for seed in SEEDS:
        made = session(seed)
        at_s = made.presses[3].end + np.random.default_rng(seed).uniform(0.4, 2.0)
        made.step(channel, at_s, size)
        tracker = track(made)
        [jump] = judged(tracker)
        assert (jump.name, jump.channel) == ("jumped", channel)
        assert jump.time_s == pytest.approx(at_s, abs=0.06)
        assert jump.size == pytest.approx(size, abs=2e-3)
        assert measured(made, tracker).count(False) <= 1
        assert len(tracker.touches) <= 10  # the jump began none that is reported


@pytest.mark.parametrize("decimals", [2, 3])
def test_the_first_change_of_coarse_readings_may_be_a_jump(decimals: int) -> None:
    made = session(1, [Press(9.0)], noise=1e-6)
    made.step("hard", 4.0, 0.3)
    made.print(decimals)
    tracker = track(made)
    assert [(j.name, j.channel) for j in judged(tracker)] == [("jumped", "hard")]
    assert len(tracker.touches) == 1


@pytest.mark.parametrize("pairs_per_s", [115.0, 1000.0])
def test_a_jump_is_survived_by_fast_converters(pairs_per_s: float) -> None:
    made = session(1, pairs_per_s=pairs_per_s, count=4)
    made.step("hard", made.presses[1].end + 1, 0.3)
    tracker = track(made)
    assert [j.name for j in judged(tracker)] == ["jumped"]
    assert measured(made, tracker) == [True] * 4


def test_after_a_jump_the_tracker_waits_at_the_new_level() -> None:
    made = session(1, count=2)
    at_s = made.presses[0].end + 2
    made.step("hard", at_s, 0.3)
    tracker = Tracker("handheld")
    before = made.t_hard < at_s + 0.6
    tracker.process(*(column[before] for column in made.columns))
    assert (tracker.state, tracker.touch_count) == ("contact", 1)
    after = ~before & (made.t_hard < at_s + 1)
    rows = tracker.process(*(column[after] for column in made.columns))
    assert (tracker.state, tracker.touch_count) == ("waiting", 1)
    assert rows["hard_baseline"][-1] == pytest.approx(HARD + 0.3, abs=1e-4)
    assert rows["touch"][-1] == 0
    assert np.isnan(tracker.ratio)


def test_the_touch_before_a_jump_is_revised_all_the_same() -> None:
    made = session(2, count=3)
    made.step("soft", made.presses[1].end + 2.2, 0.5)
    tracker = track(made)
    assert [touch.revised for touch in tracker.touches[:2]] == [True, True]


def test_a_jump_of_both_is_judged_at_once_after_presses_that_trembled() -> None:
    for seed in SEEDS:
        made = session(seed, count=5)
        at_s = made.presses[2].end + 0.7
        made.step("hard", at_s, 0.5)
        made.step("soft", at_s, 0.3)
        tracker = track(made)
        [jump] = judged(tracker)
        assert (jump.name, jump.channel) == ("jumped", "both")
        assert (jump.size, jump.soft_size) == pytest.approx((0.5, 0.3), abs=2e-3)
        [touch] = [t for t in tracker.touches if "jumped" in t.flags]
        assert touch.start_s == pytest.approx(at_s, abs=0.1)
        assert measured(made, tracker).count(False) <= 1


def long_press(hold_s: float, seed: int = 1) -> Session:
    return session(seed, [Press(3.0, hold=hold_s), Press(hold_s + 9)], tremor=0.0)


def test_a_stage_that_holds_for_longer_than_any_was_a_touch_as_soon_as_it_lifts() -> None:
    made = long_press(14.0)
    tracker = Tracker("handheld")
    pressed = made.t_hard < 16
    tracker.process(*(column[pressed] for column in made.columns))
    [touch] = tracker.touches
    assert touch.flags == ("jumped",)
    assert tracker.revisions_since(0) == [1]
    tracker.process(*(column[~pressed] for column in made.columns))
    assert [j.name for j in judged(tracker)] == ["jumped", "was_touch"]
    assert tracker.touches[0].flags == ()
    assert abs(tracker.touches[0].ratio / made.ratio - 1) < 1e-3
    assert tracker.revisions_since(1)[0] == 1


def test_a_jump_of_both_is_pending_for_10_s_without_a_hand() -> None:
    made = session(1, [Press(3.0), Press(20.0)], tremor=0.0)
    made.step("hard", 7.5, 0.2)
    made.step("soft", 7.5, 0.1)
    tracker = track(made)
    assert [(j.name, j.channel) for j in judged(tracker)] == [("jumped", "both")]
    assert [t.flags for t in tracker.touches] == [("short",), ("jumped",), ("short",)]
    assert measured(made, tracker) == [True, True]


@pytest.mark.parametrize("size", [0.1, 0.5, -0.134])
@pytest.mark.parametrize("channel", ["hard", "soft"])
def test_a_step_within_a_hold_is_named_with_its_time_and_size(channel: str, size: float) -> None:
    for seed in SEEDS:
        made = session(seed, count=6)
        press = made.presses[3]
        at_s = press.begin + press.rise + 0.5 * press.hold
        made.step(channel, at_s, size * (made.ratio / 4 if channel == "hard" else 1))
        tracker = track(made)
        [step] = judged(tracker)
        assert (step.name, step.channel) == ("step", channel)
        assert step.time_s == pytest.approx(at_s, abs=0.1)
        touch = touch_of(press, tracker)
        assert touch is not None
        assert "step" in touch.flags
        assert not {"tilt", "lag", "curve", "offset", "changed"} & set(touch.flags)
        assert palpate.flags.Flag("step").meaning.excludes(touch)
        assert measured(made, tracker).count(False) == 1


@pytest.mark.parametrize("decimals", [3, 4, 6])
@pytest.mark.parametrize("channel", ["hard", "soft"])
def test_a_channel_at_its_highest_reading_is_saturated(channel: str, decimals: int) -> None:
    flagged = touches = 0
    for seed in SEEDS:
        made = session(seed, count=5)
        made.print(decimals)
        healthy = track(made)
        assert not judged(healthy)
        values = made.values_of(channel)
        rest = np.median(values)
        np.minimum(values, np.round(rest + 0.4 * (values.max() - rest), decimals), out=values)
        tracker = track(made)
        touches += len(tracker.touches)
        flagged += sum("saturated" in touch.flags for touch in tracker.touches)
        assert {(j.name, j.channel) for j in judged(tracker)} == {("saturated", channel)}
    assert touches == 20
    assert flagged >= 19


def test_a_rail_that_dithers_is_saturated() -> None:
    flagged = 0
    for seed in SEEDS:
        made = session(seed, count=5)
        rail = SOFT + 0.5 * (made.soft.max() - SOFT)
        dither = np.random.default_rng(seed).normal(0, 1e-4, made.soft.size)
        made.soft = np.where(made.soft > rail, rail + dither, made.soft)
        flagged += sum("saturated" in touch.flags for touch in track(made).touches)
    assert flagged >= 16


def test_a_stage_that_stops_at_one_depth_with_coarse_digits_is_asked_about() -> None:
    presses = [Press(3 + 7 * k) for k in range(4)]
    made = session(1, presses, tremor=0.0, noise=1e-5)
    made.print(3)
    tracker = track(made)
    assert {j.name for j in judged(tracker)} == {"still"}
    assert sorted(j.channel for j in judged(tracker)) in (["hard"], ["soft"], ["hard", "soft"])
    assert not any(NEW & set(touch.flags) for touch in tracker.touches)


@pytest.mark.parametrize("pairs_per_s", [38.0, 200.0])
def test_channels_that_fall_when_pressed_are_named_once(pairs_per_s: float) -> None:
    made = session(1, pairs_per_s=pairs_per_s, count=5)
    tracker = track(replace(made, hard=-made.hard, soft=-made.soft))
    [falling] = judged(tracker)
    assert (falling.name, falling.channel) == ("falling", "both")
    assert falling.size < falling.soft_size < 0


def test_a_probe_that_rests_on_an_object_at_first_does_not_fall() -> None:
    presses = [Press(-2.0, hold=6.0), *(Press(7 + 7 * k) for k in range(3))]
    tracker = track(session(1, presses))
    assert not judged(tracker)
    assert len(tracker.touches) >= 3


def test_scenes_without_levels_judge_nothing() -> None:
    made = session(1, count=2)
    made.step("hard", made.presses[0].end + 1, 0.3)
    assert not judged(track(made, "paper"))
