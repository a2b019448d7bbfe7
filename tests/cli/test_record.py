"""The commands around a recording: record, check, replay, devices; and how they end."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import palpate
import pytest
from click.testing import CliRunner, Result
from palpate import DeviceNotFound, MissingExtra, Status, check
from palpate.cli import main
from palpate.recording.sidecar import load
from palpate.sources import devices
from recording_bench import record, sample, tear


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def rows(printed: str) -> dict[int, str]:
    """Return the last row of each touch, by number."""
    lines = [line for line in printed.splitlines()[1:] if line[:5].strip().isdecimal()]
    return {int(line[:5]): line for line in lines}


def told(printed: str) -> set[str]:
    """Return the sentences about touches."""
    return {line for line in printed.splitlines() if line.startswith("touch ") and ": " in line}


def test_record_check_replay(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorded = run("record", "sim:four-specimens?seed=1", "-o", path, "--touches", "4", "--note", "on the desk")
    assert recorded.exit_code == 0, recorded.stderr
    lines = len(path.read_text().splitlines()) - 1
    assert recorded.stderr == f"{path}: {lines} rows; file closed\n"
    assert list(rows(recorded.stdout)) == [1, 2, 3, 4]
    assert [recorded.stdout.count(f"  {result}") for result in ("first", "revised")] == [4, 4]
    checked = run("check", path)
    assert checked.exit_code == 0
    assert checked.stdout.startswith(f"{path}: complete, clean end: {lines} rows in 3")
    replayed = run("replay", path)
    assert (replayed.exit_code, rows(replayed.stdout)) == (0, rows(recorded.stdout))
    assert told(replayed.stdout) <= told(recorded.stdout)
    document = load(path)
    assert document
    assert document["notes"] == ["on the desk"]


def test_the_recorded_scene_is_replayed_unless_another_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    how = ("--scene", "paper", "--samples", "80", "--set", "threshold=inf")
    live = json.loads(run("record", "sim:stiff-steady", "-o", path, *how, "--json").stdout)
    again = json.loads(run("replay", path, "--json").stdout)
    assert (again["scene"], again["settings"]["threshold"], again["settings"]["samples"]) == ("paper", "inf", 80)
    assert again["touches"] == live["touches"]
    assert live["counters"]["read"] == again["rows"]
    fewer = json.loads(run("replay", path, "--json", "--samples", "20").stdout)
    assert (fewer["scene"], fewer["touches"][0]["samples"]) == ("paper", 20)
    other = json.loads(run("replay", path, "--json", "--scene", "handheld").stdout)
    assert (other["scene"], other["settings"], other["touches"][0]["samples"]) == ("handheld", {}, 208)
    in_seconds = json.loads(run("replay", path, "--json", "--touch-seconds", "2").stdout)
    assert (in_seconds["settings"]["samples"], in_seconds["settings"]["seconds"]) == (None, 2.0)
    assert in_seconds["touches"][0]["samples"] == pytest.approx(2 / 0.0313, abs=2)


def test_unplugged_in_the_middle_and_back(tmp_path: Path) -> None:
    path = tmp_path / "cut.csv"
    recorded = run("record", "sim:four-specimens?fault=unplug:1.5@13", "-o", path, "--touches", "4")
    assert recorded.exit_code == 0
    told = recorded.stderr.splitlines()
    assert "was unplugged: plug it in again. Waiting for it, up to 30 s." in told[0]
    assert told[1] == "The device is back after 1.5 s: 48 pairs lost."
    assert told[2] == "the board was unplugged for 1.5 s: the baseline is measured again: touch nothing"
    assert ", 48 lost, 1 late" in told[-1]
    checked = run("check", path)
    assert checked.exit_code == 5
    assert "48 samples lost in 1 gap" in checked.stdout
    assert rows(run("replay", path).stdout) == rows(recorded.stdout)


def test_unplugged_for_good(tmp_path: Path) -> None:
    path = tmp_path / "gone.csv"
    recorded = run("record", "sim:four-specimens?fault=unplug:inf@13&replug=5", "-o", path, "--touches", "4")
    assert recorded.exit_code == 3
    assert recorded.stderr.splitlines()[-1].startswith("Error: ")
    assert list(rows(recorded.stdout)) == [1, 2]
    assert "touch 2: short: the recording ended during this touch\n" in recorded.stdout
    checked = run("check", path)
    assert checked.exit_code == 5
    assert checked.stdout.startswith(f"{path}: complete, until the source failed: ")
    assert "the source ended with an error: " in checked.stdout
    assert rows(run("replay", path).stdout) == rows(recorded.stdout)
    as_json = run("record", "sim:step-up?fault=unplug:inf@3&replug=1", "-o", tmp_path / "b.csv", "--json")
    assert as_json.exit_code == 3
    assert "unplugged" in json.loads(as_json.stdout)["error"]


def test_so_many_seconds_and_fewer_touches_than_asked_for(tmp_path: Path) -> None:
    recorded = run("record", "sim:sliding?idle=60", "-o", tmp_path / "a.csv", "--seconds", "1")
    assert (recorded.exit_code, recorded.stdout) == (0, "")
    assert 1 <= check(tmp_path / "a.csv").survey.seconds < 2
    recorded = run("record", "sim:step-up", "-o", tmp_path / "b.csv", "--touches", "2")
    assert recorded.exit_code == 5
    assert "1 of 2 touches were measured" in recorded.stderr


def test_a_recording_without_a_sample(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("palpate.sources.sim.SimSource.__iter__", lambda _: iter(()))
    for more in ([], ["--seconds", "1"], ["--touches", "1"]):
        recorded = run("record", "sim:", "-o", tmp_path / f"{len(more)}{more[:1]}.csv", *more)
        assert (recorded.exit_code, recorded.stdout) == (5, "")
        assert recorded.stderr.splitlines()[-1].startswith("sim:: no sample came: ")


def test_a_touch_that_the_end_of_the_recording_cuts(tmp_path: Path) -> None:
    recorded = run("record", "sim:step-up", "-o", tmp_path / "a.csv", "--seconds", "4")
    told = "short: the recording ended during this touch"
    assert f"touch 1: {told}\n" in recorded.stdout
    assert f"touch 1: {told}\n" in run("replay", tmp_path / "a.csv").stdout
    recorded = run("record", "sim:step-up", "-o", tmp_path / "b.csv", "--seconds", "4", "--json")
    for document in (recorded.stdout, run("replay", tmp_path / "a.csv", "--json").stdout):
        assert told in json.loads(document)["touches"][0]["advice"]
    lifted = run("record", "sim:step-up", "-o", tmp_path / "c.csv", "--samples", "1000")
    assert "touch 1: short: the touch ended after" in lifted.stdout


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["moon:", "-o", "x.csv"], 2, "source: got moon:"),
        (["sim:moon", "-o", "x.csv"], 2, "sim: got scenario 'moon'"),
        (["sim:", "-o", "x.txt"], 2, "a name that ends in .csv"),
        (["sim:", "-o", "x.csv", "--scene", "moon"], 2, "scene: got 'moon'"),
        (["sim:", "-o", "x.csv", "--set", "colour=1"], 2, "got an unexpected keyword 'colour', allowed: samples"),
        (["sim:", "-o", "x.csv", "--touches", "0"], 2, "0 is not in the range"),
        (["sim:", "-o", "nowhere/x.csv"], 4, "nowhere: no such folder: make it, or name another one"),
        (["sim:", "-o", "there.csv"], 4, "there.csv: already exists"),
        (["nowhere.csv", "-o", "x.csv"], 4, "nowhere.csv: cannot be read"),
        (["iio:/nowhere", "-o", "x.csv"], 3, "not found"),
    ],
)
def test_how_it_ends(
    arguments: list[str], code: int, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("there.csv").write_text("precious")
    result = run("record", *arguments)
    assert (result.exit_code, result.stdout) == (code, "")
    assert message in result.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["there.csv"]
    assert Path("there.csv").read_text() == "precious"


@pytest.mark.parametrize("pause_s", [0.0, 0.06, 0.1, 0.15])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)])
def test_ctrl_c_twice_closes_the_file(tmp_path: Path, number: int, pause_s: float) -> None:
    path = tmp_path / "run.csv"
    command = [sys.executable, "-m", "palpate", "record", "sim:four-specimens?speed=1", "-o", str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        while not (path.exists() and len(path.read_bytes().splitlines()) > 6):
            time.sleep(0.02)
            assert process.poll() is None
        process.send_signal(number)
        time.sleep(pause_s)
        process.send_signal(number)
        _, told = process.communicate()
    assert process.returncode == 130
    assert told.endswith("; file closed\n")
    report = check(path)
    assert report.clean
    assert report.survey.rows >= 5


def test_check(tmp_path: Path) -> None:
    good = record(tmp_path / "good.csv", [sample(i) for i in range(100)])
    gaps = record(tmp_path / "gaps.csv", [sample(i) for i in (1, 2, 5)] + [sample(6, status=Status.LOST)])
    torn = record(tmp_path / "torn.csv", [sample(i) for i in range(100)], end=False)
    tear(torn, 9)
    letter = tmp_path / "letter.csv"
    letter.write_text("Dear colleague,\n")
    assert run("check", good).exit_code == 0
    assert run("check", good, gaps).exit_code == 5
    result = run("check", good, torn, gaps)
    assert result.exit_code == 4
    assert f"{torn}: not complete: 99 rows" in result.stdout
    result = run("check", good, letter, "--json")
    assert result.exit_code == 4
    document = json.loads(result.stdout)
    assert [entry["clean"] for entry in document["recordings"]] == [True]
    assert len(document["unreadable"]) == 1
    assert run("check", torn, "--repair").exit_code == 5
    assert "repaired: 99 rows" in run("check", torn).stdout
    assert run("check", letter, "--map", "hard=1").exit_code == 2
    table = tmp_path / "table.csv"
    table.write_text("time,hard,soft\n0,1,2\n0.1,1,3\n0.2,1,3\n")
    result = run("check", table, "--map", "hard=2,soft=3", "--unit", "pF")
    said = "time = time, s (by its steps); hard = hard, pF; soft = soft, pF; 10 pairs a second; 3 rows"
    shown = f"{table}: readable: 3 rows in 0.2 s, 10.0 pairs a second\n  {said}\n"
    assert (result.exit_code, result.stdout) == (0, shown)


def test_devices(monkeypatch: pytest.MonkeyPatch) -> None:
    def boards() -> list[devices.Found]:
        return [devices.Found("usb:1/2", "AD7746 evaluation kit")]

    def fail() -> list[devices.Found]:
        raise DeviceNotFound("no permission to look")

    for name, look in (("_boards", boards), ("_iio", fail), ("_i2c", list), ("_ports", list)):
        monkeypatch.setattr(devices, name, look)
    result = run("devices")
    assert (result.exit_code, result.stdout) == (0, "usb:1/2  AD7746 evaluation kit\n")
    assert result.stderr == "not searched: no permission to look\n"
    monkeypatch.setattr(devices, "_boards", list)
    result = run("devices", "--json")
    assert result.exit_code == 3
    assert json.loads(result.stdout) == {"devices": [], "notes": ["no permission to look"]}
    assert "sim:four-specimens" in result.stderr


def test_who_looks_for_a_board_is_not_told_of_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> list[devices.Found]:
        raise MissingExtra("serial ports need pyserial")

    monkeypatch.setattr(devices, "_ports", fail)
    monkeypatch.setattr(devices, "_boards", list)
    monkeypatch.setattr(devices, "_iio", lambda: [devices.Found("iio:x", "AD7746 by the kernel's driver")])
    assert devices.boards() == ([("iio:x", "AD7746 by the kernel's driver")], [])
    assert devices.devices()[1] == ["serial ports need pyserial"]


def test_devices_of_this_machine() -> None:
    found, notes = devices.devices()
    assert all(":" in device.uri for device in found)
    assert all(notes)


@pytest.mark.parametrize("arguments", [["--help"], ["record", "--help"], ["check", "--help"], ["devices", "--help"]])
def test_help_is_lean(arguments: list[str]) -> None:
    code = f"""
import sys
sys.argv = ["palpate", *{arguments!r}]
try:
    import palpate.__main__
finally:
    heavy = {{"numpy", "usb", "serial", "smbus2", "palpate.sources", "palpate.stream", "asyncio"}}
    assert not heavy & set(sys.modules), heavy & set(sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "Usage: " in done.stdout


def test_a_progress_line_on_a_terminal_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from palpate.cli import record as cli_record

    class Terminal(cli_record._Progress):
        def __init__(self) -> None:
            super().__init__()
            self._terminal = True

    monkeypatch.setattr(cli_record, "_Progress", Terminal)
    result: Any = run("record", "sim:stiff-steady", "-o", tmp_path / "run.csv")
    assert "\r" in result.stderr
    assert " pairs, 0 lost, " in result.stderr
    assert "\r" not in result.stdout
    assert palpate.read(tmp_path / "run.csv").hard.size
