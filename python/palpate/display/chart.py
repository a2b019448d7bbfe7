"""Parts of a chart on a page of `display.page`: its style gives a class its colour, in light, in the dark and on paper."""

from collections.abc import Callable
from math import ceil, floor, log10

import numpy as np
from numpy.typing import NDArray

from palpate.display.drawings import path
from palpate.display.markup import Markup, element

Array = NDArray[np.float64]
Axis = Callable[[Array], Array]
"""From values to pixels."""


def axis(low: float, high: float, begin: float, end: float) -> Axis:
    """Return the function from values to pixels; a value outside is drawn at the edge.

    Examples
    --------
    >>> axis(0.0, 10.0, 100.0, 0.0)(np.array([1.0, 10.0, 11.0])).tolist()
    [90.0, 0.0, 0.0]
    """
    return lambda values: begin + (np.clip(values, low, high) - low) / (high - low) * (end - begin)


def ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Return round numbers from `low` to `high`: at most so many, in steps of 1, 2 or 5 with zeros.

    Examples
    --------
    >>> ticks(1.2, 10.4), ticks(-7.0, 7.0)
    ([2.0, 4.0, 6.0, 8.0, 10.0], [-5.0, 0.0, 5.0])
    """
    power = 10.0 ** floor(log10((high - low) / most))
    step = next(factor * power for factor in (1, 2, 5, 10, 20) if (high - low) / (factor * power) <= most - 1)
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


def line(x: Array, y: Array, style: str) -> Markup:
    """Return a line through points, in pixels."""
    return path(x, y, class_=style)


def area(x: Array, low: Array, high: Array, style: str) -> Markup:
    """Return the area between two lines, in pixels; without the points where one is not known."""
    known = np.isfinite(low) & np.isfinite(high)
    edge = np.concatenate([x[known], x[known][::-1]]), np.concatenate([high[known], low[known][::-1]])
    points = " ".join(f"{across:.1f},{down:.1f}" for across, down in zip(*edge, strict=True))
    return element("polygon", points=points, class_=style)


def ruler(x: tuple[float, float], y: tuple[float, float], style: str) -> Markup:
    """Return a straight line between two points, in pixels."""
    return element("line", x1=f"{x[0]:.1f}", x2=f"{x[1]:.1f}", y1=f"{y[0]:.1f}", y2=f"{y[1]:.1f}", class_=style)


def dot(x: float, y: float, style: str, radius: float = 2.6) -> Markup:
    """Return a circle."""
    return element("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=radius, class_=style)


def label(x: float, y: float, text: str, anchor: str = "start", style: str | None = None) -> Markup:
    """Return a text at a point: anchor "start", "middle" or "end"."""
    return element("text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor, class_=style)


def picture(width: float, height: float, name: str, *drawn: Markup) -> Markup:
    """Return the picture, with a name for those who hear the page."""
    return element(
        "svg", *drawn, width=width, height=height, viewBox=f"0 0 {width} {height}", role="img", aria_label=name
    )
