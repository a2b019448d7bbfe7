"""`palpate devices` and `palpate doctor`: what is connected, and for each line that is not ok what to type."""

import os
import shutil
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import click
import pytest
from command_lines import document, run
from palpate.ad7746.bus import VirtualClock
from palpate.ad7746.evalkit import discovery, udev, usb_bus
from palpate.ad7746.evalkit.udev import UDEV_RULE
from palpate.ad7746.simulator.chip import SimulatedChip
from palpate.ad7746.simulator.evalboard import SimulatedBoard
from palpate.ad7746.simulator.usb_backend import SimulatedUsb
from palpate.cli import doctor
from palpate.errors import DeviceNotFound
from palpate.sources import devices

OLDER = 'SUBSYSTEM=="usb", ATTR{idVendor}=="0456", ATTR{idProduct}=="b481", MODE="0666"'
linux = pytest.mark.skipif(sys.platform != "linux", reason="udev is Linux's")


@pytest.fixture(autouse=True)
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No file, no variable and no rule of this machine's."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PALPATE_FIRMWARE", raising=False)
    monkeypatch.setattr(udev, "RULES", (tmp_path / "rules.d",))
    monkeypatch.setattr(click, "get_app_dir", lambda name: str(tmp_path / name))


def plug(
    monkeypatch: pytest.MonkeyPatch, *, loaded: bool = True, allowed: bool | None = None
) -> SimulatedBoard:
    """Have a simulated board, usb:1/2."""
    clock = VirtualClock()
    backend = SimulatedUsb(clock)
    kit = SimulatedBoard(SimulatedChip(lambda pin, begin_s, end_s: 1.0), clock, loaded=loaded)
    backend.plug(kit, 2)
    monkeypatch.setattr(discovery, "system_backend", lambda: backend)
    monkeypatch.setattr(discovery, "may_open", lambda board: allowed)
    monkeypatch.setattr(usb_bus, "RealClock", lambda: clock)
    return kit


def test_devices_and_searches_that_are_not_possible(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused() -> list[devices.ListedDevice]:
        raise DeviceNotFound("no permission to look")

    found = [devices.ListedDevice("usb:1/2", "AD7746 evaluation kit")]
    for name, look in (
        ("boards", lambda: found),
        ("chips", refused),
        ("_i2c", list),
        ("_ports", list),
    ):
        monkeypatch.setattr(devices, name, look)
    result = run("devices")
    assert (result.exit_code, result.stdout) == (0, "usb:1/2  AD7746 evaluation kit\n")
    assert result.stderr == "not searched: no permission to look\n"
    monkeypatch.setattr(devices, "boards", list)
    result = run("devices")
    assert (result.exit_code, result.stdout, "sim:four-specimens" in result.stderr) == (3, "", True)


def test_nothing_is_wrong_here() -> None:
    result = run("doctor")
    assert result.exit_code == 0, result.stdout
    assert {line[:2] for line in result.stdout.splitlines()} <= {"ok", "--", "  "}
    found = document("doctor")
    assert found["wrong"] == 0
    assert {"palpate", "extra usb", "firmware"} <= {
        finding["what"] for finding in found["findings"]
    }


BOARDS = [
    ("", {"allowed": True}, 0, "ok  board usb:1/2: can be opened, firmware is running, the AD7746 answers"),
    ("", {"absent": True}, 4, "the AD7746 has never answered; check the jumpers SDA, SCL and RDY of link LK2"),
    ("", {"loaded": False}, 3, "!!  board usb:1/2: the board at 1/2 has no firmware"),
    ("", {"allowed": False}, 3, "!!  permission: no udev rule for the board: only root can open it\n      palpate doctor --install-udev"),
    (f"70-palpate.rules: {UDEV_RULE}", {"allowed": False}, 3, "70-palpate.rules gives this user no access"),
]  # fmt: skip
"""A rule file, what is wrong with the board, exit code and output."""


@pytest.mark.parametrize(("rule", "state", "code", "message"), BOARDS)
def test_a_board_and_its_rule(
    rule: str,
    state: dict[str, bool],
    code: int,
    message: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if rule:
        (tmp_path / "rules.d").mkdir()
        name, _, text = rule.partition(": ")
        (tmp_path / "rules.d" / name).write_text(f"{text}\n")
    kit = plug(monkeypatch, loaded=state.get("loaded", True), allowed=state.get("allowed"))
    kit.chip.present = not state.get("absent", False)
    result = run("doctor")
    assert (result.exit_code, message in result.stdout) == (code, True), result.stdout


def test_an_extra_that_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    def version(package: str) -> str:
        if package == "pylsl":
            raise metadata.PackageNotFoundError
        return "1"

    monkeypatch.setattr(metadata, "version", version)
    found = {finding.subject: finding for finding in doctor.check_extras()}
    assert (found["extra lsl"].state, found["extra lsl"].remedy) == (
        "free",
        "pip install 'palpate[lsl]'",
    )
    assert found["extra usb"].state == "ok"
    assert not {"extra test", "extra docs"} & set(found)


def test_a_check_that_fails_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "check_extras", lambda: 1 / 0)
    result = run("doctor")
    assert (result.exit_code, "libusb" in result.stdout) == (1, True)
    assert "!!  extras: check failed: ZeroDivisionError: " in result.stdout


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the rule file of a system where root has called the command."""
    (tmp_path / "udev").mkdir()
    monkeypatch.setattr(udev, "RULES", (tmp_path / "udev" / "rules.d",))
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(udev, "reload", lambda: "")
    return tmp_path / "udev" / "rules.d" / "70-palpate.rules"


@linux
def test_the_rule_is_written_once(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert 'MODE="0660", GROUP="plugdev", TAG+="uaccess"' in UDEV_RULE
    result = run("doctor", "--install-udev")
    assert result.exit_code == 0, result.output
    begins = [
        "ok  udev rule: wrote ",
        "ok  udev: has read its rules",
        "--  users: the user at the screen",
        "      sudo gr",
    ]
    assert all(map(str.startswith, result.stdout.splitlines(), begins))
    assert len(result.stdout.splitlines()) == 4
    assert (udev.rule_files(), file.stat().st_mode & 0o777) == ([file], 0o644)
    monkeypatch.setattr(udev, "reload", lambda: "udevadm is not installed")
    again = run("doctor", "--install-udev").stdout
    assert f"{file} is there already" in again
    assert "--  udev: udevadm is not installed\n      unplug the board for a moment" in again
    assert (
        "      sudo groupadd --system --force plugdev && sudo usermod -aG plugdev $USER  # then log in again"
        in again
    )


@linux
def test_a_file_with_other_rules_stays(file: Path) -> None:
    file.parent.mkdir()
    whole = f"{UDEV_RULE}\n{OLDER}\n"
    for before, code, message in (
        ("# none\n", 0, "ok  udev rule: wrote "),
        (whole, 4, "has other rules, stays as it is"),
    ):
        file.write_text(before)
        result = run("doctor", "--install-udev")
        assert (result.exit_code, message in result.stdout) == (code, True), result.stdout
    assert file.read_text() == whole


@linux
def test_a_user_is_sent_to_sudo(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(folder: object = None) -> str:
        raise PermissionError(13, "Permission denied", str(file))

    monkeypatch.setattr(udev, "install", refuse)
    # root itself is refused: sudo would not help
    assert run("doctor", "--install-udev").exit_code == 4
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    result = run("doctor", "--install-udev")
    command = f"      sudo {sys.executable} -P -m palpate doctor --install-udev\n"
    assert (result.exit_code, command in result.stdout) == (3, True)


@linux
def test_another_system_has_no_udev(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    [finding] = doctor.install_udev_rule()
    assert (finding.code, "WinUSB, by Zadig" in finding.text) == (2, True)


@linux
def test_udev_reads_and_applies_the_rules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "udevadm"
    monkeypatch.setattr(
        shutil, "which", lambda name, path=None: str(program) if program.exists() else None
    )
    assert udev.reload().endswith("udevadm is not installed")
    program.write_text("#!/bin/sh\necho Running in chroot >&2; exit 1\n")
    program.chmod(0o755)
    assert udev.reload().endswith("udevadm control: Running in chroot")
    program.write_text("#!/bin/sh\necho $@ >> calls\n")
    assert udev.reload() == ""
    reload, trigger = (tmp_path / "calls").read_text().splitlines()
    assert reload == "control --reload"
    assert {"trigger", "--action=change", "--attr-match=idVendor=0456"} <= set(trigger.split())


def test_permission_is_that_of_the_device_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = tmp_path / "001" / "002"
    assert discovery.may_open(discovery.Board(1, 2, ()), tmp_path) is None
    node.parent.mkdir()
    node.touch()
    for allowed in (True, False):
        monkeypatch.setattr("os.access", lambda path, mode, allowed=allowed: allowed)
        assert discovery.may_open(discovery.Board(1, 2, ()), tmp_path) is allowed


def test_the_rule_is_written_without_pyusb() -> None:
    """The root's Python may have none."""
    code = "import sys; sys.modules['usb'] = None; import palpate.ad7746.evalkit.udev, palpate.cli.doctor"
    subprocess.run([sys.executable, "-c", code], check=True)
