"""Single conversions of the AD7746, over any bus. Not tried on hardware.

A conversion has these steps: write CAPDACs and offset; write 0x07 to 0x0A in one burst, CONFIG
last; wait for RDY; read 0x00 to 0x0E in one transaction. This is more than the data: the other
registers show whether the data belong to the requested channel. Another program, or a short failure
of the supply, may have changed the registers, and then the data would be from another channel.

The time of a conversion is its middle. The computer knows times around its own calls only, and may
be stopped for a while anywhere between them. So `Pace` states intervals, which hold however long
the computer was stopped, and assumes nothing about the bus.
"""

import statistics
from collections import defaultdict, deque
from typing import NamedTuple

from palpate.ad7746.bus import TRIES, Access, NotAcknowledged, repeated
from palpate.ad7746.configuration import HARD, NAMES, SATURATION, SOFT, Configuration, require_same
from palpate.ad7746.registers import (
    CAP_DATA,
    CAP_GAIN,
    CAP_SETUP,
    CAPDAC_A,
    DAC_STEP_PF,
    DAC_STEPS,
    EXCERR,
    RDYCAP,
    RDYVT,
    REGISTERS,
    RESET_S,
    RESET_VALUES,
    STATUS,
    VT_CONVERSION_S,
    VT_DATA,
    capacitance_pF,
    is_saturated,
)
from palpate.errors import ProtocolError, SourceError, SourceTimeout
from palpate.samples import Status

# Duration of a conversion before one was seen, relative to the data sheet's, at least: the chip's
# clock is +-5 %.
_SHORTEST = 0.9
# If no poll found a conversion running, the polls may have begun too late: the next ones begin so
# much earlier.
_UNSEEN_NS = 500_000
# A conversion is overdue after this multiple of the data sheet's duration (about 2 with CAPCHOP)
# and this time.
_OVERDUE = 2.5
_OVERDUE_NS = 20_000_000
# Change of the chip's clock from one conversion to the next, relative, at most: 0.018 to 0.18 % a
# second.
_DRIFT = 2e-5


class Seen(NamedTuple):
    """Observed times of a conversion, ns: it began in [asked, begun], ended in [busy, ended]."""

    asked: int
    begun: int
    busy: int
    ended: int


class Middle(NamedTuple):
    """Time of the middle of a conversion, ns; how much earlier or later it may have been, ns."""

    t_ns: int
    early_ns: int = 0
    late_ns: int = 0

    @property
    def error_ns(self) -> int:
        """Largest possible error of the time, ns."""
        return max(self.early_ns, self.late_ns)


def difference_ns(first: Middle, second: Middle) -> int:
    """Return the largest possible error of the difference of two times, ns."""
    return max(first.early_ns + second.late_ns, first.late_ns + second.early_ns)


class Pace:
    """The duration of a conversion of this chip: an interval, which each conversion narrows."""

    # The chip's own clock paces it. A conversion lasted at least from its latest begin to its
    # earliest end, and at most from its earliest begin to its latest end. The duration is in the
    # intersection of all these intervals.

    def __init__(self, nominal_s: float) -> None:
        self._nominal_ns = nominal_s * 1e9
        # So long after its begin, a conversion must have ended.
        self.overdue_ns: int = round(_OVERDUE * self._nominal_ns) + _OVERDUE_NS
        self._reset()

    def _reset(self) -> None:
        """Set the interval by the data sheet, as before the first conversion."""
        self.shortest_ns: int = round(_SHORTEST * self._nominal_ns)
        self.longest_ns: int = self.overdue_ns

    def learn(self, seen: Seen) -> None:
        """Narrow the interval.

        Raises ProtocolError if no duration fits both this conversion and those before it.
        """
        drift = round(_DRIFT * self._nominal_ns)
        sooner = drift if seen.busy > seen.asked else _UNSEEN_NS
        at_least = seen.busy - seen.begun
        at_most = seen.ended - seen.asked
        shortest = max(self.shortest_ns - sooner, at_least)
        longest = min(self.longest_ns + drift, at_most)
        if shortest > longest:
            self._reset()
            took = f"{at_least / 1e6:.2f} to {at_most / 1e6:.2f} ms"
            before = f"{shortest / 1e6:.2f} to {longest / 1e6:.2f} ms"
            why = "another program uses the board, or the clock of the chip changed"
            raise ProtocolError(f"a conversion took {took}, those before it {before}: {why}")
        self.shortest_ns = shortest
        self.longest_ns = longest

    def middle(self, seen: Seen) -> Middle:
        """Return the time of the middle of a conversion that was learned, with its bounds."""
        # With begin B, end E and duration D the middle is B + D/2 = E - D/2 = (B + E)/2. Each form
        # with the bounds of its two terms is a bound of the middle, and the narrowest of the three
        # is exact (linear programming: one of the forms is the dual solution). A write usually
        # returns half a transfer, or a little more, after the conversion begins, and the shortest
        # duration is too short by the same amount. So the time is `begun` plus half of the shortest
        # duration, if the bounds allow it.
        short = self.shortest_ns // 2
        long = -(-self.longest_ns // 2)
        earliest = max(seen.asked + short, seen.busy - long, (seen.asked + seen.busy) // 2)
        latest = min(seen.begun + long, seen.ended - short, (seen.begun + seen.ended) // 2)
        t_ns = min(max(seen.begun + short, earliest), latest)
        return Middle(t_ns, t_ns - earliest, latest - t_ns)


_SOONER_NS = 500_000  # polls begin up to this before the earliest possible end
_SECTION_NS = 309_017  # its golden section, whose multiples fill it evenly
_PROMPT = 0.75  # part of the limit: after a longer write the start is too uncertain
# Time that bus and USB add to a conversion, until one was measured: of the kit's bus at 85 kHz.
_BUS_S = 0.0047
_MARGIN = 1.25  # of the chip's clock and of other buses
_STEPS = 15  # conversions whose median is the time of one
_TRIALS = 16  # of the search for a CAPDAC, twice the bits of its range
_RDY = "STATUS shows another state; check the jumper RDY of link LK2"

_Speed = tuple[int, bool]  # CAPF and CAPCHOP, which set the duration of a conversion.


class ChannelReading(NamedTuple):
    """Result of one conversion: its middle (ns of the clock), code, capacitance (pF), `Status`."""

    middle: Middle
    raw: int
    capacitance: float
    status: Status


class CapdacSearch:
    """Search for the CAPDAC steps that bring a signal into the middle of the range."""

    def __init__(self, steps: int) -> None:
        self.steps = steps
        self._low = -DAC_STEPS
        self._high = DAC_STEPS

    def advance(self, reading: ChannelReading) -> None:
        """Choose the next steps from a reading with the present ones."""
        above = reading.capacitance > 0
        if above:
            self._low = self.steps
        else:
            self._high = self.steps
        if reading.status:  # a saturated code shows only the direction: bisect
            self.steps = (self._low + self._high + above) // 2
        else:  # any other code shows the distance, to 20 %
            distance = round(reading.capacitance / DAC_STEP_PF)
            self.steps = min(max(self.steps + distance, self._low), self._high)


class Overdue(SourceTimeout):
    """The device answers, but this conversion is too late."""


class Converter:
    """Converts one channel at a time, with a configuration."""

    def __init__(self, access: Access, configuration: Configuration, limit_ns: int) -> None:
        self.configuration = configuration
        self.limit_ns = limit_ns
        self.dump = b""
        self._access = access
        self._clock = access.clock
        self._paces: dict[_Speed, Pace] = {}
        self._steps_ns: dict[_Speed, deque[int]] = defaultdict(lambda: deque(maxlen=_STEPS))
        self._fastest_ns: dict[_Speed, int] = {}
        self._sooner_ns = 0
        self.seen = Seen(0, 0, 0, 0)  # of the last conversion

    @property
    def step_s(self) -> float:
        """Time of a conversion with all its accesses, s: median of the last ones, or an estimate."""
        steps_ns = self._steps_ns.get(self._speed)
        if steps_ns:
            return statistics.median(steps_ns) / 1e9
        return self.configuration.conversion_s + _BUS_S

    @property
    def fastest_step_s(self) -> float:
        """Time of a conversion with all its accesses on a computer that is never late, s.

        This is the fastest conversion so far. If even that one took far more than the conversion
        time by the registers and the bus time of the kit, the computer was always late: then it is
        their sum with a quarter as a margin.
        """
        conversion_s = self.configuration.conversion_s
        if self.configuration.chop:
            conversion_s *= 2
        most_s = _MARGIN * (conversion_s + _BUS_S)
        fastest_ns = self._fastest_ns.get(self._speed)
        return most_s if fastest_ns is None else min(fastest_ns / 1e9, most_s)

    @property
    def _speed(self) -> _Speed:
        return self.configuration.capf, self.configuration.chop

    def set_up(self) -> None:
        """Reset the chip, write the configuration in idle mode, and read it back."""
        self._paces.clear()  # it may be another chip
        self._access.repeated(self._reset)
        setup, in_range = self.configuration.registers(HARD)
        idle = setup[:-1] + bytes([setup[-1] & ~7])
        self._access.write(CAPDAC_A, in_range)
        self._access.write(CAP_SETUP, idle)
        self.dump = self._access.read(0, REGISTERS)
        require_same(idle + in_range, self.dump)

    def _reset(self) -> None:
        """Reset the chip.

        A chip that resets at once cannot acknowledge the byte: its registers show the reset.
        """
        try:
            self._access.bus.reset()
        except NotAcknowledged:
            self._clock.sleep(2 * RESET_S)
            known = RESET_VALUES[CAP_SETUP:]
            if self._access.bus.read(CAP_SETUP, len(known)) != known:
                raise
        self._clock.sleep(2 * RESET_S)

    def convert(self, channel: int) -> ChannelReading:
        """Convert one channel, `HARD` or `SOFT`, once."""
        entered = self._clock.now_ns()
        setup, in_range = self.configuration.registers(channel)
        self._access.write(CAPDAC_A, in_range)
        pace = self._paces.setdefault(self._speed, Pace(self.configuration.conversion_s))
        seen, image = self._run(setup, in_range, pace, RDYCAP)
        self.seen = seen
        pace.learn(seen)
        step_ns = self._clock.now_ns() - entered
        self._steps_ns[self._speed].append(step_ns)
        self._fastest_ns[self._speed] = min(self._fastest_ns.get(self._speed, step_ns), step_ns)
        raw = int.from_bytes(image[CAP_DATA:VT_DATA], "big")
        status = Status.OK
        if is_saturated(raw):
            status |= SATURATION[channel]
        if image[STATUS] & EXCERR:
            status |= Status.EXCITATION
        return ChannelReading(pace.middle(seen), raw, capacitance_pF(raw), status)

    def gains(self) -> bytes:
        """Return CAP_GAIN and VOLT_GAIN: set in the factory, constant, different in each chip."""
        return self._access.read(CAP_GAIN, REGISTERS - CAP_GAIN)

    def voltage(self, mode: int) -> int:
        """Return a code of the voltage channel; `mode`: VT_TEMPERATURE or VT_SUPPLY."""
        setup = self.configuration.voltage_registers(mode)
        _, image = self._run(setup, b"", Pace(VT_CONVERSION_S[0]), RDYVT)
        return int.from_bytes(image[VT_DATA:CAP_SETUP], "big")

    def auto_capdac(self) -> None:
        """Choose each channel's CAPDAC: its present signal is in the middle of the range."""
        for channel in (HARD, SOFT):
            self._centre(channel)
        self.dump = self._access.read(0, REGISTERS)

    def _centre(self, channel: int) -> None:
        search = CapdacSearch(self.configuration.channel(channel).capdac)
        for _ in range(_TRIALS):
            self.configuration = self.configuration.with_capdac(channel, search.steps)
            reading = self.patiently(channel)
            if reading.status & Status.EXCITATION:
                why = "EXCERR: the excitation pin is shorted or overloaded"
                raise ProtocolError(f"{NAMES[channel]}: {why}")
            if not reading.status and abs(reading.capacitance) <= 0.75 * DAC_STEP_PF:
                return
            search.advance(reading)
        raise ProtocolError(
            f"{NAMES[channel]}: no CAPDAC setting brings the idle signal into the range: "
            "the input has more than 17 pF, is shorted, or changes all the time; "
            "check the cable of the probe"
        )

    def patiently(self, channel: int) -> ChannelReading:
        """Convert one channel; a conversion that is lost is repeated twice."""
        return repeated(lambda: self.convert(channel))

    def _run(self, setup: bytes, in_range: bytes, pace: Pace, bit: int) -> tuple[Seen, bytes]:
        """Begin a conversion with the last byte of `setup`, wait for its end, read 0x00 to 0x0E."""
        for _ in range(TRIES):
            asked, begun = self._access.write(CAP_SETUP, setup)
            if begun - asked <= _PROMPT * self.limit_ns:
                break  # else its begin is too uncertain: begin it again
        busy, ended = self._wait(asked, begun, pace, bit)
        retries = self._access.counters.retries
        image = self._access.read(0, CAP_GAIN)
        require_same(setup + in_range, image)
        if image[STATUS] & bit:
            if self._access.counters.retries != retries:  # the chip marks data as new only once
                raise ProtocolError("a transfer with data was damaged")
            raise ProtocolError(f"the pin RDY# is stuck low: {_RDY}")
        if busy == asked:
            # A pin that was never high may be stuck low: only STATUS, in the image, shows the end.
            ended = self._clock.now_ns()
        return Seen(asked, begun, busy, ended), image

    def _wait(self, asked: int, begun: int, pace: Pace, bit: int) -> tuple[int, int]:
        """Return the times, ns, of the last poll during a conversion, and of the first after it."""
        self._sooner_ns = (self._sooner_ns + _SECTION_NS) % _SOONER_NS
        first_poll = asked + pace.shortest_ns - self._sooner_ns
        self._clock.sleep((first_poll - self._clock.now_ns()) / 1e9)
        busy = asked
        while True:
            now = self._clock.now_ns()
            if self._access.repeated(self._access.bus.ready):
                return busy, self._clock.now_ns()
            busy = now
            if now > begun + pace.overdue_ns:
                raise self._overdue((now - begun) / 1e9, bit)

    def _overdue(self, lasting_s: float, bit: int) -> SourceError:
        """Return the error about a conversion whose end the pin RDY# did not show."""
        if not self._access.read(STATUS, 1)[0] & bit:
            return ProtocolError(f"the pin RDY# is stuck high: {_RDY}")
        return Overdue(
            f"a conversion did not end within {lasting_s:.3f} s: it was lost, or the chip is not "
            "clocked; if it happens again, unplug the board for a moment"
        )
