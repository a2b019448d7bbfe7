"""Selects the ratio that scatters least on the specimens: hold or level, exponent, age."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import product
from math import isfinite, nan, sqrt
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


class ExponentReason(StrEnum):
    """Why a contact exponent was chosen."""

    GIVEN = "as given"
    TOO_LEVEL = "assumed: the touches were too level to show it"
    TOO_FEW = "assumed: too few touches are repeated to show it"
    LEAST_SCATTER = "as the scatter is least at"


@dataclass(frozen=True)
class Comparison:
    """The ratio that was chosen beside those it was compared with.

    Attributes
    ----------
    chosen : RatioScatter
    other : RatioScatter
        The best ratio of the other kind with the same age.
    whole_touch : RatioScatter or None
        The chosen ratio with an age of 0; None: it was not compared.
    most_touches : int
        Largest number of touches that have one of the compared ratios.
    ratio_given : bool
        Whether the kind of ratio was given.
    exponent_reason : ExponentReason
    fitted_exponent : float
        Exponent with the least scatter; nan: not determined.
    """

    chosen: RatioScatter
    other: RatioScatter
    whole_touch: RatioScatter | None
    most_touches: int
    ratio_given: bool
    exponent_reason: ExponentReason
    fitted_exponent: float = nan

    def about(self) -> About:
        """Return the reasons as sentences, for a person and for the file."""
        chosen = self.chosen
        exponent = age = ""
        if chosen.ratio == "level":
            exponent = f"{chosen.contact_exponent:g}, {self.exponent_reason}"
            if self.exponent_reason is ExponentReason.LEAST_SCATTER:
                exponent += f" {self.fitted_exponent:.2f}"
        if chosen.age_s and self.whole_touch:
            whole = f"{self.whole_touch.percent}{self._missing(self.whole_touch)}"
            age = f"{chosen.age_s:g} s; the whole touch scatters by {whole}"
        elif chosen.age_s:
            age = f"{chosen.age_s:g} s, as given"
        return About(ratio=self._about_ratio(), contact_exponent=exponent, age=age)

    def _about_ratio(self) -> str:
        name = self.chosen.ratio
        if self.ratio_given:
            name += ", as given"
        other = self.other
        if self.chosen.freedom < _FEWEST:
            return f"{name}, as too few touches are repeated to compare it with {other.ratio}"
        scatter = f"which scatters by {self.chosen.percent} within the specimens"
        return f"{name}, {scatter}; {other.ratio} {other.percent}{self._missing(other)}"

    def _missing(self, one: RatioScatter) -> str:
        """Return a remark if too few of the touches have a ratio."""
        if not _is_rare(one, self.most_touches):
            return ""
        counts = f"{one.touches} of {self.most_touches} touches have it"
        return f" ({counts}, the others a flag against it)"


@dataclass(frozen=True)
class RatioChoice:
    """The ratio of a touch that a calibration converts; made by `choose_ratio`.

    Attributes
    ----------
    ratio : str
        "hold" or "level".
    settings : dict
        Of the tracker: contact_exponent and age, s; empty in a scene that has none.
    comparison : Comparison or None
        Why; None: the scene has only one ratio.

    Examples
    --------
    >>> RatioChoice("level", {"contact_exponent": 1.0, "age": 0.0}).ratio_of.__name__
    'level_ratio'
    """

    ratio: str
    settings: Mapping[str, float]
    comparison: Comparison | None = None

    @property
    def ratio_of(self) -> RatioOf:
        """The ratio of a touch, and its standard error."""
        return RATIOS[self.ratio]

    @property
    def about(self) -> About:
        """The reasons as sentences; the other fields are empty."""
        return self.comparison.about() if self.comparison else About()


def choose_ratio(
    tracks: Sequence[Track], *, ratio: str | None = None, accept: Collection[str] = ()
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
    given = {name: value for track in tracks for name, value in track.tracking.items()}
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
    reason = ExponentReason.TOO_LEVEL
    fitted = nan
    if len(exponents) == 1:
        reason = ExponentReason.GIVEN
    elif chosen.ratio == "level" and chosen.is_better_than(holds[chosen.age_s]):
        reason = ExponentReason.LEAST_SCATTER
        fitted = fitted_exponent(tracks, chosen.age_s, accepted)
    elif chosen.freedom < _FEWEST:
        reason = ExponentReason.TOO_FEW
    settings = {"contact_exponent": chosen.contact_exponent, "age": chosen.age_s}
    comparison = Comparison(
        chosen,
        other=_best_other(chosen, compared),
        whole_touch=_whole_touch(chosen, compared),
        most_touches=_most_touches(compared),
        ratio_given=ratio is not None,
        exponent_reason=reason,
        fitted_exponent=fitted,
    )
    return RatioChoice(chosen.ratio, settings, comparison)


def _has_exponent(track: Track) -> bool:
    """Return whether the scene of a recording has a contact exponent."""
    return "contact_exponent" in Tracker(track.tracking.get("scene", "handheld")).settings


def fitted_exponent(tracks: Sequence[Track], age_s: float, accept: Collection[str]) -> float:
    """Return the exponent, 1 to 2 in steps of 0.02, with the least scatter within specimens."""
    touches = []
    for track in tracks:
        settings = {**track.tracking, "contact_exponent": 1.0, "age": age_s}
        for touch in offline(track.recording, **settings):
            name = track.specimens.get(touch.live.start)
            if name is not None and not objections(touch.live, accept):
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
        compared.append(RatioScatter(kind, exponent, age_s, sqrt(variance), len(used), freedom))
    return compared


def _measured_with(
    tracks: Sequence[Track], exponent: float, age_s: float, accept: Collection[str]
) -> list[tuple[str, Touch]]:
    """Return the touches that count with these settings, each with the name of its specimen."""
    touches = []
    for track in tracks:
        settings = {**track.tracking, "contact_exponent": exponent, "age": age_s}
        for touch in tracked(track.recording, **settings).touches:
            name = track.specimens.get(touch.start)
            if name is not None and not objections(touch, accept):
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


def _best_other(chosen: RatioScatter, compared: Sequence[RatioScatter]) -> RatioScatter:
    """Return the ratio of the other kind, with the same age, that scatters least."""
    others = [e for e in compared if e.ratio != chosen.ratio and e.age_s == chosen.age_s]
    return min(others, key=lambda each: each.scatter)


def _whole_touch(chosen: RatioScatter, compared: Sequence[RatioScatter]) -> RatioScatter | None:
    """Return the chosen ratio of the whole touch; None: it was not compared."""
    settings = (chosen.ratio, chosen.contact_exponent, 0.0)
    for each in compared:
        if (each.ratio, each.contact_exponent, each.age_s) == settings:
            return each
    return None
