"""What several commands have in common: the options of how a recording is read and estimated."""

import re
from collections.abc import Callable
from typing import Any

import click

from palpate._core import scenes


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
            raise click.BadParameter(f"got {text!r}, allowed: NAME=NUMBER, as threshold=6") from None
    return found


json_option: Callable[[Callable[..., Any]], Callable[..., Any]] = click.option(
    "--json", "as_json", is_flag=True, help="One JSON document on standard output instead."
)
"""Adds as_json to a command."""

_READING = [
    click.option("--map", "columns", callback=columns, metavar="hard=COL,soft=COL",
                 help="Columns of a table from another logger: names, or positions counted from 1; also time=COL."),
    click.option("--unit", help="Unit of the capacitances, aF to F.  [default: the header's, else pF]"),
]  # fmt: skip
_SCENES = f"How to estimate: {', '.join(scenes)}."
_SCENE = click.option("--scene", default="handheld", show_default=True, help=_SCENES)
_SCENE_AGAIN = click.option("--scene", help=f"{_SCENES}  [default: the recording's own, else handheld]")
_ESTIMATING = [
    click.option("--samples", type=click.IntRange(min=1), help="Samples a touch, at most.  [default: the scene's]"),
    click.option("--set", "settings", callback=settings, multiple=True, metavar="NAME=VALUE",
                 help="A parameter of the estimator, as threshold=6; may be repeated. A wrong NAME lists the scene's."),
]  # fmt: skip


def _adding(options: list[Callable[..., Any]]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    def add(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return add


reading_options: Callable[[Callable[..., Any]], Callable[..., Any]] = _adding(_READING)
"""Adds columns and unit to a command."""
estimating_options: Callable[[Callable[..., Any]], Callable[..., Any]] = _adding([_SCENE, *_ESTIMATING])
"""Adds scene, samples and settings."""
recording_options: Callable[[Callable[..., Any]], Callable[..., Any]] = _adding([*_READING, _SCENE, *_ESTIMATING])
"""Adds columns, unit, scene, samples and settings."""
replaying_options: Callable[[Callable[..., Any]], Callable[..., Any]] = _adding([*_READING, _SCENE_AGAIN, *_ESTIMATING])
"""The same, the scene None where none is asked for."""
