"""Canned measurements for the page: what a server would say in each state, with realistic numbers.

Twenty touches on specimens of known modulus, three of them flagged, at the pace of the evaluation kit. The same rows and
documents come out at every call.
"""

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate.live.feed import ROW, Flag, Rows

Document = dict[str, Any]
RATE = 38.4
"""Pairs a second."""
ORIGIN_S = 5.0
"""Time of the first sample, s: not 0, as that of a device."""
LENGTH = 250
"""Samples of a touch."""
THRESHOLD = 8.0
RIGID, HALF, SCATTER = 10.1, 2.056, 0.028
WANTED = 4
SPECIMENS = {"70 A": 8.68, "50 A": 2.18, "30 A": 0.87, "50 OO": 0.289, "30 OO": 0.143, "gel 7": None}
SENTENCES = {
    "offset": "offset: the soft bump is reached 2.0 % of the mean depth before the hard one (bumps not level): hold the probe "
    "upright. With this offset taken out, the ratio is 1.611 ± 0.046",
    "short": "short: the touch ended after 84 samples, before its full length: hold the probe longer",
    "gap": "gap: the board was opened again, or its range was moved, during the touch or before it; so the baseline may be "
    "that of a contact: lift the probe, and touch again",
}
MARKS = [(46.2, "50 A: lifted too early"), (108.5, "wiped the bumps"), (171.0, "left hand"), (172.0, "")]
TARES = [1.4, 107.3, 173.2]
GAP = (84.6, 85.5)


def ratio_of(modulus: float) -> float:
    """Return the ratio of a modulus by eq. (2)."""
    return (RIGID * modulus + HALF) / (modulus + HALF)


def modulus_of(ratio: float) -> float:
    """Return the modulus of a ratio."""
    return HALF * (ratio - 1) / (RIGID - ratio)


@dataclass(frozen=True)
class Press:
    """One touch, with its trace: times from its start (s), ratio, error, statistic."""

    number: int
    specimen: str
    start: float
    trace: NDArray[np.float64]  # shape (samples, 4)
    soft: float
    flag: str = ""

    @property
    def end(self) -> float:
        """Time of the last sample from the first one of the measurement, s."""
        return self.start + len(self.trace) / RATE

    @property
    def ratio(self) -> float:
        """The newest estimate."""
        return float(self.trace[-1, 1])

    def until(self, now: float) -> "Press":
        """Return the part before a moment."""
        return replace(self, trace=self.trace[self.trace[:, 0] < now - self.start])


def press(number: int, specimen: str, start: float, flag: str = "") -> Press:
    """Return a touch, with its own noise."""
    random = np.random.default_rng(100 + number)
    count, shifted = (84 if flag == "short" else LENGTH), flag == "offset"
    t = np.arange(1, count + 1) / RATE
    level = ratio_of(SPECIMENS[specimen] or 1.1) * (1 + SCATTER * random.standard_normal() + 0.052 * shifted)
    walk = np.zeros(count)
    for k, step in enumerate(random.standard_normal(count)):
        walk[k] = 0.96 * walk[k - 1] + 0.16 * step
    slide = 2.1 * np.exp(-t / 1.6) if shifted else 0.9 * np.exp(-t / 0.16)
    share = slide + 0.55 * walk / np.sqrt(1 + np.arange(count) / 6)
    error = (0.62 / np.sqrt(np.arange(1, count + 1)) + 0.1 * shifted) / 100 * level
    statistic, last = np.zeros(count), 0.0
    for k, step in enumerate(np.abs(random.standard_normal(count)) * 0.9 - 0.95):
        last = statistic[k] = max(0.0, last + step + 0.75 * (shifted and 0.8 < t[k] < 1.4))
    ratio = level * (1 + (share - share[-1]) / 100)
    return Press(number, specimen, start, np.column_stack((t, ratio, error, statistic)), 0.25, flag)


def presses() -> list[Press]:
    """Return the twenty touches."""
    found: list[Press] = []
    t = 4.0
    planned = [("70 A", 4), ("50 A", 5), ("30 A", 5), ("50 OO", 4), ("30 OO", 2)]
    flags = {6: "short", 12: "offset"}
    for name, count in planned:
        for _ in range(count):
            number = len(found) + 1
            found.append(press(number, name, t, flags.get(number, "")))
            t = found[-1].end + 2.2
        t += 7
    return found


def rows_of(touches: list[Press], now: float, cut: float | None = None) -> Rows:
    """Return the rows of a measurement from its beginning to now, or to the moment when the board was unplugged."""
    random = np.random.default_rng(7)
    t = np.arange(0, min(now, cut or now), 1 / RATE)
    t = t[(t < GAP[0]) | (t > GAP[1])]
    rows = np.zeros(len(t), ROW)
    rows["t_s"] = t + ORIGIN_S
    rows["hard"], rows["soft"] = random.normal(0, 0.0008, (2, len(t)))
    for name in ("ratio", "standard_error", "statistic"):
        rows[name] = np.nan
    for one in touches:
        depth = np.clip(np.minimum(t - one.start + 0.3, one.end + 0.3 - t) / 0.3, 0, 1)
        soft = one.soft * depth**2 * (3 - 2 * depth)
        rows["soft"] += soft
        rows["hard"] += soft * one.ratio
        inside = np.flatnonzero((t >= one.start) & (t < one.end + 1 / RATE))
        nth = np.minimum(((t[inside] - one.start) * RATE).astype(int), len(one.trace) - 1)
        for name, column in zip(("ratio", "standard_error", "statistic"), (1, 2, 3), strict=True):
            rows[name][inside] = one.trace[nth, column]
        alarm = one.trace[nth, 3] > THRESHOLD
        rows["flags"][inside] = Flag.CONTACT | Flag.MEASURED | np.where(alarm, Flag.ALARM, 0)
    return rows


@dataclass
class State:
    """One state of the page: rows, and a document of each kind.

    Attributes
    ----------
    rows : Rows
    told : dict
        Kind of a message -> document.
    traces : list of dict
    """

    rows: Rows
    told: dict[str, Document]
    traces: list[Document] = field(default_factory=list)


def modulus_document(ratio: float, uncertainty: float) -> Document:
    """Return a modulus with its interval, as `palpate.calibration.Modulus.as_dict` does."""
    value, low, high = (modulus_of(ratio + k * uncertainty) for k in (0.0, -1.96, 1.96))
    places = max(0, 1 - int(np.floor(np.log10((high - low) / 2))))
    text = f"{value:.{places}f} MPa ({low:.{places}f} to {high:.{places}f})"
    ends = {"value_MPa": value, "low_MPa": low, "high_MPa": high}
    return {**ends, "text": text, "reason": "", "extrapolated": False}


def touch_row(one: Press, touches: list[Press]) -> Document:
    """Return a row of the table."""
    mean = mean_of(one.specimen, touches)
    error = float(one.trace[-1, 2])
    uncertainty = float(np.hypot(error, SCATTER * one.ratio))
    return {
        "number": one.number,
        "start_s": one.start + ORIGIN_S,
        "end_s": one.end + ORIGIN_S,
        "samples": len(one.trace),
        "ratio": one.ratio,
        "standard_error": error,
        "uncertainty": uncertainty,
        "covariance": 4.45e-5,
        "alarm_share": float((one.trace[:, 3] > THRESHOLD).mean()),
        "flags": [one.flag] if one.flag else [],
        "refused": 0,
        "saturated": 0,
        "revised": False,
        "modulus": modulus_document(one.ratio, uncertainty),
        "advice": [SENTENCES[one.flag]] if one.flag else [],
        "specimen": one.specimen,
        "deviation": one.ratio / mean - 1 if mean else None,
        "kept": not one.flag,
        "why": SENTENCES.get(one.flag, ""),
    }


def mean_of(specimen: str, touches: list[Press]) -> float | None:
    """Return the mean ratio of the kept touches of a specimen."""
    ratios = [one.ratio for one in touches if one.specimen == specimen and not one.flag]
    return float(np.mean(ratios)) if ratios else None


def trace_of(one: Press) -> Document:
    """Return the trace of a completed touch, at most 160 points."""
    kept = one.trace[np.linspace(0, len(one.trace) - 1, min(160, len(one.trace))).astype(int)]
    names = ("t", "ratio", "error", "statistic")
    return {"touch": one.number, **{name: kept[:, k].tolist() for k, name in enumerate(names)}}


def session_of(touches: list[Press], here: str | None, known_only: bool) -> Document:
    """Return the plan and how far it is."""
    specimens: list[Document] = []
    for name, modulus in SPECIMENS.items():
        if known_only and modulus is None:
            continue
        own = [one for one in touches if one.specimen == name]
        mean, kept = mean_of(name, touches), sum(not one.flag for one in own)
        deviations = [
            {"touch": one.number, "deviation": one.ratio / mean - 1 if mean else None, "kept": not one.flag}
            for one in own
        ]
        specimens.append(
            {"name": name, "modulus": modulus, "kept": kept, "of": WANTED, "mean": mean, "deviations": deviations}
        )
    kept = sum(s["kept"] for s in specimens)
    nth = next((s["kept"] + 1 for s in specimens if s["name"] == here), 1)
    last = touches[-1] if touches else None
    return {
        "title": "calibration B" if known_only else "gel series 3",
        "operator": "M. Weber",
        "wanted": WANTED,
        "specimens": specimens,
        "next": {"name": here, "modulus": SPECIMENS[here], "nth": nth, "of": WANTED} if here else None,
        "count": {"kept": kept, "of": WANTED * len(specimens)},
        "notes": [{"t_s": 0.5 + ORIGIN_S, "text": "room 22 °C, probe warm for 20 min"}],
        "last": {"touch": last.number, "kept": not last.flag} if last else None,
    }


def calibration_of(touches: list[Press]) -> Document:
    """Return the state of a guided calibration."""
    grid = np.geomspace(0.09, 16, 60)
    known = [(one, SPECIMENS[one.specimen]) for one in touches]
    points = [
        {
            "modulus": modulus,
            "specimen": one.specimen,
            "touch": one.number,
            "ratio": one.ratio,
            "fitted": ratio_of(modulus),
            "kept": not one.flag,
        }
        for one, modulus in known
        if modulus
    ]
    curve = np.array([ratio_of(float(E)) for E in grid])
    return {
        "on": True,
        "touches": sum(not one.flag for one in touches),
        "verdict": "Not enough yet. 13 touches are on the curve: 3.2 % scatter, no trend.",
        "sound": False,
        "next": "Next: 50 OO, then 30 OO.",
        "missing": ["Below 0.8 MPa no specimen is finished."],
        "parameters": [
            {"name": "rigid_ratio", "value": "10.1", "interval": "9.6 to 10.6"},
            {"name": "half_modulus", "value": "2.06 MPa", "interval": "1.88 to 2.25"},
            {"name": "soft_ratio", "value": "1", "interval": "assumed"},
        ],
        "curve": {
            "modulus": grid.tolist(),
            "ratio": curve.tolist(),
            "low": (curve * 0.944).tolist(),
            "high": (curve * 1.056).tolist(),
        },
        "points": points,
        "rigid": {"value": RIGID, "error": 0.26},
        "history": [0.2, 0.15, 0.1, 0.07, 0.06, 0.05, 0.042, 0.035, 0.031, 0.028, 0.026],
        "error": None,
        "saved": None,
    }
