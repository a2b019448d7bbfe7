"""Sidecars of earlier versions hold drift and threshold of the scenes handheld and sliding: they are read and replayed."""

import math
from pathlib import Path
from typing import Any

import palpate
import pytest
from command_lines import document
from palpate.design import cusum
from palpate.recording import sidecar
from palpate.recording.earlier_settings import renamed


def edited(folder: Path, scene: Any, **earlier: Any) -> Path:
    """Return a recording whose settings have drift and threshold, as they were written before."""
    path = folder / "run.csv"
    with palpate.Stream("sim:step-up?seed=3", scene=scene, record=path) as stream:
        for _ in stream:
            pass
    found = sidecar.load(path) or {}
    for name in ("false_alarm_interval", "smallest_shift"):
        found["settings"].pop(name, None)
    found["settings"] |= earlier
    sidecar.save(sidecar.sidecar_path(path), found)
    return path


@pytest.mark.parametrize("scene", ["handheld", "sliding"])
def test_the_defaults_of_before_are_those_of_today(tmp_path: Path, scene: Any) -> None:
    path = edited(tmp_path, scene, drift=0.75, threshold=10.0)
    again = document("replay", path)
    assert not {"drift", "threshold", "smallest_shift"} & again["settings"].keys()
    assert again["touches"] == document("replay", path, "--scene", scene)["touches"]
    assert again["touches"]


def test_chosen_ones_are_replayed_with_the_goal_they_were_for(tmp_path: Path) -> None:
    design = cusum(false_alarm_interval=3e4, smallest_shift=1.2)
    path = edited(tmp_path, "handheld", drift=design.drift, threshold=design.threshold)
    settings = document("replay", path)["settings"]
    assert settings["smallest_shift"] == 1.2
    assert settings["false_alarm_interval"] == design.false_alarm_interval
    again = palpate.Tracker(
        "handheld",
        false_alarm_interval=settings["false_alarm_interval"],
        smallest_shift=settings["smallest_shift"],
    )
    assert 0 < again.threshold - design.threshold < 0.2


def test_settings_that_sliding_no_longer_has_are_left_out(tmp_path: Path) -> None:
    gone = {"steady": 0.9995, "confirmed": 0.0, "contact_exponent": 0.0, "age": 0.0}
    prior = {"initial_covariance": 1e10, "max_covariance": 1e12}
    path = edited(tmp_path, "sliding", **gone, **prior, guard=5.0, clip=4.0)
    again = document("replay", path)
    assert again["settings"]["clip"] == 4.0
    assert not (gone | prior | {"guard": 0.0}).keys() & again["settings"].keys()
    assert again["touches"]
    chosen = {"scene": "sliding", "steady": 0.9995, "guard": 3.0}
    assert renamed(chosen) == {"scene": "sliding", "guard": 3.0}


def test_no_alarm_stays_none(tmp_path: Path) -> None:
    path = edited(tmp_path, "handheld", drift=0.75, threshold="inf")
    found = document("replay", path)
    assert found["settings"]["false_alarm_interval"] == "inf"
    assert [touch["alarm_share"] for touch in found["touches"]] == [0] * len(found["touches"])


def test_the_paper_keeps_both(tmp_path: Path) -> None:
    path = edited(tmp_path, "paper", drift=0.02, threshold=0.1)
    settings = document("replay", path)["settings"]
    assert (settings["drift"], settings["threshold"]) == (0.02, 0.1)


@pytest.mark.parametrize(
    ("drift", "threshold", "clip", "interval", "shift"),
    [
        (0.0, 10.0, 3.0, None, 1e-3),
        (2.9, 0.5, 3.0, None, 4.5),
        (0.75, 25.0, 3.0, 1e12, 1.5),
        (0.75, 1e9, 3.0, math.inf, 1.5),
        (0.1, 0.01, 3.0, 10.0, 0.2),
    ],
)
def test_what_is_no_longer_allowed_becomes_the_nearest(
    drift: float, threshold: float, clip: float, interval: float | None, shift: float
) -> None:
    found = renamed({"scene": "handheld", "drift": drift, "threshold": threshold, "clip": clip})
    assert found["smallest_shift"] == shift
    assert interval is None or found["false_alarm_interval"] == interval
    palpate.Tracker(**found)  # it takes them


def test_what_is_no_number_is_left_to_the_tracker() -> None:
    for wrong in ("x", None, [1.0], True, 10**400):
        given = {"scene": "handheld", "threshold": wrong}
        assert renamed(given) == given
