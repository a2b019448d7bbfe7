"""Search for connected devices; their names are those for `palpate.open`."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from palpate.errors import MissingExtra, SourceError, need
from palpate.messages import shortened
from palpate.sources.registry import entry_points, loaded, package_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

# Group of entry points that search for devices of a scheme: functions () -> list of `Found`, which open no device.
GROUP = "palpate.devices"

_STREAMS_S = 1.0


class Found(NamedTuple):
    """A device that was found: its name for `palpate.open`, and a description."""

    uri: str
    what: str


def devices() -> tuple[list[Found], list[str]]:
    """Return the connected devices, without opening one.

    Returns
    -------
    list of Found, list of str
        The devices, and messages about searches that were not possible.

    Examples
    --------
    >>> found, notes = devices()
    >>> all(":" in device.uri for device in found)
    True
    """
    return look_for(boards, chips, _i2c, _ports, *of_packages())


def look_for(*searches: Callable[[], list[Found]]) -> tuple[list[Found], list[str]]:
    """Return what some of the searches of this module find, in the same form as `devices`."""
    found = []
    notes = []
    for search in searches:
        try:
            found += search()
        except (SourceError, MissingExtra) as error:
            notes.append(str(error))
    return found, notes


def boards() -> list[Found]:
    """Return the evaluation kits."""
    from palpate.ad7746.evalkit.discovery import list_boards

    return [Found(f"usb:{board}", "AD7746 evaluation kit") for board in list_boards()]


def chips() -> list[Found]:
    """Return the chips with the kernel's driver."""
    from palpate.sources import iio

    return [Found(f"iio:{path}", "AD7746 by the kernel's driver") for path in iio.devices()]


def _i2c() -> list[Found]:
    buses = sorted(Path("/dev").glob("i2c-*"))
    return [Found(f"i2c:{path}", "I2C bus; an AD7746 may be on it") for path in buses]


def _ports() -> list[Found]:
    ports = [
        port
        for port in need("serial.tools.list_ports", "serial").comports()
        if port.vid is not None
    ]
    return [
        Found(f"serial:{port.device}", port.description or "serial port") for port in sorted(ports)
    ]


def streams() -> list[Found]:
    """Return the streams of numbers of Lab Streaming Layer; takes 1 s or more."""
    from palpate.sources.lsl import NUMBERS, search, told

    found = [info for info in search({}, _STREAMS_S) if info.channel_format() in NUMBERS]
    return [
        Found(f"lsl:{shortened(info.name())}", f"{told(info)}, {info.channel_count()} channels")
        for info in found
    ]


def of_packages() -> list[Callable[[], list[Found]]]:
    """Return the searches of other packages."""
    return [partial(_of_package, point) for point in entry_points(group=GROUP)]


def _of_package(point: "EntryPoint") -> list[Found]:
    search = loaded(point)
    try:
        return [Found(*device) for device in search()]
    except Exception as error:
        text = f"{type(error).__name__}: {error!s:.200}"
        raise SourceError(
            f"{point.name}: the search of {package_of(point)} failed: {text}"
        ) from error
