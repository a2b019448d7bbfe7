"""The AD7746 as a source: `usb:` (evaluation kit) and `i2c:`. Not tried on hardware."""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Self

from palpate.ad7746.bus import Clock, RealClock, RegisterBus
from palpate.ad7746.configuration import HARD, SOFT, Channel, Configuration
from palpate.ad7746.driver import LIMIT_NS, REPLUG_S, Ad7746
from palpate.ad7746.registers import SATURATED_PF
from palpate.ad7746.wiring import Wiring
from palpate.ad7746.wiring_watch import WiringWatch
from palpate.errors import DeviceNotFound, DeviceRefused, PalpateError, SourceError
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
from palpate.sources.options import Check, anything, checked, number, text, yes_no

if TYPE_CHECKING:
    from palpate.ad7746.evalkit.discovery import Board, BoardSearch
    from palpate.ad7746.evalkit.usb_bus import EvalKit

_PINS = ("A", "B", "AB")
_CONDITIONS_NS = 10_000_000_000


def excitation(name: str, value: Any) -> tuple[str, str]:
    """Return the excitation pins of the hard and the soft bump; one word is for both."""
    words = str(value).split(",")
    if len(words) > 2 or not set(words) <= set(_PINS):
        raise ValueError(
            f"{name}: got {quoted(value)}, allowed: {', '.join(_PINS)}, or two of them: HARD,SOFT as B,A"
        )
    return words[0], words[-1]


# Options of `Configuration`, and the longest time to wait for an unplugged device, s.
CONVERTER: dict[str, Check] = {
    "capf": number(0, 7, whole=True),
    "excitation": excitation,
    "level": number(0, 3, whole=True),
    "chop": yes_no,
    "differential": yes_no,
    "hard_input": number(1, 2, whole=True),
    "soft_input": number(1, 2, whole=True),
    "replug": number(0, 86400),
}


def configuration_of(options: Mapping[str, Any]) -> Configuration:
    """Return the configuration of checked options."""
    chosen = {
        name: options[name] for name in ("capf", "level", "chop", "differential") if name in options
    }
    hard, soft = options.get("excitation", (Channel.excitation, Channel.excitation))
    hard_input = options.get("hard_input", 3 - options.get("soft_input", 2))
    if options.get("soft_input") == hard_input:
        raise ValueError(f"soft_input: got {hard_input}, as hard_input, allowed: the other one")
    return Configuration(
        **chosen,
        hard_input=hard_input,
        hard=Channel(excitation=hard),
        soft=Channel(excitation=soft),
    )


class BoardSource(SampleSource):
    """Pairs of both channels of the AD7746, until it is interrupted."""

    def __init__(
        self, bus: RegisterBus, options: Mapping[str, Any], clock: Clock, *, kit: bool = True
    ) -> None:
        self.bus: RegisterBus = bus
        self.clock: Clock = clock
        how = {
            "replug_s": options.get("replug", REPLUG_S),
            "limit_ns": options.get("limit_ns", LIMIT_NS),
        }
        notify = lambda message: self.notify(message)  # which may be set later
        self.driver: Ad7746 = Ad7746(bus, configuration_of(options), clock, notify=notify, **how)
        self._watches = [WiringWatch(number, self.driver.measure_input) for number in (HARD, SOFT)]
        self._kit = kit
        self._trouble = ""  # of the wiring
        self._first: list[SourceEvent] = []  # events from before the first pair
        self._due_ns = 0
        self._started = False

    def __enter__(self) -> Self:
        """Configure the converter, check the wiring, and set the CAPDACs so that both idle signals are in its range."""
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
        """Yield the pairs; temperature and supply of the chip at the beginning, at the end, and every 10 s between."""
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
        mistakes = Wiring(
            self.driver.measure_input, self.driver.configuration, kit=self._kit
        ).mistakes()
        if fatal := [str(mistake) for mistake in mistakes if mistake.fatal]:
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
    def zero_ns(self) -> int | None:
        """Begin of the measurement on the clock of the computer."""
        return self.driver.zero_ns

    def centre(self) -> None:
        """Set the CAPDACs again, so that both signals are in the middle of the range, before the next pair."""
        self.driver.centre()

    def describe(self) -> dict[str, Any]:
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


class WatchedKit(BoardSource):
    """Pairs of the evaluation kit, with a message within a second if a board is plugged in or unplugged."""

    def __init__(
        self,
        kit: "EvalKit",
        options: Mapping[str, Any],
        clock: Clock,
        look: "BoardSearch | None" = None,
    ) -> None:
        super().__init__(kit, options, clock)
        self._evalkit = kit
        self._look = look
        self._hotplug = ExitStack()

    def __enter__(self) -> Self:
        """Configure the converter, as `BoardSource`, and begin to watch."""
        from palpate.ad7746.evalkit.discovery import Hotplug

        super().__enter__()
        with suppress(OSError, PalpateError):  # a measurement does not need it
            self._hotplug.callback(Hotplug(self._tell, self._look).close)
        return self

    def close(self) -> None:
        """Close the device, and end the watch."""
        self._hotplug.close()
        super().close()

    def _tell(self, before: "set[Board]", now: "set[Board]") -> None:
        for board in sorted(before ^ now):
            # the driver reports that its own is gone
            if board in now or board[::2] != self._evalkit.board[::2]:
                self.notify(f"usb:{board} was {'plugged in' if board in now else 'unplugged'}.")


def open_usb(address: str, options: Mapping[str, Any]) -> BoardSource:
    """Return the source of `usb:` or `usb:BUS/ADDRESS`, the evaluation kit."""
    from palpate.ad7746.evalkit.usb_bus import EvalKit

    given = checked(
        "usb", options, {**CONVERTER, "firmware": text, "backend": anything, "clock": anything}
    )
    if not re.fullmatch(r"(\d{1,3}/\d{1,3})?", address):
        raise ValueError(
            f"usb: got address {quoted(address)}, allowed: BUS/ADDRESS as `lsusb` shows them, or nothing"
        )
    clock = given.get("clock") or RealClock()
    backend = given.get("backend")
    place = map(int, filter(None, address.split("/")))
    try:
        kit = EvalKit(*place, firmware=given.get("firmware"), backend=backend, clock=clock)
    except DeviceRefused:  # it says what to do
        raise
    except DeviceNotFound as error:
        raise DeviceNotFound(
            f"{error}; `palpate doctor` looks at the rest, and sim: needs no board"
        ) from error
    return WatchedKit(kit, given, clock) if backend is None else BoardSource(kit, given, clock)


def open_i2c(address: str, options: Mapping[str, Any]) -> BoardSource:
    """Return the source of `i2c:/dev/i2c-N`."""
    from palpate.ad7746.i2c import I2cBus

    given = checked("i2c", options, {**CONVERTER, "open_bus": anything, "clock": anything})
    if not address:
        raise ValueError("i2c: got no address, allowed: a bus, for example i2c:/dev/i2c-1")
    clock = given.get("clock") or RealClock()
    opener = {"open_bus": given["open_bus"]} if "open_bus" in given else {}
    return BoardSource(I2cBus(address, clock, **opener), given, clock, kit=False)
