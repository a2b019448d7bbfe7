"""The terminal of a command: tables, messages, progress, signals that end it."""

import os
import signal
import sys
import threading
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import click

from palpate.errors import printable


def say(message: str, *, nl: bool = True) -> None:
    """Print a message to standard error; a terminal or pipe that is closed does not end the measurement."""
    with suppress(OSError):
        click.echo(printable(message, "\n" if nl else "\r"), err=True, nl=nl)


def echo(text: str) -> None:
    """Print a result to standard output."""
    click.echo(printable(text, "\n"))


def row_below(header: Sequence[str], cells: Iterable[object]) -> str:
    """Return a row of a table: each cell stands to the right, below its name in the header, whose blanks make its width."""
    return "  ".join(
        f"{cell!s:>{len(name)}}" for name, cell in zip(header, cells, strict=True)
    ).rstrip()


def aligned(rows: Sequence[Sequence[str]], side: str = ">") -> str:
    """Return rows as a table whose columns are as wide as they need; "<": with the cells to the left."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join(f"{cell:{side}{width}}" for cell, width in zip(row, widths, strict=True))
        for row in rows
    ]
    return "\n".join(line.rstrip() for line in lines)


@contextmanager
def signals(handle: Callable[[int, Any], None], *numbers: int) -> Iterator[None]:
    """Call a function at these signals, SIGTERM among them; a closed terminal acts like SIGTERM.

    On Windows, where no program sends SIGTERM, so does Ctrl-Break. SIGHUP stays ignored if it was ignored before, as after `nohup`.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, handle) for number in numbers}
    if stop := getattr(signal, "SIGBREAK", None):  # Windows: Ctrl-Break, or its console is closed
        before[stop] = signal.signal(stop, handle)
    hangup: Any = getattr(signal, "SIGHUP", None)
    if hangup is not None and signal.getsignal(hangup) != signal.SIG_IGN:
        before[hangup] = signal.signal(hangup, _hung_up())
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _hung_up() -> Callable[[int, Any], None]:
    """Return the handler: what is printed to the closed terminal goes nowhere from then on; a log goes on."""
    terminals = [
        output for output in (1, 2) if os.isatty(output)
    ]  # asked now: a closed one is no terminal

    def handle(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_IGN)  # shell and system may both send it
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for output in terminals:
            os.dup2(nowhere, output)
        os.close(nowhere)
        signal.raise_signal(signal.SIGTERM)

    return handle


def progress(label: str, length: int) -> Any:
    """Return click's bar of progress on standard error, up to a length; hidden if that is no terminal."""
    return click.progressbar(None, length, label, file=sys.stderr, hidden=not sys.stderr.isatty())


@contextmanager
def reading(label: str, files: Collection[Path]) -> Iterator[Callable[[Path], None]]:
    """Show how far the reading of files is, by their sizes; yield the function to call when one has been read."""
    sizes = {file: file.stat().st_size if file.is_file() else 1 for file in files}
    with progress(label, sum(sizes.values())) as bar:
        yield lambda file: bar.update(sizes[file])
