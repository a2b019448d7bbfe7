"""Reference of the scene "handheld": all stages, from readings to touches."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.reference.align import matched_pair
from palpate.reference.estimate import Estimate, estimator
from palpate.reference.idle import Idle
from palpate.reference.model import LEAST, Misfit
from palpate.reference.revision import Known, Revised, line_share, revised

SECONDS = 6.5  # length of a touch


@dataclass(frozen=True)
class Touch:
    """The result of a touch.

    Attributes
    ----------
    start, samples, alarms, refused : int
        Number of the first reading; samples, those with an alarm, readings without a sample.
    full : bool
        Whether it has the wanted length.
    first_ratio, first_standard_error, covariance : float
        At the end of the touch; covariance in 1/pF^2.
    ratio, standard_error : float
        The best that is known.
    misfit : Misfit
    revision : Revised or None
        None: the baseline after it is not known.

    Examples
    --------
    >>> press = np.repeat([0.0, 0.25, 0.0], [60, 270, 30])
    >>> t = 26_000_000 * np.arange(360)
    >>> [touch], _ = handheld(t, t + 13_000_000, 9 + 2.5 * press, 8 + press)
    >>> touch.start, touch.samples, round(touch.ratio, 3)
    (60, 250, 2.5)
    """

    start: int
    samples: int
    alarms: int
    refused: int
    full: bool
    first_ratio: float
    first_standard_error: float
    covariance: float
    ratio: float
    standard_error: float
    misfit: Misfit
    revision: Revised | None = None


class Rows(NamedTuple):
    """State after each reading, as arrays of shape (n,): as the rows of `palpate.Tracker.process`.

    Attributes
    ----------
    ratio, standard_error, statistic : numpy.ndarray, shape (n,)
        nan before the first touch.
    alarm, contact, revised : numpy.ndarray of bool, shape (n,)

    Examples
    --------
    >>> handheld([], [], [], [])[1].ratio.shape
    (0,)
    """

    ratio: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    statistic: NDArray[np.float64]
    alarm: NDArray[np.bool_]
    contact: NDArray[np.bool_]
    revised: NDArray[np.bool_]


def handheld(t_hard: ArrayLike, t_soft: ArrayLike, hard: ArrayLike, soft: ArrayLike) -> tuple[list[Touch], Rows]:
    """Find touches and estimate their ratios: reference of `palpate.Tracker("handheld")`.

    Parameters
    ----------
    t_hard, t_soft : array_like of int, shape (n,), ns
    hard, soft : array_like, shape (n,), pF
        Readings; nan or infinite: a missing one.

    Returns
    -------
    touches : list of Touch
        In the order of time; one that is running at the end is ended there.
    rows : Rows
    """
    times, values = np.asarray(t_hard), np.column_stack([np.asarray(hard, float), np.asarray(soft, float)])
    pairs = matched_pair(times, t_soft, *values.T)
    state = _Tracker()
    rows = []
    for number, time in enumerate(times.tolist()):
        rows.append(state.feed(number, int(time), values[number], [column[number] for column in pairs]))
    state.finish()
    columns = np.array(rows, float).reshape(-1, 6).T
    return state.touches, Rows(*columns[:3], *(column > 0 for column in columns[3:]))


class _Tracker:
    """The stages with what they have in common."""

    def __init__(self) -> None:
        self.touches: list[Touch] = []
        self._idle = Idle()
        self._touch: Estimate | None = None  # the last one
        self._running = False
        self._before_ns = 0  # time of the reading before the contact was found
        self._known: tuple[Known, Known] | None = None  # before the last touch, until it is revised

    def feed(self, number: int, time_ns: int, values: NDArray[np.float64], pair: list[float]) -> tuple[float, ...]:
        """Take a reading of each channel, and the pair that is complete with it; return a row."""
        there = np.isfinite(values)
        if there.all():
            event = self._idle.take(time_ns, *values.tolist(), running=self._running)
        else:
            event = self._idle.take_one(
                *(v if known else None for v, known in zip(values.tolist(), there, strict=True))
            )
        alarm = False
        if event == "begun":
            begin, noise = max(number + 1 - self._idle.gate.age, 0), self._idle.soft.now.noise
            self._touch = Estimate(begin, _state=estimator(noise))
            self._running, self._known = True, None
        elif event in ("released", "idle"):
            self.finish()
        if event == "idle":
            self._known = self._baselines()
        revises = event == "measured" and self._revise(number)
        if self._running and self._touch is not None:
            alarm = self._sample(number, *pair)
            if (time_ns - self._before_ns) / 1e9 >= SECONDS:
                self.finish(full=True)
        else:
            self._before_ns = time_ns
        touch = self._touch
        if touch is None:
            return (np.nan, np.nan, 0.0, alarm, self._idle.gate.state == "contact", revises)
        error = touch.standard_error(*self._errors(touch.ratio))
        return (touch.ratio, error, touch.statistic, alarm, self._idle.gate.state == "contact", revises)

    def finish(self, *, full: bool = False) -> None:
        """End the running touch."""
        if not self._running or self._touch is None:
            return
        self._running, touch = False, self._touch
        noises, shared = self._errors(touch.ratio)
        misfit = touch.fit.result(*noises, touch.ratio)
        error = touch.standard_error(noises, shared, misfit.open + misfit.open_drift)
        ratio, covariance = (touch.ratio, touch.covariance) if touch.samples else (np.nan, np.nan)
        counts = (touch.start, touch.samples, touch.alarms, touch.refused)
        self.touches.append(Touch(*counts, full, ratio, error, covariance, ratio, error, misfit))

    def _baselines(self) -> tuple[Known, Known]:
        hard, soft = (
            Known(now.level, now.variance, now.age, now.noise, now.slope)
            for now in (self._idle.hard.now, self._idle.soft.now)
        )
        return hard, soft

    def _errors(self, ratio: float) -> tuple[tuple[float, float], float]:
        """Return the noises of the readings, and the variance of the baselines in C1 - r C2."""
        hard, soft = self._baselines()
        return (hard.noise, soft.noise), hard.variance + ratio**2 * soft.variance

    def _sample(self, number: int, hard: float, soft: float, valid: float, matched: float) -> bool:
        """Take a pair into the running touch; return whether there is an alarm."""
        assert self._touch is not None
        if not valid:
            self._touch.refused += 1
            return False
        levels = [known.level for known in self._baselines()]
        return self._touch.add(hard - levels[0], soft - levels[1], number, matched=bool(matched))

    def _revise(self, number: int) -> bool:
        """Revise the last touch, now that the baselines after it are known; return whether there is one."""
        touch, before = self._touch, self._known
        if touch is None or before is None or not touch.samples:
            return False
        self._known, after = None, self._baselines()
        share = line_share(touch.middle, touch.start, number, (before[0].age, after[0].age))
        place = {"ratio": touch.ratio, "mean": touch.mean_regressor, "share": share}
        found = revised(before, after, **place, changed=touch.alarms > 0)
        last = self.touches[-1]
        misfit, relative = last.misfit, found.shift / touch.ratio
        left_open = misfit.open + found.open + (0.0 if found.significant else misfit.open_drift)
        error = touch.standard_error((after[0].noise, after[1].noise), found.variance, left_open)
        corrected = found.shift if found.kind == "drift" else 0.0
        flags = misfit.flags | ({"drift"} if found.significant and abs(relative) > LEAST else set())
        if flags == {"offset"}:
            misfit = replace(misfit, offset_ratio=misfit.offset_ratio + corrected)
        self.touches[-1] = replace(
            last,
            ratio=last.first_ratio + corrected,
            standard_error=error,
            misfit=replace(misfit, flags=frozenset(flags)),
            revision=found,
        )
        return True
