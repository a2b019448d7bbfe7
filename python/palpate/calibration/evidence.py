"""The ratio of a touch at each exponent that its contact may have, and what makes it uncertain.

A probe that is held off by an angle presses one bump deeper than the other by g. At depth z, with
force ~ depth^p:

    hard = r K (z + g/2)^p,    soft = K (z - g/2)^p

To first order in g / z the ratio of the hold is r exp(p g / z), and the level ratio computed with
an exponent q is r exp((p - q) m g / z), where m is the mean of full depth / depth over the swept
depths. So the tilt, log(hold / level ratio), grows linearly with q:

    tilt(q) = tilt(1) (1 + GROWTH (q - 1)),    GROWTH = m / (p - (p - 1) m)

GROWTH is 1.7 within a tenth for presses of all kinds (`python -m bench.accuracy.another_hand`), so
one level ratio and the hold give the ratio at every exponent: log(hold) - tilt(q).
"""

from collections.abc import Iterable, Sequence
from math import isfinite, log, nan
from typing import NamedTuple

import numpy as np

from palpate.calibration.fit import Array
from palpate.touch import Touch
from palpate.uncertainty import RATIOS

EXPONENTS = np.linspace(1.0, 1.5, 6)
"""Exponents that a contact may have: 1, bumps with a flat end, to 1.5, domes (Hertz)."""
BUMPS = {"flat": 1.0, "domes": 1.5}
"""Exponent of the contact by the shape of the bumps."""
GROWTH = 1.7
"""Growth of the tilt with the exponent, per tilt at exponent 1."""
OF_GROWTH = 0.1  # relative standard deviation of GROWTH from touch to touch


class TiltCost(NamedTuple):
    """Standard deviation of log(ratio) by a tilt, as a share of it.

    `within`: of the whole tilt; `beyond`: of what exceeds the tilts of the calibration.
    """

    within: float
    beyond: float


# 2 %: the share of the intercept that is in doubt in a level ratio, as in judge/level_ratio.hpp;
# 5 %: the same with one side of a press. The hold has the whole tilt; its scatter within the
# specimens contains the tilts of the calibration.
TILT_COSTS = {"hold": TiltCost(0.0, 1.0), "level": TiltCost(0.02, 0.05)}


class TouchEvidence(NamedTuple):
    """The ratio of a touch, or the mean of several, at each exponent of `exponents`.

    Attributes
    ----------
    log_ratio : numpy.ndarray, shape (n,)
        Logarithm of the ratio at each exponent.
    derived : numpy.ndarray, shape (n,)
        Difference of the logarithm from the measured ratio, which has another exponent.
    tilt : float
        log(hold / ratio) at exponent 1; nan: unknown.
    standard_error : float
        Of the measured ratio, relative.
    depth_pF, rise_s : float
        Change of both channels together where the press had settled, and the time from the contact
        to there; nan: unknown.
    touches : float
        Number of touches of which it is the mean.
    """

    log_ratio: Array
    derived: Array
    tilt: float
    standard_error: float
    depth_pF: float
    rise_s: float
    touches: float = 1.0


def tilt_growth(exponent: Array | float) -> Array:
    """Return the tilt at an exponent, in units of the tilt at exponent 1.

    Examples
    --------
    >>> tilt_growth([1.0, 1.5]).tolist()
    [1.0, 1.85]
    """
    return 1 + GROWTH * (np.asarray(exponent, float) - 1)


def evidence_of(touch: Touch, kind: str, exponents: Array) -> TouchEvidence:
    """Return the evidence of a touch with a ratio of this kind, "hold" or "level".

    Parameters
    ----------
    touch : Touch
        Its ratio is above 0; with "level" the level ratio, too.
    kind : str
    exponents : numpy.ndarray, shape (n,)
        With "hold" the ratio does not depend on them.

    Returns
    -------
    TouchEvidence

    Raises
    ------
    ValueError
        The touch has no such ratio.
    """
    for value in (touch.ratio, RATIOS[kind](touch)[0]):
        if not value > 0:
            raise ValueError(f"ratios: got {value}, allowed: positive numbers")
    tilt = _flat_tilt(touch)
    ratio = touch.ratio
    error = touch.standard_error
    log_ratio = np.full(len(exponents), log(touch.ratio))
    derived = np.zeros(len(exponents))
    if kind == "level":
        ratio = touch.level_ratio
        error = touch.level_standard_error
        log_ratio = log_ratio - tilt * tilt_growth(exponents)
        derived = log_ratio - log(ratio)
    elif abs(tilt) < 2 * touch.level_standard_error / touch.level_ratio:
        tilt = 0.0  # not significant
    return TouchEvidence(
        log_ratio,
        derived,
        tilt,
        standard_error=error / ratio if isfinite(error) else 0.0,
        depth_pF=touch.depth_pF * (1 + touch.ratio),
        rise_s=touch.rise_s,
    )


def _flat_tilt(touch: Touch) -> float:
    """Return log(hold / level ratio) as with exponent 1; nan: the touch has no level ratio."""
    if not touch.level_ratio > 0:
        return nan
    return log(touch.ratio / touch.level_ratio) / float(tilt_growth(touch.contact_exponent))


def evidence_of_all(touches: Iterable[Touch], kind: str, exponents: Array) -> list[TouchEvidence]:
    """Return `evidence_of` each of several touches."""
    return [evidence_of(touch, kind, exponents) for touch in touches]


class EvidenceTable(NamedTuple):
    """The evidence of m touches by columns: `TouchEvidence` with a row for each touch.

    Attributes
    ----------
    log_ratio, derived : numpy.ndarray, shape (m, n)
    tilt, standard_error, depth_pF, rise_s, touches : numpy.ndarray, shape (m,)
    """

    log_ratio: Array
    derived: Array
    tilt: Array
    standard_error: Array
    depth_pF: Array
    rise_s: Array
    touches: Array


def table_of(touches: Sequence[TouchEvidence]) -> EvidenceTable:
    """Return the evidence of one or more touches by columns."""
    return EvidenceTable(*map(np.array, zip(*touches, strict=True)))


def mean_evidence(each: Sequence[TouchEvidence], weights: Array) -> TouchEvidence:
    """Return the mean of several touches with these weights."""
    shares = weights / weights.sum()
    table = table_of(each)
    return TouchEvidence(
        log_ratio=shares @ table.log_ratio,
        derived=shares @ table.derived,
        tilt=float(shares @ table.tilt),
        standard_error=float(np.sqrt(shares**2 @ table.standard_error**2)),
        depth_pF=float(shares @ table.depth_pF),
        rise_s=float(shares @ table.rise_s),
        touches=float(1 / (shares**2).sum()),
    )
