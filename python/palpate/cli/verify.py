"""`palpate verify`: compares a specimen of known modulus with a calibration."""

import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import click

from palpate import Calibration
from palpate.calibration.assessment import calibration_doubts
from palpate.calibration.assurance import CalibrationVerification
from palpate.calibration.calibration_file import add_verification
from palpate.calibration.learning import learned_from
from palpate.calibration.modulus_text import known_modulus, with_uncertainty
from palpate.calibration.origin import missing_remark
from palpate.calibration.specimen_files import name_key, read_moduli
from palpate.cli import touch_table
from palpate.cli.accept_option import accept_option
from palpate.cli.exit_codes import ExitCode, usage_errors
from palpate.cli.output import json_option, print_message, print_notes, print_result
from palpate.cli.paths import OUTPUT, InputFile, require_free, with_sidecar
from palpate.cli.shared_options import (
    SourceOptions,
    TrackerOptions,
    board_options,
    complete_source,
    replaying_options,
)
from palpate.cli.specimen_moduli import print_hardnesses
from palpate.cli.verified_touches import (
    Measurement,
    VerifiedTouch,
    VerifiedTouches,
    analyse,
    touches_in,
)
from palpate.errors import CalibrationError, need
from palpate.materials import KnownModulus
from palpate.messages import quoted, unlike
from palpate.report.findings import AnalysedRecording, known_moduli
from palpate.sources.options import is_file

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
@accept_option
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
    accept: tuple[str, ...],
    dry_run: bool,
    reading: SourceOptions,
    tracker: TrackerOptions,
) -> None:
    """Check with a specimen of known modulus whether a calibration still holds.

    FILE: recordings of touches on the specimen. If a sidecar says which touch was on which
    specimen (`palpate live`), those on SPECIMEN count, else all of them. SOURCE, as in `palpate
    record`: touch the specimen now. The result, with its date (UTC), is added to the calibration
    file. If it disagrees, each later use of the calibration warns, until a verification agrees.

    Exit codes: 0, the calibration agrees; 2, it is of another chip, or simulated; 4, not a
    recording, or not a calibration; 5, it disagrees, or is not reliable: no touch counts, fewer
    touches than --touches, a recording is not as it was written, the touches are simulated but the
    calibration is not, or the fit has an objection. The result is not added to the file if no touch
    counts, or if the recordings are no evidence.

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
    print_notes(calibration, [missing_remark(loaded.about.provenance)])
    if are_files:
        runs = [analyse(Path(source), loaded, reading, tracker) for source in sources]
        known = given or _modulus_in(runs, specimen, modulus_uncertainty)
        found = touches_in(runs, specimen, loaded, accept)
    else:
        if given is None:
            raise _no_modulus(specimen)
        known = given
        [source] = sources
        measurement = Measurement(source, touches, output, reading, tracker, accept)
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
class Result:
    """The result of `palpate verify`; verification: None if no touch counts, or they differ."""

    found: VerifiedTouches
    calibration: Calibration
    verification: CalibrationVerification | None
    learned: str
    """What the touches show of the contact exponent; "": nothing."""
    warnings: tuple[str, ...]
    """Why the calibration may be wrong, apart from its earlier verifications."""
    differ: str = ""
    """That the touches differ; "": they agree."""

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
            rows.append(touch_table.calibrated_row(one.number, one.touch, one.uncertainty))
            places.append(one.place)
            cells.append(self._cell(one))
        lines = touch_table.with_header(rows, touch_table.CALIBRATED_HEADER)
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
        if self.differ:
            lines.append(f"{self.differ}. Nothing is compared: touch the specimen again.")
            return lines
        if self.verification is None:
            lines.append("No touch counts, so nothing is compared: touch the specimen again.")
            return lines
        if self.learned:
            lines.append(self.learned)
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
        return _with_uncertainty(specimen, known, uncertainty)
    if table is None:
        return None
    moduli = read_moduli(table, print_message)
    known_name = _name_in(specimen, moduli)
    if known_name is None:
        raise CalibrationError(f"{table}: {unlike(specimen, moduli, 'specimen')}")
    return _with_uncertainty(known_name, moduli[known_name], uncertainty)


def _with_uncertainty(specimen: str, known: KnownModulus, text: str | None) -> KnownModulus:
    """Return a modulus with this uncertainty; print it if it is of a hardness."""
    if text is not None:
        try:
            known = with_uncertainty(known, text, None)
        except CalibrationError as error:
            raise click.BadParameter(str(error), param_hint="--modulus-uncertainty") from error
    print_hardnesses({specimen: known})
    return known


def _modulus_in(
    runs: Sequence[AnalysedRecording], specimen: str, uncertainty: str | None
) -> KnownModulus:
    """Return the modulus of the specimen in the sidecars of recordings."""
    moduli, _ = known_moduli(runs, {})
    name = _name_in(specimen, moduli)
    if name is None:
        raise _no_modulus(specimen)
    return _with_uncertainty(name, moduli[name], uncertainty)


def _no_modulus(specimen: str) -> click.UsageError:
    return click.UsageError(
        f"--modulus: missing: no modulus is known for {quoted(specimen)}, allowed: a modulus with "
        "its unit, as '1.1 MPa', or a table with --moduli"
    )


def _name_in(specimen: str, names: Iterable[str]) -> str | None:
    """Return the name that is written like a specimen; None: there is none."""
    wanted = name_key(specimen)
    return next((name for name in names if name_key(name) == wanted), None)


def _verified(
    found: VerifiedTouches, calibration: Calibration, specimen: str, known: KnownModulus
) -> Result:
    """Compare the touches with the calibration."""
    warnings = calibration_doubts(replace(calibration, verifications=()), found.scene)
    if not found.counted:
        return Result(found, calibration, None, "", tuple(warnings))
    # Their scatter narrows the range of the contact exponent; a changed gain does not bias it.
    learned = learned_from(calibration, {specimen: found.counted, **found.others})
    agreement = learned.calibration.agreement(found.counted)
    if not agreement.agree:
        differ = str(agreement)
        return Result(found, learned.calibration, None, "", tuple(warnings), differ)
    verification = learned.calibration.verify(
        found.counted, known.modulus, known.whole, specimen=specimen, date=found.date
    )
    return Result(found, learned.calibration, verification, learned.sentence, tuple(warnings))


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
