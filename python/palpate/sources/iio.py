"""The AD7746 with the driver of the Linux kernel: `iio:`, files in sysfs. Not tried on hardware.

There is no buffer: reading the file of a channel waits for one conversion of this channel.
"""

import errno
import math
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from threading import Event
from typing import Any

from palpate.ad7746 import datasheet
from palpate.errors import DeviceNotFound, DeviceRefused, ProtocolError, SourceError, quoted
from palpate.files import read_bytes
from palpate.samples import Sample, Status
from palpate.sources.base import Source
from palpate.sources.options import anything, checked, number

DEVICES = Path("/sys/bus/iio/devices")
NAME = "ad7746"
STREAK = 3
_LARGEST = 4096  # bytes of a file in sysfs: a page
_KEPT = ("name", "in_capacitance0_scale", "in_capacitance0_offset", "in_capacitance1_offset")
_FREQUENCIES = ("in_capacitance_sampling_frequency", "sampling_frequency")
_GONE = (errno.ENOENT, errno.ENODEV, errno.ENXIO)


def devices(root: Path = DEVICES) -> list[Path]:
    """Return the devices that are an AD7746."""
    found = []
    for path in sorted(root.glob("iio:device*")):
        with suppress(OSError):
            if _read(path / "name") == NAME:
                found.append(path)
    return found


class IioSource(Source):
    """Pairs of both channels, read from two files one after the other.

    Parameters
    ----------
    path : pathlib.Path
        Folder of the device in sysfs.
    hard_input : int
        1: the hard bump is channel 0; 2: it is channel 1.
    clock_ns : callable
        Returns the time, ns.
    """

    def __init__(self, path: Path, hard_input: int = 1, clock_ns: Any = time.monotonic_ns) -> None:
        self._path = path
        self._files = [path / f"in_capacitance{channel}_raw" for channel in (hard_input - 1, 2 - hard_input)]
        self._clock_ns = clock_ns
        self._stopped = Event()
        self._errors = 0
        self._described = self._identity()

    def __iter__(self) -> Iterator[Sample]:
        """Return the pairs; a pair that cannot be read is LOST, and `STREAK` of them in a row are an error."""
        start_ns, seq, streak = self._clock_ns(), 0, 0
        while not self._stopped.is_set():
            try:
                hard, soft = (self._convert(file, start_ns) for file in self._files)
                streak = 0
                yield _sample(seq, hard, soft)
            except ProtocolError:
                self._errors, streak = self._errors + 1, streak + 1
                if streak == STREAK:
                    raise
                now = self._clock_ns() - start_ns
                yield Sample(seq, now, now, -1, -1, math.nan, math.nan, Status.LOST)
            seq += 1

    @property
    def counters(self) -> dict[str, int]:
        """Number of pairs that could not be read, as `errors`."""
        return {"errors": self._errors}

    def describe(self) -> dict[str, Any]:
        """Return the folder of the device, with its files about range and speed."""
        return self._described

    def interrupt(self) -> None:
        """Stop the iteration after the present pair."""
        self._stopped.set()

    def _identity(self) -> dict[str, Any]:
        name = self._text("name")
        if name != NAME:
            raise DeviceNotFound(f"{self._path} is {quoted(name)}, not an {NAME}")
        kept = {}
        for file in (*_KEPT, *_FREQUENCIES):
            with suppress(SourceError):
                kept[file] = self._text(file)
        period = [2 / frequency for name in _FREQUENCIES if 1e-6 < (frequency := _number(kept.get(name, ""))) < 1e6]
        return {
            "name": "AD7746 by the kernel's driver",
            "note": "not tried on hardware",
            "path": str(self._path),
            "files": kept,
            "full_scale_pF": datasheet.SATURATED_PF,
            "stamps": "converter",
            **({"period_s": period[0]} if period else {}),
        }

    def _convert(self, file: Path, start_ns: int) -> tuple[int, int]:
        """Return the middle of a conversion, ns, and its code."""
        begun = self._clock_ns()
        text = self._text(file.name)
        try:
            code = int(text) + datasheet.ZERO_CODE  # the kernel subtracts it
            datasheet.capacitance_pF(code)
        except ValueError as error:
            raise ProtocolError(f"{file}: got {quoted(text)}, allowed: -8388608 to 8388607") from error
        return (begun + self._clock_ns()) // 2 - start_ns, code

    def _text(self, name: str) -> str:
        try:
            return _read(self._path / name)
        except OSError as error:
            raise _error(self._path / name, error) from error


def _read(path: Path) -> str:
    """Return the text of one of the kernel's files."""
    return read_bytes(path, _LARGEST).decode(errors="replace").strip()


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _sample(seq: int, hard: tuple[int, int], soft: tuple[int, int]) -> Sample:
    status = Status.HARD_SATURATED * datasheet.saturated(hard[1]) | Status.SOFT_SATURATED * datasheet.saturated(soft[1])
    values = datasheet.capacitance_pF(hard[1]), datasheet.capacitance_pF(soft[1])
    return Sample(seq, hard[0], soft[0], hard[1], soft[1], *values, int(status))


def _error(path: Path, error: OSError) -> SourceError:
    if error.errno in _GONE:
        return DeviceNotFound(
            f"{path}: not found: check that the kernel's driver ad7746 is loaded and bound to the chip"
        )
    if error.errno in (errno.EACCES, errno.EPERM):
        return DeviceRefused(f"{path}: no permission to read it")
    return ProtocolError(f"{path}: {error.strerror}")


def open_iio(address: str, options: Mapping[str, Any]) -> IioSource:
    """Return the source of `iio:`, the only AD7746, or of `iio:PATH`."""
    allowed = {"hard_input": number(1, 2, whole=True), "root": anything, "clock_ns": anything}
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
