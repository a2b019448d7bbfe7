"""`palpate replay`: sends a recording through the estimator again."""

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate import __version__
from palpate.cli import afterwards
from palpate.cli import touches as cli_touches
from palpate.cli.exit import NOT_RELIABLE
from palpate.cli.moduli import Moduli
from palpate.cli.options import INPUT, json_option, replaying_options, tracking

if TYPE_CHECKING:
    from palpate import OfflineTouch, Touch
    from palpate.recording.foreign import AnyRecording


@click.command()
@click.argument("file", type=INPUT)
@replaying_options
@click.option("--calibration", type=click.Path(exists=True, dir_okay=False, path_type=Path),
              help="Calibration file from `calibrate`: adds the modulus with its interval to each touch.")  # fmt: skip
@click.option("--offline", "is_offline", is_flag=True,
              help="Estimate each touch again with the whole recording known, and show it beside the live result.")  # fmt: skip
@json_option
def replay(
    file: Path,
    asked: dict[str, Any],
    scene: str | None,
    touch_seconds: float | None,
    samples: int | None,
    settings: dict[str, float],
    calibration: Path | None,
    is_offline: bool,
    as_json: bool,
) -> None:  # \b below is click's mark for lines that it must not join
    """Send a recording through the estimator again: one row for each touch.

    Without --scene a recording made by palpate is estimated with the scene and settings of the live measurement and
    gives exactly the same results. Below the table there is a sentence for each flag: what it means, and what to do;
    see help(palpate.Touch.flags). What is wrong with the recording is said on standard error and in the notes of --json.
    Exit codes: 4, not a recording, or a damaged one; 5, no touch found, or the recording is not as it was written.

    \b
    Example:
      palpate replay bench.csv --map "hard=C1 (pF),soft=C2 (pF)" --set threshold=6
    """  # noqa: D301
    from palpate import offline
    from palpate.recording.foreign import recorded
    from palpate.touch import tracked

    if is_offline and calibration:
        raise click.UsageError("--offline and --calibration: allowed one of them; moduli are of the live result")
    try:
        recording = recorded(file, **asked)
        how: dict[str, Any] = {"scene": scene} if scene else {"scene": "handheld"} | recording.settings
        how |= tracking(touch_seconds, samples, settings)
        again = offline(recording, **how) if is_offline else None
        found, retaken = tracked(recording, **how)
    except (ValueError, TypeError) as error:
        raise click.UsageError(str(error).split("\n")[0]) from error
    if recording.understood:
        click.echo(f"{file}: {recording.understood}", err=True)
    notes = [*recording.notes, *cli_touches.notes(retaken)]
    for note in notes:
        click.echo(f"{file}: {note}", err=True)
    moduli = Moduli(calibration, how["scene"]) if calibration else None
    document = _json(file, how, recording, found, notes, moduli, again) if as_json else _table(found, moduli, again)
    click.echo(document, nl=as_json)
    if not found:
        click.echo(f"{file}: no touch found: {_why_not(recording)}", err=True)
    if not found or recording.doubts:
        sys.exit(NOT_RELIABLE)


def _table(found: "list[Touch]", moduli: Moduli | None, again: "list[OfflineTouch] | None") -> str:
    if again is not None:
        return afterwards.table(again)
    table = cli_touches.table(found)
    return (moduli.table(table, found) if moduli and found else table) + cli_touches.advised(found)


def _why_not(recording: "AnyRecording") -> str:
    spans = [f"{name} {high - low:.3g} pF" for name, (low, high) in recording.survey.spans_pF.items()]
    if len(spans) < 2:
        return "a channel has no values"
    return f"no change was above the idle noise for long enough. The channels span {', '.join(spans)}; check --unit"


def _json(
    file: Path,
    how: dict[str, Any],
    recording: "AnyRecording",
    found: "list[Touch]",
    notes: list[str],
    moduli: Moduli | None,
    again: "list[OfflineTouch] | None",
) -> str:
    settings = {name: value for name, value in how.items() if name != "scene"}
    document = {
        "file": str(file),
        "scene": how["scene"],
        "settings": {name: str(value) if value in (math.inf, -math.inf) else value for name, value in settings.items()},
        "palpate": __version__,
        "rows": recording.survey.rows,
        "notes": notes,
        "touches": [cli_touches.record(touch) for touch in found],
    }
    if moduli:
        moduli.add(document, found)
    if again:
        afterwards.add(document, again)
    return json.dumps(document, indent=2, allow_nan=False)
