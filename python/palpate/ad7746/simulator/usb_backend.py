"""A pyusb backend with simulated boards: the complete driver runs in this process, without libusb.

It raises the same errors as pyusb with libusb; `tests/ad7746/test_evalkit.py` runs the same cases
over both.
"""

import array
import errno
import math
import os
from dataclasses import dataclass
from typing import Any, NamedTuple

import usb.backend
from usb.core import USBError, USBTimeoutError

from palpate.ad7746.bus import Clock
from palpate.ad7746.evalkit.discovery import PRODUCT, VENDOR
from palpate.ad7746.simulator.evalboard import SimulatedBoard

# errno of a transfer -> errno of libusb's error, where they differ on Linux.
_TRANSLATED = {errno.EPROTO: errno.EIO, errno.ESHUTDOWN: errno.ENODEV}


class DeviceDescriptor(NamedTuple):
    """Descriptor of a board, with the names of pyusb; the board has no strings."""

    bus: int
    address: int
    port_number: int
    port_numbers: tuple[int, ...]
    speed: int = 3
    idVendor: int = VENDOR
    idProduct: int = PRODUCT
    bLength: int = 0
    bDescriptorType: int = 0
    bcdUSB: int = 0
    bDeviceClass: int = 0
    bDeviceSubClass: int = 0
    bDeviceProtocol: int = 0
    bMaxPacketSize0: int = 0
    bcdDevice: int = 0
    iManufacturer: int = 0
    iProduct: int = 0
    iSerialNumber: int = 0
    bNumConfigurations: int = 0


@dataclass(eq=False)
class Port:
    """A USB port with a board in it."""

    board: SimulatedBoard
    address: int
    number: int
    attached: bool = True
    allowed: bool = True
    claimed_by: object | None = None


@dataclass(eq=False)
class Handle:
    """Handle of an opened device."""

    port: Port


class _Replug(NamedTuple):
    """A board that is plugged in again at a time, ns."""

    time_ns: float
    board: SimulatedBoard
    number: int


class SimulatedUsb(usb.backend.IBackend):  # type: ignore[misc]  # pyusb has no types
    """Backend for pyusb with simulated boards."""

    def __init__(self, clock: Clock) -> None:
        self.opened: int = 0
        self._clock = clock
        self._ports: list[Port] = []
        self._replugs: list[_Replug] = []
        self._address = 1

    def plug(self, board: SimulatedBoard, number: int = 1) -> Port:
        """Plug a board into a port."""
        self._address += 1
        port = Port(board, self._address, number)
        self._ports.append(port)
        board.plugged(lambda back_after_s: self.unplug(port, back_after_s))
        return port

    def unplug(self, port: Port, back_after_s: float = math.inf) -> None:
        """Pull a board out, and plug it in again later."""
        if port.attached:
            port.attached = False
            self._ports.remove(port)
            time_ns = self._clock.now_ns() + back_after_s * 1e9
            self._replugs.append(_Replug(time_ns, port.board, port.number))

    def enumerate_devices(self) -> Any:
        """Return the boards that are plugged in now."""
        due = [replug for replug in self._replugs if replug.time_ns <= self._clock.now_ns()]
        for replug in due:
            self._replugs.remove(replug)
            self.plug(replug.board, replug.number)
        return iter(list(self._ports))

    def get_device_descriptor(self, port: Port) -> DeviceDescriptor:
        """Return the descriptor of a device, with its bus, address and port."""
        return DeviceDescriptor(1, port.address, port.number, (port.number,))

    def get_parent(self, port: Port) -> None:
        """Return nothing: the hub is not shown."""

    def open_device(self, port: Port) -> Handle:
        """Open a device; EACCES and ENODEV as on a real system."""
        _require(port.attached, errno.ENODEV)
        _require(port.allowed, errno.EACCES)
        self.opened += 1
        return Handle(port)

    def close_device(self, handle: Handle) -> None:
        """Close a device and release its interface."""
        self.opened -= 1
        if handle.port.claimed_by is handle:
            handle.port.claimed_by = None

    def claim_interface(self, handle: Handle, interface: int) -> None:
        """Claim an interface; EBUSY if another handle has it."""
        _require(handle.port.attached, errno.ENODEV)
        _require(handle.port.claimed_by in (None, handle), errno.EBUSY)
        handle.port.claimed_by = handle

    def release_interface(self, handle: Handle, interface: int) -> None:
        """Release an interface."""
        _require(handle.port.attached, errno.ENODEV)
        handle.port.claimed_by = None

    def ctrl_transfer(
        self,
        handle: Handle,
        kind: int,
        request: int,
        value: int,
        index: int,
        data: Any,
        timeout: int,
    ) -> int:
        """Do one control transfer, and wait for its duration."""
        _require(handle.port.attached, errno.ENODEV)
        begun = self._clock.now_ns()
        to_host = bool(kind & 0x80)
        sent = b"" if to_host else data.tobytes()
        length = len(data) * data.itemsize
        reply = handle.port.board.control(kind, request, value, index, length, sent)
        if timeout and reply.lasting_ns > timeout * 1_000_000:
            self._clock.sleep(timeout / 1000)
            raise USBTimeoutError("Operation timed out", None, errno.ETIMEDOUT)
        # The computer needs time to simulate the board, too: it is a part of the duration.
        self._clock.sleep((begun + reply.lasting_ns - self._clock.now_ns()) / 1e9)
        _require(not reply.error, _TRANSLATED.get(reply.error, reply.error))
        if not to_host:
            return reply.taken
        data[: len(reply.data)] = array.array("B", reply.data)
        return len(reply.data)


def _require(condition: bool, number: int) -> None:
    """Raise the exception of pyusb for an errno if the condition is not met."""
    if not condition:
        raise USBError(os.strerror(number), None, number)
