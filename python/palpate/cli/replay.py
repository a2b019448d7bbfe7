"""`palpate replay`: sends recordings through the estimator again."""

import json
import sys
from pathlib import Path
from typing import Any

import click

from palpate.cli.exit import NOT_RELIABLE
from palpate.cli.inputs import InputFile
from palpate.cli.moduli import Moduli
from palpate.cli.options import INPUT, json_option, replaying_options, tracking
from palpate.cli.progress import Reading
from palpate.cli.recordings import Named, Recordings
from palpate.cli.replayed import How, replayed


@click.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=Recordings())
@replaying_options
@click.option("--calibration", type=InputFile(),
              help="Calibration file from `calibrate`: adds the modulus with its interval to each touch.")  # fmt: skip
@click.option("--offline", "is_offline", is_flag=True,
              help="Estimate each touch again with the whole recording known, and show it beside the live result.")  # fmt: skip
@click.option("--jobs", default=1, show_default=True, type=click.IntRange(min=1),
              help="Recordings at a time, each in a thread.")  # fmt: skip
@json_option
def replay(
    files: tuple[Named, ...],
    asked: dict[str, Any],
    scene: str | None,
    touch_seconds: float | None,
    samples: int | None,
    settings: dict[str, float],
    calibration: Path | None,
    is_offline: bool,
    jobs: int,
    as_json: bool,
) -> None:  # \b below is click's mark for lines that it must not join
    """Send recordings through the estimator again: one row for each touch.

    Without --scene a recording made by palpate is estimated with the scene and settings of the live measurement and
    gives exactly the same results. Below the table there is a sentence for each flag: what it means, and what to do;
    see help(palpate.Touch.flags). What is wrong with the recording is said on standard error and in the notes of --json.

    If the sidecar says what was touched (`palpate live`), there is a column for it, and --json has `specimen` and `left_out`.

    FILE may be a folder, or a pattern in quotes as "monday/**.csv". With several FILEs the table has a column for the
    file, and --json is a list; a file that fails is an Error: line and an error in the list, and the others go on. Ctrl-C
    prints what is done.

    Exit codes: 4, not a recording, or a damaged one; 5, no touch found, or the recording is not as it was written.

    \b
    Example:
      palpate replay bench.csv --map "hard=C1 (pF),soft=C2 (pF)" --set threshold=6
      palpate replay monday tuesday --jobs 4
    """  # noqa: D301
    if is_offline and calibration:
        raise click.UsageError("--offline and --calibration: allowed one of them; moduli are of the live result")
    how = How(asked, scene, tracking(touch_seconds, samples, settings), is_offline)
    [first, *others] = dict.fromkeys(file for named in files for file in named.files)
    if others or any(named.several for named in files):
        from palpate.cli.replaying import replay_all

        sys.exit(replay_all([first, *others], how, calibration, jobs, as_json=as_json))
    _replay_one(INPUT.convert(first, None, None), how, calibration, as_json=as_json)


def _replay_one(file: Path, how: How, calibration: Path | None, *, as_json: bool) -> None:
    try:
        with Reading("replay", [file]) as progress:
            found = replayed(file, how, progress.begin)
    except (ValueError, TypeError) as error:
        raise click.UsageError(str(error).split("\n")[0]) from error
    for told in filter(None, [found.understood, *found.notes]):
        click.echo(f"{file}: {told}", err=True)
    moduli = Moduli(calibration, found.how["scene"]) if calibration else None
    click.echo(json.dumps(found.document(moduli), indent=2, allow_nan=False) if as_json else found.table(moduli),
               nl=as_json)  # fmt: skip
    if found.fault:
        click.echo(f"{file}: {found.fault}", err=True)
    if not found.reliable:
        sys.exit(NOT_RELIABLE)
