"""The clocks of the computer: the times of samples, and what happened between two samples.

One clock stands still while the computer sleeps, one counts on, and one can be set. Their
differences show what happened: the computer slept, the program stood still, the wall clock was set.
"""

import math
import sys
import time
from collections.abc import Callable
from threading import Event, Lock, Thread
from typing import NamedTuple, Protocol

# `fine_ns` is for times of samples, ns: it counts on while the computer sleeps. `awake_ns` does
# not. `time.monotonic_ns` counts on in Windows only, and steps by 15.6 ms there before Python 3.13.
if sys.platform == "win32":
    import ctypes

    if sys.version_info < (3, 13):
        fine_ns = time.perf_counter_ns
    else:
        fine_ns = time.monotonic_ns

    def awake_ns() -> int:
        """Return the time that the computer was awake, ns."""
        ticks = ctypes.c_ulonglong()
        ctypes.windll.kernel32.QueryUnbiasedInterruptTime(ctypes.byref(ticks))
        return 100 * ticks.value

else:
    if sys.platform == "darwin":
        _CONTINUOUS = time.CLOCK_MONOTONIC_RAW
    else:
        _CONTINUOUS: int = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)

    def fine_ns() -> int:
        """Return the time, ns, for times of samples."""
        return time.clock_gettime_ns(_CONTINUOUS)

    awake_ns = time.monotonic_ns


def on_monotonic(ns: int) -> int:
    """Convert a time of `fine_ns` to the clock of `time.monotonic_ns` as it is now."""
    return ns - ahead_of_monotonic_ns()


def ahead_of_monotonic_ns() -> int:
    """Return `fine_ns` minus `time.monotonic_ns`: constant, but while the computer sleeps."""
    readings = [(time.monotonic_ns(), fine_ns(), time.monotonic_ns()) for _ in range(3)]
    before, fine, after = min(readings, key=lambda times: times[2] - times[0])
    return fine - (before + after) // 2


LOOK_S = 0.25
"""The clocks are compared so often."""
STOOD_S = 1.0  # a program that does not run for longer stood still; a busy computer takes less
SLEPT_S = 0.1  # a clock of Windows steps by 15.6 ms
# NTP sets a clock that is wrong by 0.128 s, and changes the rate of one that is less wrong by up to
# 0.5 ms a second.
SET_S = 0.1
_SLEW = 0.0005
_AT_ONCE_NS = 1_000_000
_TRIES = 3


class ClockReading(NamedTuple):
    """The three clocks of the computer at one moment, ns.

    Attributes
    ----------
    awake_ns : int
        Stands still while the computer sleeps.
    fine_ns : int
        Counts on while the computer sleeps.
    utc_ns : int
        The wall clock, since 1970; it can be set.
    """

    awake_ns: int
    fine_ns: int
    utc_ns: int


def read_clocks() -> ClockReading:
    """Read the three clocks at one moment: again if the program stood still meanwhile."""
    for _ in range(_TRIES):
        reading = ClockReading(awake_ns(), fine_ns(), time.time_ns())
        if fine_ns() - reading.fine_ns < _AT_ONCE_NS:
            break
    return reading


class Pause(NamedTuple):
    """What happened to the computer between two samples, s; 0: nothing.

    Attributes
    ----------
    slept_s : float
        How long it slept.
    stood_s : float
        How long the program did not run while the computer was awake: it was stopped, a debugger
        held it, or the computer had no time for it.
    set_s : float
        By how much the wall clock was set.
    since_s : float
        Time from the arrival of the sample before to this one, s; inf: unknown.
    """

    slept_s: float = 0.0
    stood_s: float = 0.0
    set_s: float = 0.0
    since_s: float = math.inf


class Clocks(Protocol):
    """Says what happened to the computer of a source between two samples."""

    def passed(self) -> Pause:
        """Return what happened since the last call."""


class ClockWatch:
    """Compares the clocks of the computer, and says what happened between two samples.

    A source may be silent for long, so only a thread that never waits sees that the program stood
    still: `start` begins one.

    Parameters
    ----------
    read : callable
        Returns a `ClockReading`.

    Examples
    --------
    >>> hour_ns = 3600 * 10**9
    >>> readings = [ClockReading(0, 0, 0), ClockReading(10**7, hour_ns, hour_ns)]
    >>> ClockWatch(lambda: readings.pop(0)).passed()
    Pause(slept_s=3599.99, stood_s=0.0, set_s=0.0, since_s=3600.0)
    """

    def __init__(self, read: Callable[[], ClockReading] = read_clocks) -> None:
        self._read = read
        self._before = read()
        self._passed_ns = self._before.fine_ns  # of the last call of `passed`
        self._pause = Pause()
        self._lock = Lock()
        self._stopped = Event()
        self._thread = Thread(target=self._run, name="palpate-clocks", daemon=True)

    def start(self) -> None:
        """Compare the clocks in a thread of its own from now on; forget what was before."""
        self.passed()
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._stopped.set()
        self._thread.join()

    def passed(self) -> Pause:
        """Return what happened since the last call, ended by this call."""
        self.look()
        with self._lock:
            pause = self._pause
            self._pause = Pause()
            now_ns = self._before.fine_ns
            since_s = (now_ns - self._passed_ns) / 1e9
            self._passed_ns = now_ns
            return pause._replace(since_s=since_s)

    def _run(self) -> None:
        while not self._stopped.wait(LOOK_S):
            self.look()

    def look(self) -> None:
        """Compare the clocks; if that is not done for long, the program stood still."""
        with self._lock:
            before = self._before
            now = self._read()
            self._before = now
            self._compare(before, now)

    def _compare(self, before: ClockReading, now: ClockReading) -> None:
        awake_s = (now.awake_ns - before.awake_ns) / 1e9
        passed_s = (now.fine_ns - before.fine_ns) / 1e9
        slept_s = passed_s - awake_s
        set_s = (now.utc_ns - before.utc_ns) / 1e9 - passed_s
        slept, stood, was_set, _ = self._pause
        if slept_s > SLEPT_S:
            slept += slept_s
        if awake_s > STOOD_S:
            stood += awake_s
        if abs(set_s) > SET_S + _SLEW * passed_s:
            was_set += set_s
        self._pause = Pause(slept, stood, was_set)


class Epoch(NamedTuple):
    """The time t = 0 of a source, on two clocks of the computer.

    Attributes
    ----------
    utc_ns : int
        Nanoseconds since 1970 by the wall clock: as good as this clock, for example 1 ms with NTP.
    monotonic_ns : int
        `time.monotonic_ns()`: the same for all measurements of this computer until it starts again;
        in Linux and macOS until it sleeps, after which t = 0 is earlier on this clock.

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
