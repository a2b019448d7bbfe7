"""The AD7746 on an I2C bus of Linux, as on a Raspberry Pi, by i2c-dev. Not tried on hardware."""

import errno
from typing import Any

from palpate.ad7746 import registers
from palpate.ad7746.bus import BusIdentity, Clock, Meanings, NotAcknowledged, RealClock, translated
from palpate.errors import DeviceNotFound, DeviceRefused, SourceTimeout, need

smbus2 = need("smbus2", "i2c")

_NO_BUS = (
    DeviceNotFound,
    "there is no such bus; on a Raspberry Pi `sudo raspi-config` turns it on.",
)
_FORBIDDEN = (
    DeviceRefused,
    "no permission to open it; `sudo usermod -aG i2c $USER`, then log out and in again",
)
_NOBODY = (
    NotAcknowledged,
    "not acknowledged: check that the AD7746 is wired to this bus and has its supply",
)
_ERRORS: Meanings = {
    errno.ENOENT: _NO_BUS,
    errno.ENODEV: _NO_BUS,
    errno.EACCES: _FORBIDDEN,
    errno.EPERM: _FORBIDDEN,
    errno.ENXIO: _NOBODY,
    121: _NOBODY,  # EREMOTEIO, which only Linux has
    errno.ETIMEDOUT: (
        SourceTimeout,
        "the bus is blocked: a wire is shorted, or the chip hangs; switch it off and on",
    ),
}


class I2cBus:
    """The AD7746 on a Linux I2C bus, at address 0x48.

    Parameters
    ----------
    path : str
        Device file of the bus, for example "/dev/i2c-1".
    clock : Clock, optional
        Clock of the write times.
    open_bus : callable, optional
        In place of smbus2.SMBus: an object with the same methods.

    Raises
    ------
    DeviceNotFound
        There is no such bus.
    DeviceRefused
        No permission to open it.

    Examples
    --------
    >>> bus = I2cBus("/dev/i2c-77")
    Traceback (most recent call last):
    palpate.errors.DeviceNotFound: /dev/i2c-77: there is no such bus; on a Raspberry Pi `sudo raspi-config` turns it on.
    """

    def __init__(self, path: str, clock: Clock | None = None, open_bus: Any = None) -> None:
        self._path = path
        self._clock = clock or RealClock()
        self._open_bus = open_bus or smbus2.SMBus
        self._bus: Any = None
        self.reopen()

    def read(self, register: int, count: int) -> bytes:
        """Return registers, in one transaction."""
        pointer = smbus2.i2c_msg.write(registers.I2C_ADDRESS, [register])
        data = smbus2.i2c_msg.read(registers.I2C_ADDRESS, count)
        self._transfer(f"reading register 0x{register:02X}", pointer, data)
        return bytes(data)

    def write(self, register: int, data: bytes) -> int:
        """Write registers; return the time when they were written, ns of the clock."""
        registers.check_write(register, data)
        self._send(f"writing register 0x{register:02X}", [register, *data])
        return self._clock.now_ns()

    def ready(self) -> bool:
        """Return whether a conversion has ended, from STATUS: there is no wire for RDY#."""
        return not self.read(registers.STATUS, 1)[0] & registers.RDY

    def reset(self) -> None:
        """Reset the AD7746."""
        self._send("resetting the AD7746", [registers.RESET_POINTER])

    def reopen(self) -> None:
        """Open the bus again."""
        self.close()
        with translated(self._path, _ERRORS):
            self._bus = self._open_bus(self._path)

    def close(self) -> None:
        """Close the bus."""
        if self._bus is not None:
            self._bus.close()
            self._bus = None

    def describe(self) -> BusIdentity:
        """Return the name of the bus."""
        return {"name": "AD7746 on an I2C bus", "bus": self._path, "address": registers.I2C_ADDRESS}

    def _send(self, what: str, data: list[int]) -> None:
        self._transfer(what, smbus2.i2c_msg.write(registers.I2C_ADDRESS, data))

    def _transfer(self, what: str, *messages: Any) -> None:
        if self._bus is None:
            raise DeviceNotFound(f"{self._path} is closed: open it again.")
        with translated(f"{self._path}: {what}", _ERRORS):
            self._bus.i2c_rdwr(*messages)
