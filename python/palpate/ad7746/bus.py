"""Access to the registers of the AD7746, with repetitions, and the counters of errors."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from palpate.ad7746.clock import Clock
from palpate.errors import DeviceNotFound, ProtocolError, SourceTimeout

TRIES = 3
_PAUSE_S = 0.001  # before an access is repeated

T = TypeVar("T")


class NotReady(DeviceNotFound):
    """The device is plugged in, but cannot be used yet: another program may be about to load its firmware."""


class RegisterBus(Protocol):
    """Access to the registers of the chip: over USB (`EvalKit`) or over a Linux I2C bus (`I2cBus`).

    Each call is one access. It raises SourceTimeout or ProtocolError if it failed and may be repeated, and
    DeviceNotFound if the device was unplugged. The driver repeats accesses and waits.
    """

    def read(self, register: int, count: int) -> bytes:
        """Return `count` registers from `register` on."""
        ...

    def write(self, register: int, data: bytes) -> int:
        """Write registers from `register` on; return the time when the last byte was written, ns of the clock."""
        ...

    def ready(self) -> bool:
        """Return whether a conversion has ended, without reading data."""
        ...

    def reset(self) -> None:
        """Reset the chip; it does not answer during the next `datasheet.RESET_S`."""
        ...

    def reopen(self) -> None:
        """Open the device again: the same one, or its replacement; NotReady is raised while it has to be waited for."""
        ...

    def close(self) -> None:
        """Close the device; may be called twice."""
        ...

    def describe(self) -> dict[str, Any]:
        """Return the identity of the device."""
        ...


@dataclass
class Counters:
    """Counters of a driver; `pairs + lost` is the sequence number after the last sample.

    Attributes
    ----------
    pairs, lost : int
        Samples with both values, and samples without a value or never read.
    errors, retries : int
        Failed accesses (a stuck RDY# pin counts as one), and those of them that were repeated.
    reopened, reconnects : int
        How often the device was opened again after too many lost pairs, and after it was unplugged.
    """

    pairs: int = 0
    lost: int = 0
    errors: int = 0
    retries: int = 0
    reopened: int = 0
    reconnects: int = 0


def repeated(act: Callable[[], T], counters: Counters, clock: Clock, check: Callable[[], None]) -> T:
    """Access the device, up to `TRIES` times.

    Parameters
    ----------
    act : callable
        One access.
    counters : Counters
        Its `errors` and `retries` are increased.
    clock : Clock
    check : callable
        Called before each try; an exception that it raises ends the repetitions.

    Returns
    -------
    object
        The result of `act`.

    Raises
    ------
    SourceTimeout, ProtocolError
        The error of the last try.
    """
    for left in reversed(range(TRIES)):
        check()
        try:
            return act()
        except (SourceTimeout, ProtocolError):
            counters.errors += 1
            if not left:
                raise
            counters.retries += 1
            clock.sleep(_PAUSE_S)
    raise AssertionError("unreachable")
