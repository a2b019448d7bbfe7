"""HTML and SVG as text, with all content escaped: elements, and the parts of a chart.

The one writer of SVG: `path`, `dot` and `label` draw at points in pixels, `axis` converts values to
pixels, `ticks` and `decades` choose round numbers, and `drawing` is the whole. Nothing is fetched,
and no script runs.
"""

from collections.abc import Callable, Iterable
from html import escape
from math import ceil, floor, isfinite, isnan, log10, nan

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Axis = Callable[[Array], Array]
"""From values to pixels."""
ACCENT = "#2a84c4"
"""Colour that can be read on white and on black; other lines have the colour of the text."""
WARNING = "#c96a12"
"""Colour of a remark, on white and on black."""
MINUS = "\N{MINUS SIGN}"
NONE = "\N{EN DASH}"
"""In place of a number that is not known."""
LEFT_OUT = "\N{MULTIPLICATION SIGN}"
"""Beside a value that does not count."""
_FIRST = 20
"""Readings at the start, whose median is the level there."""


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
    opening = tag
    for name, value in attributes.items():
        opening += f' {name.replace("_", "-")}="{escape(str(value))}"'
    content = ""
    for child in children:
        content += child if isinstance(child, Markup) else escape(str(child))
    return Markup(f"<{opening}>{content}</{tag}>")


def span(values: Iterable[float]) -> tuple[float, float]:
    """Return the smallest and the largest of the known values; (0, 1) without any.

    Examples
    --------
    >>> span([4.0, 1.0, float("nan")]), span([])
    ((1.0, 4.0), (0.0, 1.0))
    """
    known = list(filter(isfinite, map(float, values)))
    if not known:
        return 0.0, 1.0
    return min(known), max(known)


def path(x: Iterable[float], y: Iterable[float], **attributes: object) -> Markup:
    """Return a line through points in pixels; with `fill` the area inside it.

    The line has a hole at each point that is not known.
    """
    points = ""
    command = "M"
    for across, down in zip(x, y, strict=True):
        if isnan(across) or isnan(down):
            command = "M"
        else:
            points += f"{command}{across:.1f} {down:.1f}"
            command = "L"
    style: dict[str, object] = {"fill": "none", "stroke_linejoin": "round"}
    return element("path", d=points, **style | attributes)


def axis(low: float, high: float, begin: float, end: float) -> Axis:
    """Return the function from values to pixels; a value outside is drawn at the edge.

    Examples
    --------
    >>> axis(0.0, 10.0, 100.0, 0.0)(np.array([1.0, 10.0, 11.0])).tolist()
    [90.0, 0.0, 0.0]
    """
    width = high - low or 1.0

    def pixels(values: Array) -> Array:
        inside = np.clip(values, low, high)
        return begin + (inside - low) / width * (end - begin)

    return pixels


def ticks(low: float, high: float, limit: int = 6) -> list[float]:
    """Return round numbers from `low` to `high`, in steps of 1, 2 or 5 with zeros.

    Examples
    --------
    >>> ticks(1.2, 10.4), ticks(-7.0, 7.0)
    ([2.0, 4.0, 6.0, 8.0, 10.0], [-5.0, 0.0, 5.0])
    """
    power = 10.0 ** floor(log10((high - low) / limit))
    step = power
    for factor in (2, 5, 10, 20):
        if (high - low) / step > limit - 1:
            step = factor * power
    first = ceil(low / step)
    last = floor(high / step)
    return [step * number for number in range(first, last + 1)]


def decades(low: float, high: float) -> list[float]:
    """Return 1 and 3 with zeros from `low` to `high`, for a logarithmic axis.

    Examples
    --------
    >>> decades(0.07, 35.0)
    [0.1, 0.3, 1.0, 3.0, 10.0, 30.0]
    """
    first = floor(log10(low))
    last = ceil(log10(high))
    values = []
    for power in range(first, last + 1):
        for value in (float(f"1e{power}"), float(f"3e{power}")):
            if low <= value <= high:
                values.append(value)
    return values


def dot(x: float, y: float, radius: float = 2.6, **attributes: object) -> Markup:
    """Return a circle."""
    return element(
        "circle",
        cx=f"{x:.1f}",
        cy=f"{y:.1f}",
        r=radius,
        **attributes,
    )


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


def drawing(width: float, height: float, name: str, *drawn: Markup) -> Markup:
    """Return an SVG element of this size, px, with a name for screen readers."""
    return element(
        "svg",
        *drawn,
        width=width,
        height=height,
        viewBox=f"0 0 {width} {height}",
        role="img",
        aria_label=name,
        style="display:block;max-width:100%;height:auto",
    )


def changes(readings: Array) -> tuple[Array, float]:
    """Return the change of a channel since the median of its first readings, and this level, pF.

    The level is nan without readings.

    Examples
    --------
    >>> changes(np.array([0.5, 0.5, 0.5, 0.75]))
    (array([0.  , 0.  , 0.  , 0.25]), 0.5)
    """
    known = readings[np.isfinite(readings)]
    level = nan
    if len(known):
        level = float(np.median(known[:_FIRST]))
    return readings - level, level
