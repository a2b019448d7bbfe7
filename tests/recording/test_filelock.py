"""The lock of a recording in progress: that of this system, and that of Windows over a model of its two functions."""

import ctypes
import errno
import fcntl
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from palpate import check
from palpate.recording import filelock, windows_lock
from palpate.recording.filelock import is_locked, lock, unlock
from palpate.recording.recorder import Recorder
from project import ROOT, need
from recording_bench import sample
from windows_locks import Kernel
from wine import wine_home


@pytest.fixture(params=["here", "windows"])
def system(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    kernel = Kernel()
    if request.param == "windows":
        monkeypatch.setattr(filelock, "_LOCKS", kernel.locks())
    yield request.param
    assert not kernel.held, "a lock is left to Windows, which ends it later"


def recorder_of(path: Path) -> Recorder:
    return Recorder(path, {"name": "x", "full_scale_pF": float("inf")}, {"scene": "paper"}, [])


@pytest.mark.usefixtures("system")
def test_a_recording_is_locked_while_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = recorder_of(path)
    for seq in range(5):
        assert recorder.push(sample(seq))
    assert is_locked(path)
    assert is_locked(path), "asking ended the lock"
    assert check(path).running
    recorder.close()
    assert not is_locked(path)
    assert not check(path).running


@pytest.mark.usefixtures("system")
def test_a_second_one_is_refused_and_readers_are_not(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_bytes(b"x")
    with path.open("r+b") as first, path.open("r+b") as second:
        lock(first)
        with pytest.raises(BlockingIOError):
            lock(second)
        assert path.read_bytes() == b"x"
        unlock(first)
        assert filelock._taken(first, shared=True)
        assert filelock._taken(second, shared=True), "two readers at a time"
        unlock(first)
        unlock(second)


@pytest.mark.usefixtures("system")
def test_a_recording_waits_for_a_reader_who_asks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its file has a name before it has a lock: who asks in between has it for a moment."""
    monkeypatch.setattr(filelock, "_WAIT_S", 60.0)
    path = tmp_path / "run.csv"
    path.write_bytes(b"")
    with path.open("rb") as reader, path.open("r+b") as writer:
        assert filelock._taken(reader, shared=True)
        ending = threading.Timer(0.1, unlock, (reader,))
        ending.start()
        lock(writer)
        ending.join()
        assert is_locked(path)
        unlock(writer)


def test_a_child_process_does_not_hold_the_lock(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    with path.open("wb") as file:
        lock(file)
        waiting = subprocess.Popen(["sleep", "60"], pass_fds=[file.fileno()])
        unlock(file)
    try:
        assert not is_locked(path)
    finally:
        waiting.kill()
        waiting.wait()


def without_locks(*_: object) -> None:
    raise OSError(errno.ENOLCK, "no locks available")


def test_a_file_system_without_locks_takes_a_recording(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(fcntl, "flock", without_locks)
        recorder = recorder_of(tmp_path / "here.csv")
        assert recorder.push(sample(0))
        assert not is_locked(tmp_path / "here.csv")
        recorder.close()
    for name, locks in (("windows", Kernel(has_locks=False).locks()), ("neither", None)):
        monkeypatch.setattr(filelock, "_LOCKS", locks)
        recorder = recorder_of(tmp_path / f"{name}.csv")
        assert recorder.push(sample(0))
        assert not is_locked(tmp_path / f"{name}.csv")
        recorder.close()
        assert not check(tmp_path / f"{name}.csv").faults


def test_the_lock_of_windows_is_behind_every_byte_of_a_file(tmp_path: Path) -> None:
    """Others cannot read a locked byte. NTFS has files of less than 2**44 bytes."""
    kernel = Kernel()
    with (tmp_path / "x").open("wb") as file:
        assert kernel.locks().take(file.fileno(), shared=False)
    [(_, _, offset, exclusive)] = kernel.held
    assert offset == windows_lock.PLACE
    assert 2**44 < offset < 2**63 - 1
    assert exclusive
    assert windows_lock.of_this_system() is None


def test_wine_locks_as_the_model_does(tmp_path: Path) -> None:
    """The same calls in C, as a program for Windows: the place, the two kinds, the end of a process."""
    need("wine")
    program = tmp_path / "locks.exe"
    compiler = need("x86_64-w64-mingw32-gcc")
    subprocess.run([compiler, "-Wall", "-Werror", "-o", program, ROOT / "tests/recording/locks.c"], check=True)
    with wine_home() as wine:
        told = wine.run(program, f"{windows_lock.PLACE}").split()
        with pytest.raises(RuntimeError, match="child: no end within 1 s"):  # as a test that hangs
            wine.run(program, f"{windows_lock.PLACE}", "child", limit_s=1)
    size = ctypes.sizeof(windows_lock.Overlapped)
    assert (
        told
        == f"""size={size} exclusive=0 write=5 read=5 shared={windows_lock.VIOLATION}
        second={windows_lock.VIOLATION} replace=5 unlock=0 shared=0 shared=0 exclusive={windows_lock.VIOLATION}
        unlock=0 unlock=0 process={windows_lock.VIOLATION} killed=0""".split()
    )
