"""Locks of open files, which end with the process that has them, also if that is killed."""

import errno
import os
import sys
import time
from contextlib import suppress
from typing import IO, Any

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


def is_in_use(file: IO[Any]) -> bool:
    """Return whether a process has locked the file; False where the file system has no locks."""
    for _ in range(2):  # on Windows a second reader that asks has the lock for a moment
        if not _is_taken(file, shared=True):
            unlock(file)
            return False
        time.sleep(_AGAIN_S)
    return True


def try_lock(file: IO[Any]) -> bool | None:
    """Lock an open file; False: another process has the lock. None: the file system has no locks."""
    try:
        _take(file.fileno(), shared=False)
    except OSError as error:
        return False if isinstance(error, BlockingIOError | PermissionError) else None
    return True


def _is_taken(file: IO[Any], *, shared: bool) -> bool:
    """Lock a file, or return True: another process has the lock."""
    try:
        _take(file.fileno(), shared=shared)
    except OSError as error:  # another number: the file system has no locks
        return isinstance(error, BlockingIOError | PermissionError)
    return False
