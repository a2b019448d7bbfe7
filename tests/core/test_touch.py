"""A touch is plain data: for dataclasses, pandas, polars, copy, pickle, JSON; and the binding fills every field."""

import copy
import dataclasses
import json
import math
import pickle
from typing import Any

import numpy as np
import palpate
import pandas as pd
import polars as pl
import pytest
from example_touch import example_touch
from palpate.flags import Flag
from palpate.simulation import scenarios

RUN = scenarios.run("not-level")
[OFFSET] = palpate.touches(RUN)
NAMES = [field.name for field in dataclasses.fields(palpate.Touch)]
TOUCHES = [OFFSET, example_touch(standard_error=math.nan), example_touch("short", "gap")]


def test_asdict_has_every_field() -> None:
    values = dataclasses.asdict(OFFSET)
    assert list(values) == NAMES
    assert values["flags"] == OFFSET.flags == (Flag.OFFSET,)
    assert values["effects"] == OFFSET.effects
    assert values["samples"] == 250


def test_as_dict_is_asdict_for_json() -> None:
    record = OFFSET.as_dict()
    assert list(record) == [name for name in NAMES if name != "held"]
    assert json.loads(json.dumps(record))["flags"] == ["offset"]
    assert type(record["flags"][0]) is str
    unknown = {name for name, value in record.items() if value is None}
    assert unknown == {
        "ratio_before",
        "before_standard_error",
        "ratio_after",
        "after_standard_error",
    }
    assert all(math.isnan(dataclasses.asdict(OFFSET)[name]) for name in unknown)
    untimed = OFFSET.without_times().as_dict()
    assert (untimed["start_s"], untimed["effects"]["lag"]) == (None, None)


@pytest.mark.parametrize("touches", [TOUCHES, palpate.touches(RUN)], ids=["list", "Touches"])
def test_pandas_has_a_column_for_each_field(touches: list[palpate.Touch]) -> None:
    frame = pd.DataFrame(touches)
    assert list(frame.columns) == NAMES
    assert len(frame) == len(touches)
    first = frame.iloc[0]
    assert first["ratio"] == OFFSET.ratio
    assert first["flags"] == ("offset",)
    assert first["effects"] == OFFSET.effects


def test_polars_has_a_column_for_each_field() -> None:
    frame = pl.DataFrame(TOUCHES)
    assert frame.columns == NAMES
    assert frame["ratio"].to_list() == [touch.ratio for touch in TOUCHES]
    assert frame["flags"].to_list() == [["offset"], [], ["short", "gap"]]
    assert frame["effects"][0]["offset"] == OFFSET.effects["offset"]


@pytest.mark.parametrize("touch", TOUCHES, ids=["offset", "without an error", "short"])
def test_copies_are_equal_and_have_the_same_type(touch: palpate.Touch) -> None:
    for other in (copy.copy(touch), copy.deepcopy(touch), pickle.loads(pickle.dumps(touch))):
        assert other == touch
        assert type(other) is palpate.Touch
        assert all(isinstance(flag, Flag) for flag in other.flags)


@pytest.mark.parametrize("name", NAMES)
def test_touches_with_another_value_differ(name: str) -> None:
    others: dict[str, Any] = {"flags": (Flag.GAP,), "effects": {"offset": 1.0}}
    value = getattr(OFFSET, name)
    other = dataclasses.replace(OFFSET, **{name: others.get(name, not value)})
    assert other != OFFSET
    assert dataclasses.replace(other, **{name: value}) == OFFSET


def test_a_touch_cannot_be_changed_or_hashed_and_is_no_dict() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        OFFSET.ratio = 1.0  # type: ignore[misc]
    with pytest.raises(TypeError, match="unhashable"):
        hash(OFFSET)
    assert OFFSET.as_dict() != OFFSET


def test_the_repr_has_time_ratio_and_flags() -> None:
    assert repr(OFFSET).startswith("<Touch at 1.9")
    assert repr(OFFSET).endswith(" (assumed), 250 samples, flags offset>")
    assert repr(OFFSET.without_times()).startswith("<Touch at reading ")


def test_a_tracker_makes_each_touch_once_and_once_more_for_its_revision() -> None:
    run = scenarios.run("drift-soft", seed=1)
    columns = (run.t_hard_s, run.t_soft_s, run.hard, run.soft)
    pressed = int(np.searchsorted(run.t_hard_s, 7.5))
    tracker = palpate.Tracker(seconds=4.5)
    tracker.process(*(column[:pressed] for column in columns))
    [first] = tracker.touches
    assert tracker.touches[0] is tracker.touches_since(0)[0] is first
    tracker.process(*(column[pressed:] for column in columns))
    [revised] = tracker.touches
    assert tracker.revisions_since(0) == [1]
    assert (first.revised, revised.revised) == (False, True)
    assert revised.first_ratio == first.ratio
    assert revised.ratio != first.ratio
    assert tracker.touches[0] is revised


def test_a_fed_reading_returns_the_touch_that_it_ends() -> None:
    tracker = palpate.Tracker("fixed", samples=3)
    results = [tracker.feed(0.1 * n, 0.1 * n, 4.0, 2.0) for n in range(3)]
    assert results[:2] == [None, None]
    assert results[2] is tracker.touches[0]
    assert tracker.finish() is None


def test_the_binding_gives_each_value_to_its_field() -> None:
    """The numbers of the estimates are compared with the reference in test_tracker_reference."""
    run = scenarios.run("step-up", seed=1)
    hard = run.hard.copy()
    soft = run.soft.copy()
    length_s = {"samples": None, "seconds": None, "age": 4.0}
    settings: dict[str, Any] = {"full_scale": 30.0, "contact_exponent": 1.5} | length_s
    whole = palpate.Tracker(**settings)
    [first, last] = np.flatnonzero(
        whole.process(run.t_hard_s, run.t_soft_s, hard, soft)["touch"] == 1
    )[[0, -1]]
    hard[last - 20] = hard[last - 10] = 31.0
    soft[last - 30 : last - 27] = np.nan
    tracker = palpate.Tracker(**settings)
    rows = tracker.process(run.t_hard_s, run.t_soft_s, hard, soft)
    touch = tracker.touches[0]
    [end] = np.flatnonzero(rows["touch"] == 1)[-1:]
    assert first - 10 < touch.start < first
    assert touch.start_s == pytest.approx(run.t_hard_s[touch.start], abs=1e-8)
    assert (touch.contact_exponent, touch.age_s, touch.saturated) == (1.5, 4.0, 2)
    assert touch.saturated < 3 <= touch.refused < touch.samples <= end - first + 1
    assert (touch.first_ratio, touch.first_standard_error) == (
        rows["ratio"][end],
        rows["standard_error"][end],
    )
    assert touch.alarm_share == pytest.approx(1 / touch.samples)
    assert touch.revised == bool(rows["revised"].any())
    assert {Flag.CHANGED, Flag.SATURATED} <= set(touch.flags)
    assert touch.held
