"""The program `palpate`: answers --version at once, and imports the command line for all else."""

import sys

from palpate._core import __version__, simd


def main() -> None:
    """Run the command of `sys.argv`."""
    try:
        simd()
    except ValueError as error:
        from click import echo

        echo(f"Error: {error}", err=True)
        sys.exit(2)
    if sys.argv[1:] == ["--version"] and _told(f"palpate, version {__version__}\n"):
        return
    from palpate.cli import main as command

    command(prog_name="palpate")


def _told(text: str) -> bool:
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except (OSError, AttributeError):  # closed, full, or none at all: the command line says it, as of any other text
        return False
    return True
