"""Objects as HTML, for a notebook."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import number_format
from palpate._core import HandoverRls, HandoverRls32, VectorRls
from palpate.display import markup, text
from palpate.display.markup import ACCENT, WARNING, Array, Markup, changes, element
from palpate.errors import MissingExtra
from palpate.flags import advice
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from palpate._core import Tracker
    from palpate.calibration import Calibration
    from palpate.recording import Recording
    from palpate.stream import Stream
    from palpate.touch import Touch

_LONGEST = 50
"""Touches, marks and notes shown of a list."""
_TABLE = "border-collapse:collapse;margin:0.3em 0;font-variant-numeric:tabular-nums"
_RATIO = "ratio ± uncertainty (k = 1)"
"""Name of a ratio: its uncertainty is one standard deviation."""
_EDGE = 4.0
"""Space around a small drawing, px."""
Facts = dict[str, object]
"""Names and values; an empty value is not shown."""


def touch_card(shown: "Touch") -> Markup:
    """Return one touch, with the advice on its flags."""
    alarm = ""
    if shown.alarm_share:
        alarm = f"{shown.alarm_share:.0%} of the samples"
    left_out = text.counts_text({"saturated": shown.saturated, "refused": shown.refused})
    facts: Facts = {
        _RATIO: Uncertainty.of(shown),
        "result": _revision(shown),
        "begin": text.seconds(shown.start_s),
        "samples": f"{shown.samples:,}",
        "alarm": alarm,
        "left out": left_out,
        "flags": ", ".join(shown.flags) or "none",
    }
    return _card("Touch", facts, *_remarks(advice(shown)))


def _revision(shown: "Touch") -> str:
    if shown.revised:
        before = Uncertainty.of_ratio(shown.first_ratio, shown.first_standard_error)
        return f"revised after the release; before: {before}"
    return "first, at the end of the touch" if shown.effects else ""


def touches_card(shown: "Sequence[Touch]", notes: "Sequence[str]" = ()) -> Markup:
    """Return a table of touches, each ratio also as a bar on the same scale; then advice and notes."""
    if not shown:
        return _card("No touches", {}, *_remarks(notes))
    first = list(shown)[:_LONGEST]
    known = list(map(Uncertainty.of, first))
    bars = []
    for one in known:
        reach = 2 * one.uncertainty
        bars.append((one.ratio - reach, one.ratio + reach))
    scale = markup.span(np.ravel(bars))
    ends = " to ".join(map(number_format.number, scale))
    names = ["touch", "begin", "samples", _RATIO, f"95 % interval (k = 2), {ends}", "flags"]
    rows: list[list[object]] = []
    remarks: list[str] = []
    for number, touch, uncertainty, bar in zip(count(1), first, known, bars, strict=False):
        start = text.seconds(touch.start_s)
        flags = ", ".join(touch.flags)
        samples = f"{touch.samples:,}"
        drawn = interval_drawing(bar, scale)
        rows.append([number, start, samples, uncertainty, drawn, flags])
        remarks += [f"touch {number}: {each}" for each in advice(touch)]
    more = ""
    if len(shown) > _LONGEST:
        more = f"... and {len(shown) - _LONGEST:,} more"
    title = text.counted(len(shown), "touch")
    table = _table(names, rows)
    remarks += notes
    return _card(title, {}, table, more, *_remarks(remarks))


def interval_drawing(ends: tuple[float, float], scale: tuple[float, float]) -> Markup:
    """Return an interval and its middle, on a scale that other drawings share.

    It is empty if an end is not known.
    """
    axis = markup.axis(*scale, _EDGE, 140 - _EDGE)
    low, high = axis(np.array(ends))
    middle = (low + high) / 2
    drawn = []
    if np.isfinite(middle):
        bar = markup.path((low, high), (7.0, 7.0), stroke=ACCENT, stroke_width=2)
        drawn = [bar, markup.dot(middle, 7.0, radius=3, fill=ACCENT)]
    return markup.drawing(140, 14, "95 % interval of the ratio", *drawn)


def recording_card(shown: "Recording") -> Markup:
    """Return the facts, notes and doubts of a recording; its `plot` draws it."""
    marks = [f"{text.seconds(t_s)} {name}" for t_s, name in shown.marks]
    facts: Facts = {
        "length": text.recording_length(shown),
        "hard": _range_of_channel(shown.hard),
        "soft": _range_of_channel(shown.soft),
        "read as": shown.understood,
        "gaps": _listed([f"row {row:,}" for row in shown.gap_rows]),
        "marks": _listed(marks),
        "notes": _listed(shown.notes),
    }
    doubts = _remarks(shown.doubts[:_LONGEST])
    return _card("Recording", facts, *doubts)


def _listed(texts: Sequence[str]) -> str:
    shown = list(texts[:_LONGEST])
    if len(texts) > _LONGEST:
        shown.append(f"... and {len(texts) - _LONGEST:,} more")
    return "; ".join(shown)


def _range_of_channel(readings: Array) -> str:
    """Return the level of a channel at the start, and its largest changes."""
    change, level_pF = changes(readings)
    if np.isnan(level_pF):
        return "no readings"
    low = float(np.nanmin(change))
    high = float(np.nanmax(change))
    digits = (high - low) / 10
    ends = f"{number_format.number(low, digits)} to {number_format.number(high, digits)}"
    return f"{number_format.number(level_pF)} pF at the begin, change {ends} pF"


def calibration_card(shown: "Calibration", curve_drawing: Callable[[], Markup]) -> Markup:
    """Return the curve with the measured ratios, its parameters and the verdict on the fit."""
    low, high = shown.range
    log_error = float(shown.fitted.covariance[1, 1]) ** 0.5
    error = log_error * shown.probe.half_modulus
    specimens = text.counted(len(shown.residuals), "specimen")
    values = text.counted(len(shown.ratios), "value")
    facts: Facts = {
        "calibrated": f"{low:g} to {high:g} MPa, {specimens}, {values}",
        "rigid ratio ± std. error (k = 1)": text.rigid_ratio(shown),
        "half modulus ± std. error (k = 1)": f"{text.ratio(shown.probe.half_modulus, error)} MPa",
    }
    try:
        facts["verdict"] = shown.verdict
        drawn = curve_drawing()
    except MissingExtra as missing:
        facts["verdict"] = str(missing)
        drawn = Markup()
    return _card("Calibration", facts, drawn)


def estimator_card(shown: Any) -> Markup:
    """Return the state of an estimator, and its settings."""
    facts: Facts = {"state": text.estimator_result(shown)}
    if isinstance(shown, HandoverRls | HandoverRls32 | VectorRls):
        facts["±"] = "one standard error (k = 1)"
    if shown.threshold < math.inf:
        statistic = number_format.number(shown.statistic)
        facts["statistic"] = f"{statistic} of {shown.threshold:g}"
        if shown.alarm:
            facts["statistic"] = f"{facts['statistic']}, alarm"
    return _card(type(shown).__name__, facts, _settings(shown))


def tracker_card(shown: "Tracker") -> Markup:
    """Return the state of a tracker, its settings and its touches."""
    facts: Facts = {
        "state": f"{shown.state}, {text.counted(shown.readings, 'reading')}",
        _RATIO: text.running_ratio(shown),
    }
    touches = Markup()
    if shown.touches:
        touches = touches_card(shown.touches)
    return _card(f"Tracker, scene {shown.scene}", facts, touches, _settings(shown))


def _settings(shown: Any) -> Markup:
    """Return all settings, folded; the summary names those that are not the default."""
    others = _assignments(text.changed_settings(shown)) or "all as by default"
    summary = element("summary", f"settings: {others}")
    return element("details", summary, _assignments(shown.settings))


def _assignments(settings: Mapping[str, object]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in settings.items())


def stream_card(shown: "Stream") -> Markup:
    """Return the state of a measurement, its counters and its touches."""
    counters = text.counts_text(shown.counters.as_dict())
    facts: Facts = {"samples": counters or "none yet"}
    return _card(f"Stream of {type(shown.source).__name__}", facts, tracker_card(shown.tracker))


def _card(title: str, facts: Facts, *below: object) -> Markup:
    """Return a heading, a table of names and non-empty values, and the parts below it."""
    parts: list[object] = [element("strong", title)]
    rows = []
    for name, value in facts.items():
        if value not in ("", None):
            heading = _cell("th", name, "font-weight:normal;opacity:0.7")
            rows.append(element("tr", heading, _cell("td", value)))
    if rows:
        body = element("tbody", *rows)
        parts.append(element("table", body, style=_TABLE))
    return element("div", *parts, *below, style="line-height:1.4")


def _remarks(texts: Iterable[object]) -> list[Markup]:
    """Return sentences that a reader should not miss, each with a coloured edge."""
    style = (
        f"border-left:3px solid {WARNING};margin:0.4em 0;padding:0 0.6em;max-width:60em;"
        "white-space:pre-wrap"
    )
    return [element("div", text, style=style) for text in texts]


def _table(names: list[str], rows: list[list[object]]) -> Markup:
    """Return a table with a header; its cells are aligned to the left."""
    head = element("thead", _row("th", names))
    body = element("tbody", *map(partial(_row, "td"), rows))
    return element("table", head, body, style=_TABLE)


def _row(tag: str, contents: Iterable[object]) -> Markup:
    return element("tr", *map(partial(_cell, tag), contents))


def _cell(tag: str, content: object, style: str = "") -> Markup:
    wrap = "nowrap" if tag == "th" else "normal"
    layout = f"text-align:left;white-space:{wrap};padding:0.1em 0.8em 0.1em 0;"
    return element(tag, content, style=layout + style)
