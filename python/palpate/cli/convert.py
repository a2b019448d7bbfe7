"""`palpate convert`: a recording as Parquet, or as palpate's own."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from palpate.cli.options import json_option, reading_options

if TYPE_CHECKING:
    from palpate.recording.binary_data import BinaryData
    from palpate.recording.foreign import Foreign
    from palpate.recording.own_file import Recorded

_input = click.Path(exists=True, dir_okay=False, path_type=Path)


@click.command()
@click.argument("file", type=_input)
@click.option("-o", "output", required=True, type=click.Path(dir_okay=False, path_type=Path),
              help="NAME.parquet, or NAME.csv for a recording of palpate's own.")  # fmt: skip
@reading_options
@click.option("--soft", type=_input, help="The soft channel's file, where FILE is a Binary Data.txt of the hard one.")
@click.option(
    "--period", type=click.FloatRange(min=0, min_open=True), help="Seconds from row to row: files without times."
)
@click.option("--force", is_flag=True, help="Replace what is there.")
@json_option
def convert(
    file: Path,
    output: Path,
    columns: dict[str, str] | None,
    unit: str | None,
    soft: Path | None,
    period: float | None,
    force: bool,
    as_json: bool,
) -> None:
    """Write a recording as Parquet, or as palpate's own.

    FILE is a recording, another logger's table, or the "Binary Data.txt" of Analog Devices' program for the kit,
    which has one channel: name the other's by --soft. Every row is kept: one without a value is marked lost. A
    Parquet file has the sidecar in its metadata, under the key palpate. Exit codes: 4, not a recording, or the file is
    there already; 6, Parquet needs the extra export.

    \b
    Example:
      palpate convert run.csv -o run.parquet
      palpate convert other.csv --map "hard=C1 (pF),soft=C2 (pF)" -o run.csv
      palpate convert "Binary Data.txt" --soft "Binary Data 2.txt" -o run.csv
    """  # noqa: D301
    from palpate.recording import export

    try:
        recording = _opened(file, columns, unit, soft, period)
        rows = export.convert(recording, output, force=force, period_s=period)
    except (ValueError, TypeError) as error:
        raise click.UsageError(str(error).split("\n")[0]) from error
    notes = _notes(recording, columns)
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


def _opened(
    file: Path, columns: dict[str, str] | None, unit: str | None, soft: Path | None, period: float | None
) -> "Recorded | Foreign | BinaryData":
    from palpate.recording.binary_data import BinaryData, is_binary_data
    from palpate.recording.foreign import recorded
    from palpate.recording.own_file import is_own

    if soft is None and (columns or unit or is_own(file) or not is_binary_data(file)):
        return recorded(file, columns=columns, unit=unit)
    if columns or unit:
        raise ValueError("--soft: got it with --map or --unit, allowed: for files of codes, which need neither")
    return BinaryData(file, soft, period)


def _notes(recording: "Recorded | Foreign | BinaryData", columns: dict[str, str] | None) -> list[str]:
    from palpate.recording import export
    from palpate.recording.filelock import is_locked
    from palpate.recording.foreign import Foreign
    from palpate.recording.own_file import Recorded

    refused = recording.survey.refused
    notes = [note for note in recording.notes if "have no value in a channel" not in note]
    if refused:
        notes.append(f"{refused} of {recording.survey.rows} rows have no usable value: kept, marked as such")
    if isinstance(recording, Foreign) and (unused := export.unused_columns(recording, columns)):
        notes.append(f"columns left out: {', '.join(unused)}")
    if isinstance(recording, Recorded) and is_locked(recording.path):
        notes.append("still being recorded: what there is now was converted")
    return notes
