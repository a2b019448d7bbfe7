"""`palpate verify`: compares a specimen of known modulus with a calibration."""

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from math import inf
from pathlib import Path
from typing import Any, NamedTuple

import click

from palpate import Calibration, Touch, Uncertainty
from palpate.ad7746.registers import linearity_pF
from palpate.calibration.assessment import calibration_doubts
from palpate.calibration.calibration_file import add_verification
from palpate.calibration.calibration_verification import CalibrationVerification, today
from palpate.calibration.modulus_text import known_modulus, with_uncertainty
from palpate.calibration.specimen_files import name_key, read_moduli
from palpate.cli import touch_table
from palpate.cli.exit_codes import ExitCode, usage_errors
from palpate.cli.output import json_option, print_message, print_notes, print_result
from palpate.cli.paths import OUTPUT, InputFile, require_free, with_sidecar
from palpate.cli.shared_options import (
    Keywords,
    SourceOptions,
    TrackerOptions,
    board_options,
    complete_source,
    replaying_options,
    simulation_note,
)
from palpate.display.text import counted
from palpate.errors import CalibrationError, need
from palpate.flags import advice
from palpate.materials import KnownModulus
from palpate.messages import quoted, unlike
from palpate.recording.reading import recorded
from palpate.recording.verification import verification_of
from palpate.report.findings import AnalysedRecording, known_moduli
from palpate.sources.options import is_file
from palpate.tracking import tracked

_TO_DO = (
    "Check that this is the specimen and its modulus, that it has the temperature at which the "
    "modulus was measured, and that both bumps are clean; check the connections and the gain of "
    "both channels. Then verify again, if possible with another specimen. If it disagrees again, "
    "calibrate again."
)


@click.command("verify")
@click.argument("specimen", metavar="SPECIMEN")
@click.argument(
    "sources", metavar="SOURCE|FILE...", nargs=-1, required=True, shell_complete=complete_source
)
@click.option(
    "--calibration", required=True, type=InputFile(), help="Calibration file from `calibrate`."
)
@click.option("--modulus", help="Modulus of the specimen with its unit, as '1.1 MPa'; or '50 A'.")
@click.option(
    "--moduli",
    type=InputFile(),
    help="Table of moduli, as for `calibrate`.  [default: the list in the sidecars]",
)
@click.option(
    "--modulus-uncertainty",
    metavar="AMOUNT",
    help="Standard uncertainty (k = 1) of the modulus, as 5% or '0.05 MPa'.  [default: the one of "
    "table or list, else exact]",
)
@click.option(
    "--touches",
    default=4,
    show_default=True,
    type=click.IntRange(1, 99),
    help="Touches to measure with SOURCE.",
)
@click.option(
    "-o", "output", type=OUTPUT, help="The recording of SOURCE to write, NAME.csv: a new file."
)
@click.option("--dry-run", is_flag=True, help="Do not add the result to the calibration file.")
@board_options
@replaying_options
@json_option
def verify_command(
    specimen: str,
    sources: tuple[str, ...],
    calibration: Path,
    modulus: str | None,
    moduli: Path | None,
    modulus_uncertainty: str | None,
    touches: int,
    output: Path | None,
    dry_run: bool,
    reading: SourceOptions,
    tracker: TrackerOptions,
) -> None:
    """Check with a specimen of known modulus whether a calibration still holds.

    FILE: recordings of touches on the specimen. If a sidecar says which touch was on which
    specimen (`palpate live`), those on SPECIMEN count, else all of them. SOURCE, as in `palpate
    record`: touch the specimen now. The result, with its date (UTC), is added to the calibration
    file. If it disagrees, each later use of the calibration warns, until a verification agrees.

    Exit codes: 0, the calibration agrees; 4, not a recording, or not a calibration; 5, it
    disagrees, or is not reliable: no touch counts, fewer touches than --touches, a recording is not
    as it was written, or the fit has an objection. The result is not added to the file if no touch
    counts, or if a recording is not as it was written.

    \b
    Example:
      palpate verify "70 OO" monday.csv --calibration probe.toml
      palpate verify gel usb: --modulus "1.1 MPa" --modulus-uncertainty 3% --calibration probe.toml -o gel-check.csv
    """  # noqa: D301
    if output:
        require_free(with_sidecar(output), force=None)
    need("scipy", "science")  # before the touches are measured
    are_files = _are_files(sources)
    if output and are_files:
        raise click.UsageError("-o: got it with a recording, allowed: with a SOURCE that measures")
    if modulus and moduli:
        raise click.UsageError("--modulus and --moduli: allowed one of them")
    given = _given_modulus(specimen, modulus, moduli, modulus_uncertainty)
    loaded = Calibration.load(calibration)
    if are_files:
        runs = [_analyse(Path(source), loaded, reading, tracker) for source in sources]
        known = given or _modulus_in(runs, specimen, modulus_uncertainty)
        found = _touches_in(runs, specimen, loaded)
    else:
        if given is None:
            raise _no_modulus(specimen)
        known = given
        [source] = sources
        measurement = _Measurement(source, touches, output, reading, tracker)
        found = measurement.touches(loaded, specimen)
    result = _verified(found, loaded, specimen, known)
    kept = result.kept
    why_not = ""
    if dry_run:
        why_not = "--dry-run"
    elif kept is None:
        why_not = "the result is not reliable"
    else:
        add_verification(calibration, kept)
    _print(result, calibration, why_not)
    sys.exit(result.exit_code)


@dataclass(frozen=True)
class VerifiedTouch:
    """A touch on the specimen.

    Attributes
    ----------
    place : str
        Name of the recording or source.
    number : int
        In it, from 1.
    touch : palpate.Touch
    uncertainty : palpate.Uncertainty
    left_out : tuple of str
        Why it does not count; empty: it counts.
    remarks : tuple of str
        Sentences: what its flags mean, and how it differs from the touches that calibrated.
    """

    place: str
    number: int
    touch: Touch
    uncertainty: Uncertainty
    left_out: tuple[str, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class VerifiedTouches:
    """The touches on the specimen, and what is wrong with them.

    Attributes
    ----------
    touches : tuple of VerifiedTouch
    doubts : tuple of str
        Why they are not as they were measured.
    missing : str
        How many touches are missing; "": none.
    scene : str
        Of the tracker.
    date : str
        When they were measured, UTC, as 2026-11-29.
    others : tuple of tuple of Touch
        Touches on other specimens, each alone: they show the contact exponent, too.
    """

    touches: tuple[VerifiedTouch, ...]
    doubts: tuple[str, ...] = ()
    missing: str = ""
    scene: str = "handheld"
    date: str = ""
    others: tuple[tuple[Touch, ...], ...] = ()

    @property
    def counted(self) -> list[Touch]:
        """The touches that count."""
        return [one.touch for one in self.touches if not one.left_out]


@dataclass(frozen=True)
class Result:
    """The result of `palpate verify`; verification: None if no touch counts."""

    found: VerifiedTouches
    calibration: Calibration
    verification: CalibrationVerification | None
    warnings: tuple[str, ...]
    """Why the calibration may be wrong, apart from its earlier verifications."""

    @property
    def kept(self) -> CalibrationVerification | None:
        """The comparison to add to the calibration file; None: it is not reliable."""
        return None if self.found.doubts else self.verification

    @property
    def exit_code(self) -> ExitCode:
        """NOT_RELIABLE: it disagrees, or touches, recordings or fit have an objection."""
        agrees = self.verification is not None and self.verification.agrees
        is_complete = not self.found.doubts and not self.found.missing
        if agrees and is_complete and self.calibration.sound:
            return ExitCode.DONE
        return ExitCode.NOT_RELIABLE

    def table(self) -> list[str]:
        """Return the lines of the table of touches."""
        rows = []
        places = ["file"]
        cells = ["modulus (95 % interval)"]
        for one in self.found.touches:
            rows.append(touch_table.touch_row(one.number, one.touch, one.uncertainty))
            places.append(one.place)
            cells.append(self._cell(one))
        lines = touch_table.with_header(rows)
        if not lines:
            return []
        if len(set(places)) > 2:
            lines = touch_table.add_column(places, lines)
        return touch_table.add_column(lines, cells)

    def _cell(self, one: VerifiedTouch) -> str:
        """Return the modulus of a touch, or why it does not count."""
        if one.left_out:
            return f"left out: {', '.join(one.left_out)}"
        return touch_table.modulus_cell(self.calibration.modulus_of(one.touch))

    def sentences(self) -> list[str]:
        """Return the lines below the table."""
        lines = []
        for one in self.found.touches:
            for remark in one.remarks:
                lines.append(f"touch {one.number} of {one.place}: {remark}")
        if self.verification is None:
            lines.append("No touch counts, so nothing is compared: touch the specimen again.")
            return lines
        lines.append(f"{self.verification}.")
        if self.verification.measured.reason:
            lines.append(f"{self.verification.measured.reason}.")
        if not self.verification.agrees:
            lines.append(_TO_DO)
        return lines

    def to_json(self) -> dict[str, object]:
        """Return the document, without the names of the files."""
        touches = [one.touch for one in self.found.touches]
        uncertainties = [one.uncertainty for one in self.found.touches]
        records = touch_table.touch_records(touches, uncertainties)
        for record, one in zip(records, self.found.touches, strict=True):
            record["file"] = one.place
            record["number"] = one.number
            record["left_out"] = one.left_out
            record["modulus"] = self.calibration.modulus_of(one.touch).as_dict()
            record["remarks"] = one.remarks
        verification = None
        if self.verification is not None:
            verification = {
                **self.verification.as_dict(),
                "agrees": self.verification.agrees,
                "text": str(self.verification),
            }
        return {
            "touches": records,
            "verification": verification,
            "notes": [*self.found.doubts, *self.warnings],
            "missing": self.found.missing,
        }


def _are_files(sources: Sequence[str]) -> bool:
    """Return whether recordings are named; False: one source that measures."""
    with usage_errors():
        measuring = [source for source in sources if not is_file(source)]
    if measuring and len(sources) > 1:
        raise click.UsageError(
            f"SOURCE: got {' '.join(map(quoted, sources))}, allowed: one source that measures, or "
            "recordings"
        )
    if measuring:
        return False
    for file in sources:
        InputFile().convert(file, None, None)
    return True


def _given_modulus(
    specimen: str, text: str | None, table: Path | None, uncertainty: str | None
) -> KnownModulus | None:
    """Return the modulus of an option or of a table; None: none was given."""
    if text is not None:
        try:
            known = known_modulus(text)
        except CalibrationError as error:
            raise click.BadParameter(str(error), param_hint="--modulus") from error
        return _with_uncertainty(known, uncertainty)
    if table is None:
        return None
    moduli = read_moduli(table, print_message)
    known_name = _name_in(specimen, moduli)
    if known_name is None:
        raise CalibrationError(f"{table}: {unlike(specimen, moduli, 'specimen')}")
    return _with_uncertainty(moduli[known_name], uncertainty)


def _with_uncertainty(known: KnownModulus, text: str | None) -> KnownModulus:
    """Return a modulus with this uncertainty; print it if it is of a hardness."""
    if text is not None:
        try:
            known = with_uncertainty(known, text, None)
        except CalibrationError as error:
            raise click.BadParameter(str(error), param_hint="--modulus-uncertainty") from error
    if known.hardness is not None:
        print_message(
            f"{known.hardness:g} Shore A is taken as {known} (k = 1), by Gent's relation; a "
            "measured modulus is better"
        )
    return known


def _modulus_in(
    runs: Sequence[AnalysedRecording], specimen: str, uncertainty: str | None
) -> KnownModulus:
    """Return the modulus of the specimen in the sidecars of recordings."""
    moduli, _ = known_moduli(runs, {})
    name = _name_in(specimen, moduli)
    if name is None:
        raise _no_modulus(specimen)
    return _with_uncertainty(moduli[name], uncertainty)


def _no_modulus(specimen: str) -> click.UsageError:
    return click.UsageError(
        f"--modulus: missing: no modulus is known for {quoted(specimen)}, allowed: a modulus with "
        "its unit, as '1.1 MPa', or a table with --moduli"
    )


def _name_in(specimen: str, names: Iterable[str]) -> str | None:
    """Return the name that is written like a specimen; None: there is none."""
    wanted = name_key(specimen)
    return next((name for name in names if name_key(name) == wanted), None)


def _analyse(
    file: Path, calibration: Calibration, reading: SourceOptions, tracker: TrackerOptions
) -> AnalysedRecording:
    """Measure the touches of a recording with the settings of the calibration; print the notes."""
    with usage_errors(f"{file}: "):
        recording = recorded(file, **_without_board(reading))
        tracking = tracker.for_recording(recording, calibration)
        found = tracked(recording, **tracking)
    notes = [recording.understood, simulation_note(recording), *recording.notes]
    print_notes(file, notes)
    return AnalysedRecording(file.name, recording, tracking, found, verification_of(recording))


def _without_board(reading: SourceOptions) -> Keywords:
    """Return the options for a recording; those for a board are refused."""
    for name, value in (("firmware", reading.firmware), ("excitation", reading.excitation)):
        if value is not None:
            raise click.UsageError(f"--{name}: got it with a recording, allowed: with a board")
    return reading.keywords()


class _NamedTouch(NamedTuple):
    """A touch of a recording, its number, its specimen, and why a person left it out."""

    number: int
    touch: Touch
    specimen: str
    left_out: str


def _named_touches(run: AnalysedRecording, specimen: str) -> Iterator[_NamedTouch]:
    """Yield the touches of a recording; without names in its session all are on the specimen."""
    has_names = _has_names(run)
    touches = run.found.touches
    entries = run.plan.matched(touches, run.period_s)
    for number, (touch, entry) in enumerate(zip(touches, entries, strict=True), 1):
        if not has_names:
            yield _NamedTouch(number, touch, specimen, "")
        elif entry and entry.specimen:
            yield _NamedTouch(number, touch, entry.specimen, entry.left_out or "")


def _has_names(run: AnalysedRecording) -> bool:
    """Return whether the session of a recording names the specimen of any touch."""
    return any(entry.specimen for entry in run.plan.touches)


def _touches_in(
    runs: Sequence[AnalysedRecording], specimen: str, calibration: Calibration
) -> VerifiedTouches:
    """Return the touches of recordings on the specimen."""
    touches: list[VerifiedTouch] = []
    others: dict[str, list[Touch]] = {}
    doubts = []
    for run in runs:
        doubts += [f"{run.name}: {doubt}" for doubt in run.recording.doubts]
        linearity = linearity_pF(run.recording.full_scale_pF)
        for one in _named_touches(run, specimen):
            if name_key(one.specimen) != name_key(specimen):
                others.setdefault(one.specimen, []).append(one.touch)
                continue
            touches.append(
                _verified_touch(
                    run.name,
                    one.number,
                    one.touch,
                    calibration,
                    linearity,
                    left_out=one.left_out,
                )
            )
    if others and not touches:
        raise click.UsageError(f"SPECIMEN: {unlike(specimen, others)}")
    return VerifiedTouches(
        tuple(touches),
        tuple(doubts),
        scene=str(runs[0].tracking["scene"]),
        date=max(filter(None, map(_date_of, runs)), default=today()),
        others=tuple(map(tuple, others.values())),
    )


def _date_of(run: AnalysedRecording) -> str:
    """Return when a recording began, UTC, as 2026-11-29; "": unknown."""
    try:
        began = datetime.fromisoformat(run.recording.sidecar.started)
        date = began.astimezone(UTC).date().isoformat()
    except (ValueError, OverflowError):
        return ""
    return min(date, today())


def _verified_touch(
    place: str,
    number: int,
    touch: Touch,
    calibration: Calibration,
    linearity: float,
    *,
    left_out: str = "",
) -> VerifiedTouch:
    """Return a touch with its uncertainty, and why it does not count."""
    ratio_of = calibration.ratio_of
    uncertainty = Uncertainty.of(touch, calibration.touch_scatter, linearity, ratio_of)
    reasons = [left_out, *map(str, calibration.objections(touch))]
    remarks = [*map(str, advice(touch)), *calibration.differences(touch)]
    return VerifiedTouch(
        place,
        number,
        touch,
        uncertainty,
        left_out=tuple(filter(None, reasons)),
        remarks=tuple(remarks),
    )


@dataclass(frozen=True)
class _Measurement:
    """How touches are measured now; output: the recording to write, or None."""

    source: str
    wanted: int
    output: Path | None
    reading: SourceOptions
    tracker: TrackerOptions

    def touches(self, calibration: Calibration, specimen: str) -> VerifiedTouches:
        """Measure the touches on the specimen."""
        from palpate import sources
        from palpate.cli.printer import MeasurementPrinter, TouchCounter
        from palpate.cli.record import Limits, measure, signals_stop
        from palpate.stream import Stream

        tracking = self._tracking(calibration)
        with usage_errors():
            opened = sources.open(self.source, **self.reading.keywords())
            stream = Stream(
                opened,
                record=self.output,
                notes=[f"verification with {specimen}"],
                notify=print_message,
                capacity=None if opened.live else 2,
                **tracking,
            )
        printer = MeasurementPrinter(stream, quiet=True)
        stream.listen(printer)
        stream.listen(TouchCounter(self.wanted))
        print_message(f"{specimen}: {counted(self.wanted, 'touch')} to measure")
        try:
            with signals_stop(stream) as received:
                measure(stream, printer, Limits(self.wanted, inf, recentre=False))
        finally:
            printer.clear_status()
        if received:
            raise KeyboardInterrupt
        return self._found(stream.touches, calibration, tracking, stream.tracker.settings)

    def _tracking(self, calibration: Calibration) -> Keywords:
        """Return scene and settings: those given, else those of the calibration."""
        given = self.tracker.keywords()
        usual = {"scene": calibration.about.scene or "handheld"}
        return calibration.for_tracking(usual | given) | given

    def _found(
        self,
        touches: Sequence[Touch],
        calibration: Calibration,
        tracking: Mapping[str, Any],
        settings: Mapping[str, Any],
    ) -> VerifiedTouches:
        linearity = linearity_pF(settings["full_scale"])
        rows = []
        for number, touch in enumerate(touches, 1):
            row = _verified_touch(self.source, number, touch, calibration, linearity)
            rows.append(row)
        missing = ""
        if len(touches) < self.wanted:
            missing = f"{len(touches)} of {self.wanted} touches were measured"
        scene = str(tracking["scene"])
        return VerifiedTouches(tuple(rows), missing=missing, scene=scene, date=today())


def _verified(
    found: VerifiedTouches, calibration: Calibration, specimen: str, known: KnownModulus
) -> Result:
    """Compare the touches with the calibration."""
    warnings = calibration_doubts(replace(calibration, verifications=()), found.scene)
    verification = None
    if found.counted:
        # Their scatter narrows the range of the contact exponent; a changed gain does not bias it.
        learned = calibration.learned([found.counted, *found.others])
        verification = learned.verify(
            found.counted, known.modulus, known.whole, specimen=specimen, date=found.date
        )
    return Result(found, calibration, verification, tuple(warnings))


def _print(result: Result, calibration: Path, why_not: str) -> None:
    """Print the result; `why_not`: why it is not added to the file, "": it is."""
    document = {
        "calibration": str(calibration),
        "written": not why_not,
        **result.to_json(),
    }
    lines = [*result.table(), *result.sentences()]
    if why_not:
        lines.append(f"{calibration}: not changed: {why_not}.")
    else:
        lines.append(f"{calibration}: the result is added.")
    print_result(document, "\n".join(lines))
    print_notes(calibration, [*result.found.doubts, *result.warnings])
    if result.found.missing:
        print_message(result.found.missing)
