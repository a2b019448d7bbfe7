"""From the touches of a session to moduli, by palpate: the only module of the bench that calls it.

Some methods may be absent in a version of palpate; the bench then runs without them, and prints "-"
for results that only they have.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from inspect import signature
from typing import Any, Literal, Protocol, cast, runtime_checkable

import palpate
from palpate import Calibration, Touch
from palpate.calibration.modulus import Modulus
from palpate.calibration.selection import RatioChoice, Track, choose_ratio
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens

from bench.accuracy.other_sessions import Touched

STIFFENS = "stiffens"
ACCEPTED = ("drift", "creep", "offset")
EXPONENTS = {"flat": 1.0, "domes": 1.5}


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
    settings: Mapping[str, float]

    def touches(self, one: Touched) -> list[Touch]:
        """Return the touches on a specimen or object."""
        settings: Any = self.settings
        return palpate.touches(one.recording, **settings)


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


@runtime_checkable
class Learns(Protocol):
    """A calibration that learns the contact exponent from repeated touches."""

    def learned(self, groups: Sequence[Sequence[Touch]]) -> Calibration:
        """Return the calibration with the evidence of touches, a group an object."""


@runtime_checkable
class Averages(Protocol):
    """A calibration that gives the modulus of several touches on one object."""

    def mean_modulus(self, touches: Sequence[Touch]) -> Modulus:
        """Return their modulus."""


@runtime_checkable
class Compares(Protocol):
    """A calibration that compares a touch with those that calibrated."""

    def differences(self, touch: Touch) -> Sequence[str]:
        """Return sentences."""


class Verification(Protocol):
    """The comparison of a known specimen with a calibration."""

    @property
    def agrees(self) -> bool:
        """Whether they agree."""


@runtime_checkable
class Verifies(Protocol):
    """A calibration that compares itself with a known specimen."""

    def verify(
        self,
        touches: Sequence[Touch],
        modulus_MPa: float,
        modulus_uncertainty: float,
    ) -> Verification:
        """Return the comparison."""


def calibrated(specimens: Sequence[Touched], stated: Stated) -> Calibrated:
    """Return the calibration of a session, as `palpate calibrate` makes it.

    Raises
    ------
    palpate.errors.CalibrationError
        The touches give no calibration.
    """
    choice = _choice(specimens, stated)
    settings: Any = choice.settings
    accept = ACCEPTED if stated.age_s == 0 else ()
    known = []
    for one in specimens:
        name = str(one.label_MPa)
        touches = palpate.touches(one.recording, **settings)
        specimen = SpecimenTouches(name, one.label_MPa, touches, accept, choice.ratio_of)
        if specimen.counted:
            known.append(specimen)
    about = replace(choice.about, accepted_flags=accept)
    fit: Any = fit_specimens
    if "modulus_uncertainties" in signature(fit_specimens).parameters:
        uncertainties = [stated.modulus_uncertainty] * len(known)
        found = fit(known, about=about, modulus_uncertainties=uncertainties)
    else:
        found = fit(known, about=about)
    return Calibrated(found, choice.settings)


def _choice(specimens: Sequence[Touched], stated: Stated) -> RatioChoice:
    """Return the ratio that is chosen, with what is stated."""
    takes_bumps = "bumps" in signature(choose_ratio).parameters
    tracking = {}
    if stated.age_s is not None:
        tracking["age"] = stated.age_s
    if stated.bumps and not takes_bumps:
        tracking["contact_exponent"] = EXPONENTS[stated.bumps]
    tracks = []
    for one in specimens:
        names = {}
        for touch in palpate.touches(one.recording):
            names[touch.start] = str(one.label_MPa)
        tracks.append(Track(one.recording, tracking, names))
    if takes_bumps:
        choose: Any = choose_ratio
        return cast(RatioChoice, choose(tracks, ratio=stated.ratio, bumps=stated.bumps))
    return choose_ratio(tracks, ratio=stated.ratio)


def learned(calibration: Calibration, groups: Sequence[Sequence[Touch]]) -> Calibration:
    """Return the calibration with the evidence of the touches, if it can learn."""
    if isinstance(calibration, Learns):
        return calibration.learned(groups)
    return calibration


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
    differs = None
    if isinstance(calibration, Compares):
        differs = bool(calibration.differences(touch))
    return Remarks(stiffens, differs)


def mean_modulus(calibration: Calibration, touches: Sequence[Touch]) -> Modulus | None:
    """Return the modulus of several touches on one object; None: no touch counts."""
    usable = [touch for touch in touches if not calibration.objections(touch)]
    if not usable:
        return None
    if isinstance(calibration, Averages):
        return calibration.mean_modulus(usable)
    mean = calibration.agreement(usable)
    return calibration.modulus(mean.ratio, mean.own_error, touches=mean.effective)


def agrees(
    calibration: Calibration,
    touches: Sequence[Touch],
    modulus_MPa: float,
    modulus_uncertainty: float = 0.0,
) -> bool | None:
    """Return whether a known specimen agrees with the calibration; None: nothing compares them."""
    usable = [touch for touch in touches if not calibration.objections(touch)]
    if not usable or not isinstance(calibration, Verifies):
        return None
    return calibration.verify(usable, modulus_MPa, modulus_uncertainty).agrees
