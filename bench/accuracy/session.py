"""Modulus at the end of a whole session, on a simulator that shares nothing with ours: bench/accuracy/other_probe.py.

    python -m bench.accuracy.session [--seeds 20] [--out bench/results]

Four touches on each of ten specimens of known modulus make a calibration; then five objects are touched four times. Domes
(force ~ depth^1.5), gauges bent by 0.5 %/pF, a soft bump that creeps by 3 % within 2 s and by 3 % within 20 s, each touch at an
angle of 0.5 degrees rms that trembles by 0.03 degrees, 0.5 to 1.5 pF in both channels together, rises of 0.2 to 0.5 s, holds
of 1.5 to 6.5 s. Prints the rms error of log(E / truth): of a touch, of the mean of four; how many 95 % intervals hold it; and how many touches
have none.
"""

import argparse
import json
import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import palpate
from palpate import Calibration
from palpate.calibration.selection import RatioChoice, Track, choose_ratio
from palpate.calibration.specimen_fit import SpecimenTouches, fit_specimens
from palpate.elasticity import Elasticity

from bench.accuracy.other_probe import Recorded, Way, touch
from bench.results_age import RESULTS, about

PROBE = Elasticity()
LOW, HIGH = math.log(0.15), math.log(6.0)  # log of the moduli, MPa
WAY = Way(exponent=1.5, angle=0.5, trembling=0.03, creep=(0.03, 0.03), bend=0.005)
PARTS = {
    "all of it": WAY,
    "level": replace(WAY, angle=0.0, trembling=0.0),
    "flat bumps": replace(WAY, exponent=1.0),
    "no creep": replace(WAY, creep=(0.0, 0.0)),
    "gauges not bent": replace(WAY, bend=0.0),
    "1 degree": replace(WAY, angle=1.0),
}
# flags that all touches of a specimen may have, without an age or a level ratio
ACCEPT = ("drift", "creep", "offset")


class Session(NamedTuple):
    """Recordings of four touches each, by modulus, MPa: of the specimens, and of the objects."""

    specimens: dict[float, Recorded]
    objects: dict[float, Recorded]


def session(seed: int, way: Way = WAY) -> Session:
    """Simulate a session; the angle of `way` is the rms of the angles."""
    random = np.random.default_rng((seed, 99))

    def touched(modulus: float) -> Recorded:
        each = (
            replace(
                way,
                ratio=PROBE.ratio(modulus),
                total=random.uniform(0.5, 1.5),
                rise=random.uniform(0.2, 0.5),
                hold=random.uniform(1.5, 6.5),
                angle=way.angle * random.standard_normal(),
            )
            for _ in range(4)
        )
        return reduce(add, (touch(one, int(random.integers(2**31))) for one in each))

    def all_of(moduli: Iterable[float]) -> dict[float, Recorded]:
        return {float(modulus): touched(modulus) for modulus in moduli}

    return Session(
        all_of(np.exp(np.linspace(LOW, HIGH, 10))), all_of(np.exp(random.uniform(LOW, HIGH, 5)))
    )


def fitted(specimens: dict[float, Recorded], **given: Any) -> tuple[Calibration, RatioChoice]:
    """Return the calibration, as `palpate calibrate` makes it, and its choice; `given`: kind, contact_exponent, age."""
    kind, bumps = given.pop("kind", None), given.pop("bumps", None)
    tracks = [
        Track(run, given, {t.start: f"{E}" for t in palpate.touches(run)})
        for E, run in specimens.items()
    ]
    chosen = choose_ratio(tracks, {f"{E}": E for E in specimens}, ratio=kind, bumps=bumps)
    settings: Any = chosen.settings
    accept = ACCEPT if kind == "hold" or given.get("age") == 0 else ()
    touched = [
        SpecimenTouches(f"{E}", E, palpate.touches(run, **settings), accept, chosen.ratio_of)
        for E, run in specimens.items()
    ]
    return fit_specimens(
        touched,
        exponents=chosen.exponents,
        about=replace(chosen.about, accepted_flags=tuple(accept)),
    ), chosen


@dataclass
class Found:
    """Errors of the logarithm of the modulus, and whether the intervals hold it: of touches, and of means of four."""

    touches: list[tuple[float, bool]] = field(default_factory=list)
    means: list[tuple[float, bool]] = field(default_factory=list)
    missing: int = 0  # touches without a modulus

    def add(self, calibration: Calibration, modulus: float, touches: list[palpate.Touch]) -> None:
        """Add the four touches on an object."""
        for each in touches:
            value, low, high = calibration.modulus_of(each)
            if math.isnan(value) or calibration.objections(each):
                self.missing += 1
            else:
                self.touches.append((math.log(value / modulus), low <= modulus <= high))
        if any(not calibration.objections(each) for each in touches):
            value, low, high = calibration.mean_modulus(touches)
            self.means.append((math.log(value / modulus), low <= modulus <= high))

    @property
    def numbers(self) -> tuple[float, float, float, float]:
        """Rms error and share of the intervals that hold the modulus, %: of a touch, and of a mean."""
        return (*_numbers(self.touches), *_numbers(self.means))

    def __str__(self) -> str:
        """Return a row of the table."""
        error, holds, of_mean, means_hold = self.numbers
        return f"{error:9.2f} {holds:9.1f} {of_mean:9.2f} {means_hold:9.1f} {self.missing:8}"


def _numbers(found: list[tuple[float, bool]]) -> tuple[float, float]:
    errors, holds = np.array(found, float).reshape(-1, 2).T
    errors = errors[np.isfinite(errors)]
    return 100 * float(np.sqrt(np.mean(errors**2))), 100 * float(np.mean(holds))


def measure(seeds: Iterable[int], way: Way = WAY, **given: Any) -> Found:
    """Return the errors in several sessions."""
    found = Found()
    for seed in seeds:
        specimens, objects = session(seed, way)
        calibration, chosen = fitted(specimens, **given)
        settings: Any = chosen.settings
        for modulus, run in objects.items():
            found.add(calibration, modulus, palpate.touches(run, **settings))
    return found


ROWS: dict[str, dict[str, Any]] = {
    "hold": {"kind": "hold", "contact_exponent": 1.0, "age": 0.0},
    "hold at 0.5 s": {"kind": "hold", "contact_exponent": 1.0, "age": 0.5},
    "level, flat": {"kind": "level", "contact_exponent": 1.0, "age": 0.0},
    "level": {"kind": "level", "contact_exponent": 1.5, "age": 0.0},
    "level at 0.5 s": {"kind": "level", "contact_exponent": 1.5, "age": 0.5},
    "level at 1.3 s": {"kind": "level", "contact_exponent": 1.5, "age": 1.3},
    "as chosen": {},
}


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20, help="sessions a row")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder for the table")
    options = parser.parse_args()
    seeds = range(options.seeds)
    lines = [f"{'ratio':24}  E, rms %   holds %  of 4, rms   holds %  without"]
    lines += [f"{name:24}{measure(seeds, **given)}" for name, given in ROWS.items()]
    lines += ["", "as chosen, of a session with"]
    lines += [f"{name:24}{measure(seeds, way)}" for name, way in PARTS.items()]
    print("\n".join(lines))
    document = about() | {"seeds": options.seeds, "table": lines}
    (options.out / "session.json").write_text(json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    main()
