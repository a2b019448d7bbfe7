"""The board under test, measured without the driver, and what the steps have found so far.

Not tried on hardware. Single conversions are made by the driver. Its other results (pairs, their
times, the CAPDAC) are measured separately.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from statistics import mean
from typing import Any, NamedTuple

from palpate.ad7746 import registers
from palpate.ad7746.bus import Access, Clock, RegisterBus, repeated
from palpate.ad7746.configuration import HARD, Channel, Configuration
from palpate.ad7746.converter import CapdacSearch, ChannelReading, Converter
from palpate.ad7746.driver import LIMIT_NS
from palpate.ad7746.wiring import InputCapacitance, Mistake, measure_input
from palpate.messages import quoted
from palpate.samples import Status
from palpate.sources.board import BoardSource
from palpate.sources.options import split
from palpate.sources.registry import open as open_source

PINS = (1, 2)
EXCITATIONS = ("A", "B")
_SCHEMES = ("usb", "i2c", "sim")
# A simulated probe is idle so long before its first press: longer than the steps without one take.
_IDLE_S = 60.0
_TRIALS = 16  # of the search for a CAPDAC
_CENTRED_PF = 0.3
_PRECISE_PF = 0.1  # below, the CAPDAC's 20 % do not count, and a level has one digit more
_STEP_READINGS = 4  # whose mean is taken at each of two CAPDAC settings
_STEPS_APART = (16, 8, 4, 2, 1)  # distances of these two settings that are tried


Ask = Callable[[str], bool]
"""Tells the person at the board what to do now, and waits; False: leave the step out."""


class InputLevel(NamedTuple):
    """What an input measures with an excitation."""

    capdac: int
    pF: float
    total_pF: float
    error: bool = False

    @property
    def capacitance(self) -> InputCapacitance:
        """Capacitance at the input."""
        return InputCapacitance(self.total_pF, self.error)

    def __str__(self) -> str:
        """Return the level as text."""
        if self.error:
            return "shorted"
        if math.isnan(self.pF):
            return "out of range"
        if abs(self.total_pF) >= _PRECISE_PF:
            return f"{self.total_pF:.2f} pF"
        return f"{self.total_pF:.3f} pF"


class Chip:
    """The chip of an open board."""

    def __init__(self, bus: RegisterBus, clock: Clock) -> None:
        self._access = Access(bus, clock)
        self._converter = Converter(self._access, Configuration(), LIMIT_NS)
        self.counters = self._access.counters
        self.clock = clock

    def reset(self) -> bytes:
        """Reset the chip; return its registers."""
        self._access.repeated(self._access.bus.reset)
        self.clock.sleep(5 * registers.RESET_S)
        return self.registers()

    def registers(self, count: int = registers.REGISTERS) -> bytes:
        """Return the first registers."""
        return self._access.read(registers.STATUS, count)

    def capacitance(self, pin: int, channel: Channel, base: Configuration) -> ChannelReading:
        """Convert input CIN1 or CIN2 once, with `channel` and the other settings of `base`."""
        self._converter.configuration = replace(base, hard_input=pin, hard=channel)
        return repeated(lambda: self._converter.convert(HARD), self._count_lost)

    def voltage(self, mode: int) -> int:
        """Return a code of the voltage channel; `mode`: VT_TEMPERATURE or VT_SUPPLY."""
        return repeated(lambda: self._converter.voltage(mode), self._count_lost)

    def duration(self, base: Configuration, count: int) -> float:
        """Return the duration of a conversion, s.

        It is the middle of the interval that agrees with the observations of `count` conversions.
        """
        shortest = 0.0
        longest = math.inf
        for _ in range(count):
            self.capacitance(1, Channel(), base)
            seen = self._converter.seen
            shortest = max(shortest, seen.busy - seen.begun)
            longest = min(longest, seen.ended - seen.asked)
        return (shortest + longest) / 2e9

    def level(self, pin: int, excitation: str, base: Configuration) -> InputLevel:
        """Search the CAPDAC setting that brings an input into the range."""
        search = CapdacSearch(0)
        total_pF = math.nan
        for _ in range(_TRIALS):
            steps = search.steps
            channel = Channel(capdac=steps, excitation=excitation)
            reading = self.capacitance(pin, channel, base)
            if reading.status & Status.EXCITATION:
                return InputLevel(0, math.nan, math.nan, error=True)
            if not reading.status:
                if math.isnan(total_pF):  # at few steps, so with a small part of their 20 %
                    total_pF = steps * registers.DAC_STEP_PF + reading.capacitance
                if abs(reading.capacitance) <= _CENTRED_PF:
                    return InputLevel(steps, reading.capacitance, total_pF)
            search.advance(reading)
        if reading.status:
            return InputLevel(search.steps, math.nan, math.copysign(math.inf, search.steps))
        return InputLevel(search.steps, reading.capacitance, total_pF)

    def capdac_step(
        self, pin: int, excitation: str, level: InputLevel, base: Configuration
    ) -> float | None:
        """Return the size of this chip's CAPDAC step near a level, pF.

        Two settings are compared, as far apart as both are within the range. None: there are no
        two such settings, as the sensor is at the end of the range.
        """
        for apart in _STEPS_APART:
            lowest = max(level.capdac - apart // 2, -registers.DAC_STEPS)
            first = min(lowest, registers.DAC_STEPS - apart)
            before_pF = self._mean_pF(pin, Channel(capdac=first, excitation=excitation), base)
            second = first + apart
            after_pF = self._mean_pF(pin, Channel(capdac=second, excitation=excitation), base)
            if before_pF is not None and after_pF is not None:
                return (before_pF - after_pF) / apart
        return None

    def _mean_pF(self, pin: int, channel: Channel, base: Configuration) -> float | None:
        """Return the mean of several readings, pF; None: one is saturated."""
        values = []
        for _ in range(_STEP_READINGS):
            reading = self.capacitance(pin, channel, base)
            if reading.status:
                return None
            values.append(reading.capacitance)
        return mean(values)

    def _count_lost(self) -> None:
        self.counters.lost += 1


@dataclass
class BoardUnderTest:
    """An open board, and what the steps have found."""

    source: BoardSource
    chip: Chip
    is_kit: bool = True
    dump: bytes = b""
    levels: dict[tuple[int, str], InputLevel] = field(default_factory=dict)
    mistakes: list[Mistake] = field(default_factory=list)
    ask: Ask | None = None

    @property
    def configuration(self) -> Configuration:
        """Configuration that the options of the source give."""
        return self.source.driver.configuration

    @property
    def gains(self) -> bytes:
        """CAP_GAIN and VOLT_GAIN: set in the factory, different from chip to chip."""
        return self.dump[registers.CAP_GAIN :]

    @property
    def cannot_measure(self) -> bool:
        """Whether the driver refuses this wiring, because it does not allow to measure a ratio."""
        return any(mistake.fatal for mistake in self.mistakes)

    def scan(self) -> None:
        """Measure each input with each excitation."""
        self.levels = {}
        for pin in PINS:
            for excitation in EXCITATIONS:
                level = self.chip.level(pin, excitation, self.configuration)
                self.levels[pin, excitation] = level

    def excitation(self, pin: int) -> str:
        """Return the excitation for an input: the configured one, unless only the other answers."""
        channel = int(self.configuration.hard_input != pin)
        configured = self.configuration.channel(channel).excitation
        answering = self.answering(pin)
        if not answering or configured in (*answering, "AB"):
            return configured
        return answering[0]

    def answering(self, pin: int) -> list[str]:
        """Return the excitations between which and an input a sensor is connected."""
        return [name for name in EXCITATIONS if self.levels[pin, name].capacitance.is_sensor]

    def level(self, pin: int) -> InputLevel | None:
        """Return the level of an input with its excitation; None: there is no sensor."""
        excitation = self.excitation(pin)
        answering = self.answering(pin)
        if excitation == "AB" and answering:
            return self.chip.level(pin, excitation, self.configuration)
        if excitation in answering:
            return self.levels[pin, excitation]
        return None

    def measure_input(self, name: str, excitation: str) -> InputCapacitance:
        """Return the capacitance of an input, "1+" to "2-", with an excitation, from the levels."""
        return measure_input(self._capacitance, name, excitation)

    def _capacitance(self, pin: int, excitation: str, differential: bool) -> InputCapacitance:
        """Return the capacitance of CIN+, or of CIN+ minus CIN-, from the levels if possible."""
        if differential == self.configuration.differential:
            return self.levels[pin, excitation].capacitance
        other = replace(self.configuration, differential=differential)
        return self.chip.level(pin, excitation, other).capacitance


def open_board(uri: str, options: Mapping[str, Any]) -> BoardUnderTest:
    """Open a board by the URI of its source."""
    scheme, _, uri_options = split(uri)
    if scheme not in _SCHEMES:
        raise ValueError(
            f"source: got {quoted(uri)}, allowed: usb:, i2c:, or sim: for a simulated board"
        )
    all_options = dict(options)
    if scheme == "sim" and "idle" not in uri_options:
        all_options.setdefault("idle", _IDLE_S)
    source = open_source(uri, **all_options)
    assert isinstance(source, BoardSource)
    return BoardUnderTest(source, Chip(source.bus, source.clock), is_kit=scheme != "i2c")
