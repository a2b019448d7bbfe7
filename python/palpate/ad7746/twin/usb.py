"""A pyusb backend with simulated boards: the complete driver runs in this process, without libusb.

It raises the same errors as pyusb with libusb; `tests/ad7746/test_evalkit_board.py` runs the same cases over both.
"""

import array
import errno
import math
import struct
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NoReturn

import usb.backend
from usb.backend import libusb1
from usb.core import USBError, USBTimeoutError

from palpate.ad7746.clock import Clock
from palpate.ad7746.twin.kit import KitTwin

if TYPE_CHECKING:
    _Backend = object  # pyusb has no types
else:
    _Backend = usb.backend.IBackend

# errno of a transfer -> error of libusb, as libusb translates it on Linux.
_ERRORS = {
    errno.EPIPE: libusb1.LIBUSB_ERROR_PIPE,
    errno.EPROTO: libusb1.LIBUSB_ERROR_IO,
    errno.EOVERFLOW: libusb1.LIBUSB_ERROR_OVERFLOW,
    errno.ESHUTDOWN: libusb1.LIBUSB_ERROR_NO_DEVICE,
}
_DEVICE_FIELDS = "bLength,bDescriptorType,bcdUSB,bDeviceClass,bDeviceSubClass,bDeviceProtocol,bMaxPacketSize0,idVendor,"
_DEVICE_FIELDS += "idProduct,bcdDevice,iManufacturer,iProduct,iSerialNumber,bNumConfigurations"


class Port:
    """A USB port with a board in it."""

    def __init__(self, kit: KitTwin, address: int, number: int) -> None:
        self.kit = kit
        self.address = address
        self.number = number
        self.attached = True
        self.allowed = True
        self.claimed_by: object | None = None


class Handle:
    """Handle of an opened device."""

    def __init__(self, port: Port) -> None:
        self.port = port


class TwinBackend(_Backend):
    """Backend for pyusb with simulated boards.

    Parameters
    ----------
    clock : Clock
        The clock of the boards.

    Attributes
    ----------
    opened : int
        Number of handles that are open.
    """

    def __init__(self, clock: Clock) -> None:
        self.opened: int = 0
        self._clock = clock
        self._ports: list[Port] = []
        self._coming: list[tuple[float, KitTwin, int]] = []
        self._address = 1

    def plug(self, kit: KitTwin, number: int = 1) -> Port:
        """Plug a board into a port."""
        self._address += 1
        port = Port(kit, self._address, number)
        self._ports.append(port)
        kit.on_unplug = lambda back_after_s: self.unplug(port, back_after_s)
        kit.plugged()
        return port

    def unplug(self, port: Port, back_after_s: float = math.inf) -> None:
        """Pull a board out, and plug it in again later."""
        if not port.attached:
            return
        port.attached = False
        self._ports.remove(port)
        if math.isfinite(back_after_s):
            self._coming.append((self._clock.now_ns() + back_after_s * 1e9, port.kit, port.number))

    def _settle(self) -> None:
        now = self._clock.now_ns()
        due = [entry for entry in self._coming if entry[0] <= now]
        self._coming = [entry for entry in self._coming if entry[0] > now]
        for _, kit, number in due:
            self.plug(kit, number)

    def enumerate_devices(self) -> Any:
        """Return the boards that are plugged in now."""
        self._settle()
        return iter(list(self._ports))

    def get_device_descriptor(self, port: Port) -> Any:
        """Return the descriptor of a device, with its bus, address and port."""
        values = struct.unpack("<BBHBBBBHHHBBBB", port.kit.device_descriptor())
        place = {"bus": 1, "address": port.address, "port_number": port.number, "port_numbers": (port.number,)}
        return SimpleNamespace(**dict(zip(_DEVICE_FIELDS.split(","), values, strict=True)), **place, speed=3)

    def get_parent(self, port: Port) -> None:
        """Return nothing: the hub is not shown."""

    def open_device(self, port: Port) -> Handle:
        """Open a device; EACCES and ENODEV as on a real system."""
        _present(port)
        if not port.allowed:
            _fail(libusb1.LIBUSB_ERROR_ACCESS)
        self.opened += 1
        return Handle(port)

    def close_device(self, handle: Handle) -> None:
        """Close a device and release its interface."""
        self.opened -= 1
        if handle.port.claimed_by is handle:
            handle.port.claimed_by = None

    def claim_interface(self, handle: Handle, interface: int) -> None:
        """Claim an interface; EBUSY if another handle has it."""
        _present(handle.port)
        if handle.port.claimed_by not in (None, handle):
            _fail(libusb1.LIBUSB_ERROR_BUSY)
        handle.port.claimed_by = handle

    def release_interface(self, handle: Handle, interface: int) -> None:
        """Release an interface."""
        _present(handle.port)
        handle.port.claimed_by = None

    def ctrl_transfer(
        self, handle: Handle, kind: int, request: int, value: int, index: int, data: Any, timeout: int
    ) -> int:
        """Do one control transfer, and wait for its duration."""
        _present(handle.port)
        begun = self._clock.now_ns()
        sent = b"" if kind & 0x80 else data.tobytes()
        reply = handle.port.kit.control(kind, request, value, index, len(data) * data.itemsize, sent)
        if reply.lasting_ns is None or (timeout and reply.lasting_ns > timeout * 1_000_000):
            self._clock.sleep(timeout / 1000)
            _fail(libusb1.LIBUSB_ERROR_TIMEOUT)
        self._clock.sleep((begun + reply.lasting_ns - self._clock.now_ns()) / 1e9)  # with the time that the twin took
        if reply.error:
            _fail(_ERRORS[reply.error])
        if not kind & 0x80:
            return reply.taken
        data[: len(reply.data)] = array.array("B", reply.data)
        return len(reply.data)


def _present(port: Port) -> None:
    if not port.attached:
        _fail(libusb1.LIBUSB_ERROR_NO_DEVICE)


def _fail(code: int) -> NoReturn:
    """Raise the exception of pyusb for an error of libusb."""
    kind = USBTimeoutError if code == libusb1.LIBUSB_ERROR_TIMEOUT else USBError
    raise kind(libusb1._str_error_map[code], code, libusb1._libusb_errno[code])
