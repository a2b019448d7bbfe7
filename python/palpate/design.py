"""Design of a CUSUM from the interval between false alarms and the smallest shift."""

from collections.abc import Callable
from dataclasses import dataclass
from math import erfc, exp, inf, log, sqrt

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

STATES = 400
"""Least number of states of the Markov chain; also 10 or more for each unit of the threshold."""
_CLIPS = (1.0, 100.0)
# Below 1 mostly the sign of the innovation remains; HandoverRls allows at most 100.
_THRESHOLDS = (1e-3, 128.0)
_LONGEST = 1e15  # samples; above it the equations of the chain are singular in double precision
_NEAR = 5e-4  # tolerance of the run length, relative
_CELL = 5e-5  # tolerance of the threshold, relative, for run lengths that jump


@dataclass(frozen=True)
class Cusum:
    """Design of a two-sided CUSUM for standardised, uncorrelated innovations.

    Attributes
    ----------
    drift, threshold : float, standard deviations
        As in `palpate.HandoverRls`.
    false_alarm_interval : float, samples
        Mean time between false alarms.
    delay : float, samples
        Mean time to the alarm after the smallest shift.

    Examples
    --------
    >>> design = cusum(false_alarm_interval=1e4, smallest_shift=2.0)
    >>> design.drift, design.threshold < 7
    (1.0, True)
    """

    drift: float
    threshold: float
    false_alarm_interval: float
    delay: float


def cusum(*, false_alarm_interval: float, smallest_shift: float, clip: float = 3.0) -> Cusum:
    """Return drift and threshold for a wanted interval between false alarms and a smallest shift.

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
        An argument is out of its range, or the shift is too small: it would need a threshold above
        128.

    Notes
    -----
    Run lengths follow from the Markov chain of Brook and Evans (Biometrika 59, 1972), the threshold
    from bisection. The run length has an error of 0.05 % or less; if it jumps there, because of
    clipping, the threshold is above the jump by 0.1 % or less. `HandoverRls` whitens its
    innovations, so the design is valid for correlated ones, too.

    Examples
    --------
    >>> design = cusum(false_alarm_interval=1e5, smallest_shift=1.5)
    >>> design.drift, round(design.threshold, 2), round(design.delay, 1)
    (0.75, 6.91, 10.3)
    """
    if not 10 <= false_alarm_interval <= 1e12:
        raise ValueError(
            f"false_alarm_interval: got {false_alarm_interval}, allowed: 10 to 1e12 samples"
        )
    if not _CLIPS[0] <= clip <= _CLIPS[1]:
        raise ValueError(f"clip: got {clip}, allowed: {_CLIPS[0]:g} to {_CLIPS[1]:g}")
    if not 0 < smallest_shift <= 1.5 * clip:
        raise ValueError(
            f"smallest_shift: got {smallest_shift}, allowed: 0 < smallest_shift <= "
            f"1.5 clip ({1.5 * clip})"
        )
    drift = smallest_shift / 2
    wanted = 2 * false_alarm_interval  # of one side: two sides alarm twice as often as one

    def excess(threshold: float) -> float:
        """Return the logarithm of the run length over the wanted one."""
        return log(run_length(drift, threshold, clip=clip) / wanted)

    threshold, reached = _smallest(excess)
    if reached < -_NEAR:
        raise ValueError(
            f"smallest_shift: got {smallest_shift}, allowed: a larger shift, or a shorter interval "
            f"than {false_alarm_interval:g} samples: threshold below {_THRESHOLDS[1]:g}"
        )
    delay = run_length(drift, threshold, shift=smallest_shift, clip=clip)
    return Cusum(drift, threshold, false_alarm_interval * exp(reached), delay)


def run_length(drift: float, threshold: float, *, shift: float = 0.0, clip: float = 3.0) -> float:
    """Return the mean number of samples from 0 to the alarm of a one-sided CUSUM.

    Parameters
    ----------
    drift, threshold, clip : float, standard deviations, above 0
        As in `palpate.HandoverRls`.
    shift : float, standard deviations
        Mean of the innovations.

    Returns
    -------
    float
        Mean run length, with an error of 2 % or less at a clip of 3; inf above 1e15, or if no alarm
        is possible.

    Examples
    --------
    >>> round(run_length(0.5, 5.0, shift=1.0))
    10

    Notes
    -----
    The range of the statistic is divided into states of equal width; the first is half as wide and
    around 0. The mean run lengths mu solve (I - Q) mu = 1, where Q are the probabilities of a step
    from state to state.
    """
    if clip - drift <= 0:
        return inf
    states = max(STATES, int(10 * threshold))
    width = threshold / (states - 0.5)
    # P(step <= distance from the centre of one state to the upper edge of another), where
    # step = clipped z - drift. It depends only on the number of states between them: each row of
    # the matrix is the row above it, shifted by one.
    limits = [(n + 0.5) * width + drift for n in range(-states, states)]
    below = np.array([_clipped_cdf(limit, shift, clip) for limit in limits])
    matrix = -sliding_window_view(np.diff(below), states)[::-1]
    matrix[:, 0] = -below[states:0:-1]
    matrix.flat[:: states + 1] += 1
    try:
        length = float(np.linalg.solve(matrix, np.ones(states))[0])
    except np.linalg.LinAlgError:
        return inf
    return length if 0 < length < _LONGEST else inf


def _smallest(excess: Callable[[float], float]) -> tuple[float, float]:
    """Return the smallest threshold with a run length that is long enough, and its excess."""
    low, limit = _THRESHOLDS
    high = 1.0
    reached = excess(high)
    while reached < 0 and high < limit:
        low = high
        high = 2 * high
        reached = excess(high)
    while reached > _NEAR and high - low > _CELL * high:
        middle = sqrt(low * high)
        at_middle = excess(middle)
        if at_middle < 0:
            low = middle
        else:
            high = middle
            reached = at_middle
    return high, reached


def _clipped_cdf(z: float, mean: float, clip: float) -> float:
    """Return the probability that a clipped normal variable with this mean is at most z."""
    if z >= clip:
        return 1.0
    if z < -clip:
        return 0.0
    return 0.5 * erfc((mean - z) / sqrt(2))
