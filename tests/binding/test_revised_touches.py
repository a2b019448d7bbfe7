"""Touches that are revised, their length in seconds, and readings that are no numbers."""

import pickle
from itertools import pairwise
from typing import Any

import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from measure import bits
from palpate.simulation import Press, Scenario, scenarios, simulate
from palpate.simulation.converter import Converter
from tracking import process


def columns(run: Any) -> tuple[Any, ...]:
    return run.t_hard_s, run.t_soft_s, run.hard, run.soft


@pytest.mark.parametrize("name", ["drift-hard", "four-specimens"])
@given(cuts=st.lists(st.integers(0, 1400), max_size=5))
def test_revisions_are_the_same_bits_in_any_blocks(name: str, cuts: list[int]) -> None:
    run = scenarios.run(name, 2)
    whole, rows = process("handheld", run)
    split, parts = palpate.Tracker(), []
    edges = [0, *sorted(min(c, len(run.hard)) for c in cuts), len(run.hard)]
    for a, b in pairwise(edges):
        parts.append(split.process(*(c[a:b] for c in columns(run))))
    split.finish()
    single = palpate.Tracker()
    for row in zip(*columns(run), strict=True):
        single.feed(*map(float, row))
    single.finish()
    assert bits(np.concatenate(parts)) == bits(rows)
    assert whole.touches == split.touches == single.touches
    assert whole.revisions_since(0) == split.revisions_since(0) == single.revisions_since(0)
    assert whole.revision_count == sum(touch.revised for touch in whole.touches) > 0


def test_a_revision_comes_after_the_release_and_keeps_the_first_result() -> None:
    run = scenarios.run("drift-hard", 1)
    tracker = palpate.Tracker()
    first: list[palpate.Touch] = []
    for row in zip(*columns(run), strict=True):
        ended = tracker.feed(*map(float, row))
        first += [ended] if ended else []
        if tracker.revision_count:
            break
    [at_once], [revised] = first, tracker.touches
    assert tracker.revisions_since(0) == [1]
    assert tracker.revisions_since(1) == []
    assert (at_once.revised, revised.revised) == (False, True)
    assert revised.first_ratio == at_once.ratio == at_once.first_ratio
    assert revised.first_standard_error == at_once.standard_error
    true = run.true_ratio[at_once.start + 50]
    assert abs(revised.ratio / true - 1) < abs(at_once.ratio / true - 1) / 2
    assert "drift" in revised.flags


def test_touches_are_values_with_all_that_is_new() -> None:
    for name in ("not-level", "drift-hard", "lag", "stiff-steady"):
        touches = palpate.touches(scenarios.run(name, 1))
        assert pickle.loads(pickle.dumps(touches)) == touches
        [touch] = touches
        shown = touch.as_dict()
        assert shown["effects"] == touch.effects
        assert {*touch.effects} >= {"offset", "drift", "lag", "curve"}
        assert (shown["revised"], shown["first_ratio"]) == (touch.revised, touch.first_ratio)
        assert shown["flags"] == list(touch.flags) or tuple(shown["flags"]) == touch.flags
        assert (shown["offset_ratio"] is None) == np.isnan(touch.offset_ratio) == (touch.flags != ("offset",))
    different = [palpate.touches(scenarios.run(n, 1))[0] for n in ("not-level", "stiff-steady")]
    assert different[0] != different[1]


@pytest.mark.parametrize(("converter", "rate"), [({"capf": 2, "bus_s": 1 / 36 - 0.02}, 18), ("fast-converter", 1000)])
def test_a_touch_lasts_6_5_seconds_at_any_rate(converter: Any, rate: int) -> None:
    if isinstance(converter, str):
        run = scenarios.run(converter, 1)
    else:
        scenario = Scenario(
            presses=[Press(3.0, [(0.0, 2.8)], hold_s=8.0)], duration_s=14.0, converter=Converter(**converter)
        )
        run = simulate(scenario, 1)
    [touch] = palpate.touches(run)
    assert touch.samples == pytest.approx(6.5 * rate, rel=0.02, abs=2)
    assert "short" not in touch.flags
    [shorter] = palpate.touches(run, seconds=6.0)
    assert shorter.samples == pytest.approx(6.0 * rate, rel=0.02, abs=2)
    [counted] = palpate.touches(run, samples=6 * rate)
    assert counted.samples == 6 * rate
    [long] = palpate.touches(run, seconds=60.0)
    assert "short" in long.flags


def test_a_length_is_said_in_one_way() -> None:
    with pytest.raises(ValueError, match="seconds"):
        palpate.Tracker(seconds=3.0, samples=20)
    assert palpate.Tracker(samples=20).settings["seconds"] is None
    assert palpate.Tracker(seconds=3.0).settings["samples"] is None
    assert palpate.Tracker("paper").settings["samples"] == 250
    assert palpate.Tracker("paper", seconds=3.0).settings["samples"] is None


def test_a_tare_in_contact_is_refused_unless_forced() -> None:
    run = scenarios.run("stiff-steady", 1)
    tracker = palpate.Tracker()
    tracker.process(*(c[:150] for c in columns(run)))
    before = tracker.state
    with pytest.raises(RuntimeError, match="contact"):
        tracker.tare()
    assert (tracker.state, len(tracker.touches)) == (before, 0)
    tracker.tare(force=True)
    assert (tracker.state, len(tracker.touches)) == ("baseline", 1)


def test_a_baseline_measured_in_contact_is_taken_again() -> None:
    """Pressed from the start: the release is a fall, then everything is as it should be."""
    run = scenarios.run("four-specimens", 1)
    begin = int(np.searchsorted(run.t_hard_s, 4.0))
    tracker = palpate.Tracker()
    tracker.process(*(c[begin:] for c in columns(run)))
    tracker.finish()
    assert tracker.retaken == 1
    assert len(tracker.touches) == 3
    clean, _ = process("handheld", run)
    assert clean.retaken == 0
    for touch, right in zip(tracker.touches, clean.touches[1:], strict=True):
        assert touch.ratio == pytest.approx(right.ratio, rel=2e-3)


@pytest.mark.parametrize("scene", ["handheld", "sliding", "paper"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300, -1e300, 1e16])
def test_no_input_gives_a_ratio_that_is_no_number(scene: Any, bad: float) -> None:
    """In idle, in contact and after the release; runs of them and single ones."""
    run = scenarios.run("tremor", 1)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        hard, soft = run.hard.copy(), run.soft.copy()
        for channel in (hard, soft):
            channel[rng.integers(0, len(hard), 8)] = bad
            start = rng.integers(0, len(hard) - 40)
            channel[start : start + rng.integers(2, 40)] = bad
        tracker = palpate.Tracker(scene)
        rows = tracker.process(run.t_hard_s, run.t_soft_s, hard, soft)
        tracker.finish()
        assert np.isfinite(rows["ratio"]).all()
        assert not np.isinf(rows["standard_error"]).any()
        for touch in tracker.touches:
            assert np.isfinite(touch.ratio) or touch.samples == 0
            assert np.isfinite(touch.first_ratio) or touch.samples == 0
            assert not touch.standard_error < 0
