"""Single conversions for the acceptance of a board, without the driver. Not tried on hardware.

It shares only the data sheet, the configuration and the repetition of an access with the driver, so that a mistake of
the driver shows as a difference.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from statistics import mean
from typing import NamedTuple, TypeVar

from palpate.ad7746 import datasheet
from palpate.ad7746.bus import TRIES, Counters, RegisterBus, repeated
from palpate.ad7746.clock import Clock
from palpate.ad7746.configuration import HARD, Channel, Configuration, differs
from palpate.errors import ProtocolError, SourceTimeout

_POLL_S = 0.00025
_EARLY = 0.9  # fraction of the nominal time after which RDY# is polled: the chip's clock is off by 5 %
_LATE_S = 0.05
_TRIALS = 16  # of the search for a CAPDAC
_CENTRED_PF = 0.3
_PRECISE_PF = 0.1  # below, the CAPDAC's 20 % do not count, and a level has one digit more

T = TypeVar("T")


class Conversion(NamedTuple):
    """A conversion: 24-bit code, bit EXCERR, its duration as seen by the computer, and how uncertain that is, s."""

    code: int
    excitation_error: bool
    seconds: float
    uncertainty_s: float

    @property
    def pF(self) -> float:
        """Capacitance after the compensation by the CAPDAC, pF."""
        return datasheet.capacitance_pF(self.code)


class Level(NamedTuple):
    """What an input measures with an excitation.

    Attributes
    ----------
    capdac : int
        Steps that move the signal to the middle of the range.
    pF : float
        The rest, pF; nan if the signal is not in the range.
    total_pF : float
        Capacitance, pF, above 4 pF uncertain by the 20 % of the CAPDAC; +-inf: out of range; nan: not measured.
    error : bool
        EXCERR: the excitation is shorted or overloaded.
    """

    capdac: int
    pF: float
    total_pF: float
    error: bool = False

    def __str__(self) -> str:
        """Return it in words.

        Examples
        --------
        >>> nan = float("nan")
        >>> str(Level(42, 0.03, 6.92)), str(Level(0, 0.0021, 0.0021)), str(Level(0, nan, nan, error=True))
        ('6.92 pF', '0.002 pF', 'shorted')
        """
        if self.error:
            return "shorted"
        if math.isnan(self.pF):
            return "out of range"
        return f"{self.total_pF:.2f} pF" if abs(self.total_pF) >= _PRECISE_PF else f"{self.total_pF:.3f} pF"


class Chip:
    """The chip of an open board.

    Parameters
    ----------
    bus : RegisterBus
    clock : Clock
        The clock of the bus.

    Raises
    ------
    SourceError
        From every method that accesses the chip, after the repetitions.
    """

    def __init__(self, bus: RegisterBus, clock: Clock) -> None:
        self.counters: Counters = Counters()
        self.clock = clock
        self._bus = bus

    def reset(self) -> bytes:
        """Reset the chip; return its registers."""
        self._access(self._bus.reset)
        self.clock.sleep(5 * datasheet.RESET_S)
        return self.registers()

    def registers(self, count: int = datasheet.REGISTERS) -> bytes:
        """Return the first registers."""
        return self._access(lambda: self._bus.read(datasheet.STATUS, count))

    def capacitance(self, pin: int, channel: Channel, base: Configuration) -> Conversion:
        """Convert input CIN1 or CIN2 (`pin` 1 or 2) once, with the settings of `channel`, the others of `base`."""
        setup, in_range = replace(base, hard_input=pin, hard=channel).registers(HARD)
        return self._patiently(lambda: self._convert(setup, in_range, base.conversion_s, datasheet.RDYCAP))

    def voltage(self, mode: int) -> int:
        """Return a code of the voltage channel; `mode`: the bits VTMD of VT_SETUP."""
        setup = bytes([0, datasheet.VTEN | mode | datasheet.VTCHOP, 0, datasheet.SINGLE])
        seconds = datasheet.VT_CONVERSION_S[0]
        return self._patiently(lambda: self._convert(setup, b"", seconds, datasheet.RDYVT, datasheet.VT_DATA)).code

    def level(self, pin: int, excitation: str, base: Configuration) -> Level:
        """Search the CAPDAC that brings an input into the range."""
        low, high, steps, total = -datasheet.DAC_STEPS, datasheet.DAC_STEPS, 0, math.nan
        for _ in range(_TRIALS):
            found = self.capacitance(pin, Channel(capdac=steps, excitation=excitation), base)
            if found.excitation_error:
                return Level(0, math.nan, math.nan, error=True)
            out = datasheet.saturated(found.code)
            if not out and math.isnan(total):  # with few steps, so with a small part of their 20 %
                total = steps * datasheet.DAC_STEP_PF + found.pF
            if not out and abs(found.pF) <= _CENTRED_PF:
                return Level(steps, found.pF, total)
            low, high = (steps, high) if found.pF > 0 else (low, steps)
            move = round(found.pF / datasheet.DAC_STEP_PF)
            steps = (low + high + (found.pF > 0)) // 2 if out else min(max(steps + move, low), high)
        return Level(steps, math.nan, math.copysign(math.inf, steps)) if out else Level(steps, found.pF, total)

    def capdac_step(self, pin: int, excitation: str, level: Level, base: Configuration, apart: int = 16) -> float:
        """Return the size of this chip's CAPDAC step near a level, pF."""
        first = min(max(level.capdac - apart // 2, -datasheet.DAC_STEPS), datasheet.DAC_STEPS - apart)
        near = [Channel(capdac=steps, excitation=excitation) for steps in (first, first + apart)]
        more, less = (mean(self.capacitance(pin, channel, base).pF for _ in range(4)) for channel in near)
        return (more - less) / apart

    def _patiently(self, act: Callable[[], T]) -> T:
        for _ in range(TRIES - 1):
            try:
                return act()
            except (SourceTimeout, ProtocolError):
                self.counters.lost += 1
        return act()

    def _convert(
        self, setup: bytes, in_range: bytes, nominal_s: float, bit: int, data: int = datasheet.CAP_DATA
    ) -> Conversion:
        if in_range:
            self._access(lambda: self._bus.write(datasheet.CAPDAC_A, in_range))
        asked, begun = self._access(lambda: (self.clock.now_ns(), self._bus.write(datasheet.CAP_SETUP, setup)))
        busy, ended = self._wait(begun, nominal_s, bit)
        image = self._access(lambda: self._bus.read(0, datasheet.CAP_GAIN))
        _check(setup + in_range, image, bit)
        error = bool(image[datasheet.STATUS] & datasheet.EXCERR)
        code = int.from_bytes(image[data : data + 3], "big")
        return Conversion(code, error, ((busy + ended) / 2 - begun) / 1e9, (begun - asked + ended - busy) / 1e9)

    def _wait(self, begun: int, nominal_s: float, bit: int) -> tuple[int, int]:
        """Return two times, ns: before the last poll of RDY# that found it running, after the first that did not."""
        self.clock.sleep(_EARLY * nominal_s - (self.clock.now_ns() - begun) / 1e9)
        busy = begun
        while True:
            asked = self.clock.now_ns()
            ready = self._access(self._bus.ready)
            now = self.clock.now_ns()
            if ready:
                return busy, now
            busy = asked
            if now > begun + (1.5 * nominal_s + _LATE_S) * 1e9:
                raise self._late(bit)
            self.clock.sleep(_POLL_S)

    def _late(self, bit: int) -> ProtocolError | SourceTimeout:
        if not self.registers(1)[datasheet.STATUS] & bit:
            return ProtocolError("STATUS shows the end of a conversion, the pin RDY# does not: it is stuck high")
        return SourceTimeout("a conversion does not end: the chip is not clocked, or its supply fails")

    def _access(self, act: Callable[[], T]) -> T:
        return repeated(act, self.counters, self.clock, lambda: None)


def _check(wanted: bytes, image: bytes, bit: int) -> None:
    register = differs(wanted, image[datasheet.CAP_SETUP :])
    if register is not None:
        wrote = wanted[register - datasheet.CAP_SETUP]
        raise ProtocolError(f"register 0x{register:02X}: got 0x{image[register]:02X}, wrote 0x{wrote:02X}: another "
                            "program uses the board, or the chip had no supply")  # fmt: skip
    if image[datasheet.STATUS] & bit:
        raise ProtocolError("the pin RDY# shows the end of a conversion, STATUS does not: it is stuck low")
