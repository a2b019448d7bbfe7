"""The board under test: opened, with what the steps have found so far."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import Configuration
from palpate.ad7746.inputs import Look
from palpate.ad7746.wiring import Mistake
from palpate.errors import quoted
from palpate.kit.chip import Chip, InputLevel
from palpate.sources.board import BoardSource
from palpate.sources.options import split
from palpate.sources.uri import open as open_source

_SCHEMES = ("usb", "i2c", "sim")
_IDLE_S = 60.0  # of a simulated probe, before its first press: longer than the steps without one take
PINS, EXCITATIONS = (1, 2), ("A", "B")


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
        for pin in PINS:
            for name in EXCITATIONS:
                self.levels[pin, name] = self.chip.level(pin, name, self.configuration)

    def excitation(self, pin: int) -> str:
        """Return the excitation to measure an input with: the one that it answers to, else the configured one."""
        found = [name for name in EXCITATIONS if self.answers(pin, name)]
        wanted = self.configuration.channel(int(self.configuration.hard_input != pin)).excitation
        return wanted if wanted in (*found, "AB") or not found else found[0]

    def answers(self, pin: int, excitation: str) -> bool:
        """Return whether a sensor is connected between an input and an excitation."""
        level = self.levels.get((pin, excitation))
        return level is not None and level.look.is_sensor

    def level(self, pin: int) -> InputLevel | None:
        """Return the level of an input that answers to its excitation; None: it does not."""
        excitation = self.excitation(pin)
        if excitation == "AB" and any(self.answers(pin, name) for name in EXCITATIONS):
            return self.chip.level(pin, excitation, self.configuration)
        return self.levels[pin, excitation] if self.answers(pin, excitation) else None

    def look(self, name: str, excitation: str) -> Look:
        """Return what an input, "1+" to "2-", has on an excitation pin, from the levels."""
        plus = self._look(int(name[0]), excitation, differential=False)
        if name[1] == "+" or plus.shorted:
            return plus
        both = self._look(int(name[0]), excitation, differential=True)
        return Look(plus.capacitance - both.capacitance, both.shorted)

    def _look(self, pin: int, excitation: str, *, differential: bool) -> Look:
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
