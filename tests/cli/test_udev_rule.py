"""`palpate doctor --install-udev`: writes its own rule only, and says what else is needed."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner, Result
from palpate.ad7746.evalkit import udev
from palpate.ad7746.evalkit.udev import UDEV_RULE
from palpate.cli import main, udev_rule

OLDER = 'SUBSYSTEM=="usb", ATTR{idVendor}=="0456", ATTR{idProduct}=="b481", MODE="0666"'

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="udev is Linux's")


def install(*arguments: str) -> Result:
    return CliRunner().invoke(main, ["doctor", "--install-udev", *arguments])


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the rule file of a system where root has called the command."""
    (tmp_path / "udev").mkdir()
    monkeypatch.setattr(udev, "RULES", (tmp_path / "udev" / "rules.d",))
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(udev, "reload", lambda: "")
    monkeypatch.setattr(udev, "missing_group", lambda: "sudo usermod -aG plugdev me")
    return tmp_path / "udev" / "rules.d" / "70-palpate.rules"


def rules(file: Path) -> list[str]:
    return [line for line in file.read_text().splitlines() if not line.startswith("#")]


def test_the_rule_is_for_the_user_at_the_screen_and_a_group_and_comes_in_time() -> None:
    assert 'MODE="0660", GROUP="plugdev", TAG+="uaccess"' in UDEV_RULE
    assert udev.RULE_FILE < udev._SEATS


def test_the_rule_is_written_once(file: Path) -> None:
    result = install()
    assert result.exit_code == 0, result.output
    assert f"ok  udev rule: wrote {file}" in result.stdout
    assert "ok  udev: has read its rules again" in result.stdout
    assert "--  users: the user at the screen can open the board; over ssh" in result.stdout
    assert "      sudo usermod -aG plugdev me" in result.stdout
    assert rules(file) == [UDEV_RULE]
    assert file.stat().st_mode & 0o777 == 0o644
    before = file.stat().st_mtime_ns
    document = json.loads(install("--json").stdout)
    assert document["wrong"] == 0
    assert document["findings"][0]["text"] == f"{file} is there already"
    assert file.stat().st_mtime_ns == before
    assert (udev.rule_files(), udev.flaw(file)) == ([file], "")


@pytest.mark.parametrize(
    ("before", "said"), [(f"{OLDER}\n", "an older rule"), (f"# mine\n{OLDER}\n", "an older rule"), ("# none\n", "none")]
)
def test_its_own_older_rule_is_replaced(file: Path, before: str, said: str) -> None:
    file.parent.mkdir()
    file.write_text(before)
    result = install()
    assert result.exit_code == 0
    assert f"replaced {file}, which had {said}" in result.stdout
    assert rules(file) == [UDEV_RULE]


@pytest.mark.parametrize("before", ['ATTR{idVendor}=="0456", MODE="0600"\n', f'{UDEV_RULE}\n{OLDER}, RUN+="/bin/x"\n'])
def test_the_rules_of_others_stay(file: Path, before: str) -> None:
    file.parent.mkdir()
    file.write_text(before)
    result = install()
    assert result.exit_code == 4
    assert "has rules of someone else, stays as it is; move it away, or put in: " in result.stdout
    assert file.read_text() == before
    file.unlink()
    file.mkdir()
    assert install().exit_code == 4
    assert file.is_dir()


def test_without_udev_nothing_is_written(file: Path) -> None:
    file.parent.parent.rmdir()
    result = install()
    assert result.exit_code == 4
    assert "of a container: type it on the host" in result.stdout


def test_a_user_is_sent_to_sudo(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(folder: object = None) -> str:
        raise PermissionError(13, "Permission denied", str(file))

    called: list[list[str]] = []
    command = f"sudo {sys.executable} -P -m palpate doctor --install-udev"
    monkeypatch.setattr(udev, "install", refuse)
    assert install().exit_code == 4  # root itself is refused: sudo would not help
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    result = install()  # its input is no terminal
    assert result.exit_code == 3
    assert f"      {command}\n" in result.stdout
    monkeypatch.setattr(udev_rule, "sys", SimpleNamespace(platform="linux", executable=sys.executable, stdin=SimpleNamespace(isatty=lambda: True)))  # fmt: skip
    monkeypatch.setattr(shutil, "which", lambda name: f"/usr/bin/{name}")
    for code in (0, 1):

        def call(words: list[str], code: int = code) -> int:
            called.append(words)
            return code

        monkeypatch.setattr(subprocess, "call", call)
        result = install()
        assert result.exit_code == code
        assert called.pop() == command.split()


@pytest.mark.parametrize(("system", "hint"), [("win32", "WinUSB, by Zadig"), ("darwin", "macOS needs no rule")])
def test_other_systems(system: str, hint: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(udev_rule, "sys", SimpleNamespace(platform=system))
    result = install()
    assert result.exit_code == 2
    assert hint in result.stdout


def fake(folder: Path, text: str) -> Callable[..., str]:
    """Return a `which` that finds a program of these lines."""
    program = folder / "udevadm"
    program.write_text(f"#!/bin/sh\n{text}\n")
    program.chmod(0o755)
    return lambda name, path=None: str(program)


def test_udev_is_asked_to_read_and_apply_the_rules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", fake(tmp_path, f"echo $@ >> {tmp_path}/calls"))
    assert udev.reload() == ""
    reload, trigger = (tmp_path / "calls").read_text().splitlines()
    assert reload == "control --reload"
    assert trigger.split()[0] == "trigger"
    assert {"--action=change", "--attr-match=idVendor=0456"} <= set(trigger.split())
    monkeypatch.setattr(shutil, "which", fake(tmp_path, "echo Running in chroot >&2; exit 1"))
    assert udev.reload() == "udevadm control: Running in chroot"
    monkeypatch.setattr(udev, "_WAIT_S", 0.05)
    monkeypatch.setattr(shutil, "which", fake(tmp_path, "exec sleep 30"))
    assert udev.reload() == "udevadm control: no end within 0.05 s"
    monkeypatch.setattr(shutil, "which", lambda name, path=None: None)
    assert udev.reload() == "udevadm is not installed"


def test_what_udev_did_not_do_is_said(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(udev, "reload", lambda: "udevadm is not installed")
    monkeypatch.setattr(udev, "missing_group", lambda: "")
    result = install()
    assert result.exit_code == 0
    assert "--  udev: udevadm is not installed\n      unplug the board for a moment" in result.stdout
    assert "ok  users: the user at the screen can open the board, and so can the group plugdev" in result.stdout


def test_who_is_in_the_group(monkeypatch: pytest.MonkeyPatch) -> None:
    import grp
    import pwd

    def nobody(name: object) -> None:
        raise KeyError(name)

    monkeypatch.setenv("SUDO_USER", "me")
    monkeypatch.setattr(pwd, "getpwnam", lambda name: SimpleNamespace(pw_gid=1000))
    monkeypatch.setattr(grp, "getgrnam", lambda name: SimpleNamespace(gr_gid=46))
    monkeypatch.setattr(os, "getgrouplist", lambda user, group: [group, 46])
    assert udev.missing_group() == ""
    monkeypatch.setattr(os, "getgrouplist", lambda user, group: [group])
    assert udev.missing_group() == "sudo usermod -aG plugdev me"
    monkeypatch.setattr(pwd, "getpwnam", nobody)
    assert udev.missing_group() == "sudo usermod -aG plugdev me"
    monkeypatch.setattr(grp, "getgrnam", nobody)
    assert udev.missing_group() == "sudo groupadd --system plugdev && sudo usermod -aG plugdev me"
    monkeypatch.delenv("SUDO_USER")
    monkeypatch.setattr(os, "getuid", lambda: 1234)
    monkeypatch.setattr(pwd, "getpwuid", nobody)
    assert udev.missing_group().endswith("usermod -aG plugdev 1234")
    monkeypatch.setenv("SUDO_USER", "root")
    assert udev.missing_group() == ""


def test_it_needs_no_pyusb(file: Path) -> None:
    """The root's Python may have none; and it imports elsewhere, too."""
    code = "import sys; sys.modules['usb'] = None; import palpate.ad7746.evalkit.udev, palpate.cli.udev_rule"
    subprocess.run([sys.executable, "-c", code], check=True)
