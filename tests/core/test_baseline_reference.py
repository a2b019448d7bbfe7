"""The baseline against its reference, which keeps every value and its weight."""

from dataclasses import dataclass

import numpy as np
import pytest
from driving import drive
from edges import around, edge
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate.reference import Baseline
from palpate.reference.baseline import first_level
from tally import Tally

EPS = np.finfo(float).eps
READY, LEVEL, EXPECTED, SLOPE, SPREAD, VARIANCE, AGE = range(7)


@dataclass(frozen=True)
class Idle:
    """A channel without contact: noise relative to the scale, a drift in noises a value, spikes, a jump, codes."""

    seed: int
    count: int = 200
    scale: float = 0.6
    noise: float = 1e-4
    drift: float = 0.0
    spikes: float = 0.0
    jump: float = 0.0
    code: float = 0.0

    def values(self) -> NDArray[np.float64]:
        random, k = np.random.default_rng(self.seed), np.arange(self.count)
        deviations = random.standard_normal(self.count) + self.drift * k + self.jump * (k > random.integers(self.count))
        deviations += 1e4 * (random.random(self.count) < self.spikes)
        if self.code:
            deviations = self.code * np.rint(deviations / self.code)
        return np.asarray(self.scale * (1 + self.noise * deviations))


channels = st.builds(
    Idle,
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 400),
    scale=st.sampled_from([0.6, -4.0, 1e-6, 1e6]),
    noise=st.sampled_from([0.0, 1e-7, 1e-4, 1.0]),
    drift=st.sampled_from([0.0, 0.0, 0.02, -0.3, 5.0]) | st.floats(0.45, 0.65),  # the limit is 10 / 16
    spikes=st.sampled_from([0.0, 0.0, 0.02, 0.3]),
    jump=st.sampled_from([0.0, 0.0, 30.0, -1e4]),
    code=st.sampled_from([0.0, 0.0, 0.5, 3.0]),
)


def by_reference(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the rows of the driver, and where the test for a drift is decided by more than rounding."""
    baseline, rows, clear = Baseline(), [], []
    for value in values.tolist():
        baseline.add(value)
        now = baseline.now
        rows.append([baseline.ready, now.level, now.expected, now.slope, now.noise, now.variance, now.age])
        trend = abs(now.fast - now.slow)
        clear.append(abs(trend - now.noise * (4 / 32) ** 0.5) > 1e-6 * now.noise)
    return np.array(rows, float), np.array(clear)


@examples(300)
@given(channels)
def test_the_core_is_the_reference(tally: Tally, channel: Idle) -> None:
    """Only rounding differs: some eps of the largest value for each of the 64 values of the memory."""
    tally.count("channels against the reference of the baseline")
    values = channel.values()
    found = drive("baseline", values, 7)
    right, clear = by_reference(values)
    assert np.array_equal(found[:, READY], right[:, READY])
    ready = right[:, READY] == 1
    rounding = 500 * EPS * np.abs(values).max()
    for column in (EXPECTED, SLOPE, SPREAD):
        assert (np.abs(found - right)[ready, column] <= rounding).all(), column
    ready &= clear
    assert (np.abs(found - right)[ready, LEVEL] <= rounding).all()
    assert np.allclose(found[ready, AGE], right[ready, AGE], rtol=1e-12, atol=0)
    relative = 3 * rounding / right[ready, SPREAD] + 1e-12
    assert (np.abs(found - right)[ready, VARIANCE] <= relative * right[ready, VARIANCE]).all()


def test_the_examples_reach_every_branch() -> None:
    """A drift that is proven, one that is not yet; outliers among the first values; a floor of codes and the least one."""
    drifting, still = Idle(1, 400, drift=0.3).values(), Idle(1, 400).values()
    [steep, flat] = (by_reference(values)[0] for values in (drifting, still))
    assert not (steep[32:140, LEVEL] == steep[32:140, EXPECTED]).any()
    assert (steep[170:, LEVEL] == steep[170:, EXPECTED]).all()
    assert (steep[170:, AGE] == 0).all()
    assert (flat[170:, LEVEL] != flat[170:, EXPECTED]).mean() > 0.9
    spiked = Baseline()
    for value in Idle(4, 32, spikes=0.1).values():
        spiked.add(value)
    assert 16 < spiked.now.count < 32
    assert by_reference(np.full(60, 0.6))[0][-1, SPREAD] == 1e-6
    assert by_reference(Idle(1, 40, code=3.0, noise=1e-3).values())[0][-1, SPREAD] == pytest.approx(0.0009)


@pytest.mark.parametrize("seed", range(4))
def test_the_limit_of_a_first_slope_is_that_of_the_reference(seed: int) -> None:
    """Ten standard deviations of a half are no drift, but a touch or a jump."""
    noise = np.random.default_rng(seed).standard_normal(32)

    def values(jump: float) -> NDArray[np.float64]:
        return np.asarray(0.6 + 4e-5 * (noise + jump * (np.arange(32) >= 16)))

    for jump in around(edge(lambda jump: first_level(values(jump)).slope == 0, 1.0, 30.0)):
        slope = drive("baseline", values(jump), 7)[-1, SLOPE]
        assert slope == pytest.approx(first_level(values(jump)).slope, rel=1e-6, abs=1e-12)
