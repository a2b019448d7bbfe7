"""Notices a channel that is outside the range of the converter while nothing is touched."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palpate.samples import Block, Status

IDLE_S, PRESSED_S = 2.0, 10.0
"""Shortest time outside the range that is told: without a touch; since a touch that has samples, s."""
_CHANNELS = (("hard", Status.HARD_SATURATED), ("soft", Status.SOFT_SATURATED))


class RangeWatch:
    """Follows which channels are saturated, and for how long; the same for samples one by one and in blocks.

    Parameters
    ----------
    full_scale_pF : float
        Readings from this size on are saturated.
    initial_ratio : float
        That of the tracker.

    Attributes
    ----------
    channels : tuple of str
        Those of "hard" and "soft" that are outside the range, and not because of a touch.
    """

    def __init__(self, full_scale_pF: float, initial_ratio: float) -> None:
        self.channels: tuple[str, ...] = ()
        self._full_scale_pF, self._initial_ratio = full_scale_pF, initial_ratio
        self._since_ns: dict[str, float] = {}

    def follow(self, block: Block, rows: NDArray[Any]) -> list[str]:
        """Take the next samples; return messages.

        Parameters
        ----------
        block : numpy.ndarray, shape (n,)
            Samples, at least one.
        rows : numpy.ndarray, shape (n,)
            Of `Tracker.process`.
        """
        if (
            not self._since_ns
            and not block["status"].any()
            and not any(self._large(block[name]).any() for name, _ in _CHANNELS)
        ):
            return []
        # A channel that left its range begins a touch without any samples.
        pressed = rows["contact"] & (rows["ratio"] != self._initial_ratio)
        times, longest_s = block["t_hard_ns"].astype(float), np.where(pressed, PRESSED_S, IDLE_S)
        told = np.empty((len(block) + 1, len(_CHANNELS)), bool)  # before the first sample, and after each one
        for column, (name, flag) in zip(told.T, _CHANNELS, strict=True):
            outside = ((block["status"] & int(flag)) != 0) | self._large(block[name])
            column[0] = name in self.channels
            column[1:] = times - self._since(block, name, outside) >= longest_s * 1e9
        self.channels = _named(told[-1])
        newly = np.flatnonzero((told[1:] & ~told[:-1]).any(axis=1))
        return [_message(_named(told[row + 1]), longest_s[row]) for row in newly]

    def _large(self, readings: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(np.abs(readings) >= self._full_scale_pF)

    def _since(self, block: Block, name: str, outside: NDArray[np.bool_]) -> NDArray[np.float64]:
        """Return since when the channel is outside, ns, at each sample; nan: it is inside. A lost reading changes nothing."""
        known, before = outside | np.isfinite(block[name]), self._since_ns.pop(name, math.nan)
        out, times = outside[known], block["t_hard_ns"][known].astype(float)
        if not math.isnan(before):
            times[:1] = before
        last_inside = np.maximum.accumulate(np.where(out, -1, np.arange(len(out))))
        begins = np.where(out, times[np.minimum(last_inside + 1, len(out) - 1)], math.nan)
        since: NDArray[np.float64] = np.concatenate([[before], begins])[np.cumsum(known)]
        if not math.isnan(since[-1]):
            self._since_ns[name] = float(since[-1])
        return since


def _named(told: NDArray[np.bool_]) -> tuple[str, ...]:
    return tuple(name for (name, _), holds in zip(_CHANNELS, told, strict=True) if holds)


def _message(channels: tuple[str, ...], longest_s: float) -> str:
    return (
        f"{' and '.join(channels)}: outside the range of the converter for {longest_s:g} s, and nothing is measured: "
        "lift the probe; if it stays so, the range has to be set again, without contact (Stream.centre; record --recentre)"
    )
