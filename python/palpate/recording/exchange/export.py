"""Convert a recording to palpate's own CSV, to Parquet, or to an Arrow file. The output is complete, or not written."""

import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, Self

import numpy as np

from palpate._core import __version__
from palpate.errors import RecordingError
from palpate.files import replacing
from palpate.recording import sidecar
from palpate.recording.exchange.binary_data import BinaryData
from palpate.recording.exchange.columns_out import ArrowWriter, ParquetWriter
from palpate.recording.filelock import is_locked
from palpate.recording.foreign import RATE, AnyRecording
from palpate.recording.own_file import Recorded
from palpate.recording.rows import HEADER, format_rows
from palpate.samples import Block, Status


class _OwnWriter:
    """Writes rows as text, and the sidecar at the end."""

    def __init__(self, file: BinaryIO, target: Path) -> None:
        self._file = file
        self._sidecar = sidecar.sidecar_path(target)
        self._file.write(HEADER.encode())

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Do nothing: the file is closed when it takes its name."""

    def write(self, _block: Block, text: bytes) -> None:
        self._file.write(text)

    def finish(self, document: dict[str, Any]) -> None:
        sidecar.save(self._sidecar, document)


_WRITERS: dict[str, type[_OwnWriter | ParquetWriter | ArrowWriter]] = {
    ".csv": _OwnWriter,
    ".parquet": ParquetWriter,
    ".arrow": ArrowWriter,
    ".feather": ArrowWriter,
}
SUFFIXES: tuple[str, ...] = tuple(_WRITERS)


def convert(recording: AnyRecording, target: Path, *, force: bool = False) -> int:
    """Write a recording to another format: Parquet, Arrow, or palpate's own CSV.

    Parameters
    ----------
    recording : Recorded, Foreign or BinaryData
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
        raise ValueError(f"-o: got {target.name!r}, allowed: a name that ends in {' or '.join(SUFFIXES)}")
    if not recording.timed:
        raise ValueError(f"rate: got none, allowed: {RATE}")
    _check_free(recording, target, force=force)
    rows, size, checksum = 0, len(HEADER), zlib.crc32(HEADER.encode())
    with _whole(target) as file, _WRITERS[target.suffix](file, target) as writer:
        for block in recording.blocks():
            text = format_rows(_prepared(block))
            writer.write(block, text)
            rows, size, checksum = rows + len(block), size + len(text), zlib.crc32(text, checksum)
        writer.finish(_document(recording, {"rows": rows, "bytes": size, "crc32": checksum}))
    return rows


def _check_free(recording: AnyRecording, target: Path, *, force: bool) -> None:
    targets = [target, sidecar.sidecar_path(target)] if target.suffix == ".csv" else [target]
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


def _document(recording: AnyRecording, seal: dict[str, int]) -> dict[str, Any]:
    """Return the sidecar; the checksum is always that of the rows as CSV, so that every reader can verify them."""
    known = recording.document
    document = dict(known) if known else sidecar.fresh(recording.describe(), {}, [])
    if not known:
        gaps = recording.gap_marks
        document["marks"] = [{"seq": seq, "text": text, "tare": True, "gap": True} for seq, text in gaps]
    made = f"converted from {recording.path.name} by palpate {__version__}"
    document["notes"] = [*document.get("notes", []), *([] if known else recording.notes), made]
    document["schema"] = sidecar.SCHEMA
    document.pop("checkpoint", None)
    end = {"dropped": 0, "clean": True, **document.get("end", {}), **seal}
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
