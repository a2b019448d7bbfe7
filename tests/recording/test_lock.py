"""The lock of a recording in progress: on this system, and on Windows over a model of its two functions."""

import os
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from palpate import check
from palpate.recording import lock as lock_module
from palpate.recording.lock import WindowsLock, is_locked, lock, unlock
from palpate.recording.recorder import Recorder
from recording_bench import sample


@dataclass
class Kernel:
    """LockFileEx and UnlockFileEx as the documentation of Windows describes them: locks of one byte, each of a handle."""

    has_locks: bool = True
    error: int = 0
    held: list[tuple[int, tuple[int, int], bool]] = field(default_factory=list)

    def LockFileEx(self, handle: int, flags: int, reserved: int, low: int, high: int, place: Any) -> int:
        assert (reserved, low, high) == (0, 1, 0)
        assert flags & 1, "it would wait"
        if not self.has_locks:
            self.error = 1  # ERROR_INVALID_FUNCTION
            return 0
        exclusive = bool(flags & 2)
        if any(exclusive or other for _, where, other in self.held if where == self._where(handle, place)):
            self.error = WindowsLock.VIOLATION
            return 0
        self.held.append((handle, self._where(handle, place), exclusive))
        return 1

    def UnlockFileEx(self, handle: int, reserved: int, low: int, high: int, place: Any) -> int:
        assert (reserved, low, high) == (0, 1, 0)
        mine = [each for each in self.held if each[:2] == (handle, self._where(handle, place))]
        if mine:
            self.held.remove(mine[0])
        return len(mine)

    def locks(self) -> WindowsLock:
        return WindowsLock(self, int, lambda: self.error)

    @staticmethod
    def _where(handle: int, place: Any) -> tuple[int, int]:
        offset = int(place._obj.offset + (place._obj.offset_high << 32))
        assert 2**44 < offset < 2**63 - 1, "others cannot read a locked byte; NTFS has files of less than 2**44 bytes"
        return os.fstat(handle).st_ino, offset


@pytest.fixture(params=["here", "windows"])
def system(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    kernel = Kernel()
    if request.param == "windows":
        monkeypatch.setattr(lock_module, "_LOCKS", kernel.locks())
    yield request.param
    assert not kernel.held, "a lock is left to Windows, which ends it later"


@pytest.mark.usefixtures("system")
def test_a_recording_is_locked_while_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    assert recorder.push(sample(0))
    assert is_locked(path)
    assert is_locked(path), "asking ended the lock"
    assert check(path).running
    recorder.close()
    assert not is_locked(path)
    assert not check(path).running


@pytest.mark.usefixtures("system")
def test_a_second_one_is_refused_and_readers_are_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A writer waits for a reader that asks in between."""
    path = tmp_path / "run.csv"
    path.write_bytes(b"x")
    with path.open("r+b") as first, path.open("r+b") as second:
        lock(first)
        with pytest.raises(BlockingIOError):
            lock(second)
        assert path.read_bytes() == b"x"
        unlock(first)
        assert all(lock_module._LOCKS.take(file.fileno(), shared=True) for file in (first, second)), "two readers"
        unlock(first)
        monkeypatch.setattr(lock_module, "_WAIT_S", 60.0)
        ending = threading.Timer(0.1, unlock, (second,))
        ending.start()
        lock(first)
        ending.join()
        unlock(first)


def test_a_file_system_without_locks_takes_a_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lock_module, "_LOCKS", Kernel(has_locks=False).locks())
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    assert recorder.push(sample(0))
    assert not is_locked(tmp_path / "run.csv")
    recorder.close()
    assert not check(tmp_path / "run.csv").faults
