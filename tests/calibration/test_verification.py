"""A known specimen compared with a calibration: its probability, its sentence, its table."""

from dataclasses import replace
from math import exp, inf, log, nan

import numpy as np
import pytest
from example_touch import example_touch
from hypothesis import given
from hypothesis import strategies as st
from palpate import Calibration, Touch
from palpate.calibration.calibration_verification import (
    DOUBT,
    CalibrationVerification,
    compare,
)
from palpate.calibration.evidence import EXPONENTS, evidence_of
from palpate.calibration.fit import CurveFit
from palpate.calibration.interval import MeasuredRatio
from palpate.calibration.modulus import Modulus
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens
from palpate.calibration.touch_modulus import ratio_at
from palpate.elasticity import Elasticity
from palpate.uncertainty import level_ratio
from scipy import stats
from tilted_touch import tilted_touch

PROBE = Elasticity()
MODULI = np.geomspace(0.15, 6.0, 6)
SCATTER = 0.01
DONE = CalibrationVerification("gel", "2026-11-29", 1.1, 0.02, Modulus(1.3, 1.25, 1.36), 4, 1e-4)


def ratios_on(random: np.random.Generator, modulus: float, count: int) -> np.ndarray:
    return PROBE.ratio(modulus) * np.exp(SCATTER * random.standard_normal(count))


def fitted(random: np.random.Generator) -> CurveFit:
    ratios = np.concatenate([ratios_on(random, modulus, 4) for modulus in MODULI])
    return Calibration.fit(ratios, np.repeat(MODULI, 4)).fitted


def probability(
    fit: CurveFit, ratio: float, modulus: float, *, error: float = 0.0, u: float = 0.0
) -> float:
    return compare(fit, MeasuredRatio(ratio, error, 4), log(modulus), u).probability


# The probability


def test_it_is_even_if_nothing_has_changed() -> None:
    """In 200 sessions; by Kolmogorov and Smirnov, at 1 %."""
    random = np.random.default_rng(1)
    found = []
    for _ in range(200):
        fit = fitted(random)
        modulus = float(random.uniform(0.2, 5.0))
        found.append(probability(fit, ratios_on(random, modulus, 4).mean(), modulus))
    assert stats.kstest(found, "uniform").pvalue > 0.01


def test_a_change_of_the_gain_is_found() -> None:
    """By 4 % of the ratio, which is 8 times the scatter of a mean of four: in every session."""
    random = np.random.default_rng(2)
    for _ in range(20):
        fit = fitted(random)
        assert probability(fit, 1.04 * ratios_on(random, 1.0, 4).mean(), 1.0) < DOUBT


def test_it_is_that_of_student() -> None:
    """With one variance that was estimated: 10 degrees of freedom."""
    fit = CurveFit(np.array([10.0, log(2.0), 1.0]), np.zeros((3, 3)), 1e-4, 10, 0.0, 4, 0.0, 1.0)
    ratio = PROBE.ratio(1.0)
    for z in (0.0, 1.0, -2.5):
        measured = ratio * (1 + z * 0.01 / 2)
        assert probability(fit, measured, 1.0) == pytest.approx(2 * stats.t.sf(abs(z), 10))


def test_the_uncertainty_of_the_specimen_and_the_readings_count() -> None:
    """Each as exact as stated: with them alone the distribution is Gaussian."""
    fit = CurveFit(np.array([10.0, log(2.0), 1.0]), np.zeros((3, 3)), 0.0, 10, 0.0, 4, 0.0, 1.0)
    ratio = PROBE.ratio(1.0)
    by_modulus = 0.05 / PROBE.slope(ratio)  # dr/dE, E = 1 MPa
    assert probability(fit, ratio + 2 * by_modulus, 1.0, u=0.05) == pytest.approx(
        2 * stats.norm.sf(2), rel=1e-6
    )
    assert probability(fit, ratio - 0.3, 1.0, error=0.1) == pytest.approx(
        2 * stats.norm.sf(3), rel=1e-6
    )


# Of touches


@pytest.fixture(scope="module")
def calibration() -> Calibration:
    """Return a calibration by level touches, which leaves all exponents open."""
    random = np.random.default_rng(3)
    specimens = []
    for modulus in MODULI:
        touches = [tilted_touch(ratio) for ratio in ratios_on(random, float(modulus), 4)]
        specimens.append(
            SpecimenTouches(f"{modulus}", float(modulus), touches, ratio_of=level_ratio)
        )
    return fit_specimens(specimens)


def on_specimen(factor: float = 1.0, tilt: float = 0.001) -> list[Touch]:
    tilts = (tilt, -tilt, 2 * tilt, 0.0)
    return [tilted_touch(factor * PROBE.ratio(1.0), own) for own in tilts]


def test_a_specimen_agrees_and_a_changed_gain_does_not(calibration: Calibration) -> None:
    same = calibration.verify(on_specimen(), 1.0, specimen="gel", date="2026-11-29")
    assert same.agrees
    assert same.touches == 4
    assert same.measured == calibration.mean_modulus(on_specimen())
    assert " on 2026-11-29: the calibration holds (a change of the ratio by " in str(same)
    changed = calibration.verify(on_specimen(1.05), 1.0)
    assert not changed.agrees
    assert " % more: the calibration does not hold any more" in str(changed)
    stated = calibration.verify(on_specimen(1.05), 1.0, 0.1)
    assert stated.agrees


def test_it_is_the_probability_of_the_exponent_that_agrees_best(calibration: Calibration) -> None:
    """Oblique touches of domes: with another exponent the specimen would not agree."""
    touches = [tilted_touch(PROBE.ratio(1.0), 0.06)] * 4
    evidence = [evidence_of(touch, "level", EXPONENTS) for touch in touches]
    each = []
    for number, fit in enumerate(calibration.exponent_fits):
        one = ratio_at(
            evidence,
            fit,
            number,
            calibration.ranges,
            kind="level",
            error_share=calibration.error_share,
        )
        each.append(compare(fit.fitted, one.measured(0.95), 0.0, 0.0).probability)
    assert min(each) < DOUBT
    assert calibration.verify(touches, 1.0).probability == max(each)


def test_touches_that_do_not_count_are_left_out(calibration: Calibration) -> None:
    touches = [*on_specimen(), tilted_touch(9.0, 0.0, "step"), example_touch()]
    assert calibration.verify(touches, 1.0) == calibration.verify(on_specimen(), 1.0)
    with pytest.raises(ValueError, match="touches: got 2, none counts, allowed: at least one"):
        calibration.verify(touches[4:], 1.0)


@pytest.mark.parametrize("modulus", [0.0, -1.0, inf, nan])
def test_an_impossible_modulus_is_refused(calibration: Calibration, modulus: float) -> None:
    with pytest.raises(ValueError, match=r"modulus: got \S+, allowed: a positive number, MPa"):
        calibration.verify(on_specimen(), modulus)


@pytest.mark.parametrize("uncertainty", [-0.1, inf, nan])
def test_an_impossible_uncertainty_is_refused(calibration: Calibration, uncertainty: float) -> None:
    with pytest.raises(ValueError, match="modulus_uncertainty: got"):
        calibration.verify(on_specimen(), 1.0, uncertainty)


# Text and table


def test_the_sentence() -> None:
    assert str(DONE) == (
        "gel (1.10 MPa) measures 1.300 MPa (1.250 to 1.360) on 2026-11-29, 18 % more: the "
        "calibration does not hold any more (probability by chance 0.0001)"
    )
    undated = replace(DONE, date="", probability=0.4)
    assert str(undated) == (
        "gel (1.10 MPa) measures 1.300 MPa (1.250 to 1.360): the calibration holds"
    )
    assert ", 45 % less: " in str(replace(DONE, measured=Modulus(0.6, 0.5, 0.7)))
    assert ", 170 % more: " in str(replace(DONE, measured=Modulus(3.0, 2.8, 3.2)))
    bound = str(replace(DONE, measured=Modulus(nan, 20.0, inf)))
    assert " measures stiffer than 20.0 MPa on 2026-11-29: the calibration does not" in bound


def test_the_limit_is_one_percent() -> None:
    assert replace(DONE, probability=DOUBT).agrees
    assert not replace(DONE, probability=DOUBT * 0.999).agrees


@given(
    st.text(max_size=8),
    st.floats(1e-3, 1e3),
    st.floats(0.0, 0.9),
    st.floats(0.0, 1.0),
    st.sampled_from([1.0, inf, nan]),
)
def test_a_table_has_everything(
    specimen: str, known: float, uncertainty: float, chance: float, high: float
) -> None:
    """An infinite end is left out of it; a lower end alone is that of a bound."""
    value = 2 * known if high == 1.0 else nan
    measured = Modulus(value, known, 3 * known * high)
    one = CalibrationVerification(specimen, "2026-11-29", known, uncertainty, measured, 3, chance)
    again = CalibrationVerification.of_dict(one.as_dict())
    assert replace(again, measured=DONE.measured) == replace(one, measured=DONE.measured)
    expected = inf if np.isnan(high) else 3 * known * high
    assert [*again.measured] == pytest.approx([value, known, expected], nan_ok=True)
    assert again.agrees == one.agrees


def test_a_bound_is_a_bound_again() -> None:
    """A file has no infinity; "stiffer than" has no upper end."""
    bound = replace(DONE, measured=Modulus(nan, 20.0, inf))
    again = CalibrationVerification.of_dict(bound.as_dict())
    assert str(again) == str(bound)


def test_no_modulus_is_no_modulus_again() -> None:
    none = replace(DONE, measured=Modulus(nan, nan, nan))
    assert str(CalibrationVerification.of_dict(none.as_dict())) == str(none)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("probability", nan),
        ("probability", 1.1),
        ("known_MPa", -1.0),
        ("known_uncertainty", "much"),
        ("touches", "many"),
        ("low_MPa", "low"),
    ],
)
def test_a_wrong_table_is_refused(name: str, value: object) -> None:
    table = {**DONE.as_dict(), name: value}
    with pytest.raises(ValueError, match=r"got|invalid literal|could not convert"):
        CalibrationVerification.of_dict(table)


def test_a_table_without_a_probability_is_refused() -> None:
    table = DONE.as_dict()
    del table["probability"]
    with pytest.raises(KeyError, match="probability"):
        CalibrationVerification.of_dict(table)


def test_exp_of_the_smallest_probability() -> None:
    """Far away it is 0, and the sentence says so without a warning."""
    fit = CurveFit(np.array([10.0, log(2.0), 1.0]), np.zeros((3, 3)), 1e-8, 10**6, 0.0, 4, 0.0, 1.0)
    found = probability(fit, exp(2.0), 0.2)
    assert found == pytest.approx(0.0, abs=1e-300)
    assert "(probability by chance 0)" in str(replace(DONE, probability=0.0))
