"""What several commands have in common: exit codes, and the options of how a recording is read and estimated."""

import re
import sys
from collections.abc import Callable
from typing import Any, NoReturn

import click

from palpate import MissingExtra, PalpateError

BAD_DATA = 4
NOT_RELIABLE = 5
MISSING_EXTRA = 6


def fail(error: PalpateError) -> NoReturn:
    """Say what is wrong, and end with its exit code."""
    click.echo(f"Error: {error}", err=True)
    sys.exit(MISSING_EXTRA if isinstance(error, MissingExtra) else BAD_DATA)


def columns(_context: click.Context, _parameter: click.Parameter, text: str | None) -> dict[str, str] | None:
    """hard=COL,soft=COL[,time=COL]; a name may hold commas."""
    if text is None:
        return None
    parts = re.split(r"(?:^|,)\s*(hard|soft|time|soft_time)\s*=", text)
    if parts[0].strip() or len(parts) < 3 or len(set(parts[1::2])) < len(parts[1::2]):
        raise click.BadParameter(f"got {text!r}, allowed: hard=COL,soft=COL[,time=COL], each once")
    return {key: name.strip() for key, name in zip(parts[1::2], parts[2::2], strict=True)}


def settings(_context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, float]:
    """NAME=VALUE, several times."""
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise click.BadParameter(f"got {text!r}, allowed: NAME=NUMBER, as drift=0.02") from None
    return found


_OPTIONS = [
    click.option("--map", "columns", callback=columns, metavar="hard=COL,soft=COL",
                 help="Columns of a table from another logger: names, or positions counted from 1; also time=COL."),
    click.option("--unit", help="Unit of the capacitances, aF to F.  [default: the header's, else pF]"),
    click.option("--scene", default="handheld", show_default=True,
                 help="How to estimate: handheld, sliding, paper, fixed."),
    click.option("--samples", type=click.IntRange(min=1), help="Samples a touch, at most.  [default: the scene's]"),
    click.option("--set", "settings", callback=settings, multiple=True, metavar="NAME=VALUE",
                 help="A parameter of the estimator, as drift=0.02; may be repeated."),
]  # fmt: skip


def recording_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options columns, unit, scene, samples and settings to a command."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
