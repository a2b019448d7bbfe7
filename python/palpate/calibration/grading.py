"""The end of a calibration in one sentence: good, or what to look at."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import inf, isfinite
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from palpate.calibration.placement import (
    Misplaced,
    SpecimenRatios,
    listed_numbers,
    misplaced_touches,
    scattered_touches,
)
from palpate.uncertainty import TOUCH_SCATTER

if TYPE_CHECKING:
    from palpate.calibration.model import Calibration

MOST_SCATTER = 2 * TOUCH_SCATTER
"""Scatter from touch to touch above which a calibration is looked at again: twice a hand's."""
_POINTS = 21  # moduli at which the intervals are compared
_MOST_REASONS = 2  # in one sentence
_WIDE = 2.0  # times the median: a wide interval


class CalibrationGrade(StrEnum):
    """What to do with a calibration: use it; look at touches; or go on, or begin again."""

    GOOD = "good"
    LOOK = "look"
    BAD = "bad"


@dataclass(frozen=True)
class CalibrationJudgement:
    """What a calibration is good for, for the person who has made it.

    Attributes
    ----------
    grade : CalibrationGrade
    sentence : str
    touches : tuple of int
        Numbers of the touches to look at.
    doubts : tuple of str
        All sentences that speak against it.
    """

    grade: CalibrationGrade
    sentence: str
    touches: tuple[int, ...] = ()
    doubts: tuple[str, ...] = ()


def judge_calibration(
    calibration: "Calibration | None", specimens: Sequence[SpecimenRatios], failure: str = ""
) -> CalibrationJudgement:
    """Return the judgement of a calibration from its touches.

    Parameters
    ----------
    calibration : Calibration or None
        None: there is no fit.
    specimens : sequence of SpecimenRatios
        The touches that count.
    failure : str
        Why there is no fit.

    Returns
    -------
    CalibrationJudgement

    Examples
    --------
    >>> from palpate import Calibration
    >>> from palpate.calibration.placement import NumberedRatio
    >>> ratios, moduli = [2.0, 2.1, 3.0, 3.1, 4.0, 4.1, 5.0, 5.2], [0.2, 0.45, 1.0, 2.2]
    >>> specimens = []
    >>> for place, modulus in enumerate(moduli):
    ...     pair = ratios[2 * place : 2 * place + 2]
    ...     numbered = tuple(map(NumberedRatio, range(2 * place + 1, 9), pair))
    ...     specimens.append(SpecimenRatios(f"{modulus:g} MPa", modulus, numbered))
    >>> judge_calibration(None, specimens, "the ratios do not rise").grade
    <CalibrationGrade.BAD: 'bad'>
    """
    misplaced = misplaced_touches(specimens)
    doubts = list(map(_doubt, misplaced))
    if calibration is not None:
        doubts += calibration.assessment.objections
    if misplaced:
        return _to_look_at(misplaced, doubts)
    if calibration is None:
        return CalibrationJudgement(CalibrationGrade.BAD, f"No curve fits: {failure}", (), ())
    if not calibration.sound:
        sentence = f"Not reliable yet. {calibration.assessment.objections[0]}"
        return CalibrationJudgement(CalibrationGrade.BAD, sentence, (), tuple(doubts))
    scatter = calibration.fitted.touch_variance**0.5
    if calibration.fitted.touch_freedom and scatter > MOST_SCATTER:
        return _scattered(scatter, specimens, doubts)
    sentence = f"Good: {expected_uncertainty(calibration)}."
    return CalibrationJudgement(CalibrationGrade.GOOD, sentence, (), tuple(doubts))


def _to_look_at(misplaced: Sequence[Misplaced], doubts: Sequence[str]) -> CalibrationJudgement:
    """Return the judgement with touches that fit another specimen better."""
    numbers: set[int] = set()
    texts = []
    for each in misplaced:
        numbers.update(_present(each.numbers))
        texts.append(each.text)
    reasons = "; ".join(texts)
    if len(misplaced) > _MOST_REASONS:
        reasons = f"each fits another specimen better; {texts[0]}"
    in_order = tuple(sorted(numbers))
    sentence = f"{_look_at(in_order)}: {reasons}."
    return CalibrationJudgement(CalibrationGrade.LOOK, sentence, in_order, tuple(doubts))


def _present(numbers: Sequence[int]) -> tuple[int, ...]:
    """Return the numbers of touches of this measurement."""
    return tuple(filter(lambda number: number > 0, numbers))


def _doubt(misplaced: Misplaced) -> str:
    """Return a sentence about touches that fit another specimen better, with their numbers."""
    numbers = _present(misplaced.numbers)
    where = f" (touches {listed_numbers(numbers)})" if len(numbers) > 1 else ""
    return f"{_capital(misplaced.text)}{where}."


def _scattered(
    scatter: float, specimens: Sequence[SpecimenRatios], doubts: Sequence[str]
) -> CalibrationJudgement:
    """Return the judgement of a scatter that is too large for a hand."""
    numbers = _present(scattered_touches(specimens))
    reason = (
        f"the ratio scatters from touch to touch by {100 * scatter:.2g} %, more than twice as much "
        f"as with a steady hand ({100 * TOUCH_SCATTER:g} %)"
    )
    doubt = f"{_capital(reason)}."
    if not numbers:
        return CalibrationJudgement(CalibrationGrade.LOOK, doubt, (), (*doubts, doubt))
    farthest = "these are the farthest from their specimens"
    sentence = f"{_look_at(numbers)}: {reason}; {farthest}."
    return CalibrationJudgement(CalibrationGrade.LOOK, sentence, numbers, (*doubts, doubt))


def expected_uncertainty(calibration: "Calibration") -> str:
    """Return how well a touch determines the modulus of the next objects, as a clause.

    It is half of the 95 % interval, relative to the modulus: the median over the calibrated range,
    and from which modulus on the intervals are more than twice as wide.
    """
    moduli = np.geomspace(*calibration.range, _POINTS).tolist()
    widths: list[float] = []
    for known in moduli:
        modulus = calibration.modulus(calibration.probe.ratio(known))
        width = inf
        if isfinite(modulus.high) and modulus.value > 0:
            width = (modulus.high - modulus.low) / (2 * modulus.value)
        widths.append(width)
    usual = median(widths)
    if not isfinite(usual):
        return "the next objects are known to a factor only: most have no upper bound"
    text = f"the next objects are known to ±{100 * usual:.2g} % (95 %)"
    widest = _WIDE * usual
    if widths[-1] > widest:
        first = len(widths) - 1
        while first > 0 and widths[first - 1] > widest:
            first -= 1
        text += f", those above {moduli[first]:.2g} MPa less well"
    return text


def _look_at(numbers: Sequence[int]) -> str:
    if not numbers:
        return "Look at the touches of the measurement before"
    touches = "touch" if len(numbers) == 1 else "touches"
    return f"Look at {touches} {listed_numbers(numbers)}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
