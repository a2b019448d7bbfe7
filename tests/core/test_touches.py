"""Touches of recordings: found, flagged, with and without times, from the project's recording and from real ones."""

import dataclasses
import json
import pickle
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from palpate import Tracker
from palpate.simulation import scenarios
from project import FOUR, ROOT

MAKER = ROOT / "tests" / "data" / "make_four_specimens.py"


def test_the_recording_of_the_project_is_what_its_script_makes() -> None:
    made = [line.split(",") for line in runpy.run_path(str(MAKER))["lines"]()]
    kept = [line.split(",") for line in FOUR.read_text().splitlines()]
    assert made[0] == kept[0]
    assert len(made) == len(kept)
    for new, old in zip(made[1:], kept[1:], strict=True):
        assert new[:3] == old[:3]
        # Sines may differ in their last bit from one C library to another, and so a code by one.
        assert all(abs(int(a) - int(b)) <= 1 for a, b in zip(new[3:5], old[3:5], strict=True))


def test_the_four_specimens_are_told_apart() -> None:
    """The paper's alarm never falls on the stiff ones; handheld is within 4 of its standard errors on all."""
    names = runpy.run_path(str(MAKER))
    truth = [names["ratio"](modulus) for modulus in names["MODULI_MPA"]]
    recording = palpate.read(FOUR)
    paper = palpate.touches(recording, scene="paper")
    assert [t.ratio for t in paper] == pytest.approx(truth, rel=0.01)
    assert [t.alarm_share > 0.9 for t in paper] == [False, False, True, True]
    handheld = palpate.touches(recording)
    for touch, right in zip(handheld, truth, strict=True):
        assert abs(touch.ratio - right) < 4 * touch.standard_error < 1e-3 * right
        assert (touch.samples, touch.alarm_share, touch.flags) == (250, 0.0, ())


def press(
    ends: int, height: float = 0.25, begin: int = 60, size: int = 700
) -> tuple[np.ndarray, ...]:
    """Return times and readings of a press from row `begin` to row `ends`."""
    rows = np.arange(size)
    depth = height * np.clip(np.minimum(rows - begin, ends - rows) / 10, 0, 1)
    noise = np.random.default_rng(5).normal(0, 4e-5, (2, size))
    return rows * 0.026, rows * 0.026 + 0.013, 9 + 2.5 * depth + noise[0], 8 + depth + noise[1]


def run(
    tracker: Tracker, columns: tuple[np.ndarray, ...], begin: int, end: int | None = None
) -> None:
    tracker.process(*(column[begin:end] for column in columns))


def test_a_touch_that_runs_at_a_gap_ends_there_with_the_flag() -> None:
    tracker = Tracker()
    columns = press(400)
    run(tracker, columns, 0, 200)
    tracker.gap()
    [touch] = tracker.touches
    assert touch.flags[0] == "short"
    assert touch.flags[-1] == "gap"
    assert abs(touch.ratio - 2.5) < 0.01
    assert "lift the probe, and touch again" in palpate.advice(touch)[-1].text
    assert tracker.state == "baseline"


def test_a_baseline_of_a_contact_is_flagged_until_the_release_shows_it() -> None:
    """Held at the gap, then pressed deeper: the touch is flagged; lifted: the baseline had been measured in contact."""
    tracker = Tracker(seconds=2.0)
    hold = press(600, 0.2)
    deeper = press(605, 0.1, begin=250)
    columns = *hold[:2], hold[2] + deeper[2] - 9, hold[3] + deeper[3] - 8
    run(tracker, columns, 0, 200)
    tracker.gap()
    run(tracker, columns, 200, 590)
    # one before, one after
    assert [("gap" in touch.flags) for touch in tracker.touches] == [False, True]
    run(tracker, columns, 590)
    assert tracker.touches[-1].revised
    assert tracker.touches[-1].flags[-1] == "baseline"
    assert "touch again" in palpate.advice(tracker.touches[-1])[-1].text


@pytest.mark.parametrize("scene", ["handheld", "paper"])
def test_a_release_confirms_the_baseline_and_a_tare_does(scene: Any) -> None:
    columns = press(300)
    tracker = Tracker(scene)
    tared = Tracker(scene)
    for each in (tracker, tared):
        each.gap()
    tared.tare()
    run(tared, columns, 0)
    assert "gap" not in tared.touches[-1].flags
    run(tracker, columns, 0)
    run(tracker, columns, 0)
    first, second = tracker.touches
    assert ("gap" in first.flags) == (scene == "paper")  # it has no revised result
    assert "gap" not in second.flags


@pytest.mark.parametrize("wire", ["hard is flat", "hard is constant", "soft is flat", "soft falls"])
@pytest.mark.parametrize("scene", ["handheld", "sliding"])
def test_a_wrong_wire_is_told(wire: str, scene: Any) -> None:
    run = scenarios.run("tremor", 1)
    noise = 40e-6 * np.random.default_rng(0).standard_normal(len(run.hard))
    flat = np.full(len(run.hard), 0.62) + (0 if wire == "hard is constant" else noise)
    hard = flat if wire.startswith("hard") else run.hard
    soft = {"soft is flat": flat, "soft falls": -run.soft}.get(wire, run.soft)
    tracker = Tracker(scene)
    tracker.process(run.t_hard_s, run.t_soft_s, hard, soft)
    tracker.finish()
    [touch] = tracker.touches
    [sentence] = [each.text for each in palpate.advice(touch) if each.flag == "one-sided"]
    assert ("fell" in sentence) == (wire == "soft falls")


def test_without_times_a_touch_has_250_samples_and_no_lag_in_milliseconds() -> None:
    run = scenarios.run("lag", seed=1)
    untimed = palpate.Recording(
        np.full(len(run.hard), np.nan), np.full(len(run.hard), np.nan), run.hard, run.soft
    )
    [touch] = palpate.touches(untimed)
    assert (touch.samples, "short" in touch.flags) == (250, False)
    assert np.isnan(touch.effects["lag"])
    assert json.loads(json.dumps(touch.as_dict(), allow_nan=False))["start_s"] is None
    assert pickle.loads(pickle.dumps(touch)) == touch
    with pytest.raises(
        ValueError, match="seconds: got 3 for a recording without times, allowed: samples"
    ):
        palpate.touches(untimed, seconds=3.0)


def typed(t: Any, press: Any, noise: float = 0.0, ratio: float = 3.0) -> dict[str, Any]:
    """Return a table as one types it: a press, with white noise."""
    random = np.random.default_rng(0)
    hard, soft = (scale * press + noise * random.standard_normal(len(t)) for scale in (ratio, 1.0))
    return {"t_s": t, "hard_pF": 9 + hard, "soft_pF": 8 + soft}


@pytest.mark.parametrize("rise", [10, 20, 25])
def test_a_press_without_noise_that_is_a_ramp_is_exact(rise: int) -> None:
    """Its equal steps are no codes of a converter."""
    one = np.concatenate(
        [np.zeros(80), np.linspace(0, 0.4, rise), np.full(250, 0.4), np.linspace(0.4, 0, rise)]
    )
    press = np.append(np.tile(one, 3), np.zeros(80))
    found = palpate.touches(typed(0.026 * np.arange(len(press)), press))
    assert len(found) == 3
    assert all(touch.standard_error < 1e-4 for touch in found)
    assert [touch.ratio for touch in found] == pytest.approx([3.0] * 3, rel=1e-9)


def test_rows_without_times_are_taken_for_those_of_a_kit() -> None:
    """A change amid the touch is found, and is the result."""
    step = np.where(np.arange(430) > 200, 0.3, 0.0)
    press = np.where((np.arange(430) > 80) & (np.arange(430) < 350), 0.4, 0.0)
    table = typed(np.arange(430), press, 4e-5)
    table["hard_pF"] += step * press
    del table["t_s"]
    [touch] = palpate.touches(table)
    assert touch.ratio == pytest.approx(3.3, rel=1e-3)
    assert "changed" in touch.flags
    assert touch.ratio_before == pytest.approx(3.0, rel=1e-3)


def test_a_press_that_lasts_is_one_touch_and_a_jump_ends_after_half_a_minute() -> None:
    t = np.arange(0, 160, 0.026)
    lasting = palpate.touches(typed(t, 0.5 * np.clip(np.minimum(t - 3, 150 - t) / 0.3, 0, 1), 1e-3))
    # A baseline that is measured in contact does not revise it.
    assert [(round(touch.start_s), round(touch.ratio, 2), touch.revised) for touch in lasting] == [
        (3, 3.0, False)
    ]
    assert any("half a minute" in note for note in lasting.notes)
    jump, press = (
        np.clip(np.minimum(t - begin, end - t) / 0.3, 0, 1) for begin, end in ((3, 999), (100, 110))
    )
    table = typed(t, 0.5 * press, 1e-3)
    table["hard_pF"] += 0.3 * jump
    table["soft_pF"] += 0.2 * jump
    assert [(round(one.start_s), round(one.ratio, 1)) for one in palpate.touches(table)] == [
        (3, 1.5),
        (100, 3.0),
    ]


@pytest.mark.parametrize("channel", [0, 1])
@pytest.mark.parametrize("off", [1.0, 5.0, -5.0])
def test_a_reading_far_out_early_in_a_press_does_not_end_the_touch(
    channel: int, off: float
) -> None:
    for row in range(58, 80):
        t_hard, t_soft, *values = press(400)
        values[channel][row] += off
        [touch] = palpate.touches(palpate.Recording(t_hard, t_soft, values[0], values[1]))
        assert touch.samples >= 240, row
        assert abs(touch.ratio - 2.5) < min(4 * touch.standard_error, 0.01), row


def test_a_press_before_the_lift_is_counted() -> None:
    """Ten presses, and between them a third of the force; two rows are no press."""
    t_hard, t_soft, hard, soft = press(400)
    force = np.where(
        (np.arange(700) > 70) & (np.arange(700) < 390) & (np.arange(700) // 20 % 2 == 1), 1 / 3, 1
    )
    force[110:112] = 1
    recording = palpate.Recording(t_hard, t_soft, 9 + (hard - 9) * force, 8 + (soft - 8) * force)
    found = palpate.touches(recording)
    assert (len(found), found.notes) == (
        1,
        ("pressed again before it was lifted (9 times): such a press is no touch",),
    )


def test_notes_of_arrays() -> None:
    t_hard, t_soft, hard, soft = press(400)
    assert palpate.touches(palpate.Recording(t_hard, t_soft, hard, soft)).notes == ()
    clipped = palpate.touches(palpate.Recording(t_hard, t_soft, np.minimum(hard, 9.5), soft))
    assert (
        "readings have exactly the largest value, 9.5: is the channel clipped there?"
        in clipped.notes[0]
    )
    in_ms = palpate.touches(palpate.Recording(1000 * t_hard, 1000 * t_soft, hard, soft))
    assert "pairs are 26 s apart" in in_ms.notes[-1]
    t_hard[7] = np.nan
    [touch], [note] = (
        (found := palpate.touches(palpate.Recording(t_hard, t_soft, hard, soft))),
        found.notes,
    )
    assert (
        note
        == "1 of 700 rows have a time that is no number: no time is used, pairs are taken for 26 ms apart"
    )
    assert np.isnan(touch.start_s)


def test_a_touch_of_one_sample_has_a_begin() -> None:
    one, two = (palpate.touches(FOUR, samples=samples, seconds=None) for samples in (1, 2))
    assert [touch.start_s for touch in one] == [touch.start_s for touch in two]


def test_host_stamps_are_smoothed_where_the_recording_says_so() -> None:
    """+-3 ms at 8 % tremor: the smoothed times cost a part of the error of the times as they came."""
    truth = scenarios.SCENARIOS["host-stamps"].presses[0].ratios[0][1]
    errors = []
    for seed in range(12):
        run = scenarios.run("host-stamps", seed)
        found = palpate.touches(run), palpate.touches(run, host_stamps=False)
        errors.append([touch.first_ratio / truth - 1 for [touch] in found])
    smoothed, without = np.sqrt(np.mean(np.square(errors), axis=0))
    assert smoothed < 0.5 * without


def test_three_places_of_a_cord_are_told_apart(recordings: Path) -> None:
    quartiles = {}
    for gesture in ("h", "l", "m"):
        ratios = []
        for number in range(1, 16):
            recording = palpate.read(
                recordings / "cord" / f"{gesture}{number}.csv", columns={"soft": 4, "hard": 8}
            )
            [touch] = palpate.touches(recording)
            ratios.append(touch.ratio)
        quartiles[gesture] = np.percentile(ratios, [25, 50, 75])
    assert quartiles["h"][0] > quartiles["l"][2] > quartiles["l"][0] > quartiles["m"][2]


WINDOWS = [(2.5, 7.0), (11.5, 16.0), (20.0, 24.5), (29.0, 33.5)]


@pytest.mark.parametrize("scene", ["handheld", "sliding", "paper"])
def test_touches_that_are_cut_out_by_hand(scene: Any) -> None:
    """Each is of the samples of its window, but for the three that the gate takes to find the contact."""
    recording = palpate.read(FOUR)
    truth = [touch.ratio for touch in palpate.touches(recording, scene=scene)]
    found = palpate.touches(recording, scene=scene, windows=WINDOWS[::-1])[::-1]
    for touch, (begin_s, end_s), right in zip(found, WINDOWS, truth, strict=True):
        inside = (begin_s <= recording.t_hard_s) & (recording.t_hard_s <= end_s)
        assert (touch.start, touch.samples) == (int(inside.argmax()), int(inside.sum()) - 3)
        assert not touch.flags
        assert touch.ratio == pytest.approx(right, rel=5e-3 if scene == "paper" else 2e-5)
    assert palpate.touches(FOUR, scene=scene, windows=WINDOWS) == found


def test_windows_within_one_press_and_from_before_it_to_its_end() -> None:
    [whole] = palpate.touches(FOUR, windows=[(1.0, 9.5)])
    assert whole.start == palpate.touches(FOUR)[0].start
    parts = palpate.touches(FOUR, windows=[(2.5, 4.5), (4.5, 7.0)])
    assert [part.ratio for part in parts] == pytest.approx([whole.ratio] * 2, rel=5e-5)
    assert whole.samples > 230
    assert [round(part.start_s, 1) for part in parts] == [2.5, 4.5]


@pytest.mark.parametrize(("first", "window", "text"), [
    (0, (2.0, 16.0), "the probe is lifted in it, and pressed again"),
    (0, (8.9, 9.9), "nothing rises above the baseline before it"),
    (0, (2.0, 2.05), "or the window is too short"),
    (0, (5.0, 4.0), "got 5 to 4 s, allowed: begin before end, with samples, within 0.000 to 36.660 s"),
    (2000, (5.0, 7.5), "without samples"),
    (0, (40.0, 41.0), "within 0.000 to 36.660 s"),
])  # fmt: skip
def test_windows_without_a_touch_say_why(
    first: int, window: tuple[float, float], text: str
) -> None:
    whole = palpate.read(FOUR)
    names = ("t_hard_s", "t_soft_s", "hard", "soft")
    later = dataclasses.replace(whole, **{name: getattr(whole, name)[first:] for name in names})
    with pytest.raises(ValueError, match=text):
        palpate.touches(later, windows=[window])
    with pytest.raises(ValueError, match="several recordings"):
        palpate.touches([whole, whole], windows=[window])
    untimed = dataclasses.replace(whole, t_hard_s=np.full(len(whole.hard), np.nan))
    with pytest.raises(ValueError, match="windows: got a recording without times"):
        palpate.touches(untimed, windows=[window])
