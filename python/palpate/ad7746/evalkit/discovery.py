"""Search for evaluation kits on USB; the USB library and its error messages."""

import errno
import os
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from palpate.ad7746 import bus
from palpate.errors import (
    DeviceNotFound,
    DeviceRefused,
    MissingExtra,
    ProtocolError,
    SourceTimeout,
    need,
)

core = need("usb.core", "usb")
util = need("usb.util", "usb")

REPLUG = "unplug the board for a moment"
# USB identity, the same before and after the firmware is loaded.
VENDOR = 0x0456
PRODUCT = 0xB481
POLL_S = 1.0  # from one search for boards that come and go to the next
_END_S = 1.0
_DEVICE_LISTS = {"win32": "the Device Manager", "darwin": "`system_profiler SPUSBDataType`"}
_DEVICE_LIST = _DEVICE_LISTS.get(sys.platform, "`lsusb`")
_DRIVER = "On Windows the board needs the driver WinUSB: install it for 0456:b481 with Zadig (https://zadig.akeo.ie)"
_PERMISSION = {
    "win32": f"Close other programs that use the board. {_DRIVER}",
    "darwin": "On macOS another program or a driver holds it: close that program, then plug the board in again",
}.get(sys.platform, "Type `palpate doctor --install-udev`; in a container, on the host")
_NOT_SUPPORTED = {
    "win32": f"the driver of the board is not WinUSB. {_DRIVER}",
    "darwin": "libusb cannot open it; `brew install libusb`, for the processor that this Python is for",
}.get(sys.platform, "the USB library of this system does not support it; install libusb-1.0")
_UNPLUGGED = (DeviceNotFound, "the board was unplugged: plug it in again.")
_FORBIDDEN = (bus.NotReady, f"no permission to open it. {_PERMISSION}")
_ERRORS: bus.Meanings = {
    errno.ETIMEDOUT: (SourceTimeout, f"no answer in time; if it happens again, {REPLUG}"),
    errno.ENODEV: _UNPLUGGED,
    errno.ENOENT: _UNPLUGGED,  # on systems other than Linux
    errno.EACCES: _FORBIDDEN,
    errno.EPERM: _FORBIDDEN,
    errno.EBUSY: (DeviceRefused, "another program uses the board; close that program first"),
    errno.EPIPE: (
        ProtocolError,
        "the board refused the request (stall); check that the kit's own firmware is loaded",
    ),
    errno.EIO: (ProtocolError, "error on the USB line; try another cable or port, without a hub"),
    errno.ENOSYS: (DeviceRefused, _NOT_SUPPORTED),
    errno.EOVERFLOW: (
        ProtocolError,
        "the board sent more bytes than requested; try another cable or port",
    ),
}


translated = partial(bus.translated, meanings=_ERRORS)


class Board(NamedTuple):
    """Place of a board: bus and address as `lsusb` shows them, and the chain of ports."""

    bus: int
    address: int
    ports: tuple[int, ...]

    def __str__(self) -> str:
        """Return "bus/address", as in `usb:bus/address`."""
        return f"{self.bus}/{self.address}"

    def is_at(self, other: "Board") -> bool:
        """Return whether two boards are at the same ports; each replug gives another address."""
        return (self.bus, self.ports) == (other.bus, other.ports)


def list_boards(backend: Any = None) -> list[Board]:
    """Return the connected boards, without opening one."""
    return [board_of(device) for device in usb_devices(backend or system_backend())]


def usb_devices(backend: Any) -> list[Any]:
    """Return the devices of pyusb that are evaluation kits."""
    with translated("looking for boards"):
        found = [_device(raw, backend) for raw in backend.enumerate_devices()]
    return [device for device in found if (device.idVendor, device.idProduct) == (VENDOR, PRODUCT)]


def _device(raw: Any, backend: Any) -> Any:
    # libusb crashes if a device is freed after its context, and pyusb does not keep the context:
    # keep it here.
    raw.backend = backend
    return core.Device(raw, backend)


def board_of(device: Any) -> Board:
    """Return the place of a device."""
    return Board(device.bus, device.address, tuple(device.port_numbers or ()))


def choose_device(backend: Any, bus: int | None, address: int | None) -> Any:
    """Return the device with this bus and address, or the only one."""
    found = usb_devices(backend)
    named = [d for d in found if bus in (None, d.bus) and address in (None, d.address)]
    if len(named) == 1:
        return named[0]
    places = ", ".join(f"usb:{board_of(device)}" for device in found)
    if not found:
        kit = f"AD7746 evaluation kit ({VENDOR:04x}:{PRODUCT:04x})"
        raise DeviceNotFound(f"no {kit} found: check the cable, and {_DEVICE_LIST}")
    if not named:
        raise DeviceNotFound(f"no board at {bus}/{address}, found: {places}")
    raise DeviceNotFound(
        f"found {len(named)} boards: choose one of {places}; "
        "unplug the other ones if you do not know which is which"
    )


def system_backend() -> Any:
    """Return libusb-1.0 for pyusb, which keeps the first one that is loaded: the system's."""
    from ctypes.util import find_library

    from usb.backend import libusb1

    if find_library("usb-1.0") or find_library("libusb-1.0"):
        backend = libusb1.get_backend()
        if backend:
            return backend
    with suppress(ImportError):
        import libusb_package

        backend = libusb_package.get_libusb1_backend()
        if backend:
            return backend
    raise MissingExtra(
        "libusb-1.0 is not installed: pip install 'palpate[usb]', or apt install libusb-1.0-0"
    )


def new_context(backend: Any) -> Any:
    """Return a backend of libusb with a new context, and any other backend itself.

    Without udev a libusb context never notices that a device is plugged in or unplugged.
    """
    if hasattr(backend, "lib"):
        return type(backend)(backend.lib)
    return backend


def may_open(board: Board, usbfs: Path = Path("/dev/bus/usb")) -> bool | None:
    """Return whether this user may open a board, without opening it; None: unknown."""
    node = usbfs / f"{board.bus:03d}" / f"{board.address:03d}"
    return os.access(node, os.R_OK | os.W_OK) if node.exists() else None
