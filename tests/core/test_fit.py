"""The test of the model: the sweep operator and the fit against numpy's least squares, in both types."""

from typing import Any

import numpy as np
import pytest
from driving import drive
from numpy.typing import NDArray

OFFSET, DRIFT, LAG, CURVE = 1, 2, 4, 8
NOISE = 4e-5  # of a reading, pF
GAIN = 0.42**0.5  # of the filters before the fit
RATIO = 2.8


@pytest.mark.parametrize(("real", "tolerance"), [("double", 1e-9), ("float", 2e-3)])
@pytest.mark.parametrize("seed", range(5))
def test_the_sweep_operator_is_least_squares(real: str, tolerance: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    design = rng.standard_normal((200, 5)) + np.array([0, 1, 0, 2, 0])
    y = design @ rng.uniform(-2, 2, 5) + 0.1 * rng.standard_normal(200)
    rows = drive("sweep", np.column_stack([design, y]), 3, real)
    right, [residual], *_ = np.linalg.lstsq(design, y, rcond=None)
    assert rows[:5, 0].all()
    assert rows[:5, 1] == pytest.approx(right, rel=tolerance)
    covariance = np.linalg.inv(design.T @ design)
    assert rows[:5, 2] == pytest.approx(np.diag(covariance), rel=tolerance)
    assert rows[5, 0] == pytest.approx(residual, rel=tolerance)
    assert -rows[5, 1] == pytest.approx(covariance[0, 1], rel=tolerance, abs=1e-5 * tolerance)


def test_a_column_of_zeros_is_not_swept() -> None:
    rng = np.random.default_rng(0)
    design = rng.standard_normal((50, 5))
    design[:, 2] = 0
    rows = drive("sweep", np.column_stack([design, design @ [1, 2, 0, 3, 4]]), 3)
    assert rows[:5, 0].tolist() == [1, 1, 0, 1, 1]
    assert rows[[0, 1, 3, 4], 1] == pytest.approx([1, 2, 3, 4], rel=1e-12)


def depths(seed: int, n: int = 240, spread: float = 0.05) -> NDArray[Any]:
    """Return regressors with a sway, pF."""
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, 3)
    k = np.arange(n)
    waves = [np.sin(2 * np.pi * f * 0.026 * k + p) for f, p in zip((0.4, 1.1, 1.7), phases, strict=True)]
    return np.asarray(0.25 * (1 + spread * np.sum(waves, axis=0)))


def fitted(y: NDArray[Any], x: NDArray[Any], real: str = "double", noise: float = NOISE) -> dict[str, float]:
    rows = np.column_stack([y, x, np.arange(len(x)) + 100])
    names = ("offset", "drift", "lag", "curve", "open", "open_drift", "offset_ratio", "offset_error", "flags")
    found = drive("fit", np.concatenate([[noise, noise, RATIO], rows.ravel()]), 9, real)
    return dict(zip(names, found[0], strict=True))


def by_numpy(y: NDArray[Any], x: NDArray[Any]) -> dict[str, float]:
    """Return the same sizes from the design y = r x + c + d t + l x' + k (x / m - 1)^2, solved by lstsq."""
    slope, t, inner = (x[2:] - x[:-2]) / 2, np.arange(len(x) - 2.0), x[1:-1]
    m = inner.mean()
    design = np.column_stack([inner, np.ones_like(inner), t, slope, (inner / m - 1) ** 2])
    r, c, d, lag, k = np.linalg.lstsq(design, y[1:-1], rcond=None)[0]
    return {"offset": -c / (r * m), "drift": d * t[-1] / (r * m), "lag": lag / r, "curve": k / (r * m)}


@pytest.mark.parametrize("seed", range(8))
def test_an_exact_model_gives_its_coefficients(seed: int) -> None:
    """All terms at once, of random sizes; the sizes are those by numpy."""
    rng = np.random.default_rng(seed)
    x = depths(seed)
    slope = np.gradient(x)
    r, m = rng.uniform(1.5, 9), x[1:-1].mean()
    c, d, k = rng.uniform(0.01, 0.05, 3) * r * m * rng.choice([-1, 1], 3)
    lag = rng.uniform(0.2, 0.5)
    y = r * x + c + d * (np.arange(len(x)) - 1) / len(x) + lag * r * slope + k * (x / m - 1) ** 2
    found = fitted(y, x, noise=1e-7)
    right = by_numpy(y, x)
    assert {name: found[name] for name in right} == pytest.approx(right, rel=1e-5)
    assert found["lag"] == pytest.approx(lag, rel=1e-5)
    assert found["offset"] == pytest.approx(-c / (r * m), rel=1e-5)
    assert found["flags"] == OFFSET + DRIFT + LAG + CURVE


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize(
    ("flag", "size", "name"),
    [(OFFSET, 0.02, "offset"), (DRIFT, 0.02, "drift"), (LAG, 0.3, "lag"), (CURVE, 0.02, "curve")],
)
def test_each_effect_has_its_flag_and_its_size(flag: int, size: float, name: str, real: str) -> None:
    """With noise. A small one has none: a tenth of `least`. The numbers of float are those of double to 1 %."""
    for seed in range(10):
        rng = np.random.default_rng(seed)
        x = depths(seed, spread=0.15 if flag == CURVE else 0.05)
        m, t = x.mean(), np.arange(len(x)) / len(x)
        terms = {OFFSET: -m + 0 * x, DRIFT: m * t, LAG: np.gradient(x), CURVE: m * (x / m - 1) ** 2}[flag]
        noise = GAIN * NOISE * rng.standard_normal((2, len(x)))
        found = fitted(2.8 * (x + size * terms) + noise[0], x + noise[1], real)
        assert found["flags"] == flag, seed
        assert found[name] == pytest.approx(size, rel=0.25)
        assert found["open"] + found["open_drift"] > 0 or flag == LAG
        least = 0.08 if flag == LAG else 0.002
        none = fitted(2.8 * (x + 0.1 * least * terms) + noise[0], x + noise[1], real)
        assert none["flags"] == 0


def test_where_only_the_offset_contradicts_the_line_has_the_ratio() -> None:
    inside = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        x = depths(seed)
        noise = GAIN * NOISE * rng.standard_normal((2, len(x)))
        found = fitted(2.8 * (x - 0.02 * x.mean()) + noise[0], x + noise[1])
        assert found["flags"] == OFFSET
        inside.append(abs(found["offset_ratio"] - 2.8) < 2 * found["offset_error"])
    assert np.mean(inside) > 0.85
    assert np.isnan(fitted(2.8 * depths(1), depths(1))["offset_ratio"])


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("spread", [0.0, 0.005, 0.02, 0.05])
def test_a_healthy_touch_has_no_flag(spread: float, real: str) -> None:
    """Float has sums of 250 squares of 0.25 pF and 4 significant digits of their variation: that is enough."""
    for seed in range(25):
        rng = np.random.default_rng(seed)
        x = depths(seed, spread=spread)
        noise = GAIN * NOISE * rng.standard_normal((2, len(x)))
        assert fitted(2.8 * x + noise[0], x + noise[1], real)["flags"] == 0, seed


def test_a_constant_depth_shows_a_drift_only() -> None:
    """Without a variation of x, offset and curve cannot be told from the ratio."""
    rng = np.random.default_rng(3)
    noise = GAIN * NOISE * rng.standard_normal((2, 240))
    y = 2.8 * 0.25 * (1 + 0.02 * np.arange(240) / 240) + noise[0]
    found = fitted(y, 0.25 + noise[1])
    assert found["flags"] == DRIFT
    assert found["drift"] == pytest.approx(0.02, rel=0.05)
    assert (found["offset"], found["lag"], found["curve"]) == (0, 0, 0)


def test_few_pairs_say_nothing() -> None:
    x = depths(0, 17)
    assert fitted(2.8 * x + 0.1, x)["flags"] == 0  # 15 with both neighbours
    assert int(fitted(2.8 * depths(0, 40) + 0.1, depths(0, 40))["flags"]) & OFFSET


def test_a_gap_interrupts_the_slopes_only() -> None:
    """Pairs without their neighbours are left out; the others have the same model."""
    x = depths(4)
    y = 2.8 * (x + 0.3 * np.gradient(x))
    rows = np.column_stack([y, x, np.arange(len(x)) + 100])
    kept = np.delete(rows, [50, 51, 90, 130], axis=0)
    found = drive("fit", np.concatenate([[1e-7, 1e-7, RATIO], kept.ravel()]), 9)[0]
    assert found[2] == pytest.approx(0.3, rel=1e-6)
    wrong = np.column_stack([kept[:, :2], np.arange(len(kept)) + 100])
    assert drive("fit", np.concatenate([[1e-7, 1e-7, RATIO], wrong.ravel()]), 9)[0][2] != pytest.approx(0.3, rel=1e-3)


def test_a_change_of_the_ratio_with_the_depth_is_a_curve() -> None:
    """At a hand-over: deeper by a quarter and more, and a change above 1 %."""
    for deeper, change, flag in ((1.5, 0.1, CURVE), (1.1, 0.1, 0), (1.5, 0.005, 0)):
        before, after = depths(1, 100, 0.02), deeper * depths(2, 100, 0.02)
        rows = [[2.8 * v, v, i] for i, v in enumerate(before)] + [[2.8 * after[0], after[0], 100]]
        rows += [[change, 0, -1]] + [[2.8 * (1 + change) * v, v, i + 101] for i, v in enumerate(after[1:])]
        found = drive("fit", np.concatenate([[NOISE, NOISE, RATIO], np.ravel(rows)]), 9)[0]
        assert int(found[8]) & CURVE == flag, (deeper, change)
        assert (found[3] == pytest.approx(change)) == bool(flag)
        assert found[4] == pytest.approx((change * RATIO) ** 2 if flag else 0, abs=1e-12)  # a variance of the ratio
