"""Marks a recording in progress by a lock on its open file; the lock ends with the process, also if that is killed."""

import ctypes
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


class Overlapped(ctypes.Structure):
    """OVERLAPPED: the place in the file."""

    _fields_ = (
        ("internal", ctypes.c_size_t),
        ("internal_high", ctypes.c_size_t),
        ("offset", ctypes.c_uint32),
        ("offset_high", ctypes.c_uint32),
        ("event", ctypes.c_void_p),
    )


class WindowsLock:
    """The lock of Windows, `LockFileEx`: of one byte far behind the end of the file, as nobody can read a locked byte.

    Parameters
    ----------
    kernel : object
        The functions LockFileEx and UnlockFileEx of kernel32; 0: failed.
    handle_of, last_error : callable
        Handle of a file descriptor; GetLastError().
    """

    PLACE, VIOLATION = 2**63 - 2, 33  # the last byte that a file can have is before it; ERROR_LOCK_VIOLATION
    _AT_ONCE, _EXCLUSIVE = 1, 2

    def __init__(self, kernel: Any, handle_of: Any, last_error: Any) -> None:
        self._kernel, self._handle_of, self._last_error = kernel, handle_of, last_error
        self._place = ctypes.byref(Overlapped(0, 0, self.PLACE & 0xFFFFFFFF, self.PLACE >> 32, None))

    def take(self, descriptor: int, *, shared: bool) -> bool:
        """Lock; return False where another process has the lock."""
        flags = self._AT_ONCE | (0 if shared else self._EXCLUSIVE)
        if self._kernel.LockFileEx(self._handle_of(descriptor), flags, 0, 1, 0, self._place):
            return True
        if (error := self._last_error()) == self.VIOLATION:
            return False
        raise OSError(f"LockFileEx: error {error} of Windows")

    def release(self, descriptor: int) -> None:
        """Unlock at once: when a file is closed Windows does so later."""
        self._kernel.UnlockFileEx(self._handle_of(descriptor), 0, 1, 0, self._place)


if sys.platform == "win32":  # pragma: no cover: Windows only
    import msvcrt
    from ctypes import wintypes

    _KERNEL = ctypes.WinDLL("kernel32", use_last_error=True)
    _DWORD, _PLACE = wintypes.DWORD, ctypes.POINTER(Overlapped)
    _KERNEL.LockFileEx.argtypes = (wintypes.HANDLE, _DWORD, _DWORD, _DWORD, _DWORD, _PLACE)
    _KERNEL.UnlockFileEx.argtypes = (wintypes.HANDLE, _DWORD, _DWORD, _DWORD, _PLACE)
    _LOCKS = WindowsLock(_KERNEL, msvcrt.get_osfhandle, ctypes.get_last_error)
else:
    import fcntl

    class Flock:
        """The lock of Linux and macOS: of the whole file, and only for those who ask."""

        def take(self, descriptor: int, *, shared: bool) -> bool:
            """Lock; return False where another process has the lock."""
            try:
                fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
            return True

        def release(self, descriptor: int) -> None:
            """Unlock, also where a child process has the file open, too."""
            fcntl.flock(descriptor, fcntl.LOCK_UN)

    _LOCKS = Flock()


def lock(file: IO[Any]) -> None:
    """Lock an open file: it is being written. Without effect where the file system has no locks.

    Raises
    ------
    BlockingIOError
        Another process holds the lock.
    """
    until = time.monotonic() + _WAIT_S
    while _is_taken(file, shared=False):
        if time.monotonic() > until:
            raise BlockingIOError(errno.EWOULDBLOCK, os.strerror(errno.EWOULDBLOCK))
        time.sleep(_AGAIN_S)


def unlock(file: IO[Any]) -> None:
    """Unlock a file before it is closed."""
    with suppress(OSError):
        _LOCKS.release(file.fileno())


def is_locked(path: Path) -> bool:
    """Return whether a process is writing the file; False where the file system has no locks."""
    if path == STANDARD_INPUT:
        return False
    with open_regular(path) as file:
        taken = _is_taken(file, shared=True)
        if not taken:
            unlock(file)
        return taken


def _is_taken(file: IO[Any], *, shared: bool) -> bool:
    """Lock a file, or return True: another process has the lock."""
    try:
        return not _LOCKS.take(file.fileno(), shared=shared)
    except OSError:  # the file system has no locks
        return False
