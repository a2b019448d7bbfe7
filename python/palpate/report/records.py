"""What a report says of the recordings: each touch, what happened, device and settings, checksums, and how to do it again."""

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from math import hypot, isfinite, isnan, nan
from pathlib import Path
from typing import Any

from palpate import digits
from palpate._core import __version__
from palpate.display import page
from palpate.display.markup import LEFT_OUT, NONE, Markup, element
from palpate.display.text import counted, lasting
from palpate.errors import shortened
from palpate.recording import sidecar
from palpate.report.results import Found, Session
from palpate.report.runs import Run
from palpate.report.series import distance, series
from palpate.several import TOUCH_SCATTER

_LONGEST = 300  # characters of a text from a sidecar


def touches(session: Session) -> Markup:
    """Return the section with a picture and a row for each touch."""
    if not session.touches:
        return Markup("")
    columns = {
        "Touch": "",
        "Specimen": "name",
        "Start": "",
        "Samples": "",
        "Ratio": "",
        "Noise, %": "",
        "From mean, %": "",
    }
    columns |= {"MPa": ""} if session.calibration else {}
    columns |= {"Alarm, %": "", "Mark": "w"}
    rows: list[list[object]] = []
    marks: list[str] = []
    before = None
    for one in session.touches:
        if one.run is not before and len(session.runs) > 1:
            rows.append([element("b", one.run.name)])
            marks.append("first")
        before = one.run
        cells = _cells(session, one)
        rows.append([cells[name] for name in columns])
        rows += [["", said] for said in _said(one)]
        marks += ["" if one.kept else "out"] * (len(rows) - len(marks))
    named = [(result.name, result.mean, result.touches) for result in session.results]
    unnamed = [one for one in session.touches if not one.specimen]
    named += [("no specimen", nan, unnamed)] if unnamed else []
    return page.section("Every touch", series(named), page.table(columns, rows, marks))


def _said(one: Found) -> list[str]:
    """Return the sentences below the row of a touch: first why it is left out."""
    others = [said for said in one.said if said not in one.left_out]
    return [*(f"{LEFT_OUT} left out. {reason}" for reason in one.left_out), *others]


def _cells(session: Session, one: Found) -> dict[str, object]:
    touch = one.touch
    spread = session.calibration.touch_spread if session.calibration else TOUCH_SCATTER
    known = isfinite(touch.standard_error)
    error = hypot(touch.standard_error if known else 0.0, spread * touch.ratio)
    mean = next((result.mean for result in session.results if result.name == one.specimen), nan)
    return {
        "Touch": str(one.number),
        "Specimen": one.specimen or NONE,
        "Start": clock(touch.start_s - one.run.first_s),
        "Samples": str(touch.samples),
        "Ratio": digits.number(touch.ratio, error),
        "Noise, %": digits.error(100 * touch.standard_error / abs(touch.ratio)) if known and touch.ratio else NONE,
        "From mean, %": distance(one, mean) or NONE,
        "MPa": _modulus(session, touch.ratio, touch.standard_error) if session.calibration and one.kept else NONE,
        "Alarm, %": f"{100 * touch.alarm_share:.0f}",
        "Mark": "; ".join(_marked(one)),
    }


def _modulus(session: Session, ratio: float, error: float) -> str:
    assert session.calibration is not None  # of those that have one
    return (
        str(session.calibration.modulus(ratio, error if isfinite(error) else None))
        .partition(" (")[0]
        .removesuffix(" MPa")
    )


def _marked(one: Found) -> Iterator[str]:
    begin = one.touch.start_s
    end = begin + (float(one.trace.t_s[-1]) if len(one.trace.t_s) else 0.0)
    return (text for t_s, kind, text in _happened(one.run) if kind == "mark" and begin <= t_s <= end)


def clock(seconds: float) -> str:
    """Return a time since the begin of a recording as minutes and seconds; `NONE`: unknown.

    Examples
    --------
    >>> clock(104.26), clock(3723.0)
    ('01:44.3', '1:02:03.0')
    """
    if isnan(seconds):
        return NONE
    minutes, rest = divmod(round(seconds, 1), 60)
    hours, minutes = divmod(int(minutes), 60)
    return f"{hours}:{minutes:02}:{rest:04.1f}" if hours else f"{minutes:02}:{rest:04.1f}"


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


def recordings(session: Session) -> Markup:
    """Return the section on the recordings: when, how long, whether complete, what happened."""
    columns = {"Recording": "name", "Begin": "n", "Length": "", "Rows": "", "Missing": "n"}
    rows: list[list[object]] = []
    for run in session.runs:
        counts = [_length(run), str(run.checked.survey.rows), _missing(run)]
        rows += [[element("b", run.name), begin(run) or "unknown", *counts], ["", _checked(run)]]
    happened = [
        [run.name, clock(t_s - run.first_s), kind, text] for run in session.runs for t_s, kind, text in _happened(run)
    ]
    events = {"Recording": "name", "Time": "", "What": "n", "Text": "w"}
    return page.section("Recordings", page.table(columns, rows), page.table(events, happened) if happened else "")


def _length(run: Run) -> str:
    return lasting(timedelta(seconds=run.checked.survey.seconds)) if run.checked.timed else "unknown"


def _missing(run: Run) -> str:
    survey = run.checked.survey
    if not survey.lost:
        return "0"
    return f"{survey.lost} ({digits.number(100 * survey.lost / (survey.rows + survey.lost))} %) {survey.in_gaps}"


def _checked(run: Run) -> str:
    """Return the verdict of the check, and what it found."""
    checked = run.checked
    notes = [note for note in run.notes if note not in checked.findings]
    again = [f"the baseline was measured again ({counted(run.retaken, 'time')})"] if run.retaken else []
    found = [*checked.faults, *checked.findings, *notes, *again]
    return "; ".join(dict.fromkeys([checked.verdict, *filter(None, [checked.understood]), *found]))


def begin(run: Run) -> str:
    """Return when a recording began, UTC; "": unknown. By the epoch of its clock, else by the start of the program."""
    zero_ns = sidecar.zero_of(run.document)[0]
    if zero_ns is not None and isfinite(run.first_s):
        at = datetime.fromtimestamp(zero_ns / 1e9 + run.first_s, UTC)
        return f"{at:%Y-%m-%d %H:%M:%S} UTC"
    started = run.document.get("started")
    return f"{shortened(started).replace('T', ' ').removesuffix('+00:00')} UTC" if isinstance(started, str) else ""


def settings(session: Session) -> Markup:
    """Return the section on devices and settings; equal ones once."""
    device = _grouped((run.name, _flat(run.document.get("device", {}))) for run in session.runs)
    scene = _grouped((run.name, _flat(run.tracking)) for run in session.runs)
    made = _grouped((run.name, _flat(run.document.get("versions", {}))) for run in session.runs)
    chip = _grouped((run.name, _conditions(run)) for run in session.runs)
    groups = {"Device": device, "Chip": chip, "Estimator": scene, "Recorded by": made}
    every = len(session.runs)
    named = {
        f"{title}{'' if len(names) == every else f', {_names(names)}'}": text
        for title, group in groups.items()
        for text, names in group.items()
        if text
    }
    return page.section("Device and settings", page.facts({**named, "Reported by": f"palpate {__version__}"}))


def _names(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"


def _grouped(named: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
    """Return the names that have the same text, by this text."""
    groups: dict[str, list[str]] = {}
    for name, text in named:
        groups.setdefault(text, []).append(name)
    return groups


def _flat(values: Any, name: str = "") -> str:
    """Return names and values, those in others with both names, as one line."""
    if isinstance(values, Mapping):
        inner = (_flat(value, f"{name}.{key}" if name else str(key)) for key, value in values.items())
        return ", ".join(filter(None, inner))
    return f"{name} = {shortened(str(values), _LONGEST)}" if values is not None else ""


def _conditions(run: Run) -> str:
    """Return the range of temperature and supply of the chip, as the recording has them."""
    units = {"temperature_C": "°C", "supply_V": "V"}
    found = [one for one in run.document.get("conditions", []) or [] if isinstance(one, dict)]
    told = []
    for name, unit in units.items():
        values = [one[name] for one in found if isinstance(one.get(name), int | float)]
        told += [f"{min(values):.2f} to {max(values):.2f} {unit}"] if values else []
    return ", ".join(told)


def again(session: Session, sums: Mapping[str, str], options: Sequence[tuple[str, str]]) -> Markup:
    """Return the section with the checksums, and the commands that redo the report; `options`: those of the report."""
    files = shlex.join(run.name for run in session.runs)
    given = [f" --{name} {shlex.quote(value)}" for name, value in options]
    of_replay = [option for option in given if option.startswith(" --calibration ")]
    lines = [f"palpate check {files}", f"palpate replay {files}{''.join(of_replay)}",
             f"palpate report {files}{''.join(given)}"]  # fmt: skip
    return page.section(
        "Sources, and how to do it again",
        page.facts({name: element("code", f"sha256 {found}") for name, found in sums.items()}),
        element("p", f"With these files, palpate {__version__} gives the same numbers, bit for bit:"),
        element("pre", element("code", "\n".join(lines))),
    )


def head(session: Session, operator: str, notes: Iterable[str], calibration: Path | None) -> Markup:
    """Return who, when, with what: two columns of names and values."""
    runs = session.runs
    begins = sorted(filter(None, map(begin, runs)))
    when = begins[0] if len(set(begins)) == 1 else f"{begins[0]} to {begins[-1]}" if begins else "unknown"
    devices = [run.document.get("device", {}) for run in runs]
    chips = dict.fromkeys(str(device["fingerprint"]) for device in devices if "fingerprint" in device)
    lost = sum(run.checked.survey.lost for run in runs)
    refused = sum(run.checked.survey.refused for run in runs)
    rows = sum(run.checked.survey.rows for run in runs)
    who = {
        "Operator": operator,
        "Begin": when,
        **{"Note" if not at else f"Note {at + 1}": text for at, text in enumerate(notes)},
    }
    probe = {
        "Probe": f"calibration {calibration.name}" if calibration else "not calibrated",
        "Board": ", ".join(dict.fromkeys(filter(None, map(_board, devices)))),
        "Chip": f"fingerprint {', '.join(shortened(chip) for chip in chips)}" if chips else "",
        "Recordings": f"{runs[0].name}" if len(runs) == 1 else counted(len(runs), "recording"),
        "Rows": f"{rows:,}, {lost or 'none'} missing" + (f", {refused:,} without a value" if refused else ""),
        "Check": ", ".join(dict.fromkeys(run.checked.verdict for run in runs)),
    }
    return element("div", page.facts(who), page.facts(probe), class_="two")


def _board(device: Mapping[str, Any]) -> str:
    inner = device.get("device")
    name = inner.get("name") if isinstance(inner, dict) else device.get("name")
    return shortened(str(name)) if name else ""


def simulated(session: Session) -> str:
    """Return what to say of simulated data; "": none are."""
    made = [run.name for run in session.runs if _is_simulated(run.document.get("device", {}))]
    if not made:
        return ""
    which = "" if len(made) == len(session.runs) else f" in {', '.join(made)}"
    return f"Simulated data{which}: no probe was used."


def _is_simulated(device: Mapping[str, Any]) -> bool:
    return "simulated" in device or str(device.get("name", "")).startswith("simulated")
