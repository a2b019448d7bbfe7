"""What the reference judges of readings."""

from typing import NamedTuple


class Judgement(NamedTuple):
    """A judgement about the readings.

    Attributes
    ----------
    what : str
        "saturated", "frozen", "jumped", "was_touch", "step", "falling" or "still".
    channel : str
        "hard", "soft" or "both".
    time : int, ns
        Of the first reading that it is about.
    size, soft_size : float, pF
        The value of the channel, or its change; of both: of the hard and of the soft channel.

    Examples
    --------
    >>> Judgement("jumped", "hard", 9_900_000_000, 3.1).soft_size
    0.0
    """

    what: str
    channel: str
    time: int
    size: float
    soft_size: float = 0.0

    def in_seconds(self) -> tuple[float, str, str, float, float]:
        """Return it as the tracker does: time in s, channel, name, sizes."""
        return 1e-9 * self.time, self.channel, self.what, self.size, self.soft_size
