"""A repair keeps the files as they were, and the rows that can be read; test_life_of_a_recording.py has random damage."""

from pathlib import Path

import pytest
from palpate import check, read
from palpate.errors import RecordingError
from palpate.recording.csv_reader import RecordingFile
from palpate.recording.repair import repair_files
from recording_bench import killed, rows_of, survivors

pytestmark = pytest.mark.usefixtures("quick_disk")
ROWS, SYNCED = 60, 50


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_zeros_in_the_middle_cost_the_rows_that_they_hit(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", 2000, 1990)
    data = path.read_bytes()
    data = data[:30_000] + bytes(512) + data[30_512:]
    path.write_bytes(data)
    report = check(path)
    [place] = report.damaged
    assert report.survey.rows == len(survivors(data, rows_of(2000))) > 1980
    with pytest.raises(RecordingError, match=rf"line {place.line}: .*palpate check --repair"):
        read(path)
    refused = check(path, repair=True)
    assert refused.faults[-1].startswith(
        f"not repaired: {place.bytes:,} damaged bytes would be taken out"
    )
    repaired, again = check(path, repair=True, remove_damage=True), read(path)
    assert (repaired.survey.rows, repaired.survey.gaps, repaired.verified) == (
        report.survey.rows,
        1,
        0,
    )
    # the checkpoint was of rows that are gone: the new checksum must not hide it
    [doubt] = again.doubts
    assert doubt.startswith("before the repair: the rows were changed after they were written")
    assert any(
        note.startswith(f"repaired: removed {place.bytes} bytes of 1 damaged place")
        for note in again.notes
    )


def test_a_torn_row_is_removed_without_a_question_and_verified_rows_stay_so(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED, torn=17)
    assert check(path).verified == SYNCED
    report = check(path, repair=True)
    assert (report.faults, report.verified, report.survey.rows) == ((), SYNCED, ROWS)
    removed = (
        "repaired: removed 17 bytes of an incomplete row (the file before: run.csv.unrepaired)"
    )
    assert report.findings == (f"{removed}; 50 of 60 rows are verified",)
    assert check(path, repair=True) == report
    assert sorted(contents(tmp_path)) == [
        "run.csv",
        "run.csv.unrepaired",
        "run.json",
        "run.json.unrepaired",
    ]


def test_a_cut_table_without_a_sidecar_is_one_fault(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED, torn=49)
    path.with_suffix(".json").unlink()
    [_, fault] = check(path, repair=True).faults
    refused = (
        "not repaired: the other lines are rows, and what the sidecar said cannot be known again"
    )
    assert fault == f"the last row is cut off: its 49 bytes are left out; {refused}"


def test_a_file_that_changed_during_the_repair_is_left_alone(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED, torn=9)
    recording = RecordingFile(path)
    for _ in recording.blocks():
        pass
    with path.open("ab") as file:
        file.write(b"more")
    before = contents(tmp_path)
    with pytest.raises(
        RecordingError, match="it has changed in the meantime; all files are as they were"
    ):
        repair_files(recording)
    assert contents(tmp_path) == before
