"""Baseline and contact of a channel, value by value: the core against the reference."""

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numeric import around, drive, edge
from numpy.typing import NDArray
from palpate.reference import Baseline, Contact
from palpate.reference.idle import first_level

EPS = np.finfo(float).eps
READY, LEVEL, EXPECTED, RECOVERY, SPREAD, VARIANCE, MEAN_AGE, DISTURBED = range(8)


def idle(
    seed: int,
    count: int,
    scale: float,
    noise: float,
    drift: float,
    spikes: float,
    jump: float,
    code: float,
) -> NDArray[np.float64]:
    """Return a channel without contact: noise relative to the scale, a drift in noises a value, spikes, a jump, codes."""
    random = np.random.default_rng(seed)
    k = np.arange(count)
    deviations = random.standard_normal(count) + drift * k + jump * (k > random.integers(count))
    deviations += 1e4 * (random.random(count) < spikes)
    if code:
        deviations = code * np.rint(deviations / code)
    return np.asarray(scale * (1 + noise * deviations))


channels = st.builds(
    idle,
    seed=st.integers(0, 2**32 - 1),
    count=st.integers(1, 400),
    scale=st.sampled_from([0.6, -4.0, 1e-6, 1e6]),
    noise=st.sampled_from([0.0, 1e-7, 1e-4, 1.0]),
    drift=st.sampled_from([0.0, 0.0, 0.02, -0.3, 5.0])
    | st.floats(0.45, 0.65),  # the limit is 10 / 16
    spikes=st.sampled_from([0.0, 0.0, 0.02, 0.3]),
    jump=st.sampled_from([0.0, 0.0, 30.0, -1e4]),
    code=st.sampled_from([0.0, 0.0, 0.5, 3.0]),
)


def by_reference(
    values: NDArray[np.float64], period_ns: int
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Return the rows of the driver, and where the test for a drift is decided by more than rounding."""
    baseline = Baseline()
    rows = []
    clear = []
    for number, value in enumerate(values.tolist()):
        baseline.add(value)
        if period_ns:
            baseline.collected(number * period_ns)
        now = baseline.now
        numbers = [now.level, now.expected, now.recovery, now.noise, now.variance, now.age]
        rows.append([baseline.ready, *numbers, now.disturbed])
        trend = abs(now.fast - now.slow)
        clear.append(abs(trend - now.noise * (4 * now.share) ** 0.5) > 1e-6 * now.noise)
    return np.array(rows, float), np.array(clear)


periods_ns = st.sampled_from([0, 26_000_000, 31_250_000, 40_000_000, 128_000_000, 500_000_000])


@examples(300)
@given(channels, periods_ns | st.integers(25_000_000, 300_000_000))
def test_the_baseline_is_the_reference(values: NDArray[np.float64], period_ns: int) -> None:
    """Only rounding differs: some eps of the largest value for each of the 64 values of the memory."""
    found = drive("baseline", np.append(period_ns, values), 8)
    right, clear = by_reference(values, period_ns)
    assert np.array_equal(found[:, READY], right[:, READY])
    ready = right[:, READY] == 1
    rounding = 500 * EPS * np.abs(values).max()
    assert np.array_equal(found[ready, DISTURBED], right[ready, DISTURBED])
    for column in (EXPECTED, RECOVERY, SPREAD):
        # a recovery is over half of the first values
        largest = rounding * (16 if column == RECOVERY else 1)
        assert (np.abs(found - right)[ready, column] <= largest).all(), column
    ready &= clear
    assert (np.abs(found - right)[ready, LEVEL] <= rounding).all()
    assert np.allclose(found[ready, MEAN_AGE], right[ready, MEAN_AGE], rtol=1e-12, atol=0)
    relative = 3 * rounding / right[ready, SPREAD] + 1e-12
    assert (np.abs(found - right)[ready, VARIANCE] <= relative * right[ready, VARIANCE]).all()


@pytest.mark.parametrize("seed", range(4))
def test_the_limit_of_a_first_slope_is_that_of_the_reference(seed: int) -> None:
    """Ten standard deviations of a half are no drift, but a touch or a jump."""
    noise = np.random.default_rng(seed).standard_normal(32)

    def values(jump: float) -> NDArray[np.float64]:
        return np.asarray(0.6 + 4e-5 * (noise + jump * (np.arange(32) >= 16)))

    for jump in around(edge(lambda jump: first_level(values(jump)).slope == 0, 1.0, 30.0)):
        recovery = drive("baseline", np.append(0.0, values(jump)), 8)[-1, RECOVERY]
        assert recovery == pytest.approx(first_level(values(jump)).recovery, rel=1e-6, abs=1e-11)


CONTACT = 0
AGE = 1
Row = tuple[float, float, float, bool]

heights = st.sampled_from(
    [0.0, 1.2, 1.5, 2.0, 2.5, 6.0, 7.5, 10.5, 20.5, 47.0, 50.0, 100.0, 1e9, -1.5, -3.0, -1e9]
) | st.floats(-100, 100)
parts = st.tuples(st.integers(1, 40), heights, st.sampled_from([0.0, 0.0, 1.0]), st.booleans())


@st.composite
def courses(draw: st.DrawFn) -> list[Row]:
    """Draw (change, noise, seconds waited, wish to be between baselines): plateaus on limits, noise, long waits."""
    random = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    noise = draw(st.sampled_from([1.0, 1.0, 1.0, 4e-5, 1e-9, 1e9, 0.0]))
    rows: list[Row] = []
    for count, height, spread, between in draw(st.lists(parts, min_size=1, max_size=12)):
        waited = draw(st.sampled_from([0.0, 0.0, 29.9, 30.0, 1e3]))
        changes = (noise or 1.0) * (height + spread * random.standard_normal(count))
        rows += [(change, noise, waited, between) for change in changes.tolist()]
    return rows


def decided(course: list[Row]) -> tuple[list[list[float]], NDArray[np.float64]]:
    """Return the rows for the driver, and what the reference makes of them."""
    gate = Contact()
    given_ = []
    right = []
    for change, noise, waited, wished in course:
        between = wished and gate.state == "idle"
        given_.append([change, noise, waited, between])
        gate.update_between(change, noise) if between else gate.update(change, noise, waited)
        right.append(
            [gate.state == "contact", gate.age, gate.state == "idle", gate.fell, gate.suspects]
        )
    return given_, np.array(right, float)


@examples(200, 4000)
@given(courses())
def test_the_contact_is_the_reference(course: list[Row]) -> None:
    """Every operation is the same single rounding in both, so no decision may differ."""
    given_, right = decided(course)
    found = drive("contact", given_, 5)
    for rows in (found, right):
        rows[rows[:, CONTACT] == 0, AGE] = 0  # in other states the age is not the start of a touch
    assert found.tolist() == right.tolist()
