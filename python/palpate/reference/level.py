"""Reference of the level ratio: a line with an intercept over rise, hold and fall, which a tilt of the probe does not change."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# the press has settled if for so long it has not grown by a tenth
SETTLED_S = 0.1
GROWS = 1.1
# shares of the height: the hold, and the end of the fall
HELD = 0.75
LEAST = 1 / 6
FEWEST = 3  # pairs of the hold, and of the rise or the fall
# factors of the variance of the slope, with the fall and without
SCATTERS = 3.0
SCATTER = 9.0
# shares of what the intercept changes, with the fall and without
BENT = 0.02
BENDS = 0.05
LARGEST = 0.1  # relative error of a level ratio
MOST_NOISE = 0.3  # share of the variation of the soft channel
LEAST_SWEEP = 5e-4  # variation of the soft channel, share of its sum of squares
OF_HOLD = (
    0.25  # share of what the depth varies in the hold: a tremor moves force and angle together
)


def fitted_line(
    x: Array, y: Array, held: NDArray[np.bool_], noise: float
) -> tuple[float, float, float]:
    """Return the slope of y = b x + c by least squares, its variance from the residuals, and the share of noise in x.

    `noise` is its variance in x: it is taken out of the sum of squares. The slope is 0 if x does not vary by more.
    """
    middle = x - x.mean()
    of_hold = x[held].mean() - x.mean()
    swept = np.where(held, of_hold + OF_HOLD * (middle - of_hold), middle)
    square = float(swept @ middle)
    counted = float(np.where(held, OF_HOLD, 1.0).sum())
    if (
        square <= LEAST_SWEEP * (x @ x)
        or not (share := float(counted * noise / square)) < MOST_NOISE
    ):
        return 0.0, np.nan, np.nan
    slope = float(swept @ y / square)
    rest = y - y.mean() - slope * middle
    return slope / (1 - share), float(rest @ rest / (len(x) - 2) / square) / (1 - share) ** 2, share


@dataclass
class Sweep:
    """The pairs of a touch, from contact to the end of its fall.

    Attributes
    ----------
    exponent, age : float
        p of force ~ depth^p, and the age at which the touch ends, s; 0: at its length.
    pairs : list of (float, float, float, bool)
        Hard, soft, pF; time, s; whether the touch took samples.
    begin : int
        Pair with which the samples since the last hand-over begin.

    Examples
    --------
    >>> z = np.concatenate([np.linspace(0.1, 1, 10), np.ones(20), np.linspace(1, 0.1, 10)])
    >>> sweep = Sweep()
    >>> for number, depth in enumerate(z):
    ...     sweep.add(3 * (depth + 0.02), depth - 0.02, 0.026 * number, held=number < 30)
    >>> round(sweep.result(3.1, revised=True)[0], 12)
    3.0
    """

    exponent: float = 1.0
    age: float = 0.0
    pairs: list[tuple[float, float, float, bool]] = field(default_factory=list)
    begin: int = 0

    def add(self, hard: float, soft: float, time_s: float, *, held: bool) -> None:
        """Take a pair, pF, at a time since contact, s."""
        if 0 < hard < np.inf and 0 < soft < np.inf:
            self.pairs.append((hard, soft, time_s, held))

    def restart(self) -> None:
        """Forget the pairs before a hand-over."""
        self.begin = len(self.pairs)

    def press(self) -> tuple[float, float]:
        """Return the depth of the press, pF, and the seconds from the contact until it had settled; nan: it had not."""
        count, highest, settled_s = self.settled()
        return (highest, settled_s) if count else (np.nan, np.nan)

    def settled(self) -> tuple[int, float, float]:
        """Return the number of pairs until the press has settled, its height, pF, and the time, s; 0: it has not."""
        highest = 0.0
        grown = 0.0
        for number, (_, soft, time_s, _) in enumerate(self.pairs, 1):
            if soft > GROWS * highest:
                highest = soft
                grown = time_s
            elif time_s - grown > SETTLED_S:
                return number, highest, time_s
        return 0, 0.0, 0.0

    def result(self, ratio: float, noise: float = 0.0, *, revised: bool) -> tuple[float, float]:
        """Return the level ratio and its standard error, beside the ratio of the hold, for the noise of `soft`, pF.

        nan: there is none.
        """
        none = (np.nan, np.nan)
        (count, height, _) = self.settled()
        if not count:
            return none
        hard, soft, _, held = np.array(self.pairs, float).T
        number = np.arange(len(soft))
        top = 2 * soft[0]  # octaves of the first one; three of them count
        while not soft[:count].max() < top:
            top *= 2
        rise = (number < count) & (soft >= top / 8)
        hold = (number >= count) & (soft > HELD * height) & (held > 0)
        fall = (number >= count) & (soft <= HELD * height) & (soft > LEAST * height)
        rise, hold, fall = (part & (number >= self.begin) for part in (rise, hold, fall))
        falls = revised and not self.age and fall.sum() >= FEWEST
        if hold.sum() < FEWEST or (rise.sum() < FEWEST and not falls):
            return none
        x, y = (values ** (1 / self.exponent) for values in (soft, hard))
        lines = {
            "up": rise | hold,
            "all": rise | hold | fall if falls else rise | hold,
            "down": hold | fall,
        }

        def line(name: str) -> tuple[float, float, float]:
            p = self.exponent
            part = x[lines[name]]
            # The noise in the coordinate of the contact, at the mean depth.
            return fitted_line(
                part,
                y[lines[name]],
                hold[lines[name]],
                (noise / p) ** 2 * part.mean() ** (2 - 2 * p),
            )

        slope, variance, share = line("all")
        if not slope > 0:
            return none
        apart = 0.0
        if falls and rise.sum() >= FEWEST:
            apart = line("up")[0] - line("down")[0]
        level = slope**self.exponent
        shift = (BENT if falls else BENDS) * (level - ratio) / level
        own = (SCATTERS if falls else SCATTER) * variance + apart**2 / 4
        square = self.exponent**2 * (own / slope**2 + share**2 / 16) + shift**2
        return (level, level * float(np.sqrt(square))) if square < LARGEST**2 else none
