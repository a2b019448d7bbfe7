"""What a calibration that grows touch by touch still needs, and how well its rigid ratio is known after each touch."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from palpate._core import Touch
from palpate.calibration import Calibration
from palpate.calibration.characterise import Specimen
from palpate.errors import PalpateError, listed
from palpate.several import objections

FEWEST = 3
"""Specimens of different moduli that eq. (2) needs."""
Numbered = tuple[int, Touch, bool]
"""Number of a touch, the touch, and whether it is kept."""


@dataclass(frozen=True)
class Known:
    """A specimen of known modulus, and its touches.

    Attributes
    ----------
    name : str
    modulus : float, MPa
    wanted : int
        Touches that shall be kept.
    touches : tuple of (int, Touch, bool)
        Number, touch, and whether it is kept.

    Examples
    --------
    >>> Known("30 OO", 0.143, 4).kept
    []
    """

    name: str
    modulus: float
    wanted: int
    touches: tuple[Numbered, ...] = ()

    @property
    def kept(self) -> list[Touch]:
        """The touches that are kept."""
        return [touch for _, touch, kept in self.touches if kept]

    @property
    def usable(self) -> list[Touch]:
        """The kept touches that a fit can use."""
        return [touch for touch in self.kept if not objections(touch)]

    @property
    def lacks(self) -> int:
        """Number of touches that it still needs."""
        return max(self.wanted - len(self.usable), 0)


def missing(known: Sequence[Known]) -> list[str]:
    """Return what is still missing, as sentences; empty if the plan is fulfilled.

    Examples
    --------
    >>> missing([Known("30 OO", 0.143, 4), Known("70 A", 8.68, 4)])[-1]
    'Not touched yet: 30 OO, 70 A.'
    """
    found = []
    begun = [each for each in known if each.usable]
    if len({each.modulus for each in begun}) < FEWEST:
        found.append(f"{len(begun)} of at least {FEWEST} specimens are touched.")
    if begun and not any(len(each.usable) > 1 for each in begun):
        found.append("No specimen has two touches: the scatter from touch to touch is not known.")
    if lacking := [f"{each.name} ({each.lacks} more)" for each in begun if each.lacks]:
        found.append(f"Begun: {listed(lacking)}.")
    if untouched := [each.name for each in known if not each.usable]:
        found.append(f"Not touched yet: {listed(untouched)}.")
    return found


def next_best(known: Sequence[Known]) -> str:
    """Return what to touch next, as a sentence; empty if nothing is missing.

    A specimen that is begun comes first; then those that widen the range of the moduli.

    Examples
    --------
    >>> next_best([Known("30 OO", 0.143, 4), Known("30 A", 0.87, 4), Known("70 A", 8.68, 4)])
    'Next: 30 OO, then 70 A.'
    """
    lacking = [each for each in known if each.lacks]
    low, high = min(known, key=_modulus), max(known, key=_modulus)
    lacking.sort(key=lambda each: (not each.usable, each not in (low, high), each.modulus))
    if not lacking:
        return ""
    names = [each.name for each in lacking[:2]]
    return f"Next: {', then '.join(names)}.{_open_range([each.modulus for each in known if not each.lacks], low, high)}"


def _open_range(done: Sequence[float], low: Known, high: Known) -> str:
    if done and min(done) > low.modulus:
        return f" Below {min(done):g} MPa no specimen is finished."
    if done and max(done) < high.modulus:
        return f" Above {max(done):g} MPa no specimen is finished."
    return ""


def _modulus(known: Known) -> float:
    return known.modulus


Fitting = Callable[[Sequence[Known]], tuple[list[Specimen], Calibration]]


class Growth:
    """Relative standard error of the rigid ratio after each touch; each fit is done once.

    Parameters
    ----------
    fit : callable
        Returns the specimens and the calibration; raises an error where there is none.
    """

    def __init__(self, fit: Fitting) -> None:
        self._fit = fit
        self._found: dict[tuple[tuple[str, float, float], ...], float | None] = {}

    def history(self, known: Sequence[Known]) -> list[float]:
        """Return the relative standard error after each touch, from the first fit on."""
        numbers = sorted(n for each in known for n, _, kept in each.touches if kept)
        found: dict[tuple[tuple[str, float, float], ...], float | None] = {}
        for last in numbers:
            part = [replace(each, touches=tuple(row for row in each.touches if row[0] <= last)) for each in known]
            key = tuple((each.name, each.modulus, touch.ratio) for each in part for touch in each.kept)
            found[key] = self._found[key] if key in self._found else self._error(part)
        self._found = found
        return [error for error in found.values() if error is not None]

    def _error(self, known: Sequence[Known]) -> float | None:
        try:
            _, calibration = self._fit(known)
        except (ValueError, PalpateError):
            return None
        return float(calibration.fitted.covariance[0, 0] ** 0.5 / calibration.probe.rigid_ratio)
