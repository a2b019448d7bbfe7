"""Times of a counter that began again at its end, as micros() after 71.6 minutes."""

from typing import NamedTuple

import numpy as np

from palpate.importers.table import Array
from palpate.importers.table_checks import typical_step

# Lengths of counters, s, and their names.
_COUNTERS = (
    (2**32 / 1e6, "a counter of 32 bits in us"),
    (2**32 / 1e3, "a counter of 32 bits in ms"),
    (2**16 / 1e3, "a counter of 16 bits in ms"),
)
_CLOCKS = ((86400.0, "the time of day"),)
_NEAR = 8.0  # steps to the end of the counter, and after its zero


class ContinuedTimes(NamedTuple):
    """Times that go on where a counter began again, and a note; "" if none did."""

    seconds: Array
    note: str = ""


def continued(seconds: Array, *, of_day: bool = False) -> ContinuedTimes:
    """Return times that go on where their counter, or the time of day, began again.

    Parameters
    ----------
    seconds : numpy.ndarray, shape (n,)
    of_day : bool
        Whether they are times of day.

    Returns
    -------
    ContinuedTimes
        The same times if they go back anywhere else than at the end of a known counter.

    Examples
    --------
    >>> found = continued(np.arange(0, 60e6, 25e3)[::1] / 1e6 % (2**16 / 1e3))
    >>> found.note
    ''
    >>> continued((np.arange(4000) * 25 % 2**16) / 1e3).note
    'a counter of 16 bits in ms began again 1 time: the times go on'
    """
    steps = np.diff(seconds)
    usual = typical_step(seconds)
    backward = np.flatnonzero(steps < -_NEAR * usual)
    if not len(backward) or not usual > 0:
        return ContinuedTimes(seconds)
    counters = _CLOCKS if of_day else _COUNTERS
    for length, name in counters:
        near = _NEAR * usual
        at_end = (length - near <= seconds[backward]) & (seconds[backward] < length)
        at_zero = (seconds[backward + 1] >= 0) & (seconds[backward + 1] <= near)
        if not (at_end & at_zero).all():
            continue
        turns = np.zeros(len(seconds))
        turns[backward + 1] = length
        count = "1 time" if len(backward) == 1 else f"{len(backward)} times"
        note = f"{name} began again {count}: the times go on"
        return ContinuedTimes(seconds + np.cumsum(turns), note)
    return ContinuedTimes(seconds)
