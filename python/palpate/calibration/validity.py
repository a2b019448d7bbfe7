"""Whether a calibration applies: to one touch, and to a whole measurement."""

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING

from palpate.touch import Touch

if TYPE_CHECKING:
    from palpate.calibration.model import Calibration


@dataclass(frozen=True)
class OtherSetting:
    """A setting of the tracker that was not the same for a touch as for a calibration."""

    name: str
    measured: float
    calibrated: float


@dataclass(frozen=True)
class Refusal:
    """Why a touch has no modulus by a calibration.

    Attributes
    ----------
    settings : tuple of OtherSetting
        Settings with which the touch was measured otherwise; empty: it has no ratio.
    by_level : bool
        Whether the calibration is of level ratios.

    Examples
    --------
    >>> print(Refusal((OtherSetting("age", 0.0, 1.3),)))
    measured with age 0, but calibrated with age 1.3: use --set age=1.3
    """

    settings: tuple[OtherSetting, ...] = ()
    by_level: bool = False

    def __str__(self) -> str:
        """Return the reason as a sentence."""
        if self.settings:
            measured = " and ".join(f"{one.name} {one.measured:g}" for one in self.settings)
            calibrated = " and ".join(f"{one.name} {one.calibrated:g}" for one in self.settings)
            options = " ".join(f"--set {one.name}={one.calibrated:g}" for one in self.settings)
            return f"measured with {measured}, but calibrated with {calibrated}: use {options}"
        if self.by_level:
            return (
                "no level ratio, as the press shows no sweep of the depth: press more slowly, "
                "and hold"
            )
        return "no ratio"


def refusal(touch: Touch, contact_exponent: float | None, age_s: float) -> Refusal | None:
    """Return why a calibration has no modulus of a touch; None: it has one.

    Parameters
    ----------
    touch : Touch
    contact_exponent : float or None
        Of a calibration of level ratios; None: it is of ratios of the hold.
    age_s : float, s
        Of the touches of the calibration; 0: they have none.
    """
    by_level = bool(contact_exponent)
    settings = [OtherSetting("age", touch.age_s, age_s)]
    if contact_exponent:
        settings.append(OtherSetting("contact_exponent", touch.contact_exponent, contact_exponent))
    others = tuple(one for one in settings if one.measured != one.calibrated)
    ratio = touch.level_ratio if by_level else touch.ratio
    if others or not isfinite(ratio):
        return Refusal(others, by_level)
    return None


@dataclass(frozen=True)
class CalibrationDoubts:
    """Why the moduli by a calibration may be wrong; a text is empty if there is no such reason.

    Attributes
    ----------
    verdict : str
        Of a fit that is not sound.
    scene, made_with : str
        Scene of the measurement and of the calibration, if they differ.
    recordings : str
        Doubts about the recordings of the calibration.
    """

    verdict: str = ""
    scene: str = ""
    made_with: str = ""
    recordings: str = ""

    def sentences(self) -> list[str]:
        """Return a sentence for each reason."""
        reasons = []
        if self.verdict:
            reasons.append(f"calibration: {self.verdict}")
        if self.made_with:
            reasons.append(
                f"the calibration was made with scene {self.made_with}, but this is scene "
                f"{self.scene}: the moduli may be wrong"
            )
        if self.recordings:
            reasons.append(
                "the calibration was made from recordings that were not as written, so the moduli "
                f"may be wrong: {self.recordings}"
            )
        return reasons


def doubts_of_calibration(calibration: "Calibration", scene: str) -> CalibrationDoubts:
    """Return what may be wrong with a calibration for a measurement with this scene."""
    about = calibration.about
    made_with = about.scene or scene
    is_other = made_with != scene
    return CalibrationDoubts(
        verdict="" if calibration.sound else calibration.verdict,
        scene=scene if is_other else "",
        made_with=made_with if is_other else "",
        recordings="; ".join(about.doubts),
    )
