"""HandoverRls against its reference in 50 decimal digits, on touches with everything that a hand and a board do."""

from dataclasses import dataclass
from decimal import Decimal, localcontext
from typing import Any

import numpy as np
import palpate
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate import reference
from tally import Tally

FIELDS = ("ratio", "covariance", "innovation", "statistic", "standard_error")
SIZE = 160


@dataclass(frozen=True)
class Hand:
    """What a touch is made of: noise relative to the output, its correlation, a tone, and events."""

    seed: int
    noise: float = 1e-3
    rho: float = 0.0
    tone: float = 0.0
    period: float = 6.0
    step: float = 0.0
    drift: float = 0.0
    spikes: int = 0
    reversal: bool = False

    def samples(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return outputs and regressors."""
        random = np.random.default_rng(self.seed)
        k = np.arange(SIZE)
        noise = random.standard_normal(SIZE)
        for i in range(1, SIZE):
            noise[i] = self.rho * noise[i - 1] + np.sqrt(1 - self.rho**2) * noise[i]
        regressor = 0.25 * np.minimum(1, (k + 1) / 8) * (1 + 0.02 * random.standard_normal(SIZE))
        if self.reversal:
            regressor[SIZE // 2 :] *= -0.1
        ratio = 2.5 * (1 + self.step * (k >= SIZE // 3) + self.drift * k / SIZE)
        output = ratio * regressor + 0.6 * (self.noise * noise + self.tone * np.sin(2 * np.pi * k / self.period))
        output[random.integers(10, SIZE, self.spikes)] += 3
        return output, regressor


hands = st.builds(
    Hand,
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
# No threshold is a multiple of clip - drift: clipped news would reach it exactly, and rounding decide.
tuning = st.fixed_dictionaries(
    {},
    optional={
        "steady": st.sampled_from([0.9, 0.98, 1.0]),
        "drift": st.sampled_from([0.25, 1.5]),
        "threshold": st.sampled_from([1.1, 3.7, 20.7]),
        "clip": st.sampled_from([2.2, 6.0]),
        "smoothing": st.sampled_from([0.01, 0.5, 1.0]),
        "initial_ratio": st.sampled_from([2.5, -4.0]),
        "initial_covariance": st.sampled_from([1.0, 1e4]),
        "max_covariance": st.sampled_from([1e4, 1e6]),
    },
).filter(lambda s: s.get("initial_covariance", 1e10) <= s.get("max_covariance", 1e12))


def exactly(output: Any, regressor: Any, **chosen: float) -> reference.HandoverTrace:
    with localcontext(prec=50):
        decimals = [np.array([Decimal(v) for v in values.tolist()]) for values in (output, regressor)]
        return reference.handover_rls(*decimals, number=Decimal, **chosen)


@examples(500)
@given(hands, tuning)
def test_the_core_is_the_reference(tally: Tally, hand: Hand, chosen: dict[str, float]) -> None:
    """Only the core rounds: 1e-10 is 5e5 eps, for what cancels; in the standard error correlations near 1 do, twice."""
    tally.count("touches against the reference of HandoverRls")
    output, regressor = hand.samples()
    exact = exactly(output, regressor, **chosen)
    rows = palpate.HandoverRls(**chosen).trace(output, regressor)
    assert rows["alarm"].tolist() == exact.alarm.tolist()
    for name in FIELDS:
        right = getattr(exact, name).astype(float)
        allowed = (1e-8 if name == "standard_error" else 1e-10) * (
            np.abs(right) + {"innovation": np.abs(output), "statistic": 1.0}.get(name, 0.0)
        )
        assert np.array_equal(np.isnan(rows[name]), np.isnan(right)), name
        assert (np.abs(rows[name] - right)[~np.isnan(right)] <= allowed[~np.isnan(right)]).all(), name
    if chosen or hand.reversal:
        return
    off = np.abs(rows["ratio"] / exact.ratio.astype(float) - 1).max() / np.finfo(float).eps
    tally.note("deviation of HandoverRls from its reference in a touch, eps of float64, ratio", float(off))


@pytest.mark.parametrize("tone", [0.0, 0.01])
def test_the_examples_reach_every_branch(tone: float) -> None:
    """Alarms, outliers, a memory halved, both forms of the long-run variance."""
    reached = {"alarm": False, "error": False}
    for seed in range(20):
        hand = Hand(seed, tone=tone, step=0.3, spikes=2)
        exact = reference.handover_rls(*hand.samples())
        reached["alarm"] |= bool(exact.alarm.any())
        reached["error"] |= bool(np.isfinite(exact.standard_error).any())
    assert all(reached.values())


def test_an_empty_touch_has_an_empty_trace() -> None:
    assert reference.handover_rls([], []).ratio.shape == (0,)
    with pytest.raises(ValueError, match="not finite"):
        reference.handover_rls([np.nan], [1.0])
