"""Every touch as a small picture: the estimate in % from its result against time, with a band of one standard error."""

from collections.abc import Sequence

import numpy as np

from palpate.display import chart
from palpate.display.drawings import envelope
from palpate.display.markup import LEFT_OUT, MINUS, Markup, element
from palpate.report.results import Found
from palpate.report.runs import Trace

_WIDTH, _HEIGHT = 84, 34
_STEPS = (0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Heights of the scale, % from the result to each side."""
_SETTLED = 0.2  # share of a touch after which its estimate decides the scale
_POINTS = 60


def series(named: Sequence[tuple[str, float, Sequence[Found]]]) -> Markup:
    """Return the pictures of the touches of each specimen, in rows, and a line that says what the scales are.

    Parameters
    ----------
    named : sequence of (str, float, sequence of Found)
        Name of the specimen, the mean ratio of its touches (nan: there is none), and the touches.
    """
    touches = [one for _, _, group in named for one in group]
    height = scale([one for one in touches if one.kept] or touches)
    length = max((float(one.trace.t_s[-1]) for one in touches if len(one.trace.t_s)), default=1.0) or 1.0
    rows = [
        element("div", element("b", name), *(_cell(one, mean, height, length) for one in group), class_="series")
        for name, mean, group in named
    ]
    told = (
        f"The estimate against time, in % from the result of the touch: each picture is ±{height:g} % high and "
        f"{length:.1f} s long. Band: one standard error. Below it: the number of the touch, its "
        f"distance from the mean of the specimen, and flags; {LEFT_OUT}: left out."
    )
    return Markup("\n".join([*rows, element("p", told, class_="quiet")]))


def scale(touches: Sequence[Found]) -> float:
    """Return the height of the scale, %: the settled part of 9 samples of 10 of each touch fits in."""
    reached = [_reach(one) for one in touches if len(one.trace.t_s)]
    return next((step for step in _STEPS if all(reach <= step for reach in reached)), _STEPS[-1])


def _reach(one: Found) -> float:
    settled = _deviation(one)[int(_SETTLED * len(one.trace.t_s)) :]
    known = np.abs(settled[np.isfinite(settled)])
    return float(np.quantile(known, 0.9)) if len(known) else 0.0


def _deviation(one: Found) -> chart.Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(100 * (one.trace.ratio / one.touch.ratio - 1))


def _cell(one: Found, mean: float, height: float, length: float) -> Markup:
    mark = "" if one.kept else f" {LEFT_OUT}"
    told = [distance(one, mean), *one.touch.flags]
    name = element("div", element("b", one.number), " ", ", ".join(filter(None, told)), mark)
    return element("div", _drawn(one, height, length), name, class_=None if one.kept else "bad")


def distance(one: Found, mean: float) -> str:
    """Return how far a touch is from the mean of its specimen, %; "": unknown."""
    share = 100 * (one.touch.ratio / mean - 1)
    return f"{share:+.1f}".replace("-", MINUS) if np.isfinite(share) else ""


def _drawn(one: Found, height: float, length: float) -> Markup:
    x = chart.axis(0.0, length, 1.0, _WIDTH - 1.0)
    y = chart.axis(-height, height, _HEIGHT - 1.0, 1.0)
    middle = _HEIGHT / 2
    parts = [chart.ruler((0, _WIDTH), (middle, middle), "zero")]
    if len(one.trace.t_s):
        parts += [*_band(one, x, y), chart.line(*_line(one, x, y), "curve" if one.kept else "curve left")]
    return chart.picture(_WIDTH, _HEIGHT, f"touch {one.number}", *parts)


def _line(one: Found, x: chart.Axis, y: chart.Axis) -> tuple[chart.Array, chart.Array]:
    t_s, deviation = envelope(one.trace.t_s, _deviation(one), _POINTS)
    return x(t_s), y(deviation)


def _band(one: Found, x: chart.Axis, y: chart.Axis) -> list[Markup]:
    """Return the band; none in a scene without a standard error."""
    trace = _thinned(one.trace)
    with np.errstate(divide="ignore", invalid="ignore"):
        middle, reach = 100 * (trace.ratio / one.touch.ratio - 1), 100 * trace.error / abs(one.touch.ratio)
    if not np.isfinite(reach).any():
        return []
    return [chart.area(x(trace.t_s), y(middle - reach), y(middle + reach), "band")]


def _thinned(trace: Trace) -> Trace:
    rows = np.unique(np.linspace(0, len(trace.t_s) - 1, _POINTS).astype(int))
    return Trace(trace.t_s[rows], trace.ratio[rows], trace.error[rows])
