"""Readings of both channels, one or an array of them, and how they reach a tracker.

Sources give samples, recordings keep them, the ring carries them; live and replayed they are fed alike, so that the bits
are the same.
"""

import math
from collections.abc import Iterable
from enum import IntFlag
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate._core import SampleRing, Tracker


class Status(IntFlag):
    """What stands against a sample; one digit, 0 to 8. A sample that is not OK is never fed to an estimator."""

    OK = 0
    HARD_SATURATED = 1
    SOFT_SATURATED = 2
    EXCITATION = 4  # the converter's EXCERR: excitation shorted or overloaded
    LOST = 8  # a channel has no value; stands alone


class Sample(NamedTuple):
    """One reading of each channel.

    Attributes
    ----------
    seq : int
        Counted by the source from 0; a gap is samples lost before they were read.
    t_hard_ns, t_soft_ns : int
        Middle of each channel's conversion, ns since the source was opened.
    hard_raw, soft_raw : int
        24-bit codes; -1 where there is none (a lost conversion, or a source that has no codes).
    hard, soft : float
        Capacitances, pF, baseline included; nan where lost.
    status : int
        See `Status`.
    """

    seq: int
    t_hard_ns: int
    t_soft_ns: int
    hard_raw: int
    soft_raw: int
    hard: float
    soft: float
    status: int = 0


Block = NDArray[np.void]
"""Samples, shape (n,), of `DTYPE`."""
DTYPE = SampleRing(2).dtype
"""The fields of `Sample`, in its order."""
REFUSED = Status.EXCITATION | Status.LOST
SATURATED = Status.HARD_SATURATED | Status.SOFT_SATURATED


def block_of(samples: Iterable[Sample]) -> Block:
    """Return samples as an array.

    Examples
    --------
    >>> block_of([Sample(7, 0, 13_000_000, -1, -1, 1.5, 2.5)])["soft"]
    array([2.5])
    """
    rows = [tuple(sample) for sample in samples]
    block = np.zeros(len(rows), DTYPE)
    block[:] = rows
    return block


def samples_of(block: Block) -> list[Sample]:
    """Return an array as samples.

    Examples
    --------
    >>> sample = Sample(7, 0, 13_000_000, -1, -1, 1.5, 2.5, 0)
    >>> samples_of(block_of([sample])) == [sample]
    True
    """
    return [Sample(*row) for row in block.tolist()]


def refused(block: Block) -> NDArray[np.bool_]:
    """Tell which samples have no value that may be estimated from: not converted, or not converted well."""
    known = np.isfinite(block["hard"]) & np.isfinite(block["soft"])
    return np.asarray(((block["status"] & int(REFUSED)) != 0) | ~known)


def saturated(block: Block) -> NDArray[np.bool_]:
    """Tell which samples left the converter's range in a channel."""
    return np.asarray((block["status"] & int(SATURATED)) != 0)


def usable(block: Block, full_scale_pF: float = math.inf) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what a tracker may see of the hard and the soft channel.

    Parameters
    ----------
    block : numpy.ndarray of `DTYPE`, shape (n,)
    full_scale_pF : float
        The tracker's: it knows a reading of this size as saturated.

    Returns
    -------
    (numpy.ndarray, numpy.ndarray), shape (n,), pF
        nan where the status forbids a value, and where it says saturated and the tracker would not see it.

    Examples
    --------
    >>> usable(block_of([Sample(0, 0, 0, -1, -1, 1.5, 2.5, Status.EXCITATION)]))
    (array([nan]), array([nan]))
    """
    hard, soft = block["hard"], block["soft"]
    unseen = ~((np.abs(hard) >= full_scale_pF) | (np.abs(soft) >= full_scale_pF))
    forbidden = ((block["status"] & int(REFUSED)) != 0) | (saturated(block) & unseen)
    return np.where(forbidden, math.nan, hard), np.where(forbidden, math.nan, soft)


def feed(tracker: Tracker, block: Block) -> NDArray[Any]:
    """Send a block through a tracker; return `Tracker.process`'s rows."""
    hard, soft = usable(block, tracker.settings["full_scale"])
    return tracker.process(block["t_hard_ns"], block["t_soft_ns"], hard, soft)
