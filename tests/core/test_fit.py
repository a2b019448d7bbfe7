"""The test of the model: the core against the reference, and sizes, flags and errors of simulated effects."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numeric import around, drive, edge
from numpy.typing import NDArray
from palpate.reference import Fit, Misfit
from palpate.reference.fit import FEWEST
from palpate.reference.model import NOISE_GAIN, model

EPS = np.finfo(float).eps
BITS = {"offset": 1, "drift": 2, "lag": 4, "curve": 8}
NAMES = ("offset", "drift", "lag", "curve", "open", "open_drift", "offset_ratio", "offset_error")


@dataclass(frozen=True)
class Samples:
    """Pairs of a touch: depth, its variation, noise in units of the readings', and what the model leaves out."""

    seed: int
    count: int = 240
    ratio: float = 2.8
    depth: float = 0.25
    sway: float = 0.05
    pace: float = 1.0  # of the sway; a slow one has hardly a slope
    noise: float = 1e-4  # relative to the depth
    offset: float = 0.0
    drift: float = 0.0
    lag: float = 0.0
    curve: float = 0.0
    lost: float = 0.0
    press: int = 0  # pairs of a rise before
    change: float = 0.0  # of the ratio at a hand-over in the middle
    deeper: float = 1.0

    def rows(self) -> list[list[float]]:
        """Return output, regressor, number; and change, 0, -1 at a hand-over."""
        random, k = np.random.default_rng(self.seed), np.arange(self.count)
        waves = [np.sin(2 * np.pi * (self.pace * f * 0.026 * k + random.random())) for f in (0.4, 1.1, 1.7, 4.2)]
        x = 1 + self.sway * np.sum(waves, axis=0)
        x[: self.press] *= (k[: self.press] + 1) / (self.press + 1)
        later = k >= self.count // 2
        x[later] *= self.deeper
        terms = self.offset + self.drift * k / self.count + self.lag * np.gradient(x) if self.count > 1 else 0
        y = self.ratio * (1 + self.change * later) * (x + terms + self.curve * (x - 1) ** 2)
        x, y = (self.depth * (v + 0.65 * self.noise * random.standard_normal(self.count)) for v in (x, y))
        rows: list[list[float]] = np.column_stack([y, x, k + 1000])[random.random(self.count) >= self.lost].tolist()
        if self.change:
            at = next((i for i, row in enumerate(rows) if row[2] >= 1000 + self.count // 2), len(rows))
            rows.insert(at + 1, [self.change, 0.0, -1.0])  # after a sample of the new depth, as at an alarm
        return rows


def sizes(most: float) -> st.SearchStrategy[float]:
    """None, or any size of either sign, the small ones as often as the large ones."""
    return st.just(0.0) | st.builds(
        lambda sign, share: sign * most * share**3, st.sampled_from([-1, 1]), st.floats(0, 1)
    )


touches = st.builds(
    Samples,
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


def by_reference(rows: list[list[float]], noise: float, ratio: float) -> tuple[Misfit, float, float, float]:
    """Return what the reference finds, how much the core's sums amplify rounding, and the outputs over regressor and slope."""
    fit = Fit()
    for output, regressor, number in rows:
        if number < 0:
            fit.restart(output)
        else:
            fit.add(output, regressor, int(number))
    terms = fit.terms()
    outputs, regressors, slopes = (float(np.linalg.norm(terms[name])) for name in ("y", "x", "slope"))
    over_regressor, over_slope = (outputs / (ratio * size) if size else 0.0 for size in (regressors, slopes))
    return fit.result(noise, noise, ratio), amplification(terms, noise), over_regressor, over_slope


def amplification(terms: dict[str, NDArray[np.float64]], noise: float) -> float:
    """Return the largest ratio of a column's sum of squares to the part that the other columns of the model do not explain."""
    x = terms["x"]
    if len(x) < FEWEST:
        return 1.0
    columns = model(x, terms["time"], terms["slope"], noise)
    matrix = np.column_stack([x**2 if name == "square" else column for name, column in columns.items()])
    matrix /= np.sqrt((matrix**2).sum(axis=0))
    return float((np.linalg.norm(np.linalg.pinv(matrix, rcond=1e-15), axis=1) ** 2).max())


def squares_to_noise(rows: list[list[float]], noise: float, ratio: float) -> float:
    """Return the mean square of the outputs over the least that the residuals can have."""
    outputs = np.array([output for output, _, number in rows if number >= 0])  # the rest are hand-overs
    return float((outputs**2).mean() / (NOISE_GAIN * (1 + ratio**2) * noise**2))


def by_core(rows: list[list[float]], noise: float, ratio: float) -> dict[str, float]:
    found = drive("fit", np.concatenate([[noise, noise, ratio], np.ravel(rows)]), 9)[0]
    return dict(zip((*NAMES, "flags"), found.tolist(), strict=True))


@examples(300)
@given(touches)
def test_the_core_is_the_reference(touch: Samples) -> None:
    """Only rounding differs: sums of squares lose what the terms have in common.

    Each size has an error of some eps times the amplification, which is 1e8 at most here. Noises are above 1e-5 of the
    depth: below that, whether one pair alone varies is decided by the fourth power of its share, below eps. The sum of
    squares of the residuals is what the terms leave of that of the outputs, and at least what the noise in idle gives.
    The error of a coefficient is that of the outputs' sums over the size of its column: an offset makes the outputs larger
    than the regressors, and slopes are much smaller than both.
    """
    noise = touch.depth * touch.noise
    rows = touch.rows()
    right, amplified, over_regressor, over_slope = by_reference(rows, noise, touch.ratio)
    found = by_core(rows, noise, touch.ratio)
    assert found["flags"] == sum(BITS[flag] for flag in right.flags)
    tolerance = 100 * EPS * amplified + 1e-11
    for name in NAMES:
        expected = getattr(right, name)
        assert np.isnan(found[name]) == np.isnan(expected), name
        if not np.isnan(expected):
            allowed = tolerance * max(abs(expected), 0.1, 0.1 * over_regressor)
            if name == "lag":
                allowed += EPS * amplified * over_slope
            if name == "offset_error":
                allowed += 100 * EPS * squares_to_noise(rows, noise, touch.ratio) * expected
            assert abs(found[name] - expected) <= allowed, name


@pytest.mark.parametrize("noise", [1e-5, 3e-3])  # of these the smallest size decides, and the significance
@pytest.mark.parametrize(("name", "most"), [("offset", 0.2), ("drift", 0.2), ("lag", 0.9), ("curve", 0.9)])
def test_the_limit_of_each_flag_is_that_of_the_reference(name: str, most: float, noise: float) -> None:
    def touch(size: float) -> Samples:
        return replace(Samples(5, noise=noise, sway=0.1), **{name: size})  # type: ignore[arg-type]

    def found(size: float) -> Misfit:
        return by_reference(touch(size).rows(), 0.25 * noise, 2.8)[0]

    for size in around(edge(lambda size: name in found(size).flags, 0.0, most)):
        core = by_core(touch(size).rows(), 0.25 * noise, 2.8)
        assert core["flags"] == sum(BITS[flag] for flag in found(size).flags)


def test_the_limit_of_a_slope_that_is_noise_is_that_of_the_reference() -> None:
    def touch(pace: float) -> Samples:
        return Samples(5, noise=3e-3, sway=0.2, pace=pace)

    for pace in around(edge(lambda pace: by_reference(touch(pace).rows(), 7.5e-4, 2.8)[0].lag != 0, 0.003, 0.5)):
        assert (by_core(touch(pace).rows(), 7.5e-4, 2.8)["lag"] != 0) == (
            by_reference(touch(pace).rows(), 7.5e-4, 2.8)[0].lag != 0
        )
