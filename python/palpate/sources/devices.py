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

# Group of entry points that search for devices of a scheme, and open none: functions of no
# arguments -> list of `ListedDevice`.
GROUP = "palpate.devices"

_STREAMS_S = 1.0


class ListedDevice(NamedTuple):
    """A connected device: its name for `palpate.open`, and a description."""

    uri: str
    description: str


def devices() -> tuple[list[ListedDevice], list[str]]:
    """Return the connected devices, without opening one.

    Returns
    -------
    list of ListedDevice, list of str
        The devices, and messages about searches that were not possible.

    Examples
    --------
    >>> connected, notes = devices()
    >>> all(":" in device.uri for device in connected)
    True
    """
    return search_by(boards, chips, _i2c, _ports, *of_packages())


def search_by(
    *searches: Callable[[], list[ListedDevice]],
) -> tuple[list[ListedDevice], list[str]]:
    """Search by some of the functions of this module; the result is that of `devices`."""
    connected = []
    notes = []
    for search in searches:
        try:
            connected += search()
        except (SourceError, MissingExtra) as error:
            notes.append(str(error))
    return connected, notes


def boards() -> list[ListedDevice]:
    """Return the evaluation kits."""
    from palpate.ad7746.evalkit.discovery import list_boards

    return [ListedDevice(f"usb:{board}", "AD7746 evaluation kit") for board in list_boards()]


def chips() -> list[ListedDevice]:
    """Return the chips with the kernel's driver."""
    from palpate.sources.iio import kernel_devices

    return [
        ListedDevice(f"iio:{path}", "AD7746 by the kernel's driver") for path in kernel_devices()
    ]


def _i2c() -> list[ListedDevice]:
    buses = sorted(Path("/dev").glob("i2c-*"))
    return [ListedDevice(f"i2c:{path}", "I2C bus; an AD7746 may be on it") for path in buses]


def _ports() -> list[ListedDevice]:
    listed = []
    for port in sorted(need("serial.tools.list_ports", "serial").comports()):
        if port.vid is not None:
            listed.append(ListedDevice(f"serial:{port.device}", port.description or "serial port"))
    return listed


def streams() -> list[ListedDevice]:
    """Return the streams of numbers of Lab Streaming Layer; takes 1 s or more."""
    from palpate.sources.lsl import NUMBERS, search, stream_text

    listed = []
    for info in search({}, _STREAMS_S):
        if info.channel_format() in NUMBERS:
            description = f"{stream_text(info)}, {info.channel_count()} channels"
            listed.append(ListedDevice(f"lsl:{shortened(info.name())}", description))
    return listed


def of_packages() -> list[Callable[[], list[ListedDevice]]]:
    """Return the searches of other packages."""
    return [partial(_of_package, point) for point in entry_points(GROUP)]


def _of_package(point: "EntryPoint") -> list[ListedDevice]:
    search = loaded(point)
    try:
        return [ListedDevice(*device) for device in search()]
    except Exception as error:
        text = f"{type(error).__name__}: {error!s:.200}"
        raise SourceError(
            f"{point.name}: the search of {package_of(point)} failed: {text}"
        ) from error
