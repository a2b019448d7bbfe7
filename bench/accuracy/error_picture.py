"""The picture of error against run time: a panel for each scenario, a named point for each estimator.

All estimators get the same aligned pairs, except the published one. So a run time is the time of an estimator alone.
Libraries that compute the same result in a Python loop are one point. Marks that would cover each other are one mark with several names, and names
stand where they cover nothing.
"""

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from palpate.display.plots import HANDHELD, HARD, PAGE_IN, PAPER, SLOW, SOFT, TRUTH, written

from bench.accuracy import rivals
from bench.accuracy.comparison import ALIGNED, PICTURED, Row

Array = NDArray[np.float64]
HEIGHT_IN = 7.4
DPI = 300
PT = DPI / 72  # pixels
TIMES = 1.1  # smaller quotients of two errors are the same error
LOOPS = [name + ALIGNED for name in rivals.LIBRARIES if name != "scipy"]
NAMES = {
    "handheld scene": "handheld",
    "sliding scene": "sliding",
    "paper scene": "paper",
    "paper +A": "paper, aligned",
    "paper tuned +A": "paper, tuned",
    "fixed 0.995 +A": "Rls(0.995)",
    "fixed 0.9 +A": "Rls(0.9)",
    **{name + ALIGNED: name for name in (*rivals.METHODS, "scipy")},
}
"""Estimator -> its name in the picture, the most important first."""


@dataclass(frozen=True)
class Look:
    """Mark and colour of a point, and the size of both mark and name, points."""

    mark: str
    colour: str
    size: float = 4.0
    text: float = 6.0


LOOKS = {
    "handheld": Look("D", HANDHELD, 7.5, 8.0),
    "sliding": Look("D", HANDHELD, 4.0, 7.0),
    "paper": Look("o", PAPER, 6.0, 8.0),
    "paper, aligned": Look("o", PAPER),
    "paper, tuned": Look("o", PAPER),
    "Rls(0.995)": Look("s", SLOW),
    "Rls(0.9)": Look("s", SLOW),
}
OTHER = Look("o", SOFT)
HOLLOW = "paper"
SCENES = ("handheld", "sliding")


@dataclass(frozen=True)
class Point:
    """One estimator in one panel; errors in per cent."""

    name: str
    ns: float
    error: float
    error_90: float
    slowest_ns: float

    @property
    def look(self) -> Look:
        """Of its first name."""
        return LOOKS.get(self.name.split("\n")[0], OTHER)


def points(rows: Iterable[Row]) -> list[Point]:
    """Return the points of one panel: what has a run time; all libraries in Python are one."""
    of = {row.estimator: row for row in rows if math.isfinite(row.cost.ns)}
    found = [_point(NAMES[name], [of[name]]) for name in NAMES if name in of]
    loops = sorted((of[name] for name in LOOPS if name in of), key=lambda row: row.cost.ns)
    if loops:
        names = [row.estimator.removesuffix(ALIGNED) for row in loops]
        found.append(_point("\n".join(names), loops))
    return found


def _point(name: str, rows: Sequence[Row]) -> Point:
    first = rows[0]
    return Point(
        name,
        first.cost.estimator_ns,
        100 * first.rmse,
        100 * max(first.rmse, first.rmse_90),
        rows[-1].cost.estimator_ns,
    )


def front(shown: Iterable[Point]) -> list[Point]:
    """Return the points that are better by 1 % than all faster ones, the fastest first."""
    best: list[Point] = []
    for point in sorted(shown, key=lambda point: point.ns):
        if not best or point.error < 0.99 * best[-1].error:
            best.append(point)
    return best


def verdict(shown: Sequence[Point]) -> str:
    """Return how handheld compares with the best estimator that is no scene for a probe in the hand."""
    own = next(point for point in shown if point.name == "handheld")
    others = [point for point in shown if point.name not in SCENES]
    best = min(others, key=lambda point: point.error)
    other = best.name.split("\n")[0]
    times = best.error / own.error
    if times > TIMES:
        return f"handheld is {times:.1f} times better than the next, {other}"
    if times < 1 / TIMES:
        return f"{other} is {1 / times:.1f} times better than handheld"
    return f"handheld is as good as the best other, {other}"


def plot(rows: Sequence[Row], path: Path) -> None:
    """Draw error against run time."""
    with written(path, PAGE_IN, HEIGHT_IN) as figure:
        axes = figure.subplots(3, 2, sharex=True)
        panels = []
        for ax, (name, shows) in zip(axes.flat, PICTURED.items(), strict=True):
            shown = points(row for row in rows if row.scenario == name)
            _frame(ax, shown)
            _title(ax, shows, verdict(shown))
            panels.append((ax, shown))
        stages_ns = next(row.cost.stages_ns for row in rows if row.estimator == "handheld scene")
        for ax in axes[-1]:
            ax.set_xlabel("run time of the estimator, ns per pair")
        for ax in axes[:, 0]:
            ax.set_ylabel("error of the ratio, %")
        _legend(figure, stages_ns)
        figure.set_dpi(DPI)  # a name has another width at another resolution
        figure.draw_without_rendering()  # places the axes
        figure.set_layout_engine("none")
        for ax, shown in panels:
            _panel(ax, shown)


def _title(ax: Any, shows: str, text: str) -> None:
    ax.set_title(shows, weight="bold", pad=14)
    ahead = text.startswith("handheld")
    ax.annotate(
        text,
        (0, 1),
        xycoords="axes fraction",
        xytext=(0, 3),
        textcoords="offset points",
        color=HANDHELD if ahead else HARD,
        size=7,
    )


def _legend(figure: Any, stages_ns: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    keys = [
        (Line2D([], [], **FRONT), "front: nothing faster has a smaller error"),
        (Patch(**WORSE), "slower than handheld, and worse"),
        (
            Line2D([], [], color=SOFT, marker="|", ms=7, ls=""),
            "to the 90th percentile of the recordings",
        ),
        (Line2D([], [], color=PAPER, marker="o", ls="", mfc="white"), "on readings as they come"),
        (
            Line2D([], [], color=SOFT, marker="o", ls=""),
            f"on aligned pairs: all other stages take {stages_ns:.0f} ns more",
        ),
    ]
    handles, labels = zip(*keys, strict=True)
    figure.legend(handles, labels, loc="outside lower center", ncols=2)


FRONT: Mapping[str, Any] = TRUTH
WORSE: Mapping[str, Any] = {"fc": HANDHELD, "ec": "none", "alpha": 0.08}


def _frame(ax: Any, shown: Sequence[Point]) -> None:
    """Set the axes of a panel, with room for names."""
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlim(1.5, 2.5 * max(point.slowest_ns for point in shown))
    low = min(point.error for point in shown)
    high = max(point.error_90 for point in shown)
    room = (high / low) ** 0.15
    ax.set_ylim(low / room, high * room)
    from matplotlib.ticker import LogLocator

    subs = (1.0,) if high > 100 * low else (1.0, 2.0, 5.0)
    ax.yaxis.set_major_locator(LogLocator(subs=subs))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter("")
    ax.xaxis.set_major_formatter("{x:,.0f}")


def _panel(ax: Any, shown: Sequence[Point]) -> None:
    best = front(shown)
    right = ax.get_xlim()[1]
    ns = [*(point.ns for point in best), right]
    errors = [*(point.error for point in best), best[-1].error]
    ax.step(ns, errors, where="post", zorder=1, **FRONT)
    end = (right, best[-1].error)
    below = {"xytext": (-3, -2), "textcoords": "offset points", "ha": "right", "va": "top"}
    ax.annotate("front", end, size=6, **below)
    corners = ax.transData.transform(np.column_stack([ns, errors]))
    own = next(point for point in shown if point.name == "handheld")
    top = ax.get_ylim()[1]
    ax.fill_between([own.ns, right], own.error, top, zorder=0, lw=0, **WORSE)
    marks = merged(shown, _pixels(ax, shown), PT)
    for point in marks:
        _draw(ax, point)
    taken = [*_outside(ax), *_steps(corners)]
    for point, at in zip(marks, _pixels(ax, marks), strict=True):
        taken += _covered(ax, point, at)
    for point, at in zip(marks, _pixels(ax, marks), strict=True):
        taken.append(_name(ax, point, at, taken))


def _pixels(ax: Any, shown: Sequence[Point]) -> Array:
    places: Array = ax.transData.transform([(point.ns, point.error) for point in shown])
    return places


def merged(shown: Sequence[Point], pixels: Array, scale: float) -> list[Point]:
    """Return the points, those whose marks would cover each other by half as one with both names."""
    found: list[Point] = []
    places: list[Array] = []
    for point, place in zip(shown, pixels, strict=True):
        for i, other in enumerate(found):
            near = scale * max(point.look.size, other.look.size) / 2
            if np.hypot(*(place - places[i])) < near:
                found[i] = replace(other, name=f"{other.name}\n{point.name}")
                break
        else:
            found.append(point)
            places.append(place)
    return found


def _draw(ax: Any, point: Point) -> None:
    look = point.look
    inside = "white" if point.name.split("\n")[0] == HOLLOW else look.colour
    up = point.error_90 - point.error
    right = point.slowest_ns - point.ns
    ax.errorbar(
        point.ns,
        point.error,
        yerr=[[0], [up]],
        xerr=[[0], [right]],
        fmt=look.mark,
        color=look.colour,
        mfc=inside,
        ms=look.size,
        mew=0.9,
        elinewidth=0.7,
        capsize=1.5,
        capthick=0.7,
        zorder=4 if look.size > 4 else 3,
    )


@dataclass(frozen=True)
class Box:
    """A rectangle, pixels."""

    left: float
    bottom: float
    right: float
    top: float

    def overlap(self, other: "Box") -> float:
        """Return the area that is in both."""
        wide = min(self.right, other.right) - max(self.left, other.left)
        high = min(self.top, other.top) - max(self.bottom, other.bottom)
        return max(wide, 0.0) * max(high, 0.0)


EIGHT = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (1, -1), (0, -1), (-1, -1)]
BETWEEN = [(1, 0.5), (0.5, 1), (-0.5, 1), (-1, 0.5), (1, -0.5), (0.5, -1), (-0.5, -1), (-1, -0.5)]
DIRECTIONS = EIGHT + BETWEEN


def place(at: Array, wide: float, high: float, gaps: Sequence[float], taken: Sequence[Box]) -> Box:
    """Return the nearest place of a name beside its mark that covers least of what is taken."""
    choices = []
    for gap in gaps:
        for across, up in DIRECTIONS:
            left = at[0] + across * gap + (across - 1) / 2 * wide
            bottom = at[1] + up * gap + (up - 1) / 2 * high
            choices.append(Box(left, bottom, left + wide, bottom + high))
    return min(choices, key=lambda box: sum(box.overlap(other) for other in taken))


def _name(ax: Any, point: Point, mark: Array, taken: Sequence[Box]) -> Box:
    """Write the names of a mark, with a line to it if they are apart, and return their place."""
    look = point.look
    colour = HARD if look == OTHER else look.colour
    text = ax.text(0, 0, point.name, color=colour, size=look.text, va="bottom", zorder=5)
    text.set(linespacing=1.0, in_layout=False)
    size = text.get_window_extent()
    gaps = [PT * (look.size / 2 + gap) for gap in (1.5, 4, 8, 13, 19, 26, 34, 43)]
    box = place(mark, size.width, size.height, gaps, taken)
    pixels_to_data = ax.transData.inverted()
    text.set_position(pixels_to_data.transform((box.left, box.bottom)))
    end = np.clip(mark, (box.left, box.bottom), (box.right, box.top))
    if np.hypot(*(end - mark)) > gaps[2]:
        line = pixels_to_data.transform([mark, end])
        ax.plot(*line.T, color=SOFT, lw=0.4, zorder=2)
    return box


def _outside(ax: Any) -> list[Box]:
    """Return what is beyond each side of the axes."""
    left, bottom, right, top = ax.bbox.extents
    far = 1e4
    return [
        Box(-far, -far, left, far),
        Box(right, -far, far, far),
        Box(-far, -far, far, bottom),
        Box(-far, top, far, far),
    ]


def _steps(corners: Array) -> list[Box]:
    """Return the place of the front."""
    found = []
    for (x, y), (next_x, next_y) in itertools.pairwise(corners.tolist()):
        found.append(Box(x, y - PT, next_x, y + PT))
        found.append(Box(next_x - PT, next_y, next_x + PT, y))
    return found


def _covered(ax: Any, point: Point, at: Array) -> list[Box]:
    """Return the place of a mark and its whiskers."""
    x, y = at
    half = PT * (point.look.size / 2 + 1)
    right, top = ax.transData.transform((point.slowest_ns, point.error_90))
    return [
        Box(x - half, y - half, x + half, y + half),
        Box(x - PT, y, x + PT, top),
        Box(x, y - PT, right, y + PT),
    ]
