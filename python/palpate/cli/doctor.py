"""`palpate devices` and `palpate doctor`: what is connected, and what is wrong."""

import os
import platform
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import click

from palpate import PalpateError, __version__
from palpate.ad7746.evalkit import udev
from palpate.cli.exit_codes import ExitCode, error_exit_code, error_text
from palpate.cli.output import format_table, is_json, json_option, print_notes, print_result
from palpate.errors import MissingExtra

INSTALL_UDEV = "palpate doctor --install-udev"
_MARKS = {"ok": "ok", "free": "--", "wrong": "!!"}
_FOR_DEVELOPERS = {"test", "docs", "all"}  # extras; the last is the sum of all


@click.command("devices")
@click.option("--lsl", is_flag=True,
              help="List the streams of Lab Streaming Layer in the network, too; takes some seconds.")  # fmt: skip
@json_option
def devices_command(lsl: bool) -> None:
    """List the connected devices.

    Prints the names for `palpate record`. No device is opened. Exit code 3: no device found. `sim:` needs no device.

    \b
    Example:
      palpate devices
    """  # noqa: D301
    from palpate.sources.devices import devices as look
    from palpate.sources.devices import look_for, streams

    found, notes = look()
    if lsl:
        more, why = look_for(streams)
        found, notes = [*found, *more], [*notes, *why]
    document = {"devices": [device._asdict() for device in found], "notes": notes}
    print_result(document, format_table(found, "<"))
    print_notes("not searched", notes)
    if not found:
        click.echo("no device found; use a simulated board: sim:four-specimens", err=True)
        sys.exit(ExitCode.NO_DEVICE)


@click.command("doctor")
@click.option("--install-udev", is_flag=True,
              help="Linux: write the udev rule that lets users open the board; asks sudo.")  # fmt: skip
@json_option
def doctor_command(install_udev: bool) -> None:
    """Check installation, board and permissions, and print what to type.

    A board is opened for a moment. "ok": nothing to do; "--": optional, or could be better; "!!": wrong. Exit codes: 0,
    nothing is wrong (a missing board is not wrong); else the code of the first wrong line: 1, damaged installation; 2,
    error in a palpate.toml; 3, no permission to open the board or to write the rule; 4, the AD7746 does not answer, or
    the rule cannot be written; 6, no libusb for pyusb.

    \b
    Example:
      palpate doctor
      palpate doctor --install-udev
    """  # noqa: D301
    findings = []
    for finding in udev_steps() if install_udev else diagnosis():
        findings.append(finding)
        if not is_json():
            indented = [f"      {line}" for line in finding.do.splitlines()]
            click.echo(
                "\n".join([f"{_MARKS[finding.state]}  {finding.what}: {finding.text}", *indented])
            )
    codes = [finding.code for finding in findings if finding.code]
    plain = [{"what": f.what, "state": f.state, "text": f.text, "do": f.do} for f in findings]
    print_result({"palpate": __version__, "wrong": len(codes), "findings": plain}, "")
    sys.exit(next(iter(codes), 0))


class Finding(NamedTuple):
    """One line of the output of `palpate doctor`: what to do, its exit code (0: not wrong), whether it is optional."""

    what: str
    text: str
    do: str = ""
    code: int = 0
    free: bool = False

    @property
    def state(self) -> str:
        """The state in the document: "wrong", "free" or "ok"."""
        return "wrong" if self.code else "free" if self.free else "ok"


def diagnosis() -> Iterator[Finding]:
    """Run all checks."""
    yield from checked("installation", _installation)
    yield from checked("extras", extras)
    yield from checked("libusb", _usb)
    yield from checked("other packages", packages)


def checked(what: str, check: Callable[[], Iterator[Finding]]) -> Iterator[Finding]:
    """Run a check; an error that it raises is a finding, too."""
    try:
        yield from check()
    except (PalpateError, OSError) as error:
        yield Finding(what, error_text(error), code=error_exit_code(error))
    except Exception as error:  # noqa: BLE001 (the other checks shall still run)
        again = f"{sys.executable} -m palpate --debug doctor"
        yield Finding(
            what, f"check failed: {type(error).__name__}: {error}", again, ExitCode.UNEXPECTED
        )


def _installation() -> Iterator[Finding]:
    system = f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    installed = metadata.version("palpate")
    if installed == __version__:
        libraries = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "click"))
        yield Finding(
            "palpate", f"{__version__}, {system}, {libraries}, {Path(__file__).parents[1]}"
        )
    else:
        text = f"the compiled core is {__version__}, the package {installed}"
        yield Finding("palpate", text, "pip install --force-reinstall palpate", ExitCode.UNEXPECTED)


def extras() -> Iterator[Finding]:
    """Check which extras are installed."""
    packages: dict[str, list[str]] = {}
    for requirement in metadata.requires("palpate") or []:
        match = re.match(r"([\w.-]++).*?extra == ['\"]([\w-]++)['\"]", requirement)
        if match and match[2] not in _FOR_DEVELOPERS:
            packages.setdefault(match[2], []).append(match[1])
    for extra, names in packages.items():
        versions = {name: _version(name) for name in names}
        if missing := ", ".join(name for name, version in versions.items() if not version):
            yield Finding(
                f"extra {extra}",
                f"not installed: {missing}",
                f"pip install 'palpate[{extra}]'",
                free=True,
            )
        else:
            yield Finding(
                f"extra {extra}",
                ", ".join(f"{name} {version}" for name, version in versions.items()),
            )


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def _usb() -> Iterator[Finding]:
    """Check libusb, the boards, the permission to open them, and their firmware."""
    try:
        from palpate.ad7746.evalkit import discovery

        backend = discovery.system_backend()
    except MissingExtra as error:
        text, _, do = str(error).partition(": ")
        free = not _version("pyusb")
        yield Finding("libusb", text, do, 0 if free else ExitCode.MISSING_EXTRA, free)
        return
    boards = discovery.boards(backend)
    yield Finding("libusb", str(getattr(getattr(backend, "lib", None), "_name", "found")))
    if not boards:
        yield Finding(
            "board", "none is connected", "palpate record sim:four-specimens -o run.csv", free=True
        )
    refused = [board for board in boards if discovery.may_open(board) is False]
    for board in boards:
        if board in refused:
            yield Finding(
                f"board usb:{board}",
                "connected, but no permission to open it",
                code=ExitCode.NO_DEVICE,
            )
        else:
            yield from checked(f"board usb:{board}", partial(_board, board, backend))
    yield from _rules(needed=bool(refused), wanted=not boards and udev.rules_matter())
    yield from checked("firmware", firmware)


def _board(board: Any, backend: Any) -> Iterator[Finding]:
    from palpate.ad7746.bus import Access, RealClock
    from palpate.ad7746.evalkit.usb_bus import EvalKit

    with closing(EvalKit(board.bus, board.address, backend=backend)) as kit:
        Access(kit, RealClock()).read(0, 1)
    yield Finding(f"board usb:{board}", "can be opened, firmware is running, the AD7746 answers")


def _rules(*, needed: bool, wanted: bool) -> Iterator[Finding]:
    """Check the udev rules: `needed`, a board cannot be opened; `wanted`, a board that is plugged in will need one."""
    files = udev.rule_files()
    named = ", ".join(map(str, files))
    if needed and files:
        text = f"the udev rule in {named} gives this user no access: unplug the board for a moment; over ssh, or without a "
        text += f"screen, the user has to be in the group {udev.GROUP}, and to log in again after joining it"
        yield Finding("permission", text, udev.JOIN_GROUP, ExitCode.NO_DEVICE)
    elif files:
        yield Finding("permission", f"udev rule in {named}")
    elif needed or wanted:
        text = "no udev rule for the board: only root can open it"
        yield Finding(
            "permission", text, INSTALL_UDEV, ExitCode.NO_DEVICE if needed else 0, free=True
        )


def firmware() -> Iterator[Finding]:
    """Check the firmware file that the environment names."""
    from palpate.ad7746.evalkit.usb_bus import read_hex

    if path := os.environ.get("PALPATE_FIRMWARE"):
        yield Finding("firmware", f"{path}, {sum(map(len, read_hex(Path(path)).values()))} bytes")
    else:
        text = "PALPATE_FIRMWARE is not set; the kit needs the firmware file each time it is plugged in"
        yield Finding("firmware", text, "export PALPATE_FIRMWARE=.../Icv_usb.hex", free=True)


def packages() -> Iterator[Finding]:
    """Check that the sources of other packages can be loaded, and that their searches for devices work."""
    from palpate.sources import GROUP
    from palpate.sources.devices import look_for, of_packages
    from palpate.sources.registry import loaded, package_of

    for point in metadata.entry_points(group=GROUP):
        try:
            loaded(point)
        except PalpateError as error:
            free = isinstance(error, MissingExtra)
            yield Finding(
                f"source {point.name}",
                str(error),
                code=0 if free else ExitCode.UNEXPECTED,
                free=free,
            )
        else:
            yield Finding(f"source {point.name}", f"of {package_of(point)}")
    for note in look_for(*of_packages())[1]:
        yield Finding("search of another package", note, code=ExitCode.UNEXPECTED)


def udev_steps() -> Iterator[Finding]:
    """Write the rule, apply it, and say what else is needed; as a user without rights, through sudo."""
    if sys.platform != "linux":
        text = f"this system is {sys.platform}, udev is part of Linux; macOS needs no rule, and on Windows the board "
        yield Finding(
            "udev rule",
            text + "needs the driver WinUSB, by Zadig (https://zadig.akeo.ie)",
            code=ExitCode.USAGE,
        )
        return
    try:
        yield Finding("udev rule", udev.install())
    except OSError as error:
        if isinstance(error, PermissionError) and os.geteuid():
            yield from _through_sudo()
        else:
            yield Finding("udev rule", error_text(error), code=ExitCode.BAD_DATA)
        return
    if trouble := "" if os.geteuid() else udev.reload():
        yield Finding(
            "udev",
            trouble,
            "unplug the board for a moment; if that does not help, restart",
            free=True,
        )
    else:
        yield Finding("udev", "has read its rules again; a connected board has the new permissions")
    text = f"the user at the screen can open the board; over ssh, or without a screen, the group {udev.GROUP} can: type"
    yield Finding("users", text, f"{udev.JOIN_GROUP}  # then log in again", free=True)


def _through_sudo() -> Iterator[Finding]:
    # -P: with -m, Python would take modules of the current folder, as root.
    command = ["sudo", sys.executable, "-P", "-m", *INSTALL_UDEV.split()]
    if is_json() or not sys.stdin.isatty() or not shutil.which("sudo"):
        yield Finding(
            "udev rule", "only root may write it: type", " ".join(command), ExitCode.NO_DEVICE
        )
        return
    yield Finding("udev rule", "only root may write it:", " ".join(command), free=True)
    if code := subprocess.call(command):
        yield Finding("sudo", f"ended with exit code {code}", code=code)
