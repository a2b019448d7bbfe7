"""The commands around a recording: record, check, replay, devices; and how they end."""

import json
import sys
from itertools import count
from pathlib import Path

import pytest
from command_lines import document, run
from faulty_tables import healthy, saturated
from palpate import Status, check
from palpate.recording.sidecar import load
from palpate.recording.writer import Writer
from recording_bench import killed, record, sample

linux = pytest.mark.skipif(
    sys.platform != "linux", reason="a folder that root cannot write to, either"
)


def rows(printed: str) -> dict[int, str]:
    """Return the last row of each touch, by number."""
    lines = [line for line in printed.splitlines()[1:] if line[:5].strip().isdecimal()]
    return {int(line[:5]): line for line in lines}


def advice_lines(printed: str) -> set[str]:
    """Return the sentences about touches."""
    return {line for line in printed.splitlines() if line.startswith("touch ") and ": " in line}


def test_a_disk_that_stays_full_ends_no_measurement_and_is_exit_code_4(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All touches are measured; the rows that are not in the file are counted."""
    monkeypatch.setattr("palpate.recording.recorder.PATIENCE_S", 0.0)
    append = Writer._append
    calls = count()

    def full(self: Writer, rows: int, data: bytes) -> None:
        if next(calls):
            raise OSError(28, "No space left on device")
        append(self, rows, data)

    monkeypatch.setattr(Writer, "_append", full)
    path = tmp_path / "run.csv"
    recorded = run("record", "sim:four-specimens?seed=1", "-o", path)
    assert (recorded.exit_code, list(rows(recorded.stdout))) == (4, [1, 2, 3, 4])
    assert "not written; file closed" in recorded.stderr
    last = recorded.stderr.splitlines()[-1]
    assert last.startswith(f"Error: {path}: cannot be written: No space left on device; ")


def test_record_check_replay(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorded = run(
        "record", "sim:four-specimens?seed=1", "-o", path, "--touches", "4", "--note", "on the desk"
    )
    assert recorded.exit_code == 0, recorded.stderr
    lines = len(path.read_text().splitlines()) - 1
    assert recorded.stderr == f"{path}: {lines} rows; file closed\n"
    assert list(rows(recorded.stdout)) == [1, 2, 3, 4]
    assert [recorded.stdout.count(f"  {result}") for result in ("first", "revised")] == [0, 4]
    assert len(recorded.stdout.splitlines()) == 1 + 4 + len(advice_lines(recorded.stdout))
    assert run("check", path).stdout.startswith(f"{path}: complete, clean end: {lines} rows in 3")
    replayed = run("replay", path)
    assert (replayed.exit_code, rows(replayed.stdout)) == (0, rows(recorded.stdout))
    assert advice_lines(replayed.stdout) <= advice_lines(recorded.stdout)
    assert (load(path) or {})["notes"] == ["on the desk"]


def test_the_recorded_scene_is_replayed_unless_another_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    options = ("--scene", "paper", "--samples", "80", "--set", "threshold=inf")
    live, again = (
        document("record", "sim:stiff-steady", "-o", path, *options),
        document("replay", path),
    )
    assert (again["scene"], again["settings"]["threshold"], again["settings"]["samples"]) == (
        "paper",
        "inf",
        80,
    )
    assert again["touches"] == live["touches"]
    other = document("replay", path, "--scene", "handheld")
    assert (other["scene"], other["settings"], other["touches"][0]["samples"]) == (
        "handheld",
        {},
        208,
    )
    settings = document("replay", path, "--touch-seconds", "2")["settings"]
    assert (settings["samples"], settings["seconds"]) == (None, 2.0)


def test_unplugged_for_good(tmp_path: Path) -> None:
    path = tmp_path / "gone.csv"
    recorded = run(
        "record", "sim:four-specimens?fault=unplug:inf@13&replug=5", "-o", path, "--touches", "4"
    )
    assert (recorded.exit_code, list(rows(recorded.stdout))) == (3, [1, 2])
    assert recorded.stderr.splitlines()[-1].startswith("Error: ")
    assert "touch 2: short: the recording ended during this touch\n" in recorded.stdout
    checked = run("check", path)
    assert (checked.exit_code, "the source ended with an error: " in checked.stdout) == (5, True)
    assert checked.stdout.startswith(f"{path}: complete, until the source failed: ")
    assert rows(run("replay", path).stdout) == rows(recorded.stdout)


def test_so_many_seconds_or_fewer_touches_than_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cut, few = tmp_path / "a.csv", tmp_path / "b.csv"
    advice = "short: the recording ended during this touch"
    recorded = run("record", "sim:step-up", "-o", cut, "--seconds", "4", "--json")
    assert 4 <= check(cut).survey.seconds < 5
    assert advice in json.loads(recorded.stdout)["touches"][0]["advice"]
    assert f"touch 1: {advice}\n" in run("replay", cut).stdout
    recorded = run("record", "sim:step-up", "-o", few, "--touches", "2", "--samples", "1000")
    assert (recorded.exit_code, "1 of 2 touches were measured" in recorded.stderr) == (5, True)
    monkeypatch.setattr("palpate.sources.sim.SimSource.samples", lambda _: iter(()))
    recorded = run("record", "sim:", "-o", tmp_path / "c.csv", "--touches", "1")
    assert (recorded.exit_code, recorded.stdout) == (5, "")
    assert recorded.stderr.splitlines()[-1].startswith("sim:: no sample came: ")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["moon:", "-o", "x.csv"], 2, "source: got moon:"),
        (["sim:", "-o", "x.txt"], 2, "a name that ends in .csv"),
        (["sim:", "-o", "x.csv", "--scene", "moon"], 2, "scene: got 'moon'"),
        (["iio:/nowhere", "-o", "x.csv"], 3, "not found"),
        (["sim:", "-o", f"{__file__}/x.csv"], 4, "is no folder: make it, or name another one"),
        pytest.param(
            ["sim:", "-o", "/proc/x.csv"], 4, "/proc/x.json: cannot be written: ", marks=linux
        ),
    ],
)
def test_how_it_ends(
    arguments: list[str], code: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before anything starts: no source is read, nothing is left."""
    monkeypatch.setattr("palpate.sources.sim.SimSource.samples", lambda _: 1 / 0)
    monkeypatch.chdir(tmp_path)
    result = run("record", *arguments)
    assert (result.exit_code, result.stdout, list(tmp_path.iterdir())) == (code, "", [])
    assert message in result.stderr


def test_check_of_several_has_the_worst_code(tmp_path: Path) -> None:
    good = record(tmp_path / "good.csv", [sample(i) for i in range(100)])
    gaps = record(
        tmp_path / "gaps.csv", [sample(i) for i in (1, 2, 5)] + [sample(6, status=Status.LOST)]
    )
    torn = killed(tmp_path / "torn.csv", 99, 99, torn=50)
    letter = tmp_path / "letter.csv"
    letter.write_text("Dear colleague,\n")
    assert [run("check", good, *more).exit_code for more in ([], [gaps], [gaps, torn])] == [0, 5, 4]
    assert run("check", good, letter).exit_code == 4
    found = document("check", good, letter)
    assert ([entry["clean"] for entry in found["recordings"]], len(found["unreadable"])) == (
        [True],
        1,
    )
    table = tmp_path / "table.csv"
    table.write_text("time,hard,soft\n0,1,2\n0.1,1,3\n0.2,1,3\n")
    result = run("check", table, "--map", "hard=2,soft=3", "--unit", "pF")
    message = (
        "time = time, s (by its steps); hard = hard, pF; soft = soft, pF; 10 pairs a second; 3 rows"
    )
    shown = f"{table}: readable: 3 rows in 0.2 s, 10.0 pairs a second\n  {message}\n"
    assert (result.exit_code, result.stdout) == (0, shown)


def test_what_is_judged_of_the_readings_is_printed_once_and_in_the_document(
    tmp_path: Path,
) -> None:
    """The same sentences while it is recorded, and when it is replayed."""
    path = tmp_path / "run.csv"
    source = saturated(tmp_path)
    recorded = run("record", source, "-o", path)
    judged = document("replay", path)["judgements"]
    assert {each["name"] for each in judged} == {"saturated", "frozen"}
    assert document("record", source, "-o", tmp_path / "2.csv")["judgements"] == judged
    said = [line for line in recorded.stderr.splitlines() if "the hard channel" in line]
    assert said[0] == judged[0]["text"]
    assert said[-1] == "the hard channel: saturated once more"
    assert len(said) == len(set(said)) == 4
    replayed = [line for line in run("replay", path).stderr.splitlines() if "hard channel" in line]
    assert replayed == [f"{path}: {line}" for line in said]
    assert document("replay", healthy(tmp_path))["judgements"] == []
    assert "hard channel" not in run("check", path).stdout
