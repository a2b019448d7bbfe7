"""The program `palpate`, also as ``python -m palpate``: imports the command line and runs it."""

import os
import sys
from io import TextIOWrapper

_INTERRUPTED = 130  # as in palpate.cli.exit_codes, which may not be imported yet


def main() -> None:
    """Run the command of `sys.argv`."""
    _open_closed_streams()
    _escape_unencodable_text()
    try:
        from palpate.cli.main import palpate_command
    except KeyboardInterrupt:  # Ctrl-C during the imports; afterwards the command line handles it
        sys.stderr.write("interrupted\n")
        sys.exit(_INTERRUPTED)
    try:
        palpate_command(prog_name="palpate")
    except SystemExit as end:
        if end.code == _INTERRUPTED:
            _ignore_signals()
        raise


def _ignore_signals() -> None:
    """Ignore signals that end a program: it is ending, and the first Ctrl-C sets the exit code."""
    import signal

    for number in signal.Signals:
        if number.name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"):
            signal.signal(number, signal.SIG_IGN)


def _open_closed_streams() -> None:
    """Open the null device in place of standard streams that are closed, as after ``2>&-``.

    Else the next file that is opened, such as a recording, would be standard error: a library that
    writes there would write into it.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # gets the lowest free number, which is this one
    if sys.stdout is None:
        sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False)


def _escape_unencodable_text() -> None:
    r"""Print a character that the console cannot encode as an escape, \u03c3, without an error.

    On Windows that is any text beyond the old code page, for example in the name of a file;
    elsewhere a name that is not valid text.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    main()
