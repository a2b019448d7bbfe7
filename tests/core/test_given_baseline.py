"""A baseline that is given, and windows with a rest before, after, on both sides, or nowhere."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from command_lines import document, run
from palpate import Recording, Stream
from palpate.simulation import scenarios
from project import FOUR

WHOLE = palpate.read(FOUR)
LEVELS = (0.62001, -0.40999)  # of the first second
CHANGES = replace(WHOLE, hard=WHOLE.hard - LEVELS[0], soft=WHOLE.soft - LEVELS[1])
GIVEN_NOTE = "the baseline is given, zero: its error is not in the uncertainty"
WINDOW = (3.0, 7.0)  # within the first press
IN_PRESS = 100  # a row within the first press
STILL_IN_PRESS = 290


def part(recording: Recording, first: int = 0, end: int | None = None) -> Recording:
    which = slice(first, end)
    return replace(
        recording,
        t_hard_s=recording.t_hard_s[which],
        t_soft_s=recording.t_soft_s[which],
        hard=recording.hard[which],
        soft=recording.soft[which],
    )


@pytest.mark.parametrize("scene", ["handheld", "sliding"])
def test_changes_and_given_levels_have_the_same_touches(scene: Any) -> None:
    zero = palpate.touches(CHANGES, scene=scene, baseline="zero")
    given = palpate.touches(WHOLE, scene=scene, baseline=LEVELS)
    measured = palpate.touches(WHOLE, scene=scene)
    assert zero.notes == (GIVEN_NOTE,)
    for changes, levels, usual in zip(zero, given, measured, strict=True):
        assert (changes.start, changes.samples) == (levels.start, levels.samples)
        assert changes.ratio == pytest.approx(levels.ratio, rel=1e-9)
        # The baselines drift by 1e-4 pF in 30 s, on a press of 0.2 pF.
        assert changes.ratio == pytest.approx(usual.ratio, rel=5e-4)
        assert not changes.revised
        assert not changes.flags


@pytest.mark.parametrize("scene", ["handheld", "sliding"])
def test_a_touch_may_run_from_the_first_rows_on(scene: Any) -> None:
    pressed = part(CHANGES, IN_PRESS)
    [first, *others] = palpate.touches(pressed, scene=scene, baseline="zero")
    assert first.start == 8  # the noise takes the rows before
    assert first.ratio == pytest.approx(1.6006, rel=2e-4)
    assert len(others) == 3
    assert palpate.touches(pressed, scene=scene)[0].start > 100
    noise = (*LEVELS, 4e-5, 4e-5)
    assert palpate.touches(part(WHOLE, IN_PRESS), scene=scene, baseline=noise)[0].start == 0


@pytest.mark.parametrize("falls", [False, True])
def test_offline_has_it(falls: bool) -> None:
    sign = -1.0 if falls else 1.0
    changes = replace(CHANGES, hard=sign * CHANGES.hard, soft=sign * CHANGES.soft)
    [first, *_] = palpate.offline(part(changes, IN_PRESS), baseline="zero", falling=falls)
    assert first.baselines == "given"
    assert first.ratio == pytest.approx(1.6006, rel=2e-4)


def test_a_long_press_is_one_touch() -> None:
    """The baseline is known, so a contact of more than half a minute does not show a wrong one."""
    time_s = np.arange(4000) * 0.026
    rng = np.random.default_rng(4)
    press = 0.2 + 0.001 * np.sin(7 * time_s)
    press[:60] = press[-60:] = 0
    hard, soft = (ratio * press + rng.normal(0, 4e-5, 4000) for ratio in (2.5, 1.0))
    touches = palpate.touches(hard, soft, times_s=time_s, unit="pF", baseline="zero")
    assert (len(touches), touches.notes) == (1, (GIVEN_NOTE,))
    measured = palpate.touches(hard, soft, times_s=time_s, unit="pF")
    assert "or for half a minute" in measured.notes[0]


def test_the_baseline_stays_valid_after_a_gap() -> None:
    run_ = scenarios.run("stiff-steady", seed=1)
    levels = float(np.median(run_.hard[:50])), float(np.median(run_.soft[:50]))
    tracker = palpate.Tracker(baseline=levels)
    tracker.gap()
    tracker.take(run_.t_hard_s, run_.t_soft_s, run_.hard, run_.soft)
    tracker.finish()
    assert tracker.touches[0].flags == ()


@pytest.mark.parametrize(
    "value", ["first", (1.0,), (1.0, np.nan), (1.0, 2.0, 3e-5), (1.0, 2.0, -1.0, 1.0), 3, None]
)
def test_other_values_are_refused(value: Any) -> None:
    with pytest.raises(ValueError, match=r"baseline: got .*, allowed: 'measured', 'zero', or the"):
        palpate.Tracker(baseline=value)
    with pytest.raises(TypeError, match="baseline"):
        palpate.Tracker("paper", baseline="zero")  # type: ignore[call-overload]


def test_readings_far_below_are_said() -> None:
    low = replace(CHANGES, hard=CHANGES.hard - 1, soft=CHANGES.soft - 1)
    assert "the readings fell far below it (" in palpate.touches(low, baseline="zero").notes[0]


def test_a_recording_keeps_it(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with Stream(str(FOUR), record=path, baseline=LEVELS) as stream:
        for _ in stream:
            pass
    found = document("replay", path)
    assert found["settings"]["baseline"] == list(LEVELS)
    touches = [touch["ratio"] for touch in found["touches"]]
    assert touches == [touch.ratio for touch in palpate.touches(WHOLE, baseline=LEVELS)]
    given = ",".join(map(str, LEVELS))
    assert [
        touch["ratio"] for touch in document("replay", FOUR, "--baseline", given)["touches"]
    ] == touches
    measured = document("replay", path, "--baseline", "measured")["touches"]
    assert [touch["ratio"] for touch in measured] == [t.ratio for t in palpate.touches(WHOLE)]
    wrong = run("replay", FOUR, "--baseline", "6.9")
    assert (wrong.exit_code, "two values, pF, as 6.9,4.6" in wrong.stderr) == (2, True)


@pytest.mark.parametrize("scene", ["handheld", "sliding"])
@pytest.mark.parametrize(
    ("first", "end", "note"),
    [
        (0, None, ""),
        (0, STILL_IN_PRESS, ""),
        (IN_PRESS, None, "window 3 to 7 s: its baseline is from the readings after it"),
    ],
)
def test_a_window_needs_a_rest_on_one_side(
    scene: Any, first: int, end: int | None, note: str
) -> None:
    [whole] = palpate.touches(WHOLE, scene=scene, windows=[WINDOW])
    touches = palpate.touches(part(WHOLE, first, end), scene=scene, windows=[WINDOW])
    [touch] = touches
    assert touch.samples == pytest.approx(whole.samples, abs=1)
    apart = touch.ratio - whole.ratio
    assert abs(apart) < 4 * np.hypot(touch.standard_error, whole.standard_error)
    assert touch.standard_error < 1e-4 * touch.ratio
    assert touches.notes == ((note,) if note else ())
    falling = replace(WHOLE, hard=-WHOLE.hard, soft=-WHOLE.soft)
    [other] = palpate.touches(
        part(falling, first, end), scene=scene, windows=[WINDOW], falling=True
    )
    assert other.ratio == pytest.approx(touch.ratio, rel=1e-9)
    assert other.standard_error == pytest.approx(touch.standard_error, rel=1e-9)


def test_a_window_without_a_rest_needs_a_value() -> None:
    pressed = part(WHOLE, IN_PRESS, STILL_IN_PRESS)
    with pytest.raises(
        ValueError, match=r"without contact before or after it, or a given baseline"
    ):
        palpate.touches(pressed, windows=[WINDOW])
    with pytest.raises(ValueError, match=r"without contact before or after it"):
        palpate.touches(part(WHOLE, IN_PRESS), scene="paper", windows=[WINDOW])
    [touch] = palpate.touches(pressed, windows=[WINDOW], baseline=LEVELS)
    [other] = palpate.touches(
        part(CHANGES, IN_PRESS, STILL_IN_PRESS), windows=[WINDOW], baseline="zero"
    )
    [whole] = palpate.touches(WHOLE, windows=[WINDOW])
    assert touch.ratio == pytest.approx(whole.ratio, rel=2e-4)
    assert other.ratio == pytest.approx(touch.ratio, rel=1e-9)


def test_a_window_with_a_comma() -> None:
    found = document("replay", FOUR, "--window", "3,7")["touches"]
    assert found == document("replay", FOUR, "--window", "3:7")["touches"]
