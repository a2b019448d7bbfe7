"""Reference of `palpate.HandoverRls`: windows that adapt, a CUSUM with hand-overs, and a memory of three samples.

The core keeps sums; this keeps the samples since a change, since a CUSUM side was last 0, and those that wait.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from palpate.reference.decisions import Decisions
from palpate.reference.dyadic_windows import Sample, Windows, root, student_square
from palpate.reference.paper import finite

WARM_UP = 8  # samples before the detector starts
TRANSIENT = 3  # first innovations, dominated by the error of the initial ratio
FIRST = 16  # samples in which nothing is suspected
DOUBTED = 64  # samples while the scale, a mean of few magnitudes, is taken 1 + 3 / (samples - 2) times as large
TELLS = 64  # a sample says something of the ratio if so many times its information is that of a usual sample
STILL_USUAL = 0.98  # of the usual information, for each sample that says nothing
RARELY = 16  # of a sample with the usual information, a share of 1 / (1 + RARELY) counts in it
SUSPICION = 1  # a side of the CUSUM above it: noise is not learned
NORMAL = 1.96  # normal deviate of the 95 % interval
ROUNDING = 2.0**-53  # of a double, relative
LEAST_SCALE = 1e-15  # of the output: a few rounding errors

FORGETTING = 0.995  # of the sums of the autocorrelation
SHARE = 0.02  # of a new magnitude
FEWEST = 32  # so few innovations cannot show a correlation over more samples
PATIENCE = 128  # samples that wait at most
TRUST = 10  # samples that the scale counts as, beside those that wait

SLIDE = 5  # outliers of one sign before a slide

SHORT = 0.3  # weight of the past in the short memory
BETTER = 8  # mean square error of the windows over its own, when it is read; half of it while it is
JUDGED = 8  # samples by which both are judged
ONE_SIGN = 64  # samples without a change of sign of the regressor, before it is read
EARLY = 10  # first samples, in which it is not read


class AdaptiveWindowTrace(NamedTuple):
    """State of `adaptive_window` after each sample, as arrays of shape (n,).

    Attributes
    ----------
    ratio : numpy.ndarray, shape (n,)
    covariance : numpy.ndarray, shape (n,), 1/pF^2
        Inverse of the information; inf before the first regressor.
    innovation : numpy.ndarray, shape (n,), pF
        Output minus its prediction with the ratio before the sample.
    statistic : numpy.ndarray, shape (n,)
        Larger of the two CUSUM sides, in units of the scale of the innovations.
    standard_error : numpy.ndarray, shape (n,)
        Of the ratio; nan until it is known.
    alarm : numpy.ndarray of bool, shape (n,)
    margin : numpy.ndarray of float, shape (n,)
        How near the closest decision of this sample was to its limit, relative to the numbers that it compares.

    Examples
    --------
    >>> settings = {"drift": 0.75, "threshold": 11, "cut": 5, "clip": 3, "smoothing": 0.0625, "guard": 0}
    >>> adaptive_window([0.5, 0.52], [0.25, 0.26], **settings, initial_ratio=1).alarm
    array([False, False])
    """

    ratio: NDArray[Any]
    covariance: NDArray[Any]
    innovation: NDArray[Any]
    statistic: NDArray[Any]
    standard_error: NDArray[Any]
    alarm: NDArray[np.bool_]
    margin: NDArray[np.float64]


class Settings(NamedTuple):
    """As in `adaptive_window`."""

    drift: Any
    threshold: Any
    cut: Any
    clip: Any
    smoothing: Any
    guard: int
    initial_ratio: Any


@dataclass
class Side:
    """A CUSUM side, with the samples since it was last 0."""

    statistic: Any
    samples: list[Sample] = field(default_factory=list)

    def add(self, step: Any, sample: Sample, decisions: Decisions) -> None:
        """Add a step to the statistic; it does not fall below 0."""
        if decisions.above(self.statistic, -step):
            self.statistic += step
            self.samples.append(sample)
        else:
            self.statistic *= 0
            self.samples = []


class Innovation(NamedTuple):
    """An innovation, as the noise learns it.

    Attributes
    ----------
    limited : number
        Whitened, within the clip.
    counted : number
        Not whitened: the forecast plus the limited one where that was limited.
    before : number
        The one before.
    rise : bool
        Whether it is one of a rise of the ratio.
    outlier : bool
    """

    limited: Any
    counted: Any
    before: Any
    rise: bool
    outlier: bool


@dataclass
class Noise:
    """Scale and autocorrelation of the innovations. While a change is suspected, they wait."""

    number: Callable[[Any], Any]
    mean: Any  # of the magnitudes of the limited innovations
    lag0: Any = 0  # weighted sums of e(k)^2, e(k) e(k-1), and of 1
    lag1: Any = 0
    count: Any = 0
    correlation: Any = 0
    due: int = 1  # samples until it is estimated again
    before: Any = 0  # e(k-1)
    waiting: list[Innovation] = field(default_factory=list)

    def forecast(self) -> Any:
        """Return what is expected of the next innovation."""
        return self.correlation * self.before

    def scale(self) -> Any:
        """Return the standard deviation of the whitened innovations: sqrt(pi / 2) times their mean magnitude.

        Of those that wait, what has both signs is no change of the ratio: it counts at once.
        """
        rises = sum(abs(one.limited) for one in self.waiting if one.rise)
        falls = sum(abs(one.limited) for one in self.waiting if not one.rise)
        both = (2 * min(rises, falls) + TRUST * self.mean) / (len(self.waiting) + TRUST)
        return self.number(1.2533141) * max(self.mean, both)

    def add(self, one: Innovation, n: int, *, suspected: bool) -> None:
        """Add the n-th innovation."""
        self.waiting.append(one)
        if not suspected or len(self.waiting) >= PATIENCE:
            self.learn(n)
        self.due -= 1
        if self.due == 0:
            self.due = 1 if n < FEWEST else 8
            self.correlation = self._corrected()

    def learn(self, n: int) -> None:
        """Learn what waits, as if all magnitudes were their mean."""
        waited = len(self.waiting)
        share = max(self.number(SHARE), 1 / self.number(n))
        older = (1 - share) ** waited if n > waited else 0
        mean = sum(abs(one.limited) for one in self.waiting) / waited
        self.mean += (1 - older) * (mean - self.mean)
        forgetting = self.number(FORGETTING)
        for one in self.waiting:
            if not one.outlier:
                self.lag0 = forgetting * self.lag0 + one.counted**2
                self.lag1 = forgetting * self.lag1 + one.counted * one.before
                self.count = forgetting * self.count + 1
        self.waiting = []

    def _corrected(self) -> Any:
        """Return the autocorrelation, corrected for Kendall's bias, -(1 + 3 r) / n, within +-(FEWEST - 1) / (FEWEST + 1)."""
        if not self.lag0 > 0:
            return self.number(0)
        found = self.lag1 / self.lag0
        limit = self.number(FEWEST - 1) / (FEWEST + 1)
        return max(-limit, min(limit, found + (1 + 3 * found) / self.count))


@dataclass
class Outliers:
    """The last outliers in a row, as pairs of innovation and regressor."""

    number: Callable[[Any], Any]
    decisions: Decisions
    row: list[tuple[Any, Any]] = field(default_factory=list)
    counted_from: int = 0  # those before are not judged: there was a hand-over

    def add(self, innovation: Any, regressor: Any, *, outlier: bool) -> None:
        """Add an innovation; one that is no outlier ends the row."""
        if outlier:
            self.row.append((innovation, regressor))
        else:
            self.row = []
            self.counted_from = 0

    def begin_anew(self) -> None:
        """Judge the outliers from here on only by themselves."""
        self.counted_from = len(self.row)

    def is_burst(self) -> bool:
        """Return whether they are not as large as their regressors, as after a change of the ratio; each counts half of the next."""
        judged = self.row[self.counted_from :]
        steps = size = self.number(0)
        for place, (e, x) in enumerate(judged):
            e_before, x_before = judged[max(place - 1, 0)]
            steps = steps / 2 + abs(e * x_before - e_before * x)
            size = size / 2 + abs(e * x)
        return self.decisions.above(3 * steps, size)

    def of_one_sign(self) -> int:
        """Return how many of the last ones are for a rise of the ratio, or for a fall."""
        signs = [e * x > 0 for e, x in self.row]
        count = 0
        while count < len(signs) and signs[-1 - count] == signs[-1]:
            count += 1
        return count

    def is_slide(self) -> bool:
        """Return whether the ratio slides: there are many of one sign."""
        return self.of_one_sign() > SLIDE and not self.is_burst()


@dataclass
class ShortMemory:
    """The ratio of the last few samples, and whether it is read in place of that of the windows."""

    number: Callable[[Any], Any]
    decisions: Decisions
    ratio: Any = 0
    information: Any = 0
    trend: Any = 0  # mean step of the ratio
    miss: Any = 0  # mean squares of what it did not predict, and of what the windows did not
    other_miss: Any = 0
    same: int = ONE_SIGN  # samples since the regressor changed its sign
    is_read: bool = False

    def leading(self) -> Any:
        """Return the ratio, less what it is behind."""
        forgetting = self.number(SHORT)
        return self.ratio + forgetting / (1 - forgetting) * self.trend

    def add(self, sample: Sample, other: Any, most: Any, n: int) -> None:
        """Add the n-th sample; the windows have the ratio `other`; a square above both `most` and theirs counts as that."""
        weight, output, regressor = sample
        share = max(1 / self.number(JUDGED), 1 / self.number(n))
        error = output - self.ratio * regressor
        other_square = (output - other * regressor) ** 2
        square = error**2 if most is None else min(error**2, max(most, other_square))
        self.miss += share * (square - self.miss)
        self.other_miss += share * (other_square - self.other_miss)
        self.information = self.number(SHORT) * self.information + weight * regressor
        if self.information > 0:
            step = weight / self.information * error
            self.ratio += step
            self.trend += share * (step - self.trend)

    def choose(self, regressor: Any, before: Any, n: int) -> None:
        """Read it from now on if it predicts much better than the windows do, at the n-th sample."""
        self.same = 0 if before * regressor < 0 else self.same + 1
        times = BETTER / 2 if self.is_read else BETTER
        self.is_read = (
            self.same >= ONE_SIGN
            and n > EARLY
            and self.decisions.above(self.other_miss, self.number(times) * self.miss)
        )

    def restart(self, ratio: Any, information: Any) -> None:
        """Go on from this ratio; the trend and the errors stay."""
        self.ratio = ratio
        self.information = information
        self.is_read = False


class Judged(NamedTuple):
    """An innovation and what the detector takes of it; the scale; whether the ratio leaves the sample out."""

    innovation: Any
    limited: Any
    counted: Any
    scale: Any
    outlier: bool


class AdaptiveWindow:
    """The estimator."""

    def __init__(self, number: Callable[[Any], Any], settings: Settings) -> None:
        self.number = number
        self.settings = settings
        self.decisions = Decisions()
        self.windows = Windows(number, self.decisions)
        self.memory = ShortMemory(number, self.decisions)
        self.noise = Noise(number, number(0))
        self.outliers = Outliers(number, self.decisions)
        self.sides = self._sides()
        self.instrument = number(0)
        self.ratio = settings.initial_ratio
        self.first_ratio = settings.initial_ratio  # until the windows have one
        self.last = Sample(number(0), number(0), number(0))
        self.earlier = number(0)  # the ratio before the last change
        self.usual_information = number(0)  # of a sample
        self.mean_square = number(0)  # of the window, weighted with the information
        self.claim: Any = None  # ratio of the last outlier with more information than all before
        self.alarm = False
        self.counts = False  # the last sample is one of those of the ratio
        self.seen = 0

    def update(self, output: Any, regressor: Any) -> tuple[Any, ...]:
        """Take a sample; return a row of `AdaptiveWindowTrace`."""
        self.decisions.margin = np.inf
        sample = Sample(self._weight(regressor), output, regressor)
        if not self.information() > 0 and regressor != 0:
            self.first_ratio = output / regressor
            self.memory.restart(self.first_ratio, self.number(0))
        innovation = output - regressor * self.ratio
        if self._tells(sample):
            self._follow(sample)
        else:
            self.counts = False
            self.usual_information *= self.number(STILL_USUAL)
            self._after_alarm()
        information = self.information()
        covariance = 1 / information if information > 0 else self.number("inf")
        error = self.standard_error()
        state = (self.ratio, covariance, innovation, self.statistic(), error)
        return (*state, self.alarm, self.decisions.margin)

    def _tells(self, sample: Sample) -> bool:
        """Return whether a sample says something of the ratio: others are noise over noise, as between two pulses."""
        information = sample.weight * sample.regressor
        return information > 0 and not self.decisions.above(
            self.usual_information, TELLS * information
        )

    def _follow(self, sample: Sample) -> None:
        """Judge a sample, follow it, and learn the noise."""
        regressor = sample.regressor
        judged = self._judge(sample)
        self.counts = not judged.outlier
        self._watch(sample, judged)
        self.seen += 1
        if not judged.outlier or self.outliers.of_one_sign() > 2 or self.memory.is_read:
            most = 100 * judged.scale**2 if self.seen > WARM_UP else None
            self.memory.add(sample, self._of_windows(), most, self.seen)
        self._take(sample, judged)
        self._learn(regressor, judged)
        if judged.outlier and not self.decisions.above(
            self.information(), sample.weight * regressor
        ):
            self.claim = sample.output / regressor
        self.memory.choose(regressor, self.last.regressor, self.seen)
        share = max(self.settings.smoothing, 1 / self.number(self.seen))
        self.instrument += share * (regressor - self.instrument)
        self.ratio = self.memory.leading() if self.memory.is_read else self._of_windows()
        self.last = sample

    def standard_error(self) -> Any:
        """Return the standard error of the ratio: 1.96 of it are its 95 % interval."""
        square = self._of_memory_square() if self.memory.is_read else self._of_windows_square()
        if square is None:
            return self.number("nan")
        return root(square + (self.number(ROUNDING) * self.ratio) ** 2)

    def motion(self) -> Any:
        """Return how far the ratio moves from sample to sample; 0 where it is at rest."""
        moves = self.memory.is_read or self.windows.moves()
        return self.memory.trend if moves else self.number(0)

    def information(self) -> Any:
        """Return the information of the windows."""
        return self.windows.all().information

    def statistic(self) -> Any:
        """Return the larger CUSUM side."""
        rise, fall = self.sides
        return max(rise.statistic, fall.statistic)

    def _sides(self) -> tuple[Side, Side]:
        """Return CUSUM sides at 0: of a rise of the ratio, and of a fall."""
        return Side(self.number(0)), Side(self.number(0))

    def _of_windows(self) -> Any:
        """Return the ratio of the windows."""
        sums = self.windows.all()
        return sums.ratio if sums.information > 0 else self.first_ratio

    def _weight(self, regressor: Any) -> Any:
        """Return the mean of the earlier regressors; the regressor itself if both differ by a factor of 4 or in sign."""
        mean = abs(self.instrument)
        x = abs(regressor)
        if not self.instrument * regressor > 0:
            return regressor
        near = self.decisions.above(4 * x, mean) and self.decisions.above(4 * mean, x)
        return self.instrument if near else regressor

    def _scale(self, sample: Sample) -> Any:
        """Return the standard deviation of the whitened innovations; at least what rounding does."""
        scale = self.noise.scale()
        if WARM_UP <= self.seen < DOUBTED:
            scale *= 1 + 3 / self.number(self.seen - TRANSIENT + 1)
        size = max(abs(sample.output), abs(self.ratio * sample.regressor))
        return max(scale, self.number(LEAST_SCALE) * size)

    def _judge(self, sample: Sample) -> Judged:
        innovation = sample.output - sample.regressor * self.ratio
        whitened = innovation - self.noise.forecast()
        scale = self._scale(sample)
        limit = self.settings.clip * scale
        if self.seen < WARM_UP or not abs(whitened) > limit:
            return Judged(innovation, whitened, innovation, scale, outlier=False)
        limited = limit if whitened > 0 else -limit
        outlier = self._is_outlier(sample, whitened, limit)
        return Judged(innovation, limited, self.noise.forecast() + limited, scale, outlier)

    def _is_outlier(self, sample: Sample, whitened: Any, limit: Any) -> bool:
        """Return whether a sample is too far from the ratio of those before it, which is uncertain.

        With more information than all before it, two that agree are none: the first pulses after noise.
        """
        before = self.information()
        information = sample.weight * sample.regressor
        if not self.decisions.above(whitened**2, limit**2 * (1 + information / before)):
            return False
        if self.decisions.above(before, information):
            return True
        return self.claim is None or self.decisions.above(
            abs(sample.output - self.claim * sample.regressor), 2 * limit
        )

    def _after_alarm(self) -> None:
        """Start the CUSUM again."""
        if self.alarm:
            self.sides = self._sides()
            self.alarm = False

    def _watch(self, sample: Sample, judged: Judged) -> None:
        """Add the innovation to the CUSUM, which starts again after an alarm, and to the outliers in a row."""
        self._after_alarm()
        if self.seen >= WARM_UP:
            z = self._towards_a_larger_ratio(sample, judged)
            rise, fall = self.sides
            rise.add(z - self.settings.drift, sample, self.decisions)
            fall.add(-z - self.settings.drift, sample, self.decisions)
        self.outliers.add(judged.innovation, sample.regressor, outlier=judged.outlier)

    def _towards_a_larger_ratio(self, sample: Sample, judged: Judged) -> Any:
        """Return the limited innovation in units of its scale, with the regressor's sign."""
        if not judged.scale > 0:
            return self.number(0)
        z = judged.limited / judged.scale
        return -z if sample.regressor < 0 else z

    def _take(self, sample: Sample, judged: Judged) -> None:
        """Hand over at an alarm, otherwise add the sample to the windows; an alarm by a burst starts the CUSUM again."""
        above = self.decisions.above(self.statistic(), self.settings.threshold)
        slides = self.outliers.is_slide()
        if above and self.outliers.is_burst():
            self.sides = self._sides()
        elif slides and self.settings.threshold < np.inf:
            self._hand_over([self.last, sample], sample)
        elif above:
            rise, fall = self.sides
            rises = self.decisions.above(rise.statistic, fall.statistic)
            self._hand_over((rise if rises else fall).samples[self.settings.guard :], sample)
        elif not judged.outlier:
            learns = not self.memory.is_read
            self.alarm = self.windows.add(sample, learns=learns, cut_square=self.settings.cut**2)
            information = sample.weight * sample.regressor
            self._count_usual(information)
            share = information / self.information()
            self.mean_square += share * (information - self.mean_square)

    def _count_usual(self, information: Any) -> None:
        """Add a sample to the usual information: quickly if it is beyond it, but one alone makes no other unusual."""
        usual = self.usual_information
        if not usual > 0:
            self.usual_information = information
        elif self.decisions.above(information, TELLS * usual):
            self.usual_information = self.number(TELLS) / 2 * usual
        else:
            share = information / (information + RARELY * usual)
            self.usual_information += share * (information - usual)

    def _hand_over(self, since: list[Sample], last: Sample) -> None:
        """Keep only the samples since a change; the last one if they have no information."""
        self.alarm = True
        if not self.windows.sums(since).information > 0:
            since = [last]
        sums = self.windows.sums(since)
        self._note_change(self._of_windows(), sums.ratio)
        self.windows.restart(since)
        self.memory.restart(sums.ratio, sums.information)
        self.outliers.begin_anew()

    def _note_change(self, before: Any, after: Any) -> None:
        """Learn the noise that waits if a ratio comes back."""
        returns = self.decisions.above(abs(after - before), 2 * abs(after - self.earlier))
        if returns and self.noise.waiting:
            self.noise.learn(self.seen - TRANSIENT)
        self.earlier = before

    def _learn(self, regressor: Any, judged: Judged) -> None:
        """Learn the noise, unless this was a change."""
        noise = self.noise
        if self.alarm:
            noise.waiting = []
        elif self.seen > TRANSIENT:
            statistic = self.statistic()
            suspected = self.seen >= FIRST and self.decisions.above(statistic, SUSPICION)
            rise = (judged.limited > 0) != (regressor < 0)
            one = Innovation(judged.limited, judged.counted, noise.before, rise, judged.outlier)
            noise.add(one, self.seen - TRANSIENT, suspected=suspected)
        noise.before = self.number(0) if self.alarm else judged.counted

    def _of_windows_square(self) -> Any:
        """Return the variance of the ratio of the windows, wider where few contrasts show the noise; None if unknown."""
        if not self.information() > 0:
            return None
        variance = self.windows.variance()
        if variance is None:
            return None
        normal_square = self.number(NORMAL) ** 2
        widening = student_square(normal_square, variance.freedom) / normal_square
        return variance.noise * widening + variance.moved

    def _of_memory_square(self) -> Any:
        """Return the variance of the ratio of the short memory: as large as what it did not predict."""
        regressor = max(abs(self.last.regressor), abs(self.instrument))
        return self.memory.miss / regressor**2 if regressor > 0 else None


def adaptive_window(
    output: ArrayLike,
    regressor: ArrayLike,
    *,
    drift: float,
    threshold: float,
    cut: float,
    clip: float,
    smoothing: float,
    guard: int,
    initial_ratio: float,
    number: Callable[[Any], Any] = np.float64,
) -> AdaptiveWindowTrace:
    """Ratio of two signals from windows that adapt, with two detectors of a change: reference of `palpate.HandoverRls`.

    Parameters
    ----------
    output, regressor : array_like, shape (n,), pF
        Finite capacitance changes of the hard and the soft channel.
    drift, threshold : float, standard deviations
        Slack and limit of the CUSUM; without a limit, inf, there is no alarm.
    cut : float
        Normal deviate of the difference at which older samples are cut; inf for never.
    clip, smoothing, guard, initial_ratio : float
        As in `palpate.HandoverRls`; guard, a count, is an int.
    number : callable
        Type of all calculations: numpy.float64 or decimal.Decimal.

    Returns
    -------
    AdaptiveWindowTrace
        Ratio, covariance, innovation, statistic, standard error, alarm and margin after each sample.

    Raises
    ------
    ValueError
        A sample that is not finite, or arrays of different lengths.

    Notes
    -----
    Sums are about a ratio of 0: with numpy.float64 they lose digits where the noise is much smaller than the output.

    Examples
    --------
    >>> from palpate.reference import adaptive_window
    >>> settings = {"drift": 0.75, "threshold": 11, "cut": 5, "clip": 3, "smoothing": 0.0625, "guard": 0}
    >>> adaptive_window([0.5, 0.52], [0.25, 0.26], **settings, initial_ratio=1).ratio.round(4)
    array([2., 2.])
    """
    pairs = finite(output, regressor, number)
    cusum = (number(drift), number(threshold), number(cut), number(clip))
    settings = Settings(*cusum, number(smoothing), guard, number(initial_ratio))
    state = AdaptiveWindow(number, settings)
    rows = [state.update(y, x) for y, x in pairs]
    columns = [np.array(column) for column in zip(*rows, strict=True)] or [np.array([])] * 7
    return AdaptiveWindowTrace._make([*columns[:5], columns[5].astype(bool), columns[6]])
