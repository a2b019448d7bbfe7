"""Converts a recording to palpate's own CSV, or to Parquet or Arrow, and reads these back."""

import math
import os
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from palpate._core import __version__
from palpate.errors import RecordingError, need
from palpate.files import Json, file_errors, replacing, replacing_both
from palpate.recording import sidecar
from palpate.recording.csv_reader import RecordingFile
from palpate.recording.integrity import Known
from palpate.recording.rows import HEADER, format_rows
from palpate.recording.writer import is_locked
from palpate.samples import DTYPE, Block, Status

if TYPE_CHECKING:
    from palpate.importers.table import Table
    from palpate.recording.opened import OpenedRecording

RATE = "pairs a second, for a table without times; or name the column of times with time=COL"
"""What is allowed as the rate of a table without times."""
SUFFIXES = (".csv", ".parquet", ".arrow", ".feather")
GROUP = 2**17
"""Most rows of a row group, 57 min at 38 pairs a second: so much is in memory at a time."""
KEY = b"palpate"
"""The key of the sidecar in the metadata."""
_COLUMNS = {
    "seq": ("", "number of the sample; missing numbers are lost samples"),
    "t_hard_ns": ("ns", "middle of the hard channel's conversion"),
    "t_soft_ns": ("ns", "middle of the soft channel's conversion"),
    "hard_raw": ("code", "24-bit code, -1: none"),
    "soft_raw": ("code", "24-bit code, -1: none"),
    "hard": ("pF", "capacitance, hard channel"),
    "soft": ("pF", "capacitance, soft channel"),
    "status": ("", "0 good; sum of 1 hard saturated, 2 soft saturated, 4 excitation; 8 lost"),
    "t_uncertainty_us": (
        "us",
        "largest possible error of the difference of the two times; -1: unknown",
    ),
}
NAMES: dict[str, str] = {
    name: f"{name}_pF" if unit == "pF" else name for name, (unit, _) in _COLUMNS.items()
}
"""The names of the columns, by field of a sample."""


def schema() -> Any:
    """Return the Arrow schema of the rows, with the unit and the meaning of each column."""
    arrow = need("pyarrow", "tables")
    fields = []
    for name, (unit, meaning) in _COLUMNS.items():
        metadata = {"description": meaning}
        if unit:
            metadata["unit"] = unit
        fields.append(
            arrow.field(
                NAMES[name], arrow.from_numpy_dtype(DTYPE[name]), nullable=False, metadata=metadata
            )
        )
    return arrow.schema(fields)


def own_recording(table: "Table") -> RecordingFile | None:
    """Return the recording in a converted table, with its checksum; None: another table."""
    by_name = {column.name: column.cells for column in table.columns}
    if KEY not in table.metadata or not set(NAMES.values()) <= set(by_name):
        return None
    rows = np.zeros(len(table), DTYPE)
    for field, name in NAMES.items():
        cells = by_name[name]
        if cells.dtype != DTYPE[field]:  # also if some are empty
            raise RecordingError(
                table.path, f"column {name}: got {cells.dtype}, allowed: {DTYPE[field]} in each row"
            )
        rows[field] = cells
    known = Known(sidecar.parsed(table.path, table.metadata[KEY]))
    return RecordingFile(table.path, known, HEADER.encode() + format_rows(rows))


def convert(recording: "OpenedRecording", target: Path, *, force: bool = False) -> int:
    """Write a recording to another format: as a whole, or not at all.

    Parameters
    ----------
    recording : OpenedRecording
    target : pathlib.Path
        NAME.parquet, NAME.arrow or NAME.feather, or NAME.csv, which gets a sidecar NAME.json.
    force : bool
        Replace an existing file.

    Returns
    -------
    int
        Number of rows written: all rows. A row without a value gets the status LOST.

    Raises
    ------
    ValueError
        The suffix is not one of these; or a table without times.
    RecordingError
        The target exists, is the input, or cannot be written; or a line of the input is not a row.
    MissingExtra
        pyarrow is not installed.

    Examples
    --------
    >>> import tempfile
    >>> from palpate.recording import recorded
    >>> target = Path(tempfile.mkdtemp()) / "run.csv"
    >>> convert(recorded("tests/data/four-specimens.csv"), target) == len(target.read_text().splitlines()) - 1
    True
    """
    if target.suffix not in SUFFIXES:
        raise ValueError(
            f"-o: got {target.name!r}, allowed: a name that ends in {' or '.join(SUFFIXES)}"
        )
    if not recording.timed:
        raise ValueError(f"rate: got none, allowed: {RATE}")
    targets = [target]
    if target.suffix == ".csv":
        targets.append(sidecar.sidecar_path(target))
    _require_free(recording, targets, force=force)
    seal = _Seal()
    with file_errors(target, "cannot be written"):
        if target.suffix == ".csv":
            with replacing_both(*targets) as (file, beside):
                file.write(HEADER.encode())
                for _, text in _groups(recording, seal):
                    file.write(text)
                beside.write(sidecar.text_of(_document(recording, seal)).encode())
        else:
            with replacing(target) as file:
                _write_columns(file, target.suffix, recording, seal)
    return seal.rows


class _Seal:
    """Rows, bytes and CRC-32 of the rows so far, as text with the header."""

    def __init__(self) -> None:
        self.rows = 0
        self.bytes = len(HEADER)
        self.crc32 = zlib.crc32(HEADER.encode())

    def add(self, rows: int, text: bytes) -> None:
        """Add rows."""
        self.rows += rows
        self.bytes += len(text)
        self.crc32 = zlib.crc32(text, self.crc32)

    def as_dict(self) -> dict[str, int]:
        """Return the entries of the end in the sidecar."""
        return {"rows": self.rows, "bytes": self.bytes, "crc32": self.crc32}


def _groups(
    recording: "OpenedRecording", seal: _Seal, most: int | None = None
) -> Iterator[tuple[Block, bytes]]:
    """Yield the first rows in groups of at most `GROUP`, and their text, which the seal gets, too."""
    waiting = list[Block]()
    count = 0
    for block in recording.blocks():
        if waiting and count + len(block) > GROUP:
            yield _group(waiting, seal, most)
            waiting.clear()
            count = 0
        waiting.append(block)
        count += len(block)
    if count:
        yield _group(waiting, seal, most)


def _group(blocks: list[Block], seal: _Seal, most: int | None) -> tuple[Block, bytes]:
    """Return one block, and its text; rows without a value are marked as lost."""
    rows = np.concatenate(blocks, dtype=DTYPE)
    if most is not None:
        rows = rows[: most - seal.rows]
    has_values = np.isfinite(rows["hard"]) & np.isfinite(rows["soft"])
    rows["status"][~has_values] = int(Status.LOST)
    text = format_rows(rows)
    seal.add(len(rows), text)
    return rows, text


def _require_free(recording: "OpenedRecording", targets: list[Path], *, force: bool) -> None:
    for path in filter(os.path.lexists, targets):
        if path.exists() and recording.path.exists() and path.samefile(recording.path):
            raise RecordingError(path, "is an input file: choose another name")
        if path.is_file() and is_locked(path):
            raise RecordingError(path, "is still being recorded: choose another name")
        if not force:
            raise RecordingError(path, "already exists: choose another name, or use --force")


def _write_columns(file: BinaryIO, suffix: str, recording: "OpenedRecording", seal: _Seal) -> None:
    """Write the groups; read twice, as the seal is before the rows.

    A recording that still runs may have more rows the second time: they are left out.
    """
    for _ in _groups(recording, seal):
        pass
    complete = schema().with_metadata({KEY: sidecar.text_of(_document(recording, seal))})
    arrow = need("pyarrow", "tables")
    if suffix == ".parquet":
        output = need("pyarrow.parquet", "tables").ParquetWriter(file, complete)
    else:
        output = need("pyarrow.ipc", "tables").new_file(file, complete)
    again = _Seal()
    with output as whole:
        for rows, _ in _groups(recording, again, seal.rows):
            columns = [np.ascontiguousarray(rows[name]) for name in NAMES]
            whole.write_table(arrow.table(columns, schema=complete))
    if again.as_dict() != seal.as_dict():
        raise RecordingError(recording.path, "was changed while it was read: try again")


def _document(recording: "OpenedRecording", seal: _Seal) -> Json:
    """Return the sidecar of the output; its end has the doubts on the source."""
    document = dict(recording.sidecar.entries)
    if not document:
        document = sidecar.fresh(recording.describe(), {}, list(recording.notes))
        for gap in recording.gap_marks:
            mark = sidecar.SidecarMark(gap.seq, math.nan, gap.text, "gap")
            document["marks"].append(mark.as_dict())
    source = f"converted from {recording.path.name}"
    document["notes"] = [*document.get("notes", []), f"{source} by palpate {__version__}"]
    document.pop("checkpoint", None)
    end = {"dropped": 0, "clean": True, **document.get("end", {}), **seal.as_dict()}
    if isinstance(recording, RecordingFile):
        found = recording.integrity
        if found.verified < seal.rows:
            end["verified"] = found.verified
        if found.limits and "repaired" not in end:
            end["clean"] = False
            end["repaired"] = f"{source}: {'; '.join(found.limits)}"
        doubts = found.doubts_before("conversion", recording.sidecar.end)
        if doubts:
            end["doubts"] = doubts
    return {**document, "schema": sidecar.SCHEMA, "end": end}
