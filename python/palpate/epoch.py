"""Where t = 0 of a measurement lies on the clocks of the computer, so that measurements can be put on one time axis."""

import time
from typing import NamedTuple


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


def at(monotonic_ns: int) -> Epoch:
    """Return both times of a moment of the monotonic clock, by the wall clock as it is set now.

    Examples
    --------
    >>> at(10**9).utc_ns - at(0).utc_ns < 2 * 10**9
    True
    """
    read = [(time.monotonic_ns(), time.time_ns(), time.monotonic_ns()) for _ in range(3)]
    before, utc_ns, after = min(read, key=lambda times: times[2] - times[0])
    return Epoch(utc_ns - (before + after) // 2 + monotonic_ns, monotonic_ns)
