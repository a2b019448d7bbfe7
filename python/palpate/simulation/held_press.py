"""A press that lasts until it is released, as a person presses with a mouse."""

from dataclasses import dataclass
from math import inf

import numpy as np

from palpate.simulation.press import Press
from palpate.simulation.signals import Array, require_positive, require_within


@dataclass(frozen=True)
class HeldPress(Press):
    """A press whose force grows as long as it is held.

    Attributes
    ----------
    released_s : float
        Time of the release; inf: it is still held.
    growth : float
        The force grows by this share of its first value, `depth_pF`.
    growth_s : float
        Time constant of the growth.

    Raises
    ------
    ValueError
        A value is outside its range.

    Examples
    --------
    >>> press = HeldPress(2.0, [(0.0, 2.5)])
    >>> press.profile(np.array([1.0, 2.15, 2.3, 5.0, 60.0])).round(2)
    array([0.  , 0.51, 1.04, 1.32, 1.6 ])
    >>> HeldPress(2.0, [(0.0, 2.5)], released_s=5.0).profile(np.array([5.125, 5.25])).round(2)
    array([0.66, 0.  ])
    """

    released_s: float = inf
    growth: float = 0.6
    growth_s: float = 4.0

    def __post_init__(self) -> None:
        """Check the ranges."""
        super().__post_init__()
        require_within(0, inf, growth=self.growth)
        require_positive(growth_s=self.growth_s)

    @property
    def stop_s(self) -> float:
        """Time of the end of the fall, s."""
        return self.released_s + self.fall_s

    def profile(self, t: Array) -> Array:
        """Return the press without tremor at times t, s; 1 is `depth_pF`."""
        held_until = np.minimum(t, self.released_s)
        since = np.maximum(held_until - self.start_s, 0)
        rise = np.minimum(since / self.rise_s, 1)
        grown = 1 - self.growth * np.expm1(-since / self.growth_s)
        fall = np.clip((self.stop_s - t) / self.fall_s, 0, 1)
        return np.asarray(_half_cosine(rise) * grown * _half_cosine(fall))


def _half_cosine(share: Array) -> Array:
    """Return a smooth step from 0 to 1."""
    return np.asarray(0.5 * (1 - np.cos(np.pi * share)))
