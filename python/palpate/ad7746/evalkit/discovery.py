"""Evaluation kits on USB: their search, also for those that come and go, the USB library, and its errors in words."""

import errno
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Event, Thread
from typing import Any, NamedTuple

from palpate.ad7746 import bus
from palpate.errors import (
    DeviceNotFound,
    DeviceRefused,
    MissingExtra,
    PalpateError,
    ProtocolError,
    SourceTimeout,
    need,
)

core, util = (need(f"usb.{part}", "usb") for part in ("core", "util"))

REPLUG = "unplug the board for a moment"
VENDOR, PRODUCT = 0x0456, 0xB481  # USB identity, the same before and after the firmware is loaded.
POLL_S = 1.0  # from one look for boards that come and go to the next
_END_S = 1.0
_LISTED = {"win32": "the Device Manager", "darwin": "`system_profiler SPUSBDataType`"}.get(
    sys.platform, "`lsusb`"
)
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


def boards(backend: Any = None) -> list[Board]:
    """Return the connected boards, without opening one."""
    return [board_of(device) for device in devices(backend or system_backend())]


def devices(backend: Any) -> list[Any]:
    """Return the devices of pyusb that are evaluation kits."""
    with translated("looking for boards"):
        found = [_device(raw, backend) for raw in backend.enumerate_devices()]
    return [device for device in found if (device.idVendor, device.idProduct) == (VENDOR, PRODUCT)]


def _device(raw: Any, backend: Any) -> Any:
    # libusb crashes if a device is freed after its context, and pyusb does not keep the context: keep it here.
    raw.backend = backend
    return core.Device(raw, backend)


def board_of(device: Any) -> Board:
    """Return the place of a device."""
    return Board(device.bus, device.address, tuple(device.port_numbers or ()))


def choose(backend: Any, bus: int | None, address: int | None) -> Any:
    """Return the device with this bus and address, or the only one."""
    found = devices(backend)
    named = [d for d in found if bus in (None, d.bus) and address in (None, d.address)]
    if len(named) == 1:
        return named[0]
    places = ", ".join(f"usb:{board_of(device)}" for device in found)
    text = f"found {len(named)} boards: choose one of {places}; unplug the other ones if you do not know which is which"
    if not found:
        text = f"no AD7746 evaluation kit ({VENDOR:04x}:{PRODUCT:04x}) found: check the cable, and {_LISTED}"
    elif not named:
        text = f"no board at {bus}/{address}, found: {places}"
    raise DeviceNotFound(text)


def system_backend() -> Any:
    """Return libusb-1.0 for pyusb: the system's first, since pyusb keeps the first one that is loaded."""
    from ctypes.util import find_library

    from usb.backend import libusb1

    if any(map(find_library, ("usb-1.0", "libusb-1.0"))) and (found := libusb1.get_backend()):
        return found
    with suppress(ImportError):
        import libusb_package

        if found := libusb_package.get_libusb1_backend():
            return found
    raise MissingExtra(
        "libusb-1.0 is not installed: pip install 'palpate[usb]', or apt install libusb-1.0-0"
    )


def fresh(backend: Any) -> Any:
    """Return a backend with a new context: without udev a libusb context never notices plugging and unplugging."""
    return type(backend)(backend.lib) if hasattr(backend, "lib") else backend


def may_open(board: Board, usbfs: Path = Path("/dev/bus/usb")) -> bool | None:
    """Return whether this user may open a board, without opening it; None: unknown."""
    node = usbfs / f"{board.bus:03d}" / f"{board.address:03d}"
    return os.access(node, os.R_OK | os.W_OK) if node.exists() else None


Look = Callable[[], set[Board]]


def look() -> set[Board]:
    """Return the connected boards, through a context of libusb of its own."""
    return set(boards(fresh(system_backend())))


class Hotplug:
    """Reports which boards come and go, from its begin to `close`."""

    def __init__(
        self, changed: Callable[[set[Board], set[Board]], object], search: Look | None = None
    ) -> None:
        self._changed, self._look = changed, search or look
        self._closing = Event()
        self._known = self._look()
        self._thread = Thread(target=self._run, name="palpate-hotplug", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread; may be called twice."""
        self._closing.set()
        self._thread.join(_END_S)

    def _run(self) -> None:
        while not self._closing.wait(POLL_S):
            with suppress(OSError, PalpateError):  # the next look may succeed
                before, self._known = self._known, self._look()
                if self._known != before:
                    self._changed(before, self._known)
