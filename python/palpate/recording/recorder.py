"""Writes a recording during the measurement, in its own thread: a slow disk does not delay the source.

Rows are flushed every 0.1 s; they survive if the process is killed. Each second they are synced to the disk, and then a
checkpoint of what is synced goes to the sidecar: so a recording without an end can be verified up to it.
"""

import os
import time
import zlib
from collections.abc import Callable
from contextlib import suppress
from io import FileIO
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Any

import numpy as np

from palpate._core import SampleRing
from palpate.errors import RecordingError
from palpate.recording import sidecar
from palpate.recording.filelock import lock
from palpate.recording.rows import HEADER, format_rows
from palpate.samples import DTYPE, Block, Sample

FLUSH_S, SYNC_S = 0.1, 1.0
CAPACITY = 8192  # samples: buffer for a disk that hangs for about a minute


class Recorder:
    """Writes a recording while it is measured.

    Parameters
    ----------
    path : path-like
        NAME.csv; the sidecar becomes NAME.json.
    device : dict
        Description of the instrument, from `Source.describe`.
    settings : dict
        Scene and settings of the tracker.
    notes : list of str

    Attributes
    ----------
    rows : int
        Number of rows written.
    error : RecordingError or None
        The error that stopped the recorder.

    Raises
    ------
    RecordingError
        One of the two files already exists, or cannot be written.
    ValueError
        The name does not end in ".csv".

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> recorder = Recorder(folder / "run.csv", {}, {}, ["a note"])
    >>> recorder.push(Sample(0, 0, 13_000_000, 8388608, 8388608, 0.0, 0.0))
    True
    >>> recorder.close()
    >>> (folder / "run.csv").read_text().splitlines()[1]
    '0,0.000000000,0.013000000,8388608,8388608,0.0,0.0,0'
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        device: dict[str, Any],
        settings: dict[str, Any],
        notes: list[str],
    ) -> None:
        self.path: Path = Path(path)
        self.rows: int = 0
        self.error: RecordingError | None = None
        self._sidecar = sidecar.sidecar_path(self.path)
        self._document = sidecar.fresh(device, settings, list(notes))
        self._lock = Lock()
        self._ring = SampleRing(CAPACITY)
        self._wake, self._closing = Event(), False
        self._size = self._unwritten = self._checksum = self._synced = 0
        self._file = self._create()
        self._thread = Thread(target=self._run, name="palpate-recorder", daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> int:
        """Number of samples that are not in the file, because the disk was too slow or failed."""
        return self._ring.dropped + self._unwritten + (len(self._ring) if self.error else 0)

    @property
    def is_behind(self) -> bool:
        """Whether a source that can wait should wait for the disk."""
        return self.error is None and 2 * len(self._ring) > CAPACITY

    def push(self, sample: Sample) -> bool:
        """Add a sample; return whether there was room. To be called from one thread only."""
        taken = self._ring.push(sample)
        if self.is_behind:
            self._wake.set()
        return taken

    def note(self, text: str) -> None:
        """Add a note to the sidecar."""
        self._add("notes", text)

    def mark(self, text: str, sample: Sample | None, **more: Any) -> None:
        """Add a mark at a sample to the sidecar."""
        where = {} if sample is None else {"seq": sample.seq, "t_s": sample.t_hard_ns / 1e9}
        self._add("marks", {**where, "text": text, **more})

    def close(self, counters: Callable[[], dict[str, int]] = dict, error: str | None = None) -> None:
        """Write the remaining samples and the end of the sidecar, and close the file.

        Parameters
        ----------
        counters : callable
            Returns the counters for the sidecar; called when all rows are written.
        error : str, optional
            The error that ended the source.
        """
        if self._closing:
            return
        self._ring.close()
        self._closing = True
        self._wake.set()
        self._thread.join()
        failure = str(self.error) if self.error else error
        end: dict[str, Any] = {"rows": self.rows, "dropped": self.dropped, "clean": self.error is None}
        end |= {"bytes": self._size, "crc32": self._checksum, "counters": counters()}
        self._document["end"] = end | ({"error": failure} if failure else {})
        if self.error is None:
            self._document.pop("checkpoint", None)  # the end says the same
        with suppress(OSError):
            sync(self._file)
        self._file.close()
        self._save_or_fail()

    def _create(self) -> FileIO:
        """Create the sidecar, then the file: rows always have a sidecar, even if the process is killed."""
        if self.path.exists():
            raise RecordingError(self.path, "already exists: choose another name")
        try:
            self._sidecar.open("x").close()  # the process that creates it owns the name
        except FileExistsError as error:
            raise RecordingError(self._sidecar, "already exists: choose another name") from error
        except OSError as error:
            raise self._unwritable(error) from error
        try:
            self._save()
            return self._begin()
        except OSError as error:
            self._sidecar.unlink()
            raise self._unwritable(error) from error

    def _begin(self) -> FileIO:
        file = self.path.open("xb", buffering=0)
        try:
            lock(file)
            self._append(file, HEADER.encode())
        except OSError:
            file.close()
            self.path.unlink()
            raise
        return file

    def _unwritable(self, error: OSError) -> RecordingError:
        return RecordingError(self.path, f"cannot be written: {error.strerror}")

    def _run(self) -> None:
        waiting = np.empty(CAPACITY, DTYPE)
        synced = time.monotonic()
        try:
            while self.error is None:
                closing = self._closing
                self._write_rows(waiting[: self._ring.pop_many(waiting)])
                if time.monotonic() - synced >= SYNC_S:
                    self._checkpoint()
                    synced = time.monotonic()
                if closing:
                    return
                self._wake.wait(FLUSH_S)
                self._wake.clear()
        except OSError as error:
            self.error = self._unwritable(error)

    def _checkpoint(self) -> None:
        """Sync the rows; then say in the sidecar how many are on the disk. One that cannot be saved is tried again."""
        if self._size == self._synced:
            return
        sync(self._file)
        with self._lock:
            self._document["checkpoint"] = {"rows": self.rows, "bytes": self._size, "crc32": self._checksum}
        with suppress(OSError):
            self._save()
            self._synced = self._size

    def _write_rows(self, block: Block) -> None:
        try:
            self._append(self._file, format_rows(block))
        except OSError:
            self._unwritten += len(block)
            with suppress(OSError):
                self._file.truncate(self._size)
            raise
        self.rows += len(block)

    def _append(self, file: FileIO, data: bytes) -> None:
        self._size += _write(file, data)
        self._checksum = zlib.crc32(data, self._checksum)

    def _add(self, where: str, what: Any) -> None:
        with self._lock:
            self._document[where].append(what)
        self._save_or_fail()

    def _save_or_fail(self) -> None:
        try:
            self._save()
        except OSError as error:
            raise self._unwritable(error) from error

    def _save(self) -> None:
        with self._lock:
            sidecar.save(self._sidecar, self._document)


def _write(file: FileIO, data: bytes) -> int:
    """Write all bytes: one write to a raw file may write only a part."""
    left = memoryview(data)
    while left:
        left = left[file.write(left) or 0 :]
    return len(data)


def sync(file: FileIO) -> None:
    """Sync the data of the file to the disk."""
    getattr(os, "fdatasync", os.fsync)(file.fileno())
