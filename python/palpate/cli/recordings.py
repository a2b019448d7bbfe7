"""`palpate check`, `import`, `convert` and `report`: commands for whole recordings."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import chain
from pathlib import Path
from typing import Any, NoReturn

import click

from palpate import Uncertainty, touches
from palpate.cli.accept_option import accept_option
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
from palpate.cli.paths import (
    OUTPUT,
    InputFile,
    Recordings,
    all_files,
    force_option,
    require_free,
    with_sidecar,
)
from palpate.cli.shared_options import (
    INPUT,
    SourceOptions,
    reading_options,
    simulation_note,
    soft_later_option,
)
from palpate.display.text import counted
from palpate.errors import RecordingError
from palpate.flags import Suspicion, advice_at_end
from palpate.importers.table import ReadOptions, Table
from palpate.messages import listed, shortened
from palpate.recording.convert import convert as convert_recording
from palpate.recording.csv_reader import is_own
from palpate.recording.open_table import open_table
from palpate.recording.opened import OpenedRecording
from palpate.recording.reading import of_table, recorded, with_soft_later
from palpate.recording.verification import Verification, check_opened

_PREVIEW_ROWS = 4
_PREVIEW_WIDTH = 24  # characters of a cell
_MOST_RATIOS = 8  # in one line


@click.command("check")
@click.argument(
    "files", metavar="FILE...", nargs=-1, required=True, type=Recordings(), callback=all_files
)
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

    FILE may be a folder, or a pattern in quotes as "monday/**.csv".

    --repair never removes a row that can be read. The files before the repair are kept in
    NAME.csv.unrepaired and NAME.json.unrepaired. More than an incomplete last row is removed only
    with --yes. Exit codes: 4, a file is not a recording, not complete, or not as it was written; 5,
    samples are missing or have no usable value, or the file was repaired.

    \b
    Example:
      palpate check monday/*.csv
    """  # noqa: D301
    if yes and not repair:
        raise click.UsageError("--yes: got it without --repair, allowed: both")
    verifications: list[Verification] = []
    errors: dict[Path, ErrorReport] = {}
    notes: list[tuple[Path, str]] = []  # printed below the progress bar, not into it
    with reading_progress("check", files) as update:
        for file in files:
            try:
                recording = recorded(file, **reading.keywords())
                report = check_opened(recording, repair=repair, remove_damage=yes)
                verifications.append(report)
                notes.append((file, simulation_note(recording)))
                if repair and not yes and report.damaged and not report.running:
                    notes.append((file, "--yes takes out what is damaged, and keeps it in a file"))
            except RecordingError as error:
                errors[file] = ErrorReport.of_file(error)
            except (ValueError, TypeError) as error:  # a table that leaves a question
                if len(files) == 1:
                    raise click.UsageError(f"{file}: {message_line(str(error))}") from error
                errors[file] = ErrorReport.of_file(error)
            update(file)
    for file, note in notes:
        print_notes(file, [note])
    _print_verifications(verifications, errors)
    if errors or any(each.faults for each in verifications):
        sys.exit(ExitCode.BAD_DATA)
    if any(each.findings for each in verifications):
        sys.exit(ExitCode.NOT_RELIABLE)


def _print_verifications(
    verifications: Sequence[Verification], errors: Mapping[Path, ErrorReport]
) -> None:
    """Print the verdicts, then the errors."""
    unreadable = []
    for file, report in errors.items():
        unreadable.append({"file": str(file), "error": asdict(report)})
    document = {
        "recordings": [each.as_dict() for each in verifications],
        "unreadable": unreadable,
    }
    print_result(document, "\n".join(map(_verification_text, verifications)))
    for file, report in errors.items():
        print_message(report.line(file))


def _verification_text(report: Verification) -> str:
    """Return the verdict on a recording, its size, and what was found."""
    survey = report.survey
    size = f"{survey.rows} rows"
    if not report.timed:
        size += ", rate unknown"
    else:
        size += f" in {survey.seconds:.1f} s"
        if survey.rows > 1 and survey.period_s > 0:
            size += f", {1 / survey.period_s:.1f} pairs a second"
    lines = [f"{report.path}: {report.verdict}: {size}"]
    if report.understood:
        lines.append(report.understood)
    lines += [f"fault: {text}" for text in report.faults]
    lines += report.findings
    return "\n  ".join(lines)


@click.command("import")
@click.argument("file", type=INPUT)
@reading_options
@soft_later_option
@json_option
def import_command(file: Path, reading: SourceOptions, soft_later_ms: float | None) -> None:
    """Show how a table of another program is read.

    FILE is a table with two channels: text, Excel, Parquet, Arrow, XDF, also packed as .gz. Prints
    its first rows, and how they are understood. What stays open is an error that lists the options
    to say it; `replay`, `record`, `live`, `check`, `convert` and `calibrate` take the same options.
    Exit codes: 2, something is open; 4, not a table.

    \b
    Example:
      palpate import other.csv
      palpate import other.csv --map hard=2,soft=3 --unit fF
    """  # noqa: D301
    if is_own(file):
        allowed = "a table of another program"
        raise click.UsageError(f"{file}: is a recording of palpate, allowed: {allowed}")
    with usage_errors():
        options = ReadOptions(**reading.keywords())
        table = open_table(file, options)
        if not is_json():  # before it is understood: the columns help to set the options
            size = f"{len(table.columns)} columns, {len(table)} rows"
            print_text(f"{file}: {size}\n{_preview(table)}")
        recording = with_soft_later(of_table(file, table, options), soft_later_ms)
        measured = touches(recording)
    notes = list(recording.notes)
    for advice in chain.from_iterable(advice_at_end(measured)):
        if advice.flag is Suspicion.SWAPPED and str(advice) not in notes:
            notes.append(str(advice))
    set_options = reading.keywords()
    if reading.soft:
        set_options["soft"] = str(reading.soft)
    document = {
        "file": str(file),
        "columns": [column.name for column in table.columns],
        "rows": len(table),
        "understood": recording.understood,
        "notes": notes,
        "asked": set_options,
    }
    result = counted(len(measured), "touch")
    if measured:
        ratios = list(map(str, map(Uncertainty.of, measured)))
        result += f": ratio {listed(ratios, _MOST_RATIOS)}"
    print_result(document, "\n".join([recording.understood, *notes, result]))


def _preview(table: Table) -> str:
    """Return a line for each column: its position, its name, its first cells."""
    rows = []
    for position, column in enumerate(table.columns, 1):
        cells = [shortened(str(cell), _PREVIEW_WIDTH) for cell in column.cells[:_PREVIEW_ROWS]]
        rows.append([f"{position:5}", column.name, "  ".join(cells)])
    return format_table(rows, "<")


@click.command("convert")
@click.argument("file", type=INPUT)
@click.option(
    "-o",
    "output",
    required=True,
    type=OUTPUT,
    help="NAME.parquet, NAME.arrow, or NAME.csv for palpate's own format.",
)
@reading_options
@soft_later_option
@force_option
@json_option
def convert_command(
    file: Path, output: Path, reading: SourceOptions, soft_later_ms: float | None, force: bool
) -> None:
    """Convert a recording to Parquet, Arrow, or palpate's own CSV.

    FILE is a recording, or a table of another logger. Every row is kept; a row without a value is
    marked as lost. A Parquet or Arrow file has the sidecar in its metadata, under the key palpate,
    and can be converted back: the rows are the same, byte for byte. What is wrong with the
    recording appears on standard error, in the notes of --json, and in the sidecar of the output.
    Exit codes: 4, not a recording, a damaged one, or the output exists; 5, converted, but the
    recording is not as it was written; 6, Parquet and Arrow need the extra tables.

    \b
    Example:
      palpate convert run.csv -o run.parquet
      palpate convert other.csv --map "hard=C1 (pF),soft=C2 (pF)" -o run.csv
    """  # noqa: D301
    inputs = filter(None, (file, reading.soft))
    require_free(with_sidecar(output), inputs, force=force)
    with usage_errors():
        recording = with_soft_later(recorded(file, **reading.keywords()), soft_later_ms)
        rows = convert_recording(recording, output, force=force)
    notes = _conversion_notes(recording)
    document: dict[str, object] = {
        "file": str(file),
        "written": str(output),
        "rows": rows,
        "lost": recording.survey.refused,
        "notes": notes,
    }
    shown = [recording.understood, *notes]
    finish(recording.doubts, document, shown, f"{output}: {rows} rows")


def _conversion_notes(recording: OpenedRecording) -> list[str]:
    notes = [note for note in recording.notes if "have no value in a channel" not in note]
    refused = recording.survey.refused
    if refused:
        rows = recording.survey.rows
        notes.append(f"{refused} of {rows} rows have no usable value: kept, marked as lost")
    if recording.unused:
        notes.append(f"columns left out: {', '.join(recording.unused)}")
    return notes


def finish(
    doubts: Sequence[str], document: dict[str, object], notes: list[str], text: str
) -> NoReturn:
    """Print result and notes, and exit: NOT_RELIABLE if a recording is not as it was written."""
    print_notes(document["file"], dict.fromkeys(notes))
    print_result(document, text)
    sys.exit(ExitCode.NOT_RELIABLE if doubts else ExitCode.DONE)


@click.command("report")
@click.argument("recordings", metavar="FILE...", nargs=-1, required=True, type=InputFile())
@click.option(
    "--calibration", type=InputFile(), help="Calibration file from `calibrate`: adds the moduli."
)
@accept_option
@click.option(
    "--moduli",
    type=InputFile(),
    help="Table of name and known modulus in MPa, for recordings whose session names no specimens.",
)
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
    recordings: tuple[Path, ...], output: Path | None, force: bool, **options: Any
) -> None:
    """Write a report of recordings as one HTML file, which prints on A4.

    It has every touch with its flags, also those left out, the result of each specimen, the
    repeatability, the calibration with its data, what the uncertainty consists of, what `check`
    says of each recording, all settings, checksums, and the commands that do it again. The
    specimens are those of the session in the sidecar. Without one the file name begins with the
    name of the specimen, as for `calibrate`. The same files give the same report.

    Exit codes: 2, the calibration is of another chip, or simulated; 4, not a recording or a damaged
    one, not a calibration, or the report exists; 5, written, but not reliable: no touch found, a
    recording is not as it was written, or the calibration is not sound.

    \b
    Example:
      palpate report gel/gel.csv --calibration probe.toml -o gel.html --operator "A. Bee"
    """  # noqa: D301
    from palpate.report import ReportOptions, write_report

    path = output or recordings[0].with_name(f"{recordings[0].stem}-report.html")
    report_options = ReportOptions(**options)
    tables = [file.path for file in report_options.files()]
    require_free([path], [*recordings, *tables], force=force)
    try:
        written = write_report(path, recordings, report_options)
    except (ValueError, TypeError) as error:
        message = str(error).splitlines()[0]
        if "--map" in message:
            message += ": use palpate convert, and report what it writes"
        raise click.UsageError(message) from error
    print_notes(path, written.remarks)
    print_notes(f"{path}: results may be wrong", written.doubts)
    document = {"report": str(path), "doubts": written.doubts, **written.results}
    print_result(document, f"{path}\n{written.verdict}")
    if written.doubts:
        sys.exit(ExitCode.NOT_RELIABLE)
