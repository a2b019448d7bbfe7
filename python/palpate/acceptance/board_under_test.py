"""The board under test, measured without the driver, with what the steps have found so far. Not tried on hardware.

Single conversions are those of the driver; what the driver makes of them (pairs, their times, the CAPDAC) is measured apart.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from statistics import mean
from typing import Any, NamedTuple

from palpate.ad7746 import registers
from palpate.ad7746.bus import Access, Clock, RegisterBus, repeated
from palpate.ad7746.configuration import HARD, Channel, Configuration
from palpate.ad7746.converter import Converter, Reading
from palpate.ad7746.driver import LIMIT_NS
from palpate.ad7746.wiring import Look, Mistake, look
from palpate.messages import quoted
from palpate.samples import Status
from palpate.sources.board import BoardSource
from palpate.sources.options import split
from palpate.sources.registry import open as open_source

PINS, EXCITATIONS = (1, 2), ("A", "B")
_SCHEMES = ("usb", "i2c", "sim")
_IDLE_S = (
    60.0  # of a simulated probe, before its first press: longer than the steps without one take
)
_TRIALS = 16  # of the search for a CAPDAC
_CENTRED_PF = 0.3
_PRECISE_PF = 0.1  # below, the CAPDAC's 20 % do not count, and a level has one digit more


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
        return (
            f"{self.total_pF:.2f} pF"
            if abs(self.total_pF) >= _PRECISE_PF
            else f"{self.total_pF:.3f} pF"
        )


class Chip:
    """The chip of an open board."""

    def __init__(self, bus: RegisterBus, clock: Clock) -> None:
        self._access = Access(bus, clock)
        self._converter = Converter(self._access, Configuration(), LIMIT_NS)
        self.counters, self.clock = self._access.counters, clock

    def reset(self) -> bytes:
        """Reset the chip; return its registers."""
        self._access.repeated(self._access.bus.reset)
        self.clock.sleep(5 * registers.RESET_S)
        return self.registers()

    def registers(self, count: int = registers.REGISTERS) -> bytes:
        """Return the first registers."""
        return self._access.read(registers.STATUS, count)

    def capacitance(self, pin: int, channel: Channel, base: Configuration) -> Reading:
        """Convert input CIN1 or CIN2 (`pin` 1 or 2) once, with the settings of `channel`, the other settings of `base`."""
        self._converter.configuration = replace(base, hard_input=pin, hard=channel)
        return repeated(lambda: self._converter.convert(HARD), self._lost)

    def voltage(self, mode: int) -> int:
        """Return a code of the voltage channel; `mode`: VT_TEMPERATURE or VT_SUPPLY."""
        return repeated(lambda: self._converter.voltage(mode), self._lost)

    def duration(self, base: Configuration, times: int) -> float:
        """Return the duration of a conversion, s: the middle of what agrees with all that the computer saw of several."""
        low, high = 0.0, math.inf
        for _ in range(times):
            self.capacitance(1, Channel(), base)
            asked, begun, busy, ended = self._converter.seen
            low, high = max(low, busy - begun), min(high, ended - asked)
        return (low + high) / 2e9

    def level(self, pin: int, excitation: str, base: Configuration) -> InputLevel:
        """Search the CAPDAC that brings an input into the range."""
        low, high, steps, total = -registers.DAC_STEPS, registers.DAC_STEPS, 0, math.nan
        for _ in range(_TRIALS):
            found = self.capacitance(pin, Channel(capdac=steps, excitation=excitation), base)
            if found.status & Status.EXCITATION:
                return InputLevel(0, math.nan, math.nan, error=True)
            out = bool(found.status)
            if not out and math.isnan(total):  # with few steps, so with a small part of their 20 %
                total = steps * registers.DAC_STEP_PF + found.capacitance
            if not out and abs(found.capacitance) <= _CENTRED_PF:
                return InputLevel(steps, found.capacitance, total)
            low, high = (steps, high) if found.capacitance > 0 else (low, steps)
            move = round(found.capacitance / registers.DAC_STEP_PF)
            steps = (
                (low + high + (found.capacitance > 0)) // 2
                if out
                else min(max(steps + move, low), high)
            )
        if out:
            return InputLevel(steps, math.nan, math.copysign(math.inf, steps))
        return InputLevel(steps, found.capacitance, total)

    def capdac_step(
        self, pin: int, excitation: str, level: InputLevel, base: Configuration, apart: int = 16
    ) -> float:
        """Return the size of this chip's CAPDAC step near a level, pF."""
        first = min(
            max(level.capdac - apart // 2, -registers.DAC_STEPS), registers.DAC_STEPS - apart
        )
        near = [Channel(capdac=steps, excitation=excitation) for steps in (first, first + apart)]
        more, less = (
            mean(self.capacitance(pin, channel, base).capacitance for _ in range(4))
            for channel in near
        )
        return (more - less) / apart

    def _lost(self) -> None:
        self.counters.lost += 1


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
        return self.dump[registers.CAP_GAIN :]

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
        return self.chip.level(
            pin, excitation, replace(self.configuration, differential=differential)
        ).look


def open_bench(uri: str, options: Mapping[str, Any]) -> Bench:
    """Open a board by the name of its source."""
    scheme, _, given = split(uri)
    if scheme not in _SCHEMES:
        raise ValueError(
            f"source: got {quoted(uri)}, allowed: usb:, i2c:, or sim: for a simulated board"
        )
    simulated = {"idle": _IDLE_S} if scheme == "sim" and "idle" not in given else {}
    source = open_source(uri, **{**simulated, **options})
    assert isinstance(source, BoardSource)
    return Bench(source, Chip(source.bus, source.clock), is_kit=scheme != "i2c")
