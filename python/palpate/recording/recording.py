"""A recording in memory: both channels as arrays."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Recording:
    """A recording in memory: times and capacitances of both channels.

    Attributes
    ----------
    t_hard_s, t_soft_s : numpy.ndarray, shape (n,)
        Times of the readings of each channel, s; nan if the file has no times, equal if it has one time for both.
    hard, soft : numpy.ndarray, shape (n,)
        Capacitances, pF, baseline included; nan for a missing value.
    notes : tuple of str
        Remarks on the data: rows without a value, an incomplete last row, times that go back.
    full_scale_pF : float
        Readings of this magnitude are saturated: that of the AD7746 in palpate's own files, else inf.
    host_stamps : bool
        Whether the times are those of the arrival at the computer; False if it is not known.
    doubts : tuple of str
        Those of the notes that say that the file is not as it was written: results may be wrong.
    gap_rows : tuple of int
        Rows from which on the baseline before does not hold, from 1: the board was opened again, or its range moved.
    zero_utc_ns : int or None
        UTC of t = 0, ns since 1970, by the wall clock of the computer that recorded; None: unknown.
    understood : str
        Of a table of another program: one line that says which columns and units were used.

    Examples
    --------
    >>> import palpate
    >>> recording = palpate.read("tests/data/four-specimens.csv")
    >>> recording.hard.shape == recording.t_soft_s.shape, recording.notes
    (True, ())
    """

    t_hard_s: NDArray[np.float64]
    t_soft_s: NDArray[np.float64]
    hard: NDArray[np.float64]
    soft: NDArray[np.float64]
    notes: tuple[str, ...] = ()
    full_scale_pF: float = math.inf
    host_stamps: bool = False
    doubts: tuple[str, ...] = ()
    gap_rows: tuple[int, ...] = ()
    zero_utc_ns: int | None = None
    understood: str = ""

    @property
    def utc_ns(self) -> NDArray[np.int64]:
        """UTC of the hard channel's readings, ns since 1970, shape (n,); it puts recordings on one time axis.

        Raises
        ------
        ValueError
            It is not known, for example of a simulation that ran faster than time.
        """
        if self.zero_utc_ns is None:
            raise ValueError(
                "utc_ns: got a recording without the wall clock, allowed: one of a device in real time "
                "(of a simulated one with speed=1), made by palpate"
            )
        return self.zero_utc_ns + np.rint(self.t_hard_s * 1e9).astype(np.int64)

    def __post_init__(self) -> None:
        """Convert the fields to arrays, and check them."""
        size = np.size(self.hard)
        for name in ("t_hard_s", "t_soft_s", "hard", "soft"):
            given: Any = getattr(self, name)
            array = np.asarray(np.ma.filled(given.astype(float), math.nan) if np.ma.isMaskedArray(given) else given)
            if array.dtype.kind not in "biuf":
                raise TypeError(f"{name}: got dtype {array.dtype}, allowed: real numbers")
            if array.shape != (size,):
                raise ValueError(f"{name}: got shape {array.shape}, allowed: ({size},)")
            object.__setattr__(self, name, array.astype(float))
