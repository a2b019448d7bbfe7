"""What is written while it is recorded: at once, whole, and never over something else."""

import errno
import os
import time
import zlib
from io import FileIO
from pathlib import Path
from threading import Event
from typing import Any

import pytest
from palpate import RecordingError, Sample, Source, Stream, check, read
from palpate import open as open_source
from palpate.recording import recorder as recorder_module
from palpate.recording import row_file, sidecar, sidecar_file
from palpate.recording.filelock import is_locked
from palpate.recording.recorder import Recorder
from palpate.recording.rows import HEADER
from palpate.recording.sidecar import load
from recording_bench import Scripted, sample


def test_the_sidecar_is_there_before_the_first_row_and_gets_its_end(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {"name": "x", "full_scale_pF": float("inf")}, {"scene": "paper"}, ["first"])
    before = load(path) or {}
    assert "end" not in before
    assert (before["settings"], before["notes"]) == ({"scene": "paper"}, ["first"])
    assert is_locked(path)
    for seq in range(100):
        assert recorder.push(sample(seq))
    recorder.note("second")
    recorder.mark("here", sample(99))
    recorder.mark("before everything", None)
    assert load(path) == before | {
        "notes": ["first", "second"],
        "marks": [{"seq": 99, "t_s": 2.574000001, "text": "here"}, {"text": "before everything"}],
    }
    recorder.close(lambda: {"read": 100})
    recorder.close()
    assert not is_locked(path)
    document = load(path)
    assert document
    data = path.read_bytes()
    written = {"rows": 100, "bytes": len(data), "crc32": zlib.crc32(data)}
    assert document["end"] == {**written, "dropped": 0, "clean": True, "counters": {"read": 100}}
    assert "checkpoint" not in document  # the end says the same
    assert path.read_text().startswith(HEADER)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run.csv", "run.json"]


def checkpoint_after(path: Path, rows: int) -> dict[str, int]:
    """Wait until the sidecar says that so many rows are on the disk."""
    until = time.monotonic() + 30
    while (found := (load(path) or {}).get("checkpoint", {})).get("rows", 0) < rows:
        assert time.monotonic() < until
        time.sleep(0.01)
    assert isinstance(found, dict)
    return found


def test_checkpoints_say_what_is_on_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder_module, "SYNC_S", 0.01)
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    for rows in (100, 150):
        for seq in range(recorder.rows, rows):
            assert recorder.push(sample(seq))
        checkpoint = checkpoint_after(path, rows)
        data = path.read_bytes()
        assert checkpoint == {"rows": rows, "bytes": len(data), "crc32": zlib.crc32(data)}
    before = sidecar.sidecar_path(path).stat()
    time.sleep(0.3)
    assert sidecar.sidecar_path(path).stat() == before  # nothing was written since: nothing is saved
    recorder.close()


@pytest.mark.parametrize("there", ["run.csv", "run.json"])
def test_nothing_is_overwritten(tmp_path: Path, there: str) -> None:
    (tmp_path / there).write_text("precious")
    with pytest.raises(RecordingError, match=r"run\.\w+: already exists: choose another name"):
        Recorder(tmp_path / "run.csv", {}, {}, [])
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [(there, "precious")]


def test_names_that_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"record: got 'run.json', allowed: a name that ends in .csv"):
        Recorder(tmp_path / "run.json", {}, {}, [])
    with pytest.raises(RecordingError, match=r"cannot be written: No such file"):
        Recorder(tmp_path / "nowhere" / "run.csv", {}, {}, [])


@pytest.mark.parametrize("live", [True, False])
def test_the_wall_clock_at_zero(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, live: bool) -> None:
    """From the first sample of a live source; a jump of the wall clock is seen at the end, and changes no time."""
    path, given = tmp_path / "run.csv", [sample(seq) for seq in range(40, 60)]
    begun_ns, wall_ns, hour_ns = time.monotonic_ns(), 1_800_000_000_000_000_000, 3_600_000_000_000
    moved_ns = 0

    def jump(at: Sample) -> None:
        nonlocal moved_ns
        moved_ns -= hour_ns * (at.seq == 50)

    monkeypatch.setattr(time, "time_ns", lambda: wall_ns + moved_ns + time.monotonic_ns() - begun_ns)
    source = Scripted(list(given), live=live)
    source.before = jump
    with Stream(source, record=path) as stream:
        for _ in stream:
            pass
    clock = (load(path) or {})["clock"]
    assert 0 <= clock["started_utc_ns"] - wall_ns < 60e9
    if live:  # it arrived between the start and the end
        assert 0 <= clock["zero_utc_ns"] - wall_ns + given[0].t_soft_ns < 60e9
        assert abs(clock["zero_utc_ns_at_end"] + hour_ns - clock["zero_utc_ns"]) < 5_000_000
    else:
        assert "zero_utc_ns" not in clock
    assert read(path).t_hard_s.tolist() == [each.t_hard_ns / 1e9 for each in given]


def test_marks_and_notes_have_a_limit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond it an error, and the recording goes on; the sidecar can be read."""
    monkeypatch.setattr(sidecar_file, "_MOST", {"notes": 3, "marks": 4})
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, ["first"])
    for number in range(4):
        recorder.mark(f"{number}", sample(number))
    for number in range(2):
        recorder.note(f"{number}")
    with pytest.raises(ValueError, match=r"^marks: got 5, allowed: 4 in one recording; begin another one$"):
        recorder.mark("5", None)
    with pytest.raises(ValueError, match=r"^notes: got 4, allowed: 3 in one recording; begin another one$"):
        recorder.note("4")
    with pytest.raises(ValueError, match=r"^notes: got 4, allowed: 3"):
        Recorder(tmp_path / "other.csv", {}, {}, ["note"] * 4)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["run.csv", "run.json"]
    recorder.push(sample(0))
    recorder.close()
    report, document = check(path), load(path)
    assert report.clean
    assert document
    assert document["notes"] == ["first", "0", "1"]
    assert [mark["text"] for mark in document["marks"]] == ["0", "1", "2", "3"]


def test_a_sidecar_has_a_size_that_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    recorder.note("\u00e9" * 600_000)  # six bytes each
    with pytest.raises(
        ValueError, match=r"^marks: got \d+ bytes of sidecar with them, allowed: 3980000; begin another"
    ):
        recorder.mark("\u00e9" * 100_000, None)
    recorder.close(error="x" * 2000)
    assert check(path).clean
    assert sidecar.sidecar_path(path).stat().st_size <= sidecar.LARGEST
    with pytest.raises(ValueError, match=r"^notes: got \d+ bytes"):
        Recorder(tmp_path / "other.csv", {}, {}, ["x" * sidecar.LARGEST])


def test_an_unexpected_error_is_not_silent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: object) -> bytes:
        raise MemoryError("no more")

    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    monkeypatch.setattr(row_file, "format_rows", fail)
    recorder.push(sample(0))
    recorder.close()
    assert str(recorder.error) == f"{path}: cannot be written: MemoryError: no more"
    assert (recorder.rows, recorder.dropped) == (0, 1)
    assert not check(path).clean


def test_a_checkpoint_that_hangs_delays_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The source goes on while the disk does not answer; then all of its rows are written."""
    monkeypatch.setattr(recorder_module, "SYNC_S", 0.0)
    hangs, hung = Event(), Event()
    sync = os.fsync

    def fsync(descriptor: int) -> None:
        hung.set()
        hangs.wait()
        sync(descriptor)

    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    monkeypatch.setattr(os, "fdatasync", fsync, raising=False)
    monkeypatch.setattr(os, "fsync", fsync)
    recorder.push(sample(0))
    assert hung.wait(30)
    for seq in range(1, recorder_module.CAPACITY):
        assert recorder.push(sample(seq))  # does not wait: the disk hangs until it is let go below
    hangs.set()
    recorder.close()
    assert (recorder.rows, recorder.dropped) == (recorder_module.CAPACITY, 0)
    assert check(tmp_path / "run.csv").clean


def full_after(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    """Let the disk be full after so many bytes of rows, in the middle of one."""
    left = count + len(HEADER)

    def write(file: FileIO, data: bytes) -> int:
        nonlocal left
        part = data[:left]
        left -= len(part)
        os.write(file.fileno(), part)
        if len(part) < len(data):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return len(data)

    monkeypatch.setattr(row_file, "write", write)


def test_a_full_disk_is_said_and_leaves_whole_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full_after(monkeypatch, 1000)
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    for seq in range(500):
        recorder.push(sample(seq))
    recorder.close()
    assert "No space left on device" in str(recorder.error)
    assert recorder.rows + recorder.dropped == 500
    document = load(path)
    assert document
    assert document["end"]["rows"] == recorder.rows == len(path.read_text().splitlines()) - 1
    assert document["end"]["dropped"] == recorder.dropped > 0
    report = check(path)
    assert report.survey.rows == recorder.rows
    assert report.clean is False
    assert any("the recorder stopped with an error" in fault and "No space left" in fault for fault in report.faults)


def test_a_full_disk_ends_a_stream(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full_after(monkeypatch, 20_000)
    with (
        pytest.raises(RecordingError, match="No space left on device"),
        Stream("sim:sliding", record=tmp_path / "run.csv") as stream,
    ):
        for _ in stream:
            pass
    counters = stream.counters
    assert counters.read == counters.delivered == counters.recorded + counters.unrecorded
    assert counters.unrecorded > 0


def test_a_sidecar_that_cannot_be_written_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    monkeypatch.setattr(sidecar_file, "replacing", refuse)
    with pytest.raises(RecordingError, match="cannot be written: Input/output error"):
        recorder.note("lost")
    with pytest.raises(RecordingError, match="cannot be written: Input/output error"):
        recorder.close()
    with pytest.raises(RecordingError, match="cannot be written: Input/output error"):
        Recorder(tmp_path / "other.csv", {}, {}, [])
    assert not (tmp_path / "other.csv").exists()


def test_what_was_recorded_is_a_source(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {"name": "x", "full_scale_pF": 4.0}, {}, [])
    given = [sample(seq) for seq in range(20, 50)]
    assert all(map(recorder.push, given))
    recorder.close()
    with open_source(str(path)) as source:
        assert isinstance(source, Source)
        assert list(source) == given
        assert source.describe() == {"name": "x", "full_scale_pF": 4.0}
        assert not source.live
