"""The clocks of samples: a fine one for their times, and the time t = 0 of a source."""

import sys
import time
from collections.abc import Callable
from typing import NamedTuple

fine_ns: Callable[[], int] = time.monotonic_ns
"""The clock for times of samples, ns. `time.monotonic_ns` steps by 15.6 ms in Windows before Python
3.13; there it is `time.perf_counter_ns`."""
if sys.platform == "win32" and sys.version_info < (3, 13):
    fine_ns = time.perf_counter_ns


def on_monotonic(ns: int) -> int:
    """Convert a time of `fine_ns` to the clock of `time.monotonic_ns`; the same on most systems."""
    if fine_ns is time.monotonic_ns:
        return ns
    return ns + time.monotonic_ns() - fine_ns()


class Epoch(NamedTuple):
    """The time t = 0 of a source, on two clocks of the computer.

    Attributes
    ----------
    utc_ns : int
        Nanoseconds since 1970 by the wall clock: as good as this clock, for example 1 ms with NTP.
    monotonic_ns : int
        `time.monotonic_ns()`: the same for all measurements of this computer until it starts again.

    Examples
    --------
    >>> import palpate
    >>> with palpate.Stream("sim:tremor?speed=1") as stream:
    ...     first = next(iter(stream)).sample
    ...     age_ns = time.monotonic_ns() - (stream.epoch.monotonic_ns + first.t_hard_ns)
    >>> 0 < age_ns < 60e9
    True
    """

    utc_ns: int
    monotonic_ns: int


def epoch_at(monotonic_ns: int) -> Epoch:
    """Convert a time of the monotonic clock to both clocks, by the wall clock as it is set now.

    Examples
    --------
    >>> epoch_at(10**9).utc_ns - epoch_at(0).utc_ns < 2 * 10**9
    True
    """
    readings = [(time.monotonic_ns(), time.time_ns(), time.monotonic_ns()) for _ in range(3)]
    before, utc_ns, after = min(readings, key=lambda times: times[2] - times[0])
    middle = (before + after) // 2
    return Epoch(utc_ns - middle + monotonic_ns, monotonic_ns)
