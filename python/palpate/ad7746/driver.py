"""Driver of the AD7746: reads pairs, retries after errors, waits for an unplugged board. Not tried on hardware.

What happens after an error:

1. An access that fails (no answer, refused, too short, not acknowledged) is repeated twice. Each failed try
   is counted in `errors`, each repetition in `retries`.
2. A conversion is not repeated. If it does not end, if an access of it failed for good, or if the registers read
   with its data are not those that were written, the pair is LOST and counted in `lost`. If that is the soft
   conversion, the hard one before it keeps its value.
3. After `STREAK` lost pairs in a row, or as soon as an access got no answer in any of its tries, the device is
   opened and configured again (with the firmware, if its path is known), counted in `reopened`; after `STREAK`
   more lost pairs the last error is raised.
4. If the device is unplugged, the driver waits for it, up to `replug_s`. The pairs that the gap would have held
   are counted in `lost`, and their sequence numbers are skipped.
"""

import math
from collections.abc import Callable
from threading import Event
from typing import Any

from palpate.ad7746.bus import Counters, RegisterBus
from palpate.ad7746.clock import Clock, RealClock
from palpate.ad7746.configuration import HARD, SOFT, Configuration
from palpate.ad7746.converter import Converter, Overdue, Reading
from palpate.ad7746.inputs import Look, look
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, SourceTimeout
from palpate.samples import Sample, Status

STREAK = 3
BUS_S = 0.002
"""Approximate time that the bus and USB add to a conversion, s."""
_REPLUG_POLL_S = 0.1


class _Interrupted(Exception):
    """`interrupt` was called."""


class Ad7746:
    """Driver of the AD7746: reads the hard and the soft channel one after the other.

    Parameters
    ----------
    bus : RegisterBus
        An open bus; `close` closes it.
    configuration : Configuration, optional
    clock : Clock, optional
        The clock of the bus.
    replug_s : float
        Longest time to wait for an unplugged device, s.
    notify : callable, optional
        Called with a message when the device is unplugged and when it is back.

    Raises
    ------
    SourceError
        From every method that accesses the device; the text at the top of this module lists when.

    Examples
    --------
    >>> from palpate.simulation.board import simulated
    >>> driver = simulated("four-specimens", seed=1)
    >>> driver.start()
    >>> driver.auto_capdac()
    (41, 27)
    >>> driver.read_pair(0).status, driver.counters.pairs
    (<Status.OK: 0>, 1)
    >>> driver.close()
    """

    def __init__(
        self,
        bus: RegisterBus,
        configuration: Configuration | None = None,
        clock: Clock | None = None,
        *,
        replug_s: float = 30.0,
        notify: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.counters: Counters = Counters()
        self.gaps: list[tuple[int, str]] = []
        self._bus = bus
        self._clock = clock or RealClock()
        self._replug_s = replug_s
        self._notify = notify
        self._interrupted = Event()
        self._converter = Converter(
            bus, configuration or Configuration(), self._clock, self.counters, self._check_interrupt
        )
        self._start_ns = self._last_ns = self._clock.now_ns()
        self._streak = 0

    @property
    def configuration(self) -> Configuration:
        """Configuration in the chip, with the CAPDAC steps that `auto_capdac` found."""
        return self._converter.configuration

    @property
    def period_s(self) -> float:
        """Approximate time from one pair to the next, s."""
        return 2 * (self.configuration.conversion_s + BUS_S)

    def start(self) -> None:
        """Reset and configure the chip, and begin to count time."""
        self._converter.set_up()
        self._start_ns = self._last_ns = self._clock.now_ns()

    def interrupt(self) -> None:
        """Stop reading, from another thread: a running `read_pair` and all later ones return None."""
        self._interrupted.set()

    def close(self) -> None:
        """Close the device."""
        self._bus.close()

    def describe(self) -> dict[str, Any]:
        """Return the description for the recording, without accessing the device."""
        return {
            "converter": "AD7746",
            "note": "driver not tried on hardware",
            "device": self._bus.describe(),
            "registers": self._converter.dump.hex(" "),
            "configuration": self.configuration.as_dict(),
            "conversion_s": self.configuration.conversion_s,
            "period_s": self.period_s,
            "clock": f"{type(self._clock).__name__}, ns since the start; a time is the middle of a conversion",
            "stamps": "converter",  # the driver begins each conversion, and polls for its end
        }

    def auto_capdac(self) -> tuple[int, int]:
        """Set the CAPDAC of each channel so that its present, idle signal is in the middle of the range.

        Returns
        -------
        (int, int)
            Steps of the hard and the soft channel, as in `Channel.capdac`.
        """
        self._converter.auto_capdac()
        return self.configuration.hard.capdac, self.configuration.soft.capdac

    def read_temperature(self) -> float:
        """Measure the temperature of the chip, degrees Celsius; use it between touches, it takes 20 ms or more."""
        return self._converter.temperature()

    def read_channel(self, channel: int) -> Reading:
        """Convert one channel only, `HARD` or `SOFT`; a lost conversion raises an error here."""
        reading = self._converter.convert(channel)
        return reading._replace(t_ns=reading.t_ns - self._start_ns)

    def look(self, name: str, excitation: str) -> Look:
        """Measure what an input, "1+" to "2-", has on an excitation pin, "A" or "B"; nan after `interrupt`."""
        try:
            return look(self._converter, name, excitation)
        except _Interrupted:
            return Look(math.nan)

    def read_pair(self, seq: int) -> Sample | None:
        """Read both channels, the hard one first.

        Parameters
        ----------
        seq : int
            Sequence number of the next sample.

        Returns
        -------
        Sample or None
            Its number is `seq`, or larger by the pairs that were lost before it. None after `interrupt`.
        """
        try:
            while True:
                try:
                    return self._pair(seq)
                except DeviceRefused:
                    raise
                except DeviceNotFound as gone:
                    seq += self._wait_for_replug(gone)
        except _Interrupted:
            return None

    def _pair(self, seq: int) -> Sample:
        hard = soft = lost = Reading(self._clock.now_ns() - self._start_ns, -1, math.nan, Status.LOST)
        try:
            hard = self.read_channel(HARD)
            soft = self.read_channel(SOFT)
            self._streak = 0
            self.counters.pairs += 1
        except (SourceTimeout, ProtocolError) as failure:
            self._give_up(failure)
            self.counters.lost += 1
            hard = lost if hard.status else hard._replace(status=Status.LOST)
        self._last_ns = self._clock.now_ns()
        return Sample(
            seq, hard.t_ns, soft.t_ns, hard.raw, soft.raw, hard.capacitance, soft.capacitance, hard.status | soft.status
        )

    def _give_up(self, failure: SourceError) -> None:
        self._converter.forget()
        deaf = isinstance(failure, SourceTimeout) and not isinstance(failure, Overdue)
        self._streak = STREAK if deaf and self._streak < STREAK else self._streak + 1
        if self._streak >= 2 * STREAK:
            raise failure
        if self._streak == STREAK:
            self.counters.reopened += 1
            self._bus.reopen()
            self._converter.set_up()

    def _wait_for_replug(self, gone: DeviceNotFound) -> int:
        self._notify(f"{gone} Waiting for it, up to {self._replug_s:g} s.")
        deadline = self._clock.now_ns() + self._replug_s * 1e9
        while not self._is_back():
            if self._clock.now_ns() > deadline:
                raise gone
            self._clock.sleep(_REPLUG_POLL_S)
        gap_s = (self._clock.now_ns() - self._last_ns) / 1e9
        self._last_ns = self._clock.now_ns()
        lost = int(gap_s / self.period_s)
        self.counters.reconnects += 1
        self.counters.lost += lost
        self._notify(f"The device is back after {gap_s:.1f} s: {lost} pairs lost.")
        return lost

    def _is_back(self) -> bool:
        self._check_interrupt()
        try:
            self._bus.reopen()
            self._converter.set_up()
        except DeviceRefused:
            raise
        except SourceError:
            return False
        return True

    def _check_interrupt(self) -> None:
        if self._interrupted.is_set():
            raise _Interrupted
