"""Options that several commands share: how a recording is read, and how it is estimated."""

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate._core import scenes
from palpate.errors import quoted

if TYPE_CHECKING:
    from palpate.tables.loggers import Logger


def columns(_context: click.Context, _parameter: click.Parameter, text: str | None) -> dict[str, str] | None:
    """Parse the columns of --map."""
    from palpate.tables.asked import parsed_map

    try:
        return None if text is None else parsed_map(text)
    except ValueError as error:
        raise click.BadParameter(str(error).removeprefix("map: ")) from None


def settings(_context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, float]:
    """Parse NAME=VALUE, given any number of times."""
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise click.BadParameter(f"got {quoted(text)}, allowed: NAME=NUMBER, for example threshold=6") from None
    return found


def opening(firmware: Path | None, excitation: str | None) -> dict[str, str]:
    """Return the options of a board source that a user gave beside its name."""
    given = {"firmware": firmware and str(firmware), "excitation": excitation}
    return {name: value for name, value in given.items() if value}


def tracking(touch_seconds: float | None, samples: int | None, settings: dict[str, float]) -> dict[str, Any]:
    """Return the settings of the tracker that a user gave; a length replaces the one of the scene, or of a recording.

    Examples
    --------
    >>> tracking(None, 60, {"threshold": 6.0}), tracking(None, None, {"seconds": 3.0})
    ({'threshold': 6.0, 'seconds': None, 'samples': 60}, {'seconds': 3.0, 'samples': None})
    """
    given: dict[str, Any] = {"seconds": touch_seconds, "samples": samples}
    lengths = {name: value for name, value in given.items() if value is not None}
    lengths |= {name: settings[name] for name in given if name in settings}
    if len(lengths) > 1:
        raise click.UsageError("got a length of a touch in seconds and in samples, allowed: only one of them")
    return settings | ({**dict.fromkeys(given), **lengths} if lengths else {})


json_option: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON document instead."
)
"""Adds as_json to a command."""

_BOARD = [
    click.option("--firmware", type=click.Path(exists=True, dir_okay=False, path_type=Path),
                 help="Firmware file of the evaluation kit."),
    click.option("--excitation", metavar="PINS",
                 help="Excitation pins that the bumps are wired to: A, B, AB, or HARD,SOFT as B,A.  [default: B]"),
]  # fmt: skip
INPUT = click.Path(exists=True, dir_okay=False, allow_dash=True, path_type=Path)
"""The type of an argument that is a recording; - is standard input."""
_READING = [
    click.option("--map", "columns", callback=columns, metavar="hard=COL,soft=COL",
                 help="Columns of a table of another program: names, or positions counted from 1; also time=COL."),
    click.option("--unit", help="Unit of the capacitances, aF to F.  [default: from the header, else by size]"),
    click.option("--time-unit", help="Unit of the times, ns to d.  [default: from the header, else by size]"),
    click.option("--rate", type=click.FloatRange(min=0, min_open=True),
                 help="Pairs a second, for a table without usable times."),
    click.option("--decimal", type=click.Choice(["point", "comma"]), help="Decimal mark, if the numbers leave it open."),
    click.option("--soft", type=INPUT, help="File of the soft channel, if FILE has the hard channel only."),
    click.option("--part", metavar="NAME", help="Sheet of a workbook, or stream of an XDF file, if several fit."),
]  # fmt: skip
_ASKED = ("columns", "unit", "time_unit", "rate", "decimal", "soft", "part")
_SCENES = f"Method of estimation: {', '.join(scenes)}."
_SCENE = click.option("--scene", default="handheld", show_default=True, help=_SCENES)
_SCENE_AGAIN = click.option("--scene", help=f"{_SCENES}  [default: from the recording, else handheld]")
_ESTIMATING = [
    click.option("--touch-seconds", type=click.FloatRange(min=0, min_open=True),
                 help="Length of a touch, s.  [default: from the scene]"),
    click.option("--samples", type=click.IntRange(min=1), help="Length of a touch in samples, in place of seconds."),
    click.option("--set", "settings", callback=settings, multiple=True, metavar="NAME=VALUE",
                 help="A setting of the estimator, as threshold=6; may be repeated. A wrong NAME lists all."),
]  # fmt: skip


def _adding(options: list[Callable[..., Any]]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return add


board_options: Callable[[Callable[..., Any]], Callable[..., Any]] = _adding(_BOARD)
"""Adds firmware and excitation; see `opening`."""


def _asking(command: Callable[..., Any]) -> Callable[..., Any]:
    """Pass the values of `_READING` as one dict `asked`: those that were given, keywords of `palpate.read`."""

    @wraps(command)
    def asked(*args: Any, **given: Any) -> Any:
        values = {name: given.pop(name) for name in _ASKED}
        values["known"] = _loggers(str(given.get("source") or given.get("file") or ""))
        return command(*args, asked={name: value for name, value in values.items() if value is not None}, **given)

    return asked


def _loggers(source: str) -> "list[Logger] | None":
    """Return the loggers that palpate.toml remembers; None without one, or for a source that is no file."""
    from palpate.cli.known_loggers import loggers
    from palpate.sources.options import split

    return None if split(source)[0] else loggers() or None


def reading_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add asked to a command: the keywords of `palpate.read` that were given, and `known` as in `recorded`."""
    return _adding(_READING)(_asking(command))


def estimating_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add scene, touch_seconds, samples and settings."""
    return _adding([_SCENE, *_ESTIMATING])(command)


def recording_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add asked, scene, touch_seconds, samples and settings."""
    return reading_options(estimating_options(command))


def replaying_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the same; scene is None if it is not given."""
    return reading_options(_adding([_SCENE_AGAIN, *_ESTIMATING])(command))
