"""Reference of the gate: the begin and the end of a touch, from the sum of the changes of both channels."""

from dataclasses import dataclass

import numpy as np

SLACK, LIMIT, CLIP = 1.5, 16.0, 6.0  # of the CUSUM, standard deviations
QUIET = 1.2  # standard deviations: the touch began after the last value below it
RELEASE, IDLE_SHARE = 0.5, 0.1  # of the highest value
CONFIRM = 3  # values in a row that end a touch
PATIENCE_S = 30.0


@dataclass
class Contact:
    """The gate, value by value: reference of the third stage of the scene "handheld".

    Attributes
    ----------
    state : str
        "idle", "contact", or "released" (the touch is over, the channels are not yet idle).
    rise, fall : float, standard deviations
        CUSUM (Page's test) of the change, and of the change downwards.
    age : int
        Values since the last quiet one; in contact: this number when the contact was found.
    highest : float, pF
        Highest change of the touch.
    in_a_row : int
        Values that confirm an end, or a touch between two baselines.

    Examples
    --------
    >>> gate = Contact()
    >>> for change in [0.0, 10.0, 10.0, 10.0, 10.0]:
    ...     gate.update(change, 1.0)
    >>> gate.state, gate.age
    ('contact', 4)
    """

    state: str = "idle"
    rise: float = 0.0
    fall: float = 0.0
    age: int = 0
    highest: float = 0.0
    in_a_row: int = 0

    @property
    def suspects(self) -> bool:
        """Whether a touch may have begun."""
        return self.rise > 0 or self.age > 0

    @property
    def fell(self) -> bool:
        """Whether the idle channels fell far below the baseline: by three times the limit."""
        return self.fall >= 3 * LIMIT

    def update(self, change: float, noise: float, waited_s: float = 0.0) -> None:
        """Take one change and its noise, pF, and the time since a touch took samples, s."""
        if self.state == "idle":
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                deviations = float(np.float64(change) / np.float64(noise))
            self.rise, self.fall = _page(self.rise, deviations), _page(self.fall, -deviations)
            self.age = self.age + 1 if deviations >= QUIET else 0
            if self.rise >= LIMIT:
                self._begin(change)
            return
        touching = self.state == "contact"
        if touching:
            self.highest = max(self.highest, change)
        share = RELEASE if touching else IDLE_SHARE
        low = change < max(share * self.highest, (SLACK + 1) * noise)
        self.in_a_row = self.in_a_row + 1 if low else 0
        patient = waited_s < PATIENCE_S
        if self.in_a_row == CONFIRM or not patient:
            self.calm_down("released" if touching and patient else "idle")

    def update_between(self, change: float, noise: float) -> None:
        """Take one change from the old baseline, pF, while a new one is measured after a touch.

        The next touch begins with more than 3 values in a row above a fifth of the height of the last touch and above
        6 standard deviations of the noise.
        """
        high = self.highest > 0 and change > max(2 * IDLE_SHARE * self.highest, CLIP * noise)
        self.in_a_row = self.in_a_row + 1 if high else 0
        if self.in_a_row > CONFIRM:
            self.age = self.in_a_row
            self._begin(change)

    def calm_down(self, state: str) -> None:
        """Begin again in a state."""
        self.state, self.rise, self.fall, self.age, self.in_a_row = state, 0.0, 0.0, 0, 0

    def reset(self) -> None:
        """Begin again, without a last touch."""
        self.calm_down("idle")
        self.highest = 0.0

    def _begin(self, change: float) -> None:
        self.state, self.highest, self.in_a_row = "contact", change, 0


def _page(statistic: float, deviations: float) -> float:
    """Return max(0, g + min(z, 6) - 1.5); 0 where z is not a number."""
    after = statistic + min(deviations, CLIP) - SLACK
    return after if after > 0 else 0.0
