"""`palpate kit`: what it prints, the report, the exit codes."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import Result
from command_lines import document
from command_lines import run as palpate
from palpate.acceptance import steps
from palpate.acceptance.board_under_test import BoardUnderTest
from palpate.ad7746.simulator.evalboard import Fault, FaultKind
from palpate.sources.sim import SimSource


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str, text: str | None = None) -> Result:
    return palpate("kit", *arguments, text=text)


def fail(monkeypatch: pytest.MonkeyPatch, fault: Fault) -> None:
    """Add a fault to each simulated board."""
    begin = SimSource.__init__

    def broken(self: SimSource, *arguments: Any) -> None:
        begin(self, *arguments)
        self.kit.faults.append(fault)

    monkeypatch.setattr(SimSource, "__init__", broken)


def test_the_report_has_the_steps_that_are_printed(folder: Path) -> None:
    done = run("accept", "sim:?wiring=exca")
    assert done.exit_code == 5, done.stderr
    [path] = folder.glob("kit-report-*.json")
    assert done.stderr.endswith(f"report: {path.name}\n")
    for step in json.loads(path.read_text())["steps"]:
        assert f"  {step['name']}: {step['measured']}" in done.stdout
    assert document("kit", "accept", "sim:", "-o", "a.json") == json.loads(
        (folder / "a.json").read_text()
    )


def test_the_probe_of_a_simulated_board_is_pressed(folder: Path) -> None:
    done = run("accept", "sim:?idle=25", "-o", "a.json", "--prompt", "--skip", "replug", text="\n")
    assert "ok  press: hard bump +" in done.stdout, done.stdout
    done = run(
        "accept",
        "sim:?idle=25&wiring=swapped",
        "-o",
        "b.json",
        "--prompt",
        "--skip",
        "replug",
        text="\n",
    )
    assert (done.exit_code, "the inputs are swapped" in done.stdout) == (5, True)
    assert "--  press: left out" in run("accept", "sim:", "--prompt", text="s\ns\n").stdout


def test_an_unplugged_board_leaves_the_report_so_far(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fail(monkeypatch, Fault(FaultKind.UNPLUG, float("inf"), skip=400))
    done = run("accept", "sim:", "-o", "a.json")
    assert re.search("ended early: .*the board was unplugged", done.stdout)
    verdicts = [step["verdict"] for step in json.loads((folder / "a.json").read_text())["steps"]]
    assert (verdicts[:2], verdicts[-1]) == (["ok", "ok"], "not done")
    assert done.exit_code == 3


@pytest.mark.parametrize(
    ("fault", "step", "words"),
    [
        ("unplug:1.5@0", "losses", "the board was unplugged and came back"),
        (
            "wire-off:2@1",
            "status of the pairs",
            "CIN2+ and EXCB: a wire came off after the inputs were measured",
        ),
        ("chip-absent@1", "pairs", "the chip stopped answering: check link LK2"),
    ],
)
def test_what_fails_after_the_inputs_is_not_blamed_on_them(
    fault: str, step: str, words: str
) -> None:
    steps = {
        each["name"]: each for each in document("kit", "accept", f"sim:?fault={fault}")["steps"]
    }
    assert (steps[step]["verdict"], words in " ".join(steps[step]["do"])) == ("wrong", True)
    assert not re.search("too busy|see the inputs", str(steps))


@pytest.mark.parametrize(
    ("error", "code"), [(KeyboardInterrupt(), 130), (ZeroDivisionError("x"), 1)]
)
def test_what_ends_it_is_in_the_report(
    error: BaseException, code: int, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(board: BoardUnderTest) -> None:
        raise error

    monkeypatch.setitem(steps._STEPS, "voltages", stop)
    done = run("accept", "sim:", "-o", "a.json")
    report = json.loads((folder / "a.json").read_text())
    assert (done.exit_code, len(report["steps"])) == (code, 3)
    assert report["stopped"] == ("interrupted" if code == 130 else "unexpected: ZeroDivisionError")


@pytest.mark.parametrize("source", ["iio:", "sim:?wiring=moon", "usb:x"])
def test_what_is_no_board_is_refused(source: str) -> None:
    done = run("scan", source)
    assert (done.exit_code, len(done.stderr.splitlines())) == (2, 1)
    assert "allowed: " in done.stderr


def test_scan() -> None:
    rows = document("kit", "scan", "sim:?wiring=soft-exca")["inputs"]
    found = {row["input"] + row["excitation"]: row["pF"] for row in rows}
    assert {name for name, pF in found.items() if pF > 3} == {"CIN1EXCB", "CIN2EXCA"}
    assert {name for name, pF in found.items() if pF < 0.01} == {"CIN1EXCA", "CIN2EXCB"}
    assert "shorted" in run("scan", "sim:?wiring=excb-shorted").stdout


def test_noise_is_that_of_the_data_sheet() -> None:
    rows = document(
        "kit", "noise", "sim:?idle=600", "--readings", "400", "--capf", "0", "--capf", "7"
    )["noise"]
    assert [row["capf"] for row in rows] == [0, 7]
    for row in rows:  # 5 sigma of 400 readings
        assert [row["cin1_aF"], row["cin2_aF"]] == pytest.approx(
            [row["data_sheet_aF"]] * 2, rel=0.25
        )
    done = run("noise", "sim:?wiring=soft-open", "--capf", "0")
    assert "       -" in done.stdout
    assert done.stderr.startswith(
        "CIN2 is not measured: it has 0.003 pF on EXCA and 0.003 pF on EXCB"
    )


def test_dump() -> None:
    rows = document("kit", "dump", "sim:")["registers"]
    assert "".join(
        row["content"] for row in rows
    ) == "0700000000000000 0003a0000080 0066cc5c90".replace(" ", "")
    shown = run("dump", "sim:").stdout
    assert "0A  CONFIG      a0      idle; CAPF 4: 62.0 ms, VTF 2: 62.1 ms" in shown


def test_a_chip_that_is_absent_ends_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    fail(monkeypatch, Fault(FaultKind.CHIP_ABSENT))
    for name in ("scan", "noise", "dump"):
        done = run(name, "sim:")
        assert (done.exit_code, len(done.stderr.splitlines())) == (4, 1)
