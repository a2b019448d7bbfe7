"""The rows of the bench another_hand: who calibrates, who measures, and the bounds of each."""

from dataclasses import dataclass, replace

from bench.accuracy.another_hand_scores import Allowed, Bounds, Share
from bench.accuracy.other_probe import Way
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
NO_BOUNDS = Bounds(has_rule=False)


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
    bounds: Bounds = NO_BOUNDS
    stated: Stated = NOTHING_STATED


def _holds(rms: float, coverage: float, mean_coverage: float = 0.0) -> Bounds:
    """Return bounds with a largest rms error and smallest coverages, %."""
    return Bounds(
        rms,
        coverage=(coverage, 100.0),
        mean_coverage=(mean_coverage, 100.0),
        shares=THICK,
    )


def _shares(share: Share, low: float = 0.0, high: float = 100.0) -> Bounds:
    """Return bounds of one share, %."""
    return Bounds(shares={share: (low, high)}, has_rule=False)


def _tilted(tilt_deg: float) -> Measuring:
    """Return the measurement of a hand with this rms of the angles."""
    return Measuring(presser=HAND.at(tilt_deg))


def _deep(low_pF: float, high_pF: float) -> Presser:
    """Return a hand that presses to a depth in this range."""
    return replace(HAND, total_pF=(low_pF, high_pF))


def _alike(title: str, probe: Way, presser: Presser = HAND) -> Row:
    """Return the row of one probe and one presser, without bounds."""
    return Row(title, Calibrating(probe, presser), Measuring(probe, presser))


BY_HAND = Calibrating()
ON_STAGE = Calibrating(presser=STAGE)
CAREFUL = Calibrating(presser=HAND.at(0.05))
LEVEL = Calibrating(presser=HAND.at(0.0))
FLAT_ON_STAGE = Calibrating(FLAT, STAGE)
USUAL_DEPTH = Calibrating(presser=_deep(0.4, 1.6))
INEXACT = Calibrating(label_error=MODULUS_ERROR)
HARD_FLAT = replace(DOMES, exponent=1.0, soft_exponent=1.5)
SOFT_FLAT = replace(DOMES, exponent=1.5, soft_exponent=1.0)

FIRST = Measuring()
STEADY = Measuring(presser=STAGE)
LAYERED = Measuring(replace(DOMES, layer=0.2), moduli_MPa=(0.2, 0.6))
LAYERED_STEADY = replace(LAYERED, presser=STAGE)
KNOWN = Measuring(known=True)
CHANGED = Measuring(replace(DOMES, gain=GAIN), known=True)

LEARNS = Stated(learns=True)

THICK: dict[Share, Allowed] = {Share.STIFFENS: (0.0, 1.0), Share.WITHOUT: (0.0, 5.0)}
"""Bounds on thick objects: no false flag, and a modulus of nearly every touch."""
REFERENCE_BOUNDS = Bounds(2.0, coverage=(92.0, 98.0), shares=THICK)
ON_STAGE_ONLY = Bounds(half_width=1.5, shares=THICK)
FLAT_STATED = Bounds(1.5, half_width=1.7, coverage=(92.0, 98.0), shares=THICK)
FLAT_NOT_STATED = Bounds(half_width=5.0, coverage=(92.0, 100.0), shares=THICK)
UNCERTAINTY_STATED = Bounds(3.5, coverage=(90.0, 99.0), shares={Share.RELIABLE: (90.0, 100.0)})
NOTICED = _shares(Share.RELIABLE, high=5.0)
MOSTLY_NOTICED = _shares(Share.RELIABLE, high=15.0)
FLAGGED = _shares(Share.STIFFENS, low=80.0)
FOUND = _shares(Share.DISAGREES, low=95.0)
NOT_FOUND = _shares(Share.DISAGREES, high=3.0)

REFERENCE = Row("reference: a hand calibrates and measures", BY_HAND, FIRST, REFERENCE_BOUNDS)
WHOLE_HOLD = Row("ratio: hold", BY_HAND, FIRST, stated=Stated("flat", "hold", 0.0))

ANOTHER_HAND = (
    Row("stage calibrates and measures", ON_STAGE, STEADY, ON_STAGE_ONLY),
    Row("stage, then hand at .25 degrees", ON_STAGE, _tilted(0.25), _holds(3.0, 88.0)),
    Row("stage, then hand at .5 degrees", ON_STAGE, _tilted(0.5), _holds(4.5, 88.0)),
    Row("stage, then hand at 1.5 degrees", ON_STAGE, _tilted(1.5), _holds(16.0, 88.0)),
    Row("stage, then .5 degrees, learned", ON_STAGE, _tilted(0.5), _holds(3.0, 88.0), LEARNS),
    Row("stage, then 1.5 degrees, learned", ON_STAGE, _tilted(1.5), _holds(5.0, 88.0), LEARNS),
    Row("layered objects, stage", ON_STAGE, LAYERED_STEADY, FLAGGED),
    Row("gain +2 %, stage, then hand, learned", ON_STAGE, CHANGED, FOUND, LEARNS),
    Row("gain the same, stage, then hand, learned", ON_STAGE, KNOWN, NOT_FOUND, LEARNS),
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
)
"""Rows in which something differs between calibration and measurement."""
ONE_HAND = (
    REFERENCE,
    Row("layered objects, hand", BY_HAND, LAYERED, FLAGGED),
    Row("gain +2 %, hand", BY_HAND, CHANGED, FOUND),
    Row("gain the same, hand", BY_HAND, KNOWN, NOT_FOUND),
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
    Row("hard bump flat, soft a dome", Calibrating(HARD_FLAT), Measuring(HARD_FLAT), NOTICED),
    Row(
        "hard bump a dome, soft flat", Calibrating(SOFT_FLAT), Measuring(SOFT_FLAT), MOSTLY_NOTICED
    ),
    Row("35 of 40 touches have a level ratio", Calibrating(quick=5), FIRST, _holds(2.5, 90.0)),
)
"""Rows in which the hand that calibrated measures."""
PARTS = (
    _alike("part: level and still", DOMES, replace(HAND, tilt_deg=0.0, trembling_deg=0.0)),
    _alike("part: flat bumps", FLAT),
    _alike("part: no creep", replace(DOMES, creep=(0.0, 0.0))),
    _alike("part: gauges not bent", replace(DOMES, bend=0.0)),
    _alike("part: 1 degree", DOMES, HAND.at(1.0)),
)
"""The reference case with another probe or hand."""
RATIOS = (
    WHOLE_HOLD,
    Row("ratio: hold at 0.5 s", BY_HAND, FIRST, stated=Stated("flat", "hold", 0.5)),
    Row("ratio: level, flat", BY_HAND, FIRST, stated=Stated("flat", "level", 0.0)),
    Row("ratio: level, domes", BY_HAND, FIRST, stated=Stated("domes", "level", 0.0)),
    Row("ratio: level, domes, at 0.5 s", BY_HAND, FIRST, stated=Stated("domes", "level", 0.5)),
    Row("ratio: level, domes, at 1.3 s", BY_HAND, FIRST, stated=Stated("domes", "level", 1.3)),
)
"""The reference case with another ratio than the one that is chosen."""
ROWS = (*ONE_HAND, *ANOTHER_HAND, *PARTS, *RATIOS)
