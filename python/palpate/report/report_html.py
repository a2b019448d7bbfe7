"""Writes a report of recordings, or of a calibration, as one HTML file: its texts and tables, and the template filled."""

import hashlib
import os
import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from math import exp, inf, isfinite, isnan, nan
from pathlib import Path, PurePath
from typing import Any

from palpate import number_format
from palpate._core import __version__
from palpate.calibration import plot
from palpate.calibration.assessment import Residual
from palpate.calibration.model import Calibration
from palpate.calibration.modulus import Modulus
from palpate.calibration.specimen_files import read_moduli
from palpate.calibration.specimen_fit import SpecimenTouches, specimen_table
from palpate.calibration.validity import doubts_of_calibration
from palpate.display.markup import LEFT_OUT, MINUS, NONE, element
from palpate.display.text import counted, lasting
from palpate.errors import need
from palpate.files import unpacked_name, write_file
from palpate.materials import shore_a_of_modulus
from palpate.messages import shortened
from palpate.recording import sidecar
from palpate.report.findings import (
    AnalysedRecording,
    Findings,
    SpecimenResult,
    analyse_again,
    analyse_recording,
    findings,
)

_PathLike = str | os.PathLike[str]
_Event = tuple[float, str, str]
"""What happened in a recording: time, s (nan: unknown), kind, text."""
_LONGEST = 300  # characters of a text from a sidecar
_MOST_NAMED = 3  # specimens in the first sentence


@dataclass(frozen=True)
class WrittenReport:
    """A report that was written.

    Attributes
    ----------
    path : pathlib.Path
    verdict : str
        Its first sentences.
    doubts : tuple of str
        Why it is not to be relied on; empty: nothing is known against it.
    results : dict
        The results as plain numbers and text.
    """

    path: Path
    verdict: str
    doubts: tuple[str, ...]
    results: dict[str, Any]


def write_report(
    path: _PathLike,
    recordings: Sequence[_PathLike],
    calibration: _PathLike | None = None,
    *,
    moduli: _PathLike | None = None,
    title: str = "",
    operator: str = "",
    probe: str = "",
    site: str = "",
    unit: str = "MPa",
    shore: bool = False,
    notes: Sequence[str] = (),
    tell: Callable[[str], None] = lambda _: None,
) -> WrittenReport:
    """Write a report of recordings as one HTML file, which needs no other file; one of this name is replaced.

    The same files and arguments give the same bytes: there is no date of the report in it.

    Parameters
    ----------
    path : path-like
        The file to write.
    recordings : sequence of path-like
        One or more.
    calibration : path-like, optional
        File of `Calibration.save`: adds the moduli.
    moduli : path-like, optional
        Table of known moduli as for `palpate calibrate`: for recordings whose sidecar names no specimens.
    title, operator : str
        Default: those of the sessions in the sidecars.
    probe, site : str
        For the head of the report.
    unit : str
        Of the moduli of specimens and touches: "MPa" or "kPa".
    shore : bool
        Whether Shore A stands beside the moduli, by `shore_a_of_modulus`.
    notes : sequence of str
        For the head of the report.
    tell : callable
        Gets the progress as a text, often; an error that it raises ends the work, and nothing is written.

    Returns
    -------
    WrittenReport

    Raises
    ------
    RecordingError, CalibrationError
        A file is not what it should be.
    ValueError
        No recording, or a table that leaves open how it is read.
    MissingExtra
        jinja2 or scipy is missing; type: pip install 'palpate[report]'.

    Examples
    --------
    >>> import tempfile
    >>> made = write_report(Path(tempfile.mkdtemp()) / "report.html", ["tests/data/four-specimens.csv"])
    >>> made.results["touches"], made.path.name
    (4, 'report.html')
    """
    for module in ("scipy", "jinja2"):
        need(module, "report")  # before the recordings are read
    curve, table = (None if given is None else Path(given) for given in (calibration, moduli))
    known = read_moduli(table) if table else {}
    fitted = Calibration.load(curve) if curve else None
    runs = [
        analyse_recording(each, name, tell=tell)
        for name, each in _recordings(recordings, table).items()
    ]
    runs = (
        [analyse_again(run, fitted.for_tracking(run.tracking)) for run in runs] if fitted else runs
    )
    found = findings(runs, fitted, known)
    files = [("calibration", curve), ("moduli", table)]
    head = {
        "title": title,
        "operator": operator,
        "probe": probe,
        "site": site,
        "unit": "" if unit == "MPa" else unit,
    }
    options: list[tuple[str, Any]] = [
        *((name, file and file.name) for name, file in files),
        *head.items(),
    ]
    options += [("shore", shore), *(("note", note) for note in notes)]
    shown = _shown(
        found,
        [(name, text) for name, text in options if text],
        [file for _, file in files if file],
        tell,
    )
    write_file(
        Path(path), _render(shown).encode(errors="replace")
    )  # a name of a file may be no text
    results: dict[str, Any] = {"touches": len(found.touches), "kept": shown["kept"]}
    results["specimens"] = [result.as_dict() for result in found.results]
    results["repeatability"] = shown["repeatability"] and shown["repeatability"].as_dict()
    return WrittenReport(
        Path(path), " ".join([*shown["named"], shown["verdict"]]), tuple(shown["doubts"]), results
    )


def calibration_page(calibration: Calibration, specimens: Sequence[SpecimenTouches]) -> str:
    """Return the report of a calibration as one HTML page without external files."""
    head, *rows = specimen_table(specimens)
    records = [dict(zip(head, row, strict=True)) for row in rows]
    return _render(
        {
            "title": "Calibration of a probe",
            "found": None,
            "specimens": records,
            **_fitted(calibration),
        }
    )


def _render(context: Mapping[str, Any]) -> str:
    """Return a page: everything in the context is escaped but markup, and a name that it lacks is an error."""
    jinja2 = need("jinja2", "report")
    how = {
        "undefined": jinja2.StrictUndefined,
        "autoescape": True,
        "trim_blocks": True,
        "lstrip_blocks": True,
    }
    pages = jinja2.Environment(loader=jinja2.FileSystemLoader(Path(__file__).parent), **how)
    pages.globals.update(
        exp=exp, digits=number_format, columns=_columns, counted=counted, NONE=NONE
    )
    pages.filters["percent"] = _percent
    return str(pages.get_template("report.html.j2").render(context)).lstrip()


def _recordings(recordings: Sequence[_PathLike], table: Path | None) -> dict[str, Path]:
    """Return the recordings by the names that the report has for them, without the table of moduli."""
    paths = [
        Path(each) for each in recordings if not (table and Path(each).resolve() == table.resolve())
    ]
    if not paths:
        raise ValueError("recordings: got none, allowed: one or more")
    alone = len({path.name for path in paths}) == len(paths)
    if len({path.resolve() for path in paths}) < len(paths):
        raise ValueError("recordings: got one twice, allowed: each once")
    return {path.name if alone else path.as_posix(): path for path in paths}


_Row = dict[str, object] | str
"""A row of a table: cells by their columns, or a text about the row above."""
_WORDS = {
    "Recording", "Specimen", "95 % interval", "Inside", "Parameter", "Value", "Values", "Mark", "Missing", "Check",
    "What", "Text", "specimen",
}  # fmt: skip
"""Columns that are no numbers."""


def _columns(rows: list[_Row]) -> list[tuple[str, str]]:
    """Return the columns that have a value in any row, and the class of each."""
    cells = [row for row in rows if isinstance(row, dict)]
    return [
        (name, "w" if name in _WORDS else "")
        for name in cells[0]
        if any(row[name] != "" for row in cells)
    ]


def _in(unit: str, text: str) -> str:
    """Return a text with moduli in MPa in a unit: with the same digits."""
    if unit == "MPa":
        return text
    number = re.compile(r"\d+(?:\.(\d+))?(?:e-?\d+)?")
    in_kPa = number.sub(
        lambda one: f"{1000 * float(one[0]):.{max(0, len(one[1] or '') - 3)}f}", text
    )
    return in_kPa.replace("MPa", unit)


def _shown(
    found: Findings, options: list[tuple[str, Any]], files: list[Path], tell: Callable[[str], None]
) -> dict[str, Any]:
    """Return all that the template shows, from findings, the options of the command, and the files that these name."""
    asked, runs = dict(options), found.runs
    given = [
        f" --{name}" + ("" if text is True else f" {shlex.quote(text)}") for name, text in options
    ]
    unit, shore, names = (
        asked.get("unit", "MPa"),
        "shore" in asked,
        shlex.join(run.name for run in runs),
    )
    each = counted(len(runs), "recording") if len(runs) > 1 else runs[0].name
    counts = [
        sum(getattr(run.recording.survey, name) for run in runs)
        for name in ("rows", "lost", "refused")
    ]
    begins = sorted(filter(None, map(_begin, runs)))
    sources = [
        *(source for run in runs for source in _files(run)),
        *((file.name, file) for file in files),
    ]
    kept = [one for one in found.touches if not one.left_out]
    happened = {run.name: _happened(run) for run in runs}
    return {
        "title": asked.get("title")
        or _listed(run.plan.title for run in runs)
        or f"Report of {each}",
        "simulated": _simulated(runs),
        "doubts": _doubts(found),
        "named": _named(found.results, unit),
        "verdict": " ".join(_sentences(found, len(kept), *counts)),
        "head": [
            ("Operator", asked.get("operator") or _listed(run.plan.operator for run in runs)),
            ("Begin", _listed([*begins[:1], *begins[-1:]], " to ") or "unknown"),
            *((name.capitalize(), text) for name, text in options if name == "note"),
            ("Probe", asked.get("probe")),
            ("Site", asked.get("site")),
            ("Calibration", asked.get("calibration", "none")),
            ("Board", _listed(map(_board, runs))),
            ("Recordings", each),
            ("Rows", "{:,}, {:,} missing, {:,} without a value".format(*counts)),
            ("Check", _listed(run.checked.verdict for run in runs)),
        ],
        "found": found,
        "kept": len(kept),
        "repeatability": found.repeatability(),
        "scatter": found.scatter,
        "calibration": None,
        "specimens": [],
        "version": __version__,
        **(_fitted(found.calibration, found.results) if found.calibration else {}),
        "unit": unit,
        "results": [_result(one, found.calibration, unit, shore=shore) for one in found.results],
        "parts": [
            {
                "Specimen": one.name,
                **{name.capitalize(): number_format.error(share) for name, share, _ in one.budget},
                "Of the modulus": number_format.error(one.budget[-1].of_modulus),
            }
            for one in found.results
            if one.budget
        ],
        "touches": list(_touches(found, happened, tell, unit, shore=shore)),
        "recordings": [_recording(run) for run in runs],
        "happened": [
            {"Recording": run.name, "Time": _clock(t_s - run.first_s), "What": kind, "Text": text}
            for run in runs
            for t_s, kind, text in happened[run.name]
        ],
        "settings": [*_settings(runs), ("Reported by", [("palpate", __version__)])],
        "sums": [(name, element("code", f"sha256 {_checksum(file)}")) for name, file in sources],
        "commands": [
            f"palpate check {names}",
            f"palpate replay {names}{given[0] if 'calibration' in asked else ''}",
            f"palpate report {names}{''.join(given)}",
        ],
    }


def _fitted(calibration: Calibration, results: Iterable[SpecimenResult] = ()) -> dict[str, Any]:
    """Return what the template shows of a calibration, and of the moduli that it gave."""
    new = [
        one for one in results if one.known is None and one.modulus and isfinite(one.modulus.value)
    ]
    seen = [
        plot.MeasuredObject(one.name, one.mean.ratio, one.modulus)
        for one in new
        if one.mean and one.modulus
    ]
    names = ("Parameter", "Value", "95 % interval")
    return {
        "calibration": calibration,
        "picture": plot.curve_picture(calibration.curve(), seen),
        "rings": bool(seen),
        "parameters": [dict(zip(names, row, strict=True)) for row in calibration.parameter_rows()],
        "distances": [_distance(calibration, one) for one in calibration.residuals],
        "about": ", ".join(f"{key}: {value}" for key, value in calibration.about.entries().items()),
    }


def _distance(calibration: Calibration, one: Residual) -> dict[str, object]:
    """Return the row of a specimen of a fit: its values, their mean, and its distance from the curve."""
    values = calibration.ratios[calibration.moduli == one.modulus].tolist()
    return {
        "MPa": f"{one.modulus:g}",
        "Touches": one.touches,
        "Ratio": number_format.number(one.ratio, one.standard_error),
        "Curve": number_format.number(one.fitted, one.standard_error),
        "Distance, %": one.percent.replace("-", MINUS),
        "In std. errors": f"{one.standardised:+.1f}".replace("-", MINUS),
        "Values": ", ".join(
            number_format.number(value, calibration.touch_spread * value) for value in values
        ),
    }


def _clock(seconds: float) -> str:
    """Return a time since the begin of a recording; `NONE`: unknown."""
    return NONE if isnan(seconds) else lasting(timedelta(seconds=seconds))


def _percent(share: float) -> str:
    """Return an error in percent; `NONE`: unknown."""
    return number_format.error(100 * share) if isfinite(share) else NONE


def _cells(modulus: Modulus | None, unit: str, *, shore: bool, none: str) -> dict[str, object]:
    """Return the cells of a modulus; without a value the interval says why. `none`: without a modulus."""
    if not modulus:
        return dict.fromkeys([unit, *["Shore A"] * shore, "95 % interval"], none)
    value, _, interval = _in(unit, str(modulus)).rstrip(")").partition(" (")
    value, interval = (value.removesuffix(f" {unit}"), interval) if interval else (NONE, value)
    interval += ", beyond the specimens" if modulus.extrapolated else ""
    hardness = shore_a_of_modulus(modulus.value)
    beside = {"Shore A": f"{hardness:.0f}" if isfinite(hardness) else NONE} if shore else {}
    return {unit: value, **beside, "95 % interval": interval}


def _result(
    one: SpecimenResult, calibration: Calibration | None, unit: str, *, shore: bool
) -> dict[str, object]:
    """Return the row of a specimen."""
    mean = one.mean
    return {
        "Specimen": one.name,
        **_cells(one.modulus, unit, shore=shore, none=NONE if calibration else ""),
        f"Known, {unit}": _in(unit, f"{one.known:g}") if one.known else "",
        "Inside": {True: "yes", False: "no", None: ""}[one.inside],
        "Ratio": number_format.number(mean.ratio, mean.standard_error) if mean else NONE,
        "±": number_format.error(mean.standard_error) if mean else NONE,
        "CV, %": _percent(one.variation),
        "Kept": len(one.kept),
        "Left out": len(one.touches) - len(one.kept) or NONE,
    }


def _touches(
    found: Findings,
    happened: Mapping[str, list[_Event]],
    tell: Callable[[str], None],
    unit: str,
    *,
    shore: bool,
) -> Iterator[_Row]:
    """Yield a row for each touch, and the sentences about it; of several recordings their names, too."""
    means = {one.name: one.mean.ratio for one in found.results if one.mean}
    name = found.runs[0].name if len(found.runs) == 1 else ""
    for one in found.touches:
        tell(f"touch {one.number} of {len(found.touches)}")
        if one.run.name != name:
            name = one.run.name
            yield element("b", name)
        touch = one.touch
        known = one.uncertainty(found.scatter)
        modulus = (
            found.calibration.modulus_of(touch) if found.calibration and not one.left_out else None
        )
        from_mean = known.ratio / means.get(one.specimen, nan) - 1
        end_s = touch.start_s + touch.samples * one.run.period_s
        marks = [
            text
            for t_s, kind, text in happened[name]
            if kind == "mark" and touch.start_s <= t_s <= end_s
        ]
        yield {
            "Touch": one.number,
            "Specimen": one.specimen or NONE,
            **_cells(modulus, unit, shore=shore, none=NONE if found.calibration else ""),
            "Start": _clock(touch.start_s - one.run.first_s),
            "Samples": touch.samples,
            "Ratio": number_format.number(known.ratio, known.uncertainty),
            "±": number_format.error(known.uncertainty) if isfinite(known.uncertainty) else NONE,
            "Noise, %": _percent(known.noise / abs(known.ratio) if known.ratio else nan),
            "From mean, %": f"{100 * from_mean:+.1f}".replace("-", MINUS)
            if isfinite(from_mean)
            else NONE,
            "Alarm, %": f"{100 * touch.alarm_share:.0f}",
            "Mark": "; ".join(marks),
        }
        yield from (f"{LEFT_OUT} left out. {reason}" for reason in one.left_out)
        yield from (said for said in one.said if said not in one.left_out)


def _recording(run: AnalysedRecording) -> dict[str, object]:
    """Return the row of a recording: begin, length, rows and lost samples; and what `check` and `replay` say of it."""
    checked, survey = run.checked, run.recording.survey
    share = (
        number_format.number(100 * survey.lost / (survey.rows + survey.lost)) if survey.lost else ""
    )
    told = [
        checked.verdict,
        checked.understood,
        *checked.faults,
        *checked.findings,
        *run.found.touches.notes,
    ]
    return {
        "Recording": run.name,
        "Begin": _begin(run) or "unknown",
        "Length": lasting(timedelta(seconds=survey.seconds)) if checked.timed else "unknown",
        "Rows": survey.rows,
        "Missing": f"{survey.lost} ({share} %) {survey.in_gaps}" if survey.lost else "0",
        "Check": _listed(told, "; "),
    }


def _listed(texts: Iterable[str], between: str = ", ") -> str:
    """Return texts in one line, each once, without empty ones."""
    return between.join(dict.fromkeys(filter(None, texts)))


def _simulated(runs: list[AnalysedRecording]) -> str:
    """Return what to say of simulated data; "": there are none."""
    devices = {run.name: run.recording.sidecar.device for run in runs}
    made = [name for name, device in devices.items() if sidecar.is_simulated(device)]
    which = "" if len(made) == len(runs) else f" in {', '.join(made)}"
    return f"Simulated data{which}: no probe was used." if made else ""


def _doubts(found: Findings) -> list[str]:
    """Return why the report is not to be relied on."""
    doubts = [f"{run.name}: {doubt}" for run in found.runs for doubt in run.recording.doubts]
    if found.calibration:
        for scene in sorted({run.tracking["scene"] for run in found.runs}):
            doubts += doubts_of_calibration(found.calibration, scene).sentences()
    return list(dict.fromkeys(doubts)) if found.touches else [*doubts, "no touch was found"]


def _named(results: list[SpecimenResult], unit: str) -> list[str]:
    """Return the moduli that were not known before, a sentence each."""
    unknown = [result for result in results if result.known is None and result.modulus]
    named = [
        f"{one.name}: {_in(unit, str(one.modulus)).replace('(', '(95 %: ')}."
        for one in unknown[:_MOST_NAMED]
    ]
    more = len(unknown) - _MOST_NAMED
    return [*named, f"{counted(more, 'more specimen')} below."] if more > 0 else named


def _sentences(found: Findings, kept: int, rows: int, lost: int, refused: int) -> Iterator[str]:
    bad = {"missing": lost, "without a value": refused}
    if any(bad.values()):
        yield f"Of {rows + lost:,} rows {' and '.join(f'{n:,} {_is(n)} {what}' for what, n in bad.items() if n)}."
    if not found.touches:
        yield "No touch was found."
        return
    left = len(found.touches) - kept
    reasons = f"; {left} {_is(left)} left out, with reasons" if left else ""
    yield f"{kept} of {counted(len(found.touches), 'touch')} {_is(kept)} kept{reasons}."
    inside = [result.inside for result in found.results if result.inside is not None]
    if inside:
        yield f"{sum(inside)} of {len(inside)} known moduli {_is(sum(inside))} in the 95 % interval."
    if found.calibration is None:
        yield "No calibration was given, so there are ratios, and no moduli."
    elif of_fit := sum(
        one.ratio in found.calibration.ratios for one in found.touches
    ):  # with the same bits
        yield f"{of_fit} of these touches are data of the calibration itself: for them that is no independent test."


def _is(count: int) -> str:
    return "is" if count == 1 else "are"


def _begin(run: AnalysedRecording) -> str:
    """Return when a recording began, in the zone of the computer that made it; "": unknown.

    By the epoch of its clock, else by the start of the program, which says the zone; UTC without it.
    """
    zero_ns = run.recording.zero_utc_ns
    try:
        at = datetime.fromisoformat(run.recording.sidecar.started)
    except ValueError:
        at = None
    if zero_ns is not None and isfinite(run.first_s):
        at = datetime.fromtimestamp(zero_ns / 1e9 + run.first_s, (at and at.tzinfo) or UTC)
    return f"{at:%Y-%m-%d %H:%M:%S %Z}".strip() if at else ""


def _board(run: AnalysedRecording) -> str:
    """Return the board, and the fingerprint of its chip."""
    device = run.recording.sidecar.device
    inner = device["device"] if isinstance(device.get("device"), dict) else device
    chip = f"fingerprint {device['fingerprint']}" if "fingerprint" in device else ""
    return _listed([shortened(str(inner.get("name", ""))), shortened(chip)])


def _happened(run: AnalysedRecording) -> list[_Event]:
    """Return notes, marks, tares and gaps in order of time; first those without one."""
    known = run.recording.sidecar
    found = [(nan, "note", shortened(note, _LONGEST)) for note in known.notes]
    found += [(mark.t_s, mark.kind, mark.text) for mark in known.marks]
    found += [(note.t_s, "note", note.text) for note in run.plan.notes]
    return sorted(found, key=lambda one: -inf if isnan(one[0]) else one[0])


def _settings(runs: list[AnalysedRecording]) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return devices and settings, each with its title; equal ones once, with the names of their recordings."""
    named: dict[tuple[str, tuple[tuple[str, str], ...]], list[str]] = {}
    for run in runs:
        known = run.recording.sidecar
        parts = {"Device": known.device, "Chip": _conditions(known.conditions)}
        parts |= {"Estimator": run.tracking, "Recorded by": known.versions}
        for title, values in parts.items():
            named.setdefault((title, tuple(_flat(values))), []).append(run.name)
    return [
        (title if len(names) == len(runs) else f"{title} of {', '.join(names)}", list(values))
        for (title, values), names in named.items()
        if values
    ]


def _flat(values: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Yield names and values; a value in a table has both names."""
    if isinstance(values, Mapping):
        for key, value in values.items():
            yield from _flat(value, f"{name}.{key}" if name else str(key))
    elif values is not None:
        yield name, shortened(str(values), _LONGEST)


def _conditions(known: Sequence[Any]) -> dict[str, str]:
    """Return the range of temperature and supply of the chip, as the recording has them."""
    ranges = dict[str, str]()
    for name in ("temperature_C", "supply_V"):
        values = [
            one[name]
            for one in known
            if isinstance(one, dict) and isinstance(one.get(name), int | float)
        ]
        ranges |= {name: f"{min(values):.2f} to {max(values):.2f}"} if values else {}
    return ranges


def _files(run: AnalysedRecording) -> list[tuple[str, Path]]:
    """Return a recording, and its sidecar if there is one, by their names in the report."""
    path = run.recording.path
    own = path.with_name(unpacked_name(path))
    beside = [sidecar.sidecar_path(own)] if own.suffix.lower() == ".csv" else []
    files = [path, *(file for file in beside if file.exists())]
    return [(PurePath(run.name).with_name(file.name).as_posix(), file) for file in files]


def _checksum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
