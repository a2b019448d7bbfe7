"""Figures of a recording and of touches with matplotlib (axes in, axes out), and the style of all figures."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate import number_format
from palpate.display import text
from palpate.display.markup import changes
from palpate.errors import need
from palpate.files import replacing
from palpate.uncertainty import Uncertainty

if TYPE_CHECKING:
    from palpate._core import Touch
    from palpate.recording import Recording

SUFFIXES = (".png", ".pdf", ".svg")
"""Formats of a figure in a file."""
COLUMN_IN, PAGE_IN = 3.5, 7.16  # widths of one and of two columns of a journal page, inches
HARD, SOFT, PAPER, HANDHELD, SLOW, FAST = (
    "#3A3D40",
    "#7D848A",
    "#D55E00",
    "#0072B2",
    "#009E73",
    "#CC79A7",
)
"""Those of the live page, which colour-blind readers can distinguish (Okabe and Ito, 2008); each has one meaning."""
TRUTH: dict[str, Any] = {"color": "black", "linewidth": 0.7, "linestyle": (0, (4, 2))}
STYLE: dict[str, Any] = {
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
    """Yield an empty figure in print style; the caller's matplotlib settings do not change, no window opens."""
    with need("matplotlib", "science").rc_context(STYLE):
        yield need("matplotlib.figure", "science").Figure(
            figsize=(width_in, height_in), layout="constrained"
        )


@contextmanager
def written(path: Path, width_in: float, height_in: float) -> Iterator[Any]:
    """Yield a `sheet`, and write it; the suffix selects the format."""
    check(path)
    with sheet(width_in, height_in) as figure:
        yield figure
        with replacing(path) as file:
            figure.savefig(file, format=path.suffix[1:].lower())


@contextmanager
def axes(ax: Any) -> Iterator[Any]:
    """Yield the axes to draw on: those given, or new ones in a figure of pyplot, which a notebook shows by itself.

    The style holds inside only; nothing is shown, and the caller's settings stay.
    """
    figure = None
    if (
        ax is None
    ):  # before the context: the first figure selects a notebook's backend, which its end would take back
        pyplot = need("matplotlib.pyplot", "science")
        figure = pyplot.figure(figsize=(COLUMN_IN * 1.5, COLUMN_IN * 0.8), layout="constrained")
    with need("matplotlib", "science").rc_context(STYLE):
        yield figure.add_subplot() if figure else ax


def recording(shown: "Recording", ax: Any = None) -> Any:
    """Draw the change of both channels over time, with marks and gaps; return the axes."""
    with axes(ax) as drawn:
        timed = text.known_duration(shown) is not None
        t_hard, t_soft = (
            (shown.t_hard_s, shown.t_soft_s) if timed else (np.arange(len(shown.hard)),) * 2
        )
        for name, t, readings, colour in (
            ("hard", t_hard, shown.hard, HARD),
            ("soft", t_soft, shown.soft, SOFT),
        ):
            change, level_pF = changes(readings)
            drawn.plot(
                t,
                change,
                color=colour,
                label=f"{name}, from {number_format.number(level_pF)} {shown.unit}",
            )
        for row in shown.gap_rows:
            drawn.axvline(t_hard[row], color=PAPER, linestyle="--", linewidth=0.8)
        for at_s, name in shown.marks if timed else ():
            if not isnan(at_s):
                drawn.axvline(at_s, color="0.5", linestyle=":", linewidth=0.8)
                drawn.annotate(name, (at_s, 1), xycoords=("data", "axes fraction"), xytext=(2, -2), va="top", ha="left",
                               textcoords="offset points", rotation=90, fontsize=6, parse_math=False)  # fmt: skip
        drawn.set_xlabel("time, s" if timed else "pair")
        drawn.set_ylabel(f"change, {shown.unit}")
        drawn.legend(**_ABOVE)
    return drawn


_ABOVE: dict[str, Any] = {
    "loc": "lower left",
    "bbox_to_anchor": (0, 1),
    "ncols": 2,
    "borderaxespad": 0.2,
}
"""Place of a legend: above the axes, where nothing is drawn."""


def touches(shown: "Sequence[Touch]", ax: Any = None) -> Any:
    """Draw the ratio of each touch over its begin, with its uncertainty and its flags; return the axes."""
    with axes(ax) as drawn:
        timed = all(not isnan(one.start_s) for one in shown)
        at = np.array([one.start_s if timed else number for number, one in enumerate(shown, 1)])
        ratios = np.array([one.ratio for one in shown])
        errors = np.nan_to_num([Uncertainty.of(one).uncertainty for one in shown], nan=0.0)
        drawn.errorbar(
            at, ratios, errors, fmt="o", color=HANDHELD, capsize=3, label="ratio, uncertainty"
        )
        drawn.legend(**_ABOVE)
        for x, y, one in zip(at, ratios, shown, strict=True):
            if one.flags and np.isfinite(y):
                drawn.annotate(
                    ", ".join(one.flags),
                    (x, y),
                    xytext=(5, 3),
                    textcoords="offset points",
                    fontsize=6,
                )
        drawn.set_xlabel("begin of the touch, s" if timed else "touch")
        drawn.set_ylabel("capacitance ratio")
        drawn.margins(x=0.08, y=0.2)
    return drawn


def save(shown: "Recording", found: "Sequence[Touch]", path: Path) -> None:
    """Write a figure of a recording, and of its touches below it."""
    with written(path, PAGE_IN, 0.6 * PAGE_IN) as figure:
        timed = text.known_duration(shown) is not None
        upper, lower = figure.subplots(2, 1, sharex=timed)
        recording(shown, upper)
        touches(found, lower)
        if timed:
            upper.set_xlabel("")


def check(path: Path) -> None:
    """Refuse a name of a figure whose suffix is not one of `SUFFIXES`."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"plot: got {path.name!r}, allowed: a name that ends in {', '.join(SUFFIXES)}"
        )
