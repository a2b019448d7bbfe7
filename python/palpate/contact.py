"""Where the touches are in a recording: a threshold over the idle noise.

The rule, on the sum of both channels' changes (its magnitude, so that a press may also lower the
capacitances):

1. Idle: the baseline of each channel is its median over `IDLE` samples; the noise is 1.4826 times
   the median absolute deviation of the sum over the same samples.
2. A touch starts at the first of `CONFIRM` samples in a row above max(`NOISES` noise, `FLOOR_PF`).
3. It ends before the first of `CONFIRM` samples in a row below `RELEASE` of its highest value: the
   falling flank, where a hand tears the two channels apart, is left out.
4. The next idle stretch starts after `CONFIRM` samples in a row below `IDLE_AGAIN` of that value;
   its baseline is measured anew, so that a slow drift does not add up.

A touch that begins while an idle stretch is being measured is missed when it covers half of it.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

IDLE = 40
CONFIRM = 3
NOISES = 8.0
FLOOR_PF = 0.001
RELEASE = 0.5
IDLE_AGAIN = 0.1


class Contact(NamedTuple):
    """One touch: samples [start, stop), and each channel's value before it, pF."""

    start: int
    stop: int
    hard_baseline: float
    soft_baseline: float


def find_contacts(hard: NDArray[np.float64], soft: NDArray[np.float64]) -> Iterator[Contact]:
    """Find the touches, by the rule above.

    Parameters
    ----------
    hard, soft : numpy.ndarray, shape (n,), pF, finite
        Both channels, baseline not removed.

    Yields
    ------
    Contact
        In order of time.
    """
    position = 0
    while position + IDLE < len(hard):
        idle = slice(position, position + IDLE)
        hard_baseline, soft_baseline = float(np.median(hard[idle])), float(np.median(soft[idle]))
        signal = np.abs((hard - hard_baseline) + (soft - soft_baseline))
        threshold = max(NOISES * 1.4826 * float(np.median(signal[idle])), FLOOR_PF)
        start = _first_run(signal > threshold, position + IDLE)
        if start is None:
            return
        peak = np.maximum.accumulate(signal[start:])
        released = _first_run(signal[start:] < np.maximum(RELEASE * peak, threshold / 2), 0)
        stop = len(hard) if released is None else start + released
        yield Contact(start, stop, hard_baseline, soft_baseline)
        quiet = None if released is None else _first_run(signal < IDLE_AGAIN * peak[released], stop)
        if quiet is None:
            return
        position = quiet + CONFIRM


def _first_run(condition: NDArray[np.bool_], begin: int) -> int | None:
    """Index of the first of CONFIRM true values in a row, from `begin` on."""
    runs = np.convolve(condition[begin:], np.ones(CONFIRM, int), "valid") == CONFIRM
    return begin + int(np.argmax(runs)) if runs.any() else None
