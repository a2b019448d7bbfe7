"""What the touches of a session narrow, and the sentence about it."""

from dataclasses import replace

import numpy as np
import pytest
from palpate import Calibration, Touch
from palpate.calibration.learning import learned_from
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens
from palpate.elasticity import Elasticity
from palpate.uncertainty import level_ratio
from tilted_touch import tilted_touch

TILTS = (-0.05, -0.02, 0.03, 0.06)


@pytest.fixture(scope="module")
def on_stage() -> Calibration:
    """Return a calibration by level touches, which leaves all exponents open."""
    random = np.random.default_rng(1)
    specimens = []
    for modulus in (0.15, 0.4, 1.0, 2.5, 6.0):
        touches = []
        for _ in range(4):
            ratio = Elasticity().ratio(modulus) * np.exp(0.002 * random.standard_normal())
            touches.append(tilted_touch(ratio))
        specimens.append(SpecimenTouches(f"{modulus} MPa", modulus, touches, ratio_of=level_ratio))
    return fit_specimens(specimens)


def by_hand(*ratios: float, exponent: float = 1.5, measured: float = 1.5) -> list[Touch]:
    """Return four touches on each object with such a ratio."""
    touches = []
    for ratio in ratios:
        for tilt in TILTS:
            touches.append(tilted_touch(ratio, tilt, exponent=exponent, measured=measured))
    return touches


def test_named_objects_narrow_the_range(on_stage: Calibration) -> None:
    found = learned_from(on_stage, {"gel": by_hand(3.0), "foam": by_hand(5.0)})
    assert found.calibration.possible_exponents == (1.5, 1.5)
    assert found.sentence == (
        "The repeated touches narrow the contact exponent from the range 1 to 1.5 to 1.5."
    )


def test_few_touches_leave_a_range(on_stage: Calibration) -> None:
    found = learned_from(on_stage, {"gel": by_hand(3.0)})
    low, high = found.calibration.possible_exponents
    assert 1.0 < low < high == 1.5
    assert found.sentence.endswith(f" from the range 1 to 1.5 to the range {low:g} to 1.5.")


def test_touches_without_a_name_have_to_be_on_one_object(on_stage: Calibration) -> None:
    one = learned_from(on_stage, {"": by_hand(4.0, 4.0, exponent=1.0)})
    assert one.calibration.possible_exponents[1] < 1.5
    several = learned_from(on_stage, {"": by_hand(2.0, 6.0, exponent=1.0)})
    assert several.calibration.exponent_fits == on_stage.exponent_fits
    assert several.sentence == ""


def test_level_touches_narrow_nothing(on_stage: Calibration) -> None:
    found = learned_from(on_stage, {"gel": [tilted_touch(4.0)] * 6})
    assert found.calibration.possible_exponents == (1.0, 1.5)
    assert found.sentence == ""


def test_touches_that_contradict_the_stated_bumps_are_named(on_stage: Calibration) -> None:
    stated = replace(on_stage, exponent_fits=on_stage.exponent_fits[:1], contact_exponent=1.0)
    objects = {"gel": by_hand(3.0, measured=1.0), "foam": by_hand(5.0, measured=1.0)}
    wrong = learned_from(stated, objects)
    assert wrong.calibration is stated
    assert wrong.sentence == (
        "The repeated touches scatter least with the contact exponent 1.5, but the calibration has "
        "1, so the moduli may be wrong: is the shape of the bumps (calibrate --bumps) stated "
        "rightly?"
    )
    right = by_hand(3.0, exponent=1.0, measured=1.0)
    assert learned_from(stated, {"gel": right}).sentence == ""
