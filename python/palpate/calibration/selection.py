"""Which ratio of a touch scatters least on the specimens of a calibration: of the hold or the level one, and at which age."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import product
from math import isfinite, sqrt
from typing import Any, NamedTuple

import numpy as np

from palpate import number_format
from palpate._core import Tracker
from palpate.offline_touches import offline
from palpate.recording_protocol import RecordingProtocol
from palpate.repeatability import objections, within_groups
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
_NOT_COMPARED = ("offset", "drift", "creep")  # flags of what a level ratio, or an age, takes out


class Track(NamedTuple):
    """A recording of a calibration: scene and settings of its tracker, and the specimen of each kept touch, by its `start`."""

    recording: RecordingProtocol
    tracking: Mapping[str, Any]
    specimens: Mapping[int, str]


class RatioChoice(NamedTuple):
    """Which ratio of a touch a calibration is of; made by `choose_ratio`.

    Attributes
    ----------
    ratio : str
        "hold" or "level".
    settings : dict
        Of the tracker: contact_exponent and age, s; empty in a scene that has none.
    about : dict of str
        Why, for people.

    Examples
    --------
    >>> RatioChoice("level", {"contact_exponent": 1.0, "age": 0.0}, {}).ratio_of.__name__
    'level'
    """

    ratio: str
    settings: Mapping[str, float]
    about: Mapping[str, str]

    @property
    def ratio_of(self) -> RatioOf:
        """The ratio of a touch, and its standard error."""
        return RATIOS[self.ratio]


class _Candidate(NamedTuple):
    """A ratio, with its relative standard deviation within the specimens, and the touches that have it."""

    kind: str
    exponent: float
    age_s: float
    scatter: float
    touches: int
    freedom: int


def choose_ratio(
    tracks: Sequence[Track], *, ratio: str | None = None, accept: Collection[str] = ()
) -> RatioChoice:
    """Return the ratio, exponent and age whose ratios scatter least within the specimens.

    One that is not the simplest (the hold, an exponent of 1, the whole touch) has to reduce the scatter by more than a
    tenth, and by more than its own error, 1 / sqrt(2 v) with v degrees of freedom; and nine tenths of the touches must
    have it. An exponent or an age that the settings of the tracks have is kept.

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
    >>> starts = {name: [touch.start for touch in palpate.touches(run)] for name, run in runs.items()}
    >>> found = choose_ratio([Track(runs[name], {}, dict.fromkeys(at, name)) for name, at in starts.items()])
    >>> found.ratio, dict(found.settings)
    ('hold', {'contact_exponent': 1.0, 'age': 0.0})
    """
    if not all(
        "contact_exponent" in Tracker(track.tracking.get("scene", "handheld")).settings
        for track in tracks
    ):
        return RatioChoice("hold", {}, {})
    given = {name: value for track in tracks for name, value in track.tracking.items()}
    exponents = [given["contact_exponent"]] if "contact_exponent" in given else EXPONENTS
    ages = [given["age"]] if "age" in given else AGES_S
    accepted = {*accept, *_NOT_COMPARED}
    found = list(_candidates(tracks, exponents, ages, accepted))
    holds = {each.age_s: each for each in found if each.kind == "hold"}
    # Touches that were all level follow any exponent: it has to be better than the hold.
    shown = [e for e in found if e.exponent == exponents[0] or _gains(e, holds[e.age_s])]
    best = _simplest([each for each in shown if ratio in (None, each.kind)])
    about = {"ratio": _about_ratio(best, found, ratio)}
    if best.kind == "level":
        why = (
            "as given" if len(exponents) == 1 else "assumed: the touches were too level to show it"
        )
        if len(exponents) > 1 and best.freedom < _FEWEST:
            why = "assumed: too few touches are repeated to show it"
        if len(exponents) > 1 and _gains(best, holds[best.age_s]):
            why = f"as the scatter is least at {fitted_exponent(tracks, best.age_s, accepted):.2f}"
        about["contact exponent"] = f"{best.exponent:g}, {why}"
    if best.age_s:
        whole = next((each for each in found if each[:3] == (best.kind, best.exponent, 0.0)), None)
        beside = (
            f"; the whole touch scatters by {_percent(whole)}{_few(whole, found)}"
            if whole
            else ", as given"
        )
        about["age"] = f"{best.age_s:g} s{beside}"
    return RatioChoice(best.kind, {"contact_exponent": best.exponent, "age": best.age_s}, about)


def fitted_exponent(tracks: Sequence[Track], age_s: float, accept: Collection[str]) -> float:
    """Return the exponent, 1 to 2 in steps of 0.02, whose level ratios scatter least within the specimens."""
    touches = [
        (track.specimens[touch.live.start], touch)
        for track in tracks
        for touch in offline(
            track.recording, **{**track.tracking, "contact_exponent": 1.0, "age": age_s}
        )
        if touch.live.start in track.specimens and not objections(touch.live, accept)
    ]
    variances = [
        within_groups((name, touch.level(exponent)) for name, touch in touches)[0]
        for exponent in _GRID
    ]
    return float(_GRID[np.argmin(np.sqrt(variances))])


def _candidates(
    tracks: Sequence[Track],
    exponents: Sequence[float],
    ages: Sequence[float],
    accept: Collection[str],
) -> Iterator[_Candidate]:
    """Yield each ratio with its scatter, the simplest first."""
    made = {
        settings: [
            (track.specimens[touch.start], touch)
            for track in tracks
            for touch in tracked(
                track.recording,
                **{**track.tracking, "contact_exponent": settings[0], "age": settings[1]},
            ).touches
            if touch.start in track.specimens and not objections(touch, accept)
        ]
        for settings in product(exponents, ages)
    }
    for kind, (exponent, age_s) in product(RATIOS, made):
        if kind == "level" or exponent == exponents[0]:
            named = ((name, RATIOS[kind](touch)) for name, touch in made[exponent, age_s])
            variance, freedom, used = within_groups(named)
            yield _Candidate(kind, exponent, age_s, sqrt(variance), len(used), freedom)


def _gains(one: _Candidate, simpler: _Candidate) -> bool:
    """Return whether the scatter is significantly less than of a simpler candidate."""
    gain = max(_GAIN, 1 / sqrt(2 * max(one.freedom, 1)))
    return one.scatter < (1 - gain) * simpler.scatter


def _simplest(found: Sequence[_Candidate]) -> _Candidate:
    """Return the first candidate than which none scatters significantly less."""
    known = [e for e in found if not _few(e, found) and e.freedom >= _FEWEST]
    return next((one for one in known if not any(_gains(each, one) for each in known)), found[0])


def _few(one: _Candidate, found: Sequence[_Candidate]) -> str:
    """Return a remark if less than nine tenths of the touches have it."""
    most, lost = max(each.touches for each in found), "the others a flag against it"
    return (
        f" ({one.touches} of {most} touches have it, {lost})"
        if one.touches < (1 - _MOST_LOST) * most
        else ""
    )


def _percent(one: _Candidate) -> str:
    return (
        f"{number_format.error(100 * one.scatter)} %"
        if isfinite(one.scatter)
        else "an unknown amount"
    )


def _about_ratio(best: _Candidate, found: Sequence[_Candidate], given: str | None) -> str:
    other = min(
        (e for e in found if e.kind != best.kind and e.age_s == best.age_s),
        key=lambda each: each.scatter,
    )
    name = f"{best.kind}, as given," if given else f"{best.kind},"
    if best.freedom < _FEWEST:
        return f"{name} as too few touches are repeated to compare it with {other.kind}"
    return f"{name} which scatters by {_percent(best)} within the specimens; {other.kind} {_percent(other)}{_few(other, found)}"
