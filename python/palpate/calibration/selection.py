"""Selects the ratio that predicts specimens left out best: hold or level, at an age; and exponents.

The hold of a level probe scatters least, but a hand that measures later tilts the probe: if the
touches scatter by less than half of `TOUCH_SCATTER`, as those of a stage do, the error of the hold is
`TOUCH_SCATTER`, the scatter that a hand is assumed to have.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf, isfinite, sqrt
from typing import Any, NamedTuple

import numpy as np

from palpate import number_format
from palpate._core import Tracker
from palpate.calibration.calibration_file import About
from palpate.calibration.evidence import (
    BUMPS,
    EXPONENTS,
    TouchEvidence,
    evidence_of,
    table_of,
)
from palpate.calibration.exponent_fits import FEWEST, POSSIBLE, scatter_evidence
from palpate.calibration.fit import Array, MeanRatios, curve, fit_curve, leverages
from palpate.errors import CalibrationError
from palpate.flags import Flag
from palpate.messages import unlike
from palpate.recording_protocol import RecordingProtocol
from palpate.repeatability import is_too_oblique, objections
from palpate.touch import Touch
from palpate.tracking import tracked
from palpate.uncertainty import RATIOS, TOUCH_SCATTER, RatioOf

AGES_S = (0.0, 0.5, 0.8, 1.3, 2.0)
"""Ages that are compared; 0: the whole touch."""
TRACKED_EXPONENTS = (1.0, 1.5)
"""Exponents of the contact that a tracker has."""
_GAIN = 0.1  # a choice that is not the simplest one has to reduce the error by more
_FEWEST_SPECIMENS = 4  # for the error of a specimen that is left out: two parameters are fitted


class Track(NamedTuple):
    """A recording with its tracker settings, and the specimen of each kept touch by its `start`."""

    recording: RecordingProtocol
    tracking: Mapping[str, Any]
    specimens: Mapping[int, str]

    def settings(self, contact_exponent: float, age_s: float) -> Mapping[str, Any]:
        """Return the settings with another exponent and age."""
        return {**self.tracking, "contact_exponent": contact_exponent, "age": age_s}

    def specimen_of(self, touch: Touch, accept: Collection[str]) -> str | None:
        """Return the specimen of a touch; None: the touch does not count."""
        if objections(touch, accept):
            return None
        return self.specimens.get(touch.start)


@dataclass(frozen=True)
class RatioError:
    """Error of a ratio of the touches on specimens that are left out of the calibration.

    Attributes
    ----------
    ratio : str
        "hold" or "level".
    age_s : float
        Setting of the tracker.
    error : float
        Relative standard deviation of the ratio of a touch from the curve through the other
        specimens; inf: they show no curve.
    touches, specimens, freedom : int
        Touches that have this ratio, their specimens, and degrees of freedom of the error.
    likelihood : numpy.ndarray
        Logarithm of the likelihood of each exponent of the contact, at most 0.

    Examples
    --------
    >>> hold = RatioError("hold", 0.0, 0.001, 40, 10, freedom=30, likelihood=np.zeros(1))
    >>> hold.percent, hold.expected
    ('0.10 %', 0.03)
    """

    ratio: str
    age_s: float
    error: float
    touches: int
    specimens: int
    freedom: int
    likelihood: Array

    @property
    def expected(self) -> float:
        """Error with any hand that measures: after a stage the hold has the scatter of a hand."""
        if self.ratio == "hold" and self.error < TOUCH_SCATTER / 2:
            return TOUCH_SCATTER
        return self.error

    def is_better_than(self, other: "RatioError") -> bool:
        """Return whether the error of a mean of all presses is significantly less.

        A press without the ratio does not reduce the error of the mean.
        """
        gain = max(_GAIN, 1 / sqrt(2 * max(self.freedom, 1)))
        own = self.expected / sqrt(max(self.touches, 1))
        return own < (1 - gain) * other.expected / sqrt(max(other.touches, 1))

    @property
    def percent(self) -> str:
        """The error as text."""
        if not isfinite(self.error):
            return "an unknown amount"
        return f"{number_format.error(100 * self.error)} %"


@dataclass(frozen=True)
class RatioChoice:
    """The ratio of a touch that a calibration converts; made by `choose_ratio`.

    Attributes
    ----------
    ratio : str
        "hold" or "level".
    settings : dict
        Of the tracker: contact_exponent and age, s; empty in a scene that has none.
    exponents : tuple of float or None
        Exponents that the contact may have; None: all.
    about : palpate.calibration.calibration_file.About
        The reasons as sentences; the other fields are empty.

    Examples
    --------
    >>> RatioChoice("level", {"contact_exponent": 1.0, "age": 0.0}).ratio_of.__name__
    'level_ratio'
    """

    ratio: str
    settings: Mapping[str, float]
    exponents: tuple[float, ...] | None = None
    about: About = field(default_factory=About)

    @property
    def ratio_of(self) -> RatioOf:
        """The ratio of a touch, and its standard error."""
        return RATIOS[self.ratio]


def choose_ratio(
    tracks: Sequence[Track],
    moduli: Mapping[str, float],
    *,
    ratio: str | None = None,
    bumps: str | None = None,
    accept: Collection[str] = (),
) -> RatioChoice:
    """Return the ratio and the age that predict specimens left out best.

    One that is not the simplest (the hold, the whole touch) has to reduce the error by more than a
    tenth, and by more than its own error, 1 / sqrt(2 v) with v degrees of freedom. An exponent or
    an age that the settings of the tracks have is kept.

    Parameters
    ----------
    tracks : sequence of Track
    moduli : mapping of float, MPa
        Modulus of each specimen.
    ratio : str, optional
        "hold" or "level"; default: chosen.
    bumps : str, optional
        Shape of the bumps, "flat" or "domes": their contact exponent is 1 or 1.5. Default: the
        exponents that repeated touches leave open, from 1 to 1.5.
    accept : collection of str
        Flags that do not exclude a touch.

    Returns
    -------
    RatioChoice

    Raises
    ------
    ValueError
        An unknown `ratio` or shape of the bumps.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation.hand import session
    >>> moduli = {"gel": 1.1, "rubber": 3.0}
    >>> tracks = []
    >>> for name, run in session(0, moduli=moduli).items():
    ...     touches = palpate.touches(run)
    ...     tracks.append(Track(run, {}, {touch.start: name for touch in touches}))
    >>> found = choose_ratio(tracks, moduli)
    >>> found.ratio, dict(found.settings)
    ('hold', {'contact_exponent': 1.0, 'age': 0.0})
    """
    if ratio is not None and ratio not in RATIOS:
        raise ValueError(f"ratio: {unlike(ratio, RATIOS)}")
    if bumps is not None and bumps not in BUMPS:
        raise ValueError(f"bumps: {unlike(bumps, BUMPS)}")
    if not all(map(_has_exponent, tracks)):
        return RatioChoice("hold", {})
    given: dict[str, float] = {}
    for track in tracks:
        given |= track.tracking
    possible = EXPONENTS
    if bumps is not None:
        possible = np.array([BUMPS[bumps]])
    measured_exponent = given.get("contact_exponent", float(possible[-1]))
    ages: Sequence[float] = AGES_S
    if "age" in given:
        ages = [given["age"]]
    avoidable = [flag for flag in Flag if flag.meaning.avoided_by]
    measured = {}
    for age_s in ages:
        accepted = {*accept, *avoidable}
        measured[age_s] = _measured_with(tracks, measured_exponent, age_s, accepted)
    compared = []
    for kind in RATIOS:
        for age_s, touches in measured.items():
            compared.append(_ratio_error(kind, age_s, touches, moduli, possible))
    compared = _with_enough_specimens(compared)
    chosen = _simplest([each for each in compared if ratio in (None, each.ratio)])
    about = About(
        ratio=_about_ratio(chosen, compared, is_given=ratio is not None),
        contact_exponent=_about_exponent(chosen, possible, bumps),
        age=_about_age(chosen, compared),
    )
    settings = {
        "contact_exponent": given.get("contact_exponent", _tracked_exponent(chosen, possible)),
        "age": chosen.age_s,
    }
    return RatioChoice(chosen.ratio, settings, tuple(possible.tolist()), about)


def _tracked_exponent(chosen: RatioError, possible: Array) -> float:
    """Return the exponent that a tracker has nearest to the likeliest one; the first for the hold."""
    if chosen.ratio == "hold":
        return TRACKED_EXPONENTS[0]
    # If all are equally likely, the last one: the ratios at the others then have less noise.
    likeliest = float(possible[::-1][np.argmax(chosen.likelihood[::-1])])
    return min(TRACKED_EXPONENTS, key=lambda each: abs(each - likeliest))


def _about_ratio(chosen: RatioError, compared: Sequence[RatioError], *, is_given: bool) -> str:
    """Return why the kind of ratio was chosen: compared with the best one of the other kind."""
    others = [each for each in compared if each.ratio != chosen.ratio]
    other = min(others, key=lambda each: each.error)
    name = chosen.ratio
    if is_given:
        name += ", as given"
    if chosen.freedom < FEWEST:
        return f"{name}: there are too few touches to compare it with {other.ratio}"
    counts = ""
    most = max(each.touches for each in compared)
    for each in (chosen, other):
        if each.touches < most:
            counts += f"; {each.touches} of {most} touches have a {each.ratio} ratio"
    error = "its error on a specimen left out"
    if chosen.specimens < _FEWEST_SPECIMENS:
        error = "its scatter within the specimens"
    text = f"{name}: {error} is {chosen.percent}; {other.ratio} {other.percent}{counts}"
    if chosen.ratio == "level" and other.error < other.expected:
        text += f", but a hand is assumed to scatter it by {100 * TOUCH_SCATTER:g} %"
    return text


def _about_exponent(chosen: RatioError, possible: Array, bumps: str | None) -> str:
    """Return which exponents of the contact are possible, and why; "": the ratio has none."""
    if chosen.ratio != "level":
        return ""
    if bumps is not None:
        return f"{possible[0]:g}, as stated: {bumps}"
    if not chosen.likelihood.any():
        shown = "the touches were too level to show it"
        if chosen.freedom < FEWEST:
            shown = "too few touches are repeated to show it"
        return f"{possible[0]:g} to {possible[-1]:g}: {shown}"
    left = possible[chosen.likelihood >= POSSIBLE]
    likeliest = possible[np.argmax(chosen.likelihood)]
    span = f"{left[0]:g}" if len(left) == 1 else f"{left[0]:g} to {left[-1]:g}"
    return f"{span}: repeated touches scatter least with {likeliest:g}"


def _about_age(chosen: RatioError, compared: Sequence[RatioError]) -> str:
    """Return why the age was chosen: compared with the same ratio of the whole touch."""
    if not chosen.age_s:
        return ""
    for each in compared:
        if each.ratio == chosen.ratio and not each.age_s:
            return f"{chosen.age_s:g} s; of the whole touch the error is {each.percent}"
    return f"{chosen.age_s:g} s, as given"


def _has_exponent(track: Track) -> bool:
    """Return whether the scene of a recording has a contact exponent."""
    return "contact_exponent" in Tracker(track.tracking.get("scene", "handheld")).settings


def _measured_with(
    tracks: Sequence[Track],
    exponent: float,
    age_s: float,
    accept: Collection[str],
) -> list[tuple[str | None, Touch]]:
    """Return the touches that count with these settings, each with the name of its specimen."""
    touches = []
    for track in tracks:
        found = tracked(track.recording, **track.settings(exponent, age_s))
        for touch in found.touches:
            name = track.specimen_of(touch, accept)
            touches.append((name, touch))
    return touches


def _ratio_error(
    kind: str,
    age_s: float,
    touches: Sequence[tuple[str | None, Touch]],
    moduli: Mapping[str, float],
    exponents: Array,
) -> RatioError:
    """Return the error of one kind of ratio, with the exponent with which the touches scatter least."""
    groups: dict[float, list[TouchEvidence]] = {}
    for name, touch in touches:
        if name is None or name not in moduli or is_too_oblique(touch):
            continue
        if touch.ratio > 0 and RATIOS[kind](touch)[0] > 0:
            evidence = evidence_of(touch, kind, exponents)
            groups.setdefault(moduli[name], []).append(evidence)
    count = sum(map(len, groups.values()))
    if not groups:
        return RatioError(kind, age_s, inf, 0, 0, 0, np.zeros(len(exponents)))
    likelihood = scatter_evidence(list(groups.values()), 1.0)
    number = int(np.argmax(likelihood))
    log_ratios = {}
    for modulus, group in groups.items():
        log_ratios[modulus] = table_of(group).log_ratio[:, number]
    error, freedom = prediction_error(log_ratios)
    return RatioError(kind, age_s, error, count, len(groups), freedom, likelihood)


def prediction_error(log_ratios: Mapping[float, Array]) -> tuple[float, int]:
    """Return the error of a touch on a specimen left out, and its degrees of freedom.

    Parameters
    ----------
    log_ratios : mapping of numpy.ndarray
        Logarithms of the ratios of the touches, by the modulus of their specimen, MPa.

    Returns
    -------
    error : float
        Standard deviation of log(ratio): the scatter within the specimens, and the distance of
        each specimen from the curve through the others. The largest fifth of the distances does
        not count: a specimen with a wrong modulus, or two that are exchanged, do not decide. inf:
        there is no curve.
    freedom : int
    """
    counts = np.array(list(map(len, log_ratios.values())))
    squares = float(counts @ list(map(np.var, log_ratios.values())))
    freedom = int(counts.sum()) - len(counts)
    if len(counts) < _FEWEST_SPECIMENS and not freedom:
        return inf, 0
    within = squares / max(freedom, 1)
    if len(counts) < _FEWEST_SPECIMENS:
        return sqrt(within), freedom
    x = np.log(list(log_ratios))
    means = np.exp(list(map(np.mean, log_ratios.values())))
    rows = MeanRatios(means, np.zeros(len(x)), counts.astype(float), np.arange(len(x)))
    try:
        fitted = fit_curve(x, rows, 1.0)
    except CalibrationError:
        return inf, freedom
    rest = np.log(means / curve(fitted.parameters, x))
    left_out = rest / (1 - leverages(fitted, x, rows))
    counted = len(x) - max(len(x) // 5, 1)
    distances = np.sort(left_out**2)[:counted]
    # The distance of a specimen contains the error of its own mean.
    of_means = within * float(np.mean(1 / counts))
    square = max(within - of_means, 0.0) + float(distances.mean())
    return sqrt(square), freedom + len(x) - 3


def _with_enough_specimens(compared: Sequence[RatioError]) -> list[RatioError]:
    """Return the errors; unknown for a ratio that too few specimens have to show a curve."""
    most = max(each.specimens for each in compared)
    fewest = min(most, _FEWEST_SPECIMENS)
    found = []
    for each in compared:
        is_known = each.specimens >= fewest
        found.append(each if is_known else replace(each, error=inf))
    return found


def _simplest(compared: Sequence[RatioError]) -> RatioError:
    """Return the first ratio than which no other one has a significantly smaller error."""
    known = [each for each in compared if each.freedom >= FEWEST and isfinite(each.error)]
    for one in known:
        if not any(each.is_better_than(one) for each in known):
            return one
    return compared[0]
