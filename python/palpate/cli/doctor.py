"""`palpate devices` and `palpate doctor`: connected devices, and checks of the installation."""

import os
import platform
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any

import click

from palpate import PalpateError, __version__
from palpate.ad7746.evalkit import udev
from palpate.cli.exit_codes import ExitCode, error_exit_code, error_text
from palpate.cli.output import format_table, is_json, json_option, print_notes, print_result
from palpate.errors import MissingExtra

INSTALL_UDEV = "palpate doctor --install-udev"
_DEVELOPERS_EXTRAS = {"test", "docs", "all"}  # the last is the sum of all


@click.command("devices")
@click.option(
    "--lsl",
    is_flag=True,
    help="List the streams of Lab Streaming Layer in the network, too; takes some seconds.",
)
@json_option
def devices_command(lsl: bool) -> None:
    """List the connected devices.

    Prints the names for `palpate record`. No device is opened. Exit code 3: no device found. `sim:`
    needs no device.

    \b
    Example:
      palpate devices
    """  # noqa: D301
    from palpate.sources.devices import devices, search_by, streams

    connected, notes = devices()
    if lsl:
        lsl_streams, stream_notes = search_by(streams)
        connected = [*connected, *lsl_streams]
        notes = [*notes, *stream_notes]
    listed = [{"uri": device.uri, "what": device.description} for device in connected]
    document = {"devices": listed, "notes": notes}
    print_result(document, format_table(connected, "<"))
    print_notes("not searched", notes)
    if not connected:
        click.echo("no device found; use a simulated board: sim:four-specimens", err=True)
        sys.exit(ExitCode.NO_DEVICE)


@click.command("doctor")
@click.option(
    "--install-udev",
    is_flag=True,
    help="Linux: write the udev rule that lets users open the board; needs sudo.",
)
@json_option
def doctor_command(install_udev: bool) -> None:
    """Check installation, board and permissions, and print what to type.

    A board is opened for a moment. "ok": nothing to do; "--": optional, or could be better; "!!":
    wrong. Exit codes: 0, nothing is wrong (a missing board is not wrong); else the code of the
    first wrong line: 1, damaged installation; 2, error in a palpate.toml; 3, no permission to open
    the board or to write the rule; 4, the AD7746 does not answer, or the rule cannot be written; 6,
    no libusb for pyusb.

    \b
    Example:
      palpate doctor
      palpate doctor --install-udev
    """  # noqa: D301
    documents = []
    codes = []
    for finding in install_udev_rule() if install_udev else all_checks():
        documents.append(finding.to_json())
        if finding.code:
            codes.append(finding.code)
        if not is_json():
            click.echo(finding.text_lines())
    print_result({"palpate": __version__, "wrong": len(codes), "findings": documents}, "")
    sys.exit(codes[0] if codes else ExitCode.DONE)


class State(StrEnum):
    """The state of a finding in the JSON document."""

    OK = "ok"
    OPTIONAL = "free"
    WRONG = "wrong"


_MARKS = {State.OK: "ok", State.OPTIONAL: "--", State.WRONG: "!!"}


@dataclass(frozen=True)
class Finding:
    """The result of one check."""

    subject: str
    text: str
    remedy: str = ""
    """A command to type, or what else to do."""
    code: int = ExitCode.DONE
    is_optional: bool = False

    @property
    def state(self) -> State:
        """Whether it is wrong, could be better, or is in order."""
        if self.code:
            return State.WRONG
        return State.OPTIONAL if self.is_optional else State.OK

    def text_lines(self) -> str:
        """Return the finding as text."""
        lines = [f"{_MARKS[self.state]}  {self.subject}: {self.text}"]
        for line in self.remedy.splitlines():
            lines.append(f"      {line}")
        return "\n".join(lines)

    def to_json(self) -> dict[str, str]:
        """Return the finding for the JSON document."""
        return {
            "what": self.subject,
            "state": self.state,
            "text": self.text,
            "do": self.remedy,
        }


def all_checks() -> Iterator[Finding]:
    """Run all checks."""
    yield from run_check("installation", check_installation)
    yield from run_check("extras", check_extras)
    yield from run_check("libusb", check_usb)
    yield from run_check("other packages", check_packages)


def run_check(subject: str, check: Callable[[], Iterator[Finding]]) -> Iterator[Finding]:
    """Run a check; an error that it raises becomes a finding."""
    try:
        yield from check()
    except (PalpateError, OSError) as error:
        yield Finding(subject, error_text(error), code=error_exit_code(error))
    except Exception as error:  # noqa: BLE001 (the other checks shall still run)
        text = f"check failed: {type(error).__name__}: {error}"
        remedy = f"{sys.executable} -m palpate --debug doctor"
        yield Finding(subject, text, remedy, ExitCode.UNEXPECTED)


def check_installation() -> Iterator[Finding]:
    """Check that package and compiled core have the same version."""
    system = f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    installed = metadata.version("palpate")
    if installed == __version__:
        numpy = metadata.version("numpy")
        folder = Path(__file__).parents[1]
        click_version = metadata.version("click")
        versions = f"{__version__}, {system}, numpy {numpy}, click {click_version}, {folder}"
        yield Finding("palpate", versions)
    else:
        text = f"the compiled core is {__version__}, the package {installed}"
        remedy = "pip install --force-reinstall palpate"
        yield Finding("palpate", text, remedy, ExitCode.UNEXPECTED)


def check_extras() -> Iterator[Finding]:
    """Check which extras are installed."""
    packages: dict[str, list[str]] = {}
    for requirement in metadata.requires("palpate") or []:
        match = re.match(r"([\w.-]++).*?extra == ['\"]([\w-]++)['\"]", requirement)
        if match and match[2] not in _DEVELOPERS_EXTRAS:
            packages.setdefault(match[2], []).append(match[1])
    for extra, names in packages.items():
        installed = []
        missing = []
        for name in names:
            version = _installed_version(name)
            if version:
                installed.append(f"{name} {version}")
            else:
                missing.append(name)
        if missing:
            text = f"not installed: {', '.join(missing)}"
            remedy = f"pip install 'palpate[{extra}]'"
            yield Finding(f"extra {extra}", text, remedy, is_optional=True)
        else:
            yield Finding(f"extra {extra}", ", ".join(installed))


def _installed_version(package: str) -> str:
    """Return the version of a package, "" if it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def check_usb() -> Iterator[Finding]:
    """Check libusb, the boards, the permission to open them, and their firmware."""
    try:
        from palpate.ad7746.evalkit import discovery

        backend = discovery.system_backend()
    except MissingExtra as error:
        text, _, remedy = str(error).partition(": ")
        if _installed_version("pyusb"):
            yield Finding("libusb", text, remedy, ExitCode.MISSING_EXTRA)
        else:
            yield Finding("libusb", text, remedy, is_optional=True)
        return
    boards = discovery.list_boards(backend)
    library = getattr(backend, "lib", None)
    yield Finding("libusb", str(getattr(library, "_name", "found")))
    if not boards:
        remedy = "palpate record sim:four-specimens -o run.csv"
        yield Finding("board", "none is connected", remedy, is_optional=True)
    refused = [board for board in boards if discovery.may_open(board) is False]
    for board in boards:
        subject = f"board usb:{board}"
        if board in refused:
            text = "connected, but no permission to open it"
            yield Finding(subject, text, code=ExitCode.NO_DEVICE)
        else:
            yield from run_check(subject, partial(_check_board, board, backend))
    if refused:
        yield from _check_refused()
    else:
        yield from _check_rules(is_needed_later=not boards and udev.rules_matter())
    yield from run_check("firmware", check_firmware)


def _check_board(board: Any, backend: Any) -> Iterator[Finding]:
    """Open a board for a moment and read its status."""
    from palpate.ad7746.bus import Access, RealClock
    from palpate.ad7746.evalkit.usb_bus import EvalKit

    with closing(EvalKit(board.bus, board.address, backend=backend)) as kit:
        Access(kit, RealClock()).read(0, 1)
    text = "can be opened, firmware is running, the AD7746 answers"
    yield Finding(f"board usb:{board}", text)


def _check_refused() -> Iterator[Finding]:
    """Tell why a connected board cannot be opened."""
    files = udev.rule_files()
    if files:
        text = (
            f"the udev rule in {', '.join(map(str, files))} gives this user no access: unplug the "
            "board for a moment; over ssh, or without a screen, the user has to be in the group "
            f"{udev.GROUP}, and to log in again after joining it"
        )
        yield Finding("permission", text, udev.JOIN_GROUP, ExitCode.NO_DEVICE)
    else:
        yield Finding("permission", _NO_RULE, INSTALL_UDEV, ExitCode.NO_DEVICE)


_NO_RULE = "no udev rule for the board: only root can open it"


def _check_rules(*, is_needed_later: bool) -> Iterator[Finding]:
    """Check the udev rules while no board is refused."""
    files = udev.rule_files()
    if files:
        yield Finding("permission", f"udev rule in {', '.join(map(str, files))}")
    elif is_needed_later:
        yield Finding("permission", _NO_RULE, INSTALL_UDEV, is_optional=True)


def check_firmware() -> Iterator[Finding]:
    """Check the firmware file that the environment names."""
    from palpate.ad7746.evalkit.usb_bus import read_hex

    path = os.environ.get("PALPATE_FIRMWARE")
    if path:
        size = sum(len(block) for block in read_hex(Path(path)).values())
        yield Finding("firmware", f"{path}, {size} bytes")
    else:
        text = (
            "PALPATE_FIRMWARE is not set; the kit needs the firmware file each time it is plugged "
            "in"
        )
        remedy = "export PALPATE_FIRMWARE=.../Icv_usb.hex"
        yield Finding("firmware", text, remedy, is_optional=True)


def check_packages() -> Iterator[Finding]:
    """Check that other packages' sources can be loaded, and that their device searches work."""
    from palpate.sources import GROUP
    from palpate.sources.devices import of_packages, search_by
    from palpate.sources.registry import loaded, package_of

    for point in metadata.entry_points(group=GROUP):
        subject = f"source {point.name}"
        try:
            loaded(point)
        except MissingExtra as error:
            yield Finding(subject, str(error), is_optional=True)
        except PalpateError as error:
            yield Finding(subject, str(error), code=ExitCode.UNEXPECTED)
        else:
            yield Finding(subject, f"of {package_of(point)}")
    _, notes = search_by(*of_packages())
    for note in notes:
        yield Finding("search of another package", note, code=ExitCode.UNEXPECTED)


def install_udev_rule() -> Iterator[Finding]:
    """Write the rule and apply it; add further steps, as the command that a user has to type."""
    if sys.platform != "linux":
        text = (
            f"this system is {sys.platform}, udev is part of Linux; macOS needs no rule, and on "
            "Windows the board needs the driver WinUSB, by Zadig (https://zadig.akeo.ie)"
        )
        yield Finding("udev rule", text, code=ExitCode.USAGE)
        return
    try:
        yield Finding("udev rule", udev.install())
    except OSError as error:
        if isinstance(error, PermissionError) and os.geteuid():
            # -P: with -m, Python would take modules of the current folder, as root.
            remedy = f"sudo {sys.executable} -P -m {INSTALL_UDEV}"
            text = "only root may write it: type"
            yield Finding("udev rule", text, remedy, ExitCode.NO_DEVICE)
        else:
            yield Finding("udev rule", error_text(error), code=ExitCode.BAD_DATA)
        return
    trouble = "" if os.geteuid() else udev.reload()
    if trouble:
        remedy = "unplug the board for a moment; if that does not help, restart"
        yield Finding("udev", trouble, remedy, is_optional=True)
    else:
        text = "has read its rules again; a connected board has the new permissions"
        yield Finding("udev", text)
    text = (
        "the user at the screen can open the board; over ssh, or without a screen, the group "
        f"{udev.GROUP} can: type"
    )
    yield Finding("users", text, f"{udev.JOIN_GROUP}  # then log in again", is_optional=True)
