"""A serial port as lines of text, through unplugging and silence."""

import os
import sys
import time
from collections.abc import Callable, Iterator
from threading import Event
from typing import Any, NamedTuple

from palpate.errors import DeviceNotFound, DeviceRefused, MissingExtra, SourceError
from palpate.systems import fine_ns

try:
    import serial
except ImportError as _missing:  # pragma: no cover
    raise MissingExtra("a serial port needs pyserial: pip install 'palpate[serial]'") from _missing

LONGEST = 1000
"""Bytes of a line, at most: anything longer is not text."""
_TIMEOUT_S = 0.1
_AGAIN_S = 0.1
_SILENCE_S = 10.0


class Line(NamedTuple):
    """A line that came.

    Attributes
    ----------
    text : str
        One character a byte; empty: too long, and dropped.
    arrived_ns : int
        Since the port was opened.
    whole : bool
        False: the first one after the port was opened; its beginning may be missing.
    away_s : float
        How long the port was away just before, s.
    """

    text: str
    arrived_ns: int
    whole: bool = True
    away_s: float = 0.0


class Port:
    """A serial port.

    Parameters
    ----------
    name : str
        For example "/dev/ttyACM0" or "COM3".
    baud : int
        Bits per second.
    replug : float
        Longest time to wait for an unplugged port, s.
    reset : bool
        False: leave the lines DTR and RTS inactive, which restart many boards.

    Attributes
    ----------
    tell : callable
        Called with messages.
    reconnects : int
        How often it was opened again.

    Raises
    ------
    DeviceNotFound, DeviceRefused
        The port cannot be opened.
    """

    def __init__(self, name: str, baud: int = 115200, replug: float = 30.0, reset: bool = True) -> None:
        self.name, self.baud, self.replug_s = name, baud, replug
        self._reset = reset
        self.tell: Callable[[str], None] = print
        self._stopped = Event()
        self._begun_ns = fine_ns()
        self._buffer = b""
        self._whole = False
        self._away_s = 0.0
        self.reconnects: int = 0
        self._port = self._open()

    def lines(self) -> Iterator[Line | None]:
        """Return each line, and None where nothing came for 0.1 s."""
        silence = _Silence(self)
        while not self._stopped.is_set():
            try:
                data = self._port.read(max(self._port.in_waiting, 1))
            except (serial.SerialException, OSError) as error:
                self._wait_for_replug(error)
                continue
            lines = self._split(data)
            if word := silence.after(data, lines):
                self.tell(word)
            yield from lines
            if not lines:
                yield None

    @property
    def stopped(self) -> bool:
        """Whether the lines were told to end."""
        return self._stopped.is_set()

    def interrupt(self) -> None:
        """End the lines."""
        self._stopped.set()

    def close(self) -> None:
        """Close the port."""
        self._port.close()

    def _split(self, data: bytes) -> list[Line]:
        *parts, self._buffer = (self._buffer + data).replace(b"\r", b"\n").split(b"\n")
        found = []
        for part in parts:
            if part.strip() or not self._whole:
                found.append(self._line(part))
            self._whole = True
        if len(self._buffer) > LONGEST:  # the beginning is dropped, so the end is not a line
            if self._whole:
                found.append(self._line(self._buffer))
            self._whole, self._buffer = False, b""
        return found

    def _line(self, part: bytes) -> Line:
        text = "" if len(part) > LONGEST else part.strip().decode("latin-1")
        away_s, self._away_s = self._away_s, 0.0
        return Line(text, fine_ns() - self._begun_ns, self._whole, away_s)

    def _open(self) -> Any:
        try:
            # Exclusive: of two programs that read a port each gets a part of every line.
            port = serial.Serial(None, self.baud, timeout=_TIMEOUT_S, exclusive=True)
            port.port = self.name
            if not self._reset:
                port.dtr = port.rts = False
            port.open()
        except (serial.SerialException, OSError, ValueError) as error:
            raise _error(self.name, error) from error
        return port

    def _wait_for_replug(self, gone: Exception) -> None:
        begun = time.monotonic()
        self._port.close()
        self._buffer, self._whole = b"", False
        self.tell(f"{self.name} was unplugged. Waiting for it, up to {self.replug_s:g} s.")
        while not self._stopped.wait(_AGAIN_S):
            try:
                self._port = self._open()
            except SourceError:
                if time.monotonic() - begun > self.replug_s:
                    raise DeviceNotFound(f"{self.name} was unplugged: plug it in again") from gone
                continue
            self._away_s = time.monotonic() - begun
            self.reconnects += 1
            return


class _Silence:
    """Says once that no line comes."""

    def __init__(self, port: Port) -> None:
        self._port = port
        self._heard_s = time.monotonic()
        self._bytes = 0
        self._said = False

    def after(self, data: bytes, lines: list[Line]) -> str:
        """Return what is to be said now."""
        if lines:
            self._heard_s, self._bytes, self._said = time.monotonic(), 0, False
        self._bytes += len(data)
        if self._said or time.monotonic() - self._heard_s <= _SILENCE_S:
            return ""
        self._said = True
        what = f"sends {self._bytes} bytes, but no line end" if self._bytes else "sends nothing"
        return f"{self._port.name} {what}: check the baud rate, {self._port.baud}"


def _error(port: str, error: Exception, system: str = sys.platform) -> SourceError:
    text = str(error)
    denied = "Permission" in text
    if "exclusively lock" in text or "busy" in text or (denied and system == "win32"):  # there a port has one user
        return DeviceRefused(
            f"{port}: another program reads it, and each would get a part of the lines: close that program"
        )
    if denied:
        return DeviceRefused(
            f"{port}: no permission to open it; `sudo usermod -aG dialout $USER`, then log out and in again"
        )
    missing = "FileNotFound" in text if system == "win32" else "/" in port and not os.path.exists(port)  # noqa: PTH110
    return DeviceNotFound(
        f"{port} cannot be opened: {'there is no such port; see `palpate devices`' if missing else error}"
    )
