"""The command line. Results go to standard output, everything else to standard error.

Exit codes: 0 done, 1 unexpected, 2 usage, 4 bad or truncated data, 5 measured but not reliable (no touch), 6 an extra is missing.
"""

import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from palpate import (
    RecordingError,
    __version__,
    cli_calibrate,
    cli_figures,
    cli_moduli,
    cli_simulate,
    get_cmake_dir,
    get_include,
)
from palpate.cli_options import NOT_RELIABLE, fail, recording_options

if TYPE_CHECKING:
    from palpate import Recording, Touch


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


main.add_command(cli_simulate.simulate)
main.add_command(cli_calibrate.calibrate)
main.add_command(cli_figures.figures)


@main.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@recording_options
@click.option("--calibration", type=click.Path(exists=True, dir_okay=False, path_type=Path),
              help="What `calibrate` wrote: adds the modulus, with its interval, to each touch.")  # fmt: skip
@click.option("--json", "as_json", is_flag=True, help="One JSON document instead of a table.")
def replay(
    file: Path,
    columns: dict[str, str] | None,
    unit: str | None,
    scene: str,
    samples: int | None,
    settings: dict[str, float],
    calibration: Path | None,
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
        fail(error)
    for note in recording.notes:
        click.echo(f"{file}: {note}", err=True)
    moduli = cli_moduli.Moduli(calibration, scene) if calibration else None
    if as_json:
        click.echo(_json(file, scene, settings, recording, found, moduli))
    else:
        click.echo(moduli.table(_table(found), found) if moduli and found else _table(found), nl=False)
    if not found:
        click.echo(f"{file}: no touch found: {_why_not(recording)}", err=True)
        sys.exit(NOT_RELIABLE)


def _why_not(recording: "Recording") -> str:
    import numpy as np

    channels = {"hard": recording.hard, "soft": recording.soft}
    spans = [f"{name} {np.nanmax(c) - np.nanmin(c):.3g} pF" for name, c in channels.items() if np.isfinite(c).any()]
    if len(spans) < 2:
        return "a channel has no value at all"
    return f"nothing rose out of the idle noise for long enough. The channels span {', '.join(spans)}; see --unit"


def _json(
    file: Path,
    scene: str,
    settings: dict[str, float],
    recording: "Recording",
    found: "list[Touch]",
    moduli: cli_moduli.Moduli | None,
) -> str:
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
    if moduli:
        moduli.add(document, found)
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
