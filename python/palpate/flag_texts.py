"""Advice on a touch with a flag: the likely cause, its size, and the remedy.

`explain_short` has the advice of `Flag.SHORT`, and so on.
"""

from math import isfinite
from typing import TYPE_CHECKING

from palpate.number_format import error, plus_minus
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from palpate.touch import Touch


def _longer(touch: "Touch") -> str:
    """Return the advice against too few samples; nothing if the computer lost them."""
    lost = touch.held and "late" in touch.flags
    return "" if lost else ": hold the probe longer"


def _cause(touch: "Touch", *flags: str) -> str:
    """Return the first of these flags that a touch has; empty: none."""
    for flag in flags:
        if flag in touch.flags:
            return flag
    return ""


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


def explain_short(touch: "Touch") -> str:
    """Explain that the touch ended too early."""
    wanted = f"age of {touch.age_s:g} s" if touch.age_s else "full length"
    return f"the touch ended after {touch.samples} samples, before its {wanted}{_longer(touch)}"


def explain_saturated(touch: "Touch") -> str:
    """Explain that readings were outside the range."""
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


def explain_refused(touch: "Touch") -> str:
    """Explain that many readings gave no sample."""
    readings = touch.samples + touch.refused + touch.saturated
    text = f"{touch.refused} of {readings} readings gave no sample: they or their neighbours have no value"
    if "late" in touch.flags:
        return f"{text}, as the computer was too slow for them: close other programs"
    return (
        f"{text}: check the cable and the connection of the board; if they are good, the computer "
        "was too slow: close other programs"
    )


def explain_late(touch: "Touch") -> str:
    """Explain that the computer was too slow."""
    text = (
        f"only {touch.samples} samples came in time, as the computer was too slow (or the board "
        "did not answer): close other programs"
    )
    return f"{text}; the probe was held long enough" if touch.held else text


def explain_outliers(touch: "Touch") -> str:
    """Explain that a channel had false readings."""
    return (
        f"{touch.outliers} readings of a channel are far from their neighbours and left out: a wire "
        "or a connector that fails now and then; check both ends of the cable"
    )


def explain_unsettled(touch: "Touch") -> str:
    """Explain that there are too few samples for a standard error."""
    longer = _longer(touch) if touch.samples else ""
    return f"{touch.samples} samples are too few for a standard error{longer}"


def explain_unexcited(touch: "Touch") -> str:
    """Explain that the samples hardly moved the ratio."""
    if not touch.samples:
        return "no sample moved the ratio from its initial value"
    return (
        "the change of the capacitances was too small to move the ratio from its initial value: "
        "press deeper"
    )


def explain_one_sided(touch: "Touch") -> str:
    """Explain that one channel did not change, or fell."""
    if touch.ratio < -3 * touch.standard_error:
        return (
            "one channel fell while the other rose: check that both gauges are wired alike, and to "
            "the right inputs"
        )
    return (
        "the press did not raise both channels by amounts that can be compared: check that both "
        "gauges are wired, and to the right inputs; or press deeper"
    )


def explain_offset(touch: "Touch") -> str:
    """Explain that the bumps are not level."""
    share = touch.effects["offset"]
    size = f"{_per_cent(share)} of the mean depth"
    cause = _cause(touch, "lag", "curve")
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


def explain_drift(touch: "Touch") -> str:
    """Explain that a baseline or the object changed."""
    drift = touch.effects["drift"]
    shift = touch.effects["shift"]
    if not touch.revised:
        return (
            f"a baseline or the object changed, by {_per_cent(drift)} of the signal; which one is "
            "not known yet: lift the probe and touch nothing for a second"
        )
    cause = _cause(touch, "creep", "baseline")
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


def explain_lag(touch: "Touch") -> str:
    """Explain that a channel is late."""
    lag_ms = touch.effects["lag"]
    if not isfinite(lag_ms):
        return (
            "one channel is late; without times it is not known by how much: check that the "
            "channels are not swapped"
        )
    late = "soft" if lag_ms > 0 else "hard"
    return (
        f"the {late} channel is {error(abs(lag_ms))} ms late: a bump gives way slowly, or the "
        "times are wrong, as where one time is given for readings that are made in turn "
        "(--soft-later-ms, or soft_time=COL): press slowly; check that the channels are not swapped, and the "
        "times of the source"
    )


def explain_curve(touch: "Touch") -> str:
    """Explain that a gauge or bump is not linear."""
    share = _per_cent(touch.effects["curve"])
    size = f"hard against soft bends, by {share} of the signal at twice the mean depth"
    cause = _cause(touch, "lag")
    if cause:
        return f"{size}, likely because of the {cause}"
    if "stiffens" in touch.flags:
        return f"{size}: the object stiffens, a bump bottoms out, or a gauge is not linear"
    return (
        f"{size}: a bump bottoms out, or a gauge is not linear: press less deep, and as deep as "
        "when calibrated"
    )


def explain_tilt(touch: "Touch") -> str:
    """Explain that the ratio differs from the level ratio."""
    level = plus_minus(touch.level_ratio, touch.level_standard_error)
    return (
        f"the ratio is {_signed_per_cent(touch.effects['tilt'])} off the one over the swept depth, "
        f"{level}, which a tilt does not change: hold the probe upright"
    )


def explain_changed(touch: "Touch") -> str:
    """Explain that the ratio changed during the touch."""
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


def explain_step(_: "Touch") -> str:
    """Explain that a channel jumped during the touch."""
    return (
        "a channel jumped during the touch (a connector, the range of the converter), so the ratio is "
        "wrong: fix the cable, and touch again"
    )


def explain_jumped(_: "Touch") -> str:
    """Explain that the touch is a jump of the channels."""
    return (
        "the channels jumped to new levels and stayed there without tremor: this was probably no "
        "contact, and the ratio means nothing"
    )


def explain_creep(touch: "Touch") -> str:
    """Explain that a channel recovers slowly after the release."""
    return (
        "a channel recovers slowly after the release, so the ratio is not corrected; it is off by "
        f"about {_per_cent(touch.effects['shift'])}: press for a shorter time, and wait longer "
        "between touches"
    )


def explain_baseline(_: "Touch") -> str:
    """Explain that the baseline was measured in contact."""
    return "it was measured in contact, and is measured again now: the ratio is wrong: touch again"


def explain_gap(_: "Touch") -> str:
    """Explain that there was a gap: the message about it says why."""
    return (
        "the board was opened again, its range was moved, or the computer paused, during the touch "
        "or before it; so the baseline may have been measured in contact: lift the probe, and touch "
        "again"
    )


def explain_stiffens(touch: "Touch") -> str:
    """Explain that the ratio grows with depth."""
    return (
        f"the ratio grows by {_per_cent(touch.effects['stiffening'])} from a light contact to full "
        "depth: the object is thin or layered, or stiffens when it is strained. The ratio is the one "
        "at full depth, so a modulus is only an upper bound: touch a thicker piece, or press less "
        "deep"
    )
