"""Plot of a calibration: touches, specimens, curve, and the band for the next touch."""

from pathlib import Path
from typing import Any

import numpy as np

from palpate import digits
from palpate.calibration.calibration import Calibration, band
from palpate.calibration.curve_fit import curve
from palpate.display.plots import COLUMN_IN, HANDHELD, HARD, PAPER, TRUTH, axes, sheet
from palpate.files import replacing

_POINTS = 400
_DOTS: dict[str, Any] = {"marker": ".", "linestyle": "", "color": HARD, "markersize": 3}


def draw(ax: Any, calibration: Calibration, *, colour: str = HANDHELD, label: str = "eq. (2), fitted") -> None:
    """Draw the curve and the band for a single touch, over a logarithmic axis of moduli."""
    x, level, reach = band(calibration, _POINTS)
    ax.fill_between(np.exp(x), level - reach, level + reach, color=colour, alpha=0.15, linewidth=0,
                    label="95 % of touches")  # fmt: skip
    ax.plot(np.exp(x), level, color=colour, label=label)
    ax.axhline(calibration.probe.rigid_ratio, **TRUTH, label=f"rigid object: {_rigid(calibration)}")
    moduli_axis(ax)
    ax.set_xlim(np.exp(x[0]), np.exp(x[-1]))
    ax.set_ylabel("capacitance ratio")


def on(ax: Any, calibration: Calibration) -> Any:
    """Draw the curve and the measured ratios on axes, or on new ones; return the axes."""
    with axes(ax) as drawn:
        draw(drawn, calibration)
        _measured(drawn, calibration)
        drawn.legend(loc="lower right")
    return drawn


def _measured(ax: Any, calibration: Calibration) -> None:
    ax.plot(calibration.moduli, calibration.ratios, label="measured", zorder=3, **_DOTS)


def _rigid(calibration: Calibration) -> str:
    return digits.number(calibration.probe.rigid_ratio, float(calibration.fitted.covariance[0, 0]) ** 0.5)


def moduli_axis(ax: Any) -> None:
    """Set up the horizontal axis for moduli: logarithmic, with plain numbers."""
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_xlabel("Young's modulus, MPa")


def _figure(figure: Any, calibration: Calibration) -> None:
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1.2])
    rows = calibration.residuals
    moduli = [row.modulus for row in rows]
    bars: dict[str, Any] = {"fmt": "_", "color": PAPER, "markersize": 9, "capsize": 2, "linewidth": 0.8}
    draw(upper, calibration)
    _measured(upper, calibration)
    upper.errorbar(moduli, [row.ratio for row in rows], [row.standard_error for row in rows],
                   label="specimen's mean, std. error", **bars)  # fmt: skip
    upper.legend(loc="lower right")
    upper.set_xlabel("")
    upper.set_title("ratio against modulus, and the distance from the curve")
    level = curve(calibration.fitted.parameters, np.log(calibration.moduli))
    lower.axhline(0, color=HANDHELD)
    lower.plot(calibration.moduli, 100 * (calibration.ratios / level - 1), zorder=3, **_DOTS)
    lower.errorbar(moduli, [100 * row.relative for row in rows], [100 * row.standard_error / row.fitted for row in rows],
                   **bars)  # fmt: skip
    lower.set_ylabel("distance, %")
    moduli_axis(lower)


def save(calibration: Calibration, path: Path) -> None:
    """Write the plot; the suffix selects the format: .png, .pdf, .svg."""
    if path.suffix not in (".png", ".pdf", ".svg"):
        raise ValueError(f"plot: got {path.name!r}, allowed: a name that ends in .png, .pdf or .svg")
    with sheet(1.3 * COLUMN_IN, 1.2 * COLUMN_IN) as figure:
        _figure(figure, calibration)
        with replacing(path) as file:
            figure.savefig(file, format=path.suffix[1:])
