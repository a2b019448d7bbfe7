"""The core against the paper's equations in 60 decimal digits, and the equations against a closed form."""

from decimal import Decimal, localcontext
from math import inf
from typing import Any

import numeric
import numpy as np
import palpate
import pytest
from hypothesis import given
from measure import deviation, rounding_bounds
from palpate import reference

ESTIMATORS: dict[Any, Any] = {np.float64: palpate.AdaptiveRls, np.float32: palpate.AdaptiveRls32}


def exactly(output: list[float], regressor: list[float], **settings: float) -> reference.Trace:
    """Run the reference in 60 digits: its own rounding is then far below any float's."""
    with localcontext(prec=60):
        return reference.adaptive_rls(
            np.array([Decimal(v) for v in output]),
            np.array([Decimal(v) for v in regressor]),
            number=Decimal,
            **settings,
        )


def unlimited(exact: reference.Trace, k: int, drift: float) -> Decimal:
    """Return g(k) before the maximum with 0, which hides by how much it is below."""
    before = exact.statistic[k - 1] if k else Decimal(0)
    return Decimal(before + abs(exact.innovation[k]) - Decimal(drift))


def check(
    kind: Any,
    samples: tuple[list[float], list[float]],
    settings: dict[str, float],
    most_eps: float = inf,
) -> int:
    """Compare the core with the reference at every sample, up to the first at which rounding may decide the alarm."""
    output, regressor = samples
    exact = exactly(output, regressor, **settings)
    drift = settings["drift"]
    initial_ratio = settings["initial_ratio"]
    bounds = rounding_bounds(exact, regressor, drift=drift, initial_ratio=initial_ratio, kind=kind)
    rows = ESTIMATORS[kind](**settings).trace(output, regressor)
    for k, row in enumerate(rows):
        limit = settings["clear_level" if k and exact.alarm[k - 1] else "threshold"]
        if abs(unlimited(exact, k, drift) - Decimal(limit)) <= bounds["statistic"][k]:
            return k
        assert row["alarm"] == exact.alarm[k]
        for name, bound in bounds.items():
            value = float(row[name])
            right = getattr(exact, name)[k]
            assert abs(float(Decimal(value) - right)) <= bound[k], (k, name, value, right)
            assert name not in ("ratio", "covariance") or deviation(value, right, kind) <= most_eps
    return len(rows)


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_any_samples_stay_within_the_rounding_bound(kind: Any) -> None:
    width = np.dtype(kind).itemsize * 8
    compared = []

    @given(numeric.any_samples(width), numeric.adaptive_settings(width))
    def run(samples: tuple[list[float], list[float]], settings: dict[str, float]) -> None:
        compared.append((check(kind, samples, settings), len(samples[0])))

    run()
    # Few examples may be cut short by an alarm that rounding decides, or the comparison would be empty.
    assert sum(done for done, _ in compared) > 0.8 * sum(size for _, size in compared)


@pytest.mark.parametrize("kind", ESTIMATORS)
def test_a_touch_stays_within_16_eps(kind: Any) -> None:
    # The defaults, exact in the type.
    settings = {name: float(kind(v)) for name, v in palpate.AdaptiveRls().settings.items()}

    @given(numeric.touch_samples(np.dtype(kind).itemsize * 8))
    def run(samples: tuple[list[float], list[float]]) -> None:
        check(kind, samples, settings, most_eps=16)

    run()


def test_the_reference_is_weighted_least_squares() -> None:
    """With one lambda, r(n) minimises sum lambda^(n-k) (C1 - C2 r)^2 + lambda^n (r - r(0))^2 / P(0)."""
    random = np.random.default_rng(3)
    regressor = random.uniform(0.1, 1, 50)
    output = 2.5 * regressor + 0.01 * random.standard_normal(50)
    weights = 0.97 ** np.arange(49, -1, -1)
    prior = 0.97**50 / 100
    information = weights @ regressor**2 + prior
    expected = (weights @ (regressor * output) + prior * 1.5) / information
    settings = {"initial_ratio": 1.5, "initial_covariance": 100.0}
    trace = reference.rls(output, regressor, forgetting=0.97, **settings)
    # 50 steps of the printed form, whose subtraction costs P x^2 <= 100 times eps each.
    assert trace.ratio[-1] == pytest.approx(expected, rel=50 * 100 * 2.3e-16)
    assert 1 / trace.covariance[-1] == pytest.approx(information, rel=50 * 100 * 2.3e-16)
    assert palpate.Rls(forgetting=0.97, **settings).process(output, regressor)[-1] == pytest.approx(
        expected, rel=1e-14
    )


def test_the_reference_follows_the_paper_by_hand() -> None:
    """Two samples worked out from PAPER's equations: lambda 0.995, then 0.9 as g = 0.24 + 0.01... > h."""
    trace = reference.adaptive_rls(
        [1.0, 1.5], [0.5, 0.5], initial_ratio=1.0, initial_covariance=4.0
    )
    first_gain = 4 * 0.5 / (0.9 + 0.25 * 4)  # |e| = 0.5, g = 0.49 > 0.05: the alarm is on at once
    first_ratio = 1 + first_gain * 0.5
    first_covariance = (4 - 4 * 0.25 * 4 / (0.9 + 0.25 * 4)) / 0.9
    second = 1.5 - 0.5 * first_ratio
    second_gain = first_covariance * 0.5 / (0.9 + 0.25 * first_covariance)
    assert trace.alarm.tolist() == [True, True]
    assert trace.statistic == pytest.approx([0.49, 0.49 + abs(second) - 0.01], rel=1e-14)
    assert trace.ratio == pytest.approx(
        [first_ratio, first_ratio + second_gain * second], rel=1e-14
    )
