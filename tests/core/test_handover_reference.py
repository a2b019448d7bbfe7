"""HandoverRls against its reference in 50 decimal digits, on touches with everything that a hand and a board do."""

from collections import Counter
from collections.abc import Callable
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
from palpate.reference import handover
from palpate.reference.noise import Noise
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
        "guard": st.sampled_from([0, 1, 5, 40]),
        "initial_ratio": st.sampled_from([2.5, -4.0]),
        "initial_covariance": st.sampled_from([1.0, 1e4]),
        "max_covariance": st.sampled_from([1e4, 1e6]),
    },
).filter(lambda s: s.get("initial_covariance", 1e10) <= s.get("max_covariance", 1e12))


def exactly(output: Any, regressor: Any, **chosen: Any) -> reference.HandoverTrace:
    with localcontext(prec=50):
        decimals = [np.array([Decimal(v) for v in values.tolist()]) for values in (output, regressor)]
        return reference.handover_rls(*decimals, number=Decimal, **chosen)


@examples(250, 5000)
@given(hands, tuning)
def test_the_core_is_the_reference(tally: Tally, hand: Hand, chosen: dict[str, float]) -> None:
    """Only the core rounds: 1e-10 is 5e5 eps, for what cancels; in the standard error correlations near 1 do, twice.

    The covariance of a drift depends on what its offset has above the allowed one, in units of a roughness of 1e-4: a
    difference of numbers near 2 that are 1e-12 off, 1e-11 with the mean of 31, in each of up to a hundred samples: 1e-9.
    The statistic sums up to 160 whitened innovations, each an eps or two of the output off, in units of a scale that is
    1e-4 of the output at least: 160 * 2 * 2e-16 / 1e-4 = 7e-10, and with what the ratio is off 1e-9.
    """
    tally.count("touches against the reference of HandoverRls")
    output, regressor = hand.samples()
    exact = exactly(output, regressor, **chosen)
    rows = palpate.HandoverRls(**chosen).trace(output, regressor)
    assert rows["alarm"].tolist() == exact.alarm.tolist()
    for name in FIELDS:
        right = getattr(exact, name).astype(float)
        allowed = (1e-8 if name in {"standard_error", "covariance"} else 1e-10) * (
            np.abs(right) + {"innovation": np.abs(output), "statistic": 10.0}.get(name, 0.0)
        )
        assert np.array_equal(np.isnan(rows[name]), np.isnan(right)), name
        assert (np.abs(rows[name] - right)[~np.isnan(right)] <= allowed[~np.isnan(right)]).all(), name
    if chosen or hand.reversal:
        return
    off = np.abs(rows["ratio"] / exact.ratio.astype(float) - 1).max() / np.finfo(float).eps
    tally.note("deviation of HandoverRls from its reference in a touch, eps of float64, ratio", float(off))


@pytest.mark.parametrize(
    ("branch", "hand"),
    [
        ("handed over", Hand(0, step=0.3)),
        ("drift", Hand(0, drift=0.05)),
        ("outlier in a drift", Hand(0, drift=2.0, spikes=8)),
        ("outlier", Hand(0, spikes=3)),
        ("long-run variance of AR(1)", Hand(0)),
        ("long-run variance of AR(2)", Hand(0, tone=0.01)),
        ("least squares", Hand(0, reversal=True)),
    ],
)
def test_the_examples_reach_every_branch(branch: str, hand: Hand, monkeypatch: pytest.MonkeyPatch) -> None:
    """A drawn touch that takes none of them would prove nothing about it."""
    reached: Counter[str] = Counter()

    def counted(kind: Any, method: str, name: Callable[..., str | None]) -> None:
        original = getattr(kind, method)

        def spy(self: Any, *arguments: Any) -> Any:
            result = original(self, *arguments)
            reached[name(self, result, *arguments) or "none of them"] += 1
            return result

        monkeypatch.setattr(kind, method, spy)

    def form(noise: Any, result: Any) -> str:
        first_order = noise.lag0 / noise.weight * (1 + noise.rho) / (1 - noise.rho)
        return f"long-run variance of AR({1 if result == first_order else 2})"

    counted(handover._Handover, "_hand_over", lambda *_: "handed over")
    counted(Noise, "least_share", lambda *_: "drift")
    counted(Noise, "add_outlier", lambda noise, *_: "outlier in a drift" if noise.drifts() else None)
    counted(handover._Handover, "_learn", lambda _s, _r, _e, _clipped, outlier: "outlier" if outlier else None)
    counted(handover._Handover, "_follow", lambda _s, _r, w, x, _e: "least squares" if w == x else None)
    counted(Noise, "long_run_variance", form)
    output, regressor = hand.samples()
    exact = reference.handover_rls(output, regressor)
    assert reached[branch] > (1 if branch == "least squares" else 0)  # the first sample is one always
    rows = palpate.HandoverRls().trace(output, regressor)
    assert rows["alarm"].tolist() == exact.alarm.tolist()
    assert np.allclose(rows["ratio"], exact.ratio, rtol=1e-10, atol=0)


def test_an_empty_touch_has_an_empty_trace() -> None:
    assert reference.handover_rls([], []).ratio.shape == (0,)
    with pytest.raises(ValueError, match="not finite"):
        reference.handover_rls([np.nan], [1.0])
