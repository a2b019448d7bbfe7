"""The AD7746 with the driver of the Linux kernel: `iio:`, files in sysfs. Not tried on hardware.

The driver (drivers/iio/cdc/ad7746.c) leaves the CAPDACs at 0, and drives no excitation unless the device tree says so.
There is no buffer: reading the file of a channel starts one conversion of this channel, and sleeps for a fixed time.
"""

import errno
import itertools
import math
import statistics
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from threading import Event
from typing import Any, Final, Self

from palpate.ad7746 import registers
from palpate.ad7746.bus import Meanings, translated
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError
from palpate.messages import quoted
from palpate.samples import Sample, Status
from palpate.source_events import Gap, GapCause, SourceEvent
from palpate.sources.base import SampleSource, Stoppable
from palpate.sources.options import anything, checked, number, yes_no

DEVICES = Path("/sys/bus/iio/devices")
NAME: Final = "ad7746"
# `in_capacitanceN_offset` of one step of the CAPDAC: 21 pF / 127, in codes, rounded as the driver has it.
CODES_PER_STEP: Final = 338646
LAST_STEP: Final = (
    126  # The driver refuses offsets above 43,008,000, which is a little less than 127 steps.
)
FIRST_PAIRS = 4  # Pairs that are read first, to measure the period.
STREAK = 3  # This many pairs in a row that cannot be read are an error.
SAME = 8  # This many equal codes in a row are no measurement: the least noise of the chip is 9 codes rms.
LATE_NS = 12_000_000  # A tick of the slowest kernel, and 2 ms.
# In_capacitance_sampling_frequency -> least sleep of the driver in a conversion, ms; in the order of `registers.CONVERSION_S`.
SLEEPS_MS: Final = {91: 12, 84: 13, 50: 21, 26: 39, 16: 63, 13: 78, 11: 93, 9: 111}
_MISSING = (
    DeviceNotFound,
    "not found: check that the kernel's driver ad7746 is loaded and bound to the chip",
)
_FORBIDDEN = (DeviceRefused, "no permission: run palpate as root")
_ERRORS: Meanings = {
    **dict.fromkeys((errno.ENOENT, errno.ENODEV, errno.ENXIO), _MISSING),
    **dict.fromkeys((errno.EACCES, errno.EPERM), _FORBIDDEN),
}


class KernelDevice:
    """The folder of an AD7746 in sysfs; raises DeviceNotFound, DeviceRefused or ProtocolError."""

    def __init__(self, path: Path) -> None:
        self.path = path
        if (name := self._text("name")) != NAME:
            raise DeviceNotFound(f"{path} is {quoted(name)}, not an {NAME}")
        known = 1 / registers.CODES_PER_PF  # pF a code; the driver rounds it to 0.000000488
        self._number("in_capacitance_scale", known * 0.999, known * 1.001)
        frequency = self._number(
            "in_capacitance_sampling_frequency", min(SLEEPS_MS), max(SLEEPS_MS)
        )
        if frequency not in SLEEPS_MS:
            raise ProtocolError(
                f"{path}: got a sampling frequency of {frequency:g}, allowed: {[*SLEEPS_MS]}"
            )
        conversion_s = registers.CONVERSION_S[[*SLEEPS_MS].index(int(frequency))]
        self.conversion_ns = round(conversion_s * 1e9)
        self.sleep_ns = SLEEPS_MS[int(frequency)] * 1_000_000

    def code(self, channel: int) -> int:
        """Convert channel 0 or 1; return the 24-bit code."""
        zero = registers.ZERO_CODE  # the kernel subtracts it
        return int(self._number(f"in_capacitance{channel}_raw", -zero, zero - 1)) + zero

    def steps(self) -> list[int]:
        """Return the CAPDACs of both channels, in steps."""
        most = CODES_PER_STEP * registers.DAC_STEPS
        return [
            round(self._number(f"in_capacitance{n}_offset", 0, most) / CODES_PER_STEP)
            for n in (0, 1)
        ]

    def move(self, channel: int, steps: int) -> None:
        """Set the CAPDAC of a channel; raises DeviceRefused without permission: usually only root may."""
        file = self.path / f"in_capacitance{channel}_offset"
        with translated(file, _ERRORS):
            write(file, str(steps * CODES_PER_STEP))

    def centre(self, channel: int) -> None:
        """Set the CAPDAC by halving until the reading is in range, then to its middle; a signal beyond it stays out."""
        low = 0
        high = LAST_STEP
        steps = self.steps()[channel]
        self.move(channel, steps)
        while registers.is_saturated(code := self.code(channel)):
            low, high = (steps + 1, high) if code > registers.ZERO_CODE else (low, steps - 1)
            if low > high:
                return
            steps = (low + high) // 2
            self.move(channel, steps)
        steps += round(registers.capacitance_pF(code) / registers.DAC_STEP_PF)
        self.move(channel, min(max(steps, 0), LAST_STEP))

    def _text(self, name: str) -> str:
        with translated(self.path / name, _ERRORS):
            return text_of(self.path / name)

    def _number(self, name: str, low: float, high: float) -> float:
        """Return the number in a file."""
        text = self._text(name)
        with suppress(ValueError):
            return float(number(low, high)(name, text))
        allowed = f"{low:g} to {high:g}; check the kernel's driver"
        raise ProtocolError(f"{self.path}/{name}: got {quoted(text)}, allowed: {allowed}")


class IioSource(Stoppable, SampleSource):
    """Pairs of both channels, read from two files one after the other. Gaps: the offset of a channel was written."""

    zero_ns: int | None = None  # begin of the iteration on the clock of the computer

    def __init__(
        self,
        path: Path,
        hard_input: int = 1,
        centre: bool = False,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._device = KernelDevice(path)
        self._channels = {"hard": hard_input - 1, "soft": 2 - hard_input}
        self._clock_ns = clock_ns
        super().__init__()
        self._to_centre = Event()
        if centre:
            self._to_centre.set()
        self._period_ns = 2.0 * self._device.sleep_ns
        self._longest_ns = math.inf
        self._steps = self._device.steps()
        self._is_unjudged = True  # since the CAPDACs were moved
        self._same = {"hard": (-1, 0), "soft": (-1, 0)}  # the last code, and how often it came

    def __enter__(self) -> Self:
        """Centre the range, if this was asked for, and measure the period."""
        self._centre_if_asked()
        self._steps = self._device.steps()
        with suppress(ProtocolError):  # the iteration counts it
            self._measure_period()
        return self

    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs; a pair that cannot be read is LOST, and `STREAK` of them in a row are an error."""
        start_ns = self._clock_ns()
        streak = 0
        seq = 0
        self.zero_ns = start_ns if self._clock_ns is time.monotonic_ns else None
        while not self._stopped.is_set():
            item: Sample | Gap | None = None
            try:
                item = self._pair(seq, start_ns)
                streak = 0
            except ProtocolError:
                streak += 1
                self._errors += 1
                if streak == STREAK:
                    raise
            now = self._clock_ns() - start_ns
            if isinstance(item, Gap):
                yield item
            if isinstance(item, Sample):
                yield item
            else:
                yield Sample(seq, now, now, -1, -1, math.nan, math.nan, Status.LOST)
            seq += 1

    def describe(self) -> dict[str, Any]:
        """Return the folder of the device, its range and speed."""
        return {
            "name": "AD7746 by the kernel's driver",
            "note": "not tried on hardware",
            "path": str(self._device.path),
            "capdac": {name: self._steps[channel] for name, channel in self._channels.items()},
            "full_scale_pF": registers.SATURATED_PF,
            "stamps": "converter",
            "conversion_s": self._device.conversion_ns / 1e9,
            "period_s": self._period_ns / 1e9,
        }

    def centre(self) -> None:
        """Set the CAPDACs again before the next pair, around the present signals; from any thread. It is a gap."""
        self._to_centre.set()

    def _pair(self, seq: int, start_ns: int) -> Sample | Gap:
        """Return the next pair, or a gap if the CAPDACs were moved in it."""
        try:
            self._centre_if_asked()
        except DeviceRefused as error:  # the measurement goes on
            self.notify(str(error))
        (t_hard_ns, hard, hard_us), (t_soft_ns, soft, soft_us) = map(
            self._convert, ("hard", "soft")
        )
        if (steps := self._device.steps()) != self._steps:
            text = (
                f"{self._device.path}: the CAPDACs were moved from {self._steps} to {steps} steps"
            )
            self._steps = steps
            self._is_unjudged = True
            return Gap(GapCause.RANGE, text)
        self._judge("hard", hard)
        self._judge("soft", soft)
        self._is_unjudged = False
        status = Status.HARD_SATURATED * registers.is_saturated(
            hard
        ) | Status.SOFT_SATURATED * registers.is_saturated(soft)
        values = registers.capacitance_pF(hard), registers.capacitance_pF(soft)
        times = t_hard_ns - start_ns, t_soft_ns - start_ns
        return Sample(seq, *times, hard, soft, *values, int(status), max(hard_us, soft_us))

    def _convert(self, name: str) -> tuple[int, int, int]:
        """Return time, ns, code, and uncertainty of the time, us, of a conversion."""
        # The driver does not say when a conversion begins: somewhere in its read, the least sleep before the end. What is
        # left of the longer read is the uncertainty. Writing the registers before takes 0.3 to 1.2 ms more in both channels.
        begun = self._clock_ns()
        code = self._device.code(self._channels[name])
        lasted = self._clock_ns() - begun
        if lasted > self._longest_ns:
            took = f"a conversion lasted {lasted / 1e6:.0f} ms, allowed: {self._longest_ns / 1e6:.0f} ms"
            why = "another program uses the driver, or changed its sampling frequency"
            raise ProtocolError(f"{self._device.path}: {took}: {why}")
        uncertainty_us = math.ceil(max(lasted - self._device.sleep_ns, 0) / 1000)
        return begun + self._device.conversion_ns // 2, code, uncertainty_us

    def _measure_period(self) -> None:
        """Measure the time from pair to pair: the driver sleeps for a time that depends on the kernel's tick."""
        begun = [self._clock_ns()]
        for _ in range(FIRST_PAIRS):
            self._convert("hard")
            self._convert("soft")
            self._device.steps()
            begun.append(self._clock_ns())
        self._period_ns = max(statistics.median(b - a for a, b in itertools.pairwise(begun)), 1)
        self._longest_ns = self._period_ns / 2 + LATE_NS

    def _judge(self, name: str, code: int) -> None:
        """Report a channel that measures nothing: saturated at the start, or the same code again and again."""
        before, count = self._same[name]
        count = count + 1 if code == before else 1
        self._same[name] = code, count
        pin = f"{name}: CIN{self._channels[name] + 1}"
        value = registers.capacitance_pF(code)
        if registers.is_saturated(code):
            if self._is_unjudged:
                out = f"{'above' if value > 0 else 'below'} the range of {2 * registers.FULL_SCALE_PF:g} pF"
                now = f"its CAPDAC is at {self._steps[self._channels[name]]} steps"
                self.notify(
                    f"{pin} is {out}, {now}: as root, iio:{self._device.path}?centre=yes moves it"
                )
        elif count == SAME:
            needs = "adi,exca-output-en; or adi,excb-output-en;, for the pin that the sensor is wired to"
            said = f"{pin} gives exactly {value:g} pF, {SAME} times in a row: its sensor has no excitation"
            node = f"the node of the chip in the device tree needs {needs}, and adi,excitation-vdd-permille = <500>;"
            self.notify(f"{said}: {node}")

    def _centre_if_asked(self) -> None:
        if self._to_centre.is_set():
            self._to_centre.clear()
            for channel in (0, 1):
                self._device.centre(channel)


def open_iio(address: str, options: Mapping[str, Any]) -> IioSource:
    """Return the source of `iio:`, the only AD7746, or of `iio:PATH`."""
    allowed = {
        "hard_input": number(1, 2, whole=True),
        "centre": yes_no,
        "root": anything,
        "clock_ns": anything,
    }
    given = checked("iio", options, allowed)
    root = Path(given.pop("root", DEVICES))
    found = [Path(address)] if address else devices(root)
    if len(found) != 1:
        several = f"{len(found)} devices in {root} are an {NAME}: choose one of "
        several += ", ".join(f"iio:{path}" for path in found)
        without = f"no {NAME} in {root}: load the driver of the kernel, or read the bus without it: i2c:/dev/i2c-1"
        raise DeviceNotFound(several if found else without)
    return IioSource(found[0], **given)


def devices(root: Path = DEVICES) -> list[Path]:
    """Return the devices that are an AD7746."""
    found = []
    for path in sorted(root.glob("iio:device*")):
        with suppress(OSError):
            if text_of(path / "name") == NAME:
                found.append(path)
    return found


def text_of(path: Path) -> str:
    """Return the text of one of the kernel's files."""
    return path.read_text(encoding="utf-8", errors="replace").strip()


def write(path: Path, text: str) -> None:
    """Write one of the kernel's files: in one call, and never a new file."""
    with path.open("r+b", buffering=0) as file:
        file.write(f"{text}\n".encode())
