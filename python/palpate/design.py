"""Design of the CUSUM from what a user can say: how rare false alarms, how small a shift."""

from dataclasses import dataclass
from math import erfc, exp, sqrt

import numpy as np

STATES = 400  # of the Markov chain, at least, and 10 a unit of the threshold
_CLIPS = (1.0, 100.0)  # below, little but the sign of an innovation is left; above, HandoverRls has none
_LARGEST_THRESHOLD = 128.0
_LONGEST = 1e15  # samples; beyond it the chain's equations are singular in double


@dataclass(frozen=True)
class Cusum:
    """A two-sided CUSUM on standardised, uncorrelated innovations.

    Attributes
    ----------
    drift, threshold : float, standard deviations
        As in `palpate.HandoverRls`.
    false_alarm_interval : float, samples
        Mean time between false alarms.
    delay : float, samples
        Mean time to the alarm after the shift that it was designed for.
    """

    drift: float
    threshold: float
    false_alarm_interval: float
    delay: float


def cusum(*, false_alarm_interval: float, smallest_shift: float, clip: float = 3.0) -> Cusum:
    """Choose drift and threshold.

    Parameters
    ----------
    false_alarm_interval : float, samples, 10 to 1e12
        Wanted mean time between false alarms.
    smallest_shift : float, standard deviations, in (0, 1.5 * clip]
        Smallest shift of the innovation that matters; the drift is half of it (Lorden 1971).
    clip : float, standard deviations, in [1, 100]
        As in `palpate.HandoverRls`.

    Returns
    -------
    Cusum

    Raises
    ------
    ValueError
        An argument out of its range, or a shift so small that a threshold of 128 has more false alarms than wanted.

    Notes
    -----
    Run lengths by the Markov chain of Brook and Evans (Biometrika 59, 1972); the threshold by bisection.
    `HandoverRls` whitens its innovations, so the design holds for correlated ones, too.

    Examples
    --------
    >>> design = cusum(false_alarm_interval=1e5, smallest_shift=1.5)
    >>> design.drift, round(design.threshold, 2), round(design.delay, 1)
    (0.75, 6.91, 10.3)
    """
    if not 10 <= false_alarm_interval <= 1e12:
        raise ValueError(f"false_alarm_interval: got {false_alarm_interval}, allowed: 10 to 1e12 samples")
    if not _CLIPS[0] <= clip <= _CLIPS[1]:
        raise ValueError(f"clip: got {clip}, allowed: {_CLIPS[0]:g} to {_CLIPS[1]:g}")
    if not 0 < smallest_shift <= 1.5 * clip:
        raise ValueError(
            f"smallest_shift: got {smallest_shift}, allowed: 0 < smallest_shift <= 1.5 clip ({1.5 * clip})"
        )
    drift = smallest_shift / 2
    low, high = 0.0, 1.0
    while run_length(drift, high, clip=clip) < 2 * false_alarm_interval:
        low, high = high, 2 * high
        if high > _LARGEST_THRESHOLD:
            allowed = f"one whose threshold is below {_LARGEST_THRESHOLD:g} at a false alarm in {false_alarm_interval:g} samples"
            raise ValueError(f"smallest_shift: got {smallest_shift}, allowed: {allowed}")
    for _ in range(50):
        middle = (low + high) / 2
        # Two sides: alarms twice as often as from one.
        if run_length(drift, middle, clip=clip) < 2 * false_alarm_interval:
            low = middle
        else:
            high = middle
    interval = run_length(drift, high, clip=clip) / 2
    return Cusum(drift, high, interval, run_length(drift, high, shift=smallest_shift, clip=clip))


def run_length(drift: float, threshold: float, *, shift: float = 0.0, clip: float = 3.0) -> float:
    """Mean number of samples from 0 to the alarm of a one-sided CUSUM.

    Parameters
    ----------
    drift, threshold, clip : float, standard deviations
    shift : float, standard deviations
        Mean of the innovations.

    Returns
    -------
    float
        Mean run length, to 2 % at a clip of 3; inf above 1e15, as where no alarm can be reached.

    Notes
    -----
    The statistic's range is cut into states of equal width, the first half as wide and around 0; a mean
    run length mu solves (I - Q) mu = 1, with Q the probabilities of a step from state to state.
    """
    if clip - drift <= 0:
        return float("inf")
    states = max(STATES, int(10 * threshold))
    width = threshold / (states - 0.5)
    # P(step <= distance from a state's centre to another's upper edge), step = clipped z - drift; it depends on the
    # number of states between the two only.
    between = np.arange(-states, states)
    below = np.array([_clipped_cdf((n + 0.5) * width + drift, shift, clip) for n in between])
    upper = below[states + np.subtract.outer(np.arange(states), np.arange(states)).T]
    matrix = np.diff(upper, axis=1, prepend=0.0)
    try:
        length = float(np.linalg.solve(np.eye(states) - matrix, np.ones(states))[0])
    except np.linalg.LinAlgError:
        return float("inf")
    return length if 0 < length < _LONGEST else float("inf")


def siegmund(drift: float, threshold: float) -> float:
    """Return Siegmund's approximation of `run_length` without a shift and without clipping (1985, eq. 2.57).

    Examples
    --------
    >>> round(siegmund(0.5, 5.0))
    938
    """
    b = threshold + 1.166
    return (exp(2 * drift * b) - 2 * drift * b - 1) / (2 * drift**2)


def _clipped_cdf(z: float, mean: float, clip: float) -> float:
    if z >= clip:
        return 1.0
    return 0.0 if z < -clip else 0.5 * erfc((mean - z) / sqrt(2))
