"""The board under test: opened, with what the steps have found so far."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from palpate.ad7746 import datasheet
from palpate.ad7746.configuration import HARD, Channel, Configuration
from palpate.ad7746.inputs import Look
from palpate.ad7746.wiring import Mistake
from palpate.errors import quoted
from palpate.kit.chip import Chip, Conversion, Level
from palpate.sources.board import BoardSource
from palpate.sources.options import split
from palpate.sources.uri import open as open_source

_SCHEMES = ("usb", "i2c", "sim")
_IDLE_S = 60.0  # of a simulated probe, before its first press: longer than the steps without one take
EXCITATIONS = ("A", "B")


@dataclass
class Bench:
    """The board under test.

    Attributes
    ----------
    source : BoardSource
        Open, not started.
    chip : Chip
        The same chip, without the driver.
    is_kit : bool
        Whether it is the evaluation kit, with its USB plug, its sockets and its length sensor.
    dump : bytes
        The registers after the reset; empty: not read.
    levels : dict
        (pin, excitation) -> level.
    steps_pF : dict
        Pin -> size of its CAPDAC step, pF.
    mistakes : list of Mistake
        Of the wiring.
    """

    source: BoardSource
    chip: Chip
    is_kit: bool = True
    dump: bytes = b""
    levels: dict[tuple[int, str], Level] = field(default_factory=dict)
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

    def pin(self, channel: int) -> int:
        """Return the input, 1 or 2, of the hard (0) or soft (1) bump."""
        return self.configuration.hard_input if channel == HARD else 3 - self.configuration.hard_input

    def excitation(self, pin: int) -> str:
        """Return the excitation to measure an input with: the one that it answers to, else the configured one."""
        found = [name for name in EXCITATIONS if self.answers(pin, name)]
        wanted = self.configuration.channel(int(self.pin(HARD) != pin)).excitation
        return wanted if wanted in (*found, "AB") or not found else found[0]

    def answers(self, pin: int, excitation: str) -> bool:
        """Return whether a sensor is connected between an input and an excitation."""
        level = self.levels.get((pin, excitation))
        return level is not None and Look(level.total_pF, level.error).is_sensor

    def level(self, pin: int) -> Level | None:
        """Return the level of an input that answers to its excitation; None: it does not."""
        excitation = self.excitation(pin)
        if excitation == "AB" and any(self.answers(pin, name) for name in EXCITATIONS):
            return self.chip.level(pin, excitation, self.configuration)
        return self.levels[pin, excitation] if self.answers(pin, excitation) else None

    def look(self, name: str, excitation: str) -> Look:
        """Return what an input, "1+" to "2-", has on an excitation pin, from the levels."""
        plus = self._level(int(name[0]), excitation, differential=False)
        if name[1] == "+" or plus.error:
            return Look(plus.total_pF, plus.error)
        both = self._level(int(name[0]), excitation, differential=True)
        return Look(plus.total_pF - both.total_pF, both.error)

    def _level(self, pin: int, excitation: str, *, differential: bool) -> Level:
        """Return the level of CIN+, or of CIN+ minus CIN-; the configuration's is known."""
        if differential == self.configuration.differential:
            return self.levels[pin, excitation]
        return self.chip.level(pin, excitation, replace(self.configuration, differential=differential))

    def convert(self, pin: int, level: Level, base: Configuration) -> Conversion:
        """Convert an input once, at its level."""
        return self.chip.capacitance(pin, Channel(capdac=level.capdac, excitation=self.excitation(pin)), base)


def open_bench(uri: str, options: Mapping[str, Any]) -> Bench:
    """Open a board by the name of its source.

    Raises
    ------
    ValueError
        The source is no board with an AD7746, or an option is wrong.
    SourceError
        The board was not found, or cannot be used.
    """
    scheme, _, given = split(uri)
    if scheme not in _SCHEMES:
        raise ValueError(f"source: got {quoted(uri)}, allowed: usb:, i2c:, or sim: for a simulated board")
    simulated = {"idle": _IDLE_S} if scheme == "sim" and "idle" not in given else {}
    source = open_source(uri, **{**simulated, **options})
    assert isinstance(source, BoardSource)
    return Bench(source, Chip(source.bus, source.clock), is_kit=scheme != "i2c")
