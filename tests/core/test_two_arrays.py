"""Touches of two arrays: the same as of a recording with these times, and what is refused."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import palpate
import pandas as pd
import polars as pl
import pytest
from palpate.simulation import scenarios

RUN = scenarios.run("stiff-steady")
HARD = RUN.hard
SOFT = RUN.soft
TIMES_S = RUN.t_hard_s
LATER_S = 0.013
FRAME = pd.DataFrame({"hard": HARD, "soft": SOFT})

touches: Any = palpate.touches


def of_recording(times_s: Any, later_s: float) -> palpate.tracking.Touches:
    """Return the touches of a recording with these times."""
    times = np.asarray(times_s, float)
    return palpate.Recording(times, times + later_s, HARD, SOFT).touches()


def test_the_touches_are_those_of_a_recording_with_the_same_times() -> None:
    found = palpate.touches(HARD, SOFT, times_s=TIMES_S, soft_later_s=LATER_S)
    assert found == of_recording(TIMES_S, LATER_S) != []
    assert found[0].flags == ()
    assert found.unit == "pF"


def test_a_rate_is_an_even_grid_from_0_on() -> None:
    found = palpate.touches(HARD, SOFT, rate_hz=38.44)
    assert found == of_recording(np.arange(len(HARD)) / 38.44, 0.0) != []


def test_both_channels_are_read_at_once_by_default() -> None:
    """The readings of this run are 13 ms apart: without this information the touch has a flag."""
    [touch] = palpate.touches(HARD, SOFT, times_s=TIMES_S)
    assert [touch] == of_recording(TIMES_S, 0.0)
    assert palpate.flags.Flag.LAG in touch.flags


@pytest.mark.parametrize(
    "convert",
    [list, tuple, pd.Series, pl.Series, lambda values: pd.Series(values, dtype="Float64")],
)
def test_any_kind_of_array(convert: Callable[[Any], Any]) -> None:
    expected = palpate.touches(HARD, SOFT, times_s=TIMES_S, soft_later_s=LATER_S)
    arrays = convert(HARD), convert(SOFT)
    assert touches(*arrays, times_s=convert(TIMES_S), soft_later_s=LATER_S) == expected
    assert touches(arrays[0], soft=arrays[1], times_s=TIMES_S, soft_later_s=LATER_S) == expected
    named = {"hard": arrays[0], "soft": arrays[1], "times_s": TIMES_S}
    assert touches(**named, soft_later_s=LATER_S) == expected


def test_a_missing_reading_is_nan() -> None:
    hard = HARD.copy()
    hard[200:203] = math.nan
    masked = np.ma.array(HARD, mask=np.isnan(hard))
    missing = pd.Series(HARD, dtype="Float64").mask(np.isnan(hard))
    [expected] = palpate.touches(hard, SOFT, rate_hz=40)
    [whole] = palpate.touches(HARD, SOFT, rate_hz=40)
    assert expected.samples < whole.samples
    for given in (masked, missing):
        assert touches(given, SOFT, rate_hz=40) == [expected]


def test_capacitances_are_converted_and_other_signals_are_used_as_they_are() -> None:
    expected = palpate.touches(HARD, SOFT, rate_hz=40)
    in_fF = palpate.touches(HARD * 1024, SOFT * 1024, rate_hz=40, unit="fF")
    assert in_fF[0].covariance == pytest.approx(expected[0].covariance / 1.024**2)
    in_N = palpate.touches(HARD * 1024, SOFT * 1024, rate_hz=40, unit="N")
    assert in_N[0].covariance == pytest.approx(expected[0].covariance / 1024**2)
    assert [expected.unit, in_fF.unit, in_N.unit] == ["pF", "pF", "N"]
    paper = palpate.touches(HARD * 1024, SOFT * 1024, rate_hz=40, scene="paper", unit="fF")
    assert len(paper) == 1


def test_scene_settings_and_windows_are_as_for_a_recording() -> None:
    [touch] = palpate.touches(HARD, SOFT, rate_hz=38.44, scene="paper", samples=50)
    assert touch.samples == 50
    [part] = palpate.touches(HARD, SOFT, times_s=TIMES_S, windows=[(3.0, 6.0)])
    assert part.start_s == pytest.approx(3.0, abs=0.03)


def changed(row: int, value: float) -> np.ndarray:
    times_s = TIMES_S.copy()
    times_s[row] = value
    return times_s


DATES = np.datetime64("2026-03-01", "ns") + np.rint(TIMES_S * 1e9).astype("m8[ns]")
WITHOUT = (  # calls that lack something, or have too much
    (lambda: touches(HARD, SOFT), "times_s: got neither times_s nor rate_hz"),
    (lambda: touches(HARD, SOFT, soft_later_s=0.01), "times_s: got neither times_s nor rate_hz"),
    (lambda: touches(HARD, SOFT, times_s=TIMES_S, rate_hz=40), "times_s: got times_s and rate_hz"),
    (lambda: touches(HARD), "soft: got none, and hard as numpy.ndarray, allowed: palpate.touches"),
    (lambda: touches(FRAME["hard"]), "soft: got none, and hard as pandas.Series"),
    (lambda: touches(pl.Series(HARD)), "soft: got none, and hard as polars.Series"),
    (lambda: touches(HARD.tolist()), "soft: got none, and hard as list"),
    (lambda: touches(hard=HARD, rate_hz=40), "soft: got none"),
    (lambda: touches(soft=SOFT, rate_hz=40), "hard: got none"),
    (lambda: touches(), "recording: got None"),
    (lambda: touches(RUN, hard=HARD, soft=SOFT, rate_hz=40), "recording: got it with two arrays"),
    (lambda: touches(HARD, SOFT, rate_hz=40, reading={}), "reading: got it with two arrays"),
    (lambda: touches(FRAME, SOFT, rate_hz=40), "hard: got pandas.DataFrame, allowed: one signal"),
    (lambda: touches(HARD, FRAME, rate_hz=40), "soft: got pandas.DataFrame, allowed: one signal"),
    (lambda: touches({"hard": HARD}, SOFT, rate_hz=40), "hard: got dict, allowed: one signal"),
    (lambda: touches(RUN, SOFT, rate_hz=40), "hard: got palpate.Simulation, allowed: one signal"),
    (lambda: touches("run.csv", SOFT, rate_hz=40), "hard: got str, allowed: one signal"),
    (lambda: touches(RUN, rate_hz=40), "rate_hz: got it without two arrays"),
    (lambda: touches(FRAME, times_s=TIMES_S), "times_s: got it without two arrays"),
    (lambda: touches(RUN, soft_later_s=0.01), "soft_later_s: got it without two arrays"),
    (lambda: touches(["a", "b"], ["c", "d"], rate_hz=40), "hard: got dtype <U1, allowed: real"),
    (lambda: touches(HARD, SOFT, times_s=DATES), "times_s: got dtype datetime64.*; of dates t: "),
    (
        lambda: touches(HARD, SOFT, times_s=pd.DatetimeIndex(DATES, tz="UTC")),
        "times_s: got dtype object, allowed: seconds as numbers",
    ),
)
WRONG = (
    (lambda: touches(HARD, SOFT[:-1], rate_hz=40), "soft: got 402 readings, allowed: .* hard, 403"),
    (lambda: touches(HARD, SOFT, times_s=TIMES_S[1:]), r"times_s: got shape \(402,\), allowed"),
    (lambda: touches(HARD, SOFT, times_s=changed(9, 0.0)), "times_s: got 0 after .* in row 9"),
    (lambda: touches(HARD, SOFT, times_s=changed(9, TIMES_S[8])), "in row 9, allowed: finite"),
    (lambda: touches(HARD, SOFT, times_s=changed(0, math.nan)), "times_s: got nan in row 0"),
    (lambda: touches(HARD, SOFT, times_s=changed(9, math.inf)), "times_s: got inf after"),
    (lambda: touches(HARD, SOFT, rate_hz=0), "rate_hz: got 0, allowed: a number above 0"),
    (lambda: touches(HARD, SOFT, rate_hz=math.inf), "rate_hz: got inf, allowed"),
    (lambda: touches(HARD, SOFT, rate_hz="40"), "rate_hz: got '40', allowed"),
    (lambda: touches(HARD, SOFT, rate_hz=True), "rate_hz: got True, allowed"),
    (
        lambda: touches(HARD, SOFT, rate_hz=40, soft_later_s=13),
        "soft_later_s: got 13, allowed: less than the time from pair to pair, 0.025 s; negative",
    ),
    (lambda: touches(HARD, SOFT, rate_hz=40, soft_later_s=-0.026), "soft_later_s: got -0.026"),
    (lambda: touches(HARD, SOFT, rate_hz=40, soft_later_s=math.nan), "soft_later_s: got nan"),
    (lambda: touches(FRAME.to_numpy(), SOFT, rate_hz=40), r"hard: got shape \(403, 2\), allowed"),
    (lambda: touches([], [], rate_hz=40), r"hard: got shape \(0,\), allowed: \(n,\), n at least 1"),
    (lambda: touches(HARD / 1e12, SOFT / 1e12, rate_hz=40), "unit: got none, and values of about"),
    (lambda: touches(HARD, SOFT, rate_hz=40, unit="pf"), "unit: got 'pf', allowed: .* 'pF'"),
)


@pytest.mark.parametrize(("call", "message"), WITHOUT)
def test_what_does_not_belong_together_is_refused(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(TypeError, match=f"^{message}"):
        call()


@pytest.mark.parametrize(("call", "message"), WRONG)
def test_values_that_are_not_allowed_are_refused(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
