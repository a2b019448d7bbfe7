"""Figure of errors: every scenario with all estimators, run times, and errors against the time since contact."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from palpate.benchmark import Row
from palpate.figure_style import FAST, HANDHELD, HARD, PAGE_IN, PAPER, SLOW, SOFT, TRUTH, sheet

from bench.accuracy.must_hold.front import OWN, TIMES, compare
from bench.accuracy.since_contact import BOUND, SINCE_S, Curves
from bench.rivals import OFFLINE

OUTLINE = {"mfc": "none", "mew": 0.9}
FILLED = {"mec": "white", "mew": 0.4}
MARKS: dict[str, dict[str, Any]] = {
    "paper scene": {"marker": "o", "color": PAPER, "ms": 5.0, **OUTLINE},
    "paper +A": {"marker": "o", "color": PAPER, "ms": 5.0, **FILLED},
    "fixed 0.995 +A": {"marker": "s", "color": SLOW, "ms": 5.0, **OUTLINE},
    "fixed 0.9 +A": {"marker": "s", "color": FAST, "ms": 4.5, **FILLED},
    "Kalman walk +A": {"marker": "^", "color": HARD, "ms": 5.5, **FILLED},
    "sum / sum +A": {"marker": "v", "color": SOFT, "ms": 5.5, **FILLED},
    OFFLINE: {"marker": "x", "color": SOFT, "ms": 3.5, "mew": 0.8},
    OWN[0]: {"marker": "D", "color": HANDHELD, "ms": 5.0, **FILLED},
}
"""Look of each estimator; handheld is drawn last, over the others."""
TITLES = {"paper scene": "paper, as shipped", OWN[0]: "handheld", OFFLINE: "spline, offline"}


def draw(rows: Sequence[Row], bounds: dict[str, float], since: dict[str, Curves], path: Path) -> None:
    """Draw all panels to a PNG file."""
    with sheet(PAGE_IN, 8.2) as figure:
        left, right = figure.add_gridspec(1, 2, width_ratios=(1.6, 1))
        errors = figure.add_subplot(left)
        scenarios(errors, rows, bounds)
        parts = right.subgridspec(5, 1, height_ratios=(1.2, 1.35, 1, 1, 1))
        legend(figure.add_subplot(parts[0]), errors)
        run_times(figure.add_subplot(parts[1]), rows)
        for place, (tremor, curves) in zip((2, 3, 4), since.items(), strict=False):
            against_time(figure.add_subplot(parts[place]), tremor, curves, last=place == 4)
        figure.savefig(path, dpi=200)


def scenarios(ax: Any, rows: Sequence[Row], bounds: dict[str, float]) -> None:
    """Draw one line for each scenario, with a mark for each estimator; at its end, handheld / best of the others."""
    names = list(dict.fromkeys(row.scenario for row in rows))
    for estimator, look in MARKS.items():
        found = {row.scenario: 100 * row.rmse for row in rows if row.estimator == estimator}
        places = [names.index(name) for name in found]
        ax.semilogx(list(found.values()), places, ls="", label=TITLES.get(estimator, estimator), **look)
    places = [names.index(name) for name in bounds if name in names]
    ticks = [100 * bounds[names[place]] for place in places]
    ax.semilogx(ticks, places, "k|", ms=9, mew=1.0, label=f"{BOUND} (dashed)")
    for place, name in enumerate(names):
        here = [row for row in rows if row.scenario == name]
        times = compare(here).times
        look = {"color": PAPER, "weight": "bold"} if times > TIMES else {"color": HANDHELD}
        ax.text(1.02, place, f"{times:.2f}", transform=ax.get_yaxis_transform(), va="center", fontsize=7, **look)
    ax.text(1.02, -1.2, "handheld\n/ best", transform=ax.get_yaxis_transform(), va="bottom", fontsize=6.5)
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.set_xlabel("steady rms error, %, median of the seeds")


def run_times(ax: Any, rows: Iterable[Row]) -> None:
    """Draw the run time of each estimator that has one, the fastest at the top."""
    found = {row.estimator: row.ns for row in rows if math.isfinite(row.ns)}
    names = sorted(found, key=lambda name: found[name])
    colours = {**dict.fromkeys(OWN, HANDHELD), "paper scene": PAPER, "paper": PAPER}
    ax.barh(range(len(names)), [found[name] for name in names], 0.6, color=[colours.get(name, SOFT) for name in names])
    ax.set_xscale("log")
    ax.set_yticks(range(len(names)), names)
    ax.invert_yaxis()
    ax.set_title("run time, ns a pair")


def against_time(ax: Any, tremor: str, curves: Curves, *, last: bool) -> None:
    """Draw the errors against the time since contact: the scenes, and the rivals that are best at its end."""
    for name in ("sum / sum +A", "paper +A", "paper scene", OWN[0]):
        look = {"color": MARKS[name]["color"], "ls": "-" if name.endswith("scene") else ":"}
        ax.loglog(SINCE_S, 100 * np.asarray(curves[name]), **look)
    ax.loglog(SINCE_S, 100 * np.asarray(curves[BOUND]), **TRUTH)
    ax.set_title(f"tremor {tremor}")
    ax.set_ylabel("running error, %")
    ax.set_xticks([0.2, 0.5, 1, 2, 5], ["0.2", "0.5", "1", "2", "5"] if last else [])
    ax.minorticks_off()
    if last:
        ax.set_xlabel("time since contact, s")


def legend(ax: Any, errors: Any) -> None:
    """Put the legend into a place of its own; in the panels against time the rivals are dotted."""
    ax.set_axis_off()
    handles, labels = errors.get_legend_handles_labels()
    ax.legend(handles, labels, loc="upper left", bbox_to_anchor=(-0.3, 1.0), borderaxespad=0).set_in_layout(False)
