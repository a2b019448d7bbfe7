"""One byte that changed, anywhere before the last checkpoint or in the sidecar: every reader says so."""

import json
from collections.abc import Callable
from pathlib import Path
from random import Random

import palpate
import pytest
from click.testing import CliRunner
from damage import changed, finished, killed
from effort import NIGHTLY, draws
from palpate import RecordingError, check, read
from palpate.cli import main
from tally import Tally

pytestmark = pytest.mark.usefixtures("quick_disk")
ROWS, SYNCED = 40, 35
PARTS = 5
CHANGES = draws(500, 10_000) // PARTS


def _read(path: Path) -> str:
    recording = read(path)
    assert set(recording.doubts) <= set(recording.notes)
    return "\n".join((*recording.doubts, *(note for note in recording.notes if "no valid sidecar" in note)))


def _check(path: Path) -> str:
    return "\n".join(fault for fault in check(path).faults if not fault.startswith("no end in the sidecar"))


def _command(*words: str) -> str:
    """Return what a command says of the file, if its exit code says so too; it has no touches, so that code is 5."""
    result = CliRunner().invoke(main, list(words))
    assert result.exit_code in (0, 2, 4, 5), result
    lines = result.stderr.splitlines()
    return "\n".join(line for line in lines if "no end in the sidecar" not in line and "no touch found" not in line)


def _replay(path: Path) -> str:
    return _command("replay", str(path))


def _convert(path: Path) -> str:
    return _command("convert", str(path), "-o", str(path.with_name("converted.csv")), "--force")


READERS: dict[str, Callable[[Path], str]] = {"read": _read, "replay": _replay, "convert": _convert, "check": _check}


def told(reader: str, path: Path) -> bool:
    try:
        return bool(READERS[reader](path))
    except (palpate.RecordingError, ValueError) as error:
        return bool(str(error))


@pytest.mark.parametrize("part", range(PARTS))
def test_one_changed_byte_is_told_by_every_reader(tmp_path: Path, part: int, tally: Tally) -> None:
    path = killed(tmp_path / "run.csv", ROWS, SYNCED)
    beside = path.with_suffix(".json")
    rows, document = path.read_bytes(), beside.read_bytes()
    synced = json.loads(document)["checkpoint"]["bytes"]
    assert not any(told(reader, path) for reader in READERS)
    random, missed = Random(part), list[str]()
    for number in range(CHANGES):
        in_rows = number % 4 > 0
        data = rows if in_rows else document
        at = random.randrange(synced if in_rows else len(document))
        new = changed(data, at, random)
        (path if in_rows else beside).write_bytes(new)
        name = (path if in_rows else beside).name
        missed += [f"{reader}, {name}, byte {at}: {data[at : at + 1]!r} to {new[at : at + 1]!r}"
                   for reader in READERS if not told(reader, path)]  # fmt: skip
        (path if in_rows else beside).write_bytes(data)
    tally.say(f"one changed byte in a killed recording, part {part}: {CHANGES} tries, not told: {missed or 'none'}")
    assert len(missed) <= CHANGES * len(READERS) // 1000, missed


@pytest.mark.parametrize("seed", range(5 if NIGHTLY else 1))
def test_every_change_of_a_finished_recording_is_noticed(tmp_path: Path, seed: int) -> None:
    path = finished(tmp_path / "run.csv", ROWS)
    random = Random(seed)
    for each in (path, path.with_suffix(".json")):
        data = each.read_bytes()
        for at in range(0, len(data), 1 if NIGHTLY else 19):
            each.write_bytes(changed(data, at, random))
            assert told("check", path), at
            assert told("read", path), at
        each.write_bytes(data)
    assert check(path).clean


def test_the_exit_codes_and_the_documents(tmp_path: Path) -> None:
    """Results of changed rows are printed, with a sentence and the code 5; the converted file repeats the doubt."""
    four = Path(__file__).parents[1] / "data" / "four-specimens.csv"
    path = tmp_path / "four.csv"
    for suffix in (".csv", ".json"):
        path.with_suffix(suffix).write_bytes(four.with_suffix(suffix).read_bytes())
    runner = CliRunner()
    assert runner.invoke(main, ["replay", str(path)]).stderr == ""
    path.write_bytes(path.read_bytes().replace(b"9658471,", b"9658472,", 1))
    sentence = (
        "the rows were changed after they were written, or the sidecar belongs to another recording (checksum of "
    )
    result = runner.invoke(main, ["replay", str(path), "--json"])
    assert result.exit_code == 5
    document = json.loads(result.stdout)
    assert len(document["touches"]) == 4
    assert [note.startswith(sentence) for note in document["notes"]] == [True]
    assert result.stderr.startswith(f"{path}: {sentence}the 1,411 rows differs): results may be wrong")
    target = tmp_path / "again.csv"
    converted = runner.invoke(main, ["convert", str(path), "-o", str(target), "--json"])
    assert converted.exit_code == 5
    assert json.loads(converted.stdout)["notes"][0].startswith(sentence)
    assert read(target).doubts[0].startswith(f"before the conversion: {sentence}")
    assert check(target).verified == 0
    twice = tmp_path / "twice.csv"
    assert runner.invoke(main, ["convert", str(target), "-o", str(twice)]).exit_code == 5
    assert read(twice).doubts == read(target).doubts
    moduli = tmp_path / "moduli.csv"
    moduli.write_text("specimen,MPa\nfour,1.0\n")
    fit = ["calibrate", str(path), "--moduli", str(moduli), "-o", str(tmp_path / "probe.toml")]
    assert sentence in runner.invoke(main, fit).stderr
    with palpate.open(str(path)) as source, pytest.raises(RecordingError, match="the rows were changed"):
        list(source)
