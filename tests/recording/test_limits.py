"""The limit of each parser: at it a file is read, beyond it the error says what was found and what is allowed."""

import json
from pathlib import Path

import palpate
import pytest
from palpate import Calibration, CalibrationError, RecordingError, toml
from palpate.calibration.specimen_files import read_moduli
from palpate.recording import sidecar as sidecar_module
from palpate.recording.exchange.binary_data import read_channel
from palpate.recording.foreign import recorded
from palpate.recording.rows import HEADER
from project import ROOT

PROBE = ROOT / "tests" / "fuzz" / "corpus" / "calibration" / "probe.toml"
ROW = "{0},0.0{0},0.0{0},8388608,8400000,0.0,0.0055625,-1,0\n"


def table(tmp_path: Path, *, columns: int = 3, header: int = 1, cell: int = 1) -> Path:
    path = tmp_path / "t.csv"
    rows = f"1,2,{'3' * cell}{',4' * (columns - 3)}\n" * (3 if header == 1 else 1100)
    path.write_text("a,b\n" * (header - 1) + f"t,hard,soft{',x' * (columns - 3)}\n" + rows)
    return path


def test_tables(tmp_path: Path) -> None:
    how = {"hard": "hard", "soft": "soft"}
    for at in ({"columns": 1000}, {"header": 1000}, {"cell": 1000}):
        assert palpate.read(table(tmp_path, **at), columns=how, rate=38.4).hard[:3].tolist() == [2.0] * 3
    for beyond, said in (
        ({"columns": 1001}, "line 1: got 1,001 columns, allowed: 1,000"),
        ({"header": 1001}, "no row of numbers"),
        ({"cell": 100_000}, "line 2: got a line of 100,004 characters, allowed: 100,000"),
    ):
        with pytest.raises(RecordingError, match=said):
            palpate.read(table(tmp_path, **beyond), columns=how, rate=38.4)


@pytest.mark.parametrize(
    ("at", "beyond", "said"),
    [
        ("a" + ".a" * 32 + "=1", "a" + ".a" * 33 + "=1", "line 1: got 33 dots, allowed: 32 in a line"),
        ('a="' + "x" * 9_996 + '"', 'a="' + "x" * 9_997 + '"', "line 1: got 10,001 characters, allowed: 10,000"),
        ("a=[" + "1,\n" * 99_998 + "]", "a=[" + "1,\n" * 99_999 + "]", "got 100,001 of the characters .=,[{"),
        ("#\n" * 500_000, "#\n" * 500_000 + "#", "got 1,000,001 characters, allowed: 1,000,000"),
        ("a=" + "[" * 50 + "]" * 50, "a=" + "[" * 4000 + "]" * 4000, "too deep in others"),
    ],
)
def test_toml(at: str, beyond: str, said: str) -> None:
    toml.loads(at)
    with pytest.raises(ValueError, match="got ") as caught:
        toml.loads(beyond)
    assert said in str(caught.value)


def test_what_is_saved_can_be_loaded(tmp_path: Path) -> None:
    probe = Calibration.load(PROBE)
    assert isinstance(probe.about, dict)
    probe.about["specimen"] = "x" * 11_000
    with pytest.raises(ValueError, match="characters, allowed: 10,000"):
        probe.save(tmp_path / "p.toml")
    assert list(tmp_path.iterdir()) == []


def test_files_of_codes(tmp_path: Path) -> None:
    path = tmp_path / "Binary Data.txt"
    path.write_text("Conv. Time: 62.0 ms\n" + "a: b\n" * 998 + "800000\n")
    assert (read_channel(path).period_s, len(read_channel(path).codes)) == (0.062, 1)
    for header, said in (
        ("a: b\n" * 1000, "no row of codes found in 1,000 lines"),
        ("a" * 1001 + "\n", "line 1: got 1,001"),
    ):
        path.write_text(header + "800000\n")
        with pytest.raises(RecordingError, match=said):
            read_channel(path)


def test_moduli(tmp_path: Path) -> None:
    path = tmp_path / "moduli.csv"
    for text, said in (
        ("name,modulus\n" + "a" * 1001, "line 2: got 1,001 characters"),
        ("a" * 200_001, "200,000 bytes"),
    ):
        path.write_text(text)
        with pytest.raises(CalibrationError, match=said):
            read_moduli(path)


def sidecar(tmp_path: Path, device: str = "{}", marks: str = "") -> Path:
    path = tmp_path / "run.csv"
    path.write_text(HEADER + "".join(map(ROW.format, range(9))))
    document = f'{{"schema":"palpate-recording-1","device":{device},"settings":{{}},"notes":[],"marks":[{marks}]}}'
    path.with_suffix(".json").write_text(document)
    return path


def test_sidecars(tmp_path: Path) -> None:
    assert "no valid sidecar" not in str(palpate.read(sidecar(tmp_path, marks="[" * 30 + "]" * 30)).notes)
    for given, said in (
        ({"marks": "[" * 31 + "]" * 31}, "deeper than 32 in others"),
        ({"device": f'{{"full_scale_pF":{2**63}}}'}, "full_scale_pF: got 9223372036854775808, allowed"),
        ({"marks": "0," * 10_000 + "0"}, "marks: got 10001, allowed: 10000 at most"),
    ):
        [note] = palpate.read(sidecar(tmp_path, **given)).notes
        assert note.startswith("no valid sidecar")
        assert said in note


def test_the_marks_are_searched_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not at each block: 10,000 tares took 30 s."""
    path = sidecar(tmp_path, marks=",".join(json.dumps({"seq": n, "tare": True}) for n in range(9)))
    calls: list[object] = []
    found = sidecar_module.tares_of

    def counted(document: dict[str, object]) -> frozenset[int]:
        calls.append(document)
        return found(document)

    monkeypatch.setattr("palpate.recording.sidecar.tares_of", counted)
    palpate.touches(recorded(path))
    assert 0 < len(calls) < 9
