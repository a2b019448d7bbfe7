"""A computer that stalls, between the driver and a simulated board: the driver's calls stop for a while, at random."""

from random import Random
from typing import Any

from palpate.ad7746.clock import VirtualClock
from palpate.ad7746.twin.chip import ChipTwin
from palpate.ad7746.twin.usb import TwinBackend

LONGEST_S = 0.1


class Stalls:
    """Stops of the computer: before or after a call, each with half of the probability.

    Parameters
    ----------
    clock : VirtualClock
    random : random.Random
    share : float
        Of the calls that are stopped, 0 to 1; each for up to `LONGEST_S`.
    """

    def __init__(self, clock: VirtualClock, random: Random, share: float) -> None:
        self.share = share
        self._clock, self._random = clock, random

    def may_stop(self) -> None:
        """Stop here, with half of the probability."""
        if self._random.random() < self.share / 2:
            self._clock.sleep(self._random.uniform(0.0, LONGEST_S))


class StalledClock:
    """The driver's view of the clock: its calls may be stopped."""

    def __init__(self, clock: VirtualClock, stalls: Stalls) -> None:
        self._clock, self._stalls = clock, stalls

    def now_ns(self) -> int:
        """Return the time, ns; what stops the computer before or after it stops the call before or after it."""
        return self._clock.now_ns()

    def sleep(self, seconds: float) -> None:
        """Wait for this time, or longer."""
        self._stalls.may_stop()
        self._clock.sleep(seconds)
        self._stalls.may_stop()


class StalledBackend(TwinBackend):
    """USB of a computer that stalls: the board goes on by itself."""

    def __init__(self, clock: VirtualClock, stalls: Stalls) -> None:
        super().__init__(clock)
        self._stalls = stalls

    def ctrl_transfer(self, *request: Any) -> int:
        """Do one control transfer; stopped before it is begun, or after its end."""
        self._stalls.may_stop()
        try:
            return super().ctrl_transfer(*request)
        finally:
            self._stalls.may_stop()


def middle_of(chip: ChipTwin, pin: int, code: int, near_ns: int) -> float:
    """Return the time of the middle of the conversion with this code, ns: the nearest one; it must exist."""
    found = [(c.begin + c.end) / 2 for c in chip.conversions if (c.pin, c.code) == (pin, code) and not c.lost]
    return min(found, key=lambda middle: abs(middle - near_ns))
