"""The facts of a recording that a report shows: its begin, board, events, settings, and files."""

import hashlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime, tzinfo
from functools import cached_property
from math import isfinite, nan
from pathlib import Path, PurePath
from typing import NamedTuple

from palpate.files import unpacked_name
from palpate.judgements import judgement_notes, without_repeats
from palpate.messages import shortened
from palpate.recording import sidecar
from palpate.report.findings import AnalysedRecording

_LONGEST = 300  # characters of a text from a sidecar
_TIME = "%Y-%m-%d %H:%M:%S %Z"


class Event(NamedTuple):
    """A note, mark, tare, gap or judgement of a recording."""

    t_s: float
    """Time on the clock of the recording; nan: unknown."""
    kind: str
    text: str


class NamedValue(NamedTuple):
    """A name and its value as text."""

    name: str
    value: str


@dataclass(frozen=True)
class Settings:
    """Settings that one or more recordings have."""

    title: str
    entries: tuple[NamedValue, ...]


class SourceFile(NamedTuple):
    """A file of which the report was made, by its name in the report."""

    name: str
    path: Path

    def checksum(self) -> str:
        """Return its SHA-256."""
        with self.path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()


class RowCounts(NamedTuple):
    """Rows of all recordings, and how many of them are lost, or were refused."""

    rows: int
    lost: int
    refused: int

    @classmethod
    def of(cls, runs: Iterable[AnalysedRecording]) -> "RowCounts":
        """Return the rows of recordings."""
        rows = cls(0, 0, 0)
        for run in runs:
            counts = run.recording.survey
            rows = cls(
                rows.rows + counts.rows, rows.lost + counts.lost, rows.refused + counts.refused
            )
        return rows

    def __str__(self) -> str:
        """Return the numbers as text."""
        return f"{self.rows:,}, {self.lost:,} missing, {self.refused:,} without a value"


@dataclass(frozen=True)
class RecordingFacts:
    """The facts of one recording, read from its document."""

    run: AnalysedRecording

    @property
    def begin(self) -> str:
        """When the recording began, in the zone of the computer that made it; "": unknown.

        By the epoch of its clock, else by the start of the program, which says the zone; UTC
        without it.
        """
        zero_ns = self.run.recording.zero_utc_ns
        zone: tzinfo | None = None
        text = ""
        with suppress(ValueError):
            at = datetime.fromisoformat(self.run.recording.sidecar.started)
            zone = at.tzinfo
            text = f"{at:{_TIME}}"
        if zero_ns is not None and isfinite(self.run.first_s):
            at = datetime.fromtimestamp(zero_ns / 1e9 + self.run.first_s, zone or UTC)
            text = f"{at:{_TIME}}"
        return text.strip()

    @property
    def board(self) -> str:
        """The board, and the fingerprint of its chip."""
        device = self.run.recording.sidecar.device
        inner = device.get("device")
        if not isinstance(inner, dict):
            inner = device
        parts = [shortened(str(inner.get("name", "")))]
        if "fingerprint" in device:
            parts.append(shortened(f"fingerprint {device['fingerprint']}"))
        return joined_once(parts)

    @property
    def remarks(self) -> str:
        """The results of `check`, and the notes of `replay` without the judgements."""
        checked = self.run.checked
        notes = [note for note in self.run.found.touches.notes if note not in self.judged]
        first = [checked.verdict, checked.understood]
        return joined_once([*first, *checked.faults, *checked.findings, *notes], "; ")

    @cached_property
    def judged(self) -> list[str]:
        """What was judged of the readings, as sentences: of many alike the first ones."""
        return list(judgement_notes(self.run.found.judgements))

    @cached_property
    def events(self) -> list[Event]:
        """Notes, marks, tares, gaps and judgements in order of time; first those without one."""
        known = self.run.recording.sidecar
        events = [Event(nan, "note", shortened(note, _LONGEST)) for note in known.notes]
        for mark in known.marks:
            events.append(Event(mark.t_s, mark.kind, mark.text))
        for note in self.run.plan.notes:
            events.append(Event(note.t_s, "note", note.text))
        for judgement in without_repeats(self.run.found.judgements):
            events.append(Event(judgement.time_s, "judged", judgement.text))
        return sorted(events, key=lambda event: (isfinite(event.t_s), event.t_s))

    def settings(self) -> Iterator[Settings]:
        """Yield device and settings, each with its title; empty ones are left out."""
        known = self.run.recording.sidecar
        parts = {
            "Device": known.device,
            "Chip": _chip_conditions(known.conditions),
            "Estimator": self.run.tracking,
            "Recorded by": known.versions,
        }
        for title, values in parts.items():
            entries = tuple(_entries(values))
            if entries:
                yield Settings(title, entries)

    def files(self) -> list[SourceFile]:
        """Return the recording, and its sidecar if there is one."""
        path = self.run.recording.path
        own = path.with_name(unpacked_name(path))
        files = [path]
        if own.suffix.lower() == ".csv" and sidecar.sidecar_path(own).exists():
            files.append(sidecar.sidecar_path(own))
        name = PurePath(self.run.name)
        return [SourceFile(name.with_name(file.name).as_posix(), file) for file in files]


def first_and_last(facts: Iterable[RecordingFacts]) -> list[str]:
    """Return when the first and the last recording began, each once, as far as it is known."""
    begins = sorted(filter(None, (each.begin for each in facts)))
    return list(dict.fromkeys([*begins[:1], *begins[-1:]]))


def joined_once(texts: Iterable[str], between: str = ", ") -> str:
    """Return texts in one line, each once, without empty ones."""
    return between.join(dict.fromkeys(filter(None, texts)))


def shared_settings(facts: Sequence[RecordingFacts]) -> list[Settings]:
    """Return the settings of recordings; equal ones once, with the names of their recordings."""
    names: dict[Settings, list[str]] = {}
    for each in facts:
        for settings in each.settings():
            names.setdefault(settings, []).append(each.run.name)
    shared = []
    for settings, of in names.items():
        title = settings.title
        if len(of) < len(facts):
            title += f" of {', '.join(of)}"
        shared.append(Settings(title, settings.entries))
    return shared


def _entries(values: object, name: str = "") -> Iterator[NamedValue]:
    """Yield names and values; a value in a table has both names."""
    if isinstance(values, Mapping):
        for key, value in values.items():
            yield from _entries(value, f"{name}.{key}".lstrip("."))
    elif values is not None:
        yield NamedValue(name, shortened(str(values), _LONGEST))


def _chip_conditions(conditions: Iterable[object]) -> dict[str, str]:
    """Return the range of temperature and supply of the chip in a recording."""
    values: dict[str, list[float]] = {"temperature_C": [], "supply_V": []}
    for one in conditions:
        if isinstance(one, dict):
            for name in values.keys() & one:
                if isinstance(one[name], int | float):
                    values[name].append(one[name])
    ranges = {}
    for name, known in values.items():
        if known:
            ranges[name] = f"{min(known):.2f} to {max(known):.2f}"
    return ranges
