"""The file of a recording in progress, to which rows are added.

A lock on the open file marks it; the lock ends with the process, also if that is killed.
"""

import os
import time
import zlib
from collections.abc import Callable
from contextlib import suppress
from io import FileIO
from pathlib import Path
from typing import NamedTuple

from palpate.errors import RecordingError
from palpate.file_locks import is_in_use, lock, unlock
from palpate.files import EXISTS, STANDARD_INPUT, Json, file_errors, open_regular, to_disk
from palpate.recording import sidecar
from palpate.recording.retry_state import RetryState, reason_of
from palpate.recording.rows import HEADER, format_rows
from palpate.recording.sidecar_file import SidecarFile
from palpate.samples import Block


def is_locked(path: Path) -> bool:
    """Return whether a process is writing the file; False where the file system has no locks."""
    if path == STANDARD_INPUT:
        return False
    with open_regular(path) as file:
        return is_in_use(file)


# O_APPEND: after another program has cut the file, a row does not leave a hole of zeros before it.
_FLAGS = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_APPEND | getattr(os, "O_BINARY", 0)
_RETRY_S = 0.1


class Written(NamedTuple):
    """The first part of the file: its rows, its bytes, and their CRC-32."""

    rows: int = 0
    bytes: int = 0
    crc32: int = 0


class Writer:
    """The files of a recording in progress: rows are added until the first `error`.

    A step that fails is tried again by the caller: `disk` says why, and nothing of it is in the
    file. `error` is final: the file is no longer that of the recording.

    Attributes
    ----------
    error : RecordingError or None
        Why nothing more can be written.
    disk : RetryState
        Whether the last step has failed.
    written, synced : Written
        What is in the file, and what is on the disk.
    sidecar : SidecarFile
    """

    def __init__(self, path: Path, document: Json) -> None:
        self.path = path
        self.error: RecordingError | None = None
        self.disk: RetryState = RetryState()
        self.written = self.synced = self._checkpointed = Written()
        self._unsynced: list[bytes] = []  # the rows after `synced`
        self._is_torn = False  # a row may be in the file in part
        self._is_doubtful = False  # a sync has failed: what was not synced may be lost
        if path.exists():
            raise RecordingError(path, EXISTS)
        beside = sidecar.sidecar_path(path)
        # First the sidecar: rows always have one, after a kill, too.
        with file_errors(beside, "cannot be written"):
            self.sidecar: SidecarFile = SidecarFile(beside, document)
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
        self._unsynced = [HEADER.encode()]
        return file

    def write(self, block: Block) -> bool:
        """Write samples as rows, all or none; return False if that failed."""
        return self._attempt(lambda: self._append(len(block), format_rows(block)))

    def checkpoint(self, entries: Json) -> bool:
        """Sync the rows; then put into the sidecar how many are on the disk, without saving it."""
        if not self._attempt(self._sync):
            return False
        if self.synced != self._checkpointed:
            self.sidecar.put(**entries, checkpoint=self.synced._asdict())
            self._checkpointed = self.synced
        return True

    def end(self, entries: Json, end: Json, patience_s: float = 0.0) -> None:
        """Close the file, and save the end of the sidecar, which is tried again for some time.

        Raises
        ------
        RecordingError
            The first `error`; or the end cannot be saved.
        """
        unlock(self._file)
        with suppress(OSError):  # of a file system that writes when a file is closed
            self._file.close()
        whole = {**self.written._asdict(), "clean": self.error is None, **end}
        if self.error:
            whole["error"] = str(self.error)
        else:
            entries = {**entries, "checkpoint": None}  # the end has the same numbers
        self.sidecar.put(**entries, end=whole)
        until_s = time.monotonic() + patience_s
        while not self.sidecar.save():
            if self.sidecar.is_foreign or time.monotonic() > until_s:
                raise self.error or self._unsaved()
            time.sleep(_RETRY_S)

    def _unsaved(self) -> RecordingError:
        reason = self.sidecar.retry.reason
        if not self.sidecar.is_foreign:
            reason = f"cannot be written: {reason}"
        lost = "the end of the recording and the newest notes and marks are in no file"
        text = f"{reason}; {lost}; its {self.written.rows:,} rows are written"
        return RecordingError(self.sidecar.path, text)

    def _append(self, rows: int, data: bytes) -> None:
        if self._is_doubtful:
            self._sync()
        self._require_own_file()
        before = self.written
        try:
            write(self._file, data)
        except Exception:
            self._is_torn = True
            with suppress(OSError):
                self._cut_torn_row()
            raise
        self._unsynced.append(data)
        self.written = Written(
            before.rows + rows, before.bytes + len(data), zlib.crc32(data, before.crc32)
        )

    def _cut_torn_row(self) -> None:
        if self._is_torn:
            self._file.truncate(self.written.bytes)
            self._is_torn = False

    def _require_own_file(self) -> None:
        """Compare the open file with its path."""
        self._cut_torn_row()
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

    def _sync(self) -> None:
        """Sync the rows; after a sync that failed, write those after `synced` again before it.

        Linux reports a failed write-back once, and then takes the pages for written: a second sync
        alone would succeed without them (https://lwn.net/Articles/752063).
        """
        if self._is_doubtful:
            self._require_own_file()
            with self.path.open("r+b") as again:  # the other one only appends
                again.seek(self.synced.bytes)
                again.write(b"".join(self._unsynced))
        self._is_doubtful = True
        to_disk(self._file.fileno(), data_only=True)
        self._is_doubtful = False
        self.synced = self.written
        self._unsynced.clear()

    def _attempt(self, step: Callable[[], object]) -> bool:
        """Take a step; return False if it failed, or if the recording has ended."""
        if self.error:
            return False
        try:
            step()
        except RecordingError as error:
            self.error = error
            return False
        except Exception as error:  # noqa: BLE001  it is tried again, and shown
            self.disk.failed(reason_of(error))
            return False
        self.disk.succeeded()
        return True

    def miss_rows(self, count: int, reason: str) -> None:
        """Note that some rows are not in the file, which is an error at the end."""
        if count and not self.error:
            text = f"{count:,} rows are missing: {reason}; {self.written.rows:,} rows are written"
            self.error = RecordingError(self.path, text)

    def give_up(self) -> None:
        """End the recording with the error of the last step, which failed."""
        if not self.error:
            synced = f"{self.synced.rows:,} rows are synced to the disk"
            text = f"cannot be written: {self.disk.reason}; {synced}"
            self.error = RecordingError(self.path, text)


def write(file: FileIO, data: bytes) -> None:
    """Write all bytes: one write to a raw file may write only a part."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) or 0 :]
