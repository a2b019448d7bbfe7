"""HTML and SVG, with all text escaped: elements, small drawings, and the parts of a chart; nothing is fetched, no script runs."""

from collections.abc import Callable, Iterable
from html import escape
from math import ceil, floor, isnan, log10, nan

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Axis = Callable[[Array], Array]
"""From values to pixels."""
ACCENT, WARNING = "#2a84c4", "#c96a12"
"""Colours that can be read on white and on black; other lines have the colour of the text."""
MINUS, NONE, LEFT_OUT = "\N{MINUS SIGN}", "\N{EN DASH}", "\N{MULTIPLICATION SIGN}"
"""Before a number; in the place of one that is not known; beside what does not count."""
_COLUMNS = 240
"""Points of a line: more rows are drawn as the smallest and the largest of each group."""


class Markup(str):
    """Text that is HTML already; templates do not escape it."""

    __slots__ = ()

    def __html__(self) -> str:
        """Return itself, for a template."""
        return self


def element(tag: str, *children: object, **attributes: object) -> Markup:
    """Return an element; children and attributes are escaped, but for children that are elements.

    An underscore in the name of an attribute is a hyphen.

    Examples
    --------
    >>> element("p", "a < b ", element("b", "&"), aria_label='"')
    '<p aria-label="&quot;">a &lt; b <b>&amp;</b></p>'
    """
    given = "".join(
        f' {name.replace("_", "-")}="{escape(str(value))}"' for name, value in attributes.items()
    )
    inner = "".join(
        child if isinstance(child, Markup) else escape(str(child)) for child in children
    )
    return Markup(f"<{tag}{given}>{inner}</{tag}>")


def channels(time: Array, hard: Array, soft: Array) -> Markup:
    """Return both channels as lines over times or rows, on one scale, the soft one thinner; a missing reading is a hole."""
    lines = [envelope(time, values) for values in (hard, soft)]
    times, changes_pF = (span(np.concatenate(part)) for part in zip(*lines, strict=True))
    x, y = axis(*times, _EDGE, 480 - _EDGE), axis(*changes_pF, 90 - _EDGE, _EDGE)
    drawn = [
        path(x(t), y(values), stroke="currentColor", stroke_width=wide, stroke_opacity=opaque)
        for (t, values), wide, opaque in zip(lines, (1.6, 1.1), (1.0, 0.55), strict=True)
    ]
    return picture(480, 90, "both channels over time", *drawn)


def envelope(x: Array, y: Array) -> tuple[Array, Array]:
    """Return a line of few points with the same extremes, in any group of neighbours: two for each column.

    Examples
    --------
    >>> x, y = envelope(np.arange(10_000.0), np.arange(10_000.0) % 7)
    >>> len(x), float(y.min()), float(y.max())
    (480, 0.0, 6.0)
    """
    begins = np.unique(np.linspace(0, len(y), _COLUMNS, endpoint=False).astype(int))
    if len(begins) == len(y):
        return x, y
    ends = np.stack([np.fmin.reduceat(y, begins), np.fmax.reduceat(y, begins)])
    falls = y[begins] > y[np.append(begins[1:], len(y)) - 1]
    ends[:, falls] = ends[
        ::-1, falls
    ]  # the larger one first, or a falling line would go up and down
    return np.repeat(x[begins], 2), ends.T.ravel()


def interval(ends: tuple[float, float], scale: tuple[float, float]) -> Markup:
    """Return an interval and its middle, on a scale that other pictures share; nothing if an end is not known."""
    low, high = axis(*scale, _EDGE, 140 - _EDGE)(np.array(ends))
    line = path((low, high), (7.0, 7.0), stroke=ACCENT, stroke_width=2)
    drawn = (
        [line, dot((low + high) / 2, 7.0, radius=3, fill=ACCENT)] if np.isfinite(low + high) else []
    )
    return picture(140, 14, "ratio and two standard errors", *drawn)


def span(values: Iterable[float]) -> tuple[float, float]:
    """Return the smallest and the largest of the known values; (0, 1) without any.

    Examples
    --------
    >>> span([4.0, 1.0, float("nan")]), span([])
    ((1.0, 4.0), (0.0, 1.0))
    """
    known = [float(value) for value in values if np.isfinite(value)]
    return (min(known), max(known)) if known else (0.0, 1.0)


_EDGE = 4.0


def path(x: Iterable[float], y: Iterable[float], **attributes: object) -> Markup:
    """Return a line through points in pixels, with a hole where one is not known; with `fill` the area inside it."""
    points: list[str] = []
    pen = "M"
    for across, down in zip(x, y, strict=True):
        whole = not (isnan(across) or isnan(down))
        points += [f"{pen}{across:.1f} {down:.1f}"] if whole else []
        pen = "L" if whole else "M"
    return element(
        "path", d="".join(points), **{"fill": "none", "stroke_linejoin": "round", **attributes}
    )


def axis(low: float, high: float, begin: float, end: float) -> Axis:
    """Return the function from values to pixels; a value outside is drawn at the edge.

    Examples
    --------
    >>> axis(0.0, 10.0, 100.0, 0.0)(np.array([1.0, 10.0, 11.0])).tolist()
    [90.0, 0.0, 0.0]
    """
    return lambda values: (
        begin + (np.clip(values, low, high) - low) / (high - low or 1.0) * (end - begin)
    )


def ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Return round numbers from `low` to `high`: at most so many, in steps of 1, 2 or 5 with zeros.

    Examples
    --------
    >>> ticks(1.2, 10.4), ticks(-7.0, 7.0)
    ([2.0, 4.0, 6.0, 8.0, 10.0], [-5.0, 0.0, 5.0])
    """
    power = 10.0 ** floor(log10((high - low) / most))
    step = next(
        factor * power
        for factor in (1, 2, 5, 10, 20)
        if (high - low) / (factor * power) <= most - 1
    )
    return [step * number for number in range(ceil(low / step), floor(high / step) + 1)]


def decades(low: float, high: float) -> list[float]:
    """Return 1 and 3 with zeros from `low` to `high`, for a logarithmic axis.

    Examples
    --------
    >>> decades(0.07, 35.0)
    [0.1, 0.3, 1.0, 3.0, 10.0, 30.0]
    """
    powers = range(floor(log10(low)), ceil(log10(high)) + 1)
    found = [float(f"{first}e{power}") for power in powers for first in (1, 3)]
    return [tick for tick in found if low <= tick <= high]


def dot(x: float, y: float, radius: float = 2.6, **attributes: object) -> Markup:
    """Return a circle."""
    return element("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=radius, **attributes)


def label(x: float, y: float, text: str, anchor: str = "start") -> Markup:
    """Return a text at a point: anchor "start", "middle" or "end"."""
    return element(
        "text",
        text,
        x=f"{x:.1f}",
        y=f"{y:.1f}",
        text_anchor=anchor,
        font_size=12,
        fill="currentColor",
    )


def picture(width: float, height: float, name: str, *drawn: Markup) -> Markup:
    """Return the picture, with a name for those who hear the page."""
    box, style = f"0 0 {width} {height}", "display:block;max-width:100%;height:auto"
    return element(
        "svg",
        *drawn,
        width=width,
        height=height,
        viewBox=box,
        role="img",
        aria_label=name,
        style=style,
    )


_FIRST = 20
"""Readings at the begin, whose median is the level there."""


def changes(readings: Array) -> tuple[Array, float]:
    """Return the change of a channel since the median of its first readings, and this level, pF; nan without readings.

    Examples
    --------
    >>> changes(np.array([0.5, 0.5, 0.5, 0.75]))
    (array([0.  , 0.  , 0.  , 0.25]), 0.5)
    """
    known = readings[np.isfinite(readings)]
    level = float(np.median(known[:_FIRST])) if len(known) else nan
    return readings - level, level
