"""The AD7746 as a source: `usb:` (evaluation kit) and `i2c:`. Not tried on hardware."""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any, Self

from palpate.ad7746.bus import Clock, RealClock, RegisterBus
from palpate.ad7746.configuration import HARD, SOFT, Channel, Configuration
from palpate.ad7746.driver import LIMIT_NS, REPLUG_S, Ad7746
from palpate.ad7746.registers import SATURATED_PF
from palpate.ad7746.wiring import Wiring
from palpate.ad7746.wiring_watch import WiringWatch
from palpate.errors import DeviceNotFound, DeviceRefused, SourceError
from palpate.files import Json
from palpate.messages import quoted
from palpate.samples import Sample, Status
from palpate.source_events import (
    Gap,
    GapCause,
    SourceEvent,
    TroubleBegan,
    TroubleEnded,
    TroubleKind,
)
from palpate.sources.base import SampleSource
from palpate.sources.options import Options, number, option, text, whole_number, yes_no

_PINS = ("A", "B", "AB")
_CONDITIONS_NS = 10_000_000_000
_INPUT = whole_number(1, 2)


def excitation_pins(name: str, value: Any) -> tuple[str, str]:
    """Return the excitation pins of the hard and the soft bump; one word is for both."""
    words = str(value).split(",")
    if len(words) > 2 or not set(words) <= set(_PINS):
        pins = ", ".join(_PINS)
        raise ValueError(
            f"{name}: got {quoted(value)}, allowed: {pins}, or two of them: HARD,SOFT as B,A"
        )
    return words[0], words[-1]


@dataclass(frozen=True)
class ConverterOptions(Options):
    """Options of the AD7746."""

    capf: int | None = option(whole_number(0, 7), None)
    """Speed: 0, 11 ms for a conversion, to 7, 110 ms; 4, 62 ms, rejects mains frequency. Default: 0, or
    that of the scenario."""
    excitation: tuple[str, str] = option(excitation_pins, (Channel.excitation, Channel.excitation))
    """Excitation pins that the bumps are wired to."""
    level: int = option(whole_number(0, 3), Configuration.level)
    """Excitation voltage: VDD/8, VDD/4, 3/8 VDD or VDD/2."""
    chop: bool = option(yes_no, Configuration.chop)
    """Chopping of the capacitive channel, bit CAPCHOP."""
    differential: bool = option(yes_no, Configuration.differential)
    """Measure CIN+ minus CIN-, bit CAPDIFF, in place of CIN+ alone."""
    hard_input: int | None = option(_INPUT, None)
    """Input of the hard bump, CIN1 or CIN2. Default: CIN1, or the one that `soft_input` leaves."""
    soft_input: int | None = option(_INPUT, None)
    """Input of the soft bump. Default: the other one."""
    replug: float = option(number(0, 86400), REPLUG_S)
    """Longest time to wait for a board that was unplugged, s."""

    @property
    def configuration(self) -> Configuration:
        """The configuration of the converter."""
        hard_input = self.hard_input or 3 - (self.soft_input or 2)
        if self.soft_input == hard_input:
            raise ValueError(f"soft_input: got {hard_input}, as hard_input, allowed: the other one")
        hard_pins, soft_pins = self.excitation
        return Configuration(
            capf=self.capf or 0,
            hard=Channel(excitation=hard_pins),
            soft=Channel(excitation=soft_pins),
            hard_input=hard_input,
            level=self.level,
            chop=self.chop,
            differential=self.differential,
        )


@dataclass(frozen=True)
class UsbOptions(ConverterOptions):
    """Options of `usb:`."""

    firmware: str | None = option(text, None)
    """Path of the firmware file, for a board without one."""
    backend: Any = None  # of pyusb
    clock: Clock | None = None


@dataclass(frozen=True)
class I2cOptions(ConverterOptions):
    """Options of `i2c:`."""

    open_bus: Any = None  # in place of smbus2.SMBus
    clock: Clock | None = None


class BoardSource(SampleSource):
    """Pairs of both channels of the AD7746, until it is interrupted."""

    def __init__(
        self,
        bus: RegisterBus,
        options: ConverterOptions,
        clock: Clock,
        *,
        limit_ns: int = LIMIT_NS,
        kit: bool = True,
    ) -> None:
        self.bus = bus
        self.clock = clock
        self.driver = Ad7746(
            bus,
            options.configuration,
            clock,
            replug_s=options.replug,
            notify=lambda message: self.notify(message),  # which may be set later
            limit_ns=limit_ns,
        )
        self._watches = [WiringWatch(number, self.driver.measure_input) for number in (HARD, SOFT)]
        self._kit = kit
        self._trouble = ""  # of the wiring
        self._first: list[SourceEvent] = []  # events from before the first pair
        self._due_ns = 0
        self._started = False

    def __enter__(self) -> Self:
        """Configure the converter, check the wiring, and set the range around both idle signals."""
        try:
            self.driver.start()
            self._check_wiring()
            self.driver.auto_capdac()
        except BaseException:
            self.close()
            raise
        self._started = True
        self._first += self._measure_conditions()
        return self

    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs, and temperature and supply of the chip: first, last, and every 10 s."""
        if not self._started:
            self.__enter__()
        while self._first:
            yield self._first.pop(0)
        try:
            yield from self._pairs()
        except Exception:
            yield from self._measure_conditions()
            raise
        yield from self._measure_conditions()

    def _pairs(self) -> Iterator[Sample | SourceEvent]:
        seq = 0
        is_read = True
        while is_read:
            is_read = False
            for item in self.driver.read(seq):
                yield item
                if isinstance(item, Sample):
                    is_read = True
                    seq = item.seq + 1
                    yield from self._watch_wiring(item)
            if is_read and self.driver.conditions_are_free and self.clock.now_ns() >= self._due_ns:
                yield from self._measure_conditions()

    def _measure_conditions(self) -> Iterator[SourceEvent]:
        self._due_ns = self.clock.now_ns() + _CONDITIONS_NS
        measured = self.driver.read_conditions()
        if measured:
            yield measured

    def _check_wiring(self) -> None:
        wiring = Wiring(self.driver.measure_input, self.driver.configuration, kit=self._kit)
        mistakes = wiring.mistakes()
        fatal = [str(mistake) for mistake in mistakes if mistake.fatal]
        if fatal:
            raise DeviceRefused("; ".join(fatal))
        if mistakes:
            hint = "; ".join(map(str, mistakes))
            self._first.append(TroubleBegan(TroubleKind.HINT, hint))
        for mistake in mistakes:
            self.notify(str(mistake))

    def _watch_wiring(self, sample: Sample) -> Iterator[SourceEvent]:
        """Yield the trouble and the gap of a wire that came off or was put on, or of a short."""
        if sample.status & Status.LOST:
            return
        changes: list[str] = []
        with suppress(SourceError):  # the next pair meets the same error
            for watch in self._watches:
                changes.append(watch.take(sample, self.driver.configuration))
        change = _joined(changes)
        if change:
            yield Gap(GapCause.WIRING, change)
        trouble = _joined(watch.text for watch in self._watches)
        if trouble != self._trouble:
            self._trouble = trouble
            if trouble:
                yield TroubleBegan(TroubleKind.WIRING, trouble)
            else:
                yield TroubleEnded(TroubleKind.WIRING)

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the driver."""
        return asdict(self.driver.counters)

    @property
    def fastest_period_s(self) -> float:
        """Time from one pair to the next on a computer that is never late, s."""
        return self.driver.fastest_period_s

    @property
    def zero_ns(self) -> int | None:
        """Begin of the measurement on the clock of the computer."""
        return self.driver.zero_ns

    def centre(self) -> None:
        """Set the CAPDACs again before the next pair, with both signals mid-range."""
        self.driver.centre()

    def describe(self) -> Json:
        """Return the description of the driver, with the range of the converter."""
        return {**self.driver.describe(), "full_scale_pF": SATURATED_PF}

    def interrupt(self) -> None:
        """Stop the iteration."""
        self.driver.interrupt()

    def close(self) -> None:
        """Close the device."""
        self.driver.close()


def _joined(texts: Iterable[str]) -> str:
    return "; ".join(filter(None, texts))


def open_usb(address: str, values: Mapping[str, object]) -> BoardSource:
    """Return the source of `usb:` or `usb:BUS/ADDRESS`, the evaluation kit."""
    from palpate.ad7746.evalkit.usb_bus import EvalKit

    options = UsbOptions.parse("usb", values)
    if not re.fullmatch(r"(\d{1,3}/\d{1,3})?", address):
        allowed = "BUS/ADDRESS as `lsusb` shows them, or nothing"
        raise ValueError(f"usb: got address {quoted(address)}, allowed: {allowed}")
    clock = options.clock or RealClock()
    place = map(int, filter(None, address.split("/")))
    try:
        kit = EvalKit(*place, firmware=options.firmware, backend=options.backend, clock=clock)
    except DeviceRefused:  # its message says what to do
        raise
    except DeviceNotFound as error:
        raise DeviceNotFound(
            f"{error}; `palpate doctor` looks at the rest, and sim: needs no board"
        ) from error
    return BoardSource(kit, options, clock)


def open_i2c(address: str, values: Mapping[str, object]) -> BoardSource:
    """Return the source of `i2c:/dev/i2c-N`."""
    from palpate.ad7746.i2c import I2cBus

    options = I2cOptions.parse("i2c", values)
    if not address:
        raise ValueError("i2c: got no address, allowed: a bus, for example i2c:/dev/i2c-1")
    clock = options.clock or RealClock()
    return BoardSource(I2cBus(address, clock, options.open_bus), options, clock, kit=False)
