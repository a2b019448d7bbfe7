"""HandoverRls against its reference in 50 decimal digits, on touches with everything that a hand and a board do."""

from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import palpate
from effort import examples
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate import reference

FIELDS = ("ratio", "covariance", "innovation", "statistic", "standard_error")
SIZE = 160


def hand(
    seed: int, noise: float = 1e-3, rho: float = 0.0, tone: float = 0.0, period: float = 6.0, step: float = 0.0,
    drift: float = 0.0, spikes: int = 0, reversal: bool = False,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
    """Return outputs and regressors of a touch: noise relative to the output, its correlation, a tone, and events."""
    random, k = np.random.default_rng(seed), np.arange(SIZE)
    noises = random.standard_normal(SIZE)
    for i in range(1, SIZE):
        noises[i] = rho * noises[i - 1] + np.sqrt(1 - rho**2) * noises[i]
    regressor = 0.25 * np.minimum(1, (k + 1) / 8) * (1 + 0.02 * random.standard_normal(SIZE))
    if reversal:
        regressor[SIZE // 2 :] *= -0.1
    ratio = 2.5 * (1 + step * (k >= SIZE // 3) + drift * k / SIZE)
    output = ratio * regressor + 0.6 * (noise * noises + tone * np.sin(2 * np.pi * k / period))
    output[random.integers(10, SIZE, spikes)] += 3
    return output, regressor


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
tuning = st.fixed_dictionaries(
    {},
    optional={
        "steady": st.sampled_from([0.9, 0.98, 1.0]),
        "false_alarm_interval": st.sampled_from([15.0, 300.0, 1e9]),
        "smallest_shift": st.sampled_from([0.5, 3.0]),
        "clip": st.sampled_from([2.2, 6.0]),
        "smoothing": st.sampled_from([0.01, 0.5, 1.0]),
        "guard": st.sampled_from([0, 1, 5, 40]),
        "initial_ratio": st.sampled_from([2.5, -4.0]),
        "initial_covariance": st.sampled_from([1.0, 1e4]),
        "max_covariance": st.sampled_from([1e4, 1e6]),
    },
).filter(lambda s: s.get("initial_covariance", 1e10) <= s.get("max_covariance", 1e12))


def exactly(output: Any, regressor: Any, **chosen: Any) -> reference.HandoverTrace:
    with localcontext(prec=50):
        decimals = [
            np.array([Decimal(v) for v in values.tolist()]) for values in (output, regressor)
        ]
        return reference.handover_rls(*decimals, number=Decimal, **chosen)


@examples(250, 5000)
@given(hands, tuning)
# A hand-over; a drift, and one with outliers; outliers; the long-run variance of an AR(1), an AR(2); least squares.
@example(hand(0, step=0.3), {})
@example(hand(0, drift=0.05), {})
@example(hand(0, drift=2.0, spikes=8), {})
@example(hand(0, spikes=3), {})
@example(hand(0), {})
@example(hand(0, tone=0.01), {})
@example(hand(0, reversal=True), {})
def test_the_core_is_the_reference(
    samples: tuple[NDArray[np.float64], ...], chosen: dict[str, float]
) -> None:
    """Only the core rounds: 1e-10 is 5e5 eps, for what cancels; in the standard error correlations near 1 do, twice.

    The covariance of a drift depends on what its offset has above the allowed one, in units of a roughness of 1e-4: a
    difference of numbers near 2 that are 1e-12 off, 1e-11 with the mean of 31, in each of up to a hundred samples: 1e-9.
    The statistic sums up to 160 whitened innovations, each an eps or two of the output off, in units of a scale that is
    1e-4 of the output at least: 160 * 2 * 2e-16 / 1e-4 = 7e-10, and with what the ratio is off 1e-9.
    """
    output, regressor = samples
    estimator = palpate.HandoverRls(**chosen)
    goal = {"false_alarm_interval", "smallest_shift"}
    others = {name: value for name, value in chosen.items() if name not in goal}
    drift = estimator.settings["smallest_shift"] / 2
    exact = exactly(output, regressor, drift=drift, threshold=estimator.threshold, **others)
    rows = estimator.trace(output, regressor)
    assert rows["alarm"].tolist() == exact.alarm.tolist()
    for name in FIELDS:
        right = getattr(exact, name).astype(float)
        allowed = (1e-8 if name in {"standard_error", "covariance"} else 1e-10) * (
            np.abs(right) + {"innovation": np.abs(output), "statistic": 10.0}.get(name, 0.0)
        )
        assert np.array_equal(np.isnan(rows[name]), np.isnan(right)), name
        assert (np.abs(rows[name] - right)[~np.isnan(right)] <= allowed[~np.isnan(right)]).all(), (
            name
        )
