"""Clocks of drivers and simulated devices: real time, faster than real time, or virtual time."""

import time
from typing import Protocol

from palpate.systems import fine_ns


class Clock(Protocol):
    """The interface of a clock: read the time and wait."""

    def now_ns(self) -> int:
        """Return the time, ns; it never decreases."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait for this time."""
        ...


class RealClock:
    """The monotonic clock of the computer, optionally faster.

    Parameters
    ----------
    speed : float
        Seconds of this clock per real second, above 0; other than 1 only if a simulated device uses the same clock.

    Raises
    ------
    ValueError
        `speed` is not above 0 or not finite.
    """

    def __init__(self, speed: float = 1.0) -> None:
        if not 0 < speed < float("inf"):
            raise ValueError(f"speed: got {speed}, allowed: above 0")
        self.speed: float = speed

    def now_ns(self) -> int:
        """Return the time, ns."""
        now = fine_ns()
        return now if self.speed == 1 else round(now * self.speed)

    def sleep(self, seconds: float) -> None:
        """Wait for this time."""
        time.sleep(max(seconds, 0.0) / self.speed)


class VirtualClock:
    """A clock that advances only in `sleep`, without waiting.

    Examples
    --------
    >>> clock = VirtualClock()
    >>> clock.sleep(0.25)
    >>> clock.now_ns()
    250000000
    """

    def __init__(self) -> None:
        self._now_ns = 0

    def now_ns(self) -> int:
        """Return the time, ns."""
        return self._now_ns

    def sleep(self, seconds: float) -> None:
        """Advance by this time at once."""
        self._now_ns += max(round(seconds * 1e9), 0)
