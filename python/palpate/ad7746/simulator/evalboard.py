"""Simulated evaluation kit: a board that answers the vendor requests, with a simulated AD7746.

Not compared with hardware: it follows the same description of the board as
`palpate.ad7746.evalkit.usb_bus`; statements marked [?] are assumptions. Faults happen on demand.
`palpate.ad7746.simulator.usb_backend` connects the board to the driver inside this process.
"""

import errno
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum

from palpate.ad7746 import registers
from palpate.ad7746.bus import Clock
from palpate.ad7746.evalkit.usb_bus import (
    CPUCS,
    ERROR_COUNT,
    I2C,
    I2C_PLAIN,
    IN,
    OUT,
    PORTS,
    RAM,
    RAM_BYTES,
    RDY_PIN,
)
from palpate.ad7746.simulator.chip import SimulatedChip

TRANSFER_NS = 250_000  # Duration of a control transfer without its I2C: two microframes [?].
# I2C clock of the board: the FX2's setting of 100 kHz, which its firmware reaches in practice [?].
BUS_KHZ = 85.0
_NOBODY = b"\xff"  # each byte of a read that nobody acknowledges


@dataclass(frozen=True)
class Reply:
    """Answer of the board to a request."""

    data: bytes = b""
    error: int = 0
    lasting_ns: float = TRANSFER_NS
    taken: int = 0


_SILENCE = Reply(lasting_ns=math.inf)


class FaultKind(StrEnum):
    """What fails. Comments give the meaning of `Fault.amount`."""

    NO_ANSWER = "no answer"
    STALL = "stall"
    LINE_ERROR = "line error"
    UNPLUG = "unplug"  # seconds until the board is plugged in again
    LATE = "late"  # seconds that the answer takes
    SHORT = "short"  # bytes of the answer
    LOCK = "lock"
    NOT_ACKNOWLEDGED = "not acknowledged"
    PARTLY_ACKNOWLEDGED = "not acknowledged in mid-write"  # bytes that are acknowledged
    LOST_CONVERSION = "lost conversion"  # number of conversions
    OTHER_INPUT = "other input"  # number of conversions
    EXCITATION_SHORTED = "excitation shorted"  # number of conversions
    OVERLOAD = "overload"  # pF
    WIRE_OFF = "wire off"  # input, 1 or 2
    BROWN_OUT = "brown-out"
    CHIP_ABSENT = "chip absent"
    RDY_STUCK_HIGH = "RDY# stuck high"
    RDY_STUCK_LOW = "RDY# stuck low"


@dataclass
class Fault:
    """A simulated fault: its kind and amount, after how many (and which) requests, how often."""

    kind: FaultKind
    amount: float = 1.0
    skip: int = 0
    request: int | None = None
    times: float = 1


# Faults that replace the answer.
_INSTEAD = {
    FaultKind.NO_ANSWER: _SILENCE,
    FaultKind.STALL: Reply(error=errno.EPIPE),
    FaultKind.LINE_ERROR: Reply(error=errno.EPROTO),
    FaultKind.UNPLUG: Reply(error=errno.ESHUTDOWN),
}


class SimulatedBoard:
    """A simulated board. Its state is in attributes that may be set.

    Attributes
    ----------
    chip : SimulatedChip
    loaded : bool
        Whether the firmware is loaded.
    keeps_firmware : bool
        Whether the firmware survives unplugging. On a real board, which the cable supplies, it does not.
    locked : bool
        Whether the firmware answers no request any more.
    stuck : bool or None
        Level of a stuck RDY# pin; None: it follows the chip.
    nak_after : int or None
        Bytes of the next transfer that are acknowledged; None: all.
    faults : deque of Fault
        Faults to come, in order.
    """

    def __init__(
        self, chip: SimulatedChip, clock: Clock, *, loaded: bool = True, bus_kHz: float = BUS_KHZ
    ) -> None:
        self.chip = chip
        self.loaded = loaded
        self.keeps_firmware = True
        self.locked = False
        self.stuck: bool | None = None
        self.nak_after: int | None = None
        self.faults: deque[Fault] = deque()
        self._unplug: Callable[[float], None] = lambda _: None
        self._clock = clock
        self._bit_ns = 1e6 / bus_kHz
        self._errors = 0
        self._ram = bytearray(RAM_BYTES)
        self._held = False

    def plugged(self, unplug: Callable[[float], None]) -> None:
        """Reset everything, as at power-on. `unplug(back_after_s)` pulls the board out again."""
        self._unplug = unplug
        self._errors = 0
        self.locked = False
        self._held = False
        self.loaded = self.loaded and self.keeps_firmware
        self.brown_out()

    def brown_out(self) -> None:
        """Reset the chip, as its supply fails for a moment."""
        self.chip.power_on(self._clock.now_ns())

    def control(
        self, kind: int, request: int, value: int, index: int, length: int, data: bytes = b""
    ) -> Reply:
        """Answer one vendor request on endpoint 0."""
        fault = self._due(request)
        if fault is None:
            return self._answer(kind, request, value, index, length, data)
        self._apply(fault)
        if fault.kind in _INSTEAD:
            return _INSTEAD[fault.kind]
        reply = self._answer(kind, request, value, index, length, data)
        if fault.kind == FaultKind.LATE:
            return replace(reply, error=0, lasting_ns=round(fault.amount * 1e9))
        if fault.kind == FaultKind.SHORT:
            return replace(reply, error=0, data=reply.data[: int(fault.amount)])
        return reply

    def _due(self, request: int) -> Fault | None:
        if not self.faults:
            return None
        fault = self.faults[0]
        if fault.request not in (None, request):
            return None
        if fault.skip:
            fault.skip -= 1
            return None
        fault.times -= 1
        if fault.times <= 0:
            self.faults.popleft()
        return fault

    def _apply(self, fault: Fault) -> None:
        """Let the board, or else its chip, fail before it answers."""
        match fault.kind:
            case FaultKind.UNPLUG:
                self._unplug(fault.amount)
            case FaultKind.LOCK:
                self.locked = True
            case FaultKind.NOT_ACKNOWLEDGED:
                self.nak_after = 0
            case FaultKind.PARTLY_ACKNOWLEDGED:
                self.nak_after = int(fault.amount)
            case FaultKind.BROWN_OUT:
                self.brown_out()
            case FaultKind.RDY_STUCK_HIGH:
                self.stuck = True
            case FaultKind.RDY_STUCK_LOW:
                self.stuck = False
            case _:
                self._apply_to_chip(fault)

    def _apply_to_chip(self, fault: Fault) -> None:
        match fault.kind:
            case FaultKind.LOST_CONVERSION:
                self.chip.lose = int(fault.amount)
            case FaultKind.OTHER_INPUT:
                self.chip.garble = int(fault.amount)
            case FaultKind.EXCITATION_SHORTED:
                self.chip.short = int(fault.amount)
            case FaultKind.OVERLOAD:
                self.chip.overload_pF = fault.amount
            case FaultKind.WIRE_OFF:
                self.chip.loose = int(fault.amount)
            case FaultKind.CHIP_ABSENT:
                self.chip.present = False

    def _answer(
        self, kind: int, request: int, value: int, index: int, length: int, data: bytes
    ) -> Reply:
        if kind not in (IN, OUT):
            return _SILENCE
        if request == RAM:
            return self._access_ram(kind, value, length, data)
        if not self.loaded or self._held:
            return Reply(error=errno.EPIPE)
        if self.locked:
            return _SILENCE
        if request in (I2C, I2C_PLAIN):
            # Only writes do without a register pointer.
            pointer = bytes([index & 0xFF]) if request == I2C else b""
            return self._access_i2c(kind, value >> 1 & 0x7F, pointer, length, data)
        if request == ERROR_COUNT and kind == IN:
            count = min(self._errors, 0xFF)
            self._errors = 0
            return Reply(bytes([count])[:length])
        if request == PORTS and kind == IN:
            return self._read_ports(length)
        return _SILENCE

    def _access_i2c(
        self, kind: int, address: int, pointer: bytes, length: int, data: bytes
    ) -> Reply:
        now = self._clock.now_ns() + TRANSFER_NS // 2
        present = address == registers.I2C_ADDRESS and self.chip.acknowledges(now)
        if not present or self.nak_after == 0:
            self.nak_after = None
            self._errors += 1
            lasting = TRANSFER_NS + self._lasting(1)
            return Reply(_NOBODY * length, taken=len(data), lasting_ns=lasting)
        if kind == OUT:
            return self._write_i2c(pointer + data, now, len(data))
        lasting = self._lasting(1 + length) + self._lasting(1 + len(pointer))
        self.chip.write(pointer, now)
        return Reply(self.chip.read(length, now, lasting), lasting_ns=TRANSFER_NS + lasting)

    def _write_i2c(self, sent: bytes, now: int, taken: int) -> Reply:
        if self.nak_after is not None:
            sent = sent[: self.nak_after]
            self.nak_after = None
            self._errors += 1
        lasting = self._lasting(1 + len(sent))
        self.chip.write(sent, now + lasting)
        return Reply(taken=taken, lasting_ns=TRANSFER_NS + lasting)

    def _lasting(self, count: int) -> int:
        """Return the time of a start, `count` bytes, and a stop or the next start, ns."""
        return round((9 * count + 2) * self._bit_ns)

    def _read_ports(self, length: int) -> Reply:
        high = self.stuck
        if high is None:
            high = self.chip.rdy_pin(self._clock.now_ns() + TRANSFER_NS // 2)
        port_a = 0x80 | (RDY_PIN if high else 0)
        return Reply(bytes([port_a, 0x80, 0, 0, 0, 0])[:length])

    def _access_ram(self, kind: int, address: int, length: int, data: bytes) -> Reply:
        if kind == IN:
            return Reply(bytes(self._ram[address : address + length]))
        if address == CPUCS:
            self._held = bool(data[0] & 1)
            if not self._held and any(self._ram):
                self.loaded = True
                self.locked = False
        else:
            self._ram[address : address + len(data)] = data
        return Reply(taken=len(data))
