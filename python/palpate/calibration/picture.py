"""The calibration as a picture on a page: curve, band for a touch, data and what was measured; below it the distances."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray

from palpate import digits
from palpate.calibration.band import band
from palpate.calibration.calibration import Calibration
from palpate.calibration.curve_fit import curve
from palpate.display import chart
from palpate.display.markup import MINUS, Markup

Array = NDArray[np.float64]
_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _SPLIT, _FOOT = 450, 290, 42, 442, 12, 180, 248
_POINTS = 80


@dataclass(frozen=True)
class Seen:
    """A measured object: drawn as a ring with its name, and its interval as a bar.

    Attributes
    ----------
    name : str
    modulus, low, high : float, MPa
        Where it is drawn, and the ends of the bar; 0 and inf reach to the edge.
    ratio : float
    """

    name: str
    modulus: float
    low: float
    high: float
    ratio: float


def picture(calibration: Calibration, seen: Sequence[Seen] = ()) -> Markup:
    """Return the picture as SVG.

    Parameters
    ----------
    calibration : Calibration
    seen : sequence of Seen
        Objects that were measured with it.
    """
    return _Picture(calibration).drawn(seen)


class _Picture:
    """The axes, and what is drawn on them."""

    def __init__(self, calibration: Calibration) -> None:
        self._of = calibration
        self._log_E, self._curve, self._reach = band(calibration, _POINTS)
        self._span = float(np.exp(self._log_E[0])), float(np.exp(self._log_E[-1]))
        data = calibration.ratios
        self._distances = 100 * (data / curve(calibration.fitted.parameters, np.log(calibration.moduli)) - 1)
        self._top = 1.08 * max(calibration.probe.rigid_ratio, float(data.max()))
        self._bottom = min(1.0, float(data.min()), calibration.probe.soft_ratio)
        self._far = 1.15 * max(float(np.abs(self._distances).max()), 1.0)
        self._x = chart.axis(float(self._log_E[0]), float(self._log_E[-1]), _LEFT, _RIGHT)
        self._y = chart.axis(self._bottom, self._top, _SPLIT - 14, _TOP)
        self._z = chart.axis(-self._far, self._far, _FOOT, _SPLIT + 16)

    def drawn(self, seen: Sequence[Seen]) -> Markup:
        """Return the whole."""
        x, y = self._x(self._log_E), self._y
        band = chart.area(x, y(self._curve - self._reach), y(self._curve + self._reach), "band")
        rigid = float(y(np.array(self._of.probe.rigid_ratio)))
        error = float(self._of.fitted.covariance[0, 0]) ** 0.5
        told = f"rigid object: {digits.plus_minus(self._of.probe.rigid_ratio, error)}"
        return chart.picture(
            _WIDTH, _HEIGHT, "Calibration: ratio against modulus, and below it the distance of each value from eq. (2)",
            *self._grid(), band, chart.line(x, y(self._curve), "curve"),
            chart.ruler((_LEFT, _RIGHT), (rigid, rigid), "dash"), chart.label(_LEFT + 8, rigid - 4, told),
            *self._data(), *(part for one in seen for part in self._object(one)),
            chart.label(_RIGHT, _HEIGHT - 6, "modulus, MPa", "end"),
            chart.label(_LEFT, _HEIGHT - 6, "above: ratio; below: distance from eq. (2), %"),
        )  # fmt: skip

    def _grid(self) -> list[Markup]:
        found = []
        for modulus in chart.decades(*self._span):
            x = self._across(modulus)
            found += [
                chart.ruler((x, x), (_TOP, _FOOT), "grid"),
                chart.label(x, _FOOT + 15, f"{modulus:g}", "middle"),
            ]
        for ratio in chart.ticks(self._bottom, self._top):
            found += self._level(float(self._y(np.array(ratio))), f"{ratio:g}")
        for distance in chart.ticks(-self._far, self._far, 4):
            found += self._level(float(self._z(np.array(distance))), f"{distance:+g}".replace("+0", "0"), distance == 0)
        return found

    def _level(self, y: float, text: str, zero: bool = False) -> list[Markup]:
        return [
            chart.ruler((_LEFT, _RIGHT), (y, y), "zero" if zero else "grid"),
            chart.label(_LEFT - 6, y + 4, text.replace("-", MINUS), "end"),
        ]

    def _across(self, modulus: float) -> float:
        """Return the pixel of a modulus; 0 and inf are at the edges."""
        low, high = self._span
        return float(self._x(np.array(log(min(max(modulus, low), high)))))

    def _data(self) -> list[Markup]:
        across = [self._across(modulus) for modulus in self._of.moduli.tolist()]
        return [
            chart.dot(x, down, "dot")
            for values in (self._y(self._of.ratios), self._z(self._distances))
            for x, down in zip(across, values.tolist(), strict=True)
        ]

    def _object(self, one: Seen) -> list[Markup]:
        x, y = self._across(one.modulus), float(self._y(np.array(one.ratio)))
        bar = chart.ruler((self._across(one.low), self._across(one.high)), (y, y), "bar")
        left = x > (_LEFT + _RIGHT) / 2
        return [
            bar,
            chart.dot(x, y, "ring", 4),
            chart.label(x - 8 if left else x + 8, y - 6 if left else y + 14, one.name, "end" if left else "start"),
        ]
