"""The connection of a converter to its device: opens it again after a failure, and tells another device from the same.

A chip has no serial number, but other gains than any other chip, set in the factory.
"""

from collections.abc import Callable

from palpate.ad7746 import datasheet
from palpate.ad7746.bus import NotReady, RegisterBus
from palpate.ad7746.clock import Clock
from palpate.ad7746.converter import Converter
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, SourceTimeout

_POLL_S = 0.1
_TRIES = 3  # to open the device again, before the error of the last one counts
_GAINS_NS = 1_000_000_000  # from one look at the gains to the next; it takes 1 ms


class OtherGains(ProtocolError):
    """The chip has not the gains that it had."""


class Connection:
    """Sets up a chip, and opens its device again.

    Parameters
    ----------
    bus : RegisterBus
    converter : Converter
        Of this bus.
    clock : Clock
        The clock of the bus.
    notify : callable
        Called with a message while the device is away.
    check : callable
        Called again and again while waiting; an exception that it raises ends the method.

    Attributes
    ----------
    gains : bytes
        Registers CAP_GAIN and VOLT_GAIN; empty before `set_up`.
    away : str
        Set by `wait`: a sentence that says that it waits for the device; the caller empties it.
    """

    def __init__(
        self,
        bus: RegisterBus,
        converter: Converter,
        clock: Clock,
        notify: Callable[[str], None],
        check: Callable[[], None],
    ) -> None:
        self.gains: bytes = b""
        self.away: str = ""
        self._bus, self._converter, self._clock = bus, converter, clock
        self._notify, self._check = notify, check
        self._due_ns = 0

    def set_up(self) -> str:
        """Reset and configure the chip; return "" or, if it is another one than before, a text that says so."""
        self._converter.set_up()
        self._due_ns = self._clock.now_ns() + _GAINS_NS
        found = self._converter.dump[datasheet.CAP_GAIN :]
        before, self.gains = self.gains or found, found
        if found == before:
            return ""
        return f"; another board: the gains of its chip are {found.hex(' ')}, before {before.hex(' ')}"

    def check_gains(self) -> None:
        """Raise OtherGains if the gains have changed; looks once a second."""
        now = self._clock.now_ns()
        if now < self._due_ns:
            return
        self._due_ns = now + _GAINS_NS
        if (found := self._converter.gains()) != self.gains:
            raise OtherGains(
                f"the gains of the chip (registers 0x0F to 0x12) are {found.hex(' ')}, before {self.gains.hex(' ')}: "
                "another program uses the board; close that program"
            )

    def open_again(self) -> str:
        """Open the device, which was there all the time, again; return as `set_up`.

        Tries three times, and raises the error of the last try.
        """
        for left in reversed(range(_TRIES)):
            try:
                self._bus.reopen()
                return self.set_up()
            except (SourceTimeout, ProtocolError):
                if not left:
                    raise
            except NotReady as error:
                if not left:
                    raise DeviceRefused(str(error)) from error
            self._clock.sleep(_POLL_S)
        raise AssertionError("unreachable")

    def wait(self, gone: DeviceNotFound, longest_s: float) -> str:
        """Wait until an unplugged device is back; return as `set_up`. Raises the error of the last try."""
        self.away = f"The board is gone: plug it in again. It is waited for, up to {longest_s:g} s."
        self._notify(f"{gone} Waiting for it, up to {longest_s:g} s.")
        deadline = self._clock.now_ns() + longest_s * 1e9
        told = False
        while True:
            try:
                self._check()
                self._bus.reopen()
                return self.set_up()
            except DeviceRefused:
                raise
            except NotReady as error:
                if self._clock.now_ns() > deadline:
                    raise DeviceRefused(str(error)) from error
                if not told:
                    told = True
                    self.away = f"{error}. Waiting for a program that loads it."
                    self._notify(self.away)
            except SourceError:
                if self._clock.now_ns() > deadline:
                    raise
            self._clock.sleep(_POLL_S)
