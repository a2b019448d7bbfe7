"""Marks a recording in progress by a lock on its file; the lock ends with the process, also if that is killed."""

import errno
import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Protocol

from palpate.files import open_regular
from palpate.tables.packed import STANDARD_INPUT

_WAIT_S, _AGAIN_S = 1.0, 0.005  # a reader that asks has the lock for some microseconds


class _Locks(Protocol):
    def take(self, descriptor: int, *, shared: bool) -> bool: ...
    def release(self, descriptor: int) -> None: ...


def _of_this_system() -> _Locks | None:
    if sys.platform == "win32":
        from palpate.recording.windows_lock import of_this_system

        return of_this_system()
    else:  # noqa: RET505  so that mypy, which knows this condition, reads one of them only
        try:
            from palpate.recording.flock import Flock
        except ImportError:  # pragma: no cover: a system with neither: a recording in progress looks torn there
            return None
        return Flock()


_LOCKS = _of_this_system()


def lock(file: IO[Any]) -> None:
    """Lock an open file: it is being written. Without effect where the file system has no locks.

    Raises
    ------
    BlockingIOError
        Another process holds the lock.
    """
    until = time.monotonic() + _WAIT_S
    with suppress(_NoLocks):
        while not _taken(file, shared=False):
            if time.monotonic() > until:
                raise BlockingIOError(errno.EWOULDBLOCK, os.strerror(errno.EWOULDBLOCK))
            time.sleep(_AGAIN_S)


def unlock(file: IO[Any]) -> None:
    """Unlock a file before it is closed."""
    if _LOCKS:
        with suppress(OSError):
            _LOCKS.release(file.fileno())


def is_locked(path: Path) -> bool:
    """Return whether a process is writing the file; False where the file system has no locks."""
    if path == STANDARD_INPUT:
        return False
    with open_regular(path) as file:
        try:
            free = _taken(file, shared=True)
        except _NoLocks:
            return False
        if free:
            unlock(file)
        return not free


class _NoLocks(Exception):
    """The file system has no locks, or the system."""


def _taken(file: IO[Any], *, shared: bool) -> bool:
    if _LOCKS is None:
        raise _NoLocks
    try:
        return _LOCKS.take(file.fileno(), shared=shared)
    except OSError as error:
        raise _NoLocks from error
