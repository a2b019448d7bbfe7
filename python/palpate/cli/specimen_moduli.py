"""The moduli of the specimens of a calibration: from tables and sidecars, with their uncertainty."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import click

from palpate.calibration.modulus_text import percent_in
from palpate.calibration.specimen_files import read_moduli
from palpate.calibration.specimen_fit import SpecimenTouches
from palpate.cli.output import print_message
from palpate.materials import DUROMETER_POINTS, RELATION_UNCERTAINTY, KnownModulus
from palpate.report.findings import AnalysedRecording, known_moduli

_RELATION = (
    "Shore A is converted to a modulus by Gent's relation, with a standard uncertainty of "
    f"{100 * RELATION_UNCERTAINTY:g} % and, if none is stated, {DUROMETER_POINTS:g} points of the "
    "durometer"
)


def parse_percent(
    _context: click.Context, _parameter: click.Parameter, text: str | None
) -> float | None:
    """Return the relative uncertainty in a text such as 5%."""
    if text is None:
        return None
    try:
        return percent_in(text)
    except ValueError as error:
        raise click.BadParameter(str(error)) from error


def has_session(run: AnalysedRecording) -> bool:
    """Return whether the sidecar names the specimen of any touch."""
    return any(entry.specimen for entry in run.plan.touches)


def moduli_of(runs: Sequence[AnalysedRecording], table: Path | None) -> dict[str, KnownModulus]:
    """Return the moduli of a table, else of the sidecars; print where they differ."""
    without_session = [run.recording.path for run in runs if not has_session(run)]
    if table is None and without_session:
        raise click.UsageError(
            "--moduli: missing: allowed: a table of moduli, with the name of the specimen in each "
            "file name, for recordings whose sidecar names no specimens, as "
            f"{without_session[0]}"
        )
    from_table = read_moduli(table, print_message) if table else {}
    moduli, differences = known_moduli(runs, from_table)
    for difference in differences:
        print_message(f"{difference}, as {table} says")
    return moduli


def with_stated(
    moduli: Mapping[str, KnownModulus], stated: float | None
) -> dict[str, KnownModulus]:
    """Return the moduli with this uncertainty where they have none of their own."""
    if stated is None:
        return dict(moduli)
    changed = dict(moduli)
    for name, known in moduli.items():
        if known.uncertainty is None:
            changed[name] = replace(known, uncertainty=stated)
    if changed == moduli:
        print_message(
            f"--moduli-uncertainty {_percent(stated)}: not used: each modulus has its own"
        )
    return changed


def print_hardnesses(moduli: Mapping[str, KnownModulus]) -> None:
    """Print the moduli that were computed from a hardness."""
    for name, known in moduli.items():
        if known.hardness is not None:
            print_message(f"{name}: {known.hardness:g} Shore A is taken as {known} (k = 1)")
    if any(known.hardness is not None for known in moduli.values()):
        print_message(f"{_RELATION}; a measured modulus is better")


def about_moduli(
    moduli: Mapping[str, KnownModulus],
    specimens: Sequence[SpecimenTouches],
    stated: float | None,
) -> dict[str, str]:
    """Return the notes on the moduli for the file."""
    notes = {}
    hardnesses = []
    for specimen in specimens:
        known = moduli[specimen.name]
        if known.hardness is not None:
            hardnesses.append(f"{specimen.name} has {known.hardness:g}")
    if hardnesses:
        notes["moduli"] = f"{_RELATION}: {', '.join(hardnesses)}"
    if stated is not None:
        notes["uncertainty of moduli"] = f"{_percent(stated)} where none was stated (k = 1)"
    return notes


def _percent(share: float) -> str:
    return f"{100 * share:g} %"
