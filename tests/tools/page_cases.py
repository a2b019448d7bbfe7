"""The states of the page, as messages of a server: `CASES[name]()` returns one."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from page_data import (
    GAP,
    HALF,
    LENGTH,
    MARKS,
    ORIGIN_S,
    RATE,
    RIGID,
    SCATTER,
    TARES,
    THRESHOLD,
    Document,
    Press,
    State,
    calibration_of,
    modulus_document,
    press,
    presses,
    rows_of,
    session_of,
    touch_row,
    trace_of,
)

DASH = "\N{EN DASH}"
TOUCHES = presses()
RUNNING = TOUCHES[19]
LIVE = RUNNING.start + 4.05
IDLE: Document = {"word": "Touch", "sub": "30 OO, touch 2 of 4: press, and hold", "tone": "idle", "share": None}
HOLD: Document = {"word": "Hold", "sub": "2.5 s more", "tone": "busy", "share": 4.05 * RATE / LENGTH}
FACTS = {
    "Board": "AD7746 kit, USB 1/4",
    "Pairs a second": "38.4",
    "Late, lost, refused": "3, 34, 0",
    "Excitation": "EXCA, ±½ VDD, 32 kHz",
    "Conversion": "CAPF 0, 11.0 ms",
    "Temperature": "24.6 °C, +0.4 since tare",
    "Hard, CIN1": "28 % of range",
    "Soft, CIN2": "6 % of range",
}
SHARES = {"Hard, CIN1": 0.28, "Soft, CIN2": 0.06}


def quiet(text: str) -> Document:
    """Return a line that says nothing special."""
    return line("quiet", "", text, "")


def line(level: str, title: str, text: str, what: str, since_s: float | None = None) -> Document:
    """Return what the line says."""
    return {"level": level, "title": title, "text": text, "since_s": since_s, "what": what}


def facts(**changed: str) -> list[Document]:
    """Return the facts of the device; those given by their first word are changed, and warn."""
    told = []
    for name, value in FACTS.items():
        other = changed.get(name.split(",")[0].split()[0])
        share = None if other else SHARES.get(name)
        told.append({"name": name, "value": other or value, "warn": other not in (None, DASH), "share": share})
    return told


def case(
    now_s: float,
    now: Document,
    said: Document,
    *,
    touches: list[Press] | None = None,
    running: Press | None = None,
    cut: float | None = None,
    recording: bool = True,
    here: str | None = "30 OO",
    device: list[Document] | None = None,
    kind: str = "live",
    state: str | None = None,
    calibrating: bool = False,
) -> State:
    """Return a state of the page at a moment, s from the first sample."""
    known = [one for one in TOUCHES if one.end <= now_s] if touches is None else touches
    seen = [*known, *([running] if running else [])]
    file = kind == "file"
    told: dict[str, Document] = {
        "hello": hello(kind),
        "touches": {"rows": [touch_row(one, known) for one in known], "most_reliable": None, "together": None},
        "events": events(now_s, known, cut),
        "session": {**session_of(known, None if file else here, known_only=calibrating)},
        "calibration": calibration_of(known) if calibrating else {"on": False},
        "device": {
            "board": "" if file else "AD7746 kit, USB 1/4",
            "facts": [] if file else (device or facts()),
            "options": {} if file else options(),
            "can_centre": not file,
        },
        "noise": noise(),
        "state": state_of(now_s, now, said, running, recording, state or ("contact" if running else "no contact"), cut),
    }
    return State(rows_of(seen, now_s, cut), told, [trace_of(one) for one in known])


def hello(kind: str) -> Document:
    """Return what does not change during a measurement."""
    file = kind == "file"
    return {
        "measurement": 1,
        "kind": kind,
        "source": "run-11.csv" if file else "usb:",
        "device": "AD7746 kit" if file else "AD7746 kit, USB 1/4",
        "scene": "handheld",
        "threshold": THRESHOLD,
        "statistic_unit": "",
        "calibrated": True,
        "probe": {
            "name": "probe.toml",
            "rigid_ratio": RIGID,
            "half_modulus": HALF,
            "soft_ratio": 1.0,
            "scatter": SCATTER,
        },
        "scatter": SCATTER,
        "samples": LENGTH,
        "seconds": LENGTH / RATE,
        "origin_s": ORIGIN_S,
        "utc": "2026-11-21T14:02:07Z",
        "version": "0.1.0",
        "file": {"name": "run-11.csv", "rows": 7612, "missing": 34, "end": "clean end", "seconds": 200.0}
        if file
        else None,
    }


def state_of(
    now_s: float, now: Document, said: Document, running: Press | None, recording: bool, state: str, cut: float | None
) -> Document:
    """Return what changes during a measurement."""
    ratio = running.ratio if running else None
    error = float(running.trace[-1, 2]) if running else None
    uncertainty = (error**2 + (SCATTER * ratio) ** 2) ** 0.5 if ratio and error else None
    rows = round(min(now_s, cut or now_s) * RATE)
    return {
        "state": state,
        "ratio": ratio,
        "standard_error": error,
        "uncertainty": uncertainty,
        "modulus": modulus_document(ratio, uncertainty) if ratio and uncertainty else None,
        "pairs_per_s": 0.0 if cut else RATE,
        "counters": {"dropped": 0, "lost": 34, "refused": 0, "late": 3, "read": rows},
        "messages": ["range set: CAPDAC A 21, B 18"],
        "error": "",
        "end_s": min(now_s, cut or now_s) + ORIGIN_S,
        "recording": {"name": "palpate-2026-11-22-2.csv", "rows": rows, "seconds": now_s} if recording else None,
        "proposed": "palpate-2026-11-22-3.csv" if recording else "palpate-2026-11-22-2.csv",
        "files": [
            {"name": "palpate-2026-11-22-1.csv", "kind": "recording"},
            {"name": "palpate-2026-11-22-1.json", "kind": "settings"},
            {"name": "palpate-2026-11-22-1-report.html", "kind": "report"},
            {"name": "probe.toml", "kind": "calibration"},
        ],
        "now": now,
        "line": said,
        "announce": f"{now['word']}: {now['sub']}",
    }


def events(now_s: float, touches: list[Press], cut: float | None) -> Document:
    """Return marks, tares, gaps and flags."""
    gaps = [(*GAP, 34, "gap, 34 lost")] + ([(cut, now_s, 495, "unplugged")] if cut else [])
    return {
        "marks": [{"id": k, "t_s": t + ORIGIN_S, "text": text} for k, (t, text) in enumerate(MARKS, 1) if t < now_s],
        "tares": [t + ORIGIN_S for t in TARES if t < now_s],
        "gaps": [
            {"from_s": a + ORIGIN_S, "to_s": b + ORIGIN_S, "lost": lost, "text": text}
            for a, b, lost, text in gaps
            if a < now_s
        ],
        "flags": [
            {"t_s": one.end + ORIGIN_S, "touch": one.number, "name": one.flag, "text": touch_row(one, touches)["why"]}
            for one in touches
            if one.flag
        ],
    }


def options() -> Document:
    """Return what can be set on the board."""
    return {
        "capf": {"value": 0, "allowed": [0, 1, 2, 3], "title": "Conversion time (CAPF)"},
        "excitation": {
            "value": "half",
            "allowed": ["eighth", "quarter", "three-eighths", "half"],
            "title": "Excitation",
        },
    }


def noise() -> Document:
    """Return a spectrum with a peak of the mains."""
    hz = [0.15 * k for k in range(1, 128)]
    level = [4.0 + 6.0 / f + (9.0 if abs(f - 11.6) < 0.2 else 0.0) for f in hz]
    return {
        "seconds": 26.7,
        "hard_aF": 31.0,
        "soft_aF": 28.0,
        "hz": hz,
        "hard": level,
        "soft": [0.9 * v for v in level],
        "peaks": [{"hz": 11.6, "channel": "hard", "aF": 8.1}],
        "text": "Noise 31 aF (hard) and 28 aF (soft); a peak at 11.6 Hz is likely the mains (50 Hz, folded).",
    }


def flagged() -> State:
    """Return the state after a touch with a flag."""
    offset = press(20, "30 OO", RUNNING.start, "offset")
    now: Document = {
        "word": "Repeat",
        "sub": "lift, hold upright, touch 30 OO again",
        "tone": "caution",
        "share": 1.0,
    }
    text = "Offset: the soft bump is reached 2 % of the depth before the hard one; hold the probe upright."
    said = line("caution", "Touch 20 is left out.", text, "flagged")
    return case(offset.end + 0.6, now, said, touches=[*TOUCHES[:19], offset], state="no contact")


def unplugged() -> State:
    """Return the state after the board has gone, in a touch."""
    cut = LIVE - 0.95
    part = replace(RUNNING.until(cut), flag="gap")
    now: Document = {
        "word": "Stop",
        "sub": "no board: plug it in, it goes on by itself",
        "tone": "fault",
        "share": None,
    }
    text = "The board at USB 1/4 is gone. Touch 20 is cut, and will be repeated. The recording goes on."
    gone = facts(Board="USB 1/4, gone for 12 s", Pairs="0", Late="3, 495, 0", Temperature=DASH, Hard=DASH, Soft=DASH)
    said = line("fault", "Unplugged.", text, "unplugged", 12.0)
    return case(LIVE + 12, now, said, touches=[*TOUCHES[:19], part], cut=cut, device=gone, state="no contact")


def idle(said: Document, **more: Any) -> State:
    """Return a state without contact."""
    return case(RUNNING.start - 1.4, IDLE, said, **more)


def bare() -> State:
    """Return the beginning of a measurement without a plan, a calibration and a recording."""
    now: Document = {"word": "Touch", "sub": "press, and hold for 6.5 s", "tone": "idle", "share": None}
    state = case(3.9, now, quiet("Ready. Baseline 3 s old, noise 31 aF."), recording=False, here=None)
    state.told["hello"] |= {"calibrated": False, "probe": None, "scatter": None}
    state.told["session"] |= {"title": "", "specimens": [], "next": None, "count": {"kept": 0, "of": 0}, "notes": []}
    return state


HELD = RUNNING.until(LIVE)
SLOW = "212 of 1530 readings came late (14 %). Close other programs. Late readings are recorded; ratios are less sure."
UNWIRED = "Both channels read 0.000 pF, and a touch changes nothing. Wire the hard gauge to CIN1, the soft one to CIN2."
CASES: dict[str, Callable[[], State]] = {
    "idle": lambda: idle(quiet("Ready. Baseline 7 s old, noise 31 aF."), recording=False),
    "contact": lambda: case(LIVE, HOLD, quiet("Measuring. 30 OO, touch 2 of 4."), running=HELD),
    "lift": lambda: case(
        RUNNING.end + 0.1,
        {"word": "Lift", "sub": "kept; then 30 OO, touch 3 of 4", "tone": "good", "share": 1.0},
        quiet("Touch 20 is kept."),
        state="done",
    ),
    "flagged": flagged,
    "unplugged": unplugged,
    "saturated": lambda: case(
        LIVE,
        {"word": "Repeat", "sub": "lift, then press less", "tone": "caution", "share": 4.05 * RATE / LENGTH},
        line(
            "caution",
            "Saturated.",
            "The hard channel has been at its limit, 4.096 pF, for 0.4 s. Press less: half of this is enough.",
            "saturated",
        ),
        running=HELD,
        device=facts(Hard="100 % of range"),
    ),
    "baseline": lambda: case(
        LIVE,
        {"word": "Tare", "sub": "lift the probe, then press T", "tone": "fault", "share": None},
        line(
            "fault",
            "Baseline lost.",
            "The soft channel is 0.4 pF below its baseline: something was touched while taring.",
            "baseline",
        ),
    ),
    "slow": lambda: idle(
        line("caution", "Computer too slow.", SLOW, "slow", 40.0), device=facts(Pairs="33.1 of 38.4", Late="212, 34, 0")
    ),
    "unwired": lambda: case(
        3.9,
        {"word": "Stop", "sub": "nothing is wired to the inputs", "tone": "fault", "share": None},
        line("fault", "Nothing wired.", UNWIRED, "unwired"),
        recording=False,
        here="70 A",
        device=facts(Hard="0.000 pF", Soft="0.000 pF"),
    ),
    "calibrate": lambda: case(
        TOUCHES[15].start - 1.3,
        {"word": "Touch", "sub": "50 OO, touch 2 of 4: press, and hold", "tone": "idle", "share": None},
        quiet("Calibrating with 5 specimens of known modulus: 3 done, 50 OO begun."),
        here="50 OO",
        calibrating=True,
    ),
    "file": lambda: case(
        RUNNING.end + 1.2,
        {"word": "File", "sub": "run-11.csv, 21 Nov 2026, 14:02", "tone": "idle", "share": None},
        quiet("A recording: whole, 7612 rows, 34 missing, clean end. Nothing is being measured."),
        recording=False,
        kind="file",
        state="ended",
    ),
    "bare": bare,
}
CASES["review"] = CASES["contact"]
"""The page itself looks back: nothing changes at the server."""
