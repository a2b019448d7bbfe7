"""The ratio of a touch at each exponent: derived from one level ratio and the hold."""

from collections.abc import Callable
from math import hypot, isnan, log, nan

import numpy as np
import palpate
import pytest
from example_touch import example_touch
from hypothesis import given
from hypothesis import strategies as st
from palpate.calibration.evidence import (
    EXPONENTS,
    OF_GROWTH,
    evidence_of,
    mean_evidence,
    tilt_growth,
)
from palpate.repeatability import MOST_TILTED, is_too_oblique
from tilted_touch import growth, tilted_touch

from bench.accuracy.other_probe import Way, touch

PLACES = {1.0: 0, 1.5: len(EXPONENTS) - 1}
TILTS = st.floats(-0.2, 0.2)
RATIOS = st.floats(1.05, 9.5)


# On another simulator


@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_derived_level_ratio_is_the_one_that_is_tracked(exponent: float) -> None:
    """The tracker has two exponents: each level ratio is derived from the other one.

    The difference is within 3 standard deviations: of both level ratios, and of the growth.
    """
    largest = 0.0
    for seed, angle in enumerate((-1.0, -0.6, -0.3, 0.3, 0.6, 1.0)):
        recording = touch(Way(exponent=exponent, angle=angle, hold=6.5), seed)
        flat = palpate.touches(recording, contact_exponent=1.0)[0]
        domes = palpate.touches(recording, contact_exponent=1.5)[0]
        for measured, other in ((flat, domes), (domes, flat)):
            place = PLACES[other.contact_exponent]
            evidence = evidence_of(measured, "level", EXPONENTS)
            difference = evidence.log_ratio[place] - log(other.level_ratio)
            of_growth = OF_GROWTH * evidence.derived[place]
            own = measured.level_standard_error / measured.level_ratio
            others = other.level_standard_error / other.level_ratio
            assert abs(difference) < 3 * hypot(of_growth, own, others)
            largest = max(largest, abs(evidence.derived[place]) / hypot(of_growth, own, others))
    assert largest > 3  # a ratio that is not derived would be outside


def test_the_exponent_of_a_touch_is_that_of_the_simulator() -> None:
    """At the true exponent of the contact a tilted probe has the ratio of a level one."""
    for exponent, place in PLACES.items():
        for angle in (-0.6, 0.6):
            way = Way(exponent=exponent, angle=angle, hold=6.5)
            found = palpate.touches(touch(way, 4), contact_exponent=1.5)[0]
            log_ratio = evidence_of(found, "level", EXPONENTS).log_ratio
            away = abs(log_ratio - log(way.ratio))
            assert away[place] < 0.01
            assert abs(np.argmin(away) - place) <= 1
            assert max(away) > 0.01


# By its equations


@given(RATIOS, TILTS, st.sampled_from(EXPONENTS.tolist()), st.sampled_from([1.0, 1.5]))
def test_a_touch_has_its_true_ratio_at_its_exponent(
    ratio: float, tilt: float, exponent: float, measured: float
) -> None:
    """Sums of a few logarithms: 1e-13."""
    found = evidence_of(
        tilted_touch(ratio, tilt, exponent=exponent, measured=measured), "level", EXPONENTS
    )
    place = int(np.flatnonzero(exponent == EXPONENTS)[0])
    assert found.tilt == pytest.approx(tilt, abs=1e-13)
    assert found.log_ratio[place] == pytest.approx(log(ratio), abs=1e-13)
    own = PLACES[measured]
    assert found.derived[own] == pytest.approx(0.0, abs=1e-13)
    assert found.log_ratio[own] == pytest.approx(
        log(ratio) + tilt * (growth(exponent) - growth(measured)), abs=1e-13
    )
    np.testing.assert_allclose(
        found.log_ratio, found.log_ratio[own] + found.derived, rtol=0, atol=1e-13
    )


@given(RATIOS, TILTS)
def test_the_hold_does_not_depend_on_the_exponent(ratio: float, tilt: float) -> None:
    one = tilted_touch(ratio, tilt)
    found = evidence_of(one, "hold", EXPONENTS)
    assert (found.log_ratio == log(one.ratio)).all()
    assert not found.derived.any()
    assert found.standard_error == pytest.approx(1e-3)


def test_the_depth_is_of_both_channels() -> None:
    found = evidence_of(tilted_touch(4.0, 0.02, depth_pF=0.7, rise_s=0.4), "level", EXPONENTS)
    assert found.depth_pF == pytest.approx(0.7)
    assert found.rise_s == 0.4


def test_a_tilt_of_the_hold_counts_if_it_is_significant() -> None:
    """The level ratio that shows it has an error of .1 %; tilt(1.5) = 1.85 tilt(1)."""
    assert evidence_of(tilted_touch(4.0, 0.0009), "hold", EXPONENTS).tilt == 0
    assert evidence_of(tilted_touch(4.0, 0.003), "hold", EXPONENTS).tilt == pytest.approx(0.003)
    assert evidence_of(tilted_touch(4.0, 0.0009), "level", EXPONENTS).tilt == pytest.approx(0.0009)
    assert isnan(evidence_of(example_touch(), "hold", EXPONENTS).tilt)


def test_an_unknown_standard_error_counts_as_0() -> None:
    unknown = example_touch(standard_error=nan)
    assert evidence_of(unknown, "hold", EXPONENTS).standard_error == 0


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("hold", {"ratio": -0.1}),
        ("hold", {"ratio": nan}),
        ("level", {"ratio": -0.1, "level_ratio": 4.0}),
        ("level", {"ratio": 4.0}),
    ],
)
def test_a_touch_without_a_ratio_is_refused(kind: str, values: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=r"ratios: got (nan|-0.1), allowed: positive numbers"):
        evidence_of(example_touch(**values), kind, EXPONENTS)


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_touch_of_one_bump_is_too_oblique(sign: int) -> None:
    """It is the tilt of the measured level ratio that counts."""
    limit = sign * MOST_TILTED / growth(1.5)
    assert is_too_oblique(tilted_touch(4.0, 1.001 * limit))
    assert not is_too_oblique(tilted_touch(4.0, 0.999 * limit))


@pytest.mark.parametrize(
    "touch_without",
    [lambda: example_touch(), lambda: example_touch(ratio=-1.0, level_ratio=4.0)],
)
def test_without_both_ratios_a_touch_is_not_too_oblique(
    touch_without: Callable[[], palpate.Touch],
) -> None:
    assert not is_too_oblique(touch_without())


def test_the_growth_is_that_of_the_docstring() -> None:
    np.testing.assert_allclose(tilt_growth(EXPONENTS), [growth(one) for one in EXPONENTS])


# Means


@given(st.lists(st.tuples(RATIOS, TILTS), min_size=1, max_size=5))
def test_a_mean_with_equal_weights(values: list[tuple[float, float]]) -> None:
    each = [evidence_of(tilted_touch(*value), "level", EXPONENTS) for value in values]
    found = mean_evidence(each, np.ones(len(each)))
    assert found.touches == pytest.approx(len(each))
    np.testing.assert_allclose(found.log_ratio, np.mean([one.log_ratio for one in each], axis=0))
    assert found.tilt == pytest.approx(np.mean([one.tilt for one in each]))
    assert found.standard_error == pytest.approx(1e-3 / len(each) ** 0.5)


def test_a_mean_with_one_weight_is_that_touch() -> None:
    each = [evidence_of(tilted_touch(ratio, 0.01), "level", EXPONENTS) for ratio in (3.0, 5.0)]
    found = mean_evidence(each, np.array([0.0, 2.0]))
    assert found.touches == 1
    np.testing.assert_array_equal(found.log_ratio, each[1].log_ratio)
    assert found.depth_pF == each[1].depth_pF
