"""LockFileEx and UnlockFileEx as the documentation of Windows describes them, over files of this system."""

import os
from dataclasses import dataclass, field
from typing import Any

from palpate.recording.windows_lock import VIOLATION, WindowsLock

_AT_ONCE, _EXCLUSIVE = 1, 2
INVALID_FUNCTION = 1


@dataclass
class Kernel:
    """The locks of a system: each belongs to a handle, here a descriptor, and is of one byte of a file."""

    has_locks: bool = True
    error: int = 0
    held: list[tuple[int, tuple[int, int], int, bool]] = field(default_factory=list)

    def lock_file(self, handle: int, flags: int, reserved: int, low: int, high: int, place: Any) -> int:
        assert (reserved, low, high) == (0, 1, 0)
        assert flags & _AT_ONCE, "it would wait"
        if not self.has_locks:
            self.error = INVALID_FUNCTION
            return 0
        exclusive = bool(flags & _EXCLUSIVE)
        if any(exclusive or other for *_, other in self._at(handle, place)):
            self.error = VIOLATION
            return 0
        self.held.append((handle, self._file(handle), self._offset(place), exclusive))
        return 1

    def unlock_file(self, handle: int, reserved: int, low: int, high: int, place: Any) -> int:
        assert (reserved, low, high) == (0, 1, 0)
        for lock in self._at(handle, place):
            if lock[0] == handle:
                self.held.remove(lock)
                return 1
        self.error = 158  # ERROR_NOT_LOCKED
        return 0

    def locks(self) -> WindowsLock:
        return WindowsLock(self.lock_file, self.unlock_file, int, lambda: self.error)

    def _at(self, handle: int, place: Any) -> list[tuple[int, tuple[int, int], int, bool]]:
        file, offset = self._file(handle), self._offset(place)
        return [lock for lock in self.held if lock[1:3] == (file, offset)]

    @staticmethod
    def _file(handle: int) -> tuple[int, int]:
        found = os.fstat(handle)
        return found.st_dev, found.st_ino

    @staticmethod
    def _offset(place: Any) -> int:
        return int(place._obj.offset + (place._obj.offset_high << 32))
