"""The matched pair of filters: its response, the deviations of times, and when it interpolates instead."""

from typing import Any

import numpy as np
import pytest
from driving import drive
from numpy.typing import NDArray

SIDES = {26.0: (0.21048, 0.04482), 31.5: (0.22142, 0.05300)}  # a1, b2: period, ms


def pairs(hard: NDArray[Any], soft: NDArray[Any], t_hard: NDArray[Any], t_soft: NDArray[Any]) -> NDArray[np.float64]:
    """Return (hard, soft, valid, matched) of each pair."""
    return drive("pair", np.column_stack([np.round(t_hard * 1e9), np.round(t_soft * 1e9), hard, soft]), 4)


def responses(frequency: float, period_s: float) -> tuple[float, float]:
    """Return A and B of the formulas in matched_pair.hpp."""
    a1, b2 = SIDES[period_s * 1e3]
    a = 2 * np.pi * frequency * period_s
    return 1 - 2 * a1 * (1 - np.cos(a)), (1 - 2 * b2) * np.cos(a / 2) + 2 * b2 * np.cos(1.5 * a)


def tone(t: NDArray[Any], frequency: float, level: float = 1.0) -> NDArray[Any]:
    return level + 0.1 * np.sin(2 * np.pi * frequency * t)


@pytest.mark.parametrize("period_ms", [26.0, 31.5])
@pytest.mark.parametrize("soft_first", [False, True])
def test_both_channels_have_the_response_of_the_formula(period_ms: float, soft_first: bool) -> None:
    period = period_ms / 1e3
    k = np.arange(60)
    t_hard, t_soft = 5 + (k + 0.5 * soft_first) * period, 5 + (k + 0.5 * (not soft_first)) * period
    for frequency in (0.5, 3.0, 5.0, 8.0, 12.0, 13.0):
        found = pairs(tone(t_hard, frequency), tone(t_soft, frequency), t_hard, t_soft)[6:]
        assert found[:, 2:].all()
        at = t_hard[4:-2] if soft_first else t_hard[5:-1]  # one pair later if the soft channel is read first
        wave = np.sin(2 * np.pi * frequency * at)
        for column, response in enumerate(responses(frequency, period)):
            assert found[:, column] == pytest.approx(1 + 0.1 * response * wave, abs=1e-9)


@pytest.mark.parametrize("period_ms", [26.0, 31.5])
def test_the_two_responses_agree_where_a_hand_trembles(period_ms: float) -> None:
    """By 0.13 % rms from 3 to 13 Hz at 26 ms; at 31.5 ms they have less room. Interpolation: 6 %."""
    frequencies = np.linspace(3, 13, 200)
    off = np.array([a - b for a, b in (responses(f, period_ms / 1e3) for f in frequencies)])
    rms = np.sqrt(np.mean(off**2))
    assert rms < (0.0014 if period_ms == 26.0 else 0.0042)
    a = 2 * np.pi * frequencies * period_ms / 1e3
    assert rms < np.sqrt(np.mean((1 - (9 * np.cos(a / 2) - np.cos(1.5 * a)) / 8) ** 2)) / 10


def test_deviations_of_the_times_are_corrected() -> None:
    """By the slope: a line stays a line exactly, and a slow tone nearly."""
    rng, k = np.random.default_rng(1), np.arange(200)
    t_hard = 0.026 * k + rng.uniform(-0.002, 0.002, 200)
    t_soft = 0.026 * k + 0.013 + rng.uniform(-0.002, 0.002, 200)
    found = pairs(3 * t_hard, t_soft, t_hard, t_soft)[5:]
    assert found[:, 3].all()
    # Both are at the time of the hard reading in the middle; times are rounded to ns.
    assert found[:, 0] == pytest.approx(3 * t_hard[4:-1], abs=0.013)
    assert np.abs(found[:, 0] / 3 - found[:, 1]).max() < 2e-3
    even = pairs(tone(0.026 * k, 2.0), tone(0.026 * k + 0.013, 2.0), 0.026 * k, 0.026 * k + 0.013)[5:]
    uneven = pairs(tone(t_hard, 2.0), tone(t_soft, 2.0), t_hard, t_soft)[5:]
    misfit = [np.std(rows[:, 0] - rows[:, 1]) for rows in (even, uneven)]
    assert misfit[1] < 5e-4  # not corrected: 2 ms of 1.26 / s, 1.5e-3
    assert misfit[0] < 1e-4


def test_windows_with_a_lost_reading_are_left_out() -> None:
    k = np.arange(60)
    t_hard, t_soft = 0.026 * k, 0.026 * k + 0.013
    for column in (0, 1):
        channels = [tone(t_hard, 5.0), tone(t_soft, 5.0)]
        channels[column][30] = np.nan
        found = pairs(channels[0], channels[1], t_hard, t_soft)
        left_out = np.flatnonzero(found[6:, 2] == 0) + 6
        assert left_out.tolist() == ([30, 31, 32] if column == 0 else [30, 31, 32, 33]), column
        assert found[34:, 3].all()
        whole = pairs(tone(t_hard, 5.0), tone(t_soft, 5.0), t_hard, t_soft)
        used = found[:, 2] == 1
        assert np.array_equal(found[used], whole[used])  # a lost value touches no other result


def cubic(t: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(2 + 3 * t - t**2 + t**3 / 4)


@pytest.mark.parametrize(("period_ms", "shares"), [(26.0, (0.0, 0.4)), (45.0, (0.0, 0.0)), (200.0, (0.0, 0.0))])
def test_uneven_windows_and_long_periods_are_interpolated(period_ms: float, shares: tuple[float, float]) -> None:
    """After 8 windows in a row; a cubic exactly."""
    k = np.arange(60)
    late = np.where(k % 2 == 0, *shares)
    t_hard = period_ms / 1e3 * (k + late)
    t_soft = t_hard + period_ms / 2e3
    found = pairs(cubic(t_hard), cubic(t_soft), t_hard, t_soft)
    assert not found[:, 3].any()
    valid = np.flatnonzero(found[:, 2])
    assert valid[0] == 10  # the first window is complete with reading 3, the eighth with 10
    assert np.array_equal(valid, np.arange(10, 60))
    assert found[valid, 0] == pytest.approx(cubic(t_hard[valid - 1]), abs=1e-12)
    assert found[valid, 1] == pytest.approx(cubic(t_hard[valid - 1]), abs=1e-6)  # times in ns


def test_gaps_of_more_than_a_second_are_not_interpolated() -> None:
    k = np.arange(40)
    assert not pairs(1.0 + 0 * k, 1.0 + 0 * k, 1.1 * k, 1.1 * k + 0.55)[:, 2].any()
