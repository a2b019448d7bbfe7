"""Which evaluation kits are plugged in, and through which library they are spoken to."""

from contextlib import suppress
from typing import Any, NamedTuple

from palpate.ad7746.evalkit.usberrors import translated
from palpate.errors import DeviceNotFound, MissingExtra

try:
    import usb.core
except ImportError as _missing:  # pragma: no cover
    raise MissingExtra("the evaluation kit needs pyusb: pip install 'palpate[usb]'") from _missing

VENDOR, PRODUCT = 0x0456, 0xB481
"""The same before and after the firmware is loaded."""


class Board(NamedTuple):
    """Where a board is plugged in: bus and address as `lsusb` shows them, and the ports that lead to it."""

    bus: int
    address: int
    ports: tuple[int, ...]

    def __str__(self) -> str:
        """Return "bus/address", as `usb:` takes it."""
        return f"{self.bus}/{self.address}"


def boards(backend: Any = None) -> list[Board]:
    """List the boards that are plugged in; opens none.

    Parameters
    ----------
    backend : usb.backend.IBackend, optional
        A twin's; otherwise `system_backend`.

    Raises
    ------
    MissingExtra
        No libusb.
    """
    return [board_of(device) for device in devices(backend or system_backend())]


def devices(backend: Any) -> list[Any]:
    """Return pyusb's devices."""
    with translated("looking for boards"):
        found = [_device(raw, backend) for raw in backend.enumerate_devices()]
    return [device for device in found if (device.idVendor, device.idProduct) == (VENDOR, PRODUCT)]


def _device(raw: Any, backend: Any) -> Any:
    # libusb crashes where a device is given back after its context; pyusb does not hold the one for the other.
    raw.backend = backend
    return usb.core.Device(raw, backend)


def board_of(device: Any) -> Board:
    """Return where a device is plugged in."""
    return Board(device.bus, device.address, tuple(device.port_numbers or ()))


def choose(backend: Any, bus: int | None, address: int | None) -> Any:
    """Return the device that was named, or the only one."""
    found = devices(backend)
    named = [d for d in found if bus in (None, d.bus) and address in (None, d.address)]
    if len(named) == 1:
        return named[0]
    places = ", ".join(f"usb:{board_of(device)}" for device in found)
    if not found:
        raise DeviceNotFound(
            f"no AD7746 evaluation kit ({VENDOR:04x}:{PRODUCT:04x}) is plugged in: check the cable, and `lsusb`"
        )
    if not named:
        raise DeviceNotFound(f"no board at {bus}/{address}: plugged in are {places}")
    raise DeviceNotFound(f"{len(named)} boards are plugged in: name one of {places}")


def system_backend() -> Any:
    """Return pyusb's libusb-1.0, the system's first: the first one that is loaded is the one that is kept."""
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
    """Return a backend with a new context: without udev a libusb context never sees a device come or go."""
    return type(backend)(backend.lib) if hasattr(backend, "lib") else backend
