"""Twin of the AD7746: a simulated chip with the registers and the timing of the data sheet, and its wiring.

`WIRINGS` has the wiring of the evaluation kit's guide and the mistakes that are made with it. What is marked [?] is an
assumption. All times of the chip are ns of the caller's clock; nothing here waits.
"""

import random
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from palpate.ad7746 import registers

# (bump, begin, end) -> mean capacitance, pF, of the hard (1) or the soft bump (2) between two times, s.
Pins = Callable[[int, float, float], float]

HARD, SOFT = 1, 2  # Numbers of the bumps, and of their inputs.
STRAY_PF = 0.003  # Capacitance of an input without a wire to a driven excitation pin [?].
# The board's length sensor between CIN2+ and EXCA, which R1 and R2 connect; the value is from its schematic.
DEMO_PF = 1.4
SHORT_PF = 1000.0  # An input that is shorted to an excitation pin: far outside every range.


@dataclass(frozen=True)
class Wiring:
    """Where the two bumps hang, at an input and an excitation pin as "1+B", "" nowhere; what else is there; a shorted pin."""

    hard: str = "1+B"
    soft: str = "2+B"
    constant_pF: Mapping[str, float] = field(default_factory=dict)
    shorted: str = ""

    def mean_pF(
        self, bumps: Pins, setup: int, excitation: int, begin_s: float, end_s: float, loose: int = 0
    ) -> float:
        """Return the mean capacitance that the chip measures between two times."""
        pin, driven = 2 if setup & registers.CIN2 else 1, self._driven(excitation)
        signs = {"+": 1.0, "-": -1.0} if setup & registers.CAPDIFF else {"+": 1.0}
        seen = {
            f"{pin}{end}{name}": sign
            for end, sign in signs.items()
            for name in driven
            if pin != loose
        }
        wired = ((self.hard, HARD), (self.soft, SOFT))
        found = [
            seen[place] * bumps(bump, begin_s, end_s) for place, bump in wired if place in seen
        ]
        found += [
            seen[place] * constant_pF
            for place, constant_pF in self.constant_pF.items()
            if place in seen
        ]
        return sum(found) if found else STRAY_PF * bool(driven)

    def fails(self, excitation: int) -> bool:
        """Return whether a driven pin is shorted, for the register EXC_SETUP."""
        return any(pin in self.shorted for pin in self._driven(excitation))

    @staticmethod
    def _driven(excitation: int) -> str:
        return ("A" if excitation & registers.EXCA else "") + (
            "B" if excitation & registers.EXCB else ""
        )


_DEMO = {"2+A": DEMO_PF}

# By name: both bumps on EXCB, as in the guide; then other wirings. exca, hard-exca, soft-exca: both bumps, or one, on EXCA.
# swapped: the hard bump on CIN2. demo, demo-exca, demo-alone: R1 and R2 are left in, with both bumps on EXCB, both on
# EXCA, no soft bump. hard-minus: the hard bump on CIN1-. hard-open, soft-open, open: not connected. hard-shorted, soft-
# shorted: the input to EXCB. exca-shorted, excb-shorted: the pin to ground. differential: a constant capacitor between
# each CIN- and EXCB.
WIRINGS: dict[str, Wiring] = {
    "guide": Wiring(),
    "exca": Wiring("1+A", "2+A"),
    "hard-exca": Wiring("1+A", "2+B"),
    "soft-exca": Wiring("1+B", "2+A"),
    "swapped": Wiring("2+B", "1+B"),
    "demo": Wiring(constant_pF=_DEMO),
    "demo-exca": Wiring("1+A", "2+A", _DEMO),
    "demo-alone": Wiring("1+B", "", _DEMO),
    "hard-minus": Wiring("1-B", "2+B"),
    "hard-open": Wiring("", "2+B"),
    "soft-open": Wiring("1+B", ""),
    "open": Wiring("", ""),
    "hard-shorted": Wiring(constant_pF={"1+B": SHORT_PF}),
    "soft-shorted": Wiring(constant_pF={"2+B": SHORT_PF}),
    "exca-shorted": Wiring(shorted="A"),
    "excb-shorted": Wiring(shorted="B"),
    "differential": Wiring(constant_pF={"1-B": 2.0, "2-B": 1.5}),
}


FACTORY = bytes([0x66, 0xCC, 0x5C, 0x90])  # CAP_GAIN and VOLT_GAIN of a chip.
_DAC_STEP_PF = (0.171, 0.158)  # of CAPDAC_A and CAPDAC_B
_ALL_READY = registers.RDY | registers.RDYVT | registers.RDYCAP
_CAP_BYTES, _VT_BYTES = {1, 2, 3}, {4, 5, 6}


class Conversion(NamedTuple):
    """A finished conversion: pin (CIN) 1 or 2, begin and end in ns, code, and whether it was lost."""

    pin: int
    begin: int
    end: int
    code: int
    lost: bool


class Running(NamedTuple):
    """A running conversion, with the registers at its begin."""

    begin: int
    end: int
    registers: bytes


class ChipTwin:
    """A simulated AD7746."""

    def __init__(
        self,
        pins: Pins,
        *,
        seed: int = 0,
        dac_step_pF: tuple[float, float] = _DAC_STEP_PF,
        wiring: Wiring = WIRINGS["guide"],
    ) -> None:
        self.conversions: deque[Conversion] = deque(maxlen=4096)
        self.factory = FACTORY
        self.temperature_C, self.supply_V = 25.0, 3.3
        self.present = True
        self.lose = self.garble = self.short = (
            0  # next conversions that are lost, are of the other input, have EXCERR
        )
        self.loose = 0  # input whose wires are off, 1 or 2
        self.overload_pF = 0.0
        self.disturb: Callable[[], float] = lambda: 0.0  # pF, for each conversion
        self.pace = 1.0  # a conversion's time, relative to the data sheet's
        self._pins, self._wiring, self._dac_step_pF = pins, wiring, dac_step_pF
        self._random, self._noisy = random.Random(seed), True
        self._silent_until = 0
        self._pointer = 0
        self._running: Running | None = None
        self.registers = bytearray(registers.RESET_VALUES + FACTORY)

    def acknowledges(self, now: int) -> bool:
        """Return whether the chip acknowledges its address."""
        return self.present and now >= self._silent_until

    def power_on(self, now: int) -> None:
        """Reset, as at power-on or by command."""
        self.registers[:] = registers.RESET_VALUES + self.factory
        self._running = None
        self._silent_until = now + round(registers.RESET_S * 1e9)

    def write(self, data: bytes, now: int) -> None:
        """Process the bytes after the address: a register pointer, then values."""
        self._advance(now)
        if data[0] == registers.RESET_POINTER:
            self.power_on(now)
            return
        self._pointer = data[0]
        for byte in data[1:]:
            if registers.CAP_SETUP <= self._pointer < registers.REGISTERS:
                self.registers[self._pointer] = byte
            if self._pointer == registers.CONFIG:
                self._begin(now)
            self._pointer += 1

    def read(self, count: int, now: int, lasting: int = 0) -> bytes:
        """Return registers from the pointer on; the transfer starts at `now` and takes `lasting`."""
        self._advance(now)
        span = range(self._pointer, self._pointer + count)
        self._pointer = span.stop
        data = bytes(self.registers[number % registers.REGISTERS] for number in span)
        if (
            self._running
            and self._running.end <= now + lasting
            and (_CAP_BYTES | _VT_BYTES) & set(span)
        ):
            self._end(self._running, lost=True)
        if set(span) >= _CAP_BYTES:
            self.registers[registers.STATUS] |= registers.RDY | registers.RDYCAP
        if set(span) >= _VT_BYTES:
            self.registers[registers.STATUS] |= registers.RDYVT
        return data

    def rdy_pin(self, now: int) -> bool:
        """Return the level of RDY#: low (False) when a conversion has ended. Its value, which may take long, waits."""
        if self._running and self._running.end <= now:
            return self.lose > 0
        return bool(self.registers[registers.STATUS] & registers.RDY)

    def _begin(self, now: int) -> None:
        self._running = None
        self.registers[registers.STATUS] |= _ALL_READY
        config = self.registers[registers.CONFIG]
        if config & 7 != registers.SINGLE:  # no other one is used
            return
        if self.garble:
            self.garble -= 1
            self.registers[registers.CAP_SETUP] ^= registers.CIN2
        seconds = registers.CONVERSION_S[config >> 3 & 7] * bool(
            self.registers[registers.CAP_SETUP] & registers.CAPEN
        )
        seconds += registers.VT_CONVERSION_S[config >> 6] * bool(
            self.registers[registers.VT_SETUP] & registers.VTEN
        )
        if seconds:
            self._running = Running(
                now, now + round(self.pace * seconds * 1e9), bytes(self.registers)
            )

    def _advance(self, now: int) -> None:
        if self._running and self._running.end <= now:
            self._end(self._running, lost=False)

    def _end(self, running: Running, *, lost: bool) -> None:
        if self.lose:
            self.lose, lost = self.lose - 1, True
        if running.registers[registers.CAP_SETUP] & registers.CAPEN:
            pin = 2 if running.registers[registers.CAP_SETUP] & registers.CIN2 else 1
            code = registers.code_of(self._measured_pF(running))
            self.conversions.append(Conversion(pin, running.begin, running.end, code, lost))
            if not lost:
                shorted = self.short > 0 or self._wiring.fails(
                    running.registers[registers.EXC_SETUP]
                )
                self.short = max(self.short - 1, 0)
                self.registers[registers.STATUS] &= ~registers.EXCERR
                self.registers[registers.STATUS] |= registers.EXCERR * shorted
                self._give(registers.CAP_DATA, code, registers.RDYCAP)
        if running.registers[registers.VT_SETUP] & registers.VTEN and not lost:
            code = round((self.temperature_C + 4096) * 2048)
            if running.registers[registers.VT_SETUP] & registers.VT_SUPPLY:
                code = (
                    round(self.supply_V / (6 * registers.REFERENCE_V) * 2**23) + registers.ZERO_CODE
                )
            self._give(registers.VT_DATA, code, registers.RDYVT)
        self._running = None
        self.registers[registers.CONFIG] &= ~7

    def _give(self, register: int, code: int, ready: int) -> None:
        self.registers[register : register + 3] = code.to_bytes(3, "big")
        self.registers[registers.STATUS] &= ~(registers.RDY | ready)

    def _measured_pF(self, running: Running) -> float:
        image = running.registers
        setup, excitation = image[registers.CAP_SETUP], image[registers.EXC_SETUP]
        total = self._wiring.mean_pF(
            self._pins, setup, excitation, running.begin / 1e9, running.end / 1e9, self.loose
        )
        total += self.disturb() + self.overload_pF
        minus, plus = self._dac_step_pF
        for register, step in ((registers.CAPDAC_A, -minus), (registers.CAPDAC_B, plus)):
            if image[register] & registers.DAC_ENABLE:
                total += (image[register] & registers.DAC_STEPS) * step
        offset = int.from_bytes(image[registers.CAP_OFFSET : registers.CAP_GAIN], "big")
        total += (offset - registers.OFFSET_ZERO) * registers.OFFSET_STEP_PF
        noise = registers.NOISE_PF[image[registers.CONFIG] >> 3 & 7] if self._noisy else 0.0
        return (
            (total + self._random.gauss(0.0, noise))
            * _gain(image[registers.CAP_GAIN :])
            / _gain(self.factory)
        )


def _gain(registers: bytes) -> float:
    """Return the gain that CAP_GAIN sets: (2^16 + code) / 2^16."""
    return 1 + int.from_bytes(registers[:2], "big") / 2**16
