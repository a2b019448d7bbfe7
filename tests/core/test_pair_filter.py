"""Design of the filters that align the channels."""

import cmath
import math

import numpy as np
import palpate
import pytest
from palpate.pair_filter import PairFilter, matched_pair


def responses(found: PairFilter, f: float) -> tuple[complex, complex]:
    """Return the response of each filter, from its impulse response at the real times of its readings."""

    def at(t: float) -> complex:
        return cmath.exp(2j * math.pi * f * t * found.period_s)

    a1, b2 = found.hard_side, found.soft_side
    hard = (1 - 2 * a1) * at(0) + a1 * (at(-1) + at(1))
    soft = (0.5 - b2) * (at(-0.5) + at(0.5)) + b2 * (at(-1.5) + at(1.5))
    return hard, soft


def difference(found: PairFilter, f: float) -> float:
    """Return |A - B|."""
    hard, soft = responses(found, f)
    return abs(hard - soft)


@pytest.mark.parametrize("period_s", [0.01, 0.022, 0.026, 0.0315, 0.04])
def test_the_responses_differ_by_the_mismatch_and_a_constant_passes(period_s: float) -> None:
    found = matched_pair(period_s)
    assert max(abs(response - 1) for response in responses(found, 0.0)) < 1e-15
    differences = [difference(found, f) for f in np.linspace(3, 13, 2001)]
    assert np.sqrt(np.mean(np.square(differences))) == pytest.approx(found.mismatch, rel=0.01)
    # Linear interpolation of one channel differs by 1 - cos(w / 2): far more.
    interpolated = np.sqrt(np.mean([(1 - math.cos(math.pi * f * period_s)) ** 2 for f in np.linspace(3, 13, 2001)]))
    assert found.mismatch < 0.1 * interpolated


@pytest.mark.parametrize(("period_s", "prefix"), [(0.026, ""), (0.0315, "slow_")])
def test_the_constants_of_the_core_are_those_of_the_design(period_s: float, prefix: str) -> None:
    settings = palpate.Tracker("handheld").settings
    for name, value in matched_pair(period_s).settings.items():
        assert name.startswith(prefix + ("hard" if "hard" in name else "soft"))
        assert settings[name] == pytest.approx(value, abs=6e-6)


def test_no_other_coefficients_match_better() -> None:
    found = matched_pair(0.026)
    weights = [(f, 1.0 if f >= 3 else 0.3) for f in np.linspace(0.2, 13, 400)]

    def cost(a1: float, b2: float) -> float:
        other = PairFilter(0.026, a1, b2, 0.0)
        gain = (1 - 2 * a1) ** 2 + 2 * a1**2 + 2 * (0.5 - b2) ** 2 + 2 * b2**2
        return sum(w * difference(other, f) ** 2 for f, w in weights) / 400 + 1e-6 * gain

    best = cost(found.hard_side, found.soft_side)
    for a, b in [(1e-3, 0), (-1e-3, 0), (0, 1e-3), (0, -1e-3), (1e-3, 5e-4), (-1e-3, -5e-4)]:
        assert cost(found.hard_side + a, found.soft_side + b) > best


@pytest.mark.parametrize(
    ("period_s", "band", "message"),
    [(0.0, (0.2, 13), "period_s"), (0.05, (0.2, 13), "interpolates"), (math.nan, (0.2, 13), "period_s"),
     (0.026, (0.2, 40), "the pair rate"), (0.026, (5, 3), "band_Hz")],
)  # fmt: skip
def test_what_does_not_fit_is_refused(period_s: float, band: tuple[float, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        matched_pair(period_s, band_Hz=band)
