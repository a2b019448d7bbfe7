"""The probability that a known specimen differs from a calibration by chance."""

from math import inf, log, nan

import numpy as np
import pytest
from example_touch import example_touch
from palpate import Calibration, Touch
from palpate.calibration.assurance import DOUBT, compare
from palpate.calibration.evidence import EXPONENTS, evidence_of
from palpate.calibration.fit import CurveFit
from palpate.calibration.interval import MeasuredRatio
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens
from palpate.calibration.touch_modulus import ratio_at
from palpate.elasticity import Elasticity
from palpate.uncertainty import level_ratio
from scipy import stats
from tilted_touch import tilted_touch

PROBE = Elasticity()
MODULI = np.geomspace(0.15, 6.0, 6)
SCATTER = 0.01


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
    assert " on 2026-11-29: the calibration holds" in str(same)
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
