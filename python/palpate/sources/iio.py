"""The AD7746 with the driver of the Linux kernel: `iio:`, files in sysfs. Not tried on hardware.

There is no buffer: reading the file of a channel waits for one conversion of this channel.
"""

import math
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Event
from typing import Any, NamedTuple, Self

from palpate.ad7746 import datasheet
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError
from palpate.samples import Sample, Status
from palpate.sources.base import Gap, Source
from palpate.sources.options import anything, checked, number, yes_no
from palpate.sources.sysfs import LEVEL, NAME, PINS, KernelDevice, text_of

DEVICES = Path("/sys/bus/iio/devices")
STREAK = 3
FIRST_PAIRS = 4
"""Pairs that are read at the begin, to measure the period."""
SAME = 8
"""So many equal codes in a row are no measurement: the least noise of the chip is 9 codes rms."""


LATE_S = 0.012
"""A tick of the slowest kernel, and 2 ms."""


class _Reading(NamedTuple):
    t_ns: int
    code: int
    uncertainty_us: int


def devices(root: Path = DEVICES) -> list[Path]:
    """Return the devices that are an AD7746."""
    found = []
    for path in sorted(root.glob("iio:device*")):
        with suppress(OSError):
            if text_of(path / "name") == NAME:
                found.append(path)
    return found


class IioSource(Source):
    """Pairs of both channels, read from two files one after the other.

    The time of a value is the begin of its read, and half a conversion: writing the registers before a conversion takes
    some 0.3 to 1.2 ms more, alike in both channels. The driver does not say when a conversion begins: somewhere in its
    read, the least sleep before the end. What is left of the longer read is `t_uncertainty_us`: some 3 ms with a kernel
    of 1000 ticks a second, 18 ms with 100. A pair with a read `LATE_S` longer than usual is LOST.

    Parameters
    ----------
    path : pathlib.Path
        Folder of the device in sysfs.
    hard_input : int
        1: the hard bump is channel 0; 2: it is channel 1.
    centre : bool
        Set the CAPDACs at the begin so that both idle signals are in the middle of the range; needs write permission.
    clock_ns : callable
        Returns the time, ns.
    """

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
        self._stopped, self._to_centre = Event(), Event()
        if centre:
            self._to_centre.set()
        self._begun = False
        self._errors = 0
        self._gaps: list[Gap] = []
        self._conversion_s, self._sleep_s = self._device.times_s()
        self._period_s = 2 * self._sleep_s
        self._longest_ns = math.inf
        self._steps = self._read_steps()
        self._unjudged = True
        self._same = {"hard": (-1, 0), "soft": (-1, 0)}
        self._start_ns: int | None = None

    def __enter__(self) -> Self:
        """Centre the range, if this was asked for, and measure the period."""
        self._begun = True
        if self._device.excitation == "":
            self.notify(f"{self._device.path}: no excitation: {_HOW_TO_EXCITE}")
        if self._to_centre.is_set():
            self._centre_both()
            self._steps = self._read_steps()
        with suppress(ProtocolError):  # the iteration counts it
            self._period_s = self._measured_period()
        return self

    def __iter__(self) -> Iterator[Sample]:
        """Return the pairs; a pair that cannot be read is LOST, and `STREAK` of them in a row are an error."""
        if not self._begun:
            self.__enter__()
        start_ns, seq, streak = self._clock_ns(), 0, 0
        self._start_ns = start_ns
        while not self._stopped.is_set():
            try:
                sample = self._pair(seq, start_ns)
                streak = 0
            except ProtocolError:
                self._errors, streak = self._errors + 1, streak + 1
                if streak == STREAK:
                    raise
                sample = self._lost(seq, start_ns)
            if sample:
                yield sample
            seq += 1

    @property
    def zero_ns(self) -> int | None:
        """Begin of the iteration on the clock of the computer."""
        return self._start_ns if self._clock_ns is time.monotonic_ns else None

    @property
    def counters(self) -> dict[str, int]:
        """Number of pairs that could not be read, as `errors`."""
        return {"errors": self._errors}

    @property
    def gaps(self) -> Sequence[Gap]:
        """Samples from which on the range was another one: the offset of a channel was written."""
        return tuple(self._gaps)

    def describe(self) -> dict[str, Any]:
        """Return the folder of the device, its range and speed."""
        known = math.isfinite(self._period_s)
        return {
            "name": "AD7746 by the kernel's driver",
            "note": "not tried on hardware",
            "path": str(self._device.path),
            "scale": self._device.scale,
            "capdac": {name: self._steps[channel] for name, channel in self._channels.items()},
            "excitation": self._device.excitation,
            "full_scale_pF": datasheet.SATURATED_PF,
            "stamps": "converter",
            **({"conversion_s": self._conversion_s, "period_s": self._period_s} if known else {}),
        }

    def centre(self) -> None:
        """Set the CAPDACs again before the next pair, around the present signals; from any thread. It is a gap."""
        self._to_centre.set()

    def interrupt(self) -> None:
        """Stop the iteration after the present conversion."""
        self._stopped.set()

    def _pair(self, seq: int, start_ns: int) -> Sample | None:
        """Return the next pair; None: it was interrupted."""
        if self._to_centre.is_set():
            self._centre_again()
        hard = self._convert(self._channels["hard"])
        if self._stopped.is_set():
            return None
        soft = self._convert(self._channels["soft"])
        if self._was_moved(seq):
            return self._lost(seq, start_ns)
        for name, reading in (("hard", hard), ("soft", soft)):
            self._judge(name, reading.code)
        self._unjudged = False
        return _sample(seq, start_ns, hard, soft)

    def _lost(self, seq: int, start_ns: int) -> Sample:
        now = self._clock_ns() - start_ns
        return Sample(seq, now, now, -1, -1, math.nan, math.nan, Status.LOST)

    def _convert(self, channel: int) -> _Reading:
        begun = self._clock_ns()
        code = self._device.code(channel)
        lasted = self._clock_ns() - begun
        if lasted > self._longest_ns:
            raise ProtocolError(
                f"{self._device.path}: a conversion lasted {lasted / 1e6:.0f} ms, allowed: {self._longest_ns / 1e6:.0f} ms: "
                "another program uses the driver, or changed its sampling frequency"
            )
        if math.isnan(self._conversion_s):
            return _Reading(begun + lasted // 2, code, -1)
        uncertainty_us = math.ceil(max(lasted - self._sleep_s * 1e9, 0) / 1000)
        return _Reading(begun + round(self._conversion_s * 1e9 / 2), code, uncertainty_us)

    def _measured_period(self) -> float:
        """Return the time from pair to pair, s: the driver sleeps for a time that depends on the kernel's tick."""
        lasted = []
        for _ in range(FIRST_PAIRS):
            begun = self._clock_ns()
            for channel in self._channels.values():
                if not self._stopped.is_set():
                    self._convert(channel)
            self._read_steps()
            lasted.append(self._clock_ns() - begun)
        period_ns = max(statistics.median(lasted), 1)
        self._longest_ns = period_ns / 2 + LATE_S * 1e9
        return period_ns / 1e9

    def _read_steps(self) -> list[int | None]:
        return [self._device.steps(channel) for channel in (0, 1)]

    def _was_moved(self, seq: int) -> bool:
        """Return whether the offset of a channel was written since the pair before; then note the gap."""
        if (steps := self._read_steps()) == self._steps:
            return False
        text = f"{self._device.path}: the CAPDACs were moved from {self._steps} to {steps} steps"
        self._gaps.append(Gap(seq, text))
        self.notify(f"{text}: the baseline is measured again")
        self._steps, self._unjudged = steps, True
        return True

    def _judge(self, name: str, code: int) -> None:
        """Tell of a channel that measures nothing: saturated at the begin, or the same code again and again."""
        before, count = self._same[name]
        self._same[name] = code, count + 1 if code == before else 1
        if self._unjudged and datasheet.saturated(code):
            self.notify(f"{name}: {self._device.out_of_range(self._channels[name], code)}")
        elif count + 1 == SAME and code == before and not datasheet.saturated(code):
            pins = f"driven: EXC{', EXC'.join(self._device.excitation)}" if self._device.excitation else _HOW_TO_EXCITE
            self.notify(
                f"{name}: CIN{self._channels[name] + 1} gives exactly {datasheet.capacitance_pF(code):g} pF, "
                f"{SAME} times in a row: its sensor has no excitation ({pins})"
            )

    def _centre_again(self) -> None:
        """Centre during the measurement, which goes on if that is not permitted."""
        try:
            self._centre_both()
        except DeviceRefused as error:
            self.notify(str(error))

    def _centre_both(self) -> None:
        self._to_centre.clear()
        for channel in self._channels.values():
            self._device.centre(channel)


_HOW_TO_EXCITE = (
    f"the node of the chip in the device tree needs {PINS['A']}; or {PINS['B']};, for the pin that the sensor is wired to, "
    f"and {LEVEL} = <500>;"
)


def _sample(seq: int, start_ns: int, hard: _Reading, soft: _Reading) -> Sample:
    status = Status.HARD_SATURATED * datasheet.saturated(hard.code) | Status.SOFT_SATURATED * datasheet.saturated(
        soft.code
    )
    values = datasheet.capacitance_pF(hard.code), datasheet.capacitance_pF(soft.code)
    times = hard.t_ns - start_ns, soft.t_ns - start_ns
    return Sample(
        seq, *times, hard.code, soft.code, *values, int(status), max(hard.uncertainty_us, soft.uncertainty_us)
    )


def open_iio(address: str, options: Mapping[str, Any]) -> IioSource:
    """Return the source of `iio:`, the only AD7746, or of `iio:PATH`."""
    allowed = {"hard_input": number(1, 2, whole=True), "centre": yes_no, "root": anything, "clock_ns": anything}
    given = checked("iio", options, allowed)
    root = Path(given.pop("root", DEVICES))
    if address:
        return IioSource(Path(address), **given)
    found = devices(root)
    if len(found) != 1:
        there = ", ".join(f"iio:{path}" for path in found)
        raise DeviceNotFound(
            f"{len(found)} devices in {root} are an {NAME}" + (f": choose one of {there}" if there else "")
        )
    return IioSource(found[0], **given)
