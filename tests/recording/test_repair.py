"""A repair keeps the files as they were, and the rows that can be read; test_life_of_a_recording.py has random damage."""

import errno
import json
from pathlib import Path

import pytest
from damage import finished, killed, rows_of, survivors
from palpate import RecordingError, check, read, recorded
from palpate.recording import repair
from palpate.recording.rows import HEADER

pytestmark = pytest.mark.usefixtures("quick_disk")
ROWS, SYNCED = 60, 50


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def holed(path: Path) -> tuple[Path, bytes]:
    """Write a recording of 2000 rows with 512 zero bytes in it; return it, and its bytes."""
    killed(path, 2000, 1990)
    data = path.read_bytes()
    data = data[:30_000] + bytes(512) + data[30_512:]
    path.write_bytes(data)
    return path, data


def test_zeros_in_the_middle_cost_the_rows_that_they_hit(tmp_path: Path) -> None:
    path, data = holed(tmp_path / "run.csv")
    report = check(path)
    [place] = report.damaged
    assert report.survey.rows == len(survivors(data, rows_of(2000))) > 1980
    with pytest.raises(RecordingError, match=rf"line {place.line}: .*palpate check --repair"):
        read(path)
    refused = check(path, repair=True)
    assert refused.faults[-1].startswith(f"not repaired: {place.bytes:,} damaged bytes would be taken out")
    assert path.read_bytes() == data
    repaired = check(path, repair=True, remove_damage=True)
    assert repaired.survey.rows == report.survey.rows
    assert (repaired.survey.lost, repaired.survey.gaps) == (2000 - repaired.survey.rows, 1)
    again = read(path)
    [doubt] = again.doubts  # the checkpoint was of rows that are gone: the new checksum must not hide it
    assert doubt.startswith("before the repair: the rows were changed after they were written")
    assert any(note.startswith(f"repaired: removed {place.bytes} bytes of 1 damaged place") for note in again.notes)
    assert repaired.verified == 0


def test_a_torn_row_is_removed_without_a_question_and_verified_rows_stay_so(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED, torn=17)
    assert check(path).verified == SYNCED
    report = check(path, repair=True)
    assert (report.faults, report.verified, report.survey.rows) == ((), SYNCED, ROWS)
    removed = "repaired: removed 17 bytes of an incomplete row (the file before: run.csv.unrepaired)"
    assert report.findings == (f"{removed}; 50 of 60 rows are verified",)
    end = json.loads((tmp_path / "run.json").read_text())["end"]
    assert (end["rows"], end["verified"], end["clean"]) == (ROWS, SYNCED, False)
    assert recorded(path).doubts == ()
    assert check(path, repair=True) == report
    assert sorted(contents(tmp_path)) == ["run.csv", "run.csv.unrepaired", "run.json", "run.json.unrepaired"]


@pytest.mark.parametrize("header", [b"", HEADER.encode().replace(b"t_hard", b"t\xffhard")])
def test_a_header_that_is_repaired_leaves_no_doubt(tmp_path: Path, header: bytes) -> None:
    """The bytes are again those that were recorded: they agree with the checksum of that time."""
    path = finished(tmp_path / "run.csv", ROWS)
    data = path.read_bytes()
    path.write_bytes(header + data.removeprefix(HEADER.encode()))
    with pytest.raises(RecordingError, match="line 1: "):
        read(path)
    report = check(path, repair=True, remove_damage=True)
    assert path.read_bytes() == data
    assert (report.faults, report.verified) == ((), ROWS)
    assert report.findings[0].endswith("wrote the missing header; 60 of 60 rows are verified")


@pytest.mark.parametrize("call", range(5))
def test_a_full_disk_leaves_everything_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: int) -> None:
    """Whichever file cannot be synced: one more each time, until the repair succeeds."""
    path, _ = holed(tmp_path / "run.csv")
    before, calls = contents(tmp_path), 0

    def full(_: int) -> None:
        nonlocal calls
        calls += 1
        if calls > call:
            raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    monkeypatch.setattr("palpate.files.sync", lambda _: None)
    if call < 4:
        with pytest.raises(
            RecordingError, match="cannot be repaired: No space left on device; all files are as they were"
        ):
            check(path, repair=True, remove_damage=True)
        assert contents(tmp_path) == before
    else:
        assert check(path, repair=True, remove_damage=True).repaired


def test_a_file_that_changed_during_the_repair_is_left_alone(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED, torn=9)
    recording = recorded(path)
    for _ in recording.blocks():
        pass
    with path.open("ab") as file:
        file.write(b"more")
    before = contents(tmp_path)
    with pytest.raises(RecordingError, match="it has changed in the meantime; all files are as they were"):
        repair.repair(recording, [])  # type: ignore[arg-type]
    assert contents(tmp_path) == before
