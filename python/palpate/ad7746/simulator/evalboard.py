"""Twin of the evaluation kit: a simulated board that answers the vendor requests, with a simulated AD7746.

Not compared with hardware: it follows the same description of the board as `palpate.ad7746.evalkit.usb_bus`; what is
marked [?] is an assumption. Faults happen on demand. `palpate.ad7746.simulator.usb_backend` connects it to the driver inside this
process.
"""

import errno
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

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
from palpate.ad7746.simulator.chip import ChipTwin

TRANSFER_NS = 250_000  # Duration of a control transfer without its I2C: two microframes [?].
BUS_KHZ = 85.0  # I2C clock of the board: the FX2's setting of 100 kHz, which its firmware reaches in practice [?].
_NOBODY = b"\xff"  # what a read gives if nobody acknowledges


@dataclass(frozen=True)
class Reply:
    """Answer of the board to a request."""

    data: bytes = b""
    error: int = 0
    lasting_ns: float = TRANSFER_NS
    taken: int = 0


_SILENCE = Reply(lasting_ns=math.inf)


@dataclass
class Fault:
    """A simulated fault: its kind, after how many (and which) requests it happens, and how often."""

    kind: str
    amount: float = 1.0
    skip: int = 0
    request: int | None = None
    times: float = 1


class KitTwin:
    """A simulated board."""

    def __init__(
        self, chip: ChipTwin, clock: Clock, *, loaded: bool = True, bus_kHz: float = BUS_KHZ
    ) -> None:
        self.chip = chip
        self.loaded = loaded
        self.keeps_firmware = (
            True  # after unplugging; a real board, supplied by the cable, does not
        )
        self.stuck: bool | None = None  # level of a stuck RDY# pin; None: it follows the chip
        self.locked = False
        self.nak_after: int | None = (
            None  # bytes of the next transfer that are acknowledged; None: all
        )
        self.faults: deque[Fault] = deque()
        self.on_unplug: Callable[[float], None] = lambda _: None
        self._clock = clock
        self._bit_ns = 1e6 / bus_kHz
        self._errors = 0
        self._ram = bytearray(RAM_BYTES)
        self._held = False

    def plugged(self) -> None:
        """Reset everything, as at power-on."""
        self._errors, self.locked, self._held = 0, False, False
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
        if fault and fault.kind in _BEFORE:
            _BEFORE[fault.kind](self, fault.amount)
        if fault and fault.kind in _IN_PLACE:
            return _IN_PLACE[fault.kind]
        reply = self._answer(kind, request, value, index, length, data)
        return _AFTER[fault.kind](reply, fault.amount) if fault and fault.kind in _AFTER else reply

    def _due(self, request: int) -> Fault | None:
        if not self.faults or self.faults[0].request not in (None, request):
            return None
        if self.faults[0].skip:
            self.faults[0].skip -= 1
            return None
        self.faults[0].times -= 1
        return self.faults[0] if self.faults[0].times > 0 else self.faults.popleft()

    def _answer(
        self, kind: int, request: int, value: int, index: int, length: int, data: bytes
    ) -> Reply:
        if kind not in (IN, OUT):
            return _SILENCE
        if request == RAM:
            return self._access_ram(kind, value, length, data)
        if not self.loaded or self._held:
            return Reply(error=errno.EPIPE)
        if not self.locked:
            if request in (I2C, I2C_PLAIN):
                pointer = (
                    bytes([index & 0xFF]) if request == I2C else b""
                )  # which only writes leave out
                return self._access_i2c(kind, value >> 1 & 0x7F, pointer, length, data)
            if request == ERROR_COUNT and kind == IN:
                count, self._errors = min(self._errors, 0xFF), 0
                return Reply(bytes([count])[:length])
            if request == PORTS and kind == IN:
                return self._read_ports(length)
        return _SILENCE

    def _access_i2c(
        self, kind: int, address: int, pointer: bytes, length: int, data: bytes
    ) -> Reply:
        now = self._clock.now_ns() + TRANSFER_NS // 2
        if (
            address != registers.I2C_ADDRESS
            or not self.chip.acknowledges(now)
            or self.nak_after == 0
        ):
            self.nak_after = None
            self._errors += 1
            return Reply(
                _NOBODY * length, taken=len(data), lasting_ns=TRANSFER_NS + self._lasting(1)
            )
        if kind == OUT:
            return self._write_i2c(pointer + data, now, len(data))
        lasting = self._lasting(1 + length) + self._lasting(1 + len(pointer))
        self.chip.write(pointer, now)
        return Reply(self.chip.read(length, now, lasting), lasting_ns=TRANSFER_NS + lasting)

    def _write_i2c(self, sent: bytes, now: int, taken: int) -> Reply:
        if self.nak_after is not None:
            sent, self.nak_after = sent[: self.nak_after], None
            self._errors += 1
        lasting = self._lasting(1 + len(sent))
        self.chip.write(sent, now + lasting)
        return Reply(taken=taken, lasting_ns=TRANSFER_NS + lasting)

    def _lasting(self, count: int) -> int:
        """Return the time of a start, `count` bytes, and a stop or the next start, ns."""
        return round((9 * count + 2) * self._bit_ns)

    def _read_ports(self, length: int) -> Reply:
        high = (
            self.chip.rdy_pin(self._clock.now_ns() + TRANSFER_NS // 2)
            if self.stuck is None
            else self.stuck
        )
        return Reply(bytes([0x80 | RDY_PIN * high, 0x80, 0, 0, 0, 0])[:length])

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


# What a fault does before the request is answered, in place of the answer, with the answer.
_BEFORE: dict[str, Callable[[KitTwin, float], None]] = {
    "unplug": lambda kit, back_after_s: kit.on_unplug(back_after_s),
    "lock": lambda kit, _: setattr(kit, "locked", True),
    "not acknowledged": lambda kit, _: setattr(kit, "nak_after", 0),
    "not acknowledged in mid-write": lambda kit, count: setattr(kit, "nak_after", int(count)),
    "lost conversion": lambda kit, count: setattr(kit.chip, "lose", int(count)),
    "other input": lambda kit, count: setattr(kit.chip, "garble", int(count)),
    "excitation shorted": lambda kit, count: setattr(kit.chip, "short", int(count)),
    "overload": lambda kit, overload_pF: setattr(kit.chip, "overload_pF", overload_pF),
    "wire off": lambda kit, pin: setattr(kit.chip, "loose", int(pin)),
    "brown-out": lambda kit, _: kit.brown_out(),
    "chip absent": lambda kit, _: setattr(kit.chip, "present", False),
    "RDY# stuck high": lambda kit, _: setattr(kit, "stuck", True),
    "RDY# stuck low": lambda kit, _: setattr(kit, "stuck", False),
}
_IN_PLACE = {
    "no answer": _SILENCE,
    "stall": Reply(error=errno.EPIPE),
    "line error": Reply(error=errno.EPROTO),
    "unplug": Reply(error=errno.ESHUTDOWN),
}
_AFTER: dict[str, Callable[[Reply, float], Reply]] = {
    "late": lambda reply, seconds: replace(reply, error=0, lasting_ns=round(seconds * 1e9)),
    "short": lambda reply, count: replace(reply, error=0, data=reply.data[: int(count)]),
}
FAULTS = tuple(_IN_PLACE | _AFTER | _BEFORE)  # All allowed values of `Fault.kind`.
