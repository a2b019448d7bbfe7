"""The exponents that repeated touches leave open, and the slope of the ratio against the depth."""

from random import Random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.calibration.evidence import EXPONENTS, TouchEvidence, evidence_of
from palpate.calibration.exponent_fits import (
    FEWEST,
    POSSIBLE,
    ExponentFit,
    depth_slope,
    scatter_evidence,
    weighted,
)
from palpate.calibration.fit import CurveFit
from palpate.calibration.ranges import BEND
from palpate.uncertainty import LEVEL_SCATTER
from scipy.stats import chi2, f
from tilted_touch import tilted_touch

Group = list[TouchEvidence]
Drawn = list[list[tuple[float, float]]]
CURVE = CurveFit(np.array([10.0, 0.7, 1.0]), np.zeros((3, 3)), 1e-5, 20, 0.0, 4, 0.0, 1.0)
GROUPS = st.lists(
    st.lists(st.tuples(st.floats(-0.05, 0.05), st.floats(-0.01, 0.01)), min_size=1, max_size=4),
    min_size=1,
    max_size=4,
)


def evidence(ratio: float, tilt: float, exponent: float) -> TouchEvidence:
    return evidence_of(tilted_touch(ratio, tilt, exponent=exponent), "level", EXPONENTS)


def groups_of(
    random: np.random.Generator,
    exponent: float,
    tilt: float,
    *,
    objects: int = 5,
    touches: int = 4,
    scatter: float = 0.0,
) -> list[Group]:
    """Return touches on some objects, with tilts of this rms, and a scatter for another reason."""
    groups = []
    for ratio in np.linspace(1.5, 8.0, objects):
        group = []
        for _ in range(touches):
            own = ratio * np.exp(scatter * random.standard_normal())
            group.append(evidence(own, tilt * random.standard_normal(), exponent))
        groups.append(group)
    return groups


def drawn(values: Drawn) -> list[Group]:
    """Return groups of touches with these tilts and deviations."""
    groups = []
    for number, group in enumerate(values):
        ratio = 2.0 + number
        groups.append([evidence(ratio * np.exp(away), tilt, 1.2) for tilt, away in group])
    return groups


# The scatter


def test_level_touches_show_nothing() -> None:
    """Tilts of .1 % cost up to .1 % at a wrong exponent: far below the scatter of a level ratio."""
    found = scatter_evidence(groups_of(np.random.default_rng(1), 1.5, 0.001), 1.0)
    assert found.tolist() == [0.0] * len(EXPONENTS)


@pytest.mark.parametrize("place", [0, 2, 5])
def test_tilted_touches_show_their_exponent(place: int) -> None:
    """Tilts of 3 % scatter by 2.5 % at the other end of the range: 4 times what is assumed."""
    groups = groups_of(np.random.default_rng(2), float(EXPONENTS[place]), 0.03)
    found = scatter_evidence(groups, 1.0)
    assert np.argmax(found) == place
    assert found[place] == 0
    assert found[0 if place > 2 else -1] < POSSIBLE


def test_it_is_the_likelihood_of_the_scatter() -> None:
    """Of Gaussian errors whose variance is estimated, with the least scatter of a level ratio."""
    groups = groups_of(np.random.default_rng(3), 1.5, 0.03)
    error = 2e-3
    groups = [[touch._replace(standard_error=error) for touch in group] for group in groups]
    found = scatter_evidence(groups, 0.5)
    freedom = sum(len(group) - 1 for group in groups)
    for number in range(len(EXPONENTS)):
        variances = []
        for place in (number, len(EXPONENTS) - 1):
            logs = [[touch.log_ratio[place] for touch in group] for group in groups]
            pooled = sum(np.var(group) * len(group) for group in logs) / freedom
            variances.append(pooled + (0.5 * error) ** 2 + LEVEL_SCATTER**2)
        expected = -freedom / 2 * np.log(variances[0] / variances[1])
        assert found[number] == pytest.approx(expected, rel=1e-9)


def test_a_small_difference_of_the_scatter_is_no_evidence() -> None:
    """Below the 99 % quantile of F; just above it the least likely exponent is excluded."""
    for tilt, is_shown in ((0.010, False), (0.012, True)):
        groups = groups_of(np.random.default_rng(2), 1.5, tilt)
        freedom = sum(len(group) - 1 for group in groups)
        logs = np.array([[touch.log_ratio for touch in group] for group in groups])
        squares = ((logs - logs.mean(axis=1, keepdims=True)) ** 2).sum(axis=(0, 1))
        variances = squares / freedom + 1e-6 + LEVEL_SCATTER**2
        quantile = f.ppf(0.99, freedom, freedom)
        assert (variances.max() / variances.min() > quantile) is np.bool_(is_shown)
        assert scatter_evidence(groups, 1.0).any() is np.bool_(is_shown)


def test_the_true_exponent_is_rarely_excluded() -> None:
    """In 200 sessions of a hand whose level ratios scatter as assumed: at most 5 % and 3 errors."""
    random = np.random.default_rng(4)
    excluded = 0
    shown = 0
    for _ in range(200):
        found = scatter_evidence(groups_of(random, 1.2, 0.06, scatter=LEVEL_SCATTER), 1.0)
        excluded += int(found[2] < POSSIBLE)
        shown += int(found.any())
    assert shown > 100
    assert excluded <= 200 * 0.05 + 3 * (200 * 0.05 * 0.95) ** 0.5


def test_the_limit_is_that_of_wilks() -> None:
    assert pytest.approx(-chi2.ppf(0.95, 1) / 2, abs=0.005) == POSSIBLE
    assert ExponentFit(1.0, CURVE, log_weight=POSSIBLE).is_possible
    assert not ExponentFit(1.0, CURVE, log_weight=POSSIBLE - 1e-9).is_possible


def test_too_few_touches_show_nothing() -> None:
    random = np.random.default_rng(5)
    few = groups_of(random, 1.5, 0.05, objects=1, touches=FEWEST)
    enough = groups_of(random, 1.5, 0.05, objects=1, touches=FEWEST + 1)
    single = groups_of(random, 1.5, 0.05, objects=9, touches=1)
    assert not scatter_evidence(few, 1.0).any()
    assert scatter_evidence(enough, 1.0).any()
    assert not scatter_evidence(single, 1.0).any()


@given(GROUPS, st.randoms(use_true_random=False))
def test_the_order_of_touches_and_objects_does_not_matter(values: Drawn, order: Random) -> None:
    groups = drawn(values)
    expected = scatter_evidence(groups, 1.0)
    for group in groups:
        order.shuffle(group)
    order.shuffle(groups)
    np.testing.assert_allclose(scatter_evidence(groups, 1.0), expected, rtol=1e-9, atol=1e-9)


@given(GROUPS, st.floats(-1.0, 1.0))
def test_a_common_factor_of_an_object_does_not_matter(values: Drawn, shift: float) -> None:
    """Rounding of the mean of a group: 1e-16 of variances of at least 1e-5."""
    groups = drawn(values)
    expected = scatter_evidence(groups, 1.0)
    groups[0] = [touch._replace(log_ratio=touch.log_ratio + shift) for touch in groups[0]]
    np.testing.assert_allclose(scatter_evidence(groups, 1.0), expected, rtol=1e-7, atol=1e-7)


@given(GROUPS)
def test_the_likeliest_exponent_has_0(values: Drawn) -> None:
    found = scatter_evidence(drawn(values), 1.0)
    assert found.max() == 0
    assert len(found) == len(EXPONENTS)


# Weights


def test_evidence_adds_up() -> None:
    fits = [ExponentFit(exponent, CURVE) for exponent in (1.0, 1.2, 1.5)]
    first = weighted(fits, np.array([-1.0, -3.0, -2.0]))
    assert [fit.log_weight for fit in first] == [0.0, -2.0, -1.0]
    second = weighted(first, np.array([-2.5, 0.0, -1.0]))
    assert [fit.log_weight for fit in second] == pytest.approx([-0.5, 0.0, 0.0])
    assert [fit.contact_exponent for fit in second] == [1.0, 1.2, 1.5]
    assert [fit.is_possible for fit in first] == [True, False, True]


# The depth


def scene_of_depths(
    random: np.random.Generator, slope: float, noise: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    specimen = np.repeat(np.arange(6), 4)
    depths = random.uniform(0.5, 1.5, 24)
    logs = specimen * 0.3 + slope * depths + noise * random.standard_normal(24)
    return logs, depths, specimen


def test_the_slope_within_its_error() -> None:
    """Of 100 slopes from the assumed spread, 95 are within 2 errors; 6 of them may not be."""
    random = np.random.default_rng(6)
    within = 0
    errors = []
    for _ in range(100):
        true = BEND * random.standard_normal()
        logs, depths, specimen = scene_of_depths(random, true, 0.003)
        found, error = depth_slope(logs, np.full(24, 1e-7), depths, specimen)
        within += abs(found - true) < 2 * error
        errors.append(error)
    assert within >= 89
    assert np.median(errors) < BEND / 2


def test_without_depths_the_slope_is_that_of_before() -> None:
    logs, depths, specimen = scene_of_depths(np.random.default_rng(7), 0.05, 0.003)
    variances = np.full(24, 1e-6)
    depths[3] = np.nan
    assert depth_slope(logs, variances, depths, specimen) == (0.0, BEND)


def test_equal_depths_show_no_slope() -> None:
    logs, _, specimen = scene_of_depths(np.random.default_rng(8), 0.05, 0.003)
    found, error = depth_slope(logs, np.full(24, 1e-6), np.ones(24), specimen)
    assert found == 0
    assert error == pytest.approx(BEND)


def test_one_touch_for_each_object_shows_no_slope() -> None:
    depths = np.linspace(0.5, 1.5, 5)
    found, error = depth_slope(np.arange(5.0), np.full(5, 1e-6), depths, np.arange(5))
    assert found == 0
    assert error == pytest.approx(BEND)
