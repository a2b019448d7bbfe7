"""Objects as HTML, for a notebook."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from palpate import digits
from palpate.display import drawings, text
from palpate.display.changes import changes
from palpate.display.markup import Markup, captioned, card, columns, element, sentences
from palpate.errors import MissingExtra
from palpate.sentences import advice

if TYPE_CHECKING:
    from palpate._core import Touch, Tracker
    from palpate.display.kinds import Curve, Estimator, Measurement, Pairs

_MOST = 50
"""Touches, marks and notes shown of a list."""


def touch(shown: "Touch") -> Markup:
    """Return one touch, with a sentence for each flag."""
    facts: dict[str, object] = {
        "ratio": text.ratio(shown.ratio, shown.standard_error),
        "result": _result(shown),
        "begin": text.seconds(shown.start_s),
        "samples": f"{shown.samples:,}",
        "alarm": f"{shown.alarm_share:.0%} of the samples" if shown.alarm_share else "",
        "left out": ", ".join(f"{n:,} {why}" for n, why in ((shown.saturated, "saturated"), (shown.refused, "refused")) if n),
        "flags": ", ".join(shown.flags) or "none",
    }  # fmt: skip
    return card("Touch", facts, said=advice(shown))


def _result(shown: "Touch") -> str:
    if not shown.revised:
        return "first, at the end of the touch" if shown.effects else ""
    before = text.ratio(shown.first_ratio, shown.first_standard_error)
    return f"revised after the release; before: {before}"


def touches(shown: "Sequence[Touch]", said: "Sequence[str]" = ()) -> Markup:
    """Return a table of touches, each ratio also as a bar on the same scale; then the sentences about their flags."""
    if not shown:
        return card("No touches", {}, *sentences(said))
    listed = list(shown)[:_MOST]
    scale = drawings.span((one.ratio, one.standard_error) for one in listed)
    rows: list[list[object]] = [
        [number, text.seconds(one.start_s), f"{one.samples:,}", text.ratio(one.ratio, one.standard_error),
         drawings.interval(one.ratio, one.standard_error, scale), ", ".join(one.flags)]
        for number, one in enumerate(listed, 1)
    ]  # fmt: skip
    advised = [f"touch {number}: {sentence}" for number, one in enumerate(listed, 1) for sentence in advice(one)]
    names = ["touch", "begin", "samples", "ratio", f"± 2 std. errors, {_ends(scale)}", "flags"]
    return card(
        text.counted(len(shown), "touch"),
        {},
        columns(names, rows),
        _more(len(shown)),
        *sentences([*advised, *said]),
    )


def _ends(scale: tuple[float, float]) -> str:
    low, high = scale
    return f"{digits.number(low)} to {digits.number(high)}"


def _more(count: int) -> str:
    return f"... and {count - _MOST:,} more" if count > _MOST else ""


def recording(shown: "Pairs") -> Markup:
    """Return both channels as lines, what is known of them, and what was said of the file."""
    duration = text.known_duration(shown)
    pairs = len(shown.hard)
    length_s = duration.total_seconds() if duration else 0.0
    rate = f"{digits.number((pairs - 1) / length_s)} pairs a second" if length_s else "rate unknown"
    t_s = np.arange(pairs, dtype=float) if duration is None else shown.t_hard_s
    hard, soft = changes(shown.hard), changes(shown.soft)
    facts: dict[str, object] = {
        "length": f"{text.lasting(duration)}, {text.counted(pairs, 'pair')}, {rate}",
        "hard": hard.told,
        "soft": soft.told,
        "read as": shown.understood,
        "gaps": ", ".join(f"row {row:,}" for row in shown.gap_rows[:_MOST]),
        "marks": _marks(shown),
        "notes": "; ".join([*shown.notes[:_MOST], _more(len(shown.notes))]).rstrip("; "),
    }
    caption = f"change of hard (thick) and soft (thin) over {'pairs' if duration is None else 'time'}"
    picture = captioned(drawings.channels(t_s, hard.values, soft.values), caption) if pairs else ""
    return card("Recording", facts, picture, said=shown.doubts[:_MOST])


def _marks(shown: "Pairs") -> str:
    told = [f"{text.seconds(t_s)} {name}" for t_s, name in shown.marks[:_MOST]]
    return ", ".join(told) + _more(len(shown.marks))


def calibration(shown: "Curve") -> Markup:
    """Return the curve with the measured ratios, its parameters and the verdict on the fit."""
    low, high = shown.range
    moduli = np.geomspace(low / 2, high * 2, 100)
    line = np.array([shown.probe.ratio(modulus) for modulus in moduli.tolist()])
    error = float(shown.fitted.covariance[1, 1]) ** 0.5 * shown.probe.half_modulus
    facts: dict[str, object] = {
        "calibrated": f"{low:g} to {high:g} MPa, {text.counted(len(set(shown.moduli.tolist())), 'specimen')}, "
        f"{text.counted(len(shown.ratios), 'value')}",
        "rigid ratio": text.rigid(shown),
        "half modulus": f"{text.ratio(shown.probe.half_modulus, error)} MPa",
    }
    try:
        facts["verdict"] = shown.verdict
    except MissingExtra as missing:
        facts["verdict"] = str(missing)
    picture = drawings.curve(shown.moduli, shown.ratios, (moduli, line))
    caption = f"ratio over modulus, {digits.number(moduli[0])} to {digits.number(moduli[-1])} MPa, logarithmic"
    return card("Calibration", facts, captioned(picture, caption))


def estimator(shown: "Estimator") -> Markup:
    """Return the state of an estimator, and its settings."""
    others = text.changed(shown.settings, text.own_class(shown)().settings)
    facts: dict[str, object] = {
        "ratio": text.ratio(shown.ratio, getattr(shown, "standard_error", float("nan"))),
        "samples": f"{shown.samples:,}" + (f", {shown.rejected:,} rejected" if shown.rejected else ""),
        "statistic": _statistic(shown),
    }
    return card(type(shown).__name__, facts, _settings(shown.settings, others))


def _statistic(shown: "Estimator") -> str:
    if "threshold" not in shown.settings:
        return ""
    alarm = ", alarm" if shown.alarm else ""
    return f"{digits.number(shown.statistic)} of {shown.settings['threshold']:g}{alarm}"


def tracker(shown: "Tracker") -> Markup:
    """Return the state of a tracker, its settings and its touches."""
    others = text.changed(shown.settings, text.own_class(shown)(shown.scene).settings)
    facts: dict[str, object] = {
        "state": f"{shown.state}, {text.counted(shown.readings, 'reading')}",
        "ratio": text.running_ratio(shown),
    }
    below = touches(shown.touches) if shown.touches else ""
    return card(f"Tracker, scene {shown.scene}", facts, below, _settings(shown.settings, others))


def _settings(settings: dict[str, float], others: dict[str, float]) -> Markup:
    """Return all settings, folded in; those that are not the default are named on the fold."""
    named = ", ".join(f"{name} = {value}" for name, value in others.items()) or "all as by default"
    every = ", ".join(f"{name} = {value}" for name, value in settings.items())
    return element("details", element("summary", f"settings: {named}"), every)


def stream(shown: "Measurement") -> Markup:
    """Return the state of a measurement, its counters and its touches."""
    counters = {name: f"{count:,}" for name, count in shown.counters.as_dict().items() if count}
    facts: dict[str, object] = {
        "state": shown.tracker.state,
        "ratio": text.running_ratio(shown.tracker),
        "samples": ", ".join(f"{count} {name}" for name, count in counters.items()) or "none yet",
    }
    below = touches(shown.touches) if shown.touches else ""
    return card(f"Stream of {type(shown.source).__name__}", facts, below)
