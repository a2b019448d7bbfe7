"""The end of a calibration in one sentence, and the touches that fit another specimen better."""

from collections.abc import Callable, Sequence
from itertools import count

import numpy as np
import pytest
from palpate import Calibration
from palpate.calibration.grading import CalibrationGrade, expected_uncertainty, judge_calibration
from palpate.calibration.placement import NumberedRatio, SpecimenRatios, misplaced_touches
from palpate.elasticity import SORBOTHANE_MPA, Elasticity

PROBE = Elasticity()
TOUCHES = 4
NAMES = list(SORBOTHANE_MPA)
Touched = list[tuple[str, float]]


def session(scatter: float = 0.03, seed: int = 0) -> Touched:
    """Return the object and the ratio of each touch of a session on ten specimens, in order."""
    random = np.random.default_rng(seed)
    found = []
    for name in NAMES:
        for factor in 1 + scatter * random.standard_normal(TOUCHES):
            found.append((name, PROBE.ratio(SORBOTHANE_MPA[name]) * float(factor)))
    return found


def specimens(touched: Touched, names: Sequence[str]) -> list[SpecimenRatios]:
    """Return the specimens with the touches that are said to be on them."""
    ratios: dict[str, list[NumberedRatio]] = {name: [] for name in NAMES}
    for number, (_, ratio), name in zip(count(1), touched, names, strict=False):
        ratios[name].append(NumberedRatio(number, ratio))
    return [SpecimenRatios(name, SORBOTHANE_MPA[name], tuple(ratios[name])) for name in NAMES]


def fit(found: Sequence[SpecimenRatios]) -> Calibration:
    ratios = [one.ratio for specimen in found for one in specimen.ratios]
    moduli = [specimen.modulus for specimen in found for _ in specimen.ratios]
    return Calibration.fit(ratios, moduli)


def in_order(touched: Touched) -> list[str]:
    return [name for name, _ in touched]


@pytest.mark.parametrize("seed", range(40))
def test_a_right_session_is_good(seed: int) -> None:
    touched = session(seed=seed)
    found = specimens(touched, in_order(touched))
    assert misplaced_touches(found) == []
    calibration = fit(found)
    judged = judge_calibration(calibration, found)
    assert judged.grade == CalibrationGrade.GOOD
    assert judged.sentence.startswith("Good: the next objects are known to ±")
    assert (judged.touches, judged.doubts) == ((), ())


def test_the_uncertainty_is_that_of_the_next_objects() -> None:
    """19 of 20 moduli within the calibrated range, softer than where it is said to be worse."""
    touched = session()
    calibration = fit(specimens(touched, in_order(touched)))
    text = expected_uncertainty(calibration)
    share = float(text.partition("±")[2].partition(" %")[0]) / 100
    worse = float(text.partition("above ")[2].partition(" MPa")[0])
    random = np.random.default_rng(1)
    moduli = np.exp(random.uniform(np.log(0.143), np.log(worse), 2000))
    errors = []
    for modulus in moduli.tolist():
        ratio = PROBE.ratio(modulus) * (1 + 0.03 * float(random.standard_normal()))
        errors.append(abs(calibration.probe.modulus(ratio) / modulus - 1))
    assert 0.05 < share < 0.3
    assert 0.85 < np.mean(np.array(errors) < share) < 0.99


def one_ahead(names: list[str]) -> list[str]:
    """Shift the touches by one from the seventh on, as after a touch that was not repeated."""
    return [*names[:6], names[5], *names[6:-1]]


def exchanged(names: list[str]) -> list[str]:
    pairs = {"40 OO": "50 A", "50 A": "40 OO"}
    return [pairs.get(name, name) for name in names]


def neighbours(names: list[str]) -> list[str]:
    pairs = {"60 OO": "70 OO", "70 OO": "60 OO"}
    return [pairs.get(name, name) for name in names]


def moved(names: list[str]) -> list[str]:
    """Touch the softest specimen as the last one, and the others earlier."""
    following = dict(zip(NAMES, [NAMES[-1], *NAMES[:-1]], strict=True))
    return [following[name] for name in names]


@pytest.mark.parametrize(
    ("order", "touches", "text"),
    [
        (one_ahead, {21}, "each fits another specimen better; touch "),
        (exchanged, set(range(5, 9)), "40 OO and 50 A seem to be exchanged."),
        (neighbours, set(range(13, 17)), "60 OO and 70 OO seem to be exchanged."),
        (moved, set(range(1, 5)), "has the ratio of "),
    ],
)
@pytest.mark.parametrize("seed", range(5))
def test_touches_under_a_wrong_specimen_are_named(
    order: Callable[[list[str]], list[str]], touches: set[int], text: str, seed: int
) -> None:
    touched = session(seed=seed)
    found = specimens(touched, order(in_order(touched)))
    judged = judge_calibration(None, found, "the ratios do not rise")
    assert judged.grade == CalibrationGrade.LOOK
    assert judged.sentence.startswith("Look at touches ")
    assert touches <= set(judged.touches)
    assert text in judged.sentence
    wrong = [
        number
        for number, said, name in zip(
            count(1), order(in_order(touched)), in_order(touched), strict=False
        )
        if said != name
    ]
    assert set(judged.touches) <= set(wrong)


@pytest.mark.parametrize("scatter", [0.09, 0.12])
def test_a_scatter_of_twice_a_hands_is_not_good(scatter: float) -> None:
    touched = session(scatter)
    found = specimens(touched, in_order(touched))
    judged = judge_calibration(fit(found), found)
    assert judged.grade != CalibrationGrade.GOOD
    assert judged.sentence.startswith("Look at touch")
    assert "the ratio scatters from touch to touch by " in judged.sentence
    for number in judged.touches:
        name, ratio = touched[number - 1]
        assert abs(ratio / PROBE.ratio(SORBOTHANE_MPA[name]) - 1) > 0.03


def test_a_fit_that_is_not_sound_is_bad_with_its_reason() -> None:
    touched = session()
    found = specimens(touched, in_order(touched))[:3]
    calibration = fit(found)
    judged = judge_calibration(calibration, found)
    assert judged.grade == CalibrationGrade.BAD
    assert judged.sentence.startswith("Not reliable yet. The rigid ratio is not determined")
    assert judged.doubts == calibration.assessment.objections
