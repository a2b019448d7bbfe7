"""The hand of a simulated source: what it touches, and what a page may ask of it."""

import time
from collections.abc import Callable, Mapping
from threading import Event
from typing import NamedTuple

from palpate.messages import quoted

_TURN_S = 0.05  # of one call that waits


class Truth(NamedTuple):
    """A simulated press on an object with one ratio; `name`: of the object, or ""."""

    start_s: float
    ratio: float
    name: str


class WantedTouch(NamedTuple):
    """The object to touch next, and its modulus, MPa; None: it is not known."""

    name: str
    modulus_MPa: float | None


class SimulatedHand:
    """The hand of a simulated source. A measurement calls it from any thread.

    Attributes
    ----------
    truths : list of Truth
        The presses, in order of time, each with its true ratio; also those to come.
    specimens : mapping of str to float
        Objects on which a page can press: name -> true modulus, MPa. Empty: it presses by itself.
    is_waiting : bool
        It waits for the first page.
    """

    def __init__(self, truths: list[Truth], specimens: Mapping[str, float] | None = None) -> None:
        self.truths = truths
        self.specimens: Mapping[str, float] = specimens or {}
        self.is_waiting = False
        self._begin: Event | None = None
        self._longest_wait_s = 0.0
        self._wanted: Callable[[], WantedTouch | None] | None = None

    def wait_for(self, begin: Event, longest_s: float) -> None:
        """Let the simulation begin at this event, or after this time, s.

        A probe that is pressed on the page has no begin to wait for.
        """
        self._begin = begin
        self._longest_wait_s = longest_s
        self.is_waiting = not begin.is_set() and not self.specimens

    def wait(self, stopped: Event) -> float:
        """Wait for the begin, or until this is stopped; return how long, s."""
        begun_s = time.monotonic()
        while self.is_waiting and self._begin is not None and not stopped.is_set():
            waited_s = time.monotonic() - begun_s
            self.is_waiting = not self._begin.wait(_TURN_S) and waited_s < self._longest_wait_s
        self.is_waiting = False
        return time.monotonic() - begun_s

    def follow(self, wanted: Callable[[], WantedTouch | None]) -> None:
        """Ask this function what to touch next, when a press begins; None: go on by itself."""
        self._wanted = wanted

    def press(self, specimen: str) -> None:
        """Press on a specimen until `release`; RuntimeError: this hand presses by itself."""
        raise RuntimeError(f"press: got {quoted(specimen)}, allowed: with the source demo: only")

    def release(self) -> None:
        """Lift the probe; RuntimeError: this hand lifts by itself."""
        raise RuntimeError("release: got it, allowed: with the source demo: only")
