"""What the touches of a session narrow, and the sentence about it."""

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


def by_hand(*ratios: float, exponent: float = 1.5) -> list[Touch]:
    """Return four touches on each object with such a ratio."""
    return [tilted_touch(ratio, tilt, exponent=exponent) for ratio in ratios for tilt in TILTS]


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
