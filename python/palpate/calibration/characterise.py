"""Choose one ratio from the touches on a specimen, and fit a calibration to specimens."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate._core import Touch
from palpate.calibration.calibration import Calibration
from palpate.errors import unlike
from palpate.several import TOUCH_SCATTER, most_reliable, usable

# Data of a fit: all touches; their mean, plain, weighted by how level each was held, or by the standard errors; or the
# most reliable touch.
CHOICES = ("all", "mean", "level", "weighted", "agreement", "standard_error", "covariance")


@dataclass(frozen=True)
class Chosen:
    """One ratio computed from several touches on one object.

    Attributes
    ----------
    ratio : float
    standard_error : float
        That of the estimator, without the scatter from touch to touch.
    touches : float
        Number of touches of which the ratio is the mean; with unequal weights the effective number.

    Examples
    --------
    >>> Chosen(4.1, 0.002).touches
    1.0
    """

    ratio: float
    standard_error: float
    touches: float = 1.0


@dataclass(frozen=True)
class Specimen:
    """The touches on one specimen of known modulus.

    Attributes
    ----------
    name : str
    modulus : float, MPa
    touches : sequence of Touch
    accept : collection of str
        Flags that do not exclude a touch.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> specimen = Specimen("70 A", 8.68, palpate.touches(scenarios.run("stiff-steady")))
    >>> specimen.mean == specimen.touches[0].ratio
    True
    """

    name: str
    modulus: float
    touches: Sequence[Touch]
    accept: Collection[str] = ()

    @property
    def mean(self) -> float:
        """Mean ratio of the usable touches."""
        return self.choose("mean").ratio

    @property
    def usable(self) -> list[Touch]:
        """The touches without a flag that excludes them."""
        return usable(self.touches, self.accept)

    def choose(self, by: str) -> Chosen:
        """Return one ratio for the touches, as `choose` does."""
        return choose(self.touches, by, self.accept)

    @property
    def spread(self) -> float:
        """Standard deviation of these ratios, divided by their mean; nan for one touch."""
        ratios = [touch.ratio for touch in self.usable]
        return float(np.std(ratios, ddof=1) / np.mean(ratios)) if len(ratios) > 1 else float("nan")


def choose(touches: Sequence[Touch], by: str, accept: Collection[str] = ()) -> Chosen:
    """Return one ratio for several touches on one object.

    Parameters
    ----------
    touches : sequence of Touch
    by : str
        One of `CHOICES` except "all". A mean uses the usable touches, "level" with weights
        1 / (`TOUCH_SCATTER`^2 + `unlevel`^2); the other ones as in `palpate.most_reliable`, without the test whether they
        agree.
    accept : collection of str
        Flags that do not exclude a touch.

    Returns
    -------
    Chosen

    Raises
    ------
    ValueError
        No usable touch, or an unknown `by`.

    Examples
    --------
    >>> import palpate
    >>> from palpate.simulation import scenarios
    >>> four = palpate.touches(scenarios.run("four-specimens"))
    >>> choose(four, "mean").touches
    4.0
    """
    if by not in ("mean", "level", "weighted"):
        touch = most_reliable(touches, by=by, scatter=None, accept=accept)
        return Chosen(touch.ratio, _error(touch))
    kept = usable(touches, accept)
    errors = np.array([_error(touch) for touch in kept])
    weights = np.ones(len(kept))
    if by == "level":
        weights = 1 / (TOUCH_SCATTER**2 + np.array([unlevel(touch) for touch in kept]) ** 2)
    elif by == "weighted" and (errors > 0).all():
        weights = 1 / errors**2
    weights = weights / weights.sum()
    ratio = float(weights @ [touch.ratio for touch in kept])
    return Chosen(ratio, float(np.sqrt((weights**2) @ errors**2)), float(1 / (weights**2).sum()))


def unlevel(touch: Touch) -> float:
    """Return how far from level the probe was held, by the fit of the touch: a share of the mean output, 0 or more."""
    # It is the hard channel that the fitted line or curve has at zero force of the soft one, `curve` less `offset` in
    # `Touch.effects`: level bumps are reached together. 0 in a scene without a fit.
    effects = touch.effects
    return abs(effects["curve"] - effects["offset"]) if effects else 0.0


def _error(touch: Touch) -> float:
    return touch.standard_error if np.isfinite(touch.standard_error) else 0.0


def rises(ratios: Sequence[float]) -> bool:
    """Return whether each ratio is above the one before."""
    return all(after > before for before, after in pairwise(ratios))


def calibrate(
    specimens: Sequence[Specimen],
    *,
    by: str = "all",
    soft_ratio: float | None = 1.0,
    about: Mapping[str, str] | None = None,
) -> Calibration:
    """Return a calibration fitted to specimens.

    Parameters
    ----------
    specimens : sequence of Specimen
    by : str
        One of `CHOICES`. With "all", the default, the fit can estimate the scatter from touch to touch.
    soft_ratio, about
        As in `Calibration.fit`.

    Returns
    -------
    Calibration

    Raises
    ------
    ValueError
        A specimen without a usable touch, or an unknown `by`.
    CalibrationError
        As in `Calibration.fit`.

    Examples
    --------
    >>> import palpate
    >>> from palpate.elasticity import SORBOTHANE_MPA
    >>> from palpate.simulation.hand import session
    >>> runs = session(0, touches=2)
    >>> specimens = [Specimen(name, E, palpate.touches(runs[name])) for name, E in SORBOTHANE_MPA.items()]
    >>> calibrate(specimens).about["fitted on"]
    'all'
    """
    if by not in CHOICES:
        raise ValueError(f"by: {unlike(by, CHOICES)}")
    rows = [
        (chosen, specimen.modulus)
        for specimen in specimens
        for chosen in (
            [Chosen(touch.ratio, _error(touch)) for touch in specimen.usable] if by == "all" else [specimen.choose(by)]
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
