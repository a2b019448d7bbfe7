"""The files of the Linux kernel's driver for the AD7746 in sysfs, as drivers/iio/cdc/ad7746.c defines them.

The driver leaves the CAPDACs at 0 and drives no excitation unless the device tree says so; reading the file of a channel
starts one conversion and sleeps for a fixed time. Not tried on hardware.
"""

import errno
import math
from contextlib import suppress
from pathlib import Path
from typing import Final

from palpate.ad7746 import datasheet
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, quoted
from palpate.files import read_bytes

NAME: Final = "ad7746"
CODES_PER_STEP: Final = 338646
"""`in_capacitanceN_offset` of one step of the CAPDAC: 21 pF / 127, in codes, rounded as the driver has it."""
LAST_STEP: Final = 126
"""The driver refuses offsets above 43,008,000, which is a little less than 127 steps."""
SATURATED_STEPS: Final = 41
"""From a saturated reading the range is moved by so many steps: less than its width, with a chip 20 % above typical, too."""
PINS: Final = {"A": "adi,exca-output-en", "B": "adi,excb-output-en"}
"""Excitation pin -> property of the device tree that drives it; without both the chip measures exactly 0."""
LEVEL: Final = "adi,excitation-vdd-permille"
"""Property of the level: 125, 250, 375 or 500; 125 if it is missing."""
_TIMES_S: dict[float, tuple[float, float]] = {
    frequency: (conversion_s, sleep_ms / 1000)
    for frequency, conversion_s, sleep_ms in zip(
        (91, 84, 50, 26, 16, 13, 11, 9), datasheet.CONVERSION_S, (12, 13, 21, 39, 63, 78, 93, 111), strict=True
    )
}
_LARGEST = 4096  # bytes of a file in sysfs: a page
_SCALES = ("in_capacitance_scale", "in_capacitance0_scale")
_FREQUENCIES = ("in_capacitance_sampling_frequency", "sampling_frequency")
_GONE = (errno.ENOENT, errno.ENODEV, errno.ENXIO)


class KernelDevice:
    """The folder of an AD7746 in sysfs.

    Parameters
    ----------
    path : pathlib.Path

    Raises
    ------
    DeviceNotFound, DeviceRefused
        There is no such device, it is another one, or it may not be read.
    ProtocolError
        Its scale is not that of the data sheet.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if (name := self.text("name")) != NAME:
            raise DeviceNotFound(f"{path} is {quoted(name)}, not an {NAME}")
        self.scale: str = self._first(_SCALES)
        self._check_scale()

    def times_s(self) -> tuple[float, float]:
        """Return the conversion time and the least sleep of the driver, from the sampling frequency, s; nan if unknown."""
        return _TIMES_S.get(_number(self._first(_FREQUENCIES)), (math.nan, math.nan))

    @property
    def excitation(self) -> str | None:
        """Excitation pins that the device tree drives: "", "A", "B" or "AB"; None: no device tree is shown."""
        node = self.path / "of_node"
        if not node.is_dir():
            return None
        return "".join(pin for pin, name in PINS.items() if (node / name).exists())

    def code(self, channel: int) -> int:
        """Convert channel 0 or 1; return the 24-bit code."""
        file = f"in_capacitance{channel}_raw"
        text = self.text(file)
        try:
            code = int(text) + datasheet.ZERO_CODE  # the kernel subtracts it
            datasheet.capacitance_pF(code)
        except ValueError as error:
            raise ProtocolError(f"{self.path / file}: got {quoted(text)}, allowed: -8388608 to 8388607") from error
        return code

    def steps(self, channel: int) -> int | None:
        """Return the CAPDAC of a channel, in steps; None if the driver does not say."""
        offset = _number(self._first((f"in_capacitance{channel}_offset",)))
        return round(offset / CODES_PER_STEP) if 0 <= offset <= CODES_PER_STEP * datasheet.DAC_STEPS else None

    def move(self, channel: int, steps: int) -> None:
        """Set the CAPDAC of a channel.

        Raises
        ------
        DeviceRefused
            Not permitted: only root may write the file.
        """
        file = self.path / f"in_capacitance{channel}_offset"
        try:
            write(file, str(steps * CODES_PER_STEP))
        except OSError as error:
            if error.errno in (errno.EACCES, errno.EPERM):
                both = " ".join(f"{self.path}/in_capacitance{number}_offset" for number in (0, 1))
                raise DeviceRefused(
                    f"{file}: no permission to write it: run palpate as root, or `sudo chmod a+w {both}`"
                ) from error
            raise _error(file, error) from error

    def centre(self, channel: int) -> None:
        """Set the CAPDAC of a channel by halving, until the reading is in range, then to its middle.

        A signal beyond the CAPDAC stays out of range.
        """
        low, high, steps = 0, LAST_STEP, self.steps(channel) or 0
        while True:
            self.move(channel, steps)
            code = self.code(channel)
            if not datasheet.saturated(code):
                break
            low, high = (steps + 1, high) if code > datasheet.ZERO_CODE else (low, steps - 1)
            if low > high:
                return
            steps = (low + high) // 2
        self.move(channel, _possible(steps + round(datasheet.capacitance_pF(code) / datasheet.DAC_STEP_PF)))

    def out_of_range(self, channel: int, code: int) -> str:
        """Return what to do about a saturated code."""
        steps, up = self.steps(channel) or 0, code > datasheet.ZERO_CODE
        offset = _possible(steps + (SATURATED_STEPS if up else -SATURATED_STEPS)) * CODES_PER_STEP
        return (
            f"CIN{channel + 1} is {'above' if up else 'below'} the range of {2 * datasheet.FULL_SCALE_PF:g} pF, its CAPDAC is "
            f"at {steps} steps: sudo sh -c 'echo {offset} > {self.path}/in_capacitance{channel}_offset'; or, as root, "
            f"iio:{self.path}?centre=yes finds the steps"
        )

    def text(self, name: str) -> str:
        """Return the text of a file."""
        try:
            return text_of(self.path / name)
        except OSError as error:
            raise _error(self.path / name, error) from error

    def _first(self, names: tuple[str, ...]) -> str:
        """Return the text of the first file that can be read; empty: none."""
        for name in names:
            with suppress(SourceError):
                return self.text(name)
        return ""

    def _check_scale(self) -> None:
        """Check pF a code; the driver rounds it to 0.000000488. In nF, the unit of the kernel's ABI, it is accepted, too."""
        given, known = _number(self.scale), 1 / datasheet.CODES_PER_PF
        if not any(abs(given / unit - known) < 1e-3 * known for unit in (1.0, 1e-3)):
            raise ProtocolError(
                f"{self.path}/{_SCALES[0]}: got {quoted(self.scale)}, allowed: 0.000000488, that of the data sheet: "
                "with another one the values would be wrong; check the version of the kernel's driver"
            )


def text_of(path: Path) -> str:
    """Return the text of one of the kernel's files."""
    return read_bytes(path, _LARGEST).decode(errors="replace").strip()


def write(path: Path, text: str) -> None:
    """Write one of the kernel's files: in one call, and never a new file."""
    with path.open("r+b", buffering=0) as file:
        file.write(f"{text}\n".encode())


def _possible(steps: int) -> int:
    return min(max(steps, 0), LAST_STEP)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _error(path: Path, error: OSError) -> SourceError:
    if error.errno in _GONE:
        return DeviceNotFound(
            f"{path}: not found: check that the kernel's driver ad7746 is loaded and bound to the chip"
        )
    if error.errno in (errno.EACCES, errno.EPERM):
        return DeviceRefused(f"{path}: no permission to read it")
    return ProtocolError(f"{path}: {error.strerror}")
