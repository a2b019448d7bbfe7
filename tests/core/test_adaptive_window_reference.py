"""HandoverRls against its reference in 50 decimal digits: on touches, and on any two signals.

Only the core rounds. Its decisions are those of the reference unless a number is within its rounding error of a limit: from
such a sample on nothing is compared. NEAR is ten times the error of the statistic below. Numbers without ties come so near in
one of 1e7 samples; ties are common only in a burst of noise, where every whitened innovation is limited, and five steps of
clip - drift are as large as three of clip + drift. `test_most_samples_are_compared` counts them.
"""

from decimal import Decimal, localcontext
from statistics import NormalDist
from typing import Any

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate import reference

Array = NDArray[np.float64]
Signals = tuple[Array, Array]
NEAR = 1e-8
SIZE = 160
EVENTS = (
    "nothing", "step", "small step", "drift", "slide", "fast", "outliers", "burst", "more noise", "zeros", "zeros first", "late",
    "pulses", "false readings",
)  # fmt: skip


def coloured(random: np.random.Generator, size: int, rho: float) -> Array:
    """Return AR(1) noise of variance 1."""
    noise = random.standard_normal(size)
    for i in range(1, size):
        noise[i] = rho * noise[i - 1] + np.sqrt(1 - rho**2) * noise[i]
    return noise


def hand(
    seed: int, noise: float = 1e-3, rho: float = 0.0, tone: float = 0.0, period: float = 6.0, step: float = 0.0,
    drift: float = 0.0, spikes: int = 0, reversal: bool = False,
) -> Signals:  # fmt: skip
    """Return outputs and regressors of a touch: noise relative to the output, its correlation, a tone, and events."""
    random = np.random.default_rng(seed)
    k = np.arange(SIZE)
    noises = coloured(random, SIZE, rho)
    regressor = 0.25 * np.minimum(1, (k + 1) / 8) * (1 + 0.02 * random.standard_normal(SIZE))
    if reversal:
        regressor[SIZE // 2 :] *= -0.1
    ratio = 2.5 * (1 + step * (k >= SIZE // 3) + drift * k / SIZE)
    output = ratio * regressor + 0.6 * (noise * noises + tone * np.sin(2 * np.pi * k / period))
    output[random.integers(10, SIZE, spikes)] += 3
    return output, regressor


def regressors(random: np.random.Generator, size: int, shape: str) -> Array:
    """Return a regressor around 0, of one size and any sign, slow, periodic, or of one sign."""
    if shape == "white":
        return random.standard_normal(size)
    if shape == "any sign":
        return random.choice([-1.0, 1.0], size) * (1 + 0.1 * random.standard_normal(size))
    if shape == "slow":
        return coloured(random, size, 0.95)
    if shape == "sine":
        return np.sin(np.arange(size) / random.uniform(1, 12))
    return random.uniform(0.5, 1.5, size)


def ratios(random: np.random.Generator, size: int, event: str, noise: float) -> Array:
    """Return the true ratios, with what an event changes in them."""
    k = np.arange(size)
    ratio = np.full(size, random.uniform(-3, 3))
    after = np.maximum(0, k - int(random.integers(size // 3, size)))
    if event == "step":
        ratio[after > 0] += random.uniform(0.5, 2)
    if event == "small step":
        ratio[size // 3 :] += random.uniform(0.5, 1.5) * noise
    if event == "drift":
        ratio += 10 * noise * k / size
    if event == "slide":
        ratio += 3 * noise * after
    if event == "fast":
        ratio += 30 * noise * np.sin(k / random.uniform(3, 15))
    return ratio


def any_two(
    seed: int, size: int, shape: str, event: str, noise: float = 0.1, rho: float = 0.0
) -> Signals:
    """Return two signals with noise, relative to the size of the regressor, its correlation, and an event."""
    random = np.random.default_rng(seed)
    x = regressors(random, size, shape)
    at = int(random.integers(10, size - 30))
    if event == "zeros":
        x[at : at + 100] = 0
    if event == "zeros first":
        x[:20] = 0
    noises = coloured(random, size, rho)
    if event == "pulses":
        x *= np.where(np.arange(size) % 40 < 6, 1, 0.01)
    if event == "outliers":
        noises[random.integers(0, size, 5)] *= 40
    if event == "burst":
        noises[at : at + 20] *= 30
    if event == "more noise":
        noises[at:] *= 5
    y = ratios(random, size, event, noise) * x
    if event == "late":
        y = np.roll(y, 1)
    y += noise * noises
    if event == "false readings":
        wrong = random.integers(0, size, 6)
        x[wrong] *= 10 ** random.uniform(0, 5, 6)
        y[wrong] *= 10 ** random.uniform(0, 5, 6)
    return y, x


hands = st.builds(
    hand,
    seed=st.integers(0, 2**32 - 1),
    noise=st.sampled_from([1e-4, 1e-3, 1e-2]),
    rho=st.sampled_from([0.0, 0.5, 0.9, -0.6]),
    tone=st.sampled_from([0.0, 3e-4, 3e-3]),
    period=st.floats(3, 30),
    step=st.sampled_from([0.0, 0.01, 0.3, -0.5]),
    drift=st.sampled_from([0.0, 0.05]),
    spikes=st.integers(0, 3),
    reversal=st.booleans(),
)
worlds = st.builds(
    any_two,
    seed=st.integers(0, 2**32 - 1),
    size=st.integers(60, 300),
    shape=st.sampled_from(["white", "any sign", "slow", "sine", "one sign"]),
    event=st.sampled_from(EVENTS),
    noise=st.sampled_from([1e-3, 0.03, 1.0]),
    rho=st.sampled_from([0.0, 0.5, 0.9, -0.6]),
)
tuning = st.fixed_dictionaries(
    {},
    optional={
        "false_alarm_interval": st.sampled_from([15.0, 300.0, 1e9, np.inf]),
        "smallest_shift": st.sampled_from([0.5, 3.0]),
        "clip": st.sampled_from([2.2, 6.0]),
        "smoothing": st.sampled_from([0.01, 0.5, 1.0]),
        "guard": st.sampled_from([1, 5, 40]),
        "initial_ratio": st.sampled_from([2.5, -4.0]),
    },
)


def cut_of(chosen: dict[str, float]) -> float:
    """Return the normal deviate at which samples are cut: the windows are a test in each 5.733 samples."""
    if not chosen.keys() & {"false_alarm_interval", "smallest_shift", "clip"}:
        return 5.0
    interval = chosen.get("false_alarm_interval", 1e7)
    if interval == np.inf:
        return np.inf
    return -NormalDist().inv_cdf(5.733 / interval / 2)


def exactly(signals: Signals, chosen: dict[str, float]) -> reference.AdaptiveWindowTrace:
    """Return what the reference computes in 50 digits."""
    estimator = palpate.HandoverRls(**chosen)
    settings = estimator.settings
    with localcontext(prec=50):
        output, regressor = (np.array([Decimal(v) for v in s.tolist()]) for s in signals)
        return reference.adaptive_window(
            output,
            regressor,
            drift=settings["smallest_shift"] / 2,
            threshold=estimator.threshold,
            cut=cut_of(chosen),
            clip=settings["clip"],
            smoothing=settings["smoothing"],
            guard=int(settings["guard"]),
            initial_ratio=settings["initial_ratio"],
            number=Decimal,
        )


def compared(exact: reference.AdaptiveWindowTrace, near: float) -> int:
    """Return how many samples there are before the first one with a decision near its limit."""
    [first] = np.append(exact.margin < near, True).nonzero()[0][:1]
    return int(first)


def assert_near(
    rows: NDArray[Any], exact: reference.AdaptiveWindowTrace, signals: Signals, allowed: dict[str, float], near: float
) -> None:  # fmt: skip
    """Compare up to the first decision near its limit, in units of the size of what is added up."""
    end = compared(exact, near)
    output, regressor = (np.abs(values[:end]) for values in signals)
    size = np.sqrt(np.mean(signals[0] ** 2) / np.mean(signals[1] ** 2))
    sizes = {"ratio": size, "innovation": output + size * regressor, "statistic": 10.0}
    assert rows["alarm"][:end].tolist() == exact.alarm[:end].tolist()
    for name, relative in allowed.items():
        found = rows[name][:end]
        right = getattr(exact, name)[:end].astype(float)
        assert np.array_equal(np.isnan(found), np.isnan(right)), name
        assert np.array_equal(np.isinf(found), np.isinf(right)), name
        known = np.isfinite(right)
        most = relative * (np.abs(right) + sizes.get(name, 0.0))
        assert (np.abs(found[known] - right[known]) <= most[known]).all(), name


DOUBLE = {
    "ratio": 1e-11,
    "covariance": 1e-11,
    "innovation": 1e-11,
    "statistic": 1e-9,
    "standard_error": 1e-9,
}
SINGLE = {
    "ratio": 1e-5,
    "covariance": 1e-5,
    "innovation": 1e-5,
    "statistic": 1e-4,
    "standard_error": 2e-4,
}


@examples(120, 3000)
@given(hands | worlds, tuning)
# A hand-over; drifts; outliers; correlated noise; a regressor that changes its sign; windows of the last samples.
@example(hand(0, step=0.3), {})
@example(hand(0, drift=0.05), {})
@example(hand(0, drift=2.0, spikes=8), {})
@example(hand(0, spikes=3), {})
@example(hand(0, rho=0.9), {})
@example(hand(0, reversal=True), {})
@example(any_two(3, 300, "one sign", "slide"), {})
@example(any_two(3, 300, "one sign", "fast"), {})
@example(any_two(3, 300, "white", "burst"), {"guard": 3})
@example(any_two(3, 300, "one sign", "more noise"), {})
@example(any_two(3, 300, "slow", "zeros"), {})
@example(any_two(3, 300, "one sign", "zeros first"), {"false_alarm_interval": np.inf})
# The short memory takes outliers from the third in a row on; noise of the levels that differs from that of finer ones.
@example(any_two(26, 300, "slow", "fast", noise=1.0), {})
@example(any_two(70, 300, "slow", "fast", noise=1e-3), {"smallest_shift": 0.5, "guard": 1})
@example(any_two(187, 300, "slow", "drift", noise=1.0), {})
@example(any_two(311, 300, "one sign", "drift", noise=1.0, rho=0.9), {})
def test_the_core_is_the_reference(samples: Signals, chosen: dict[str, float]) -> None:
    """Bounds, with the rounding u = 1.1e-16 of a number, at most 300 samples n, and noise of 1e-4 of the output or more.

    Ratio, covariance and innovation: sums of n terms, all of one sign in the information: n u = 3e-14, and a hundred times
    that for a ratio of three small regressors, as one in a hundred is a hundredth of their size.
    Statistic: up to n whitened innovations, each two u of the output off, in units of a scale of 1e-4 of it:
    300 * 2.2e-16 / 1e-4 = 7e-10, of a number near 10.
    Standard error: the core's Student statistics are right to 1e-11; the difference of two blocks is n u of the output off
    where it is as small as their noise, 3e-14 / 1e-4 = 3e-10.
    """
    rows = palpate.HandoverRls(**chosen).trace(*samples)
    assert_near(rows, exactly(samples, chosen), samples, DOUBLE, NEAR)


def test_a_small_step_that_the_windows_find_in_2000_samples() -> None:
    random = np.random.default_rng(1)
    x = random.uniform(0.5, 1.5, 2000)
    samples = np.repeat([2.0, 2.5], [1300, 700]) * x + random.standard_normal(2000), x
    exact = exactly(samples, {})
    rows = palpate.HandoverRls().trace(*samples)
    [at] = rows["alarm"].nonzero()[0]
    assert at > 1300
    assert rows["statistic"][at] < palpate.HandoverRls().threshold
    assert compared(exact, NEAR) == 2000
    assert_near(rows, exact, samples, DOUBLE, NEAR)


def test_most_samples_are_compared() -> None:
    """Ties are in bursts, and there in one of three runs."""
    share = {}
    for event in EVENTS:
        runs = [exactly(any_two(seed, 200, "one sign", event), {}) for seed in range(3)]
        share[event] = np.mean([compared(run, NEAR) / 200 for run in runs])
    assert share.pop("burst") > 0.5
    assert set(share.values()) == {1.0}


@pytest.mark.parametrize("event", EVENTS)
def test_float_is_the_reference_but_for_its_rounding(event: str) -> None:
    """As above with u = 6e-8, 150 samples and noise of .1 of the output: sums are within n u = 9e-6.

    What is compared with noise is 9e-6 / .1 = 9e-5 off, and its square twice that; the nearest decision is five times as far.
    """
    output, regressor = (v.astype(np.float32) for v in any_two(5, 150, "one sign", event))
    signals = output.astype(float), regressor.astype(float)
    rows = palpate.HandoverRls32().trace(output, regressor)
    assert_near(rows, exactly(signals, {}), signals, SINGLE, 1e-3)
