"""A replacement of smbus2 for the I2C driver, with a simulated chip."""

import errno
from typing import Any

from palpate.ad7746.clock import VirtualClock
from palpate.ad7746.twin.chip import ChipTwin


class Bus:
    """A replacement of smbus2.SMBus for `I2cBus`."""

    def __init__(self, chip: ChipTwin, clock: VirtualClock, bus_kHz: float = 400.0) -> None:
        self.chip, self.clock = chip, clock
        self.bit_s = 1e-3 / bus_kHz
        self.opened = 0
        self.failures: list[int] = []

    def __call__(self, path: str) -> "Bus":
        assert path == "/dev/i2c-1"
        if self.failures:
            raise OSError(self.failures.pop(0), "failed")
        self.opened += 1
        return self

    def i2c_rdwr(self, *messages: Any) -> None:
        if self.failures:
            raise OSError(self.failures.pop(0), "failed")
        if not self.chip.acknowledges(self.clock.now_ns()):
            raise OSError(errno.EREMOTEIO, "Remote I/O error")
        for message in messages:
            assert message.addr == 0x48
            lasting = (9 * (1 + message.len) + 2) * self.bit_s
            now = self.clock.now_ns()
            if message.flags & 1:
                data = self.chip.read(message.len, now, round(lasting * 1e9))
                for number, byte in enumerate(data):
                    message.buf[number] = bytes([byte])
            else:
                self.chip.write(bytes(message), now + round(lasting * 1e9))
            self.clock.sleep(lasting)

    def close(self) -> None:
        self.opened -= 1
