"""Reference of the test of the model: the samples of a touch that it uses."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from palpate.reference.model import Misfit, tested

FEWEST = 16  # samples with both neighbours
BEND = 0.1  # a regressor that bends by more than this share of itself is left out
LEAST_CURVED = 0.01  # share of the ratio: a smaller change together with the depth has no flag


@dataclass
class Fit:
    """The samples of a touch, tested at its end: reference of the fifth stage of the scene "handheld".

    Attributes
    ----------
    samples : list of (float, float, int)
        Output, regressor, and number of each sample since the last hand-over.
    before : (float, float, int) or None
        The last sample, also one before a hand-over.
    curved : float
        Largest change of the ratio together with the depth at a hand-over, share.

    Examples
    --------
    >>> fit, x = Fit(), 0.25 + 0.02 * np.sin(np.arange(60))
    >>> for number, regressor in enumerate(x):
    ...     fit.add(2.5 * (regressor - 0.005), regressor, number)
    >>> found = fit.result(4e-5, 4e-5, 2.5)
    >>> sorted(found.flags), round(found.offset, 2), round(found.offset_ratio, 2)
    (['offset'], 0.02, 2.5)
    """

    samples: list[tuple[float, float, int]] = field(default_factory=list)
    before: tuple[float, float, int] | None = None
    curved: float = 0.0

    def add(self, output: float, regressor: float, number: int) -> None:
        """Take a pair, pF, with its number."""
        self.before = (output, regressor, number)
        self.samples.append(self.before)

    def restart(self, change: float) -> None:
        """Forget the samples after a hand-over that changed the ratio by this share.

        If the depth has changed by a quarter or more, too, the cause may be a curve.
        """
        x = self.terms()["x"]
        if len(x) and self.before is not None:
            deeper = abs(self.before[1] - x.mean()) >= abs(x.mean()) / 4
            if deeper and abs(change) > abs(self.curved):
                self.curved = change
        self.samples = []

    def terms(self) -> dict[str, NDArray[np.float64]]:
        """Return x, y, time and slope of the samples with both neighbours, without those where x bends."""
        y, x, number = np.array(self.samples, float).reshape(-1, 3).T
        whole = (np.diff(number[:-1]) == 1) & (np.diff(number[1:]) == 1)
        whole &= np.abs(np.diff(x, 2)) < BEND * np.abs(x[1:-1])
        terms = {"x": x[1:-1], "y": y[1:-1], "time": number[1:-1], "slope": (x[2:] - x[:-2]) / 2}
        terms = {name: values[whole] for name, values in terms.items()}
        terms["time"] = terms["time"] - terms["time"][:1]
        return terms

    def result(self, hard_noise: float, soft_noise: float, ratio: float) -> Misfit:
        """Test the model.

        Parameters
        ----------
        hard_noise, soft_noise : float, pF
            Standard deviations of a reading.
        ratio : float
            Of the estimator.

        Returns
        -------
        Misfit
        """
        terms, found = self.terms(), Misfit()
        if len(terms["x"]) >= FEWEST and terms["x"].sum() > 0:
            found = tested(terms, hard_noise, soft_noise)
        if abs(self.curved) <= LEAST_CURVED:
            return found
        return replace(
            found,
            curve=self.curved,
            flags=found.flags | {"curve"},
            open=found.open + (self.curved * ratio) ** 2,
            offset_ratio=np.nan,
            offset_error=np.nan,
        )
