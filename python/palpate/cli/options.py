"""Options that several commands share: how a recording is read, and how it is estimated."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from palpate._core import scenes
from palpate.errors import quoted


def columns(_context: click.Context, _parameter: click.Parameter, text: str | None) -> dict[str, str] | None:
    """Parse hard=COL,soft=COL[,time=COL]; a name may contain commas."""
    if text is None:
        return None
    parts = re.split(r"(?:^|,)\s*(hard|soft|time|soft_time)\s*=", text)
    if parts[0].strip() or len(parts) < 3 or len(set(parts[1::2])) < len(parts[1::2]):
        raise click.BadParameter(f"got {quoted(text)}, allowed: hard=COL,soft=COL[,time=COL], each once")
    return {key: name.strip() for key, name in zip(parts[1::2], parts[2::2], strict=True)}


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
_READING = [
    click.option("--map", "columns", callback=columns, metavar="hard=COL,soft=COL",
                 help="Columns of a table of another logger: names, or positions counted from 1; also time=COL."),
    click.option("--unit", help="Unit of the capacitances, aF to F.  [default: from the header, else pF]"),
]  # fmt: skip
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
reading_options: Callable[[Callable[..., Any]], Callable[..., Any]] = _adding(_READING)
"""Adds columns and unit to a command."""
estimating_options: Callable[[Callable[..., Any]], Callable[..., Any]] = _adding([_SCENE, *_ESTIMATING])
"""Adds scene, touch_seconds, samples and settings."""
recording_options: Callable[[Callable[..., Any]], Callable[..., Any]] = _adding([*_READING, _SCENE, *_ESTIMATING])
"""Adds columns, unit, scene, touch_seconds, samples and settings."""
replaying_options: Callable[[Callable[..., Any]], Callable[..., Any]] = _adding([*_READING, _SCENE_AGAIN, *_ESTIMATING])
"""Adds the same; scene is None if it is not given."""
