"""Single conversions of the AD7746, over any bus. Not tried on hardware.

The steps of a conversion: write CAPDACs and offset if they differ from those in the chip; write 0x07 to 0x0A in one
burst, CONFIG last; wait for RDY; read 0x00 to 0x0E in one transaction. That is more than the data: the other
registers show whether the data belong to the requested channel. Another program, or a short failure of the supply,
may have changed the registers, and then the data would be from another channel.
"""

from collections.abc import Callable
from typing import NamedTuple, NoReturn, TypeVar

from palpate.ad7746 import datasheet
from palpate.ad7746.bus import Counters, RegisterBus, repeated
from palpate.ad7746.clock import Clock
from palpate.ad7746.configuration import HARD, NAMES, SOFT, Configuration, differs
from palpate.errors import ProtocolError, SourceTimeout
from palpate.samples import Status

_POLL_S = 0.00025
_EARLY = 0.98  # fraction of the nominal conversion time after which RDY is polled
_LATE_S = 0.02  # a conversion is overdue after 1.5 times its nominal time plus this
_PATIENCE = 3  # tries of a conversion in the CAPDAC search
_SATURATED = (Status.HARD_SATURATED, Status.SOFT_SATURATED)

T = TypeVar("T")


class Reading(NamedTuple):
    """Result of one conversion: time of its middle (ns of the clock), code, capacitance (pF), `Status`."""

    t_ns: int
    raw: int
    capacitance: float
    status: Status


class Overdue(SourceTimeout):
    """The device answers, but this conversion is too late."""


class _Span(NamedTuple):
    """Earliest and latest start of a conversion, its duration (ns), and the registers after it."""

    earliest: int
    latest: int
    nominal: int
    image: bytes

    def middle_ns(self) -> int:
        """Return the time of the middle, ns.

        Normally the start is known to within one transfer; on a busy computer it is less certain.
        """
        if self.latest - self.earliest > self.nominal:
            raise Overdue(
                f"the start of a conversion is uncertain by {(self.latest - self.earliest) / 1e9:.3f} s, more than its "
                "duration: the computer is too busy, or the board answers late"
            )
        return self.latest + self.nominal // 2


class Converter:
    """Converts one channel at a time, with a configuration.

    Parameters
    ----------
    bus : RegisterBus
    configuration : Configuration
    clock : Clock
        The clock of the bus.
    counters : Counters
        Counts failed and repeated accesses.
    check : callable
        Called before each access; an exception that it raises ends the method.

    Raises
    ------
    SourceError
        From every method that accesses the chip, after the repetitions of `palpate.ad7746.bus.repeated`.
    """

    def __init__(
        self,
        bus: RegisterBus,
        configuration: Configuration,
        clock: Clock,
        counters: Counters,
        check: Callable[[], None],
    ) -> None:
        self.configuration: Configuration = configuration
        self.dump: bytes = b""
        self._bus = bus
        self._clock = clock
        self._counters = counters
        self._check = check
        self._range = b""  # content of CAPDAC_A to CAP_OFFSET; empty: unknown
        self._trust_pin = True

    def set_up(self) -> None:
        """Reset the chip, write the configuration in idle mode, and check that it reads back the same."""
        self._range, self._trust_pin = b"", True
        self._access(self._bus.reset)
        self._clock.sleep(2 * datasheet.RESET_S)
        setup, in_range = self.configuration.registers(HARD)
        idle = setup[:-1] + bytes([setup[-1] & ~7])
        self._access(lambda: self._bus.write(datasheet.CAPDAC_A, in_range))
        self._access(lambda: self._bus.write(datasheet.CAP_SETUP, idle))
        self.dump = self._access(lambda: self._bus.read(0, datasheet.REGISTERS))
        _same(idle + in_range, self.dump)

    def convert(self, channel: int) -> Reading:
        """Convert one channel, `HARD` or `SOFT`, once."""
        setup, in_range = self.configuration.registers(channel)
        if self._range != in_range:
            self._range = b""
            self._access(lambda: self._bus.write(datasheet.CAPDAC_A, in_range))
        span = self._run(setup, in_range, round(self.configuration.conversion_s * 1e9), datasheet.RDYCAP)
        self._range = in_range
        raw = int.from_bytes(span.image[datasheet.CAP_DATA : datasheet.VT_DATA], "big")
        status = _SATURATED[channel] if datasheet.saturated(raw) else Status.OK
        status |= Status.EXCITATION if span.image[datasheet.STATUS] & datasheet.EXCERR else Status.OK
        return Reading(span.middle_ns(), raw, datasheet.capacitance_pF(raw), status)

    def forget(self) -> None:
        """Write all registers again before the next conversion."""
        self._range = b""

    def temperature(self) -> float:
        """Measure the temperature of the chip, degrees Celsius."""
        setup = self.configuration.temperature_registers
        image = self._run(setup, b"", round(self.configuration.temperature_s * 1e9), datasheet.RDYVT).image
        return datasheet.temperature_C(int.from_bytes(image[datasheet.VT_DATA : datasheet.CAP_SETUP], "big"))

    def auto_capdac(self) -> None:
        """Choose each channel's CAPDAC so that its present signal lies in the middle of the range."""
        for channel in (HARD, SOFT):
            self._centre(channel)
        self.dump = self._access(lambda: self._bus.read(0, datasheet.REGISTERS))

    def _centre(self, channel: int) -> None:
        low, high = -datasheet.DAC_STEPS, datasheet.DAC_STEPS
        steps = self.configuration.channel(channel).capdac
        for _ in range(2 * (high - low).bit_length()):
            self.configuration = self.configuration.with_capdac(channel, steps)
            reading = self.patiently(channel)
            if reading.status & Status.EXCITATION:
                raise ProtocolError(f"{NAMES[channel]}: EXCERR: the excitation pin is shorted or overloaded")
            if not reading.status and abs(reading.capacitance) <= 0.75 * datasheet.DAC_STEP_PF:
                return
            low, high = (steps, high) if reading.capacitance > 0 else (low, steps)
            # A saturated code shows only the direction: bisect. Any other code shows the distance, to 20 %.
            move = reading.capacitance / datasheet.DAC_STEP_PF
            steps = (low + high + (move > 0)) // 2 if reading.status else min(max(steps + round(move), low), high)
        raise ProtocolError(
            f"{NAMES[channel]}: no CAPDAC setting brings the idle signal into the range: the input has more than "
            "17 pF, is shorted, or changes all the time; check the cable of the probe"
        )

    def patiently(self, channel: int) -> Reading:
        """Convert one channel; a conversion that is lost is repeated twice."""
        for _ in range(_PATIENCE - 1):
            try:
                return self.convert(channel)
            except (SourceTimeout, ProtocolError):
                self.forget()
        return self.convert(channel)

    def _run(self, setup: bytes, in_range: bytes, nominal: int, bit: int) -> "_Span":
        """Begin a conversion with the last byte of `setup`, wait until it has ended, read 0x00 to 0x0E."""
        asked, begun = self._access(lambda: (self._clock.now_ns(), self._bus.write(datasheet.CAP_SETUP, setup)))
        busy, ended = self._wait(asked, begun, nominal, bit)
        retries = self._counters.retries
        image = self._access(lambda: self._bus.read(0, datasheet.CAP_GAIN))
        _same(setup + in_range, image)
        if image[datasheet.STATUS] & bit:
            self._not_new(repeated=self._counters.retries != retries)
        return _Span(max(asked, busy - nominal), min(begun, ended - nominal), nominal, image)

    def _not_new(self, *, repeated: bool) -> NoReturn:
        if repeated:
            raise ProtocolError(
                "a transfer with data was damaged; the AD7746 marks data as new only once, so they cannot be read again"
            )
        self._trust_pin = False  # from now on read STATUS instead, before the data
        self._counters.errors += 1
        raise ProtocolError("the RDY# pin shows the end of a conversion, STATUS does not: the pin is stuck low")

    def _wait(self, asked: int, begun: int, nominal: int, bit: int) -> tuple[int, int]:
        """Return two times, ns: the last poll that found the conversion running, the first that found it ended."""
        self._clock.sleep((asked + _EARLY * nominal - self._clock.now_ns()) / 1e9)
        busy = asked
        while True:
            now = self._clock.now_ns()
            if self._ready(bit):
                return busy, self._clock.now_ns()
            busy = now
            if now > begun + 1.5 * nominal + _LATE_S * 1e9:
                self._check_overdue((now - begun) / 1e9, bit)
                return asked, self._clock.now_ns()
            self._clock.sleep(_POLL_S)

    def _check_overdue(self, waited_s: float, bit: int) -> None:
        if not self._trust_pin or not self._ready_by_status(bit):
            raise Overdue(
                f"a conversion did not end within {waited_s:.3f} s: it was lost, or the chip is not clocked; "
                "if it happens again, unplug the board for a moment"
            )
        self._trust_pin = False  # stuck high: from now on read STATUS instead
        self._counters.errors += 1

    def _ready(self, bit: int) -> bool:
        return self._access(self._bus.ready) if self._trust_pin else self._ready_by_status(bit)

    def _ready_by_status(self, bit: int) -> bool:
        return not self._access(lambda: self._bus.read(datasheet.STATUS, 1))[0] & bit

    def _access(self, act: Callable[[], T]) -> T:
        return repeated(act, self._counters, self._clock, self._check)


def _same(wanted: bytes, image: bytes) -> None:
    register = differs(wanted, image[datasheet.CAP_SETUP :])
    if register is not None:
        raise ProtocolError(
            f"register 0x{register:02X}: got 0x{image[register]:02X}, wrote "
            f"0x{wanted[register - datasheet.CAP_SETUP]:02X}: another program uses the board, or the chip had no supply"
        )
