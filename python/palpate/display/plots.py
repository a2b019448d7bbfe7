"""Figures of a recording and of touches with matplotlib, and the style of all figures."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import isfinite, isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import number_format
from palpate.display import text
from palpate.display.markup import Array, changes
from palpate.errors import need
from palpate.files import replacing
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from palpate.recording import Recording
    from palpate.touch import Touch

RATIO_AXIS = "Ratio of the capacitance changes"
"""Label of an axis of ratios."""
SUFFIXES = (".png", ".pdf", ".svg")
"""Formats of a figure in a file."""
COLUMN_IN = 3.5
PAGE_IN = 7.16
"""Widths of one column and of two columns of a journal page, inches."""
# The colours of the live page, which colour-blind readers can distinguish (Okabe and Ito, 2008).
HARD = "#3A3D40"
SOFT = "#7D848A"
PAPER = "#D55E00"
HANDHELD = "#0072B2"
SLOW = "#009E73"
FAST = "#CC79A7"
TRUTH: Mapping[str, object] = {
    "color": "black",
    "linewidth": 0.7,
    "linestyle": (0, (4, 2)),
}
STYLE: Mapping[str, object] = {
    **dict.fromkeys(("font.size", "axes.titlesize", "axes.labelsize"), 8),
    **dict.fromkeys(("legend.fontsize", "xtick.labelsize", "ytick.labelsize"), 7),
    **dict.fromkeys(("axes.linewidth", "grid.linewidth"), 0.5),
    "lines.linewidth": 1.0,
    "lines.markersize": 4,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.alpha": 0.25,
    "legend.frameon": False,
    "savefig.dpi": 300,
    "pdf.fonttype": 42,
    "svg.hashsalt": "palpate",
}


@contextmanager
def sheet(width_in: float, height_in: float) -> Iterator[Any]:
    """Yield an empty figure in print style.

    The caller's matplotlib settings do not change, and no window opens.
    """
    with need("matplotlib", "science").rc_context(STYLE):
        figure = need("matplotlib.figure", "science").Figure
        yield figure(figsize=(width_in, height_in), layout="constrained")


@contextmanager
def written(path: Path, width_in: float, height_in: float) -> Iterator[Any]:
    """Yield a `sheet`, and write it; the suffix selects the format."""
    require_figure_name(path)
    with sheet(width_in, height_in) as figure:
        yield figure
        with replacing(path) as file:
            suffix = path.suffix.lower()
            figure.savefig(file, format=suffix.removeprefix("."))


@contextmanager
def axes(ax: Any) -> Iterator[Any]:
    """Yield the axes to draw on: `ax`, or new ones in a figure of pyplot, which a notebook shows.

    The style applies inside only; nothing is shown, and the caller's settings stay.
    """
    figure = None
    if ax is None:
        # Before the context, which would restore the backend that a notebook's first figure selects.
        pyplot = need("matplotlib.pyplot", "science")
        size = (COLUMN_IN * 1.5, COLUMN_IN * 0.8)
        figure = pyplot.figure(figsize=size, layout="constrained")
    with need("matplotlib", "science").rc_context(STYLE):
        yield figure.add_subplot() if figure else ax


_ABOVE: Mapping[str, object] = {
    "loc": "lower left",
    "bbox_to_anchor": (0, 1),
    "ncols": 2,
    "borderaxespad": 0.2,
}
"""Place of a legend: above the axes, where nothing is drawn."""


def draw_recording(shown: "Recording", ax: Any) -> None:
    """Draw the change of both channels over time, with marks and gaps."""
    t_hard: Array = np.arange(len(shown.hard), dtype=float)
    t_soft = t_hard
    is_timed = text.known_duration(shown) is not None
    if is_timed:
        t_hard = shown.t_hard_s
        t_soft = shown.t_soft_s
    _draw_channel(ax, "hard", t_hard, shown.hard, HARD, shown.unit)
    _draw_channel(ax, "soft", t_soft, shown.soft, SOFT, shown.unit)
    for row in shown.gap_rows:
        ax.axvline(t_hard[row], color=PAPER, linestyle="--", linewidth=0.8)
    if is_timed:
        for t_s, name in shown.marks:
            if not isnan(t_s):
                _draw_mark(ax, t_s, name)
    ax.set_xlabel("time, s" if is_timed else "pair")
    ax.set_ylabel(f"change, {shown.unit}")
    ax.legend(**_ABOVE)


def _draw_channel(
    ax: Any,
    name: str,
    t: Any,
    readings: Array,
    colour: str,
    unit: str,
) -> None:
    change, level = changes(readings)
    label = f"{name}, from {number_format.number(level)} {unit}"
    ax.plot(t, change, color=colour, label=label)


def _draw_mark(ax: Any, t_s: float, name: str) -> None:
    ax.axvline(t_s, color="0.5", linestyle=":", linewidth=0.8)
    ax.annotate(
        name,
        (t_s, 1),
        xycoords=("data", "axes fraction"),
        xytext=(2, -2),
        va="top",
        ha="left",
        textcoords="offset points",
        rotation=90,
        fontsize=6,
        parse_math=False,
    )


def draw_touches(shown: "Sequence[Touch]", ax: Any) -> None:
    """Draw the ratio of each touch over its start, with its uncertainty and flags."""
    at = [touch.start_s for touch in shown]
    is_timed = not any(map(isnan, at))
    if not is_timed:
        at = list(range(1, len(shown) + 1))
    ratios = [touch.ratio for touch in shown]
    uncertainties = [Uncertainty.of(touch).uncertainty for touch in shown]
    errors = np.nan_to_num(uncertainties, nan=0.0)
    ax.errorbar(
        at,
        ratios,
        errors,
        fmt="o",
        color=HANDHELD,
        capsize=3,
        label="ratio ± uncertainty (k = 1)",
    )
    ax.legend(**_ABOVE)
    for x, touch in zip(at, shown, strict=True):
        if touch.flags and isfinite(touch.ratio):
            ax.annotate(
                ", ".join(touch.flags),
                (x, touch.ratio),
                fontsize=6,
                xytext=(5, 3),
                textcoords="offset points",
            )
    ax.set_xlabel("begin of the touch, s" if is_timed else "touch")
    ax.set_ylabel(RATIO_AXIS)
    ax.margins(x=0.08, y=0.2)


def save_figure(shown: "Recording", found: "Sequence[Touch]", path: Path) -> None:
    """Write a figure of a recording, and of its touches below it."""
    with written(path, PAGE_IN, 0.6 * PAGE_IN) as figure:
        is_timed = text.known_duration(shown) is not None
        upper, lower = figure.subplots(2, 1, sharex=is_timed)
        draw_recording(shown, upper)
        draw_touches(found, lower)
        if is_timed:
            upper.set_xlabel("")


def require_figure_name(path: Path) -> None:
    """Refuse the name of a figure whose suffix is not one of `SUFFIXES`."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"plot: got {path.name!r}, allowed: a name that ends in {', '.join(SUFFIXES)}"
        )
