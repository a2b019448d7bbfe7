"""The board under test, measured without the driver, with what the steps have found so far. Not tried on hardware.

A conversion here shares only the data sheet, the configuration and the repetition of an access with the driver, so that
a mistake of the driver shows as a difference.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from statistics import mean
from typing import Any, NamedTuple

from palpate.ad7746 import datasheet
from palpate.ad7746.bus import Access, Clock, RegisterBus, repeated
from palpate.ad7746.configuration import HARD, Channel, Configuration, require_same
from palpate.ad7746.wiring import Look, Mistake, look
from palpate.errors import ProtocolError, SourceTimeout, quoted
from palpate.sources.board import BoardSource
from palpate.sources.options import split
from palpate.sources.uri import open as open_source

PINS, EXCITATIONS = (1, 2), ("A", "B")
_SCHEMES = ("usb", "i2c", "sim")
_IDLE_S = 60.0  # of a simulated probe, before its first press: longer than the steps without one take
_POLL_S = 0.00025
_EARLY = 0.9  # fraction of the nominal time after which RDY# is polled: the chip's clock is off by 5 %
_LATE_S = 0.05
_TRIALS = 16  # of the search for a CAPDAC
_CENTRED_PF = 0.3
_PRECISE_PF = 0.1  # below, the CAPDAC's 20 % do not count, and a level has one digit more


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


class InputLevel(NamedTuple):
    """What an input measures with an excitation."""

    capdac: int
    pF: float
    total_pF: float
    error: bool = False

    @property
    def look(self) -> Look:
        """What is there."""
        return Look(self.total_pF, self.error)

    def __str__(self) -> str:
        """Return it in words."""
        if self.error:
            return "shorted"
        if math.isnan(self.pF):
            return "out of range"
        return f"{self.total_pF:.2f} pF" if abs(self.total_pF) >= _PRECISE_PF else f"{self.total_pF:.3f} pF"


class Chip:
    """The chip of an open board."""

    def __init__(self, bus: RegisterBus, clock: Clock) -> None:
        self._access = Access(bus, clock)
        self.counters, self.clock = self._access.counters, clock

    def reset(self) -> bytes:
        """Reset the chip; return its registers."""
        self._access.repeated(self._access.bus.reset)
        self.clock.sleep(5 * datasheet.RESET_S)
        return self.registers()

    def registers(self, count: int = datasheet.REGISTERS) -> bytes:
        """Return the first registers."""
        return self._access.read(datasheet.STATUS, count)

    def capacitance(self, pin: int, channel: Channel, base: Configuration) -> Conversion:
        """Convert input CIN1 or CIN2 (`pin` 1 or 2) once, with the settings of `channel`, the other settings of `base`."""
        setup, in_range = replace(base, hard_input=pin, hard=channel).registers(HARD)
        return self._patiently(lambda: self._convert(setup, in_range, base.conversion_s, datasheet.RDYCAP))

    def voltage(self, mode: int) -> int:
        """Return a code of the voltage channel; `mode`: the bits VTMD of VT_SETUP."""
        setup = bytes([0, datasheet.VTEN | mode | datasheet.VTCHOP, 0, datasheet.SINGLE])
        seconds = datasheet.VT_CONVERSION_S[0]
        return self._patiently(lambda: self._convert(setup, b"", seconds, datasheet.RDYVT)).code

    def level(self, pin: int, excitation: str, base: Configuration) -> InputLevel:
        """Search the CAPDAC that brings an input into the range."""
        low, high, steps, total = -datasheet.DAC_STEPS, datasheet.DAC_STEPS, 0, math.nan
        for _ in range(_TRIALS):
            found = self.capacitance(pin, Channel(capdac=steps, excitation=excitation), base)
            if found.excitation_error:
                return InputLevel(0, math.nan, math.nan, error=True)
            out = datasheet.saturated(found.code)
            if not out and math.isnan(total):  # with few steps, so with a small part of their 20 %
                total = steps * datasheet.DAC_STEP_PF + found.pF
            if not out and abs(found.pF) <= _CENTRED_PF:
                return InputLevel(steps, found.pF, total)
            low, high = (steps, high) if found.pF > 0 else (low, steps)
            move = round(found.pF / datasheet.DAC_STEP_PF)
            steps = (low + high + (found.pF > 0)) // 2 if out else min(max(steps + move, low), high)
        if out:
            return InputLevel(steps, math.nan, math.copysign(math.inf, steps))
        return InputLevel(steps, found.pF, total)

    def capdac_step(self, pin: int, excitation: str, level: InputLevel, base: Configuration, apart: int = 16) -> float:
        """Return the size of this chip's CAPDAC step near a level, pF."""
        first = min(max(level.capdac - apart // 2, -datasheet.DAC_STEPS), datasheet.DAC_STEPS - apart)
        near = [Channel(capdac=steps, excitation=excitation) for steps in (first, first + apart)]
        more, less = (mean(self.capacitance(pin, channel, base).pF for _ in range(4)) for channel in near)
        return (more - less) / apart

    def _patiently(self, act: Callable[[], Conversion]) -> Conversion:
        def lost() -> None:
            self.counters.lost += 1

        return repeated(act, lost)

    def _convert(self, setup: bytes, in_range: bytes, nominal_s: float, bit: int) -> Conversion:
        if in_range:
            self._access.write(datasheet.CAPDAC_A, in_range)
        asked, begun = self._access.write(datasheet.CAP_SETUP, setup)
        busy, ended = self._wait(begun, nominal_s, bit)
        image = self._access.read(0, datasheet.CAP_GAIN)
        require_same(setup + in_range, image)
        if image[datasheet.STATUS] & bit:
            raise ProtocolError("the pin RDY# shows the end of a conversion, STATUS does not: it is stuck low")
        error = bool(image[datasheet.STATUS] & datasheet.EXCERR)
        data = datasheet.CAP_DATA if bit == datasheet.RDYCAP else datasheet.VT_DATA
        code = int.from_bytes(image[data : data + 3], "big")
        return Conversion(code, error, ((busy + ended) / 2 - begun) / 1e9, (begun - asked + ended - busy) / 1e9)

    def _wait(self, begun: int, nominal_s: float, bit: int) -> tuple[int, int]:
        """Return two times, ns: before the last poll of RDY# that found it running, after the first that did not."""
        self.clock.sleep(_EARLY * nominal_s - (self.clock.now_ns() - begun) / 1e9)
        busy = begun
        while True:
            asked = self.clock.now_ns()
            if self._access.repeated(self._access.bus.ready):
                return busy, self.clock.now_ns()
            busy = asked
            if self.clock.now_ns() > begun + (1.5 * nominal_s + _LATE_S) * 1e9:
                if not self.registers(1)[datasheet.STATUS] & bit:
                    raise ProtocolError("STATUS shows the end of a conversion, the pin RDY# does not: it is stuck high")
                raise SourceTimeout("a conversion does not end: the chip is not clocked, or its supply fails")
            self.clock.sleep(_POLL_S)


@dataclass
class Bench:
    """The board under test."""

    source: BoardSource
    chip: Chip
    is_kit: bool = True
    dump: bytes = b""
    levels: dict[tuple[int, str], InputLevel] = field(default_factory=dict)
    steps_pF: dict[int, float] = field(default_factory=dict)
    mistakes: list[Mistake] = field(default_factory=list)

    @property
    def configuration(self) -> Configuration:
        """Configuration that the options of the source give."""
        return self.source.driver.configuration

    @property
    def gains(self) -> bytes:
        """CAP_GAIN and VOLT_GAIN: set in the factory, different from chip to chip."""
        return self.dump[datasheet.CAP_GAIN :]

    @property
    def cannot_measure(self) -> bool:
        """Whether the wiring lets no ratio be measured, so that the driver refuses."""
        return any(mistake.fatal for mistake in self.mistakes)

    def scan(self) -> None:
        """Measure each input with each excitation."""
        places = [(pin, name) for pin in PINS for name in EXCITATIONS]
        self.levels = {place: self.chip.level(*place, self.configuration) for place in places}

    def excitation(self, pin: int) -> str:
        """Return the excitation to measure an input with: the one that it answers to, else the configured one."""
        found = [name for name in EXCITATIONS if self.answers(pin, name)]
        wanted = self.configuration.channel(int(self.configuration.hard_input != pin)).excitation
        return wanted if wanted in (*found, "AB") or not found else found[0]

    def answers(self, pin: int, excitation: str) -> bool:
        """Return whether a sensor is connected between an input and an excitation."""
        return self.levels[pin, excitation].look.is_sensor

    def level(self, pin: int) -> InputLevel | None:
        """Return the level of an input that answers to its excitation; None: it does not."""
        excitation = self.excitation(pin)
        if excitation == "AB" and any(self.answers(pin, name) for name in EXCITATIONS):
            return self.chip.level(pin, excitation, self.configuration)
        return self.levels[pin, excitation] if self.answers(pin, excitation) else None

    def look(self, name: str, excitation: str) -> Look:
        """Return what an input, "1+" to "2-", has on an excitation pin, from the levels."""
        return look(self._look, name, excitation)

    def _look(self, pin: int, excitation: str, differential: bool) -> Look:
        """Return what CIN+, or CIN+ minus CIN-, has; the configuration's is known."""
        if differential == self.configuration.differential:
            return self.levels[pin, excitation].look
        return self.chip.level(pin, excitation, replace(self.configuration, differential=differential)).look


def open_bench(uri: str, options: Mapping[str, Any]) -> Bench:
    """Open a board by the name of its source."""
    scheme, _, given = split(uri)
    if scheme not in _SCHEMES:
        raise ValueError(f"source: got {quoted(uri)}, allowed: usb:, i2c:, or sim: for a simulated board")
    simulated = {"idle": _IDLE_S} if scheme == "sim" and "idle" not in given else {}
    source = open_source(uri, **{**simulated, **options})
    assert isinstance(source, BoardSource)
    return Bench(source, Chip(source.bus, source.clock), is_kit=scheme != "i2c")
