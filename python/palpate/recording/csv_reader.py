"""Palpate's own recordings, NAME.csv with its sidecar, read in blocks: only a part is in memory."""

import io
import os
from collections.abc import Iterator
from dataclasses import dataclass
from difflib import SequenceMatcher
from itertools import groupby
from pathlib import Path
from typing import BinaryIO

import numpy as np

from palpate.ad7746.registers import SATURATED_PF
from palpate.errors import RecordingError
from palpate.files import Json, file_errors, open_unpacked
from palpate.messages import quoted
from palpate.recording.counts import Survey
from palpate.recording.integrity import Bytes, Integrity, Known, judge, known_of
from palpate.recording.opened import Damage, GapMark, OpenedRecording
from palpate.recording.recording import Mark, Recording
from palpate.recording.rows import (
    COLUMNS,
    HEADERS,
    VERSIONS,
    Codes,
    codes_of,
    parse_rows,
    unreadable,
)
from palpate.recording.sidecar import BEGUN, load
from palpate.recording_protocol import PartEnd
from palpate.samples import DTYPE, Block, Instrument

_LONGEST_ROW = 256  # bytes; the longest row that palpate writes has some 150
_BEGIN = 256  # bytes in which a file is recognised
_LIKE_HEADER = 0.9  # share of the header: a few damaged bytes; with other delimiters it is below
_FIRST = 1 << 12  # bytes of the rows that show the scale of the codes
# Bytes, some 3,000 rows: more would not stay in the cache, and be new pages for each block.
_CHUNK = 1 << 18
_MOST_GAPS = 5  # in the notes
_ROUNDED_PF = 1e-3  # by a spreadsheet
_MOVED_S = 0.005  # a wall clock that NTP holds moves less in an hour


@dataclass
class _Position:
    """The next line of a file: its number, its offset in bytes, and the number of rows before it."""

    line: int = 1
    offset: int = 0
    rows: int = 0

    def skip(self, lines: int, size: int) -> None:
        """Go on by some lines, of a size in bytes."""
        self.line += lines
        self.offset += size


class RecordingFile(OpenedRecording):
    """A recording made by palpate, read in blocks; see `OpenedRecording` for the other attributes.

    Parameters
    ----------
    path : path-like
    known : Known, optional
        With `data`: the content of its sidecar.
    data : bytes, optional
        The rows as text, of a recording that was converted to another format.

    Attributes
    ----------
    known : Known
        The content of the sidecar; read once, when the recording is opened.
    seen : Bytes
        Counts over the bytes of the last `blocks()`, if it came to the end.
    integrity : Integrity
        Whether the recording is as it was written; known after `blocks()`.
    headed : bool
        Whether the header is complete, after `blocks()`.
    columns : tuple of str
        Names of its columns, after `blocks()`: a recording of an earlier version has fewer.
    codes : Codes or None
        Scale of the codes: from the sidecar; else the AD7746 if the first rows agree with it; else
        None.

    Raises
    ------
    RecordingError
        The file does not exist or is not a recording made by palpate; from `blocks()`: a line is
        not a row.

    Examples
    --------
    >>> recording = RecordingFile("tests/data/four-specimens.csv")
    >>> sum(len(block) for block in recording.blocks()) == recording.survey.rows
    True
    """

    def __init__(
        self, path: str | os.PathLike[str], known: Known | None = None, data: bytes | None = None
    ) -> None:
        super().__init__(Path(path))
        self.data = data
        if data is None and not is_own(self.path):
            reason = (
                f"not a recording made by palpate; its first line has to be {HEADERS[0].decode()}"
            )
            raise RecordingError(self.path, reason)
        self.known: Known = known or known_of(self.path)
        self.sidecar = self.known.sidecar
        self.seen: Bytes = Bytes()
        self.integrity: Integrity = Integrity()
        self.headed: bool = False
        self.columns: tuple[str, ...] = COLUMNS
        self.codes: Codes | None = None
        self._skips_damage = True  # until the rows are wanted
        instrument = Instrument.of(self.describe())
        self.unit = instrument.unit
        self.settings = self.sidecar.settings
        self.host_stamps = instrument.host_stamps
        self.period_s = float(self.settings.get("period", instrument.period_s))
        self.zero_utc_ns = self.sidecar.zero_utc_ns
        tares = self.sidecar.tares
        self.tares = frozenset(mark.seq for mark in tares)
        self.gap_marks = [GapMark(mark.seq, mark.text) for mark in tares if mark.kind == "gap"]
        if self.sidecar.entries:
            self.codes = codes_of(self.sidecar.device)
            self.full_scale_pF = instrument.full_scale_pF
        else:
            self._recognise_codes()
        self._skips_damage = False

    def _recognise_codes(self) -> None:
        """Use the codes of an AD7746 if the first rows agree, but for rounding by a spreadsheet."""
        written = self._first_rows()
        self.codes = Codes()
        computed = self._first_rows()
        for name in ("hard", "soft"):
            near = np.isclose(
                written[name], computed[name], rtol=0, atol=_ROUNDED_PF, equal_nan=True
            )
            if not near.all():
                self.codes = None
                return
        if (computed["hard_raw"][:1] >= 0).any():
            self.full_scale_pF = SATURATED_PF

    def _first_rows(self) -> Block:
        parsed = self._parsed(Bytes(), _FIRST)
        return next(parsed, np.zeros(0, DTYPE))

    @property
    def doubts(self) -> tuple[str, ...]:
        """Differences from the file as it was written; complete after `blocks()`, also in `notes`."""
        return self.integrity.doubts

    @property
    def recorder_notes(self) -> tuple[str, ...]:
        """Notes of the recorder: it began late, or had gaps."""
        notes = [note for note in self.sidecar.notes if note.startswith(BEGUN)]
        for mark in self.gap_marks[:_MOST_GAPS]:
            notes.append(
                f"gap after sample {mark.seq}: {mark.text}: the baseline was measured again"
            )
        more = len(self.gap_marks) - _MOST_GAPS
        if more > 0:
            notes.append(f"{more} more gaps")
        return tuple(notes)

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data; complete after `blocks()`."""
        found = self.integrity
        return (
            *found.doubts,
            *found.limits,
            *found.remarks,
            *self.recorder_notes,
            *self._row_notes(),
        )

    def _row_notes(self) -> Iterator[str]:
        survey = self.survey
        if survey.refused:
            yield (f"{survey.refused} of {survey.rows} rows have no value in a channel: left out")
        if survey.lost:
            yield f"{survey.lost} samples are missing {survey.in_gaps}"
        if survey.backward:
            yield (
                f"time goes back at {survey.backward} of {survey.rows} rows: "
                "the order of the file is used"
            )
        if survey.pause_note:
            yield survey.pause_note
        if self.codes is None:
            yield (
                "the codes are not those of an AD7746, and no sidecar says their scale: left out"
            )
        zero_at_end_ns = self.sidecar.zero_utc_ns_at_end
        if self.zero_utc_ns is not None and zero_at_end_ns is not None:
            moved_s = (zero_at_end_ns - self.zero_utc_ns) / 1e9
            if abs(moved_s) > _MOVED_S:
                yield (
                    f"the wall clock was moved by {moved_s:+.3f} s during the recording: "
                    "UTC is by the clock at its begin"
                )

    def describe(self) -> Json:
        """Return the description of the instrument from the sidecar."""
        if self.sidecar.entries:
            return dict(self.sidecar.device)
        return {"name": "recording", "file": self.path.name}

    def skip_damage(self) -> None:
        """From now on, list damaged places in `damaged`; else the first one is an error."""
        self._skips_damage = True

    def blocks(self) -> Iterator[Block]:
        """Yield the samples in blocks of some thousand; a new one begins after each tare and gap."""
        self.survey = Survey(marked=self.tares, largest_code=(self.codes or Codes()).largest)
        self.integrity = Integrity()
        tares = sorted(self.tares)
        seen = Bytes(self.sidecar.seal.bytes)
        for block in self._parsed(seen, _CHUNK):
            self._count(block)
            if tares:
                cuts = np.flatnonzero(np.isin(block["seq"][:-1], tares)) + 1
                yield from np.split(block, cuts)
            else:
                yield block
        self.integrity = judge(self.known, self.seen)

    def in_memory(self) -> Recording:
        """Read the whole recording into memory."""
        nothing = np.zeros(0)
        columns = [(nothing, nothing, nothing, nothing)]
        rows = 0
        gap_rows = list[int]()
        for part in self.parts(self.full_scale_pF):
            columns.append((*part.seconds, part.hard, part.soft))
            rows += part.pairs
            if part.end is PartEnd.GAP:
                gap_rows.append(rows)
        t_hard_s, t_soft_s, hard, soft = map(np.concatenate, zip(*columns, strict=True))
        return Recording(
            t_hard_s,
            t_soft_s,
            hard,
            soft,
            notes=self.notes,
            unit=self.unit,
            full_scale_pF=self.full_scale_pF,
            host_stamps=self.host_stamps,
            period_s=self.period_s,
            doubts=self.doubts,
            gap_rows=tuple(row for row in gap_rows if row < rows),
            zero_utc_ns=self.zero_utc_ns,
            marks=tuple(Mark(mark.t_s, mark.text) for mark in self.sidecar.marks),
            plan=self.sidecar.session,
        )

    def _parsed(self, seen: Bytes, chunk: int) -> Iterator[Block]:
        """Read the file once, in whole lines; yield the rows in them."""
        self.headed = False
        self.damaged = []
        at = _Position()
        tail = b""
        with file_errors(self.path, "cannot be read"), self._opened() as file:
            while data := file.read(chunk):
                seen.count(data)
                end = data.rfind(b"\n") + 1
                if not end:
                    tail += data
                    continue
                lines = b"".join((tail, memoryview(data)[:end]))  # one copy
                tail = data[end:]
                if not self.headed:
                    header, _, lines = lines.partition(b"\n")
                    self.columns = VERSIONS[HEADERS.index(header.removesuffix(b"\r"))]
                    self.headed = True
                    at.skip(1, len(header) + 1)
                block = self._block(lines, at)
                if len(block):
                    yield block
        seen.rows = at.rows
        seen.torn = len(tail)  # of an incomplete row, or zeros of a power cut
        self.seen = seen
        if len(tail.rstrip(b"\0")) > _LONGEST_ROW:
            reason = f"{len(tail)} bytes without a line end"
            place = Damage(at.line, 1, at.offset, len(tail), at.rows, reason)
            self._add(place)
            seen.torn = 0

    def _opened(self) -> BinaryIO:
        return open_unpacked(self.path) if self.data is None else io.BytesIO(self.data)

    def _block(self, data: bytes, at: _Position) -> Block:
        """Return the lines that are rows, and add the rest as damaged places."""
        try:
            block = parse_rows(data, self.columns, self.codes)
        except ValueError:
            return self._block_of_damaged(data, at)
        at.skip(len(block), len(data))  # each line is a row
        at.rows += len(block)
        return block

    def _block_of_damaged(self, data: bytes, at: _Position) -> Block:
        good = list[bytes]()
        lines = [line + b"\n" for line in data.split(b"\n")[:-1]]
        for reason, group in groupby(lines, lambda line: unreadable(line, self.columns)):
            alike = list(group)
            size = sum(map(len, alike))
            if reason is None:
                good += alike
                at.rows += len(alike)
            else:
                place = Damage(at.line, len(alike), at.offset, size, at.rows, reason)
                self._add(place)
            at.skip(len(alike), size)
        return parse_rows(b"".join(good), self.columns, self.codes)

    def _add(self, place: Damage) -> None:
        if not self._skips_damage:
            advice = (
                "palpate check counts what can still be read, "
                "palpate check --repair takes the rest out"
            )
            raise RecordingError(self.path, f"{place.reason}: damaged; {advice}", place.line)
        self.damaged.append(place)


def is_own(path: Path) -> bool:
    """Return whether palpate made a file: its header, or a truncated one with a sidecar."""
    begin = _begin(path)
    if _first_line(begin) in HEADERS:
        return True
    truncated = begin.rstrip(b"\0")
    return _has_sidecar(path) and any(header.startswith(truncated) for header in HEADERS)


def header_damage(path: Path) -> str:
    """Return the damage in the header of a recording with a sidecar; empty: another file."""
    if not _has_sidecar(path):
        return ""
    begin = _begin(path)
    for header in HEADERS:
        held = begin[: len(header)]
        if SequenceMatcher(None, header, held).ratio() < _LIKE_HEADER:
            continue
        pairs = enumerate(zip(header, held, strict=False), 1)
        place = next((place for place, (a, b) in pairs if a != b), len(held) + 1)
        got = quoted(_first_line(begin).decode(errors="replace"))
        found = f"the header of this recording is damaged at byte {place}: got {got}"
        advice = "write it so, and nothing else, into the first line of a copy; the rows follow it"
        return f"{found}, allowed: {header.decode()}; {advice}"
    return ""


def has_wrong_name(path: Path) -> bool:
    """Return whether a recording with a sidecar has a header with a damaged name.

    A header that somebody wrote again, with other delimiters or one more column, is none.
    """
    names = _first_line(_begin(path)).count(b",")
    alike = any(names == header.count(b",") for header in HEADERS)
    return alike and header_damage(path) != ""


def _begin(path: Path) -> bytes:
    with file_errors(path, "cannot be read"), open_unpacked(path) as file:
        return file.read(_BEGIN)


def _first_line(begin: bytes) -> bytes:
    return begin.partition(b"\n")[0].removesuffix(b"\r")


def _has_sidecar(path: Path) -> bool:
    try:
        return load(path) is not None
    except RecordingError:
        return False
