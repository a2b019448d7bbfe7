"""A recording of two arrays: the readings of both channels, with their times or their rate."""

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.importers.channel_units import require_probable_pF
from palpate.importers.rounded_times import EvenTimes, even_times
from palpate.importers.units import PICOFARADS, checked_unit, unit_read
from palpate.labels import require_same_index
from palpate.messages import quoted
from palpate.recording.recording import Recording, real_array
from palpate.recording_protocol import is_like_recording

_Array = NDArray[np.float64]
_CALL = "palpate.touches(hard, soft, rate_hz=40), or with times_s"


@dataclass(frozen=True)
class PairTimes:
    """When the pairs of two arrays were read.

    Attributes
    ----------
    times_s : array_like, shape (n,), optional
        Times of the hard readings, s.
    rate_hz : float, optional
        Pairs a second.
    soft_later_s : float
        Time from the hard reading of a pair to its soft reading, s.
    """

    times_s: ArrayLike | None = None
    rate_hz: float | None = None
    soft_later_s: float = 0.0

    def require_none(self) -> None:
        """Check that nothing is given, as for a recording, which has its own times.

        Raises
        ------
        TypeError
            Something is given.

        Examples
        --------
        >>> PairTimes(rate_hz=40).require_none()
        Traceback (most recent call last):
        TypeError: rate_hz: got it without two arrays, allowed: palpate.touches(hard, soft, \
rate_hz=40), or with times_s; for a table without times, reading={"rate": 40}
        """
        given = ""
        if self.times_s is not None:
            given = "times_s"
        elif self.rate_hz is not None:
            given = "rate_hz"
        elif self.soft_later_s != 0:
            given = "soft_later_s"
        if given:
            table = 'for a table without times, reading={"rate": 40}'
            if given == "soft_later_s":
                table = "for a recording, soft_later=0.0156"
            raise TypeError(f"{given}: got it without two arrays, allowed: {_CALL}; {table}")

    def seconds(self, rows: int) -> tuple[_Array, _Array, str]:
        """Return the times of both channels, s, and a note on times with few decimals, or "".

        Parameters
        ----------
        rows : int
            Number of pairs.

        Raises
        ------
        TypeError
            Neither times nor a rate, or both; or not real numbers.
        ValueError
            Times of another length, or that do not increase; a rate or a delay out of range.
        """
        if self.times_s is None and self.rate_hz is None:
            raise TypeError(f"times_s: got neither times_s nor rate_hz, allowed: one, as {_CALL}")
        if self.times_s is not None and self.rate_hz is not None:
            raise TypeError(f"times_s: got times_s and rate_hz, allowed: one of them, as {_CALL}")
        note = ""
        if self.times_s is None:
            hard_s = np.arange(rows) / _checked_rate(self.rate_hz)
        else:
            hard_s, note = _checked_times(self.times_s, rows)
        return hard_s, hard_s + _checked_delay(self.soft_later_s, hard_s), note


def _checked_rate(rate_hz: object) -> float:
    rate = _number(rate_hz)
    if not 0 < rate < math.inf:
        allowed = "a number above 0, pairs a second"
        raise ValueError(f"rate_hz: got {quoted(rate_hz)}, allowed: {allowed}")
    return rate


def _number(value: object) -> float:
    """Return a number as a float; nan if it is none."""
    if isinstance(value, float | int | np.integer | np.floating) and not isinstance(value, bool):
        return float(value)
    return math.nan


def _checked_times(times_s: ArrayLike, rows: int) -> EvenTimes:
    dtype = np.asarray(times_s).dtype
    if dtype.kind in "mMO":
        dates = "of dates t: (t - t[0]) / numpy.timedelta64(1, 's')"
        raise TypeError(f"times_s: got dtype {dtype}, allowed: seconds as numbers; {dates}")
    even = even_times(real_array("times_s", times_s, rows))
    times = even.seconds
    right = np.isfinite(times)
    right[1:] &= times[1:] > times[:-1]
    if not right.all():
        row = int(right.argmin())
        got = f"{times[row]:g}"
        if row:
            got += f" after {times[row - 1]:g}"
        allowed = "finite numbers that increase from row to row, s"
        raise ValueError(f"times_s: got {got} in row {row}, allowed: {allowed}")
    return even


def _checked_delay(soft_later_s: object, hard_s: _Array) -> float:
    later_s = _number(soft_later_s)
    if not math.isfinite(later_s):
        allowed = "a finite number, s"
        raise ValueError(f"soft_later_s: got {quoted(soft_later_s)}, allowed: {allowed}")
    step_s = math.inf
    if len(hard_s) > 1:
        step_s = float(np.median(np.diff(hard_s)))
    if abs(later_s) >= step_s:
        allowed = f"less than the time from pair to pair, {step_s:.3g} s; negative: soft is first"
        raise ValueError(f"soft_later_s: got {later_s:g}, allowed: {allowed}")
    return later_s


def recording_of_arrays(hard: Any, soft: Any, times: PairTimes, unit: str | None) -> Recording:
    """Return the recording of two arrays.

    Parameters
    ----------
    hard, soft : array_like of real numbers, shape (n,)
    times : PairTimes
    unit : str, optional
        A capacitance, which is converted to pF, or any other text. Default: pF, for values of the
        size of a gauge.

    Raises
    ------
    TypeError
        Not two arrays of real numbers; or as in `PairTimes.seconds`.
    ValueError
        Arrays of different lengths or indices, or without values; a size that is not probable for
        pF; or as in `PairTimes.seconds`.

    Examples
    --------
    >>> recording = recording_of_arrays([9.0, 9.5], [8.0, 8.2], PairTimes(rate_hz=40), None)
    >>> recording.t_soft_s.tolist(), recording.unit
    ([0.0, 0.025], 'pF')
    """
    require_same_index(["hard", "soft", "times_s"], [hard, soft, times.times_s])
    hard_values = _readings("hard", hard)
    soft_values = _readings("soft", soft)
    if len(hard_values) != len(soft_values):
        counts = f"{len(soft_values)} readings, allowed: as many as of hard, {len(hard_values)}"
        raise ValueError(f"soft: got {counts}")
    if unit is None:
        require_probable_pF(hard_values, soft_values)
        unit = "pF"
    unit = checked_unit("unit", unit)
    hard_s, soft_s, note = times.seconds(len(hard_values))
    factor = PICOFARADS.get(unit, 1.0)
    return Recording(
        hard_s,
        soft_s,
        hard_values * factor,
        soft_values * factor,
        notes=(note,) if note else (),
        unit=unit_read(unit),
    )


def require_no_signal(value: object) -> None:
    """Check that a recording is not one signal without the other one.

    Raises
    ------
    TypeError
        It is an array, a column of a data frame, or a list of numbers.

    Examples
    --------
    >>> require_no_signal(np.ones(700))
    Traceback (most recent call last):
    TypeError: soft: got none, and hard as numpy.ndarray, allowed: palpate.touches(hard, soft, \
rate_hz=40), or with times_s
    """
    if _is_signal(value):
        raise TypeError(f"soft: got none, and hard as {_type_name(value)}, allowed: {_CALL}")


def _is_signal(value: object) -> bool:
    if isinstance(value, list | tuple):
        return len(value) > 0 and isinstance(value[0], Real)
    is_array = hasattr(value, "dtype") and hasattr(value, "shape")
    return is_array and not _is_table(value)


def _is_table(value: object) -> bool:
    names = getattr(getattr(value, "dtype", None), "names", None)
    return isinstance(value, Mapping) or hasattr(value, "columns") or bool(names)


def _type_name(value: object) -> str:
    """Return the name of a type with that of its library, as "pandas.Series"."""
    kind = type(value)
    library = kind.__module__.split(".")[0]
    return kind.__name__ if library == "builtins" else f"{library}.{kind.__name__}"


def _readings(name: str, values: Any) -> _Array:
    """Return the readings of a channel as floats, shape (n,), n at least 1."""
    if values is None:
        raise TypeError(f"{name}: got none, allowed: {_CALL}")
    if isinstance(values, str | os.PathLike) or is_like_recording(values) or _is_table(values):
        allowed = "one signal, an array of shape (n,); of a recording or table, it alone"
        raise TypeError(f"{name}: got {_type_name(values)}, allowed: {allowed}")
    shape = np.shape(values)
    if len(shape) != 1 or shape == (0,):
        raise ValueError(f"{name}: got shape {shape}, allowed: (n,), n at least 1")
    return real_array(name, values, shape[0])
