"""Times of arrival become the converter's: a least-squares line, gaps of whole periods, and a new beginning."""

import numpy as np
import pytest
from driving import drive
from numpy.typing import ArrayLike, NDArray

PERIOD = 26_000_000.0  # ns


def smoothed(times: ArrayLike) -> NDArray[np.float64]:
    return drive("stamps", np.round(np.asarray(times, float)), 1)[:, 0]


def arrivals(n: int, late_ms: float = 3.0, seed: int = 0) -> NDArray[np.float64]:
    return 1e12 + PERIOD * np.arange(n) + 1e6 * np.random.default_rng(seed).uniform(-late_ms, late_ms, n)


@pytest.mark.parametrize("n", [3, 5, 8, 20, 32])
def test_the_first_stamps_are_a_least_squares_line(n: int) -> None:
    times = arrivals(n)
    line = np.polyfit(np.arange(n), times - times[0], 1)
    assert smoothed(times)[-1] - times[0] == pytest.approx(np.polyval(line, n - 1), abs=2 * n)  # whole ns each time


def test_the_error_of_many_is_a_fraction() -> None:
    errors = [smoothed(arrivals(300, seed=s))[60:] - (1e12 + PERIOD * np.arange(300))[60:] for s in range(20)]
    assert np.std(errors) / 1e6 < 3 / 3**0.5 / 2.5


def test_steady_stamps_stay() -> None:
    times = 1e12 + PERIOD * np.arange(1000)
    assert np.abs(smoothed(times) - times).max() <= 2


def test_a_gap_of_whole_periods_is_lost_readings() -> None:
    times = np.delete(arrivals(200), [50, 51, 52, 120])
    right = np.delete(1e12 + PERIOD * np.arange(200), [50, 51, 52, 120])
    errors = smoothed(times) - right
    assert np.std(errors[40:]) / 1e6 < 0.8
    steps = np.diff(smoothed(np.delete(1e12 + PERIOD * np.arange(100), [50, 51])))
    assert steps[49] == pytest.approx(3 * PERIOD, abs=4)


@pytest.mark.parametrize("jump", [0.45, 7.45, -3.0, -1e4, 1e6])
def test_after_anything_else_the_line_begins_again(jump: float) -> None:
    """The stamp itself, then a line through the later ones only."""
    times = arrivals(120, late_ms=0.5)
    times[60:] += jump * PERIOD
    found = smoothed(times)
    assert found[60] == np.round(times[60])
    line = np.polyfit(np.arange(20), times[60:80] - times[60], 1)
    assert found[79] - times[60] == pytest.approx(np.polyval(line, 19), abs=60)


def test_equal_and_decreasing_times_do_no_harm() -> None:
    assert (smoothed([5e9] * 50) == 5e9).all()
    falling = 1e15 - 1e12 * np.arange(50)
    assert np.array_equal(smoothed(falling), falling)
