"""`check` tells the truth about a file, and `read` opens what is left of one; tests/golden has more kinds of files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from palpate import Status, check, read
from palpate.errors import RecordingError
from palpate.recording import sidecar
from recording_bench import record, sample

CHANGED = (
    "the rows were changed after they were written, or the sidecar belongs to another recording (checksum of {} differs): "
    "results may be wrong; take the file from a copy"
)


def five(tmp_path: Path, **more: Any) -> Path:
    """Write a recording of five rows."""
    return record(tmp_path / "run.csv", [sample(i) for i in range(5)], **more)


def test_what_is_missing_and_clipped(tmp_path: Path) -> None:
    rows = [sample(i) for i in (*range(100), *range(130, 200), *range(201, 300))]
    rows += [sample(300, status=Status.LOST), sample(301, status=Status.EXCITATION)]
    rows += [
        sample(302, status=Status.HARD_SATURATED | Status.SOFT_SATURATED),
        sample(303, status=1),
    ]
    report = check(record(tmp_path / "run.csv", rows))
    assert report.clean
    assert report.verdict == "samples lost, clean end"
    assert report.findings == (
        "31 samples lost in 2 gaps",
        "2 rows without a usable value",
        "1 of them with the excitation shorted or overloaded",
        "saturated: 2 rows in the hard channel",
        "saturated: 1 rows in the soft channel",
    )


def disordered(data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    return b"".join([*lines[:3], *lines[:3:-1]]) + b"9,9.0,9.0,16777216,0,0.0,0.0,-1,0\n"


@pytest.mark.parametrize(
    ("edit", "faults"),
    [
        (disordered, (CHANGED.format("the 5 rows"), "1 rows out of order: their seq does not rise",
                      "time goes back at 1 rows",
                      "1 rows have codes above 16777215, the largest of the converter")),
        (lambda data: data.replace(b"8388610", b"8388617", 1), (CHANGED.format("the 5 rows"),)),
        (lambda _: b"", ("the file is empty, but 5 rows were written",)),
    ],
)  # fmt: skip
def test_rows_that_were_changed(
    tmp_path: Path, edit: Callable[[bytes], bytes], faults: tuple[str, ...]
) -> None:
    path = five(tmp_path)
    path.write_bytes(edit(path.read_bytes()))
    assert check(path).faults == faults


def test_a_line_that_is_no_row_is_named(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(30_000)])
    lines = path.read_bytes().split(b"\n")
    lines[20_001] = b"what is this?"
    path.write_bytes(b"\n".join(lines))
    cells = "got 1 cells, allowed: 9"
    with pytest.raises(
        RecordingError, match=f"run.csv, line 20002: {cells}: damaged; palpate check"
    ):
        read(path)
    report = check(path)
    found = [(place.line, place.rows_before, place.reason) for place in report.damaged]
    assert found == [(20_002, 20_000, cells)]
    assert (
        f"damaged: line 20002, 14 bytes ({cells}); 20000 rows before, 9999 after" in report.faults
    )


@pytest.mark.parametrize(
    ("right", "wrong", "offset"),
    [
        (b"hard_pF", b"h\xffrd_pF", 1),
        (b",soft_pF", b"\nsoft_pF", 0),
        (b"status\n", b"status ", 6),
        # Without these names it would be a table of another program, with other times.
        (b"seq", b"suq", 1),
        (b"t_hard_s", b"tOhard_s", 1),
        (b"status", b"states", 4),
    ],
)
def test_a_damaged_header_is_named_if_the_sidecar_is_intact(
    right: bytes, wrong: bytes, offset: int, tmp_path: Path
) -> None:
    path = five(tmp_path)
    data = path.read_bytes()
    path.write_bytes(data.replace(right, wrong, 1))
    for reader in (read, check):
        with pytest.raises(
            RecordingError, match=r"header of this recording is damaged at byte (\d+)"
        ):
            reader(path)
    with pytest.raises(RecordingError) as refusal:
        read(path)
    assert refusal.value.line == 1
    assert f"at byte {data.index(right) + 1 + offset}:" in str(refusal.value)
    assert data.decode().partition("\n")[0] in str(refusal.value)
    path.write_bytes(data)
    assert len(read(path)) == 5


def test_a_header_that_somebody_wrote_again_is_read(tmp_path: Path) -> None:
    """Somebody changed the delimiters or added a column; the sidecar is intact."""
    path = five(tmp_path)
    hard = read(path).hard
    data = path.read_bytes()
    lines = data.decode().splitlines()
    for changed in (
        data.replace(b",", b";"),
        "\n".join([f"{lines[0]},remark", *(f"{line},a" for line in lines[1:]), ""]).encode(),
    ):
        path.write_bytes(changed)
        np.testing.assert_array_equal(read(path).hard, hard)


def test_a_damaged_header_without_a_sidecar_is_a_table_of_another_program(tmp_path: Path) -> None:
    path = five(tmp_path)
    path.write_bytes(path.read_bytes().replace(b"hard_pF", b"harx_pF", 1))
    sidecar.sidecar_path(path).unlink()
    with pytest.raises(ValueError, match="none for a table of another program"):
        read(path)


def _sidecar(device: str, marks: str = "") -> str:
    return f'{{"schema": "palpate-recording-1", "device": {device}, "settings": {{}}, "notes": [], "marks": [{marks}]}}'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "not JSON"),
        ('{"a": 1}', "no schema"),
        (_sidecar('{"full_scale_pF": 0}'), "full_scale_pF: got 0, allowed: above 0"),
        (_sidecar('{"period_s": "fast"}'), "period_s: got 'fast', allowed: 0 to 1e+06, s"),
    ],
)
def test_a_broken_sidecar_does_not_keep_the_rows_back(
    tmp_path: Path, text: str, message: str
) -> None:
    path = five(tmp_path)
    path.with_suffix(".json").write_text(text)
    [fault] = check(path).faults
    assert fault.startswith(f"no valid sidecar ({path.with_suffix('.json')}: ")
    assert fault.endswith("the rows cannot be verified, the device and its range are unknown")
    recording = read(path)
    assert len(recording.hard) == 5
    assert recording.full_scale_pF == pytest.approx(4.0958, abs=1e-4)
    assert any(message in note for note in recording.notes)


@pytest.mark.parametrize(
    ("edit", "doubts", "rest"),
    [
        (lambda document: document["end"].pop("crc32"), "the end in the sidecar has no checksum, which", ""),
        (lambda document: document["end"].update(rows=[7] * 99), "5 rows in the file, but [7, 7, 7, 7, 7, 7, 7 were", ""),
        (lambda document: document["end"].update(doubts=["as said"]), "as said", ""),
        (lambda document: document["end"].update(clean=False, error="full"), "", "the recorder stopped with an error: full"),
        (lambda document: document["end"].update(error="gone"), "", "the source ended with an error: gone"),
    ],
)  # fmt: skip
def test_what_a_sidecar_says_or_does_not_say(
    tmp_path: Path, edit: Callable[[dict[str, Any]], object], doubts: str, rest: str
) -> None:
    path = five(tmp_path)
    document = sidecar.load(path) or {}
    edit(document)
    sidecar.save(path.with_suffix(".json"), document)
    recording, report = read(path), check(path)
    assert len(recording.notes) == bool(doubts or rest)
    assert all(note.startswith(doubts or rest) for note in recording.notes)
    assert recording.doubts == (recording.notes if doubts else ())
    assert set(recording.notes) <= {*report.faults, *report.findings}


def test_a_sidecar_that_was_edited_is_told(tmp_path: Path) -> None:
    path = five(tmp_path, full_scale_pF=4.0)
    beside = path.with_suffix(".json")
    beside.write_text(beside.read_text().replace('"full_scale_pF": 4.0', '"full_scale_pF": 8.0'))
    recording, report = read(path), check(path)
    assert (recording.full_scale_pF, report.faults) == (8, recording.doubts)
    [doubt] = recording.doubts
    assert doubt.startswith(
        "the sidecar was changed after it was written (its checksum differs): device, settings"
    )
    assert doubt.endswith("; the rows agree with the checksum in it: take the sidecar from a copy")
    assert (report.verified, report.changed) == (5, True)
    assert (
        check(path, repair=True).faults[-1].startswith("not repaired: only the sidecar was changed")
    )
