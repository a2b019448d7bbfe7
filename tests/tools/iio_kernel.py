"""The files of the kernel's driver for the AD7746, as drivers/iio/cdc/ad7746.c behaves: reads convert, and sleep.

They take the place of `read_text` and `write_text` in `palpate.sources.iio`, because a file in a folder cannot convert.
"""

import errno
import os
import random
from pathlib import Path

import pytest
from palpate.ad7746 import registers

FREQUENCIES = (91, 84, 50, 26, 16, 13, 11, 9)
SLEEPS_MS = (12, 13, 21, 39, 63, 78, 93, 111)
LAST_OFFSET = 43_008_000
I2C_NS = 1_160_000  # of four writes of a register at 100 kHz, before a conversion; the read after it takes half as long


class Kernel:
    """One AD7746 with the kernel's driver, and a clock of its own."""

    def __init__(
        self, folder: Path, picofarads: tuple[float, float] = (1.0, -1.0), *, hz: int = 1000,
        step_pF: float = registers.DAC_STEP_PF, pins: str = "B", root: bool = True,
    ) -> None:  # fmt: skip
        # pF at CIN1 and CIN2; ticks a second, at which a sleep ends; a step of this chip's CAPDAC; excitation pins of the
        # device tree; whether the offsets may be written.
        self.folder = folder
        self.picofarads = picofarads
        self.step_pF = step_pF
        self.pins = pins
        self.root = root
        self.tick_ns = 10**9 // hz
        self.now_ns = 10**12 + 123_456
        self.capdac = [0, 0]
        self.capf = 0
        self.random = random.Random(1)
        self.conversions: list[tuple[int, int, int]] = []  # channel, middle, code
        self.scale = "0.000000488"
        self.failures: dict[str, int] = {}
        self.stall_ns = 0  # before a conversion of the second channel

    def install(self, monkeypatch: pytest.MonkeyPatch) -> "Kernel":
        monkeypatch.setattr("palpate.sources.iio.read_text", self.read)
        monkeypatch.setattr("palpate.sources.iio.write_text", self.write)
        return self

    def clock_ns(self) -> int:
        self.now_ns += 2_000  # a call of the kernel
        return self.now_ns

    def read(self, path: Path) -> str:
        self._fail(path)
        self.now_ns += 10_000
        name = path.name
        if name.endswith("_raw"):
            return str(self.convert(int(name[14])))
        if name.endswith("_offset"):
            return str(self.capdac[int(name[14])] * 338646)
        files = {
            "name": "ad7746",
            "scale": self.scale,
            "sampling_frequency": str(FREQUENCIES[self.capf]),
        }
        return files[name.removeprefix("in_capacitance_")]

    def write(self, path: Path, text: str) -> None:
        self._fail(path)
        if not self.root:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        offset = int(text)
        assert path.name.endswith("_offset")
        assert 0 <= offset <= LAST_OFFSET
        self.capdac[int(path.name[14])] = offset // 338646

    def convert(self, channel: int) -> int:
        """Write the registers, convert, sleep, read; return the code without the middle of the range."""
        self.now_ns += I2C_NS + self.stall_ns * channel
        lasts = round(registers.CONVERSION_S[self.capf] * 1e9)
        noise = self.random.gauss(0, registers.NOISE_PF[self.capf])
        value = (self.picofarads[channel] - self.capdac[channel] * self.step_pF + noise) * bool(
            self.pins
        )
        code = registers.capacitance_code(value)
        self.conversions.append((channel, self.now_ns + lasts // 2, code))
        ticks = -(-SLEEPS_MS[self.capf] * 1_000_000 // self.tick_ns) + 1
        self.now_ns = (self.now_ns // self.tick_ns + ticks) * self.tick_ns + I2C_NS // 2
        return code - registers.ZERO_CODE

    def _fail(self, path: Path) -> None:
        if number := self.failures.get(path.name):
            raise OSError(number, os.strerror(number), str(path))
