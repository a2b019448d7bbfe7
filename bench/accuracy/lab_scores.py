"""How the bench lab judges sessions: outcomes of presses, their shares, and limits of these."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cache
from typing import Protocol

import numpy as np
import palpate

from bench.accuracy.lab_worlds import Press, Session, World, make

EARLY_S = 0.3  # that a touch may begin before its press, and still be it
MEANS_S = 0.025  # of a sample of a fast converter
LATE_S = 1.0  # after a press: a judgement of it needs readings from after it
WRONG = 0.05  # a share: such a ratio is wrong
ERRORS = 4.0  # standard errors: a ratio that is farther off is wrong, too
SIDES = 1.96
STATES = frozenset({"saturated", "frozen", "falling"})  # judged once, true from then on
REMARKS = frozenset({"short", "late"})
NEW_FLAGS = frozenset({"outliers", "saturated", "step", "frozen", "jumped"})


class Judgement(Protocol):
    """What the bench reads of a judgement of a tracker."""

    @property
    def time_s(self) -> float:
        """Time."""

    @property
    def name(self) -> str:
        """What was judged."""

    @property
    def channel(self) -> str:
        """Of which channel: "hard", "soft" or "both"."""


class Measure(StrEnum):
    """A share that is measured."""

    COVERED = "covered"
    SILENT = "silent"
    FLAGGED = "flagged"
    NAMED = "named"
    NOTED = "noted"
    CALLED = "called"
    LOST = "lost"
    SAID = "said"


@dataclass(frozen=True)
class Outcome:
    """What became of a press.

    Attributes
    ----------
    found : bool
    error, standard_error : float
        Relative; nan if it was lost.
    excluded : bool
        Whether it has a flag that keeps it out of means.
    flags, judgements : frozenset of str
        All its flags; the names of the judgements that are about it.
    """

    found: bool
    error: float = math.nan
    standard_error: float = math.nan
    excluded: bool = False
    flags: frozenset[str] = frozenset()
    judgements: frozenset[str] = frozenset()

    @property
    def covered(self) -> bool:
        """Whether the 95 % interval holds the true ratio."""
        return abs(self.error) < SIDES * self.standard_error

    @property
    def flagged(self) -> bool:
        """Whether a flag excludes it, or a judgement names it."""
        return self.excluded or bool(self.judgements)

    @property
    def silent(self) -> bool:
        """Whether it is wrong, and nothing says so."""
        wrong = abs(self.error) > WRONG or abs(self.error) > ERRORS * self.standard_error
        return self.found and wrong and not self.flagged

    @property
    def noted(self) -> bool:
        """Whether it has a flag at all, or a judgement."""
        return bool(self.flags - REMARKS) or bool(self.judgements)

    def names(self, wanted: frozenset[str]) -> bool:
        """Whether a flag or a judgement has one of these names."""
        return bool((self.flags | self.judgements) & wanted)


@dataclass(frozen=True)
class Played:
    """What became of a session.

    Attributes
    ----------
    presses, phantoms : tuple of Outcome
        Of each press; of each touch without a press.
    said : frozenset of str
        Names of the judgements about a channel that has a fault.
    """

    presses: tuple[Outcome, ...]
    phantoms: tuple[Outcome, ...]
    said: frozenset[str] = frozenset()

    @property
    def lost(self) -> int:
        """Presses without a touch."""
        return sum(not outcome.found for outcome in self.presses)


def about(judgements: Iterable[Judgement], begin_s: float, end_s: float) -> frozenset[str]:
    """Return the names of the judgements within a time, and of states that began before it."""
    return frozenset(
        str(judgement.name)
        for judgement in judgements
        if judgement.time_s < end_s + LATE_S
        and (judgement.time_s > begin_s - EARLY_S or judgement.name in STATES)
    )


def outcome_of(
    touch: palpate.Touch,
    ratio: float,
    begin_s: float,
    end_s: float,
    judgements: Sequence[Judgement],
) -> Outcome:
    """Return what a touch says."""
    return Outcome(
        found=True,
        error=touch.ratio / ratio - 1,
        standard_error=touch.standard_error / abs(ratio),
        excluded=any(flag.meaning.excludes(touch) for flag in touch.flags),
        flags=frozenset(map(str, touch.flags)),
        judgements=about(judgements, begin_s, end_s),
    )


def belongs(touch: palpate.Touch, press: Press, session: Session) -> bool:
    """Return whether a touch is the one of a press.

    It begins in the press or a little before it; or it begins earlier, lasts into it, and is right.
    """
    if press.contact_s - EARLY_S < touch.start_s < press.end_s:
        return True
    sample_s = session.pair_s if session.pair_s > MEANS_S / 2 else MEANS_S
    lasts = touch.start_s < press.contact_s < touch.start_s + sample_s * touch.samples
    return lasts and abs(touch.ratio / session.ratio - 1) < WRONG


def judged(session: Session, faulty: frozenset[str], tracker: "palpate.Tracker") -> Played:
    """Return what became of a session that a tracker has taken; `faulty`: channels with faults."""
    judgements: Sequence[Judgement] = getattr(tracker, "judgements", [])
    presses = []
    outside = list(tracker.touches)
    for press in session.presses:
        own = [touch for touch in tracker.touches if belongs(touch, press, session)]
        outside = [touch for touch in outside if touch not in own]
        if not own:
            names = about(judgements, press.contact_s, press.end_s)
            presses.append(Outcome(found=False, judgements=names))
            continue
        longest = max(own, key=lambda touch: touch.samples)
        presses.append(outcome_of(longest, session.ratio, press.contact_s, press.end_s, judgements))
    phantoms = [
        outcome_of(touch, session.ratio, touch.start_s, touch.start_s + LATE_S, judgements)
        for touch in outside
    ]
    said = [one.name for one in judgements if one.channel == "both" or one.channel in faulty]
    return Played(tuple(presses), tuple(phantoms), frozenset(said))


def taken(session: Session, scene: str = "handheld") -> "palpate.Tracker":
    """Give a session to a tracker."""
    tracker = palpate.Tracker("paper") if scene == "paper" else palpate.Tracker("handheld")
    tracker.take(*session.times_s, *session.values)
    tracker.finish()
    return tracker


@cache
def played(world: World, seed: int) -> Played:
    """Make the session of a seed and judge it."""
    session = make(world, seed)
    return judged(session, world.faulty, taken(session))


@dataclass(frozen=True)
class Share:
    """How many of how many."""

    count: int
    of: int

    @property
    def value(self) -> float:
        """The share; nan of none."""
        return self.count / self.of if self.of else math.nan


def share_of(outcomes: Sequence[Outcome], holds: Callable[[Outcome], bool]) -> Share:
    """Return the share of the outcomes for which a condition holds."""
    return Share(sum(map(holds, outcomes)), len(outcomes))


@dataclass(frozen=True)
class Summary:
    """What is measured of a row.

    Attributes
    ----------
    presses : int
    error : float
        Rms of the relative errors of the touches found.
    half_width : float
        Median over the sessions of the median half-width of their intervals, relative.
    shares : dict
    worst_lost : int
        Presses lost in the worst session.
    by_session : list
        (rms error, median half-width) of each session.
    """

    presses: int
    error: float
    half_width: float
    shares: dict[Measure, Share]
    worst_lost: int
    by_session: list[tuple[float, float]] = field(default_factory=list)


def session_figures(session: Played) -> tuple[float, float]:
    """Return rms error and median half-width of a session; nan if all of its presses were lost."""
    found = [outcome for outcome in session.presses if outcome.found]
    if not found:
        return math.nan, math.nan
    return rms([outcome.error for outcome in found]), SIDES * float(
        np.median([outcome.standard_error for outcome in found])
    )


def rms(values: Sequence[float]) -> float:
    """Return the root mean square of the finite values; nan of none."""
    finite = [value for value in values if math.isfinite(value)]
    return float(np.sqrt(np.mean(np.square(finite)))) if finite else math.nan


def median(values: Sequence[float]) -> float:
    """Return the median of the finite values; nan of none."""
    finite = [value for value in values if math.isfinite(value)]
    return float(np.median(finite)) if finite else math.nan


def summary_of(
    sessions: Sequence[Played], names: frozenset[str] = NEW_FLAGS, only: int | None = None
) -> Summary:
    """Summarise sessions, with the names that are right; `only`: number of the press that counts.

    A touch without a press counts as silent, unless something says what it is.
    """
    presses = [
        outcome
        for session in sessions
        for number, outcome in enumerate(session.presses)
        if only is None or number == only
    ]
    phantoms = [outcome for session in sessions for outcome in session.phantoms]
    found = [outcome for outcome in presses if outcome.found]
    silent = Share(
        sum(outcome.silent for outcome in presses)
        + sum(not outcome.flagged for outcome in phantoms),
        len(presses),
    )
    figures = [session_figures(session) for session in sessions]
    return Summary(
        presses=len(presses),
        error=rms([outcome.error for outcome in found]),
        half_width=median([half for _, half in figures]),
        shares={
            Measure.COVERED: share_of(found, lambda outcome: outcome.covered),
            Measure.SILENT: silent,
            Measure.FLAGGED: share_of(presses, lambda outcome: outcome.flagged),
            Measure.NAMED: share_of(presses, lambda outcome: outcome.names(names)),
            Measure.NOTED: share_of(presses, lambda outcome: outcome.noted),
            Measure.CALLED: share_of(presses, lambda outcome: outcome.names(NEW_FLAGS)),
            Measure.LOST: share_of(presses, lambda outcome: not outcome.found),
            Measure.SAID: Share(
                sum(bool(names & session.said) for session in sessions),
                len(sessions),
            ),
        },
        worst_lost=max(session.lost for session in sessions),
        by_session=figures,
    )


@dataclass(frozen=True)
class Limit:
    """The range that a share must be in.

    A share of n presses may be outside by two standard errors of a share of n at the limit.
    """

    measure: Measure
    low: float = 0.0
    high: float = 1.0

    def holds(self, summary: Summary) -> bool:
        """Return whether the share is within the limit."""
        share = summary.shares[self.measure]
        return share.of > 0 and self.low - allowance(
            self.low, share.of
        ) <= share.value <= self.high + allowance(self.high, share.of)

    def __str__(self) -> str:
        """Return the limit as text."""
        if self.high == 0:
            return f"none {self.measure}"
        if self.low == 1:
            return f"all {self.measure}"
        if self.high == 1:
            return f"{self.measure} >= {percent(self.low)}"
        if self.low == 0:
            return f"{self.measure} <= {percent(self.high)}"
        return f"{self.measure} {100 * self.low:.3g}-{percent(self.high)}"


def allowance(limit: float, of: int) -> float:
    """Return two standard errors of a share at its limit."""
    return 2 * math.sqrt(limit * (1 - limit) / of)


def percent(share: float) -> str:
    """Return a share as text."""
    return f"{100 * share:.3g} %"
