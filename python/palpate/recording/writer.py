"""Writes the two files of a recording, and goes on in a rescue recording if they are disturbed."""

import errno
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from palpate.errors import RecordingError
from palpate.recording import rescue
from palpate.recording.row_file import RowFile
from palpate.recording.sidecar import RESCUED, sidecar_path
from palpate.recording.sidecar_file import SidecarFile
from palpate.samples import Block

_FULL = (errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC))


class Writer:
    """The files of a recording in progress; used by one thread, but for `sidecar`.

    Parameters
    ----------
    path : pathlib.Path
        NAME.csv, absolute.
    document : dict
        As from `sidecar.fresh`.

    Attributes
    ----------
    path : pathlib.Path
        NAME.csv, or the rescue recording.
    sidecar : SidecarFile
    error : RecordingError or None
        What happened to the recording.
    stopped : bool
        Whether nothing more is written.

    Raises
    ------
    RecordingError
        One of the two files already exists, or cannot be written.
    ValueError
        Too many notes, or too long ones.
    """

    def __init__(self, path: Path, document: dict[str, Any]) -> None:
        self.path = path
        self.error: RecordingError | None = None
        self.stopped: bool = False
        self.sidecar: SidecarFile
        self.sidecar, self._rows = _create(path, document)
        self._checkpointed = self._rows.synced
        self._taken = 0
        self._rescued = False

    @property
    def rows(self) -> int:
        """Number of rows in the file."""
        return self._rows.written.rows

    @property
    def missing(self) -> int:
        """Number of samples that are not in the file."""
        return max(0, self._taken - self.rows)

    def write(self, block: Block) -> None:
        """Write samples as rows."""
        self._attempt(lambda: self._rows.append(block))
        self._taken += len(block)

    def mark(self, what: dict[str, Any]) -> None:
        """Add a mark without which the rows after it would be read wrongly: if it has no room, nothing more is written."""
        before = self.path
        self._attempt(lambda: self.sidecar.add("marks", what))
        if self.path != before:  # a rescue recording, begun without it
            self._attempt(lambda: self.sidecar.add("marks", what))

    def note(self, text: str) -> None:
        """Add a note on the rows that come."""
        self._attempt(lambda: self.sidecar.put(text))

    def checkpoint(self, entries: dict[str, Any]) -> None:
        """Sync the rows; then say in the sidecar how many are on the disk. One that cannot be saved is tried again."""
        self._attempt(lambda: self._checkpoint(entries))

    def end(self, entries: dict[str, Any], end: dict[str, Any]) -> None:
        """Close the file, and write the end of the sidecar: `end`, with the rows and whether they are complete.

        Raises
        ------
        RecordingError
            It cannot be written, or the rescue recording failed, too.
        """
        self._rows.close()
        failure = {"error": str(self.error)} if self.stopped else {}
        last = {} if self.stopped else {"checkpoint": None}  # the end says the same
        whole = {**self._rows.written._asdict(), "clean": not self.stopped, **end, **failure}
        try:
            self.sidecar.put(**entries, end=whole, **last)
        except OSError as error:
            raise self.error or unwritable(self.path, error) from error
        if self.error and self.stopped and self._rescued:
            raise self.error

    def _checkpoint(self, entries: dict[str, Any]) -> None:
        self._rows.sync()
        if self._rows.synced != self._checkpointed or self.sidecar.unsaved:
            with suppress(OSError):
                self.sidecar.put(**entries, checkpoint=self._rows.synced._asdict())
                self._checkpointed = self._rows.synced

    def _attempt(self, step: Callable[[], object]) -> None:
        try:
            step()
        except RecordingError as fault:
            self._disturbed(fault)
        except OSError as fault:
            said = unwritable(self.path, fault)
            if fault.errno in _FULL and not self.error:
                self._stop(said)
            else:
                self._disturbed(said)
        except Exception as fault:  # noqa: BLE001  the thread must not end in silence
            self._stop(RecordingError(self.path, f"cannot be written: {type(fault).__name__}: {fault}"))

    def _stop(self, error: RecordingError) -> None:
        self.stopped, self.error = True, error

    def _disturbed(self, fault: RecordingError) -> None:
        if self.error:
            self._stop(RecordingError(self.error.path, f"{self.error.reason}, but not all: {fault}"))
        else:
            self._rescue(fault)

    def _rescue(self, fault: RecordingError) -> None:
        """Go on in a rescue recording. The error is set first: the source ends while the rows are copied."""
        lost = self._rows
        try:
            rescued = rescue.begin(lost, self.sidecar, str(fault))
        except OSError as error:
            self._stop(RecordingError(fault.path, f"{fault.reason}; no rescue recording could be made: {error}"))
            return
        self._rescued = True
        self.path, self._rows = rescued.path, rescued
        self.error = RecordingError(fault.path, f"{fault.reason}; what could be saved is in {rescued.path}")
        self._attempt(lambda: self._fill(rescued, lost))

    def _fill(self, rescued: RowFile, lost: RowFile) -> None:
        try:
            rescue.fill(rescued, lost)
        finally:
            lost.close()
        if missing := lost.written.rows + lost.refused - rescued.written.rows:
            self.sidecar.put(f"{RESCUED}{missing} rows are missing: {lost.path} has lost them, or cannot be read")


def unwritable(path: Path, error: OSError) -> RecordingError:
    """Return the error that a file cannot be written."""
    return RecordingError(path, f"cannot be written: {error.strerror}")


def _create(path: Path, document: dict[str, Any]) -> tuple[SidecarFile, RowFile]:
    """Create the sidecar, then the file: rows always have a sidecar, even if the process is killed."""
    if path.exists():
        raise RecordingError(path, "already exists: choose another name")
    beside = sidecar_path(path)
    try:
        described = SidecarFile(beside, document)
    except FileExistsError as error:
        raise RecordingError(beside, "already exists: choose another name") from error
    except OSError as error:
        raise unwritable(path, error) from error
    try:
        return described, RowFile(path)
    except OSError as error:
        described.discard()
        raise unwritable(path, error) from error
