"""`palpate plot`: a figure of a recording and of its touches."""

import json
import sys
from pathlib import Path
from typing import Any

import click

from palpate.cli import touches as cli_touches
from palpate.cli.exit import NOT_RELIABLE
from palpate.cli.options import INPUT, json_option, replaying_options, tracking
from palpate.cli.outputs import OUTPUT, force_option, require_free


@click.command()
@click.argument("file", type=INPUT)
@click.option("-o", "output", required=True, type=OUTPUT,
              help="NAME.png, NAME.pdf or NAME.svg.")  # fmt: skip
@replaying_options
@force_option
@json_option
def plot(
    file: Path,
    output: Path,
    asked: dict[str, Any],
    scene: str | None,
    touch_seconds: float | None,
    samples: int | None,
    settings: dict[str, float],
    force: bool,
    as_json: bool,
) -> None:
    """Draw a recording, with the ratio of each touch.

    Above are the changes of both channels over time, below is the ratio of each touch at its begin. The touches
    are those of `palpate replay` with the same options. What is wrong with the recording is said on standard error and in
    the notes of --json. Exit codes: 4, not a recording, a damaged one, or the output exists; 5, drawn, but the recording
    is not as it was written; 6, matplotlib is missing.

    \b
    Example:
      palpate plot run.csv -o run.png
    """  # noqa: D301
    from palpate.display import plots
    from palpate.recording.foreign import recorded
    from palpate.recording.reading import in_memory
    from palpate.touch import tracked

    try:
        require_free([output], [file], force=force)
        plots.check(output)
        recording = recorded(file, whole=True, **asked)
        how: dict[str, Any] = {"scene": scene} if scene else {"scene": "handheld"} | recording.settings
        found, retaken, _ = tracked(recording, **how | tracking(touch_seconds, samples, settings))
        plots.save(in_memory(recording), found, output)
    except (ValueError, TypeError) as error:
        raise click.UsageError(str(error).split("\n")[0]) from error
    said = [recording.understood, *recording.notes, *cli_touches.notes(retaken)]
    notes = [note for note in said if note]
    for note in notes:
        click.echo(f"{file}: {note}", err=True)
    document = {"file": str(file), "written": str(output), "touches": len(found), "notes": notes}
    click.echo(json.dumps(document, indent=2) if as_json else f"{output}: {len(found)} touches")
    sys.exit(NOT_RELIABLE if recording.doubts else 0)
