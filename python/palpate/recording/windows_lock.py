"""The lock of Windows, `LockFileEx`: of one byte far behind the end of the file, as others cannot read a locked byte."""

import ctypes
import sys
from collections.abc import Callable
from typing import Any

PLACE = 2**63 - 2
"""The byte that is locked; the last one that a file can have is before it."""
VIOLATION = 33
"""ERROR_LOCK_VIOLATION: another handle has the lock."""
_AT_ONCE, _EXCLUSIVE = 1, 2  # LOCKFILE_FAIL_IMMEDIATELY, LOCKFILE_EXCLUSIVE_LOCK


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
    """Locks open files by two functions of kernel32.

    Parameters
    ----------
    lock_file, unlock_file : callable
        LockFileEx, UnlockFileEx; 0: failed.
    handle_of : callable
        Returns the handle of a file descriptor.
    last_error : callable
        Returns GetLastError().
    """

    def __init__(
        self,
        lock_file: Callable[..., int],
        unlock_file: Callable[..., int],
        handle_of: Callable[[int], int],
        last_error: Callable[[], int],
    ) -> None:
        self._lock_file, self._unlock_file = lock_file, unlock_file
        self._handle_of, self._last_error = handle_of, last_error

    def take(self, descriptor: int, *, shared: bool) -> bool:
        """Lock; return False where another one has the lock.

        Raises
        ------
        OSError
            The file system has no locks.
        """
        flags = _AT_ONCE | (0 if shared else _EXCLUSIVE)
        if self._lock_file(self._handle_of(descriptor), flags, 0, 1, 0, _place()):
            return True
        error = self._last_error()
        if error == VIOLATION:
            return False
        raise OSError(f"LockFileEx: error {error} of Windows")

    def release(self, descriptor: int) -> None:
        """Unlock at once: when a file is closed Windows does so later."""
        self._unlock_file(self._handle_of(descriptor), 0, 1, 0, _place())


def _place() -> Any:
    return ctypes.byref(Overlapped(0, 0, PLACE & 0xFFFFFFFF, PLACE >> 32, None))


def of_this_system() -> WindowsLock | None:
    """Return the lock of this system; None: it is not Windows."""
    if sys.platform != "win32":
        return None
    import msvcrt  # pragma: no cover: Windows only
    from ctypes import wintypes

    kernel = ctypes.WinDLL("kernel32", use_last_error=True)
    dword, place = wintypes.DWORD, ctypes.POINTER(Overlapped)
    kernel.LockFileEx.argtypes = (wintypes.HANDLE, dword, dword, dword, dword, place)
    kernel.UnlockFileEx.argtypes = (wintypes.HANDLE, dword, dword, dword, place)
    return WindowsLock(kernel.LockFileEx, kernel.UnlockFileEx, msvcrt.get_osfhandle, ctypes.get_last_error)
