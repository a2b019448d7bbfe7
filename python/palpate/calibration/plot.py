"""Plots of a calibration with matplotlib, and as SVG: touches, specimens, curve, and the band for the next touch."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from palpate.calibration.model import Calibration, Modulus, band
from palpate.display import markup, text
from palpate.display.markup import ACCENT, Markup
from palpate.display.plots import COLUMN_IN, HANDHELD, HARD, PAPER, TRUTH, axes, written

_POINTS = 400


def draw_curve(ax: Any, calibration: Calibration, *, colour: str = HANDHELD) -> None:
    """Draw the curve and the band for a single touch, over a logarithmic axis of moduli."""
    x, level, reach = band(calibration, _POINTS)
    ax.fill_between(np.exp(x), level - reach, level + reach, color=colour, alpha=0.15, linewidth=0,
                    label="95 % of touches")  # fmt: skip
    ax.plot(np.exp(x), level, color=colour, label="eq. (2), fitted")
    ax.axhline(
        calibration.probe.rigid_ratio,
        **TRUTH,
        label=f"rigid object: {text.rigid_ratio(calibration)}",
    )
    moduli_axis(ax)
    ax.set_xlim(np.exp(x[0]), np.exp(x[-1]))
    ax.set_ylabel("capacitance ratio")


def draw_calibration(ax: Any, calibration: Calibration) -> Any:
    """Draw the curve, the measured ratios and the mean of each specimen on axes, or on new ones; return the axes."""
    with axes(ax) as drawn:
        draw_curve(drawn, calibration)
        drawn.plot(
            calibration.moduli,
            calibration.ratios,
            ".",
            color=HARD,
            markersize=3,
            label="measured",
            zorder=3,
        )
        rows = calibration.residuals
        drawn.errorbar([row.modulus for row in rows], [row.ratio for row in rows], [row.standard_error for row in rows],
                       fmt="_", color=PAPER, markersize=9, capsize=2, linewidth=0.8, label="specimen's mean, std. error")  # fmt: skip
        drawn.legend(loc="lower right")
    return drawn


def moduli_axis(ax: Any) -> None:
    """Set up the horizontal axis for moduli: logarithmic, with plain numbers."""
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_xlabel("Young's modulus, MPa")


def save_plot(calibration: Calibration, path: Path) -> None:
    """Write the plot; the suffix selects the format."""
    with written(path, 1.3 * COLUMN_IN, 0.9 * COLUMN_IN) as figure:
        draw_calibration(figure.add_subplot(), calibration)


_LEFT, _RIGHT, _TOP, _FOOT = 42.0, 442.0, 12.0, 208.0  # edges of the curve in the picture
_GRID: dict[str, Any] = {"stroke": "currentColor", "stroke_opacity": 0.15}
_BAR: dict[str, Any] = {"stroke": "currentColor", "stroke_width": 1.2}


def curve_picture(
    calibration: Calibration, seen: Iterable[tuple[str, float, Modulus]] = ()
) -> Markup:
    """Return SVG: the curve, the band for a touch, and the data; `seen`: names, ratios and moduli, as rings."""
    log_E, level, reach = band(calibration, 80)
    rigid, low, high = (
        calibration.probe.rigid_ratio,
        float(np.exp(log_E[0])),
        float(np.exp(log_E[-1])),
    )
    bottom = min(1.0, float(calibration.ratios.min()), calibration.probe.soft_ratio)
    top = 1.08 * max(rigid, float(calibration.ratios.max()))
    across, down = (
        markup.axis(log_E[0], log_E[-1], _LEFT, _RIGHT),
        markup.axis(bottom, top, _FOOT, _TOP),
    )

    def x(modulus: float) -> float:
        return float(across(np.log(np.clip(modulus, low, high))))

    def y(ratio: float) -> float:
        return float(down(np.array(ratio)))

    around, edge = np.append(log_E, log_E[::-1]), np.append(level - reach, (level + reach)[::-1])
    drawn = []
    for tick in markup.decades(low, high):
        drawn += [markup.path([x(tick)] * 2, (_TOP, _FOOT), **_GRID)]
        drawn += [markup.label(x(tick), _FOOT + 15, f"{tick:g}", "middle")]
    for tick in markup.ticks(bottom, top):
        drawn += [markup.path((_LEFT, _RIGHT), [y(tick)] * 2, **_GRID)]
        drawn += [markup.label(_LEFT - 6, y(tick) + 4, f"{tick:g}", "end")]
    drawn += [
        markup.path(across(around), down(edge), fill=ACCENT, fill_opacity=0.24),
        markup.path(across(log_E), down(level), stroke=ACCENT, stroke_width=2),
        markup.path((_LEFT, _RIGHT), [y(rigid)] * 2, stroke="currentColor", stroke_dasharray="5 4"),
        markup.label(_LEFT + 8, y(rigid) - 4, f"rigid object: {text.rigid_ratio(calibration)}"),
        markup.label(_RIGHT, 244, "ratio over modulus, MPa", "end"),
    ]
    for modulus, ratio in zip(calibration.moduli, calibration.ratios, strict=True):
        drawn += [markup.dot(x(modulus), y(ratio), fill="currentColor")]
    for name, ratio, found in seen:
        at, height = x(found.value), y(ratio)
        beside = (
            (at - 8, height - 6, name, "end")
            if at > (_LEFT + _RIGHT) / 2
            else (at + 8, height + 14, name)
        )
        drawn += [markup.path((x(found.low), x(found.high)), [height] * 2, **_BAR)]
        drawn += [markup.dot(at, height, 4, fill="none", **_BAR), markup.label(*beside)]
    return markup.drawing(450, 250, "Calibration: ratio against modulus", *drawn)
