"""Repeatability: a published example, published intervals, and the cases at the edge."""

import math

import numpy as np
import pytest
from effort import draws
from palpate.report.anova import one_way_anova

# Shrout and Fleiss (1979), Table 2: six targets, four judges.
SHROUT_FLEISS = [
    [9, 2, 5, 8],
    [6, 1, 3, 2],
    [8, 4, 6, 8],
    [7, 1, 2, 6],
    [10, 5, 6, 9],
    [6, 2, 4, 7],
]


def test_the_example_of_shrout_and_fleiss() -> None:
    """Their Table 3 has BMS 11.24 and WMS 6.26, their Table 4 ICC(1,1) = .17.

    The interval is the one that R's psych::ICC prints for these data, -0.133 to 0.72 (F = 1.8 with 5 and 18 degrees of
    freedom), by the formula in Shrout and Fleiss, and in McGraw and Wong (1996), Table 7.
    """
    found = one_way_anova(SHROUT_FLEISS)
    assert (found.specimens, found.touches, found.within_freedom, found.per_specimen) == (
        6,
        24,
        18,
        4,
    )
    assert round(found.between, 2) == 11.24
    assert round(found.within, 2) == 6.26
    assert round(found.icc, 2) == 0.17
    assert (round(found.low, 3), round(found.high, 2)) == (-0.133, 0.72)
    assert found.error == pytest.approx(6.26**0.5, rel=1e-3)
    assert found.detectable() == pytest.approx(1.96 * 2**0.5 * found.error)
    assert found.detectable(4) == pytest.approx(found.detectable() / 2)


def test_the_estimate_and_its_interval_hold_in_unbalanced_designs() -> None:
    """Between variance 4, within 1: ICC 0.8. The interval is approximate there; its coverage is printed.

    Of n intervals that hold with 95 % the share has a standard deviation of sqrt(0.0475 / n): 5 of them, and 1 % for the
    approximation.
    """
    random = np.random.default_rng(1)
    sizes = (2, 6, 3, 4, 4, 5, 2, 4)
    count = draws(2000)
    held = 0
    within = []
    between = []
    for _ in range(count):
        groups = [random.normal(random.normal(0, 2), 1, size).tolist() for size in sizes]
        found = one_way_anova(groups)
        held += found.low <= 0.8 <= found.high
        within.append(found.within)
        between.append((found.between - found.within) / found.per_specimen)
    assert abs(held / count - 0.95) < 5 * (0.0475 / count) ** 0.5 + 0.01
    # both estimates of a variance have no bias
    for values, true in ((within, 1.0), (between, 4.0)):
        assert abs(np.mean(values) - true) < 5 * np.std(values) / count**0.5


@pytest.mark.parametrize(
    ("groups", "freedom", "error", "icc"),
    [
        # specimens differ by less than their touches scatter
        ([[0.0, 1.0], [1.1, 0.0], [0.1, 0.9]], 3, 0.689, -0.993),
        ([[1.0, 1.1, 0.9]], 2, 0.1, math.nan),
        ([[1.0, 1.0], [2.0, 2.0], []], 2, 0.0, 1.0),
        ([[1.0]], 0, math.nan, math.nan),
    ],
)
def test_what_cannot_be_known_is_nan(
    groups: list[list[float]], freedom: int, error: float, icc: float
) -> None:
    found = one_way_anova(groups)
    assert found.within_freedom == freedom
    assert (found.error, found.icc) == pytest.approx((error, icc), abs=0.01, nan_ok=True)
    for name, value in {"error": error, "icc": icc, "low": icc, "high": icc}.items():
        assert (found.as_dict()[name] is None) == math.isnan(value), name
