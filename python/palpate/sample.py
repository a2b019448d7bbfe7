"""One reading of both channels, as sources give it, recordings keep it and the ring carries it."""

from enum import IntFlag
from typing import NamedTuple


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
