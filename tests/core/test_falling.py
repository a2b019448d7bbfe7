"""Channels that fall when pressed: with `falling` everything is as of the readings with the other sign."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from command_lines import document, run
from palpate import Stream, reference
from palpate.recording.reading import recorded
from palpate.simulation import scenarios
from project import FOUR

RISING = palpate.read(FOUR)
REFERENCES = {"handheld": reference.handheld, "sliding": reference.sliding}
FALLING = replace(RISING, hard=-RISING.hard, soft=-RISING.soft)


@pytest.mark.parametrize("scene", ["paper", "handheld", "sliding"])
def test_touches_have_the_same_bits(scene: Any) -> None:
    touches = palpate.touches(FALLING, scene=scene, falling=True)
    assert len(touches) == 4
    assert list(touches) == list(palpate.touches(RISING, scene=scene))
    found = palpate.offline(FALLING, scene=scene, falling=True)
    expected = palpate.offline(RISING, scene=scene)
    numbers = [[touch.ratio, touch.level_ratio, touch.standard_error] for touch in found]
    wanted = [[touch.ratio, touch.level_ratio, touch.standard_error] for touch in expected]
    assert np.array_equal(numbers, wanted, equal_nan=True)


@pytest.mark.parametrize("scene", ["paper", "handheld", "sliding"])
def test_rows_keep_the_sign_of_the_readings(scene: Any) -> None:
    readings = FALLING.t_hard_s, FALLING.t_soft_s
    rows = palpate.Tracker(scene, falling=True).process(*readings, FALLING.hard, FALLING.soft)
    other = palpate.Tracker(scene).process(*readings, RISING.hard, RISING.soft)
    for channel in ("hard_baseline", "soft_baseline"):
        assert np.array_equal(rows[channel], -other[channel], equal_nan=True)
    for name in ("ratio", "standard_error", "statistic", "touch", "contact", "revised"):
        assert np.array_equal(rows[name], other[name], equal_nan=True)


@pytest.mark.parametrize("scene", ["handheld", "sliding"])
def test_the_reference_has_it(scene: Any) -> None:
    run_ = scenarios.run("stiff-steady", seed=2)
    t_hard, t_soft = (np.rint(1e9 * t).astype(np.int64) for t in (run_.t_hard_s, run_.t_soft_s))
    readings = t_hard, t_soft, -run_.hard, -run_.soft
    tracker = palpate.Tracker(scene, falling=True)
    tracker.take(*readings)
    tracker.finish()
    [touch] = tracker.touches
    [expected], _ = REFERENCES[scene](*readings, falling=True)
    assert (touch.start, touch.samples) == (expected.start, expected.samples)
    assert touch.ratio == pytest.approx(expected.ratio, rel=1e-9)


def test_only_scenes_with_a_baseline_have_it() -> None:
    with pytest.raises(TypeError, match="falling"):
        palpate.Tracker("fixed", falling=True)  # type: ignore[call-overload]
    with pytest.raises(ValueError, match=r"falling: got 2\.0, allowed: True or False"):
        palpate.Tracker("handheld", falling=2)  # type: ignore[call-overload]


def test_a_recording_keeps_it(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    columns = np.column_stack([FALLING.t_hard_s, FALLING.t_soft_s, FALLING.hard, FALLING.soft])
    header = "t_s,t_soft_s,hard_pF,soft_pF"
    np.savetxt(path, columns, "%.9f", ",", header=header, comments="")
    found = document("replay", path, "--falling")["touches"]
    assert [touch["ratio"] for touch in found] == pytest.approx(
        [touch.ratio for touch in palpate.touches(RISING)], rel=1e-6
    )
    rising = document("replay", path, "--falling", "--rising")["touches"]
    assert rising != found
    with Stream(str(path), record=tmp_path / "run.csv", falling=True) as stream:
        for _ in stream:
            pass
    again = recorded(tmp_path / "run.csv")
    assert again.settings["falling"] is True
    document_ = document("replay", tmp_path / "run.csv")
    assert document_["settings"]["falling"] is True
    assert [touch["samples"] for touch in document_["touches"]] == [
        touch["samples"] for touch in found
    ]


@pytest.mark.parametrize("command", ["replay", "record", "live", "calibrate", "plot"])
def test_commands_have_the_option(command: str) -> None:
    assert "--falling" in run(command, "--help").stdout
