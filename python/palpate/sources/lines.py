"""Lines of text on a serial port, for example from a microcontroller: `serial:`."""

import math
import os
import re
import time
from collections.abc import Iterator, Mapping
from threading import Event
from typing import Any

from palpate.errors import DeviceNotFound, DeviceRefused, MissingExtra, SourceError, quoted
from palpate.recording.table import PICOFARADS, to_number
from palpate.samples import Sample, Status
from palpate.sources.base import Source
from palpate.sources.options import Check, checked, choice, number, text

try:
    import serial
except ImportError as _missing:  # pragma: no cover
    raise MissingExtra("a serial port needs pyserial: pip install 'palpate[serial]'") from _missing

# ++ takes all and gives nothing back, and no number begins within another one: so the time grows with the length only.
NUMBER = r"[-+]?(?<!\d)\d++(?:[.,]\d++)?(?:[eE][-+]?\d++)?|[-+]?OV?LD?|nan"
PATTERN = rf"(?P<hard>{NUMBER})(?:\s*+[a-zA-Z]{{1,20}}+)?[\s,;|]++(?P<soft>{NUMBER})"
"""Two numbers in a line, the hard channel first; a unit may follow each number."""
_TIMEOUT_S = 0.1
_AGAIN_S = 0.1
_LONGEST = 1000  # of a line, bytes, and of a pattern: anything longer is not text
_SILENCE_S = 10.0


class SerialSource(Source):
    """Pairs from lines of text on a serial port.

    A line has the values of both channels, or of one: then a pair is a hard value and the soft value after it. The
    time of a value is the arrival of its line.

    Parameters
    ----------
    port : str
        For example "/dev/ttyACM0" or "COM3".
    pattern : str
        Regular expression with groups `hard` and `soft`, searched in each line.
    unit : str
        Unit of the numbers, aF to F.
    baud : int
        Bits per second.
    replug : float
        Longest time to wait for an unplugged port, s.

    Raises
    ------
    DeviceNotFound, DeviceRefused
        The port cannot be opened.
    """

    def __init__(
        self, port: str, pattern: str = PATTERN, unit: str = "pF", baud: int = 115200, replug: float = 30.0
    ) -> None:
        self._pattern = re.compile(pattern)
        self._settings = {"port": port, "pattern": pattern, "unit": unit, "baud": baud}
        self._factor = PICOFARADS[unit]
        self._replug_s = replug
        self._stopped = Event()
        self._counters = {"errors": 0, "reconnects": 0, "lost": 0}
        self._buffer = b""
        self._period_ns = 0.0
        self._port = self._open()

    def __iter__(self) -> Iterator[Sample]:
        """Return the pairs; lines that do not match the pattern are counted as errors."""
        start_ns, seq, hard = time.monotonic_ns(), 0, None
        for skipped, line in self._lines():
            now = time.monotonic_ns() - start_ns
            seq, hard = seq + skipped, None if skipped else hard
            first, second = self._values(line)
            if first is not None:
                if hard is not None:
                    self._counters["lost"] += 1
                    yield _sample(seq, hard, (hard[0], math.nan))
                    seq += 1
                hard = now, first
            if second is not None and hard is not None:
                yield _sample(seq, hard, (now, second))
                seq, hard = seq + 1, None
                self._period_ns = now / seq
            elif second is not None:
                self._counters["errors"] += 1

    @property
    def counters(self) -> dict[str, int]:
        """Lines that do not match (`errors`), `reconnects`, and `lost` pairs: incomplete, or in a gap."""
        return self._counters

    def describe(self) -> dict[str, Any]:
        """Return the settings of the port."""
        return {
            "name": "serial port",
            **self._settings,
            "clock": "arrival of a line, ns since the start",
            "stamps": "host",
        }

    def interrupt(self) -> None:
        """Stop the iteration."""
        self._stopped.set()

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def _lines(self) -> Iterator[tuple[int, str]]:
        """Return each line, with the number of pairs lost in a gap before it; the incomplete first line is skipped."""
        whole, skipped, heard = False, 0, time.monotonic()
        while not self._stopped.is_set():
            try:
                data = self._port.read(max(self._port.in_waiting, 1))
            except (serial.SerialException, OSError) as error:
                skipped += self._wait_for_replug(error)
                whole = False
                continue
            heard = time.monotonic() if data else heard
            if time.monotonic() - heard > _SILENCE_S:
                heard = time.monotonic()
                self.notify(f"{self._settings['port']} sends nothing: check the baud rate, {self._settings['baud']}")
            *lines, self._buffer = (self._buffer + data).replace(b"\r", b"\n").split(b"\n")
            for line in lines:
                if len(line) > _LONGEST:
                    self._counters["errors"] += whole
                elif whole and line.strip():
                    yield skipped, line.decode("latin-1")
                    skipped = 0
                whole = True
            if len(self._buffer) > _LONGEST:  # the beginning is dropped, so the end is not a line
                self._counters["errors"] += whole
                whole, self._buffer = False, b""

    def _values(self, line: str) -> tuple[float | None, float | None]:
        """Return the hard and the soft value of a line; None: not in this line."""
        match = self._pattern.search(line)
        cells = [match[name] for name in ("hard", "soft")] if match else [None, None]
        try:
            hard, soft = (None if cell is None else to_number(cell.strip()) * self._factor for cell in cells)
        except ValueError:
            hard = soft = None
        self._counters["errors"] += hard is None and soft is None
        return hard, soft

    def _open(self) -> Any:
        try:
            return serial.Serial(self._settings["port"], self._settings["baud"], timeout=_TIMEOUT_S)
        except (serial.SerialException, OSError, ValueError) as error:
            raise _error(str(self._settings["port"]), error) from error

    def _wait_for_replug(self, gone: Exception) -> int:
        begun = time.monotonic()
        self._port.close()
        self._buffer = b""
        self.notify(f"{self._settings['port']} was unplugged. Waiting for it, up to {self._replug_s:g} s.")
        while not self._stopped.wait(_AGAIN_S):
            try:
                self._port = self._open()
            except SourceError:
                if time.monotonic() - begun > self._replug_s:
                    raise DeviceNotFound(f"{self._settings['port']} was unplugged: plug it in again") from gone
                continue
            lost = int((time.monotonic() - begun) * 1e9 / self._period_ns) if self._period_ns else 0
            self._counters["reconnects"] += 1
            self._counters["lost"] += lost
            self.notify(f"{self._settings['port']} is back: {lost} pairs lost.")
            return lost
        return 0


def _sample(seq: int, hard: tuple[int, float], soft: tuple[int, float]) -> Sample:
    status = Status.LOST if math.isnan(hard[1] + soft[1]) else Status.OK
    return Sample(seq, hard[0], soft[0], -1, -1, hard[1], soft[1], int(status))


def _error(port: str, error: Exception) -> SourceError:
    if "Permission" in str(error):
        return DeviceRefused(
            f"{port}: no permission to open it; `sudo usermod -aG dialout $USER`, then log out and in again"
        )
    there = "" if os.path.exists(port) or "/" not in port else ": there is no such port; see `palpate devices`"  # noqa: PTH110
    return DeviceNotFound(f"{port} cannot be opened{there or f': {error}'}")


def _pattern(name: str, value: Any) -> str:
    if len(str(value)) > _LONGEST:
        raise ValueError(f"{name}: got {len(str(value)):,} characters, allowed: {_LONGEST}")
    try:
        groups = set(re.compile(str(value)).groupindex)
    except (re.error, OverflowError, RecursionError) as error:
        raise ValueError(f"{name}: got {quoted(value)}, allowed: a regular expression ({error})") from error
    if not {"hard", "soft"} <= groups:
        raise ValueError(f"{name}: got groups {quoted(sorted(groups))}, allowed: both (?P<hard>...) and (?P<soft>...)")
    return str(value)


_ALLOWED: dict[str, Check] = {
    "pattern": _pattern,
    "unit": choice(*PICOFARADS),
    "baud": number(50, 4_000_000, whole=True),
    "replug": number(0, 86400),
}


def open_serial(address: str, options: Mapping[str, Any]) -> SerialSource:
    """Return the source of `serial:PORT`."""
    given = checked("serial", options, _ALLOWED)
    return SerialSource(text("serial's port", address), **given)
