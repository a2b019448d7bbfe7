"""The curve of eq. (2): fitted to touches on specimens of known modulus, with two variances.

In x = log E, eq. (2) is a logistic, r = r_soft + (r_rigid - r_soft) / (1 + exp(log a - x)): the
calibration curve of immunoassays, whose weighting and inversion are well studied (O'Connell,
Belanger and Haaland, Calibration and assay development using the four-parameter logistic model,
Chemometrics 20, 1993). Residuals are differences of the ratio: residuals in log E would be the same
to first order, but log E does not exist for a measured ratio of r_rigid or more.

The ratio of touch j on specimen i is f(x_i) (1 + specimen_i + touch_ij) + error_ij. error_ij has
the standard error of the estimator. touch_ij (oblique contact) and specimen_i (wrong modulus,
deviating specimen or wrong curve) have unknown variances. Both are found by the method of Paule and
Mandel (J. Res. NBS 87, 1982): the variance with which the weighted sum of squares equals its
degrees of freedom.

A modulus with the relative standard uncertainty u is an error u of x. The mean of its specimen has
the further variance (u dr/dx)^2, known beforehand: the effective variance (J. Orear, Am. J. Phys.
50, 1982, 912). specimen_i is then the scatter beyond it. An error that all specimens share, as that
of a relation that gave the moduli, is no scatter: it shifts the fitted curve, and its covariance
contains this shift.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.errors import CalibrationError, need

Array = NDArray[np.float64]
SMALLEST_VARIANCE = 1e-18  # relative; rounding of a ratio: keeps the weights finite for exact data
_ROUNDS = 50
_EXACT = 1e9  # degrees of freedom of a variance that is known
_RELATIVE = "0 or more and below 1, relative to the modulus: 0.05 is 5 %"
_BELOW_LIMIT = 0.7  # probability that a variance is below its upper limit: intervals then hold
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
        Their degrees of freedom. touch_freedom 0: one touch for each specimen; then touch_variance
        is the sum of both, with specimen_freedom.
    specimen_share : float
        Share of specimen_variance in the variance of the mean of a specimen.
    misfit : float
        Weighted sum of squares around the curve with specimen_variance 0, per degree of freedom.
    modulus_share : float
        Share of the uncertainty of the moduli in the variance of the mean of a specimen.

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
    modulus_share: float = 0.0

    @property
    def curve_freedom(self) -> float:
        """Degrees of freedom of the covariance, by Welch and Satterthwaite.

        The part by the stated uncertainty of the moduli is taken as exact.
        """
        estimated = 1 - self.modulus_share
        return float(min(self.specimen_freedom / max(estimated, 1e-4) ** 2, _EXACT))


@dataclass(frozen=True)
class MeanRatios:
    """Measured ratios, each the mean of `touches` touches on specimen number `specimen`."""

    ratio: Array
    standard_error: Array
    touches: Array
    specimen: NDArray[np.intp]

    def variance(self, touch_variance: float, level: Array) -> Array:
        """Return the variance of each row around the ratio `level` of its specimen."""
        return np.asarray(self.standard_error**2 + touch_variance * level**2 / self.touches)


class FitData(NamedTuple):
    """The data of a fit: arrays of one length."""

    ratios: Array
    moduli: Array
    standard_errors: Array
    touches: Array
    modulus_uncertainties: Array  # relative
    common_uncertainties: Array  # relative


@dataclass(frozen=True)
class ModulusErrors:
    """Relative standard uncertainties of the modulus of each specimen: its own, and a common one."""

    own: Array
    common: Array


def fit_data(
    ratios: ArrayLike,
    moduli: ArrayLike,
    standard_errors: ArrayLike | None,
    touches: ArrayLike | None,
    modulus_uncertainties: ArrayLike | None = None,
    common_uncertainties: ArrayLike | None = None,
) -> FitData:
    """Return the data of a fit; raise ValueError for data that cannot be fitted."""
    shape = np.shape(ratios)
    errors = np.zeros(shape) if standard_errors is None else standard_errors
    count = _for_each(touches, 1.0, shape)
    own = _for_each(modulus_uncertainties, 0.0, shape)
    common = _for_each(common_uncertainties, 0.0, shape)
    smallest = float(np.nextafter(0.0, 1.0))
    data = FitData(
        _column("ratios", ratios, shape, smallest, "positive numbers"),
        _column("moduli", moduli, shape, smallest, "positive numbers"),
        _column("standard_errors", errors, shape, 0.0, "0 or more"),
        _column("touches", count, shape, 1.0, "1 or more"),
        _column("modulus_uncertainties", own, shape, 0.0, _RELATIVE),
        _column("common_uncertainties", common, shape, 0.0, _RELATIVE),
    )
    _require_relative("modulus_uncertainties", data.modulus_uncertainties, data.moduli)
    _require_relative("common_uncertainties", data.common_uncertainties, data.moduli)
    return data


def _for_each(given: ArrayLike | None, default: float, shape: tuple[int, ...]) -> Array:
    """Return a value for each row: those given, one value repeated, or the default."""
    if np.ma.isMaskedArray(given):
        return np.ma.filled(np.ma.asarray(given, dtype=float), np.nan)
    values = np.asarray(default if given is None else given, dtype=float)
    if values.ndim == 0:
        values = np.broadcast_to(values, shape)
    return values


def _require_relative(name: str, values: Array, moduli: Array) -> None:
    """Refuse uncertainties of moduli of 100 % or more, or unequal ones of one modulus."""
    largest = values.max(initial=0.0)
    if largest >= 1:
        raise ValueError(f"{name}: got {largest}, allowed: {_RELATIVE}")
    for modulus in np.unique(moduli):
        same = np.unique(values[moduli == modulus])
        if len(same) > 1:
            raise ValueError(
                f"{name}: got {same[0]:g} and {same[1]:g} at {modulus:g} MPa, allowed: the same "
                "for all ratios of one modulus, which are of one specimen"
            )


def _column(
    name: str,
    given: ArrayLike,
    shape: tuple[int, ...],
    least: float,
    allowed: str,
) -> Array:
    """Return one column of the data as a new array."""
    if np.ma.isMaskedArray(given):
        given = np.ma.filled(np.ma.asarray(given, dtype=float), np.nan)
    values: Array = np.array(given, dtype=float)
    if values.ndim != 1 or values.shape != shape:
        raise ValueError(f"{name}: got shape {values.shape}, allowed: (n,), the same for all")
    wrong = ~(np.isfinite(values) & (values >= least))
    if wrong.any():
        raise ValueError(f"{name}: got {values[wrong][0]}, allowed: {allowed}")
    return values


def curve(parameters: Array, x: Array) -> Array:
    """Return the ratio at x = log(E / MPa)."""
    rigid, log_half, soft = parameters
    return np.asarray(soft + (rigid - soft) * _share(x - log_half))


def gradient(parameters: Array, x: Array) -> Array:
    """Return the derivative of `curve` with respect to the parameters, shape (3, ...)."""
    rigid, log_half, soft = parameters
    share = _share(x - log_half)
    by_log_half = -(rigid - soft) * share * (1 - share)
    return np.stack([share, by_log_half, 1 - share])


def slope_by_log_modulus(parameters: Array, x: Array) -> Array:
    """Return the derivative of `curve` with respect to x."""
    rigid, log_half, soft = parameters
    share = _share(x - log_half)
    return np.asarray((rigid - soft) * share * (1 - share))


def variance_by_moduli(parameters: Array, x: Array, modulus_uncertainty: Array) -> Array:
    """Return the variance of the ratios at x by the relative uncertainty of their moduli."""
    return np.asarray((slope_by_log_modulus(parameters, x) * modulus_uncertainty) ** 2)


def _share(x: Array) -> Array:
    """Return 1 / (1 + exp(-x)), without overflow."""
    small = np.exp(-np.abs(x))
    numerator = np.where(x < 0, small, 1.0)
    return np.asarray(numerator / (1 + small))


def specimen_means(rows: MeanRatios, touch_variance: float) -> tuple[Array, Array]:
    """Return the weighted mean of the rows of each specimen, and its variance."""
    level = _sums(rows, rows.ratio) / _sums(rows, np.ones_like(rows.ratio))
    weight = 1 / rows.variance(max(touch_variance, SMALLEST_VARIANCE), level[rows.specimen])
    total = _sums(rows, weight)
    return _sums(rows, weight * rows.ratio) / total, 1 / total


def fit_curve(
    x: Array,
    rows: MeanRatios,
    soft_ratio: float | None,
    errors: ModulusErrors | None = None,
) -> CurveFit:
    """Return the curve fitted to rows at x = log(E / MPa); soft_ratio None: fit it, too."""
    free = [0, 1, 2] if soft_ratio is None else [0, 1]
    touch_freedom = len(rows.ratio) - len(x)
    freedom = len(x) - len(free)
    if errors is None:
        errors = ModulusErrors(np.zeros(len(x)), np.zeros(len(x)))
    touch_variance = SMALLEST_VARIANCE
    if touch_freedom:
        touch_variance = _touch_variance(rows, touch_freedom)
    mean, variance = specimen_means(rows, touch_variance)
    parameters = _start_parameters(x, mean, variance, soft_ratio)
    around = _AroundCurve(rows, mean, variance, touch_freedom)
    level = curve(parameters, x)
    known = variance_by_moduli(parameters, x, errors.own)
    excess = 0.0
    for _ in range(_ROUNDS):
        excess_before = excess
        known_before = known
        parameters = _least_squares(x, mean, around.total(excess, level, known), parameters, free)
        level = curve(parameters, x)
        known = variance_by_moduli(parameters, x, errors.own)
        excess = around.excess(level, known, freedom)
        is_same = np.allclose(known, known_before, rtol=1e-6, atol=0)
        if is_same and abs(excess - excess_before) <= 1e-6 * excess:
            break
    total = around.total(excess, level, known)
    slopes = gradient(parameters, x)[free]
    covariance = _covariance(slopes, total)
    shift = covariance @ (slopes / total) @ (slope_by_log_modulus(parameters, x) * errors.common)
    covariance = covariance + np.outer(shift, shift)
    whole = np.zeros((3, 3))
    whole[np.ix_(free, free)] = covariance
    modulus_share = float(np.mean(known / total))
    if not touch_freedom:
        return CurveFit(
            parameters, whole, excess, 0, 0.0, freedom, 1.0, 1.0, modulus_share=modulus_share
        )
    misfit = float(((mean - level) ** 2 / (variance + known)).sum() / freedom)
    share = float(np.mean(excess * level**2 / total))
    return CurveFit(
        parameters,
        whole,
        touch_variance,
        touch_freedom,
        excess,
        freedom,
        share,
        misfit,
        modulus_share,
    )


def _sums(rows: MeanRatios, values: Array) -> Array:
    return np.bincount(rows.specimen, values).astype(float)


def _touch_variance(rows: MeanRatios, freedom: int) -> float:
    def squares(variance: float) -> float:
        mean, _ = specimen_means(rows, variance)
        weight = 1 / rows.variance(max(variance, SMALLEST_VARIANCE), mean[rows.specimen])
        return float((weight * (rows.ratio - mean[rows.specimen]) ** 2).sum())

    return _paule_mandel(squares, freedom)


@dataclass(frozen=True)
class _AroundCurve:
    """The means of the specimens, and their variances around a curve."""

    rows: MeanRatios
    mean: Array
    variance: Array
    touch_freedom: int

    def total(self, excess: float, level: Array, known: Array) -> Array:
        """Return the variance of each mean; `known`: the part by the moduli."""
        if self.touch_freedom:
            return np.asarray(self.variance + excess * level**2 + known)
        # A row is a specimen.
        return self.rows.variance(max(excess, SMALLEST_VARIANCE), level) + known

    def excess(self, level: Array, known: Array, freedom: int) -> float:
        """Return the variance between specimens; with one touch each, it includes the touches' own."""

        def squares(excess: float) -> float:
            total = self.total(excess, level, known)
            return float(((self.mean - level) ** 2 / total).sum())

        excess = _paule_mandel(squares, freedom)
        if self.touch_freedom or not known.any():
            return excess
        # The scatter of the touches is then what the known part leaves of the whole: a difference,
        # which is often estimated as 0. As far as the part is of the whole, its upper limit counts.
        share = float(np.mean(known / self.total(excess, level, known)))
        fewest = float(need("scipy.special", "science").chdtri(freedom, _BELOW_LIMIT))
        return _paule_mandel(squares, freedom - share * (freedom - fewest))


def _paule_mandel(squares: Callable[[float], float], freedom: float) -> float:
    """Return the variance at which the sum of squares falls to `freedom`; 0 if it is less at 0."""
    if squares(0.0) <= freedom:
        return 0.0

    def excess_squares(log_variance: float) -> float:
        return squares(float(np.exp(log_variance))) - freedom

    low = np.log(SMALLEST_VARIANCE)
    high = 0.0
    while excess_squares(high) > 0:
        high += 5.0
    brentq = need("scipy.optimize", "science").brentq
    return float(np.exp(brentq(excess_squares, low, high, xtol=1e-9)))


def _start_parameters(
    x: Array,
    mean: Array,
    variance: Array,
    soft_ratio: float | None,
) -> Array:
    """Return start parameters: the best half modulus of a grid, with least-squares end ratios."""
    weight = 1 / np.sqrt(variance + 1e-6 * mean**2)
    best = np.empty(0)
    least = np.inf
    lowest = x.min() - np.log(1e3)
    highest = x.max() + np.log(1e3)
    for log_half in np.linspace(lowest, highest, _HALF_MODULI):
        share = _share(x - log_half)
        if soft_ratio is None:
            columns = np.stack([share, 1 - share], axis=1)
            (rigid, soft), *_ = np.linalg.lstsq(
                columns * weight[:, None], mean * weight, rcond=None
            )
        else:
            soft = soft_ratio
            target = (mean - soft * (1 - share)) * weight
            column = share[:, None] * weight[:, None]
            (rigid,), *_ = np.linalg.lstsq(column, target, rcond=None)
        parameters = np.array([rigid, log_half, soft])
        squares = float((((mean - curve(parameters, x)) * weight) ** 2).sum())
        if squares < least:
            least = squares
            best = parameters
    return best


def _least_squares(
    x: Array,
    mean: Array,
    total: Array,
    parameters: Array,
    free: list[int],
) -> Array:
    """Return the weighted least-squares fit, by Levenberg and Marquardt, from start parameters."""
    weight = 1 / np.sqrt(total)

    def whole(values: Array) -> Array:
        result = parameters.copy()
        result[free] = values
        return result

    def distances(values: Array) -> Array:
        return (curve(whole(values), x) - mean) * weight

    def slopes(values: Array) -> Array:
        return np.asarray((gradient(whole(values), x)[free] * weight).T)

    least_squares = need("scipy.optimize", "science").least_squares
    result = least_squares(
        distances,
        parameters[free],
        jac=slopes,
        method="lm",
        x_scale="jac",
    )
    found = whole(result.x)
    rigid, log_half, soft = found
    nearest = np.clip(log_half, x.min(), x.max())
    beyond = abs(log_half - nearest)
    valid = result.success and np.isfinite(found).all() and rigid > soft
    if not valid or beyond > np.log(1e3):
        raise CalibrationError(
            "ratios: got values that do not follow the S-shaped curve of eq. (2), allowed: ratios "
            "that rise with the modulus, on specimens that are soft and stiff enough to show both "
            "ends of the curve; palpate replay shows the ratios of a recording, and whether its "
            "channels are exchanged"
        )
    return found


def leverages(fit: CurveFit, x: Array, rows: MeanRatios) -> Array:
    """Return the leverage of each row, one a specimen: the share of itself in its fitted ratio."""
    slopes = gradient(fit.parameters, x)
    level = curve(fit.parameters, x)
    variance = rows.variance(max(fit.touch_variance, SMALLEST_VARIANCE), level)
    return np.asarray(np.einsum("ij,ik,kj->j", slopes, fit.covariance, slopes) / variance)


def _covariance(slopes: Array, total: Array) -> Array:
    """Return the covariance: the inverse of the information of the weighted fit."""
    weighted = slopes / np.sqrt(total)
    scale = np.sqrt((weighted**2).sum(axis=1))
    scaled = weighted / scale[:, None]
    information = scaled @ scaled.T
    inverse = np.linalg.pinv(information, hermitian=True) / np.outer(scale, scale)
    return np.asarray((inverse + inverse.T) / 2)
