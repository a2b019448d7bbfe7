"""What carries the AD7746's registers, and the count of how it went."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from palpate.ad7746.clock import Clock
from palpate.errors import ProtocolError, SourceTimeout

TRIES = 3
_PAUSE_S = 0.001  # before an access is repeated

T = TypeVar("T")


class RegisterBus(Protocol):
    """A way to the registers: the kit's USB, a Linux I2C bus.

    Each call is one access. It raises SourceTimeout or ProtocolError where it failed and may be repeated,
    DeviceNotFound where the device is gone. Repeating and waiting is the driver's.
    """

    def read(self, register: int, count: int) -> bytes:
        """Return `count` registers from `register` on."""
        ...

    def write(self, register: int, data: bytes) -> int:
        """Write registers from `register` on; return when the last byte was written, ns of the clock."""
        ...

    def ready(self) -> bool:
        """Tell whether a conversion has ended, without reading data."""
        ...

    def reset(self) -> None:
        """Reset the chip; it is silent for `ad7746.RESET_S` then."""
        ...

    def reopen(self) -> None:
        """Open the device again: the same one, or the one plugged in its place."""
        ...

    def close(self) -> None:
        """Give the device back; may be called twice."""
        ...

    def describe(self) -> dict[str, Any]:
        """Return the device's identity."""
        ...


@dataclass
class Counters:
    """What a driver has done; `pairs + lost` is the number after the last sample's.

    Attributes
    ----------
    pairs, lost : int
        Samples handed on with both values, and those without or never read.
    errors, retries : int
        Accesses that failed (a RDY# pin that is found stuck is one), and those of them that were repeated.
    reopened, reconnects : int
        After too many lost pairs, and after an unplugging.
    """

    pairs: int = 0
    lost: int = 0
    errors: int = 0
    retries: int = 0
    reopened: int = 0
    reconnects: int = 0


def repeated(act: Callable[[], T], counters: Counters, clock: Clock, check: Callable[[], None]) -> T:
    """Access the device, `TRIES` times at most.

    Parameters
    ----------
    act : callable
        One access.
    counters : Counters
        `errors` and `retries` are counted up.
    clock : Clock
    check : callable
        Called before each try; what it raises ends the matter.
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
