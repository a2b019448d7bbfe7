"""The rows of the bench another_hand: who calibrates, who measures, and the bounds of each."""

from dataclasses import dataclass, replace

from bench.accuracy.another_hand_scores import Bounds, Share
from bench.accuracy.other_sessions import (
    DOMES,
    FLAT,
    HAND,
    STAGE,
    Calibrating,
    Labels,
    Measuring,
    Presser,
)
from bench.accuracy.session_calibration import Stated

MODULUS_ERROR = 0.05
GAIN = 1.02
NOTHING_STATED = Stated()


@dataclass(frozen=True)
class Row:
    """A line of the table.

    Attributes
    ----------
    title : str
    calibrating : Calibrating
    measuring : Measuring
    stated : Stated
    bounds : Bounds
    """

    title: str
    calibrating: Calibrating
    measuring: Measuring
    bounds: Bounds
    stated: Stated = NOTHING_STATED


def _holds(rms: float, coverage: float, mean_coverage: float = 0.0) -> Bounds:
    """Return bounds with a largest rms error and smallest coverages, %."""
    return Bounds(rms, coverage=(coverage, 100.0), mean_coverage=(mean_coverage, 100.0))


def _shares(share: Share, low: float = 0.0, high: float = 100.0) -> Bounds:
    """Return bounds of one share, %."""
    return Bounds(shares={share: (low, high)}, has_rule=False)


def _tilted(tilt_deg: float) -> Measuring:
    """Return the measurement of a hand with this rms of the angles."""
    return Measuring(presser=HAND.at(tilt_deg))


def _deep(low_pF: float, high_pF: float) -> Presser:
    """Return a hand that presses so deep."""
    return replace(HAND, total_pF=(low_pF, high_pF))


BY_HAND = Calibrating()
ON_STAGE = Calibrating(presser=STAGE)
CAREFUL = Calibrating(presser=HAND.at(0.05))
LEVEL = Calibrating(presser=HAND.at(0.0))
FLAT_ON_STAGE = Calibrating(FLAT, STAGE)
USUAL_DEPTH = Calibrating(presser=_deep(0.4, 1.6))
INEXACT = Calibrating(label_error=MODULUS_ERROR)

FIRST = Measuring()
STEADY = Measuring(presser=STAGE)
LAYERED = Measuring(replace(DOMES, layer=0.2), moduli_MPa=(0.2, 0.6))
LAYERED_STEADY = replace(LAYERED, presser=STAGE)
KNOWN = Measuring(known=True)
CHANGED = Measuring(replace(DOMES, gain=GAIN), known=True)

LEARNS = Stated(learns=True)

REFERENCE = Bounds(
    2.0,
    coverage=(92.0, 98.0),
    shares={Share.STIFFENS: (0.0, 1.0)},
)
ON_STAGE_ONLY = Bounds(half_width=1.5, shares={Share.STIFFENS: (0.0, 1.0)})
FLAT_STATED = Bounds(1.5, half_width=1.7, coverage=(92.0, 98.0))
FLAT_NOT_STATED = Bounds(half_width=5.0, coverage=(92.0, 100.0))
UNCERTAINTY_STATED = Bounds(
    3.5,
    coverage=(90.0, 99.0),
    shares={Share.RELIABLE: (90.0, 100.0)},
)
NOTICED = _shares(Share.RELIABLE, high=5.0)
FLAGGED = _shares(Share.STIFFENS, low=80.0)
FOUND = _shares(Share.DISAGREES, low=95.0)
NOT_FOUND = _shares(Share.DISAGREES, high=3.0)

ROWS = (
    Row("reference: a hand calibrates and measures", BY_HAND, FIRST, REFERENCE),
    Row("layered objects, by hand", BY_HAND, LAYERED, FLAGGED),
    Row("gain +2 %, by hand", BY_HAND, CHANGED, FOUND),
    Row("gain unchanged, by hand", BY_HAND, KNOWN, NOT_FOUND),
    Row("stage calibrates and measures", ON_STAGE, STEADY, ON_STAGE_ONLY),
    Row("stage, then hand at .25 degrees", ON_STAGE, _tilted(0.25), _holds(3.0, 88.0)),
    Row("stage, then hand at .5 degrees", ON_STAGE, _tilted(0.5), _holds(4.5, 88.0)),
    Row("stage, then hand at 1.5 degrees", ON_STAGE, _tilted(1.5), _holds(16.0, 88.0)),
    Row("stage, then .5 degrees, learned", ON_STAGE, _tilted(0.5), _holds(3.0, 88.0), LEARNS),
    Row("stage, then 1.5 degrees, learned", ON_STAGE, _tilted(1.5), _holds(5.0, 88.0), LEARNS),
    Row("layered objects, on a stage", ON_STAGE, LAYERED_STEADY, FLAGGED),
    Row("gain +2 %, stage, then hand, learned", ON_STAGE, CHANGED, FOUND, LEARNS),
    Row("gain unchanged, stage, then hand, learned", ON_STAGE, KNOWN, NOT_FOUND, LEARNS),
    Row("hand at .05 degrees, then .5", CAREFUL, _tilted(0.5), _holds(4.5, 88.0)),
    Row("A level, B at 1.5 degrees", LEVEL, _tilted(1.5), _holds(16.0, 88.0)),
    Row(
        "flat, stated: stage, then hand",
        FLAT_ON_STAGE,
        Measuring(FLAT),
        FLAT_STATED,
        Stated(bumps="flat"),
    ),
    Row("flat, not stated: stage, then hand", FLAT_ON_STAGE, Measuring(FLAT), FLAT_NOT_STATED),
    Row(
        "deeper than calibrated",
        USUAL_DEPTH,
        Measuring(presser=_deep(1.6, 3.0)),
        _holds(3.0, 90.0, 85.0),
    ),
    Row(
        "lighter than calibrated",
        USUAL_DEPTH,
        Measuring(presser=_deep(0.1, 0.3)),
        _holds(5.0, 88.0, 85.0),
    ),
    Row(
        "u(E) 5 %, stated",
        INEXACT,
        FIRST,
        UNCERTAINTY_STATED,
        Stated(modulus_uncertainty=MODULUS_ERROR),
    ),
    Row("u(E) 5 %, not stated", INEXACT, FIRST, NOTICED),
    Row("a wrong label", Calibrating(labels=Labels.ONE_WRONG), FIRST, NOTICED),
    Row("two labels swapped", Calibrating(labels=Labels.TWO_SWAPPED), FIRST, NOTICED),
    Row(
        "unequal exponents",
        Calibrating(replace(DOMES, soft_exponent=1.0)),
        Measuring(replace(DOMES, soft_exponent=1.0)),
        NOTICED,
    ),
    Row("35 of 40 touches have a level ratio", Calibrating(quick=5), FIRST, _holds(2.5, 90.0)),
)
