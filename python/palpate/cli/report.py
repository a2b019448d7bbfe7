"""`palpate report`: a report of recordings as one HTML file."""

import json
import sys
from pathlib import Path

import click

from palpate.cli.exit import NOT_RELIABLE
from palpate.cli.inputs import InputFile
from palpate.cli.options import json_option
from palpate.cli.outputs import OUTPUT, force_option, require_free


@click.command()
@click.argument("recordings", metavar="RECORDING...", nargs=-1, required=True, type=InputFile())
@click.option("--calibration", type=InputFile(), help="Calibration file from `calibrate`: adds the moduli.")
@click.option("--moduli", type=InputFile(),
              help="Table of name and known modulus in MPa, for recordings whose session names no specimens.")  # fmt: skip
@click.option("-o", "output", type=OUTPUT, help="The report to write, HTML.  [default: NAME-report.html]")
@click.option("--title", default="", help="Title of the report.  [default: that of the session]")
@click.option("--operator", default="", help="Who measured.  [default: from the session]")
@click.option("--note", "notes", multiple=True, help="A note for the head of the report; may be repeated.")
@force_option
@json_option
def report(
    recordings: tuple[Path, ...],
    calibration: Path | None,
    moduli: Path | None,
    output: Path | None,
    title: str,
    operator: str,
    notes: tuple[str, ...],
    force: bool,
    as_json: bool,
) -> None:
    """Write a report of recordings as one HTML file, which prints on A4.

    It has every touch with its plot and flags, also those left out, the result of each specimen, the repeatability, the
    calibration with its data, what the uncertainty consists of, what `check` says of each recording, all settings,
    checksums, and the commands that do it again. The specimens are those of the session in the sidecar. Without one
    the file name begins with the name of the specimen, as for `calibrate`. The same files give the same report.

    Exit codes: 4, not a recording or a damaged one, not a calibration, or the report exists; 5, written, but not reliable:
    no touch found, a recording is not as it was written, or the calibration is not sound.

    \b
    Example:
      palpate report gel/gel.csv --calibration probe.toml -o gel.html --operator "A. Bee"
    """  # noqa: D301
    from palpate.report import write

    path = output or recordings[0].with_name(f"{recordings[0].stem}-report.html")
    inputs = [*recordings, *(file for file in (calibration, moduli) if file)]
    require_free([path], inputs, force=force)
    try:
        made = write(path, recordings, calibration, moduli=moduli, title=title, operator=operator, notes=notes)
    except (ValueError, TypeError) as error:
        said = str(error).splitlines()[0]
        convert = ": use palpate convert, and report what it writes" if "--map" in said else ""
        raise click.UsageError(f"{said}{convert}") from error
    for doubt in made.doubts:
        click.echo(f"{path}: results may be wrong: {doubt}", err=True)
    if as_json:
        document = {"report": str(path), "doubts": made.doubts, **made.results}
        click.echo(json.dumps(document, indent=2, allow_nan=False))
    else:
        click.echo(f"{path}\n{made.verdict}")
    sys.exit(NOT_RELIABLE if made.doubts else 0)
