"""Objects as HTML, for a notebook."""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import number_format
from palpate.display import markup, text
from palpate.display.markup import ACCENT, WARNING, Array, Markup, changes, element, envelope
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
_EDGE = 4.0
"""Space around a small drawing, px."""


def touch_card(shown: "Touch") -> Markup:
    """Return one touch, with the advice on its flags."""
    left_out = []
    if shown.saturated:
        left_out.append(f"{shown.saturated:,} saturated")
    if shown.refused:
        left_out.append(f"{shown.refused:,} refused")
    facts: dict[str, object] = {
        "ratio": Uncertainty.of(shown),
        "result": _revision(shown),
        "begin": text.seconds(shown.start_s),
        "samples": f"{shown.samples:,}",
        "alarm": f"{shown.alarm_share:.0%} of the samples" if shown.alarm_share else "",
        "left out": ", ".join(left_out),
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
    known = [Uncertainty.of(touch) for touch in first]
    bars = [(one.ratio - 2 * one.uncertainty, one.ratio + 2 * one.uncertainty) for one in known]
    scale = markup.span(end for bar in bars for end in bar)
    rows: list[list[object]] = []
    remarks: list[str] = []
    for number, (touch, uncertainty, bar) in enumerate(zip(first, known, bars, strict=True), 1):
        start = text.seconds(touch.start_s)
        flags = ", ".join(touch.flags)
        samples = f"{touch.samples:,}"
        rows.append([number, start, samples, uncertainty, interval_drawing(bar, scale), flags])
        remarks += [f"touch {number}: {each}" for each in advice(touch)]
    ends = " to ".join(number_format.number(end) for end in scale)
    names = ["touch", "begin", "samples", "ratio", f"± 2 uncertainties, {ends}", "flags"]
    more = f"... and {len(shown) - _LONGEST:,} more" if len(shown) > _LONGEST else ""
    title = text.counted(len(shown), "touch")
    return _card(title, {}, _table(names, rows), more, *_remarks([*remarks, *notes]))


def interval_drawing(ends: tuple[float, float], scale: tuple[float, float]) -> Markup:
    """Return an interval and its middle, on a scale that other drawings share.

    It is empty if an end is not known.
    """
    low, high = markup.axis(*scale, _EDGE, 140 - _EDGE)(np.array(ends))
    drawn = []
    if np.isfinite(low + high):
        drawn.append(markup.path((low, high), (7.0, 7.0), stroke=ACCENT, stroke_width=2))
        drawn.append(markup.dot((low + high) / 2, 7.0, radius=3, fill=ACCENT))
    return markup.drawing(140, 14, "ratio and two standard errors", *drawn)


def recording_card(shown: "Recording") -> Markup:
    """Return both channels as lines, and the facts, notes and doubts of a recording."""
    if text.known_duration(shown):
        axis = "time"
        at = shown.t_hard_s
    else:
        axis = "pairs"
        at = np.arange(len(shown.hard), dtype=float)
    facts: dict[str, object] = {
        "length": text.recording_length(shown),
        "hard": _range_of_channel(shown.hard),
        "soft": _range_of_channel(shown.soft),
        "read as": shown.understood,
        "gaps": _listed([f"row {row:,}" for row in shown.gap_rows]),
        "marks": _listed([f"{text.seconds(t_s)} {name}" for t_s, name in shown.marks]),
        "notes": _listed(shown.notes),
    }
    below = _remarks(shown.doubts[:_LONGEST])
    if len(shown.hard):
        caption = f"change of hard (thick) and soft (thin) over {axis}"
        below.append(channels_drawing(at, changes(shown.hard)[0], changes(shown.soft)[0]))
        below.append(element("small", caption, style="opacity:0.7"))
    return _card("Recording", facts, *below)


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


def channels_drawing(time: Array, hard: Array, soft: Array) -> Markup:
    """Return both channels as lines over times or rows, on one scale, the soft one thinner.

    A missing reading is a hole.
    """
    hard_line = envelope(time, hard)
    soft_line = envelope(time, soft)
    times, changes_pF = (
        markup.span(np.concatenate(part)) for part in zip(hard_line, soft_line, strict=True)
    )
    x = markup.axis(*times, _EDGE, 480 - _EDGE)
    y = markup.axis(*changes_pF, 90 - _EDGE, _EDGE)

    def line(points: tuple[Array, Array], width: float, opacity: float) -> Markup:
        style = {"stroke": "currentColor", "stroke_width": width, "stroke_opacity": opacity}
        return markup.path(x(points[0]), y(points[1]), **style)

    drawn = [line(hard_line, 1.6, 1.0), line(soft_line, 1.1, 0.55)]
    return markup.drawing(480, 90, "both channels over time", *drawn)


def calibration_card(shown: "Calibration", curve_drawing: Callable[[], Markup]) -> Markup:
    """Return the curve with the measured ratios, its parameters and the verdict on the fit."""
    low, high = shown.range
    error = float(shown.fitted.covariance[1, 1]) ** 0.5 * shown.probe.half_modulus
    specimens = text.counted(len(set(shown.moduli.tolist())), "specimen")
    values = text.counted(len(shown.ratios), "value")
    facts: dict[str, object] = {
        "calibrated": f"{low:g} to {high:g} MPa, {specimens}, {values}",
        "rigid ratio": text.rigid_ratio(shown),
        "half modulus": f"{text.ratio(shown.probe.half_modulus, error)} MPa",
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
    facts: dict[str, object] = {"state": text.estimator_result(shown)}
    if "threshold" in shown.settings:
        alarm = ", alarm" if shown.alarm else ""
        statistic = number_format.number(shown.statistic)
        facts["statistic"] = f"{statistic} of {shown.settings['threshold']:g}{alarm}"
    return _card(type(shown).__name__, facts, _settings(shown.settings, text.defaults(shown)))


def tracker_card(shown: "Tracker") -> Markup:
    """Return the state of a tracker, its settings and its touches."""
    facts: dict[str, object] = {
        "state": f"{shown.state}, {text.counted(shown.readings, 'reading')}",
        "ratio": text.running_ratio(shown),
    }
    touches = touches_card(shown.touches) if shown.touches else ""
    defaults = text.own_class(shown)(shown.scene).settings
    settings = _settings(shown.settings, defaults)
    return _card(f"Tracker, scene {shown.scene}", facts, touches, settings)


def _settings(settings: dict[str, Any], defaults: dict[str, Any]) -> Markup:
    """Return all settings, folded; the summary names those that are not the default."""
    others = _assignments(text.changed(settings, defaults)) or "all as by default"
    return element("details", element("summary", f"settings: {others}"), _assignments(settings))


def _assignments(settings: dict[str, Any]) -> str:
    return ", ".join(f"{name} = {value}" for name, value in settings.items())


def stream_card(shown: "Stream") -> Markup:
    """Return the state of a measurement, its counters and its touches."""
    counters = [f"{count:,} {name}" for name, count in shown.counters.as_dict().items() if count]
    facts: dict[str, object] = {"samples": ", ".join(counters) or "none yet"}
    return _card(f"Stream of {type(shown.source).__name__}", facts, tracker_card(shown.tracker))


def _card(title: str, facts: dict[str, object], *below: object) -> Markup:
    """Return a heading, a table of names and non-empty values, and the parts below it."""
    parts: list[object] = [element("strong", title)]
    rows = []
    for name, value in facts.items():
        if value not in ("", None):
            heading = _cell("th", name, "font-weight:normal;opacity:0.7")
            rows.append(element("tr", heading, _cell("td", value)))
    if rows:
        parts.append(element("table", element("tbody", *rows), style=_TABLE))
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
    head = element("tr", *(_cell("th", name) for name in names))
    body = [element("tr", *(_cell("td", cell) for cell in row)) for row in rows]
    return element("table", element("thead", head), element("tbody", *body), style=_TABLE)


def _cell(tag: str, content: object, style: str = "") -> Markup:
    wrap = "nowrap" if tag == "th" else "normal"
    layout = f"text-align:left;white-space:{wrap};padding:0.1em 0.8em 0.1em 0;"
    return element(tag, content, style=layout + style)
