"""`palpate calibrate`: fits a calibration to recordings; and `palpate simulate`, which writes some to try it."""

import math
import sys
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from palpate import Calibration, Touch
from palpate.calibration.plot import save_plot
from palpate.calibration.selection import EXPONENTS, RatioChoice, Track, choose_ratio
from palpate.calibration.specimen_files import read_moduli, session_files, write_session
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens, specimen_table
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
    force_option,
    require_free,
    require_free_in,
)
from palpate.cli.shared_options import (
    SourceOptions,
    TrackerOptions,
    parse_numbers,
    recording_options,
)
from palpate.elasticity import SORBOTHANE_MPA
from palpate.errors import CalibrationError, need
from palpate.files import write_file
from palpate.flags import FEWEST, Flag
from palpate.messages import listed, nearest, shortened
from palpate.repeatability import objections
from palpate.report import calibration_page
from palpate.report.findings import (
    AnalysedRecording,
    analyse_again,
    analyse_recording,
    assigned,
    known_moduli,
)
from palpate.simulation.hand import Hand, session
from palpate.uncertainty import RATIOS, TOUCH_SCATTER

_SHORT = f"short, below {FEWEST} samples or without a standard error"
_YOUNG = "short, it did not reach the age"


@click.command("calibrate")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=InputFile())
@click.option("--moduli", type=InputFile(), help="Table with two columns: name of the specimen, modulus in MPa. Default: "
              "those of the sidecars.")  # fmt: skip
@click.option(
    "-o", "output", required=True, type=OUTPUT, help="The calibration file to write, TOML."
)
@click.option("--plot", type=OUTPUT, help="The plot to write: .png, .pdf or .svg.")
@click.option("--report", type=OUTPUT, help="The report to write, HTML: table, fit and plot.")
@click.option("--by", default="all", show_default=True, help="Values to fit: all touches, or for each "
              "specimen one of mean, weighted, agreement, standard_error, covariance.")  # fmt: skip
@click.option("--ratio", type=click.Choice([*RATIOS]), help="Ratio of a touch: hold, or level, over the swept depth.  "
              "[default: the one that scatters less]")  # fmt: skip
@click.option("--contact-exponent", type=click.Choice([f"{p:g}" for p in EXPONENTS]), help="Of force against depth: 1, flat "
              "bumps; 1.5, domes.  [default: by the scatter]")  # fmt: skip
@click.option("--age", type=click.FloatRange(min=0),
              help="End of a touch, s from where it has settled; 0: its length.  [default: by the scatter]")  # fmt: skip
@click.option("--free-soft-ratio", is_flag=True,
              help="Fit the ratio on an infinitely soft object, too: for channels with different gains.")  # fmt: skip
@click.option("--accept", multiple=True, metavar="FLAG", type=click.Choice([flag.value for flag in Flag]),
              help="Use touches with this flag all the same; may be repeated. The file says so.")  # fmt: skip
@force_option
@recording_options
@json_option
def calibrate_command(
    files: tuple[Path, ...],
    moduli: Path | None,
    output: Path,
    plot: Path | None,
    report: Path | None,
    by: str,
    ratio: str | None,
    contact_exponent: str | None,
    age: float | None,
    free_soft_ratio: bool,
    accept: tuple[str, ...],
    force: bool,
    reading: SourceOptions,
    tracker: TrackerOptions,
) -> None:
    """Fit a calibration to recordings of touches on known objects.

    A recording may hold several touches. If its sidecar says which touch was on which specimen (`palpate live`), that and
    its moduli are used, those of --moduli before them, and touches that were discarded are left out. Else all of its
    touches are on one specimen, and the file name begins with its name (30OO-2.csv belongs to "30 OO"). A touch weighs by its standard error and the scatter from touch to touch. One that is
    only short is used if it has a standard error; with another flag it is left out, and the flag is printed. What is
    wrong with a recording appears on standard error and in the notes of --json. Exit codes: 4, not a recording, a
    damaged one, not a table of moduli, no calibration possible, or an output exists; 5, written, but not reliable (the
    verdict says why, or a recording is not as it was written).

    \b
    Example:
      palpate calibrate specimens/*A.csv specimens/*O.csv --moduli specimens/moduli.csv -o probe.toml --plot probe.png
      palpate calibrate palpate-2026-11-22-1.csv -o probe.toml
    """  # noqa: D301
    require_free(
        filter(None, [output, plot, report]), [*files, *filter(None, [moduli])], force=force
    )
    need("scipy", "science")  # before the touches are measured
    if plot:
        need("matplotlib", "science")
    if report:
        need("jinja2", "report")
    exponent = float(contact_exponent) if contact_exponent else None
    how = tracker.with_settings(contact_exponent=exponent, age=age).keywords()
    runs = [
        _run(file, reading.keywords(), how)
        for file in files
        if moduli is None or file.resolve() != moduli.resolve()
    ]
    known, chosen = _chosen(runs, moduli, ratio, accept)
    runs = [analyse_again(run, {**run.tracking, **chosen.settings}) for run in runs]
    specimens = _specimens(runs, known, accept, chosen)
    doubts = [f"{run.name}: {doubt}" for run in runs for doubt in run.recording.doubts] + _copies(
        runs
    )
    about = replace(
        chosen.about,
        scene=how["scene"],
        accepted_flags=accept,
        doubts=(shortened("; ".join(doubts), 1000),) if doubts else (),
    )
    with usage_errors():
        soft = None if free_soft_ratio else 1.0
        found = fit_specimens(specimens, by=by, soft_ratio=soft, about=about)
        if plot:
            save_plot(found.curve(400), plot)
        if report:
            write_file(report, calibration_page(found, specimens).encode())
        found.save(output)
    notes = [f"{run.recording.path}: {note}" for run in runs for note in run.recording.notes]
    more = {
        "sound": found.sound,
        "specimens": [one.summary().as_dict() for one in specimens],
        "notes": notes,
    }
    print_result(
        {"calibration": str(output), **found.as_dict(), **more},
        _fit_table(found, specimens, chosen),
    )
    sys.exit(0 if found.sound and not doubts else ExitCode.NOT_RELIABLE)


def _copies(runs: Sequence[AnalysedRecording]) -> list[str]:
    """Return which recordings have the same touches as one before, and print it."""
    first, found = dict[str, Path](), list[str]()
    for run in runs:
        touches = repr(
            [(touch.samples, touch.ratio, touch.standard_error) for touch in run.found.touches]
        )
        path = run.recording.path
        if run.found.touches and first.setdefault(touches, path) is not path:
            found.append(f"{path}: has the touches of {first[touches]}: each of them counts again")
            print_message(found[-1])
    return found


def _fit_table(found: Calibration, specimens: list[SpecimenTouches], chosen: RatioChoice) -> str:
    why = [f"{name}: {text}" for name, text in chosen.about.entries().items()]
    parameters = [
        f"{name:15} {value:>12}   {interval}" for name, value, interval in found.parameter_rows()
    ]
    return "\n".join(
        [
            format_table(specimen_table(specimens)),
            "",
            *why,
            *[""] * bool(why),
            *parameters,
            "",
            found.verdict,
        ]
    )


def _run(file: Path, asked: dict[str, Any], how: dict[str, Any]) -> AnalysedRecording:
    """Measure the touches of a recording, and print the notes on it."""
    with usage_errors(f"{file}: "):
        run = analyse_recording(file, file.name, how, **asked)
    print_notes(file, [run.recording.understood, *run.recording.notes])
    return run


def _chosen(
    runs: Sequence[AnalysedRecording],
    table: Path | None,
    ratio: str | None,
    accept: Collection[str],
) -> tuple[dict[str, float], RatioChoice]:
    """Return the moduli of a table, else of the sidecars, and which ratio of the touches to use; print differences."""
    unnamed = next(
        (run.recording.path for run in runs if not any(one.specimen for one in run.plan.touches)),
        None,
    )
    if table is None and unnamed:
        raise click.UsageError(
            "--moduli: missing: allowed: a table of moduli, with the name of the specimen in each file name, for recordings "
            f"whose sidecar names no specimens, as {unnamed}"
        )
    moduli, differences = known_moduli(runs, read_moduli(table, print_message) if table else {})
    for difference in differences:
        print_message(f"{difference}, as {table} says")
    named = [
        {t.start: name for t, name, out in assigned(run, moduli) if name in moduli and not out}
        for run in runs
    ]
    tracks = [
        Track(run.recording, run.tracking, names) for run, names in zip(runs, named, strict=True)
    ]
    with usage_errors():
        return moduli, choose_ratio(tracks, ratio=ratio, accept=accept)


def _specimens(
    runs: Sequence[AnalysedRecording],
    moduli: Mapping[str, float],
    accept: tuple[str, ...],
    chosen: RatioChoice,
) -> list[SpecimenTouches]:
    """Return the specimens with a usable touch, in order of modulus; print which touches are left out, and why."""
    found = _touches(runs, moduli, accept, chosen)
    flags = {flag for touches in found.values() for touch in touches for flag in touch.flags}
    for flag in set(accept) - flags:
        there = " ".join(sorted(flags)) or "none"
        print_message(f"--accept {flag}: no touch has this flag; those found: {there}")
    kept = []
    for name, modulus in sorted(moduli.items(), key=lambda item: item[1]):
        if any(not objections(touch, accept, chosen.ratio_of) for touch in found[name]):
            kept.append(SpecimenTouches(name, modulus, found[name], accept, chosen.ratio_of))
        else:
            none = (
                f"{len(found[name])} touches, none of them usable" if found[name] else "no touches"
            )
            print_message(f"{name}: {none}: the specimen is left out")
    return kept


def _touches(
    runs: Sequence[AnalysedRecording],
    moduli: Mapping[str, float],
    accept: tuple[str, ...],
    chosen: RatioChoice,
) -> dict[str, list[Touch]]:
    """Return the touches on each specimen, without those left out by hand; print what is left out, and why."""
    found: dict[str, list[Touch]] = {name: [] for name in moduli}
    unknown = set[str]()
    for run in runs:
        for number, (touch, name, left_out) in enumerate(assigned(run, moduli), 1):
            place = f"touch {number} of {run.name}"
            if not name:
                print_message(f"{place} is left out: {left_out or 'no specimen is named for it'}")
            elif name not in moduli and not any(one.specimen for one in run.plan.touches):
                allowed = f"a name that begins with one of {listed(moduli)}{nearest(name, moduli)}"
                raise CalibrationError(
                    f"{run.recording.path}: no specimen has this name, allowed: {allowed}"
                )
            elif name not in moduli:
                unknown.add(name)
            else:
                found[name] += [] if left_out else [touch]
                if (
                    against := [left_out]
                    if left_out
                    else objections(touch, accept, chosen.ratio_of)
                ):
                    short = _YOUNG if touch.age_s else _SHORT
                    reasons = ", ".join(short if flag == "short" else flag for flag in against)
                    print_message(f"{name}: {place} is left out: {reasons}")
    for name in sorted(unknown):
        print_message(f"{name}: no modulus is known: the specimen is left out")
    return found


def _objects(
    _context: click.Context, _parameter: click.Parameter, texts: tuple[str, ...]
) -> dict[str, float]:
    found = parse_numbers(texts, "gel=1.1")
    for name, modulus in found.items():
        if not name or set(name) & set("/\\") or not 0 < modulus < math.inf:
            raise click.BadParameter(
                f"got {name}={modulus:g}, allowed: NAME=MPA, for example gel=1.1"
            )
    return found


@click.command("simulate")
@click.option("-o", "folder", required=True, type=OUTPUT_FOLDER, help="The folder to write in.")
@click.option("--object", "objects", multiple=True, callback=_objects, metavar="NAME=MPA",
              help="An object and its modulus; may be repeated.  [default: ten specimens, Table I of the paper]")  # fmt: skip
@click.option(
    "--touches",
    default=4,
    show_default=True,
    type=click.IntRange(1, 100),
    help="Touches on each object.",
)
@click.option("--oblique", default=TOUCH_SCATTER, show_default=True, type=click.FloatRange(0, 0.5),
              help="Scatter of the ratio from touch to touch, relative.")  # fmt: skip
@click.option("--seed", default=0, show_default=True, type=click.IntRange(min=0),
              help="The same seed gives the same files.")  # fmt: skip
@force_option
@json_option
def simulate_command(
    folder: Path, objects: dict[str, float], touches: int, oblique: float, seed: int, force: bool
) -> None:
    """Write simulated recordings of touches on known objects.

    Use it to try `calibrate` without a probe. Writes a file for each object, and moduli.csv with the true moduli.
    Exit code 4: one of the files exists.

    \b
    Example:
      palpate simulate -o specimens
      palpate simulate -o gel --object gel=1.1 --seed 7
    """  # noqa: D301
    moduli = objects or SORBOTHANE_MPA
    require_free_in(folder, session_files(folder, moduli), force=force)
    with progress_bar("simulate", len(moduli)) as bar:
        tell = lambda done, _: bar.update(done - bar.pos)
        made = session(
            seed, hand=Hand(oblique=oblique), moduli=moduli, touches=touches, progress=tell
        )
    blocks = {name: run.block() for name, run in made.items()}
    paths = [str(path) for path in write_session(folder, blocks, moduli)]
    print_result({"files": paths}, "\n".join(paths))
