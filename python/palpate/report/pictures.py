"""Pictures of a report, as SVG: each touch against time, and the calibration with its data."""

from collections.abc import Sequence
from math import log
from typing import NamedTuple

import numpy as np

from palpate import digits
from palpate.calibration.calibration import Calibration, band
from palpate.display import svg
from palpate.display.markup import MINUS, Markup
from palpate.report.results import Found, Result

_WIDTH, _HEIGHT, _POINTS = 84, 34, 60  # of a touch
_STEPS = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Heights of the scale, % from the result to each side."""
_SETTLED = 0.2  # share of a touch after which its estimate decides the scale
_CURVE_WIDTH, _CURVE_HEIGHT, _LEFT, _RIGHT, _TOP, _FOOT = 450, 250, 42, 442, 12, 208
_CURVE_POINTS = 80


class Scale(NamedTuple):
    """The scale that the pictures of all touches share: % from the result to each side, and s."""

    height: float
    length: float


def deviation_scale(touches: Sequence[Found]) -> Scale:
    """Return the scale on which the settled part of 9 samples of 10 of each kept touch fits."""
    height, length = _STEPS[0], 0.0
    for one in touches:
        settled = np.abs(_deviation(one)[int(_SETTLED * len(one.trace.t_s)) :])
        known = settled[np.isfinite(settled)]
        reach = float(np.quantile(known, 0.9)) if one.kept and len(known) else 0.0
        height = max(height, next((step for step in _STEPS if reach <= step), _STEPS[-1]))
        length = max(length, float(one.trace.t_s[-1]) if len(one.trace.t_s) else 0.0)
    return Scale(height, length or 1.0)


def _deviation(one: Found) -> svg.Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(100 * (one.trace.ratio / one.touch.ratio - 1))


def distance(one: Found, mean: float) -> str:
    """Return how far a touch is from the mean of its specimen, %; "": unknown."""
    share = 100 * (one.touch.ratio / mean - 1)
    return f"{share:+.1f}".replace("-", MINUS) if np.isfinite(share) else ""


def touch_picture(one: Found, scale: Scale) -> Markup:
    """Return the estimate of a touch in % from its result against time, with a band of one standard error."""
    x = svg.axis(0.0, scale.length, 1.0, _WIDTH - 1.0)
    y = svg.axis(-scale.height, scale.height, _HEIGHT - 1.0, 1.0)
    parts = [svg.ruler((0, _WIDTH), (_HEIGHT / 2, _HEIGHT / 2), "zero")]
    if len(one.trace.t_s):
        rows = np.unique(np.linspace(0, len(one.trace.t_s) - 1, _POINTS).astype(int))
        with np.errstate(divide="ignore", invalid="ignore"):
            middle, reach = _deviation(one)[rows], 100 * one.trace.error[rows] / abs(one.touch.ratio)
        if np.isfinite(reach).any():  # else a scene without a standard error
            parts.append(svg.area(x(one.trace.t_s[rows]), y(middle - reach), y(middle + reach), "band"))
        t_s, deviation = svg.envelope(one.trace.t_s, _deviation(one), _POINTS)
        parts.append(svg.line(x(t_s), y(deviation), "curve" if one.kept else "curve left"))
    return svg.picture(_WIDTH, _HEIGHT, f"touch {one.number}", *parts)


def calibration_picture(calibration: Calibration, seen: Sequence[Result] = ()) -> Markup:
    """Return a calibration as SVG: the curve, the band for a touch, and the data; `seen` are rings with names."""
    log_E, fitted, reach = band(calibration, _CURVE_POINTS)
    rigid, low, high = calibration.probe.rigid_ratio, float(np.exp(log_E[0])), float(np.exp(log_E[-1]))
    bottom = min(1.0, float(calibration.ratios.min()), calibration.probe.soft_ratio)
    top = 1.08 * max(rigid, float(calibration.ratios.max()))
    x, y = svg.axis(log(low), log(high), _LEFT, _RIGHT), svg.axis(bottom, top, _FOOT, _TOP)

    def place(modulus: float, ratio: float) -> tuple[float, float]:
        return float(x(np.array(log(min(max(modulus, low), high))))), float(y(np.array(ratio)))

    drawn = []
    for across, modulus in [(place(modulus, rigid)[0], modulus) for modulus in svg.decades(low, high)]:
        drawn += [
            svg.ruler((across, across), (_TOP, _FOOT), "grid"),
            svg.label(across, _FOOT + 15, f"{modulus:g}", "middle"),
        ]
    for down, ratio in [(place(low, ratio)[1], ratio) for ratio in svg.ticks(bottom, top)]:
        drawn += [svg.ruler((_LEFT, _RIGHT), (down, down), "grid"), svg.label(_LEFT - 6, down + 4, f"{ratio:g}", "end")]
    drawn += [svg.area(x(log_E), y(fitted - reach), y(fitted + reach), "band"), svg.line(x(log_E), y(fitted), "curve")]
    drawn += [svg.dot(*place(*one), "dot") for one in zip(calibration.moduli, calibration.ratios, strict=True)]
    told = f"rigid object: {digits.plus_minus(rigid, float(calibration.fitted.covariance[0, 0]) ** 0.5)}"
    level = place(low, rigid)[1]
    drawn += [svg.ruler((_LEFT, _RIGHT), (level, level), "dash"), svg.label(_LEFT + 8, level - 4, told)]
    for one in seen:
        assert one.modulus is not None  # of those that are shown
        across, down = place(one.modulus.value, one.mean)
        ends = place(one.modulus.low, one.mean)[0], place(one.modulus.high, one.mean)[0]
        left = across > (_LEFT + _RIGHT) / 2
        beside = (across - 8, down - 6, one.name, "end") if left else (across + 8, down + 14, one.name, "start")
        drawn += [svg.ruler(ends, (down, down), "bar"), svg.dot(across, down, "ring", 4), svg.label(*beside)]
    drawn.append(svg.label(_RIGHT, _CURVE_HEIGHT - 6, "ratio over modulus, MPa", "end"))
    return svg.picture(_CURVE_WIDTH, _CURVE_HEIGHT, "Calibration: ratio against modulus", *drawn)
