"""The picture of a report, as SVG: the calibration with its data."""

from collections.abc import Sequence
from math import log

import numpy as np

from palpate import digits
from palpate.calibration.calibration import Calibration, band
from palpate.display import svg
from palpate.display.markup import Markup
from palpate.report.results import Result

_CURVE_WIDTH, _CURVE_HEIGHT, _LEFT, _RIGHT, _TOP, _FOOT = 450, 250, 42, 442, 12, 208
_CURVE_POINTS = 80


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
