"""Options and arguments that several commands share."""

from collections.abc import Callable, Iterable, Sequence
from functools import reduce, wraps
from typing import TYPE_CHECKING, Any

import click

from palpate._core import scenes
from palpate.cli.paths import InputFile
from palpate.errors import quoted

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from palpate.calibration import Calibration

_Adding = Callable[[Callable[..., Any]], Callable[..., Any]]
_SCHEMES = ("usb:", "sim:", "i2c:", "iio:", "serial:", "lsl:")
_LSL_NAME = "palpate"


def complete_source(
    _context: click.Context, _parameter: click.Parameter, begun: str
) -> "list[CompletionItem]":
    """Return what the shell offers: schemes; after a scheme, scenarios or connected devices; else files."""
    from click.shell_completion import CompletionItem

    words: Iterable[str] = _SCHEMES
    if begun.startswith("sim:"):
        from palpate.simulation.board_input import known

        words = [f"sim:{name}" for name in known()]
    elif begun.startswith(_SCHEMES):
        from palpate.sources.devices import devices

        words = [device.uri for device in devices()[0]]
    found = [CompletionItem(word) for word in words if word.startswith(begun)]
    return found or [CompletionItem(begun, type="file")]


def _scene_names(_context: click.Context, _parameter: click.Parameter, begun: str) -> list[str]:
    return [scene for scene in scenes if scene.startswith(begun)]


def _columns(
    _context: click.Context, _parameter: click.Parameter, text: str | None
) -> dict[str, str] | None:
    from palpate.importers.table import parsed_map

    try:
        return None if text is None else parsed_map(text)
    except ValueError as error:
        raise click.BadParameter(str(error).removeprefix("map: ")) from None


def named_numbers(texts: Iterable[str], example: str) -> dict[str, float]:
    """Parse NAME=NUMBER, given any number of times."""
    found = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            found[name.strip()] = float(value)
        except ValueError:
            raise click.BadParameter(
                f"got {quoted(text)}, allowed: NAME=NUMBER, for example {example}"
            ) from None
    return found


def _settings(
    _context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]
) -> dict[str, float]:
    return named_numbers(texts, "threshold=6")


def _lsl_name(_context: click.Context, _parameter: click.Parameter, text: str | None) -> str | None:
    if text is not None and (":" in text or not text):
        allowed = "a name without a colon; write --lsl after SOURCE, or --lsl=NAME"
        raise click.BadParameter(f"got {quoted(text)}, allowed: {allowed}")
    return text


def _given(**values: Any) -> dict[str, Any]:
    return {name: value for name, value in values.items() if value is not None}


def tracking(
    scene: str | None, touch_seconds: float | None, samples: int | None, settings: dict[str, float]
) -> dict[str, Any]:
    """Return scene and settings of the tracker that a user gave; a length replaces the one of the scene, or of a recording.

    Examples
    --------
    >>> tracking("paper", None, 60, {"threshold": 6.0})
    {'scene': 'paper', 'seconds': None, 'samples': 60, 'threshold': 6.0}
    """
    given = settings | _given(seconds=touch_seconds, samples=samples)
    lengths = given.keys() & {"seconds", "samples"}
    if len(lengths) > 1:
        raise click.UsageError(
            "got a length of a touch in seconds and in samples, allowed: only one of them"
        )
    other_length = {"seconds": None, "samples": None} if lengths else {}
    return _given(scene=scene) | other_length | given


def tracking_of(
    recording: Any, how: dict[str, Any], calibration: "Calibration | None" = None
) -> dict[str, Any]:
    """Return scene and settings for a recording: without a given scene its own; of a calibration; and those that are given."""
    found = how if "scene" in how else {"scene": "handheld"} | recording.settings | how
    return calibration.for_tracking(found) | how if calibration else found


def simulated(recording: Any) -> str:
    """Return what to print of a recording that a simulator made; "": it is of a probe, or not known."""
    from palpate.recording.sidecar import is_simulated

    return "simulated: no probe was used" * is_simulated(recording.document.get("device", {}))


INPUT = InputFile(allow_dash=True)
"""The type of an argument that is a recording; - is standard input."""
lsl_option: _Adding = click.option(
    "--lsl", is_flag=False, flag_value=_LSL_NAME, callback=_lsl_name, metavar="[NAME]",
    help="Send the measurement to Lab Streaming Layer, as the streams NAME (samples), NAME-estimates and NAME-marks. "
    f"Without a name: {_LSL_NAME}.",
)  # fmt: skip
"""Adds lsl, the name of the streams or None, to a command."""
firmware_option: _Adding = click.option(
    "--firmware", type=InputFile(), help="Firmware file of the evaluation kit."
)
"""Adds firmware to a command."""
_EXCITATION = click.option("--excitation", metavar="PINS", help="Excitation pins that the bumps are wired to: A, B, AB, "
                           "or HARD,SOFT as B,A.  [default: B]")  # fmt: skip
_READING = [
    click.option("--map", "columns", callback=_columns, metavar="hard=COL,soft=COL",
                 help="Columns of a table of another program: names, or positions counted from 1; also time=COL."),
    click.option("--unit", help="Unit of the capacitances, aF to F; or of two other signals, as N.  [default: from the header, else by size]"),
    click.option("--time-unit", help="Unit of the times, ns to d.  [default: from the header, else by size]"),
    click.option("--rate", type=click.FloatRange(min=0, min_open=True),
                 help="Pairs a second, for a table without usable times."),
    click.option("--decimal", type=click.Choice(["point", "comma"]), help="Decimal mark, if the numbers leave it open."),
    click.option("--soft", type=INPUT, help="File of the soft channel, if FILE has the hard channel only."),
    click.option("--part", metavar="NAME", help="Sheet of a workbook, or stream of an XDF file, if several fit."),
]  # fmt: skip
_SCENES = f"Method of estimation: {', '.join(scenes)}."
_SCENE = click.option(
    "--scene", default="handheld", show_default=True, help=_SCENES, shell_complete=_scene_names
)
_SCENE_AGAIN = click.option("--scene", shell_complete=_scene_names,
                            help=f"{_SCENES}  [default: from the recording, else handheld]")  # fmt: skip
_ESTIMATING = [
    click.option("--touch-seconds", type=click.FloatRange(min=0, min_open=True),
                 help="Length of a touch, s.  [default: from the scene]"),
    click.option("--samples", type=click.IntRange(min=1), help="Length of a touch in samples, in place of seconds."),
    click.option("--set", "settings", callback=_settings, multiple=True, metavar="NAME=VALUE",
                 help="A setting of the estimator, as threshold=6; may be repeated. A wrong NAME lists all."),
]  # fmt: skip


def _adding(options: Sequence[_Adding]) -> _Adding:
    return lambda command: reduce(lambda made, option: option(made), reversed(options), command)


def _together(
    command: Callable[..., Any], name: str, make: Callable[..., Any], *parts: str
) -> Callable[..., Any]:
    """Pass the values of those of these options that a command has as one argument, which a function makes of them."""

    @wraps(command)
    def called(*args: Any, **given: Any) -> Any:
        made = make(**{part: given.pop(part) for part in parts if part in given})
        return command(*args, **{name: made}, **given)

    return called


board_options: _Adding = _adding([firmware_option, _EXCITATION])
"""Adds firmware and excitation to a command with `reading_options`: they are in `asked`, too."""


def reading_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add `asked` to a command: the keywords of `palpate.read`, or of `palpate.open`, that were given."""
    names = (
        "columns",
        "unit",
        "time_unit",
        "rate",
        "decimal",
        "soft",
        "part",
        "firmware",
        "excitation",
    )
    return _adding(_READING)(_together(command, "asked", _given, *names))


def recording_options(command: Callable[..., Any], scene: _Adding = _SCENE) -> Callable[..., Any]:
    """Add `asked` and `how`, as of `tracking`, to a command."""
    names = ("scene", "touch_seconds", "samples", "settings")
    return reading_options(
        _adding([scene, *_ESTIMATING])(_together(command, "how", tracking, *names))
    )


def replaying_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the same; `how` has a scene only if it is given: see `tracking_of`."""
    return recording_options(command, _SCENE_AGAIN)
