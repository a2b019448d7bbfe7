"""Design of a CUSUM from the interval between false alarms and the smallest shift."""

from dataclasses import dataclass

from palpate._core import cusum as _cusum
from palpate._core import run_length as _run_length


@dataclass(frozen=True)
class Cusum:
    """Design of a two-sided CUSUM for standardised, uncorrelated innovations.

    Attributes
    ----------
    drift : float, standard deviations
        Subtracted from each innovation.
    threshold : float, standard deviations
        Limit of the sum, above which there is an alarm.
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

    `palpate.HandoverRls` and `palpate.VectorRls` take the interval and the shift themselves.

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
    return Cusum(*_cusum(false_alarm_interval, smallest_shift, clip))


def run_length(drift: float, threshold: float, *, shift: float = 0.0, clip: float = 3.0) -> float:
    """Return the mean number of samples from 0 to the alarm of a one-sided CUSUM.

    Parameters
    ----------
    drift, threshold, clip : float, standard deviations, above 0
        As in `Cusum` and `cusum`; the threshold is at most 1000.
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
    around 0. The mean run length is the mean length of the excursions from the first state, over the
    probability that one of them ends in the alarm (Page 1954).
    """
    return _run_length(drift, threshold, shift, clip)
