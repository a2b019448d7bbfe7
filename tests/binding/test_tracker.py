"""The tracker: its bookkeeping, revised touches, and readings that are not as they should be."""

from typing import Any

import numpy as np
import palpate
import pytest
from numeric import process
from palpate.simulation import Press, Scenario, scenarios, simulate
from palpate.simulation.readings import ConverterModel


def test_states_and_rows_tell_the_same() -> None:
    run = scenarios.run("four-specimens", 1)
    tracker = palpate.Tracker()
    states = []
    for row in zip(run.t_hard_s, run.t_soft_s, run.hard, run.soft, strict=True):
        tracker.feed(*map(float, row))
        states.append(tracker.state)
    order = [s for s, before in zip(states, [None, *states], strict=False) if s != before]
    assert order == ["baseline", "waiting", "contact", "done"] * 4 + ["baseline", "waiting"]
    _, rows = process("handheld", run)
    assert [touch.samples in (250, 251) for touch in tracker.touches] == [True] * 4
    assert (rows["touch"] > 0).sum() == sum(touch.samples for touch in tracker.touches)
    assert tracker.readings == len(run.hard)
    assert np.isfinite(tracker.standard_error)


@pytest.mark.parametrize("scene", palpate._core.scenes)
def test_the_initial_ratio_is_never_shown_as_one_that_was_measured(scene: Any) -> None:
    """It is far from any ratio of the run."""
    run = scenarios.run("four-specimens", 1)
    tracker = palpate.Tracker(scene, initial_ratio=77.0)
    assert np.isnan(tracker.ratio)
    shown = []
    for row in zip(run.t_hard_s, run.t_soft_s, run.hard, run.soft, strict=True):
        tracker.feed(*map(float, row))
        shown.append(tracker.ratio)
    finite = np.isfinite(shown)
    assert finite[-1]
    assert np.abs(np.array(shown)[finite]).max() < 20
    assert scene == "fixed" or np.isnan(shown[:30]).all()
    assert scene == "fixed" or tracker.ratio == tracker.touches[-1].first_ratio


def test_a_contact_whose_readings_are_saturated_has_no_ratio() -> None:
    """The soft channel shows the contact; the hard one is beyond its range."""
    press = np.repeat([0.0, 0.25], [60, 40])
    t = 0.026 * np.arange(100)
    tracker = palpate.Tracker(full_scale=9.1)
    rows = tracker.process(t, t + 0.013, 9 + 2.5 * press, 8 + press)
    assert rows["contact"][-1]
    assert tracker.state == "contact"
    assert np.isnan(tracker.ratio)
    assert "ratio" not in repr(tracker)
    touch = tracker.finish()
    assert touch is not None
    assert touch.samples == 0
    assert np.isnan([touch.ratio, tracker.ratio]).all()


def test_a_touch_stays_as_it_is_when_the_next_ones_end() -> None:
    run = scenarios.run("four-specimens", 1)
    tracker = palpate.Tracker()
    seen = []
    for row in zip(run.t_hard_s, run.t_soft_s, run.hard, run.soft, strict=True):
        if tracker.feed(*map(float, row)):
            touch = tracker.touches[-1]
            seen.append((touch, touch.as_dict()))
    assert len({touch.start_s for touch, _ in seen}) == 4
    assert [touch.as_dict() for touch, _ in seen] == [then for _, then in seen]


def test_tare_after_the_baseline_jumped() -> None:
    run = scenarios.run("tremor", 1)
    t = [run.t_hard_s, run.t_soft_s]
    jumped = np.arange(len(run.hard)) < 40
    tracker = palpate.Tracker()
    tracker.process(t[0][:60], t[1][:60], run.hard[:60] - 0.5 * jumped[:60], run.soft[:60])
    assert tracker.state == "contact"
    with pytest.raises(RuntimeError, match="contact"):
        tracker.tare()
    assert tracker.state == "contact"
    tracker.tare(force=True)
    assert (tracker.state, len(tracker.touches)) == ("baseline", 1)
    again = tracker.process(t[0] + 100, t[1] + 100, run.hard, run.soft)
    tracker.finish()
    assert len(tracker.touches) == 2
    assert tracker.touches[1].ratio == pytest.approx(run.true_ratio[200], rel=1e-3)
    assert again["touch"].max() == 2


def test_readings_are_checked() -> None:
    tracker = palpate.Tracker()
    with pytest.raises(ValueError, match="t_soft: got shape"):
        tracker.process([0.0, 1.0], [0.0], [1.0, 1.0], [1.0, 1.0])
    with pytest.raises(ValueError, match="t_hard: got inf"):
        tracker.feed(np.inf, 0.0, 1.0, 1.0)
    with pytest.raises(TypeError, match="hard: got dtype"):
        tracker.process([0.0], [0.0], ["a"], [1.0])
    with pytest.raises(TypeError, match="__init__"):
        palpate.Tracker.__new__(palpate.Tracker).finish()
    assert tracker.readings == 0


def test_the_scene_fixed_goes_on_after_a_tare_and_an_end() -> None:
    """Nothing is released there: the next sample begins the next touch, and none is ignored."""
    tracker = palpate.Tracker("fixed")
    t = np.arange(300) * 0.026
    tracker.process(t, t, np.full(300, 0.5), np.full(300, 0.25))
    tracker.tare()
    assert tracker.state == "waiting"
    tracker.process(t + 8, t + 8, np.full(300, 0.75), np.full(300, 0.25))
    tracker.finish()
    tracker.process(t + 16, t + 16, np.full(300, 1.0), np.full(300, 0.25))
    tracker.finish()
    found = [(touch.start, touch.samples, round(touch.ratio, 3)) for touch in tracker.touches]
    assert found == [(0, 300, 2.0), (300, 300, 3.0), (600, 300, 4.0)]


SLOW = Scenario(
    presses=[Press(3.0, [(0.0, 2.8)], hold_s=8.0)],
    duration_s=14.0,
    converter=ConverterModel(capf=2, bus_s=1 / 36 - 0.02),
)


@pytest.mark.parametrize(
    ("scenario", "rate"), [(SLOW, 18), (scenarios.SCENARIOS["fast-converter"], 40)]
)
def test_a_touch_lasts_6_5_seconds_at_any_rate(scenario: Scenario, rate: int) -> None:
    """Of 1,000 pairs a second 40 means are samples."""
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


@pytest.mark.parametrize("scene", ["handheld", "sliding", "paper"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e300, -1e300, 1e16])
def test_no_input_gives_a_ratio_that_is_no_number(scene: Any, bad: float) -> None:
    """In idle, in contact and after the release; runs of them and single ones."""
    run = scenarios.run("tremor", 1)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        hard = run.hard.copy()
        soft = run.soft.copy()
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
