"""The program `palpate`, also as ``python -m palpate``: imports the command line, and hears a Ctrl-C meanwhile."""

import sys
from io import TextIOWrapper

_INTERRUPTED = 130  # as in palpate.cli.main, which may not be imported yet


def main() -> None:
    """Run the command of `sys.argv`."""
    _show_any_text()
    try:
        from palpate.cli import main as command
    except (
        KeyboardInterrupt
    ):  # Ctrl-C in the tenth of a second of the imports; from here on the command line hears it
        sys.stderr.write("interrupted\n")
        sys.exit(_INTERRUPTED)
    try:
        command(prog_name="palpate")
    except SystemExit as end:
        if end.code == _INTERRUPTED:
            _stay_ended()
        raise


def _stay_ended() -> None:
    """Ignore what ends a program: it ends already, all is closed, and the first Ctrl-C gives the exit code."""
    import signal

    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK"):
        if number := getattr(signal, name, None):
            signal.signal(number, signal.SIG_IGN)


def _show_any_text() -> None:
    r"""Let a character that the console or a pipe has no code for be printed as \u03c3, where it would be an error.

    On Windows that is any text beyond the old code page, for example in the name of a file; elsewhere a name that is no text.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    main()
