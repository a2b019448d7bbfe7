"""Driver of the AD7746: reads pairs, retries after errors, waits for an unplugged board.

Not tried on hardware. What happens after an error:

1. An access that fails (no answer, refused, too short, not acknowledged) is repeated twice. Each
   failed try is counted in `errors`, each repetition in `retries`.
2. A conversion is not repeated. The pair is LOST and counted in `lost` if the conversion does not
   end, if an access of it failed for good, or if the registers that are read with its data are not
   as written. If that is the soft conversion, the hard one before it keeps its value.
3. After `STREAK` lost pairs in a row, or as soon as an access got no answer in any of its tries,
   the device is opened and configured again (with the firmware, if its path is known), counted in
   `reopened`. After `STREAK` more lost pairs the last error is raised.
4. If the computer stopped so long that the difference of a pair's two times may be wrong by more
   than `limit_ns`, the pair is LOST and counted in `lost`; the hard reading keeps its value if its
   own time is good. Such pairs are no failures of the device: it is not opened again.
5. If the device is unplugged, the driver waits for it, up to `replug_s`, and opens it again as
   often as that fails. The pairs that the gap would have held are counted in `lost`, and their sequence
   numbers are skipped.
6. Once a second the gains of the chip are read: a chip has no serial number, but its gains, set in
   the factory, differ from those of any other chip. If another program has changed them, the pair
   is LOST, and the device is opened again: the reset restores them. The text of the gap says since
   when readings may be wrong.

After 3, 5 and 6, and after the range was set again, the earlier baseline is no longer valid: `read`
yields a `Gap` before the first sample for which this is so. While the driver waits for an unplugged
device, `read` yields a trouble.
"""

import math
from collections.abc import Callable, Generator, Iterator
from dataclasses import asdict
from functools import partial
from threading import Event
from typing import Any

from palpate.ad7746 import registers
from palpate.ad7746.bus import Access, Clock, RealClock, RegisterBus, repeated
from palpate.ad7746.configuration import HARD, SOFT, Configuration
from palpate.ad7746.converter import ChannelReading, Converter, Middle, Overdue, difference_ns
from palpate.ad7746.replug import POLL_S, ReplugWait
from palpate.ad7746.wiring import InputCapacitance, measure_input, measure_pin
from palpate.clocks import on_monotonic
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, SourceTimeout
from palpate.samples import Sample, Status
from palpate.source_events import (
    Conditions,
    Gap,
    GapCause,
    SourceEvent,
    TroubleEnded,
    TroubleKind,
)

STREAK = 3
REPLUG_S = 120.0  # Longest time to wait for an unplugged device: a person looks for the cable.
# Largest possible error of the difference of the two times of a pair that is not LOST, ns.
LIMIT_NS = 2_000_000
_UNKNOWN_NS = -1000
_GRACE_NS = 200_000_000  # for the conditions, after `interrupt`
_CONDITIONS_S = 2 * (registers.VT_CONVERSION_S[0] + 0.005)
_GAINS_NS = 1_000_000_000  # the gains are read so often; it takes 1 ms


class _Interrupted(Exception):
    """`interrupt` was called."""


class _OtherGains(ProtocolError):
    """The gains of the chip have changed."""


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
        Longest time to wait for an unplugged device, s, 0 or more.
    notify : callable, optional
        Called with a message when the device is unplugged, as the wait for it goes on, and when it
        is back, or if its range cannot be set again.
    limit_ns : int
        Largest possible error of the difference of a pair's two times, ns; above it the pair is
        LOST.

    Attributes
    ----------
    counters : Counters

    Raises
    ------
    SourceError
        From every method that accesses the device; the text at the top of this module lists when.

    Examples
    --------
    >>> import palpate
    >>> driver = palpate.open("sim:four-specimens?seed=1").driver
    >>> driver.start()
    >>> driver.auto_capdac()
    (41, 27)
    >>> [sample] = driver.read(0)
    >>> sample.status, driver.counters.pairs
    (<Status.OK: 0>, 1)
    >>> driver.close()
    """

    def __init__(
        self,
        bus: RegisterBus,
        configuration: Configuration | None = None,
        clock: Clock | None = None,
        *,
        replug_s: float = REPLUG_S,
        notify: Callable[[str], None] = lambda _: None,
        limit_ns: int = LIMIT_NS,
    ) -> None:
        self._gaps: list[Gap] = []  # that are not yielded yet
        self._bus = bus
        self._clock = clock or RealClock()
        self._replug_s = replug_s
        self._notify = notify
        self._interrupted = Event()
        self._centre = Event()
        access = Access(bus, self._clock, self._check_interrupt)
        self.counters = access.counters
        self._converter = Converter(access, configuration or Configuration(), limit_ns)
        self._gains = b""
        self._check_gains_ns = 0
        self._start_ns = self._clock.now_ns()
        self._last_ns = self._start_ns
        self._streak = 0  # lost pairs in a row
        self._next = 0  # number of the next sample
        self._grace_ns = 0

    @property
    def configuration(self) -> Configuration:
        """Configuration in the chip, with the CAPDAC steps that `auto_capdac` found."""
        return self._converter.configuration

    @property
    def period_s(self) -> float:
        """Time from one pair to the next, s: twice the median of the last conversions' times."""
        return 2 * self._converter.step_s

    @property
    def fastest_period_s(self) -> float:
        """Time from one pair to the next on a computer that is never late, s."""
        return 2 * self._converter.fastest_step_s

    @property
    def zero_ns(self) -> int | None:
        """`time.monotonic_ns()` at t = 0; None: it is not the computer's clock."""
        if isinstance(self._clock, RealClock) and self._clock.speed == 1:
            return on_monotonic(self._start_ns)
        return None

    def start(self) -> None:
        """Reset and configure the chip, and begin to count time."""
        self._set_up()
        self._start_ns = self._clock.now_ns()
        self._last_ns = self._start_ns

    def interrupt(self) -> None:
        """Stop reading, from another thread: a running `read` and all later ones end."""
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
            "fingerprint": self._gains.hex(" "),  # of the chip: its gains from the factory
            "configuration": asdict(self.configuration),
            "conversion_s": self.configuration.conversion_s,
            "period_s": self.period_s,
            "clock": f"{type(self._clock).__name__}, ns since the start; "
            "a time is the middle of a conversion",
            "stamps": "converter",  # the driver begins each conversion, and polls for its end
        }

    def auto_capdac(self) -> tuple[int, int]:
        """Set the CAPDAC of each channel: its present, idle signal is in the middle of the range.

        If it fails, the CAPDACs are those from before.

        Returns
        -------
        (int, int)
            Steps of the hard and the soft channel, as in `Channel.capdac`.
        """
        before = self.configuration
        capdacs = self._capdacs
        try:
            self._converter.auto_capdac()
        except BaseException:
            self._converter.configuration = before
            raise
        if self._next and capdacs != self._capdacs:
            text = f"the range was set again: CAPDAC {self._capdacs}, before {capdacs}"
            self._gaps.append(Gap(GapCause.RANGE, text))
        return self._capdacs

    def centre(self) -> None:
        """Do `auto_capdac` before the next pair of `read`; from any thread."""
        self._centre.set()

    def read_conditions(self) -> Conditions | None:
        """Measure temperature and supply of the chip, in about 50 ms.

        After `interrupt` it works, too, for 0.2 s at most.

        Returns
        -------
        Conditions or None
            With `temperature_C` and `supply_V`; None: the chip could not be read.
        """
        self._grace_ns = self._clock.now_ns() + _GRACE_NS
        try:
            t_s = (self._clock.now_ns() - self._start_ns) / 1e9
            temperature = self._converter.voltage(registers.VT_TEMPERATURE)
            supply = self._converter.voltage(registers.VT_SUPPLY)
        except (SourceError, _Interrupted):
            return None
        finally:
            self._grace_ns = 0
        values = {
            "temperature_C": round(registers.temperature_C(temperature), 3),
            "supply_V": round(registers.supply_V(supply), 3),
        }
        return Conditions(round(t_s, 3), values)

    @property
    def conditions_are_free(self) -> bool:
        """Whether `read_conditions` between two pairs leaves the second one in time."""
        return 0.4 * self.period_s > _CONDITIONS_S

    def read_channel(self, channel: int) -> ChannelReading:
        """Convert one channel only, `HARD` or `SOFT`; a lost conversion raises an error here."""
        reading = self._converter.convert(channel)
        since_start = reading.middle._replace(t_ns=reading.middle.t_ns - self._start_ns)
        return reading._replace(middle=since_start)

    def measure_input(self, name: str, excitation: str) -> InputCapacitance:
        """Measure an input, "1+" to "2-", with an excitation, "A" or "B"; nan after `interrupt`."""
        try:
            return measure_input(partial(measure_pin, self._converter), name, excitation)
        except _Interrupted:
            return InputCapacitance(math.nan)

    def read(self, seq: int) -> Iterator[Sample | SourceEvent]:
        """Read both channels, the hard one first; yield the sample, with the events around it.

        Parameters
        ----------
        seq : int
            Sequence number of the next sample.

        Yields
        ------
        Sample or SourceEvent
            One sample: its number is `seq`, or larger by the pairs that were lost before it. None
            after `interrupt`.
        """
        try:
            while True:
                self._next = seq
                try:
                    seq += self._centred()
                    yield from self._passed_gaps()
                    sample = self._pair(seq)
                    break
                except DeviceRefused:
                    raise
                except DeviceNotFound as gone:
                    seq += yield from self._wait_for_replug(gone)
        except _Interrupted:
            return
        self._next = sample.seq + 1
        yield sample
        yield from self._passed_gaps()

    def _passed_gaps(self) -> Iterator[Gap]:
        """Yield the gaps that were not yielded yet."""
        while self._gaps:
            yield self._gaps.pop(0)

    def _pair(self, seq: int) -> Sample:
        hard = _empty(Middle(self._clock.now_ns() - self._start_ns))
        soft = hard
        uncertainty_ns = _UNKNOWN_NS
        try:
            self._check_gains()
            hard = self.read_channel(HARD)
            soft = self.read_channel(SOFT)
            self._streak = 0
            uncertainty_ns = difference_ns(hard.middle, soft.middle)
        except (SourceTimeout, ProtocolError) as failure:
            self._give_up(failure, seq)
        if 0 <= uncertainty_ns <= self._converter.limit_ns:
            self.counters.pairs += 1
        else:
            self.counters.lost += 1
            if not hard.status and hard.middle.error_ns <= self._converter.limit_ns:
                hard = hard._replace(status=Status.LOST)
            else:
                hard = _empty(hard.middle)
            soft = _empty(soft.middle)
        self._last_ns = self._clock.now_ns()
        return Sample(
            seq,
            hard.middle.t_ns,
            soft.middle.t_ns,
            hard.raw,
            soft.raw,
            hard.capacitance,
            soft.capacitance,
            hard.status | soft.status,
            -(-uncertainty_ns // 1000),
        )

    def _give_up(self, failure: SourceError, seq: int) -> None:
        """Count a failed pair; open the device again, or raise the failure, if there were many."""
        no_answer = isinstance(failure, SourceTimeout) and not isinstance(failure, Overdue)
        self._streak += 1
        if no_answer or isinstance(failure, _OtherGains):
            self._streak = max(self._streak, STREAK)
        if self._streak >= 2 * STREAK:
            raise failure
        if self._streak == STREAK:
            self.counters.reopened += 1
            other = repeated(self._reopen, lambda: self._clock.sleep(POLL_S))
            text = f"the board was opened again after an error ({failure}){other}"
            self._gaps.append(Gap(GapCause.REOPENED, text))

    def _reopen(self) -> str:
        """Open the device again; return as `_set_up`."""
        self._check_interrupt()
        self._bus.reopen()
        return self._set_up()

    def _set_up(self) -> str:
        """Reset and configure the chip; return a text about another chip than before, or ""."""
        self._converter.set_up()
        self._check_gains_ns = self._clock.now_ns() + _GAINS_NS
        before = self._gains
        self._gains = self._converter.dump[registers.CAP_GAIN :]
        if before in (b"", self._gains):
            return ""
        gains = f"{self._gains.hex(' ')}, before {before.hex(' ')}"
        return f"; another board: the gains of its chip are {gains}"

    def _check_gains(self) -> None:
        """Raise _OtherGains if the gains have changed; reads them once a second."""
        now = self._clock.now_ns()
        if now < self._check_gains_ns:
            return
        since_s = (self._check_gains_ns - _GAINS_NS - self._start_ns) / 1e9
        self._check_gains_ns = now + _GAINS_NS
        found = self._converter.gains()
        if found != self._gains:
            gains = f"{found.hex(' ')}, before {self._gains.hex(' ')}"
            raise _OtherGains(
                f"the gains of the chip (registers 0x0F to 0x12) are {gains}: another program uses "
                f"the board; close that program. Readings since {since_s:.1f} s may be wrong"
            )

    def _wait_for_replug(self, gone: DeviceNotFound) -> Generator[SourceEvent, None, int]:
        """Wait until an unplugged device is back; return the number of pairs lost meanwhile."""
        wait = ReplugWait(self._clock, self._replug_s, self._notify)
        self._notify(f"{gone} Waiting for it, up to {self._replug_s:g} s.")
        try:
            other = yield from wait.until_open(self._reopen)
        except (SourceError, _Interrupted):
            yield TroubleEnded(TroubleKind.UNPLUGGED)
            raise
        gap_s = (self._clock.now_ns() - self._last_ns) / 1e9
        lost = self._skipped()
        self.counters.reconnects += 1
        yield Gap(GapCause.DISCONNECTED, f"the board was unplugged for {gap_s:.1f} s{other}")
        yield TroubleEnded(TroubleKind.UNPLUGGED)
        self._notify(f"The device is back after {gap_s:.1f} s: {lost} pairs lost{other}.")
        return lost

    def _centred(self) -> int:
        """Set the range again if that was requested; return the number of pairs lost meanwhile."""
        if not self._centre.is_set():
            return 0
        self._centre.clear()
        try:
            self.auto_capdac()
        except (SourceTimeout, ProtocolError) as error:
            self._notify(f"the range could not be set again: {error}")
        return self._skipped()

    def _skipped(self) -> int:
        """Count the pairs that there would have been since the last one."""
        lost = int((self._clock.now_ns() - self._last_ns) / 1e9 / self.period_s)
        self._last_ns = self._clock.now_ns()
        self.counters.lost += lost
        return lost

    @property
    def _capdacs(self) -> tuple[int, int]:
        return self.configuration.hard.capdac, self.configuration.soft.capdac

    def _check_interrupt(self) -> None:
        if self._interrupted.is_set() and self._clock.now_ns() >= self._grace_ns:
            raise _Interrupted


def _empty(middle: Middle) -> ChannelReading:
    """Return a reading that has only a time."""
    return ChannelReading(middle, -1, math.nan, Status.LOST)
