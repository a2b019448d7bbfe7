"""False alarms and delays of HandoverRls, and those that palpate.design computes for its settings.

    python -m bench.accuracy.design [--seeds 40]

The ratio is 2, the regressor is 1 with 2 % of wander, the innovations of the noise have a standard deviation of .01.

A shift is a step of the ratio, in standard deviations of the innovations. In AR(1) noise of rho .7, white innovations added
to .7 of the noise before, the step is 1 / (1 - .7) times as large. The whitened innovations then have this shift from the
second sample on; the first one is 1 / (1 - .7) times as large, and is clipped.

A delay is 1 if the alarm is at the first sample of the shift. A false alarm in the 300 samples after the shift counts as
found; a run with one before the shift is left out. Needs the extra science.
"""

import argparse
import math
import os
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from math import inf

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate import design

from bench.accuracy import signal_worlds
from bench.accuracy.signal_rows import begun
from bench.accuracy.signal_worlds import Array, Generator, Signals

RATIO = 2.0
SD = 0.01
BURN_IN = 100
FALSE_ALARMS_WORLD = 183
SHIFTS_WORLD = 184


@dataclass(frozen=True)
class Noise:
    """Noise of the output.

    Attributes
    ----------
    name : str
    innovations : str
        A name in `signal_worlds.NOISES`.
    rho : float, in [0, 1)
        Share of the noise before in each value.
    """

    name: str
    innovations: str
    rho: float = 0.0

    def make(self, random: Generator, size: int) -> Array:
        """Return noise whose innovations have a standard deviation of 1."""
        white = signal_worlds.NOISES[self.innovations](random, size + BURN_IN)
        return signal_worlds.coloured(white, self.rho)[BURN_IN:]


NOISES = (
    Noise("white normal", "white"),
    Noise("AR(.7)", "white", 0.7),
    Noise("Laplace", "Laplace"),
    Noise("t3", "t3"),
)


@dataclass(frozen=True)
class Choice:
    """What a user chooses, and what `palpate.design` computes for it.

    Attributes
    ----------
    false_alarm_interval : float, samples
    smallest_shift : float, standard deviations
    """

    false_alarm_interval: float = 1e7
    smallest_shift: float = 1.5

    def __str__(self) -> str:
        """Return the choice as arguments."""
        interval = rounded(self.false_alarm_interval, 0)
        return f"false_alarm_interval={interval}, smallest_shift={self.smallest_shift:g}"

    def estimator(self) -> palpate.HandoverRls:
        """Return a new estimator with this choice."""
        return palpate.HandoverRls(
            false_alarm_interval=self.false_alarm_interval, smallest_shift=self.smallest_shift
        )

    @property
    def clip(self) -> float:
        """Limit of a whitened innovation, standard deviations."""
        return float(self.estimator().settings["clip"])

    @property
    def cusum(self) -> design.Cusum:
        """The CUSUM that `design.cusum` computes; an estimator has a higher threshold."""
        return design.cusum(
            false_alarm_interval=self.false_alarm_interval,
            smallest_shift=self.smallest_shift,
            clip=self.clip,
        )

    def delay(self, threshold: float, shift: float) -> float:
        """Return the mean delay of a CUSUM with some threshold, samples."""
        return design.run_length(self.cusum.drift, threshold, shift=shift, clip=self.clip)


DEFAULT = Choice()
QUICK = Choice(false_alarm_interval=1e4, smallest_shift=1.0)


# False alarms.

RECORDS = {QUICK: 50_000, Choice(1e4): 50_000, Choice(1e5): 200_000, DEFAULT: 400_000}
"""Choice -> samples of each seed."""


@dataclass(frozen=True)
class FalseAlarms:
    """False alarms with one choice, in one noise.

    Attributes
    ----------
    choice : Choice
    noise : Noise
    samples : int
        Of all seeds.
    counts : NDArray, shape (seeds,)
        Alarms of both detectors.
    of_cusum : int
        Alarms of all seeds at which the CUSUM is above its threshold; the others are cuts by the windows.
    """

    choice: Choice
    noise: Noise
    samples: int
    counts: NDArray[np.int64]
    of_cusum: int

    @property
    def alarms(self) -> int:
        """Alarms of both detectors."""
        return int(self.counts.sum())

    @property
    def interval(self) -> float:
        """Samples to a false alarm; inf without one."""
        return mean_interval(self.samples, self.alarms)

    @property
    def dispersion(self) -> float:
        """Variance of the counts over their mean, 1 or more; 1 for a Poisson process. Alarms that follow each other have more."""
        if len(self.counts) < 2 or self.alarms == 0:
            return 1.0
        return max(1.0, float(self.counts.var(ddof=1) / self.counts.mean()))

    @property
    def limits(self) -> tuple[float, float]:
        """Of the 95 % interval of the mean time between false alarms: of a Poisson count (Garwood 1936), alarms / dispersion."""
        from scipy.stats import chi2

        independent = self.alarms / self.dispersion
        most = chi2.ppf(0.975, 2 * independent + 2) / 2
        fewest = chi2.ppf(0.025, 2 * independent) / 2 if independent else 0.0
        samples = self.samples / self.dispersion
        return samples / most, mean_interval(samples, fewest)

    @property
    def designed_of_cusum(self) -> float:
        """Mean time between false alarms of a CUSUM with the threshold of the estimator, in noise that is known."""
        threshold = self.choice.estimator().threshold
        return self.choice.delay(threshold, 0.0) / 2

    def __str__(self) -> str:
        """Return the row as text."""
        low, high = self.limits
        between = f"{rounded(low)} to {rounded(high)}"
        share = self.interval / self.choice.false_alarm_interval
        of_cusum = mean_interval(self.samples, self.of_cusum)
        text = f"{rounded(self.choice.false_alarm_interval, 0):>6}"
        text += f"{self.choice.smallest_shift:>7.1f}  {self.noise.name:14}"
        text += f"{rounded(self.samples):>9}{self.alarms:>8}{rounded(self.interval):>11}"
        text += f"{between:>18}{share:>10.2f}"
        return text + f"{rounded(of_cusum):>13}{rounded(self.designed_of_cusum):>10}"


FALSE_ALARMS_HEAD = """Samples to a false alarm of both detectors, with its 95 % interval; of the CUSUM alone, measured and designed
   set  shift  noise           samples  alarms    measured     95 % interval     / set     of CUSUM  designed"""


def mean_interval(samples: float, alarms: float) -> float:
    """Return the samples to an alarm; inf without one."""
    return samples / alarms if alarms else inf


def rounded(value: float, digits: int = 1) -> str:
    """Return a large number as text: 5.3e3."""
    return f"{value:.{digits}e}".replace("e+0", "e").replace("e+", "e")


def signals(noise: Noise, ratio: Array, random: Generator) -> Signals:
    """Return the signals of a ratio."""
    regressor = signal_worlds.wandering(random, len(ratio))
    return signal_worlds.noisy(regressor, ratio, SD * noise.make(random, len(ratio)), SD)


def false_alarms(choice: Choice, noise: Noise, samples: int, seeds: int) -> FalseAlarms:
    """Return the false alarms of one record a seed."""
    ratio = np.full(samples, RATIO)
    counts = []
    of_cusum = 0
    for seed in range(seeds):
        made = signals(noise, ratio, signal_worlds.generator(seed, FALSE_ALARMS_WORLD))
        estimator = choice.estimator()
        rows = estimator.trace(made.output, made.regressor)
        counts.append(begun(rows["alarm"]))
        of_cusum += begun(rows["alarm"] & (rows["statistic"] > estimator.threshold))
    return FalseAlarms(choice, noise, seeds * samples, np.array(counts), of_cusum)


# Delays.

RUNS = 15  # of each seed
AFTER = (60, 300, 2000)
SHIFTS = (1.0, 1.5, 2.0, 3.0)
LONGEST = 300


@dataclass(frozen=True)
class Delays:
    """Delays to the alarm with one choice, in one noise, after one shift.

    Attributes
    ----------
    choice : Choice
    noise : Noise
    after : int
        Samples before the shift.
    shift : float, standard deviations of the innovations
    delays : NDArray, shape (runs,), samples
        inf for a shift that was not found within 300 samples.
    """

    choice: Choice
    noise: Noise
    after: int
    shift: float
    delays: Array

    @property
    def mean(self) -> float:
        """Mean of those that were found; nan without one."""
        found = self.delays[np.isfinite(self.delays)]
        return float(found.mean()) if len(found) else math.nan

    @property
    def median(self) -> float:
        """Of all; nan without a run."""
        return float(np.median(self.delays)) if len(self.delays) else math.nan

    @property
    def lost(self) -> float:
        """Share that was not found within 300 samples; nan without a run."""
        return float(np.mean(np.isinf(self.delays))) if len(self.delays) else math.nan

    @property
    def of_design(self) -> float:
        """Mean delay of the CUSUM of `design.cusum`."""
        return self.choice.delay(self.choice.cusum.threshold, self.shift)

    @property
    def of_threshold(self) -> float:
        """Mean delay of a CUSUM with the threshold of the estimator."""
        return self.choice.delay(self.choice.estimator().threshold, self.shift)

    def __str__(self) -> str:
        """Return the row as text."""
        median = f"> {LONGEST}" if math.isinf(self.median) else f"{self.median:.0f}"
        text = f"{self.noise.name:14}{self.after:>6}{self.shift:>7.1f}{len(self.delays):>7}"
        text += f"{self.mean:>9.1f}{median:>8}{100 * self.lost:>8.1f} %"
        return text + f"{self.of_design:>15.1f}{self.of_threshold:>15.1f}"


DELAYS_HEAD = f"""{"noise":14}{"after":>6}{"shift":>7}{"runs":>7}{"mean":>9}{"median":>8}{"lost":>10}{"design.cusum":>15}{"its threshold":>15}"""


def delays(choice: Choice, noise: Noise, after: int, seeds: int) -> list[Delays]:
    """Return the delays of each shift, all in the same noise."""
    measured: dict[float, list[float]] = {shift: [] for shift in SHIFTS}
    steady = np.full(after + LONGEST, RATIO)
    estimator = choice.estimator()
    for seed in range(seeds):
        random = signal_worlds.generator(seed, SHIFTS_WORLD)
        for _ in range(RUNS):
            made = signals(noise, steady, random)
            for shift in SHIFTS:
                estimator.reset()
                output = with_step(made, after, ratio_step(noise, shift))
                alarm = estimator.trace(output, made.regressor)["alarm"]
                if not alarm[:after].any():
                    measured[shift].append(first(alarm[after:]))
    return [
        Delays(choice, noise, after, shift, np.array(found)) for shift, found in measured.items()
    ]


def ratio_step(noise: Noise, shift: float) -> float:
    """Return the step of the ratio that shifts the mean of the whitened innovations by some standard deviations."""
    return SD * shift / (1 - noise.rho)


def with_step(steady: Signals, after: int, step: float) -> Array:
    """Return the output if the ratio has a step after some samples."""
    changes = signal_worlds.stepped(len(steady.ratio), after, 0.0, step)
    return steady.output + changes * steady.regressor


def first(alarm: NDArray[np.bool_]) -> float:
    """Return the number of samples to the first alarm, this one included; inf without one."""
    return float(np.argmax(alarm)) + 1 if alarm.any() else inf


# Everything.


def false_alarm_rows(pool: Executor, seeds: int) -> Iterator[FalseAlarms]:
    """Return the false alarms for each interval, in each noise."""
    choices = [choice for choice in RECORDS for _ in NOISES]
    samples = [RECORDS[choice] for choice in choices]
    noises = NOISES * len(RECORDS)
    return pool.map(false_alarms, choices, noises, samples, [seeds] * len(choices))


def delay_rows(pool: Executor, choice: Choice, seeds: int) -> Iterator[list[Delays]]:
    """Return the delays in each noise, after each number of samples."""
    noises = [noise for noise in NOISES for _ in AFTER]
    after = AFTER * len(NOISES)
    return pool.map(delays, [choice] * len(noises), noises, after, [seeds] * len(noises))


def title(choice: Choice) -> str:
    """Return what is above a table of delays."""
    cusum = choice.cusum
    threshold = choice.estimator().threshold
    return (
        f"Delay to the alarm, samples: {choice}\n"
        f"design.cusum: threshold {cusum.threshold:.2f}, delay {cusum.delay:.1f} for a shift of "
        f"{choice.smallest_shift:g}; the threshold of HandoverRls is {threshold:.2f}.\n"
        f"mean: of the shifts found within {LONGEST} samples; lost: share of the others"
    )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=40, help="records of each row")
    options = parser.parse_args()
    if options.seeds < 1:
        parser.error(f"--seeds is {options.seeds}; give 1 or more")
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        print(FALSE_ALARMS_HEAD, flush=True)
        for row in false_alarm_rows(pool, options.seeds):
            print(row, flush=True)
        for choice in (DEFAULT, QUICK):
            print(f"\n{title(choice)}\n{DELAYS_HEAD}", flush=True)
            for rows in delay_rows(pool, choice, options.seeds):
                print(*rows, sep="\n", flush=True)


if __name__ == "__main__":
    main()
