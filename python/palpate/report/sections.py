"""The texts and tables of a report that its template cannot make by itself."""

import hashlib
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import UTC, datetime, timedelta
from math import isfinite, isnan, nan
from pathlib import Path, PurePath
from typing import Any

from palpate import digits
from palpate._core import __version__
from palpate.calibration import plot, verdict
from palpate.calibration.calibration import Calibration, Modulus
from palpate.calibration.fit_tables import parameter_rows
from palpate.display.markup import LEFT_OUT, MINUS, NONE
from palpate.display.text import counted, lasting
from palpate.errors import shortened
from palpate.files import open_regular
from palpate.recording import sidecar
from palpate.report.findings import Findings, Found, Result, Run
from palpate.tables.packed import unpacked_name

_LONGEST = 300  # characters of a text from a sidecar
_MOST_NAMED = 3  # specimens in the first sentence


def context(found: Findings, files: Mapping[str, Path], given: list[tuple[str, str]]) -> dict[str, Any]:
    """Return all that the template shows; `files`: calibration and moduli, `given`: the options of the report."""
    asked, notes, runs = dict(given), [text for name, text in given if name == "note"], found.runs
    each = counted(len(runs), "recording") if len(runs) > 1 else runs[0].name
    title = asked.get("title") or _listed(run.plan.title for run in runs) or f"Report of {each}"
    sums = {name: _checksum(file) for run in runs for name, file in _files(run)}
    return {
        "title": title,
        "simulated": _simulated(runs),
        "doubts": _doubts(found),
        "named": _named(found.results),
        "verdict": " ".join(_sentences(found)),
        "who": {
            "Operator": asked.get("operator") or _listed(run.plan.operator for run in runs),
            "Begin": _when(runs),
            **{f"Note {at}" if at > 1 else "Note": text for at, text in enumerate(notes, 1)},
        },
        "probe": {
            "Probe": f"calibration {files['calibration'].name}" if "calibration" in files else "not calibrated",
            **_board(runs),
            "Recordings": each,
            **_rows(runs),
        },
        "found": found,
        "calibration": None,
        "version": __version__,
        **(fitted(found.calibration, found.results) if found.calibration else {}),
        "recordings": [row for run in runs for row in _recording(run)],
        "happened": [[run.name, clock(t_s - run.first_s), *what] for run in runs for t_s, *what in _happened(run)],
        "settings": {**_settings(runs), "Reported by": f"palpate {__version__}"},
        "sums": sums | {file.name: _checksum(file) for file in files.values()},
        "commands": _commands(runs, [*((name, file.name) for name, file in files.items()), *given]),
    }


def fitted(calibration: Calibration, results: Iterable[Result] = ()) -> dict[str, Any]:
    """Return what the template shows of a calibration, and of the moduli that it gave."""
    seen = [
        (one.name, one.together.ratio, one.modulus)
        for one in results
        if one.known is None and one.together and one.modulus and isfinite(one.modulus.value)
    ]
    return {
        "calibration": calibration,
        "picture": plot.picture(calibration, seen),
        "rings": bool(seen),
        "parameters": parameter_rows(calibration),
        "distances": [_distance(calibration, one) for one in calibration.residuals],
        "about": ", ".join(f"{key}: {value}" for key, value in calibration.about.items()),
    }


def clock(seconds: float) -> str:
    """Return a time since the begin of a recording; `NONE`: unknown."""
    return NONE if isnan(seconds) else lasting(timedelta(seconds=seconds))


def percent(share: float) -> str:
    """Return an error in percent; `NONE`: unknown."""
    return digits.error(100 * share) if isfinite(share) else NONE


def signed(share: float) -> str:
    """Return a difference in percent, with its sign."""
    return f"{100 * share:+.1f}".replace("-", MINUS) if isfinite(share) else NONE


def modulus_cells(modulus: Modulus | None) -> tuple[str, str]:
    """Return the cells of a modulus and of its interval; without a value the second one says why."""
    if modulus is None:
        return NONE, NONE
    value, _, interval = str(modulus).partition(" (")
    beyond = ", beyond the specimens" if modulus.extrapolated else ""
    return (value.removesuffix(" MPa"), interval.rstrip(")") + beyond) if interval else (NONE, value + beyond)


def touch_modulus(found: Findings, one: Found) -> str:
    """Return the modulus of a touch that is kept."""
    if not (found.calibration and one.kept):
        return NONE
    error = one.touch.standard_error if isfinite(one.touch.standard_error) else None
    modulus = found.calibration.modulus(one.touch.ratio, error)
    return str(modulus).partition(" (")[0].removesuffix(" MPa")


def marks_in(one: Found) -> str:
    """Return the marks that were made during a touch."""
    end_s = one.touch.start_s + one.touch.samples * one.run.period_s
    return "; ".join(
        text for t_s, kind, text in _happened(one.run) if kind == "mark" and one.touch.start_s <= t_s <= end_s
    )


def _recording(run: Run) -> list[list[str]]:
    """Return two rows: begin, length, rows and lost samples; and what `check` found."""
    checked, survey = run.checked, run.checked.survey
    length = lasting(timedelta(seconds=survey.seconds)) if checked.timed else "unknown"
    share = digits.number(100 * survey.lost / (survey.rows + survey.lost)) if survey.lost else ""
    missing = f"{survey.lost} ({share} %) {survey.in_gaps}" if survey.lost else "0"
    retaken = run.found.retaken
    again = f"the baseline was measured again ({counted(retaken, 'time')})" if retaken else ""
    told = [checked.verdict, checked.understood, *checked.faults, *checked.findings, *run.recording.notes, again]
    return [[run.name, _begin(run) or "unknown", length, str(survey.rows), missing], ["", _listed(told, "; ")]]


SHOWN: dict[str, Any] = {
    "NONE": NONE,
    "LEFT_OUT": LEFT_OUT,
    **{use.__name__: use for use in (clock, counted, marks_in, modulus_cells, percent, signed, touch_modulus)},
}
"""What the template uses beside the context."""


def _listed(texts: Iterable[str], between: str = ", ") -> str:
    """Return texts in one line, each once, without empty ones."""
    return between.join(dict.fromkeys(filter(None, texts)))


def _distance(calibration: Calibration, one: verdict.Residual) -> list[str]:
    """Return the row of a specimen of a fit: its values, their mean, and its distance from the curve."""
    values = calibration.ratios[calibration.moduli == one.modulus].tolist()
    return [
        f"{one.modulus:g}", str(one.touches), digits.number(one.ratio, one.standard_error),
        digits.number(one.fitted, one.standard_error), verdict.percent(one).replace("-", MINUS),
        f"{one.standardised:+.1f}".replace("-", MINUS),
        ", ".join(digits.number(value, calibration.touch_spread * value) for value in values),
    ]  # fmt: skip


def _simulated(runs: list[Run]) -> str:
    """Return what to say of simulated data; "": there are none."""
    devices = {run.name: run.document.get("device", {}) for run in runs}
    made = [n for n, d in devices.items() if "simulated" in d or str(d.get("name", "")).startswith("simulated")]
    which = "" if len(made) == len(devices) else f" in {', '.join(made)}"
    return f"Simulated data{which}: no probe was used." if made else ""


def _doubts(found: Findings) -> list[str]:
    """Return why the report is not to be relied on."""
    doubts = [f"{run.name}: {doubt}" for run in found.runs for doubt in run.recording.doubts]
    if found.calibration:
        about, scenes = found.calibration.about, {run.tracking["scene"] for run in found.runs}
        if not found.calibration.sound:
            doubts.append(f"calibration: {found.calibration.verdict}")
        if made_of := about.get("doubts"):
            doubts.append(f"the calibration was made from recordings that were not as written: {made_of}")
        if (made_by := about.get("scene")) and scenes != {made_by}:
            doubts.append(
                f"the calibration was made with scene {made_by}, the touches with {', '.join(sorted(scenes))}"
            )
    return doubts if found.touches else [*doubts, "no touch was found"]


def _named(results: list[Result]) -> list[str]:
    """Return the moduli that were not known before, a sentence each."""
    unknown = [result for result in results if result.known is None and result.modulus]
    named = [f"{one.name}: {str(one.modulus).replace('(', '(95 %: ')}." for one in unknown[:_MOST_NAMED]]
    more = len(unknown) - _MOST_NAMED
    return [*named, f"{counted(more, 'more specimen')} below."] if more > 0 else named


def _sentences(found: Findings) -> Iterator[str]:
    if not found.touches:
        yield "No touch was found."
        return
    left = len(found.touches) - found.kept
    reasons = f"; {left} {_is(left)} left out, with reasons" if left else ""
    yield f"{found.kept} of {counted(len(found.touches), 'touch')} {_is(found.kept)} kept{reasons}."
    inside = [result.inside for result in found.results if result.inside is not None]
    if inside:
        yield f"{sum(inside)} of {len(inside)} known moduli {_is(sum(inside))} in the 95 % interval."
    if found.of_the_fit:
        yield f"{found.of_the_fit} of these touches are data of the calibration itself: for them that is no independent test."
    if found.calibration is None:
        yield "No calibration was given, so there are ratios, and no moduli."


def _is(count: int) -> str:
    return "is" if count == 1 else "are"


def _when(runs: list[Run]) -> str:
    begins = sorted(filter(None, map(_begin, runs)))
    return " to ".join(dict.fromkeys([begins[0], begins[-1]])) if begins else "unknown"


def _begin(run: Run) -> str:
    """Return when a recording began, UTC; "": unknown. By the epoch of its clock, else by the start of the program."""
    zero_ns = sidecar.zero_of(run.document)[0]
    if zero_ns is not None and isfinite(run.first_s):
        at = datetime.fromtimestamp(zero_ns / 1e9 + run.first_s, UTC)
        return f"{at:%Y-%m-%d %H:%M:%S} UTC"
    started = run.document.get("started")
    return f"{shortened(started).replace('T', ' ').removesuffix('+00:00')} UTC" if isinstance(started, str) else ""


def _board(runs: list[Run]) -> dict[str, str]:
    """Return the boards and the fingerprints of their chips."""
    devices = [run.document.get("device", {}) for run in runs]
    inner = [device["device"] if isinstance(device.get("device"), dict) else device for device in devices]
    chips = _listed(shortened(str(device.get("fingerprint", ""))) for device in devices)
    return {
        "Board": _listed(shortened(str(device.get("name", ""))) for device in inner),
        "Chip": f"fingerprint {chips}" if chips else "",
    }


def _rows(runs: list[Run]) -> dict[str, str]:
    """Return how many rows there are, and what the check says of them."""
    surveys = [run.checked.survey for run in runs]
    rows, lost, refused = (sum(getattr(one, name) for one in surveys) for name in ("rows", "lost", "refused"))
    without = f", {refused:,} without a value" if refused else ""
    return {
        "Rows": f"{rows:,}, {lost or 'none'} missing{without}",
        "Check": _listed(run.checked.verdict for run in runs),
    }


def _happened(run: Run) -> list[tuple[float, str, str]]:
    """Return marks, tares, gaps and notes: time, kind, text."""
    raw = [mark for mark in run.document.get("marks", []) if isinstance(mark, dict)]
    found = [
        (t_s, "gap" if mark.get("gap") is True else "tare" if mark.get("tare") is True else "mark", text)
        for mark, (t_s, text) in zip(raw, sidecar.marks_of(run.document), strict=True)
    ]
    found += [(note.t_s, "note", note.text) for note in run.plan.notes]
    found.sort(key=lambda one: (not isnan(one[0]), one[0]))
    general = [(nan, "note", shortened(str(note), _LONGEST)) for note in run.document.get("notes", [])]
    return general + found


def _settings(runs: list[Run]) -> dict[str, str]:
    """Return devices and settings; equal ones once, with the names of their recordings."""
    named: dict[tuple[str, str], list[str]] = {}
    for title, text_of in _SETTINGS.items():
        for run in runs:
            named.setdefault((title, text_of(run)), []).append(run.name)
    return {
        title if len(names) == len(runs) else f"{title}, {_first(names)}": text
        for (title, text), names in named.items()
    }


def _first(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"


def _flat(values: Any, name: str = "") -> str:
    """Return names and values as one line; a value in a table has both names."""
    if isinstance(values, Mapping):
        inner = (_flat(value, f"{name}.{key}" if name else str(key)) for key, value in values.items())
        return ", ".join(filter(None, inner))
    return f"{name} = {shortened(str(values), _LONGEST)}" if values is not None else ""


def _conditions(run: Run) -> str:
    """Return the range of temperature and supply of the chip, as the recording has them."""
    found = [one for one in run.document.get("conditions", []) if isinstance(one, dict)]
    values = {
        unit: [one[name] for one in found if isinstance(one.get(name), int | float)]
        for name, unit in {"temperature_C": "°C", "supply_V": "V"}.items()
    }
    return ", ".join(f"{min(of):.2f} to {max(of):.2f} {unit}" for unit, of in values.items() if of)


_SETTINGS: dict[str, Callable[[Run], str]] = {
    "Device": lambda run: _flat(run.document.get("device", {})),
    "Chip": _conditions,
    "Estimator": lambda run: _flat(run.tracking),
    "Recorded by": lambda run: _flat(run.document.get("versions", {})),
}


def _files(run: Run) -> list[tuple[str, Path]]:
    """Return a recording, and its sidecar if there is one, by their names in the report."""
    path = run.recording.path
    own = path.with_name(unpacked_name(path))
    beside = [sidecar.sidecar_path(own)] if own.suffix.lower() == ".csv" else []
    files = [path, *(file for file in beside if file.exists())]
    return [(PurePath(run.name).with_name(file.name).as_posix(), file) for file in files]


def _checksum(path: Path) -> str:
    opened: Any = open_regular(path)
    with opened as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _commands(runs: list[Run], options: Iterable[tuple[str, str]]) -> list[str]:
    """Return the commands that redo the report."""
    files = shlex.join(run.name for run in runs)
    given = [f" --{name} {shlex.quote(value)}" for name, value in options]
    of_replay = [option for option in given if option.startswith(" --calibration ")]
    return [
        f"palpate check {files}",
        f"palpate replay {files}{''.join(of_replay)}",
        f"palpate report {files}{''.join(given)}",
    ]
