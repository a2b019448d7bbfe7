"""`palpate calibrate`: fits a calibration to recordings."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from palpate import Touch
from palpate.cli.exit import NOT_RELIABLE
from palpate.cli.inputs import InputFile
from palpate.cli.options import json_option, recording_options, tracking
from palpate.cli.outputs import OUTPUT, force_option, require_free
from palpate.cli.progress import Reading
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
@click.option(
    "--moduli", required=True, type=InputFile(), help="Table with two columns: name of the specimen, modulus in MPa."
)
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
    moduli: Path,
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

    A recording may hold several touches, all on one specimen; the file name begins with the name of the specimen
    (30OO-2.csv belongs to "30 OO"). A touch weighs by its standard error and the scatter from touch to touch. One that is
    only short is used if it has a standard error; with another flag it is left out, and the flag is printed. What is
    wrong with a recording is said on standard error and in the notes of --json. Exit codes: 4, not a recording, a
    damaged one, not a table of moduli, no calibration possible, or an output exists; 5, written, but not reliable (the
    verdict says why, or a recording is not as it was written).

    \b
    Example:
      palpate calibrate specimens/*A.csv specimens/*O.csv --moduli specimens/moduli.csv -o probe.toml --plot probe.png
    """  # noqa: D301
    from palpate.calibration import characterise

    require_free(filter(None, [output, plot, report]), [*files, moduli], force=force)
    for module in ("scipy", "matplotlib") if plot else ("scipy",):
        need(module, "science")  # before the touches are measured
    with Reading("calibrate", files) as progress:
        told = _Told([], [], progress)
        specimens = _specimens(files, moduli, how, accept, told)
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


class _Told(NamedTuple):
    """Notes on the recordings; and those which say that one is not as it was written."""

    notes: list[str]
    doubts: list[str]
    progress: Reading


def _specimens(
    files: Sequence[Path], moduli: Path, how: dict[str, Any], accept: tuple[str, ...], told: _Told
) -> "list[Specimen]":
    from palpate.calibration.characterise import Specimen
    from palpate.calibration.specimen_files import assign, read_moduli

    known = read_moduli(moduli)
    assigned = assign([file for file in files if file.resolve() != moduli.resolve()], known)
    kept, carried = [], set[str]()
    for name in sorted(known, key=lambda name: known[name]):
        found = {file: _touches(file, how, told) for file in assigned[name]}
        specimen = Specimen(name, known[name], [touch for touches in found.values() for touch in touches], accept)
        carried |= {flag for touch in specimen.touches for flag in touch.flags}
        with told.progress.aside():
            if _tell(name, found, accept):
                kept.append(specimen)
    for flag in set(accept) - carried:
        told.progress.echo(
            f"--accept {flag}: no touch has this flag; those found: {' '.join(sorted(carried)) or 'none'}", err=True
        )
    return kept


def _tell(name: str, found: dict[Path, list[Touch]], accept: tuple[str, ...]) -> int:
    """Print which touches are left out, and for which flag; return the number of the others."""
    from palpate.several import objections

    usable, total = 0, sum(map(len, found.values()))
    for file, touches in found.items():
        for number, touch in enumerate(touches, 1):
            against = objections(touch, accept)
            usable += not against
            if against:
                click.echo(f"{name}: touch {number} of {file.name} is left out: {_words(against)}", err=True)
    if not usable:
        why = f"no usable touch among {total}" if total else "no touch found" if found else "no recording"
        click.echo(f"{name}: {why}: the specimen is left out", err=True)
    return usable


def _words(flags: tuple[str, ...]) -> str:
    from palpate.several import FEWEST

    short = f"short, below {FEWEST} samples or without a standard error"
    return ", ".join(short if flag == "short" else flag for flag in flags)


def _touches(file: Path, how: dict[str, Any], told: _Told) -> list[Touch]:
    from palpate import recorded, touches

    try:
        recording = recorded(file, **how["asked"])
        given = tracking(how["touch_seconds"], how["samples"], how["settings"])
        found = touches(recording, scene=how["scene"], **given)
    except (ValueError, TypeError) as error:
        raise click.UsageError(f"{file}: {str(error).splitlines()[0]}") from error
    for note in filter(None, [recording.understood, *recording.notes]):
        told.progress.echo(f"{file}: {note}", err=True)
    told.progress.end(file)
    told.notes.extend(f"{file}: {note}" for note in recording.notes)
    told.doubts.extend(f"{file.name}: {doubt}" for doubt in recording.doubts)
    return found


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


def _document(found: "Calibration", specimens: "list[Specimen]", output: Path, told: _Told) -> str:
    from palpate.calibration.report import specimen_records

    whole = {
        "calibration": str(output),
        **found.as_dict(),
        "sound": found.sound,
        "specimens": specimen_records(specimens),
        "notes": told.notes,
    }
    return json.dumps(whole, indent=2, allow_nan=False)
