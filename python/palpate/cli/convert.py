"""`palpate convert`: a recording to Parquet, Arrow, or palpate's own CSV."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.cli.exit import NOT_RELIABLE
from palpate.cli.options import INPUT, json_option, reading_options
from palpate.cli.outputs import OUTPUT, force_option, require_free, with_sidecar
from palpate.cli.progress import Reading

if TYPE_CHECKING:
    from palpate.recording.foreign import AnyRecording


@click.command()
@click.argument("file", type=INPUT)
@click.option("-o", "output", required=True, type=OUTPUT,
              help="NAME.parquet, NAME.arrow, or NAME.csv for palpate's own format.")  # fmt: skip
@reading_options
@force_option
@json_option
def convert(
    file: Path,
    output: Path,
    asked: dict[str, Any],
    force: bool,
    as_json: bool,
) -> None:
    """Convert a recording to Parquet, Arrow, or palpate's own CSV.

    FILE is a recording, a table of another logger, or a "Binary Data.txt" of Analog Devices' program for the kit. That
    file has one channel: give the file of the other channel with --soft. Every row is kept; a row without a value is
    marked as lost. A Parquet or Arrow file has the sidecar in its metadata, under the key palpate, and
    can be converted back: the rows are the same, byte for byte. What is wrong with the
    recording is said on standard error, in the notes of --json, and in the sidecar of the output. Exit codes: 4, not a
    recording, a damaged one, or the output exists; 5, converted, but the recording is not as it was written; 6, Parquet
    and Arrow need the extra export.

    \b
    Example:
      palpate convert run.csv -o run.parquet
      palpate convert other.csv --map "hard=C1 (pF),soft=C2 (pF)" -o run.csv
      palpate convert "Binary Data.txt" --soft "Binary Data 2.txt" -o run.csv
    """  # noqa: D301
    from palpate.recording.exchange import export
    from palpate.recording.foreign import recorded

    require_free(with_sidecar(output), filter(None, [file, asked.get("soft")]), force=force)
    try:
        with Reading("convert", [file]) as progress:
            recording = recorded(file, **asked)
            progress.begin(file, recording)
            rows = export.convert(recording, output, force=force)
    except (ValueError, TypeError) as error:
        raise click.UsageError(str(error).split("\n")[0]) from error
    if recording.understood:
        click.echo(f"{file}: {recording.understood}", err=True)
    notes = _notes(recording)
    for note in notes:
        click.echo(f"{file}: {note}", err=True)
    document = {
        "file": str(file),
        "written": str(output),
        "rows": rows,
        "lost": recording.survey.refused,
        "notes": notes,
    }
    click.echo(json.dumps(document, indent=2) if as_json else f"{output}: {rows} rows")
    sys.exit(NOT_RELIABLE if recording.doubts else 0)


def _notes(recording: "AnyRecording") -> list[str]:
    refused = recording.survey.refused
    notes = [note for note in recording.notes if "have no value in a channel" not in note]
    if refused:
        notes.append(f"{refused} of {recording.survey.rows} rows have no usable value: kept, marked as lost")
    if unused := getattr(recording, "unused", None):
        notes.append(f"columns left out: {', '.join(unused)}")
    return notes
