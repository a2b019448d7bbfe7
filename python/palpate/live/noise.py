"""The noise of both channels without contact, in words: rms, and what stands out of it."""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palpate import number_format
from palpate.live.channel_status import CHANNELS
from palpate.live.page_frames import RowFlag, Rows

Array = NDArray[np.float64]
MAINS_HZ = (50.0, 60.0)
HARMONICS = 3
TREMOR_HZ = (4.0, 12.0)
FEWEST = 64  # samples without contact, one after the other, at least
_SEGMENT = 512  # samples
_SEGMENTS = 16
_EDGE_S = 0.25  # beside a touch: the contact is found a little late
_PER_PF = 1e6  # aF
_ABOVE = 4.0  # a peak: times the median of the spectrum


def noise_of(rows: Rows) -> str:
    """Return the noise of the newest samples without contact in words; rows: every sample, in order."""
    segments = idle_segments(rows)
    if not len(segments):
        return f"Noise: wait for {FEWEST} samples without contact, one after the other."
    rate = 1 / float(np.median(np.diff(segments["t_s"], axis=1)))
    texts = []
    for name in CHANNELS:
        level = _detrended(segments[name] * _PER_PF)
        rms = math.sqrt(float(np.mean(level**2)) * level.shape[1] / (level.shape[1] - 2))
        texts.append(f"{name} {number_format.error(rms)} aF rms{_known_peak(level, rate)}")
    return f"Noise without contact, {segments.size / rate:.0f} s: {', '.join(texts)}."


def idle_segments(rows: Rows) -> Rows:
    """Return the newest samples without contact in segments of one length, one after the other in time; shape (k, n)."""
    other = int(RowFlag.CONTACT | RowFlag.MEASURED | RowFlag.REFUSED | RowFlag.SATURATED)
    usable = (rows["flags"] & other == 0) & np.isfinite(rows["hard"]) & np.isfinite(rows["soft"])
    steps_s = np.diff(rows["t_s"])
    if not len(steps_s):
        return rows[:0].reshape(0, 0)
    period_s = float(np.median(steps_s))
    follows = usable[1:] & usable[:-1] & (np.abs(steps_s - period_s) < 0.5 * period_s)
    edge = 0
    if period_s > 0:
        edge = math.ceil(_EDGE_S / period_s)
    runs = _runs(usable, follows, edge)
    longest = max((end - begin for begin, end in runs), default=0)
    if longest < FEWEST:
        return rows[:0].reshape(0, 0)
    size = min(1 << (longest.bit_length() - 1), _SEGMENT)
    segments = []
    for begin, end in runs:
        first = begin + (end - begin) % size
        for at in range(first, end - size + 1, size):
            segments.append(rows[at : at + size])
    return np.stack(segments[-_SEGMENTS:])


def _runs(
    usable: NDArray[np.bool_], follows: NDArray[np.bool_], edge: int
) -> list[tuple[int, int]]:
    """Return begin and end of the usable samples that follow each other, without the edges beside a touch."""
    is_cut = np.concatenate(([True], ~follows, [True]))
    runs = []
    for begin, end in pairwise(np.flatnonzero(is_cut).tolist()):
        if not usable[begin]:
            continue
        if begin > 0:
            begin += edge
        if end < len(usable):
            end -= edge
        runs.append((begin, end))
    return runs


def name_of(hz: float, near_hz: float, rate: float) -> str:
    """Return what a peak at this frequency is, as far as its frequency says it.

    Examples
    --------
    >>> name_of(11.4, 0.2, 38.5), name_of(6.0, 0.2, 38.5), name_of(15.0, 0.2, 38.5)
    ('50 Hz mains', 'tremor of a hand', '')
    """
    for order in range(1, HARMONICS + 1):
        for mains_hz in MAINS_HZ:
            if abs(alias(order * mains_hz, rate) - hz) <= near_hz:
                return f"{order * mains_hz:g} Hz mains"
    return "tremor of a hand" if TREMOR_HZ[0] <= hz <= TREMOR_HZ[1] else ""


def alias(hz: float, rate: float) -> float:
    """Return the frequency at which one appears in samples of this rate.

    Examples
    --------
    >>> alias(50.0, 38.5), alias(50.0, 1000.0)
    (11.5, 50.0)
    """
    return abs(hz - rate * round(hz / rate))


def _known_peak(level: Array, rate: float) -> str:
    """Return the strongest peak that has a name, in words; "": none. The spectrum has a Hann window (Welch, 1967)."""
    size = level.shape[1]
    window = np.hanning(size + 1)[:-1]
    power = np.mean(np.abs(np.fft.rfft(level * window)) ** 2, axis=0)
    amplitude = np.sqrt(power)[1:]
    inner = amplitude[1:-1]
    is_high = inner > _ABOVE * float(np.median(amplitude))
    is_top = (inner >= amplitude[:-2]) & (inner > amplitude[2:]) & is_high
    tops = 1 + np.flatnonzero(is_top)
    strongest_first = tops[np.argsort(-amplitude[tops])]
    for hz in ((strongest_first + 1) * rate / size).tolist():
        name = name_of(hz, 1.5 * rate / size, rate)
        if name:
            return f" with {name} at {hz:.1f} Hz"
    return ""


def _detrended(level: Array) -> Array:
    """Return segments without mean and slope."""
    at = np.arange(level.shape[1]) - (level.shape[1] - 1) / 2
    level = level - level.mean(axis=1, keepdims=True)
    return np.asarray(level - (level @ at)[:, None] * at / (at @ at))
