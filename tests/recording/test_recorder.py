"""What is written while it is recorded: at once, whole, and never over something else."""

import errno
import json
import math
import os
import re
import zlib
from collections.abc import Callable
from io import FileIO
from pathlib import Path
from threading import Event, Timer
from unittest.mock import Mock

import pytest
from palpate import check, file_locks, read
from palpate.errors import RecordingError
from palpate.file_locks import lock, unlock
from palpate.recording import recorder as recorder_module
from palpate.recording import sidecar
from palpate.recording import sidecar_file as sidecar_file_module
from palpate.recording import writer as writer_module
from palpate.recording.reading import recorded
from palpate.recording.recorder import CAPACITY, FLUSH_S, SYNC_S, Recorder
from palpate.recording.rows import HEADER
from palpate.recording.session import Entry, Note, Plan, Specimen, plan_of
from palpate.recording.sidecar import MarkKind, SidecarMark
from palpate.recording.writer import is_locked
from palpate.samples import block_of
from palpate.source_events import Conditions
from palpate.stream import stream as stream_module
from recording_bench import document, sample, soon

PLAN = Plan(
    "Monday", "N. N.", (Specimen("30 OO", 0.143, 4),), (Entry(0.5, "30 OO"),), (Note(1.0, "warm"),)
)


def test_what_the_pages_promise() -> None:
    """A write each 0.1 s, a sync each second, room for a disk that hangs, and for a consumer that is late."""
    assert (stream_module._LAG_S, stream_module._LEAST) == (1.0, 4096)
    assert (FLUSH_S, SYNC_S, CAPACITY) == (0.1, 1.0, 32768)
    assert (recorder_module.capacity_for(1e-5), sidecar.LARGEST) == (
        300_000,
        4_000_000,
    )


def test_the_sidecar_is_there_before_the_first_row_and_gets_its_end(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(
        path, {"name": "x", "full_scale_pF": float("inf")}, {"scene": "paper"}, ["first"]
    )
    before = document(path)
    assert "end" not in before
    assert (before["settings"], before["notes"]) == ({"scene": "paper"}, ["first"])
    assert is_locked(path)
    assert is_locked(path), "asking ended the lock"
    for seq in range(100):
        assert recorder.push(sample(seq))
    recorder.note("second")
    recorder.mark("here", sample(99))
    recorder.mark("before everything", None)
    assert document(path) == before | {
        "notes": ["first", "second"],
        "marks": [{"seq": 99, "t_s": 2.574000001, "text": "here"}, {"text": "before everything"}],
    }
    recorder.close(lambda: {"read": 100})
    recorder.close()
    assert not is_locked(path)
    data = path.read_bytes()
    written = {"rows": 100, "bytes": len(data), "crc32": zlib.crc32(data)}
    assert document(path)["end"] == {
        **written,
        "dropped": 0,
        "clean": True,
        "counters": {"read": 100},
    }
    assert "checkpoint" not in document(path)  # the end says the same
    assert path.read_text().startswith(HEADER)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run.csv", "run.json"]


@pytest.mark.parametrize("there", ["run.csv", "run.json"])
def test_nothing_is_overwritten(tmp_path: Path, there: str) -> None:
    (tmp_path / there).write_text("precious")
    with pytest.raises(RecordingError, match=r"run\.\w+: already exists: choose another name"):
        Recorder(tmp_path / "run.csv", {}, {}, [])
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [(there, "precious")]


def test_marks_notes_and_session_have_a_limit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond it an error, and the recording goes on; the sidecar can be read."""
    monkeypatch.setattr(sidecar_file_module, "_MOST_BYTES", 5000)
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, ["first"])
    recorder.mark("0", sample(0))
    with pytest.raises(
        ValueError,
        match=r"^marks: got \d+ bytes of sidecar with them, allowed: 5000; begin another one$",
    ):
        recorder.mark("1" * 5000, None)
    with pytest.raises(ValueError, match=r"^notes: got \d+ bytes"):
        recorder.note("1" * 5000)
    recorder.session(PLAN)
    with pytest.raises(
        ValueError, match=r"session: got \d+ bytes of sidecar with them, allowed: 5000"
    ):
        recorder.session(Plan(touches=tuple(Entry(float(at), "30 OO") for at in range(200))))
    with pytest.raises(ValueError, match=r"^notes: got \d+ bytes"):
        Recorder(tmp_path / "other.csv", {}, {}, ["note" * 1500])
    assert sorted(file.name for file in tmp_path.iterdir()) == ["run.csv", "run.json"]
    recorder.push(sample(0))
    recorder.close()
    assert check(path).clean
    assert document(path)["notes"] == ["first"]
    assert [mark["text"] for mark in document(path)["marks"]] == ["0"]
    assert plan_of(document(path)) == PLAN


NO_SPACE = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("error", [NO_SPACE, MemoryError("no more")])
def test_a_disk_that_fails_for_good_is_an_error_at_the_end(
    error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is said at once; the rows wait, and those that never could be written are counted."""
    monkeypatch.setattr(recorder_module, "PATIENCE_S", 0.0)
    said = list[str]()
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [], notify=said.append)
    monkeypatch.setattr(writer_module, "write", Mock(side_effect=error))
    for seq in range(500):
        recorder.push(sample(seq))
    soon(lambda: said)
    reason = "No space left on device" if error is NO_SPACE else "MemoryError: no more"
    waits = r"\d+ rows wait, and there is room for \S+ more; it is tried again"
    assert re.fullmatch(f"run.csv: cannot be written: {reason}; {waits}", said[0])
    assert re.fullmatch(f"run.csv: cannot be written: {reason}; {waits}", recorder.rows_trouble)
    assert (recorder.error, recorder.dropped) == (None, 0)
    recorder.close()
    assert (
        str(recorder.error) == f"{path}: cannot be written: {reason}; 0 rows are synced to the disk"
    )
    end, report = document(path)["end"], check(path)
    assert (recorder.rows, end["rows"], recorder.dropped, end["dropped"]) == (0, 0, 500, 500)
    assert (report.survey.rows, report.clean) == (0, False)
    assert any(
        "the recorder stopped with an error" in fault and reason in fault for fault in report.faults
    )


@pytest.mark.parametrize("failing", ["write", "to_disk", "replacing"])
def test_what_fails_for_a_while_loses_nothing(
    failing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Write, sync or replacement; said when it lasts, and said when it is over."""
    monkeypatch.setattr(recorder_module, "SYNC_S", 0.0)
    said = list[str]()
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [], notify=said.append)
    module = sidecar_file_module if failing == "replacing" else writer_module
    name = "run.json" if failing == "replacing" else "run.csv"
    with monkeypatch.context() as broken:
        broken.setattr(module, failing, Mock(side_effect=NO_SPACE))
        for seq in range(500):
            recorder.push(sample(seq))
        recorder.gap("moved")
        recorder.note("answered")
        soon(lambda: said)
        assert said[0].startswith(f"{name}: cannot be written: No space left on device")
        shown = recorder.rows_trouble or recorder.sidecar_trouble
        assert shown.startswith(f"{name}: cannot be written: No space left on device")
    soon(lambda: len(said) == 2)
    assert said[1].startswith(f"{name}: is written again")
    for seq in range(500, 600):
        recorder.push(sample(seq))
    recorder.close()
    assert (recorder.error, recorder.rows, recorder.dropped) == (None, 600, 0)
    assert recorder.rows_trouble == recorder.sidecar_trouble == ""
    assert recorder.failures >= 2
    assert (check(path).faults, check(path).clean) == ((), True)
    assert document(path)["notes"] == ["answered"]
    assert [mark["seq"] for mark in document(path)["marks"]] == [499]


def test_a_failure_that_is_over_at_the_next_try_is_counted_and_not_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = list[str]()
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [], notify=said.append)
    monkeypatch.setattr(writer_module, "write", _failing_once(writer_module.write))
    recorder.push(sample(0))
    recorder.close()
    assert (recorder.failures, recorder.rows, said) == (1, 1, [])


def test_an_unexpected_error_in_the_thread_that_writes_ends_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Recorder, "_move_marks", _failing_once(Recorder._move_marks))
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    recorder.push(sample(0))
    recorder.close()
    assert (recorder.failures, recorder.rows, recorder.error) == (1, 1, None)


def test_a_row_that_was_written_in_part_is_cut_also_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The disk fails while a row is written, and then refuses to cut it."""
    path = tmp_path / "run.csv"
    writer = writer_module.Writer(path, sidecar.fresh({}, {}, []))

    def torn(file: FileIO, data: bytes) -> None:
        os.write(file.fileno(), data[:7])
        raise NO_SPACE

    with monkeypatch.context() as broken:
        broken.setattr(writer_module, "write", torn)
        broken.setattr(writer_module.Writer, "_cut_torn_row", Mock(side_effect=[None, NO_SPACE]))
        assert not writer.write(block_of([sample(0)]))
    assert path.read_bytes().endswith(b"0,0.000")
    assert writer.write(block_of([sample(0)]))
    assert writer.checkpoint({})
    writer.end({}, {"dropped": 0})
    assert check(path).clean


def test_after_a_sync_that_failed_the_rows_are_written_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The system may have forgotten them: the next sync alone would not bring them back."""
    path = tmp_path / "run.csv"
    writer = writer_module.Writer(path, sidecar.fresh({}, {}, []))
    assert writer.write(block_of([sample(0)]))
    assert writer.checkpoint({})
    synced = path.read_bytes()
    assert writer.write(block_of([sample(1), sample(2)]))
    whole = path.read_bytes()
    with monkeypatch.context() as broken:
        broken.setattr(
            writer_module, "to_disk", Mock(side_effect=OSError(errno.EIO, "Input/output error"))
        )
        assert not writer.checkpoint({})
    path.write_bytes(synced + bytes(len(whole) - len(synced)))
    assert not writer.error
    assert writer.write(block_of([sample(3)]))
    assert writer.checkpoint({})
    assert path.read_bytes()[: len(whole)] == whole
    writer.end({}, {"dropped": 0})
    assert check(path).clean


def test_a_full_queue_loses_rows_and_the_recording_resumes_after_a_gap(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "capacity_for", lambda _: 64)
    said = list[str]()
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [], notify=said.append)
    with monkeypatch.context() as broken:
        broken.setattr(writer_module, "write", Mock(side_effect=NO_SPACE))
        recorder.push(sample(0))
        soon(lambda: said)
        for seq in range(1, 100):
            recorder.push(sample(seq))
        assert recorder.dropped > 0
        assert (
            recorder.rows_trouble
            == f"run.csv: {recorder.dropped} rows are missing: No space left on device, and more are lost"
        )
    soon(lambda: recorder.rows == 100 - recorder.dropped)
    for seq in range(100, 110):
        recorder.push(sample(seq))
    recorder.close()
    lost = recorder.dropped
    text = f"{lost} rows are missing: No space left on device"
    assert said[1].startswith("run.csv: rows are lost from here on: No space left on device, and ")
    assert f"run.csv: is written again; {text}" in said
    assert str(recorder.error) == f"{path}: {text}; {recorder.rows} rows are written"
    [mark] = document(path)["marks"]
    assert (mark["seq"], mark["text"], mark["gap"]) == (99 - lost, text, True)
    assert (document(path)["end"]["dropped"], document(path)["end"]["clean"]) == (lost, False)
    assert [int(row.split(",")[0]) for row in path.read_text().splitlines()[-10:]] == [
        *range(100, 110)
    ]
    assert (check(path).survey.gaps, check(path).survey.lost) == (1, lost)


def test_a_source_that_can_wait_waits_for_a_disk_that_fails_but_not_for_ever(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "capacity_for", lambda _: 64)
    monkeypatch.setattr(recorder_module, "PATIENCE_S", 1e9)
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    monkeypatch.setattr(writer_module, "write", Mock(side_effect=NO_SPACE))
    recorder.push(sample(0))
    soon(lambda: recorder.rows_trouble)
    for seq in range(1, 50):
        recorder.push(sample(seq))
    assert recorder.is_behind
    recorder._writer.sidecar.retry.reason = "read-only"
    assert "rows are written" not in recorder.sidecar_trouble
    recorder._writer.sidecar.retry.reason = ""
    monkeypatch.setattr(recorder_module, "PATIENCE_S", 0.0)
    assert recorder.room == 64
    recorder.close()
    assert recorder.dropped == 50


def test_notes_marks_and_session_are_on_the_disk_when_they_are_answered(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    recorder.note("first")
    assert document(path)["notes"] == ["first"]
    number = recorder.mark("", sample(0))
    recorder.rename_mark(number, "named")
    assert document(path)["marks"][0]["text"] == "named"
    recorder.session(PLAN)
    assert plan_of(document(path)) == PLAN
    recorder.close()


def test_a_sidecar_of_another_program_is_left_and_rows_go_on(tmp_path: Path) -> None:
    said = list[str]()
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [], notify=said.append)
    (tmp_path / "run.json").write_text("precious")
    recorder.note("a note")
    for seq in range(50):
        recorder.push(sample(seq))
    soon(lambda: recorder.rows == 50)
    changed = "was changed by another program while it was recorded; it is left as it is"
    assert recorder.sidecar_trouble == (
        f"run.json: {changed}; notes, marks and checkpoints are in no file; rows are written"
    )
    with pytest.raises(RecordingError, match="its 50 rows are written"):
        recorder.close()
    assert (tmp_path / "run.json").read_text() == "precious"
    assert len(path.read_text().splitlines()) == 51


def _failing_once(step: Callable[..., object]) -> Callable[..., object]:
    """Return a function whose first call fails."""
    failures = [NO_SPACE]

    def call(*given: object) -> object:
        if failures:
            raise failures.pop()
        return step(*given)

    return call


@pytest.mark.skipif(os.name == "nt", reason="an open file cannot be removed on this system")
def test_a_file_that_is_removed_is_an_error_also_without_a_sample(
    tmp_path: Path,
) -> None:
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    recorder.path.unlink()
    soon(lambda: recorder.error)
    recorder.close()


def test_a_checkpoint_that_hangs_delays_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The source goes on while the disk does not answer; then all of its rows are written."""
    monkeypatch.setattr(recorder_module, "SYNC_S", 0.0)
    hangs, hung, sync = Event(), Event(), os.fsync

    def fsync(descriptor: int) -> None:
        hung.set()
        hangs.wait()
        sync(descriptor)

    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    monkeypatch.setattr(os, "fdatasync", fsync, raising=False)
    monkeypatch.setattr(os, "fsync", fsync)
    recorder.push(sample(0))
    assert hung.wait(30)
    for seq in range(1, CAPACITY):
        assert recorder.push(sample(seq))  # does not wait: the disk hangs until it is let go below
    hangs.set()
    recorder.close()
    assert (recorder.rows, recorder.dropped) == (CAPACITY, 0)
    assert check(tmp_path / "run.csv").clean


def test_a_sidecar_that_never_can_be_written_is_an_error_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It ends nothing before; at the beginning it is an error at once."""
    monkeypatch.setattr(recorder_module, "PATIENCE_S", 0.0)
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    failing = Mock(side_effect=OSError(errno.EBUSY, os.strerror(errno.EBUSY)))
    monkeypatch.setattr(sidecar_file_module, "replacing", failing)
    recorder.note("lost")
    recorder.push(sample(0))
    assert "run.json: cannot be written: Device or resource busy" in recorder.sidecar_trouble
    with pytest.raises(
        RecordingError,
        match=r"resource busy; the end of the recording and .* its 1 rows are written",
    ):
        recorder.close()
    with pytest.raises(RecordingError, match="cannot be written: Device or resource busy"):
        Recorder(tmp_path / "other.csv", {}, {}, [])
    assert not (tmp_path / "other.csv").exists()


def test_a_session_is_stored_with_a_checkpoint_and_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also when no row comes, and when the process is killed after it; it can be amended after the end."""
    monkeypatch.setattr(recorder_module, "SYNC_S", 0.02)
    path, other = tmp_path / "run.csv", Plan("Tuesday")
    recorder = Recorder(path, {}, {}, [])
    recorder.session(PLAN)
    soon(lambda: plan_of(document(path)) == PLAN)
    recorder.push(sample(0))
    recorder.session(other)
    soon(lambda: plan_of(document(path)) == other and document(path).get("checkpoint"))
    recorder.session(PLAN)
    recorder.close()
    assert (read(path).plan, check(path).faults) == (PLAN, ())
    assert json.loads((tmp_path / "run.json").read_text())["session"]["touches"] == [
        {"start_s": 0.5, "specimen": "30 OO", "left_out": ""}
    ]
    with pytest.raises(ValueError, match=r"run\.csv: got a change of a closed recording"):
        recorder.session(other)
    sidecar.amend(path, other, PLAN)
    assert (read(path).plan, check(path).faults) == (other, ())
    many = Plan(touches=tuple(Entry(float(at), "30 OO") for at in range(50_000)))
    with pytest.raises(RecordingError, match=r"would have \S+ bytes, allowed: 4,000,000"):
        sidecar.amend(path, many, other)
    with pytest.raises(RecordingError, match="was changed by another program: nothing is added"):
        sidecar.amend(path, PLAN, PLAN)
    text = path.with_suffix(".json").read_text()
    path.with_suffix(".json").write_text(text.replace('"title": "', '"title": "x'))
    with pytest.raises(RecordingError, match="was changed after it was written: nothing is added"):
        sidecar.amend(path, PLAN, other)
    path.with_suffix(".json").unlink()
    with pytest.raises(RecordingError, match="is gone"):
        sidecar.amend(path, PLAN, other)


@pytest.mark.parametrize("kind", ["mark", "tare", "gap"])
def test_a_mark_is_read_as_it_was_written(tmp_path: Path, kind: MarkKind) -> None:
    path = tmp_path / "run.csv"
    marks = [
        SidecarMark.at(sample(0), "here", kind),
        SidecarMark(7, math.nan, "without a time", kind),
    ]
    recorder = Recorder(path, {}, {}, [])
    recorder.begin(block_of([sample(0)]), marks, "")
    recorder.mark("by hand", sample(0), kind)
    recorder.close()
    by_hand = SidecarMark.at(sample(0), "by hand", kind)
    found = recorded(path).sidecar.marks
    assert sorted(map(str, found)) == sorted(map(str, [*marks, by_hand]))


def test_conditions_go_to_the_sidecar_at_the_end(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    recorder.conditions = [Conditions(1.5, {"temperature_C": 25.0})]
    recorder.close()
    assert document(recorder.path)["conditions"] == [{"t_s": 1.5, "temperature_C": 25.0}]


def test_a_mark_may_be_earlier_and_be_renamed(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    with pytest.raises(ValueError, match="it has no row yet"):
        recorder.mark_at(1.0, "x")
    for seq in range(40, 90):
        recorder.push(sample(seq))
    recorder.gap("moved")
    recorder.push(sample(90))
    soon(lambda: len(document(path)["marks"]) == 1)
    assert recorder.mark_at(2.0, "") == 2
    with pytest.raises(ValueError, match=r"got 1\.000 s, .* from 1\.040 s on"):
        recorder.mark_at(1.0, "too early")
    recorder.rename_mark(2, "named")
    for number, wrong in ((3, "allowed: 1 to 2"), (1, "a tare or gap")):
        with pytest.raises(ValueError, match=f"got number {number}, {wrong}"):
            recorder.rename_mark(number, "x")
    recorder.close()
    assert read(path).marks[1] == (2.0, "named")


def test_a_second_one_is_refused_and_readers_are_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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
        monkeypatch.setattr(file_locks, "_WAIT_S", 60.0)
        ending = Timer(0.1, unlock, (second,))
        ending.start()
        lock(first)
        ending.join()
        unlock(first)


def test_a_file_system_without_locks_takes_a_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object, shared: bool) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(file_locks, "_take", none)
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    assert recorder.push(sample(0))
    assert not is_locked(tmp_path / "run.csv")
    recorder.close()
    assert not check(tmp_path / "run.csv").faults
