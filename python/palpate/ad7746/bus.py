"""Access to the registers of the AD7746: buses, clocks, repetitions, error counters."""

import errno
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NotRequired, Protocol, TypedDict, TypeVar

from palpate.clocks import fine_ns
from palpate.errors import DeviceRefused, ProtocolError, SourceError, SourceTimeout

TRIES = 3
_PAUSE_S = 0.001  # before an access is repeated

T = TypeVar("T")
Meanings = dict[int, tuple[type[SourceError], str]]  # Errno -> error of palpate, and what to do.


class Clock(Protocol):
    """Reads the time and waits."""

    def now_ns(self) -> int:
        """Return the time, ns; it never decreases."""

    def sleep(self, seconds: float) -> None:
        """Wait for this time."""


class RealClock:
    """The monotonic clock of the computer, optionally faster."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed: float = speed
        self._skipped_ns = 0

    def now_ns(self) -> int:
        """Return the time, ns."""
        if self.speed == 1:
            return fine_ns() + self._skipped_ns
        return round(fine_ns() * self.speed) + self._skipped_ns

    def skip(self, seconds: float) -> None:
        """Advance by this time at once."""
        self._skipped_ns += round(seconds * 1e9)

    def sleep(self, seconds: float) -> None:
        """Wait for this time."""
        time.sleep(max(seconds, 0.0) / self.speed)


class VirtualClock:
    """A clock that advances only in `sleep`, without waiting."""

    def __init__(self) -> None:
        self._now_ns = 0

    def now_ns(self) -> int:
        """Return the time, ns."""
        return self._now_ns

    def sleep(self, seconds: float) -> None:
        """Advance by this time at once."""
        self._now_ns += max(round(seconds * 1e9), 0)

    def skip(self, seconds: float) -> None:
        """Advance by this time at once."""
        self.sleep(seconds)


class NotReady(DeviceRefused):
    """The device cannot be used yet: permissions or firmware are missing, maybe for a moment."""


class NotAcknowledged(ProtocolError):
    """The chip did not acknowledge its address or a byte."""


@contextmanager
def translated(what: object, meanings: Meanings) -> Iterator[None]:
    """Translate errors of the system to palpate's."""
    try:
        yield
    except OSError as error:
        kind, text = meanings.get(error.errno or 0, (ProtocolError, error.strerror))
        raise kind(f"{what}: {text}") from error
    except NotImplementedError as error:  # of pyusb
        kind, text = meanings.get(errno.ENOSYS, (ProtocolError, ""))
        raise kind(f"{what}: {text}") from error


class BusIdentity(TypedDict):
    """Identity of a device in the description of a recording; the chip has no serial number."""

    name: str
    usb: NotRequired[str]
    bus: int | str
    address: int
    ports: NotRequired[list[int]]


class RegisterBus(Protocol):
    """Access to the registers of the chip: over USB (`EvalKit`) or Linux I2C (`I2cBus`)."""

    def read(self, register: int, count: int) -> bytes:
        """Return `count` registers from `register` on."""

    def write(self, register: int, data: bytes) -> int:
        """Write registers from `register` on; return when the last byte was written, ns."""

    def ready(self) -> bool:
        """Return whether a conversion has ended, without reading data."""

    def reset(self) -> None:
        """Reset the chip; it does not answer during the next `registers.RESET_S`."""

    def reopen(self) -> None:
        """Open the device again, or its replacement; NotReady: try again later."""

    def close(self) -> None:
        """Close the device; may be called twice."""

    def describe(self) -> BusIdentity:
        """Return the identity of the device."""


@dataclass
class Counters:
    """Counters of a driver; `pairs + lost` is the sequence number after the last sample."""

    pairs: int = 0
    lost: int = 0
    errors: int = 0
    retries: int = 0
    reopened: int = 0
    reconnects: int = 0


def _do_nothing() -> None:
    pass


def repeated(act: Callable[[], T], failed: Callable[[], object] = _do_nothing) -> T:
    """Act, up to `TRIES` times; call `failed` before each repetition."""
    for _ in range(TRIES - 1):
        try:
            return act()
        except (SourceTimeout, ProtocolError, NotReady):
            failed()
    return act()


class Access:
    """Access to a bus, up to `TRIES` times, after `check`; counts errors and repetitions."""

    def __init__(
        self, bus: RegisterBus, clock: Clock, check: Callable[[], None] = _do_nothing
    ) -> None:
        self.bus = bus
        self.clock = clock
        self.counters = Counters()
        self._check = check

    def read(self, register: int, count: int) -> bytes:
        """Return `count` registers from `register` on."""
        return self.repeated(lambda: self.bus.read(register, count))

    def write(self, register: int, data: bytes) -> tuple[int, int]:
        """Write registers from `register` on; return times before and after it, ns."""
        return self.repeated(lambda: (self.clock.now_ns(), self.bus.write(register, data)))

    def repeated(self, act: Callable[[], T]) -> T:
        """Do an access, up to `TRIES` times."""
        return repeated(lambda: self._once(act), self._pause)

    def _pause(self) -> None:
        self.counters.retries += 1
        self.clock.sleep(_PAUSE_S)

    def _once(self, act: Callable[[], T]) -> T:
        self._check()
        try:
            return act()
        except (SourceTimeout, ProtocolError):
            self.counters.errors += 1
            raise
