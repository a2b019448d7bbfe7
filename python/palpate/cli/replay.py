"""`palpate replay`: estimates recordings again, and prints one row for each touch."""

import math
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import palpate
from palpate.ad7746.registers import linearity_pF
from palpate.batch import in_order
from palpate.calibration.assessment import calibration_doubts
from palpate.calibration.origin import (
    ReadingsOrigin,
    missing_remark,
    origin_remarks,
    provenance_document,
    require_origin,
)
from palpate.cli import touch_table
from palpate.cli.accept_option import accept_option
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
from palpate.cli.touch_moduli import TouchModuli
from palpate.cli.trends import SpecimenTrend, by_specimen, specimen_trends
from palpate.recording.opened import OpenedRecording
from palpate.recording.reading import recorded
from palpate.recording.session import Entry, Plan
from palpate.repeatability import Agreement, agreement, objections, session_scatter, with_scatter
from palpate.tracking import Touches, Tracked, Windows, baseline_takes, tracked
from palpate.uncertainty import RATIOS, RatioOf, Scatter, Uncertainty

if TYPE_CHECKING:  # they are imported when they are used
    from palpate import Calibration, Touch
    from palpate.offline_touches import OfflineTouch


def _parse_windows(_: click.Context, __: click.Parameter, texts: tuple[str, ...]) -> Windows | None:
    """Return begin and end of each window; None without windows."""
    windows = []
    try:
        for text in texts:
            begin, end = text.replace(",", ":").split(":")
            windows.append((float(begin), float(end)))
    except ValueError:
        allowed = "BEGIN:END, two times, s, as 2.0:8.5"
        raise click.BadParameter(f"got {' '.join(texts)!r:.60}, allowed: {allowed}") from None
    return windows or None


@click.command("replay")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=Recordings())
@replaying_options
@click.option(
    "--calibration",
    type=InputFile(),
    help="Calibration file from `calibrate`: adds the modulus with its interval to each touch.",
)
@accept_option
@click.option(
    "--offline",
    "is_offline",
    is_flag=True,
    help="Estimate each touch again with the whole recording known, and show it beside the live "
    "result.",
)
@click.option(
    "--window",
    "windows",
    multiple=True,
    callback=_parse_windows,
    metavar="BEGIN:END",
    help="Estimate the samples between two times, s, as a touch, as 2.0:8.5; may be repeated. Its "
    "baseline is from the rest before or after it, or --baseline.",
)
@click.option(
    "--jobs",
    default=1,
    show_default=True,
    type=click.IntRange(min=1),
    help="Recordings at a time, each in a thread.",
)
@json_option
def replay_command(
    files: tuple[FileArgument, ...],
    reading: SourceOptions,
    tracker: TrackerOptions,
    calibration: Path | None,
    accept: tuple[str, ...],
    is_offline: bool,
    windows: Windows | None,
    jobs: int,
) -> None:  # \b below is click's mark for lines that it must not join
    """Send recordings through the estimator again: one row for each touch.

    Without --scene a recording made by palpate is estimated with the scene and settings of the live
    measurement and gives exactly the same results. Below the table there is a sentence for each
    flag: what it means, and what to do; see help(palpate.flags.Flag). What is wrong with the
    recording appears on standard error and in the notes of --json.

    If the sidecar says what was touched (`palpate live`), there is a column for it, and --json has
    `specimen` and `left_out`.

    FILE may be a folder, or a pattern in quotes as "monday/**.csv". With several FILEs the table
    has a column for the file, and --json is a list; a file that fails is an Error: line and an
    error in the list, and the others go on. Ctrl-C prints what is done.

    Exit codes: 2, the calibration is of another chip, or simulated; 4, not a recording, or a
    damaged one; 5, no touch found, the recording is not as it was written, or the calibration is
    not reliable.

    \b
    Example:
      palpate replay bench.csv --map "hard=C1 (pF),soft=C2 (pF)" --set smallest_shift=1
      palpate replay monday tuesday --jobs 4
    """  # noqa: D301
    if is_offline and calibration:
        raise click.UsageError(
            "--offline and --calibration: allowed one of them; moduli are of the live result"
        )
    if is_offline and windows:
        raise click.UsageError("--offline and --window: allowed one of them")
    loaded = None
    if calibration:
        loaded = palpate.Calibration.load(calibration)
        print_notes(calibration, [missing_remark(loaded.about.provenance)])
    options = ReplayOptions(reading, tracker, loaded, is_offline, windows, accept)
    paths: dict[Path, None] = {}
    are_several = False
    for argument in files:
        paths |= dict.fromkeys(argument.files)
        are_several = argument.is_pattern or len(paths) > 1 or are_several
    if are_several:
        option = "--soft" if reading.soft else "--window"
        if reading.soft or windows:
            raise click.UsageError(
                f"{option}: got it with {len(paths)} recordings, allowed: with one FILE"
            )
        sys.exit(_replay_all(paths, options, jobs))
    [path] = paths
    with usage_errors():
        replay = replay_recording(INPUT.convert(path, None, None), options)
    print_result(replay.to_json(), "\n".join([*replay.table(), *replay.sentences()]))
    print_notes(path, [replay.understood, *replay.touches.notes, *replay.warnings])
    sys.exit(replay.exit_code)


@dataclass(frozen=True)
class ReplayOptions:
    """How each recording is read and estimated."""

    reading: SourceOptions
    tracker: TrackerOptions
    calibration: "Calibration | None" = None
    is_offline: bool = False
    windows: Windows | None = None
    accept: Collection[str] = ()


@dataclass(frozen=True)
class Replay:
    """The touches of one recording, with specimen, modulus and advice of each."""

    file: Path
    options: ReplayOptions
    tracking: Mapping[str, Any]
    """Scene and settings of the tracker."""
    rows: int
    unit: str
    found: Tracked
    uncertainties: Sequence[Uncertainty]
    entries: Sequence[Entry | None] | None
    """The session's entry for each touch; None without a session."""
    is_level: bool
    """Whether the level ratio is used."""
    moduli: TouchModuli | None
    trends: Sequence[SpecimenTrend]
    """Trends that are not in the sentence on the mean."""
    offline: "Sequence[OfflineTouch] | None"
    understood: str
    """How a table of another program is read, or that the recording is simulated."""
    warnings: Sequence[str]
    """Notes that are not in the document: on the calibration, and why there is no touch."""
    origin_remarks: Sequence[str]
    """Remarks on the origins of calibration and recording."""
    is_as_written: bool
    """Whether the recording has no doubts."""

    @property
    def touches(self) -> Touches:
        """The touches, with the notes on the recording."""
        return self.found.touches

    @property
    def exit_code(self) -> ExitCode:
        """NOT_RELIABLE: no touch, a doubtful recording, or a calibration that is not reliable."""
        calibration = self.options.calibration
        is_reliable = calibration is None or calibration.is_reliable
        if self.touches and self.is_as_written and is_reliable:
            return ExitCode.DONE
        return ExitCode.NOT_RELIABLE

    def table(self) -> list[str]:
        """Return the lines of the table: the header, and a row for each touch."""
        if self.offline is not None:
            offline_rows = map(touch_table.offline_row, count(1), self.offline)
            return touch_table.with_header(offline_rows, touch_table.OFFLINE_HEADER)
        if self.moduli is not None:
            rows = map(touch_table.calibrated_row, count(1), self.touches, self.uncertainties)
            lines = touch_table.with_header(rows, touch_table.CALIBRATED_HEADER)
        else:
            rows = map(touch_table.touch_row, count(1), self.touches, self.uncertainties)
            lines = touch_table.with_header(rows)
        if self.entries is not None:
            cells = map(touch_table.specimen_cell, self.entries)
            lines = touch_table.add_column(lines, ["specimen", *cells])
        if self.moduli is not None and self.touches:
            cells = map(touch_table.modulus_cell, self.moduli.moduli)
            lines = touch_table.add_column(lines, ["modulus (95 % interval)", *cells])
        return lines

    def sentences(self) -> list[str]:
        """Return the lines below the table."""
        if self.offline is not None:
            return touch_table.offline_methods(self.offline)
        sentences = []
        if self.is_level:
            sentences.append(self._level_sentence)
        if self.moduli is not None:
            sentences += self.moduli.sentences()
        sentences += map(str, self.trends)
        if self.unit != "pF" and self.touches:
            sentences.append(f"unit: {self.unit}; of the covariance: 1/({self.unit})^2")
        return sentences + touch_table.advice_lines(self.touches, cut=self.found.cut)

    @property
    def _level_sentence(self) -> str:
        """The sentence on level ratios; with several exponents their moduli are means of all."""
        text = "The ratios are level ratios: over the swept depth, not of the hold."
        if self.moduli is None:
            return text
        low, high = self.moduli.calibration.possible_exponents
        if low == high:
            return text
        exponent = self.moduli.calibration.contact_exponent
        return (
            f"{text} They have the contact exponent {exponent:g}; the moduli are means over the "
            f"exponents {low:g} to {high:g}."
        )

    def to_json(self) -> dict[str, object]:
        """Return the document."""
        settings = {**self.tracking}
        scene = settings.pop("scene")
        for name, value in settings.items():
            if value in (math.inf, -math.inf):  # JSON has no infinity
                settings[name] = str(value)
        document: dict[str, object] = {
            "file": str(self.file),
            "scene": scene,
            "settings": settings,
            "palpate": palpate.__version__,
            "rows": self.rows,
            "notes": self.touches.notes,
            "judgements": [judgement.as_dict() for judgement in self.found.judgements],
        }
        if self.unit != "pF":
            document["unit"] = self.unit
        if self.options.windows:
            document["windows"] = self.options.windows
        if self.options.calibration is not None:
            provenance = self.options.calibration.about.provenance
            document["calibration"] = provenance_document(provenance, self.origin_remarks)
        document["touches"] = self._touch_records()
        if self.is_level:
            document["ratio_used"] = "level_ratio"
        if self.trends:
            document["trends"] = [trend.as_dict() for trend in self.trends]
        if self.moduli is not None:
            document |= self.moduli.as_dict()
        return document

    def _touch_records(self) -> list[dict[str, object]]:
        """Return the touches for the document."""
        records = touch_table.touch_records(self.touches, self.uncertainties, cut=self.found.cut)
        if self.entries is not None:
            for record, entry in zip(records, self.entries, strict=True):
                record["specimen"] = entry.specimen if entry else None
                record["left_out"] = entry.left_out if entry else ""
        if self.moduli is not None:
            for record, modulus in zip(records, self.moduli.moduli, strict=True):
                record["modulus"] = modulus.as_dict()
        if self.offline is not None:
            for record, touch in zip(records, self.offline, strict=False):
                record["offline"] = touch.as_dict()
        return records


def replay_recording(file: Path, options: ReplayOptions) -> Replay:
    """Send a recording through the estimator.

    Raises
    ------
    RecordingError, ValueError, TypeError
        As from `palpate.touches`.
    CalibrationRefused
        The calibration is of another chip, or simulated.
    """
    calibration = options.calibration
    recording = recorded(file, **options.reading.keywords())
    remarks = _origin_remarks(recording, options)
    tracking = options.tracker.for_recording(recording, calibration)
    offline = moduli = None
    if options.is_offline:
        offline = palpate.offline(recording, **tracking)
    found = tracked(recording, windows=options.windows, **tracking)
    touches = found.touches
    plan = recording.sidecar.session
    entries = plan.matched(touches, recording.survey.period_s)
    warnings = []
    if calibration is not None:
        moduli = TouchModuli.of(calibration, touches, by_specimen(touches, entries))
        calibration = moduli.calibration
        warnings += [*calibration_doubts(calibration, tracking["scene"]), *remarks]
    if not touches:
        reason = _why_no_touch(recording, tracking["scene"], was_retaken=found.retaken > 0)
        warnings.append(f"no touch found: {reason}")
    session = _ReplayedSession(touches, plan, entries, calibration)
    return Replay(
        file,
        options,
        tracking,
        rows=recording.survey.rows,
        unit=recording.unit,
        found=found,
        uncertainties=session.uncertainties(recording.full_scale_pF),
        entries=entries if touches and plan.touches else None,
        is_level=(calibration or plan).ratio == "level",
        moduli=moduli,
        trends=session.trends(),
        offline=offline,
        understood=recording.understood or simulation_note(recording),
        warnings=warnings,
        origin_remarks=remarks,
        is_as_written=not recording.doubts,
    )


def _origin_remarks(recording: OpenedRecording, options: ReplayOptions) -> list[str]:
    """Return remarks on the origins of calibration and recording; refuse what does not match."""
    if options.calibration is None:
        return []
    provenance = options.calibration.about.provenance
    origin = ReadingsOrigin.of_sidecar(recording.sidecar)
    require_origin(str(recording.path), provenance, origin, options.accept)
    return origin_remarks(provenance, origin)


@dataclass(frozen=True)
class _ReplayedSession:
    """The touches of a recording with their specimens, and the ratio and scatter that count."""

    touches: "Sequence[Touch]"
    plan: Plan
    entries: Sequence[Entry | None]
    calibration: "Calibration | None"

    @property
    def ratio_of(self) -> RatioOf:
        """The ratio of the calibration, else of the session."""
        if self.calibration is not None:
            return self.calibration.ratio_of
        return RATIOS[self.plan.ratio]

    def scatter(self) -> Scatter:
        """Return the scatter of the calibration, else of the kept touches on named specimens."""
        if self.calibration is not None:
            return self.calibration.touch_scatter
        kept = []
        for entry, touch in zip(self.entries, self.touches, strict=True):
            if entry and not entry.left_out and not objections(touch):
                kept.append((entry.specimen, touch))
        return session_scatter(kept, self.ratio_of)

    def uncertainties(self, full_scale_pF: float) -> list[Uncertainty]:
        """Return the uncertainty of each touch."""
        scatter = self.scatter()
        linearity = linearity_pF(full_scale_pF)
        uncertainties = []
        for touch in self.touches:
            uncertainties.append(Uncertainty.of(touch, scatter, linearity, self.ratio_of))
        return uncertainties

    def agreement(self, touches: "Sequence[Touch]") -> Agreement:
        """Return whether touches on one specimen agree."""
        if self.calibration is not None:
            return self.calibration.agreement(touches)
        found = agreement(touches, ratio_of=self.ratio_of)
        return with_scatter(found, self.scatter())

    def trends(self) -> list[SpecimenTrend]:
        """Return the trends; with a calibration the sentences on the means contain them."""
        if self.calibration is not None:
            return []
        return list(specimen_trends(self.touches, self.entries, self.agreement))


def _why_no_touch(recording: OpenedRecording, scene: str, *, was_retaken: bool) -> str:
    """Return why a recording may have no touch; `was_retaken`: the baseline was measured again."""
    survey = recording.survey
    baseline = baseline_takes(survey.period_s if recording.timed else 0, scene)
    spans = []
    for name, (low, high) in survey.spans_pF.items():
        spans.append(f"{name} {high - low:.3g} {recording.unit}")
    if len(spans) < 2:
        return "a channel has no values"
    if was_retaken:
        return baseline + _BEGINS
    return (
        "no change was above the idle noise for long enough. The channels span "
        f"{', '.join(spans)}; check --unit; {baseline}{_BEGINS}"
    )


_BEGINS = "; if the recording begins in a press: --baseline zero, or --baseline HARD,SOFT"


_Results = dict[Path, Replay | Exception]
_PRIORITY = (
    ExitCode.UNEXPECTED,
    ExitCode.MISSING_EXTRA,
    ExitCode.USAGE,
    ExitCode.NO_DEVICE,
    ExitCode.BAD_DATA,
    ExitCode.NOT_RELIABLE,
    ExitCode.DONE,
)
"""Exit codes of several recordings: the first one here that any of them has is returned."""


def _replay_all(files: Collection[Path], options: ReplayOptions, jobs: int) -> ExitCode:
    """Replay recordings in threads, print the results in order, and return the exit code."""
    results: _Results = {}
    work = in_order(partial(replay_recording, options=options), files, jobs)
    try:
        with reading_progress("replay", files) as update:
            for file, result in zip(files, work, strict=True):
                results[file] = result
                update(file)
    except KeyboardInterrupt:
        work.close()  # waits for the threads
        _print_all(results)
        click.echo(f"{len(results)} of {len(files)} recordings are done", err=True)
        raise
    codes = _print_all(results)
    return next(code for code in _PRIORITY if code in codes)


def _print_all(results: _Results) -> set[ExitCode]:
    """Print all results as a table or list, then sentences and errors; return the codes."""
    width = max((len(str(file)) for file in results), default=0)
    codes = {ExitCode.DONE}
    documents: list[object] = []
    lines: list[str] = []
    sentences: list[str] = []
    errors: list[str] = []
    understood = ""
    for file, result in results.items():
        if isinstance(result, Exception):
            report = ErrorReport.of_file(result)
            codes.add(report.code)
            errors.append(report.line(file))
            documents.append({"file": str(file), "error": asdict(report)})
            continue
        codes.add(result.exit_code)
        documents.append(result.to_json())
        notes = [*result.touches.notes, *result.warnings]
        if result.understood != understood:
            notes.insert(0, result.understood)
            understood = result.understood
        print_notes(file, notes)
        table = result.table()
        if table and not lines:
            lines.append(f"{'file':{width}}  {table[0]}")
        for row in table[1:]:
            lines.append(f"{file!s:{width}}  {row}")
        for sentence in result.sentences():
            sentences.append(f"{file}: {sentence}")
    print_result(documents, "\n".join([*lines, *sentences]))
    for error in errors:
        print_message(error)
    return codes
