"""The steps of `palpate doctor --install-udev`."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator

from palpate.ad7746.evalkit import udev
from palpate.cli.diagnosis import INSTALL_UDEV, Finding
from palpate.cli.exit import BAD_DATA, NO_DEVICE, USAGE, said_of

_ELSEWHERE = {
    "darwin": "macOS needs no rule",
    "win32": "on Windows the board needs the driver WinUSB, by Zadig (https://zadig.akeo.ie)",
}


def steps(*, as_json: bool) -> Iterator[Finding]:
    """Write the rule, apply it, and say what else is needed; as a user without rights, through sudo."""
    if sys.platform != "linux":
        text = f"this system is {sys.platform}: udev is part of Linux"
        yield Finding("udev rule", "wrong", text, _ELSEWHERE.get(sys.platform, ""), USAGE)
        return
    try:
        yield Finding("udev rule", "ok", udev.install())
    except OSError as error:
        if isinstance(error, PermissionError) and os.geteuid():
            yield from _through_sudo(as_json=as_json)
        else:
            yield Finding("udev rule", "wrong", said_of(error), "", BAD_DATA)
        return
    yield from _applied()
    yield _group()


def _through_sudo(*, as_json: bool) -> Iterator[Finding]:
    # -P: with -m, Python would take modules of the current folder, as root.
    command = ["sudo", sys.executable, "-P", "-m", *INSTALL_UDEV.split()]
    if as_json or not sys.stdin.isatty() or not shutil.which("sudo"):
        yield Finding("udev rule", "wrong", "only root may write it: type", " ".join(command), NO_DEVICE)
        return
    yield Finding("udev rule", "free", "only root may write it:", " ".join(command))
    if code := subprocess.call(command):
        yield Finding("sudo", "wrong", f"ended with exit code {code}", "", code)


def _applied() -> Iterator[Finding]:
    if sys.platform == "win32" or os.geteuid():
        return
    if trouble := udev.reload():
        yield Finding("udev", "free", trouble, "unplug the board for a moment; if that does not help, restart")
    else:
        yield Finding("udev", "ok", "has read its rules again; a connected board has the new permissions")


def _group() -> Finding:
    screen = "the user at the screen can open the board"
    if join := udev.missing_group():
        return Finding(
            "users", "free", f"{screen}; over ssh, or without a screen, type:", f"{join}  # then log in again"
        )
    return Finding("users", "ok", f"{screen}, and so can the group {udev.GROUP}")
