"""The noise of both channels without contact: rms, spectrum, and what its peaks are."""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from palpate.live.feed import Document, Flag, Rows
from palpate.live.signal_state import CHANNELS

Array = NDArray[np.float64]
MAINS_HZ = (50.0, 60.0)
HARMONICS = 3
TREMOR_HZ = (4.0, 12.0)
FEWEST = 64  # samples without contact, one after the other, at least
_SEGMENT, _SEGMENTS = 512, 16
_EDGE_S = 0.25  # beside a touch: the contact is found a little late
_PER_PF = 1e6  # aF
_ABOVE = 4.0  # a peak: times the median of the amplitude
_PEAKS = 4


def noise_of(rows: Rows) -> Document:
    """Return the noise of the newest samples without contact, as the message to a page; rows: every sample, in order."""
    segments = idle(rows)
    if not len(segments):
        text = f"Noise: wait for {FEWEST} samples without contact, one after the other."
        values: Document = {"hard_aF": None, "soft_aF": None, "hz": [], "hard": [], "soft": [], "peaks": []}
        return {"seconds": 0.0, **values, "text": text}
    rate = 1 / float(np.median(np.diff(segments["t_s"], axis=1)))
    spectra: dict[str, Array] = {}
    rms: dict[str, float] = {}
    for name in CHANNELS:
        level = _detrended(segments[name] * _PER_PF)
        rms[name] = math.sqrt(float(np.mean(level**2)) * level.shape[1] / (level.shape[1] - 2))
        hz, spectra[name] = spectrum(level, rate)
    peaks = [peak for name in CHANNELS for peak in peaks_of(name, hz, spectra[name], rate)]
    seconds = segments.size / rate
    values = {f"{name}_aF": rms[name] for name in CHANNELS} | {name: spectra[name].tolist() for name in CHANNELS}
    return {"seconds": seconds, **values, "hz": hz.tolist(), "peaks": peaks, "text": _said(seconds, rms, peaks, rate)}


def idle(rows: Rows) -> Rows:
    """Return the newest samples without contact in segments of one length, one after the other in time; shape (k, n)."""
    other = int(Flag.CONTACT | Flag.MEASURED | Flag.REFUSED | Flag.SATURATED)
    usable = (rows["flags"] & other == 0) & np.isfinite(rows["hard"]) & np.isfinite(rows["soft"])
    steps = np.diff(rows["t_s"])
    period_s = float(np.median(steps)) if len(steps) else 0.0
    follows = usable[1:] & usable[:-1] & (np.abs(steps - period_s) < 0.5 * period_s)
    cuts = np.flatnonzero(np.concatenate(([True], ~follows, [True]))).tolist() if len(rows) else []
    edge = math.ceil(_EDGE_S / period_s) if period_s > 0 else 0
    known = [(begin, end) for begin, end in pairwise(cuts) if usable[begin]]
    runs = [(begin + edge * (begin > 0), end - edge * (end < len(rows))) for begin, end in known]
    longest = max((end - begin for begin, end in runs), default=0)
    if longest < FEWEST:
        return rows[:0].reshape(0, 0)
    size = min(1 << (longest.bit_length() - 1), _SEGMENT)
    begins = [at for begin, end in runs for at in range(begin + (end - begin) % size, end - size + 1, size)]
    return np.stack([rows[at : at + size] for at in begins[-_SEGMENTS:]])


def spectrum(level: Array, rate: float) -> tuple[Array, Array]:
    """Return frequencies, Hz, and amplitude, aF/sqrt(Hz), of segments without trend, aF: Hann window (Welch, 1967)."""
    window = np.hanning(level.shape[1] + 1)[:-1]
    power = np.mean(np.abs(np.fft.rfft(level * window)) ** 2, axis=0) * 2 / (rate * float(window @ window))
    hz = np.fft.rfftfreq(level.shape[1], 1 / rate)
    return np.asarray(hz[1:], np.float64), np.sqrt(power[1:])


def peaks_of(channel: str, hz: Array, amplitude: Array, rate: float) -> list[Document]:
    """Return the highest peaks of a spectrum, the highest first: where, channel, rms, and what it is; "": unknown."""
    step, inner = float(hz[0]), amplitude[1:-1]
    high = inner > _ABOVE * float(np.median(amplitude))
    tops = 1 + np.flatnonzero((inner >= amplitude[:-2]) & (inner > amplitude[2:]) & high)
    tops = tops[np.argsort(-amplitude[tops])][:_PEAKS]
    found = []
    for top in tops.tolist():
        power = float(np.sum(amplitude[max(top - 2, 0) : top + 3] ** 2)) * step  # a line fills three bins of the window
        at = float(hz[top])
        found.append({"hz": at, "channel": channel, "aF": math.sqrt(power), "name": name_of(at, 1.5 * step, rate)})
    return found


def name_of(hz: float, near_hz: float, rate: float) -> str:
    """Return what a peak at this frequency is, as far as its frequency says it.

    Examples
    --------
    >>> name_of(11.4, 0.2, 38.5), name_of(6.0, 0.2, 38.5), name_of(15.0, 0.2, 38.5)
    ('mains, 50 Hz', 'tremor of a hand', '')
    """
    for order in range(1, HARMONICS + 1):
        for mains_hz in MAINS_HZ:
            if abs(alias(order * mains_hz, rate) - hz) <= near_hz:
                return f"mains, {order * mains_hz:g} Hz"
    return "tremor of a hand" if TREMOR_HZ[0] <= hz <= TREMOR_HZ[1] else ""


def alias(hz: float, rate: float) -> float:
    """Return the frequency at which one appears in samples of this rate.

    Examples
    --------
    >>> alias(50.0, 38.5), alias(50.0, 1000.0)
    (11.5, 50.0)
    """
    return abs(hz - rate * round(hz / rate))


def _detrended(level: Array) -> Array:
    """Return segments without mean and slope."""
    at = np.arange(level.shape[1]) - (level.shape[1] - 1) / 2
    level = level - level.mean(axis=1, keepdims=True)
    return np.asarray(level - (level @ at)[:, None] * at / (at @ at))


def _said(seconds: float, rms: dict[str, float], peaks: list[Document], rate: float) -> str:
    where = " and ".join(f"{hz:g} Hz at {alias(hz, rate):.1f} Hz" for hz in MAINS_HZ)
    shown = [f"{p['name'] or 'a peak'} at {p['hz']:.1f} Hz ({p['channel']}, {p['aF']:.2g} aF)" for p in peaks]
    told = "; ".join(shown) or "no peak stands out"
    return (
        f"Without contact, {seconds:.0f} s: hard {rms['hard']:.2g} aF rms, soft {rms['soft']:.2g} aF rms; {told}. "
        f"At {rate:.1f} pairs a second the mains appear: {where}."
    )
