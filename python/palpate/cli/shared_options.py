"""Options and arguments that several commands share, and their values as objects."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate._core import scenes
from palpate.cli.paths import InputFile
from palpate.messages import quoted

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from palpate.calibration import Calibration
    from palpate.recording.opened import OpenedRecording

_Function = Callable[..., Any]
Keywords = dict[str, Any]
"""Keyword arguments of palpate's functions."""
_Decorator = Callable[[_Function], _Function]
_SCHEMES = ("usb:", "sim:", "i2c:", "iio:", "serial:", "lsl:")
_LSL_NAME = "palpate"


@dataclass(frozen=True)
class SourceOptions:
    """Options for reading a file or opening a device; None: not set."""

    columns: Mapping[str, str] | None = None
    unit: str | None = None
    time_unit: str | None = None
    rate: float | None = None
    decimal: str | None = None
    soft: Path | None = None
    part: str | None = None
    line_columns: str | None = None
    pattern: str | None = None
    firmware: Path | None = None
    excitation: str | None = None

    def keywords(self) -> Keywords:
        """Return the options that are set, as keywords of `palpate.read` and `palpate.open`."""
        keywords = _without_none(asdict(self))
        line_columns = keywords.pop("line_columns", None)
        if line_columns is not None:
            if "columns" in keywords:
                raise click.UsageError("--columns: got --map, too, allowed: one of them")
            keywords["columns"] = line_columns
        return keywords


@dataclass(frozen=True)
class TrackerOptions:
    """Scene and settings of the tracker; None: not set."""

    scene: str | None = None
    touch_seconds: float | None = None
    samples: int | None = None
    soft_later_ms: float | None = None
    falling: bool | None = None
    baseline: str | tuple[float, float] | None = None
    settings: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the length of a touch is set once."""
        if len(self._changed_settings().keys() & {"seconds", "samples"}) > 1:
            raise click.UsageError(
                "got a length of a touch in seconds and in samples, allowed: only one of them"
            )

    def keywords(self) -> Keywords:
        """Return keywords of `palpate.Stream`; a given length replaces the one of scene and recording.

        Examples
        --------
        >>> TrackerOptions("paper", samples=60, settings={"threshold": 0.1}).keywords()
        {'scene': 'paper', 'seconds': None, 'samples': 60, 'threshold': 0.1}
        """
        changed = self._changed_settings()
        keywords: Keywords = {}
        if self.scene is not None:
            keywords["scene"] = self.scene
        if changed.keys() & {"seconds", "samples"}:
            keywords |= {"seconds": None, "samples": None}
        return keywords | changed

    def for_recording(
        self, recording: "OpenedRecording", calibration: "Calibration | None" = None
    ) -> Keywords:
        """Return keywords for a recording: without a scene its own; then the calibration's."""
        options = self.keywords()
        keywords = options
        if self.scene is None:
            keywords = {"scene": "handheld"} | recording.settings | options
        if calibration is not None:
            keywords = calibration.for_tracking(keywords) | options
        return keywords

    def with_settings(self, **settings: float | None) -> "TrackerOptions":
        """Return the options with more settings, without those that are None."""
        return replace(self, settings={**self.settings, **_without_none(settings)})

    def _changed_settings(self) -> Keywords:
        later_s = None
        if self.soft_later_ms is not None:
            later_s = self.soft_later_ms / 1000
        named = {
            "seconds": self.touch_seconds,
            "samples": self.samples,
            "soft_later": later_s,
            "falling": self.falling,
            "baseline": self.baseline,
        }
        return {**self.settings, **_without_none(named)}


def _without_none(values: Mapping[str, Any]) -> Keywords:
    return {name: value for name, value in values.items() if value is not None}


def simulation_note(recording: "OpenedRecording") -> str:
    """Return a note if a simulator made a recording, else ""."""
    if recording.sidecar.is_simulated:
        return "simulated: no probe was used"
    return ""


def complete_source(
    _context: click.Context, _parameter: click.Parameter, begin: str
) -> "list[CompletionItem]":
    """Return the shell's proposals: schemes; after a scheme, scenarios or devices; else files."""
    from click.shell_completion import CompletionItem

    words: Iterable[str] = _SCHEMES
    if begin.startswith("sim:"):
        from palpate.simulation.board_input import board_scenarios

        words = map("sim:{}".format, board_scenarios())
    elif begin.startswith(_SCHEMES):
        from palpate.sources.devices import devices

        words = [device.uri for device in devices()[0]]
    proposals = [CompletionItem(word) for word in words if word.startswith(begin)]
    return proposals or [CompletionItem(begin, type="file")]


def _complete_scene(_context: click.Context, _parameter: click.Parameter, begin: str) -> list[str]:
    return [scene for scene in scenes if scene.startswith(begin)]


def _parse_columns(
    _context: click.Context, _parameter: click.Parameter, text: str | None
) -> dict[str, str] | None:
    from palpate.importers.table import parse_map

    if text is None:
        return None
    try:
        return parse_map(text)
    except ValueError as error:
        raise click.BadParameter(str(error).removeprefix("map: ")) from None


def parse_numbers(texts: Iterable[str], example: str) -> dict[str, float]:
    """Parse NAME=NUMBER, any number of times."""
    numbers = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            numbers[name.strip()] = float(value)
        except ValueError:
            allowed = f"NAME=NUMBER, for example {example}"
            raise click.BadParameter(f"got {quoted(text)}, allowed: {allowed}") from None
    return numbers


def _parse_settings(
    _context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]
) -> dict[str, float]:
    return parse_numbers(texts, "smallest_shift=1")


def _parse_baseline(
    _context: click.Context, _parameter: click.Parameter, text: str | None
) -> str | tuple[float, float] | None:
    if text in (None, "measured", "zero"):
        return text
    try:
        hard, soft = map(float, str(text).split(","))
    except ValueError:
        allowed = "zero, measured, or two values, pF, as 6.9,4.6"
        raise click.BadParameter(f"got {quoted(text)}, allowed: {allowed}") from None
    return hard, soft


def _check_lsl_name(
    _context: click.Context, _parameter: click.Parameter, text: str | None
) -> str | None:
    if text is not None and (":" in text or not text):
        allowed = "a name without a colon; write --lsl after SOURCE, or --lsl=NAME"
        raise click.BadParameter(f"got {quoted(text)}, allowed: {allowed}")
    return text


INPUT = InputFile(allow_dash=True)
"""The type of an argument that is a recording; - is standard input."""
lsl_option: _Decorator = click.option(
    "--lsl",
    is_flag=False,
    flag_value=_LSL_NAME,
    callback=_check_lsl_name,
    metavar="[NAME]",
    help="Send the measurement to Lab Streaming Layer, as the streams NAME (samples), "
    f"NAME-estimates and NAME-marks. Without a name: {_LSL_NAME}.",
)
"""Adds lsl, the name of the streams or None, to a command."""
firmware_option: _Decorator = click.option(
    "--firmware", type=InputFile(), help="Firmware file of the evaluation kit."
)
"""Adds firmware to a command."""
_BOARD: Sequence[_Decorator] = [
    firmware_option,
    click.option(
        "--excitation",
        metavar="PINS",
        help="Excitation pins that the bumps are wired to: A, B, AB, or HARD,SOFT as B,A.  "
        "[default: B]",
    ),
]
_READING: Sequence[_Decorator] = [
    click.option(
        "--map",
        "columns",
        callback=_parse_columns,
        metavar="hard=COL,soft=COL",
        help="Columns of a table of another program: names, or positions counted from 1; also "
        "time=COL.",
    ),
    click.option(
        "--columns",
        "line_columns",
        metavar="NAME,NAME,...",
        help="Of captured lines of a serial port: the names of the cells in order, as "
        "t_ms,hard,soft; - for a cell that is not used.",
    ),
    click.option(
        "--pattern",
        metavar="REGEX",
        help="Of captured lines: a regular expression that matches a whole line, with groups as "
        "(?P<hard>...) and (?P<soft>...).",
    ),
    click.option(
        "--unit",
        help="Unit of the capacitances, aF to F; or of two other signals, as N.  "
        "[default: from the header, else by size]",
    ),
    click.option(
        "--time-unit",
        help="Unit of the times, ns to d.  [default: from the header, else by size]",
    ),
    click.option(
        "--rate",
        type=click.FloatRange(min=0, min_open=True),
        help="Pairs a second, for a table without usable times.",
    ),
    click.option(
        "--decimal",
        type=click.Choice(["point", "comma"]),
        help="Decimal mark, if the numbers leave it open.",
    ),
    click.option(
        "--soft",
        type=INPUT,
        help="File of the soft channel, if FILE has the hard channel only.",
    ),
    click.option(
        "--part",
        metavar="NAME",
        help="Sheet of a workbook, or stream of an XDF file, if several fit.",
    ),
]
_SCENES = f"Method of estimation: {', '.join(scenes)}."
_SCENE: _Decorator = click.option(
    "--scene", default="handheld", show_default=True, help=_SCENES, shell_complete=_complete_scene
)
_SCENE_OF_RECORDING: _Decorator = click.option(
    "--scene",
    shell_complete=_complete_scene,
    help=f"{_SCENES}  [default: from the recording, else handheld]",
)
soft_later_option: _Decorator = click.option(
    "--soft-later-ms",
    type=float,
    metavar="MS",
    help="How much later the soft channel is read than its times say, as with one time for both "
    "channels; negative: earlier.  [default: 0]",
)
"""Adds soft_later_ms to a command."""
_SETTINGS: Sequence[_Decorator] = [
    click.option(
        "--touch-seconds",
        type=click.FloatRange(min=0, min_open=True),
        help="Length of a touch, s.  [default: from the scene]",
    ),
    click.option(
        "--samples",
        type=click.IntRange(min=1),
        help="Length of a touch in samples, in place of seconds.",
    ),
    soft_later_option,
    click.option(
        "--falling/--rising",
        default=None,
        help="Whether a press makes both channels fall: mutual capacitances, inverted wiring.  "
        "[default: rising]",
    ),
    click.option(
        "--baseline",
        callback=_parse_baseline,
        metavar="HARD,SOFT",
        help="Readings without contact, pF, as 6.9,4.6, in place of measured; zero: the readings are changes "
        "already, as of an indenter. A touch may then begin in the first rows.  [default: measured]",
    ),
    click.option(
        "--set",
        "settings",
        callback=_parse_settings,
        multiple=True,
        metavar="NAME=VALUE",
        help="A setting of the estimator, as smallest_shift=1; may be repeated. A wrong NAME lists all.",
    ),
]


def add_options(command: _Function, options: Sequence[_Decorator]) -> _Function:
    """Add options to a command, in the order in which --help lists them."""
    for option in reversed(options):
        command = option(command)
    return command


def pass_as(argument: str, options_class: type[Any], command: _Function) -> _Function:
    """Pass the options of a command that are fields of a class as one argument, its object."""

    @wraps(command)
    def with_object(*args: Any, **values: Any) -> Any:
        own = {}
        for option in fields(options_class):
            if option.name in values:
                own[option.name] = values.pop(option.name)
        return command(*args, **{argument: options_class(**own)}, **values)

    return with_object


def board_options(command: _Function) -> _Function:
    """Add firmware and excitation to a command that has the argument `reading`."""
    return add_options(command, _BOARD)


def reading_options(command: _Function) -> _Function:
    """Add the argument `reading` to a command, of `SourceOptions`."""
    return add_options(pass_as("reading", SourceOptions, command), _READING)


def recording_options(command: _Function) -> _Function:
    """Add `reading` and `tracker`, of `TrackerOptions`, to a command that measures."""
    return _add_tracker(command, _SCENE)


def replaying_options(command: _Function) -> _Function:
    """Add `reading` and `tracker` to a command for recordings, which have their own scene."""
    return _add_tracker(command, _SCENE_OF_RECORDING)


def _add_tracker(command: _Function, scene: _Decorator) -> _Function:
    with_tracker = pass_as("tracker", TrackerOptions, command)
    return reading_options(add_options(with_tracker, [scene, *_SETTINGS]))
