"""Reference of the estimate of one touch: the estimator, its standard error, and the mean time of its samples."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palpate.reference.align import ALIASES, FAST, SLOW
from palpate.reference.fit import LEAST_BENT, Fit
from palpate.reference.handover import FEWEST, SETTLED, _Handover
from palpate.reference.level import Sweep

# a change with the probe down for so long is the result
CONFIRMED_S = 0.6
LONGEST_LIFT_S = 2.5
CHANGED = 4  # standard errors between two ratios
DOWN = 0.97  # share of the mean square of the regressors before the change


class Errors(NamedTuple):
    """What is wrong with C1 - r C2, beside the innovations.

    Attributes
    ----------
    noises : (float, float), pF
        Standard deviations of a hard and of a soft reading.
    shared : float, pF^2
        Variance of the baselines: an error that all samples have in common.
    rounding : float, pF^2
        Variance by codes that are coarser than the noise: of the baselines, and of each reading.
    pace : int
        How slow the pairs are.

    Examples
    --------
    >>> Errors((4e-5, 4e-5), 1e-11, 0.0).rounding
    0.0
    """

    noises: tuple[float, float]
    shared: float
    rounding: float
    pace: int = FAST

    def of_readings(self, ratio: float) -> float:
        """Return the variance of C1 - r C2 by the noise of both readings, pF^2."""
        hard_noise, soft_noise = self.noises
        return hard_noise**2 + ratio**2 * soft_noise**2 + self.rounding

    def of_few(self, readings: float, scatter: float) -> float:
        """Return the long-run variance by few innovations: of the readings, and several times their excess."""
        return readings + (6 if self.pace == ALIASES else 4) * max(scatter - readings / 2, 0.0)

    def least(self, readings: float, scatter: float) -> float:
        """Return the least long-run variance, by the readings and, with slow pairs, by the variance of the innovations."""
        if self.pace == ALIASES:
            return self.of_few(readings, scatter)
        return readings + (0.5 if self.pace == SLOW else 0.0) * max(scatter - readings / 2, 0.0)


def estimator(noise: float = 1.0) -> _Handover:
    """Return the estimator of the scene; below a noise of 1e-5 the initial covariance follows from it."""
    return _Handover(16 / noise**2) if noise**2 * 1e10 < 1 else _Handover()


@dataclass
class Estimate:
    """The samples of one touch.

    Attributes
    ----------
    start : int
        Number of the first reading of the touch.
    samples, alarms, refused : int
    fit : Fit
        The same samples, for the test of the model.
    sweep : Sweep
        The same samples, for the level ratio.
    changed : bool
        Whether the ratio changed in these samples.
    lifted : bool
        Whether the result is the one before a change that was not confirmed.
    before, after : (float, float)
        Ratio and standard error before a change that was confirmed, and after one that was not; nan: there was none.
    margin : float
        inf: the decisions are not watched.

    Examples
    --------
    >>> estimate = Estimate(start=3)
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
    _unconfirmed: dict[str, Any] | None = None  # before a change
    _begun_s: float = 0.0  # the first change, and the last one
    _changed_s: float = 0.0
    _alarmed: bool = False  # by a hand-over
    _squares: list[float] = field(default_factory=list)  # of the regressors since the last one
    _down: bool = False  # their mean is not much less than before
    _state: _Handover = field(default_factory=estimator)
    # of the readings, and their weights
    _numbers: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    _weights: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    @property
    def ratio(self) -> float:
        """The ratio."""
        return float(self._state.ratio)

    @property
    def covariance(self) -> float:
        """Inverse of the information, 1/pF^2."""
        return float(1 / self._state.information)

    @property
    def statistic(self) -> float:
        """The larger CUSUM side, standard deviations."""
        return float(self._state.statistic())

    @property
    def mean_regressor(self) -> float:
        """Root of the mean square regressor, by the information, with the sign of the instrument, pF."""
        return float(
            np.copysign(
                np.sqrt(self._state.information / self._state.weight), self._state.instrument
            )
        )

    @property
    def middle(self) -> float:
        """Mean number of the readings, with the weights of the samples."""
        return float(self._weights @ self._numbers / self._weights.sum())

    def add(
        self, hard: float, soft: float, number: int, time_s: float, *, matched: bool
    ) -> tuple[bool, _Handover | None]:
        """Take a sample, pF, of the reading with this number, s after the contact.

        Returns
        -------
        alarm : bool
        before : _Handover or None
            The estimator before a change that is confirmed by this sample.
        """
        state = self._state
        before = {
            name: getattr(state, name) for name in ("base", "information", "squares", "weight")
        }
        drifted = state.drifting
        state.update(hard, soft)
        self.samples += 1
        if alarm := state.alarm():
            self.alarms += 1
            self._keep(before, time_s, alarm=True)
            # The samples that the hand-over kept count as the last readings.
            self._weights = np.ones(round(state.weight))
            self._numbers = number - np.arange(len(self._weights), dtype=float)
            self.fit.restart(state.ratio / before["base"] - 1)
            self.sweep.restart()
            self.changed = True
        if state.drifting and not (drifted and self._unconfirmed):
            self._keep(before, time_s, alarm=False)
        before_change = self._confirm(soft, time_s)
        # an outlier changes no sum, unless the ratio drifts
        if not alarm and state.squares != before["squares"]:
            # forgotten, a little or much
            self._weights *= (state.weight - 1) / max(self._weights.sum(), 1)
            self._weights = np.append(self._weights, 1.0)
            self._numbers = np.append(self._numbers, float(number))
            if matched and not state.outlier:
                self.fit.add(hard, soft, number)
                self.sweep.add(hard, soft, time_s, held=True)
        return alarm, before_change

    def _keep(self, before: dict[str, Any], time_s: float, *, alarm: bool) -> None:
        """Keep what is known before a hand-over or a drift, until it is confirmed; of several, the first one counts."""
        if self._unconfirmed is None:
            names = ("fit", "sweep", "changed", "_weights", "_numbers", "_state")
            kept = {name: deepcopy(getattr(self, name)) for name in names}
            for name, value in before.items():
                setattr(kept["_state"], name, value)
            kept["_state"].lag = kept["_state"].lead = 0.0
            self._unconfirmed = kept
            self._begun_s = time_s
            self._alarmed = False
        self._alarmed = self._alarmed or alarm
        self._changed_s = time_s
        self._squares = []

    def _confirm(self, regressor: float, time_s: float) -> _Handover | None:
        """Forget what was known before a change if the probe is still down some time after it, or after the longest lift.

        Returns the estimator before a hand-over that is confirmed now.
        """
        if self._unconfirmed:
            state = self._unconfirmed["_state"]
            self._squares.append(regressor**2)
            self._down = bool(np.mean(self._squares) >= DOWN * state.information / state.weight)
            least_s = CONFIRMED_S if self._alarmed else 2 * CONFIRMED_S  # a drift is slow
            confirmed = self._down and time_s - self._changed_s >= least_s
            if confirmed or time_s - self._begun_s >= LONGEST_LIFT_S:
                self._unconfirmed = None
                return state if self._alarmed else None
        return None

    def note(self, state: _Handover, errors: Errors) -> None:
        """Note the ratio before a change, if its samples are not few; of several, the farthest from the ratio now counts."""
        if state.weight < SETTLED or state.noise.weight < FEWEST:
            return
        other = replace(self, _state=state)
        if not abs(other.ratio - self.ratio) <= abs(self.before[0] - self.ratio):
            self.before = other.ratio, other.standard_error(errors)

    def apart(self, own: float) -> bool:
        """Return whether the ratio before a change is another one, with this standard error of the ratio."""
        ratio, error = self.before
        apart = abs(self.ratio - ratio)
        different = bool(apart > CHANGED * np.hypot(own, error) and apart > LEAST_BENT * abs(ratio))
        self.before = self.before if different else (np.nan, np.nan)
        return different

    def end(self, errors: Callable[[float], Errors]) -> bool:
        """At the end: return whether the ratio changed; before a change that is not confirmed is the result."""
        changed = self._go_back(errors(self.ratio))
        if self.lifted:
            return changed
        waiting = self._unconfirmed["_state"] if self._unconfirmed else None
        if waiting:
            self.note(waiting, errors(float(waiting.ratio)))
        return self.apart(self.standard_error(errors(self.ratio)))

    def _go_back(self, errors: Errors) -> bool:
        """At the end: take the result before a change that is not confirmed; return whether the change was large."""
        kept = self._unconfirmed
        few = kept is not None and kept["_state"].weight < self._state.weight
        if not kept or (few if self._alarmed else self._down):
            return False
        self.lifted = True
        changed = abs(self.ratio / kept["_state"].ratio - 1) > LEAST_BENT
        if changed:
            self.after = self.ratio, self.standard_error(errors)
        self.before = (np.nan, np.nan)
        for name, value in kept.items():
            setattr(self, name, value)
        return bool(changed)

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
        The long-run variance of a sample is not below the variance of the readings. While the innovations are too few to show how
        they are correlated, it is that plus 4 times what their variance has above half of it. Where a tremor aliases it
        is never below this with 6 times.
        """
        state = self._state
        noise = self._state.noise
        scatter = noise.lag0 / noise.weight if noise.weight else 0.0
        if not self.samples or (errors.pace == ALIASES and not scatter):
            return float("nan")
        readings = errors.of_readings(self.ratio)
        few = errors.of_few(readings, scatter)
        settled = noise.weight >= FEWEST and state.weight >= SETTLED
        own = noise.long_run_variance(aliases=errors.pace == ALIASES) if settled else few
        square = max(own, errors.least(readings, scatter)) * state.squares / state.information**2
        square += (errors.shared + errors.rounding) * state.weight / state.information + left_open
        return float(np.sqrt(square))
