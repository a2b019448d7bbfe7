"""The AD7746 with the driver of the Linux kernel: `iio:`, files in sysfs. Not tried on hardware.

The driver (drivers/iio/cdc/ad7746.c) leaves the CAPDACs at 0, and drives no excitation unless the
device tree says so. There is no buffer: reading the file of a channel starts one conversion of this
channel, and sleeps for a fixed time.
"""

import errno
import math
import statistics
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from itertools import count, pairwise
from pathlib import Path
from threading import Event
from typing import NamedTuple, Self

from palpate.ad7746 import registers
from palpate.ad7746.bus import Meanings, translated
from palpate.ad7746.configuration import HARD, NAMES, SATURATION, SOFT
from palpate.clocks import fine_ns, on_monotonic
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError
from palpate.files import Json, read_bytes
from palpate.messages import quoted
from palpate.samples import Sample, Status
from palpate.source_events import Gap, GapCause, SourceEvent
from palpate.sources.base import SampleSource, Stoppable
from palpate.sources.options import Options, number, option, whole_number, yes_no

DEVICES = Path("/sys/bus/iio/devices")
NAME = "ad7746"
LARGEST = 4096  # Bytes of a file of the kernel, which is one page at most.
# `in_capacitanceN_offset` of one step of the CAPDAC: 21 pF / 127, in codes, rounded by the driver.
CODES_PER_STEP = 338646
# The driver refuses offsets above 43,008,000, which is a little less than 127 steps.
LAST_STEP = 126
FIRST_PAIRS = 4  # Pairs that are read first, to measure the period.
STREAK = 3  # This many pairs in a row that cannot be read are an error.
SAME = 8  # Equal codes in a row that are no measurement: the least noise is 9 codes rms.
LATE_NS = 12_000_000  # A tick of the slowest kernel, and 2 ms.
# in_capacitance_sampling_frequency -> least sleep of the driver in a conversion, ms; in the order of
# `registers.CONVERSION_S`.
SLEEPS_MS = {91: 12, 84: 13, 50: 21, 26: 39, 16: 63, 13: 78, 11: 93, 9: 111}
_MISSING = (
    DeviceNotFound,
    "not found: check that the kernel's driver ad7746 is loaded and bound to the chip",
)
_FORBIDDEN = (DeviceRefused, "no permission: run palpate as root")
_ERRORS: Meanings = {
    **dict.fromkeys((errno.ENOENT, errno.ENODEV, errno.ENXIO), _MISSING),
    **dict.fromkeys((errno.EACCES, errno.EPERM), _FORBIDDEN),
}


@dataclass(frozen=True)
class IioOptions(Options):
    """Options of `iio:`; `root`: the folder of the devices."""

    hard_input: int = option(whole_number(1, 2), 1)
    """Input of the hard bump; the soft bump has the other one."""
    centre: bool = option(yes_no, False)
    """Move the range to the signals at the start; it needs permission to write two files."""
    root: Path = DEVICES
    clock_ns: Callable[[], int] = fine_ns


class TimedCode(NamedTuple):
    """A reading of one channel; its time is the middle of the conversion."""

    t_ns: int
    uncertainty_us: int
    code: int


class KernelDevice:
    """The folder of an AD7746 in sysfs; raises DeviceNotFound, DeviceRefused or ProtocolError."""

    def __init__(self, path: Path) -> None:
        self.path = path
        name = self._text("name")
        if name != NAME:
            raise DeviceNotFound(f"{path} is {quoted(name)}, not an {NAME}")
        pF_per_code = 1 / registers.CODES_PER_PF  # the driver rounds it to 0.000000488
        self._number("in_capacitance_scale", pF_per_code * 0.999, pF_per_code * 1.001)
        frequencies = list(SLEEPS_MS)
        frequency = self._number(
            "in_capacitance_sampling_frequency", min(frequencies), max(frequencies)
        )
        if frequency not in frequencies:
            raise ProtocolError(
                f"{path}: got a sampling frequency of {frequency:g}, allowed: {frequencies}"
            )
        conversion_s = registers.CONVERSION_S[frequencies.index(int(frequency))]
        self.conversion_ns = round(conversion_s * 1e9)
        self.sleep_ns = SLEEPS_MS[int(frequency)] * 1_000_000

    def code(self, channel: int) -> int:
        """Convert channel 0 or 1; return the 24-bit code."""
        zero = registers.ZERO_CODE  # the kernel subtracts it
        return int(self._number(f"in_capacitance{channel}_raw", -zero, zero - 1)) + zero

    def steps(self) -> list[int]:
        """Return the CAPDACs of both channels, in steps."""
        largest = CODES_PER_STEP * registers.DAC_STEPS
        steps = []
        for channel in (0, 1):
            codes = self._number(f"in_capacitance{channel}_offset", 0, largest)
            steps.append(round(codes / CODES_PER_STEP))
        return steps

    def move(self, channel: int, steps: int) -> None:
        """Set the CAPDAC of a channel; DeviceRefused without permission: usually only root may."""
        file = self.path / f"in_capacitance{channel}_offset"
        with translated(file, _ERRORS):
            write_text(file, str(steps * CODES_PER_STEP))

    def centre(self, channel: int) -> None:
        """Set the CAPDAC by halving until the reading is in range, then to its middle.

        A signal beyond the range of the CAPDAC stays out of range.
        """
        low = 0
        high = LAST_STEP
        steps = self.steps()[channel]
        self.move(channel, steps)
        code = self.code(channel)
        while registers.is_saturated(code):
            if code > registers.ZERO_CODE:
                low = steps + 1
            else:
                high = steps - 1
            if low > high:
                return
            steps = (low + high) // 2
            self.move(channel, steps)
            code = self.code(channel)
        steps += round(registers.capacitance_pF(code) / registers.DAC_STEP_PF)
        self.move(channel, min(max(steps, 0), LAST_STEP))

    def _text(self, name: str) -> str:
        with translated(self.path / name, _ERRORS):
            return read_text(self.path / name)

    def _number(self, name: str, low: float, high: float) -> float:
        """Return the number in a file."""
        text = self._text(name)
        with suppress(ValueError):
            return number(low, high)(name, text)
        allowed = f"{low:g} to {high:g}; check the kernel's driver"
        raise ProtocolError(f"{self.path}/{name}: got {quoted(text)}, allowed: {allowed}")


class IioSource(Stoppable, SampleSource):
    """Pairs, read from the files of both channels in turn; a CAPDAC that was moved is a gap."""

    zero_ns: int | None = None  # begin of the iteration on the clock of the computer

    def __init__(self, path: Path, options: IioOptions) -> None:
        self._device = KernelDevice(path)
        self._inputs = (options.hard_input - 1, 2 - options.hard_input)
        self._clock_ns = options.clock_ns
        super().__init__()
        self._to_centre = Event()
        if options.centre:
            self._to_centre.set()
        self._period_ns = 2.0 * self._device.sleep_ns
        self._longest_ns = math.inf  # of a conversion
        self._steps = self._device.steps()
        self._is_unchecked = True  # since the CAPDACs were moved
        self._last_codes = [-1, -1]
        self._repeats = [0, 0]  # how often the last codes came

    def __enter__(self) -> Self:
        """Centre the range, if this was requested, and measure the period."""
        self._centre_if_requested()
        self._steps = self._device.steps()
        with suppress(ProtocolError):  # the iteration counts it
            self._measure_period()
        return self

    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs; one that cannot be read is LOST, `STREAK` of them are an error."""
        start_ns = self._clock_ns()
        self.zero_ns = on_monotonic(start_ns) if self._clock_ns is fine_ns else None
        streak = 0
        for seq in count():
            if self._stopped.is_set():
                return
            try:
                item = self._pair(seq, start_ns)
                streak = 0
            except ProtocolError:
                streak += 1
                self._errors += 1
                if streak == STREAK:
                    raise
                item = None
            now = self._clock_ns() - start_ns
            if item:
                yield item
            if not isinstance(item, Sample):
                yield Sample(seq, now, now, -1, -1, math.nan, math.nan, Status.LOST)

    def describe(self) -> Json:
        """Return the folder of the device, its range and speed."""
        hard, soft = self._inputs
        return {
            "name": "AD7746 by the kernel's driver",
            "note": "not tried on hardware",
            "path": str(self._device.path),
            "capdac": {"hard": self._steps[hard], "soft": self._steps[soft]},
            "full_scale_pF": registers.SATURATED_PF,
            "stamps": "converter",
            "conversion_s": self._device.conversion_ns / 1e9,
            "period_s": self._period_ns / 1e9,
        }

    def centre(self) -> None:
        """Set the CAPDACs again before the next pair, around the present signals: a gap."""
        self._to_centre.set()

    def _pair(self, seq: int, start_ns: int) -> Sample | Gap:
        """Return the next pair, or a gap if the CAPDACs were moved in it."""
        try:
            self._centre_if_requested()
        except DeviceRefused as error:  # the measurement goes on
            self.notify(str(error))
        hard = self._convert(HARD)
        soft = self._convert(SOFT)
        before = self._steps
        self._steps = self._device.steps()
        if self._steps != before:
            self._is_unchecked = True
            moved = f"the CAPDACs were moved from {before} to {self._steps} steps"
            return Gap(GapCause.RANGE, f"{self._device.path}: {moved}")
        status = 0
        for channel, code in enumerate((hard.code, soft.code)):
            self._check(channel, code)
            if registers.is_saturated(code):
                status |= SATURATION[channel]
        self._is_unchecked = False
        return Sample(
            seq,
            hard.t_ns - start_ns,
            soft.t_ns - start_ns,
            hard.code,
            soft.code,
            registers.capacitance_pF(hard.code),
            registers.capacitance_pF(soft.code),
            int(status),
            max(hard.uncertainty_us, soft.uncertainty_us),
        )

    def _convert(self, channel: int) -> TimedCode:
        # The driver does not say when a conversion begins: somewhere in its read, the least sleep
        # before the end. The rest of the longer read is the uncertainty. Writing the registers
        # before takes 0.3 to 1.2 ms more in both channels.
        begun = self._clock_ns()
        code = self._device.code(self._inputs[channel])
        duration_ns = self._clock_ns() - begun
        if duration_ns > self._longest_ns:
            limit_ms = self._longest_ns / 1e6
            raise ProtocolError(
                f"{self._device.path}: a conversion lasted {duration_ns / 1e6:.0f} ms, allowed: "
                f"{limit_ms:.0f} ms: another program uses the driver, or changed its sampling "
                "frequency"
            )
        uncertainty_us = math.ceil(max(duration_ns - self._device.sleep_ns, 0) / 1000)
        return TimedCode(begun + self._device.conversion_ns // 2, uncertainty_us, code)

    def _measure_period(self) -> None:
        """Measure the time from pair to pair: the sleep of the driver depends on the kernel's tick."""
        begun = [self._clock_ns()]
        for _ in range(FIRST_PAIRS):
            self._convert(HARD)
            self._convert(SOFT)
            self._device.steps()
            begun.append(self._clock_ns())
        self._period_ns = max(statistics.median(b - a for a, b in pairwise(begun)), 1)
        self._longest_ns = self._period_ns / 2 + LATE_NS

    def _check(self, channel: int, code: int) -> None:
        """Report a channel that is saturated at the start, or repeats the same code."""
        if code != self._last_codes[channel]:
            self._last_codes[channel] = code
            self._repeats[channel] = 0
        self._repeats[channel] += 1
        pin = self._inputs[channel]
        title = f"{NAMES[channel]}: CIN{pin + 1}"
        value_pF = registers.capacitance_pF(code)
        if registers.is_saturated(code):
            if self._is_unchecked:
                side = "above" if value_pF > 0 else "below"
                self.notify(
                    f"{title} is {side} the range of {2 * registers.FULL_SCALE_PF:g} pF, its "
                    f"CAPDAC is at {self._steps[pin]} steps: as root, "
                    f"iio:{self._device.path}?centre=yes moves it"
                )
        elif self._repeats[channel] == SAME:
            self.notify(
                f"{title} gives exactly {value_pF:g} pF, {SAME} times in a row: its sensor has no "
                "excitation: the node of the chip in the device tree needs adi,exca-output-en; or "
                "adi,excb-output-en;, for the pin that the sensor is wired to, and "
                "adi,excitation-vdd-permille = <500>;"
            )

    def _centre_if_requested(self) -> None:
        if self._to_centre.is_set():
            self._to_centre.clear()
            for channel in (0, 1):
                self._device.centre(channel)


def open_iio(address: str, values: Mapping[str, object]) -> IioSource:
    """Return the source of `iio:`, the only AD7746, or of `iio:PATH`."""
    options = IioOptions.parse("iio", values)
    paths = [Path(address)] if address else kernel_devices(options.root)
    if not paths:
        raise DeviceNotFound(
            f"no {NAME} in {options.root}: load the driver of the kernel, or read the bus without "
            "it: i2c:/dev/i2c-1"
        )
    if len(paths) > 1:
        names = ", ".join(f"iio:{path}" for path in paths)
        raise DeviceNotFound(
            f"{len(paths)} devices in {options.root} are an {NAME}: choose one of {names}"
        )
    return IioSource(paths[0], options)


def kernel_devices(root: Path = DEVICES) -> list[Path]:
    """Return the devices that are an AD7746."""
    paths = []
    for path in sorted(root.glob("iio:device*")):
        with suppress(OSError):
            if read_text(path / "name") == NAME:
                paths.append(path)
    return paths


def read_text(path: Path) -> str:
    """Return the text of one of the kernel's files."""
    return read_bytes(path, LARGEST).decode(errors="replace").strip()


def write_text(path: Path, text: str) -> None:
    """Write one of the kernel's files: in one call, and never a new file."""
    with path.open("r+b", buffering=0) as file:
        file.write(f"{text}\n".encode())
