"""The flags of a touch: the results that each one excludes, and its advice to the user."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import inf, isfinite
from typing import TYPE_CHECKING, Literal, Self

from palpate import flag_texts

if TYPE_CHECKING:
    from palpate.touch import Touch

FEWEST = 16
"""Samples of a short touch: fewer do not show that both channels follow one ratio. A burst of noise
has a few."""


def _always(_: "Touch") -> bool:
    return True


def _never(_: "Touch") -> bool:
    """Return False: the standard error includes the effect."""
    return False


def _if_few(touch: "Touch") -> bool:
    return touch.samples < FEWEST or not isfinite(touch.standard_error)


def _if_few_or_too_young(touch: "Touch") -> bool:
    return touch.age_s > 0 or _if_few(touch)


def _if_many_outliers(touch: "Touch") -> bool:
    """Return whether an eighth of the readings of a channel are outliers: not all of them are seen."""
    return touch.outliers > (touch.samples + touch.refused + touch.saturated) / 8


def _if_whole(touch: "Touch") -> bool:
    """Return whether the touch has no age: one with an age ends before most of the effect."""
    return touch.age_s == 0


def _if_whole_and_not_revised(touch: "Touch") -> bool:
    corrected = touch.revised and isfinite(touch.standard_error)
    return _if_whole(touch) and not corrected


def _unknown(_: "Touch") -> float:
    return inf


def _effect(name: str) -> Callable[["Touch"], float]:
    """Return a function that gives the size of an effect of a touch, as a share of the ratio."""

    def size(touch: "Touch") -> float:
        share = abs(touch.effects.get(name, inf))
        return share if isfinite(share) else inf

    return size


@dataclass(frozen=True)
class Meaning:
    """The meaning of a flag: its advice, and its effect on results.

    Attributes
    ----------
    explain : callable
        Advice on a touch with this flag: the likely cause, its size, and the remedy.
    excludes : callable
        Whether the flag keeps this touch out of means, fits and reports, unless it is accepted.
    error : callable
        Largest relative error of the ratio by the effect; inf: unknown. A flag whose error is less
        than a third of the uncertainty of the ratio does not exclude a touch.
    no_ratio : bool
        Whether the ratio has no meaning at all.
    misfit : bool
        Whether the samples contradict hard = ratio * soft, or a baseline is wrong.
    avoided_by : str
        "level": the level ratio does not have this error; "age": a touch that ends at an age does
        not have it; "": neither.
    hint : str
        The remedy in two words; "": none.
    """

    explain: Callable[["Touch"], str]
    excludes: Callable[["Touch"], bool] = _always
    error: Callable[["Touch"], float] = _unknown
    no_ratio: bool = False
    misfit: bool = False
    avoided_by: Literal["level", "age", ""] = ""
    hint: str = ""


class Flag(StrEnum):
    """A warning about the result of a touch, with its meaning.

    The core decides which touch has it, except for `STIFFENS`.

    Attributes
    ----------
    SHORT
        The touch is shorter than `seconds` or `samples`.
    SATURATED
        Readings were outside the range of the converter, or a channel did not follow the other one.
    REFUSED
        More than three quarters of the readings gave no sample.
    LATE
        A fifth of the pairs or more did not come in time: the computer was too slow.
    OUTLIERS
        A twentieth of the readings of a channel or more, three at least, were far from their
        neighbours, and are left out.
    UNSETTLED
        Too few samples for a standard error, in a scene that has one.
    UNEXCITED
        The samples hardly moved the initial ratio.
    ONE_SIDED
        One channel did not change, or fell: a ratio below 0.02 or above 50.
    OFFSET
        The samples contradict hard = ratio * soft: the bumps are not level.
    DRIFT
        The samples contradict hard = ratio * soft: a baseline or the object drifted.
    LAG
        The samples contradict hard = ratio * soft: a channel is late, or the times are wrong.
    CURVE
        The samples contradict hard = ratio * soft: a gauge or a bump is not linear.
    TILT
        The ratio differs from the level ratio.
    CHANGED
        The ratio changed during the touch: `ratio` is the one after it; or shortly before the end:
        the one before.
    STEP
        A channel jumped during the touch.
    JUMPED
        The touch was a jump of the channels, and no contact.
    CREEP
        Known after the release: a channel recovers slowly.
    BASELINE
        Known after the release: the baseline was measured in contact.
    GAP
        `Tracker.gap` ended the touch; or the baseline was measured after a gap, and no release has
        shown yet that this was without contact.
    STIFFENS
        Known after the release: the ratio grows with depth, because the object is thin or layered,
        or stiffens when it is strained. A `Tracker` alone does not test this: `palpate.touches`,
        `Stream` and `palpate replay` do.

    Examples
    --------
    >>> Flag("tilt") is Flag.TILT, Flag.TILT == "tilt", Flag.OFFSET.meaning.hint
    (True, True, 'hold upright')
    """

    meaning: Meaning

    def __new__(cls, name: str, meaning: Meaning = Meaning(flag_texts.explain_gap)) -> Self:
        """Make an entry. The default is for type checkers: `Flag("tilt")` looks an entry up."""
        flag = str.__new__(cls, name)
        flag._value_ = name
        flag.meaning = meaning
        return flag

    SHORT = "short", Meaning(flag_texts.explain_short, _if_few_or_too_young, hint="hold longer")
    SATURATED = "saturated", Meaning(flag_texts.explain_saturated, hint="press less")
    REFUSED = "refused", Meaning(flag_texts.explain_refused)
    LATE = "late", Meaning(flag_texts.explain_late, _if_few)
    OUTLIERS = (
        "outliers",
        Meaning(flag_texts.explain_outliers, _if_many_outliers, hint="check the wires"),
    )
    UNSETTLED = "unsettled", Meaning(flag_texts.explain_unsettled, hint="hold longer")
    UNEXCITED = (
        "unexcited",
        Meaning(flag_texts.explain_unexcited, no_ratio=True, hint="press deeper"),
    )
    ONE_SIDED = "one-sided", Meaning(flag_texts.explain_one_sided, no_ratio=True)
    OFFSET = (
        "offset",
        Meaning(
            flag_texts.explain_offset,
            error=_effect("offset"),
            misfit=True,
            avoided_by="level",
            hint="hold upright",
        ),
    )
    DRIFT = (
        "drift",
        Meaning(
            flag_texts.explain_drift,
            _if_whole_and_not_revised,
            error=_effect("drift"),
            misfit=True,
            avoided_by="age",
            hint="hold still",
        ),
    )
    LAG = "lag", Meaning(flag_texts.explain_lag, misfit=True, hint="press slowly")
    CURVE = (
        "curve",
        Meaning(flag_texts.explain_curve, error=_effect("curve"), misfit=True, hint="press less"),
    )
    TILT = "tilt", Meaning(flag_texts.explain_tilt, _never)
    CHANGED = "changed", Meaning(flag_texts.explain_changed, _never)
    STEP = "step", Meaning(flag_texts.explain_step, misfit=True)
    JUMPED = "jumped", Meaning(flag_texts.explain_jumped, no_ratio=True, misfit=True)
    CREEP = (
        "creep",
        Meaning(
            flag_texts.explain_creep,
            _if_whole,
            error=_effect("shift"),
            misfit=True,
            avoided_by="age",
            hint="wait longer",
        ),
    )
    BASELINE = "baseline", Meaning(flag_texts.explain_baseline, no_ratio=True, misfit=True)
    GAP = "gap", Meaning(flag_texts.explain_gap)
    STIFFENS = "stiffens", Meaning(flag_texts.explain_stiffens, _never)


class Suspicion(StrEnum):
    """Advice that belongs to no flag: the ratio itself shows it.

    Attributes
    ----------
    SWAPPED
        The bumps are likely at each other's inputs.
    """

    SWAPPED = "swapped"


@dataclass(frozen=True)
class Advice:
    """A flag of a touch as a sentence: the likely cause, its size, and the remedy.

    Attributes
    ----------
    flag : Flag or Suspicion
    text : str

    Examples
    --------
    >>> print(Advice(Flag.GAP, "lift the probe, and touch again"))
    gap: lift the probe, and touch again
    """

    flag: Flag | Suspicion
    text: str

    def __str__(self) -> str:
        """Return the flag and the text."""
        return f"{self.flag}: {self.text}"


def advice(touch: "Touch") -> list[Advice]:
    """Return advice for each flag of a touch.

    A ratio below 1 has one, too: the bumps are likely at each other's inputs.

    Parameters
    ----------
    touch : Touch

    Returns
    -------
    list of Advice
        In the order of `touch.flags`; then one with `Suspicion.SWAPPED`, if there is reason for it.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> [touch] = palpate.touches(scenarios.run("not-level"))
    >>> [offset] = palpate.advice(touch)
    >>> offset.flag.name, offset.text[:30]
    ('OFFSET', 'the soft bump is reached 2.1 %')
    """
    result = [Advice(flag, flag.meaning.explain(touch)) for flag in touch.flags]
    if _is_swapped(touch, _FEWEST_SWAPPED):
        result.append(_SWAPPED)
    return result


def advice_at_end(touches: Sequence["Touch"], *, cut: int = 0) -> list[list[Advice]]:
    """Return `advice` on each touch of a recording.

    The recording ended during the last `cut` touches: to hold longer would not have helped them.
    Short touches are "swapped", too, if three or more agree and no touch contradicts.
    """
    result = [advice(touch) for touch in touches]
    for last in result[len(result) - cut :]:
        for place, each in enumerate(last):
            if each.flag is Flag.SHORT:
                last[place] = _CUT
    with_ratio = [touch.samples >= _FEW and not _has_no_ratio(touch) for touch in touches]
    low = [_is_swapped(touch, _FEW) for touch in touches]
    if sum(with_ratio) >= _AGREE and low == with_ratio:
        for is_swapped, own in zip(low, result, strict=True):
            if is_swapped and _SWAPPED not in own:
                own.append(_SWAPPED)
    return result


def sentences(objections: Iterable[object], known: Iterable[Advice]) -> list[str]:
    """Return each objection to a touch as a sentence; a flag with known advice as this advice."""
    of_flag: dict[object, Advice] = {each.flag: each for each in known}
    return [str(of_flag.get(objection, objection)) for objection in objections]


_CUT = Advice(Flag.SHORT, "the recording ended during this touch")
_SWAPPED = Advice(
    Suspicion.SWAPPED,
    "the soft channel changed more than the hard one, but the hard bump takes more of the force "
    "(eq. 1): exchange the wires of the two inputs, or the option hard_input (1 or 2); a soft "
    "gauge that is far more sensitive does it, too",
)
_FEWEST_SWAPPED = 20  # samples: a burst of noise can begin a touch of a few
_FEW = 10  # samples of a short touch
_AGREE = 3  # this number of short touches together shows that the inputs are swapped
_CLEARLY = 0.2  # below 1, of a ratio without a standard error


def _has_no_ratio(touch: "Touch") -> bool:
    return any(flag.meaning.no_ratio for flag in touch.flags)


def _is_swapped(touch: "Touch", fewest: int) -> bool:
    """Return whether the ratio is clearly below 1; by eq. (2) it is above 1 on every object."""
    margin = 2 * touch.standard_error if isfinite(touch.standard_error) else _CLEARLY
    is_low = 0 < touch.ratio < 1 - margin
    return touch.samples >= fewest and is_low and not _has_no_ratio(touch)
