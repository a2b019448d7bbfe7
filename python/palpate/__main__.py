"""The program `palpate`, also as ``python -m palpate``: imports the command line and runs it."""

import sys
from io import TextIOWrapper

_INTERRUPTED = 130  # as in palpate.cli.exit_codes, which may not be imported yet


def main() -> None:
    """Run the command of `sys.argv`."""
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
