"""What the touches of a session show of the contact exponent, so that intervals become narrower."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from palpate.calibration.evidence import EXPONENTS, evidence_of_all
from palpate.calibration.exponent_fits import POSSIBLE, scatter_evidence
from palpate.calibration.model import Calibration
from palpate.touch import Touch


@dataclass(frozen=True)
class LearnedCalibration:
    """A calibration with the evidence of repeated touches.

    Attributes
    ----------
    calibration : Calibration
    sentence : str
        What the touches narrow, or that they contradict the exponent; "": nothing.
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
    contradiction = _contradiction(calibration, groups)
    if contradiction:
        return LearnedCalibration(calibration, contradiction)
    learned = calibration.learned(groups)
    before = _range_text(calibration)
    after = _range_text(learned)
    if before == after:
        return LearnedCalibration(learned)
    return LearnedCalibration(
        learned, f"The repeated touches narrow the contact exponent from {before} to {after}."
    )


def _contradiction(calibration: Calibration, groups: Sequence[Sequence[Touch]]) -> str:
    """Return that the touches exclude the exponent of a calibration with one; "": they do not."""
    low, high = calibration.possible_exponents
    if calibration.ratio == "hold" or not groups or low < high:
        return ""
    exponents = np.union1d(EXPONENTS, [low])
    evidence = []
    for touches in groups:
        evidence.append(evidence_of_all(touches, calibration.ratio, exponents))
    likelihood = scatter_evidence(evidence, calibration.error_share)
    if likelihood[exponents == low][0] >= POSSIBLE:
        return ""
    likeliest = exponents[np.argmax(likelihood)]
    return (
        f"The repeated touches scatter least with the contact exponent {likeliest:g}, but the "
        f"calibration has {low:g}, so the moduli may be wrong: is the shape of the bumps "
        "(calibrate --bumps) stated rightly?"
    )


def _is_one_object(calibration: Calibration, touches: Sequence[Touch]) -> bool:
    found = calibration.agreement(touches)
    return found.agree or found.cause is not None


def _range_text(calibration: Calibration) -> str:
    low, high = calibration.possible_exponents
    return f"{low:g}" if low == high else f"the range {low:g} to {high:g}"
