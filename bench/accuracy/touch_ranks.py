"""What a number of a touch knows of its error: rank correlation between the number and the true error, within an object."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate.calibration.characterise import unlevel
from palpate.elasticity import SORBOTHANE_MPA
from palpate.simulation.scenarios import PROBE

from bench.accuracy.hands import Session, level_ratio

CRITERIA: Mapping[str, Callable[[palpate.Touch], float]] = {
    "P": lambda touch: touch.covariance,
    "std. error": lambda touch: touch.standard_error / abs(touch.ratio),
    "|offset|": lambda touch: abs(touch.effects["offset"]),
    "|curve|": lambda touch: abs(touch.effects["curve"]),
    "unlevel": unlevel,
}
PAPER, NEAREST = "P, paper", "to mean"
"""P of the scene paper, with the error of its ratio; distance from the mean of the touches."""
COLUMNS = ("P", PAPER, *list(CRITERIA)[1:], NEAREST)


@dataclass(frozen=True)
class Known:
    """The touches of one session on the ten specimens."""

    errors: list[float]  # relative, of each touch
    flagged: list[bool]
    correlations: dict[str, list[float]]  # criterion -> one number for each specimen


@dataclass(frozen=True)
class RankRow:
    """All sessions of one hand."""

    hand: str
    rms_error: float  # of one touch
    flagged: float  # share of the touches
    correlations: dict[str, float]
    standard_error: float  # the largest one of a correlation


def correlation(values: Sequence[float], errors: NDArray[np.float64]) -> float:
    """Return Spearman's rank correlation; nan where all values are equal, or one is not a number."""
    from scipy.stats import rankdata

    if len(values) < 3 or not np.isfinite(values).all() or np.ptp(values) == 0 or np.ptp(errors) == 0:
        return float("nan")
    return float(np.corrcoef(rankdata(values), rankdata(errors))[0, 1])


def known(seen: Session) -> Known:
    """Return errors, flags and rank correlations of one session."""
    found = Known([], [], {name: [] for name in COLUMNS})
    for name, modulus in SORBOTHANE_MPA.items():
        truth = level_ratio(seen.hand, PROBE.ratio(modulus))
        four, paper = seen.touches[name], seen.paper[name]
        ratios = np.array([touch.ratio for touch in four])
        errors = np.abs(ratios / truth - 1)
        found.errors.extend(errors.tolist())
        found.flagged.extend(bool(touch.flags) for touch in four)
        for key, value in CRITERIA.items():
            found.correlations[key].append(correlation([value(touch) for touch in four], errors))
        off = np.abs(np.array([touch.ratio for touch in paper]) / truth - 1)
        found.correlations[PAPER].append(correlation([touch.covariance for touch in paper], off))
        found.correlations[NEAREST].append(correlation(np.abs(ratios - ratios.mean()).tolist(), errors))
    return found


def rank_row(hand: str, sessions: Iterable[Known]) -> RankRow:
    """Reduce the sessions to a row; specimens without a correlation are left out."""
    listed = list(sessions)
    means, errors = {}, []
    for name in COLUMNS:
        values = np.array([value for one in listed for value in one.correlations[name]])
        values = values[np.isfinite(values)]
        means[name] = float(values.mean()) if len(values) else float("nan")
        errors.append(float(values.std() / np.sqrt(len(values))) if len(values) else float("nan"))
    relative = np.array([error for one in listed for error in one.errors])
    flagged = float(np.mean([flag for one in listed for flag in one.flagged]))
    return RankRow(hand, float(np.sqrt(np.mean(relative**2))), flagged, means, max(errors))


def rank_table(rows: Iterable[RankRow]) -> str:
    """Return the rows as text."""
    lines = [
        f"{'hand':29} {'error: rms':>10} {'flagged':>8}" + "".join(f"{name:>11}" for name in COLUMNS) + f"{'+-':>6}"
    ]
    for row in rows:
        cells = "".join(f"{row.correlations[name]:11.2f}" for name in COLUMNS)
        lines.append(
            f"{row.hand:29} {100 * row.rms_error:8.2f} % {100 * row.flagged:6.0f} %{cells}{row.standard_error:6.2f}"
        )
    return "\n".join(lines)
