"""Simulated AD7746: the registers and the timing of the data sheet, and the wiring of its inputs.

`WIRINGS` has the wiring of the evaluation kit's guide and common mistakes. What is marked [?] is an
assumption. All times of the chip are ns of the caller's clock; nothing here waits.
"""

import random
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from palpate.ad7746.registers import (
    CAP_DATA,
    CAP_GAIN,
    CAP_OFFSET,
    CAP_SETUP,
    CAPDAC_A,
    CAPDAC_B,
    CAPDIFF,
    CAPEN,
    CIN2,
    CONFIG,
    CONVERSION_S,
    DAC_ENABLE,
    DAC_STEPS,
    EXC_SETUP,
    EXCA,
    EXCB,
    EXCERR,
    NOISE_PF,
    OFFSET_STEP_PF,
    OFFSET_ZERO,
    RDY,
    RDYCAP,
    RDYVT,
    REFERENCE_V,
    REGISTERS,
    RESET_POINTER,
    RESET_S,
    RESET_VALUES,
    SINGLE,
    STATUS,
    VT_CONVERSION_S,
    VT_DATA,
    VT_SETUP,
    VT_SUPPLY,
    VTEN,
    ZERO_CODE,
    capacitance_code,
)

# (bump, begin, end) -> mean capacitance, pF, of the hard (1) or the soft bump (2) between two
# times, s.
BumpCapacitance = Callable[[int, float, float], float]

# Numbers of the bumps, and of their inputs.
HARD = 1
SOFT = 2
STRAY_PF = 0.003  # Capacitance of an input without a wire to a driven excitation pin [?].
# The board's length sensor between CIN2+ and EXCA, which R1 and R2 connect; the value is from its
# schematic.
DEMO_PF = 1.4
SHORT_PF = 1000.0  # An input that is shorted to an excitation pin: far outside every range.


def _driven_pins(excitation: int) -> str:
    """Return the driven pins, "", "A", "B" or "AB", for the register EXC_SETUP."""
    driven = ""
    if excitation & EXCA:
        driven += "A"
    if excitation & EXCB:
        driven += "B"
    return driven


@dataclass(frozen=True)
class SimulatedWiring:
    """Where the bumps, constant capacitors and a short are.

    Attributes
    ----------
    hard, soft : str
        Place of each bump: an input and an excitation pin, as "1+B"; empty: it is not connected.
    constant_pF : mapping of str to float, pF
        Constant capacitors, by their places.
    shorted : str
        Excitation pin that is shorted to ground, "A" or "B".
    """

    hard: str = "1+B"
    soft: str = "2+B"
    constant_pF: Mapping[str, float] = field(default_factory=dict)
    shorted: str = ""

    def mean_pF(
        self,
        bumps: BumpCapacitance,
        setup: int,
        excitation: int,
        begin_s: float,
        end_s: float,
        loose: int = 0,
    ) -> float:
        """Return the mean capacitance that the chip measures between two times.

        `setup` and `excitation` are the registers CAP_SETUP and EXC_SETUP; the wires of the input
        `loose` are off.
        """
        signs = self._signs(setup, excitation, loose)
        found = []
        for bump, place in ((HARD, self.hard), (SOFT, self.soft)):
            if place in signs:
                found.append(signs[place] * bumps(bump, begin_s, end_s))
        for place, constant_pF in self.constant_pF.items():
            if place in signs:
                found.append(signs[place] * constant_pF)
        if found:
            return sum(found)
        return STRAY_PF if _driven_pins(excitation) else 0.0

    def _signs(self, setup: int, excitation: int, loose: int) -> dict[str, float]:
        """Return the signs of the places that are measured; others are not."""
        pin = 2 if setup & CIN2 else 1
        if pin == loose:
            return {}
        signs = {}
        for excitation_pin in _driven_pins(excitation):
            signs[f"{pin}+{excitation_pin}"] = 1.0
            if setup & CAPDIFF:
                signs[f"{pin}-{excitation_pin}"] = -1.0
        return signs

    def fails(self, excitation: int) -> bool:
        """Return whether a driven pin is shorted, for the register EXC_SETUP."""
        return any(pin in self.shorted for pin in _driven_pins(excitation))


_DEMO = {"2+A": DEMO_PF}

# By name: both bumps on EXCB, as in the guide; then other wirings.
# exca, hard-exca, soft-exca: both bumps, or one, on EXCA. swapped: the hard bump on CIN2.
# demo, demo-exca, demo-alone: R1 and R2 are left in, with both bumps on EXCB, both on EXCA, no soft
# bump. hard-minus: the hard bump on CIN1-. hard-open, soft-open, open: not connected.
# hard-shorted, soft-shorted: the input to EXCB. exca-shorted, excb-shorted: the pin to ground.
# differential: a constant capacitor between each CIN- and EXCB.
WIRINGS: dict[str, SimulatedWiring] = {
    "guide": SimulatedWiring(),
    "exca": SimulatedWiring("1+A", "2+A"),
    "hard-exca": SimulatedWiring("1+A", "2+B"),
    "soft-exca": SimulatedWiring("1+B", "2+A"),
    "swapped": SimulatedWiring("2+B", "1+B"),
    "demo": SimulatedWiring(constant_pF=_DEMO),
    "demo-exca": SimulatedWiring("1+A", "2+A", _DEMO),
    "demo-alone": SimulatedWiring("1+B", "", _DEMO),
    "hard-minus": SimulatedWiring("1-B", "2+B"),
    "hard-open": SimulatedWiring("", "2+B"),
    "soft-open": SimulatedWiring("1+B", ""),
    "open": SimulatedWiring("", ""),
    "hard-shorted": SimulatedWiring(constant_pF={"1+B": SHORT_PF}),
    "soft-shorted": SimulatedWiring(constant_pF={"2+B": SHORT_PF}),
    "exca-shorted": SimulatedWiring(shorted="A"),
    "excb-shorted": SimulatedWiring(shorted="B"),
    "differential": SimulatedWiring(constant_pF={"1-B": 2.0, "2-B": 1.5}),
}


FACTORY = bytes([0x66, 0xCC, 0x5C, 0x90])  # CAP_GAIN and VOLT_GAIN of a chip.
DAC_STEP_PF = (0.171, 0.158)  # Steps of CAPDAC_A and CAPDAC_B of a chip, pF.
_ALL_READY = RDY | RDYVT | RDYCAP
_CAP_BYTES = {1, 2, 3}
_VT_BYTES = {4, 5, 6}


class Conversion(NamedTuple):
    """A finished conversion: pin (CIN) 1 or 2, begin and end in ns, code, whether it was lost."""

    pin: int
    begin: int
    end: int
    code: int
    lost: bool


class _Running(NamedTuple):
    """A running conversion, with the registers at its begin."""

    begin: int
    end: int
    image: bytes


class SimulatedChip:
    """A simulated AD7746. Faults and properties of this chip are attributes that may be set.

    Attributes
    ----------
    factory : bytes
        CAP_GAIN and VOLT_GAIN after a reset.
    dac_step_pF : (float, float), pF
        Steps of CAPDAC_A and CAPDAC_B.
    temperature_C, supply_V : float
        Readings of the voltage channel.
    pace : float
        Duration of a conversion, relative to the data sheet's.
    noisy : bool
        Whether readings have the noise of the data sheet.
    present : bool
        Whether the chip acknowledges its address.
    lose, garble, short : int
        How many of the next conversions are lost, are of the other input, have EXCERR.
    loose : int
        Input whose wires are off, 1 or 2; 0: none.
    overload_pF : float, pF
        Added to all readings.
    disturbance : callable
        Returns the disturbance to add to a reading, pF; called for each conversion.
    conversions : deque of Conversion
        The last conversions.
    """

    def __init__(
        self,
        bumps: BumpCapacitance,
        *,
        seed: int = 0,
        dac_step_pF: tuple[float, float] = DAC_STEP_PF,
        wiring: SimulatedWiring = WIRINGS["guide"],
    ) -> None:
        self.factory = FACTORY
        self.dac_step_pF = dac_step_pF
        self.temperature_C = 25.0
        self.supply_V = 3.3
        self.pace = 1.0
        self.noisy = True
        self.present = True
        self.lose = 0
        self.garble = 0
        self.short = 0
        self.loose = 0
        self.overload_pF = 0.0
        self.disturbance: Callable[[], float] = lambda: 0.0
        self.conversions: deque[Conversion] = deque(maxlen=4096)
        self.registers = bytearray(RESET_VALUES + FACTORY)
        self._bumps = bumps
        self._wiring = wiring
        self._random = random.Random(seed)
        self._silent_until = 0
        self._pointer = 0
        self._running: _Running | None = None

    def acknowledges(self, now: int) -> bool:
        """Return whether the chip acknowledges its address."""
        return self.present and now >= self._silent_until

    def power_on(self, now: int) -> None:
        """Reset, as at power-on or by command."""
        self.registers[:] = RESET_VALUES + self.factory
        self._running = None
        self._silent_until = now + round(RESET_S * 1e9)

    def write(self, data: bytes, now: int) -> None:
        """Process the bytes after the address: a register pointer, then values."""
        self._advance(now)
        if data[0] == RESET_POINTER:
            self.power_on(now)
            return
        self._pointer = data[0]
        for byte in data[1:]:
            if CAP_SETUP <= self._pointer < REGISTERS:
                self.registers[self._pointer] = byte
            if self._pointer == CONFIG:
                self._begin(now)
            self._pointer += 1

    def read(self, count: int, now: int, lasting: int = 0) -> bytes:
        """Return registers from the pointer on; the transfer starts at `now`, takes `lasting`."""
        self._advance(now)
        span = range(self._pointer, self._pointer + count)
        self._pointer = span.stop
        data = bytes(self.registers[number % REGISTERS] for number in span)
        if self._running and self._running.end <= now + lasting:
            # A conversion that ends during a read of data is lost.
            if not (_CAP_BYTES | _VT_BYTES).isdisjoint(span):
                self._end(self._running, lost=True)
        if _CAP_BYTES.issubset(span):
            self.registers[STATUS] |= RDY | RDYCAP
        if _VT_BYTES.issubset(span):
            self.registers[STATUS] |= RDYVT
        return data

    def rdy_pin(self, now: int) -> bool:
        """Return the level of the pin RDY#: low (False) when a conversion has ended."""
        # The value of a conversion may take long to compute: it waits for the next access.
        if self._running and self._running.end <= now:
            return self.lose > 0
        return bool(self.registers[STATUS] & RDY)

    def _begin(self, now: int) -> None:
        self._running = None
        self.registers[STATUS] |= _ALL_READY
        config = self.registers[CONFIG]
        if config & 7 != SINGLE:  # the driver uses no other mode
            return
        if self.garble:
            self.garble -= 1
            self.registers[CAP_SETUP] ^= CIN2
        seconds = 0.0
        if self.registers[CAP_SETUP] & CAPEN:
            seconds += CONVERSION_S[config >> 3 & 7]
        if self.registers[VT_SETUP] & VTEN:
            seconds += VT_CONVERSION_S[config >> 6]
        if seconds:
            end = now + round(self.pace * seconds * 1e9)
            self._running = _Running(now, end, bytes(self.registers))

    def _advance(self, now: int) -> None:
        if self._running and self._running.end <= now:
            self._end(self._running, lost=False)

    def _end(self, running: _Running, *, lost: bool) -> None:
        if self.lose:
            self.lose -= 1
            lost = True
        if running.image[CAP_SETUP] & CAPEN:
            self._end_capacitance(running, lost)
        if running.image[VT_SETUP] & VTEN and not lost:
            code = self._voltage_code(running.image[VT_SETUP])
            self._store(VT_DATA, code, RDYVT)
        self._running = None
        self.registers[CONFIG] &= ~7

    def _end_capacitance(self, running: _Running, lost: bool) -> None:
        pin = 2 if running.image[CAP_SETUP] & CIN2 else 1
        code = capacitance_code(self._measured_pF(running))
        self.conversions.append(Conversion(pin, running.begin, running.end, code, lost))
        if lost:
            return
        shorted = self.short > 0 or self._wiring.fails(running.image[EXC_SETUP])
        self.short = max(self.short - 1, 0)
        self.registers[STATUS] &= ~EXCERR
        if shorted:
            self.registers[STATUS] |= EXCERR
        self._store(CAP_DATA, code, RDYCAP)

    def _voltage_code(self, setup: int) -> int:
        if setup & VT_SUPPLY:
            share = self.supply_V / (6 * REFERENCE_V)
            return round(share * 2**23) + ZERO_CODE
        return round((self.temperature_C + 4096) * 2048)

    def _store(self, register: int, code: int, ready: int) -> None:
        self.registers[register : register + 3] = code.to_bytes(3, "big")
        self.registers[STATUS] &= ~(RDY | ready)

    def _measured_pF(self, running: _Running) -> float:
        image = running.image
        total = self._wiring.mean_pF(
            self._bumps,
            image[CAP_SETUP],
            image[EXC_SETUP],
            running.begin / 1e9,
            running.end / 1e9,
            self.loose,
        )
        total += self.disturbance() + self.overload_pF
        minus_pF, plus_pF = self.dac_step_pF
        if image[CAPDAC_A] & DAC_ENABLE:
            total -= (image[CAPDAC_A] & DAC_STEPS) * minus_pF
        if image[CAPDAC_B] & DAC_ENABLE:
            total += (image[CAPDAC_B] & DAC_STEPS) * plus_pF
        offset = int.from_bytes(image[CAP_OFFSET:CAP_GAIN], "big")
        total += (offset - OFFSET_ZERO) * OFFSET_STEP_PF
        noise_pF = 0.0
        if self.noisy:
            noise_pF = NOISE_PF[image[CONFIG] >> 3 & 7]
        total += self._random.gauss(0.0, noise_pF)
        return total * _gain(image[CAP_GAIN:]) / _gain(self.factory)


def _gain(gains: bytes) -> float:
    """Return the gain that CAP_GAIN sets: (2^16 + code) / 2^16."""
    return 1 + int.from_bytes(gains[:2], "big") / 2**16
