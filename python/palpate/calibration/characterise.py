"""From several touches on each of some specimens to one table, and to a calibration."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate._core import Touch
from palpate.calibration.calibration import Calibration
from palpate.touch import most_reliable, usable

CHOICES = ("all", "mean", "weighted", "agreement", "standard_error", "covariance")
"""What a calibration is fitted on: every touch, their mean (plain, or weighted by the standard errors), or one of them."""


@dataclass(frozen=True)
class Chosen:
    """What several touches on one object come to.

    Attributes
    ----------
    ratio, standard_error : float
        The standard error holds what the estimator knows, not the scatter from touch to touch.
    touches : float
        How many touches the ratio is the mean of; with unequal weights their effective number.
    """

    ratio: float
    standard_error: float
    touches: float = 1.0


@dataclass(frozen=True)
class Specimen:
    """The touches on one specimen of known modulus."""

    name: str
    modulus: float
    touches: Sequence[Touch]

    @property
    def mean(self) -> float:
        """Mean ratio of the touches without a flag."""
        return choose(self.touches, "mean").ratio

    @property
    def spread(self) -> float:
        """Standard deviation of these ratios, relative to their mean; nan for one touch."""
        ratios = [touch.ratio for touch in usable(self.touches)]
        return float(np.std(ratios, ddof=1) / np.mean(ratios)) if len(ratios) > 1 else float("nan")


def choose(touches: Sequence[Touch], by: str) -> Chosen:
    """Reduce several touches on one object to one ratio.

    Parameters
    ----------
    touches : sequence of Touch
    by : str
        One of `CHOICES` but "all". Means are of the touches without a flag; the others as in `palpate.most_reliable`.

    Returns
    -------
    Chosen

    Raises
    ------
    ValueError
        No touch to choose from, or an unknown `by`.
    """
    if by not in ("mean", "weighted"):
        touch = most_reliable(touches, by=by)
        return Chosen(touch.ratio, _error(touch))
    kept = usable(touches)
    errors = np.array([_error(touch) for touch in kept])
    weights = 1 / errors**2 if by == "weighted" and (errors > 0).all() else np.ones(len(kept))
    weights = weights / weights.sum()
    ratio = float(weights @ [touch.ratio for touch in kept])
    return Chosen(ratio, float(np.sqrt((weights**2) @ errors**2)), float(1 / (weights**2).sum()))


def _error(touch: Touch) -> float:
    return touch.standard_error if np.isfinite(touch.standard_error) else 0.0


def rises(ratios: Sequence[float]) -> bool:
    """Whether each ratio is above the one before."""
    return all(after > before for before, after in pairwise(ratios))


def calibrate(
    specimens: Sequence[Specimen],
    *,
    by: str = "all",
    soft_ratio: float | None = 1.0,
    about: Mapping[str, str] | None = None,
) -> Calibration:
    """Fit a calibration to specimens.

    Parameters
    ----------
    specimens : sequence of Specimen
    by : str
        One of `CHOICES`: "all", the default, knows the scatter from touch to touch from the touches themselves.
    soft_ratio, about
        As in `Calibration.fit`.

    Raises
    ------
    ValueError
        A specimen without a touch to choose from, or an unknown `by`.
    CalibrationError
        As `Calibration.fit`.
    """
    if by not in CHOICES:
        raise ValueError(f"by: got {by!r}, allowed: {', '.join(CHOICES)}")
    rows = [
        (chosen, specimen.modulus)
        for specimen in specimens
        for chosen in (
            [Chosen(touch.ratio, _error(touch)) for touch in usable(specimen.touches)]
            if by == "all"
            else [choose(specimen.touches, by)]
        )
    ]
    return Calibration.fit(
        [chosen.ratio for chosen, _ in rows],
        [modulus for _, modulus in rows],
        standard_errors=[chosen.standard_error for chosen, _ in rows],
        touches=[chosen.touches for chosen, _ in rows],
        soft_ratio=soft_ratio,
        about={**(about or {}), "fitted on": by},
    )
