"""`palpate check`: checks whether recordings are complete."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from palpate import RecordingError
from palpate.cli.exit import BAD_DATA, NOT_RELIABLE
from palpate.cli.options import INPUT, json_option, reading_options
from palpate.cli.progress import Reading

if TYPE_CHECKING:
    from palpate.recording.verification import Verification


@click.command()
@click.argument("files", nargs=-1, required=True, type=INPUT)
@reading_options
@click.option("--repair", is_flag=True, help="After an unclean stop: remove an incomplete last row, and write the end.")
@click.option("--yes", is_flag=True, help="With --repair: remove damaged places, too, without a question.")
@json_option
def check(
    files: tuple[Path, ...],
    asked: dict[str, Any],
    repair: bool,
    yes: bool,
    as_json: bool,
) -> None:
    """Check that recordings are complete, without gaps and not saturated.

    --repair never removes a row that can be read. What it removes is kept in NAME.torn, the files before it in
    NAME.csv.unrepaired and NAME.json.unrepaired. More than an incomplete last row is removed only after a question, or
    with --yes. Exit codes: 4, a file is not a recording, not complete, or not as it was written; 5, samples are missing
    or have no usable value, or the file was repaired or rescued.

    \b
    Example:
      palpate check monday/*.csv
    """  # noqa: D301
    if yes and not repair:
        raise click.UsageError("--yes: got it without --repair, allowed: both")
    reports: list[Verification] = []
    unreadable: list[RecordingError] = []
    with Reading("check", files) as progress:
        for file in files:
            try:
                reports.append(_checked(file, repair, yes, asked, progress))
            except ValueError as error:
                raise click.UsageError(f"{file}: {error}") from error
            except RecordingError as error:
                unreadable.append(error)
            progress.end(file)
    click.echo(_json(reports, unreadable) if as_json else "\n".join(map(_lines, reports)), nl=as_json or bool(reports))
    for wrong in unreadable:
        click.echo(f"Error: {wrong}", err=True)
    sys.exit(_code(reports, unreadable))


def _checked(file: Path, repair: bool, yes: bool, table: dict[str, Any], progress: Reading) -> "Verification":
    from palpate.recording.foreign import recorded
    from palpate.recording.verification import check as look
    from palpate.recording.verification import verified

    recording = recorded(file, **table)
    progress.begin(file, recording)
    report = verified(recording, repair=repair, remove_damage=yes)
    if not repair or yes or not report.damaged or report.running:
        return report
    if not _is_terminal():
        *faults, refused = report.faults
        return replace(report, faults=(*faults, f"{refused}; --yes confirms it"))
    size, places = sum(place.bytes for place in report.damaged), len(report.damaged)
    where = "1 place" if places == 1 else f"{places} places"
    question = f"{file}: {size:,} bytes in {where} are no rows. Remove them, and keep them in a file?"
    with progress.aside():
        confirmed = click.confirm(question, err=True)
    return look(file, repair=True, remove_damage=True) if confirmed else report


def _is_terminal() -> bool:
    return sys.stdin.isatty()


def _code(reports: "list[Verification]", unreadable: list[RecordingError]) -> int:
    if unreadable or any(report.faults for report in reports):
        return BAD_DATA
    return NOT_RELIABLE if any(report.findings for report in reports) else 0


def _json(reports: "list[Verification]", unreadable: list[RecordingError]) -> str:
    plain = [report.as_dict() for report in reports]
    return json.dumps({"recordings": plain, "unreadable": [str(error) for error in unreadable]}, indent=2)


def _lines(report: "Verification") -> str:
    survey = report.survey
    pace = "" if survey.rows < 2 or not survey.period_s > 0 else f", {1 / survey.period_s:.1f} pairs a second"
    size = (
        f"{survey.rows} rows in {survey.seconds:.1f} s{pace}" if report.timed else f"{survey.rows} rows, rate unknown"
    )
    lines = [f"{report.path}: {report.verdict}: {size}"]
    lines += [f"  {report.understood}"] if report.understood else []
    return "\n".join(
        [*lines, *(f"  fault: {text}" for text in report.faults), *(f"  {text}" for text in report.findings)]
    )
