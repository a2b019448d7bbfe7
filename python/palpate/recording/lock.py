"""Marks a recording in progress by a lock on its open file; the lock ends with the process, also if that is killed."""

import errno
import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from palpate.files import open_regular
from palpate.tables.packed import STANDARD_INPUT

_WAIT_S, _AGAIN_S = 1.0, 0.005  # a reader that asks has the lock for some microseconds

if sys.platform == "win32":  # pragma: no cover: Windows only
    import msvcrt

    _PLACE = 2**31 - 2  # nobody else can read a locked byte: one that only a recording of 2 GB has

    def _take(descriptor: int, *, shared: bool) -> None:
        """Lock, for a moment also for those who only ask: Windows has no shared lock in the standard library."""
        os.lseek(descriptor, _PLACE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

    def _release(descriptor: int) -> None:
        os.lseek(descriptor, _PLACE, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_UNLCK, 1)

else:
    import fcntl

    def _take(descriptor: int, *, shared: bool) -> None:
        """Lock the whole file, only for those who ask."""
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)

    def _release(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_UN)


def lock(file: IO[Any]) -> None:
    """Lock an open file: it is being written. BlockingIOError: by another process. No effect where a file system has no locks."""
    until = time.monotonic() + _WAIT_S
    while _is_taken(file, shared=False):
        if time.monotonic() > until:
            raise BlockingIOError(errno.EWOULDBLOCK, os.strerror(errno.EWOULDBLOCK))
        time.sleep(_AGAIN_S)


def unlock(file: IO[Any]) -> None:
    """Unlock a file before it is closed: a child process may have it open, too, and Windows unlocks later."""
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
