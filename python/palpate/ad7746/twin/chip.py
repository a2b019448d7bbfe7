"""Twin of the AD7746: a simulated chip with the registers and the timing of the data sheet.

All times are ns of the caller's clock; nothing here waits.
"""

import random
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from palpate.ad7746 import datasheet
from palpate.ad7746.twin.wiring import WIRINGS, Pins, Wiring

FACTORY = bytes([0x66, 0xCC, 0x5C, 0x90])  # CAP_GAIN and VOLT_GAIN of a chip.
_DAC_STEP_PF = (0.171, 0.158)  # of CAPDAC_A and CAPDAC_B
_ALL_READY = datasheet.RDY | datasheet.RDYVT | datasheet.RDYCAP
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
        self.lose = self.garble = self.short = 0  # next conversions that are lost, are of the other input, have EXCERR
        self.loose = 0  # input whose wires are off, 1 or 2
        self.overload_pF = 0.0
        self.disturb: Callable[[], float] = lambda: 0.0  # pF, for each conversion
        self.pace = 1.0  # a conversion's time, relative to the data sheet's
        self._pins, self._wiring, self._dac_step_pF = pins, wiring, dac_step_pF
        self._random, self._noisy = random.Random(seed), True
        self._silent_until = 0
        self._pointer = 0
        self._running: Running | None = None
        self.registers = bytearray(datasheet.RESET_VALUES + FACTORY)

    def acknowledges(self, now: int) -> bool:
        """Return whether the chip acknowledges its address."""
        return self.present and now >= self._silent_until

    def power_on(self, now: int) -> None:
        """Reset, as at power-on or by command."""
        self.registers[:] = datasheet.RESET_VALUES + self.factory
        self._running = None
        self._silent_until = now + round(datasheet.RESET_S * 1e9)

    def write(self, data: bytes, now: int) -> None:
        """Process the bytes after the address: a register pointer, then values."""
        self._advance(now)
        if data[0] == datasheet.RESET_POINTER:
            self.power_on(now)
            return
        self._pointer = data[0]
        for byte in data[1:]:
            if datasheet.CAP_SETUP <= self._pointer < datasheet.REGISTERS:
                self.registers[self._pointer] = byte
            if self._pointer == datasheet.CONFIG:
                self._begin(now)
            self._pointer += 1

    def read(self, count: int, now: int, lasting: int = 0) -> bytes:
        """Return registers from the pointer on; the transfer starts at `now` and takes `lasting`."""
        self._advance(now)
        span = range(self._pointer, self._pointer + count)
        self._pointer = span.stop
        data = bytes(self.registers[number % datasheet.REGISTERS] for number in span)
        if self._running and self._running.end <= now + lasting and (_CAP_BYTES | _VT_BYTES) & set(span):
            self._end(self._running, lost=True)
        if set(span) >= _CAP_BYTES:
            self.registers[datasheet.STATUS] |= datasheet.RDY | datasheet.RDYCAP
        if set(span) >= _VT_BYTES:
            self.registers[datasheet.STATUS] |= datasheet.RDYVT
        return data

    def rdy_pin(self, now: int) -> bool:
        """Return the level of RDY#: low (False) when a conversion has ended. Its value, which may take long, waits."""
        if self._running and self._running.end <= now:
            return self.lose > 0
        return bool(self.registers[datasheet.STATUS] & datasheet.RDY)

    def _begin(self, now: int) -> None:
        self._running = None
        self.registers[datasheet.STATUS] |= _ALL_READY
        config = self.registers[datasheet.CONFIG]
        if config & 7 != datasheet.SINGLE:  # no other one is used
            return
        if self.garble:
            self.garble -= 1
            self.registers[datasheet.CAP_SETUP] ^= datasheet.CIN2
        seconds = datasheet.CONVERSION_S[config >> 3 & 7] * bool(self.registers[datasheet.CAP_SETUP] & datasheet.CAPEN)
        seconds += datasheet.VT_CONVERSION_S[config >> 6] * bool(self.registers[datasheet.VT_SETUP] & datasheet.VTEN)
        if seconds:
            self._running = Running(now, now + round(self.pace * seconds * 1e9), bytes(self.registers))

    def _advance(self, now: int) -> None:
        if self._running and self._running.end <= now:
            self._end(self._running, lost=False)

    def _end(self, running: Running, *, lost: bool) -> None:
        if self.lose:
            self.lose, lost = self.lose - 1, True
        if running.registers[datasheet.CAP_SETUP] & datasheet.CAPEN:
            pin = 2 if running.registers[datasheet.CAP_SETUP] & datasheet.CIN2 else 1
            code = datasheet.code_of(self._measured_pF(running))
            self.conversions.append(Conversion(pin, running.begin, running.end, code, lost))
            if not lost:
                shorted = self.short > 0 or self._wiring.fails(running.registers[datasheet.EXC_SETUP])
                self.short = max(self.short - 1, 0)
                self.registers[datasheet.STATUS] &= ~datasheet.EXCERR
                self.registers[datasheet.STATUS] |= datasheet.EXCERR * shorted
                self._give(datasheet.CAP_DATA, code, datasheet.RDYCAP)
        if running.registers[datasheet.VT_SETUP] & datasheet.VTEN and not lost:
            code = round((self.temperature_C + 4096) * 2048)
            if running.registers[datasheet.VT_SETUP] & datasheet.VT_SUPPLY:
                code = round(self.supply_V / (6 * datasheet.REFERENCE_V) * 2**23) + datasheet.ZERO_CODE
            self._give(datasheet.VT_DATA, code, datasheet.RDYVT)
        self._running = None
        self.registers[datasheet.CONFIG] &= ~7

    def _give(self, register: int, code: int, ready: int) -> None:
        self.registers[register : register + 3] = code.to_bytes(3, "big")
        self.registers[datasheet.STATUS] &= ~(datasheet.RDY | ready)

    def _measured_pF(self, running: Running) -> float:
        registers = running.registers
        setup, excitation = registers[datasheet.CAP_SETUP], registers[datasheet.EXC_SETUP]
        total = self._wiring.mean_pF(self._pins, setup, excitation, running.begin / 1e9, running.end / 1e9, self.loose)
        total += self.disturb() + self.overload_pF
        minus, plus = self._dac_step_pF
        for register, step in ((datasheet.CAPDAC_A, -minus), (datasheet.CAPDAC_B, plus)):
            if registers[register] & datasheet.DAC_ENABLE:
                total += (registers[register] & datasheet.DAC_STEPS) * step
        offset = int.from_bytes(registers[datasheet.CAP_OFFSET : datasheet.CAP_GAIN], "big")
        total += (offset - datasheet.OFFSET_ZERO) * datasheet.OFFSET_STEP_PF
        noise = datasheet.NOISE_PF[registers[datasheet.CONFIG] >> 3 & 7] if self._noisy else 0.0
        return (total + self._random.gauss(0.0, noise)) * _gain(registers[datasheet.CAP_GAIN :]) / _gain(self.factory)


def _gain(registers: bytes) -> float:
    """Return the gain that CAP_GAIN sets: (2^16 + code) / 2^16."""
    return 1 + int.from_bytes(registers[:2], "big") / 2**16
