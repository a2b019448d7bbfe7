"""Touches that fit another specimen better: under a wrong name, or specimens that were exchanged."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import log, sqrt
from statistics import median
from typing import NamedTuple

from palpate.uncertainty import TOUCH_SCATTER

_FAR = 4.0  # times the scatter: a touch is not of its specimen
_NEAR = 2.5  # times the scatter: a touch may be of this specimen
_NEARER = 0.4  # times the distance from its own specimen
_FEWEST = 3  # touches of a specimen that show the scatter
_TO_SCATTER = 1.4826  # the standard deviation of normal values, by their median distance
_NAMED = 6  # touches that scatter, at most


class NumberedRatio(NamedTuple):
    """The ratio of a touch, its number (below 1: of an earlier measurement), and how it is named."""

    number: int
    ratio: float
    name: str = ""

    def __str__(self) -> str:
        """Return how the touch is named in a sentence."""
        if self.name:
            return self.name
        return f"touch {self.number}" if self.number > 0 else "an earlier touch"


def _ratio(one: NumberedRatio) -> float:
    return one.ratio


def _number(one: NumberedRatio) -> int:
    return one.number


@dataclass(frozen=True)
class SpecimenRatios:
    """The ratios of the kept touches on a specimen of known modulus, MPa.

    Examples
    --------
    >>> SpecimenRatios("gel", 1.1, (NumberedRatio(5, 4.0), NumberedRatio(6, 4.4))).numbers
    (5, 6)
    """

    name: str
    modulus: float
    ratios: tuple[NumberedRatio, ...]

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers of its touches."""
        return tuple(map(_number, self.ratios))

    @property
    def level(self) -> float:
        """The logarithm of the median of its ratios."""
        return log(median(map(_ratio, self.ratios)))

    def without(self, numbers: set[int]) -> "SpecimenRatios":
        """Return the specimen without some of its touches."""
        kept = []
        for one in self.ratios:
            if one.number not in numbers:
                kept.append(one)
        return SpecimenRatios(self.name, self.modulus, tuple(kept))


@dataclass(frozen=True)
class Misplaced:
    """Touches that do not fit their specimen, and why.

    Attributes
    ----------
    numbers : tuple of int
        Numbers of the touches.
    text : str
        What they fit better, as a clause.
    """

    numbers: tuple[int, ...]
    text: str


def _is_touched(specimen: SpecimenRatios) -> bool:
    return bool(specimen.ratios)


def misplaced_touches(specimens: Sequence[SpecimenRatios]) -> list[Misplaced]:
    """Return the touches that fit another specimen better, and specimens that were exchanged.

    A touch is compared with the median of the other touches on its specimen, and with the medians
    of the other specimens, in units of the scatter from touch to touch. Then the specimens are
    compared: by eq. (2) their ratios rise with the modulus.

    Parameters
    ----------
    specimens : sequence of SpecimenRatios

    Returns
    -------
    list of Misplaced

    Examples
    --------
    >>> def specimen(name, modulus, *ratios, first):
    ...     return SpecimenRatios(name, modulus, tuple(map(NumberedRatio, range(first, 99), ratios)))
    >>> soft = specimen("soft", 0.2, 2.0, 2.0, 4.1, 2.1, first=1)
    >>> stiff = specimen("stiff", 1.0, 4.0, 4.1, 4.0, 3.9, first=5)
    >>> misplaced_touches([soft, stiff])
    [Misplaced(numbers=(3,), text='touch 3, on soft, fits stiff better')]
    >>> exchanged = specimen("soft", 0.2, 4.0, 4.1, first=1), specimen("stiff", 1.0, 2.0, 2.1, first=3)
    >>> [each.text for each in misplaced_touches(exchanged)]
    ['soft and stiff seem to be exchanged']
    """
    touched = sorted(filter(_is_touched, specimens), key=lambda specimen: specimen.modulus)
    scatter = _scatter(touched)
    found = list(_single_touches(touched, scatter))
    numbers: set[int] = set()
    for each in found:
        numbers.update(each.numbers)
    rest = []
    for specimen in touched:
        rest.append(specimen.without(numbers))
    return found + list(_wrong_order(list(filter(_is_touched, rest)), scatter))


def scattered_touches(specimens: Sequence[SpecimenRatios]) -> tuple[int, ...]:
    """Return the touches that are farthest from the median of their specimen, in order of number.

    Examples
    --------
    >>> ratios = [NumberedRatio(number, ratio) for number, ratio in enumerate([2, 2.02, 2.4, 2], 1)]
    >>> scattered_touches([SpecimenRatios("gel", 1.0, tuple(ratios))])
    (3,)
    """
    distances: dict[int, float] = {}
    for specimen in specimens:
        if len(specimen.ratios) > 1:
            for one in specimen.ratios:
                distances[one.number] = abs(log(one.ratio) - specimen.level)
    farthest = sorted(distances, key=lambda number: -distances[number])[:_NAMED]
    far = filter(lambda number: distances[number] > 2 * TOUCH_SCATTER, farthest)
    return tuple(sorted(far))


def _scatter(specimens: Sequence[SpecimenRatios]) -> float:
    """Return the scatter from touch to touch, relative; a few misplaced touches do not change it."""
    distances = []
    for specimen in specimens:
        if len(specimen.ratios) >= _FEWEST:
            for one in specimen.ratios:
                distances.append(abs(log(one.ratio) - specimen.level))
    if not distances:
        return TOUCH_SCATTER
    return max(TOUCH_SCATTER, _TO_SCATTER * median(distances))


def _single_touches(specimens: Sequence[SpecimenRatios], scatter: float) -> Iterator[Misplaced]:
    """Yield each touch that is far from the others on its specimen, and near another specimen."""
    for specimen in specimens:
        if len(specimen.ratios) < 2:
            continue
        for one in specimen.ratios:
            value = log(one.ratio)
            away = abs(value - specimen.without({one.number}).level)
            nearest = min(specimens, key=lambda each: abs(value - each.level))
            if away <= _FAR * scatter or nearest is specimen:
                continue
            if abs(value - nearest.level) < min(_NEAR * scatter, _NEARER * away):
                text = f"{one}, on {specimen.name}, fits {nearest.name} better"
                yield Misplaced((one.number,), text)


def _wrong_order(specimens: Sequence[SpecimenRatios], scatter: float) -> Iterator[Misplaced]:
    """Yield the specimens, in order of modulus, whose ratios do not rise with it."""
    by_level = sorted(range(len(specimens)), key=lambda place: specimens[place].level)
    falls = [pair for pair in pairwise(specimens) if _falls(*pair, scatter)]
    if not falls:
        return
    place_of = dict(zip(by_level, range(len(specimens)), strict=True))
    exchanged = _exchanges(specimens, place_of, scatter)
    if exchanged is not None:
        for one, other in exchanged:
            text = f"{one.name} and {other.name} seem to be exchanged"
            yield Misplaced((*one.numbers, *other.numbers), text)
        return
    rising = _longest_rise(specimens)
    for place, specimen in enumerate(specimens):
        if place in rising:
            continue
        nearest = _nearest(specimens, rising, specimen.level)
        text = (
            f"{specimen.name} has the ratio of {nearest.name}: another specimen was touched, or its "
            "modulus is wrong"
        )
        yield Misplaced(specimen.numbers, text)


def _falls(softer: SpecimenRatios, stiffer: SpecimenRatios, scatter: float) -> bool:
    """Return whether the ratio falls from one specimen to a stiffer one, beyond the scatter."""
    error = scatter * sqrt(1 / len(softer.ratios) + 1 / len(stiffer.ratios))
    return softer.level - stiffer.level > _NEAR * error


def _exchanges(
    specimens: Sequence[SpecimenRatios], place_of: Mapping[int, int], scatter: float
) -> list[tuple[SpecimenRatios, SpecimenRatios]] | None:
    """Return the pairs of specimens that were exchanged; None: pairs do not explain the order.

    Neighbours within the scatter may be in any order.
    """
    pairs = []
    for place, rank in place_of.items():
        if place_of[rank] != place:
            return None
        if place < rank and _falls(specimens[place], specimens[rank], scatter):
            pairs.append((specimens[place], specimens[rank]))
    return pairs or None


def _nearest(
    specimens: Sequence[SpecimenRatios], places: Sequence[int], level: float
) -> SpecimenRatios:
    """Return the specimen at one of these places whose level is the nearest."""
    place = min(places, key=lambda other: abs(specimens[other].level - level))
    return specimens[place]


def _longest_rise(specimens: Sequence[SpecimenRatios]) -> list[int]:
    """Return the places of a longest part of the specimens whose levels rise."""
    longest: list[list[int]] = []  # that ends at each place
    for place, specimen in enumerate(specimens):
        before: list[int] = []
        for other in range(place):
            is_below = specimens[other].level <= specimen.level
            if is_below and len(longest[other]) > len(before):
                before = longest[other]
        longest.append([*before, place])
    return max(longest, key=len)


def listed_numbers(numbers: Sequence[int]) -> str:
    """Return numbers as text, three or more in a row by their ends.

    Examples
    --------
    >>> listed_numbers([5, 6, 7, 8, 13, 17]), listed_numbers([4]), listed_numbers([1, 2])
    ('5 to 8, 13 and 17', '4', '1 and 2')
    """
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    texts: list[str] = []
    for run in runs:
        if len(run) > 2:
            texts.append(f"{run[0]} to {run[-1]}")
        else:
            texts += map(str, run)
    if len(texts) == 1:
        return texts[0]
    return f"{', '.join(texts[:-1])} and {texts[-1]}"
