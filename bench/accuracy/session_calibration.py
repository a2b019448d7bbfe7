"""From the touches of a session to moduli, by palpate: the only module of the bench that calls it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import palpate
from palpate import Calibration, Touch
from palpate.calibration.modulus import Modulus
from palpate.calibration.selection import RatioChoice, Track, choose_ratio
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens

from bench.accuracy.other_sessions import Touched

STIFFENS = "stiffens"
ACCEPTED = ("drift", "creep", "offset")


@dataclass(frozen=True)
class Stated:
    """What the user states.

    Attributes
    ----------
    bumps : str or None
        "flat" or "domes".
    ratio : str or None
        "hold" or "level"; None: chosen.
    age_s : float or None
        None: chosen; 0: the whole touch, and flags that depend on its age are accepted.
    modulus_uncertainty : float
        Relative standard uncertainty of the moduli of the specimens.
    learns : bool
        Whether the calibration learns from the touches that are measured.
    """

    bumps: Literal["flat", "domes"] | None = None
    ratio: Literal["hold", "level"] | None = None
    age_s: float | None = None
    modulus_uncertainty: float = 0.0
    learns: bool = False


@dataclass(frozen=True)
class Calibrated:
    """A calibration, and the settings of the tracker for its touches."""

    calibration: Calibration
    settings: Mapping[str, Any]

    def touches(self, one: Touched) -> list[Touch]:
        """Return the touches on a specimen or object."""
        return palpate.touches(one.recording, **self.settings)


@dataclass(frozen=True)
class Remarks:
    """Remarks on a touch; None: palpate has no such remark.

    Attributes
    ----------
    stiffens : bool or None
        Whether the touch has the flag.
    differs : bool or None
        Whether a sentence says how the touch differs from those that calibrated.
    """

    stiffens: bool | None
    differs: bool | None


def calibrated(specimens: Sequence[Touched], stated: Stated) -> Calibrated:
    """Return the calibration of a session, as `palpate calibrate` makes it.

    Raises
    ------
    palpate.errors.CalibrationError
        The touches give no calibration.
    """
    choice = _choice(specimens, stated)
    settings: dict[str, Any] = dict(choice.settings)
    accept = ACCEPTED if stated.age_s == 0 else ()
    known = []
    for one in specimens:
        name = str(one.label_MPa)
        touches = palpate.touches(one.recording, **settings)
        specimen = SpecimenTouches(
            name,
            one.label_MPa,
            touches,
            accept,
            choice.ratio_of,
            modulus_uncertainty=stated.modulus_uncertainty,
        )
        if specimen.counted:
            known.append(specimen)
    about = replace(choice.about, accepted_flags=accept)
    found = fit_specimens(known, exponents=choice.exponents, about=about)
    return Calibrated(found, settings)


def _choice(specimens: Sequence[Touched], stated: Stated) -> RatioChoice:
    """Return the ratio that is chosen, with what is stated."""
    tracking: dict[str, float] = {}
    if stated.age_s is not None:
        tracking["age"] = stated.age_s
    tracks = []
    for one in specimens:
        names = {}
        for touch in palpate.touches(one.recording):
            names[touch.start] = str(one.label_MPa)
        tracks.append(Track(one.recording, tracking, names))
    moduli = {str(one.label_MPa): one.label_MPa for one in specimens}
    return choose_ratio(tracks, moduli, ratio=stated.ratio, bumps=stated.bumps)


def learned(calibration: Calibration, groups: Sequence[Sequence[Touch]]) -> Calibration:
    """Return the calibration with the evidence of the touches."""
    return calibration.learned(groups)


def modulus_of(calibration: Calibration, touch: Touch) -> Modulus | None:
    """Return the modulus of a touch; None: the touch does not count."""
    if calibration.objections(touch):
        return None
    return calibration.modulus_of(touch)


def remarks_on(calibration: Calibration, touch: Touch) -> Remarks:
    """Return the remarks on a touch, whether or not it counts."""
    stiffens = None
    if STIFFENS in list(palpate.flags.Flag):
        stiffens = STIFFENS in touch.flags
    return Remarks(stiffens, bool(calibration.differences(touch)))


def mean_modulus(calibration: Calibration, touches: Sequence[Touch]) -> Modulus | None:
    """Return the modulus of several touches on one object; None: no touch counts."""
    usable = [touch for touch in touches if not calibration.objections(touch)]
    if not usable:
        return None
    return calibration.mean_modulus(usable)


def agrees(
    calibration: Calibration,
    touches: Sequence[Touch],
    modulus_MPa: float,
    modulus_uncertainty: float = 0.0,
) -> bool | None:
    """Return whether a known specimen agrees with the calibration; None: nothing compares them."""
    usable = [touch for touch in touches if not calibration.objections(touch)]
    if not usable:
        return None
    return calibration.verify(usable, modulus_MPa, modulus_uncertainty).agrees
