"""Times printed with few decimals: their step, and the even grid that they came from."""

from typing import NamedTuple

import numpy as np

from palpate.importers.table import Array
from palpate.importers.table_checks import typical_step

COARSE = 1 / 8  # of a period: half of such a step is a quarter of what the alignment allows
_COARSEST = 4.0  # periods: with longer steps, nothing shows that the pairs were evenly spaced
# A line through rounded times passes within half a step; a quarter more if each was also late.
_SPREAD = 1.5  # steps
_ON_GRID = 2 / 3  # of the differences: they are the period itself
_FEWEST = 16  # rows
_PAUSE = 16.0  # periods
_CHUNK = 1024  # rows: two clocks do not drift apart by a step
_SEARCHES = 40
_EXACT = 1e-6  # of a step
_RESOLUTION = 8 * np.finfo(float).eps


class EvenTimes(NamedTuple):
    """Times, and a note on them; "" if the note is not needed."""

    seconds: Array
    note: str = ""


def even_times(seconds: Array) -> EvenTimes:
    """Return times on the even grid from which a coarse print has rounded them.

    Parameters
    ----------
    seconds : numpy.ndarray, shape (n,)
        They do not decrease; several may be equal.

    Returns
    -------
    EvenTimes
        The same times if their step is not coarse, or if no even grid explains all of them.

    Examples
    --------
    >>> even = even_times(np.round(np.arange(400) / 38, 2))
    >>> float(np.ptp(even.seconds - np.arange(400) / 38)) < 0.005, even.note
    (True, 'times have steps of 10 ms: smoothed')
    """
    period = typical_step(seconds)
    step = _step_of(seconds, period)
    if not COARSE * period < step <= _COARSEST * period:
        return EvenTimes(seconds)
    note = f"times have steps of {1000 * step:.3g} ms"
    smoothed = np.empty_like(seconds)
    places = _places(seconds, period, step)
    for rows in _runs(seconds, places, period, step):
        smoothed[rows] = _line(seconds[rows], places[rows], period, step)
    if not (np.diff(smoothed) > 0).all():  # nor nan
        advice = f"too coarse for pairs {1000 * period:.3g} ms apart: print more decimals"
        return EvenTimes(seconds, f"{note}, {advice}")
    if np.abs(smoothed - seconds).max() < _EXACT * step:
        return EvenTimes(seconds)
    return EvenTimes(smoothed, f"{note}: smoothed")


def _step_of(seconds: Array, period: float) -> float:
    """Return the step of which all differences are multiples; 0: there is none, or few times."""
    if len(seconds) < _FEWEST or not np.isfinite(seconds).all():
        return 0.0
    differences = np.diff(seconds)
    if not period > 0 or differences.min() < 0:
        return 0.0
    resolution = max(_EXACT * period, _RESOLUTION * float(np.abs(seconds).max()))
    usual = differences[differences <= _PAUSE * period]
    sizes = np.unique(np.rint(usual / resolution)) * resolution
    steps = np.append(sizes, np.diff(sizes))
    steps = steps[steps > 2 * resolution]
    if not len(steps) or steps.min() < 100 * resolution:
        return 0.0
    counts = np.rint(sizes / steps.min())
    step = float(sizes.sum() / counts.sum())
    in_steps = np.rint(usual / step)
    if np.mean(in_steps == 1) > _ON_GRID and in_steps.max() > 1:
        return 0.0  # the period is the step, and rows are missing
    is_multiple = np.abs(sizes - step * counts) < 4 * resolution
    return step if is_multiple.all() else 0.0


def _places(seconds: Array, period: float, step: float) -> Array:
    """Return the place of each row on the grid; missing rows count, pauses do not."""
    periods = np.diff(seconds) / period
    late = np.diff(seconds) > period + 1.5 * step
    on_grid = np.abs(periods - np.rint(periods)) * period <= step
    missing = late & on_grid & (periods <= _PAUSE)
    return np.append(0.0, np.cumsum(np.where(missing, np.rint(periods), 1.0)))


def _runs(seconds: Array, places: Array, period: float, step: float) -> list[slice]:
    """Return the rows between pauses, at most `_CHUNK` in each."""
    beyond = np.diff(seconds) - period * np.diff(places)
    breaks = np.flatnonzero(beyond > 1.5 * step) + 1
    runs = []
    for rows in np.split(np.arange(len(seconds)), breaks):
        parts = -(-len(rows) // _CHUNK)
        for part in np.array_split(rows, parts):
            runs.append(slice(int(part[0]), int(part[-1]) + 1))
    return runs


def _line(times: Array, places: Array, period: float, step: float) -> Array:
    """Return the even times nearest to some times; nan if they are too far away."""
    place = places - places[0]
    last = float(place[-1])

    def spread(slope: float) -> float:
        return float(np.ptp(times - slope * place))

    slope = period
    if last and spread(slope) > step:
        mean = float(times[-1] - times[0]) / last
        low = mean - step / last
        high = mean + step / last
        for _ in range(_SEARCHES):  # the spread is convex: the least is on the lower third's side
            third = (high - low) / 3
            if spread(low + third) < spread(high - third):
                high -= third
            else:
                low += third
        slope = (low + high) / 2
    if spread(slope) > _SPREAD * step:
        return np.full(len(times), np.nan)
    rest = times - slope * place
    middle = (float(rest.min()) + float(rest.max())) / 2
    even: Array = middle + slope * place
    return even
