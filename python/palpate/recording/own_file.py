"""A recording as a sequence of blocks: only a part of the file is in memory."""

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from palpate.ad7746.datasheet import SATURATED_PF
from palpate.errors import RecordingError
from palpate.recording import sidecar
from palpate.recording.codes import Codes, codes_of
from palpate.recording.integrity import Integrity, Known, judge, known_of
from palpate.recording.lines import LONGEST_ROW, Damage, Pass, Piece, add, sift
from palpate.recording.recognition import is_own
from palpate.recording.rows import COLUMNS, HEADER, RowError, columns_of, is_whole, parse_rows, unreadable
from palpate.recording.survey import Survey
from palpate.samples import Block

_CHUNK = 1 << 18  # bytes, some 3,000 rows: more would not stay in the cache, and be new pages for each block
_MOST_TOLD = 5  # gaps
_NONE = Integrity((), (), (), 0)


class Recorded:
    """A recording made by palpate, read in blocks.

    Parameters
    ----------
    path : path-like

    Attributes
    ----------
    path : pathlib.Path
    known : Known
        What the sidecar says; read once, when the recording is opened.
    survey : Survey
        Counts over the blocks of the last `blocks()`.
    seen : Pass
        The bytes of the last `blocks()`.
    torn_bytes : int
        Bytes after the last complete row, after `blocks()`: the recording was not closed.
    headed : bool
        Whether the first line is the header, after `blocks()`.
    columns : tuple of str
        Names of its columns, after `blocks()`: a recording of an earlier version has fewer.
    codes : Codes or None
        Scale of the codes, from the sidecar. Without one that of the AD7746, if it agrees with the first rows, else None.
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
    >>> recording = Recorded("tests/data/four-specimens.csv")
    >>> sum(len(block) for block in recording.blocks()) == recording.survey.rows
    True
    """

    timed = True
    understood = ""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path: Path = Path(path)
        self.known = self._known()
        self.survey: Survey = Survey()
        self.seen = Pass(self.path)
        self.torn_bytes: int = 0
        self.headed: bool = False
        self.columns: tuple[str, ...] = COLUMNS
        self.codes: Codes | None = codes_of(self.document["device"]) if self.document else self._likely_codes()

    def _known(self) -> Known:
        """Return what is known of the file before its rows are read."""
        if not is_own(self.path):
            raise RecordingError(
                self.path, f"not a recording made by palpate; its first line has to be {HEADER.strip()}"
            )
        return known_of(self.path)

    @property
    def document(self) -> dict[str, Any] | None:
        """The sidecar; None without a valid one."""
        return self.known.document

    @property
    def full_scale_pF(self) -> float:
        """Full scale from the sidecar, pF; without one that of the AD7746 if the first row has a code, else inf."""
        if self.document is not None:
            return float(self.document["device"].get("full_scale_pF", math.inf))
        first = next(self._parsed(Pass(self.path), 4096, []), None)
        return SATURATED_PF if first is not None and first["hard_raw"][0] >= 0 else math.inf

    @property
    def host_stamps(self) -> bool:
        """Whether the times are those of the arrival at the computer, from the sidecar."""
        return self.describe().get("stamps") == "host"

    @property
    def settings(self) -> dict[str, Any]:
        """Scene and settings of the live measurement; empty if unknown."""
        return sidecar.settings_of(self.document or {})

    @property
    def tares(self) -> frozenset[int]:
        """Numbers of the samples after which the baseline was measured again; each is the last of a block."""
        return sidecar.tares_of(self.document or {})

    @property
    def gap_marks(self) -> list[tuple[int, str]]:
        """Those of `tares` that are before a gap, each with what happened there: the board was opened again, ..."""
        return sidecar.gaps_of(self.document or {})

    @property
    def zero_utc_ns(self) -> int | None:
        """UTC of t = 0, ns since 1970, by the wall clock at the begin; None: unknown."""
        return sidecar.zero_of(self.document or {})[0]

    @property
    def _moved(self) -> str:
        """What to say of a wall clock that was moved; "": nothing."""
        begin, end = sidecar.zero_of(self.document or {})
        moved_s = 0.0 if begin is None or end is None else (end - begin) / 1e9
        if abs(moved_s) <= _MOVED_S:
            return ""
        return f"the wall clock was moved by {moved_s:+.3f} s during the recording: UTC is that of its begin"

    @property
    def integrity(self) -> Integrity:
        """Whether the recording is as it was written; known after `blocks()`."""
        return judge(self.known, self.seen, self.survey.rows) if self.seen.complete else _NONE

    @property
    def doubts(self) -> tuple[str, ...]:
        """What is not as it was written, after `blocks()`: results may be wrong. They are in `notes`, too."""
        return self.integrity.doubts

    @property
    def told(self) -> tuple[str, ...]:
        """What the recorder said: it began late, was disturbed, or had gaps; and what a rescue lacks before it."""
        notes = (*sidecar.told_of(self.document or {}), *self._told_gaps())
        missing = self.survey.first_seq if any(note.startswith(sidecar.RESCUED) for note in notes) else 0
        if not missing or any(note.startswith(sidecar.BEGUN) for note in notes):
            return notes
        return (*notes, f"{missing} samples are missing before the first row")

    def _told_gaps(self) -> list[str]:
        marks = self.gap_marks
        told = [f"gap after sample {seq}: {text}: the baseline was measured again" for seq, text in marks[:_MOST_TOLD]]
        return told + ([f"{len(marks) - _MOST_TOLD} more gaps"] if len(marks) > _MOST_TOLD else [])

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data; complete after `blocks()`."""
        survey = self.survey
        notes = {
            f"{survey.refused} of {survey.rows} rows have no value in a channel: left out": survey.refused,
            f"{survey.lost} samples are missing {survey.in_gaps}": survey.lost,
            f"time goes back at {survey.backward} of {survey.rows} rows: the order of the file is used": (
                survey.backward
            ),
            "the last row is incomplete (no line end): left out": self.torn_bytes,
            survey.told_pause: survey.told_pause,
            "the codes are not those of an AD7746, and no sidecar says their scale: left out": self.codes is None,
            self._moved: self._moved,
        }
        found = self.integrity
        whole = (*found.doubts, *found.limits, *found.remarks)
        return (*whole, *self.told, *(note for note, holds in notes.items() if holds))

    def describe(self) -> dict[str, Any]:
        """Return the description of the instrument from the sidecar."""
        return dict(self.document["device"]) if self.document else {"name": "recording", "file": self.path.name}

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
        self.seen = Pass(self.path, self.known.marked)
        tares = sorted(self.tares)
        for block in self._parsed(self.seen, _CHUNK, damage):
            self.survey.add(block)
            cuts = np.flatnonzero(np.isin(block["seq"][:-1], tares)) + 1 if tares else np.zeros(0, np.int64)
            yield from np.split(block, cuts)

    def _likely_codes(self) -> Codes | None:
        """Return the scale of the AD7746 if the first rows have it, within what a spreadsheet may round."""
        self.codes = None
        written = next(self._parsed(Pass(self.path), 4096, []), None)
        self.codes = Codes()
        computed = next(self._parsed(Pass(self.path), 4096, []), None)
        agree = (
            written is None
            or computed is None
            or all(
                np.allclose(written[name], computed[name], rtol=0, atol=_ROUNDED_PF, equal_nan=True)
                for name in ("hard", "soft")
            )
        )
        return self.codes if agree else None

    def _parsed(self, seen: Pass, chunk: int, damage: list[Damage] | None) -> Iterator[Block]:
        rows, self.headed = 0, False
        for piece in seen.pieces(chunk):
            rest = self._without_header(piece, damage) if piece.line == 1 else piece
            try:
                block = self._block(rest, rows, damage)
            except RowError as error:
                if error.number:  # the rows before it
                    lines = rest.data.split(b"\n")[: error.number]
                    yield self._block(rest._replace(data=b"\n".join((*lines, b""))), rows, damage)
                self._refuse(rest.line + error.number, str(error))
            rows += len(block)
            if len(block):
                yield block
        yield from self._last(seen, rows, damage)

    def _without_header(self, piece: Piece, damage: list[Damage] | None) -> Piece:
        first, _, rest = piece.data.partition(b"\n")
        line = first.removesuffix(b"\r")
        self.columns = columns_of(piece.data.split(b"\n")) or COLUMNS
        self.headed = line == ",".join(self.columns).encode()
        if self.headed:
            return Piece(rest, len(first) + 1, 2, 0)
        if unreadable(line, self.columns) is None:
            self._damaged(Damage(1, 0, 0, 0, 0, "the header is missing"), damage)
        return piece

    def _block(self, piece: Piece, rows: int, damage: list[Damage] | None) -> Block:
        if not piece.left_out:
            try:
                return parse_rows(piece.data, self.columns, self.codes)
            except RowError:
                if damage is None:
                    raise
        good, places = sift(piece, rows, self.columns)
        for place in places:
            self._damaged(place, damage)
        return parse_rows(good, self.columns, self.codes)

    def _last(self, seen: Pass, rows: int, damage: list[Damage] | None) -> Iterator[Block]:
        """Yield a last row without a line end; what is left then is an incomplete row, zeros of a power cut, or damage."""
        last = seen.tail.partition(b"\0")[0]
        begin = seen.tail_offset
        if begin == 0:
            self.columns = columns_of([last]) or COLUMNS
        if is_whole(last, self.columns):
            if begin == 0:
                self._damaged(Damage(1, 0, 0, 0, 0, "the header is missing"), damage)
            yield parse_rows(last, self.columns, self.codes)
            begin, rows = begin + len(last), rows + 1
        self.torn_bytes = seen.size - begin
        if seen.filled - begin > LONGEST_ROW:
            self.torn_bytes = 0
            reason = f"{seen.size - begin} bytes without a line end"
            self._damaged(Damage(seen.tail_line, 1, begin, seen.size - begin, rows, reason), damage)

    def _damaged(self, place: Damage, damage: list[Damage] | None) -> None:
        if damage is None:
            self._refuse(place.line, place.reason)
        add(damage, place)

    def _refuse(self, line: int, reason: str) -> NoReturn:
        advice = "damaged; palpate check counts what can still be read, palpate check --repair takes the rest out"
        raise RecordingError(self.path, f"{reason}: {advice}", line)


_ROUNDED_PF = 1e-3
_MOVED_S = 0.005  # a wall clock that NTP holds moves less in an hour
