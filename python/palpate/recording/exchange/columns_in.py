"""Reads back the Parquet and Arrow files that palpate writes: the rows, and the sidecar in their metadata."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import RecordingError
from palpate.recording import sidecar
from palpate.recording.codes import Codes
from palpate.recording.exchange.columns_out import KEY, NAMES, schema
from palpate.recording.integrity import Known
from palpate.recording.lines import Damage, Pass, begin_of
from palpate.recording.own_file import Recorded
from palpate.recording.recognition import is_own
from palpate.recording.rows import HEADER, LARGEST_STATUS, capacitances, format_rows
from palpate.samples import DTYPE, Block
from palpate.tables.packed import contents, is_packed
from palpate.tables.readers.arrow import ArrowFile, is_arrow

_ROWS = 1 << 14
MOST_ROWS = 100_000_000
"""Rows of a file, at most: a few bytes can claim any number of equal rows."""


class OwnColumns(Recorded):
    """A recording made by palpate and converted to Parquet or Arrow, read in blocks.

    The checksum in its sidecar is that of the rows as CSV: a row that another program changed is noticed.

    Parameters
    ----------
    path : pathlib.Path

    Raises
    ------
    RecordingError
        The file is damaged, or not a recording; from `blocks()`: a row is not one of a recording.
    MissingExtra
        pyarrow is not installed.
    """

    def _known(self) -> Known:
        self._file = _opened(self.path)
        if self._file.rows > MOST_ROWS:
            raise RecordingError(self.path, f"got {self._file.rows:,} rows, allowed: {MOST_ROWS:,}")
        return Known(*sidecar.parsed(self.path, self._file.metadata[KEY.encode()]), "", False)

    def _parsed(self, seen: Pass, _chunk: int, _damage: list[Damage] | None) -> Iterator[Block]:
        seen.count(HEADER.encode())
        rows = 0
        for table in self._file.parts(list(NAMES.values()), _ROWS):
            block = _block(self.path, table, rows)
            seen.count(format_rows(block))
            _check(self.path, block, rows)
            for name in ("hard", "soft"):
                block[name] = capacitances(block[f"{name}_raw"], block[name], self.codes or Codes())
            rows += len(block)
            yield block
        seen.complete = True


def own_recording(path: Path) -> Recorded | None:
    """Return a recording made by palpate, CSV, Parquet or Arrow; None: a table of another program.

    Examples
    --------
    >>> own_recording(Path("tests/data/four-specimens.csv")) is None
    False
    """
    if is_arrow(begin_of(path, 8)):
        file = _opened(path)
        return OwnColumns(path) if KEY.encode() in file.metadata and set(NAMES.values()) <= set(file.names) else None
    return Recorded(path) if is_own(path) else None


def _opened(path: Path) -> ArrowFile:
    return ArrowFile(path, contents(path) if is_packed(path) else None)


def _block(path: Path, table: Any, before: int) -> Block:
    block = np.zeros(table.num_rows, DTYPE)
    for (field, name), wanted in zip(NAMES.items(), schema(), strict=True):
        column = table.column(name)
        if column.type != wanted.type:
            raise RecordingError(path, f"column {name}: got {column.type}, allowed: {wanted.type}")
        if column.null_count:
            raise RecordingError(path, f"column {name}: got a null in rows {before + 1:,} to {before + len(block):,}")
        block[field] = column.to_numpy()
    return block


_LEAST = {"seq": 0, "hard_raw": -1, "soft_raw": -1, "t_uncertainty_us": -1}


def _check(path: Path, block: Block, before: int) -> None:
    wrong = block["status"] > LARGEST_STATUS
    for name, least in _LEAST.items():
        wrong |= block[name] < least
    if wrong.any():
        row = int(np.argmax(wrong))
        raise RecordingError(path, f"not a row of a recording: {block[row].tolist()}", before + row + 1)
