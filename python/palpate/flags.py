"""The flags of a touch: the results that each one excludes, and its advice to the user."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite
from typing import TYPE_CHECKING, Literal, Self

from palpate.number_format import error, plus_minus
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from palpate.touch import Touch

FEWEST = 16
"""Samples of a short touch: fewer do not show that both channels follow one ratio. A burst of noise
has a few."""


def _longer(touch: "Touch") -> str:
    """Return the advice against too few samples; nothing if the computer lost them."""
    lost = touch.held and Flag.LATE in touch.flags
    return "" if lost else ": hold the probe longer"


def _cause(touch: "Touch", *flags: "Flag") -> "Flag | None":
    """Return the first of these flags that a touch has."""
    for flag in flags:
        if flag in touch.flags:
            return flag
    return None


def _per_cent(share: float) -> str:
    """Return a size with two digits.

    Above the whole signal, the terms of the fit only oppose each other.
    """
    if abs(share) >= 1:
        return "more than 100 %"
    return f"{error(100 * abs(share))} %"


def _signed_per_cent(share: float) -> str:
    sign = "+" if share > 0 else "-"
    return sign + _per_cent(share)


def _short(touch: "Touch") -> str:
    wanted = f"age of {touch.age_s:g} s" if touch.age_s else "full length"
    return f"the touch ended after {touch.samples} samples, before its {wanted}{_longer(touch)}"


def _saturated(touch: "Touch") -> str:
    if not touch.samples:
        return (
            f"all {touch.saturated} readings are outside the range of the converter: look at the "
            "wires, and set the range again without contact (record --recentre)"
        )
    readings = "reading is" if touch.saturated == 1 else "readings are"
    return (
        f"{touch.saturated} {readings} outside the range of the converter and left out: "
        "press less deep"
    )


def _refused(touch: "Touch") -> str:
    readings = touch.samples + touch.refused + touch.saturated
    return (
        f"{touch.refused} of {readings} readings gave no sample: they or their neighbours have no "
        "value: check the cable and the connection of the board"
    )


def _late(touch: "Touch") -> str:
    text = (
        f"only {touch.samples} samples came in time, as the computer was too slow (or the board "
        "did not answer): close other programs"
    )
    return f"{text}; the probe was held long enough" if touch.held else text


def _unsettled(touch: "Touch") -> str:
    longer = _longer(touch) if touch.samples else ""
    return f"{touch.samples} samples are too few for a standard error{longer}"


def _unexcited(touch: "Touch") -> str:
    if not touch.samples:
        return "no sample moved the ratio from its initial value"
    return (
        "the change of the capacitances was too small to move the ratio from its initial value: "
        "press deeper"
    )


def _one_sided(touch: "Touch") -> str:
    if touch.ratio < -3 * touch.standard_error:
        return (
            "one channel fell while the other rose: check that both gauges are wired alike, and to "
            "the right inputs"
        )
    return (
        "the press did not raise both channels by amounts that can be compared: check that both "
        "gauges are wired, and to the right inputs; or press deeper"
    )


def _offset(touch: "Touch") -> str:
    share = touch.effects["offset"]
    size = f"{_per_cent(share)} of the mean depth"
    cause = _cause(touch, Flag.LAG, Flag.CURVE)
    if cause:
        return f"hard against soft misses the origin by {size}, likely because of the {cause}"
    first, second = ("soft", "hard") if share > 0 else ("hard", "soft")
    text = (
        f"the {first} bump is reached {size} before the {second} one (bumps not level): "
        "hold the probe upright"
    )
    if isfinite(touch.offset_ratio):
        corrected = Uncertainty.of_ratio(touch.offset_ratio, touch.offset_standard_error)
    elif isfinite(touch.level_ratio):
        corrected = Uncertainty.of_ratio(touch.level_ratio, touch.level_standard_error)
    else:
        return text
    return f"{text}. With this offset taken out, the ratio is {corrected}"


def _drift(touch: "Touch") -> str:
    drift = touch.effects["drift"]
    shift = touch.effects["shift"]
    if not touch.revised:
        return (
            f"a baseline or the object changed, by {_per_cent(drift)} of the signal; which one is "
            "not known yet: lift the probe and touch nothing for a second"
        )
    cause = _cause(touch, Flag.CREEP, Flag.BASELINE)
    if cause:
        size = _per_cent(max(drift, shift, key=abs))
        return f"a channel changed, by {size} of the signal, likely because of the {cause}"
    if abs(drift) > 4 * abs(shift):  # the object changed, too
        return (
            f"the ratio changed during the touch, by {_per_cent(drift)}; the baselines explain "
            f"{_per_cent(shift)}: the object gives way, or the probe tilts: hold the probe still, "
            "and wait until the object is at rest"
        )
    return (
        f"a baseline changed during the touch; the ratio is corrected by {_signed_per_cent(shift)} "
        "(revised): let the probe warm up, and keep hands and metal away from it"
    )


def _lag(touch: "Touch") -> str:
    lag_ms = touch.effects["lag"]
    if not isfinite(lag_ms):
        return (
            "one channel is late; without times it is not known by how much: check that the "
            "channels are not swapped"
        )
    late = "soft" if lag_ms > 0 else "hard"
    return (
        f"the {late} channel is {error(abs(lag_ms))} ms late: a bump gives way slowly, or the "
        "times are wrong, as where one time is given for readings that are made in turn (a table "
        "can have soft_time=COL): press slowly; check that the channels are not swapped, and the "
        "times of the source"
    )


def _curve(touch: "Touch") -> str:
    share = _per_cent(touch.effects["curve"])
    size = f"hard against soft bends, by {share} of the signal at twice the mean depth"
    cause = _cause(touch, Flag.LAG)
    if cause:
        return f"{size}, likely because of the {cause}"
    return (
        f"{size}: a bump bottoms out, or a gauge is not linear: press less deep, and as deep as "
        "when calibrated"
    )


def _tilt(touch: "Touch") -> str:
    level = plus_minus(touch.level_ratio, touch.level_standard_error)
    return (
        f"the ratio is {_signed_per_cent(touch.effects['tilt'])} off the one over the swept depth, "
        f"{level}, which a tilt does not change: hold the probe upright"
    )


def _changed(touch: "Touch") -> str:
    if isfinite(touch.ratio_before):
        change = touch.first_ratio / touch.ratio_before - 1
        before = plus_minus(touch.ratio_before, touch.before_standard_error)
        return (
            f"the ratio changed during the touch, by {_signed_per_cent(change)}; the result is the "
            f"one after it, not {before}"
        )
    change = touch.ratio_after / touch.first_ratio - 1
    return (
        f"the ratio changed shortly before the end, by {_signed_per_cent(change)}; the result is "
        "the one before: lift straight up; after a real change, hold for another second"
    )


def _creep(touch: "Touch") -> str:
    return (
        "a channel recovers slowly after the release, so the ratio is not corrected; it is off by "
        f"about {_per_cent(touch.effects['shift'])}: press for a shorter time, and wait longer "
        "between touches"
    )


def _baseline(_: "Touch") -> str:
    return "it was measured in contact, and is measured again now: the ratio is wrong: touch again"


def _gap(_: "Touch") -> str:
    return (
        "the board was opened again, or its range was moved, during the touch or before it; so the "
        "baseline may have been measured in contact: lift the probe, and touch again"
    )


def _always(_: "Touch") -> bool:
    return True


def _never(_: "Touch") -> bool:
    """Return False: the standard error includes the effect."""
    return False


def _if_few(touch: "Touch") -> bool:
    return touch.samples < FEWEST or not isfinite(touch.standard_error)


def _if_few_or_too_young(touch: "Touch") -> bool:
    return touch.age_s > 0 or _if_few(touch)


def _if_whole(touch: "Touch") -> bool:
    """Return whether the touch has no age: one with an age ends before most of the effect."""
    return touch.age_s == 0


def _if_whole_and_not_revised(touch: "Touch") -> bool:
    corrected = touch.revised and isfinite(touch.standard_error)
    return _if_whole(touch) and not corrected


@dataclass(frozen=True)
class Meaning:
    """The meaning of a flag: its advice, and its effect on results.

    Attributes
    ----------
    explain : callable
        Advice on a touch with this flag: the likely cause, its size, and the remedy.
    excludes : callable
        Whether the flag keeps this touch out of means, fits and reports, unless it is accepted.
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
    no_ratio: bool = False
    misfit: bool = False
    avoided_by: Literal["level", "age", ""] = ""
    hint: str = ""


class Flag(StrEnum):
    """A warning about the result of a touch, with its meaning; the core decides which touch has it.

    Attributes
    ----------
    SHORT
        The touch is shorter than `seconds` or `samples`.
    SATURATED
        Readings were outside the range of the converter.
    REFUSED
        More than three quarters of the readings gave no sample.
    LATE
        A fifth of the pairs or more did not come in time: the computer was too slow.
    UNSETTLED
        Too few samples for a standard error, in a scene that has one.
    UNEXCITED
        The samples hardly moved the initial ratio.
    ONE_SIDED
        One channel did not change, or fell: a ratio below 0.02 or above 50.
    OFFSET, DRIFT, LAG, CURVE
        The samples contradict hard = ratio * soft: bumps not level; drift of a baseline or of the
        object; a late channel, or wrong times; a gauge or bump that is not linear.
    TILT
        The ratio differs from the level ratio.
    CHANGED
        The ratio changed during the touch: `ratio` is the one after it; or shortly before the end:
        the one before.
    CREEP, BASELINE
        Known after the release: a channel recovers slowly; the baseline was measured in contact.
    GAP
        `Tracker.gap` ended the touch; or the baseline was measured after a gap, and no release has
        shown yet that this was without contact.

    Examples
    --------
    >>> Flag("tilt") is Flag.TILT, Flag.TILT == "tilt", Flag.OFFSET.meaning.hint
    (True, True, 'hold upright')
    """

    meaning: Meaning

    def __new__(cls, name: str, meaning: Meaning = Meaning(_gap)) -> Self:
        """Make an entry. The default is for type checkers: `Flag("tilt")` looks an entry up."""
        flag = str.__new__(cls, name)
        flag._value_ = name
        flag.meaning = meaning
        return flag

    SHORT = "short", Meaning(_short, _if_few_or_too_young, hint="hold longer")
    SATURATED = "saturated", Meaning(_saturated, hint="press less")
    REFUSED = "refused", Meaning(_refused)
    LATE = "late", Meaning(_late, _if_few)
    UNSETTLED = "unsettled", Meaning(_unsettled, hint="hold longer")
    UNEXCITED = "unexcited", Meaning(_unexcited, no_ratio=True, hint="press deeper")
    ONE_SIDED = "one-sided", Meaning(_one_sided, no_ratio=True)
    OFFSET = "offset", Meaning(_offset, misfit=True, avoided_by="level", hint="hold upright")
    DRIFT = (
        "drift",
        Meaning(
            _drift, _if_whole_and_not_revised, misfit=True, avoided_by="age", hint="hold still"
        ),
    )
    LAG = "lag", Meaning(_lag, misfit=True, hint="press slowly")
    CURVE = "curve", Meaning(_curve, misfit=True, hint="press less")
    TILT = "tilt", Meaning(_tilt, _never)
    CHANGED = "changed", Meaning(_changed, _never)
    CREEP = "creep", Meaning(_creep, _if_whole, misfit=True, avoided_by="age", hint="wait longer")
    BASELINE = "baseline", Meaning(_baseline, no_ratio=True, misfit=True)
    GAP = "gap", Meaning(_gap)


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
