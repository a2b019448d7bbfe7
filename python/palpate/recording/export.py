"""Convert a recording to palpate's own CSV, or to Parquet. The output file is complete, or not written."""

import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np

from palpate._core import __version__
from palpate.errors import RecordingError
from palpate.extras import need
from palpate.files import replacing
from palpate.recording import sidecar
from palpate.recording.binary_data import BinaryData
from palpate.recording.filelock import is_locked
from palpate.recording.foreign import RATE, AnyRecording
from palpate.recording.own_file import Recorded
from palpate.recording.rows import HEADER, format_rows
from palpate.samples import DTYPE, Block, Status

SUFFIXES = (".parquet", ".csv")
_UNITS = {"t_hard_ns": "ns", "t_soft_ns": "ns", "hard_raw": "code", "soft_raw": "code", "hard": "pF", "soft": "pF"}
_UNITS |= {"t_uncertainty_us": "us"}
_MEANT = {
    "seq": "number of the sample; missing numbers are lost samples",
    "t_hard_ns": "middle of the hard channel's conversion",
    "t_soft_ns": "middle of the soft channel's conversion",
    "hard_raw": "24-bit code, -1: none",
    "soft_raw": "24-bit code, -1: none",
    "hard": "capacitance, hard channel",
    "soft": "capacitance, soft channel",
    "status": "0 good; sum of 1 hard saturated, 2 soft saturated, 4 excitation; 8 lost",
    "t_uncertainty_us": "largest possible error of the difference of the two times; -1: unknown",
}


class _OwnWriter:
    """Writes rows as text, and the sidecar at the end."""

    def __init__(self, file: BinaryIO, target: Path) -> None:
        self._file = file
        self._sidecar = sidecar.sidecar_path(target)
        self._size = self._checksum = 0
        self._write(HEADER.encode())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing: the file is closed when it takes its name."""

    def write(self, block: Block) -> None:
        self._write(format_rows(block))

    def _write(self, data: bytes) -> None:
        self._size += self._file.write(data)
        self._checksum = zlib.crc32(data, self._checksum)

    def finish(self, document: dict[str, Any]) -> None:
        written = {"bytes": self._size, "crc32": self._checksum}
        sidecar.save(self._sidecar, {**document, "end": document["end"] | written})


class _ParquetWriter:
    """Writes columns with their unit, and the sidecar as JSON under the key `palpate`."""

    def __init__(self, file: BinaryIO, _target: Path) -> None:
        self._arrow, parquet = need("pyarrow", "export"), need("pyarrow.parquet", "export")
        self._schema = self._arrow.schema([self._field(name) for name in DTYPE.names or ()])
        self._writer = parquet.ParquetWriter(file, self._schema)

    def _field(self, name: str) -> Any:
        metadata = {"description": _MEANT[name], **({"unit": _UNITS[name]} if name in _UNITS else {})}
        return self._arrow.field(
            f"{name}_pF" if _UNITS.get(name) == "pF" else name,
            self._arrow.from_numpy_dtype(DTYPE.fields[name][0]) if DTYPE.fields else None,
            nullable=False,
            metadata=metadata,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def write(self, block: Block) -> None:
        columns = [np.ascontiguousarray(block[name]) for name in DTYPE.names or ()]
        self._writer.write_table(self._arrow.table(columns, schema=self._schema))

    def finish(self, document: dict[str, Any]) -> None:
        self._writer.add_key_value_metadata({"palpate": sidecar.text_of(document)})


def convert(recording: AnyRecording, target: Path, *, force: bool = False) -> int:
    """Write a recording to another format: Parquet, or palpate's own CSV.

    Parameters
    ----------
    recording : Recorded, Foreign or BinaryData
    target : pathlib.Path
        NAME.parquet, or NAME.csv, which gets a sidecar NAME.json.
    force : bool
        Replace an existing file.

    Returns
    -------
    int
        Number of rows written: all rows. A row without a value gets the status LOST.

    Raises
    ------
    ValueError
        The suffix is not .parquet or .csv; or a table without times.
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
        raise ValueError(f"-o: got {target.name!r}, allowed: a name that ends in {' or '.join(SUFFIXES)}")
    if not recording.timed:
        raise ValueError(f"rate: got none, allowed: {RATE}")
    _check_free(recording, target, force=force)
    rows = 0
    with _whole(target) as file, _writer(target)(file, target) as writer:
        for block in recording.blocks():
            writer.write(_prepared(block))
            rows += len(block)
        writer.finish(_document(recording, rows))
    return rows


def _writer(target: Path) -> "type[_ParquetWriter | _OwnWriter]":
    return _ParquetWriter if target.suffix == ".parquet" else _OwnWriter


def _check_free(recording: AnyRecording, target: Path, *, force: bool) -> None:
    targets = [target] if target.suffix == ".parquet" else [target, sidecar.sidecar_path(target)]
    inputs = [channel.path for channel in recording.channels] if isinstance(recording, BinaryData) else [recording.path]
    for path in filter(os.path.lexists, targets):
        if path.exists() and any(read.exists() and path.samefile(read) for read in inputs):
            raise RecordingError(path, "is an input file: choose another name")
        if path.is_file() and is_locked(path):
            raise RecordingError(path, "is still being recorded: choose another name")
        if not force:
            raise RecordingError(path, "already exists: choose another name, or use --force")


@contextmanager
def _whole(target: Path) -> Iterator[BinaryIO]:
    """Yield a file that takes the place of the target when everything is written."""
    try:
        with replacing(target) as file:
            yield file
    except OSError as error:
        raise RecordingError(target, f"cannot be written: {error.strerror or error}") from error


def _prepared(block: Block) -> Block:
    block["status"][~(np.isfinite(block["hard"]) & np.isfinite(block["soft"]))] = int(Status.LOST)
    return block


def _document(recording: AnyRecording, rows: int) -> dict[str, Any]:
    known = recording.document
    document = dict(known) if known else sidecar.fresh(recording.describe(), {}, [])
    made = f"converted from {recording.path.name} by palpate {__version__}"
    document["notes"] = [*document.get("notes", []), *([] if known else recording.notes), made]
    document["schema"] = sidecar.SCHEMA
    document.pop("checkpoint", None)
    end = {"dropped": 0, "clean": True, **document.get("end", {}), "rows": rows}
    if isinstance(recording, Recorded):
        end |= _history(recording)
    return {**document, "end": end}


def _history(recording: Recorded) -> dict[str, Any]:
    """Return what the end of the output says of its source: a checksum of the output alone would hide it."""
    found, before = recording.integrity, recording.known.end
    old = before.get("doubts", [])
    doubts = [text if text in old else f"before the conversion: {text}" for text in found.doubts]
    history: dict[str, Any] = {"verified": found.verified} if found.verified < recording.survey.rows else {}
    if found.limits and "repaired" not in before:
        history |= {"clean": False, "repaired": f"converted from {recording.path.name}: {'; '.join(found.limits)}"}
    return history | ({"doubts": doubts} if doubts else {})
