"""The baseline: its first values against numpy, a drift without lag, and its own standard error."""

import numpy as np
import pytest
from driving import drive

NOISE = 4e-5
READY, LEVEL, EXPECTED, SLOPE, SPREAD, VARIANCE, AGE = range(7)


@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-12), ("float", 1e-5)])
@pytest.mark.parametrize("seed", range(6))
def test_the_first_values_are_summed_up_as_by_numpy(real: str, tolerance: float, seed: int) -> None:
    """Median, quartiles and the mean of those near the median; the slope from one half's median to the other's."""
    rng = np.random.default_rng(seed)
    values = rng.standard_normal(32) + 0.01 * np.arange(32)
    values[rng.integers(0, 32, 3)] += 50
    if real == "float":
        values = values.astype(np.float32).astype(float)
    mean, count, slope, noise, floor = drive("halves", values, 5, real)[0]
    ranks = np.sort(values)
    least = np.diff(ranks).min()
    assert floor == pytest.approx(least / 2 if least > 2e-6 else 1e-6, rel=10 * tolerance, abs=10 * tolerance)
    assert noise == pytest.approx((ranks[23] - ranks[8]) / 1.25, rel=tolerance)
    near = values[np.abs(values - np.median(values)) <= 3 * noise]
    assert count == len(near) < 32
    assert mean == pytest.approx(near.mean(), rel=tolerance, abs=tolerance)
    assert slope == pytest.approx((np.median(values[16:]) - np.median(values[:16])) / 16, rel=100 * tolerance)


def test_a_jump_in_the_first_values_is_no_slope() -> None:
    values = 1e-3 * np.random.default_rng(1).standard_normal(32) + (np.arange(32) >= 16)
    assert drive("halves", values, 5)[0][2] == 0
    assert drive("halves", 1e-3 * np.random.default_rng(1).standard_normal(32), 5)[0][2] != 0


@pytest.mark.parametrize("slope", [1e-5, -2e-5])
def test_a_constant_slope_does_not_lag(slope: float) -> None:
    """0.4 and 0.8 fF/s at 26 ms. A running mean of 64 values would be 64 slopes behind: 0.6 fF."""
    behind, steepness = [], []
    for seed in range(20):
        k = np.arange(800)
        values = 0.6 + slope * k + NOISE * np.random.default_rng(seed).standard_normal(800)
        rows = drive("baseline", values, 7)
        behind.append(rows[-1, EXPECTED] - (0.6 + slope * 800))
        steepness.append(rows[-1, SLOPE])
        assert rows[-1, LEVEL] == rows[-1, EXPECTED]  # the drift is proven: the level follows, too
        assert rows[-1, AGE] == 0
    assert abs(np.mean(behind)) < 4 * NOISE * (5 / 4 / 32) ** 0.5 / 20**0.5 + abs(slope)
    assert np.mean(steepness) == pytest.approx(slope, rel=0.15)


@pytest.mark.parametrize("values", [40, 120, 400])
def test_the_variance_of_the_level_is_that_of_many_seeds(values: int) -> None:
    levels, believed = [], []
    for seed in range(300):
        rows = drive("baseline", 0.6 + NOISE * np.random.default_rng(seed).standard_normal(values), 7)
        levels.append(rows[-1, LEVEL])
        believed.append(rows[-1, VARIANCE])
    assert np.var(levels) == pytest.approx(np.median(believed), rel=0.4)  # of 300: 8 %; the clip and the gate on slope


def test_a_spike_is_clipped() -> None:
    values = 0.6 + NOISE * np.random.default_rng(0).standard_normal(200)
    clean = drive("baseline", values, 7)
    values[150] += 1.0
    spiked = drive("baseline", values, 7)
    assert abs(spiked[150, LEVEL] - clean[150, LEVEL]) < 6 * NOISE / 64
    assert abs(spiked[150, EXPECTED] - clean[150, EXPECTED]) < 2 * 6 * NOISE / 32
