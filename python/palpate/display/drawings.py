"""Small drawings as SVG: both channels of a recording, a ratio with its uncertainty, a calibration curve."""

from collections.abc import Callable, Iterable, Sequence
from math import isnan

import numpy as np
from numpy.typing import NDArray

from palpate.display.markup import ACCENT, Markup, element

Array = NDArray[np.float64]
_COLUMNS = 240
"""Points of a line: more rows are drawn as the smallest and the largest of each group."""
_REACH = 2.0  # standard errors to each side


def channels(time: Array, hard: Array, soft: Array) -> Markup:
    """Return both channels as lines on one scale, the soft one thinner; a missing reading is a hole.

    Parameters
    ----------
    time : numpy.ndarray, shape (n,)
        Times, or row numbers.
    hard, soft : numpy.ndarray, shape (n,), pF
        Changes of the capacitance.
    """
    width, height = 480, 90
    lines = [envelope(time, values) for values in (hard, soft)]
    x = _scale(np.concatenate([line[0] for line in lines]), width, False)
    y = _scale(np.concatenate([line[1] for line in lines]), height, True)
    drawn = [
        path(x(line[0]), y(line[1]), stroke="currentColor", stroke_width=wide, stroke_opacity=opaque)
        for line, wide, opaque in zip(lines, (1.6, 1.1), (1.0, 0.55), strict=True)
    ]
    return _svg(width, height, drawn, "both channels over time")


def envelope(x: Array, y: Array, columns: int = _COLUMNS) -> tuple[Array, Array]:
    """Return a line of few points with the same extremes, in any group of neighbours: two for each column.

    Examples
    --------
    >>> x, y = envelope(np.arange(10_000.0), np.arange(10_000.0) % 7)
    >>> len(x), float(y.min()), float(y.max())
    (480, 0.0, 6.0)
    """
    begins = np.unique(np.linspace(0, len(y), columns, endpoint=False).astype(int))
    if len(begins) == len(y):
        return x, y
    ends = np.stack([np.fmin.reduceat(y, begins), np.fmax.reduceat(y, begins)])
    falls = y[begins] > y[np.append(begins[1:], len(y)) - 1]
    ends[:, falls] = ends[::-1, falls]  # the larger one first, or a falling line would go up and down
    return np.repeat(x[begins], 2), ends.T.ravel()


def interval(value: float, error: float, span: tuple[float, float]) -> Markup:
    """Return a value with two standard errors to each side, on a scale that others share."""
    width, height = 140, 14
    x = _scale(np.array(span), width, False)
    ends = x(np.array([value - _REACH * error, value, value + _REACH * error]))
    middle = height / 2
    bar = path(ends[[0, 2]], np.full(2, middle), stroke=ACCENT, stroke_width=2)
    dot = element("circle", cx=f"{ends[1]:.1f}", cy=middle, r=3, fill=ACCENT)
    return _svg(width, height, [bar, dot] if np.isfinite(ends).all() else [], "ratio and two standard errors")


def span(values: Iterable[tuple[float, float]]) -> tuple[float, float]:
    """Return the scale for values with standard errors; (0, 1) without any.

    Examples
    --------
    >>> span([(2.0, 0.5), (4.0, 0.0), (3.0, float("nan"))])
    (1.0, 4.0)
    """
    ends = [value + side * _REACH * error for value, error in values for side in (-1, 1)]
    known = [end for end in ends if np.isfinite(end)]
    return (min(known), max(known)) if known else (0.0, 1.0)


def curve(moduli: Array, ratios: Array, line: tuple[Array, Array]) -> Markup:
    """Return a curve over a logarithmic axis of moduli, with the measured values as dots."""
    width, height = 320, 120
    x = _scale(np.log(np.concatenate([moduli, line[0]])), width, False)
    y = _scale(np.concatenate([ratios, line[1]]), height, True)
    dots = [
        element("circle", cx=f"{across:.1f}", cy=f"{down:.1f}", r=2, fill="currentColor", fill_opacity=0.7)
        for across, down in zip(x(np.log(moduli)), y(ratios), strict=True)
    ]
    fitted = path(x(np.log(line[0])), y(line[1]), stroke=ACCENT, stroke_width=2)
    return _svg(width, height, [fitted, *dots], "ratio over modulus")


def _scale(values: Array, size: float, up: bool) -> Callable[[Array], Array]:
    """Return the function from values to pixels, with an edge; upwards where the value is larger."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)

    def pixels(given: Array) -> Array:
        share = (given - low) / (high - low or 1.0)
        return _EDGE + (1 - share if up else share) * (size - 2 * _EDGE)

    return pixels


_EDGE = 4.0


def path(x: Array, y: Array, **attributes: object) -> Markup:
    """Return a line through points in pixels, with a hole where one is not known."""
    points: list[str] = []
    pen = "M"
    for across, down in zip(x.tolist(), y.tolist(), strict=True):
        whole = not (isnan(across) or isnan(down))
        points += [f"{pen}{across:.1f} {down:.1f}"] if whole else []
        pen = "L" if whole else "M"
    return element("path", d="".join(points), fill="none", stroke_linejoin="round", **attributes)


def _svg(width: int, height: int, drawn: Sequence[Markup], label: str) -> Markup:
    style = f"display:block;width:{width}px;max-width:100%;height:auto"
    return element("svg", *drawn, xmlns="http://www.w3.org/2000/svg", viewBox=f"0 0 {width} {height}", role="img",
                   aria_label=label, style=style)  # fmt: skip
