"""Single conversions of the AD7746, over any bus. Not tried on hardware.

The steps of a conversion: write CAPDACs and offset; write 0x07 to 0x0A in one burst, CONFIG last; wait for RDY; read
0x00 to 0x0E in one transaction. That is more than the data: the other registers show whether the data belong to the
requested channel. Another program, or a short failure of the supply, may have changed the registers, and then the data
would be from another channel.

The time of a conversion is its middle. The computer knows times around its own calls only, and may be stopped for a while
anywhere between them: so each statement of `Pace` is an interval that holds however long it was stopped, and nothing is
assumed about the bus.
"""

import statistics
from collections import defaultdict, deque
from typing import NamedTuple

from palpate.ad7746 import registers
from palpate.ad7746.bus import TRIES, Access, NotAcknowledged, repeated
from palpate.ad7746.configuration import HARD, NAMES, SATURATION, SOFT, Configuration, require_same
from palpate.errors import ProtocolError, SourceTimeout
from palpate.samples import Status

# Duration of a conversion before one was seen, relative to the data sheet's, at least: the chip's clock is +-5 %.
_SHORTEST = 0.9
# If no poll found a conversion running, the polls may have begun too late: the next ones begin so much earlier.
_UNSEEN_NS = 500_000
# A conversion is overdue after this multiple of the data sheet's duration (about 2 with CAPCHOP) and this time.
_OVERDUE, _OVERDUE_NS = 2.5, 20_000_000
# Change of the chip's clock from one conversion to the next, relative, at most: 0.018 to 0.18 % a second.
_DRIFT = 2e-5


class Seen(NamedTuple):
    """What the computer saw of a conversion, ns: it began in [asked, begun], and ended in [busy, ended]."""

    asked: int
    begun: int
    busy: int
    ended: int


class Middle(NamedTuple):
    """Time of the middle of a conversion, ns, and how much earlier or later it may have been, ns, from 0."""

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

    # The chip's own clock paces it. A conversion lasted at least from its latest begin to its earliest end, and at most
    # from its earliest begin to its latest end; the duration is in the intersection of all these intervals.

    def __init__(self, nominal_s: float) -> None:
        self._nominal_ns = nominal_s * 1e9
        self.overdue_ns: int = (
            round(_OVERDUE * self._nominal_ns) + _OVERDUE_NS
        )  # after the begin: it must have ended
        self._forget()

    def _forget(self) -> None:
        """Know only the data sheet's duration, as before the first conversion."""
        self.shortest_ns: int = round(_SHORTEST * self._nominal_ns)
        self.longest_ns: int = self.overdue_ns

    def learn(self, seen: Seen) -> None:
        """Narrow the interval; ProtocolError: no duration fits, so it was another conversion, or those before it were."""
        drift = round(_DRIFT * self._nominal_ns)
        sooner = drift if seen.busy > seen.asked else _UNSEEN_NS
        shortest = max(self.shortest_ns - sooner, seen.busy - seen.begun)
        longest = min(self.longest_ns + drift, seen.ended - seen.asked)
        if shortest > longest:
            self._forget()
            took = (
                f"{(seen.busy - seen.begun) / 1e6:.2f} to {(seen.ended - seen.asked) / 1e6:.2f} ms"
            )
            before = f"{shortest / 1e6:.2f} to {longest / 1e6:.2f} ms"
            why = "another program uses the board, or the clock of the chip changed"
            raise ProtocolError(f"a conversion took {took}, those before it {before}: {why}")
        self.shortest_ns, self.longest_ns = shortest, longest

    def middle(self, seen: Seen) -> Middle:
        """Return the time of the middle of a conversion that was learned, with its bounds."""
        # With begin B, end E and duration D the middle is B + D/2 = E - D/2 = (B + E)/2: each form with the bounds of its
        # two terms is a bound of the middle, and the narrowest of the three is exact (linear programming: one of the
        # forms is the dual solution). A write normally returns as late after the begin as the shortest duration is too
        # short, in each case half of a transfer, or a little more: so the time is `begun` plus half of that, if the bounds
        # allow it.
        short, long = self.shortest_ns // 2, -(-self.longest_ns // 2)
        earliest = max(seen.asked + short, seen.busy - long, (seen.asked + seen.busy) // 2)
        latest = min(seen.begun + long, seen.ended - short, (seen.begun + seen.ended) // 2)
        t_ns = min(max(seen.begun + short, earliest), latest)
        return Middle(t_ns, t_ns - earliest, latest - t_ns)


_SOONER_NS = 500_000  # polls begin up to this before the earliest possible end
_SECTION_NS = 309_017  # its golden section, whose multiples fill it evenly
_PROMPT = 0.75  # part of the limit: a write that took longer leaves the begin too uncertain
_BUS_S = (
    0.0047  # what bus and USB add to a conversion, until one was measured: the kit's bus at 85 kHz
)
_STEPS = 15  # conversions whose median is the time of one
_RDY = "STATUS shows another state; check the jumper RDY of link LK2"

_Speed = tuple[int, bool]  # CAPF and CAPCHOP, which set the duration of a conversion.


class Reading(NamedTuple):
    """Result of one conversion: its middle (ns of the clock), code, capacitance (pF), `Status`."""

    middle: Middle
    raw: int
    capacitance: float
    status: Status


class Overdue(SourceTimeout):
    """The device answers, but this conversion is too late."""


class Converter:
    """Converts one channel at a time, with a configuration."""

    def __init__(self, access: Access, configuration: Configuration, limit_ns: int) -> None:
        self.configuration = configuration
        self.limit_ns = limit_ns
        self.dump = b""
        self._access, self._clock = access, access.clock
        self._paces: dict[_Speed, Pace] = {}
        self._steps_ns: dict[_Speed, deque[int]] = defaultdict(lambda: deque(maxlen=_STEPS))
        self._sooner_ns = 0
        self.seen = Seen(0, 0, 0, 0)  # of the last conversion

    @property
    def step_s(self) -> float:
        """Time of a conversion with all its accesses, s: the median of the last ones; before the first, an estimate."""
        if steps_ns := self._steps_ns[self.configuration.capf, self.configuration.chop]:
            return statistics.median(steps_ns) / 1e9
        return self.configuration.conversion_s + _BUS_S

    def set_up(self) -> None:
        """Reset the chip, write the configuration in idle mode, and check that it reads back the same."""
        self._paces.clear()  # it may be another chip
        self._access.repeated(self._reset)
        setup, in_range = self.configuration.registers(HARD)
        idle = setup[:-1] + bytes([setup[-1] & ~7])
        self._access.write(registers.CAPDAC_A, in_range)
        self._access.write(registers.CAP_SETUP, idle)
        self.dump = self._access.read(0, registers.REGISTERS)
        require_same(idle + in_range, self.dump)

    def _reset(self) -> None:
        """Reset the chip. One that resets at once cannot acknowledge the byte: then its registers show the reset."""
        try:
            self._access.bus.reset()
        except NotAcknowledged:
            self._clock.sleep(2 * registers.RESET_S)
            known = registers.RESET_VALUES[registers.CAP_SETUP :]
            if self._access.bus.read(registers.CAP_SETUP, len(known)) != known:
                raise
        self._clock.sleep(2 * registers.RESET_S)

    def convert(self, channel: int) -> Reading:
        """Convert one channel, `HARD` or `SOFT`, once."""
        entered = self._clock.now_ns()
        setup, in_range = self.configuration.registers(channel)
        self._access.write(registers.CAPDAC_A, in_range)
        speed = self.configuration.capf, self.configuration.chop
        pace = self._paces.setdefault(speed, Pace(self.configuration.conversion_s))
        seen, image = self._run(setup, in_range, pace, registers.RDYCAP)
        self.seen = seen
        pace.learn(seen)
        self._steps_ns[speed].append(self._clock.now_ns() - entered)
        raw = int.from_bytes(image[registers.CAP_DATA : registers.VT_DATA], "big")
        status = SATURATION[channel] if registers.saturated(raw) else Status.OK
        status |= Status.EXCITATION if image[registers.STATUS] & registers.EXCERR else Status.OK
        return Reading(pace.middle(seen), raw, registers.capacitance_pF(raw), status)

    def gains(self) -> bytes:
        """Return CAP_GAIN and VOLT_GAIN: set in the factory, other ones in each chip, and constant."""
        return self._access.read(registers.CAP_GAIN, registers.REGISTERS - registers.CAP_GAIN)

    def voltage(self, mode: int) -> int:
        """Return a code of the voltage channel; `mode`: VT_TEMPERATURE or VT_SUPPLY."""
        setup = self.configuration.voltage_registers(mode)
        _, image = self._run(setup, b"", Pace(registers.VT_CONVERSION_S[0]), registers.RDYVT)
        return int.from_bytes(image[registers.VT_DATA : registers.CAP_SETUP], "big")

    def auto_capdac(self) -> None:
        """Choose each channel's CAPDAC so that its present signal lies in the middle of the range."""
        for channel in (HARD, SOFT):
            self._centre(channel)
        self.dump = self._access.read(0, registers.REGISTERS)

    def _centre(self, channel: int) -> None:
        low, high = -registers.DAC_STEPS, registers.DAC_STEPS
        steps = self.configuration.channel(channel).capdac
        for _ in range(2 * (high - low).bit_length()):
            self.configuration = self.configuration.with_capdac(channel, steps)
            reading = self.patiently(channel)
            if reading.status & Status.EXCITATION:
                raise ProtocolError(
                    f"{NAMES[channel]}: EXCERR: the excitation pin is shorted or overloaded"
                )
            if not reading.status and abs(reading.capacitance) <= 0.75 * registers.DAC_STEP_PF:
                return
            low, high = (steps, high) if reading.capacitance > 0 else (low, steps)
            # A saturated code shows only the direction: bisect. Any other code shows the distance, to 20 %.
            move = reading.capacitance / registers.DAC_STEP_PF
            steps = (
                (low + high + (move > 0)) // 2
                if reading.status
                else min(max(steps + round(move), low), high)
            )
        why = "the input has more than 17 pF, is shorted, or changes all the time; check the cable of the probe"
        raise ProtocolError(
            f"{NAMES[channel]}: no CAPDAC setting brings the idle signal into the range: {why}"
        )

    def patiently(self, channel: int) -> Reading:
        """Convert one channel; a conversion that is lost is repeated twice."""
        return repeated(lambda: self.convert(channel))

    def _run(self, setup: bytes, in_range: bytes, pace: Pace, bit: int) -> tuple[Seen, bytes]:
        """Begin a conversion with the last byte of `setup`, wait until it has ended, read 0x00 to 0x0E."""
        for _ in range(TRIES):
            asked, begun = self._access.write(registers.CAP_SETUP, setup)
            if begun - asked <= _PROMPT * self.limit_ns:
                break  # else its begin is too uncertain: begin it again
        busy, ended = self._wait(asked, begun, pace, bit)
        retries = self._access.counters.retries
        image = self._access.read(0, registers.CAP_GAIN)
        require_same(setup + in_range, image)
        if image[registers.STATUS] & bit:
            damaged = (
                self._access.counters.retries != retries
            )  # the chip marks data as new only once
            raise ProtocolError(
                "a transfer with data was damaged"
                if damaged
                else f"the pin RDY# is stuck low: {_RDY}"
            )
        # A pin that was never high may be stuck low: then only STATUS, in the image, shows the end.
        return Seen(asked, begun, busy, ended if busy > asked else self._clock.now_ns()), image

    def _wait(self, asked: int, begun: int, pace: Pace, bit: int) -> tuple[int, int]:
        """Return two times, ns: the last poll that found the conversion running, the first that found it ended."""
        self._sooner_ns = (self._sooner_ns + _SECTION_NS) % _SOONER_NS
        self._clock.sleep((asked + pace.shortest_ns - self._sooner_ns - self._clock.now_ns()) / 1e9)
        busy = asked
        while True:
            now = self._clock.now_ns()
            if self._access.repeated(self._access.bus.ready):
                return busy, self._clock.now_ns()
            busy = now
            if now > begun + pace.overdue_ns:
                if not self._access.read(registers.STATUS, 1)[0] & bit:
                    raise ProtocolError(f"the pin RDY# is stuck high: {_RDY}")
                why = "it was lost, or the chip is not clocked; if it happens again, unplug the board for a moment"
                raise Overdue(f"a conversion did not end within {(now - begun) / 1e9:.3f} s: {why}")
