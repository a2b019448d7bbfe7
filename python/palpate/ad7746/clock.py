"""Time as drivers and their twins see it: real, faster than real, or made up."""

import time
from typing import Protocol


class Clock(Protocol):
    """What a driver needs of time."""

    def now_ns(self) -> int:
        """Return the time, ns; never goes back."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let that much time pass."""
        ...


class RealClock:
    """The computer's.

    Parameters
    ----------
    speed : float
        Seconds of this clock in a second, above 0; other than 1 only where a twin shares the clock.
    """

    def __init__(self, speed: float = 1.0) -> None:
        if not 0 < speed < float("inf"):
            raise ValueError(f"speed: got {speed}, allowed: above 0")
        self._speed = speed

    def now_ns(self) -> int:
        """Return the time, ns."""
        now = time.monotonic_ns()
        return now if self._speed == 1 else round(now * self._speed)

    def sleep(self, seconds: float) -> None:
        """Let that much time pass."""
        time.sleep(max(seconds, 0.0) / self._speed)


class VirtualClock:
    """Stands still until someone sleeps.

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
        """Let that much time pass at once."""
        self._now_ns += max(round(seconds * 1e9), 0)
