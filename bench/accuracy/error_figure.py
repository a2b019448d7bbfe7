"""Figure of errors: against run time for all estimators, and against the time since contact, with the Fisher bound."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from palpate.benchmark import Row
from palpate.figure_style import FAST, HANDHELD, HARD, PAGE_IN, PAPER, SLOW, SOFT, TRUTH, sheet

from bench.accuracy.since_contact import BOUND, SINCE_S, Curves

MARKS = {
    "handheld scene": ("o", HANDHELD, 6.0),
    "sliding scene": ("D", HANDHELD, 7.5),
    "paper scene": ("o", PAPER, 6.0),
    "paper": ("s", PAPER, 4.0),
    "fixed 0.995": ("s", SLOW, 4.0),
    "fixed 0.9": ("s", FAST, 4.0),
    "lfilter 0.995": ("^", SLOW, 4.5),
    "padasip": ("v", HARD, 4.5),
    "river": ("P", HARD, 4.5),
    "filterpy": ("X", SOFT, 4.5),
}
"""Marker, colour and size of each estimator: circles for scenes of readings, squares for bare estimators of palpate."""
LARGE = 7.0  # a mark above this size is an outline, around another one


def draw(rows: Sequence[Row], bounds: dict[str, float], since: dict[str, Curves], path: Path) -> None:
    """Draw both kinds of panels to a PNG file."""
    with sheet(PAGE_IN, 4.6) as figure:
        axes = figure.subplots(2, 4, sharey="row")
        for ax, (scenario, bound) in zip(axes[0], bounds.items(), strict=True):
            against_run_time(ax, scenario, [r for r in rows if r.scenario == scenario], bound)
        axes[0, 0].set_ylabel("steady rms error, %")
        for ax, (tremor, curves) in zip(axes[1], since.items(), strict=False):
            against_time(ax, tremor, curves)
        axes[1, 0].set_ylabel("rms error of the running ratio, %")
        legend(axes)
        figure.savefig(path, dpi=200)


def against_run_time(ax: Any, scenario: str, rows: Sequence[Row], bound: float) -> None:
    """Draw the errors of one scenario, one mark for each estimator."""
    for row in rows:
        if math.isfinite(row.ns):
            marker, colour, size = MARKS[row.estimator]
            look = {"mfc": "none", "mew": 0.8} if size > LARGE else {"mec": "white", "mew": 0.4}
            ax.loglog(row.ns, 100 * row.rms, marker, color=colour, ms=size, label=row.estimator, **look)
    ax.axhline(100 * bound, **TRUTH, label=BOUND)
    ax.set_title(scenario)
    ax.set_xlabel("run time, ns a pair")


def against_time(ax: Any, tremor: str, curves: Curves) -> None:
    """Draw the errors against the time since contact, one line for each scene."""
    for name, errors in curves.items():
        percent = 100 * np.asarray(errors)
        if name == BOUND:
            ax.loglog(SINCE_S, percent, **TRUTH)
        elif name != "sliding scene":  # the same as handheld until its memory ends
            ax.loglog(SINCE_S, percent, color=MARKS[name][1])
    ax.set_title(f"tremor {tremor}")
    ax.set_xlabel("time since contact, s")
    ax.set_xticks([0.2, 0.5, 1, 2, 5], ["0.2", "0.5", "1", "2", "5"])
    ax.minorticks_off()


def legend(axes: Any) -> None:
    """Put one legend for all panels in the place of the last one."""
    axes[1, 3].set_axis_off()
    handles, labels = axes[0, 0].get_legend_handles_labels()
    order = sorted(range(len(labels)), key=lambda i: [*MARKS, BOUND].index(labels[i]))
    axes[1, 3].legend([handles[i] for i in order], [labels[i] for i in order], loc="center left")
