"""What is touched: the specimens, which touch was on which of them, which are kept, what comes next, and notes."""

import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import wraps
from math import inf, isfinite
from threading import RLock
from typing import Concatenate, ParamSpec

from palpate.calibration import Calibration
from palpate.calibration.modulus_text import (
    ModulusScale,
    uncertainty_column,
    with_uncertainty,
    without_unit,
)
from palpate.errors import CalibrationError, PalpateError
from palpate.flags import advice, sentences
from palpate.importers.units import to_number
from palpate.live.measurement import EndedRecording, Measurement
from palpate.live.protocol import (
    Deviation,
    LastTouchKept,
    NextTouch,
    ReadLine,
    RefusedCommand,
    SessionMessage,
    SessionResult,
    ShownNote,
    SpecimenRow,
    TouchCount,
)
from palpate.materials import KnownModulus
from palpate.messages import quoted
from palpate.recording import session as stored
from palpate.recording.recorder import Recorder
from palpate.recording.session import Specimen
from palpate.recording.sidecar import amend
from palpate.repeatability import objections, session_scatter
from palpate.sources.simulated_hand import SimulatedHand, WantedTouch
from palpate.stream import Listener, Stream
from palpate.touch import Touch
from palpate.uncertainty import RATIOS, RatioOf, hold_ratio

DISCARDED = "discarded"
_EMPTY = stored.Plan()
_NAME = f"names of 1 to {stored.LONGEST_NAME} characters"
_MODULUS = "moduli above 0, as 30 OO; 0.143"
_NEAR_S = 0.5  # between the clocks of a simulated hand and of the samples
_WANTED_IN_DEMO = 2  # touches of each specimen: calibrated in a minute
_SHOWN = 99  # the newest touches of a specimen


_Arguments = ParamSpec("_Arguments")


@dataclass(frozen=True)
class TouchKept:
    """What the plan knows of a touch: its specimen, whether it is kept, and why not."""

    specimen: str | None
    kept: bool
    why: str


@dataclass
class PlannedTouch:
    """A touch that has ended; its number counts from 1, in an earlier measurement it is 0 and less."""

    number: int
    touch: Touch
    specimen: str | None
    left_out: str | None = None  # why; "": it is kept; None: its flags decide
    why: str = ""  # why it is left out now; "": it is kept

    def judge(self, against: Callable[[Touch], Sequence[object]]) -> None:
        """Find why it is left out."""
        if self.left_out is not None:
            self.why = self.left_out
            return
        reasons = sentences(against(self.touch), advice(self.touch))
        self.why = ""
        if reasons:
            self.why = reasons[0]
        elif not isfinite(self.touch.ratio):
            self.why = "it has no ratio"


@dataclass(frozen=True)
class KnownSpecimen:
    """A specimen of known modulus, and its touches: number, touch, and whether it is kept."""

    name: str
    modulus: float  # MPa
    touches: tuple[tuple[int, Touch, bool], ...] = ()
    ratio_of: RatioOf = hold_ratio
    modulus_uncertainty: float = 0.0  # relative

    @property
    def kept(self) -> list[Touch]:
        """The touches that are kept."""
        return [touch for _, touch, kept in self.touches if kept]

    @property
    def usable(self) -> list[Touch]:
        """The kept touches that a fit can use."""
        return [touch for touch in self.kept if not objections(touch, (), self.ratio_of)]


def _changes(
    method: Callable[Concatenate["TouchPlan", _Arguments], str],
) -> Callable[Concatenate["TouchPlan", _Arguments], str]:
    """Publish the change that a command makes, and store it in the recording before the answer."""

    @wraps(method)
    def changed(plan: "TouchPlan", /, *args: _Arguments.args, **keywords: _Arguments.kwargs) -> str:
        with plan._lock:
            plan._measurement.require_amendable()
            message = method(plan, *args, **keywords)
            plan._changed(ordered=True)
            recorder = plan._measurement.recorder
        if recorder and recorder.sidecar_trouble:
            message += f" {recorder.sidecar_trouble}."
        return message

    return changed


class TouchPlan(Listener):
    """The plan of a measurement, and what was done of it; also in the recording, as far as it is within it.

    `calibration`: says which ratio of a touch counts, and which flags exclude it. `document`: the message `session`.
    `rows`: what is known of each touch of the measurement. `version`: number of the last change; after each change
    the functions in `on_changed` are called.
    """

    def __init__(self, measurement: Measurement, calibration: Calibration | None = None) -> None:
        self._measurement = measurement
        self._is_review = measurement.file is not None
        self.version = 0
        self.on_changed: list[Callable[[], None]] = []
        # Title, operator, notes and the kind of ratio; of a recording also the touches before it is read.
        plan = measurement.sidecar.session
        self._plan = plan
        # a recorder, and what it has
        self._stored: tuple[Recorder | None, stored.Plan] = (None, plan)
        self._wanted = max(
            (one.wanted for one in plan.specimens), default=measurement.touches_wanted
        )
        self.progress = Progress(calibration, plan)
        self._lock = RLock()
        # of a recording: of touches that are not found with these settings
        self._unmatched: list[stored.Entry] = []
        self._files = 0  # made before this list, or before its last touch
        self._is_done = False
        measurement.listeners.append(self)
        measurement.recording_begun.append(self._store)
        self._changed()

    def known(self) -> list[KnownSpecimen]:
        """Return the specimens of known modulus with their touches; those of earlier measurements have numbers below 1."""
        with self._lock:
            return self.progress.known()

    @property
    def operator(self) -> str:
        """Who measures; "": not stated."""
        return self._plan.operator

    def use_calibration(self, calibration: Calibration | None) -> None:
        """Use another calibration for all touches; None: no calibration."""
        with self._lock:
            self.progress.calibration = calibration
            self._changed()

    def begun(self, stream: Stream) -> None:
        """Begin with the next measurement."""
        with self._lock:
            self.progress.begin()
            self._plan = replace(self._plan, notes=())
            if stream.source.hand:
                self._follow_hand(stream.source.hand)
            self._changed()

    def _follow_hand(self, hand: SimulatedHand) -> None:
        """Let a simulated hand do what is next; one that is pressed on the page decides itself."""
        hand.follow(self._wanted_touch)
        if not hand.specimens:
            return
        self.progress.name_at = lambda t_s: _pressed_at(hand, t_s)
        if not self.progress.specimens:
            self._wanted = _WANTED_IN_DEMO
            for name, modulus in hand.specimens.items():
                self.progress.specimens.append(Specimen(name, modulus, _WANTED_IN_DEMO))

    def _wanted_touch(self) -> WantedTouch | None:
        """Return the object of the next touch; None: nothing is wanted."""
        following = self.document.next
        return WantedTouch(following.name, following.modulus) if following else None

    def touch(self, number: int, touch: Touch) -> None:
        """Take a touch when it has ended, or was revised."""
        with self._lock:
            self.progress.take(number, touch)
            self._changed()

    def ended(self, error: BaseException | None) -> None:
        """Take the touches of a recording when it has been read."""
        if not self._is_review:
            return
        entries = self._measurement.stored_entries(self._plan)
        self.progress.present = []
        for number, (touch, entry) in enumerate(
            zip(self._measurement.touches, entries, strict=True), 1
        ):
            planned = PlannedTouch(number, touch, None)
            if entry:
                planned.specimen = entry.specimen
                planned.left_out = entry.left_out
            self.progress.present.append(planned)
        found = set(entries)
        self._unmatched = [entry for entry in self._plan.touches if entry not in found]
        self._changed()

    @_changes
    def plan(
        self,
        text: str,
        wanted: int,
        unit: str = "MPa",
        title: str | None = None,
        operator: str | None = None,
    ) -> str:
        """Take another list of specimens; return the message. None: title and operator stay."""
        specimens = specimens_of(text, wanted, unit)
        if title is not None:
            self._plan = replace(self._plan, title=title)
        if operator is not None:
            self._plan = replace(self._plan, operator=operator)
        self._wanted = wanted
        progress = self.progress
        self._files = len(self._measurement.files.named)  # made for earlier lists
        progress.specimens = specimens
        progress.over = False
        if progress.chosen and not progress.named(progress.chosen[1]):
            progress.chosen = None
        if not specimens:
            return "No specimens."
        count = _counted(len(specimens), "specimen", "specimens")
        return f"{count}, {_counted(wanted, 'touch', 'touches')} of each."

    @staticmethod
    def read_list(text: str, unit: str = "MPa") -> list[ReadLine | None]:
        """Return how each line of a list is read: its modulus, MPa, or what is wrong."""
        lines: list[ReadLine | None] = []
        for read in read_lines(text, 1, unit):
            if isinstance(read, Specimen):
                lines.append(ReadLine(read.modulus_MPa, read.modulus_uncertainty))
            else:
                lines.append(ReadLine(wrong=read) if read else None)
        return lines

    @_changes
    def specimen(self, name: str) -> str:
        """Choose the specimen of the next touch, "": the list decides; return the message."""
        self.progress.chosen = None
        if name:
            self.progress.chosen = (self._measurement.last_s, self._in_list(name))
        self.progress.over = not name
        return self._following() or "All specimens are done: the next touches are of other objects."

    @_changes
    def assign(self, touch: int, name: str) -> str:
        """Give a touch another specimen, or none; return the message."""
        done = self._done(touch)
        done.specimen = self._in_list(name) or None
        return f"Touch {touch}: {done.specimen or 'no specimen'}."

    @_changes
    def name(self, touches: list[int], text: str) -> str:
        """Give touches a specimen, written as in a list, "": none; a new one comes into the list; return the message."""
        named = [self._done(touch) for touch in touches]
        found = specimens_of(text, self._wanted)
        if text.strip() and not found:
            raise RefusedCommand(f"name: got {quoted(text)}, allowed: {_NAME}, and {_MODULUS}")
        name = None
        remark = ""
        for one in found:  # a line is one at most
            name = one.name
            remark = self._add(one)
        for each in named:
            each.specimen = name
        count = _counted(len(named), "touch", "touches")
        return f"{count}: {name or 'no specimen'}.{remark}"

    def _add(self, one: Specimen) -> str:
        """Add a specimen to the list, or take its modulus; return a remark on another modulus."""
        known = self.progress.named(one.name)
        if not known:
            self.progress.specimens.append(one)
            return ""
        if one.known in (None, known.known):
            return ""
        changed = replace(
            known, modulus_MPa=one.modulus_MPa, modulus_uncertainty=one.modulus_uncertainty
        )
        self.progress.change(known, changed)
        return f" Its modulus is {one.known} now, before {known.known or 'unknown'}."

    @_changes
    def discard(self, touch: int) -> str:
        """Leave a touch out; return the message."""
        self._done(touch).left_out = DISCARDED
        return f"Touch {touch} is left out. {self._following()}".strip()

    @_changes
    def keep(self, touch: int) -> str:
        """Keep a touch, whatever its flags say; return the message."""
        done = self._done(touch)
        if not isfinite(self.progress.ratio_of(done.touch)[0]):
            raise RefusedCommand(f"keep: touch {touch} has no ratio; touch again")
        done.left_out = "" if self.progress.objections(done.touch) else None
        return f"Touch {touch} is kept. {self._following()}".strip()

    @_changes
    def more(self) -> str:
        """Want one touch more of the specimen of the last touch, else of the next one; return the message."""
        progress = self.progress
        specimen = progress.named(progress.last or progress.next)
        wanted = 0
        if specimen:
            wanted = max(specimen.wanted, len(progress.kept[specimen.name])) + 1
        if not specimen or wanted > stored.MOST_WANTED:
            raise RefusedCommand(
                f"more: allowed: up to {stored.MOST_WANTED} touches of a specimen of the list"
            )
        progress.change(specimen, replace(specimen, wanted=wanted))
        progress.chosen = None
        return f"{specimen.name}: {wanted} touches are wanted."

    @_changes
    def note(self, text: str) -> str:
        """Add a note; return the message."""
        note = stored.Note(self._measurement.last_s, text)
        self._plan = replace(self._plan, notes=(*self._plan.notes, note))
        return f"Noted: {text}"

    def _changed(self, *, ordered: bool = False) -> None:
        """Make the message again; store the plan in the recording, after an order also in one that has ended."""
        progress = self.progress
        progress.settle(self._measurement.last_s)
        self.rows: list[TouchKept] = progress.rows()
        self.document: SessionMessage = self._message()
        self._forget_earlier_files()
        self._put_into_recording(ordered=ordered)
        self.version += 1
        for notify in self.on_changed:
            notify()

    def _forget_earlier_files(self) -> None:
        """Forget the files from before the last wanted touch: a report of them lacks touches."""
        was_done = self._is_done
        self._is_done = self.document.done is not None
        if self._is_done and not was_done:
            self._files = len(self._measurement.files.named)

    def _message(self) -> SessionMessage:
        progress = self.progress
        rows = self.rows
        following = progress.following()
        count = progress.count()
        result = progress.result()
        if self._is_review:
            following = None
            count = TouchCount(sum(row.kept for row in rows), len(rows))
            result = None
        return SessionMessage(
            title=self._plan.title,
            operator=self._plan.operator,
            wanted=self._wanted,
            specimens=[progress.specimen_row(one) for one in progress.specimens],
            next=following,
            count=count,
            notes=[ShownNote(note.t_s, note.text) for note in self._plan.notes],
            last=LastTouchKept(len(rows), rows[-1].kept) if rows else None,
            done=result,
        )

    def _put_into_recording(self, *, ordered: bool) -> None:
        recorder = self._measurement.recorder
        ended = self._measurement.ended_recording
        if recorder:
            self._store(recorder, wait=ordered)
        elif ordered and ended:
            self._amend(ended)

    def _stored_in(self, recorder: Recorder | None) -> stored.Plan:
        """Return the plan that a recording has."""
        if self._stored[0] is recorder:
            return self._stored[1]
        return _EMPTY

    def _amend(self, ended: EndedRecording) -> None:
        """Give a recording that has ended the session as it is now."""
        plan = self._within(ended.first_s)
        amend(ended.path, plan, self._stored_in(ended.recorder))
        self._stored = (ended.recorder, plan)

    def _store(self, recorder: Recorder, *, wait: bool = False) -> None:
        """Give a recording the session as it is now: what is within it; `wait` for the disk."""
        with self._lock:
            plan = self._within(-inf if recorder.first_s is None else recorder.first_s)
            if plan == self._stored_in(recorder):
                return
            try:
                recorder.session(plan, wait=wait)
                self._stored = (recorder, plan)
            except (ValueError, PalpateError) as error:  # no room for it, or closed at this moment
                self._measurement.notify(str(error))

    def finished(self) -> tuple[str, str, str] | None:
        """Return title and text of the line, and what was done, from the last wanted touch to the next one; else None."""
        result = self.document.done
        if not result:
            return None
        made = {file.kind for file in self._measurement.files.named[self._files :]}
        done = []
        if "calibration" in made:
            done.append("calibration saved")
        if "report" in made:
            done.append("report ready")
        text = "Nothing is recorded now."
        if self._measurement.recorder:
            text = "The recording goes on until you end it."
        if done:
            text = f"{', '.join(done).capitalize()}. {text}"
        kept = self.document.count.kept
        specimens = len(self.progress.specimens)
        return (
            f"{kept} of {kept} done.",
            text,
            f"{specimens} specimens; {result.left_out or 'none'} left out",
        )

    def _within(self, first_s: float) -> stored.Plan:
        """Return the plan with what was done from a time on."""
        progress = self.progress
        newest = progress.present
        if not self._is_review:
            newest = newest[-stored.MOST_TOUCHES :]
        touches = []
        for done in newest:
            start_s = done.touch.start_s
            if (done.specimen or done.why) and isfinite(start_s) and start_s >= first_s:
                left_out = done.left_out or (None if done.why else "")
                touches.append(stored.Entry(start_s, done.specimen, left_out))
        ratio = progress.kind
        if progress.calibration:
            ratio = progress.calibration.ratio
        return replace(
            self._plan,
            specimens=tuple(progress.specimens),
            touches=(*touches, *self._unmatched),
            notes=tuple(note for note in self._plan.notes if note.t_s >= first_s),
            ratio=ratio,
        )

    def _following(self) -> str:
        self.progress.settle(self._measurement.last_s)
        following = self.progress.next
        if self._is_review or not following:
            return ""
        return f"Next: {following}."

    def _in_list(self, name: str) -> str:
        if name and not self.progress.named(name):
            names = (
                ", ".join(one.name for one in self.progress.specimens[:10])
                or "none: write a list first"
            )
            raise RefusedCommand(
                f"name: got {name!r:.60}, allowed: a specimen of the list: {names}"
            )
        return name

    def _done(self, number: int) -> PlannedTouch:
        present = self.progress.present
        if not 1 <= number <= len(present):
            raise RefusedCommand(
                f"touch: got {number}, allowed: a touch of this measurement, 1 to {len(present)}"
            )
        return present[number - 1]


def _pressed_at(hand: SimulatedHand, t_s: float) -> str:
    """Return the name of what a simulated hand presses, or pressed last, when a touch begins."""
    name = ""
    for truth in hand.truths:
        if truth.start_s < t_s + _NEAR_S:
            name = truth.name
    return name


class Progress:
    """Specimens and the touches on them, in consecutive measurements.

    A touch is on the specimen that was the next one when it began. The next one is the one that the user has chosen, else
    the specimen of the last touch until as many touches of it are kept as are wanted, else the next one in the list that
    lacks touches.
    """

    def __init__(self, calibration: Calibration | None = None, plan: stored.Plan = _EMPTY) -> None:
        self.specimens = list(plan.specimens)
        self.present: list[PlannedTouch] = []  # the touches of this measurement
        self.chosen: tuple[float, str] | None = None  # when, s, and which
        self.calibration = calibration
        self.kind = plan.ratio  # that counts without a calibration
        # what is touched at a time, whatever is next
        self.name_at: Callable[[float], str] = lambda _: ""
        self._earlier: list[PlannedTouch] = []
        self._on: dict[str, list[PlannedTouch]] = {}
        self.kept: dict[str, list[float]] = {}  # ratios of the kept touches on each specimen
        self.means: dict[str, float] = {}  # of these, by specimen
        self._nexts: list[tuple[float, str | None]] = [(-inf, None)]
        self.over = False  # the user goes on with other objects

    @property
    def ratio_of(self) -> RatioOf:
        """Which ratio of a touch counts."""
        if self.calibration:
            return self.calibration.ratio_of
        return RATIOS[self.kind]

    def objections(self, touch: Touch) -> tuple[str, ...]:
        """Return why a touch does not count."""
        if self.calibration:
            return self.calibration.objections(touch)
        return objections(touch, ratio_of=self.ratio_of)

    def begin(self) -> None:
        """Begin a new measurement: times and numbers begin again; what was done stays."""
        self._earlier += self.present
        for done in self._earlier:
            done.number -= len(self.present)
        self.present = []
        if self.chosen:
            self.chosen = (-inf, self.chosen[1])
        self._nexts = [(-inf, None)]
        self.settle(-inf)

    def take(self, number: int, touch: Touch) -> None:
        """Take a touch that is new, or was revised."""
        if number <= len(self.present):
            self.present[number - 1].touch = touch
            return
        self.present.append(PlannedTouch(number, touch, self.on(touch.start_s)))
        if self.chosen and not self.chosen[0] > touch.start_s:
            self.chosen = None
        self.settle(touch.start_s)

    def on(self, start_s: float) -> str | None:
        """Return the specimen of a touch that began then: what was next, whatever was chosen since; None: no specimen."""
        before = (name for t_s, name in reversed(self._nexts) if not t_s > start_s)
        return self.name_at(start_s) or next(before, None)

    def settle(self, t_s: float) -> None:
        """Judge each touch after a change at a time, s, and note what comes next from then on."""
        self._on, self.kept = defaultdict(list), defaultdict(list)
        for done in (*self._earlier, *self.present):
            done.judge(self.objections)
            if done.specimen:
                self._on[done.specimen].append(done)
                if not done.why and isfinite(ratio := self.ratio_of(done.touch)[0]):
                    self.kept[done.specimen].append(ratio)
        self.means = {name: sum(kept) / len(kept) for name, kept in self.kept.items() if kept}
        if (name := self.next) != self._nexts[-1][1]:
            self._nexts.append((t_s, name))

    def change(self, specimen: Specimen, changed: Specimen) -> None:
        """Put a specimen into the place of another one in the list."""
        self.specimens[self.specimens.index(specimen)] = changed

    @property
    def since_s(self) -> float:
        """Since when the next specimen is the next one, s: a touch that began before is not on it."""
        return self._nexts[-1][0]

    @property
    def next(self) -> str | None:
        """Name of the specimen of the next touch; None: nothing is lacking."""
        if self.chosen:
            return self.chosen[1]
        last = self.last
        first = next((place for place, one in enumerate(self.specimens) if one.name == last), 0)
        in_turn = [*self.specimens[first:], *self.specimens[:first]]
        return next((one.name for one in in_turn if len(self.kept[one.name]) < one.wanted), None)

    def named(self, name: str | None) -> Specimen | None:
        """Return the specimen with this name; None: it is not in the list."""
        return next((one for one in self.specimens if one.name == name), None)

    def following(self) -> NextTouch | None:
        """Return the specimen of the next touch, for the page."""
        one = self.named(self.next)
        if one is None:
            return None
        nth = len(self.kept[one.name]) + 1
        return NextTouch(one.name, one.modulus_MPa, nth, max(one.wanted, nth))

    def count(self) -> TouchCount:
        """Return how many of the wanted touches are done."""
        kept = 0
        wanted = 0
        for one in self.specimens:
            kept += min(len(self.kept[one.name]), one.wanted)
            wanted += one.wanted
        return TouchCount(kept, wanted)

    def result(self) -> SessionResult | None:
        """Return scatter, and how many known moduli are in their intervals, when all is done, until another object is touched."""
        newest = next(reversed((*self._earlier, *self.present)), None)
        if self.over or self.next or not newest or not self.named(newest.specimen):
            return None
        used = self.calibration
        pairs = []
        known = 0
        inside = 0
        for one in self.specimens:
            kept = [done.touch for done in self._on[one.name] if not done.why]
            pairs += [(one.name, touch) for touch in kept]
            if used and one.known:
                known += 1
                inside += used.mean_modulus(kept).agrees_with(one.known)
        scatter = used.touch_scatter if used else session_scatter(pairs, self.ratio_of)
        left_out = 0
        for touches in self._on.values():
            left_out += sum(bool(done.why) for done in touches)
        return SessionResult(scatter.share, scatter.source, inside, known, left_out)

    def specimen_row(self, one: Specimen) -> SpecimenRow:
        """Return a specimen with its touches, for the page."""
        mean = self.means.get(one.name)
        shown = []
        for done in self._on[one.name][-_SHOWN:]:
            deviation = self.ratio_of(done.touch)[0] / mean - 1 if mean else None
            shown.append(Deviation(max(done.number, 0) or None, deviation, not done.why))
        return SpecimenRow(
            one.name,
            one.modulus_MPa,
            one.modulus_uncertainty,
            len(self.kept[one.name]),
            one.wanted,
            mean,
            shown,
        )

    def rows(self) -> list[TouchKept]:
        """Return what is known of each touch of the measurement."""
        return [TouchKept(done.specimen, not done.why, done.why) for done in self.present]

    def known(self) -> list[KnownSpecimen]:
        """Return the specimens of known modulus with their touches."""
        found = []
        for one in self.specimens:
            touches = tuple((done.number, done.touch, not done.why) for done in self._on[one.name])
            if one.known:
                found.append(
                    KnownSpecimen(
                        one.name, one.known.modulus, touches, modulus_uncertainty=one.known.own
                    )
                )
        return found

    @property
    def last(self) -> str | None:
        """The specimen of the last touch that was on one of the list."""
        newest_first = (
            done.specimen for part in (self.present, self._earlier) for done in reversed(part)
        )
        return next((name for name in newest_first if self.named(name)), None)


def _counted(number: int, one: str, many: str) -> str:
    return f"1 {one}" if number == 1 else f"{number} {many}"


def specimens_of(text: str, wanted: int, unit: str = "MPa") -> list[Specimen]:
    r"""Return the specimens of a list, as `read_lines` does; `RefusedCommand` has a line for each that is wrong.

    Examples
    --------
    >>> [(one.name, one.modulus_MPa) for one in specimens_of("30 OO; 0,143\ngel 7\n70 A\t8.68", 4)]
    [('30 OO', 0.143), ('gel 7', None), ('70 A', 8.68)]
    >>> specimens_of("30 OO\n30 OO", 4)
    Traceback (most recent call last):
    palpate.live.protocol.RefusedCommand: line 2: got '30 OO' again, allowed: each name once
    """
    specimens = []
    wrong = []
    for number, read in enumerate(read_lines(text, wanted, unit), 1):
        if isinstance(read, Specimen):
            specimens.append(read)
        elif read:
            wrong.append(f"line {number}: {read}")
    if wrong:
        raise RefusedCommand("\n".join(wrong))
    return specimens


def read_lines(text: str, wanted: int = 1, unit: str = "MPa") -> Iterator[Specimen | str | None]:
    """Yield the specimen of each line, its fault as a text, or None: it is empty, or the names of columns.

    A line is "name", "name; modulus" or "name; modulus; uncertainty", also with tabs or commas between. A modulus has its
    own unit, else the one of the heading, else `unit`; its standard uncertainty has "%" or a unit, or the heading has.
    The decimal point may be a comma. Of each specimen `wanted` touches are wanted.
    """
    names = set[str]()
    columns = _ListColumns(without_unit(unit)[1] or 0)
    for line in text.splitlines():
        name, modulus, uncertainty = _cells(line)
        try:
            heading = None if names else _heading(modulus, uncertainty)
            if heading or not (name or modulus):
                columns = heading or columns
                yield None
                continue
            specimen = _specimen(name, modulus, uncertainty, columns, wanted)
        except CalibrationError as error:
            yield str(error)
            continue
        except ValueError:  # no number, or no name
            allowed = _MODULUS if 0 < len(name) <= stored.LONGEST_NAME else _NAME
            yield f"got {quoted(line)}, allowed: {allowed}"
            continue
        if name in names:
            yield f"got {quoted(name)} again, allowed: each name once"
        else:
            yield specimen
        names.add(name)


@dataclass(frozen=True)
class _ListColumns:
    """The units of a list: power of ten of the moduli in MPa, and unit of the uncertainties."""

    power: int
    uncertainty: ModulusScale | None = None


def _cells(line: str) -> tuple[str, str, str]:
    """Return the three parts of a line; in a line without a tab and a semicolon commas are between them."""
    between = next((mark for mark in "\t;" if mark in line), ",")
    name, _, rest = line.partition(between)
    modulus, _, uncertainty = rest.partition(between)
    if between == ",":  # it may be a decimal one, too
        before, _, last = rest.rpartition(",")
        is_uncertainty = "%" in last or "uncertainty" in last
        modulus = before if is_uncertainty else rest
        uncertainty = last if is_uncertainty else ""
    return _stripped(name), _stripped(modulus), _stripped(uncertainty)


def _stripped(cell: str) -> str:
    return cell.strip('" \t;')


def _heading(modulus: str, uncertainty: str) -> _ListColumns | None:
    """Return the units of the names of columns; None: they are not names of columns."""
    bare, power = without_unit(modulus)
    is_named = power is not None or re.search("modul", bare, re.IGNORECASE)
    if not is_named or re.search(r"\d", bare):
        return None
    return _ListColumns(power or 0, uncertainty_column(uncertainty))


def _specimen(
    name: str, modulus: str, uncertainty: str, columns: _ListColumns, wanted: int
) -> Specimen:
    """Return the specimen of a line; ValueError: no number, or no name."""
    if not modulus:
        return Specimen(name, None, wanted)
    bare, power = without_unit(modulus)
    if power is None:
        power = columns.power
    value = float(Decimal(str(to_number(bare))).scaleb(power))
    if not uncertainty:
        return Specimen(name, value, wanted)
    known = with_uncertainty(KnownModulus(value), uncertainty, columns.uncertainty)
    return Specimen(name, value, wanted, known.uncertainty)
