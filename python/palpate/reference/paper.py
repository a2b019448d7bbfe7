"""The equations of the paper in plain numpy: slow, simple, without code of the core.

Eq. (3) with steps 1-4, and the change detection, in the covariance form as printed. Its subtraction loses digits
by cancellation; the compiled core uses the equivalent information form.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Trace(NamedTuple):
    """State of `adaptive_rls` or `rls` after each sample, as arrays of shape (n,).

    Attributes
    ----------
    ratio : numpy.ndarray, shape (n,)
    covariance : numpy.ndarray, shape (n,), 1/pF^2
    innovation : numpy.ndarray, shape (n,), pF
        Output minus its prediction with the ratio before the sample.
    statistic : numpy.ndarray, shape (n,), pF
        CUSUM statistic.
    alarm : numpy.ndarray of bool, shape (n,)

    Examples
    --------
    >>> adaptive_rls([0.5, 0.52], [0.25, 0.26]).alarm
    array([ True,  True])
    """

    ratio: NDArray[Any]
    covariance: NDArray[Any]
    innovation: NDArray[Any]
    statistic: NDArray[Any]
    alarm: NDArray[np.bool_]


def adaptive_rls(
    output: ArrayLike,
    regressor: ArrayLike,
    *,
    steady: float = 0.995,
    alarmed: float = 0.9,
    drift: float = 0.01,
    threshold: float = 0.05,
    clear_level: float = 0.0,
    initial_ratio: float = 1.0,
    initial_covariance: float = 1e12,
    max_covariance: float = 1e12,
    number: Callable[[Any], Any] = np.float64,
) -> Trace:
    """Recursive least squares with a forgetting factor switched by a CUSUM detector.

    Parameters
    ----------
    output, regressor : array_like, shape (n,), pF
        Finite capacitance changes of the hard and the soft channel.
    steady, alarmed, drift, threshold, clear_level : float
        As in `palpate.AdaptiveRls`.
    initial_ratio, initial_covariance, max_covariance : float
        As in `palpate.AdaptiveRls`.
    number : callable
        Type of all calculations: numpy.float64, numpy.float32 or decimal.Decimal.

    Returns
    -------
    Trace
        Ratio, covariance, innovation, statistic and alarm after each sample.

    Raises
    ------
    ValueError
        A sample that is not finite, or arrays of different lengths.

    Examples
    --------
    >>> from palpate.reference import adaptive_rls
    >>> adaptive_rls([0.5, 0.52], [0.25, 0.26]).ratio.round(4)
    array([2., 2.])
    """
    pairs = finite(output, regressor, number)
    ratio = number(initial_ratio)
    covariance = number(initial_covariance)
    statistic = number(0)
    steady = number(steady)
    alarmed = number(alarmed)
    bound = number(max_covariance)
    drift = number(drift)
    threshold = number(threshold)
    clear_level = number(clear_level)
    alarm = False
    rows = []
    for output_k, regressor_k in pairs:  # Step 1: C1(k), C2(k)
        # Step 2: e(k) = C1(k) - C2(k) r_C(k-1)
        innovation = output_k - regressor_k * ratio

        # g(k) = max(0, g(k-1) + |e(k)| - d)
        statistic = max(number(0), statistic + abs(innovation) - drift)

        # The alarm is set when g(k) > h, and cleared when g(k) has come back to 0 (Sec. III-C)
        alarm = bool(statistic > (clear_level if alarm else threshold))

        # lambda(k) = 0.9 if alarm(k) else 0.995
        forgetting = alarmed if alarm else steady

        # Not in the paper: lambda is raised if P(k-1) / lambda would exceed the bound on P
        forgetting = max(forgetting, covariance / bound)

        # Step 3: K(k) = P(k-1) C2(k) / (lambda + C2(k) P(k-1) C2(k))
        gain = covariance * regressor_k / (forgetting + regressor_k * covariance * regressor_k)

        # P(k) = [P(k-1) - P(k-1) C2(k)^2 P(k-1) / (lambda + C2(k)^2 P(k-1))] / lambda
        covariance = (
            covariance
            - covariance * regressor_k**2 * covariance / (forgetting + regressor_k**2 * covariance)
        ) / forgetting

        # Step 4: r_C(k) = r_C(k-1) + K(k) e(k)
        ratio = ratio + gain * innovation
        rows.append((ratio, covariance, innovation, statistic, alarm))
    columns = list(zip(*rows, strict=True)) or [()] * 5
    ratios, covariances, innovations, statistics, alarms = (np.array(column) for column in columns)
    return Trace(ratios, covariances, innovations, statistics, alarms.astype(bool))


def finite(
    output: ArrayLike, regressor: ArrayLike, number: Callable[[Any], Any]
) -> list[tuple[Any, Any]]:
    """Return pairs of numbers of this type; ValueError: one is not finite, or there are more of one channel."""
    if not (
        np.isfinite(np.asarray(output, float)).all()
        and np.isfinite(np.asarray(regressor, float)).all()
    ):
        raise ValueError(
            "output, regressor: got a value that is not finite, allowed: finite numbers"
        )
    return [
        (number(y), number(x))
        for y, x in zip(np.asarray(output), np.asarray(regressor), strict=True)
    ]


def rls(
    output: ArrayLike, regressor: ArrayLike, *, forgetting: float = 0.995, **settings: Any
) -> Trace:
    """Recursive least squares with one forgetting factor.

    Parameters
    ----------
    output, regressor : array_like, shape (n,), pF
        Finite capacitance changes of the hard and the soft channel.
    forgetting : float
        As in `palpate.Rls`.
    **settings
        initial_ratio, initial_covariance, max_covariance, number: as in `adaptive_rls`.

    Returns
    -------
    Trace
        As for `adaptive_rls`; statistic 0 and alarm False, since there is no detector.

    Raises
    ------
    ValueError
        A sample that is not finite, or arrays of different lengths.

    Examples
    --------
    >>> from palpate.reference import rls
    >>> rls([0.5, 0.52], [0.25, 0.26]).ratio.round(4)
    array([2., 2.])
    """
    trace = adaptive_rls(output, regressor, steady=forgetting, alarmed=forgetting, **settings)
    return trace._replace(statistic=0 * trace.statistic, alarm=np.zeros_like(trace.alarm))
