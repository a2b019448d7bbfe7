"""The curve of eq. (2): fitted to touches on specimens of known modulus, with two variances, and read backwards.

In x = log E, eq. (2) is a logistic, r = r_soft + (r_rigid - r_soft) / (1 + exp(log a - x)): the calibration curve
of immunoassays, whose weighting and inversion are well studied (O'Connell, Belanger and Haaland, Calibration
and assay development using the four-parameter logistic model, Chemometrics 20, 1993). The moduli are taken as
exact and the ratios as scattered, so residuals are differences of the ratio: residuals in log E would be the same to
first order, but log E does not exist for a measured ratio of r_rigid or more.

The ratio of touch j on specimen i is f(x_i) (1 + specimen_i + touch_ij) + error_ij. error_ij has the standard error of
the estimator. touch_ij (oblique contact) and specimen_i (wrong modulus, deviating specimen or wrong curve) have unknown
variances. Both are found by the method of Paule and Mandel (J. Res. NBS 87, 1982): the variance with which the weighted
sum of squares equals its degrees of freedom.

The interval is the set of all E whose predicted ratio is within t standard deviations of the measured ratio. The
variance belongs to a new measurement at this E: the standard error of the ratio, the scatter from touch to touch and
from object to object, and the error of the fitted curve. For every E the measured ratio is within t standard deviations
of its prediction with the given probability; so the set contains the true E with this probability, also near the rigid
ratio, where the interval is not symmetric or has no upper end. (The delta method, sigma dE/dr, fails there.)

t is the quantile of Student's distribution, with the degrees of freedom of Welch and Satterthwaite: each variance has
the degrees of freedom of its estimate; the standard error is taken as exact. With few of them t falls so fast that a standard
error beside a scatter that is hardly known gives a narrower interval than the scatter alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.errors import CalibrationError, need

Array = NDArray[np.float64]
SMALLEST_VARIANCE = 1e-18  # relative; rounding of a ratio: keeps the weights finite for exact data
_ROUNDS = 50
_REACH = 40.0  # log(E / half_modulus): beyond it the curve is constant in double precision
_STEPS = 401
_HALF_MODULI = 41  # start values, up to three decades beyond the specimens on either side


@dataclass(frozen=True)
class CurveFit:
    """A fitted calibration curve: parameters, covariance and scatter.

    Attributes
    ----------
    parameters : numpy.ndarray, shape (3,)
        rigid_ratio, log(half_modulus / MPa), soft_ratio.
    covariance : numpy.ndarray, shape (3, 3)
        Covariance of the parameters; zeros for a soft_ratio that was not fitted.
    touch_variance, specimen_variance : float
        Variances of touch_ij and specimen_i, relative to the ratio squared.
    touch_freedom, specimen_freedom : int
        Their degrees of freedom. touch_freedom 0: one touch for each specimen; then touch_variance is the sum of both,
        with specimen_freedom.
    specimen_share : float
        Share of specimen_variance in the variance of the mean of a specimen.
    misfit : float
        Weighted sum of squares around the curve with specimen_variance 0, per degree of freedom.

    Examples
    --------
    >>> from palpate import Calibration
    >>> found = Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5])
    >>> found.fitted.parameters.shape, found.fitted.touch_freedom
    ((3,), 0)
    """

    parameters: Array
    covariance: Array
    touch_variance: float
    touch_freedom: int
    specimen_variance: float
    specimen_freedom: int
    specimen_share: float
    misfit: float


@dataclass(frozen=True)
class MeanRatios:
    """MeasuredRatio ratios, each the mean of `touches` touches on the specimen with index `specimen`."""

    ratio: Array
    standard_error: Array
    touches: Array
    specimen: NDArray[np.intp]

    def variance(self, touch_variance: float, level: Array) -> Array:
        """Return the variance of each row around the ratio `level` of its specimen."""
        return np.asarray(self.standard_error**2 + touch_variance * level**2 / self.touches)


def curve(parameters: Array, x: Array) -> Array:
    """Return the ratio at x = log(E / MPa)."""
    rigid, log_half, soft = parameters
    return np.asarray(soft + (rigid - soft) * _share(x - log_half))


def gradient(parameters: Array, x: Array) -> Array:
    """Return the derivative of `curve` with respect to the parameters, shape (3, ...)."""
    rigid, log_half, soft = parameters
    share = _share(x - log_half)
    return np.stack([share, -(rigid - soft) * share * (1 - share), 1 - share])


def _share(x: Array) -> Array:
    """Return 1 / (1 + exp(-x)), without overflow."""
    small = np.exp(-np.abs(x))
    return np.asarray(np.where(x < 0, small, 1.0) / (1 + small))


def specimen_means(rows: MeanRatios, touch_variance: float) -> tuple[Array, Array]:
    """Return the weighted mean of the rows of each specimen, and its variance."""
    level = _sums(rows, rows.ratio) / _sums(rows, np.ones_like(rows.ratio))
    weight = 1 / rows.variance(max(touch_variance, SMALLEST_VARIANCE), level[rows.specimen])
    total = _sums(rows, weight)
    return _sums(rows, weight * rows.ratio) / total, 1 / total


def fit_curve(x: Array, rows: MeanRatios, soft_ratio: float | None) -> CurveFit:
    """Return the curve fitted to rows on specimens at x = log(E / MPa); soft_ratio None: fit it, too."""
    free = [0, 1, 2] if soft_ratio is None else [0, 1]
    touch_freedom = len(rows.ratio) - len(x)
    freedom = len(x) - len(free)
    touch_variance = _touch_variance(rows, touch_freedom) if touch_freedom else SMALLEST_VARIANCE
    mean, variance = specimen_means(rows, touch_variance)
    parameters = _beginning(x, mean, variance, soft_ratio)
    excess = 0.0
    for _ in range(_ROUNDS):
        total, before = _total(rows, variance, excess, curve(parameters, x), touch_freedom), excess
        parameters = _polished(x, mean, total, parameters, free)
        excess = _excess(rows, mean, variance, curve(parameters, x), touch_freedom, freedom)
        if abs(excess - before) <= 1e-6 * excess:
            break
    level = curve(parameters, x)
    total = _total(rows, variance, excess, level, touch_freedom)
    covariance = _covariance(gradient(parameters, x)[free], total)
    whole = np.zeros((3, 3))
    whole[np.ix_(free, free)] = covariance
    misfit = float(((mean - level) ** 2 / variance).sum() / freedom) if touch_freedom else 1.0
    if not touch_freedom:
        return CurveFit(parameters, whole, excess, 0, 0.0, freedom, 1.0, misfit)
    share = float(np.mean(excess * level**2 / total))
    return CurveFit(
        parameters, whole, touch_variance, touch_freedom, excess, freedom, share, misfit
    )


def _sums(rows: MeanRatios, values: Array) -> Array:
    return np.bincount(rows.specimen, values).astype(float)


def _touch_variance(rows: MeanRatios, freedom: int) -> float:
    def squares(variance: float) -> float:
        mean, _ = specimen_means(rows, variance)
        weight = 1 / rows.variance(max(variance, SMALLEST_VARIANCE), mean[rows.specimen])
        return float((weight * (rows.ratio - mean[rows.specimen]) ** 2).sum())

    return _paule_mandel(squares, freedom)


def _total(
    rows: MeanRatios, variance: Array, excess: float, level: Array, touch_freedom: int
) -> Array:
    """Return the variance of the mean of each specimen around the curve."""
    if touch_freedom:
        return np.asarray(variance + excess * level**2)
    return rows.variance(max(excess, SMALLEST_VARIANCE), level)  # a row is a specimen


def _excess(
    rows: MeanRatios, mean: Array, variance: Array, level: Array, touch_freedom: int, freedom: int
) -> float:
    """Return the variance of the specimens; with one touch each, the sum of the touches' and specimens' variance."""

    def squares(excess: float) -> float:
        return float(
            ((mean - level) ** 2 / _total(rows, variance, excess, level, touch_freedom)).sum()
        )

    return _paule_mandel(squares, freedom)


def _paule_mandel(squares: Callable[[float], float], freedom: int) -> float:
    """Return the variance at which the decreasing sum of squares is `freedom`; 0 if it is already less at 0."""
    if squares(0.0) <= freedom:
        return 0.0
    low, high = np.log(SMALLEST_VARIANCE), 0.0
    while squares(float(np.exp(high))) > freedom:
        high += 5.0
    root = need("scipy.optimize", "science").brentq(
        lambda v: squares(float(np.exp(v))) - freedom, low, high, xtol=1e-9
    )
    return float(np.exp(root))


def _beginning(x: Array, mean: Array, variance: Array, soft_ratio: float | None) -> Array:
    """Return start parameters: a grid of half moduli; for each, the two end ratios by linear least squares."""
    weight = 1 / np.sqrt(variance + 1e-6 * mean**2)
    best: tuple[float, Array] = (np.inf, np.empty(0))
    for log_half in np.linspace(x.min() - np.log(1e3), x.max() + np.log(1e3), _HALF_MODULI):
        share = _share(x - log_half)
        if soft_ratio is None:
            columns, target = np.stack([share, 1 - share], axis=1), mean
        else:
            columns, target = share[:, None], mean - soft_ratio * (1 - share)
        ends, *_ = np.linalg.lstsq(columns * weight[:, None], target * weight, rcond=None)
        soft = soft_ratio if soft_ratio is not None else ends[1]
        parameters = np.array([ends[0], log_half, soft])
        squares = float((((mean - curve(parameters, x)) * weight) ** 2).sum())
        if squares < best[0]:
            best = squares, parameters
    return best[1]


def _polished(x: Array, mean: Array, total: Array, parameters: Array, free: list[int]) -> Array:
    """Return the weighted least-squares fit, by Levenberg and Marquardt, from start parameters."""
    weight = 1 / np.sqrt(total)

    def whole(values: Array) -> Array:
        result = parameters.copy()
        result[free] = values
        return result

    result = need("scipy.optimize", "science").least_squares(
        lambda values: (curve(whole(values), x) - mean) * weight,
        parameters[free],
        jac=lambda values: (gradient(whole(values), x)[free] * weight).T,
        method="lm",
        x_scale="jac",
    )
    found = whole(result.x)
    beyond = abs(found[1] - np.clip(found[1], x.min(), x.max()))
    if not (result.success and np.isfinite(found).all() and found[0] > found[2]) or beyond > np.log(
        1e3
    ):
        raise CalibrationError(
            "ratios: got values that do not follow the S-shaped curve of eq. (2), allowed: ratios that rise with the "
            "modulus, on specimens that are soft and stiff enough to show both ends of the curve; palpate replay shows the "
            "ratios of a recording, and whether its channels are exchanged"
        )
    return found


def _covariance(slopes: Array, total: Array) -> Array:
    """Return the covariance: the inverse of the information of the weighted fit."""
    weighted = slopes / np.sqrt(total)
    scale = np.sqrt((weighted**2).sum(axis=1))
    information = (weighted / scale[:, None]) @ (weighted / scale[:, None]).T
    inverse = np.linalg.pinv(information, hermitian=True) / np.outer(scale, scale)
    return np.asarray((inverse + inverse.T) / 2)


@dataclass(frozen=True)
class MeasuredRatio:
    """A measured ratio: the mean of `touches` touches, its standard error, and the confidence level."""

    ratio: float
    standard_error: float = 0.0
    touches: float = 1
    level: float = 0.95


def bounds(fit: CurveFit, measured: MeasuredRatio) -> tuple[float, float]:
    """Return the lowest and highest log(E / MPa) that agree with a ratio; nan, nan if none agrees."""
    # -inf: all softer objects agree; inf: all stiffer objects agree.
    log_half = fit.parameters[1]
    inner = log_half + np.linspace(-_REACH, _REACH, _STEPS)
    middle = _best(fit, measured.ratio)
    x = np.sort(
        np.concatenate([[-np.inf], inner, [np.inf], [middle] if np.isfinite(middle) else []])
    )
    agrees = np.flatnonzero(np.abs(_distance(fit, measured, x)) <= 1)
    if not len(agrees):
        return np.nan, np.nan
    first, last = agrees[0], agrees[-1]
    low = -np.inf if first == 0 else _crossing(fit, measured, inside=x[first], outside=x[first - 1])
    high = (
        np.inf
        if last == len(x) - 1
        else _crossing(fit, measured, inside=x[last], outside=x[last + 1])
    )
    return low, high


def _best(fit: CurveFit, ratio: float) -> float:
    """Return log E for a ratio; infinite beyond the ends of the curve."""
    rigid, log_half, soft = fit.parameters
    if not soft < ratio < rigid:
        return np.inf if ratio >= rigid else -np.inf
    return float(log_half + np.log((ratio - soft) / (rigid - ratio)))


def _distance(fit: CurveFit, measured: MeasuredRatio, x: Array) -> Array:
    """Return ratio minus prediction at x, in units of `allowance`; it decreases with x."""
    return np.asarray((measured.ratio - curve(fit.parameters, x)) / allowance(fit, measured, x))


class Variances(NamedTuple):
    """The parts of the variance of a measured ratio, which add up."""

    # noise: The square of the standard error: noise of the converter.
    # touch: Scatter from touch to touch: how the probe is held; of the mean of the touches.
    # specimen: Scatter of specimens around the curve.
    # curve: Error of the fitted curve.

    noise: float
    touch: Array
    specimen: Array
    curve: Array


def variances(fit: CurveFit, measured: MeasuredRatio, x: Array) -> Variances:
    """Return the parts of the variance of a measured ratio around the curve at x = log(E / MPa)."""
    level = curve(fit.parameters, x)
    slopes = gradient(fit.parameters, x)
    return Variances(
        measured.standard_error
        * measured.standard_error,  # not **, which raises an error at overflow
        fit.touch_variance * level**2 / measured.touches,
        fit.specimen_variance * level**2,
        np.einsum("i...,ij,j...->...", slopes, fit.covariance, slopes),
    )


def allowance(fit: CurveFit, measured: MeasuredRatio, x: Array) -> Array:
    """Return t standard deviations of a measured ratio around the curve at x = log(E / MPa)."""
    noise, touch, specimen, fitted = variances(fit, measured, x)
    total = noise + touch + specimen + fitted
    # Terms from the same estimate are fully correlated; the error of the curve comes from both estimates.
    by_specimen = specimen + fit.specimen_share * fitted if fit.touch_freedom else touch + fitted
    by_touch = touch + specimen + fitted - by_specimen
    parts = by_touch**2 / max(fit.touch_freedom, 1) + by_specimen**2 / fit.specimen_freedom
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        freedom = np.minimum(total**2 / parts, 1e9)
    t = need("scipy.special", "science").stdtrit(freedom, 0.5 + measured.level / 2)
    return np.asarray(t * np.sqrt(total))


def _crossing(fit: CurveFit, measured: MeasuredRatio, *, inside: float, outside: float) -> float:
    """Return x at which the distance is 1 or -1, between a point inside the interval and one outside."""
    if not (np.isfinite(inside) and np.isfinite(outside)):
        return inside if np.isfinite(inside) else outside  # beyond _REACH
    side = np.sign(_distance(fit, measured, np.array(outside)))
    brentq = need("scipy.optimize", "science").brentq
    return float(
        brentq(
            lambda x: float(_distance(fit, measured, np.array(x)) - side),
            inside,
            outside,
            xtol=1e-12,
        )
    )
