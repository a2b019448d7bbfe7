"""The rules of the reference of HandoverRls, each with a variant of the reference that does not have it.

A variant is the reference with other names in its modules while it runs: a constant, a function, or a class of which one
method is another one.
"""

import math
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np
import palpate
from palpate.reference import adaptive, dyadic_windows
from palpate.reference.adaptive import (
    AdaptiveWindow,
    Innovation,
    Judged,
    Noise,
    Outliers,
    ShortMemory,
)
from palpate.reference.dyadic_windows import Block, Pooled, Sample, Sums, Windows

from bench.accuracy.signal_followers import Trace
from bench.accuracy.signal_worlds import Signals

CUT = 5.0
"""Normal deviate of a cut: the default of the core. `palpate.HandoverRls` has no such setting."""
NEVER = math.inf


@dataclass(frozen=True)
class Limits:
    """Limits of the detectors; None for the one of `palpate.HandoverRls`."""

    threshold: float | None = None
    cut: float | None = None
    clip: float | None = None


AS_IT_IS = Limits()


@dataclass(frozen=True)
class Replacement:
    """A name of a module of the reference, and another value of it."""

    module: ModuleType
    name: str
    value: Any


@dataclass(frozen=True)
class Rule:
    """A rule of the estimator, and the estimator without it.

    Attributes
    ----------
    name, phrase : str
        What it is called here; what it does.
    replacements : tuple of Replacement
    limits : Limits
    """

    name: str
    phrase: str
    replacements: tuple[Replacement, ...] = ()
    limits: Limits = AS_IT_IS


def faster_sums(windows: Windows, blocks: Iterable[Block]) -> Sums:
    """Return `Windows.of_blocks` with the same additions, without an object for each partial sum."""
    moment = information = windows.number(0)
    for block in blocks:
        moment += block.sums.moment
        information += block.sums.information
    return Sums(moment, information)


@contextmanager
def without(rule: Rule) -> Iterator[None]:
    """Replace the names of a rule for a while, and what takes most of the run time by the same calculation."""
    with ExitStack() as stack:
        stack.enter_context(patch.object(Windows, "of_blocks", faster_sums))
        for one in rule.replacements:
            stack.enter_context(patch.object(one.module, one.name, one.value))
        yield


def chosen(limit: float | None, usual: float) -> float:
    """Return a limit, or the usual one if it is None."""
    return usual if limit is None else limit


def follow(signals: Signals, limits: Limits = AS_IT_IS) -> Trace:
    """Follow with the reference, with the settings of `palpate.HandoverRls`."""
    estimator = palpate.HandoverRls()
    settings = estimator.settings
    # Variants may divide by 0, or add infinite numbers.
    with np.errstate(all="ignore"):
        rows = adaptive.adaptive_window(
            signals.output,
            signals.regressor,
            drift=settings["smallest_shift"] / 2,
            threshold=chosen(limits.threshold, estimator.threshold),
            cut=chosen(limits.cut, CUT),
            clip=chosen(limits.clip, settings["clip"]),
            smoothing=settings["smoothing"],
            guard=int(settings["guard"]),
            initial_ratio=settings["initial_ratio"],
        )
    return Trace(rows.ratio, rows.standard_error, rows.alarm)


def constant(name: str, value: Any) -> tuple[Replacement, ...]:
    """Return another value of a name of the detectors."""
    return (Replacement(adaptive, name, value),)


def of_windows(name: str, value: Any) -> tuple[Replacement, ...]:
    """Return another value of a name of the windows."""
    return (Replacement(dyadic_windows, name, value),)


def part(variant: type) -> tuple[Replacement, ...]:
    """Return a subclass that replaces its base class."""
    return (Replacement(adaptive, variant.__bases__[0].__name__, variant),)


def normal_square(square: Any, freedom: Any) -> Any:
    """Take the noise as known."""
    return square


# The estimator.


class WeightOfRegressor(AdaptiveWindow):
    """Least squares: each sample has the weight of its own regressor."""

    def _weight(self, regressor: Any) -> Any:
        return regressor


class WeightOfMean(AdaptiveWindow):
    """The mean regressor is the weight of each sample of its sign."""

    def _weight(self, regressor: Any) -> Any:
        return self.instrument if self.instrument * regressor > 0 else regressor


class OutliersTaken(AdaptiveWindow):
    """Outliers are limited in the detector, and the ratio has them."""

    def _judge(self, sample: Sample) -> Judged:
        return super()._judge(sample)._replace(outlier=False)


class WithoutLeverage(AdaptiveWindow):
    """All that is limited is an outlier."""

    def _is_outlier(self, sample: Sample, whitened: Any, limit: Any) -> bool:
        return True


class EachIsConfirmed(AdaptiveWindow):
    """A sample with more information than all before it is no outlier."""

    def _is_outlier(self, sample: Sample, whitened: Any, limit: Any) -> bool:
        alone = sample.weight * sample.regressor >= self.information()
        return not alone and super()._is_outlier(sample, whitened, limit)


class WithoutReturns(AdaptiveWindow):
    """Noise that waits is not learned when a ratio comes back."""

    def _note_change(self, before: Any, after: Any) -> None:
        pass


class LastTwo(AdaptiveWindow):
    """A hand-over keeps the last two samples only."""

    def _hand_over(self, since: list[Sample], last: Sample) -> None:
        super()._hand_over(since[-2:], last)


class ChangesAreNoise(AdaptiveWindow):
    """What waits at an alarm is learned later."""

    def _learn(self, regressor: Any, judged: Judged) -> None:
        waiting = self.noise.waiting
        super()._learn(regressor, judged)
        if self.alarm:
            self.noise.waiting = waiting


# The noise.


class White(Noise):
    """No innovation says anything of the next one."""

    def _corrected(self) -> Any:
        return self.number(0)


class Biased(Noise):
    """The autocorrelation as it is found."""

    def _corrected(self) -> Any:
        if not self.lag0 > 0:
            return self.number(0)
        limit = self.number(adaptive.FEWEST - 1) / (adaptive.FEWEST + 1)
        return max(-limit, min(limit, self.lag1 / self.lag0))


class LearnedOnly(Noise):
    """What waits does not count in the scale."""

    def scale(self) -> Any:
        """Return the standard deviation of what is learned."""
        return self.number(1.2533141) * self.mean


class OutliersCorrelate(Noise):
    """The autocorrelation has outliers, too."""

    def add(self, one: Innovation, n: int, *, suspected: bool) -> None:
        """Add an innovation as no outlier."""
        super().add(one._replace(outlier=False), n, suspected=suspected)


# Outliers in a row.


class WithoutBursts(Outliers):
    """Outliers in a row are never a burst."""

    def is_burst(self) -> bool:
        """Return False."""
        return False


class JudgedTogether(Outliers):
    """Outliers from before a hand-over are judged, too."""

    def begin_anew(self) -> None:
        """Change nothing."""


class OutOfMemory(Outliers):
    """Only slides count outliers of one sign, so that the short memory takes none."""

    def of_one_sign(self) -> int:
        """Return 0, for the short memory."""
        return 0

    def is_slide(self) -> bool:
        """Return whether the ratio slides."""
        return super().of_one_sign() > adaptive.SLIDE and not self.is_burst()


# The short memory.


class WithoutTrend(ShortMemory):
    """The ratio is late by the memory."""

    def leading(self) -> Any:
        """Return the ratio."""
        return self.ratio


class EachErrorCounts(ShortMemory):
    """One error, however large, counts in full."""

    def add(self, sample: Sample, other: Any, most: Any, n: int) -> None:
        """Add a sample without a limit of its square."""
        super().add(sample, other, None, n)


class OneLimit(ShortMemory):
    """It must be as much better to go on as to begin."""

    def choose(self, regressor: Any, before: Any, n: int) -> None:
        """Choose as if it were not read."""
        self.is_read = False
        super().choose(regressor, before, n)


# The windows.


class ReadWhole(Windows):
    """All samples since the last cut are read."""

    def _choose(self) -> None:
        self.read = self._blocks()


class StandsStill(Windows):
    """The ratio has not moved within the window."""

    def _moved_square(self, noise: Any) -> Any:
        return self.number(0)


class NoMotion(Windows):
    """A change is over at once."""

    def _expect_motion(self, change: Any, information: Any, left: Any) -> None:
        pass


class WithoutScatter(Windows):
    """Limits do not know the contrasts within the window."""

    def _scatter(self, window: list[Any]) -> Any:
        return self.number(0)


class AllLevels(Windows):
    """The noise is the mean of all levels."""

    def _joins(self, pooled: Pooled, finer: Any) -> bool:
        return True


class LearnedContrasts(Windows):
    """The standard error has the contrasts of pairs of blocks only."""

    def _noise_of_all(self) -> Pooled:
        pooled = Pooled(self.number(0), self.number(0))
        for learned in reversed(self.learned):
            if not self._joins(pooled, learned):
                break
            pooled = pooled.with_(learned)
        return pooled


class LearnsAlways(Windows):
    """Contrasts are learned while the short memory is read, too."""

    def add(self, sample: Sample, *, learns: bool, cut_square: Any) -> bool:
        """Add a sample; its contrasts are learned."""
        return super().add(sample, learns=True, cut_square=cut_square)


RULES = (
    Rule("CUSUM", "a hand-over at its alarm", limits=Limits(threshold=NEVER)),
    Rule("cut", "windows drop what differs from them", limits=Limits(cut=NEVER)),
    Rule("reading", "the longest window that agrees with shorter ones", part(ReadWhole)),
    Rule("clip", "innovations are limited, outliers known", limits=Limits(clip=NEVER)),
    Rule("outliers out", "the ratio leaves them out", part(OutliersTaken)),
    Rule("leverage", "no outlier where the ratio is uncertain", part(WithoutLeverage)),
    Rule("two agree", "of outliers with more information than all before", part(EachIsConfirmed)),
    Rule("slide", "a hand-over after outliers of one sign", constant("SLIDE", NEVER)),
    Rule("burst", "no hand-over for outliers unlike a change", part(WithoutBursts)),
    Rule("begin anew", "a burst is judged from the hand-over on", part(JudgedTogether)),
    Rule("samples since", "a hand-over keeps those since the CUSUM was 0", part(LastTwo)),
    Rule("instrument", "the mean regressor as weight", part(WeightOfRegressor)),
    Rule("near the mean", "only of regressors within a factor of 4", part(WeightOfMean)),
    Rule("TELLS", "samples that say nothing are left out", constant("TELLS", NEVER)),
    Rule("STILL_USUAL", "and are usual after a while", constant("STILL_USUAL", 1.0)),
    Rule("WARM_UP", "the detector starts after 8 samples", constant("WARM_UP", adaptive.TRANSIENT)),
    Rule("TRANSIENT", "the first innovations are no noise", constant("TRANSIENT", 0)),
    Rule("FIRST", "nothing is suspected in 16 samples", constant("FIRST", 0)),
    Rule("DOUBTED", "a larger scale in 64 samples", constant("DOUBTED", 0)),
    Rule("SUSPICION", "noise waits while a change is suspected", constant("SUSPICION", NEVER)),
    Rule("PATIENCE", "and is learned after 128 samples", constant("PATIENCE", NEVER)),
    Rule("both signs", "what waits with both signs counts at once", part(LearnedOnly)),
    Rule("changes dropped", "what waits at an alarm is no noise", part(ChangesAreNoise)),
    Rule("returns", "what waits is learned if a ratio comes back", part(WithoutReturns)),
    Rule("SHARE", "the scale forgets", constant("SHARE", 0.0)),
    Rule("FORGETTING", "the autocorrelation forgets", constant("FORGETTING", 1.0)),
    Rule("whitening", "innovations less their forecast", part(White)),
    Rule("Kendall", "the autocorrelation is corrected for its bias", part(Biased)),
    Rule("outliers unlearned", "the autocorrelation is without outliers", part(OutliersCorrelate)),
    Rule("LEAST_SCALE", "a scale of a few rounding errors", constant("LEAST_SCALE", 0.0)),
    Rule("ROUNDING", "a standard error of a rounding error", constant("ROUNDING", 0.0)),
    Rule("short memory", "read where it predicts much better", constant("BETTER", NEVER)),
    Rule("its trend", "its ratio less what it is behind", part(WithoutTrend)),
    Rule("its limit", "one large error does not decide", part(EachErrorCounts)),
    Rule("its hysteresis", "it is read on with half of the advantage", part(OneLimit)),
    Rule("third outlier", "it takes outliers from the third in a row on", part(OutOfMemory)),
    Rule("ONE_SIGN", "not read where the regressor changes its sign", constant("ONE_SIGN", 0)),
    Rule("EARLY", "not read in 10 samples", constant("EARLY", 0)),
    Rule("not learning", "no contrasts while it is read", part(LearnsAlways)),
    Rule("Student: error", "few contrasts: a wider interval", constant("student_square", normal_square)),
    Rule("Student: limits", "few contrasts: wider limits", of_windows("student_square", normal_square)),
    Rule("FEWEST", "4 degrees of freedom for a test and an error", of_windows("FEWEST", 0)),
    Rule("moved", "the error knows how far the ratio moved", part(StandsStill)),
    Rule("motion", "and that it may move on after a change", part(NoMotion)),
    Rule("scatter", "limits know the contrasts within a window", part(WithoutScatter)),
    Rule("agreement", "finer levels join if their noise is the same", part(AllLevels)),
    Rule("ENOUGH", "few contrasts join without a test", of_windows("ENOUGH", 0)),
    Rule("older blocks", "the error knows each block against older ones", part(LearnedContrasts)),
    Rule("SHORTEST", "no test of less than 8 blocks", of_windows("SHORTEST", 2)),
    Rule("NEWEST", "4 blocks for how far the ratio moved", of_windows("NEWEST", 1)),
    Rule("MEMORY", "contrasts are forgotten", of_windows("MEMORY", 1e9)),
    Rule("KEPT", "and most of them at a cut", of_windows("KEPT", 1e9)),
)  # fmt: skip
