"""Search for evaluation kits on USB, and for the USB library."""

import sys
from contextlib import suppress
from typing import Any, NamedTuple

from palpate.ad7746.evalkit.usberrors import translated
from palpate.errors import DeviceNotFound, MissingExtra

try:
    import usb.core
except ImportError as _missing:  # pragma: no cover
    raise MissingExtra("the evaluation kit needs pyusb: pip install 'palpate[usb]'") from _missing

VENDOR, PRODUCT = 0x0456, 0xB481
"""USB identity, the same before and after the firmware is loaded."""
_LISTED = {"win32": "the Device Manager", "darwin": "`system_profiler SPUSBDataType`"}.get(sys.platform, "`lsusb`")


class Board(NamedTuple):
    """Place of a board: bus and address as `lsusb` shows them, and the chain of ports."""

    bus: int
    address: int
    ports: tuple[int, ...]

    def __str__(self) -> str:
        """Return "bus/address", as in `usb:bus/address`."""
        return f"{self.bus}/{self.address}"


def boards(backend: Any = None) -> list[Board]:
    """Return the connected boards, without opening one.

    Parameters
    ----------
    backend : usb.backend.IBackend, optional
        Backend of a simulated board. Default: `system_backend`.

    Returns
    -------
    list of Board

    Raises
    ------
    MissingExtra
        No libusb.
    """
    return [board_of(device) for device in devices(backend or system_backend())]


def devices(backend: Any) -> list[Any]:
    """Return the devices of pyusb that are evaluation kits."""
    with translated("looking for boards"):
        found = [_device(raw, backend) for raw in backend.enumerate_devices()]
    return [device for device in found if (device.idVendor, device.idProduct) == (VENDOR, PRODUCT)]


def _device(raw: Any, backend: Any) -> Any:
    # libusb crashes if a device is freed after its context, and pyusb does not keep the context: keep it here.
    raw.backend = backend
    return usb.core.Device(raw, backend)


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
    if not found:
        raise DeviceNotFound(
            f"no AD7746 evaluation kit ({VENDOR:04x}:{PRODUCT:04x}) found: check the cable, and {_LISTED}"
        )
    if not named:
        raise DeviceNotFound(f"no board at {bus}/{address}, found: {places}")
    raise DeviceNotFound(
        f"found {len(named)} boards: choose one of {places}; `palpate devices --blink` shows which is which"
    )


def system_backend() -> Any:
    """Return libusb-1.0 for pyusb; first that of the system, since pyusb keeps the first one that is loaded."""
    from ctypes.util import find_library

    from usb.backend import libusb1

    if any(map(find_library, ("usb-1.0", "libusb-1.0"))) and (found := libusb1.get_backend()):
        return found
    with suppress(ImportError):
        import libusb_package

        if found := libusb_package.get_libusb1_backend():
            return found
    raise MissingExtra("libusb-1.0 is not installed: pip install 'palpate[usb]', or apt install libusb-1.0-0")


def fresh(backend: Any) -> Any:
    """Return a backend with a new context: without udev a libusb context never notices plugging and unplugging."""
    return type(backend)(backend.lib) if hasattr(backend, "lib") else backend
