"""`palpate doctor`: each line ok, or what to type."""

import json
from importlib import metadata
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result
from palpate.ad7746.clock import VirtualClock
from palpate.ad7746.evalkit import find, permission, udev
from palpate.ad7746.evalkit.find import Board
from palpate.ad7746.evalkit.udev import UDEV_RULE
from palpate.ad7746.twin.chip import ChipTwin
from palpate.ad7746.twin.kit import KitTwin
from palpate.ad7746.twin.usb import TwinBackend
from palpate.cli import diagnosis, main


def run(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["doctor", *arguments])


@pytest.fixture(autouse=True)
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No file, no variable and no rule of this machine's."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PALPATE_FIRMWARE", raising=False)
    monkeypatch.setattr(udev, "RULES", (tmp_path / "rules.d",))
    monkeypatch.setattr("palpate.benchmark.nanoseconds", lambda work, pairs: 3.6)
    monkeypatch.setattr(click, "get_app_dir", lambda name: str(tmp_path / name))


def plug(monkeypatch: pytest.MonkeyPatch, *, loaded: bool = True, allowed: bool | None = None) -> KitTwin:
    """Have a board that is simulated."""
    clock = VirtualClock()
    kit = KitTwin(ChipTwin(lambda pin, begin_s, end_s: 1.0), clock, loaded=loaded)
    backend = TwinBackend(clock)
    backend.plug(kit)
    monkeypatch.setattr(find, "system_backend", lambda: backend)
    monkeypatch.setattr(permission, "may_open", lambda board: allowed)
    return kit


def test_nothing_is_wrong_here() -> None:
    result = run()
    assert result.exit_code == 0, result.stdout
    marks = {line[:2] for line in result.stdout.splitlines()}
    assert marks <= {"ok", "--", "  "}
    assert " ns an update" in result.stdout
    document = json.loads(run("--json").stdout)
    assert document["wrong"] == 0
    assert {"palpate", "extra usb", "speed, AdaptiveRls"} <= {finding["what"] for finding in document["findings"]}


def test_a_board_that_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, allowed=True)
    result = run()
    assert result.exit_code == 0
    assert "can be opened, firmware is running, the AD7746 answers" in result.stdout


def test_a_board_without_a_chip(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch).chip.present = False
    result = run()
    assert result.exit_code == 4
    assert "the AD7746 has never answered; check the jumpers SDA, SCL and RDY of link LK2" in result.stdout


def test_a_board_without_firmware(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, loaded=False)
    result = run()
    assert result.exit_code == 3
    assert "!!  board usb:" in result.stdout
    assert "has no firmware" in result.stdout
    assert "export PALPATE_FIRMWARE=.../Icv_usb.hex" in result.stdout


def test_a_board_that_may_not_be_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    plug(monkeypatch, allowed=False)
    result = run()
    assert result.exit_code == 3
    assert "connected, but no permission to open it" in result.stdout
    assert "!!  permission: no udev rule for the board" in result.stdout
    assert "      palpate doctor --install-udev" in result.stdout


def test_a_rule_that_gives_this_user_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rules.d").mkdir()
    (tmp_path / "rules.d" / "70-palpate.rules").write_text(f"{UDEV_RULE}\n")
    plug(monkeypatch, allowed=False)
    monkeypatch.setattr(udev, "missing_group", lambda: "sudo usermod -aG plugdev me")
    result = run()
    assert result.exit_code == 3
    assert "70-palpate.rules gives this user no access" in result.stdout
    assert "      sudo usermod -aG plugdev me" in result.stdout


@pytest.mark.parametrize(
    ("name", "rule", "text", "do"),
    [
        (
            "70-palpate.rules",
            'MODE="0666"',
            "lets every user and program of this machine write",
            "palpate doctor --inst",
        ),
        (
            "99-ad7746.rules",
            'MODE:="666"',
            "lets every user and program of this machine write",
            "take the board's mode",
        ),
        (
            "99-ad7746.rules",
            'RUN+="fxload -m 0666"',
            "lets every user and program",
            "take the board's mode and tag out of",
        ),
        ("99-ad7746.rules", 'TAG+="uaccess"', "sorts after 73-seat-late.rules", "take the board's mode"),
    ],
)
def test_a_rule_that_should_be_replaced(
    name: str, rule: str, text: str, do: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "rules.d").mkdir()
    board = 'SUBSYSTEM=="usb", ATTR{idVendor}=="0456", ATTR{idProduct}=="B481"'
    (tmp_path / "rules.d" / name).write_text(f"{board}, {rule}\n")
    plug(monkeypatch, allowed=True)
    result = run()
    assert result.exit_code == 0
    assert text in result.stdout
    assert f"      {do}" in result.stdout


def test_permission_is_that_of_the_device_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    board = Board(1, 2, ())
    node = tmp_path / "001" / "002"
    assert permission.may_open(board, tmp_path) is None
    node.parent.mkdir()
    node.touch()
    assert permission.may_open(board, tmp_path) is True
    monkeypatch.setattr("os.access", lambda path, mode: False)
    assert permission.may_open(board, tmp_path) is False


def test_a_rule_is_found_where_it_counts(tmp_path: Path) -> None:
    folder = tmp_path / "rules.d"
    folder.mkdir()
    (folder / "70-palpate.rules").write_text(f"# {UDEV_RULE}\n")
    assert udev.rule_files([folder, tmp_path / "nowhere"]) == []
    (folder / "70-palpate.rules").write_text(f"{UDEV_RULE}\n")
    assert udev.rule_files([folder]) == [folder / "70-palpate.rules"]


def test_an_extra_that_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    def version(package: str) -> str:
        if package == "pyarrow":
            raise metadata.PackageNotFoundError
        return "1"

    monkeypatch.setattr(metadata, "version", version)
    found = {finding.what: finding for finding in diagnosis.extras()}
    assert (found["extra export"].state, found["extra export"].do) == ("free", "pip install 'palpate[export]'")
    assert found["extra usb"].state == "ok"
    assert not {"extra test", "extra docs"} & set(found)


def test_defaults_and_firmware_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "palpate.toml").write_text("[relay]\n")
    monkeypatch.setenv("PALPATE_FIRMWARE", str(tmp_path / "nowhere.hex"))
    replay = main.get_command(click.Context(main), "replay")
    assert replay is not None
    found = {finding.what: finding for finding in [*diagnosis.files({"replay": replay}), diagnosis._firmware()]}
    assert "got 'relay', allowed: tables [replay]" in found["defaults"].text
    assert found["defaults"].code == 2
    (tmp_path / "palpate.toml").write_text("[calibrate]\nplott = 1\n")
    result = run()
    assert result.exit_code == 2
    assert "!!  defaults: palpate.toml: [calibrate]: got 'plott', allowed: moduli, plot, " in result.stdout
    assert (found["firmware"].state, found["firmware"].code) == ("wrong", 4)
    hex_file = tmp_path / "some.hex"
    hex_file.write_text(":03000000020100FA\n:00000001FF\n")
    monkeypatch.setenv("PALPATE_FIRMWARE", str(hex_file))
    assert diagnosis._firmware().text == f"{hex_file}, 3 bytes"
    (tmp_path / "palpate.toml").write_text("[replay]\nscene = 'paper'\n")
    assert [finding.text for finding in diagnosis.files({"replay": replay})] == ["palpate.toml: [replay]"]


def test_a_look_that_fails_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail() -> None:
        raise RuntimeError("out of order")

    monkeypatch.setattr(diagnosis, "extras", fail)
    result = run()
    assert result.exit_code == 1
    assert "!!  extras: check failed: RuntimeError: out of order" in result.stdout
    assert "speed, HandoverRls" in result.stdout
