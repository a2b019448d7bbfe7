"""The rows of a recording in progress: added at the end of a file of its own, and kept until they are on the disk."""

import os
import zlib
from contextlib import suppress
from io import FileIO
from pathlib import Path
from typing import NamedTuple

from palpate.recording.filelock import lock, unlock
from palpate.recording.rows import HEADER, format_rows
from palpate.recording.watch import Watch
from palpate.samples import Block
from palpate.systems import to_disk

# O_APPEND: after another program has cut the file, a row does not leave a hole of zeros before it.
_FLAGS = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)


class Written(NamedTuple):
    """A part of the file from its first byte on: number of rows and of bytes, and the CRC-32 of the bytes."""

    rows: int = 0
    bytes: int = 0
    crc32: int = 0


class RowFile:
    """A file of rows that is being written.

    Parameters
    ----------
    path : pathlib.Path
        Absolute path of a file that does not exist.

    Attributes
    ----------
    path : pathlib.Path
    file : FileIO
    written : Written
        What the system has taken; it survives the end of the process.
    synced : Written
        What is on the disk.
    unsynced : list of (int, bytes)
        The rows since then, also those that could not be written.

    Raises
    ------
    OSError
        The file exists or cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.written = self.synced = Written()
        self.unsynced: list[tuple[int, bytes]] = []
        self.file: FileIO = os.fdopen(os.open(path, _FLAGS, 0o666), "r+b", buffering=0)
        try:
            lock(self.file)
            self._watch = Watch(self.file, path)
            self.put(0, HEADER.encode())
        except OSError:
            self.discard()
            raise

    @property
    def refused(self) -> int:
        """Number of rows that could not be written."""
        return self.synced.rows + sum(rows for rows, _ in self.unsynced) - self.written.rows

    def append(self, block: Block) -> None:
        """See that the file is as it was written, and write samples as rows: all of them or, after an error, none.

        Raises
        ------
        RecordingError
            Another program has changed the file, or its name.
        OSError
            The disk failed, or is full.
        """
        rows = len(block), format_rows(block)
        self.unsynced.append(rows)  # before anything can fail
        self._watch.look(self.written.bytes)
        self.put(*rows)

    def put(self, rows: int, data: bytes) -> None:
        """Write rows that are text already, and do not keep them."""
        try:
            write(self.file, data)
        except OSError:
            self._cut()
            raise
        self.written = _longer(self.written, rows, data)

    def sync(self) -> None:
        """Sync the rows to the disk.

        Raises
        ------
        OSError
            The disk failed.
        """
        to_disk(self.file.fileno(), data_only=True)
        self.synced = self.written
        self.unsynced.clear()

    def restart(self) -> None:
        """Remove all rows."""
        header = HEADER.encode()
        self.file.truncate(len(header))
        self.written = _longer(Written(), 0, header)

    def close(self) -> None:
        """Unlock the file and close it."""
        if not self.file.closed:
            unlock(self.file)
        self.file.close()

    def discard(self) -> None:
        """Close the file and remove it: nothing was written."""
        self.close()
        self.path.unlink()

    def _cut(self) -> None:
        """Remove a row that was written in part."""
        with suppress(OSError):
            if os.fstat(self.file.fileno()).st_size > self.written.bytes:
                self.file.truncate(self.written.bytes)


def write(file: FileIO, data: bytes) -> None:
    """Write all bytes: one write to a raw file may write only a part."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) or 0 :]


def _longer(written: Written, rows: int, data: bytes) -> Written:
    return Written(written.rows + rows, written.bytes + len(data), zlib.crc32(data, written.crc32))
