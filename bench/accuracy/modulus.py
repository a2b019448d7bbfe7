"""What is wrong with a ratio by per cents, and what says so: on touches of a simulator that shares nothing with palpate's.

    python -m bench.accuracy.modulus [--seeds 40] [--period 0.026]

Three tables. Sources: the error of the ratio and of the level ratio, rms, and by creep their scatter, at the end and at an
age. Silent: results that are off by more than 4 standard errors and 0.5 %, without a flag but "short". Level: the error of
the level ratio, and how often its 95 % intervals hold. The simulator: bench/accuracy/other_probe.py.
"""

import argparse
import math
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray

from bench.accuracy.other_probe import Way, touch

AGE_s = 1.3
_TREMBLING = Way(trembling=0.03)
_OBLIQUE = replace(_TREMBLING, angle=0.5)
_DOMES = replace(_OBLIQUE, exponent=1.5)
_CREEP = Way(ratio=2.8, creep=(0.03, 0.03))

SOURCES: dict[str, Way] = {
    "noise and tremor": Way(),
    "gauges bent by .5 %/pF": Way(bend=0.005),
    "0.5 degrees, flat": _OBLIQUE,
    "0.5 degrees, domes": _DOMES,
    "2 degrees, domes": replace(_DOMES, angle=2.0),
}
CREEPS: dict[str, Way] = {
    "creep of the bumps": _CREEP,
    "creep of the object": Way(ratio=2.8, object_creep=0.03),
    "creep of both, 0.5 degrees, domes": replace(
        _DOMES, ratio=2.8, creep=(0.03, 0.03), object_creep=0.03
    ),
}
SILENT: dict[str, Way] = {
    "lift with another ratio, -10 %": Way(lifted_ratio=0.9),
    "lift with a tilt of 1 degree": Way(lifted_angle=1.0),
    "two pairs swapped at the end": Way(swapped=2),
    "codes of 10 fF": Way(code=0.01, total=0.95),
    "codes of 1/4 pF": Way(code=0.25, total=3.8),
    "angle that trembles, domes": _DOMES,
    "angle that trembles, flat": _OBLIQUE,
    "sliding when the touch ends": Way(slide=(0.4, 1.3)),
    "10 pairs a second": Way(period=0.1, before=5.0, after=5.0, tremor=0.08),
    "pulses of 2 %": Way(pulse=0.02),
    "1/f noise common to both": Way(pink=1e-4),
    "15 % stale soft readings": Way(stale=0.15),
    "hard bump first by 5 %": Way(gap=0.05, tremor=0.02, hold=1.7),
    "change of 30 % under tremor": Way(change=(2.0, 1.3), tremor=0.08, hold=4.5),
}
LEVEL: dict[str, Way] = {
    "level and still, flat": Way(tremor=0.0),
    "level and still, domes": Way(tremor=0.0, exponent=1.5),
    "level, trembling, flat": _TREMBLING,
    "level, trembling, domes": replace(_TREMBLING, exponent=1.5),
    "0.5 degrees, flat": _OBLIQUE,
    "0.5 degrees, domes": _DOMES,
    "2 degrees, domes": replace(_DOMES, angle=2.0),
    "rise of 0.2 s, domes": replace(_DOMES, rise=0.2),
    "rise of 0.15 s, domes": replace(_DOMES, rise=0.15),
    "rise of 0.1 s, domes": replace(_DOMES, rise=0.1),
    "0.2 pF together, domes": replace(_DOMES, total=0.2),
    "ratio of 8.5, domes": replace(_DOMES, ratio=8.5),
    "angle in phase with the force": replace(_DOMES, trembling=0.0, in_phase=0.03),
}
_RANDOM: dict[str, Callable[[np.random.Generator], float]] = {
    "ratio": lambda random: math.exp(random.uniform(math.log(1.3), math.log(7.5))),
    "hold": lambda random: random.uniform(2, 6),
}


def drawn(way: Way, seed: int) -> Way:
    """Return a way with a random ratio and length, where these have their defaults; every second one tilts the other way."""
    random = np.random.default_rng((seed, 5))
    default = Way()
    values = {name: float(draw(random)) for name, draw in _RANDOM.items()}
    given: Any = {
        name: value
        for name, value in values.items()
        if getattr(way, name) == getattr(default, name)
    }
    return replace(way, angle=way.angle * (-1) ** seed, **given)


def longest_touch(way: Way, seed: int, **settings: Any) -> palpate.Touch:
    """Return the touch with the most samples; there may be another one of a few."""
    found = palpate.touches(touch(way, seed), contact_exponent=way.exponent, **settings)
    return max(found, key=lambda touch: touch.samples)


@dataclass(frozen=True)
class Found:
    """Results of touches in one way, relative to the true ratio; `silent` is a share."""

    ratio: NDArray[np.float64]
    level: NDArray[np.float64]
    level_error: NDArray[np.float64]
    silent: float
    flags: Counter[str]

    @property
    def covered(self) -> NDArray[np.bool_]:
        """Whether each 95 % interval of the level ratio holds the truth."""
        known = np.isfinite(self.level)
        return np.asarray(np.abs(self.level[known]) < 1.96 * self.level_error[known])


def found(way: Way, seeds: Iterable[int], **settings: Any) -> Found:
    """Return the results of touches with these seeds."""
    ratio = []
    level = []
    error = []
    silent = []
    flags = Counter[str]()
    for seed in seeds:
        one = drawn(way, seed)
        truth = one.ratio * one.change[1]
        made = longest_touch(one, seed, **settings)
        off = abs(made.ratio - truth)
        ratio.append(made.ratio / truth - 1)
        level.append(made.level_ratio / truth - 1)
        error.append(made.level_standard_error / truth)
        silent.append(
            off > 0.005 * truth and off > 4 * made.standard_error and not {*made.flags} - {"short"}
        )
        flags.update(made.flags)
    return Found(np.array(ratio), np.array(level), np.array(error), float(np.mean(silent)), flags)


def rms(errors: NDArray[np.float64]) -> float:
    """Return the root mean square of the known ones, %."""
    known = errors[np.isfinite(errors)]
    return 100 * float(np.sqrt(np.mean(known**2))) if len(known) else math.nan


def scatter(errors: NDArray[np.float64]) -> float:
    """Return the standard deviation of the known ones, %."""
    return 100 * float(np.nanstd(errors))


def main() -> None:
    """Print the three tables."""
    parser = argparse.ArgumentParser(description="Errors by per cents, and what says so")
    parser.add_argument("--seeds", type=int, default=40, help="touches of each row")
    parser.add_argument(
        "--period",
        type=float,
        default=Way().period,
        help="s from pair to pair, where a row has none",
    )
    options = parser.parse_args()
    seeds = range(options.seeds)

    def found_in(way: Way, **settings: Any) -> Found:
        return found(
            replace(way, period=options.period) if way.period == Way().period else way,
            seeds,
            **settings,
        )

    print(f"{'source':36} {'ratio, rms %':>14} {'level ratio, %':>15}")
    for name, way in SOURCES.items():
        made = found_in(way)
        print(f"{name:36} {rms(made.ratio):14.4f} {rms(made.level):15.4f}")
    for name, way in CREEPS.items():
        for age_s in (0.0, AGE_s):
            made = found_in(way, age=age_s)
            at = f"{name}, {f'at {age_s} s' if age_s else 'whole touch'}: scatter"
            print(f"{at:60} {scatter(made.ratio):.3f} {scatter(made.level):.3f}")
    print(f"\n{'effect':36} {'error, median %':>15} {'silent, %':>10}  flags")
    for name, way in SILENT.items():
        made = found_in(way)
        flags = ", ".join(
            f"{flag} {count}" for flag, count in made.flags.items() if flag != "short"
        )
        print(
            f"{name:36} {100 * np.median(np.abs(made.ratio)):15.4f} {100 * made.silent:10.0f}  {flags}"
        )
    print(
        f"\n{'level ratio':36} {'ratio, rms %':>14} {'level ratio, %':>15} {'covered, %':>11} {'known':>6}"
    )
    covered = []
    for name, way in LEVEL.items():
        made = found_in(way)
        covered.append(made.covered)
        shares = f"{100 * made.covered.mean():11.0f} {np.isfinite(made.level).sum():6}"
        print(f"{name:36} {rms(made.ratio):14.4f} {rms(made.level):15.4f} {shares}")
    print(f"{'all':36} {'':30} {100 * np.concatenate(covered).mean():11.1f}")


if __name__ == "__main__":
    main()
