"""Reference of the noise of a channel that is slower than its readings, from the means of blocks of idle values."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

# values of a block, and sizes of blocks, each twice the one before it
SMALLEST = 8
LEVELS = 6
# differences of neighbours: of the smallest blocks, and of the others
FIRST = 16
FEWEST = 4
MOST = 255  # differences; of more, the older ones count less
LIMIT = 4.0  # of a difference, standard deviations
MARGIN = 4.0  # share of the white noise for one difference


@dataclass
class SlowNoise:
    """The blocks of the idle values of a channel, pause by pause.

    Attributes
    ----------
    pauses : list of list of float
        Means of the smallest blocks of each pause, pF.

    Examples
    --------
    >>> noise = SlowNoise()
    >>> for value in np.sin(np.arange(400) / 20):
    ...     noise.add(float(value), suspected=False)
    >>> round(float(noise.of_mean(16, white=0.0)), 2)
    0.15
    """

    pauses: list[list[float]] = field(default_factory=lambda: [[]])
    _values: list[float] = field(default_factory=list)

    def add(self, value: float, *, suspected: bool) -> None:
        """Take an idle value, pF; `suspected`: a touch may have begun, so that no block ends."""
        self._values.append(value)
        if suspected or len(self._values) < SMALLEST:
            return
        # without the largest and the smallest one, so that a spike is none
        self.pauses[-1].append(float(np.mean(np.sort(self._values)[1:-1])))
        self._values = []

    def interrupt(self) -> None:
        """Begin another pause: a touch has begun, perhaps in the last values."""
        self.pauses.append([])
        self._values = []

    def of_mean(self, length: float, white: float) -> float:
        """Return the variance of a mean by slow noise.

        Parameters
        ----------
        length : float
            Number of its values.
        white : float, pF^2
            Variance of the noise of a value.

        Returns
        -------
        float, pF^2

        Notes
        -----
        Half of the variance of the difference between neighbouring blocks is that of a block. The smallest blocks that are as long
        as the mean count; if these are not known, the variance grows from shorter ones in proportion, as of a walk.
        """
        found = 0.0
        for level in range(LEVELS):
            size = SMALLEST * 2**level
            changes = self._changes(level)
            count = min(len(changes), MOST)
            if count < (FEWEST if level else FIRST):
                return found
            half = _spread(changes) * count / (count - 1) / 2
            found = max(half - white / size * (1 + MARGIN / np.sqrt(count)), 0.0)
            if size >= length:
                return float(found)
            found *= length / size
        return found

    def _changes(self, level: int) -> NDArray[np.float64]:
        """Return the differences between neighbouring blocks of a size, of all pauses in the order of time."""
        changes = [np.zeros(0)]
        for pause in self.pauses:
            blocks = np.array(pause)
            for _ in range(level):
                blocks = blocks[: len(blocks) // 2 * 2].reshape(-1, 2).mean(axis=1)
            changes.append(np.diff(blocks))
        return np.concatenate(changes)


def _spread(changes: NDArray[np.float64]) -> float:
    """Return the mean square of the deviations from the mean; one far out is limited, and at last the older ones count less."""
    mean = square = 0.0
    for number, change in enumerate(changes.tolist(), 1):
        count = min(number, MOST)
        off = change - mean
        if count > FEWEST:
            off = float(np.clip(off, -LIMIT * np.sqrt(square), LIMIT * np.sqrt(square)))
        mean += off / count
        square += (off**2 * (1 - 1 / count) - square) / count
    return square
