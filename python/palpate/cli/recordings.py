"""`palpate check`, `import`, `convert`, `plot` and `report`: commands about whole recordings and tables."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from palpate import Uncertainty, touches
from palpate.cli.exit_codes import ErrorReport, ExitCode, message_line, usage_errors
from palpate.cli.output import (
    format_table,
    is_json,
    json_option,
    print_message,
    print_notes,
    print_result,
    print_text,
    reading_progress,
)
from palpate.cli.paths import OUTPUT, InputFile, force_option, require_free, with_sidecar
from palpate.cli.shared_options import (
    INPUT,
    SourceOptions,
    TrackerOptions,
    reading_options,
    replaying_options,
    simulation_note,
)
from palpate.errors import RecordingError
from palpate.flags import Suspicion, advice_at_end
from palpate.importers.formats import read_table
from palpate.importers.table import ReadOptions, Table
from palpate.messages import listed, shortened
from palpate.recording.convert import convert as convert_recording
from palpate.recording.csv_reader import is_own
from palpate.recording.opened import OpenedRecording
from palpate.recording.reading import of_table, recorded
from palpate.recording.verification import Verification, check_opened
from palpate.tracking import tracked

_SHOWN = 4  # rows of a preview
_TOUCHES = 8  # in one line
_WIDTH = 24  # characters of a cell


@click.command("check")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=INPUT)
@reading_options
@click.option(
    "--repair",
    is_flag=True,
    help="After an unclean stop: remove an incomplete last row, and write the end.",
)
@click.option("--yes", is_flag=True, help="With --repair: remove damaged places, too.")
@json_option
def check_command(files: tuple[Path, ...], reading: SourceOptions, repair: bool, yes: bool) -> None:
    """Check that recordings are complete, without gaps and not saturated.

    --repair never removes a row that can be read. The files before the repair are kept in NAME.csv.unrepaired and
    NAME.json.unrepaired. More than an incomplete last row is removed only with --yes. Exit codes: 4, a file is not a
    recording, not complete, or not as it was written; 5, samples are missing or have no usable value, or the file was
    repaired.

    \b
    Example:
      palpate check monday/*.csv
    """  # noqa: D301
    if yes and not repair:
        raise click.UsageError("--yes: got it without --repair, allowed: both")
    reports: list[Verification] = []
    unreadable: dict[Path, Exception] = {}
    with reading_progress("check", files) as done:
        for file in files:
            try:
                reports.append(_checked(file, repair, yes, reading))
            except RecordingError as error:
                unreadable[file] = error
            except (ValueError, TypeError) as error:  # a table that leaves a question
                if len(files) == 1:
                    raise click.UsageError(f"{file}: {message_line(str(error))}") from error
                unreadable[file] = error
            done(file)
    failed = [
        {"file": str(file), "error": asdict(ErrorReport.of_file(wrong))}
        for file, wrong in unreadable.items()
    ]
    print_result(
        {"recordings": [each.as_dict() for each in reports], "unreadable": failed},
        "\n".join(map(_lines, reports)),
    )
    for file, wrong in unreadable.items():
        print_message(ErrorReport.of_file(wrong).line(file))
    if unreadable or any(report.faults for report in reports):
        sys.exit(ExitCode.BAD_DATA)
    sys.exit(ExitCode.NOT_RELIABLE if any(report.findings for report in reports) else 0)


def _checked(file: Path, repair: bool, yes: bool, reading: SourceOptions) -> Verification:
    recording = recorded(file, **reading.keywords())
    report = check_opened(recording, repair=repair, remove_damage=yes)
    print_notes(file, [simulation_note(recording)])
    if repair and not yes and report.damaged and not report.running:
        print_message(f"{file}: --yes takes out what is damaged, and keeps it in a file")
    return report


def _lines(report: Verification) -> str:
    survey = report.survey
    pace = (
        f", {1 / survey.period_s:.1f} pairs a second"
        if survey.rows > 1 and survey.period_s > 0
        else ""
    )
    size = f"{survey.rows} rows" + (
        f" in {survey.seconds:.1f} s{pace}" if report.timed else ", rate unknown"
    )
    below = [report.understood] * bool(report.understood) + [
        f"fault: {text}" for text in report.faults
    ]
    return "\n  ".join([f"{report.path}: {report.verdict}: {size}", *below, *report.findings])


@click.command("import")
@click.argument("file", type=INPUT)
@reading_options
@json_option
def import_command(file: Path, reading: SourceOptions) -> None:
    """Show how a table of another program is read.

    FILE is a table with two channels: text, Excel, Parquet, Arrow, XDF, also packed as .gz. Prints its first rows, and how
    they are understood. What stays open is an error that lists the options to say it; `replay`, `record`, `live`, `check`,
    `convert` and `calibrate` take the same options. Exit codes: 2, something is open; 4, not a table.

    \b
    Example:
      palpate import other.csv
      palpate import other.csv --map hard=2,soft=3 --unit fF
    """  # noqa: D301
    if is_own(file):
        raise click.UsageError(
            f"{file}: is a recording of palpate, allowed: a table of another program"
        )

    with usage_errors():
        wanted = ReadOptions(**reading.keywords())
        table = read_table(file, wanted)
        if not is_json():  # before it is understood: what is shown helps to say the rest
            size = f"{len(table.columns)} columns, {len(table)} rows"
            print_text(f"{file}: {size}\n{_preview(table)}")
        found = of_table(file, table, wanted)
    measured = touches(found)
    swapped = {
        str(each)
        for advice in advice_at_end(measured)
        for each in advice
        if each.flag is Suspicion.SWAPPED
    }
    notes = [*found.notes, *swapped]
    document = {
        "file": str(file),
        "columns": [column.name for column in table.columns],
        "rows": len(table),
        "understood": found.understood,
        "notes": notes,
        "asked": {
            name: str(value) if name == "soft" else value
            for name, value in reading.keywords().items()
        },
    }
    ratios = [str(Uncertainty.of(touch)) for touch in measured]
    values = f": ratio {listed(ratios, _TOUCHES)}" if ratios else ""
    count = f"{len(ratios)} touch{'es' * (len(ratios) != 1)}"
    print_result(document, "\n".join([found.understood, *notes, count + values]))


def _preview(table: Table) -> str:
    """Return a line for each column: its position, its name, its first cells."""
    cells = [
        [shortened(str(cell), _WIDTH) for cell in column.cells[:_SHOWN]] for column in table.columns
    ]
    names = [[f"{position:5}", column.name] for position, column in enumerate(table.columns, 1)]
    return format_table(
        [[*name, "  ".join(shown)] for name, shown in zip(names, cells, strict=True)], "<"
    )


@click.command("convert")
@click.argument("file", type=INPUT)
@click.option("-o", "output", required=True, type=OUTPUT,
              help="NAME.parquet, NAME.arrow, or NAME.csv for palpate's own format.")  # fmt: skip
@reading_options
@force_option
@json_option
def convert_command(file: Path, output: Path, reading: SourceOptions, force: bool) -> None:
    """Convert a recording to Parquet, Arrow, or palpate's own CSV.

    FILE is a recording, or a table of another logger. Every row is kept; a row without a value is marked as lost. A Parquet or Arrow file has the sidecar in its metadata, under the key palpate, and
    can be converted back: the rows are the same, byte for byte. What is wrong with the
    recording appears on standard error, in the notes of --json, and in the sidecar of the output. Exit codes: 4, not a
    recording, a damaged one, or the output exists; 5, converted, but the recording is not as it was written; 6, Parquet
    and Arrow need the extra tables.

    \b
    Example:
      palpate convert run.csv -o run.parquet
      palpate convert other.csv --map "hard=C1 (pF),soft=C2 (pF)" -o run.csv
    """  # noqa: D301
    require_free(with_sidecar(output), filter(None, [file, reading.soft]), force=force)
    with usage_errors():
        recording = recorded(file, **reading.keywords())
        rows = convert_recording(recording, output, force=force)
    notes, counts = _convert_notes(recording), {"rows": rows, "lost": recording.survey.refused}
    sys.exit(_print_written(file, output, recording, counts, notes))


def _print_written(
    file: Path, output: Path, recording: OpenedRecording, counts: dict[str, int], notes: list[str]
) -> int:
    """Print what was made of a recording, the first of `counts`, or all as JSON; return the exit code."""
    print_notes(file, dict.fromkeys([recording.understood, *notes]))
    what, count = next(iter(counts.items()))
    document = {"file": str(file), "written": str(output), **counts, "notes": notes}
    print_result(document, f"{output}: {count} {what}")
    return ExitCode.NOT_RELIABLE if recording.doubts else 0


def _convert_notes(recording: OpenedRecording) -> list[str]:
    notes = [note for note in recording.notes if "have no value in a channel" not in note]
    if refused := recording.survey.refused:
        notes.append(
            f"{refused} of {recording.survey.rows} rows have no usable value: kept, marked as lost"
        )
    if recording.unused:
        notes.append(f"columns left out: {', '.join(recording.unused)}")
    return notes


@click.command("plot")
@click.argument("file", type=INPUT)
@click.option("-o", "output", required=True, type=OUTPUT, help="NAME.png, NAME.pdf or NAME.svg.")
@replaying_options
@force_option
@json_option
def plot_command(
    file: Path, output: Path, reading: SourceOptions, tracker: TrackerOptions, force: bool
) -> None:
    """Draw a recording, with the ratio of each touch.

    Above are the changes of both channels over time, below is the ratio of each touch at its begin. The touches
    are those of `palpate replay` with the same options. What is wrong with the recording appears on standard error and in
    the notes of --json. Exit codes: 4, not a recording, a damaged one, or the output exists; 5, drawn, but the recording
    is not as it was written; 6, matplotlib is missing.

    \b
    Example:
      palpate plot run.csv -o run.png
    """  # noqa: D301
    from palpate.display import plots

    with usage_errors():
        require_free([output], [file], force=force)
        plots.require_figure_name(output)
        recording = recorded(file, **reading.keywords())
        found = tracked(recording, **tracker.for_recording(recording))
        plots.save_figure(recording.in_memory(), found.touches, output)
    notes = [note for note in [recording.understood, *found.touches.notes] if note]
    sys.exit(_print_written(file, output, recording, {"touches": len(found.touches)}, notes))


@click.command("report")
@click.argument("recordings", metavar="FILE...", nargs=-1, required=True, type=InputFile())
@click.option(
    "--calibration", type=InputFile(), help="Calibration file from `calibrate`: adds the moduli."
)
@click.option("--moduli", type=InputFile(),
              help="Table of name and known modulus in MPa, for recordings whose session names no specimens.")  # fmt: skip
@click.option(
    "-o", "output", type=OUTPUT, help="The report to write, HTML.  [default: NAME-report.html]"
)
@click.option("--title", default="", help="Title of the report.  [default: the session's title]")
@click.option("--operator", default="", help="Who measured.  [default: from the session]")
@click.option("--probe", default="", help="Which probe, for the head of the report.")
@click.option("--site", default="", help="Where it was measured, for the head of the report.")
@click.option(
    "--unit",
    type=click.Choice(["MPa", "kPa"]),
    default="MPa",
    show_default=True,
    help="Unit of the moduli.",
)
@click.option("--shore", is_flag=True, help="Shore A beside the moduli, by Gent's relation.")
@click.option(
    "--note", "notes", multiple=True, help="A note for the head of the report; may be repeated."
)
@force_option
@json_option
def report_command(
    recordings: tuple[Path, ...],
    calibration: Path | None,
    moduli: Path | None,
    output: Path | None,
    notes: tuple[str, ...],
    force: bool,
    **head: Any,
) -> None:
    """Write a report of recordings as one HTML file, which prints on A4.

    It has every touch with its flags, also those left out, the result of each specimen, the repeatability, the
    calibration with its data, what the uncertainty consists of, what `check` says of each recording, all settings,
    checksums, and the commands that do it again. The specimens are those of the session in the sidecar. Without one
    the file name begins with the name of the specimen, as for `calibrate`. The same files give the same report.

    Exit codes: 4, not a recording or a damaged one, not a calibration, or the report exists; 5, written, but not reliable:
    no touch found, a recording is not as it was written, or the calibration is not sound.

    \b
    Example:
      palpate report gel/gel.csv --calibration probe.toml -o gel.html --operator "A. Bee"
    """  # noqa: D301
    from palpate.report import write_report

    path = output or recordings[0].with_name(f"{recordings[0].stem}-report.html")
    require_free([path], [*recordings, *filter(None, (calibration, moduli))], force=force)
    try:
        made = write_report(path, recordings, calibration, moduli=moduli, notes=notes, **head)
    except (ValueError, TypeError) as error:
        said = str(error).splitlines()[0]
        convert = ": use palpate convert, and report what it writes" if "--map" in said else ""
        raise click.UsageError(f"{said}{convert}") from error
    print_notes(f"{path}: results may be wrong", made.doubts)
    document = {"report": str(path), "doubts": made.doubts, **made.results}
    print_result(document, f"{path}\n{made.verdict}")
    sys.exit(ExitCode.NOT_RELIABLE if made.doubts else 0)
