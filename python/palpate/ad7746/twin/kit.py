"""Twin of the evaluation kit: a simulated board that answers the vendor requests, with a simulated AD7746.

Not compared with hardware: it follows the same description of the board as `palpate.ad7746.evalkit.board`; what is
marked [?] is an assumption. Faults happen on demand. `palpate.ad7746.twin.usb` connects it to the driver inside this
process.
"""

import errno
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from palpate.ad7746 import datasheet
from palpate.ad7746.clock import Clock
from palpate.ad7746.evalkit.board import (
    CPUCS,
    ERROR_COUNT,
    I2C,
    I2C_PLAIN,
    IN,
    OUT,
    PORTS,
    RAM,
    RDY_PIN,
    TRANSFER_BYTES,
)
from palpate.ad7746.evalkit.find import PRODUCT, VENDOR
from palpate.ad7746.evalkit.firmware import RAM_BYTES
from palpate.ad7746.twin.chip import ChipTwin

TRANSFER_NS = 250_000
"""Duration of a control transfer without its I2C: two microframes [?]."""
BUS_KHZ = 85.0
"""I2C clock of the board: the FX2's setting of 100 kHz, which its firmware reaches in practice [?]."""
_I2C_WIDE = 0xDE
_EEPROM = range(0x50, 0x58)


@dataclass(frozen=True)
class Reply:
    """Answer of the board to a request.

    Attributes
    ----------
    data : bytes
        Bytes sent to the host.
    error : int
        errno at the end of the transfer; 0: no error.
    lasting_ns : int or None
        Duration of the transfer; None: the board does not answer.
    taken : int
        Number of bytes accepted from the host.
    """

    data: bytes = b""
    error: int = 0
    lasting_ns: int | None = TRANSFER_NS
    taken: int = 0


@dataclass
class Fault:
    """A simulated fault.

    Attributes
    ----------
    kind : str
        One of `FAULTS`.
    amount : float
        Size of the fault; the unit depends on the kind: seconds, bytes, conversions, pF.
    skip : int
        Number of requests without the fault before it.
    request : int, optional
        Only requests with this number are counted and affected.
    times : float
        Number of affected requests in a row; may be infinity.
    """

    kind: str
    amount: float = 1.0
    skip: int = 0
    request: int | None = None
    times: float = 1


class KitTwin:
    """A simulated board.

    A request takes `TRANSFER_NS`; one with I2C, in its middle, also the time of the bits on the bus: 9 for each byte, and
    1 each for start, repeated start and stop. A write takes effect at its end. At 85 kHz a pair takes 31.5 ms at CAPF 0.

    Parameters
    ----------
    chip : ChipTwin
        The chip on the board.
    clock : Clock
        The clock of the driver.
    loaded : bool
        Whether it has firmware. Without, it answers only the RAM request, until an image is written and started.
    bus_kHz : float
        I2C clock, kHz.

    Attributes
    ----------
    faults : deque of Fault
        The next faults, in order.
    on_unplug : callable
        Set by the USB backend; called with the seconds until the board is plugged in again, or infinity.
    eeprom_touched : bool
        Whether the memory with the identity of the board was addressed.
    """

    def __init__(self, chip: ChipTwin, clock: Clock, *, loaded: bool = True, bus_kHz: float = BUS_KHZ) -> None:
        self.chip = chip
        self._bit_ns = 1e6 / bus_kHz
        self.loaded: bool = loaded
        self.keeps_firmware = True  # after unplugging; a real board, supplied by the cable, does not
        self.stuck: bool | None = None  # level of a stuck RDY# pin; None: it follows the chip
        self.locked: bool = False
        self.eeprom_touched: bool = False
        self.faults: deque[Fault] = deque()
        self.on_unplug: Callable[[float], None] = lambda _: None
        self.configuration = 1
        self._clock = clock
        self._errors = 0
        self._buffer = bytearray(TRANSFER_BYTES)
        self._ports = bytearray([0x80, 0x80, 0, 0, 0, 0])
        self._ram = bytearray(RAM_BYTES)
        self._held = False
        self._nak_after: int | None = None

    def plugged(self) -> None:
        """Reset everything, as at power-on."""
        self._errors, self.locked, self._held = 0, False, False
        self.loaded = self.loaded and self.keeps_firmware
        self.chip.power_on(self._clock.now_ns())

    def control(self, kind: int, request: int, value: int, index: int, length: int, data: bytes = b"") -> Reply:
        """Answer one vendor request on endpoint 0.

        Parameters
        ----------
        kind, request, value, index, length : int
            bmRequestType, bRequest, wValue, wIndex, wLength.
        data : bytes
            Bytes from the host, for OUT.

        Returns
        -------
        Reply
        """
        fault = self._due(request)
        prepared = _FAULTS[fault.kind](self, fault.amount) if fault else None
        if isinstance(prepared, Reply):
            return prepared
        reply = self._answer(kind, request, value, index, length, data)
        return prepared(reply) if prepared else reply

    def _due(self, request: int) -> Fault | None:
        if not self.faults or self.faults[0].request not in (None, request):
            return None
        if self.faults[0].skip:
            self.faults[0].skip -= 1
            return None
        self.faults[0].times -= 1
        return self.faults[0] if self.faults[0].times > 0 else self.faults.popleft()

    def _answer(self, kind: int, request: int, value: int, index: int, length: int, data: bytes) -> Reply:
        if kind not in (IN, OUT):
            return Reply(lasting_ns=None)
        if request == RAM:
            return self._access_ram(kind, value, length, data)
        if not self.loaded or self._held:
            return Reply(error=errno.EPIPE)
        if self.locked:
            return Reply(lasting_ns=None)
        if request in (I2C, I2C_PLAIN, _I2C_WIDE):
            pointer = {I2C: bytes([index & 0xFF]), I2C_PLAIN: b"", _I2C_WIDE: index.to_bytes(2, "big")}[request]
            return self._access_i2c(kind, value >> 1 & 0x7F, pointer, length, data)
        if request == ERROR_COUNT and kind == IN:
            count, self._errors = min(self._errors, 0xFF), 0
            return Reply(bytes([count])[:length])
        if request == PORTS:
            return self._access_ports(kind, length, data)
        return Reply(lasting_ns=None)

    def _access_i2c(self, kind: int, address: int, pointer: bytes, length: int, data: bytes) -> Reply:
        count = length & 0xFF
        if not 1 <= count <= TRANSFER_BYTES:
            self._errors += 1
            return Reply(bytes(self._buffer)[:length], taken=len(data))
        self.eeprom_touched |= address in _EEPROM
        now = self._clock.now_ns() + TRANSFER_NS // 2
        acknowledged = address == datasheet.I2C_ADDRESS and self.chip.acknowledges(now) and self._nak_after != 0
        if not acknowledged:
            self._nak_after = None
            self._errors += 1
            self._buffer[:count] = b"\xff" * count
            return Reply(b"\xff" * count, taken=len(data), lasting_ns=TRANSFER_NS + self._lasting(1))
        if kind == OUT:
            return self._write_i2c(pointer + data, now, len(data))
        lasting = self._lasting(1 + count) + (self._lasting(1 + len(pointer)) if pointer else 0)
        if pointer:
            self.chip.write(pointer[-1:], now)
        self._buffer[:count] = self.chip.read(count, now, lasting)
        return Reply(bytes(self._buffer[:count]), lasting_ns=TRANSFER_NS + lasting)

    def _write_i2c(self, sent: bytes, now: int, taken: int) -> Reply:
        if self._nak_after is not None:
            sent, self._nak_after = sent[: self._nak_after], None
            self._errors += 1
        lasting = self._lasting(1 + len(sent))
        self.chip.write(sent, now + lasting)
        return Reply(taken=taken, lasting_ns=TRANSFER_NS + lasting)

    def _lasting(self, count: int) -> int:
        """Return the time of a start, so many bytes, and a stop or the start after it, ns."""
        return round((9 * count + 2) * self._bit_ns)

    def _access_ports(self, kind: int, length: int, data: bytes) -> Reply:
        if kind == OUT:
            self._ports[: len(data)] = data[:6]
            return Reply(taken=len(data))
        high = self.chip.rdy_pin(self._clock.now_ns() + TRANSFER_NS // 2) if self.stuck is None else self.stuck
        port_a = self._ports[0] & ~RDY_PIN | RDY_PIN * high
        return Reply(bytes([port_a, *self._ports[1:]])[:length])

    def _access_ram(self, kind: int, address: int, length: int, data: bytes) -> Reply:
        if kind == IN:
            return Reply(bytes(self._ram[address : address + length]))
        if address == CPUCS:
            self._held = bool(data[0] & 1)
            if not self._held and any(self._ram):
                self.loaded, self.locked = True, False
        else:
            self._ram[address : address + len(data)] = data
        return Reply(taken=len(data))

    def device_descriptor(self) -> bytes:
        """Return the USB device descriptor; the board has no strings."""
        return struct.pack("<BBHBBBBHHHBBBB", 18, 1, 0x0200, 0xFF, 0xFF, 0xFF, 64, VENDOR, PRODUCT, 0, 0, 0, 0, 1)

    def configuration_descriptor(self) -> bytes:
        """Return the descriptor of the only configuration, with one interface; its endpoints are not used."""
        interface = struct.pack("<9B", 9, 4, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0)
        return struct.pack("<BBHBBBBB", 9, 2, 9 + len(interface), 1, 1, 0, 0x80, 50) + interface

    def _unplug(self, back_after_s: float) -> Reply:
        self.on_unplug(back_after_s)
        return Reply(error=errno.ESHUTDOWN)

    def _set(self, **values: object) -> None:
        for name, value in values.items():
            setattr(self, name, value)

    def _set_chip(self, **values: object) -> None:
        for name, value in values.items():
            setattr(self.chip, name, value)


Effect = Reply | Callable[[Reply], Reply] | None

_FAULTS: dict[str, Callable[[KitTwin, float], Effect]] = {
    "no answer": lambda kit, amount: Reply(lasting_ns=None),
    "stall": lambda kit, amount: Reply(error=errno.EPIPE),
    "line error": lambda kit, amount: Reply(error=errno.EPROTO),
    "babble": lambda kit, amount: Reply(error=errno.EOVERFLOW),
    "late": lambda kit, seconds: lambda reply: Reply(reply.data, 0, round(seconds * 1e9), reply.taken),
    "short": lambda kit, count: lambda reply: Reply(reply.data[: int(count)], 0, reply.lasting_ns, reply.taken),
    "unplug": lambda kit, back_after_s: kit._unplug(back_after_s),
    "lock": lambda kit, amount: kit._set(locked=True),
    "not acknowledged": lambda kit, amount: kit._set(_nak_after=0),
    "not acknowledged in mid-write": lambda kit, count: kit._set(_nak_after=int(count)),
    "lost conversion": lambda kit, count: kit._set_chip(lose=int(count)),
    "other input": lambda kit, count: kit._set_chip(garble=int(count)),
    "excitation shorted": lambda kit, count: kit._set_chip(short=int(count)),
    "overload": lambda kit, overload_pF: kit._set_chip(overload_pF=overload_pF),
    "wire off": lambda kit, pin: kit._set_chip(loose=int(pin)),
    "brown-out": lambda kit, amount: kit.chip.power_on(kit._clock.now_ns()),
    "chip absent": lambda kit, amount: kit._set_chip(present=False),
    "RDY# stuck high": lambda kit, amount: kit._set(stuck=True),
    "RDY# stuck low": lambda kit, amount: kit._set(stuck=False),
}
FAULTS = tuple(_FAULTS)
"""All allowed values of `Fault.kind`."""
