"""The lock of a recording in progress: held while it is written, asked for without ending it, and optional."""

import errno
import threading
from pathlib import Path

import pytest
from palpate import check
from palpate.recording import lock as lock_module
from palpate.recording.lock import is_locked, lock, unlock
from palpate.recording.recorder import Recorder
from recording_bench import sample


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
        lock(second)
        monkeypatch.setattr(lock_module, "_WAIT_S", 60.0)
        ending = threading.Timer(0.1, unlock, (second,))
        ending.start()
        lock(first)
        ending.join()
        unlock(first)


def test_a_file_system_without_locks_takes_a_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none(*_: object, shared: bool) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(lock_module, "_take", none)
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    assert recorder.push(sample(0))
    assert not is_locked(tmp_path / "run.csv")
    recorder.close()
    assert not check(tmp_path / "run.csv").faults
