"""Files that are packed as .gz, and standard input."""

import gzip
import io
import json
import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import palpate
import pytest
from click.testing import CliRunner
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError
from palpate.cli import main
from palpate.recording.foreign import recorded
from palpate.recording.verification import check
from palpate.tables import packed
from project import ROOT
from workbooks import row, words, workbook

OWN = ROOT / "tests" / "data" / "four-specimens.csv"
TABLE = b"time (s),hard (pF),soft (pF)\n" + b"".join(b"%.3f,6.%03d,4.%03d\n" % (n / 40, n, n) for n in range(50))
BOOK = workbook(
    words(1, "time (s)", "hard (pF)", "soft (pF)") + "".join(row(n, str(n / 40), "6.5", "4.5") for n in range(2, 40))
)


def test_a_table_in_gz(tmp_path: Path) -> None:
    plain, small = tmp_path / "table.csv", tmp_path / "table.csv.gz"
    plain.write_bytes(TABLE)
    half = TABLE.index(b"\n", 300) + 1
    small.write_bytes(gzip.compress(TABLE[:half], mtime=0) + gzip.compress(TABLE[half:], mtime=0))  # two members
    first, second = palpate.read(plain), palpate.read(small)
    assert first.hard.tolist() == second.hard.tolist()
    assert (first.understood, first.notes) == (second.understood, second.notes)


def test_a_workbook_in_gz(tmp_path: Path) -> None:
    path = tmp_path / "book.xlsx.gz"
    path.write_bytes(gzip.compress(BOOK, mtime=0))
    recording = palpate.read(path)
    assert (len(recording.hard), recording.notes) == (38, ())


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Pack a recording of palpate, beside its sidecar."""
    path = tmp_path / "run.csv.gz"
    path.write_bytes(gzip.compress(OWN.read_bytes(), mtime=0))
    (tmp_path / "run.json").write_bytes(OWN.with_suffix(".json").read_bytes())
    return path


def test_a_recording_of_palpate_in_gz_is_read_and_verified_as_such(own: Path) -> None:
    report = check(own)
    assert (report.clean, report.faults) == (True, ())
    assert report.verified == report.survey.rows > 1000
    assert palpate.touches(recorded(own)) == palpate.touches(recorded(OWN))


def test_it_is_not_repaired(own: Path) -> None:
    torn = OWN.read_bytes()[:-30]
    own.write_bytes(gzip.compress(torn + b"\n1,2\n" + torn[-2000:], mtime=0))
    before = own.read_bytes()
    report = check(own, repair=True, remove_damage=True)
    assert report.faults[-1] == "not repaired: it is standard input, or a packed file: unpack it, and repair that"
    assert own.read_bytes() == before


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (gzip.compress(TABLE, mtime=0)[:-20], "cannot be read: damaged, or not complete"),
        (gzip.compress(TABLE, mtime=0)[:15], "cannot be read: damaged, or not complete"),
        (gzip.compress(TABLE, mtime=0)[:-6] + b"123456", "CRC check failed"),
        (gzip.compress(TABLE, mtime=0) + b"more", "Not a gzipped file"),
        (b"\x1f\x8b", "cannot be read: damaged, or not complete"),
        (gzip.compress(b"", mtime=0), "is empty"),
        (gzip.compress(gzip.compress(TABLE, mtime=0), mtime=0), "a packed file, which palpate cannot read: unpack it"),
        (gzip.compress(TABLE + b"1,2,3\n" * 1000, mtime=0), "larger than 5,000 bytes"),
        (gzip.compress(OWN.read_bytes(), mtime=0), "larger than 5,000 bytes"),
    ],
)
def test_what_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, data: bytes, said: str) -> None:
    monkeypatch.setattr(packed, "LARGEST", 5000)
    path = tmp_path / "run.csv.gz"
    path.write_bytes(data)
    with pytest.raises(RecordingError, match=said):
        palpate.read(path)


@examples(100)
@given(st.data())
def test_any_bytes_are_a_recording_or_refused(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    whole = gzip.compress(TABLE, mtime=0)
    changed = bytearray(whole[: data.draw(st.integers(2, len(whole)))])
    for _ in range(data.draw(st.integers(0, 3))):
        changed[data.draw(st.integers(2, len(changed) - 1)) if len(changed) > 2 else 0] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "any.csv.gz"
    path.write_bytes(changed)
    with suppress(RecordingError, ValueError):
        palpate.read(path)


def piped(data: bytes, *arguments: str) -> "subprocess.CompletedProcess[bytes]":
    return subprocess.run([sys.executable, "-m", "palpate", *arguments], input=data, capture_output=True, check=False)


def test_a_recording_of_palpate_through_a_pipe_gives_the_same_touches() -> None:
    direct, through = piped(b"", "replay", str(OWN), "--json"), piped(OWN.read_bytes(), "replay", "-", "--json")
    assert json.loads(through.stdout)["touches"] == json.loads(direct.stdout)["touches"] != []
    assert b"standard input has none" in through.stderr


def run(data: bytes, *arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(main, arguments, input=data)
    return result.exit_code, result.output


@pytest.mark.parametrize("data", [TABLE, BOOK, gzip.compress(TABLE, mtime=0)], ids=["text", "excel", "gz"])
def test_every_command_reads_standard_input(tmp_path: Path, data: bytes) -> None:
    code, output = run(data, "check", "-")
    assert "-: readable" in output
    assert "40.0 pairs a second" in output
    code, output = run(data, "convert", "-", "-o", str(tmp_path / "new.csv"))
    assert (code, check(tmp_path / "new.csv").clean) == (0, True)
    assert run(data, "convert", "-", "-o", str(tmp_path / "new.csv"), "--force")[0] == 0
    code, output = run(data, "import", "-")
    assert (code, "40 pairs a second" in output) == (0, True)
    code, output = run(data, "record", "-", "-o", str(tmp_path / "recorded.csv"))
    assert palpate.read(tmp_path / "recorded.csv").hard.size > 30, output


def test_read_of_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(TABLE)))
    assert palpate.read("-").hard.size == 50
    assert palpate.read("-").hard.size == 50, "read once, and kept"
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(OWN.read_bytes())))
    assert palpate.read("-").hard.size > 1000, "another stream"
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(RecordingError, match="there is no standard input"):
        palpate.read("-")


def test_repair_of_standard_input_says_that_it_cannot_be() -> None:
    code, output = run(OWN.read_bytes()[:-30], "check", "-", "--repair")
    assert (code, "not repaired" in output) == (4, True)


def test_too_much_comes_from_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packed, "LARGEST", 100)
    code, output = run(TABLE, "check", "-")
    assert (code, "larger than 100 bytes" in output) == (4, True)


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo terminals")
def test_a_terminal_is_not_waited_for() -> None:
    import pty

    leader, follower = pty.openpty()
    command = [sys.executable, "-m", "palpate", "check", "-"]
    result = subprocess.run(command, stdin=follower, capture_output=True, text=True, timeout=100, check=False)
    os.close(leader)
    os.close(follower)
    assert result.returncode == 4
    assert "standard input is a terminal: send a file to it, as in palpate check - < run.csv" in result.stderr
