"""How a touch differs from those that calibrated, and the cost of it."""

from math import hypot, inf, log, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.calibration.evidence import EXPONENTS, OF_GROWTH, TouchEvidence, evidence_of
from palpate.calibration.ranges import BEND, DifferenceErrors, Range, Ranges, differences_of
from tilted_touch import growth, tilted_touch

KNOWN = Ranges(tilt=0.01, depth_pF=Range(0.5, 1.5), rise_s=Range(0.2, 0.5), middle_pF=1.0)
SLOPE_ERROR = 0.002
LAST = len(EXPONENTS) - 1


def evidence(
    tilt: float = 0.0, *, depth_pF: float = 1.0, rise_s: float = 0.3, kind: str = "level"
) -> TouchEvidence:
    one = tilted_touch(4.0, tilt, error=1e-9, depth_pF=depth_pF, rise_s=rise_s)
    return evidence_of(one, kind, EXPONENTS)


def cost(
    touch: TouchEvidence, ranges: Ranges = KNOWN, *, number: int = LAST, kind: str = "level"
) -> DifferenceErrors:
    exponent = float(EXPONENTS[number])
    return differences_of(touch, number, exponent, ranges, kind=kind, depth_slope_error=SLOPE_ERROR)


# Ranges


@given(st.floats(-10, 10), st.floats(0, 10), st.floats(-30, 30))
def test_beyond_is_the_distance_from_the_nearest_end(
    low: float, width: float, value: float
) -> None:
    found = Range(low, low + width).beyond(value)
    if low <= value <= low + width:
        assert found == 0
    else:
        nearest = min((low, low + width), key=lambda end: abs(end - value))
        assert found == value - nearest


def test_an_unknown_range_has_no_outside() -> None:
    assert Range().beyond(3.0) == 0
    assert Range(1.0, 2.0).beyond(nan) == 0
    assert not Range(1.0, nan).is_known
    assert not Range.of([1.0, nan]).is_known
    assert not Range.of([1.0, inf]).is_known
    assert Range.of([2.0, 1.0, 3.0]) == (1.0, 3.0)


def test_ranges_of_touches() -> None:
    tilts = np.linspace(-0.02, 0.018, 20)
    touches = [
        evidence(tilt, depth_pF=0.5 + 0.05 * number, rise_s=0.2 + 0.01 * number)
        for number, tilt in enumerate(tilts)
    ]
    found = Ranges.of(touches)
    assert found.tilt == pytest.approx(np.quantile(abs(tilts), 0.9))
    assert found.depth_pF == pytest.approx((0.5, 1.45))
    assert found.rise_s == pytest.approx((0.2, 0.39))
    assert found.middle_pF == pytest.approx(0.975)
    assert found.unknown == []


def test_a_touch_without_a_value_makes_its_range_unknown() -> None:
    touches = [evidence(0.01), evidence(0.01)._replace(tilt=nan)]
    assert Ranges.of(touches).unknown == ["tilt"]
    touches[1] = touches[0]._replace(depth_pF=nan, rise_s=nan)
    assert Ranges.of(touches).unknown == ["depth", "rise"]
    assert Ranges().unknown == ["tilt", "depth", "rise"]


@pytest.mark.parametrize(
    ("touch", "expected"),
    [
        (evidence(0.005), []),
        (evidence(0.0179), []),
        (evidence(0.0181), ["held more obliquely than in the calibration"]),
        (evidence(-0.0181), ["held more obliquely than in the calibration"]),
        (evidence(depth_pF=1.94), []),
        (evidence(depth_pF=1.96), ["pressed deeper than in the calibration"]),
        (evidence(depth_pF=0.38), ["pressed more lightly than in the calibration"]),
        (evidence(rise_s=0.66), ["pressed more slowly than in the calibration"]),
        (evidence(rise_s=0.15), ["pressed faster than in the calibration"]),
        (
            evidence(0.03, depth_pF=3.0),
            [
                "held more obliquely than in the calibration",
                "pressed deeper than in the calibration",
            ],
        ),
    ],
)
def test_a_difference_is_a_sentence(touch: TouchEvidence, expected: list[str]) -> None:
    """1.5 times the usual tilt and .3 %; 1.3 times the ends of the other ranges."""
    assert KNOWN.differences(touch) == expected
    assert Ranges().differences(touch) == []


# Costs


def test_a_touch_like_those_that_calibrated_costs_its_tilt_and_depth_only() -> None:
    """2 % of the tilt, and the error of the slope at its distance from the median depth."""
    found = cost(evidence(0.008, depth_pF=1.2))
    assert found.tilt == pytest.approx(0.02 * 0.008 * growth(1.5))
    assert found.depth == pytest.approx(SLOPE_ERROR * 0.2)
    assert found.rise == 0
    assert found.contact_exponent == pytest.approx(0.0, abs=1e-15)


def test_what_exceeds_the_usual_tilt_costs_more() -> None:
    """A further 5 % of it; of the ratio of the hold all of it."""
    by_level = cost(evidence(-0.03)).tilt / growth(1.5)
    assert by_level == pytest.approx(-hypot(0.02 * 0.03, 0.05 * 0.02))
    by_hold = cost(evidence(-0.03, kind="hold"), number=0, kind="hold").tilt
    assert by_hold == pytest.approx(-0.02)
    assert cost(evidence(0.009, kind="hold"), number=0, kind="hold").tilt == 0


def test_a_ratio_at_another_exponent_has_the_error_of_the_growth() -> None:
    """It is away from the measured ratio by tilt(1.5) - tilt(1) = .85 tilt."""
    found = cost(evidence(0.008), number=0)
    assert found.contact_exponent == pytest.approx(OF_GROWTH * 0.85 * 0.008)


@pytest.mark.parametrize(("depth_pF", "beyond"), [(2.5, 1.0), (0.2, -0.3)])
def test_a_depth_outside_has_the_bend_of_the_gauges(depth_pF: float, beyond: float) -> None:
    found = cost(evidence(depth_pF=depth_pF)).depth
    expected = hypot(SLOPE_ERROR * (depth_pF - 1.0), BEND * beyond)
    assert found == pytest.approx(np.copysign(expected, beyond))


@pytest.mark.parametrize(("rise_s", "factor"), [(1.0, 2.0), (0.1, 0.5)])
def test_another_speed_costs_by_the_logarithm(rise_s: float, factor: float) -> None:
    assert cost(evidence(rise_s=rise_s)).rise == pytest.approx(0.005 * log(factor))


def test_an_unknown_range_widens() -> None:
    touch = evidence(0.008, depth_pF=1.2)
    known = cost(touch)
    unknown = cost(touch, Ranges())
    assert unknown.tilt == pytest.approx(hypot(0.02, 0.05) * 0.008 * growth(1.5))
    assert unknown.depth == pytest.approx(SLOPE_ERROR * 1.2)
    assert abs(unknown.tilt) > abs(known.tilt)
    assert abs(unknown.depth) > abs(known.depth)


@given(st.floats(-0.1, 0.1), st.floats(1.0, 3.0), st.integers(0, LAST))
def test_a_larger_tilt_costs_more(tilt: float, factor: float, number: int) -> None:
    for kind in ("level", "hold"):
        small = cost(evidence(tilt, kind=kind), number=number, kind=kind).tilt
        large = cost(evidence(factor * tilt, kind=kind), number=number, kind=kind).tilt
        assert abs(large) >= abs(small) * (1 - 1e-12)
        assert large * tilt >= 0


@given(st.floats(0.0, 5.0), st.floats(0.0, 5.0))
def test_a_depth_farther_away_costs_more(first: float, second: float) -> None:
    near, far = sorted((first, second), key=lambda depth: abs(depth - 1.0))
    if (near - 1.0) * (far - 1.0) > 0:
        near_cost = cost(evidence(depth_pF=near)).depth
        assert abs(cost(evidence(depth_pF=far)).depth) >= abs(near_cost) * (1 - 1e-9)
