"""Binary frames of samples and estimates for the page: the exact values of the tracker, column by column."""

import struct
from collections.abc import Sequence
from enum import IntFlag
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.samples import refused, saturated
from palpate.stream.estimate import Batch

Rows = NDArray[np.void]
"""Rows that a page draws: shape (n,), dtype `ROW`."""
FIELDS = ("t_s", "hard", "soft", "ratio", "standard_error", "statistic")
ROW = np.dtype([(name, "<f8") for name in FIELDS] + [("flags", "u1")])
KEPT = 16384
"""Rows that are kept for a page that is opened later: 160 s at 100 pairs per second, 16 s at 1,000 and more."""
HEADER = struct.Struct("<4I")
VERSION = 2
BINS_PER_S = 500
"""Beyond two rows in each of these parts of a second, a page gets two: lowest and highest values."""


class Flag(IntFlag):
    """Flags of a row."""

    CONTACT = 1
    MEASURED = 2
    ALARM = 4
    REFUSED = 8
    SATURATED = 16


def rows_of(batch: Batch) -> Rows:
    """Return the rows that a page draws for a batch.

    hard, soft: changes of the capacitances, pF, from the tracker's baselines at that sample; nan for a sample without a
    value, or before the first baseline. ratio, standard_error, statistic: of the current touch; nan outside touches.

    Examples
    --------
    >>> import palpate
    >>> with palpate.Stream("sim:stiff-steady?seed=1") as stream:
    ...     rows = np.concatenate([rows_of(batch) for batch in stream.batches()])
    >>> bool(rows["ratio"][rows["flags"] & Flag.MEASURED != 0][-1] == stream.touches[0].first_ratio)
    True
    """
    samples, estimates = batch.samples, batch.rows
    rows = np.empty(len(samples), ROW)
    unusable, measured = refused(samples), estimates["touch"] > 0
    rows["t_s"] = samples["t_hard_ns"] * 1e-9
    for name in ("hard", "soft"):
        rows[name] = np.where(unusable, np.nan, samples[name] - estimates[f"{name}_baseline"])
    for name in ("ratio", "standard_error", "statistic"):
        rows[name] = np.where(measured, estimates[name], np.nan)
    flags: dict[Flag, Any] = {
        Flag.CONTACT: estimates["contact"],
        Flag.MEASURED: measured,
        Flag.ALARM: estimates["alarm"] & measured,
        Flag.REFUSED: unusable,
        Flag.SATURATED: saturated(samples),
    }
    rows["flags"] = sum(np.where(holds, int(flag), 0) for flag, holds in flags.items())
    return rows


def thinned(rows: Rows) -> Rows:
    """Return the lowest and the highest values of each 2 ms, if there are more rows than that; else all rows.

    Of each column the value that came first stands first, if the column only rises or falls. standard_error: the
    highest, twice. flags: all that were there. A bin has a nan only where no row of it has a value.

    Examples
    --------
    >>> rows = np.zeros(1000, ROW)
    >>> rows["t_s"], rows["hard"] = np.arange(1000) / 1e5, np.sin(np.arange(1000))
    >>> kept = thinned(rows)
    >>> len(kept), bool(np.ptp(kept["hard"]) == np.ptp(rows["hard"]))
    (10, True)
    """
    bins = np.floor(rows["t_s"] * BINS_PER_S)
    begins = np.flatnonzero(np.diff(bins, prepend=np.nan))
    if len(rows) <= 2 * len(begins):
        return rows
    ends = np.append(begins[1:], len(rows)) - 1
    kept = np.empty((len(begins), 2), ROW)
    kept["t_s"] = np.column_stack((rows["t_s"][begins], rows["t_s"][ends]))
    for name in FIELDS[1:]:
        values = rows[name]
        low, high = np.fmin.reduceat(values, begins), np.fmax.reduceat(values, begins)
        falls = values[ends] < values[begins]
        kept[name] = np.column_stack((np.where(falls, high, low), np.where(falls, low, high)))
    kept["standard_error"] = kept["standard_error"].max(axis=1, keepdims=True)
    kept["flags"] = np.bitwise_or.reduceat(rows["flags"], begins)[:, None]
    return kept.ravel()


def joined(parts: Sequence[Rows]) -> Rows:
    """Return several blocks of rows as one."""
    return np.concatenate(parts) if parts else np.empty(0, ROW)


def pack(number: int, rows: Rows, *, past: bool = False) -> bytes:
    """Return a frame as bytes.

    Little-endian: version, number, number of samples, past (0 or 1), each uint32; then the columns, float64; then the
    flags, uint8. The header has 16 bytes: the columns are aligned, and a browser reads them without a copy. past: the
    page shall forget all rows before these.

    Examples
    --------
    >>> frame = pack(7, np.zeros(3, ROW))
    >>> len(frame), HEADER.unpack_from(frame)
    (163, (2, 7, 3, 0))
    """
    columns = (np.ascontiguousarray(rows[name]).tobytes() for name in (*FIELDS, "flags"))
    return HEADER.pack(VERSION, number, len(rows), past) + b"".join(columns)


class History:
    """The newest rows of a measurement, at most `KEPT`; rows are counted from 0.

    Attributes
    ----------
    end : int
        Number of rows that were ever added.
    """

    def __init__(self) -> None:
        self.end: int = 0
        self._rows, self._used = np.empty(2 * KEPT, ROW), 0

    def add(self, rows: Rows) -> None:
        """Add rows, and remove the oldest ones."""
        self.end += len(rows)
        rows = rows[-KEPT:]
        if self._used + len(rows) > len(self._rows):
            kept = self._rows[max(self._used - KEPT, 0) : self._used]
            self._rows[: len(kept)] = kept.copy()
            self._used = len(kept)
        self._rows[self._used : self._used + len(rows)] = rows
        self._used += len(rows)

    @property
    def begin(self) -> int:
        """Number of the oldest row that is still there."""
        return max(self.end - KEPT, 0)

    def rows(self, begin: int, most: int) -> Rows:
        """Return rows from a number on, at most so many; a view."""
        first = self._used - (self.end - begin)
        return self._rows[first : min(first + most, self._used)]
