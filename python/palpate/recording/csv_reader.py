"""A recording as a sequence of blocks, only a part of which is in memory."""

import io
import math
import os
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746.registers import SATURATED_PF
from palpate.errors import RecordingError
from palpate.files import file_errors, open_unpacked
from palpate.recording import sidecar
from palpate.recording.counts import Survey
from palpate.recording.integrity import Bytes, Integrity, Known, judge, known_of
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
from palpate.recording.session import plan_of
from palpate.samples import DTYPE, Block, usable

_LONGEST_ROW = 256  # bytes; the longest row that palpate writes has some 150
_BEGIN = 256  # bytes in which a file is recognised
_FIRST = 1 << 12  # bytes of the rows that show the scale of the codes
_CHUNK = (
    1 << 18
)  # bytes, some 3,000 rows: more would not stay in the cache, and be new pages for each block
_MOST_GAPS = 5  # in the notes
_ROUNDED_PF = 1e-3  # by a spreadsheet
_MOVED_S = 0.005  # a wall clock that NTP holds moves less in an hour


class Damage(NamedTuple):
    """A place in a file that is no row, and was not left by a writer that was stopped.

    Attributes
    ----------
    line, lines : int
        Number of its first line, from 1; number of lines.
    offset, bytes : int
        Where it begins in the file, and its length.
    rows_before : int
        Rows of the file before it.
    reason : str
    """

    line: int
    lines: int
    offset: int
    bytes: int
    rows_before: int
    reason: str


class RecordingFile:
    """A recording made by palpate, read in blocks.

    Parameters
    ----------
    path : path-like
    known : Known, optional
        With `data`: what its sidecar says.
    data : bytes, optional
        The rows as text, of a recording that was converted to another format.

    Attributes
    ----------
    path : pathlib.Path
    known : Known
        What the sidecar says; read once, when the recording is opened.
    document : dict
        The sidecar; empty without a valid one.
    survey : Survey
        Counts over the blocks of the last `blocks()`.
    seen : Bytes
        Counts over the bytes of the last `blocks()`, if it came to the end.
    integrity : Integrity
        Whether the recording is as it was written; known after `blocks()`.
    headed : bool
        Whether the header is complete, after `blocks()`.
    columns : tuple of str
        Names of its columns, after `blocks()`: a recording of an earlier version has fewer.
    codes : Codes or None
        Scale of the codes: from the sidecar; else the AD7746 if the first rows agree with it; else None.
    full_scale_pF : float
        Full scale, pF: from the sidecar; else the range of the AD7746 if rows have codes; else inf.
    settings : dict
        Scene and settings of the live measurement; empty if unknown.
    host_stamps : bool
        Whether the computer stamped the samples when they arrived, from the sidecar.
    period_s : float
        From pair to pair, as the live measurement knew it, else the device, s; 0: unknown.
    zero_utc_ns : int or None
        UTC of t = 0, ns since 1970, by the wall clock at the begin; None: unknown.
    tares : frozenset of int
        Numbers of the samples after which the baseline was measured again; each is the last of a block.
    gap_marks : list of (int, str)
        Those of `tares` that are before a gap, each with what happened there: the board was opened again, ...
    timed : bool
        True: every row has its times. A table of another program may have none.
    understood : str
        Empty: nothing had to be understood, as it has for a table of another program.

    Raises
    ------
    RecordingError
        The file does not exist or is not a recording made by palpate; from `blocks()`: a line is not a row.

    Examples
    --------
    >>> recording = RecordingFile("tests/data/four-specimens.csv")
    >>> sum(len(block) for block in recording.blocks()) == recording.survey.rows
    True
    """

    timed = True
    understood = ""

    def __init__(
        self, path: str | os.PathLike[str], known: Known | None = None, data: bytes | None = None
    ) -> None:
        self.path: Path = Path(path)
        self.data = data
        if data is None and not is_own(self.path):
            reason = (
                f"not a recording made by palpate; its first line has to be {HEADERS[0].decode()}"
            )
            raise RecordingError(self.path, reason)
        self.known: Known = known or known_of(self.path)
        self.document: dict[str, Any] = self.known.document
        self.survey: Survey = Survey()
        self.seen: Bytes = Bytes()
        self.integrity: Integrity = Integrity()
        self.headed: bool = False
        self.columns: tuple[str, ...] = COLUMNS
        self.codes: Codes | None = None
        self.full_scale_pF: float = math.inf
        self.unit: str = str(self.describe().get("unit", "pF"))
        self.settings: dict[str, Any] = sidecar.settings_of(self.document)
        self.host_stamps: bool = self.describe().get("stamps") == "host"
        self.period_s: float = float(
            self.settings.get("period", self.describe().get("period_s", 0.0))
        )
        self.zero_utc_ns: int | None = sidecar.zero_of(self.document)[0]
        tares = sidecar.tares_of(self.document)
        self.tares: frozenset[int] = frozenset(seq for seq, _, _ in tares)
        self.gap_marks: list[tuple[int, str]] = [
            (seq, text) for seq, text, is_gap in tares if is_gap
        ]
        if self.document:
            device = self.document["device"]
            self.codes, self.full_scale_pF = (
                codes_of(device),
                float(device.get("full_scale_pF", math.inf)),
            )
        else:
            self._recognise_codes()

    def _recognise_codes(self) -> None:
        """Use the codes as those of an AD7746 if the first rows agree, within what a spreadsheet may round."""
        written = self._first_rows()
        self.codes = Codes()
        computed = self._first_rows()
        near: dict[str, Any] = {"rtol": 0, "atol": _ROUNDED_PF, "equal_nan": True}
        if not all(np.allclose(written[name], computed[name], **near) for name in ("hard", "soft")):
            self.codes = None
        elif (computed["hard_raw"][:1] >= 0).any():
            self.full_scale_pF = SATURATED_PF

    def _first_rows(self) -> Block:
        return next(self._parsed(Bytes(), _FIRST, []), np.zeros(0, DTYPE))

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is not as it was written, after `blocks()`: results may be wrong. They are in `notes`, too."""
        return self.integrity.doubts

    @property
    def told(self) -> tuple[str, ...]:
        """What the recorder said: it began late, or had gaps."""
        marks, more = self.gap_marks[:_MOST_GAPS], len(self.gap_marks) - _MOST_GAPS
        gaps = [
            f"gap after sample {seq}: {text}: the baseline was measured again"
            for seq, text in marks
        ]
        begun = [
            str(note)
            for note in self.document.get("notes", [])
            if str(note).startswith(sidecar.BEGUN)
        ]
        return (*begun, *gaps, *([f"{more} more gaps"] if more > 0 else []))

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data; complete after `blocks()`."""
        survey, found = self.survey, self.integrity
        begin, end = sidecar.zero_of(self.document)
        moved_s = 0.0 if begin is None or end is None else (end - begin) / 1e9
        moved = f"the wall clock was moved by {moved_s:+.3f} s during the recording: UTC is by the clock at its begin"
        order = "the order of the file is used"
        notes = {
            f"{survey.refused} of {survey.rows} rows have no value in a channel: left out": survey.refused,
            f"{survey.lost} samples are missing {survey.in_gaps}": survey.lost,
            f"time goes back at {survey.backward} of {survey.rows} rows: {order}": survey.backward,
            survey.told_pause: survey.told_pause,
            "the codes are not those of an AD7746, and no sidecar says their scale: left out": self.codes
            is None,
            moved: abs(moved_s) > _MOVED_S,
        }
        said = (note for note, is_so in notes.items() if is_so)
        return (*found.doubts, *found.limits, *found.remarks, *self.told, *said)

    def describe(self) -> dict[str, Any]:
        """Return the description of the instrument from the sidecar."""
        return (
            dict(self.document["device"])
            if self.document
            else {"name": "recording", "file": self.path.name}
        )

    def blocks(self, damage: list[Damage] | None = None) -> Iterator[Block]:
        """Yield the samples in blocks of some thousand.

        Parameters
        ----------
        damage : list of Damage, optional
            Damaged places are left out and added to this list. Without it, the first one is an error.

        Yields
        ------
        numpy.ndarray, shape (n,), of `palpate.SampleRing.dtype`
        """
        self.survey = Survey(marked=self.tares, largest_code=(self.codes or Codes()).largest)
        self.integrity, tares = Integrity(), sorted(self.tares)
        for block in self._parsed(Bytes(self.known.sealed("bytes")), _CHUNK, damage):
            self.survey.add(block)
            if tares:
                cuts = np.flatnonzero(np.isin(block["seq"][:-1], tares)) + 1
                yield from np.split(block, cuts)
            else:
                yield block
        self.integrity = judge(self.known, self.seen)

    @property
    def recording(self) -> Recording:
        """The whole recording in memory."""
        parts = [self._arrays(np.zeros(0, DTYPE))]
        rows = 0
        rows_after_gaps = list[int]()
        last_before_gaps = [seq for seq, _ in self.gap_marks]
        for block in self.blocks():
            parts.append(self._arrays(block))
            rows += len(block)
            if block["seq"][-1] in last_before_gaps:
                rows_after_gaps.append(rows)
        t_hard_s, t_soft_s, hard, soft = map(np.concatenate, zip(*parts, strict=True))
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
            gap_rows=tuple(row for row in rows_after_gaps if row < rows),
            zero_utc_ns=self.zero_utc_ns,
            marks=tuple(Mark(*mark) for mark in sidecar.marks_of(self.document)),
            plan=plan_of(self.document),
        )

    def _arrays(self, block: Block) -> tuple[NDArray[np.float64], ...]:
        """Return both times, s, and both usable readings."""
        hard, soft = usable(block, self.full_scale_pF)
        return block["t_hard_ns"] / 1e9, block["t_soft_ns"] / 1e9, hard, soft

    def _parsed(self, seen: Bytes, chunk: int, damage: list[Damage] | None) -> Iterator[Block]:
        """Read the file once, in whole lines; yield the rows in them."""
        self.headed, tail = False, b""
        line, offset, rows = 1, 0, 0  # of what comes next
        with file_errors(self.path, "cannot be read"), self._opened() as file:
            while data := file.read(chunk):
                seen.count(data)
                end = data.rfind(b"\n") + 1
                if not end:
                    tail += data
                    continue
                lines, tail = b"".join((tail, memoryview(data)[:end])), data[end:]  # one copy
                if not self.headed:
                    first, _, lines = lines.partition(b"\n")
                    self.columns, self.headed = (
                        VERSIONS[HEADERS.index(first.removesuffix(b"\r"))],
                        True,
                    )
                    line, offset = 2, len(first) + 1
                block = self._block(lines, line, offset, rows, damage)
                line += lines.count(b"\n") if damage else len(block)  # each line is a row
                offset += len(lines)
                rows += len(block)
                if len(block):
                    yield block
        seen.rows, seen.torn, self.seen = (
            rows,
            len(tail),
            seen,
        )  # torn: of an incomplete row, or zeros of a power cut
        if len(tail.rstrip(b"\0")) > _LONGEST_ROW:
            self._add(
                Damage(line, 1, offset, len(tail), rows, f"{len(tail)} bytes without a line end"),
                damage,
            )
            seen.torn = 0

    def _opened(self) -> BinaryIO:
        return open_unpacked(self.path) if self.data is None else io.BytesIO(self.data)

    def _block(
        self, data: bytes, line: int, offset: int, rows: int, damage: list[Damage] | None
    ) -> Block:
        """Return the lines that are rows, and add the rest as damaged places."""
        try:
            return parse_rows(data, self.columns, self.codes)
        except ValueError:
            good = list[bytes]()
        lines = [each + b"\n" for each in data.split(b"\n")[:-1]]
        for reason, group in groupby(lines, lambda each: unreadable(each, self.columns)):
            alike = list(group)
            size = sum(map(len, alike))
            if reason is None:
                good += alike
            else:
                self._add(Damage(line, len(alike), offset, size, rows + len(good), reason), damage)
            line, offset = line + len(alike), offset + size
        return parse_rows(b"".join(good), self.columns, self.codes)

    def _add(self, place: Damage, damage: list[Damage] | None) -> None:
        if damage is None:
            advice = "damaged; palpate check counts what can still be read, palpate check --repair takes the rest out"
            raise RecordingError(self.path, f"{place.reason}: {advice}", place.line)
        damage.append(place)


def is_own(path: Path) -> bool:
    """Return whether a file is a recording made by palpate: by its header, or by its sidecar and the begin of a header."""
    with file_errors(path, "cannot be read"), open_unpacked(path) as file:
        begin = file.read(_BEGIN)
    if begin.partition(b"\n")[0].removesuffix(b"\r") in HEADERS:
        return True
    try:
        has_sidecar = sidecar.load(path) is not None
    except RecordingError:
        return False
    return has_sidecar and any(header.startswith(begin.rstrip(b"\0")) for header in HEADERS)
