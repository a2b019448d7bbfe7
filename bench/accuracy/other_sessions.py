"""Sessions on the simulator of other_probe.py: specimens of known modulus, and objects.

A session is made by two pressers: one calibrates, one measures. Each touch is drawn from the ranges
of its presser: angle, depth, times.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import reduce
from operator import add

import numpy as np

from bench.accuracy.other_probe import RIGID, Recorded, Way, touch

HALF_MPa = 2.0  # modulus of an object with a ratio half-way between 1 and RIGID
SOFTEST_MPa = 0.15
STIFFEST_MPa = 6.0
SPECIMENS = 10
OBJECTS = 5
TOUCHES = 4
WRONG_LABEL = 1.4  # factor of a wrong label; from specimen to specimen it is 1.5

DOMES = Way(exponent=1.5, creep=(0.03, 0.03), bend=0.005)
"""A probe with two domes, a soft bump that creeps, and bent gauges."""
FLAT = replace(DOMES, exponent=1.0)
"""The same with flat bumps."""

Range = tuple[float, float]


@dataclass(frozen=True)
class Presser:
    """A hand or a stage: the ranges from which a touch is drawn.

    Attributes
    ----------
    tilt_deg, trembling_deg : float
        Rms from touch to touch, and within a touch.
    tremor : float
        Rms share of the depth.
    total_pF : tuple of float
        Both channels together, during the hold.
    rise_s, hold_s : tuple of float
    fall_s : float
    """

    tilt_deg: float = 0.5
    trembling_deg: float = 0.03
    tremor: float = 0.03
    total_pF: Range = (0.5, 1.5)
    rise_s: Range = (0.2, 0.5)
    hold_s: Range = (1.5, 6.5)
    fall_s: float = 0.3

    def at(self, tilt_deg: float) -> "Presser":
        """Return the same presser with another rms of the angles."""
        return replace(self, tilt_deg=tilt_deg)


HAND = Presser()
STAGE = Presser(
    tilt_deg=0.0,
    trembling_deg=0.0,
    tremor=0.1 * HAND.tremor,
    rise_s=(0.45, 0.45),
    hold_s=(3.0, 3.0),
)
QUICK = replace(HAND, tremor=0.1 * HAND.tremor, rise_s=(0.02, 0.02), fall_s=0.02)
"""A hand so quick and so still that its touches show no sweep of the depth: no level ratio."""


class Labels(StrEnum):
    """Whether the labels of the specimens are those of their moduli."""

    RIGHT = "right"
    ONE_WRONG = "one wrong"
    TWO_SWAPPED = "two swapped"


@dataclass(frozen=True)
class Calibrating:
    """How the specimens of a session are touched and labelled.

    Attributes
    ----------
    probe : Way
    presser : Presser
    labels : Labels
    label_error : float
        Relative standard deviation of the true moduli around the labels.
    quick : int
        Number of touches, among those on all specimens, that have no level ratio.
    """

    probe: Way = DOMES
    presser: Presser = HAND
    labels: Labels = Labels.RIGHT
    label_error: float = 0.0
    quick: int = 0


@dataclass(frozen=True)
class Measuring:
    """How the objects of a session are touched.

    Attributes
    ----------
    probe : Way
    presser : Presser
    moduli_MPa : tuple of float
        Range of the moduli.
    known : bool
        Whether the objects are some of the specimens.
    laws : tuple of float
        Laws by which layered objects stiffen, in turn.
    """

    probe: Way = DOMES
    presser: Presser = HAND
    moduli_MPa: Range = (SOFTEST_MPa, STIFFEST_MPa)
    known: bool = False
    laws: tuple[float, ...] = (1.0, 2.0, 3.0)


@dataclass(frozen=True)
class Touched:
    """Four touches on one specimen or object; its true modulus at small depth, and its label."""

    modulus_MPa: float
    label_MPa: float
    recording: Recorded


def ratio_on(modulus_MPa: float) -> float:
    """Return the ratio on a thick object."""
    return 1 + (RIGID - 1) / (1 + HALF_MPa / modulus_MPa)


def pressed(
    probe: Way,
    modulus_MPa: float,
    pressers: Sequence[Presser],
    random: np.random.Generator,
) -> Recorded:
    """Return a recording of one touch of each presser."""
    recordings = []
    for presser in pressers:
        way = replace(
            probe,
            ratio=ratio_on(modulus_MPa),
            total=random.uniform(*presser.total_pF),
            rise=random.uniform(*presser.rise_s),
            hold=random.uniform(*presser.hold_s),
            fall=presser.fall_s,
            angle=presser.tilt_deg * random.standard_normal(),
            trembling=presser.trembling_deg,
            tremor=presser.tremor,
        )
        recordings.append(touch(way, int(random.integers(2**31))))
    return reduce(add, recordings)


def labels_MPa() -> list[float]:
    """Return the right labels of the specimens: even steps of the logarithm."""
    steps = np.linspace(math.log(SOFTEST_MPa), math.log(STIFFEST_MPa), SPECIMENS)
    return [float(modulus) for modulus in np.exp(steps)]


def _written(labels: list[float], kind: Labels, random: np.random.Generator) -> list[float]:
    """Return the labels with the mistakes of this kind."""
    written = list(labels)
    one = int(random.integers(SPECIMENS))
    if kind is Labels.ONE_WRONG:
        written[one] *= WRONG_LABEL ** random.choice([-1, 1])
    if kind is Labels.TWO_SWAPPED:
        other = (one + 1) % SPECIMENS
        written[one] = labels[other]
        written[other] = labels[one]
    return written


def specimens(calibrating: Calibrating, seed: int) -> list[Touched]:
    """Simulate the touches that calibrate."""
    random = np.random.default_rng((seed, 99))
    mistakes = np.random.default_rng((seed, 97))
    right = labels_MPa()
    written = _written(right, calibrating.labels, mistakes)
    errors = calibrating.label_error * mistakes.standard_normal(SPECIMENS)
    quick = mistakes.choice(SPECIMENS * TOUCHES, calibrating.quick, replace=False)
    pressers = [calibrating.presser] * (SPECIMENS * TOUCHES)
    for number in quick:
        pressers[number] = QUICK
    made = []
    for number in range(SPECIMENS):
        modulus = right[number] * math.exp(errors[number])
        own = pressers[number * TOUCHES : (number + 1) * TOUCHES]
        recording = pressed(calibrating.probe, modulus, own, random)
        made.append(Touched(modulus, written[number], recording))
    return made


def objects(measuring: Measuring, seed: int) -> list[Touched]:
    """Simulate the touches that are measured."""
    random = np.random.default_rng((seed, 98))
    low, high = np.log(measuring.moduli_MPa)
    moduli = np.exp(random.uniform(low, high, OBJECTS))
    if measuring.known:
        moduli = random.choice(labels_MPa(), OBJECTS, replace=False)
    made = []
    for number, modulus in enumerate(map(float, moduli)):
        law = measuring.laws[(seed + number) % len(measuring.laws)]
        probe = replace(measuring.probe, law=law)
        recording = pressed(probe, modulus, [measuring.presser] * TOUCHES, random)
        made.append(Touched(modulus, modulus, recording))
    return made
