"""`palpate plot`: a recording with its touches, or a figure of the paper from own specimens."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import click

from palpate.cli.accept_option import accept_option
from palpate.cli.exit_codes import usage_errors
from palpate.cli.output import json_option, print_message, print_notes
from palpate.cli.paths import (
    OUTPUT,
    InputFile,
    Recordings,
    all_files,
    force_option,
    require_free,
)
from palpate.cli.recordings import finish
from palpate.cli.shared_options import SourceOptions, TrackerOptions, replaying_options
from palpate.cli.specimen_moduli import has_session, moduli_of
from palpate.materials import KnownModulus
from palpate.messages import listed
from palpate.recording.reading import recorded
from palpate.repeatability import objections
from palpate.report.findings import AnalysedRecording, analyse_recording, assigned
from palpate.touch import Touch
from palpate.tracking import tracked

_FIGURES = ("10", "11", "12")


@click.command("plot")
@click.argument(
    "files", metavar="FILE...", nargs=-1, required=True, type=Recordings(), callback=all_files
)
@click.option("-o", "output", required=True, type=OUTPUT, help="NAME.png, NAME.pdf or NAME.svg.")
@click.option(
    "--figure",
    type=click.Choice(_FIGURES),
    help="A figure of the paper from recordings on specimens of known modulus: 10, ratio against "
    "modulus with its scatter; 11, the touch with the smallest P against the mean; 12, equation "
    "(2) fitted to the touches with the smallest P.",
)
@click.option(
    "--moduli",
    type=InputFile(),
    help="With --figure: table of specimens and their moduli, as for `calibrate`.  "
    "[default: those of the sidecars]",
)
@accept_option
@replaying_options
@force_option
@json_option
def plot_command(
    files: tuple[Path, ...],
    output: Path,
    figure: str | None,
    moduli: Path | None,
    accept: tuple[str, ...],
    reading: SourceOptions,
    tracker: TrackerOptions,
    force: bool,
) -> None:
    """Draw a recording with the ratio of each touch, or a figure of the paper.

    Without --figure: above are the changes of both channels over time, below is the ratio of each
    touch at its begin. The touches are those of `palpate replay` with the same options.

    With --figure: FILE... are recordings of touches on specimens, as for `calibrate`: a sidecar or
    the file name says which specimen. FILE may be a folder. Touches with a flag are left out, and
    printed. The paper's estimator is --scene paper.

    What is wrong with a recording appears on standard error and in the notes of --json. Exit codes:
    4, not a recording, a damaged one, too few specimens, or the output exists; 5, drawn, but a
    recording is not as it was written; 6, matplotlib is missing.

    \b
    Example:
      palpate plot run.csv -o run.png
      palpate plot specimens --moduli specimens/moduli.csv --figure 11 -o figure-11.pdf
    """  # noqa: D301
    from palpate.display import plots

    with usage_errors():
        inputs = [*files, moduli] if moduli else files
        require_free([output], inputs, force=force)
        plots.require_figure_name(output)
    if figure is not None:
        _plot_figure(figure, files, output, moduli, accept, reading, tracker)
        return
    if moduli or accept:
        raise click.UsageError("--moduli, --accept: got them without --figure, allowed: with it")
    if len(files) > 1:
        allowed = "one recording, or several with --figure"
        raise click.UsageError(f"FILE: got {len(files)} recordings, allowed: {allowed}")
    [file] = files
    with usage_errors():
        recording = recorded(file, **reading.keywords())
        found = tracked(recording, **tracker.for_recording(recording)).touches
        plots.save_figure(recording.in_memory(), found, output)
    notes = list(filter(None, (recording.understood, *found.notes)))
    document: dict[str, object] = {
        "file": str(file),
        "written": str(output),
        "touches": len(found),
        "notes": notes,
    }
    finish(recording.doubts, document, notes, f"{output}: {len(found)} touches")


def _plot_figure(
    figure: str,
    files: Sequence[Path],
    output: Path,
    moduli: Path | None,
    accept: tuple[str, ...],
    reading: SourceOptions,
    tracker: TrackerOptions,
) -> None:
    """Draw a figure of the paper."""
    from palpate.calibration.paper_figures import save_paper_figure
    from palpate.calibration.specimen_fit import SpecimenTouches

    tracking = {"scene": "handheld"} | tracker.keywords()
    runs = []
    for file in files:
        if moduli is None or file.resolve() != moduli.resolve():
            with usage_errors(f"{file}: "):
                run = analyse_recording(file, file.name, tracking, **reading.keywords())
            print_notes(file, [run.recording.understood, *run.recording.notes])
            runs.append(run)
    known = moduli_of(runs, moduli)
    touches_of = _touches_by_specimen(runs, known, accept)
    specimens = []
    for name, one in sorted(known.items(), key=lambda item: item[1].modulus):
        specimen = SpecimenTouches(name, one.modulus, touches_of.get(name, []), accept)
        if specimen.counted:
            specimens.append(specimen)
        elif name in touches_of:
            print_message(f"{name}: no usable touch: the specimen is left out")
    if not specimens:
        raise click.UsageError(f"FILE: got no usable touch on {listed(known)}, allowed: some")
    with usage_errors():
        shown = save_paper_figure(figure, specimens, output)
    count = sum(len(specimen.usable) for specimen in specimens)
    doubts = [f"{run.name}: {doubt}" for run in runs for doubt in run.recording.doubts]
    document: dict[str, object] = {
        "file": str(output),
        "written": str(output),
        "figure": figure,
        "specimens": [specimen.as_dict() for specimen in specimens],
        "touches": count,
        "notes": [shown, *doubts],
    }
    text = f"{output}: {count} touches on {len(specimens)} specimens; {shown}"
    finish(doubts, document, doubts, text)


def _touches_by_specimen(
    runs: Sequence[AnalysedRecording], moduli: Mapping[str, KnownModulus], accept: tuple[str, ...]
) -> dict[str, list[Touch]]:
    """Return the touches on each specimen that are not left out by hand; print each left out."""
    touches: dict[str, list[Touch]] = {}
    for run in runs:
        for number, (touch, name, left_out) in enumerate(assigned(run, moduli), 1):
            place = f"touch {number} of {run.name}"
            if name not in moduli and not has_session(run):
                allowed = f"one that begins with the name of a specimen: {listed(moduli)}"
                raise click.UsageError(f"FILE: got {run.name}, allowed: {allowed}")
            against = left_out or ", ".join(map(str, objections(touch, accept)))
            if against:
                print_message(f"{place} is left out: {against}")
            if name in moduli and not left_out:
                touches.setdefault(name, []).append(touch)
    return touches
