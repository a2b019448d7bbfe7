"""How a command ends: its exit code, an error as one line, and the signals that interrupt it."""

import errno
import json
import os
import re
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from enum import IntEnum
from types import FrameType
from typing import NoReturn

import click

from palpate.cli.output import OutputSettings
from palpate.errors import (
    CalibrationRefused,
    DeviceNotFound,
    MissingExtra,
    PalpateError,
    SourceTimeout,
)
from palpate.messages import shortened


class ExitCode(IntEnum):
    """The exit codes of all commands."""

    DONE = 0
    """The command did its work."""
    UNEXPECTED = 1
    """An unexpected error, or the program that reads the output has closed the pipe."""
    USAGE = 2
    """A wrong command line, wrong keys or values in palpate.toml, or a calibration of another chip."""
    NO_DEVICE = 3
    """No device, or no permission to open it."""
    BAD_DATA = 4
    """A file is missing, not readable or damaged, or an output cannot be written."""
    NOT_RELIABLE = 5
    """Measured, but not reliable: the help of each command says when."""
    MISSING_EXTRA = 6
    """An optional package is missing."""
    INTERRUPTED = 130
    """Ended by Ctrl-C, SIGTERM or a closed terminal."""


_LONGEST = 1500  # characters of a message
_CLICK_NUMBER = re.compile(r"a valid (float|integer)(?: range)?$")  # the end of click's message
_NUMBERS = {
    "float": "a number: write it as 1.5, without a unit",
    "integer": "a whole number: write it as 3",
}


def error_exit_code(error: Exception) -> ExitCode:
    """Return the exit code for an error."""
    if isinstance(error, CalibrationRefused):
        return ExitCode.USAGE
    if isinstance(error, MissingExtra):
        return ExitCode.MISSING_EXTRA
    if isinstance(error, DeviceNotFound | SourceTimeout):
        return ExitCode.NO_DEVICE
    if isinstance(error, PalpateError | OSError):
        return ExitCode.BAD_DATA
    return ExitCode.UNEXPECTED


def error_text(error: Exception) -> str:
    """Return an error as one line."""
    if isinstance(error, OSError) and error.filename is not None:
        return message_line(f"{error.filename}: {error.strerror}")
    text = message_line(str(error))
    if isinstance(error, PalpateError | OSError):
        return text
    return f"unexpected: {type(error).__name__}: {text}"


def message_line(message: str) -> str:
    """Return a message as one line of limited length; other libraries quote a whole input."""
    return shortened(" ".join(message.splitlines()), _LONGEST)


@dataclass(frozen=True)
class ErrorReport:
    """An error in a JSON document."""

    code: ExitCode
    message: str

    @classmethod
    def of_file(cls, error: Exception) -> "ErrorReport":
        """Return the report of an error about one file; there a wrong column is bad data, too."""
        if isinstance(error, ValueError | TypeError):
            first_line = str(error).split("\n")[0]
            return cls(ExitCode.BAD_DATA, message_line(first_line))
        return cls(error_exit_code(error), error_text(error))

    def line(self, file: object) -> str:
        """Return the message for standard error, which names the file."""
        place = "" if self.message.startswith(str(file)) else f"{file}: "
        return f"Error: {place}{self.message}"


@contextmanager
def usage_errors(prefix: str = "") -> Iterator[None]:
    """Turn a wrong argument of palpate's functions into an error of the command line."""
    try:
        yield
    except (ValueError, TypeError) as error:
        raise click.UsageError(prefix + str(error).split("\n")[0]) from error


@contextmanager
def errors_end_command(output: OutputSettings) -> Iterator[None]:
    """After an error print one line and exit with its code; click itself handles a closed pipe."""
    try:
        yield
    except click.UsageError as error:
        raise _with_help_command(error, output) from error
    except (click.ClickException, click.exceptions.Exit, click.Abort):
        raise
    except KeyboardInterrupt:
        _end(ExitCode.INTERRUPTED, "interrupted", "", output)
    except Exception as error:
        if isinstance(error, OSError) and error.errno == errno.EPIPE:
            raise
        code = error_exit_code(error)
        message = error_text(error)
        if output.debug:
            traceback.print_exception(error)
        elif code == ExitCode.UNEXPECTED:
            message += "; please report it with the output of --debug"
        _end(code, message, "Error: ", output)


def _with_help_command(error: click.UsageError, output: OutputSettings) -> click.UsageError:
    """Return the error as one line with the help command; `palpate` alone shows its help."""
    if error.ctx is None or isinstance(error, click.exceptions.NoArgsIsHelpError):
        return error
    text = error.format_message().rstrip(".")
    message = message_line(_CLICK_NUMBER.sub(lambda match: _NUMBERS[match[1]], text))
    see = " See" if message.endswith("?") else "; see"
    message += f"{see} {error.ctx.command_path} --help"
    _print_error_document(ExitCode.USAGE, message, output)
    return click.UsageError(message)


def _end(code: ExitCode, message: str, prefix: str, output: OutputSettings) -> NoReturn:
    _print_error_document(code, message, output)
    click.echo(prefix + message, err=True)
    sys.exit(code)


def _print_error_document(code: ExitCode, message: str, output: OutputSettings) -> None:
    """With --json print the error as the document, unless the command has printed one."""
    if output.json and not output.is_printed:
        click.echo(json.dumps({"error": asdict(ErrorReport(code, message))}, indent=2))


SignalHandler = Callable[[int, FrameType | None], object]


@contextmanager
def handle_signals(handler: SignalHandler, *numbers: int) -> Iterator[None]:
    """Call a function at these signals, SIGTERM among them; a closed terminal acts like SIGTERM.

    On Windows, where no program sends SIGTERM, so does Ctrl-Break. SIGHUP stays ignored if it was
    ignored before, as after `nohup`.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = {number: signal.signal(number, handler) for number in numbers}
    ctrl_break = getattr(signal, "SIGBREAK", None)  # Windows: also a closed console
    if ctrl_break is not None:
        previous[ctrl_break] = signal.signal(ctrl_break, handler)
    hangup = getattr(signal, "SIGHUP", None)
    if hangup is not None and signal.getsignal(hangup) != signal.SIG_IGN:
        previous[hangup] = signal.signal(hangup, _closed_terminal_handler())
    try:
        yield
    finally:
        for number, earlier in previous.items():
            signal.signal(number, earlier)


def _closed_terminal_handler() -> SignalHandler:
    """Return the handler of SIGHUP: discard output to the closed terminal, keep a log, and end."""
    # Asked before: a closed terminal is none any more.
    terminals = [output for output in (1, 2) if os.isatty(output)]

    def handle(number: int, _: FrameType | None) -> None:
        signal.signal(number, signal.SIG_IGN)  # shell and system may both send it
        null = os.open(os.devnull, os.O_WRONLY)
        for terminal in terminals:
            os.dup2(null, terminal)
        os.close(null)
        signal.raise_signal(signal.SIGTERM)

    return handle
