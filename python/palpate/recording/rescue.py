"""Goes on in another recording, NAME.rescued.csv, after a recording was removed, changed, or its disk failed."""

import errno
import math
import os
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from palpate.recording.row_file import RowFile
from palpate.recording.rows import HEADER, RowError, parse_rows
from palpate.recording.sidecar import RESCUED, sidecar_path
from palpate.recording.sidecar_file import SidecarFile

_CHUNK = 1 << 20  # bytes
_MOST = 1000  # names that are tried


def begin(lost: RowFile, sidecar: SidecarFile, why: str) -> RowFile:
    """Create the rescue recording beside a recording, or in a new folder for temporary files; no file is overwritten.

    Raises
    ------
    OSError
        It can be created in neither.
    """
    with suppress(OSError):
        return _in_folder(lost.path.parent, lost, sidecar, why)
    return _in_folder(Path(tempfile.mkdtemp(prefix="palpate-rescued-")), lost, sidecar, why)


def fill(rescued: RowFile, lost: RowFile) -> None:
    """Copy all rows of a recording that can still be had.

    The rows up to the last sync are read from the open file, which also works if it has no name any more; if they are
    not as they were written, those before the first change. The rows since then come from memory.

    Raises
    ------
    OSError
        The rescue recording cannot be written.
    """
    for data in _chunks(lost):
        rescued.put(data.count(b"\n"), data)
    if rescued.written[1:] != lost.synced[1:]:
        rescued.restart()
        for data in _whole_rows(lost):
            rescued.put(data.count(b"\n"), data)
    for rows, data in lost.unsynced:
        rescued.put(rows, data)


def _in_folder(folder: Path, lost: RowFile, sidecar: SidecarFile, why: str) -> RowFile:
    for number in range(1, _MOST):
        path = folder / f"{lost.path.stem}.rescued{'' if number == 1 else f'-{number}'}{lost.path.suffix}"
        with suppress(FileExistsError):
            return _create(path, lost, sidecar, why)
    raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))


def _create(path: Path, lost: RowFile, sidecar: SidecarFile, why: str) -> RowFile:
    rescued = RowFile(path)
    end = {**lost.written._asdict(), "dropped": lost.refused, "clean": False}
    try:
        sidecar.move(sidecar_path(path), f"{RESCUED}{why}", end | {"error": f"{why}; see {path}"})
    except OSError:
        rescued.discard()
        raise
    return rescued


def _chunks(lost: RowFile) -> Iterator[bytes]:
    """Return the rows up to the last sync; fewer if the file is shorter now or cannot be read."""
    left = lost.synced.bytes - len(HEADER)
    with suppress(OSError):
        lost.file.seek(len(HEADER))
        while data := lost.file.read(min(_CHUNK, left)):
            left -= len(data)
            yield data


def _whole_rows(lost: RowFile) -> Iterator[bytes]:
    """Return the rows before the first one that is not a row, or that is in memory as well."""
    newest = next((int(data.split(b",")[0]) for rows, data in lost.unsynced if rows), math.inf)
    with suppress(OSError):
        lost.file.seek(0)
        if lost.file.read(len(HEADER)) != HEADER.encode():
            return
        rest = b""
        while data := lost.file.read(_CHUNK):
            *lines, rest = (rest + data).split(b"\n")
            whole = _leading(lines, newest)
            yield b"".join(line + b"\n" for line in lines[:whole])
            if whole < len(lines):
                return


def _leading(lines: list[bytes], newest: float) -> int:
    """Return how many lines at the begin are rows older than a sample."""
    try:
        old = parse_rows(b"".join(line + b"\n" for line in lines))["seq"] < newest
        return len(lines) if old.all() else int(old.argmin())
    except RowError as error:
        return _leading(lines[: error.number], newest)
