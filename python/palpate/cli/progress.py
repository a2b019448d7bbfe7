"""How far a command is, how fast, and the time left: a line on the terminal."""

import os
import sys
import threading
import time
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self, TypeVar

import click

from palpate.cli.terminal import say

_SILENT_S = 1.0
_EVERY_S = 0.25
_Item = TypeVar("_Item")


class Progress:
    """A line on standard error, if that is a terminal: after the first second, 4 times a second, cleared at the end.

    A thread draws it, so the time goes on where a step takes long.

    Parameters
    ----------
    what : str
        What is done: the beginning of the line.
    unit : str
        What is counted.
    """

    def __init__(self, what: str, unit: str) -> None:
        self._what, self._unit = what, unit
        self._done: Callable[[], float] = float
        self._total, self._begin_s, self._shown = 0.0, time.monotonic(), 0
        self._ended, self._lock = threading.Event(), threading.Lock()
        self._thread = threading.Thread(target=self._draw_often, daemon=True) if sys.stderr.isatty() else None

    def __call__(self, done: int, total: int) -> None:
        """Set how much is done, of how much. The rate is that since the call with 0."""
        if not done:
            self._begin_s = time.monotonic()
        self.follow(lambda: done, total)

    def follow(self, done: Callable[[], float], total: float) -> None:
        """Set a function that returns how much is done, and how much there is; 0: unknown."""
        self._done, self._total = done, total

    def __enter__(self) -> Self:
        """Begin to draw."""
        if self._thread:
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Clear the line."""
        self._ended.set()
        if self._thread:
            self._thread.join()
        self._clear()

    def over(self, items: Collection[_Item]) -> Iterator[_Item]:
        """Yield the items; one is done when the next is asked for."""
        for done, item in enumerate(items):
            self(done, len(items))
            yield item

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Clear the line while something else is printed or asked."""
        with self._lock:
            self._clear()
            yield

    def echo(self, text: str, *, err: bool = False, nl: bool = True) -> None:
        """Print a text in place of the line."""
        with self.aside():
            click.echo(text, err=err, nl=nl)

    def _draw_often(self) -> None:
        pause_s = _SILENT_S
        while not self._ended.wait(pause_s):
            pause_s = _EVERY_S
            with self._lock:
                self._draw()

    def _draw(self) -> None:
        text = f"{self._what}: {told(self._done(), self._total, self._unit, time.monotonic() - self._begin_s)}"
        text = text[: _columns() - 1]
        say(f"\r{text:{self._shown}}", nl=False)
        self._shown = len(text)

    def _clear(self) -> None:
        if self._shown:
            say("\r" + " " * self._shown + "\r", nl=False)
            self._shown = 0


def told(done: float, total: float, unit: str, seconds: float) -> str:
    """Return how far something is.

    Examples
    --------
    >>> told(30, 120, "MB", 20.0), told(1, 6, "figures", 4.0), told(0, 6, "figures", 4.0)
    ('30 of 120 MB, 1.5 MB/s, 1:00 left', '1 of 6 figures, 0.25 figures/s, 0:20 left', '0:04')
    """
    if not (done and total and seconds):
        return _clock(seconds)
    rate = done / seconds
    return f"{done:.4g} of {total:.4g} {unit}, {rate:.2g} {unit}/s, {_clock(max(total - done, 0.0) / rate)} left"


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"


def _columns() -> int:
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns or 80
    except (OSError, ValueError):
        from shutil import get_terminal_size

        return get_terminal_size().columns


class Reading(Progress):
    """The line of a command that reads files: in MB, also within a recording of palpate.

    Parameters
    ----------
    what : str
    files : collection of pathlib.Path
    """

    def __init__(self, what: str, files: Collection[Path]) -> None:
        super().__init__(what, "MB")
        self._sizes = {file: file.stat().st_size if file.is_file() else 0 for file in files}
        self._read: dict[Path, Callable[[], int]] = dict.fromkeys(files, int)
        self.follow(self._megabytes, sum(self._sizes.values()) / 1e6)

    def begin(self, file: Path, recording: Any) -> None:
        """Follow the reading of a recording in blocks; that of a table is not seen."""
        if hasattr(recording, "seen"):
            size = self._sizes[file]
            self._read[file] = lambda: min(recording.seen.size, size)  # columns take less in a file than as text

    def end(self, file: Path) -> None:
        """Count a file as read."""
        size = self._sizes[file]
        self._read[file] = lambda: size

    def _megabytes(self) -> float:
        return sum(read() for read in self._read.values()) / 1e6
