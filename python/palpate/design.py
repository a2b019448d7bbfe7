"""Design of the CUSUM from what a user can say: how rare false alarms, how small a shift."""

from collections.abc import Callable
from dataclasses import dataclass
from math import erfc, exp, isinf, log, sqrt

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

STATES = 400  # of the Markov chain, at least, and 10 a unit of the threshold
_CLIPS = (1.0, 100.0)  # below, little but the sign of an innovation is left; above, HandoverRls has none
_THRESHOLDS = (1e-3, 128.0)
_LONGEST = 1e15  # samples; beyond it the chain's equations are singular in double
_COARSE = 4  # so many times fewer states, solved in a fiftieth of the time, tell where to look
_APART = 1.005  # factor between two thresholds that enclose the wanted one, as a rule, around the place they tell
_NEAR = 5e-4  # relative, of a run length that counts as the wanted one
_CELL = 1e-3  # relative, of a threshold; less than a state's width: where the run length jumps, it is known no better


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
    Run lengths by the Markov chain of Brook and Evans (Biometrika 59, 1972); the threshold by regula falsi and bisection:
    the run length is the wanted one to 0.05 %, or, where clipping makes it jump, the threshold is above the jump by at
    most 0.1 %.
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
    wanted = 2 * false_alarm_interval  # of a side: the two alarm twice as often as one

    def excess(states: int) -> Callable[[float], float]:
        return lambda threshold: log(_solved(drift, threshold, 0.0, clip, states) / wanted)

    guess, _ = _search(excess(STATES // _COARSE), 4.0, 2.0)
    threshold, reached = _search(excess(STATES), guess, _APART)
    if reached < -_NEAR:
        allowed = (
            f"one whose threshold is below {_THRESHOLDS[1]:g} at a false alarm in {false_alarm_interval:g} samples"
        )
        raise ValueError(f"smallest_shift: got {smallest_shift}, allowed: {allowed}")
    delay = run_length(drift, threshold, shift=smallest_shift, clip=clip)
    return Cusum(drift, threshold, false_alarm_interval * exp(reached), delay)


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
    return _solved(drift, threshold, shift, clip, STATES)


def siegmund(drift: float, threshold: float) -> float:
    """Return Siegmund's approximation of `run_length` without a shift and without clipping (1985, eq. 2.57).

    Examples
    --------
    >>> round(siegmund(0.5, 5.0))
    938
    """
    b = threshold + 1.166
    return (exp(2 * drift * b) - 2 * drift * b - 1) / (2 * drift**2)


_Point = tuple[float, float]
"""A threshold, and the logarithm of its run length over the wanted one."""


def _search(excess: Callable[[float], float], guess: float, factor: float) -> _Point:
    """Return the smallest threshold that does not fall short, looked for from a guess in steps of a factor."""
    least, most = _THRESHOLDS
    low = high = (guess, excess(guess))
    while high[1] < 0 and high[0] < most:
        low, high = high, _at(excess, min(high[0] * factor, most))
        factor *= factor
    while low[1] >= 0 and low[0] > least:
        low, high = _at(excess, max(low[0] / factor, least)), low
        factor *= factor
    return _narrowed(excess, low, high) if low[1] < 0 <= high[1] else high


def _narrowed(excess: Callable[[float], float], low: _Point, high: _Point) -> _Point:
    """Regula falsi and bisection in turn: the one is fast where the run length is smooth, the other where it jumps."""
    bisect = False
    while high[1] > _NEAR and high[0] - low[0] > _CELL * high[0]:
        share = 0.5 if bisect or isinf(high[1]) else low[1] / (low[1] - high[1])
        new = _at(excess, low[0] + share * (high[0] - low[0]))
        if abs(new[1]) <= _NEAR:
            return new
        low, high = (new, high) if new[1] < 0 else (low, new)
        bisect = not bisect
    return high


def _at(excess: Callable[[float], float], threshold: float) -> _Point:
    return threshold, excess(threshold)


def _solved(drift: float, threshold: float, shift: float, clip: float, least: int) -> float:
    """Return `run_length` by a chain of `least` states or more."""
    if clip - drift <= 0:
        return float("inf")
    states = max(least, int(10 * threshold * least / STATES))
    width = threshold / (states - 0.5)
    # P(step <= distance from a state's centre to another's upper edge), step = clipped z - drift; it depends on the
    # number of states between the two only: each row of the matrix is the one above it, moved by one.
    below = np.array([_clipped_cdf((n + 0.5) * width + drift, shift, clip) for n in range(-states, states)])
    matrix = -sliding_window_view(np.diff(below), states)[::-1]
    matrix[:, 0] = -below[states:0:-1]
    matrix.flat[:: states + 1] += 1
    try:
        length = float(np.linalg.solve(matrix, np.ones(states))[0])
    except np.linalg.LinAlgError:
        return float("inf")
    return length if 0 < length < _LONGEST else float("inf")


def _clipped_cdf(z: float, mean: float, clip: float) -> float:
    if z >= clip:
        return 1.0
    return 0.0 if z < -clip else 0.5 * erfc((mean - z) / sqrt(2))
