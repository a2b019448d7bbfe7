"""Objects as HTML, for a notebook."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import number_format
from palpate.display import markup, text
from palpate.display.markup import WARNING, Markup, changes, element
from palpate.errors import MissingExtra
from palpate.flags import advice
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from palpate._core import Touch, Tracker
    from palpate.calibration import Calibration
    from palpate.recording import Recording
    from palpate.stream import Stream

_MOST = 50
"""Touches, marks and notes shown of a list."""
_TABLE = "border-collapse:collapse;margin:0.3em 0;font-variant-numeric:tabular-nums"


def touch(shown: "Touch") -> Markup:
    """Return one touch, with a sentence for each flag."""
    facts: dict[str, object] = {
        "ratio": Uncertainty.of(shown),
        "result": _result(shown),
        "begin": text.seconds(shown.start_s),
        "samples": f"{shown.samples:,}",
        "alarm": f"{shown.alarm_share:.0%} of the samples" if shown.alarm_share else "",
        "left out": ", ".join(f"{n:,} {why}" for n, why in ((shown.saturated, "saturated"), (shown.refused, "refused")) if n),
        "flags": ", ".join(shown.flags) or "none",
    }  # fmt: skip
    return _card("Touch", facts, said=advice(shown))


def _result(shown: "Touch") -> str:
    if shown.revised:
        before = Uncertainty.of_ratio(shown.first_ratio, shown.first_standard_error)
        return f"revised after the release; before: {before}"
    return "first, at the end of the touch" if shown.effects else ""


def touches(shown: "Sequence[Touch]", said: "Sequence[str]" = ()) -> Markup:
    """Return a table of touches, each ratio also as a bar on the same scale; then the sentences about their flags."""
    if not shown:
        return _card("No touches", {}, *_sentences(said))
    listed = list(shown)[:_MOST]
    known = [Uncertainty.of(one) for one in listed]
    bars = [(one.ratio - 2 * one.uncertainty, one.ratio + 2 * one.uncertainty) for one in known]
    scale = markup.span(end for bar in bars for end in bar)
    rows: list[list[object]] = [
        [number, text.seconds(one.start_s), f"{one.samples:,}", about, markup.interval(bar, scale), ", ".join(one.flags)]
        for number, (one, about, bar) in enumerate(zip(listed, known, bars, strict=True), 1)
    ]  # fmt: skip
    advised = [
        f"touch {number}: {sentence}"
        for number, one in enumerate(listed, 1)
        for sentence in advice(one)
    ]
    ends = " to ".join(map(number_format.number, scale))
    names = ["touch", "begin", "samples", "ratio", f"± 2 uncertainties, {ends}", "flags"]
    more = f"... and {len(shown) - _MOST:,} more" if len(shown) > _MOST else ""
    below = (_columns(names, rows), more, *_sentences([*advised, *said]))
    return _card(text.counted(len(shown), "touch"), {}, *below)


def _some(texts: Sequence[str]) -> str:
    return "; ".join(
        [*texts[:_MOST], *([f"... and {len(texts) - _MOST:,} more"] if len(texts) > _MOST else [])]
    )


def recording(shown: "Recording") -> Markup:
    """Return both channels as lines, what is known of them, and what was said of the file."""
    pairs = len(shown.hard)
    t_s, over = (
        (shown.t_hard_s, "time")
        if text.known_duration(shown)
        else (np.arange(pairs, dtype=float), "pairs")
    )
    facts: dict[str, object] = {
        "length": text.length(shown),
        "hard": _told(shown.hard),
        "soft": _told(shown.soft),
        "read as": shown.understood,
        "gaps": _some([f"row {row:,}" for row in shown.gap_rows]),
        "marks": _some([f"{text.seconds(t_s)} {name}" for t_s, name in shown.marks]),
        "notes": _some(shown.notes),
    }
    below: list[Markup] = []
    if pairs:
        caption = element(
            "small", f"change of hard (thick) and soft (thin) over {over}", style="opacity:0.7"
        )
        below = [markup.channels(t_s, changes(shown.hard)[0], changes(shown.soft)[0]), caption]
    return _card("Recording", facts, *below, said=shown.doubts[:_MOST])


def _told(readings: markup.Array) -> str:
    """Return the level of a channel at the begin, and its largest changes."""
    change, level_pF = changes(readings)
    if np.isnan(level_pF):
        return "no readings"
    low, high = float(np.nanmin(change)), float(np.nanmax(change))
    low_pF, high_pF = (number_format.number(value, (high - low) / 10) for value in (low, high))
    return f"{number_format.number(level_pF)} pF at the begin, change {low_pF} to {high_pF} pF"


def calibration(shown: "Calibration", picture: Callable[["Calibration"], Markup]) -> Markup:
    """Return the curve with the measured ratios, its parameters and the verdict on the fit."""
    low, high = shown.range
    error = float(shown.fitted.covariance[1, 1]) ** 0.5 * shown.probe.half_modulus
    specimens, values = len(set(shown.moduli.tolist())), len(shown.ratios)
    facts: dict[str, object] = {
        "calibrated": f"{low:g} to {high:g} MPa, {text.counted(specimens, 'specimen')}, {text.counted(values, 'value')}",
        "rigid ratio": text.rigid(shown),
        "half modulus": f"{text.ratio(shown.probe.half_modulus, error)} MPa",
    }
    try:
        facts["verdict"] = shown.verdict
        drawn = picture(shown)
    except MissingExtra as missing:
        facts["verdict"], drawn = str(missing), Markup()
    return _card("Calibration", facts, drawn)


def estimator(shown: Any) -> Markup:
    """Return the state of an estimator, and its settings."""
    facts: dict[str, object] = {"state": text.measured(shown)}
    if "threshold" in shown.settings:
        alarm = ", alarm" if shown.alarm else ""
        facts["statistic"] = (
            f"{number_format.number(shown.statistic)} of {shown.settings['threshold']:g}{alarm}"
        )
    return _card(type(shown).__name__, facts, _settings(shown.settings, text.defaults(shown)))


def tracker(shown: "Tracker") -> Markup:
    """Return the state of a tracker, its settings and its touches."""
    state = f"{shown.state}, {text.counted(shown.readings, 'reading')}"
    settings = _settings(shown.settings, text.own_class(shown)(shown.scene).settings)
    facts: dict[str, object] = {"state": state, "ratio": text.running_ratio(shown)}
    return _card(
        f"Tracker, scene {shown.scene}",
        facts,
        touches(shown.touches) if shown.touches else "",
        settings,
    )


def _settings(settings: dict[str, Any], defaults: dict[str, Any]) -> Markup:
    """Return all settings, folded in; those that are not the default are named on the fold."""
    others = ", ".join(
        f"{name} = {value}" for name, value in text.changed(settings, defaults).items()
    )
    every = ", ".join(f"{name} = {value}" for name, value in settings.items())
    return element(
        "details", element("summary", f"settings: {others or 'all as by default'}"), every
    )


def stream(shown: "Stream") -> Markup:
    """Return the state of a measurement, its counters and its touches."""
    counters = [f"{count:,} {name}" for name, count in shown.counters.as_dict().items() if count]
    samples = ", ".join(counters) or "none yet"
    return _card(
        f"Stream of {type(shown.source).__name__}", {"samples": samples}, tracker(shown.tracker)
    )


def _card(title: str, facts: dict[str, object], *below: object, said: Any = ()) -> Markup:
    """Return a heading, a table of names and values, sentences, and what else stands below.

    Values of nothing ("" or None) are left out.
    """
    rows = [
        element("tr", _cell("th", name, "font-weight:normal;opacity:0.7"), _cell("td", value))
        for name, value in facts.items()
        if value not in ("", None)
    ]
    table = [element("table", element("tbody", *rows), style=_TABLE)] if rows else []
    return element(
        "div", element("strong", title), *table, *_sentences(said), *below, style="line-height:1.4"
    )


def _sentences(said: Any) -> list[Markup]:
    """Return sentences that a reader should not miss, as a list with a coloured edge."""
    style = f"border-left:3px solid {WARNING};margin:0.4em 0;padding:0 0.6em;max-width:60em;white-space:pre-wrap"
    return [element("div", sentence, style=style) for sentence in said]


def _columns(names: list[str], rows: list[list[object]]) -> Markup:
    """Return a table with a header; its cells are aligned to the left."""
    head = element("tr", *(_cell("th", name) for name in names))
    body = [element("tr", *(_cell("td", cell) for cell in row)) for row in rows]
    return element("table", element("thead", head), element("tbody", *body), style=_TABLE)


def _cell(tag: str, content: object, more: str = "") -> Markup:
    wrap = "nowrap" if tag == "th" else "normal"
    return element(
        tag, content, style=f"text-align:left;white-space:{wrap};padding:0.1em 0.8em 0.1em 0;{more}"
    )
