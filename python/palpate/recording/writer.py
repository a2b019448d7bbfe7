"""The files of a recording in progress: rows are added, the sidecar is replaced.

A lock on the open file marks it; the lock ends with the process, also if that is killed.
"""

import errno
import os
import sys
import time
import zlib
from collections.abc import Callable
from contextlib import suppress
from io import FileIO
from pathlib import Path
from threading import Lock
from typing import IO, Any, NamedTuple

from palpate.errors import RecordingError
from palpate.files import (
    EXISTS,
    STANDARD_INPUT,
    Json,
    file_errors,
    open_regular,
    read_bytes,
    replacing,
    to_disk,
)
from palpate.recording import sidecar
from palpate.recording.rows import HEADER, format_rows
from palpate.samples import Block

# a reader that asks has the lock for some microseconds
_WAIT_S = 1.0
_AGAIN_S = 0.005

if sys.platform == "win32":  # pragma: no cover: Windows only
    import msvcrt

    _PLACE = 2**31 - 2  # nobody else can read a locked byte: one that only a recording of 2 GB has

    def _take(descriptor: int, *, shared: bool) -> None:
        """Take the lock; `is_locked` takes it for a moment, too: the standard library has no shared lock on Windows."""
        os.lseek(descriptor, _PLACE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

    def _release(descriptor: int) -> None:
        os.lseek(descriptor, _PLACE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_UNLCK, 1)

else:
    import fcntl

    def _take(descriptor: int, *, shared: bool) -> None:
        """Lock the whole file; the lock only marks it as in use."""
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)

    def _release(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_UN)


def lock(file: IO[Any]) -> None:
    """Lock an open file, if the file system has locks; BlockingIOError: another process has it."""
    until = time.monotonic() + _WAIT_S
    while _is_taken(file, shared=False):
        if time.monotonic() > until:
            raise BlockingIOError(errno.EWOULDBLOCK, os.strerror(errno.EWOULDBLOCK))
        time.sleep(_AGAIN_S)


def unlock(file: IO[Any]) -> None:
    """Unlock a file before it is closed: Windows would unlock later, and a child may have it open."""
    with suppress(OSError):
        _release(file.fileno())


def is_locked(path: Path) -> bool:
    """Return whether a process is writing the file; False where the file system has no locks."""
    if path == STANDARD_INPUT:
        return False
    with open_regular(path) as file:
        for _ in range(2):  # on Windows a second reader that asks has the lock for a moment
            if not _is_taken(file, shared=True):
                unlock(file)
                return False
            time.sleep(_AGAIN_S)
    return True


def _is_taken(file: IO[Any], *, shared: bool) -> bool:
    """Lock a file, or return True: another process has the lock."""
    try:
        _take(file.fileno(), shared=shared)
    except OSError as error:  # another number: the file system has no locks
        return isinstance(error, BlockingIOError | PermissionError)
    return False


# O_APPEND: after another program has cut the file, a row does not leave a hole of zeros before it.
_FLAGS = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)
_MOST_BYTES = sidecar.LARGEST - 20_000  # the rest is for checkpoint and end


class Written(NamedTuple):
    """The first part of the file: its rows, its bytes, and their CRC-32."""

    rows: int = 0
    bytes: int = 0
    crc32: int = 0


class Writer:
    """The files of a recording in progress; after the first `error` nothing is written."""

    def __init__(self, path: Path, document: Json) -> None:
        self.path = path
        self.error: RecordingError | None = None
        self.written = self.synced = self._checkpointed = Written()
        self._taken = 0
        if path.exists():
            raise RecordingError(path, EXISTS)
        beside = sidecar.sidecar_path(path)
        # First the sidecar: rows always have one, after a kill, too.
        with file_errors(beside, "cannot be written"):
            self.sidecar = SidecarFile(beside, document)
        try:
            with file_errors(path, "cannot be written"):
                self._file = self._created()
        except RecordingError:
            beside.unlink()
            raise

    def _created(self) -> FileIO:
        file: FileIO = os.fdopen(os.open(self.path, _FLAGS, 0o666), "r+b", buffering=0)
        try:
            lock(file)
            held = os.fstat(file.fileno())
            # Some network file systems do not number their files.
            self._is_numbered = os.path.samestat(held, self.path.stat())
            write(file, HEADER.encode())
        except OSError:
            file.close()
            self.path.unlink()
            raise
        self.written = Written(0, len(HEADER), zlib.crc32(HEADER.encode()))
        return file

    @property
    def missing(self) -> int:
        """Number of samples that are not in the file."""
        return self._taken - self.written.rows

    def write(self, block: Block) -> None:
        """Write samples as rows, all or none; a file that was removed or changed is an error."""
        self.attempt(lambda: self._append(len(block), format_rows(block)))
        self._taken += len(block)

    def checkpoint(self, entries: Json) -> None:
        """Sync the rows; then store in the sidecar how many are on the disk."""
        self.attempt(lambda: self._checkpoint(entries))

    def end(self, entries: Json, end: Json) -> None:
        """Close the file, and write the end of the sidecar; RecordingError if that is not possible."""
        unlock(self._file)
        self._file.close()
        whole = {**self.written._asdict(), "clean": self.error is None, **end}
        if self.error:
            whole["error"] = str(self.error)
        else:
            entries = {**entries, "checkpoint": None}  # the end has the same numbers
        try:
            with file_errors(self.path, "cannot be written"):
                self.sidecar.put(**entries, end=whole)
        except RecordingError as error:
            raise self.error or error from None

    def _append(self, rows: int, data: bytes) -> None:
        self._require_own_file()
        before = self.written
        try:
            write(self._file, data)
        except OSError:
            with suppress(OSError):  # a row that was written in part
                self._file.truncate(before.bytes)
            raise
        self.written = Written(
            before.rows + rows, before.bytes + len(data), zlib.crc32(data, before.crc32)
        )

    def _require_own_file(self) -> None:
        """Compare the open file with its path."""
        held = os.fstat(self._file.fileno())
        wrong = ""
        try:
            named = self.path.stat()
            if self._is_numbered and not os.path.samestat(held, named):
                wrong = "was replaced by another file"
            elif held.st_size != self.written.bytes:
                sizes = f"from {self.written.bytes} bytes to {held.st_size},"
                wrong = f"was changed by another program, {sizes}"
        except (FileNotFoundError, NotADirectoryError):
            wrong = "was removed, renamed or moved"
        if wrong:
            raise RecordingError(self.path, f"{wrong} while it was recorded")

    def _checkpoint(self, entries: Json) -> None:
        to_disk(self._file.fileno(), data_only=True)
        self.synced = self.written
        if self.synced != self._checkpointed or self.sidecar.unsaved:
            with suppress(OSError):  # it is tried again
                self.sidecar.put(**entries, checkpoint=self.synced._asdict())
                self._checkpointed = self.synced

    def attempt(self, step: Callable[[], object]) -> None:
        """Take a step that later rows need: its error ends the recording."""
        if self.error:
            return
        try:
            step()
        except RecordingError as error:
            self.error = error
        except Exception as error:  # noqa: BLE001  the thread must not end in silence
            why = f"{type(error).__name__}: {error}"
            if isinstance(error, OSError):
                why = str(error.strerror)
            synced = f"{self.synced.rows:,} rows are synced to the disk"
            self.error = RecordingError(self.path, f"cannot be written: {why}; {synced}")


class SidecarFile:
    """The sidecar of a recording in progress; its methods may be called from any thread."""

    def __init__(self, path: Path, document: Json) -> None:
        self.path = path
        self.unsaved = False
        self._lock = Lock()
        self._document = document
        self._with("notes", document["notes"])
        path.open("xb").close()  # the process that creates it owns the name
        self._saved = b""
        try:
            self._save(document)
        except OSError:
            path.unlink()
            raise

    def add(self, name: str, entry: str | Json) -> int:
        """Add a note or a mark; return their number. ValueError: no room; errors as `put`."""
        with self._lock:
            longer = [*self._document[name], entry]
            self._save(self._with(name, longer))
            return len(longer)

    def rename(self, number: int, text: str) -> None:
        """Give a mark another text; its number, from 1, is as `add` returned it. Errors as in `add`."""
        with self._lock:
            marks = list(self._document["marks"])
            if not 1 <= number <= len(marks):
                raise ValueError(
                    f"mark: got number {number}, allowed: 1 to {len(marks)}, as it was returned"
                )
            if marks[number - 1].get("tare"):
                raise ValueError(
                    f"mark: got number {number}, a tare or gap, allowed: a mark that was made by hand"
                )
            marks[number - 1] = {**marks[number - 1], "text": text}
            self._save(self._with("marks", marks))

    def set(self, name: str, entry: Json) -> None:
        """Set an entry, which is saved with the next `put`; ValueError if there is no room for it."""
        with self._lock:
            self._document = self._with(name, entry)
            self.unsaved = True

    def put(self, *notes: str, **entries: Any) -> None:
        """Add notes, set entries (None removes one), and save; after an error nothing has changed."""
        with self._lock:
            document = {**self._document, "notes": [*self._document["notes"], *notes], **entries}
            self._save({name: value for name, value in document.items() if value is not None})

    def _with(self, name: str, entry: object) -> Json:
        """Return the document with an entry; ValueError if it is too long."""
        document = {**self._document, name: entry}
        size = len(sidecar.text_of(document))
        if size > _MOST_BYTES:
            allowed = f"{_MOST_BYTES}; begin another one"
            raise ValueError(f"{name}: got {size} bytes of sidecar with them, allowed: {allowed}")
        return document

    def _save(self, document: Json) -> None:
        text = sidecar.text_of(document).encode()
        with replacing(self.path) as file:
            file.write(text)
            file.flush()
            to_disk(file.fileno())
            with suppress(FileNotFoundError):  # removed: it is written again
                if read_bytes(self.path, sidecar.LARGEST) != self._saved:
                    raise RecordingError(
                        self.path, "was changed by another program while it was recorded"
                    )
        self._document = document
        self._saved = text
        self.unsaved = False


def write(file: FileIO, data: bytes) -> None:
    """Write all bytes: one write to a raw file may write only a part."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) or 0 :]
