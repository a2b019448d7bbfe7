"""`palpate calibrate`: fits a calibration to recordings."""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate.cli.exit import NOT_RELIABLE
from palpate.cli.inputs import InputFile
from palpate.cli.options import json_option, recording_options
from palpate.cli.outputs import OUTPUT, force_option, require_free
from palpate.cli.progress import Reading
from palpate.cli.specimens import Told, specimens_of
from palpate.cli.words import OneOf
from palpate.errors import shortened
from palpate.extras import need
from palpate.files import replacing
from palpate.sentences import FLAGS

if TYPE_CHECKING:
    from palpate import Calibration
    from palpate.calibration.characterise import Specimen


@click.command()
@click.argument("files", nargs=-1, required=True, type=InputFile())
@click.option("--moduli", type=InputFile(), help="Table with two columns: name of the specimen, modulus in MPa. Default: "
              "those of the sidecars.")  # fmt: skip
@click.option("-o", "output", required=True, type=OUTPUT, help="The calibration file to write, TOML.")
@click.option("--plot", type=OUTPUT, help="The plot to write: .png, .pdf or .svg.")
@click.option("--report", type=OUTPUT, help="The report to write, HTML: table, fit and plot.")
@click.option("--by", default="all", show_default=True, help="Values to fit: all touches, or for each "
              "specimen one of mean, level, weighted, agreement, standard_error, covariance.")  # fmt: skip
@click.option(
    "--free-soft-ratio",
    is_flag=True,
    help="Fit the ratio on an infinitely soft object, too: for channels with different gains.",
)
@click.option("--accept", multiple=True, metavar="FLAG", type=OneOf(FLAGS),
              help="Use touches with this flag all the same; may be repeated. The file says so.")  # fmt: skip
@force_option
@recording_options
@json_option
def calibrate(
    files: tuple[Path, ...],
    moduli: Path | None,
    output: Path,
    plot: Path | None,
    report: Path | None,
    by: str,
    free_soft_ratio: bool,
    accept: tuple[str, ...],
    force: bool,
    as_json: bool,
    **how: Any,
) -> None:
    """Fit a calibration to recordings of touches on known objects.

    A recording may hold several touches. If its sidecar says which touch was on which specimen (`palpate live`), that and
    its moduli are used, those of --moduli before them, and touches that were discarded are left out. Else all of its
    touches are on one specimen, and the file name begins with its name (30OO-2.csv belongs to "30 OO"). A touch weighs by its standard error and the scatter from touch to touch. One that is
    only short is used if it has a standard error; with another flag it is left out, and the flag is printed. What is
    wrong with a recording is said on standard error and in the notes of --json. Exit codes: 4, not a recording, a
    damaged one, not a table of moduli, no calibration possible, or an output exists; 5, written, but not reliable (the
    verdict says why, or a recording is not as it was written).

    \b
    Example:
      palpate calibrate specimens/*A.csv specimens/*O.csv --moduli specimens/moduli.csv -o probe.toml --plot probe.png
      palpate calibrate palpate-2026-11-22-1.csv -o probe.toml
    """  # noqa: D301
    from palpate.calibration import characterise

    require_free(filter(None, [output, plot, report]), [*files, *filter(None, [moduli])], force=force)
    for module in ("scipy", "matplotlib") if plot else ("scipy",):
        need(module, "science")  # before the touches are measured
    with Reading("calibrate", files) as progress:
        told = Told([], [], progress)
        specimens = specimens_of(files, moduli, how, accept, told)
    try:
        about = {"scene": how["scene"]} | ({"accepted flags": " ".join(accept)} if accept else {})
        about |= {"doubts": shortened("; ".join(told.doubts), 1000)} if told.doubts else {}
        soft = None if free_soft_ratio else 1.0
        found = characterise.calibrate(specimens, by=by, soft_ratio=soft, about=about)
        _draw(found, specimens, plot, report)
        found.save(output)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    click.echo(_document(found, specimens, output, told) if as_json else _table(found, specimens))
    sys.exit(0 if found.sound and not told.doubts else NOT_RELIABLE)


def _draw(found: "Calibration", specimens: "list[Specimen]", plot: Path | None, report: Path | None) -> None:
    if plot:
        from palpate.calibration.plot import save

        save(found, plot)
    if report:
        from palpate.calibration.report import html

        with replacing(report) as file:
            file.write(html(found, specimens).encode())


def _table(found: "Calibration", specimens: "list[Specimen]") -> str:
    from palpate.calibration.report import parameter_rows, specimen_rows

    rows = specimen_rows(specimens)
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    parameters = [f"{name:15} {value:>12}   {interval}" for name, value, interval in parameter_rows(found)]
    return "\n".join([*(line.rstrip() for line in lines), "", *parameters, "", found.verdict])


def _document(found: "Calibration", specimens: "list[Specimen]", output: Path, told: Told) -> str:
    from palpate.calibration.report import specimen_records

    whole = {
        "calibration": str(output),
        **found.as_dict(),
        "sound": found.sound,
        "specimens": specimen_records(specimens),
        "notes": told.notes,
    }
    return json.dumps(whole, indent=2, allow_nan=False)
