"""Recordings without times, and with the times of a computer."""

import json
import pickle

import numpy as np
import palpate
import pytest
from palpate.simulation import scenarios


def test_without_times_a_touch_has_250_samples_and_no_lag_in_milliseconds() -> None:
    run = scenarios.run("lag", seed=1)
    untimed = palpate.Recording(np.full(len(run.hard), np.nan), np.full(len(run.hard), np.nan), run.hard, run.soft)
    [touch] = palpate.touches(untimed)
    assert (touch.samples, "short" in touch.flags) == (250, False)
    assert np.isnan(touch.start_s)
    assert np.isnan(touch.effects["lag"])
    assert touch.as_dict()["effects"]["lag"] is None
    assert json.loads(json.dumps(touch.as_dict(), allow_nan=False))["start_s"] is None
    assert pickle.loads(pickle.dumps(touch)) == touch
    assert [t.samples for t in palpate.touches(untimed, samples=100)] == [100]
    assert [t.samples > 250 for t in palpate.touches(untimed, scene="sliding")] == [True]
    with pytest.raises(ValueError, match="seconds: got 3 for a recording without times, allowed: samples"):
        palpate.touches(untimed, seconds=3.0)


def test_host_stamps_are_smoothed_where_the_recording_says_so() -> None:
    """+-3 ms at 8 % tremor: the smoothed times cost a part of the error of the others."""
    truth = scenarios.SCENARIOS["host-stamps"].presses[0].ratios[0][1]
    errors: dict[bool, list[float]] = {True: [], False: []}
    for seed in range(12):
        run = scenarios.run("host-stamps", seed)
        assert run.host_stamps
        assert not scenarios.run("tremor", seed).host_stamps
        for smoothed, found in errors.items():
            [touch] = palpate.touches(run) if smoothed else palpate.touches(run, host_stamps=False)
            found.append(touch.first_ratio / truth - 1)
    with_line, without = (float(np.sqrt(np.mean(np.square(found)))) for found in errors.values())
    assert with_line < 0.5 * without
