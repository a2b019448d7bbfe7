"""Reference of the estimate of one touch whose ratio may move: windows that adapt, and the last hold."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field, replace

import numpy as np

from palpate.reference.adaptive import AdaptiveWindow, Settings
from palpate.reference.align import ALIASES
from palpate.reference.estimate import CHANGED, Errors
from palpate.reference.fit import LEAST_BENT, Fit
from palpate.reference.level import Sweep

# the default settings of the scene
SETTINGS = Settings(
    drift=0.75, threshold=11.0, cut=5.0, clip=3.0, smoothing=0.0625, guard=0, initial_ratio=1.0
)
FEW = 16  # samples, with which nothing is tested
LIFT = 48  # samples: longer than a second, with those of the hold since the copy
DELAY = 1.5  # pairs from the middle of an aligned one to its last reading


def windows() -> AdaptiveWindow:
    """Return the estimator of the scene."""
    return AdaptiveWindow(np.float64, SETTINGS)


@dataclass
class MovingEstimate:
    """The samples of one touch, as `Estimate`.

    Attributes
    ----------
    start : int
        Number of the first reading of the touch.
    samples, alarms, refused : int
    fit : Fit
        The same samples, for the test of the model.
    sweep : Sweep
        Without samples: the scene has no level ratio.
    changed : bool
        Whether the ratio changed in these samples.
    lifted : bool
        Whether the result is the one of the last hold.
    before, after : (float, float)
        Ratio and standard error before a change, and after one shortly before the end; nan: there was none.
    margin : float
        Of the decision that was nearest to its limit.

    Examples
    --------
    >>> estimate = MovingEstimate(start=3)
    >>> estimate.add(0.5, 0.2, 4, 0.1, matched=True)
    (False, None)
    >>> round(estimate.ratio, 6), estimate.samples
    (2.5, 1)
    """

    start: int
    samples: int = 0
    alarms: int = 0
    refused: int = 0
    fit: Fit = field(default_factory=Fit)
    sweep: Sweep = field(default_factory=Sweep)
    changed: bool = False
    lifted: bool = False
    before: tuple[float, float] = (np.nan, np.nan)
    after: tuple[float, float] = (np.nan, np.nan)
    margin: float = np.inf
    _state: AdaptiveWindow = field(default_factory=windows)
    _since: int = 0  # samples since the ratio moved
    _hold: "MovingEstimate | None" = (
        None  # the state after FEW such samples, and again after as many
    )
    _number: int = 0  # of the last reading
    _mean_age: float = 0.0  # of the samples, readings

    @property
    def ratio(self) -> float:
        """The ratio."""
        return float(self._state.ratio)

    @property
    def covariance(self) -> float:
        """Inverse of the information, 1/pF^2."""
        information = self._state.information()
        return float(1 / information) if information > 0 else np.inf

    @property
    def statistic(self) -> float:
        """The larger CUSUM side, standard deviations."""
        return float(self._state.statistic())

    @property
    def mean_regressor(self) -> float:
        """Root of the mean square regressor, with the sign of the instrument, pF."""
        return float(np.copysign(np.sqrt(self._state.mean_square), self._state.instrument))

    @property
    def middle(self) -> float:
        """Mean number of the readings of the samples from which the ratio was computed, about."""
        return self._number - self._mean_age

    def add(
        self, hard: float, soft: float, number: int, _time_s: float, *, matched: bool
    ) -> tuple[bool, None]:
        """Take a sample, pF, of the reading with this number; return whether there is an alarm, and no change to note."""
        state = self._state
        ratio = self.ratio
        state.update(hard, soft)
        self.margin = min(self.margin, state.decisions.margin)
        self.samples += 1
        self.alarms += state.alarm
        self._keep_hold()
        if state.alarm:
            self.fit.restart(self.ratio / ratio - 1)
            self.changed = True
        self._follow_age(number)
        if matched and state.counts:
            self.fit.add(hard, soft, number)
        return state.alarm, None

    def _keep_hold(self) -> None:
        """Keep the state after every few samples in which the ratio does not move."""
        moves = self._state.alarm or self._state.memory.is_read
        self._since = 0 if moves else self._since + 1
        if self._since and self._since % FEW == 0:
            self._hold = replace(
                self, fit=deepcopy(self.fit), _state=deepcopy(self._state), _hold=None
            )

    def _follow_age(self, number: int) -> None:
        """Follow the mean age of the samples, as many as the information is that of usual ones."""
        state = self._state
        count = 1.0
        if not state.memory.is_read:
            with np.errstate(divide="ignore", invalid="ignore"):
                count = float(state.information() / np.float64(state.mean_square))
        older = self._mean_age + (number - self._number if self.samples > 1 else 0)
        if state.alarm:
            older = (count - 1) / 2
        elif state.counts:
            older *= 1 - 1 / count
        self._mean_age = older
        self._number = number

    def end(self, errors: Callable[[float], Errors]) -> bool:
        """At the end: take the result of the last hold if the ratio moved since; return whether the ratio changed."""
        hold = self._hold
        if hold is None or self._since >= FEW:
            return False
        if self.samples - hold.samples >= LIFT:
            self.before = hold.ratio, hold.standard_error(errors(hold.ratio))
            return self.apart(self.standard_error(errors(self.ratio)))
        self.lifted = True
        changed = bool(abs(self.ratio / hold.ratio - 1) > LEAST_BENT)
        if changed:
            self.after = self.ratio, self.standard_error(errors(self.ratio))
        self.fit = hold.fit
        self.changed = hold.changed
        self._state = hold._state
        self._number = hold._number
        self._mean_age = hold._mean_age
        return changed

    def apart(self, own: float) -> bool:
        """Return whether the ratio of all samples alike is another one, with this standard error of the ratio."""
        ratio, error = self.before
        apart = abs(self.ratio - ratio)
        different = bool(apart > CHANGED * np.hypot(own, error) and apart > LEAST_BENT * abs(ratio))
        self.before = self.before if different else (np.nan, np.nan)
        return different

    def standard_error(self, errors: Errors, left_open: float = 0.0) -> float:
        """Return the standard error of the ratio.

        Parameters
        ----------
        errors : Errors
        left_open : float
            Variance of the ratio that a misfit leaves open.

        Returns
        -------
        float
            nan before the first sample.

        Notes
        -----
        That of the windows is not below what the noise of the readings makes of their information. The ratio is that of the middle
        of the pair: since then it has moved on.
        """
        state = self._state
        if not self.samples or not state.information() > 0:
            return float("nan")
        scatter = state.noise.lag0 / state.noise.count if state.noise.count > 0 else 0.0
        if errors.pace == ALIASES and not scatter:
            return float("nan")
        readings = errors.of_readings(self.ratio)
        own = float(state.standard_error())
        if not np.isfinite(own):
            own = 0.0
            readings = errors.of_few(readings, scatter)
        square = max(own**2, readings * self.covariance)
        square += (DELAY * state.motion()) ** 2
        square += (errors.shared + errors.rounding) / state.mean_square + left_open
        return float(np.sqrt(square))
