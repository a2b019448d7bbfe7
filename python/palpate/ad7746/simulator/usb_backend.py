"""A pyusb backend with simulated boards: the complete driver runs in this process, without libusb.

It raises the same errors as pyusb with libusb; `tests/ad7746/test_evalkit.py` runs the same cases over both.
"""

import array
import errno
import math
import os
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import usb.backend
from usb.core import USBError, USBTimeoutError

from palpate.ad7746.bus import Clock
from palpate.ad7746.evalkit.discovery import PRODUCT, VENDOR
from palpate.ad7746.simulator.evalboard import KitTwin

# errno of a transfer -> errno of libusb's error, where they differ on Linux.
_TRANSLATED = {errno.EPROTO: errno.EIO, errno.ESHUTDOWN: errno.ENODEV}
_FIELDS = "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol bMaxPacketSize0 bcdDevice "
_FIELDS += "iManufacturer iProduct iSerialNumber bNumConfigurations"


@dataclass(eq=False)
class Port:
    """A USB port with a board in it."""

    kit: KitTwin
    address: int
    number: int
    attached: bool = True
    allowed: bool = True
    claimed_by: object | None = None


@dataclass(eq=False)
class Handle:
    """Handle of an opened device."""

    port: Port


class TwinBackend(usb.backend.IBackend):  # type: ignore[misc]  # pyusb has no types
    """Backend for pyusb with simulated boards."""

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
        if port.attached:
            port.attached = False
            self._ports.remove(port)
            self._coming.append((self._clock.now_ns() + back_after_s * 1e9, port.kit, port.number))

    def enumerate_devices(self) -> Any:
        """Return the boards that are plugged in now."""
        for coming in [each for each in self._coming if each[0] <= self._clock.now_ns()]:
            self._coming.remove(coming)
            self.plug(*coming[1:])
        return iter(list(self._ports))

    def get_device_descriptor(self, port: Port) -> Any:
        """Return the descriptor of a device, with its bus, address and port."""
        others = dict.fromkeys(_FIELDS.split(), 0)  # the board has no strings
        place = {
            "bus": 1,
            "address": port.address,
            "port_number": port.number,
            "port_numbers": (port.number,),
        }
        return SimpleNamespace(idVendor=VENDOR, idProduct=PRODUCT, **others, **place, speed=3)

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
        sent = b"" if kind & 0x80 else data.tobytes()
        reply = handle.port.kit.control(
            kind, request, value, index, len(data) * data.itemsize, sent
        )
        if timeout and reply.lasting_ns > timeout * 1_000_000:
            self._clock.sleep(timeout / 1000)
            raise USBTimeoutError("Operation timed out", None, errno.ETIMEDOUT)
        self._clock.sleep(
            (begun + reply.lasting_ns - self._clock.now_ns()) / 1e9
        )  # with the time that the twin took
        _require(not reply.error, _TRANSLATED.get(reply.error, reply.error))
        if not kind & 0x80:
            return reply.taken
        data[: len(reply.data)] = array.array("B", reply.data)
        return len(reply.data)


def _require(condition: bool, number: int) -> None:
    """Raise the exception of pyusb for an errno if the condition is not met."""
    if not condition:
        raise USBError(os.strerror(number), None, number)
