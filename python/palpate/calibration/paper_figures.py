"""Fig. 10, 11 and 12 of the paper, of touches on specimens of known modulus."""

from collections.abc import Sequence
from dataclasses import asdict
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from palpate import number_format
from palpate.calibration.fit import Array
from palpate.calibration.model import Calibration
from palpate.calibration.plot import draw_curve, moduli_axis
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens, rises
from palpate.display.plots import (
    COLUMN_IN,
    HANDHELD,
    HARD,
    PAPER,
    RATIO_AXIS,
    SLOW,
    TRUTH,
    written,
)

FIGURES = ("10", "11", "12")
"""Numbers of the figures in the paper."""
_MODULI = "Young's modulus, MPa"
_WIDE = 1.3 * COLUMN_IN
_HEIGHTS = {"10": 0.9, "11": 1.1, "12": 0.9}  # of the width of a column


class _Look(NamedTuple):
    """How a way to choose a ratio is drawn."""

    column: str
    mark: str
    colour: str
    label: str


_LOOKS = (
    _Look("mean", "s", SLOW, "mean"),
    _Look("smallest P", "o", PAPER, "smallest $P$, as in the paper"),
    _Look("smallest error", "^", HANDHELD, "smallest standard error"),
)


def save_paper_figure(
    number: str, specimens: Sequence[SpecimenTouches], path: Path, *, by: str = "covariance"
) -> str:
    """Write a figure of the paper from own touches.

    Parameters
    ----------
    number : str
        One of `FIGURES`.
    specimens : sequence of SpecimenTouches
        In the order of their moduli.
    path : pathlib.Path
        Its suffix selects the format.
    by : str
        Values that Fig. 12 fits; the paper's: the touch with the smallest P.

    Returns
    -------
    str
        One line that says what the figure shows.

    Raises
    ------
    ValueError
        There are too few specimens or touches.
    """
    calibration = fit_specimens(specimens, by=by) if number == "12" else None
    with written(path, _WIDE, _HEIGHTS[number] * _WIDE) as figure:
        if calibration is not None:
            draw_fit(figure.add_subplot(), calibration)
            return f"eq. (2): {', '.join(parameter_texts(calibration))}"
        if number == "10":
            draw_spread(figure, specimens)
            return f"mean and standard deviation of {len(specimens)} specimens"
        draw_choices(figure, specimens)
    return "; ".join(_monotonic(specimens))


def _moduli(specimens: Sequence[SpecimenTouches]) -> Array:
    return np.array([one.modulus for one in specimens])


def _ratios(specimens: Sequence[SpecimenTouches], column: str) -> Array:
    """Return the ratio of each specimen, as in a column of `RATIO_COLUMNS`."""
    return np.array([one.ratios[column] for one in specimens])


def draw_spread(figure: Any, specimens: Sequence[SpecimenTouches]) -> None:
    """Draw ratio against modulus: mean and standard deviation; inset: logarithmic moduli."""
    ax = figure.subplots()
    inset = ax.inset_axes((0.46, 0.19, 0.51, 0.44))
    moduli = _moduli(specimens)
    means = _ratios(specimens, "mean")
    spread = []
    for one in specimens:
        spread.append(one.mean * one.spread)
    for axes in (ax, inset):
        axes.errorbar(
            moduli,
            means,
            np.nan_to_num(spread),
            fmt="o",
            color=PAPER,
            capsize=2,
            linewidth=0.8,
            markersize=4,
            mfc="none",
            label="mean and std. deviation",
        )
        for number, one in enumerate(specimens):
            ratios = [one.ratio_of(touch)[0] for touch in one.usable]
            axes.plot(
                [one.modulus] * len(ratios),
                ratios,
                ".",
                color=HARD,
                markersize=2,
                label="each touch" if number == 0 else None,
                zorder=3,
            )
    ax.set_xlim(-0.02 * max(moduli), 1.06 * max(moduli))
    ax.set_ylim(0, 1.2 * max(means))
    ax.set_xlabel(_MODULI)
    ax.set_ylabel(RATIO_AXIS)
    moduli_axis(inset)
    inset.set_xlabel("the same, logarithmic", fontsize=7)
    inset.tick_params(labelsize=6)
    ax.legend(loc="upper left")


def draw_choices(figure: Any, specimens: Sequence[SpecimenTouches]) -> None:
    """Draw the ratio of each specimen by the mean, and by the touch with the smallest P.

    Below is the distance from the mean.
    """
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2.2, 1])
    moduli = _moduli(specimens)
    means = _ratios(specimens, "mean")
    lower.axhline(0, **TRUTH)
    for look in _LOOKS:
        ratios = _ratios(specimens, look.column)
        if not np.isfinite(ratios).any():
            continue
        _draw_ratios(upper, moduli, ratios, look)
        if look.column != "mean":
            _draw_ratios(lower, moduli, 100 * (ratios / means - 1), look)
    upper.set_ylabel(RATIO_AXIS)
    lower.set_ylabel("from the mean, %")
    moduli_axis(lower)
    upper.legend(loc="upper left")


def _draw_ratios(ax: Any, moduli: Array, values: Array, look: _Look) -> None:
    label = look.label
    ax.plot(moduli, values, look.mark, label=label, color=look.colour, mfc="none", markersize=4.5)


def draw_fit(ax: Any, calibration: Calibration) -> None:
    """Draw equation (2), fitted, with its band, the data and the parameters."""
    draw_curve(ax, calibration.curve(400))
    ax.plot(
        calibration.moduli,
        calibration.ratios,
        "o",
        color=PAPER,
        mfc="none",
        markersize=4,
        label="measured",
        zorder=3,
    )
    ax.legend(loc="lower right")
    lines = "\n".join(parameter_texts(calibration))
    ax.text(0.03, 0.97, lines, transform=ax.transAxes, va="top", fontsize=7)


def parameter_texts(calibration: Calibration) -> list[str]:
    """Return each fitted parameter with its 95 % interval."""
    lines = []
    fitted = asdict(calibration.probe)
    for name, ends in calibration.parameter_intervals().items():
        if ends[1] > ends[0]:
            value, low, high = number_format.between(fitted[name], *ends)
            unit = " MPa" if name.endswith("modulus") else ""
            lines.append(f"{name.replace('_', ' ')} {value} ({low} to {high}){unit}")
    return lines


def _monotonic(specimens: Sequence[SpecimenTouches]) -> list[str]:
    """Return for each way to choose a ratio whether it rises with the modulus."""
    texts = []
    for look in _LOOKS:
        ratios = _ratios(specimens, look.column).tolist()
        if not all(map(isfinite, ratios)):
            continue
        verdict = "rises from specimen to specimen" if rises(ratios) else "does not always rise"
        texts.append(f"{look.column}: {verdict}")
    return texts
