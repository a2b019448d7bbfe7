"""The checks of `palpate doctor`, one function each."""

import os
import platform
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from functools import partial
from importlib import metadata
from pathlib import Path
from typing import Any, NamedTuple

import click

from palpate import MissingExtra, PalpateError, __version__
from palpate.cli import config
from palpate.cli.exit import BAD_DATA, MISSING_EXTRA, NO_DEVICE, UNEXPECTED, USAGE, code_of, said_of

INSTALL_UDEV = "palpate doctor --install-udev"


class Finding(NamedTuple):
    """One line of the output of `palpate doctor`.

    Attributes
    ----------
    what, text : str
    state : str
        "ok"; "free": missing, but optional; "wrong".
    do : str
        What to type or to do; empty: nothing.
    code : int
        The exit code, if the state is "wrong".
    """

    what: str
    state: str
    text: str
    do: str = ""
    code: int = 0


def installation() -> Iterator[Finding]:
    """Check palpate and the packages that it always needs."""
    system = f"Python {platform.python_version()}, {platform.system()} {platform.machine()}"
    installed = metadata.version("palpate")
    if installed == __version__:
        yield Finding("palpate", "ok", f"{__version__}, {system}, {Path(__file__).parents[1]}")
    else:
        text = f"the compiled core is {__version__}, the package {installed}"
        yield Finding("palpate", "wrong", text, "pip install --force-reinstall palpate", UNEXPECTED)
    yield Finding("numpy, click", "ok", f"{metadata.version('numpy')}, {metadata.version('click')}")


def extras() -> Iterator[Finding]:
    """Check which extras are installed."""
    for extra, packages in _extras().items():
        found = {package: _version(package) for package in packages}
        missing = [package for package, version in found.items() if version is None]
        if missing:
            text = f"not installed: {', '.join(missing)}"
            yield Finding(f"extra {extra}", "free", text, f"pip install 'palpate[{extra}]'")
        else:
            yield Finding(f"extra {extra}", "ok", ", ".join(f"{p} {version}" for p, version in found.items()))


_LEFT_OUT = {"test", "docs", "all"}  # for developers, or the sum of the others


def _extras() -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for requirement in metadata.requires("palpate") or []:
        match = re.match(r"([\w.-]++).*?extra == ['\"]([\w-]++)['\"]", requirement)
        if match and match[2] not in _LEFT_OUT:
            found.setdefault(match[2], []).append(match[1])
    return found


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def usb() -> Iterator[Finding]:
    """Check libusb, the board, the permission to open it, and its firmware."""
    try:
        from palpate.ad7746.evalkit import find

        backend = find.system_backend()
        boards = find.boards(backend)
    except MissingExtra as error:
        text, _, do = str(error).partition(": ")
        missing = _version("pyusb") is None
        yield Finding("libusb", "free" if missing else "wrong", text, do, 0 if missing else MISSING_EXTRA)
        return
    except PalpateError as error:
        yield Finding("libusb", "wrong", str(error), "", code_of(error))
        return
    yield Finding("libusb", "ok", str(getattr(getattr(backend, "lib", None), "_name", "found")))
    yield from _boards(boards, backend)


def _boards(boards: list[Any], backend: Any) -> Iterator[Finding]:
    from palpate.ad7746.evalkit.permission import may_open

    if not boards:
        yield Finding("board", "free", "no evaluation kit is connected", "palpate record sim:four-specimens -o run.csv")
    refused = [board for board in boards if may_open(board) is False]
    for board in boards:
        if board in refused:
            yield Finding(f"board usb:{board}", "wrong", "connected, but no permission to open it", code=NO_DEVICE)
        else:
            yield _open(board, backend)
    yield from _rules(needed=bool(refused), asked=len(refused) == len(boards))
    yield _firmware()


def _rules(*, needed: bool, asked: bool) -> Iterator[Finding]:
    """Check the udev rules: `needed`, a board cannot be opened; `asked`, none was opened, so rules tell more."""
    from palpate.ad7746.evalkit import udev

    files = udev.rule_files()
    for file in files:
        if flaw := udev.flaw(file):
            edit = f"take the board's mode and tag out of {file}, then:\n"
            do = INSTALL_UDEV if file.name == udev.RULE_FILE else edit + INSTALL_UDEV
            yield Finding("permission", "free", f"the udev rule in {file} {flaw}: replace it", do)
    named = ", ".join(map(str, files))
    if needed and files:
        text = f"the udev rule in {named} gives this user no access: unplug the board for a moment; over ssh, or without a "
        text += f"screen, the user has to be in the group {udev.GROUP}, and to log in again after joining it"
        yield Finding("permission", "wrong", text, udev.missing_group(), NO_DEVICE)
    elif files:
        yield Finding("permission", "ok", f"udev rule in {named}")
    elif needed or (asked and udev.rules_matter()):
        text = "no udev rule for the board: only root can open it"
        yield Finding("permission", "wrong" if needed else "free", text, INSTALL_UDEV, NO_DEVICE if needed else 0)
    elif asked and sys.platform == "linux":
        yield Finding("permission", "ok", "this user needs no udev rule; for other users:", INSTALL_UDEV)


def _open(board: Any, backend: Any) -> Finding:
    from palpate.ad7746.bus import Counters, repeated
    from palpate.ad7746.clock import RealClock
    from palpate.ad7746.evalkit.board import EvalKit

    what = f"board usb:{board}"
    try:
        with closing(EvalKit(board.bus, board.address, backend=backend)) as kit:
            repeated(lambda: kit.read(0, 1), Counters(), RealClock(), lambda: None)
    except PalpateError as error:
        return Finding(what, "wrong", str(error), "", code_of(error))
    return Finding(what, "ok", "can be opened, firmware is running, the AD7746 answers")


def _firmware() -> Finding:
    from palpate.ad7746.evalkit.firmware import read_hex

    path = os.environ.get("PALPATE_FIRMWARE")
    if not path:
        text = "PALPATE_FIRMWARE is not set; the kit needs the firmware file each time it is plugged in"
        return Finding("firmware", "free", text, "export PALPATE_FIRMWARE=.../Icv_usb.hex")
    try:
        size = sum(map(len, read_hex(Path(path)).values()))
    except PalpateError as error:
        return Finding("firmware", "wrong", str(error), "", code_of(error))
    return Finding("firmware", "ok", f"{path}, {size} bytes")


def others() -> Iterator[Finding]:
    """List the other connected devices."""
    from palpate.sources.devices import devices

    found = [device for device in devices()[0] if not device.uri.startswith("usb:")]
    text = ", ".join(device.uri for device in found)
    yield Finding("other devices", "ok" if found else "free", text or "none on i2c:, iio:, serial:")


def packages() -> Iterator[Finding]:
    """Check that the sources of other packages can be loaded, and that their searches for devices work."""
    from palpate.sources import GROUP
    from palpate.sources.devices import devices_of_packages
    from palpate.sources.uri import loaded, package_of

    for point in metadata.entry_points(group=GROUP):
        try:
            loaded(point)
        except MissingExtra as error:
            yield Finding(f"source {point.name}", "free", str(error))
        except PalpateError as error:
            yield Finding(f"source {point.name}", "wrong", str(error), "", UNEXPECTED)
        else:
            yield Finding(f"source {point.name}", "ok", f"of {package_of(point)}")
    for note in devices_of_packages()[1]:
        yield Finding("search of another package", "wrong", note, "", UNEXPECTED)


def files(commands: Mapping[str, click.Command]) -> Iterator[Finding]:
    """Check every table of each palpate.toml."""
    for path in filter(Path.is_file, config.places()):
        try:
            tables = config.read(path, commands)
            for name, table in tables.items():
                config.parameters(str(path), commands[name], table)
        except click.UsageError as error:
            yield Finding("defaults", "wrong", error.message, "", USAGE)
        except OSError as error:
            yield Finding("defaults", "wrong", said_of(error), "", BAD_DATA)
        else:
            yield Finding("defaults", "ok", f"{path}: {', '.join(f'[{name}]' for name in tables) or 'empty'}")


def speed() -> Iterator[Finding]:
    """Check the result of the estimators, then measure their speed."""
    import numpy as np

    from palpate import AdaptiveRls, HandoverRls
    from palpate.benchmark import nanoseconds

    regressor = 0.1 + 0.01 * np.sin(np.arange(20_000) / 7)
    noisy = 3.0 * regressor + np.random.default_rng(0).normal(0, 4e-5, len(regressor))  # as a converter's
    for made in (AdaptiveRls, HandoverRls):
        ratio = made().process(3.0 * regressor, regressor)[-1]
        run = partial(made().process, noisy, regressor)
        name = f"speed, {made.__name__}"
        if abs(ratio - 3.0) > 1e-6:
            do = "pip install --force-reinstall --no-binary palpate palpate"
            yield Finding(name, "wrong", f"self-test failed: ratio 3 is estimated as {ratio}", do, UNEXPECTED)
        else:
            yield Finding(name, "ok", f"{nanoseconds(run, len(regressor)):.1f} ns an update")


def all_of(commands: Mapping[str, click.Command]) -> Iterator[Finding]:
    """Run all checks; a check that raises an error is a finding, too."""
    checks: list[tuple[str, Callable[[], Iterator[Finding]]]] = [
        ("installation", installation),
        ("extras", extras),
        ("defaults", lambda: files(commands)),
        ("USB", usb),
        ("other devices", others),
        ("other packages", packages),
        ("speed", speed),
    ]
    for what, check in checks:
        try:
            yield from check()
        except Exception as error:  # noqa: BLE001 (the other checks shall still run)
            text = f"check failed: {type(error).__name__}: {error}"
            yield Finding(what, "wrong", text, f"{sys.executable} -m palpate --debug doctor", UNEXPECTED)
