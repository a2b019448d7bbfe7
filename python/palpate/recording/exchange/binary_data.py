"""Reader of "Binary Data.txt" of the evaluation kit's program: hex codes of one channel. Not tested with a real file.

The header has cells `key: value`, separated by tabs. Each row has a capacitance code and a temperature code.
"""

import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.ad7746.datasheet import LAST_CODE, SATURATED_CODES, SATURATED_PF
from palpate.errors import RecordingError
from palpate.recording.lines import begin_of
from palpate.recording.rows import capacitances
from palpate.recording.survey import Survey
from palpate.samples import Block, Status, blank
from palpate.tables.packed import contents

_CODE = re.compile(r"[0-9A-Fa-f]{6}")
_TIME = re.compile(r"(?<![\d.,])(\d{1,9}(?:[.,]\d{1,9})?)\s{0,9}(ms|s)$")
MOST_HEADER_ROWS = 1000
LONGEST = 1000
"""Characters of a line, at most."""
_BEGIN = 1 << 20  # bytes in which the first row of codes is looked for


@dataclass(frozen=True, eq=False)
class ChannelFile:
    """Header and codes of one file.

    Attributes
    ----------
    header : dict of str to str
    codes : numpy.ndarray of int32, shape (n,)
    temperatures : int
        Number of rows with a temperature code; a recording does not store temperatures.
    torn : bool
        The last row is incomplete and left out.
    """

    path: Path
    header: dict[str, str]
    codes: NDArray[np.int32]
    temperatures: int
    torn: bool

    @property
    def period_s(self) -> float | None:
        """The conversion time from the header, s; None if the header has none."""
        for key, value in self.header.items():
            match = _TIME.search(value)
            if "conv" in key.lower() and "time" in key.lower() and match:
                return float(match[1].replace(",", ".")) * (1e-3 if match[2] == "ms" else 1.0)
        return None


def is_binary_data(path: Path) -> bool:
    """Return whether a file has a header with `key: value` and then a row of codes."""
    header, rows = _parts(begin_of(path, _BEGIN).decode("latin-1").splitlines())
    return bool(rows) and any(":" in line for line in header)


def read_channel(path: Path) -> ChannelFile:
    """Return the header and codes of one file.

    Raises
    ------
    RecordingError
        No row of codes, a header that is too long, or a later line that is not a row: with its line number.
    """
    text = _text(path)
    header, rows = _parts(text.splitlines())
    for number, line in enumerate(header, 1):
        if len(line) > LONGEST:
            raise RecordingError(path, f"got {len(line):,} characters in a header line, allowed: {LONGEST:,}", number)
    torn = bool(rows) and not text.endswith(("\n", "\r")) and not _whole(rows[-1], len(_cells(rows[0])))
    parsed = [_row(path, len(header) + 1 + i, line) for i, line in enumerate(rows[: len(rows) - torn]) if line.strip()]
    if not parsed:
        where = f"found in {MOST_HEADER_ROWS:,} lines"
        raise RecordingError(path, f"no row of codes {where}; expected six hex digits, a tab, six hex digits")
    cells = [cell for line in header for cell in line.split("\t") if ":" in cell]
    named = {key.strip(): value.strip() for key, _, value in (cell.partition(":") for cell in cells)}
    codes = np.array([row[0] for row in parsed], np.int32)
    return ChannelFile(path, named, codes, sum(len(row) > 1 for row in parsed), torn)


def _text(path: Path) -> str:
    try:
        return contents(path).decode("latin-1")
    except OSError as error:
        raise RecordingError(path, f"cannot be read: {error.strerror}") from error


def _parts(lines: list[str]) -> tuple[list[str], list[str]]:
    """Return the lines above the first row of codes, and the others; all are above if it comes too late."""
    first = next((i for i, line in enumerate(lines[:MOST_HEADER_ROWS]) if _whole(line)), len(lines))
    return lines[:first], lines[first:]


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split("\t") if cell.strip()]


def _whole(line: str, least: int = 1) -> bool:
    cells = _cells(line) if len(line) <= LONGEST else []
    return least <= len(cells) <= 2 and all(_CODE.fullmatch(cell) for cell in cells)


def _row(path: Path, number: int, line: str) -> list[int]:
    if not _whole(line):
        raise RecordingError(
            path, f"{line[:40]!r} is not a row of codes; expected six hex digits, a tab, six hex digits", number
        )
    return [int(cell, 16) for cell in _cells(line)]


_CLIPPED = (Status.HARD_SATURATED, Status.SOFT_SATURATED)


def _saturated(codes: NDArray[np.int32]) -> NDArray[np.bool_]:
    return (codes >= 0) & ((codes < SATURATED_CODES) | (codes > LAST_CODE - SATURATED_CODES))


class BinaryData:
    r"""The "Binary Data.txt" files of Analog Devices' program, one for each channel.

    Parameters
    ----------
    hard, soft : path-like
        The files. Without `soft`, the soft channel has no values.
    period_s : float, optional
        Time from row to row, above 0; needed if the header has no conversion time.

    Attributes
    ----------
    document : None
        There is no sidecar.
    timed : bool
        True: the times follow from the conversion time.
    doubts : tuple of str
        Empty: what is doubtful is in `notes`.
    host_stamps : bool
        False: where the times were taken is not known.
    zero_utc_ns : None
        The wall clock at t = 0 is not known.
    tares : frozenset of int
        Empty: no baseline was measured again.
    torn_bytes : int
        0: there is no row that was cut off.
    full_scale_pF : float
        A reading of this size or more is saturated, pF.

    Raises
    ------
    RecordingError
        As in `read_channel`, or the two files have different conversion times.
    ValueError
        No conversion time in the header, and no `period_s`.

    Examples
    --------
    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "Binary Data.txt"
    >>> _ = path.write_text("Conversion time: 11 ms\n800000\t812345\n")
    >>> [block["hard"].tolist() for block in BinaryData(path).blocks()]
    [[0.0]]
    """

    document = None
    timed = True
    doubts: tuple[str, ...] = ()
    host_stamps = False  # not known
    zero_utc_ns: int | None = None
    tares: frozenset[int] = frozenset()
    torn_bytes = 0
    full_scale_pF = SATURATED_PF

    def __init__(self, hard: Path, soft: str | os.PathLike[str] | None = None, period_s: float | None = None) -> None:
        self.path: Path = Path(hard)
        self.channels: list[ChannelFile] = [read_channel(Path(path)) for path in (hard, soft) if path is not None]
        self.survey: Survey = Survey()
        self.settings: dict[str, Any] = {}
        self.gap_marks: list[tuple[int, str]] = []
        periods = {channel.period_s for channel in self.channels}
        if len(periods) > 1:
            raise RecordingError(
                self.path, f"and {soft}: the conversion times differ: the files do not belong together"
            )
        self.period_s: float | None = period_s or periods.pop()
        if not self.period_s:
            raise ValueError(f"rate: got none, allowed: pairs a second; {hard} has no conversion time in its header")

    @property
    def understood(self) -> str:
        """One line: what each file is, pairs a second, rows."""
        names = [channel.path.name for channel in self.channels]
        rows = max(len(channel.codes) for channel in self.channels)
        channels = [f"{name} = codes of {file}" for name, file in zip(("hard", "soft"), names, strict=False)]
        return "; ".join([*channels, f"{1 / (self.period_s or math.nan):.4g} pairs a second", f"{rows} rows"])

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on the data."""
        lengths = [len(channel.codes) for channel in self.channels]
        general = {
            f"the file has no times: rows are {self.period_s:g} s apart": True,
            "no file for the soft channel: every row is marked as lost": len(lengths) == 1,
            "one file for each channel: it is assumed that both were measured at the same time": len(lengths) == 2,
            f"the files have {' and '.join(map(str, lengths))} rows: missing rows are marked as lost": len({*lengths})
            > 1,
        }
        return (
            *(note for note, holds in general.items() if holds),
            *(f"{c.path}: {c.temperatures} temperatures left out: recordings have none" for c in self.channels
              if c.temperatures),
            *(f"{c.path}: the last row is incomplete: left out" for c in self.channels if c.torn),
        )  # fmt: skip

    def describe(self) -> dict[str, Any]:
        """Return the contents of the headers."""
        files = [{"file": channel.path.name, "header": channel.header} for channel in self.channels]
        return {
            "name": "AD7746, saved by Analog Devices' program",
            "files": files,
            "full_scale_pF": self.full_scale_pF,
            "period_s": self.period_s,
        }

    def blocks(self) -> Iterator[Block]:
        """Yield all rows as one block."""
        block = blank(max(len(channel.codes) for channel in self.channels))
        block["t_hard_ns"] = block["t_soft_ns"] = np.rint(block["seq"] * (self.period_s or 0.0) * 1e9)
        codes = np.full((2, len(block)), -1, np.int32)
        for row, channel in zip(codes, self.channels, strict=False):
            row[: len(channel.codes)] = channel.codes
        for name, row, flag in zip(("hard", "soft"), codes, _CLIPPED, strict=True):
            block[f"{name}_raw"], block[name] = row, capacitances(row, np.full(len(row), np.nan))
            block["status"][_saturated(row)] |= int(flag)
        block["status"][(codes < 0).any(axis=0)] = int(Status.LOST)
        self.survey = Survey()
        self.survey.add(block)
        yield block
