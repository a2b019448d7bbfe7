"""How the bench another_hand judges moduli: errors, half-widths, coverage and shares of sessions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from palpate.calibration.modulus import Modulus

RULE = 2.5  # largest median half-width, in rms errors


class Share(StrEnum):
    """A share that is counted, %."""

    WITHOUT = "without"
    STIFFENS = "stiffens"
    DIFFERS = "differs"
    RELIABLE = "reliable"
    DISAGREES = "disagrees"


Allowed = tuple[float, float]


@dataclass(frozen=True)
class Estimate:
    """A modulus against the true one.

    Attributes
    ----------
    error : float
        Of its natural logarithm; nan: it has no value.
    half_width : float
        Of the 95 % interval of the logarithm; inf: a bound.
    holds : bool
        Whether the interval contains the true modulus.
    """

    error: float
    half_width: float
    holds: bool

    @classmethod
    def of(cls, modulus: Modulus, true_MPa: float) -> "Estimate":
        """Compare a modulus with the true one."""
        error = math.log(modulus.value / true_MPa)
        half_width = math.inf
        if modulus.low > 0 and modulus.high < math.inf:
            half_width = math.log(modulus.high / modulus.low) / 2
        return cls(error, half_width, modulus.low <= true_MPa <= modulus.high)


@dataclass
class Tally:
    """How many of how many."""

    count: int = 0
    of: int = 0

    def add(self, is_so: bool | None) -> None:
        """Add an answer; None is not counted."""
        if is_so is None:
            return
        self.count += is_so
        self.of += 1

    @property
    def percent(self) -> float:
        """The share, %; nan of none."""
        return 100 * self.count / self.of if self.of else math.nan


@dataclass
class Score:
    """Results of one or more sessions of a row."""

    touches: list[Estimate] = field(default_factory=list)
    means: list[Estimate] = field(default_factory=list)
    tallies: dict[Share, Tally] = field(default_factory=lambda: {s: Tally() for s in Share})

    def add(self, other: "Score") -> None:
        """Add the results of another session."""
        self.touches += other.touches
        self.means += other.means
        for share, tally in other.tallies.items():
            self.tallies[share].count += tally.count
            self.tallies[share].of += tally.of


@dataclass(frozen=True)
class Figures:
    """The numbers of a row, %; nan: unknown.

    Attributes
    ----------
    rms, half_width, coverage : float
        Rms error, median half-width and coverage of touches.
    mean_rms, mean_half_width, mean_coverage : float
        The same of means of four.
    shares : dict of float
    """

    rms: float
    half_width: float
    coverage: float
    mean_rms: float
    mean_half_width: float
    mean_coverage: float
    shares: dict[Share, float]

    @classmethod
    def of(cls, score: Score) -> "Figures":
        """Summarise a score."""
        return cls(
            rms=rms(score.touches),
            half_width=half_width(score.touches),
            coverage=coverage(score.touches),
            mean_rms=rms(score.means),
            mean_half_width=half_width(score.means),
            mean_coverage=coverage(score.means),
            shares={share: tally.percent for share, tally in score.tallies.items()},
        )


def rms(estimates: Sequence[Estimate]) -> float:
    """Return the root mean square of the known errors, %."""
    errors = [one.error for one in estimates if math.isfinite(one.error)]
    if not errors:
        return math.nan
    return 100 * float(np.sqrt(np.mean(np.square(errors))))


def half_width(estimates: Sequence[Estimate]) -> float:
    """Return the median half-width, %."""
    if not estimates:
        return math.nan
    return 100 * float(np.median([one.half_width for one in estimates]))


def coverage(estimates: Sequence[Estimate]) -> float:
    """Return the share of the intervals that contain the true modulus, %."""
    tally = Tally()
    for one in estimates:
        tally.add(one.holds)
    return tally.percent


@dataclass(frozen=True)
class Bounds:
    """The ranges in which the numbers of a row must be, %.

    Attributes
    ----------
    rms, half_width : float
        Largest ones, of touches.
    coverage, mean_coverage : tuple of float
    shares : dict of tuple
    has_rule : bool
        Whether the median half-width is at most `RULE` times the rms error.
    """

    rms: float = math.inf
    half_width: float = math.inf
    coverage: Allowed = (0.0, 100.0)
    mean_coverage: Allowed = (0.0, 100.0)
    shares: dict[Share, Allowed] = field(default_factory=dict)
    has_rule: bool = True

    def broken(self, figures: Figures) -> list[str]:
        """Return the bounds that do not hold; an unknown number is outside of any range."""
        limits = [
            Limit("rms", figures.rms, (0.0, self.rms)),
            Limit("half-width", figures.half_width, (0.0, self.half_width)),
            Limit("coverage", figures.coverage, self.coverage),
            Limit("of means", figures.mean_coverage, self.mean_coverage),
        ]
        for share, allowed in self.shares.items():
            limits.append(Limit(share, figures.shares[share], allowed))
        if self.has_rule:
            limits.append(Limit("half-width / rms", figures.half_width / figures.rms, (0.0, RULE)))
        return [str(limit) for limit in limits if not limit.holds]


@dataclass(frozen=True)
class Limit:
    """A number with its allowed range, %."""

    name: str
    value: float
    allowed: Allowed

    @property
    def holds(self) -> bool:
        """Whether the number is in its range; 0 to 100 or to inf allows any number."""
        low, high = self.allowed
        if low == 0 and high in (100, math.inf):
            return True
        return low <= self.value <= high

    def __str__(self) -> str:
        """Return the number and the range."""
        low, high = self.allowed
        value = percent(self.value)
        if low == 0:
            return f"{self.name} {value}, at most {high:.3g}"
        if high == 100:
            return f"{self.name} {value}, at least {low:g}"
        return f"{self.name} {value}, allowed {low:g} to {high:g}"


def percent(value: float) -> str:
    """Return a number as text; "-": unknown."""
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "inf"
    return f"{value:.3g}"
