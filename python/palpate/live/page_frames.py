"""Frames for a page: samples and estimates with the exact values of the tracker."""

import struct
from enum import IntEnum, IntFlag

import numpy as np
from numpy.typing import NDArray

from palpate.samples import refused_samples, saturated_samples
from palpate.stream.batches import Batch

Rows = NDArray[np.void]  # rows that a page draws: shape (n,), dtype `ROW`
FIELDS = ("t_s", "hard", "soft", "ratio", "standard_error", "statistic")
ROW = np.dtype([(name, "<f8") for name in FIELDS] + [("flags", "u1")])
HEADER = struct.Struct("<4I")
VERSION = 3
BINS_PER_S = 500.0  # beyond two rows in each of these parts of a second, a page gets two: lowest and highest values


class FrameKind(IntEnum):
    """What a page does with the rows of a frame: adds them, forgets all rows before them, or shows them as a view."""

    NEXT = 0
    ANEW = 1
    VIEW = 2


class RowFlag(IntFlag):
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
    >>> bool(rows["ratio"][rows["flags"] & RowFlag.MEASURED != 0][-1] == stream.touches[0].first_ratio)
    True
    """
    samples = batch.samples
    estimates = batch.rows
    refused = refused_samples(samples)
    is_measured = estimates["touch"] > 0
    rows = np.empty(len(samples), ROW)
    rows["t_s"] = samples["t_hard_ns"] * 1e-9
    for name in ("hard", "soft"):
        rows[name] = np.where(refused, np.nan, samples[name] - estimates[f"{name}_baseline"])
    for name in ("ratio", "standard_error", "statistic"):
        rows[name] = np.where(is_measured, estimates[name], np.nan)
    rows["flags"] = (
        np.where(estimates["contact"], RowFlag.CONTACT, 0)
        | np.where(is_measured, RowFlag.MEASURED, 0)
        | np.where(estimates["alarm"] & is_measured, RowFlag.ALARM, 0)
        | np.where(refused, RowFlag.REFUSED, 0)
        | np.where(saturated_samples(samples), RowFlag.SATURATED, 0)
    )
    return rows


def ends_of(batch: Batch) -> dict[int, float]:
    """Return the time of the last sample in the batch of each touch, s, by the number of the touch."""
    numbers = batch.rows["touch"]
    last = np.flatnonzero(np.diff(numbers, append=np.uint32(0)))
    times_s = batch.samples["t_hard_ns"][last] * 1e-9
    ends = dict(zip(numbers[last].tolist(), times_s.tolist(), strict=True))
    ends.pop(0, None)  # no touch
    return ends


def thinned(rows: Rows, per_s: float = BINS_PER_S) -> Rows:
    """Return two rows for each bin, 1/per_s wide, that has more: the lowest and the highest values; other rows as they are.

    Examples
    --------
    >>> rows = np.zeros(1000, ROW)
    >>> rows["t_s"], rows["hard"] = np.arange(1000) / 1e5, np.sin(np.arange(1000))
    >>> kept = thinned(rows)
    >>> len(kept), bool(np.ptp(kept["hard"]) == np.ptp(rows["hard"]))
    (10, True)
    """
    # Of each column the value that came first stands first, if the column only rises or falls. standard_error: the highest,
    # twice. flags: all that were there. Such a bin has a nan only where no row of it has a value. Bins that are cut anew,
    # into wider ones that they fill, have the same extremes as all the rows.
    return extremes(rows, np.flatnonzero(np.diff(np.floor(rows["t_s"] * per_s), prepend=np.nan)))


def extremes(rows: Rows, begins: NDArray[np.intp]) -> Rows:
    """Return the rows thinned as `thinned`, with bins that begin at these rows."""
    counts = np.diff(begins, append=len(rows))
    full = counts > 2
    if not full.any():
        return rows
    counts = np.minimum(counts, 2)
    place = np.cumsum(counts) - counts
    ends = np.append(begins[1:], len(rows)) - 1
    chosen = np.repeat(begins, counts)
    chosen[place + counts - 1] = ends
    kept = rows.take(chosen)  # in a tenth of the time of rows[chosen]
    first = place[full]
    for name in FIELDS[1:]:
        values = rows[name]
        low = np.fmin.reduceat(values, begins)[full]
        high = np.fmax.reduceat(values, begins)[full]
        if name == "standard_error":
            low = high
        falls = values[ends[full]] < values[begins[full]]
        kept[name][first] = np.where(falls, high, low)
        kept[name][first + 1] = np.where(falls, low, high)
    flags = np.bitwise_or.reduceat(rows["flags"], begins)[full]
    kept["flags"][first] = flags
    kept["flags"][first + 1] = flags
    return kept


def pack(number: int, rows: Rows, kind: FrameKind = FrameKind.NEXT) -> bytes:
    """Return a frame as bytes.

    Little-endian: version, number, number of rows, kind, each uint32; then the columns, float64; then the flags, uint8.
    The header has 16 bytes: the columns are aligned, and a browser reads them without a copy. number: of
    a view, the one that the page gave it.

    Examples
    --------
    >>> frame = pack(7, np.zeros(3, ROW))
    >>> len(frame), HEADER.unpack_from(frame)
    (163, (3, 7, 3, 0))
    """
    parts = [HEADER.pack(VERSION, number, len(rows), kind)]
    for name in (*FIELDS, "flags"):
        parts.append(np.ascontiguousarray(rows[name]).tobytes())
    return b"".join(parts)
