"""What the touches of a session show of the contact exponent, so that intervals become narrower."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from palpate.calibration.model import Calibration
from palpate.touch import Touch


@dataclass(frozen=True)
class LearnedCalibration:
    """A calibration with the evidence of repeated touches.

    Attributes
    ----------
    calibration : Calibration
    sentence : str
        What the touches narrow; "": nothing.
    """

    calibration: Calibration
    sentence: str = ""


def learned_from(
    calibration: Calibration, objects: Mapping[str, Sequence[Touch]]
) -> LearnedCalibration:
    """Return a calibration with what repeated touches show of the contact exponent.

    Parameters
    ----------
    calibration : Calibration
    objects : mapping of sequence of Touch
        The touches on each object, by its name. Touches with the name "" are used only if they
        agree, or differ by a tilt: else they may be on several objects.

    Returns
    -------
    LearnedCalibration
    """
    groups = []
    for name, touches in objects.items():
        counted = [touch for touch in touches if not calibration.objections(touch)]
        if len(counted) > 1 and (name or _is_one_object(calibration, counted)):
            groups.append(counted)
    learned = calibration.learned(groups)
    before = _range_text(calibration)
    after = _range_text(learned)
    if before == after:
        return LearnedCalibration(learned)
    return LearnedCalibration(
        learned, f"The repeated touches narrow the contact exponent from {before} to {after}."
    )


def _is_one_object(calibration: Calibration, touches: Sequence[Touch]) -> bool:
    found = calibration.agreement(touches)
    return found.agree or found.cause is not None


def _range_text(calibration: Calibration) -> str:
    low, high = calibration.possible_exponents
    return f"{low:g}" if low == high else f"the range {low:g} to {high:g}"
