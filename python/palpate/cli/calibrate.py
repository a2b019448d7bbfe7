"""`palpate calibrate` and `palpate simulate`, which writes recordings to try it."""

import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import chain, count
from math import inf
from pathlib import Path

import click

from palpate import Calibration, Touch
from palpate.calibration.evidence import BUMPS
from palpate.calibration.placement import NumberedRatio, SpecimenRatios, misplaced_touches
from palpate.calibration.plot import save_plot
from palpate.calibration.selection import RatioChoice, Track, choose_ratio
from palpate.calibration.specimen_files import session_files, write_session
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens, specimen_table
from palpate.cli.calibration_origin import CalibratedOrigin, StatedOrigin, stated_options
from palpate.cli.exit_codes import ExitCode, usage_errors
from palpate.cli.output import (
    format_table,
    json_option,
    print_message,
    print_notes,
    print_result,
    progress_bar,
)
from palpate.cli.paths import (
    OUTPUT,
    OUTPUT_FOLDER,
    InputFile,
    Recordings,
    all_files,
    force_option,
    require_free,
    require_free_in,
)
from palpate.cli.shared_options import (
    Keywords,
    SourceOptions,
    TrackerOptions,
    parse_numbers,
    recording_options,
)
from palpate.cli.specimen_moduli import (
    about_moduli,
    has_session,
    moduli_of,
    parse_percent,
    print_hardnesses,
    with_stated,
)
from palpate.elasticity import SORBOTHANE_MPA
from palpate.errors import CalibrationError, need
from palpate.files import write_file
from palpate.flags import FEWEST, Flag
from palpate.materials import KnownModulus
from palpate.messages import listed, nearest, shortened
from palpate.repeatability import objections
from palpate.report import CalibrationHead, calibration_page
from palpate.report.calibration_head import left_out_touches
from palpate.report.findings import (
    AnalysedRecording,
    analyse_again,
    analyse_recording,
    assigned,
)
from palpate.simulation.hand import Hand, session
from palpate.uncertainty import RATIOS, TOUCH_SCATTER

_LONGEST_DOUBTS = 1000  # characters


@click.command("calibrate")
@click.argument(
    "files", metavar="FILE...", nargs=-1, required=True, type=Recordings(), callback=all_files
)
@click.option(
    "--moduli",
    type=InputFile(),
    help="Table with two columns: name of the specimen, modulus in MPa (or Shore A, if it says so); "
    "a third one may have the standard uncertainty of the modulus. Default: those of the sidecars.",
)
@click.option(
    "--moduli-uncertainty",
    "uncertainty",
    callback=parse_percent,
    metavar="PERCENT",
    help="Standard uncertainty (k = 1) of each modulus that has none of its own, as 5%.  "
    "[default: exact]",
)
@click.option(
    "-o", "output", required=True, type=OUTPUT, help="The calibration file to write, TOML."
)
@click.option("--plot", type=OUTPUT, help="The plot to write: .png, .pdf or .svg.")
@click.option("--report", type=OUTPUT, help="The report to write, HTML: table, fit and plot.")
@click.option(
    "--by",
    default="all",
    show_default=True,
    help="Values to fit: all touches, or for each specimen one of mean, weighted, agreement, "
    "standard_error, covariance.",
)
@click.option(
    "--ratio",
    type=click.Choice([*RATIOS]),
    help="Ratio of a touch: hold, or level, over the swept depth.  "
    "[default: by the error on specimens left out]",
)
@click.option(
    "--bumps",
    type=click.Choice([*BUMPS]),
    help="Shape of the bumps: flat (force ~ depth) or domes (force ~ depth^1.5).  [default: what "
    "repeated touches leave open]",
)
@click.option(
    "--age",
    type=click.FloatRange(min=0),
    help="End of a touch, s from where it has settled; 0: its length.  [default: by the error on "
    "specimens left out]",
)
@click.option(
    "--free-soft-ratio",
    is_flag=True,
    help="Fit the ratio on an infinitely soft object, too: for channels with different gains.",
)
@click.option(
    "--accept",
    multiple=True,
    metavar="FLAG",
    type=click.Choice(list(map(str, Flag))),
    help="Use touches with this flag all the same; may be repeated. The file says so.",
)
@stated_options
@force_option
@recording_options
@json_option
def calibrate_command(
    files: tuple[Path, ...],
    moduli: Path | None,
    uncertainty: float | None,
    output: Path,
    plot: Path | None,
    report: Path | None,
    by: str,
    ratio: str | None,
    bumps: str | None,
    age: float | None,
    free_soft_ratio: bool,
    accept: tuple[str, ...],
    force: bool,
    stated: StatedOrigin,
    reading: SourceOptions,
    tracker: TrackerOptions,
) -> None:
    """Fit a calibration to recordings of touches on known objects.

    FILE may be a folder, or a pattern in quotes as "monday/**.csv"; a table of moduli among the
    files, by --moduli or named moduli.csv, is not read as a recording.

    A recording may hold several touches. If its sidecar says which touch was on which specimen
    (`palpate live`), that and its moduli are used, those of --moduli before them, and touches that
    were discarded are left out. Else all of its touches are on one specimen, and the file name
    begins with its name (30OO-2.csv belongs to "30 OO"). A touch weighs by its standard error and
    the scatter from touch to touch. One that is only short is used if it has a standard error; with
    another flag it is left out, and the flag is printed. What is wrong with a recording appears on
    standard error and in the notes of --json. Exit codes: 2, simulated recordings and recordings
    from a probe together; 4, not a recording, a damaged one, not a table of moduli, no calibration
    possible, or an output exists; 5, written, but not reliable (the verdict says why, or a
    recording is not as it was written).

    \b
    Example:
      palpate calibrate specimens/*A.csv specimens/*O.csv --moduli specimens/moduli.csv -o probe.toml --plot probe.png
      palpate calibrate palpate-2026-11-22-1.csv -o probe.toml
    """  # noqa: D301
    outputs = filter(None, (output, plot, report))
    inputs = filter(None, (*files, moduli))
    require_free(outputs, inputs, force=force)
    need("scipy", "science")  # before the touches are measured
    if plot:
        need("matplotlib", "science")
    if report:
        need("jinja2", "report")
    tracking = tracker.with_settings(age=age).keywords()
    runs = []
    for file in files:
        if moduli is None or file.resolve() != moduli.resolve():
            runs.append(_analyse(file, reading, tracking))
    origin = CalibratedOrigin(runs)
    with usage_errors():
        provenance = origin.provenance([reading.soft, moduli], stated)
    modulus_of = with_stated(moduli_of(runs, moduli), uncertainty)
    print_hardnesses(modulus_of)
    chosen = _choose_ratio(runs, modulus_of, ratio, bumps, accept)
    runs = [analyse_again(run, {**run.tracking, **chosen.settings}) for run in runs]
    specimens = _usable_specimens(runs, modulus_of, accept, chosen)
    doubts: list[str] = []
    notes = _origin_notes(origin)
    notes += _misplaced_notes(runs, modulus_of, accept, chosen)
    for run in runs:
        doubts += [f"{run.name}: {doubt}" for doubt in run.recording.doubts]
        notes += [f"{run.recording.path}: {note}" for note in run.recording.notes]
    doubts += _duplicates(runs)
    about = replace(
        chosen.about,
        scene=tracking["scene"],
        accepted_flags=accept,
        notes=about_moduli(modulus_of, specimens, uncertainty),
        provenance=provenance,
    )
    if doubts:
        about = replace(about, doubts=(shortened("; ".join(doubts), _LONGEST_DOUBTS),))
    with usage_errors():
        soft_ratio = None if free_soft_ratio else 1.0
        calibration = fit_specimens(
            specimens, by=by, exponents=chosen.exponents, soft_ratio=soft_ratio, about=about
        )
        if plot:
            save_plot(calibration.curve(400), plot)
        if report:
            left_out = left_out_touches(runs, modulus_of, accept, chosen.ratio_of)
            head = CalibrationHead.of_recordings(runs, moduli=moduli, left_out=left_out)
            page = calibration_page(calibration, specimens, head)
            write_file(report, page.encode(errors="replace"))
        calibration.save(output)
    document = {
        "calibration": str(output),
        **calibration.as_dict(),
        "sound": calibration.sound,
        "specimens": [specimen.as_dict() for specimen in specimens],
        "notes": notes,
    }
    print_result(document, _fit_text(calibration, specimens, chosen))
    if doubts or not calibration.sound:
        sys.exit(ExitCode.NOT_RELIABLE)


def _analyse(file: Path, reading: SourceOptions, tracking: Keywords) -> AnalysedRecording:
    """Measure the touches of a recording, and print the notes on it."""
    with usage_errors(f"{file}: "):
        run = analyse_recording(file, file.name, tracking, **reading.keywords())
    print_notes(file, [run.recording.understood, *run.recording.notes])
    return run


def _origin_notes(origin: CalibratedOrigin) -> list[str]:
    """Return notes on recordings whose origins differ, and print them."""
    notes = origin.notes()
    for note in notes:
        print_message(note)
    return notes


def _choose_ratio(
    runs: Sequence[AnalysedRecording],
    moduli: Mapping[str, KnownModulus],
    ratio: str | None,
    bumps: str | None,
    accept: Collection[str],
) -> RatioChoice:
    """Return which ratio of the touches to use."""
    tracks = []
    for run in runs:
        specimens = {}
        for touch, name, left_out in assigned(run, moduli):
            if name in moduli and not left_out:
                specimens[touch.start] = name
        tracks.append(Track(run.recording, run.tracking, specimens))
    with usage_errors():
        known = {name: one.modulus for name, one in moduli.items()}
        return choose_ratio(tracks, known, ratio=ratio, bumps=bumps, accept=accept)


def _usable_specimens(
    runs: Sequence[AnalysedRecording],
    moduli: Mapping[str, KnownModulus],
    accept: tuple[str, ...],
    chosen: RatioChoice,
) -> list[SpecimenTouches]:
    """Return the specimens with a usable touch, in order of modulus; print the others with the reason."""
    touches_of = _touches_of_specimens(runs, moduli, accept, chosen)
    flags: set[str] = set()
    for touch in chain.from_iterable(touches_of.values()):
        flags.update(touch.flags)
    for flag in set(accept) - flags:
        existing = " ".join(sorted(flags)) or "none"
        print_message(f"--accept {flag}: no touch has this flag; those found: {existing}")
    specimens = []
    for name, known in sorted(moduli.items(), key=lambda item: item[1].modulus):
        touches = touches_of[name]
        specimen = SpecimenTouches(
            name,
            known.modulus,
            touches,
            accept,
            chosen.ratio_of,
            modulus_uncertainty=known.own,
            common_uncertainty=known.common,
        )
        if specimen.counted:
            specimens.append(specimen)
        elif touches:
            reason = f"{len(touches)} touches, none of them usable"
            print_message(f"{name}: {reason}: the specimen is left out")
        else:
            print_message(f"{name}: no touches: the specimen is left out")
    return specimens


def _touches_of_specimens(
    runs: Sequence[AnalysedRecording],
    moduli: Mapping[str, KnownModulus],
    accept: tuple[str, ...],
    chosen: RatioChoice,
) -> dict[str, list[Touch]]:
    """Return the touches on each specimen that are not left out by hand; print each left out."""
    touches: dict[str, list[Touch]] = {name: [] for name in moduli}
    without_modulus: set[str] = set()
    for run in runs:
        for number, (touch, name, left_out) in enumerate(assigned(run, moduli), 1):
            place = f"touch {number} of {run.name}"
            if not name:
                reason = left_out or "no specimen is named for it"
                print_message(f"{place} is left out: {reason}")
                continue
            if name not in moduli:
                if not has_session(run):
                    raise _unknown_specimen(run, name, moduli)
                without_modulus.add(name)
                continue
            if left_out:
                print_message(f"{name}: {place} is left out: {_reason_text(left_out, touch)}")
                continue
            touches[name].append(touch)
            reasons = objections(touch, accept, chosen.ratio_of)
            if reasons:
                text = ", ".join(_reason_text(reason, touch) for reason in reasons)
                print_message(f"{name}: {place} is left out: {text}")
    for name in sorted(without_modulus):
        print_message(f"{name}: no modulus is known: the specimen is left out")
    return touches


def _misplaced_notes(
    runs: Sequence[AnalysedRecording],
    moduli: Mapping[str, KnownModulus],
    accept: Collection[str],
    chosen: RatioChoice,
) -> list[str]:
    """Return which touches fit another specimen better, and print it."""
    ratios: dict[str, list[NumberedRatio]] = {name: [] for name in moduli}
    ids = count(1)
    for run in runs:
        for number, (touch, name, left_out) in enumerate(assigned(run, moduli), 1):
            is_counted = name in moduli and not left_out
            if is_counted and not objections(touch, accept, chosen.ratio_of):
                ratio, _ = chosen.ratio_of(touch)
                place = f"touch {number} of {run.name}"
                ratios[name].append(NumberedRatio(next(ids), ratio, place))
    specimens = []
    for name, known in moduli.items():
        specimens.append(SpecimenRatios(name, known.modulus, tuple(ratios[name])))
    notes = [each.text for each in misplaced_touches(specimens)]
    for note in notes:
        print_message(note)
    return notes


def _unknown_specimen(
    run: AnalysedRecording, name: str, moduli: Mapping[str, KnownModulus]
) -> CalibrationError:
    allowed = f"a name that begins with one of {listed(moduli)}{nearest(name, moduli)}"
    return CalibrationError(f"{run.recording.path}: no specimen has this name, allowed: {allowed}")


def _reason_text(reason: str, touch: Touch) -> str:
    """Return why a touch is left out; a short touch is explained."""
    if reason != Flag.SHORT:
        return reason
    if touch.age_s:
        return "short, it did not reach the age"
    return f"short, below {FEWEST} samples or without a standard error"


def _duplicates(runs: Sequence[AnalysedRecording]) -> list[str]:
    """Return which recordings have the same touches as an earlier one, and print it."""
    first: dict[str, Path] = {}
    sentences = []
    for run in runs:
        touches = run.found.touches
        if not touches:
            continue
        # As text, where nan is equal to nan.
        key = repr([(touch.samples, touch.ratio, touch.standard_error) for touch in touches])
        path = run.recording.path
        earlier = first.setdefault(key, path)
        if earlier is not path:
            sentence = f"{path}: has the touches of {earlier}: each of them counts again"
            sentences.append(sentence)
            print_message(sentence)
    return sentences


def _fit_text(
    calibration: Calibration, specimens: Sequence[SpecimenTouches], chosen: RatioChoice
) -> str:
    """Return the specimens, why the ratio was chosen, the parameters and the verdict."""
    lines = [format_table(specimen_table(specimens)), ""]
    for name, text in chosen.about.entries().items():
        lines.append(f"{name}: {text}")
    lines += [*calibration.about.provenance.lines(), ""]
    lines.append(f"{'parameter':15} {'value':>12}   95 % interval")
    for name, value, interval in calibration.parameter_rows():
        lines.append(f"{name:15} {value:>12}   {interval}")
    lines += ["", calibration.verdict]
    return "\n".join(lines)


def _parse_objects(
    _context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]
) -> dict[str, float]:
    moduli = parse_numbers(texts, "gel=1.1")
    for name, modulus in moduli.items():
        if not name or set(name) & set("/\\") or not 0 < modulus < inf:
            allowed = "NAME=MPA, for example gel=1.1"
            raise click.BadParameter(f"got {name}={modulus:g}, allowed: {allowed}")
    return moduli


@click.command("simulate")
@click.option("-o", "folder", required=True, type=OUTPUT_FOLDER, help="The folder to write in.")
@click.option(
    "--object",
    "objects",
    multiple=True,
    callback=_parse_objects,
    metavar="NAME=MPA",
    help="An object and its modulus; may be repeated.  [default: ten specimens, Table I of the "
    "paper]",
)
@click.option(
    "--touches",
    default=4,
    show_default=True,
    type=click.IntRange(1, 100),
    help="Touches on each object.",
)
@click.option(
    "--oblique",
    default=TOUCH_SCATTER,
    show_default=True,
    type=click.FloatRange(0, 0.5),
    help="Scatter of the ratio from touch to touch, relative.",
)
@click.option(
    "--seed",
    default=0,
    show_default=True,
    type=click.IntRange(min=0),
    help="The same seed gives the same files.",
)
@force_option
@json_option
def simulate_command(
    folder: Path, objects: dict[str, float], touches: int, oblique: float, seed: int, force: bool
) -> None:
    """Write simulated recordings of touches on known objects.

    Use it to try `calibrate` without a probe. Writes a file for each object, and moduli.csv with
    the true moduli. Exit code 4: one of the files exists.

    \b
    Example:
      palpate simulate -o specimens
      palpate simulate -o gel --object gel=1.1 --seed 7
    """  # noqa: D301
    moduli = objects or SORBOTHANE_MPA
    require_free_in(folder, session_files(folder, moduli), force=force)
    with progress_bar("simulate", len(moduli)) as bar:

        def update(done: int, _: int) -> None:
            bar.update(done - bar.pos)

        simulations = session(
            seed, hand=Hand(oblique=oblique), moduli=moduli, touches=touches, progress=update
        )
    blocks = {name: simulation.block() for name, simulation in simulations.items()}
    paths = list(map(str, write_session(folder, blocks, moduli)))
    print_result({"files": paths}, "\n".join(paths))
