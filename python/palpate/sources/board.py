"""The AD7746 as a source: `usb:` (evaluation kit) and `i2c:`. Not tried on hardware."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any, Self

from palpate.ad7746.bus import RegisterBus
from palpate.ad7746.clock import Clock, RealClock
from palpate.ad7746.configuration import Configuration
from palpate.ad7746.datasheet import SATURATED_PF
from palpate.ad7746.driver import LIMIT_NS, Ad7746
from palpate.errors import quoted
from palpate.samples import Sample
from palpate.sources.base import Source
from palpate.sources.options import Check, anything, checked, number, text

CONVERTER: dict[str, Check] = {
    "capf": number(0, 7, whole=True),
    "hard_input": number(1, 2, whole=True),
    "replug": number(0, 86400),
}
"""Options: speed; input of the hard bump; longest time to wait for an unplugged device, s."""


class BoardSource(Source):
    """Pairs of both channels of the AD7746, until it is interrupted.

    Parameters
    ----------
    bus : RegisterBus
        An open bus.
    options : mapping
        Checked options, as in `CONVERTER`; and `limit_ns`, as in `Ad7746`.
    clock : Clock
        The clock of the bus.
    """

    def __init__(self, bus: RegisterBus, options: Mapping[str, Any], clock: Clock) -> None:
        chosen = {name: options[name] for name in ("capf", "hard_input") if name in options}
        self.driver: Ad7746 = Ad7746(
            bus,
            Configuration(**chosen),
            clock,
            replug_s=options.get("replug", 30.0),
            notify=lambda message: self.notify(message),
            limit_ns=options.get("limit_ns", LIMIT_NS),
        )
        self._started = False

    def __enter__(self) -> Self:
        """Configure the converter, and set the CAPDACs so that both idle signals are in its range."""
        try:
            self.driver.start()
            self.driver.auto_capdac()
        except BaseException:
            self.close()
            raise
        self._started = True
        return self

    def __iter__(self) -> Iterator[Sample]:
        """Return the pairs."""
        if not self._started:
            self.__enter__()
        seq = 0
        while (sample := self.driver.read_pair(seq)) is not None:
            yield sample
            seq = sample.seq + 1

    @property
    def counters(self) -> dict[str, int]:
        """Counters of the driver."""
        return asdict(self.driver.counters)

    @property
    def zero_ns(self) -> int | None:
        """Begin of the measurement on the clock of the computer."""
        return self.driver.zero_ns

    def describe(self) -> dict[str, Any]:
        """Return the description of the driver, with the range of the converter."""
        return {**self.driver.describe(), "full_scale_pF": SATURATED_PF}

    def interrupt(self) -> None:
        """Stop the iteration."""
        self.driver.interrupt()

    def close(self) -> None:
        """Close the device."""
        self.driver.close()


def open_usb(address: str, options: Mapping[str, Any]) -> BoardSource:
    """Return the source of `usb:` or `usb:BUS/ADDRESS`, the evaluation kit."""
    from palpate.ad7746.evalkit.board import EvalKit

    given = checked("usb", options, {**CONVERTER, "firmware": text, "backend": anything, "clock": anything})
    match = re.fullmatch(r"(?:(\d{1,3})/(\d{1,3}))?", address)
    if not match:
        raise ValueError(f"usb: got address {quoted(address)}, allowed: BUS/ADDRESS as `lsusb` shows them, or nothing")
    bus, number_ = (int(part) if part else None for part in match.groups())
    clock = given.pop("clock", None) or RealClock()
    kit = EvalKit(bus, number_, firmware=given.pop("firmware", None), backend=given.pop("backend", None), clock=clock)
    return BoardSource(kit, given, clock)


def open_i2c(address: str, options: Mapping[str, Any]) -> BoardSource:
    """Return the source of `i2c:/dev/i2c-N`."""
    from palpate.ad7746.i2c import I2cBus

    given = checked("i2c", options, {**CONVERTER, "open_bus": anything, "clock": anything})
    if not address:
        raise ValueError("i2c: got no address, allowed: a bus, for example i2c:/dev/i2c-1")
    clock = given.pop("clock", None) or RealClock()
    opener = {"open_bus": given.pop("open_bus")} if "open_bus" in given else {}
    return BoardSource(I2cBus(address, clock, **opener), given, clock)
