"""Repeatability: a published example, published intervals, and the cases at the edge."""

import math
from itertools import chain

import numpy as np
import pytest
from effort import draws
from palpate.report.repeatability import repeatability

# Shrout and Fleiss (1979), Table 2: six targets, four judges.
SHROUT_FLEISS = [[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]]


def test_the_example_of_shrout_and_fleiss() -> None:
    """Their Table 3 has BMS 11.24 and WMS 6.26, their Table 4 ICC(1,1) = .17.

    The interval is the one that R's psych::ICC prints for these data, -0.133 to 0.72 (F = 1.8 with 5 and 18 degrees of
    freedom), by the formula in Shrout and Fleiss, and in McGraw and Wong (1996), Table 7.
    """
    found = repeatability(SHROUT_FLEISS)
    assert (found.specimens, found.touches, found.within_freedom, found.per_specimen) == (6, 24, 18, 4)
    assert round(found.between, 2) == 11.24
    assert round(found.within, 2) == 6.26
    assert round(found.icc, 2) == 0.17
    assert (round(found.low, 3), round(found.high, 2)) == (-0.133, 0.72)
    assert found.error == pytest.approx(6.26**0.5, rel=1e-3)
    assert found.detectable() == pytest.approx(1.96 * 2**0.5 * found.error)
    assert found.detectable(4) == pytest.approx(found.detectable() / 2)


def test_the_shift_and_the_scale_of_the_values_change_nothing() -> None:
    moved = repeatability([[3.0 * value - 100.0 for value in group] for group in SHROUT_FLEISS])
    found = repeatability(SHROUT_FLEISS)
    assert (moved.icc, moved.low, moved.high) == pytest.approx((found.icc, found.low, found.high))
    assert moved.error == pytest.approx(3 * found.error)


def sums_of_squares(groups: list[list[float]]) -> tuple[float, float]:
    """Return those within and between groups, term by term."""
    whole = list(chain(*groups))
    mean = math.fsum(whole) / len(whole)
    means = [math.fsum(group) / len(group) for group in groups]
    within = math.fsum((value - m) ** 2 for group, m in zip(groups, means, strict=True) for value in group)
    return within, math.fsum(len(group) * (m - mean) ** 2 for group, m in zip(groups, means, strict=True))


def test_unbalanced_groups() -> None:
    groups = [[1.0, 1.2], [2.0, 2.1, 2.3, 1.9], [0.4], [3.0, 3.3, 2.9]]
    found = repeatability([*groups[:2], [], *groups[2:]])  # one without a value does not count
    within, between = sums_of_squares(groups)
    assert (found.specimens, found.touches, found.within_freedom) == (4, 10, 6)
    assert found.within == pytest.approx(within / 6)
    assert found.between == pytest.approx(between / 3)
    assert found.per_specimen == pytest.approx((10 - (4 + 16 + 1 + 9) / 10) / 3)
    assert found.low < found.icc < found.high < 1


def test_the_estimate_and_its_interval_hold_in_unbalanced_designs() -> None:
    """Between variance 4, within 1: ICC 0.8. The interval is approximate there; its coverage is told.

    Of n intervals that hold with 95 % the share has a standard deviation of sqrt(0.0475 / n): 5 of them, and 1 % for the
    approximation.
    """
    random = np.random.default_rng(1)
    sizes, count = (2, 6, 3, 4, 4, 5, 2, 4), draws(2000)
    held, within, between = 0, [], []
    for _ in range(count):
        groups = [random.normal(random.normal(0, 2), 1, size).tolist() for size in sizes]
        found = repeatability(groups)
        held += found.low <= 0.8 <= found.high
        within.append(found.within)
        between.append((found.between - found.within) / found.per_specimen)
    assert abs(held / count - 0.95) < 5 * (0.0475 / count) ** 0.5 + 0.01
    for values, true in ((within, 1.0), (between, 4.0)):  # both estimates of a variance have no bias
        assert abs(np.mean(values) - true) < 5 * np.std(values) / count**0.5


def test_negative_icc() -> None:
    found = repeatability([[0.0, 1.0], [1.1, 0.0], [0.1, 0.9]])
    assert found.icc < 0
    assert found.low < found.icc < found.high


def test_one_specimen_has_a_scatter_and_no_icc() -> None:
    found = repeatability([[1.0, 1.1, 0.9]])
    assert found.error == pytest.approx(0.1)
    assert math.isnan(found.icc)
    assert math.isnan(found.low)
    assert found.as_dict()["icc"] is None


def test_one_touch_each_has_no_scatter() -> None:
    found = repeatability([[1.0], [2.0], [3.0]])
    assert found.within_freedom == 0
    assert math.isnan(found.error)
    assert math.isnan(found.icc)
    one = repeatability([[1.0]])
    assert (one.touches, one.as_dict()["error"]) == (1, None)


def test_no_variance() -> None:
    alike = repeatability([[1.0, 1.0], [1.0, 1.0]])
    assert alike.error == 0
    assert math.isnan(alike.icc)
    apart = repeatability([[1.0, 1.0], [2.0, 2.0]])
    assert (apart.icc, apart.low, apart.high) == (1, 1, 1)


@pytest.mark.parametrize("groups", [[], [[]], [[1.0, math.nan]], [[math.inf], [1.0]]])
def test_values_that_are_refused(groups: list[list[float]]) -> None:
    with pytest.raises(ValueError, match="groups"):
        repeatability(groups)
