"""Selects the ratio that scatters least on the specimens: hold or level, exponent, age."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from math import isfinite, sqrt
from typing import Any, NamedTuple

import numpy as np

from palpate import number_format
from palpate._core import Tracker
from palpate.calibration.calibration_file import About
from palpate.flags import Flag
from palpate.offline_touches import offline
from palpate.recording_protocol import RecordingProtocol
from palpate.repeatability import objections, within_groups
from palpate.touch import Touch
from palpate.tracking import tracked
from palpate.uncertainty import RATIOS, RatioOf

AGES_S = (0.0, 0.5, 0.8, 1.3, 2.0)
"""Ages that are compared; 0: the whole touch."""
EXPONENTS = (1.0, 1.5)
"""Exponents of the contact that a tracker has."""
_GRID = np.linspace(1, 2, 51)
_GAIN = 0.1  # a choice that is not the simplest one has to reduce the scatter by more
_MOST_LOST = 0.1  # share of the touches
_FEWEST = 3  # degrees of freedom


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
class RatioScatter:
    """Scatter within the specimens of one ratio of the touches.

    Attributes
    ----------
    ratio : str
        "hold" or "level".
    contact_exponent, age_s : float
        Settings of the tracker.
    scatter : float
        Relative standard deviation within the specimens; inf: unknown.
    touches, freedom : int
        Touches that have this ratio, and degrees of freedom of the scatter.

    Examples
    --------
    >>> hold = RatioScatter("hold", 1.0, 0.0, 0.030, touches=40, freedom=30)
    >>> RatioScatter("level", 1.0, 0.0, 0.002, touches=40, freedom=30).is_better_than(hold)
    True
    """

    ratio: str
    contact_exponent: float
    age_s: float
    scatter: float
    touches: int
    freedom: int

    def is_better_than(self, other: "RatioScatter") -> bool:
        """Return whether the scatter is significantly less than the one of another ratio."""
        gain = max(_GAIN, 1 / sqrt(2 * max(self.freedom, 1)))
        return self.scatter < (1 - gain) * other.scatter

    @property
    def percent(self) -> str:
        """The scatter as text."""
        if not isfinite(self.scatter):
            return "an unknown amount"
        return f"{number_format.error(100 * self.scatter)} %"


@dataclass(frozen=True)
class RatioChoice:
    """The ratio of a touch that a calibration converts; made by `choose_ratio`.

    Attributes
    ----------
    ratio : str
        "hold" or "level".
    settings : dict
        Of the tracker: contact_exponent and age, s; empty in a scene that has none.
    about : palpate.calibration.calibration_file.About
        The reasons as sentences; the other fields are empty.

    Examples
    --------
    >>> RatioChoice("level", {"contact_exponent": 1.0, "age": 0.0}).ratio_of.__name__
    'level_ratio'
    """

    ratio: str
    settings: Mapping[str, float]
    about: About = field(default_factory=About)

    @property
    def ratio_of(self) -> RatioOf:
        """The ratio of a touch, and its standard error."""
        return RATIOS[self.ratio]


def choose_ratio(
    tracks: Sequence[Track],
    *,
    ratio: str | None = None,
    accept: Collection[str] = (),
) -> RatioChoice:
    """Return the ratio, exponent and age whose ratios scatter least within the specimens.

    One that is not the simplest (the hold, an exponent of 1, the whole touch) has to reduce the
    scatter by more than a tenth, and by more than its own error, 1 / sqrt(2 v) with v degrees of
    freedom; and nine tenths of the touches must have it. An exponent or an age that the settings of
    the tracks have is kept.

    Parameters
    ----------
    tracks : sequence of Track
    ratio : str, optional
        "hold" or "level"; default: chosen.
    accept : collection of str
        Flags that do not exclude a touch.

    Returns
    -------
    RatioChoice

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation.hand import session
    >>> runs = session(0, moduli={"gel": 1.1, "rubber": 3.0})
    >>> tracks = []
    >>> for name, run in runs.items():
    ...     touches = palpate.touches(run)
    ...     tracks.append(Track(run, {}, {touch.start: name for touch in touches}))
    >>> found = choose_ratio(tracks)
    >>> found.ratio, dict(found.settings)
    ('hold', {'contact_exponent': 1.0, 'age': 0.0})
    """
    if not all(map(_has_exponent, tracks)):
        return RatioChoice("hold", {})
    given: dict[str, float] = {}
    for track in tracks:
        given |= track.tracking
    exponents = [given["contact_exponent"]] if "contact_exponent" in given else EXPONENTS
    ages = [given["age"]] if "age" in given else AGES_S
    avoidable = [flag for flag in Flag if flag.meaning.avoided_by]
    accepted = {*accept, *avoidable}
    compared = _compared(tracks, exponents, ages, accepted)
    holds = {each.age_s: each for each in compared if each.ratio == "hold"}
    allowed = []
    for each in compared:
        # Touches that were all level follow any exponent: it has to be better than the hold.
        is_shown = each.contact_exponent == exponents[0] or each.is_better_than(holds[each.age_s])
        if is_shown and ratio in (None, each.ratio):
            allowed.append(each)
    chosen = _simplest(allowed)
    exponent = ""
    if chosen.ratio == "level":
        exponent = f"{chosen.contact_exponent:g}, "
        if len(exponents) == 1:
            exponent += "as given"
        elif chosen.is_better_than(holds[chosen.age_s]):
            best = fitted_exponent(tracks, chosen.age_s, accepted)
            exponent += f"as the scatter is least at {best:.2f}"
        elif chosen.freedom < _FEWEST:
            exponent += "assumed: too few touches are repeated to show it"
        else:
            exponent += "assumed: the touches were too level to show it"
    about = About(
        ratio=_about_ratio(chosen, compared, is_given=ratio is not None),
        contact_exponent=exponent,
        age=_about_age(chosen, compared),
    )
    settings = {"contact_exponent": chosen.contact_exponent, "age": chosen.age_s}
    return RatioChoice(chosen.ratio, settings, about)


def _about_ratio(chosen: RatioScatter, compared: Sequence[RatioScatter], *, is_given: bool) -> str:
    """Return why the kind of ratio was chosen: beside the best one of the other kind and this age."""
    others = [e for e in compared if e.ratio != chosen.ratio and e.age_s == chosen.age_s]
    other = min(others, key=lambda each: each.scatter)
    name = chosen.ratio
    if is_given:
        name += ", as given"
    if chosen.freedom < _FEWEST:
        return f"{name}, as too few touches are repeated to compare it with {other.ratio}"
    scatter = f"which scatters by {chosen.percent} within the specimens"
    return f"{name}, {scatter}; {other.ratio} {other.percent}{_missing(other, compared)}"


def _about_age(chosen: RatioScatter, compared: Sequence[RatioScatter]) -> str:
    """Return why the age was chosen: beside the same ratio of the whole touch, if it was compared."""
    if not chosen.age_s:
        return ""
    for each in compared:
        is_same = (each.ratio, each.contact_exponent) == (chosen.ratio, chosen.contact_exponent)
        if is_same and not each.age_s:
            whole = f"{each.percent}{_missing(each, compared)}"
            return f"{chosen.age_s:g} s; the whole touch scatters by {whole}"
    return f"{chosen.age_s:g} s, as given"


def _missing(one: RatioScatter, compared: Sequence[RatioScatter]) -> str:
    """Return a remark if too few of the touches have a ratio."""
    most = _most_touches(compared)
    if not _is_rare(one, most):
        return ""
    return f" ({one.touches} of {most} touches have it, the others a flag against it)"


def _has_exponent(track: Track) -> bool:
    """Return whether the scene of a recording has a contact exponent."""
    return "contact_exponent" in Tracker(track.tracking.get("scene", "handheld")).settings


def fitted_exponent(tracks: Sequence[Track], age_s: float, accept: Collection[str]) -> float:
    """Return the exponent, 1 to 2 in steps of 0.02, with the least scatter within specimens."""
    touches = []
    for track in tracks:
        for touch in offline(track.recording, **track.settings(1.0, age_s)):
            name = track.specimen_of(touch.live, accept)
            touches.append((name, touch))
    variances = []
    for exponent in _GRID:
        variance, _, _ = within_groups((name, touch.level(exponent)) for name, touch in touches)
        variances.append(variance)
    return float(_GRID[np.argmin(np.sqrt(variances))])


def _compared(
    tracks: Sequence[Track],
    exponents: Sequence[float],
    ages: Sequence[float],
    accept: Collection[str],
) -> list[RatioScatter]:
    """Return each ratio with its scatter, the simplest first."""
    pairs = list(product(exponents, ages))
    measured = {pair: _measured_with(tracks, *pair, accept) for pair in pairs}
    compared = []
    for kind, (exponent, age_s) in product(RATIOS, pairs):
        if kind == "hold" and exponent != exponents[0]:
            continue
        touches = measured[exponent, age_s]
        variance, freedom, used = within_groups(
            (name, RATIOS[kind](touch)) for name, touch in touches
        )
        scatter = sqrt(variance)
        compared.append(RatioScatter(kind, exponent, age_s, scatter, len(used), freedom))
    return compared


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


def _simplest(compared: Sequence[RatioScatter]) -> RatioScatter:
    """Return the first ratio than which no other one scatters significantly less."""
    most = _most_touches(compared)
    known = [e for e in compared if not _is_rare(e, most) and e.freedom >= _FEWEST]
    for one in known:
        if not any(each.is_better_than(one) for each in known):
            return one
    return compared[0]


def _most_touches(compared: Sequence[RatioScatter]) -> int:
    return max(each.touches for each in compared)


def _is_rare(one: RatioScatter, most: int) -> bool:
    """Return whether less than nine tenths of the touches have a ratio."""
    return one.touches < (1 - _MOST_LOST) * most
