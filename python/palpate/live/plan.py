"""What is touched: the specimens, which touch was on which of them, which are kept, what comes next, and notes."""

import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from decimal import Decimal
from functools import wraps
from math import inf, isfinite
from pathlib import Path
from threading import RLock
from typing import Any

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
from palpate.live.feed import Document, RefusedCommand
from palpate.live.measurement import AnyMeasurement, LiveMeasurement, RecordedMeasurement
from palpate.materials import KnownModulus
from palpate.messages import quoted
from palpate.recording import session as stored
from palpate.recording.recorder import Recorder
from palpate.recording.session import Specimen
from palpate.recording.sidecar import amend
from palpate.repeatability import objections, session_scatter
from palpate.stream import Listener, Stream
from palpate.touch import Touch
from palpate.uncertainty import RATIOS, RatioOf, hold_ratio

DISCARDED = "discarded"
_EMPTY = stored.Plan()
_NAME, _MODULUS = (
    f"names of 1 to {stored.LONGEST_NAME} characters",
    "moduli above 0, as 30 OO; 0.143",
)
_NEAR_S = 0.5  # between the clocks of a simulated hand and of the samples
_SHOWN = 99  # the newest touches of a specimen


@dataclass
class Done:
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
        self.why = (reasons or ["" if isfinite(self.touch.ratio) else "it has no ratio"])[0]


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


def _order(obey: Callable[..., str]) -> Callable[..., str]:
    """Make an order: what it changes is in the documents, and in the recording before the answer."""

    @wraps(obey)
    def ordered(plan: "TouchPlan", *args: Any, **given: Any) -> str:
        with plan._lock:
            plan._require_amendable()
            message = obey(plan, *args, **given)
            plan._changed(ordered=True)
            recorder = plan._measurement.recorder
        if recorder and recorder.sidecar_trouble:
            message += f" {recorder.sidecar_trouble}."
        return message

    return ordered


class TouchPlan(Listener):
    """The plan of a measurement, and what was done of it; also in the recording, as far as it is within it.

    `calibration`: says which ratio of a touch counts, and which flags exclude it. `document`: the message `session`.
    `rows`: what is known of each touch of the measurement: specimen, kept, and why it is not.
    """

    def __init__(self, measurement: AnyMeasurement, calibration: Calibration | None = None) -> None:
        self._measurement = measurement
        self._recorded = isinstance(measurement, RecordedMeasurement)
        # Title, operator, notes and the kind of ratio; of a recording also the touches before it is read.
        self._plan = plan = measurement.sidecar.session
        # a recorder, and what it has
        self._stored: tuple[Recorder | None, stored.Plan] = (None, plan)
        self._wanted = max(
            (one.wanted for one in plan.specimens), default=1 if self._recorded else 4
        )
        self.progress = Progress(calibration, plan)
        self._lock = RLock()
        # of a recording: of touches that are not found with these settings
        self._unmatched: list[stored.Entry] = []
        self._files = 0
        if isinstance(measurement, LiveMeasurement) and measurement.demo:
            self.progress.name_at = lambda t_s: measurement.pressed(t_s + _NEAR_S)
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
            self._changed()

    def touch(self, number: int, touch: Touch) -> None:
        """Take a touch when it has ended, or was revised."""
        with self._lock:
            self.progress.take(number, touch)
            self._changed()

    def ended(self, error: BaseException | None) -> None:
        """Take the touches of a recording when it has been read."""
        if isinstance(measurement := self._measurement, RecordedMeasurement):
            known = self._plan.matched(measurement.touches, measurement.recording.survey.period_s)
            self.progress.present = [
                Done(
                    number,
                    touch,
                    entry.specimen if entry else None,
                    entry.left_out if entry else None,
                )
                for number, (touch, entry) in enumerate(
                    zip(measurement.touches, known, strict=True), 1
                )
            ]
            found = set(known)
            self._unmatched = [entry for entry in self._plan.touches if entry not in found]
            self._changed()

    @_order
    def plan(self, text: str, wanted: int, unit: str = "MPa", **head: Any) -> str:
        """Take another list of specimens; return the message."""
        specimens = specimens_of(text, wanted, unit)
        self._plan, self._wanted, progress = replace(self._plan, **head), wanted, self.progress
        self._files = len(self._measurement.files.named)  # made for earlier lists
        progress.specimens, progress.over = specimens, False
        if progress.chosen and not progress.named(progress.chosen[1]):
            progress.chosen = None
        touches = "1 touch" if wanted == 1 else f"{wanted} touches"
        found = "1 specimen" if len(specimens) == 1 else f"{len(specimens)} specimens"
        return f"{found}, {touches} of each." if specimens else "No specimens."

    @staticmethod
    def read_list(text: str, unit: str = "MPa") -> Document:
        """Return how each line of a list is read: its modulus, MPa, or what is wrong."""
        read = (
            one and ({"wrong": one} if isinstance(one, str) else _known_modulus(one))
            for one in read_lines(text, 1, unit)
        )
        return {"message": "", "lines": list(read)}

    @_order
    def specimen(self, name: str) -> str:
        """Choose the specimen of the next touch, "": the list decides; return the message."""
        self.progress.chosen = (self._measurement.last_s, self._in_list(name)) if name else None
        self.progress.over = not name
        return self._following() or "All specimens are done: the next touches are of other objects."

    @_order
    def assign(self, touch: int, name: str) -> str:
        """Give a touch another specimen, or none; return the message."""
        done = self._done(touch)
        done.specimen = self._in_list(name) or None
        return f"Touch {touch}: {done.specimen or 'no specimen'}."

    @_order
    def name(self, touches: list[int], text: str) -> str:
        """Give touches a specimen, written as in a list, "": none; a new one comes into the list; return the message."""
        done, found = [self._done(touch) for touch in touches], specimens_of(text, self._wanted)
        if text.strip() and not found:
            raise RefusedCommand(f"name: got {quoted(text)}, allowed: {_NAME}, and {_MODULUS}")
        name, told = None, ""
        for one in found:  # a line is one at most
            name, known = one.name, self.progress.named(one.name)
            if not known:
                self.progress.specimens.append(one)
            elif one.known not in (None, known.known):
                told = f" Its modulus is {one.known} now, before {known.known or 'unknown'}."
                self.progress.change(
                    known,
                    modulus_MPa=one.modulus_MPa,
                    modulus_uncertainty=one.modulus_uncertainty,
                )
        for each in done:
            each.specimen = name
        return f"{'1 touch' if len(done) == 1 else f'{len(done)} touches'}: {name or 'no specimen'}.{told}"

    @_order
    def discard(self, touch: int) -> str:
        """Leave a touch out; return the message."""
        self._done(touch).left_out = DISCARDED
        return f"Touch {touch} is left out. {self._following()}".strip()

    @_order
    def keep(self, touch: int) -> str:
        """Keep a touch, whatever its flags say; return the message."""
        done = self._done(touch)
        if not isfinite(self.progress.ratio_of(done.touch)[0]):
            raise RefusedCommand(f"keep: touch {touch} has no ratio; touch again")
        done.left_out = "" if self.progress.objections(done.touch) else None
        return f"Touch {touch} is kept. {self._following()}".strip()

    @_order
    def more(self) -> str:
        """Want one touch more of the specimen of the last touch, else of the next one; return the message."""
        progress = self.progress
        specimen = progress.named(progress.last or progress.next)
        wanted = max(specimen.wanted, len(progress.kept[specimen.name])) + 1 if specimen else 0
        if not specimen or wanted > stored.MOST_WANTED:
            raise RefusedCommand(
                f"more: allowed: up to {stored.MOST_WANTED} touches of a specimen of the list"
            )
        progress.change(specimen, wanted=wanted)
        progress.chosen = None
        return f"{specimen.name}: {wanted} touches are wanted."

    @_order
    def note(self, text: str) -> str:
        """Add a note; return the message."""
        note = stored.Note(self._measurement.last_s, text)
        self._plan = replace(self._plan, notes=(*self._plan.notes, note))
        return f"Noted: {text}"

    def _changed(self, *, ordered: bool = False) -> None:
        """Make the documents anew; store the plan in the recording, after an order also in one that has ended."""
        progress = self.progress
        progress.settle(self._measurement.last_s)
        rows = self.rows = progress.rows()
        following, count = progress.following(), progress.count()
        if self._recorded:
            following, count = None, {"kept": sum(row["kept"] for row in rows), "of": len(rows)}
        self.document: Document = {
            "title": self._plan.title,
            "operator": self._plan.operator,
            "wanted": self._wanted,
            "specimens": [progress.specimen_row(one) for one in progress.specimens],
            "next": following,
            "count": count,
            "notes": [asdict(note) for note in self._plan.notes],
            "last": {"touch": len(rows), "kept": rows[-1]["kept"]} if rows else None,
            "done": None if self._recorded else progress.result(),
        }
        if recorder := self._measurement.recorder:
            self._store(recorder, wait=ordered)
        elif ordered and isinstance(shown := self._measurement, RecordedMeasurement):
            self._amend(shown.recording.path, -inf, None)
        elif ordered and (ended := self._measurement.newest_recorder) and ended.first_s is not None:
            self._amend(ended.path, ended.first_s, ended)

    def _amend(self, path: Path, first_s: float, recorder: Recorder | None) -> None:
        """Give a recording that has ended the session as it is now."""
        plan, (of, has) = self._within(first_s), self._stored
        amend(path, plan, has if of is recorder else _EMPTY)
        self._stored = recorder, plan

    def _require_amendable(self) -> None:
        shown = self._measurement
        if isinstance(shown, RecordedMeasurement) and (shown.running or not shown.amendable):
            why = "it is still being read" if shown.running else "it has no sidecar with an end"
            made = "a recording of palpate that has ended; palpate convert, or check --repair, makes one"
            raise RefusedCommand(
                f"{shown.recording.path.name}: cannot be changed: {why}, allowed: {made}"
            )

    def _store(self, recorder: Recorder, *, wait: bool = False) -> None:
        """Give a recording the session as it is now: what is within it; `wait` for the disk."""
        with self._lock:
            plan = self._within(-inf if recorder.first_s is None else recorder.first_s)
            of, has = self._stored
            if plan == (has if of is recorder else _EMPTY):
                return
            try:
                recorder.session(plan, wait=wait)
                self._stored = recorder, plan
            except (ValueError, PalpateError) as error:  # no room for it, or closed at this moment
                self._measurement.say(str(error))

    def finished(self) -> tuple[str, str, str] | None:
        """Return title and text of the line, and what was done, from the last wanted touch to the next one; else None."""
        if not (done := self.document["done"]):
            return None
        made = {file["kind"] for file in self._measurement.files.named[self._files :]}
        words = {"calibration": "calibration saved", "report": "report ready"}
        said = ", ".join(word for kind, word in words.items() if kind in made).capitalize()
        text = (
            "The recording goes on until you end it."
            if self._measurement.recorder
            else "Nothing is recorded now."
        )
        text = f"{said}. {text}" if said else text
        kept, all_of = self.document["count"]["kept"], len(self.progress.specimens)
        return (
            f"{kept} of {kept} done.",
            text,
            f"{all_of} specimens; {done['left_out'] or 'none'} left out",
        )

    def _within(self, first_s: float) -> stored.Plan:
        progress = self.progress
        entries = (
            stored.Entry(
                done.touch.start_s, done.specimen, done.left_out or (None if done.why else "")
            )
            for done in progress.present[0 if self._recorded else -stored.MOST_TOUCHES :]
            if (done.specimen or done.why)
            and isfinite(done.touch.start_s)
            and done.touch.start_s >= first_s
        )
        notes = tuple(note for note in self._plan.notes if note.t_s >= first_s)
        ratio = progress.calibration.ratio if progress.calibration else progress.kind
        specimens, touches = tuple(progress.specimens), (*entries, *self._unmatched)
        return replace(self._plan, specimens=specimens, touches=touches, notes=notes, ratio=ratio)

    def _following(self) -> str:
        self.progress.settle(self._measurement.last_s)
        following = None if self._recorded else self.progress.next
        return f"Next: {following}." if following else ""

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

    def _done(self, number: int) -> Done:
        present = self.progress.present
        if not 1 <= number <= len(present):
            raise RefusedCommand(
                f"touch: got {number}, allowed: a touch of this measurement, 1 to {len(present)}"
            )
        return present[number - 1]


class Progress:
    """Specimens and the touches on them, in consecutive measurements.

    A touch is on the specimen that was the next one when it began. The next one is the one that the user has chosen, else
    the specimen of the last touch until as many touches of it are kept as are wanted, else the next one in the list that
    lacks touches.
    """

    def __init__(self, calibration: Calibration | None = None, plan: stored.Plan = _EMPTY) -> None:
        self.specimens = list(plan.specimens)
        self.present: list[Done] = []  # the touches of this measurement
        self.chosen: tuple[float, str] | None = None  # when, s, and which
        self.calibration = calibration
        self.kind = plan.ratio  # that counts without a calibration
        # what is touched at a time, whatever is next
        self.name_at: Callable[[float], str] = lambda _: ""
        self._earlier: list[Done] = []
        self._on: dict[str, list[Done]] = {}
        self.kept: dict[str, list[float]] = {}  # ratios of the kept touches on each specimen
        self.means: dict[str, float] = {}  # of these, by specimen
        self._nexts: list[tuple[float, str | None]] = [(-inf, None)]
        self.over = False  # the user goes on with other objects

    @property
    def ratio_of(self) -> RatioOf:
        """Which ratio of a touch counts."""
        return self.calibration.ratio_of if self.calibration else RATIOS[self.kind]

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
        self.present.append(Done(number, touch, self.on(touch.start_s)))
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

    def change(self, specimen: Specimen, **values: Any) -> None:
        """Give a specimen of the list other values."""
        self.specimens[self.specimens.index(specimen)] = replace(specimen, **values)

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

    def following(self) -> Document | None:
        """Return the specimen of the next touch, for the page."""
        one = self.named(self.next)
        if one is None:
            return None
        nth = len(self.kept[one.name]) + 1
        return {
            "name": one.name,
            "modulus": one.modulus_MPa,
            "nth": nth,
            "of": max(one.wanted, nth),
        }

    def count(self) -> Document:
        """Return how many of the wanted touches are done."""
        kept = sum(min(len(self.kept[one.name]), one.wanted) for one in self.specimens)
        return {"kept": kept, "of": sum(one.wanted for one in self.specimens)}

    def result(self) -> Document | None:
        """Return scatter, and how many known moduli are in their intervals, when all is done, until another object is touched."""
        newest = next(reversed((*self._earlier, *self.present)), None)
        if self.over or self.next or not newest or not self.named(newest.specimen):
            return None
        used, inside = self.calibration, list[bool]()
        kept = {
            one: [done.touch for done in self._on[one.name] if not done.why]
            for one in self.specimens
        }
        pairs = ((one.name, touch) for one, touches in kept.items() for touch in touches)
        scatter = used.touch_scatter if used else session_scatter(pairs, self.ratio_of)
        for one, touches in kept.items():
            if used and one.known:
                modulus = used.mean_modulus(touches)
                inside.append(modulus.agrees_with(one.known))
        left_out = sum(bool(done.why) for of in self._on.values() for done in of)
        counts = {"inside": sum(inside), "of": len(inside), "left_out": left_out}
        return {"scatter": scatter.share, "source": scatter.source, **counts}

    def specimen_row(self, one: Specimen) -> Document:
        """Return a specimen with its touches, for the page."""
        mean = self.means.get(one.name)
        shown = [
            {
                "touch": max(done.number, 0) or None,
                "deviation": self.ratio_of(done.touch)[0] / mean - 1 if mean else None,
                "kept": not done.why,
            }
            for done in self._on[one.name][-_SHOWN:]
        ]
        known = {
            "name": one.name,
            **_known_modulus(one),
            "kept": len(self.kept[one.name]),
            "of": one.wanted,
        }
        return {**known, "mean": mean, "deviations": shown}

    def rows(self) -> list[Document]:
        """Return specimen, whether it is kept, and why not, for each touch of the measurement."""
        return [
            {"specimen": done.specimen, "kept": not done.why, "why": done.why}
            for done in self.present
        ]

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


def specimens_of(text: str, wanted: int, unit: str = "MPa") -> list[Specimen]:
    r"""Return the specimens of a list, as `read_lines` does; `RefusedCommand` has a line for each that is wrong.

    Examples
    --------
    >>> [(one.name, one.modulus_MPa) for one in specimens_of("30 OO; 0,143\ngel 7\n70 A\t8.68", 4)]
    [('30 OO', 0.143), ('gel 7', None), ('70 A', 8.68)]
    >>> specimens_of("30 OO\n30 OO", 4)
    Traceback (most recent call last):
    palpate.live.feed.RefusedCommand: line 2: got '30 OO' again, allowed: each name once
    """
    read = list(read_lines(text, wanted, unit))
    if wrong := [
        f"line {number}: {one}" for number, one in enumerate(read, 1) if isinstance(one, str)
    ]:
        raise RefusedCommand("\n".join(wrong))
    return [one for one in read if isinstance(one, Specimen)]


def _known_modulus(one: Specimen) -> Document:
    """Return the modulus of a specimen, MPa, and its relative uncertainty, for the page."""
    return {"modulus": one.modulus_MPa, "uncertainty": one.modulus_uncertainty}


def read_lines(text: str, wanted: int = 1, unit: str = "MPa") -> Iterator[Specimen | str | None]:
    """Yield the specimen of each line, its fault as a text, or None: it is empty, or the names of columns.

    A line is "name", "name; modulus" or "name; modulus; uncertainty", also with tabs or commas between. A modulus has its
    own unit, else the one of the heading, else `unit`; its standard uncertainty has "%" or a unit, or the heading has.
    The decimal point may be a comma. Of each specimen `wanted` touches are wanted.
    """
    names = set[str]()
    columns = _Columns(without_unit(unit)[1] or 0)
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
class _Columns:
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
        modulus, uncertainty = (before, last) if is_uncertainty else (rest, "")
    return _stripped(name), _stripped(modulus), _stripped(uncertainty)


def _stripped(cell: str) -> str:
    return cell.strip('" \t;')


def _heading(modulus: str, uncertainty: str) -> _Columns | None:
    """Return the units of the names of columns; None: they are not names of columns."""
    bare, power = without_unit(modulus)
    is_named = power is not None or re.search("modul", bare, re.IGNORECASE)
    if not is_named or re.search(r"\d", bare):
        return None
    return _Columns(power or 0, uncertainty_column(uncertainty))


def _specimen(
    name: str, modulus: str, uncertainty: str, columns: _Columns, wanted: int
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
