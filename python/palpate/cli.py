"""The command line. Results go to standard output, everything else to standard error.

Exit codes: 0 done, 1 unexpected, 2 usage, 4 bad or truncated data, 5 measured but not reliable (no touch).
"""

import json
import math
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from palpate import PalpateError, RecordingError, __version__, get_cmake_dir, get_include

if TYPE_CHECKING:
    from palpate import Recording, Touch

BAD_DATA = 4
NOT_RELIABLE = 5


def _tell(text: str) -> Callable[[click.Context, click.Parameter, bool], None]:
    def tell(context: click.Context, _parameter: click.Parameter, asked: bool) -> None:
        if asked:
            click.echo(text)
            context.exit()

    return tell


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="palpate")
@click.option("--includes", is_flag=True, is_eager=True, expose_value=False, callback=_tell(f"-I{get_include()}"),
              help="Print what a C++ compiler needs to find the headers, and exit.")  # fmt: skip
@click.option("--cmakedir", is_flag=True, is_eager=True, expose_value=False, callback=_tell(get_cmake_dir()),
              help="Print the folder for CMake's palpate_DIR or add_subdirectory, and exit.")  # fmt: skip
def main() -> None:
    """Real-time capacitance ratio from a two-bump tactile probe."""


def _columns(_context: click.Context, _parameter: click.Parameter, text: str | None) -> dict[str, str] | None:
    """hard=COL,soft=COL[,time=COL]; a name may hold commas."""
    if text is None:
        return None
    parts = re.split(r"(?:^|,)\s*(hard|soft|time|soft_time)\s*=", text)
    if parts[0].strip() or len(parts) < 3 or len(set(parts[1::2])) < len(parts[1::2]):
        raise click.BadParameter(f"got {text!r}, allowed: hard=COL,soft=COL[,time=COL], each once")
    return {key: name.strip() for key, name in zip(parts[1::2], parts[2::2], strict=True)}


def _settings(_context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, float]:
    """NAME=VALUE, several times."""
    settings = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            settings[name.strip()] = float(value)
        except ValueError:
            raise click.BadParameter(f"got {text!r}, allowed: NAME=NUMBER, as drift=0.02") from None
    return settings


@main.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--map", "columns", callback=_columns, metavar="hard=COL,soft=COL",
              help="Columns of a table from another logger: names, or positions counted from 1; also time=COL.")  # fmt: skip
@click.option("--unit", help="Unit of the capacitances, aF to F.  [default: the header's, else pF]")
@click.option(
    "--scene", default="handheld", show_default=True, help="How to estimate: handheld, sliding, paper, fixed."
)
@click.option("--samples", type=click.IntRange(min=1), help="Samples a touch, at most.  [default: the scene's]")
@click.option("--set", "settings", callback=_settings, multiple=True, metavar="NAME=VALUE",
              help="A parameter of the estimator, as drift=0.02; may be repeated.")  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="One JSON document instead of a table.")
def replay(
    file: Path,
    columns: dict[str, str] | None,
    unit: str | None,
    scene: str,
    samples: int | None,
    settings: dict[str, float],
    as_json: bool,
) -> None:  # \b below is click's mark for lines that it must not join
    """Send a recording through the estimator again: one row a touch.

    Flags: short, saturated, refused, unsettled, unexcited; see help(palpate.Touch.flags). Exit codes: 4, not a
    recording; 5, no touch in it.

    \b
    Example:
      palpate replay bench.csv --map "hard=C1 (pF),soft=C2 (pF)" --set drift=0.005
    """  # noqa: D301
    from palpate import read, touches

    try:
        recording = read(file, columns=columns, unit=unit)
        found = touches(recording, scene=scene, **settings, **({"samples": samples} if samples else {}))
    except (ValueError, TypeError) as error:
        raise click.UsageError(str(error).split("\n")[0]) from error
    except RecordingError as error:
        _fail(error, BAD_DATA)
    for note in recording.notes:
        click.echo(f"{file}: {note}", err=True)
    click.echo(_json(file, scene, settings, recording, found) if as_json else _table(found), nl=as_json)
    if not found:
        click.echo(f"{file}: no touch found: {_why_not(recording)}", err=True)
        sys.exit(NOT_RELIABLE)


def _fail(error: PalpateError, code: int) -> NoReturn:
    click.echo(f"Error: {error}", err=True)
    sys.exit(code)


def _why_not(recording: "Recording") -> str:
    import numpy as np

    channels = {"hard": recording.hard, "soft": recording.soft}
    spans = [f"{name} {np.nanmax(c) - np.nanmin(c):.3g} pF" for name, c in channels.items() if np.isfinite(c).any()]
    if len(spans) < 2:
        return "a channel has no value at all"
    return f"nothing rose out of the idle noise for long enough. The channels span {', '.join(spans)}; see --unit"


def _json(file: Path, scene: str, settings: dict[str, float], recording: "Recording", found: "list[Touch]") -> str:
    plain = [touch.as_dict() for touch in found]
    document = {
        "file": str(file),
        "scene": scene,
        "settings": {name: value if math.isfinite(value) else str(value) for name, value in settings.items()},
        "palpate": __version__,
        "rows": len(recording.hard),
        "notes": recording.notes,
        "touches": plain,
    }
    return json.dumps(document, indent=2, allow_nan=False)


def _table(found: "list[Touch]") -> str:
    if not found:
        return ""
    lines = ["touch   start_s  samples     ratio  std. error  covariance  alarm  flags"]
    for number, touch in enumerate(found, 1):
        start = "-" if math.isnan(touch.start_s) else f"{touch.start_s:.3f}"
        error = "-" if math.isnan(touch.standard_error) else f"{touch.standard_error:.2g}"
        lines.append(
            f"{number:5} {start:>9} {touch.samples:8} {touch.ratio:9.4f} {error:>11} {touch.covariance:11.3g}"
            f" {touch.alarm_share:6.0%}  {' '.join(touch.flags)}".rstrip()
        )
    return "\n".join(lines) + "\n"


@main.command()
@click.option("--seeds", default=20, show_default=True, type=click.IntRange(min=1), help="Recordings of each scenario.")
def bench(seeds: int) -> None:
    """Error against run time, on simulated touches with known truth.

    The whole bench, with other libraries, the cost of each stage and a figure, is in bench/ of the source.

    \b
    Example:
      palpate bench --seeds 50
    """  # noqa: D301
    from palpate import benchmark

    click.echo(benchmark.table(benchmark.compare(seeds)))
