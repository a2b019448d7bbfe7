"""What holds for every estimator, whatever the samples."""

import copy
import math
import pickle
from typing import Any

import numeric
import numpy as np
import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from measure import bits

BAD = st.sampled_from([math.nan, math.inf, -math.inf])

widths = pytest.mark.parametrize("width", [64, 32])


def kind_of(name: str, width: int) -> Any:
    return getattr(palpate, name if width == 64 else name + "32")


def make(data: st.DataObject, width: int) -> tuple[Any, list[float], list[float]]:
    output, regressor = data.draw(numeric.any_samples(width))
    settings = data.draw(numeric.adaptive_settings(width))
    steady = settings["steady"]
    prior = ("initial_ratio", "initial_covariance", "max_covariance")
    chosen = {
        "AdaptiveRls": settings,
        "HandoverRls": {"clip": 2.0, "false_alarm_interval": 100.0},
        "Rls": {"forgetting": steady} | {name: settings[name] for name in prior},
    }
    name = data.draw(st.sampled_from(sorted(chosen)))
    return kind_of(name, width)(**chosen[name]), output, regressor


@widths
@given(data=st.data())
def test_samples_blocks_and_pickles_give_the_same_bits(width: int, data: st.DataObject) -> None:
    fresh, output, regressor = make(data, width)
    whole = fresh.copy().process(output, regressor)

    one_by_one = fresh.copy()
    assert bits(
        np.array([one_by_one.update(*s) for s in zip(output, regressor, strict=True)], whole.dtype)
    ) == bits(whole)

    cut = data.draw(st.integers(0, len(output)))
    split = fresh.copy()
    parts = [split.process(output[:cut], regressor[:cut])]
    split = data.draw(
        st.sampled_from([lambda e: pickle.loads(pickle.dumps(e)), copy.copy, copy.deepcopy])
    )(split)
    parts.append(split.process(output[cut:], regressor[cut:]))
    assert bits(np.concatenate(parts)) == bits(whole)

    traced = fresh.copy()
    rows = traced.trace(output, regressor)
    assert bits(rows["ratio"]) == bits(whole)
    assert one_by_one == split == traced != fresh
    for name in set(rows.dtype.names) - {"standard_error"}:
        assert getattr(traced, name) == rows[name][-1]


@widths
@given(data=st.data())
def test_scaling_both_channels_by_a_power_of_two_changes_no_bit_of_the_ratio(
    width: int, data: st.DataObject
) -> None:
    output, regressor = data.draw(numeric.any_samples(width))
    settings = data.draw(numeric.adaptive_settings(width))
    scale = 2.0 ** data.draw(st.integers(-12, 12))
    powers = {
        "drift": 1,
        "threshold": 1,
        "clear_level": 1,
        "initial_covariance": -2,
        "max_covariance": -2,
    }
    scaled = {name: value * scale ** powers.get(name, 0) for name, value in settings.items()}
    rows = kind_of("AdaptiveRls", width)(**settings).trace(output, regressor)
    rows_scaled = kind_of("AdaptiveRls", width)(**scaled).trace(
        np.array(output) * scale, np.array(regressor) * scale
    )
    for name, power in (
        ("ratio", 0),
        ("alarm", 0),
        ("innovation", 1),
        ("statistic", 1),
        ("covariance", -2),
    ):
        real = rows[name].dtype.type
        assert bits(rows_scaled[name]) == bits(
            rows[name] * real(scale**power) if power else rows[name]
        )


@widths
@given(data=st.data())
def test_the_covariance_is_positive_and_bounded(width: int, data: st.DataObject) -> None:
    estimator, output, regressor = make(data, width)
    rows = estimator.trace(output, regressor)
    # 1 / fl(1 / max) may round up by one eps.
    bound = estimator.settings.get("max_covariance", math.inf) * (
        1 + float(np.finfo(rows["covariance"].dtype).eps)
    )
    assert ((rows["covariance"] > 0) & (rows["covariance"] <= bound)).all()


@widths
@given(data=st.data())
def test_refused_samples_change_nothing(width: int, data: st.DataObject) -> None:
    estimator, output, regressor = make(data, width)
    clean = estimator.copy().trace(output, regressor)
    positions = data.draw(st.lists(st.integers(0, len(output)), min_size=1, max_size=5))
    dirty = list(zip(output, regressor, strict=True))
    for position in sorted(positions, reverse=True):
        bad = data.draw(BAD)
        dirty.insert(position, data.draw(st.sampled_from([(bad, 1.0), (1.0, bad), (bad, bad)])))
    rows = estimator.trace(*map(list, zip(*dirty, strict=True)))
    accepted = np.isfinite([a + b for a, b in dirty])
    assert bits(rows[accepted]) == bits(clean)
    assert np.isnan(rows["innovation"][~accepted]).all()
    assert (estimator.samples, estimator.rejected) == (len(output), len(positions))
    for k in np.flatnonzero(~accepted)[:1]:
        kept = rows[k - 1] if k else None
        for name in ("ratio", "covariance", "statistic", "alarm"):
            assert kept is None or kept[name] == rows[name][k]


@widths
@given(data=st.data())
def test_reset_is_a_new_start(width: int, data: st.DataObject) -> None:
    estimator, output, regressor = make(data, width)
    fresh = estimator.copy()
    first = estimator.trace(output, regressor)
    estimator.reset()
    assert estimator == fresh == type(fresh)(**fresh.settings)
    assert bits(estimator.trace(output, regressor)) == bits(first)
