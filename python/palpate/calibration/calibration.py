"""A probe's curve, fitted to specimens of known modulus: the modulus of the next object from its ratio, with an interval."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import exp, isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.calibration import file as calibration_file
from palpate.calibration import verdict
from palpate.calibration.curve_fit import Fit, Rows, fit
from palpate.calibration.interval import Measured, bounds
from palpate.calibration.modulus import Modulus
from palpate.elasticity import Elasticity
from palpate.errors import CalibrationError
from palpate.extras import need

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Calibration:
    """A probe's curve, fitted to specimens; made by `fit` or `load`.

    Attributes
    ----------
    fitted : palpate.calibration.curve_fit.Fit
        Parameters, their covariance, and the scatter.
    ratios, moduli, standard_errors, touches : numpy.ndarray, shape (n,)
        What it was fitted on; standard errors are 0 where none were given.
    about : dict of str
        Where it comes from; saved with it.
    version : str
        The version of palpate that fitted it.
    """

    fitted: Fit
    ratios: Array
    moduli: Array
    standard_errors: Array
    touches: Array
    about: Mapping[str, str] = field(default_factory=dict)
    version: str = ""

    @classmethod
    def fit(
        cls,
        ratios: ArrayLike,
        moduli: ArrayLike,
        *,
        standard_errors: ArrayLike | None = None,
        touches: ArrayLike | None = None,
        soft_ratio: float | None = 1.0,
        about: Mapping[str, str] | None = None,
    ) -> "Calibration":
        """Fit eq. (2): ratio against the logarithm of the modulus, weighted by everything that scatters.

        Parameters
        ----------
        ratios : array_like, shape (n,)
            One of each touch, or of each specimen.
        moduli : array_like, shape (n,), MPa
            Of the specimen; ratios with the same modulus are touches on the same specimen. Taken as exact.
        standard_errors : array_like, shape (n,), optional
            Of the ratios, as `Touch.standard_error`.
        touches : array_like, shape (n,) or (), optional
            How many touches each ratio is the mean of; 1 by default.
        soft_ratio : float or None
            Ratio on an infinitely soft object; None to fit it, as a third parameter, where the channels' gains differ.
        about : mapping of str, optional
            Where the data come from; saved with the calibration.

        Returns
        -------
        Calibration

        Raises
        ------
        ValueError
            Arguments of different lengths, not finite, or not positive.
        CalibrationError
            Too few specimens, or ratios that do not follow eq. (2).

        Examples
        --------
        >>> from palpate.elasticity import SORBOTHANE_MPA, Elasticity
        >>> moduli = list(SORBOTHANE_MPA.values())
        >>> four = [1.02, 0.99, 0.98, 1.01]  # four touches on each, held more or less obliquely
        >>> ratios = [factor * Elasticity().ratio(E) for E in moduli for factor in four]
        >>> found = Calibration.fit(ratios, [E for E in moduli for _ in four])
        >>> value, low, high = found.modulus(5.0)
        >>> low < value < high, round(value, 1)
        (True, 1.6)
        >>> print(found.modulus(9.9))
        stiffer than 34.5 MPa
        """
        data = _checked(ratios, moduli, standard_errors, touches)
        if soft_ratio is not None and not isfinite(soft_ratio):
            raise ValueError(f"soft_ratio: got {soft_ratio}, allowed: a finite number, or None to fit it")
        known, specimen = np.unique(data["moduli"], return_inverse=True)
        least = 3 if soft_ratio is not None else 4
        if len(known) < least:
            raise CalibrationError(
                f"moduli: got {len(known)} specimens, allowed: {least} or more, one above the number of parameters"
            )
        rows = Rows(data["ratios"], data["standard_errors"], data["touches"], specimen)
        return cls(fit(np.log(known), rows, soft_ratio), **data, about=dict(about or {}), version=_version())

    @property
    def probe(self) -> Elasticity:
        """Eq. (2) with the fitted parameters."""
        rigid, log_half, soft = (float(value) for value in self.fitted.parameters)
        return Elasticity(rigid, exp(log_half), soft)

    @property
    def touch_spread(self) -> float:
        """Standard deviation of the ratio from touch to touch, relative, without the standard errors' part."""
        return float(self.fitted.touch_variance**0.5)

    @property
    def specimen_spread(self) -> float:
        """Standard deviation of the specimens about the curve, relative, beyond what the touches' scatter explains."""
        return float(self.fitted.specimen_variance**0.5)

    @property
    def range(self) -> tuple[float, float]:
        """Smallest and largest calibrated modulus, MPa."""
        return float(self.moduli.min()), float(self.moduli.max())

    @property
    def residuals(self) -> list[verdict.Residual]:
        """How far each specimen is off the curve, in order of modulus."""
        return verdict.residuals(self.fitted, self.ratios, self.moduli, self.standard_errors, self.touches)

    @property
    def verdict(self) -> str:
        """What a careful colleague would say of the fit."""
        return verdict.verdict(self.fitted, self.residuals, len(self.ratios))

    @property
    def sound(self) -> bool:
        """Whether the verdict has nothing against it."""
        return not verdict.objections(self.fitted, self.residuals)

    def parameter_intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Return the interval of each parameter: rigid_ratio, half_modulus (MPa), soft_ratio."""
        _check_level(level)
        t = float(need("scipy.special", "science").stdtrit(self.fitted.specimen_freedom, 0.5 + level / 2))
        reach = t * np.sqrt(np.diag(self.fitted.covariance))
        low, high = self.fitted.parameters - reach, self.fitted.parameters + reach
        return {
            "rigid_ratio": (float(low[0]), float(high[0])),
            "half_modulus": (exp(low[1]), exp(high[1])),
            "soft_ratio": (float(low[2]), float(high[2])),
        }

    def modulus(
        self, ratio: float, standard_error: float | None = None, *, touches: float = 1, level: float = 0.95
    ) -> Modulus:
        """Return the modulus of an object from its ratio, with an interval.

        The interval holds the error of the fitted curve, the scatter from touch to touch and the standard error, read
        backwards through the curve: it is not symmetric, and near the rigid ratio it has no upper end.

        Parameters
        ----------
        ratio : float
        standard_error : float, optional
            Of the ratio; left out, it counts as 0.
        touches : float
            How many touches on the object the ratio is the mean of.
        level : float, in (0, 1)
            Probability with which the interval holds the modulus. Where it is "stiffer than low" the bound is the
            lower end of the same interval: it is exceeded with (1 + level) / 2.

        Returns
        -------
        Modulus

        Raises
        ------
        ValueError
            An argument out of its range.
        """
        error = 0.0 if standard_error is None else standard_error
        _check_measured(ratio, error, touches)
        _check_level(level)
        return Modulus.of(self.probe, ratio, bounds(self.fitted, Measured(ratio, error, touches, level)), self.range)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the calibration, with units, versions and the data it was fitted on, as TOML."""
        calibration_file.save(Path(path), self.as_dict())

    def as_dict(self) -> dict[str, Any]:
        """Return everything that `save` writes, as plain numbers and text."""
        data = {name: getattr(self, name) for name in calibration_file.DATA}
        return calibration_file.document(self.fitted, self.probe, self.verdict, data, self.about, self.version)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> "Calibration":
        """Read what `save` wrote.

        Raises
        ------
        CalibrationError
            The file is not a calibration.
        """
        return cls(**calibration_file.load(Path(path)))


def _version() -> str:
    from palpate._core import __version__

    return __version__


def _check_level(level: float) -> None:
    if not 0 < level < 1:
        raise ValueError(f"level: got {level}, allowed: 0 < level < 1")


def _check_measured(ratio: float, standard_error: float, touches: float) -> None:
    if not isfinite(ratio):
        raise ValueError(f"ratio: got {ratio}, allowed: a finite number")
    if not (isfinite(standard_error) and standard_error >= 0):
        raise ValueError(f"standard_error: got {standard_error}, allowed: 0 or more, or None")
    if not touches >= 1:
        raise ValueError(f"touches: got {touches}, allowed: 1 or more")


def _checked(
    ratios: ArrayLike, moduli: ArrayLike, standard_errors: ArrayLike | None, touches: ArrayLike | None
) -> dict[str, Array]:
    shape = np.shape(ratios)
    count = np.asarray(1.0 if touches is None else touches, dtype=float)
    given = {
        "ratios": ratios,
        "moduli": moduli,
        "standard_errors": np.zeros(shape) if standard_errors is None else standard_errors,
        "touches": np.broadcast_to(count, shape) if count.ndim == 0 else count,
    }
    data = {name: np.array(values, dtype=float) for name, values in given.items()}
    for name, values in data.items():
        if values.ndim != 1 or values.shape != shape:
            raise ValueError(f"{name}: got shape {values.shape}, allowed: (n,), the same for all")
        least = 0.0 if name == "standard_errors" else np.nextafter(0.0, 1.0) if name != "touches" else 1.0
        wrong = ~(np.isfinite(values) & (values >= least))
        if wrong.any():
            allowed = {"standard_errors": "0 or more", "touches": "1 or more"}.get(name, "positive numbers")
            raise ValueError(f"{name}: got {values[wrong][0]}, allowed: {allowed}")
    return data
