"""What is said of a recording in progress: the session, marks whose text comes later, and how much there is room for."""

import json
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from palpate import Sample, Stream, check, read
from palpate.recording import recorder as recorder_module
from palpate.recording import sidecar, sidecar_file
from palpate.recording.recorder import Recorder
from palpate.recording.session import Entry, Note, Plan, Specimen, plan_of
from palpate.recording.sidecar import load
from recording_bench import Scripted, sample

PLAN = Plan("Monday", "N. N.", (Specimen("30 OO", 0.143, 4),), (Entry(0.5, "30 OO"),), (Note(1.0, "warm"),))


def soon(holds: Callable[[], bool]) -> None:
    until = time.monotonic() + 30
    while not holds():
        assert time.monotonic() < until
        time.sleep(0.01)


def session_of(path: Path) -> Plan:
    return plan_of(load(path) or {})


def test_a_session_is_stored_with_a_checkpoint_and_at_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also when no row comes, and when the process is killed after it."""
    monkeypatch.setattr(recorder_module, "SYNC_S", 0.02)
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    recorder.session(PLAN)
    soon(lambda: session_of(path) == PLAN)
    recorder.push(sample(0))
    other = Plan("Tuesday")
    recorder.session(other)
    soon(lambda: session_of(path) == other and bool((load(path) or {}).get("checkpoint")))
    recorder.session(PLAN)
    recorder.close()
    assert read(path).plan == PLAN
    assert check(path).faults == ()
    with pytest.raises(ValueError, match=r"run\.csv: got a change of a closed recording"):
        recorder.session(other)


def test_a_session_goes_with_a_rescue(quick_recorder: None, tmp_path: Path) -> None:
    path = tmp_path / "run" / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    recorder.push(sample(0))
    recorder.session(PLAN)
    path.unlink()
    soon(lambda: recorder.error is not None)
    recorder.close()
    assert session_of(recorder.path) == PLAN
    assert recorder.path != path


def test_a_session_for_which_there_is_no_room_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The sidecar can still be read, with the marks and the session that were there before."""
    monkeypatch.setattr(sidecar_file, "_MOST_BYTES", 5000)
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    recorder.session(PLAN)
    with pytest.raises(ValueError, match=r"session: got \d+ bytes of sidecar with them, allowed: 5000"):
        recorder.session(Plan(touches=tuple(Entry(float(at), "30 OO") for at in range(200))))
    with pytest.raises(ValueError, match=r"marks: got \d+ bytes"):
        recorder.mark("x" * 5000, None)
    recorder.close()
    assert session_of(path) == PLAN


def test_a_session_and_marks_together_stay_below_the_largest_sidecar(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    recorder.session(Plan(touches=tuple(Entry(float(at), "\u00e4" * 200) for at in range(2000))))
    with pytest.raises(ValueError, match="marks: got"):
        recorder.mark("y" * 2_700_000, None)
    recorder.close()
    assert sidecar.sidecar_path(path).stat().st_size < sidecar.LARGEST
    assert len(session_of(path).touches) == 2000


def test_the_text_of_a_mark_may_come_later(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    recorder.push(sample(100))
    first, second = recorder.mark("", sample(100)), recorder.mark("b", sample(101))
    assert (first, second) == (1, 2)
    recorder.rename_mark(first, "hand off")
    assert [mark["text"] for mark in (load(path) or {})["marks"]] == ["hand off", "b"]
    recorder.mark("tare", sample(102), tare=True)
    for number, reason in [(0, "allowed: 1 to 3"), (4, "allowed: 1 to 3"), (3, "a tare or gap")]:
        with pytest.raises(ValueError, match=f"mark: got number {number}, .*{reason}"):
            recorder.rename_mark(number, "x")
    recorder.close()
    with pytest.raises(ValueError, match="a closed recording"):
        recorder.rename_mark(first, "late")
    assert [mark.text for mark in read(path).marks] == ["hand off", "b", "tare"]


def test_a_mark_may_be_earlier_than_now_but_not_than_the_recording(tmp_path: Path) -> None:
    path, begin_s = tmp_path / "run.csv", None
    with Stream(Scripted([*map(sample, range(5000))])) as stream:
        for estimate in stream:
            if estimate.sample.seq == 100:
                assert stream.mark("nothing is recorded") is None
                with pytest.raises(ValueError, match="those of a running recording; there is none"):
                    stream.rename_mark(1, "x")
                recorder = stream.start_recording(path)
            if estimate.sample.seq == 4999:
                begin_s = recorder.first_s
                assert begin_s is not None
                assert stream.mark("", begin_s + 1) == 1
                with pytest.raises(ValueError, match=rf"got 1\.000 s, .* from {begin_s:.3f} s on"):
                    stream.mark("too early", 1.0)
                stream.rename_mark(1, "named")
    [mark] = read(path).marks
    assert begin_s is not None
    assert mark == (begin_s + 1, "named")
    assert recorder.first_s == read(path).t_hard_s[0]


def test_a_mark_needs_a_row(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    with pytest.raises(ValueError, match="it has no row yet"):
        recorder.mark_at(1.0, "x")
    recorder.push(Sample(0, 0, 0, -1, -1, 1.0, 2.0))
    with pytest.raises(ValueError, match="got nan s"):
        recorder.mark_at(float("nan"), "x")
    recorder.close()


def test_a_session_is_plain_json(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "run.csv", {}, {}, [])
    recorder.session(PLAN)
    recorder.close()
    assert json.loads((tmp_path / "run.json").read_text())["session"] == {
        "title": "Monday",
        "operator": "N. N.",
        "specimens": [{"name": "30 OO", "modulus_MPa": 0.143, "wanted": 4}],
        "touches": [{"start_s": 0.5, "specimen": "30 OO", "left_out": ""}],
        "notes": [{"t_s": 1.0, "text": "warm"}],
    }
