"""The terminal of a measurement: the signals that end it, and messages that must not end it."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import click


def say(message: str, *, nl: bool = True) -> None:
    """Print a message to standard error; a terminal or pipe that is closed does not end the measurement."""
    with suppress(OSError):
        click.echo(message, err=True, nl=nl)


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


@contextmanager
def whole() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM wait until the block is done, and act then."""
    came: list[int] = []
    with signals(lambda number, _: came.append(number), signal.SIGINT, signal.SIGTERM):
        yield
    if came:
        signal.raise_signal(came[0])


def _hung_up() -> Callable[[int, Any], None]:
    """Return the handler: what is printed to the closed terminal goes nowhere from then on; a log goes on."""
    terminals = [output for output in (1, 2) if os.isatty(output)]  # asked now: a closed one is no terminal

    def handle(number: int, _: object) -> None:
        signal.signal(number, signal.SIG_IGN)  # shell and system may both send it
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for output in terminals:
            os.dup2(nowhere, output)
        os.close(nowhere)
        signal.raise_signal(signal.SIGTERM)

    return handle
