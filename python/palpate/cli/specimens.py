"""The touches of each specimen for `palpate calibrate`: as the sidecars say, else as the names of the files."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from palpate.cli.options import tracking
from palpate.cli.progress import Reading
from palpate.errors import CalibrationError, RecordingError
from palpate.recording import sidecar
from palpate.recording.session import Plan, plan_of

if TYPE_CHECKING:
    from palpate import Touch
    from palpate.calibration.characterise import Specimen

NO_MODULI = (
    "missing: allowed: a table of moduli, with the name of the specimen in each file name, for recordings whose sidecar "
    "names no specimens"
)


class Told(NamedTuple):
    """Notes on the recordings; and those which say that one is not as it was written."""

    notes: list[str]
    doubts: list[str]
    progress: Reading


class One(NamedTuple):
    """A touch of a file, its number there, and why it is left out; "": it is kept."""

    file: Path
    number: int
    touch: "Touch"
    why: str = ""


def specimens_of(
    files: Sequence[Path], moduli: Path | None, how: dict[str, Any], accept: tuple[str, ...], told: Told
) -> "list[Specimen]":
    """Return the specimens with a usable touch, in order of modulus; print which touches are left out, and why.

    Raises
    ------
    click.UsageError
        A recording names no specimens, and there is no table of moduli; or it cannot be read with these options.
    CalibrationError, RecordingError
        As from `read_moduli`, `assign` and `palpate.touches`; or two recordings have other moduli for a specimen.
    """
    from palpate.calibration.characterise import Specimen
    from palpate.calibration.specimen_files import assign, read_moduli

    files = [file for file in files if moduli is None or file.resolve() != moduli.resolve()]
    planned = {file: plan for file in files if (plan := _plan(file)).touches}
    if moduli is None and len(planned) < len(files):
        raise click.UsageError(f"--moduli: {NO_MODULI}, as {next(file for file in files if file not in planned)}")
    listed = read_moduli(moduli) if moduli else {}
    named = assign([file for file in files if file not in planned], listed)
    names = _Names(listed, moduli, told)
    for file, plan in planned.items():
        names.add(file, plan)
    found = _by_plans(planned, names, how, told)
    for name, own in named.items():
        found[name] += [One(file, *each) for file in own for each in enumerate(_touches(file, how, told)[0], 1)]
    order = sorted(names.moduli, key=lambda name: names.moduli[name])
    specimens = [
        Specimen(name, names.moduli[name], [one.touch for one in found[name] if not one.why], accept) for name in order
    ]
    with told.progress.aside():
        kept = [
            one for one in specimens if _tell(one.name, found[one.name], accept, bool(named.get(one.name) or planned))
        ]
    _tell_unused(accept, {flag for specimen in specimens for touch in specimen.touches for flag in touch.flags}, told)
    return kept


def _by_plans(planned: Mapping[Path, Plan], names: "_Names", how: dict[str, Any], told: Told) -> dict[str, list[One]]:
    """Return the touches of the specimens that the sidecars name, and of all others none; print which have no modulus."""
    found: dict[str, list[One]] = {name: [] for name in names.moduli}
    for file, plan in planned.items():
        for name, one in _by_plan(file, plan, names, how, told):
            found.setdefault(name, []).append(one)
    for name in found.keys() - names.moduli.keys():
        told.progress.echo(f"{name}: no modulus is known: the specimen is left out", err=True)
    return found


def _tell_unused(accept: tuple[str, ...], carried: set[str], told: Told) -> None:
    for flag in set(accept) - carried:
        told.progress.echo(
            f"--accept {flag}: no touch has this flag; those found: {' '.join(sorted(carried)) or 'none'}", err=True
        )


class _Names:
    """Moduli by the names of the specimens; those of the table win, and it is said."""

    def __init__(self, listed: Mapping[str, float], table: Path | None, told: Told) -> None:
        from palpate.calibration.specimen_files import bare

        self.moduli: dict[str, float] = dict(listed)
        self._bare = bare
        self._names = {bare(name): name for name in listed}
        self._origins: dict[str, Path | None] = dict.fromkeys(listed, table)
        self._table, self._told = table, told

    def of(self, name: str) -> str:
        """Return the name under which a specimen is known: blanks, dashes and capitals are no difference."""
        return self._names.setdefault(self._bare(name), name)

    def add(self, file: Path, plan: Plan) -> None:
        """Add the moduli of a recording."""
        for given, modulus in plan.moduli.items():
            name = self.of(given)
            known, origin = self.moduli.setdefault(name, modulus), self._origins.setdefault(name, file)
            if known == modulus:
                continue
            if origin != self._table or origin is None:
                raise CalibrationError(
                    f"{file}: {name}: got {modulus:g} MPa, allowed: {known:g} MPa, as in {origin}; or --moduli with a table"
                )
            self._told.progress.echo(
                f"{name}: {known:g} MPa, as {origin} says, not {modulus:g} MPa, as {file} says", err=True
            )


def _plan(file: Path) -> Plan:
    try:
        return plan_of(sidecar.load(file) or {})
    except RecordingError:  # the reader of the recording says so
        return Plan()


def _by_plan(file: Path, plan: Plan, names: _Names, how: dict[str, Any], told: Told) -> Iterator[tuple[str, One]]:
    """Yield the touches of a recording, each with the name of its specimen."""
    touches, period_s = _touches(file, how, told)
    for number, (touch, entry) in enumerate(zip(touches, plan.matched(touches, period_s), strict=True), 1):
        if entry and entry.specimen:
            yield names.of(entry.specimen), One(file, number, touch, entry.left_out)
        else:
            why = entry.left_out if entry and entry.left_out else "no specimen is named for it"
            told.progress.echo(f"touch {number} of {file.name} is left out: {why}", err=True)


def _tell(name: str, found: Sequence[One], accept: tuple[str, ...], has_files: bool) -> int:
    """Print which touches are left out, and for which flag; return the number of the others."""
    from palpate.several import objections

    usable = 0
    for file, number, touch, why in found:
        against = [why] if why else _words(objections(touch, accept))
        usable += not against
        if against:
            click.echo(f"{name}: touch {number} of {file.name} is left out: {', '.join(against)}", err=True)
    if not usable:
        why = f"no usable touch among {len(found)}" if found else "no touch found" if has_files else "no recording"
        click.echo(f"{name}: {why}: the specimen is left out", err=True)
    return usable


def _words(flags: tuple[str, ...]) -> list[str]:
    from palpate.several import FEWEST

    short = f"short, below {FEWEST} samples or without a standard error"
    return [short if flag == "short" else flag for flag in flags]


def _touches(file: Path, how: dict[str, Any], told: Told) -> "tuple[list[Touch], float]":
    """Return the touches of a recording, and the time from pair to pair, s."""
    from palpate import recorded, touches

    try:
        recording = recorded(file, **how["asked"])
        given = tracking(how["touch_seconds"], how["samples"], how["settings"])
        found = touches(recording, scene=how["scene"], **given)
    except (ValueError, TypeError) as error:
        raise click.UsageError(f"{file}: {str(error).splitlines()[0]}") from error
    for note in filter(None, [recording.understood, *recording.notes]):
        told.progress.echo(f"{file}: {note}", err=True)
    told.progress.end(file)
    told.notes.extend(f"{file}: {note}" for note in recording.notes)
    told.doubts.extend(f"{file.name}: {doubt}" for doubt in recording.doubts)
    return found, recording.survey.period_s
