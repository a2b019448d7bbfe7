"""The simulated hands of the studies of several touches: one for each cause of the scatter from touch to touch."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import palpate
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation import Substrate
from palpate.simulation.hand import Hand, session

_LEVEL = Hand(oblique=0.0, nonlinearity=0.0)
_TILTED = replace(_LEVEL, tilt_deg=0.5)
# A hand that holds an instrument still moves its tip by 49 um rms (Riviere, Rader, Khosla 1997): 0.03 degrees at 100 mm.
TREMOR_DEG = 0.03
# Two plates with 10 pF at rest: the change is f (1 + f / 10 pF). The AD7746 can balance 17 pF.
CURVED_PER_PF = 0.1

STAGE = replace(_LEVEL, nonlinearity=CURVED_PER_PF, press_spread=0.0, tremor=0.0)
"""The probe on a stage, with a constant load: no tilt, no tremor, the same press. The gauges are those of `FREE`."""
FREE = replace(
    _TILTED,
    nonlinearity=CURVED_PER_PF,
    shallow=0.3,
    substrate=Substrate(exponent=1.5, tremor_deg=TREMOR_DEG, settles=0.5),
)
"""The probe in a hand, with all causes that follow from the geometry."""

HANDS = {
    "factor 3 %": Hand(),
    "factor 10 %": Hand(oblique=0.10),
    "factor 3 %, less when firm": Hand(firm=1.0),
    "factor 3 %, one in four slips": Hand(slips=0.25),
    "factor 1 %, light presses": Hand(oblique=0.01, press_pF=0.02, press_spread=1.2),
    "tilt 0.5 deg": _TILTED,
    "tilt, trembling": replace(_TILTED, substrate=Substrate(tremor_deg=TREMOR_DEG)),
    "tilt, domes": replace(_TILTED, substrate=Substrate(exponent=1.5)),
    "tilt, settles from twice": replace(_TILTED, substrate=Substrate(settles=1.0)),
    "tilt, less deep when oblique": replace(_TILTED, shallow=0.3),
    "curved gauges, level": replace(_LEVEL, nonlinearity=CURVED_PER_PF),
    "tilt, curved gauges": replace(_TILTED, nonlinearity=CURVED_PER_PF),
    "all of tilt and gauges": FREE,
    "stage": STAGE,
}
"""Name -> hand. "factor": a random factor of the ratio that nothing else shows. "tilt": of the substrate, 0.5 degrees."""

MISFITS = ("offset", "curve", "drift", "lag")
"""Flags of the test of the model. On a tilted probe with curved gauges most touches have one; the studies use them."""

UNKNOWN = "eleventh"


def level_ratio(hand: Hand, ratio: float) -> float:
    """Return what a level probe shows at the median press: the ratio by which a touch of this hand is judged.

    A calibration takes up what is the same in all touches; what differs between them is their error.
    """
    hard, soft = (hand.press_pF * share / (1 + ratio) for share in (ratio, 1.0))
    return ratio * (1 + hand.nonlinearity * hard) / (1 + hand.nonlinearity * soft)


@dataclass(frozen=True)
class Session:
    """The touches on the ten specimens and on an eleventh object of random modulus, by both scenes."""

    hand: Hand
    modulus: float  # of the eleventh object, MPa
    touches: Mapping[str, list[palpate.Touch]]
    paper: Mapping[str, list[palpate.Touch]]


def recorded(hand: Hand, seed: int) -> Session:
    """Simulate four touches of a hand on each object, and estimate them."""
    modulus = math.exp(np.random.default_rng([seed, 99]).uniform(math.log(0.2), math.log(6.0)))
    runs = session(seed, hand=hand, moduli={**SORBOTHANE_MPA, UNKNOWN: modulus})
    touches = {name: palpate.touches(run) for name, run in runs.items()}
    return Session(hand, modulus, touches, {name: palpate.touches(run, scene="paper") for name, run in runs.items()})
