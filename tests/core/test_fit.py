"""The test of the model: the core against the reference, and sizes, flags and errors of simulated effects."""

from typing import Any

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numeric import around, drive, edge
from numpy.typing import NDArray
from palpate.reference import Fit, Misfit
from palpate.reference.fit import FEWEST, NOISE_GAIN, model

EPS = np.finfo(float).eps
BITS = {"offset": 1, "drift": 2, "lag": 4, "curve": 8}
NAMES = (
    "offset",
    "drift",
    "drift_error",
    "lag",
    "curve",
    "open",
    "open_drift",
    "offset_ratio",
    "offset_error",
)


Touch = tuple[list[list[float]], float, float]


def touch_of(
    seed: int, count: int = 240, ratio: float = 2.8, depth: float = 0.25, sway: float = 0.05, pace: float = 1.0,
    noise: float = 1e-4, offset: float = 0.0, drift: float = 0.0, lag: float = 0.0, curve: float = 0.0, lost: float = 0.0,
    press: int = 0, change: float = 0.0, deeper: float = 1.0,
) -> Touch:  # fmt: skip
    """Return the pairs of a touch, their noise and their ratio.

    The depth sways, slowly if the pace is small: then it has hardly a slope. The noise is relative to the depth. The model
    leaves out offset, drift, lag and curve. A rise has `press` pairs; the ratio changes at a hand-over in the middle. A row
    is output, regressor, number; or change, 0, -1 at the hand-over.
    """
    random = np.random.default_rng(seed)
    k = np.arange(count)
    waves = [
        np.sin(2 * np.pi * (pace * f * 0.026 * k + random.random())) for f in (0.4, 1.1, 1.7, 4.2)
    ]
    x = 1 + sway * np.sum(waves, axis=0)
    x[:press] *= (k[:press] + 1) / (press + 1)
    later = k >= count // 2
    x[later] *= deeper
    terms = offset + drift * k / count + lag * np.gradient(x) if count > 1 else 0
    y = ratio * (1 + change * later) * (x + terms + curve * (x - 1) ** 2)
    x, y = (depth * (v + 0.65 * noise * random.standard_normal(count)) for v in (x, y))
    rows: list[list[float]] = np.column_stack([y, x, k + 1000])[
        random.random(count) >= lost
    ].tolist()
    if change:
        at = next((i for i, row in enumerate(rows) if row[2] >= 1000 + count // 2), len(rows))
        rows.insert(at + 1, [change, 0.0, -1.0])  # after a sample of the new depth, as at an alarm
    return rows, depth * noise, ratio


def sizes(most: float) -> st.SearchStrategy[float]:
    """None, or any size of either sign, the small ones as often as the large ones."""
    return st.just(0.0) | st.builds(
        lambda sign, share: sign * most * share**3, st.sampled_from([-1, 1]), st.floats(0, 1)
    )


touches = st.builds(
    touch_of,
    seed=st.integers(0, 2**32 - 1),
    count=st.sampled_from([1, 3, 17, 18, 19, 30, 240]) | st.integers(20, 400),
    ratio=st.sampled_from([1.0, 2.8, 9.0]),
    depth=st.sampled_from([0.25, 0.02, 4.0, 1e-3, 1e3]),
    sway=st.sampled_from([0.0, 1e-3, 0.01, 0.05, 0.2]),
    pace=st.sampled_from([1.0, 1.0]) | st.floats(0.003, 0.2),
    noise=st.sampled_from([1e-5, 1e-4, 1e-3, 1e-2]),
    offset=sizes(0.05) | st.just(0.7),
    drift=sizes(0.03),
    lag=sizes(0.2),
    curve=sizes(0.3),
    lost=st.sampled_from([0.0, 0.0, 0.05, 0.3]),
    press=st.sampled_from([0, 0, 8]),
    change=st.sampled_from([0.0, 0.0, 0.005, 0.02, -0.3]),
    deeper=st.sampled_from([1.0, 1.2, 1.5, 0.6]),
)


def by_reference(
    rows: list[list[float]], noise: float, ratio: float
) -> tuple[Misfit, float, float, float]:
    """Return what the reference finds, how much the core's sums amplify rounding, and the outputs over regressor and slope."""
    fit = Fit()
    for output, regressor, number in rows:
        if number < 0:
            fit.restart(output)
        else:
            fit.add(output, regressor, int(number))
    terms = fit.terms()
    outputs, regressors, slopes = (
        float(np.linalg.norm(terms[name])) for name in ("y", "x", "slope")
    )
    over_regressor, over_slope = (
        outputs / (ratio * size) if size else 0.0 for size in (regressors, slopes)
    )
    return fit.result(noise, noise, ratio), amplification(terms, noise), over_regressor, over_slope


def amplification(terms: dict[str, NDArray[np.float64]], noise: float) -> float:
    """Return the largest ratio of a column's sum of squares to the part that the other columns of the model do not explain."""
    x = terms["x"]
    if len(x) < FEWEST:
        return 1.0
    columns = model(x, terms["time"], terms["slope"], noise)
    matrix = np.column_stack(
        [x**2 if name == "square" else column for name, column in columns.items()]
    )
    matrix /= np.sqrt((matrix**2).sum(axis=0))
    return float((np.linalg.norm(np.linalg.pinv(matrix, rcond=1e-15), axis=1) ** 2).max())


def squares_to_noise(rows: list[list[float]], noise: float, ratio: float) -> float:
    """Return the mean square of the outputs over the least that the residuals can have."""
    # the rest are hand-overs
    outputs = np.array([output for output, _, number in rows if number >= 0])
    return float((outputs**2).mean() / (NOISE_GAIN * (1 + ratio**2) * noise**2))


def by_core(rows: list[list[float]], noise: float, ratio: float) -> dict[str, float]:
    found = drive("fit", np.concatenate([[noise, noise, ratio], np.ravel(rows)]), 10)[0]
    return dict(zip((*NAMES, "flags"), found.tolist(), strict=True))


@examples(300)
@given(touches)
def test_the_core_is_the_reference(touch: Touch) -> None:
    """Only rounding differs: sums of squares lose what the terms have in common.

    Each size has an error of some eps times the amplification, which is 1e8 at most here. Noises are above 1e-5 of the
    depth: below that, whether one pair alone varies is decided by the fourth power of its share, below eps. The sum of
    squares of the residuals is what the terms leave of that of the outputs, and at least what the noise in idle gives.
    The error of a coefficient is that of the outputs' sums over the size of its column: an offset makes the outputs larger
    than the regressors, and slopes are much smaller than both.
    """
    right, amplified, over_regressor, over_slope = by_reference(*touch)
    found = by_core(*touch)
    assert found["flags"] == sum(BITS[flag] for flag in right.flags)
    tolerance = 100 * EPS * amplified + 1e-11
    for name in NAMES:
        expected = getattr(right, name)
        assert np.isnan(found[name]) == np.isnan(expected), name
        if not np.isnan(expected):
            allowed = tolerance * max(abs(expected), 0.1, 0.1 * over_regressor)
            if name == "lag":
                allowed += EPS * amplified * over_slope
            if name.endswith("_error"):
                allowed += 100 * EPS * squares_to_noise(*touch) * expected
            assert abs(found[name] - expected) <= allowed, name


# At the first noise the smallest size decides, and the significance at the second.
FLAGS = [(name, most, {"noise": noise, "sway": 0.1}) for noise in (1e-5, 3e-3)
         for name, most in (("offset", 0.2), ("drift", 0.2), ("lag", 0.9), ("curve", 0.9))]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "most", "settings"), [*FLAGS, ("pace", 0.5, {"noise": 3e-3, "sway": 0.2})]
)
def test_each_limit_is_that_of_the_reference(
    name: str, most: float, settings: dict[str, Any]
) -> None:
    """Of a flag, and of the pace at which a slope is more than noise."""

    def touch(size: float) -> Touch:
        return touch_of(5, **settings | {name: size})

    def found(size: float) -> Misfit:
        return by_reference(*touch(size))[0]

    def decided(size: float) -> bool:
        return found(size).lag != 0 if name == "pace" else name in found(size).flags

    for size in around(edge(decided, 0.003 if name == "pace" else 0.0, most)):
        core = by_core(*touch(size))
        right = found(size)
        assert core["flags"] == sum(BITS[flag] for flag in right.flags)
        assert (core["lag"] != 0) == (right.lag != 0)
