"""What the sections of a report say: the rows of their tables, and the sentences that depend on the results."""

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import UTC, datetime, timedelta
from math import hypot, isfinite, isnan, nan, sqrt
from pathlib import Path
from typing import Any

from palpate import digits
from palpate._core import __version__
from palpate.calibration.calibration import Calibration
from palpate.calibration.fit_tables import parameter_rows
from palpate.calibration.verdict import percent
from palpate.display.markup import LEFT_OUT, MINUS, NONE, Markup, element
from palpate.display.text import counted, lasting
from palpate.errors import shortened
from palpate.recording import sidecar
from palpate.report.pictures import calibration_picture
from palpate.report.results import Findings, Found, Result, deviations
from palpate.report.runs import Run
from palpate.several import TOUCH_SCATTER

_LONGEST = 300  # characters of a text from a sidecar
_MOST_NAMED = 3  # specimens in the first sentence


def context(found: Findings, files: Sequence[tuple[str, Path]], given: Sequence[tuple[str, str]]) -> dict[str, Any]:
    """Return all that the template shows; `files`: calibration and moduli, `given`: the options of the report."""
    asked, probe = dict(given), dict(files).get("calibration")
    title = asked.get("title") or _default_title(found)
    operator = asked.get("operator") or ", ".join(
        dict.fromkeys(run.plan.operator for run in found.runs if run.plan.operator)
    )
    notes = [text for name, text in given if name == "note"]
    return {
        "title": title,
        "version": __version__,
        "left_out": LEFT_OUT,
        "none_known": NONE,
        "simulated": _simulated(found),
        "doubts": _doubts(found),
        "verdict": {"named": _named(found), "rest": " ".join(_sentences(found))},
        "who": {"Operator": operator, "Begin": _when(found)}
        | {f"Note {at}" if at > 1 else "Note": text for at, text in enumerate(notes, 1)},
        "probe": _probe(found, probe),
        "results": _results(found),
        **_repeatability(found),
        **_uncertainty(found),
        **(_calibration(found, found.calibration) if found.calibration else {"calibration": None}),
        **_touches(found),
        "recordings": [row for run in found.runs for row in _recording(run)],
        "happened": [
            [run.name, clock(t_s - run.first_s), *what] for run in found.runs for t_s, *what in _happened(run)
        ],
        "settings": _settings(found),
        "sums": {name: value for run in found.runs for name, value in run.sums.items()},
        "commands": _commands(found, [*((name, file.name) for name, file in files), *given]),
    }


def about(calibration: Calibration) -> str:
    """Return what a calibration says of its origin."""
    return ", ".join(f"{key}: {value}" for key, value in calibration.about.items())


def distances(calibration: Calibration) -> list[list[str]]:
    """Return a row for each specimen of a fit: its values, their mean, and its distance from the curve."""
    rows = []
    for one in calibration.residuals:
        values = calibration.ratios[calibration.moduli == one.modulus].tolist()
        rows.append([
            f"{one.modulus:g}", str(one.touches), digits.number(one.ratio, one.standard_error),
            digits.number(one.fitted, one.standard_error), percent(one).replace("-", MINUS),
            f"{one.standardised:+.1f}".replace("-", MINUS),
            ", ".join(digits.number(value, calibration.touch_spread * value) for value in values),
        ])  # fmt: skip
    return rows


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


def _default_title(found: Findings) -> str:
    titles = dict.fromkeys(run.plan.title for run in found.runs if run.plan.title)
    several = f"{len(found.runs)} recordings" if len(found.runs) > 1 else found.runs[0].name
    return ", ".join(titles) or f"Report of {several}"


def _simulated(found: Findings) -> str:
    """Return what to say of simulated data; "": there are none."""
    devices = {run.name: run.document.get("device", {}) for run in found.runs}
    made = [n for n, d in devices.items() if "simulated" in d or str(d.get("name", "")).startswith("simulated")]
    which = "" if len(made) == len(devices) else f" in {', '.join(made)}"
    return f"Simulated data{which}: no probe was used." if made else ""


def _doubts(found: Findings) -> list[str]:
    """Return why the report is not to be relied on."""
    doubts = [f"{run.name}: {doubt}" for run in found.runs for doubt in run.doubts]
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


def _named(found: Findings) -> list[str]:
    """Return the moduli that were not known before, a sentence each."""
    unknown = [
        (result.name, str(result.modulus)) for result in found.results if result.known is None and result.modulus
    ]
    named = [f"{name}: {modulus.replace('(', '(95 %: ')}." for name, modulus in unknown[:_MOST_NAMED]]
    return [
        *named,
        *([f"{counted(len(unknown) - _MOST_NAMED, 'more specimen')} below."] if unknown[_MOST_NAMED:] else []),
    ]


def _sentences(found: Findings) -> Iterator[str]:
    if not found.touches:
        yield "No touch was found."
        return
    kept = sum(one.kept for one in found.touches)
    left = len(found.touches) - kept
    reasons = f"; {left} {'is' if left == 1 else 'are'} left out, with reasons" if left else ""
    yield f"{kept} of {counted(len(found.touches), 'touch')} {'is' if kept == 1 else 'are'} kept{reasons}."
    inside = [result.inside for result in found.results if result.inside is not None]
    if inside:
        yield f"{sum(inside)} of {len(inside)} known moduli {'is' if sum(inside) == 1 else 'are'} in the 95 % interval."
    if found.of_the_fit:
        yield f"{found.of_the_fit} of these touches are data of the calibration itself: for them that is no independent test."
    if found.calibration is None:
        yield "No calibration was given, so there are ratios, and no moduli."


def _when(found: Findings) -> str:
    begins = sorted(filter(None, map(_begin, found.runs)))
    return begins[0] if len(set(begins)) == 1 else f"{begins[0]} to {begins[-1]}" if begins else "unknown"


def _begin(run: Run) -> str:
    """Return when a recording began, UTC; "": unknown. By the epoch of its clock, else by the start of the program."""
    zero_ns = sidecar.zero_of(run.document)[0]
    if zero_ns is not None and isfinite(run.first_s):
        at = datetime.fromtimestamp(zero_ns / 1e9 + run.first_s, UTC)
        return f"{at:%Y-%m-%d %H:%M:%S} UTC"
    started = run.document.get("started")
    return f"{shortened(started).replace('T', ' ').removesuffix('+00:00')} UTC" if isinstance(started, str) else ""


def _probe(found: Findings, calibration: Path | None) -> dict[str, str]:
    """Return with what was measured, by name."""
    runs = found.runs
    devices = [run.document.get("device", {}) for run in runs]
    chips = dict.fromkeys(shortened(str(device["fingerprint"])) for device in devices if "fingerprint" in device)
    surveys = [run.checked.survey for run in runs]
    refused = sum(survey.refused for survey in surveys)
    rows = f"{sum(survey.rows for survey in surveys):,}, {sum(survey.lost for survey in surveys) or 'none'} missing"
    return {
        "Probe": f"calibration {calibration.name}" if calibration else "not calibrated",
        "Board": ", ".join(dict.fromkeys(filter(None, map(_board, devices)))),
        "Chip": f"fingerprint {', '.join(chips)}" if chips else "",
        "Recordings": f"{runs[0].name}" if len(runs) == 1 else counted(len(runs), "recording"),
        "Rows": rows + (f", {refused:,} without a value" if refused else ""),
        "Check": ", ".join(dict.fromkeys(run.checked.verdict for run in runs)),
    }


def _board(device: Mapping[str, Any]) -> str:
    inner = device.get("device")
    name = inner.get("name") if isinstance(inner, dict) else device.get("name")
    return shortened(str(name)) if name else ""


def _bold(text: str) -> Markup:
    return element("b", text)


def _results(found: Findings) -> dict[str, Any]:
    columns = {"Specimen": "name", "Kept": "", "Left out": "", "Ratio": "", "±": "", "CV, %": ""}
    if found.calibration:
        columns |= {"MPa": "strong", "95 % interval": "n"}
    if any(result.known for result in found.results):
        columns |= {"Known": "", "Inside": "n"} if found.calibration else {"Known": ""}
    warnings = [f"{one.name}: {one.agreement}." for one in found.results if one.agreement and not one.agreement.agree]
    if unnamed := sum(not one.specimen for one in found.touches):
        warnings.append(f"{counted(unnamed, 'touch')} without a specimen: in the list of touches only.")
    rows = [[cells[name] for name in columns] for cells in map(_result, found.results)]
    return {"columns": columns, "rows": rows, "warnings": warnings}


def _result(result: Result) -> dict[str, str]:
    found, modulus = result.agreement, result.modulus
    error = found.standard_error if found else nan
    value, _, interval = str(modulus).partition(" (") if modulus else (NONE, "", "")
    beyond = ", beyond the specimens" if modulus and modulus.extrapolated else ""
    return {
        "Specimen": _bold(result.name),
        "Kept": str(len(result.kept)),
        "Left out": str(len(result.touches) - len(result.kept) or NONE),
        "Ratio": digits.number(result.mean, error) if isfinite(result.mean) else NONE,
        "±": digits.error(error) if isfinite(result.mean) else NONE,
        "CV, %": digits.error(100 * result.variation) if isfinite(result.variation) else NONE,
        "MPa": value.removesuffix(" MPa") if interval else NONE,
        "95 % interval": (interval.rstrip(")") or (value if modulus else NONE)) + beyond,
        "Known": f"{result.known:g}" if result.known else NONE,
        "Inside": {True: "yes", False: "no", None: ""}[result.inside],
    }


def _repeatability(found: Findings) -> dict[str, Any]:
    """Return the scatter from touch to touch, if it is known, and what it is with the touches that are left out."""
    kept, every = found.repeatability(), found.repeatability(all_touches=True)
    left = sum(not one.kept for one in found.touches)
    return {
        "repeatability": kept if kept and kept.within_freedom else None,
        "left": f"{left} of {len(found.touches)}" if left else "",
        "with_all": digits.error(100 * every.error) if left and every and every.within_freedom else "",
    }


def _uncertainty(found: Findings) -> dict[str, Any]:
    if found.calibration is None:
        return {"scatter": digits.error(100 * TOUCH_SCATTER)}
    rows = []
    for result in found.results:
        if result.parts and result.agreement:
            shares = deviations(result.parts, result.mean)
            whole = sqrt(sum(share**2 for share in shares.values()))
            parts = [shares[name] for name in ("touch", "specimen", "curve", "noise")]
            rows.append([_bold(result.name), *(digits.error(100 * part) for part in (*parts, whole))])
    spread = digits.error(100 * found.calibration.touch_spread)
    return {"scatter": spread, "freedom": counted(found.calibration.fitted.touch_freedom, "degree"), "parts": rows}


def _calibration(found: Findings, calibration: Calibration) -> dict[str, Any]:
    seen = [one for one in found.results if one.modulus and isfinite(one.modulus.value) and one.known is None]
    return {
        "calibration": calibration,
        "picture": calibration_picture(calibration, seen),
        "rings": bool(seen),
        "parameters": parameter_rows(calibration),
        "distances": distances(calibration),
        "about": about(calibration),
    }


def _touches(found: Findings) -> dict[str, Any]:
    """Return a row for each touch."""
    modulus = ["MPa"] if found.calibration else []
    names = ["Touch", "Specimen", "Start", "Samples", "Ratio", "Noise, %", "From mean, %", *modulus, "Alarm, %", "Mark"]
    columns = dict.fromkeys(names, "") | {"Specimen": "name", "Mark": "w"}
    means = {result.name: result.mean for result in found.results}
    rows: list[list[str]] = []
    marks: list[str] = []
    for at, one in enumerate(found.touches):
        if len(found.runs) > 1 and (at == 0 or one.run is not found.touches[at - 1].run):
            rows.append([_bold(one.run.name)])
            marks.append("first")
        cells = _touch(found, one, means.get(one.specimen, nan))
        others = [said for said in one.said if said not in one.left_out]
        below = [*(f"{LEFT_OUT} left out. {reason}" for reason in one.left_out), *others]
        rows += [[cells[name] for name in columns], *(["", said] for said in below)]
        marks += ["" if one.kept else "out"] * (1 + len(below))
    return {"touches": {"columns": columns, "rows": rows, "marks": marks}}


def _distance(one: Found, mean: float) -> str:
    """Return how far a touch is from the mean of its specimen, %."""
    share = 100 * (one.touch.ratio / mean - 1)
    return f"{share:+.1f}".replace("-", MINUS) if isfinite(share) else NONE


def _touch(found: Findings, one: Found, mean: float) -> dict[str, str]:
    touch, calibration = one.touch, found.calibration
    known = isfinite(touch.standard_error)
    spread = calibration.touch_spread if calibration else TOUCH_SCATTER
    error = hypot(touch.standard_error if known else 0.0, spread * touch.ratio)
    modulus = NONE
    if calibration and one.kept:
        whole = calibration.modulus(touch.ratio, touch.standard_error if known else None)
        modulus = str(whole).partition(" (")[0].removesuffix(" MPa")
    end = touch.start_s + touch.samples * one.run.period_s
    happened = [text for t_s, kind, text in _happened(one.run) if kind == "mark" and touch.start_s <= t_s <= end]
    return {
        "Touch": str(one.number),
        "Specimen": one.specimen or NONE,
        "Start": clock(touch.start_s - one.run.first_s),
        "Samples": str(touch.samples),
        "Ratio": digits.number(touch.ratio, error),
        "Noise, %": digits.error(100 * touch.standard_error / abs(touch.ratio)) if known and touch.ratio else NONE,
        "From mean, %": _distance(one, mean),
        "MPa": modulus,
        "Alarm, %": f"{100 * touch.alarm_share:.0f}",
        "Mark": "; ".join(happened),
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


def _recording(run: Run) -> list[list[str]]:
    """Return two rows: when, how long, what is missing; and the verdict of the check with what it found."""
    checked, survey = run.checked, run.checked.survey
    length = lasting(timedelta(seconds=survey.seconds)) if checked.timed else "unknown"
    share = digits.number(100 * survey.lost / (survey.rows + survey.lost)) if survey.lost else ""
    missing = f"{survey.lost} ({share} %) {survey.in_gaps}" if survey.lost else "0"
    notes = [note for note in run.notes if note not in checked.findings]
    again = [f"the baseline was measured again ({counted(run.retaken, 'time')})"] if run.retaken else []
    told = [checked.verdict, *filter(None, [checked.understood]), *checked.faults, *checked.findings, *notes, *again]
    first = [_bold(run.name), _begin(run) or "unknown", length, str(survey.rows), missing]
    return [first, ["", "; ".join(dict.fromkeys(told))]]


def _settings(found: Findings) -> dict[str, str]:
    """Return devices and settings; equal ones once, with the names of their recordings."""
    named = {}
    for title, text_of in _SETTINGS.items():
        groups: dict[str, list[str]] = {}
        for run in found.runs:
            groups.setdefault(text_of(run), []).append(run.name)
        for text, names in groups.items():
            which = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
            named[title if len(names) == len(found.runs) else f"{title}, {which}"] = text
    return {**named, "Reported by": f"palpate {__version__}"}


def _flat(values: Any, name: str = "") -> str:
    """Return names and values as one line; a value in a table has both names."""
    if isinstance(values, Mapping):
        inner = (_flat(value, f"{name}.{key}" if name else str(key)) for key, value in values.items())
        return ", ".join(filter(None, inner))
    return f"{name} = {shortened(str(values), _LONGEST)}" if values is not None else ""


def _conditions(run: Run) -> str:
    """Return the range of temperature and supply of the chip, as the recording has them."""
    found = [one for one in run.document.get("conditions", []) or [] if isinstance(one, dict)]
    told = []
    for name, unit in {"temperature_C": "°C", "supply_V": "V"}.items():
        if values := [one[name] for one in found if isinstance(one.get(name), int | float)]:
            told.append(f"{min(values):.2f} to {max(values):.2f} {unit}")
    return ", ".join(told)


_SETTINGS: dict[str, Callable[[Run], str]] = {
    "Device": lambda run: _flat(run.document.get("device", {})),
    "Chip": _conditions,
    "Estimator": lambda run: _flat(run.tracking),
    "Recorded by": lambda run: _flat(run.document.get("versions", {})),
}


def _commands(found: Findings, options: Sequence[tuple[str, str]]) -> list[str]:
    """Return the commands that redo the report."""
    files = shlex.join(run.name for run in found.runs)
    given = [f" --{name} {shlex.quote(value)}" for name, value in options]
    of_replay = [option for option in given if option.startswith(" --calibration ")]
    return [
        f"palpate check {files}",
        f"palpate replay {files}{''.join(of_replay)}",
        f"palpate report {files}{''.join(given)}",
    ]
