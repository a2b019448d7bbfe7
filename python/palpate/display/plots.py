"""Figures of a recording and of touches, with matplotlib: axes in, axes out."""

from collections.abc import Sequence
from contextlib import contextmanager
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.display import text
from palpate.display.changes import changes
from palpate.extras import need
from palpate.figure_style import COLUMN_IN, HANDHELD, HARD, PAGE_IN, PAPER, SOFT, STYLE, sheet
from palpate.files import replacing

if TYPE_CHECKING:
    from collections.abc import Iterator

    from palpate._core import Touch
    from palpate.display.kinds import Pairs

SUFFIXES = (".png", ".pdf", ".svg")
"""Formats of a figure in a file."""


@contextmanager
def axes(ax: Any, width_in: float = COLUMN_IN * 1.5, height_in: float = COLUMN_IN * 0.8) -> "Iterator[Any]":
    """Yield the axes to draw on: those given, or new ones in a figure of pyplot, which a notebook shows by itself.

    The style holds inside only; nothing is shown, and the caller's settings stay.
    """
    figure = None
    if ax is None:  # before the context: the first figure selects a notebook's backend, which its end would take back
        pyplot = need("matplotlib.pyplot", "science")
        figure = pyplot.figure(figsize=(width_in, height_in), layout="constrained")
    with need("matplotlib", "science").rc_context(STYLE):
        yield figure.add_subplot() if figure else ax


def recording(shown: "Pairs", ax: Any = None) -> Any:
    """Draw the change of both channels over time, with marks and gaps; return the axes."""
    with axes(ax) as drawn:
        timed = text.known_duration(shown) is not None
        t_hard, t_soft = (shown.t_hard_s, shown.t_soft_s) if timed else (np.arange(len(shown.hard)),) * 2
        for name, t, readings, colour in (("hard", t_hard, shown.hard, HARD), ("soft", t_soft, shown.soft, SOFT)):
            change = changes(readings)
            drawn.plot(t, change.values, color=colour, label=f"{name}, from {change.level}")
        for row in shown.gap_rows:
            drawn.axvline(t_hard[row], color=PAPER, linestyle="--", linewidth=0.8)
        for at_s, name in shown.marks if timed else ():
            _mark(drawn, at_s, name)
        drawn.set_xlabel("time, s" if timed else "pair")
        drawn.set_ylabel("change, pF")
        drawn.legend(loc="upper left")
    return drawn


def _mark(ax: Any, at_s: float, name: str) -> None:
    ax.axvline(at_s, color="0.5", linestyle=":", linewidth=0.8)
    ax.annotate(name, (at_s, 1), xycoords=("data", "axes fraction"), xytext=(2, -2), textcoords="offset points",
                rotation=90, ha="left", va="top", fontsize=6, parse_math=False)  # fmt: skip


def touches(shown: "Sequence[Touch]", ax: Any = None) -> Any:
    """Draw the ratio of each touch over its begin, with its standard error and its flags; return the axes."""
    with axes(ax) as drawn:
        timed = all(not isnan(one.start_s) for one in shown)
        for flagged in (False, True):
            rows = [
                (one.start_s if timed else number, one.ratio, one.standard_error, ", ".join(one.flags))
                for number, one in enumerate(shown, 1)
                if bool(one.flags) is flagged
            ]
            if rows:
                _ratios(drawn, rows, flagged=flagged)
        drawn.set_xlabel("begin of the touch, s" if timed else "touch")
        drawn.set_ylabel("capacitance ratio")
        drawn.margins(x=0.08, y=0.2)
        if shown:
            drawn.legend(loc="upper left")
    return drawn


def _ratios(ax: Any, rows: list[tuple[float, float, float, str]], *, flagged: bool) -> None:
    at, ratios, errors, names = zip(*rows, strict=True)
    face = "none" if flagged else HANDHELD
    label = "with flags" if flagged else "ratio, std. error"
    known = np.nan_to_num(errors, nan=0.0, posinf=0.0)
    ax.errorbar(at, ratios, known, fmt="o", color=HANDHELD, markerfacecolor=face, capsize=3, label=label)
    for x, y, name in zip(at, ratios, names, strict=True):
        if np.isfinite(y):
            ax.annotate(name, (x, y), xytext=(5, 3), textcoords="offset points", fontsize=6)


def save(shown: "Pairs", found: "Sequence[Touch]", path: Path) -> None:
    """Write a figure of a recording, and of its touches below it; the suffix selects the format.

    Raises
    ------
    ValueError
        A suffix that is not one of `SUFFIXES`.
    """
    check(path)
    with sheet(PAGE_IN, 0.6 * PAGE_IN) as figure:
        timed = text.known_duration(shown) is not None
        upper, lower = figure.subplots(2, 1, sharex=timed)
        recording(shown, upper)
        touches(found, lower)
        if timed:
            upper.set_xlabel("")
        with replacing(path) as file:
            figure.savefig(file, format=path.suffix[1:].lower())


def check(path: Path) -> None:
    """Refuse a name of a figure whose suffix is not one of `SUFFIXES`."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"plot: got {path.name!r}, allowed: a name that ends in {', '.join(SUFFIXES)}")
