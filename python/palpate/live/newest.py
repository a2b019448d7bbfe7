"""The newest rows in memory of fixed size."""

import numpy as np

from palpate.live.feed import ROW, Rows


class Newest:
    """The newest rows, in the order in which they came; at most `most`, and up to a quarter more.

    Parameters
    ----------
    most : int
    room : int
        Rows for which there is room at once; else it grows.

    Attributes
    ----------
    end : int
        Number of rows that were ever added.
    """

    def __init__(self, most: int, room: int = 0) -> None:
        self.end: int = 0
        self._most = most
        self._rows, self._used = np.empty(room, ROW), 0

    def add(self, rows: Rows) -> None:
        """Add rows. Rows that were returned before do not change."""
        self.end += len(rows)
        rows = rows[-self._most :]
        if self._used + len(rows) > len(self._rows):
            kept = self._rows[max(self._used - self._most, 0) : self._used]
            size = len(kept) + len(rows)
            self._rows, self._used = np.empty(max(size, min(2 * size, self._most * 5 // 4)), ROW), len(kept)
            self._rows[: len(kept)] = kept
        self._rows[self._used : self._used + len(rows)] = rows
        self._used += len(rows)

    @property
    def begin(self) -> int:
        """Number of the oldest row that counts."""
        return max(self.end - self._most, 0)

    @property
    def rows(self) -> Rows:
        """All rows that are there; a view."""
        return self._rows[: self._used]

    def part(self, begin: int, most: int) -> Rows:
        """Return rows from a number on, at most so many; a view."""
        first = self._used - (self.end - begin)
        return self._rows[first : min(first + most, self._used)]
