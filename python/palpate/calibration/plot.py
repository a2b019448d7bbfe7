"""Drawings of a calibration with matplotlib and as SVG: curve, band for a touch, and data."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from palpate.calibration.assessment import Residual
from palpate.calibration.fit import Array
from palpate.calibration.modulus import Modulus
from palpate.display import markup, text
from palpate.display.markup import ACCENT, Axis, Markup
from palpate.display.plots import COLUMN_IN, HANDHELD, HARD, PAPER, RATIO_AXIS, TRUTH, written


@dataclass(frozen=True, eq=False)
class CalibrationCurve:
    """The numbers of a drawing; made by `Calibration.curve`.

    Attributes
    ----------
    log_modulus : numpy.ndarray, shape (points,)
        log(E / MPa), in even steps.
    ratio, reach : numpy.ndarray, shape (points,)
        The curve, and the distance from it within which 95 % of single touches lie.
    rigid_ratio, rigid_error, soft_ratio : float
        Ratio on a rigid object with its standard error; ratio on an infinitely soft one.
    moduli, ratios : numpy.ndarray, shape (n,)
        The fitted data; moduli in MPa.
    specimens : sequence of Residual
        The mean of each specimen.
    """

    log_modulus: Array
    ratio: Array
    reach: Array
    rigid_ratio: float
    rigid_error: float
    soft_ratio: float
    moduli: Array
    ratios: Array
    specimens: Sequence[Residual]

    @property
    def modulus(self) -> Array:
        """Moduli of the points, MPa."""
        return np.asarray(np.exp(self.log_modulus))

    @property
    def low(self) -> Array:
        """Lower edge of the band."""
        return self.ratio - self.reach

    @property
    def high(self) -> Array:
        """Upper edge of the band."""
        return self.ratio + self.reach

    @property
    def rigid_label(self) -> str:
        """Label of the ratio on a rigid object."""
        return f"rigid object: {text.ratio(self.rigid_ratio, self.rigid_error)}"


def draw_curve(ax: Any, curve: CalibrationCurve, *, colour: str = HANDHELD) -> None:
    """Draw the curve and the band on matplotlib axes, over a logarithmic axis of moduli."""
    modulus = curve.modulus
    ax.fill_between(
        modulus,
        curve.low,
        curve.high,
        label="95 % of touches",
        color=colour,
        alpha=0.15,
        linewidth=0,
    )
    ax.plot(modulus, curve.ratio, color=colour, label="eq. (2), fitted")
    ax.axhline(curve.rigid_ratio, **TRUTH, label=curve.rigid_label)
    moduli_axis(ax)
    ax.set_xlim(modulus[0], modulus[-1])
    ax.set_ylabel(RATIO_AXIS)


def draw_calibration(ax: Any, curve: CalibrationCurve) -> None:
    """Draw curve, ratios and means of specimens on axes."""
    draw_curve(ax, curve)
    ax.plot(
        curve.moduli,
        curve.ratios,
        ".",
        color=HARD,
        markersize=3,
        label="measured",
        zorder=3,
    )
    specimens = [(each.modulus, each.ratio, each.standard_error) for each in curve.specimens]
    ax.errorbar(
        *np.transpose(specimens),
        fmt="_",
        color=PAPER,
        markersize=9,
        capsize=2,
        linewidth=0.8,
        label="mean of a specimen ± std. error (k = 1)",
    )
    ax.legend(loc="lower right")


def moduli_axis(ax: Any) -> None:
    """Set up the horizontal axis for moduli: logarithmic, with plain numbers."""
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_xlabel("Young's modulus, MPa")


def save_plot(curve: CalibrationCurve, path: Path) -> None:
    """Write the plot; the suffix selects the format."""
    with written(path, 1.3 * COLUMN_IN, 0.9 * COLUMN_IN) as figure:
        draw_calibration(figure.add_subplot(), curve)


class MeasuredObject(NamedTuple):
    """Another object in the plot: its name, mean ratio and modulus."""

    name: str
    ratio: float
    modulus: Modulus


# edges of the curve in the picture
_LEFT = 42.0
_RIGHT = 442.0
_TOP = 24.0
_FOOT = 220.0
_GRID: dict[str, object] = {"stroke": "currentColor", "stroke_opacity": 0.15}
_BAR: dict[str, object] = {"stroke": "currentColor", "stroke_width": 1.2}


class _Scales(NamedTuple):
    """The axes of the picture: from log(E / MPa) and ratio to pixels."""

    curve: CalibrationCurve
    across: Axis
    down: Axis

    def x(self, modulus: float) -> float:
        """Return the pixel of a modulus, MPa; one outside is at the edge."""
        ends = self.curve.modulus
        inside = np.clip(modulus, ends[0], ends[-1])
        return float(self.across(np.log(inside)))

    def y(self, ratio: float) -> float:
        """Return the pixel of a ratio."""
        return float(self.down(np.array(ratio)))


def curve_picture(curve: CalibrationCurve, objects: Iterable[MeasuredObject] = ()) -> Markup:
    """Return an SVG picture: the curve, its band, the data as dots, and objects as rings."""
    bottom = min(1.0, float(curve.ratios.min()), curve.soft_ratio)
    top = 1.08 * max(curve.rigid_ratio, float(curve.ratios.max()))
    softest = curve.log_modulus[0]
    stiffest = curve.log_modulus[-1]
    across = markup.axis(softest, stiffest, _LEFT, _RIGHT)
    scales = _Scales(curve, across, markup.axis(bottom, top, _FOOT, _TOP))
    drawn = _grid(scales, bottom, top)
    drawn += _curve_and_band(scales)
    for modulus, ratio in zip(curve.moduli, curve.ratios, strict=True):
        x = scales.x(modulus)
        y = scales.y(ratio)
        drawn.append(markup.dot(x, y, fill="currentColor"))
    for one in objects:
        drawn += _ring(scales, one)
    return markup.drawing(
        450, 262, "Calibration: ratio of the capacitance changes against Young's modulus", *drawn
    )


def _grid(scales: _Scales, bottom: float, top: float) -> list[Markup]:
    """Return the lines and numbers of both axes."""
    drawn = []
    ends = scales.curve.modulus
    for modulus in markup.decades(float(ends[0]), float(ends[-1])):
        x = scales.x(modulus)
        line = markup.path((x, x), (_TOP, _FOOT), **_GRID)
        drawn.append(line)
        drawn.append(markup.label(x, _FOOT + 15, f"{modulus:g}", "middle"))
    for ratio in markup.ticks(bottom, top):
        y = scales.y(ratio)
        line = markup.path((_LEFT, _RIGHT), (y, y), **_GRID)
        drawn.append(line)
        drawn.append(markup.label(_LEFT - 6, y + 4, f"{ratio:g}", "end"))
    return drawn


def _curve_and_band(scales: _Scales) -> list[Markup]:
    """Return the band, the curve, and the line of a rigid object with its label."""
    curve, across, down = scales
    around = np.append(curve.log_modulus, curve.log_modulus[::-1])
    edge = np.append(curve.low, curve.high[::-1])
    rigid = scales.y(curve.rigid_ratio)
    dashed: dict[str, object] = {"stroke": "currentColor", "stroke_dasharray": "5 4"}
    return [
        markup.path(
            across(around),
            down(edge),
            fill=ACCENT,
            fill_opacity=0.24,
        ),
        markup.path(
            across(curve.log_modulus),
            down(curve.ratio),
            stroke=ACCENT,
            stroke_width=2,
        ),
        markup.path((_LEFT, _RIGHT), (rigid, rigid), **dashed),
        markup.label(_LEFT + 8, rigid - 4, curve.rigid_label),
        markup.label((_LEFT + _RIGHT) / 2, _FOOT + 36, "Young's modulus, MPa", "middle"),
        markup.label(0, 12, RATIO_AXIS),
    ]


def _ring(scales: _Scales, one: MeasuredObject) -> list[Markup]:
    """Return the ring of an object, the interval of its modulus, and its name on the freer side."""
    x = scales.x(one.modulus.value)
    y = scales.y(one.ratio)
    ends = scales.x(one.modulus.low), scales.x(one.modulus.high)
    name = markup.label(x + 8, y + 14, one.name)
    if x > (_LEFT + _RIGHT) / 2:
        name = markup.label(x - 8, y - 6, one.name, "end")
    bar = markup.path(ends, (y, y), **_BAR)
    ring = markup.dot(x, y, 4, fill="none", **_BAR)
    return [bar, ring, name]
