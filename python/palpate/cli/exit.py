"""How a command ends: exit codes, and errors as sentences."""

import sys
from typing import Any, NoReturn

import click

from palpate import DeviceNotFound, MissingExtra, PalpateError, SourceTimeout

NO_DEVICE = 3
BAD_DATA = 4
NOT_RELIABLE = 5
MISSING_EXTRA = 6
INTERRUPTED = 130


class Commands(click.Group):
    """Ends a command with a sentence and an exit code where it raises one of the package's errors."""

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command."""
        try:
            return super().invoke(ctx)
        except PalpateError as error:
            fail(error)
        except KeyboardInterrupt:
            click.echo("interrupted", err=True)
            ctx.exit(INTERRUPTED)


def fail(error: PalpateError) -> NoReturn:
    """Say what is wrong, and end with its exit code."""
    click.echo(f"Error: {error}", err=True)
    sys.exit(code_of(error))


def code_of(error: PalpateError) -> int:
    """Return the exit code of an error."""
    if isinstance(error, MissingExtra):
        return MISSING_EXTRA
    return NO_DEVICE if isinstance(error, DeviceNotFound | SourceTimeout) else BAD_DATA
