"""Converts a recording to palpate's own CSV, or to Parquet or Arrow, and reads these back."""

import math
import os
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from palpate._core import __version__
from palpate.errors import RecordingError, need
from palpate.files import Json, file_errors, replacing
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
    rows = np.concatenate([np.zeros(0, DTYPE), *recording.blocks()], dtype=DTYPE)
    rows["status"][~(np.isfinite(rows["hard"]) & np.isfinite(rows["soft"]))] = int(Status.LOST)
    text = HEADER.encode() + format_rows(rows)
    document = _document(
        recording, {"rows": len(rows), "bytes": len(text), "crc32": zlib.crc32(text)}
    )
    with file_errors(target, "cannot be written"), replacing(target) as file:
        if target.suffix == ".csv":
            file.write(text)
            sidecar.save(sidecar.sidecar_path(target), document)
        else:
            _write_columns(file, target.suffix, rows, document)
    return len(rows)


def _require_free(recording: "OpenedRecording", targets: list[Path], *, force: bool) -> None:
    for path in filter(os.path.lexists, targets):
        if path.exists() and recording.path.exists() and path.samefile(recording.path):
            raise RecordingError(path, "is an input file: choose another name")
        if path.is_file() and is_locked(path):
            raise RecordingError(path, "is still being recorded: choose another name")
        if not force:
            raise RecordingError(path, "already exists: choose another name, or use --force")


def _write_columns(file: BinaryIO, suffix: str, rows: Block, document: Json) -> None:
    complete = schema().with_metadata({KEY: sidecar.text_of(document)})
    columns = [np.ascontiguousarray(rows[name]) for name in NAMES]
    table = need("pyarrow", "tables").table(columns, schema=complete)
    if suffix == ".parquet":
        need("pyarrow.parquet", "tables").write_table(table, file)
        return
    with need("pyarrow.ipc", "tables").new_file(file, complete) as whole:
        whole.write_table(table)


def _document(recording: "OpenedRecording", seal: dict[str, int]) -> Json:
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
    end = {"dropped": 0, "clean": True, **document.get("end", {}), **seal}
    if isinstance(recording, RecordingFile):
        found = recording.integrity
        if found.verified < seal["rows"]:
            end["verified"] = found.verified
        if found.limits and "repaired" not in end:
            end["clean"] = False
            end["repaired"] = f"{source}: {'; '.join(found.limits)}"
        doubts = found.doubts_before("conversion", recording.sidecar.end)
        if doubts:
            end["doubts"] = doubts
    return {**document, "schema": sidecar.SCHEMA, "end": end}
