"""`palpate replay`: sends recordings through the estimator again, and prints one row for each touch."""

import math
import sys
from dataclasses import asdict, dataclass, field
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import palpate
from palpate.ad7746.registers import linearity_pF
from palpate.batch import in_order
from palpate.calibration.validity import doubts_of_calibration
from palpate.cli import touch_table
from palpate.cli.exit_codes import ErrorReport, ExitCode, usage_errors
from palpate.cli.output import (
    json_option,
    print_message,
    print_notes,
    print_result,
    reading_progress,
)
from palpate.cli.paths import FileArgument, InputFile, Recordings
from palpate.cli.shared_options import (
    INPUT,
    SourceOptions,
    TrackerOptions,
    replaying_options,
    simulation_note,
)
from palpate.recording.opened import OpenedRecording
from palpate.recording.reading import recorded
from palpate.recording.session import Entry
from palpate.repeatability import objections, session_scatter
from palpate.tracking import baseline_takes, tracked
from palpate.uncertainty import RATIOS, Uncertainty

if TYPE_CHECKING:  # they are imported when they are used
    from palpate import Calibration
    from palpate.offline_touches import OfflineTouch

_Windows = list[tuple[float, float]] | None
_WORST = (ExitCode.UNEXPECTED, ExitCode.MISSING_EXTRA, ExitCode.BAD_DATA, ExitCode.NOT_RELIABLE, 0)
"""Exit codes of several recordings: the first code here that one of them has is returned."""


def _windows(_: click.Context, __: click.Parameter, given: tuple[str, ...]) -> _Windows:
    """Return begin and end of each window, s; None: none was given."""
    try:
        return [
            (float(begin), float(end)) for begin, end in (text.split(":") for text in given)
        ] or None
    except ValueError:
        raise click.BadParameter(
            f"got {' '.join(given)!r:.60}, allowed: BEGIN:END, two times, s, as 2.0:8.5"
        ) from None


@click.command("replay")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=Recordings())
@replaying_options
@click.option("--calibration", type=InputFile(),
              help="Calibration file from `calibrate`: adds the modulus with its interval to each touch.")  # fmt: skip
@click.option("--offline", "is_offline", is_flag=True,
              help="Estimate each touch again with the whole recording known, and show it beside the live result.")  # fmt: skip
@click.option(
    "--window",
    "windows",
    multiple=True,
    callback=_windows,
    metavar="BEGIN:END",
    help="Estimate the samples between two times, s, as a touch, as 2.0:8.5; may be repeated.",
)
@click.option("--jobs", default=1, show_default=True, type=click.IntRange(min=1),
              help="Recordings at a time, each in a thread.")  # fmt: skip
@json_option
def replay_command(
    files: tuple[FileArgument, ...],
    reading: SourceOptions,
    tracker: TrackerOptions,
    calibration: Path | None,
    is_offline: bool,
    windows: _Windows,
    jobs: int,
) -> None:  # \b below is click's mark for lines that it must not join
    """Send recordings through the estimator again: one row for each touch.

    Without --scene a recording made by palpate is estimated with the scene and settings of the live measurement and
    gives exactly the same results. Below the table there is a sentence for each flag: what it means, and what to do;
    see help(palpate.flags.Flag). What is wrong with the recording appears on standard error and in the notes of --json.

    If the sidecar says what was touched (`palpate live`), there is a column for it, and --json has `specimen` and `left_out`.

    FILE may be a folder, or a pattern in quotes as "monday/**.csv". With several FILEs the table has a column for the
    file, and --json is a list; a file that fails is an Error: line and an error in the list, and the others go on. Ctrl-C
    prints what is done.

    Exit codes: 4, not a recording, or a damaged one; 5, no touch found, the recording is not as it was written, or the
    calibration is not reliable.

    \b
    Example:
      palpate replay bench.csv --map "hard=C1 (pF),soft=C2 (pF)" --set threshold=6
      palpate replay monday tuesday --jobs 4
    """  # noqa: D301
    if is_offline and calibration:
        raise click.UsageError(
            "--offline and --calibration: allowed one of them; moduli are of the live result"
        )
    if is_offline and windows:
        raise click.UsageError("--offline and --window: allowed one of them")
    made = palpate.Calibration.load(calibration) if calibration else None
    one = partial(
        replayed,
        reading=reading,
        tracker=tracker,
        offline=is_offline,
        calibration=made,
        windows=windows,
    )
    [first, *others] = dict.fromkeys(file for named in files for file in named.files)
    if others or any(named.is_pattern for named in files):
        if reading.soft:
            raise click.UsageError(
                f"--soft: got it with {len(others) + 1} recordings, allowed: with one FILE"
            )
        if windows:
            raise click.UsageError(
                f"--window: got it with {len(others) + 1} recordings, allowed: with one FILE"
            )
        sys.exit(_replay_all([first, *others], one, jobs))
    with usage_errors():
        found = one(INPUT.convert(first, None, None))
    print_result(found.document, "\n".join([*found.table, *found.below]))
    print_notes(first, [found.understood, *found.notes])
    sys.exit(0 if found.reliable else ExitCode.NOT_RELIABLE)


@dataclass
class Replayed:
    """What is printed of one recording: a JSON document, or a table with sentences below it; and notes."""

    document: dict[str, Any]
    table: list[str]
    understood: str
    notes: list[str]
    reliable: bool
    below: list[str] = field(default_factory=list)

    def add_specimens(self, entries: list[Entry | None]) -> None:
        """Add what the sidecar says of each touch."""
        self.table = touch_table.beside(
            self.table, ["specimen", *map(touch_table.specimen_of, entries)]
        )
        for record, entry in zip(self.document["touches"], entries, strict=True):
            record |= {
                "specimen": entry and entry.specimen,
                "left_out": entry.left_out if entry else "",
            }

    def add_moduli(self, calibration: "Calibration", touches: list[palpate.Touch]) -> None:
        """Add the modulus of each touch, and of their mean."""
        moduli = [calibration.modulus_of(touch) for touch in touches]
        usable = [touch for touch in touches if not calibration.objections(touch)]
        found, of_mean = calibration.agreement(usable) if len(usable) > 1 else None, None
        if found and found.agree:
            of_mean = calibration.modulus(found.ratio, found.own_error, touches=found.effective)
        if touches:
            cells = ["modulus (95 % interval)", *map(touch_table.modulus_cell, moduli)]
            self.table = touch_table.beside(self.table, cells)
            mean = (
                f", if all are on one object: {touch_table.modulus_cell(of_mean)}"
                if of_mean
                else ""
            )
            self.below += [f"{found}{mean}"] * bool(found) + [
                f"The intervals include the {calibration.scatter}."
            ]
        for record, modulus in zip(self.document["touches"], moduli, strict=True):
            record["modulus"] = modulus.as_dict()
        self.document["agreement"] = found.as_dict() if found else None
        self.document["modulus_of_mean"] = of_mean.as_dict() if of_mean else None

    def add_offline(self, touches: "list[OfflineTouch]") -> None:
        """Show the touches as they are estimated afterwards."""
        rows = [touch_table.offline_row(*each) for each in enumerate(touches, 1)]
        self.table = touch_table.table(rows, touch_table.OFFLINE_HEADER)
        self.below = touch_table.methods(touches)
        for record, touch in zip(self.document["touches"], touches, strict=False):
            record["offline"] = touch.as_dict()


def replayed(
    file: Path,
    reading: SourceOptions,
    tracker: TrackerOptions,
    offline: bool,
    calibration: "Calibration | None",
    windows: _Windows,
) -> Replayed:
    """Send a recording through the estimator.

    Raises
    ------
    RecordingError, ValueError, TypeError
        As from `palpate.touches`.
    """
    recording = recorded(file, **reading.keywords())
    tracking = tracker.for_recording(recording, calibration)
    again = palpate.offline(recording, **tracking) if offline else None
    of_tracker = tracked(recording, windows=windows, **tracking)
    touches, notes, plan = (
        of_tracker.touches,
        [*of_tracker.touches.notes],
        recording.sidecar.session,
    )
    other = {} if recording.unit == "pF" else {"unit": recording.unit}
    entries = plan.matched(touches, recording.survey.period_s)
    ratio_of = calibration.ratio_of if calibration else RATIOS[plan.ratio]
    named = [
        (entry, touch)
        for touch, entry in zip(touches, entries, strict=True)
        if entry and not entry.left_out
    ]
    kept = [(entry.specimen, touch) for entry, touch in named if not objections(touch)]
    scatter = calibration.touch_scatter if calibration else session_scatter(kept, ratio_of)
    linearity = linearity_pF(recording.full_scale_pF)
    uncertainties = [Uncertainty.of(touch, scatter, linearity, ratio_of) for touch in touches]
    document = {
        "file": str(file),
        "scene": tracking["scene"],
        "settings": {name: _plain(value) for name, value in tracking.items() if name != "scene"},
        "palpate": palpate.__version__,
        "rows": recording.survey.rows,
        "notes": list(notes),
        **other,
        **({"windows": windows} if windows else {}),
        "touches": touch_table.records(touches, uncertainties, cut=of_tracker.cut),
    }
    reliable = bool(touches) and not recording.doubts
    rows = map(touch_table.row, count(1), touches, uncertainties)
    understood = recording.understood or simulation_note(recording)
    found = Replayed(document, touch_table.table([*rows]), understood, notes, reliable)
    if (calibration or plan).ratio == "level":
        document["ratio_used"] = "level_ratio"
        found.below.append("The ratios are level ratios: over the swept depth, not of the hold.")
    if touches and plan.touches:
        found.add_specimens(entries)
    if calibration:
        notes += doubts_of_calibration(calibration, tracking["scene"]).sentences()
        found.reliable &= calibration.sound
        found.add_moduli(calibration, touches)
    found.below += [
        f"unit: {unit}; of the covariance: 1/({unit})^2" for unit in other.values() if touches
    ]
    found.below += touch_table.advised(document["touches"])
    if again is not None:
        found.add_offline(again)
    if not touches:
        notes.append(f"no touch found: {_why_not(recording, again=of_tracker.retaken > 0)}")
    return found


def _plain(value: Any) -> Any:
    """Return a setting for JSON, which has no infinity."""
    return str(value) if value in (math.inf, -math.inf) else value


def _why_not(recording: OpenedRecording, *, again: bool) -> str:
    takes = baseline_takes(recording.survey.period_s if recording.timed else 0)
    spans = [
        f"{name} {high - low:.3g} {recording.unit}"
        for name, (low, high) in recording.survey.spans_pF.items()
    ]
    if len(spans) < 2:
        return "a channel has no values"
    found = f"no change was above the idle noise for long enough. The channels span {', '.join(spans)}; check --unit; "
    return takes if again else found + takes


def _replay_all(files: list[Path], one: partial[Replayed], jobs: int) -> int:
    """Replay recordings in threads, print the results in order, and return the exit code."""
    results: dict[Path, Replayed | Exception] = {}
    work = in_order(one, files, jobs)
    try:
        with reading_progress("replay", files) as done:
            for file, result in zip(files, work, strict=True):
                results[file] = result
                done(file)
    except KeyboardInterrupt:
        work.close()  # waits for the threads
        _print_all(results)
        click.echo(f"{len(results)} of {len(files)} recordings are done", err=True)
        raise
    codes = _print_all(results)
    return next(code for code in _WORST if code in codes)


def _print_all(results: dict[Path, Replayed | Exception]) -> set[int]:
    """Print a table or a list of all results, then their sentences, notes and errors; return the exit codes."""
    width = max((len(str(file)) for file in results), default=0)
    documents, lines, below, errors, codes, understood = (
        [],
        list[str](),
        list[str](),
        list[str](),
        {0},
        "",
    )
    for file, result in results.items():
        if isinstance(result, Exception):
            found = ErrorReport.of_file(result)
            codes.add(found.code)
            errors.append(found.line(file))
            documents.append({"file": str(file), "error": asdict(found)})
            continue
        documents.append(result.document)
        codes.add(0 if result.reliable else ExitCode.NOT_RELIABLE)
        print_notes(
            file, [result.understood if result.understood != understood else "", *result.notes]
        )
        understood = result.understood
        begin = [] if lines or not result.table else [f"{'file':{width}}  {result.table[0]}"]
        lines += [*begin, *(f"{file!s:{width}}  {row}" for row in result.table[1:])]
        below += [f"{file}: {line}" for line in result.below]
    print_result(documents, "\n".join([*lines, *below]))
    for error in errors:
        print_message(error)
    return codes
