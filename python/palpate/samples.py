"""Samples (readings of both channels), arrays of samples, and their way to a tracker.

Sources, recordings and the ring use the same samples. A live measurement and its replay send them
to the tracker in the same way, so the results have the same bits.
"""

import math
from collections.abc import Collection, Iterable, Mapping
from enum import IntFlag
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate._core import SampleRing, Tracker

if TYPE_CHECKING:
    from palpate._core import _AnySettings, _Scene


class Status(IntFlag):
    """Quality of a sample, as a sum of flags. Only a sample with status OK reaches an estimator.

    Attributes
    ----------
    OK
        0: both readings are valid.
    HARD_SATURATED, SOFT_SATURATED
        1, 2: the channel is at an end of the converter's range.
    EXCITATION
        4: bit EXCERR of the converter: excitation shorted or overloaded.
    LOST
        8: a channel has no value; the other one may have a value. Never with another flag.

    Examples
    --------
    >>> Status(3) == Status.HARD_SATURATED | Status.SOFT_SATURATED
    True
    """

    OK = 0
    HARD_SATURATED = 1
    SOFT_SATURATED = 2
    EXCITATION = 4
    LOST = 8


class Sample(NamedTuple):
    """One reading of each channel.

    Attributes
    ----------
    seq : int
        Number from the source, from 0; a gap means samples that were lost before they were read.
    t_hard_ns, t_soft_ns : int
        Middle of the conversion of each channel, ns since the source was opened.
    hard_raw, soft_raw : int
        Codes of the converter, 0 to 2**31 - 1; -1: no code (lost conversion, or a source without
        codes). Their scale is in the description of the source, `palpate.sources.Codes`; by default
        they are the 24 bits of the AD7746.
    hard, soft : float
        Capacitances, pF, with the baseline; nan if lost.
    status : int
        See `Status`.
    t_uncertainty_us : int
        Largest possible error of the difference of the two times, us, rounded up; -1: unknown.

    Examples
    --------
    >>> Sample(0, 0, 13_000_000, -1, -1, 1.5, 2.5).status == Status.OK
    True
    """

    seq: int
    t_hard_ns: int
    t_soft_ns: int
    hard_raw: int
    soft_raw: int
    hard: float
    soft: float
    status: int = 0
    t_uncertainty_us: int = -1


Block = NDArray[np.void]
"""Array of samples, shape (n,), with dtype `DTYPE`."""
Columns = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]
"""Times, ns, and readings, pF, of both channels, hard and soft; each of shape (n,)."""
DTYPE = SampleRing(2).dtype
"""numpy dtype with the fields of `Sample`, in the same order."""
SHORTEST_PAIR_S = 1 / 120
FEWEST_BASELINE, MOST_BASELINE = 5, 32  # pairs of the first baseline, which takes a second
PAIR_S = 0.025
_MEMORY = 64  # pairs
REFUSED = Status.EXCITATION | Status.LOST
RETAKEN = (
    "something was touched while the baseline was measured, or for half a minute, or it jumped; "
    "touches since then may be lost; it is measured again"
)
"""Message when `Tracker.retaken` rises."""
SATURATED = Status.HARD_SATURATED | Status.SOFT_SATURATED
UNTIMED_NS = 26_000_000
"""Time between pairs without known times, ns: an AD7746 needs it with conversions of 11 ms."""
_new_tuple = tuple.__new__  # as Sample._make, in a third of its time
_IN_PF = ("drift", "threshold", "initial_covariance", "max_covariance")


def block_of(samples: Iterable[Sample]) -> Block:
    """Convert samples to an array."""
    row = SampleRing(2).row
    rows = [row(sample) for sample in samples]
    block = np.zeros(len(rows), DTYPE)
    block[:] = rows
    return block


def blank(count: int) -> Block:
    """Return samples numbered from 0, without codes and with unknown uncertainty.

    Times, capacitances and status are 0.
    """
    block = np.zeros(count, DTYPE)
    block["seq"] = np.arange(count)
    for name in ("hard_raw", "soft_raw", "t_uncertainty_us"):
        block[name] = -1
    return block


def samples_of(block: Block) -> list[Sample]:
    """Convert an array to samples."""
    return [_new_tuple(Sample, row) for row in block.tolist()]


def refused_samples(block: Block) -> NDArray[np.bool_]:
    """Return which samples have no valid value: lost, excitation error, not finite; shape (n,)."""
    finite = np.isfinite(block["hard"]) & np.isfinite(block["soft"])
    return np.asarray(_has_status(block, REFUSED) | ~finite)


def saturated_samples(block: Block) -> NDArray[np.bool_]:
    """Return which samples are saturated in a channel; bool, shape (n,)."""
    return _has_status(block, SATURATED)


def usable_readings(
    block: Block, full_scale_pF: float = math.inf
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the readings of the hard and the soft channel, pF; nan: a tracker may not use it.

    nan replaces both readings at an excitation error, and saturated ones that the tracker would not
    recognise by its full scale. In a lost sample, a channel with a value keeps it.
    """
    hard = block["hard"]
    soft = block["soft"]
    recognised = (np.abs(hard) >= full_scale_pF) | (np.abs(soft) >= full_scale_pF)
    unrecognised = _has_status(block, SATURATED) & ~recognised
    forbidden = _has_status(block, Status.EXCITATION) | unrecognised
    return np.where(forbidden, math.nan, hard), np.where(forbidden, math.nan, soft)


def feed(tracker: Tracker, block: Block) -> NDArray[Any]:
    """Send samples to a tracker and return the rows of `Tracker.process`."""
    return tracker.process(*columns_for(tracker, block))


def columns_for(tracker: Tracker, block: Block) -> Columns:
    """Return the arguments of `Tracker.process`: times, ns, and readings as `usable_readings`."""
    hard = block["hard"]
    soft = block["soft"]
    if block["status"].any():
        hard, soft = usable_readings(block, tracker.settings["full_scale"])
    return block["t_hard_ns"], block["t_soft_ns"], hard, soft


class Instrument(NamedTuple):
    """The properties of an instrument, or of a recording, that a tracker uses.

    Attributes
    ----------
    full_scale_pF : float
        Readings of this magnitude are saturated, pF; inf: unknown.
    period_s : float
        Time from pair to pair, s; 0: unknown.
    host_stamps : bool
        Whether the computer stamps the samples when they arrive.
    unit : str
        Unit of both signals.

    Examples
    --------
    >>> Instrument.of({"period_s": 0.026, "stamps": "host"})
    Instrument(full_scale_pF=inf, period_s=0.026, host_stamps=True, unit='pF')
    """

    full_scale_pF: float = math.inf
    period_s: float = 0.0
    host_stamps: bool = False
    unit: str = "pF"

    @classmethod
    def of(cls, device: Mapping[str, Any]) -> "Instrument":
        """Return the properties in a description, as from `Source.describe`."""
        return cls(
            float(device.get("full_scale_pF", math.inf)),
            float(device.get("period_s", 0.0)),
            device.get("stamps") == "host",
            str(device.get("unit", "pF")),
        )


def settings_for(scene: "_Scene", instrument: Instrument) -> "_AnySettings":
    """Return the settings of a tracker that follow from the instrument."""
    settings: _AnySettings = {"full_scale": instrument.full_scale_pF}
    if "host_stamps" in Tracker(scene).settings:
        settings["host_stamps"] = instrument.host_stamps
        settings["period"] = instrument.period_s
    return settings


def require_scale(scene: "_Scene", unit: str, names: Collection[str]) -> None:
    """Check that signals in another unit than pF have names of all settings that are in pF.

    The scenes handheld and sliding have no such setting.
    """
    known = Tracker(scene).settings
    if unit == "pF" or "clip" in known:
        return
    missing = [name for name in _IN_PF if name in known and name not in names]
    if missing:
        raise ValueError(
            f"{', '.join(missing)}: got none for signals in {unit}, allowed: numbers; "
            "handheld needs none"
        )


def _has_status(block: Block, flags: Status) -> NDArray[np.bool_]:
    """Return which samples have any of these flags; bool, shape (n,)."""
    return np.asarray((block["status"] & int(flags)) != 0)


def memory_s(period_s: float) -> float:
    """Return the longest time without samples over which a baseline is valid, s.

    Its level is a mean over 64 pairs. Over as many pairs, a drift too small to be seen in them
    moves the signal by 0.7 of its noise at most, which is no contact; over more it may be one.

    Parameters
    ----------
    period_s : float
        As in `pair_of`.
    """
    return _MEMORY * pair_of(period_s)


def pair_of(period_s: float) -> float:
    """Return the time from pair to pair in a tracker, s: it takes means of a fast converter.

    Parameters
    ----------
    period_s : float
        Time from pair to pair of the converter, s; 0: unknown.
    """
    return period_s if period_s > SHORTEST_PAIR_S else PAIR_S


def baseline_pairs(pair_s: float) -> int:
    """Return how many pairs a first baseline takes: those of a second, 5 to 32.

    Parameters
    ----------
    pair_s : float
        Time from pair to pair in a tracker, s; 0: unknown.
    """
    if not pair_s > 1 / MOST_BASELINE:
        return MOST_BASELINE
    return max(math.ceil(1 / pair_s), FEWEST_BASELINE)
