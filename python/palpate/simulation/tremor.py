"""Hand tremor: random with a known spectrum, or from a record of an accelerometer."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Tremor:
    """Hand tremor as a function of time: sines with frequencies around two peaks between 3 and 12 Hz.

    Frequencies of physiological tremor: 8-12 Hz neurogenic, 3-5 Hz of the loaded wrist (Elble and Koller, Tremor,
    1990).

    Parameters
    ----------
    rms : float
        Relative to the force of the press.
    record : (time s, value), optional
        A measured record, repeated and scaled to `rms`, instead of the sines.
    random : numpy.random.Generator
        For frequencies, phases and amplitudes.
    """

    def __init__(self, rms: float, record: tuple[ArrayLike, ArrayLike] | None, random: np.random.Generator) -> None:
        self._rms = rms
        self._record = record
        peaks = np.repeat([random.uniform(3.5, 5.0), random.uniform(7.0, 10.0)], 12)
        self._frequencies = np.clip(peaks + random.normal(0.0, 0.8, 24), 3.0, 12.0)
        self._phases = random.uniform(0, 2 * np.pi, 24)
        amplitudes = random.rayleigh(1.0, 24) * np.repeat([0.6, 1.0], 12)
        self._amplitudes = amplitudes / np.sqrt((amplitudes**2).sum() / 2)

    def __call__(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the tremor at times t, s."""
        if self._rms == 0:
            return np.zeros_like(t)
        if self._record is not None:
            times, values = (np.asarray(a, float) for a in self._record)
            values = values - values.mean()
            span = times[-1] - times[0]
            return np.asarray(self._rms / values.std() * np.interp(times[0] + np.mod(t, span), times, values))
        total = np.zeros_like(t)
        for amplitude, frequency, phase in zip(self._amplitudes, self._frequencies, self._phases, strict=True):
            total += amplitude * np.sin(2 * np.pi * frequency * t + phase)
        return self._rms * total
