"""Canned states of the page: what a server says in each of them. `state(name)` gives the same at every call.

Twenty touches on specimens of known modulus, at the pace of the evaluation kit; two were left out.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from palpate.calibration import Modulus
from palpate.elasticity import Elasticity
from palpate.live.instruction_rules import StatusLine
from palpate.live.page_frames import ROW, RowFlag, Rows
from palpate.live.plan import PlannedTouch, Progress, TouchKept
from palpate.live.protocol import Instruction
from palpate.recording.session import Specimen

Document = dict[str, Any]
RATE = 38.4  # pairs a second
ORIGIN_S = 5.0  # time of the first sample, s: not 0, as with a device
LENGTH, WANTED = 250, 4  # samples of a touch; touches of a specimen
THRESHOLD, SCATTER = 8.0, 0.028
PROBE = Elasticity(10.1, 2.056)  # rigid ratio; half modulus, MPa
SPECIMENS = {
    "70 A": 8.68,
    "50 A": 2.18,
    "30 A": 0.87,
    "50 OO": 0.289,
    "30 OO": 0.143,
    "gel 7": None,
}
UNCERTAINTIES = {"50 A": 0.05}  # relative, of the moduli
TOUCHED = [("70 A", 4), ("50 A", 5), ("30 A", 5), ("50 OO", 4), ("30 OO", 2)]
FLAGGED = {6: "short", 12: "offset"}
WHY = {
    "offset": "offset: the soft bump is reached 2.0 % of the mean depth before the hard one (bumps not level): hold the probe "
    "upright. With this offset taken out, the ratio is 1.611 ± 0.046",
    "short": "short: the touch ended after 84 samples, before its full length: hold the probe longer",
    "gap": "gap: the board was opened again: lift the probe, and touch again",
}
MARKS = [
    (46.2, "50 A: lifted too early"),
    (108.5, "wiped the bumps"),
    (171.0, "left hand"),
    (172.0, ""),
]
TARES = [1.4, 107.3, 173.2]
GAP = (84.6, 85.5)
FACTS = {"Board": "AD7746 kit, USB 1/4", "Pairs a second": "38.4", "Late, lost, refused": "3, 34, 0", "Conversion": "11.0 ms (CAPF 0)",
         "Excitation": "±1/2 of the supply (EXCA)", "Temperature": "24.6 °C, +0.4 since tare", "Hard, CIN1": "28 % of range",
         "Soft, CIN2": "6 % of range"}  # fmt: skip
RECORDED = [("palpate-2026-11-22-1.csv", "recording"), ("palpate-2026-11-22-1.json", "settings"),
            ("palpate-2026-11-22-1-report.html", "report"), ("probe.toml", "calibration")]  # fmt: skip


@dataclass(frozen=True)
class Press:
    """One touch; `trace` has times from its start (s), ratio, error and statistic, shape (samples, 4)."""

    number: int
    specimen: str
    start: float
    trace: NDArray[np.float64]
    flag: str = ""

    @property
    def end(self) -> float:
        """Time of the last sample from the first one of the measurement, s."""
        return self.start + len(self.trace) / RATE

    @property
    def ratio(self) -> float:
        """The newest estimate."""
        return float(self.trace[-1, 1])

    @property
    def standard_error(self) -> float:
        """Of that."""
        return float(self.trace[-1, 2])

    def until(self, now: float) -> "Press":
        """Return the part before a moment."""
        return replace(self, trace=self.trace[self.trace[:, 0] < now - self.start])


def press(number: int, specimen: str, start: float, flag: str = "") -> Press:
    """Return a touch, with its own noise."""
    random = np.random.default_rng(100 + number)
    nth = np.arange(1, (84 if flag == "short" else LENGTH) + 1)
    level = PROBE.ratio(SPECIMENS[specimen] or 1.1) * (1 + SCATTER * random.standard_normal())
    settling = 0.02 * np.exp(-nth / RATE / 0.5)
    statistic = np.abs(random.standard_normal(len(nth)))
    trace = (nth / RATE, level * (1 + settling), 0.0062 * level / np.sqrt(nth), statistic)
    return Press(number, specimen, start, np.column_stack(trace), flag)


def presses() -> list[Press]:
    """Return the twenty touches."""
    found: list[Press] = []
    t = 4.0
    for name, count in TOUCHED:
        for number in range(len(found) + 1, len(found) + count + 1):
            found.append(press(number, name, t, FLAGGED.get(number, "")))
            t = found[-1].end + 2.2
        t += 7
    return found


TOUCHES = presses()
RUNNING = TOUCHES[19]
LIVE = RUNNING.start + 4.05


def rows_of(touches: list[Press], until: float) -> Rows:
    """Return the rows of a measurement from its beginning."""
    random = np.random.default_rng(7)
    t = np.arange(0, until, 1 / RATE)
    t = t[(t < GAP[0]) | (t > GAP[1])]
    rows = np.zeros(len(t), ROW)
    rows["t_s"] = t + ORIGIN_S
    rows["hard"], rows["soft"] = random.normal(0, 0.0008, (2, len(t)))
    for name in ("ratio", "standard_error", "statistic"):
        rows[name] = np.nan
    for one in touches:
        soft = 0.25 * np.clip(np.minimum(t - one.start + 0.3, one.end + 0.3 - t) / 0.3, 0, 1)
        rows["soft"] += soft
        rows["hard"] += soft * one.ratio
        inside = np.flatnonzero((t >= one.start) & (t < one.end + 1 / RATE))
        nth = np.minimum(((t[inside] - one.start) * RATE).astype(int), len(one.trace) - 1)
        for column, name in enumerate(("ratio", "standard_error", "statistic"), 1):
            rows[name][inside] = one.trace[nth, column]
        rows["flags"][inside] = RowFlag.CONTACT | RowFlag.MEASURED
    return rows


@dataclass
class State:
    """One state of the page: rows, and a document of each kind of message."""

    rows: Rows
    told: dict[str, Document]


def plain(value: object) -> Any:
    """Return a part of a message as plain values."""
    return msgspec.to_builtins(value)


def measured(ratio: float, error: float) -> Document:
    """Return standard error, uncertainty and modulus of a ratio."""
    known = float(np.hypot(error, SCATTER * ratio))
    value, low, high = map(PROBE.modulus, ratio + known * np.array([0.0, -1.96, 1.96]))
    named = {
        "ratio": ratio,
        "standard_error": error,
        "uncertainty": known,
        "uncertainty_from": "calibration",
    }
    return named | {"modulus": Modulus(value, low, high).as_dict()}


def progress_of(case: "Case", touches: list[Press]) -> Progress:
    """Return the account of the touches on the specimens."""
    progress = Progress()
    if case.listed:
        progress.specimens = [
            Specimen(name, modulus, WANTED, UNCERTAINTIES.get(name))
            for name, modulus in SPECIMENS.items()
        ]
    given: Any = touches
    progress.present = [
        PlannedTouch(one.number, one, one.specimen, WHY.get(one.flag, "")) for one in given
    ]
    progress.settle(0.0)
    return progress


def touch_row(one: Press, row: TouchKept) -> Document:
    """Return a row of the table."""
    known = plain(row)
    flags, times = (
        [one.flag] if one.flag else [],
        {"start_s": one.start + ORIGIN_S, "end_s": one.end + ORIGIN_S},
    )
    counted = {
        "samples": len(one.trace),
        "covariance": 4.45e-5,
        "alarm_share": 0.0,
        "refused": 0,
        "saturated": 0,
    }
    said = {"flags": flags, "advice": [known["why"]] if flags else [], "revised": False}
    return {
        "number": one.number,
        **times,
        **counted,
        **said,
        **known,
        **measured(one.ratio, float(one.trace[-1, 2])),
    }


def session_of(case: "Case", progress: Progress) -> Document:
    """Return the plan and how far it is."""
    rows = progress.rows()
    return {
        "title": "gel series 3" if case.listed else "",
        "operator": "M. Weber",
        "wanted": WANTED,
        "specimens": plain([progress.specimen_row(one) for one in progress.specimens]),
        "next": None if case.file else plain(progress.following()),
        "count": plain(progress.count()),
        "notes": [{"t_s": 0.5 + ORIGIN_S, "text": "room 22 °C, probe warm for 20 min"}]
        if case.listed
        else [],
        "last": {"touch": len(rows), "kept": rows[-1].kept} if rows else None,
        "done": DONE if case.now.word == "Done" else None,
    }


def calibration_of(touches: list[Press]) -> Document:
    """Return the state of a guided calibration."""
    grid = np.geomspace(0.09, 16, 60)
    curve = np.array([*map(PROBE.ratio, grid)])
    points = [
        {"modulus": modulus, "fitted": PROBE.ratio(modulus), "specimen": one.specimen, "touch": one.number, "ratio": one.ratio, "kept": not one.flag}
        for one in touches
        if (modulus := SPECIMENS[one.specimen])
    ]  # fmt: skip
    rigid = {"name": "rigid_ratio", "value": "10.1", "interval": "9.6 to 10.6"}
    half = {"name": "half_modulus", "value": "2.06 MPa", "interval": "1.88 to 2.25"}
    lines = {"ratio": curve, "low": curve * 0.944, "high": curve * 1.056, "modulus": grid}
    said = {"verdict": "Not enough yet. 13 touches are on the curve: 3.2 % scatter, no trend."}
    todo = {"next": "Next: 50 OO.", "saved": None}
    return {"on": True, "sound": False} | said | todo | {
        "parameters": [rigid, half],
        "curve": {name: values.tolist() for name, values in lines.items()},
        "points": points,
        "rigid": {"value": PROBE.rigid_ratio, "error": 0.26},
        "history": [0.2, 0.15, 0.1, 0.07, 0.06, 0.05, 0.042, 0.035, 0.031, 0.028, 0.026],
    }  # fmt: skip


def device(file: bool, changed: Document) -> Document:
    """Return facts and options of the board; changed facts, by the begin of their names, warn."""
    facts = []
    for name, value in FACTS.items():
        other = next((text for begin, text in changed.items() if name.startswith(begin)), None)
        share = 0.28 if name == "Hard, CIN1" and not other else None
        facts.append(
            {"name": name, "value": other or value, "warn": other is not None, "share": share}
        )
    if file:
        return {"facts": [], "options": {}, "can_centre": False}
    capf = {"value": 0, "allowed": [0, 1, 2, 3], "title": "Conversion time (CAPF)"}
    excitation = {"value": "half", "allowed": ["quarter", "half"], "title": "Excitation"}
    return {"facts": facts, "options": {"capf": capf, "excitation": excitation}, "can_centre": True}


def events_of(now: float, known: list[Press], cut: float | None) -> Document:
    """Return marks, tares, gaps, judgements and flags until now."""
    gaps = [(*GAP, 34, "gap, 34 lost"), *([(cut, now, 495, "unplugged")] if cut else [])]
    return {
        "marks": [{"id": k, "t_s": t + ORIGIN_S, "text": text} for k, (t, text) in enumerate(MARKS, 1) if t < now],
        "tares": [t + ORIGIN_S for t in TARES if t < now],
        "gaps": [{"from_s": a + ORIGIN_S, "to_s": b + ORIGIN_S, "lost": lost, "text": text} for a, b, lost, text in gaps if a < now],
        "judgements": [],
        "flags": [{"t_s": one.end + ORIGIN_S, "touch": one.number, "name": one.flag, "text": WHY[one.flag]} for one in known if one.flag],
    }  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A moment of the measurement, s from its first sample; the word and the line that the server says, and what differs."""

    at: float
    now: Instruction
    line: StatusLine
    touches: list[Press] | None = None
    running: Press | None = None
    cut: float | None = None
    listed: bool = True
    recording: bool = True
    file: bool = False
    calibrating: bool = False
    state: str = ""
    facts: Document = field(default_factory=dict)


DONE = {"scatter": 0.0271, "source": "session", "inside": 5, "of": 5, "left_out": 2}
HELD, PART = RUNNING.until(LIVE), replace(RUNNING.until(LIVE - 0.95), flag="gap")
OFFSET = press(20, "30 OO", RUNNING.start, "offset")
TOUCH = Instruction("Touch", "30 OO, touch 2 of 4: press, and hold")
HOLD = Instruction("Hold", "2.5 s more", "busy", 4.05 * RATE / LENGTH)
READY = StatusLine("ready", "quiet", "", "Ready. Baseline 7 s old, noise 31 aF.")
BEFORE = RUNNING.start - 1.4
SLOW = "32 of 38 pairs a second arrive. It costs nothing here: ± 0.25 stays ± 0.25."
GONE = "The board at USB 1/4 is gone. Touch 20 is cut, and will be repeated. The recording goes on."
FILE = "A recording: whole, 7612 rows, 34 missing, clean end. Nothing is being measured."
LEFT = (
    "Offset: the soft bump is reached 2 % of the depth before the hard one; hold the probe upright."
)
CASES = {
    "idle": Case(BEFORE, TOUCH, READY, recording=False),
    "contact": Case(LIVE, HOLD, StatusLine("contact", "quiet", "", "Measuring. 30 OO, touch 2 of 4."), running=HELD),
    "lift": Case(RUNNING.end + 0.1, Instruction("Lift", "kept; then 30 OO, touch 3 of 4", "good", 1.0), StatusLine("done", "quiet", "", "Touch 20 is kept."), state="done"),
    "flagged": Case(OFFSET.end + 0.6, Instruction("Repeat", "lift, hold upright, touch 30 OO again", "caution", 1.0), StatusLine("left out", "caution", "Touch 20 is left out.", LEFT),
                    touches=[*TOUCHES[:19], OFFSET]),
    "unplugged": Case(LIVE + 12, Instruction("Stop", "no board: plug it in, it goes on by itself", "fault"), StatusLine("unplugged", "fault", "Unplugged.", GONE),
                      touches=[*TOUCHES[:19], PART], cut=LIVE - 0.95, facts={"Board": "USB 1/4, gone for 12 s", "Late": "3, 495, 0"}),
    "slow": Case(BEFORE, TOUCH, StatusLine("slow", "note", "Slow computer.", SLOW), facts={"Pairs": "33.1 of 38.4", "Late": "212, 34, 0"}),
    "calibrate": Case(TOUCHES[15].start - 1.3, Instruction("Touch", "50 OO, touch 2 of 4: press, and hold"),
                      StatusLine("ready", "quiet", "", "Calibrating with 5 specimens of known modulus: 3 done, 50 OO begun."), calibrating=True),
    "file": Case(RUNNING.end + 1.2, Instruction("File", "run-11.csv, 21 Nov 2026, 14:02"), StatusLine("file", "quiet", "", FILE), recording=False, file=True, state="ended"),
    "done": Case(RUNNING.end + 2.4, Instruction("Done", "6 specimens; 2 left out", "good"), StatusLine("finished", "note", "24 of 24 done.", "Calibration saved, report ready. The recording goes on until you end it."), touches=TOUCHES),
    "bare": Case(3.9, Instruction("Touch", "press, and hold for 6.5 s"), READY, recording=False, listed=False),
}  # fmt: skip
CASES["review"] = CASES["contact"]
"""The page itself looks back: nothing changes at the server."""


def state(name: str) -> State:
    """Return a state by its name in `CASES`."""
    case = CASES[name]
    known = [one for one in TOUCHES if one.end <= case.at] if case.touches is None else case.touches
    end, running = case.cut or case.at, case.running
    rows = rows_of([*known, *([running] if running else [])], end)
    progress = progress_of(case, known)
    touches = [touch_row(one, row) for one, row in zip(known, progress.rows(), strict=True)]
    told = {
        "hello": hello_of(case),
        "touches": {"rows": touches, "most_reliable": None, "together": None},
        "events": events_of(case.at, known, case.cut),
        "session": session_of(case, progress),
        "calibration": calibration_of(known) if case.calibrating else {"on": False},
        "device": device(case.file, case.facts),
        "state": state_of(case, end, running),
    }
    return State(rows, told)


def hello_of(case: Case) -> Document:
    """Return what does not change during a measurement."""
    named = {
        "source": "run-11.csv" if case.file else "usb:",
        "device": "AD7746 kit, USB 1/4",
        "scene": "handheld",
    }
    length = {
        "samples": LENGTH,
        "seconds": LENGTH / RATE,
        "threshold": THRESHOLD,
        "origin_s": ORIGIN_S,
    }
    known = {
        "calibrated": case.listed,
        "scatter": SCATTER if case.listed else None,
        "assumed": 0.03,
    }
    file = {
        "name": "run-11.csv",
        "rows": 7612,
        "missing": 34,
        "end": "clean end",
        "amendable": True,
    }
    kind = {
        "measurement": 1,
        "kind": "file" if case.file else "live",
        "file": file if case.file else None,
    }
    return {**named, **length, **known, **kind}


def state_of(case: Case, end: float, running: Press | None) -> Document:
    """Return what changes during a measurement."""
    none = dict.fromkeys(("ratio", "standard_error", "uncertainty", "uncertainty_from", "modulus"))
    return {
        **(measured(running.ratio, float(running.trace[-1, 2])) if running else none),
        "state": case.state or ("contact" if running else "no contact"),
        "on": running and running.specimen,
        "error": "",
        "end_s": end + ORIGIN_S,
        "recording": {"name": "palpate-2026-11-22-2.csv", "rows": round(end * RATE), "seconds": end}
        if case.recording
        else None,
        "proposed": "palpate-2026-11-22-2.csv",
        "files": [{"name": file, "kind": kind} for file, kind in RECORDED],
        "now": plain(case.now),
        "line": plain(case.line.shown(12.0 if case.cut else None)),
        "announce": f"{case.now.word}: {case.now.sub}",
    }
