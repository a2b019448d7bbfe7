"""Notices a channel that is outside the range of the converter while nothing is touched."""

import numpy as np

from palpate.samples import Block, Status

IDLE_S, PRESSED_S = 2.0, 10.0
"""Shortest time outside the range that is told: without a touch; since a touch that has samples, s."""
_CHANNELS = (("hard", Status.HARD_SATURATED), ("soft", Status.SOFT_SATURATED))


class RangeWatch:
    """Follows which channels are saturated, and for how long.

    Parameters
    ----------
    full_scale_pF : float
        Readings from this size on are saturated.

    Attributes
    ----------
    channels : tuple of str
        Those of "hard" and "soft" that are outside the range, and not because of a touch.
    """

    def __init__(self, full_scale_pF: float) -> None:
        self.channels: tuple[str, ...] = ()
        self._full_scale_pF = full_scale_pF
        self._since_ns: dict[str, int] = {}

    def follow(self, block: Block, *, pressed: bool) -> str:
        """Take the next samples; return a message, "" for none.

        Parameters
        ----------
        block : numpy.ndarray, shape (n,)
            Samples, at least one.
        pressed : bool
            Whether after them a touch is running that has samples, or such a touch was not yet released.
        """
        longest = PRESSED_S if pressed else IDLE_S
        now = int(block["t_hard_ns"][-1])
        for name, flag in _CHANNELS:
            self._look(block, name, flag)
        before = self.channels
        self.channels = tuple(name for name, since in self._since_ns.items() if now - since >= longest * 1e9)
        if not set(self.channels) - set(before):
            return ""
        return (
            f"{' and '.join(self.channels)}: outside the range of the converter for {longest:g} s, and nothing is measured: "
            "lift the probe; if it stays so, the range has to be set again, without contact (Stream.centre; record --recentre)"
        )

    def _look(self, block: Block, name: str, flag: int) -> None:
        outside = ((block["status"] & int(flag)) != 0) | (np.abs(block[name]) >= self._full_scale_pF)
        inside = np.flatnonzero(np.isfinite(block[name]) & ~outside)
        if len(inside):
            self._since_ns.pop(name, None)
        following = np.flatnonzero(outside[inside[-1] + 1 if len(inside) else 0 :])
        if len(following) and name not in self._since_ns:
            first = following[0] + (inside[-1] + 1 if len(inside) else 0)
            self._since_ns[name] = int(block["t_hard_ns"][first])
