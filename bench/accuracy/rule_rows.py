"""The rows of the bench of rules: short worlds, each of which needs some of the rules, and what is measured in them.

Of most worlds of signal_worlds only a part is taken, as the reference in plain Python needs about .2 ms for a sample.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from bench.accuracy import signal_worlds as worlds
from bench.accuracy.signal_followers import Trace
from bench.accuracy.signal_rows import begun, held, rms
from bench.accuracy.signal_worlds import Signals

Array = NDArray[np.float64]
EVERY = slice(None)


def part_of(signals: Signals, part: slice) -> Signals:
    """Return some of the samples of two signals."""
    return Signals(
        signals.output[part], signals.regressor[part], signals.ratio[part], signals.noise
    )


# Worlds. `sd` is the standard deviation of the noise of the output.


def late(seed: int) -> Signals:
    """Return 200 samples of a sine of 60 samples that is one sample late."""
    return part_of(worlds.late_sine(seed, 60.0, 1.0, 0.0), slice(200))


def offset(seed: int) -> Signals:
    """Return 200 samples of a sine of 60 samples with an offset of 2 % of its amplitude, from a random phase on."""
    begin = int(worlds.generator(seed, 200).integers(60))
    signals = worlds.late_sine(seed, 60.0, 0.0, 0.06)
    return part_of(signals, slice(begin, begin + 200))


SMALL_AT = 300


def small_step(seed: int) -> Signals:
    """Return a ratio that steps by .75 sd after 300 of 601 samples."""
    return part_of(worlds.small_step(seed, 0.75), slice(1000 - SMALL_AT, None))


def relaxing(seed: int) -> Signals:
    """Return a ratio that relaxes by 20 % with a time constant of 80 samples, 200 in all, from a press of 8 samples on."""
    random = worlds.generator(seed, 201)
    k = np.arange(200)
    regressor = np.minimum(1, (k + 1) / 8) * worlds.wandering(random, 200)
    ratio = 2.5 * (1 + 0.2 * np.exp(-k / 80))
    sd = 0.005
    return worlds.noisy(regressor, ratio, sd * random.standard_normal(200), sd)


def drifting(seed: int) -> Signals:
    """Return a ratio that drifts by 2 sd in 600 samples."""
    return part_of(worlds.drifting(seed, 2 / 0.6), slice(600))


FAST_SD = 0.01


def fast(seed: int) -> Signals:
    """Return a ratio that swings by 30 sd with a period of 40 samples."""
    random = worlds.generator(seed, 202)
    regressor = random.uniform(0.5, 1.5, 160)
    phase = random.uniform(0, 2 * math.pi)
    ratio = 2 + 30 * FAST_SD * np.sin(2 * math.pi * np.arange(160) / 40 + phase)
    return worlds.noisy(regressor, ratio, FAST_SD * random.standard_normal(160), FAST_SD)


BACK = 120


def step_and_back(seed: int) -> Signals:
    """Return a ratio that steps by 20 % after 80 samples, and back 40 samples later, 200 in all."""
    random = worlds.generator(seed, 203)
    regressor = worlds.wandering(random, 200)
    ratio = worlds.stepped(200, 80, 2.5, 3.0)
    ratio[BACK:] = 2.5
    return worlds.noisy(regressor, ratio, 0.01 * random.standard_normal(200), 0.01)


BURST_AT = 150


def burst(seed: int) -> Signals:
    """Return a ratio of 2 in noise that is 30 times as large in 20 samples from 150 on, 230 in all."""
    random = worlds.generator(seed, 204)
    regressor = random.uniform(0.5, 1.5, 230)
    noise = 0.01 * random.standard_normal(230)
    noise[BURST_AT : BURST_AT + 20] *= 30
    return worlds.noisy(regressor, np.full(230, 2.0), noise, 0.01)


def pulses(seed: int) -> Signals:
    """Return pulses of 12 samples at the end of each 92, 552 in all.

    The output has a noise of .01, the regressor one of .005 that the output does not have; between pulses this is all.
    """
    random = worlds.generator(seed, 205)
    within = np.arange(552) % 92 >= 80
    regressor = np.where(within, 1 + 0.05 * random.standard_normal(552), 0.0)
    output = 2 * regressor + 0.01 * random.standard_normal(552)
    regressor = regressor + 0.005 * random.standard_normal(552)
    return Signals(output, regressor, np.full(552, 2.0), 0.01)


def false_reading(seed: int) -> Signals:
    """Return a ratio of 2 in noise, with one reading that is 4e5 and 5e5 times too large, 200 samples."""
    random = worlds.generator(seed, 211)
    regressor = random.uniform(0.5, 1.5, 200)
    output = 2 * regressor + 0.01 * random.standard_normal(200)
    regressor[100] *= 4e5
    output[100] *= 5e5
    return Signals(output, regressor, np.full(200, 2.0), 0.01)


def noise_in_regressor(seed: int) -> Signals:
    """Return a regressor of 1 with white noise of 20 %, that the output of a ratio of 2 does not have, 200 samples."""
    random = worlds.generator(seed, 206)
    output = 2 * worlds.wandering(random, 200) + 0.01 * random.standard_normal(200)
    regressor = output / 2 + 0.2 * random.standard_normal(200)
    return Signals(output, regressor, np.full(200, 2.0), 0.4)


def exact(seed: int) -> Signals:
    """Return 120 samples without noise: a ratio of 2.3, only rounded. The regressor is constant in the first 40 of them."""
    regressor = worlds.generator(seed, 207).uniform(0.5, 1.5, 120)
    regressor[:40] = 1
    return Signals(2.3 * regressor, regressor, np.full(120, 2.3), 0.0)


def quieter(seed: int) -> Signals:
    """Return a ratio of 2 in noise of .05, from 100 of 260 samples on of .01."""
    random = worlds.generator(seed, 208)
    regressor = random.uniform(0.5, 1.5, 260)
    noise = 0.01 * random.standard_normal(260)
    noise[:100] *= 5
    return worlds.noisy(regressor, np.full(260, 2.0), noise, 0.01)


def weaker(seed: int) -> Signals:
    """Return a regressor of 1, from 80 of 300 samples on of .05, and a ratio of 2, then of 2.4, in noise of .001."""
    random = worlds.generator(seed, 209)
    regressor = worlds.stepped(300, 80, 1.0, 0.05) * worlds.wandering(random, 300)
    ratio = worlds.stepped(300, 80, 2.0, 2.4)
    return worlds.noisy(regressor, ratio, 0.001 * random.standard_normal(300), 0.001)


def constant(size: int, regressor: str, noise: str) -> Callable[[int], Signals]:
    """Return the world of a constant ratio with this regressor and this noise."""

    def make(seed: int) -> Signals:
        return worlds.constant(seed, size, regressor, noise)

    return make


# Measures of one run.


def error_rms(signals: Signals, trace: Trace, part: slice) -> float:
    """Return the rms error of the ratio."""
    return rms((trace.ratio - signals.ratio)[part])


def largest_error(signals: Signals, trace: Trace, part: slice) -> float:
    """Return the largest error of the ratio, relative."""
    errors = (trace.ratio - signals.ratio) / signals.ratio
    return float(np.max(np.abs(errors[part])))


def coverage(signals: Signals, trace: Trace, part: slice) -> float:
    """Return the share of intervals of 95 % that hold; with a standard error of nan it does not."""
    return float(held(signals, trace, part).mean())


def known(signals: Signals, trace: Trace, part: slice) -> float:
    """Return the share of standard errors that are known."""
    return float(np.mean(np.isfinite(trace.error[part])))


def last_width(signals: Signals, trace: Trace, part: slice) -> float:
    """Return the last standard error; inf if it is nan."""
    error = float(trace.error[part][-1])
    return error if math.isfinite(error) else math.inf


def has_alarm(signals: Signals, trace: Trace, part: slice) -> float:
    """Return 1 if there is an alarm."""
    return float(trace.alarm[part].any())


def has_none(signals: Signals, trace: Trace, part: slice) -> float:
    """Return 1 if there is no alarm."""
    return 1 - has_alarm(signals, trace, part)


def alarm_rate(signals: Signals, trace: Trace, part: slice) -> float:
    """Return the alarms in 1,000 samples; one that lasts is one."""
    alarm = trace.alarm[part]
    return 1000 * begun(alarm) / len(alarm)


class Kind(Enum):
    """How the values of the runs are put together, and how two such numbers are compared; see `rules`."""

    RMS = "rms"
    MEDIAN = "median"
    RATE = "per 1,000"
    SHARE = "%"
    COVERAGE = "% held"


@dataclass(frozen=True)
class Measure:
    """A number of each run of a world.

    Attributes
    ----------
    name : str
    of : callable
        Value of a run, in a part of its samples.
    kind : Kind
    part : slice
    """

    name: str
    of: Callable[[Signals, Trace, slice], float]
    kind: Kind
    part: slice


@dataclass(frozen=True)
class World:
    """Signals, and what is measured in them.

    Attributes
    ----------
    name : str
    make : callable
        Signals of a seed.
    measures : tuple of Measure
    runs : int
        For each seed.
    """

    name: str
    make: Callable[[int], Signals]
    measures: tuple[Measure, ...]
    runs: int = 1


def error(part: slice) -> Measure:
    """Return the rms error of a part."""
    return Measure("error", error_rms, Kind.RMS, part)


def holding(part: slice) -> Measure:
    """Return the coverage of a part."""
    return Measure("coverage", coverage, Kind.COVERAGE, part)


WIDTH = Measure("width", last_width, Kind.MEDIAN, EVERY)
"""Of the interval after the last sample."""
FALSE_ALARM = Measure("runs with a false alarm", has_alarm, Kind.SHARE, EVERY)
ALARMS = Measure("alarms", alarm_rate, Kind.RATE, EVERY)


def from_(first: int) -> slice:
    """Return the samples from one on."""
    return slice(first, None)


def missed(begin: int) -> Measure:
    """Return how often there is no alarm from a change on."""
    return Measure("never found", has_none, Kind.SHARE, from_(begin))


AFTER_STEP = slice(80, 160)
SLIDES = from_(math.floor(worlds.PAIRS_PER_S * worlds.SLIDE_AT_S))
GROWN = from_(worlds.GROWS_AT + 50)
KNOWN = Measure("known", known, Kind.COVERAGE, from_(60))
LARGEST = Measure("largest error", largest_error, Kind.RMS, SLIDES)

WORLDS = (
    World("white, n 60", lambda seed: worlds.steady(seed, 60),
          (error(from_(20)), holding(from_(20)), WIDTH, FALSE_ALARM), runs=4),
    World("white, n 200", lambda seed: worlds.steady(seed, 200),
          (error(from_(60)), holding(from_(60)), WIDTH, FALSE_ALARM)),
    World("random walk x", constant(120, "random walk", "white"),
          (error(from_(20)), holding(from_(20)), WIDTH, FALSE_ALARM)),
    World("MA -.8", constant(160, "uniform .5-1.5", "MA -.8"), (holding(from_(60)), WIDTH)),
    World("AR .9", constant(300, "uniform .5-1.5", "AR .9"), (error(from_(100)), holding(from_(100)), ALARMS)),
    World("5 % outliers x 10", constant(200, "uniform .5-1.5", "5 % outliers"),
          (error(from_(60)), holding(from_(60)), WIDTH, FALSE_ALARM)),
    World("noise x 5", lambda seed: part_of(worlds.growing_noise(seed), slice(300)), (error(GROWN), holding(GROWN), FALSE_ALARM)),
    World("noise / 5", quieter, (error(from_(200)), holding(from_(200)), WIDTH)),
    World("weaker x", weaker, (error(from_(250)), holding(from_(250)))),
    World("burst", burst, (error(from_(BURST_AT)), holding(from_(BURST_AT)), FALSE_ALARM), runs=2),
    World("no noise", exact, (holding(from_(40)), FALSE_ALARM)),
    World("late sine", late, (error(from_(60)), KNOWN, ALARMS)),
    World("offset", offset, (error(from_(60)), KNOWN, ALARMS)),
    World("false reading", false_reading, (error(from_(100)), holding(from_(100)), FALSE_ALARM)),
    World("pulses", pulses, (error(from_(200)), holding(from_(200)), WIDTH, FALSE_ALARM)),
    World("noise in x", noise_in_regressor, (error(from_(100)), holding(from_(100)))),
    World("step 2 sd", lambda seed: part_of(worlds.early_step(seed, 2.0), slice(220)), (error(AFTER_STEP), missed(60))),
    World("step .75 sd", small_step, (error(from_(550)), holding(from_(550)))),
    World("step and back", step_and_back, (error(from_(BACK)), holding(from_(BACK)), ALARMS)),
    World("slide", lambda seed: worlds.slide(seed, 0.4, 0.3), (LARGEST, error(SLIDES), holding(SLIDES))),
    World("relaxing", relaxing, (error(from_(20)), holding(from_(20)))),
    World("drift", drifting, (error(from_(200)), holding(from_(200)))),
    World("fast swing", fast, (error(from_(60)), holding(from_(60)))),
)  # fmt: skip
"""The seeds of a world with several runs a seed are other ones for each run."""
