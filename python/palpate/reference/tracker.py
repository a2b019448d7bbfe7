"""Reference of the scenes "handheld" and "sliding": all stages, from readings to touches."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.reference.align import FAST, Reading, means
from palpate.reference.estimate import Errors, Estimate, estimator
from palpate.reference.fit import LEAST, LEAST_BENT, NOISE_GAIN, Misfit
from palpate.reference.handover import _Handover
from palpate.reference.idle import RELEASE, Contact, GivenBaseline, Idle
from palpate.reference.judgement import Judgement
from palpate.reference.level import Sweep
from palpate.reference.levels import Known as LevelsKnown
from palpate.reference.levels import Levels
from palpate.reference.moving import MovingEstimate
from palpate.reference.readings import AHEAD, screen
from palpate.reference.slow_noise import SlowNoise

# standard deviations: the baselines drifted; the ratio is known to be wrong
SURE = 3.0
SIGNIFICANT = 8.0
FALLEN = 0.05  # share of the touch
NEARER = 3.0  # times nearer is the level ratio to the ratio that it decides for
RECOVERED = 4.0  # standard errors of the change
RECOVERED_NOISE = 1.77  # of the recovery in noises: 4 sqrt(pi / 2) sqrt(2 / 16)


class Known(NamedTuple):
    """What is known of the baseline of a channel.

    Attributes
    ----------
    level, variance : float, pF, pF^2
        Level, and its variance.
    age : float, readings
        Mean age of its values.
    noise : float, pF
        Standard deviation of a value.
    recovery : float, pF
        `Level.recovery`.
    slow : float, pF^2
        Variance of its difference to the mean of the touch by slow noise.

    Examples
    --------
    >>> Known(0.62).age
    15.5
    """

    level: float
    variance: float = 1e-11
    age: float = 15.5
    noise: float = 4e-5
    recovery: float = 0.0
    slow: float = 0.0


class Revised(NamedTuple):
    """The result of a revision.

    Attributes
    ----------
    kind : str
        "drift": the ratio is corrected; "creep", "baseline": it is not.
    shift : float
        Of the ratio.
    variance : float, pF^2
        Of the two baselines at the mean time of the samples, as a variance of C1 - r C2.
    open : float
        Variance of the ratio that is left open.
    significant : bool
        Whether the baselines moved by more than 8 standard deviations.

    Examples
    --------
    >>> Revised("drift", 0.01, 1e-11, 0.0, False).kind
    'drift'
    """

    kind: str
    shift: float
    variance: float
    open: float
    significant: bool


class Seen(NamedTuple):
    """What a touch itself shows of how its baselines moved.

    Attributes
    ----------
    drift, drift_error : float
        Change of the output from the first to the last sample, share of it, and its standard error; nan: not known.
    length : float
        From the first to the last sample, share of the line between the baselines.
    level_ratio, level_error : float
        Ratio over the swept depth, and its standard error; nan: not known.

    Examples
    --------
    >>> Seen().drift
    nan
    """

    drift: float = np.nan
    drift_error: float = np.nan
    length: float = 0.0
    level_ratio: float = np.nan
    level_error: float = np.nan


NOTHING_SEEN = Seen()


def line_share(middle: float, start: float, end: float, ages: tuple[float, float]) -> float:
    """Return where on the line between two baselines the middle of a touch is: 0, at the first one, to 1; times in readings."""
    first = start - ages[0]
    second = end - ages[1]
    return (middle - first) / (second - first) if middle < second else 1.0


def revised(
    before: tuple[Known, Known],
    after: tuple[Known, Known],
    *,
    ratio: float,
    mean: float,
    share: float,
    changed: bool = False,
    seen: Seen = NOTHING_SEEN,
) -> Revised:
    """Return what the change of the baselines did to a ratio.

    Parameters
    ----------
    before, after : (Known, Known)
        Baselines of the hard and the soft channel before and after the touch.
    ratio : float
        Of the touch.
    mean : float, pF
        Mean regressor.
    share : float
        `line_share` of the touch.
    changed : bool
        Whether the ratio changed during the touch: a jump of a baseline does that.
    seen : Seen
        What the touch itself shows of how its baselines moved.

    Returns
    -------
    Revised

    Notes
    -----
    With D the change from the first baselines to those at the mean time of the samples, the true ratio is
    r - (D_hard - r D_soft) / mean. D is a share of the whole change: by the line, if the change is more than 3
    standard deviations of the noise of the readings; otherwise by the mean of both baselines with the smallest variance.
    It is a drift if it is also more than 3 standard deviations with the slow noise.

    A step at the contact or at the release gives no drift within the touch. D of it is all of the step at the contact, and 0
    at the release; the level ratio decides, else D is half of it, and the other half is left open.

    Examples
    --------
    >>> first, second = (Known(0.62), Known(-0.41)), (Known(0.6204), Known(-0.41))
    >>> round(revised(first, second, ratio=2.5, mean=0.2, share=0.5).shift, 6)
    -0.001
    """
    hard, soft = (later.level - earlier.level for earlier, later in zip(before, after, strict=True))
    first, second = (known[0].variance + ratio**2 * known[1].variance for known in (before, after))
    change = hard - ratio * soft
    slow = before[0].slow + ratio**2 * before[1].slow
    moved = abs(change) > SURE * np.sqrt(first + second)
    part = share if moved else first / (first + second)
    stepped = 0.0
    first = first + slow
    second = second + slow
    error = np.sqrt(first + second)
    drifted = abs(change) > SURE * error
    significant = bool(abs(change) > SIGNIFICANT * error)
    kind = "drift"
    if -(hard + soft) > FALLEN * (ratio + 1) * mean:
        kind = "baseline"
    elif any(_recovers(*channel) for channel in zip(before, after, strict=True)):
        kind = "creep"
    elif drifted:
        part, stepped = _with_steps(-change / mean, ratio, share, seen)
    shift = -part * change / mean
    if kind != "drift":
        return Revised(kind, shift, first, shift**2, significant)
    # What both errors do not explain is drift or slow noise. Of a drift half of the correction is open for a jump and for a
    # walk, a quarter for an exponential that is large enough for a flag.
    excess = max(change**2 - error**2, 0.0)
    uneven = changed or not significant
    left_open = part * (1 - part) * excess / mean**2
    if drifted:
        left_open = (shift / (2 if uneven else 4)) ** 2 + (stepped * change / mean) ** 2
    variance = (1 - part) ** 2 * first + part**2 * second
    return Revised("drift", shift, variance, left_open, significant)


def _with_steps(whole: float, ratio: float, share: float, seen: Seen) -> tuple[float, float]:
    """Return the shares of the change of the baselines that are corrected and left open.

    `whole`: of the ratio, if the baselines had changed at the contact. Half of the drift that an even change gives is enough, as
    the age of a baseline that drifts is known no better.
    """
    half = -whole / ratio * seen.length / 2
    even = 1.0
    error = 1.0
    if half and np.isfinite(seen.drift):
        most_off = SURE * seen.drift_error / abs(half)
        if seen.drift / half < -most_off:
            return share, 0.5  # the object or the probe drifts, and the level ratio does, too
        even = min(max(seen.drift / half, 0.0), 1.0)
        error = min(seen.drift_error / abs(2 * half), 1.0)
    step = 1 - even
    release = ratio + even * share * whole
    contact = release + step * whole
    far, near = (f(abs(seen.level_ratio - at) for at in (release, contact)) for f in (max, min))
    doubt = max(step, error)
    if far > SURE * seen.level_error and far > NEARER * near:
        at_contact = abs(seen.level_ratio - contact) < abs(seen.level_ratio - release)
        return even * share + step * at_contact, doubt / 6
    return even * share + step / 2, doubt / 2


def _recovers(before: Known, after: Known) -> bool:
    """Return whether a channel moves back after the release, by more than 4 standard errors of the move and the change."""
    change = after.level - before.level
    move = after.recovery
    moves_back = move * change < 0 and abs(move) > RECOVERED_NOISE * before.noise
    return moves_back and change**2 > RECOVERED**2 * (before.variance + after.variance)


SECONDS = 6.5  # length of a touch
LATE_RELEASE = 0.3  # share of the height, which varies where the probe slides
TILTED = 4.0  # errors of both ratios by which they differ


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
    level_ratio, level_standard_error, tilt : float
        Over the swept depth; the ratio above it, share of it.
    depth_pF, rise_s : float
        Change of the soft channel where the press had settled, and the time from the contact to there.
    after : (float, float)
        Ratio and standard error after a change that was not confirmed.
    tilted : bool
        Whether both ratios differ.
    margin : float
        Of the decision of the estimator that was nearest to its limit, as `Decisions.margin`; inf: not known.
    level_flag : str
        "step": a channel jumped within it; "jumped": it was a jump of the channels; "": neither.
    saturated : int
        How often a channel did not follow the other one.

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
    level_ratio: float = np.nan
    level_standard_error: float = np.nan
    depth_pF: float = np.nan
    rise_s: float = np.nan
    tilt: float = 0.0
    before: tuple[float, float] = (np.nan, np.nan)
    after: tuple[float, float] = (np.nan, np.nan)
    tilted: bool = False
    margin: float = np.inf
    level_flag: str = ""
    saturated: int = 0


class CodeStep:
    """The step of a channel's codes: of what all differences between its readings are multiples (Euclid's algorithm)."""

    def __init__(self) -> None:
        self._last = 0.0
        self._change = 0.0
        self._step = 0.0
        self._times = 0
        self._fine = False  # a few millionths of a reading

    def add(self, value: float, *, held: bool) -> None:
        """Take a reading, pF; three differences prove the step, of several codes or within a touch, but not those of a ramp."""
        change = value - self._last
        self._last = value
        if self._fine or not np.isfinite(change):
            return
        before_change = self._change
        self._change = change
        difference = abs(change)
        if not difference:
            return
        least = 1e-6 * (abs(value) + difference)
        before = self._step
        self._step = difference
        rest = before if before < 1000 * difference else 0.0
        while rest > least:
            self._step, rest = rest, abs(self._step - rest * int(self._step / rest + 0.5))
        self._fine = self._step <= 8 * least
        is_ramp = abs(change - before_change) <= least
        if before - self._step > least or before == 0 or (is_ramp and self._times < 3):
            self._times = 0
        elif held or difference > self._step + least:
            self._times = min(self._times + 1, 3)

    def coarse(self, noise: float) -> float:
        """Return the step, pF; 0 if the noise moves the readings from code to code."""
        if self._times == 3 and not self._fine and noise <= 0.51 * self._step:
            return self._step
        return 0.0


AnyEstimate: TypeAlias = Estimate | MovingEstimate


class Rows(NamedTuple):
    """State after each reading, as arrays of shape (n,): as the rows of `palpate.Tracker.process`.

    Attributes
    ----------
    ratio, standard_error, statistic : numpy.ndarray, shape (n,)
        nan before the first touch.
    alarm, contact, revised : numpy.ndarray of bool, shape (n,)
    judgements : list of Judgement
        All of them, in the order of time.

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
    judgements: list[Judgement]


GivenLevels: TypeAlias = tuple[float, ...] | str
"""A baseline as in the settings of the tracker: "measured", "zero", or levels of hard and soft, and their noise, pF."""


def handheld(
    t_hard: ArrayLike,
    t_soft: ArrayLike,
    hard: ArrayLike,
    soft: ArrayLike,
    *,
    contact_exponent: float = 1.0,
    age: float = 0.0,
    falling: bool = False,
    baseline: GivenLevels = "measured",
) -> tuple[list[Touch], Rows]:
    """Find touches and estimate their ratios: reference of `palpate.Tracker("handheld")`.

    Parameters
    ----------
    t_hard, t_soft : array_like of int, shape (n,), ns
    hard, soft : array_like, shape (n,), pF
        Readings; nan or infinite: a missing one.
    contact_exponent, age, falling, baseline
        As the settings of the tracker.

    Returns
    -------
    touches : list of Touch
        In the order of time; one that is running at the end is ended there.
    rows : Rows
    """

    def begin(start: int, noise: float) -> Estimate:
        return Estimate(start, sweep=Sweep(contact_exponent, age), _state=estimator(noise))

    state = _Tracker(begin, age=age, levels=_levels(baseline, falling=falling))
    return _tracked(state, t_hard, t_soft, *_rising(hard, soft, falling=falling))


def sliding(
    t_hard: ArrayLike,
    t_soft: ArrayLike,
    hard: ArrayLike,
    soft: ArrayLike,
    *,
    falling: bool = False,
    baseline: GivenLevels = "measured",
) -> tuple[list[Touch], Rows]:
    """Find touches whose ratio may move: reference of `palpate.Tracker("sliding")`.

    Parameters
    ----------
    t_hard, t_soft : array_like of int, shape (n,), ns
    hard, soft : array_like, shape (n,), pF
        Readings; nan or infinite: a missing one.
    falling, baseline
        As the settings of the tracker.

    Returns
    -------
    touches : list of Touch
        In the order of time; one that is running at the end is ended there.
    rows : Rows

    Examples
    --------
    >>> press = np.repeat([0.0, 0.25, 0.0], [60, 300, 30])
    >>> t = 26_000_000 * np.arange(390)
    >>> [touch], _ = sliding(t, t + 13_000_000, 9 + 2.5 * press, 8 + press)
    >>> touch.start, touch.samples > 290, round(touch.ratio, 3)
    (60, True, 2.5)
    """
    state = _Tracker(
        lambda start, _: MovingEstimate(start),
        release=LATE_RELEASE,
        seconds=np.inf,
        levels=_levels(baseline, falling=falling),
    )
    return _tracked(state, t_hard, t_soft, *_rising(hard, soft, falling=falling))


def _rising(hard: ArrayLike, soft: ArrayLike, *, falling: bool) -> tuple[ArrayLike, ArrayLike]:
    """Return readings that rise in a touch."""
    sign = -1.0 if falling else 1.0
    return sign * np.asarray(hard, float), sign * np.asarray(soft, float)


def _levels(baseline: GivenLevels, *, falling: bool) -> tuple[float, ...] | None:
    """Return the given levels of readings that rise in a touch; None: they are measured."""
    if baseline == "measured":
        return None
    hard, soft, *noises = (0.0, 0.0) if isinstance(baseline, str) else baseline
    return (-hard, -soft, *noises) if falling else (hard, soft, *noises)


def _tracked(
    state: "_Tracker", t_hard: ArrayLike, t_soft: ArrayLike, hard: ArrayLike, soft: ArrayLike
) -> tuple[list[Touch], Rows]:
    screened = screen(t_hard, t_soft, hard, soft)
    clean = np.column_stack([screened.hard, screened.soft])
    made = means(t_hard, t_soft, *clean.T, at_end=screened.at_end)
    rows = [state.row()] * AHEAD
    for values, reading in zip(clean, made, strict=True):
        rows.append(state.feed(values, reading))
    state.finish()
    columns = np.array(rows[: len(clean)], float).reshape(-1, 6).T
    alarm, contact, revised = (column > 0 for column in columns[3:])
    ratio, error, statistic = columns[:3]
    judgements = state.levels.judgements
    return state.touches, Rows(ratio, error, statistic, alarm, contact, revised, judgements)


class _Tracker:
    """The stages with what they have in common; `begin`: a touch, with its first reading and the noise of the soft channel."""

    def __init__(
        self,
        begin: Callable[[int, float], AnyEstimate],
        *,
        release: float = RELEASE,
        age: float = 0.0,
        seconds: float = SECONDS,
        levels: tuple[float, ...] | None = None,
    ) -> None:
        self.touches: list[Touch] = []
        self.levels = Levels()
        # of the running touch
        self._level_flag = ""
        self._saturated = 0
        self._begin = begin
        self._age = age
        self._seconds = seconds
        self._steps = CodeStep(), CodeStep()
        self._begin_ns = 0
        self._idle = Idle(gate=Contact(release=release))
        if levels is not None:
            hard, soft, *noises = levels
            hard_noise, soft_noise = noises or (0.0, 0.0)
            both = GivenBaseline(hard, hard_noise), GivenBaseline(soft, soft_noise)
            self._idle = Idle(*both, Contact(release=release, patience_s=np.inf))
        self._blocks = SlowNoise(), SlowNoise()
        self._slow = [0.0, 0.0]  # variances of the last touch
        self._rests = False  # the baselines are measured, and no touch has begun
        self._touch: AnyEstimate | None = None  # the last one
        self._running = False
        self._before_ns = 0  # time of the reading before the contact was found
        self._known: tuple[Known, Known] | None = None  # before the last touch, until it is revised
        self._readings = self._pairs = self._first = (
            0  # all readings; all that are no part of a mean; the touch's first
        )
        self._size = 1  # of the last mean
        self._together = False  # as `Reading`
        self._pace = FAST

    def feed(self, read: NDArray[np.float64], reading: Reading) -> tuple[float, ...]:
        """Take a reading of each channel, or a mean with it; return a row."""
        self._add_codes(read)
        self._pace = reading.pace
        if not reading.size:
            self._readings += 1
            return self.row(alarm=False, revises=False)
        time_ns = reading.time
        number = self._pairs
        pair = [*reading.pair]
        self._size = reading.size
        self._together = reading.together
        values = np.array([reading.hard, reading.soft])
        there = np.isfinite(values)
        if there.all():
            hard, soft = values.tolist()
            event = self._idle.take(time_ns, hard, soft, self._one_code(), running=self._running)
        else:
            event = self._idle.take_one(
                time_ns,
                *(v if known else None for v, known in zip(values.tolist(), there, strict=True)),
            )
        if event == "begun":
            self._start(number, time_ns)
        elif event == "idle":
            self._known = self._baselines()
        revises = event == "measured" and self._revise(number)
        is_given = isinstance(self._idle.hard, GivenBaseline)
        watches = bool(there.all()) and not is_given
        if watches and self._watch(time_ns, hard, soft, begun=event == "begun"):
            revises = True
        if event in ("released", "idle"):
            self.finish()
        alarm = False
        if self._running:
            alarm = self._in_touch(number, time_ns, pair)
        else:
            self._before_ns = time_ns
            if self._rests and there.all():
                for blocks, value in zip(self._blocks, values.tolist(), strict=True):
                    blocks.add(value, suspected=self._idle.gate.suspects)
            self._falling(time_ns, pair)
        self._readings += 1
        self._pairs += 1
        return self.row(alarm=alarm, revises=revises)

    def _start(self, number: int, time_ns: int) -> None:
        """Begin a touch with the pair of this number."""
        age = self._idle.gate.age
        self._first = max(number + 1 - age, 0)
        first = max(self._readings + 1 - age * self._size, 0)
        self._touch = self._begin(first, self._idle.soft.now.noise)
        self._begin_ns = time_ns
        self._running = True
        self._known = None
        self._level_flag = ""
        self._saturated = 0
        self._rests = False
        for blocks in self._blocks:
            blocks.interrupt()

    def _watch(self, time_ns: int, hard: float, soft: float, *, begun: bool) -> bool:
        """Take a frame for the levels; return whether the last touch is revised."""
        idle = self._idle
        noises = self.levels.noises
        known = LevelsKnown(
            idle.ready,
            idle.gate.state == "idle",
            (idle.hard.now.level, idle.soft.now.level),
            (idle.hard.now.noise, idle.soft.now.noise),
            (self._steps[0].coarse(noises[0]), self._steps[1].coarse(noises[1])),
        )
        change = self.levels.take(time_ns, hard, soft, known, begun=begun)
        if change == "saturated":
            return self._saturate()
        if change:
            idle.move(*self.levels.moved_to)
            return self._change_level(change)
        return False

    def _saturate(self) -> bool:
        """Note that a channel does not follow; return whether the last touch is revised."""
        if self._running:
            self._saturated += 1
            return False
        self.touches[-1] = replace(self.touches[-1], saturated=self.touches[-1].saturated + 1)
        return True

    def _change_level(self, change: str) -> bool:
        """End the running touch, as the levels have changed; return whether the last touch is revised."""
        self._rests = True
        for blocks in self._blocks:
            blocks.interrupt()
        if self._running and change in ("dropped", "returned"):
            self._running = False
            self._touch = None
            return False
        revises = False
        if change != "moved":
            flag = {"stepped": "step", "returned": ""}.get(change, "jumped")
            revises = flag != self._level_flag and not self._running
            self._level_flag = flag
        if revises:
            self.touches[-1] = replace(self.touches[-1], level_flag=flag)
        self.finish()
        return revises

    def row(self, *, alarm: bool = False, revises: bool = False) -> tuple[float, ...]:
        """Return the present state as a row."""
        touch = self._touch
        contact = self._idle.gate.state == "contact"
        if touch is None:
            return (np.nan, np.nan, 0.0, alarm, contact, revises)
        error = touch.standard_error(self._errors(touch.ratio))
        return (touch.ratio, error, touch.statistic, alarm, contact, revises)

    def _one_code(self) -> float:
        """Return the larger step of codes that are coarser than the noise, pF: a change by it is no contact."""
        noises = self._idle.hard.now.noise, self._idle.soft.now.noise
        return max(step.coarse(noise) for step, noise in zip(self._steps, noises, strict=True))

    def _add_codes(self, values: NDArray[np.float64]) -> None:
        """Take a reading of each channel for the step of its codes, which a mean does not show."""
        for step, value in zip(self._steps, values, strict=True):
            step.add(float(value), held=self._running)

    def _in_touch(self, number: int, time_ns: int, pair: list[float]) -> bool:
        """Take a pair into the running touch, and end it at its age or length; return whether there is an alarm."""
        assert self._touch is not None
        since_s = (time_ns - self._begin_ns) / 1e9
        alarm = False
        hard, soft, valid, matched = pair
        if valid:
            alarm, before = self._touch.add(
                *self._changes(hard, soft), number, since_s, matched=bool(matched)
            )
            if self._touch.samples & (self._touch.samples - 1) == 0:
                self._find_slow(self._touch.samples)
            self._note(before)
        else:
            self._touch.refused += 1
        settled, _, settled_s = self._touch.sweep.settled()
        aged = self._age and settled and since_s - settled_s >= self._age
        if aged or (time_ns - self._before_ns) / 1e9 >= self._seconds:
            self.finish(full=bool(aged) or not self._age)
        return alarm

    def _falling(self, time_ns: int, pair: list[float]) -> None:
        """Take a pair between the end of a touch and the end of its release: it belongs to the level ratio."""
        hard, soft, valid, matched = pair
        if (
            self._touch
            and self._touch.samples
            and self._idle.gate.state != "idle"
            and valid
            and matched
        ):
            self._touch.sweep.add(
                *self._changes(hard, soft), (time_ns - self._begin_ns) / 1e9, held=False
            )

    def finish(self, *, full: bool = False) -> None:
        """End the running touch."""
        if not self._running or self._touch is None:
            return
        self._running = False
        touch = self._touch
        self._find_slow(touch.samples)
        changed = touch.end(self._errors)
        errors = self._errors(touch.ratio)
        hard_noise, soft_noise = (max(noise, self._one_code()) for noise in errors.noises)
        misfit = touch.fit.result(hard_noise, soft_noise, touch.ratio)
        if not changed and not misfit.flags:  # a ratio that comes and goes: its mean is another one
            touch.before = touch.fit.mean()
            changed = touch.apart(touch.standard_error(errors))
        misfit = replace(misfit, flags=misfit.flags | {"changed"}) if changed else misfit
        error = touch.standard_error(errors, misfit.open + misfit.open_drift)
        ratio, covariance = (touch.ratio, touch.covariance) if touch.samples else (np.nan, np.nan)
        counts = (touch.start, touch.samples, touch.alarms, touch.refused)
        found = Touch(
            *counts,
            full,
            ratio,
            error,
            covariance,
            ratio,
            error,
            misfit,
            before=touch.before,
            after=touch.after,
            margin=touch.margin,
            level_flag=self._level_flag,
            saturated=self._saturated,
        )
        self.touches.append(self._levelled(found, revised=False))

    def _levelled(self, result: Touch, *, revised: bool) -> Touch:
        """Add the level ratio: with the fall if it is known and has the same ratio; with coarse codes there is none."""
        touch = self._touch
        assert touch is not None
        errors = self._errors(touch.ratio)
        own = touch.standard_error(errors)
        noise = errors.noises[1] * (1 if self._together or self._size > 1 else np.sqrt(NOISE_GAIN))
        level, error = touch.sweep.result(touch.ratio, noise, revised=revised and not touch.lifted)
        if errors.rounding:
            level = error = np.nan
        tilt = touch.ratio / level - 1
        tilted = abs(touch.ratio - level) > TILTED * np.hypot(own, error) and abs(tilt) > LEAST_BENT
        tilt = tilt if np.isfinite(tilt) else 0.0
        depth, rise = touch.sweep.press()
        return replace(
            result,
            level_ratio=level,
            level_standard_error=error,
            depth_pF=depth,
            rise_s=rise,
            tilt=tilt,
            tilted=bool(tilted),
        )

    def _find_slow(self, samples: int) -> None:
        """Find the variances by slow noise: at each doubling of the samples, and at the end."""
        channels = zip(self._blocks, (self._idle.hard.now, self._idle.soft.now), strict=True)
        for k, (blocks, now) in enumerate(channels):
            white = now.noise**2
            lengths = [samples, *([white / now.variance] if now.variance > 0 else [])]
            self._slow[k] = sum(blocks.of_mean(length, white) for length in lengths)

    def _baselines(self) -> tuple[Known, Known]:
        levels = zip((self._idle.hard.now, self._idle.soft.now), self._slow, strict=True)
        hard, soft = (
            Known(now.level, now.variance, now.age, now.noise, now.recovery, slow)
            for now, slow in levels
        )
        return hard, soft

    def _changes(self, hard: float, soft: float) -> tuple[float, float]:
        """Return the changes of both channels from their baselines, pF."""
        return hard - self._idle.hard.now.level, soft - self._idle.soft.now.level

    def _errors(self, ratio: float) -> Errors:
        """Return the errors of C1 - r C2 with this ratio."""
        hard, soft = self._baselines()
        hard_step, soft_step = (
            step.coarse(known.noise * np.sqrt(self._size))
            for step, known in zip(self._steps, (hard, soft), strict=True)
        )
        # step^2 / 12 of the readings, and the same of the baseline
        rounding = (hard_step**2 + ratio**2 * soft_step**2) / 6
        shared = hard.variance + hard.slow + ratio**2 * (soft.variance + soft.slow)
        return Errors((hard.noise, soft.noise), shared, rounding, self._pace)

    def _note(self, before: _Handover | None) -> None:
        """Note the ratio before a change."""
        if before and isinstance(self._touch, Estimate):
            self._touch.note(before, self._errors(float(before.ratio)))

    def _revise(self, number: int) -> bool:
        """Revise the last touch, now that the baselines after it are known; return whether there is one."""
        touch = self._touch
        before = self._known
        self._rests = True
        if before is None:  # the first baselines, or again: before them was perhaps no idle reading
            self._blocks = SlowNoise(), SlowNoise()
            return False
        if touch is None or not touch.samples:
            return False
        self._known, after = None, self._baselines()
        ages = (before[0].age, after[0].age)
        last = self.touches[-1]
        share = line_share(touch.middle, self._first, number, ages)
        place = {"ratio": touch.ratio, "mean": touch.mean_regressor, "share": share}
        seen = Seen(
            last.misfit.drift if last.misfit.drift_error else np.nan,
            last.misfit.drift_error,
            touch.fit.length() / (number - ages[1] - self._first + ages[0]),
            last.level_ratio,
            last.level_standard_error,
        )
        found = revised(before, after, **place, changed=touch.changed, seen=seen)
        self._rests = found.kind != "creep"  # a recovery is no noise
        misfit = last.misfit
        relative = found.shift / touch.ratio
        left_open = misfit.open + found.open + (0.0 if found.significant else misfit.open_drift)
        error = touch.standard_error(
            self._errors(touch.ratio)._replace(shared=found.variance), left_open
        )
        corrected = found.shift if found.kind == "drift" else 0.0
        flags = misfit.flags | ({"drift"} if found.significant and abs(relative) > LEAST else set())
        if flags == {"offset"}:
            misfit = replace(misfit, offset_ratio=misfit.offset_ratio + corrected)
        self.touches[-1] = replace(
            self._levelled(last, revised=True),
            ratio=last.first_ratio + corrected,
            standard_error=error,
            misfit=replace(misfit, flags=frozenset(flags)),
            revision=found,
        )
        return True
