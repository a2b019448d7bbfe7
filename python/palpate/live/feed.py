"""Samples and estimates as the page takes them: the tracker's own bits, column by column."""

import struct
from collections.abc import Sequence
from enum import IntFlag
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.samples import refused, saturated
from palpate.stream.estimate import Batch

Rows = NDArray[np.void]
"""What a page draws, shape (n,), of `ROW`."""
FIELDS = ("t_s", "hard", "soft", "ratio", "standard_error", "statistic")
ROW = np.dtype([(name, "<f8") for name in FIELDS] + [("flags", "u1")])
KEPT = 16384
"""Samples that a page which comes later is given: 160 s at 100 pairs a second, 16 s at 1,000."""
HEADER = struct.Struct("<4I")
VERSION = 1


class Flag(IntFlag):
    """What a page knows of a sample beside its numbers."""

    CONTACT = 1
    MEASURED = 2
    ALARM = 4
    REFUSED = 8
    SATURATED = 16


def rows_of(batch: Batch) -> Rows:
    """Return what a page draws of a batch.

    The changes of both capacitances, pF, from the baselines that the tracker had at each sample; nan where a sample has
    no value or there is no baseline yet. Ratio, standard error and statistic: of the touch that is measured; nan where
    none is.

    Examples
    --------
    >>> import palpate
    >>> with palpate.Stream("sim:stiff-steady?seed=1") as stream:
    ...     rows = np.concatenate([rows_of(batch) for batch in stream.batches()])
    >>> bool(rows["ratio"][rows["flags"] & Flag.MEASURED != 0][-1] == stream.touches[0].ratio)
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


def joined(parts: Sequence[Rows]) -> Rows:
    """Return several blocks of rows as one."""
    return np.concatenate(parts) if parts else np.empty(0, ROW)


def pack(number: int, rows: Rows, *, past: bool = False) -> bytes:
    """Return a frame: version, number, samples, whether it is the past, each uint32; columns of float64; flags, uint8.

    Little-endian. The header is 16 bytes, so that a browser may look at the columns where they lie.

    Examples
    --------
    >>> frame = pack(7, np.zeros(3, ROW))
    >>> len(frame), HEADER.unpack_from(frame)
    (163, (1, 7, 3, 0))
    """
    columns = (np.ascontiguousarray(rows[name]).tobytes() for name in (*FIELDS, "flags"))
    return HEADER.pack(VERSION, number, len(rows), past) + b"".join(columns)


class History:
    """The newest rows, never more than `KEPT`."""

    def __init__(self) -> None:
        self._rows, self._used = np.empty(2 * KEPT, ROW), 0

    def add(self, rows: Rows) -> None:
        """Take rows, and let go of the oldest."""
        rows = rows[-KEPT:]
        if self._used + len(rows) > len(self._rows):
            kept = self.rows
            self._rows[: len(kept)] = kept.copy()
            self._used = len(kept)
        self._rows[self._used : self._used + len(rows)] = rows
        self._used += len(rows)

    @property
    def rows(self) -> Rows:
        """The newest, oldest first; a view."""
        return self._rows[max(self._used - KEPT, 0) : self._used]
