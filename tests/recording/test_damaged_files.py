"""`check` tells the truth about a file, and `read` opens whatever is left of one."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import palpate
import pytest
from damage import killed
from palpate import RecordingError, Status, check, read
from palpate.recording import sidecar
from palpate.recording.foreign import recorded
from palpate.recording.recorder import Recorder
from palpate.recording.rows import HEADER
from recording_bench import record, sample, tear

CHANGED = (
    "the rows were changed after they were written, or the sidecar belongs to another recording (checksum of {} differs): "
    "results may be wrong; take the file from a copy"
)


def test_a_whole_recording(tmp_path: Path) -> None:
    report = check(record(tmp_path / "run.csv", [sample(i) for i in range(300)]))
    assert (report.clean, report.running, report.repaired) == (True, False, False)
    assert report.faults == report.findings == ()
    survey = report.survey
    assert (survey.rows, survey.first_seq, survey.last_seq, survey.seconds) == (300, 0, 299, 7.774000005)


def test_what_is_missing_and_clipped(tmp_path: Path) -> None:
    rows = [sample(i) for i in (*range(100), *range(130, 200), *range(201, 300))]
    rows += [sample(300, status=Status.LOST), sample(301, status=Status.EXCITATION)]
    rows += [sample(302, status=Status.HARD_SATURATED | Status.SOFT_SATURATED), sample(303, status=1)]
    report = check(record(tmp_path / "run.csv", rows))
    assert report.clean
    assert report.findings == (
        "31 samples lost in 2 gaps",
        "2 rows without a usable value",
        "1 of them with the excitation shorted or overloaded",
        "saturated: 2 rows in the hard channel",
        "saturated: 1 rows in the soft channel",
    )


def test_rows_that_were_tampered_with(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(6)])
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join([*lines[:3], *lines[:3:-1]]) + "9,9.0,9.0,16777216,0,0.0,0.0,-1,0\n")
    report = check(path)
    assert not report.clean
    assert report.faults == (
        CHANGED.format("the 6 rows"),
        "2 rows out of order: their seq does not rise",
        "time goes back at 2 rows",
        "1 rows have codes above 16777215, the largest of the converter",
    )
    path.write_text("".join(lines[:-1]))
    assert check(path).faults == ("5 rows in the file, but 6 were written",)


@pytest.mark.parametrize("torn", range(2, 40))
def test_an_unclean_stop_is_said_and_repaired_when_asked(tmp_path: Path, torn: int) -> None:
    """Wherever in the last row it was cut; one byte less, the line end alone, has lost nothing."""
    path = record(tmp_path / "run.csv", [sample(i) for i in range(5)], end=False)
    tear(path, torn)
    left = path.read_bytes()
    report = check(path)
    assert (report.survey.rows, report.clean, report.repaired) == (4, False, False)
    assert report.faults[0].startswith("no end in the sidecar: the recording was not closed")
    assert report.faults[1].endswith("bytes after the last complete row")
    assert path.read_bytes() == left
    assert list(read(path).hard) == [sample(i).hard for i in range(4)]
    repaired = check(path, repair=True)
    assert (repaired.survey.rows, repaired.repaired, repaired.clean, repaired.faults) == (4, True, False, ())
    assert repaired.findings[0].startswith("repaired: removed ")
    assert "4 of 4 rows are verified" in repaired.findings[0]
    assert left.startswith(path.read_bytes())
    assert check(path, repair=True) == repaired
    assert b",".join([b"4", b"0.104"]) not in path.read_bytes()


def test_a_row_that_lost_its_line_end_only_is_whole(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(5)], end=False)
    tear(path, 1)
    assert check(path).survey.rows == len(read(path).hard) == 5
    assert check(path, repair=True).survey.rows == 5


def test_zeros_as_a_power_cut_leaves_them(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(5)], end=False)
    with path.open("ab") as file:
        file.write(b"5,0.1" + bytes(4096))
    report = check(path)
    assert report.survey.rows == 5
    assert report.faults[1] == "4101 bytes after the last complete row"
    assert check(path, repair=True).survey.rows == 5
    assert path.read_bytes().endswith(b",0\n")


@pytest.mark.parametrize("length", [0, 1, len(HEADER) - 1, len(HEADER)])
def test_stopped_before_the_first_row(tmp_path: Path, length: int) -> None:
    path = record(tmp_path / "run.csv", [], end=False)
    path.write_text(HEADER[:length])
    report = check(path)
    assert (report.survey.rows, report.clean) == (0, False)
    assert report.findings == ("no rows",)
    assert len(read(path).hard) == 0
    assert palpate.touches(read(path)) == []
    repaired = check(path, repair=True)
    assert repaired.faults == ()
    assert repaired.survey.rows == 0


def test_a_running_recording_is_not_repaired(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, [])
    recorder.push(sample(0))
    report = check(path, repair=True)
    assert (report.running, report.repaired) == (True, False)
    recorder.close()
    assert check(path).clean


def _sidecar(device: str) -> str:
    return f'{{"schema": "palpate-recording-1", "device": {device}, "settings": {{}}, "notes": [], "marks": []}}'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON"),
        ("[]", "not the sidecar"),
        ('{"a": 1}', "no schema"),
        (_sidecar("[]"), "device: got [], allowed: names and values"),
        (_sidecar('{"full_scale_pF": 0}'), "full_scale_pF: got 0, allowed: above 0"),
    ],
)
def test_a_broken_sidecar_does_not_keep_the_rows_back(tmp_path: Path, text: str, message: str) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(5)])
    path.with_suffix(".json").write_text(text)
    [fault] = check(path).faults
    assert fault.startswith(f"no valid sidecar ({path.with_suffix('.json')}: ")
    assert fault.endswith("the rows cannot be verified, the device and its range are unknown")
    recording = read(path)
    assert len(recording.hard) == 5
    assert recording.full_scale_pF == pytest.approx(4.0958, abs=1e-4)
    assert any(message in note for note in recording.notes)


def test_a_line_that_is_no_row_is_named(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(30_000)])
    lines = path.read_text().splitlines(keepends=True)
    lines[20_001] = "what is this?\n"
    path.write_text("".join(lines))
    message = r"run.csv, line 20002: got 1 cells, allowed: 9: damaged; palpate check"
    with pytest.raises(RecordingError, match=message):
        read(path)
    parts, rows = recorded(path).blocks(), list[int]()
    with pytest.raises(RecordingError, match=message):
        rows.extend(len(block) for block in parts)
    assert sum(rows) == 20_000  # whoever reads in parts has all before it
    report = check(path)
    [place] = report.damaged
    assert (place.line, place.lines, place.bytes, place.rows_before) == (20_002, 1, 14, 20_000)
    assert "damaged: line 20002, 14 bytes (got 1 cells, allowed: 9); 20000 rows before, 9999 after" in report.faults
    assert report.as_dict()["damaged"][0]["line"] == 20_002


def _edited(path: Path, edit: Callable[[dict[str, Any]], object]) -> Path:
    document = sidecar.load(path)
    assert document
    edit(document)
    sidecar.save(path.with_suffix(".json"), document)
    return path


@pytest.mark.parametrize(
    ("edit", "doubts", "rest"),
    [
        (lambda document: document["end"].pop("crc32"), "the end in the sidecar has no checksum, which", ""),
        (lambda document: document["end"].update(crc32="7"), "the end in the sidecar has no checksum, which", ""),
        (lambda document: document["end"].update(rows=[7] * 99), "5 rows in the file, but [7, 7, 7, 7, 7, 7, 7 were", ""),
        (lambda document: document["end"].update(doubts=["as said"]), "as said", ""),
        (lambda document: document["end"].update(clean=False, error="full"), "", "the recorder stopped with an error: full"),
        (lambda document: document["end"].update(error="gone"), "", "the source ended with an error: gone"),
        (lambda document: document.pop("end"), "", "no end in the sidecar: the recording was not closed; no row is verified (it"),
    ],
)  # fmt: skip
def test_what_a_sidecar_says_or_does_not_say(
    tmp_path: Path, edit: Callable[[dict[str, Any]], object], doubts: str, rest: str
) -> None:
    path = _edited(record(tmp_path / "run.csv", [sample(i) for i in range(5)]), edit)
    recording = read(path)
    [note] = recording.notes
    assert note.startswith(doubts or rest)
    assert recording.doubts == ((note,) if doubts else ())
    report = check(path)
    assert note in (*report.faults, *report.findings)


def test_a_sidecar_that_was_edited_is_told(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(5)], full_scale_pF=4.0)
    beside = path.with_suffix(".json")
    beside.write_text(beside.read_text().replace('"full_scale_pF": 4.0', '"full_scale_pF": 8.0'))
    recording = read(path)
    assert recording.full_scale_pF == 8
    assert recording.doubts == (
        (
            "the sidecar was changed after it was written (its checksum differs): device, settings, marks, end may be "
            "wrong; the rows agree with the checksum in it: take the sidecar from a copy"
        ),
    )
    assert check(path).faults == recording.doubts
    assert (check(path).verified, check(path).changed) == (5, True)
    assert check(path, repair=True).faults[-1] == (
        "not repaired: only the sidecar was changed, and what it said before cannot be known: take it from a copy"
    )


def test_line_ends_of_windows_are_told_and_the_rows_are_verified(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(5)])
    data = path.read_bytes()
    path.write_bytes(data.replace(b"\n", b"\r\n"))
    report = check(path)
    assert (report.verified, report.faults, report.clean) == (5, (), True)
    told = ("the line ends were changed to those of Windows; the rows are as they were written",)
    assert report.findings == read(path).notes == told
    path.write_bytes(data.replace(b"8388610", b"8388617", 1).replace(b"\n", b"\r\n"))
    assert "the rows were changed after they were written" in check(path).faults[0]


def test_an_empty_file_is_said_to_be_empty(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(5)])
    path.write_bytes(b"")
    assert check(path).faults == ("the file is empty, but 5 rows were written",)
    path.with_suffix(".json").unlink()
    for reader in (read, check):
        with pytest.raises(RecordingError, match=r"run.csv: is empty$"):
            reader(path)


@pytest.mark.parametrize("checksum", [True, False])
def test_a_recording_of_the_first_schema(tmp_path: Path, checksum: bool) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(5)])
    document = json.loads(path.with_suffix(".json").read_text())
    for name in ("sidecar_crc32", "checkpoint"):
        document.pop(name, None)
    document["schema"] = "palpate-recording-1"
    document["end"].pop("bytes")
    if not checksum:
        document["end"].pop("crc32")
    path.with_suffix(".json").write_text(json.dumps(document))
    old = "no checksum in the sidecar, which an older palpate wrote: only the number of rows is verified"
    assert read(path).notes == (() if checksum else (old,))
    assert (check(path).clean, check(path).verified) == (True, 5 if checksum else 0)
    path.write_bytes(path.read_bytes().replace(b"8388610", b"8388617", 1))
    assert bool(read(path).doubts) == checksum


def test_a_checkpoint_that_the_file_does_not_reach(tmp_path: Path) -> None:
    path = killed(tmp_path / "run.csv", 20, 20)
    tear(path, 150)
    [doubt] = read(path).doubts
    assert doubt == "the file ends 150 bytes before its last checkpoint: rows that were written are missing"


def test_another_loggers_table(tmp_path: Path) -> None:
    path = tmp_path / "other.csv"
    path.write_text("time,hard,soft\n0,1,2\n0.1,OL,3\n0.2,1,3\n")
    report = check(path, columns={"hard": 2, "soft": 3}, unit="pF")
    assert (report.clean, report.survey.rows, report.survey.refused) == (None, 3, 1)
    assert json.dumps(report.as_dict())
