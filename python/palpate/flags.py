"""What the flags of a touch mean, in words for the person who holds the probe; and doubts about a calibration."""

from collections.abc import Callable, Iterable, Sequence
from math import isfinite
from typing import TYPE_CHECKING

from palpate._core import Touch
from palpate.number_format import error, plus_minus
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from palpate.calibration import Calibration


def advice(touch: Touch) -> list[str]:
    """Return a sentence for each flag of a touch: what it is likely to be, how large it is, and what to do.

    A ratio below 1 has one, too: the bumps are likely at each other's inputs.

    Parameters
    ----------
    touch : Touch

    Returns
    -------
    list of str
        In the order of `touch.flags`; each begins with the name of its flag, or with "swapped".

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> [touch] = palpate.touches(scenarios.run("not-level"))
    >>> [offset] = palpate.advice(touch)
    >>> offset.partition(". ")[2]
    'With this offset taken out, the ratio is 2.844 ± 0.085 (assumed)'
    """
    told = [f"{flag}: {_SENTENCES[flag](touch)}" for flag in touch.flags]
    return [*told, _SWAPPED] if _is_swapped(touch) else told


def advice_at_end(touches: Sequence[Touch], *, cut: int = 0) -> list[list[str]]:
    """Return `advice` on each touch of a recording; the last `cut` ones ran when it ended: longer would not have helped.

    Also short touches are "swapped" where three or more agree, and no touch contradicts.
    """
    told = [advice(touch) for touch in touches]
    for said in told[len(told) - cut :]:
        said[:] = [_CUT if sentence.startswith("short: ") else sentence for sentence in said]
    known = [
        touch for touch in touches if touch.samples >= _FEW and not _NO_RATIO & set(touch.flags)
    ]
    agree = len(known) >= _AGREE and all(_is_swapped(touch, _FEW) for touch in known)
    for touch, said in zip(touches, told, strict=True):
        said += [_SWAPPED] * (agree and touch in known and _SWAPPED not in said)
    return told


def reasons(said: Iterable[str], against: Iterable[str]) -> list[str]:
    """Return of the sentences of `advice` those of these flags; what is no flag is a sentence itself."""
    of_flag = {sentence.partition(":")[0]: sentence for sentence in said}
    return [of_flag.get(each, each) for each in against]


def refusal(touch: Touch, contact_exponent: float | None, age_s: float) -> str:
    """Return why a calibration with this age and exponent (None: not of level ratios) has no modulus of a touch; "": it has."""
    wanted = {"age": age_s} | ({"contact_exponent": contact_exponent} if contact_exponent else {})
    made = {"age": touch.age_s, "contact_exponent": touch.contact_exponent}
    if other := [name for name, value in wanted.items() if made[name] != value]:
        was, calibrated = (
            " and ".join(f"{name} {of[name]:g}" for name in other) for of in (made, wanted)
        )
        again = " ".join(f"--set {name}={wanted[name]:g}" for name in other)
        return f"measured with {was}, but calibrated with {calibrated}: use {again}"
    if contact_exponent and not isfinite(touch.level_ratio):
        return (
            "no level ratio, as the press shows no sweep of the depth: press more slowly, and hold"
        )
    return "" if contact_exponent or isfinite(touch.ratio) else "no ratio"


_CUT = "short: the recording ended during this touch"
_SWAPPED = (
    "swapped: the soft channel changed more than the hard one, but the hard bump takes more of the force (eq. 1): "
    "exchange the wires of the two inputs, or the option hard_input (1 or 2); a soft gauge that is far more sensitive "
    "does it, too"
)
_NO_RATIO = {"unexcited", "one-sided", "baseline"}
_FEWEST = 20  # samples: a burst of noise can begin a touch of a few
_FEW, _AGREE = (
    10,
    3,
)  # samples of short touches, and how many of them show that the inputs are swapped
_CLEARLY = 0.2  # below 1, of a ratio without a standard error


def _is_swapped(touch: Touch, fewest: int = _FEWEST) -> bool:
    """Return whether the ratio is clearly below 1; by eq. (2) it is above 1 on every object."""
    margin = 2 * touch.standard_error if isfinite(touch.standard_error) else _CLEARLY
    return (
        touch.samples >= fewest
        and 0 < touch.ratio < 1 - margin
        and not _NO_RATIO & set(touch.flags)
    )


def _saturated(touch: Touch) -> str:
    if not touch.samples:
        return (
            f"all {touch.saturated} readings are outside the range of the converter: look at the wires, and set the range "
            "again without contact (record --recentre)"
        )
    some = "reading is" if touch.saturated == 1 else "readings are"
    return (
        f"{touch.saturated} {some} outside the range of the converter and left out: press less deep"
    )


def _refused(touch: Touch) -> str:
    readings = touch.samples + touch.refused + touch.saturated
    return (
        f"{touch.refused} of {readings} readings gave no sample: they or their neighbours have no value: check the "
        "cable and the connection of the board"
    )


def _unexcited(touch: Touch) -> str:
    if not touch.samples:
        return "no sample moved the ratio from its initial value"
    return "the change of the capacitances was too small to move the ratio from its initial value: press deeper"


def _one_sided(touch: Touch) -> str:
    if touch.ratio < -3 * touch.standard_error:
        return "one channel fell while the other rose: check that both gauges are wired alike, and to the right inputs"
    return (
        "the press did not raise both channels by amounts that can be compared: check that both gauges are wired, and to "
        "the right inputs; or press deeper"
    )


def _offset(touch: Touch) -> str:
    share = touch.effects["offset"]
    if cause := _cause(touch, "lag", "curve"):
        return f"hard against soft misses the origin by {_per_cent(share)} of the mean depth, likely because of the {cause}"
    first, second = ("soft", "hard") if share > 0 else ("hard", "soft")
    size = f"{_per_cent(share)} of the mean depth before the {second} one (bumps not level)"
    told = f"the {first} bump is reached {size}: hold the probe upright"
    ratio, error = touch.offset_ratio, touch.offset_standard_error
    if not isfinite(ratio):
        ratio, error = touch.level_ratio, touch.level_standard_error
    if not isfinite(ratio):
        return told
    corrected = Uncertainty.of_ratio(ratio, error)
    return f"{told}. With this offset taken out, the ratio is {corrected}"


def _drift(touch: Touch) -> str:
    drift, shift = touch.effects["drift"], touch.effects["shift"]
    if not touch.revised:
        return (
            f"a baseline or the object changed, by {_per_cent(drift)} of the signal; which one is not known yet: "
            "lift the probe and touch nothing for a second"
        )
    if cause := _cause(touch, "creep", "baseline"):
        return f"a channel changed, by {_per_cent(max(drift, shift, key=abs))} of the signal, likely because of the {cause}"
    if abs(drift) > 4 * abs(shift):  # the object, too
        return (
            f"the ratio changed during the touch, by {_per_cent(drift)}; the baselines explain {_per_cent(shift)}: the "
            "object gives way, or the probe tilts: hold the probe still, and wait until the object is at rest"
        )
    return (
        f"a baseline changed during the touch; the ratio is corrected by {_signed_per_cent(shift)} (revised): let the "
        "probe warm up, and keep hands and metal away from it"
    )


def _lag(touch: Touch) -> str:
    lag_ms = touch.effects["lag"]
    late = "soft" if lag_ms > 0 else "hard"
    if not isfinite(lag_ms):
        return "one channel is late; without times it is not known by how much: check that the channels are not swapped"
    return (
        f"the {late} channel is {error(abs(lag_ms))} ms late: a bump gives way slowly, or the times are wrong, as where one time "
        "is given for readings that are made in turn (a table can have soft_time=COL): press slowly; check that the channels are not swapped, and the times of the source"
    )


def _curve(touch: Touch) -> str:
    size = f"hard against soft bends, by {_per_cent(touch.effects['curve'])} of the signal at twice the mean depth"
    if cause := _cause(touch, "lag"):
        return f"{size}, likely because of the {cause}"
    return f"{size}: a bump bottoms out, or a gauge is not linear: press less deep, and as deep as when calibrated"


def _tilt(touch: Touch) -> str:
    level = plus_minus(touch.level_ratio, touch.level_standard_error)
    return (
        f"the ratio is {_signed_per_cent(touch.effects['tilt'])} off the one over the swept depth, {level}, which a tilt does not "
        "change: hold the probe upright"
    )


def _changed(touch: Touch) -> str:
    if isfinite(touch.ratio_before):
        change, before = (
            touch.first_ratio / touch.ratio_before - 1,
            plus_minus(touch.ratio_before, touch.before_standard_error),
        )
        return f"the ratio changed during the touch, by {_signed_per_cent(change)}; the result is the one after it, not {before}"
    change = touch.ratio_after / touch.first_ratio - 1
    return (
        f"the ratio changed shortly before the end, by {_signed_per_cent(change)}; the result is the one before: lift straight "
        "up; after a real change, hold for another second"
    )


_SENTENCES: dict[str, Callable[[Touch], str]] = {
    "short": lambda touch: (
        f"the touch ended after {touch.samples} samples, before its "
        f"{f'age of {touch.age_s:g} s' if touch.age_s else 'full length'}{_longer(touch)}"
    ),
    "saturated": _saturated,
    "refused": _refused,
    "late": lambda touch: (
        f"only {touch.samples} samples came in time, as the computer was too slow (or the board did not answer): close "
        "other programs" + "; the probe was held long enough" * touch._held
    ),
    "unsettled": lambda touch: (
        f"{touch.samples} samples are too few for a standard error"
        + _longer(touch) * bool(touch.samples)
    ),
    "unexcited": _unexcited,
    "one-sided": _one_sided,
    "offset": _offset,
    "drift": _drift,
    "lag": _lag,
    "curve": _curve,
    "tilt": _tilt,
    "changed": _changed,
    "creep": lambda touch: (
        "a channel recovers slowly after the release, so the ratio is not corrected; it is off by about "
        f"{_per_cent(touch.effects['shift'])}: press for a shorter time, and wait longer between touches"
    ),
    "baseline": lambda _: (
        "it was measured in contact, and is measured again now: the ratio is wrong: touch again"
    ),
    "gap": lambda _: (
        "the board was opened again, or its range was moved, during the touch or before it; so the baseline may have been "
        "measured in contact: lift the probe, and touch again"
    ),
}
FLAGS = tuple(_SENTENCES)
"""The flags that a touch can have."""


def _longer(touch: Touch) -> str:
    """Return what to do against too few samples: nothing where the computer lost them."""
    return "" if touch._held and "late" in touch.flags else ": hold the probe longer"


def _cause(touch: Touch, *flags: str) -> str:
    """Return the first of these flags that a touch has; "": none."""
    return next((flag for flag in flags if flag in touch.flags), "")


def _per_cent(share: float) -> str:
    """Return a size with two digits. Above the whole signal the terms of the fit only oppose each other."""
    return f"{error(100 * abs(share))} %" if abs(share) < 1 else "more than 100 %"


def _signed_per_cent(share: float) -> str:
    return ("+" if share > 0 else "-") + _per_cent(share)


def doubts_of_calibration(calibration: "Calibration", scene: str) -> list[str]:
    """Return what may be wrong with a calibration for this scene: its fit, and what its file says about its origin."""
    made_by, doubts = calibration.about.get("scene", scene), calibration.about.get("doubts", "")
    other = f"the calibration was made with scene {made_by}, but this is scene {scene}: the moduli may be wrong"
    doubtful = f"the calibration was made from recordings that were not as written, so the moduli may be wrong: {doubts}"
    unsound = [] if calibration.sound else [f"calibration: {calibration.verdict}"]
    return unsound + [other] * (made_by != scene) + [doubtful] * bool(doubts)
