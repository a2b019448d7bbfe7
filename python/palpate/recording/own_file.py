"""A recording as a sequence of blocks: only a part of the file is in memory."""

import math
import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from palpate.ad7746.datasheet import SATURATED_PF
from palpate.errors import RecordingError
from palpate.files import open_regular
from palpate.recording import sidecar
from palpate.recording.rows import HEADER, RowError, is_whole, parse_rows
from palpate.recording.survey import Survey
from palpate.samples import Block

_CHUNK = 1 << 20  # bytes: some 10,000 rows


class Recorded:
    """A recording made by palpate, read in blocks.

    Parameters
    ----------
    path : path-like

    Attributes
    ----------
    path : pathlib.Path
    document : dict or None
        The sidecar; None without one.
    survey : Survey
        Counts over the blocks of the last `blocks()`.
    torn_bytes : int
        Bytes after the last complete row, after `blocks()`: the recording was not closed.
    checksum : int
        CRC-32 of the complete rows, after `blocks()`.

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

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path: Path = Path(path)
        self.document: dict[str, Any] | None = None
        self.survey: Survey = Survey()
        self.torn_bytes: int = 0
        self.checksum: int = 0
        self._notes: list[str] = []
        try:
            self.document = sidecar.load(self.path)
        except RecordingError as error:
            self._notes.append(f"sidecar not used: {error}")
        if not is_own(self.path):
            raise RecordingError(
                self.path, f"not a recording made by palpate; its first line has to be {HEADER.strip()}"
            )

    @property
    def full_scale_pF(self) -> float:
        """Full scale from the sidecar, pF; without one that of the AD7746 if the first row has a code, else inf."""
        if self.document is not None:
            return float(self.document["device"].get("full_scale_pF", math.inf))
        first = next(self._parsed(4096), None)
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
        }
        told = [str(note) for note in (self.document or {}).get("notes", []) if str(note).startswith(sidecar.BEGUN)]
        return (*self._notes, *told, *(note for note, holds in notes.items() if holds))

    def describe(self) -> dict[str, Any]:
        """Return the description of the instrument from the sidecar."""
        return dict(self.document["device"]) if self.document else {"name": "recording", "file": self.path.name}

    def blocks(self) -> Iterator[Block]:
        """Yield the samples in blocks of some thousand.

        Yields
        ------
        numpy.ndarray, shape (n,), of `palpate.SampleRing.dtype`
        """
        self.survey = Survey()
        tares = sorted(self.tares)
        for block in self._parsed(_CHUNK):
            self.survey.add(block)
            cuts = np.flatnonzero(np.isin(block["seq"][:-1], tares)) + 1
            yield from np.split(block, cuts)

    def _parsed(self, chunk: int) -> Iterator[Block]:
        first = 2
        for lines in self._lines(chunk):
            try:
                block = parse_rows(lines)
            except RowError as error:
                raise RecordingError(self.path, str(error), first + error.number) from error
            first += len(lines)
            if len(block):
                yield block

    def _lines(self, chunk: int) -> Iterator[list[str]]:
        with open_regular(self.path) as file:
            header = file.readline()
            taken = len(header) if header.endswith(b"\n") else 0
            self.checksum = zlib.crc32(header[:taken])
            rest, zero = b"", b""
            while not zero and (data := file.read(chunk)):
                data, zero, _ = (rest + data).partition(b"\0")  # a power cut can leave zeros at the end of a file
                whole, end, rest = data.rpartition(b"\n")
                taken += len(whole + end)
                self.checksum = zlib.crc32(whole + end, self.checksum)
                if whole:
                    yield self._text(whole).splitlines()
            if is_whole(self._text(rest)):
                taken += len(rest)
                self.checksum = zlib.crc32(rest, self.checksum)
                yield [self._text(rest)]
        self.torn_bytes = self.path.stat().st_size - taken

    def _text(self, data: bytes) -> str:
        try:
            return data.decode("ascii")
        except UnicodeDecodeError as error:
            raise RecordingError(self.path, f"not a recording: {error}") from error


def is_own(path: Path) -> bool:
    """Return whether a file is a recording made by palpate, from its first line or its sidecar."""
    try:
        with open_regular(path) as file:
            line = file.readline(2 * len(HEADER))
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror}") from error
    if line.rstrip(b"\r\n") == HEADER.strip().encode():
        return True
    # Stopped before the first row was written.
    return HEADER.encode().startswith(line) and path.suffix == ".csv" and sidecar.sidecar_path(path).is_file()
