"""Locks of open files, which end with the process that has them, also if that is killed."""

import errno
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

# a reader that asks has the lock for some microseconds
_WAIT_S = 1.0
_CHANGE_WAIT_S = 20.0  # several programs may change a file, one after the other
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


def lock(file: IO[Any], wait_s: float | None = None) -> None:
    """Lock an open file, if the file system has locks; BlockingIOError: another process has it."""
    until = time.monotonic() + (_WAIT_S if wait_s is None else wait_s)
    while _is_taken(file, shared=False):
        if time.monotonic() > until:
            raise BlockingIOError(errno.EWOULDBLOCK, os.strerror(errno.EWOULDBLOCK))
        time.sleep(_AGAIN_S)


def unlock(file: IO[Any]) -> None:
    """Unlock a file before it is closed: Windows would unlock later, and a child may have it open."""
    with suppress(OSError):
        _release(file.fileno())


@contextmanager
def exclusive_change(path: Path) -> Iterator[None]:
    """Let one program at a time read, change and replace a file; the others wait.

    The lock is on a file of its own, .NAME.lock, since the file itself is replaced. It is removed
    afterwards. BlockingIOError: another program does not end its change.
    """
    beside = path.with_name(f".{path.name}.lock")
    try:
        file = _locked(beside)
    except BlockingIOError as error:
        text = f"another program has been changing it for {_CHANGE_WAIT_S:g} s: try again"
        raise BlockingIOError(error.errno, text, str(path)) from error
    try:
        yield
    finally:
        if sys.platform != "win32":
            beside.unlink(missing_ok=True)  # before the lock ends: the next one makes its own
        unlock(file)
        file.close()
        if sys.platform == "win32":  # pragma: no cover: Windows only
            with suppress(OSError):  # another program has opened it, and removes it
                beside.unlink()


def _locked(path: Path) -> IO[Any]:
    """Return the file of this path, open and locked: not one that was removed meanwhile."""
    while True:
        file = path.open("ab")
        try:
            lock(file, _CHANGE_WAIT_S)
            if path.exists() and os.path.samestat(os.fstat(file.fileno()), path.stat()):
                return file
        except FileNotFoundError:  # removed between the two questions
            pass
        except BaseException:
            file.close()
            raise
        file.close()


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
