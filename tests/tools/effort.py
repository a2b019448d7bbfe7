"""How many examples, changes and random cases the tests draw; the seed of all of them; and the numbers that they collect.

PALPATE_DRAWS=few, the default, draws a tenth; all: all of them. `.ci/nightly` sets PALPATE_NIGHTLY=1,
ten times those of a commit or as many as a test says, and another PALPATE_SEED in each run.
"""

import os
from collections import Counter
from collections.abc import Iterable, Iterator
from random import Random
from typing import Any

from hypothesis import settings

NIGHTLY = os.environ.get("PALPATE_NIGHTLY", "0") != "0"
ALL = NIGHTLY or os.environ.get("PALPATE_DRAWS", "few") == "all"
SEED = int(os.environ.get("PALPATE_SEED", "0"))


def draws(count: int, nightly: int | None = None, *, at_least: int = 1) -> int:
    """Return how many to draw where a commit draws `count`: a tenth in a developer's run, but not below `at_least`."""
    if NIGHTLY:
        return 10 * count if nightly is None else nightly
    return count if ALL else min(count, max(at_least, count // 10))


def examples(count: int, nightly: int | None = None) -> settings:
    """Return hypothesis settings where a commit has this number of examples."""
    return settings(max_examples=draws(count, nightly, at_least=5))


def random_of(name: str) -> Random:
    """Return random numbers for a test: the same in every run without PALPATE_SEED."""
    return Random(f"{SEED} {name}")


class Tally:
    """Tries, rows and lost rows of each fault; examples of each property; largest deviations; sentences.

    They travel with the reports of the tests, also of workers.
    """

    def __init__(self, properties: list[tuple[str, object]]) -> None:
        self._properties = properties

    def say(self, line: str) -> None:
        """Add a line to the output at the end: the output of workers is not visible."""
        self._properties.append(("said", line))

    def count(self, what: str, number: int = 1) -> None:
        """Count examples of a property."""
        self._properties.append(("count", (what, int(number))))

    def note(self, what: str, value: float) -> None:
        """Keep the largest value of a name."""
        self._properties.append(("largest", (what, float(value))))

    def fault(self, what: str, rows: int, lost: int) -> None:
        """Count one try of a fault: acknowledged rows, and how many of them were lost."""
        for name, number in {"tries": 1, "rows": rows, "rows lost": max(lost, 0)}.items():
            self.count(f"{what}, {name}", number)


def lines(properties: Iterable[tuple[str, Any]]) -> Iterator[str]:
    """Return all numbers as text."""
    counts: Counter[str] = Counter()
    largest: dict[str, float] = {}
    said = []
    for kind, value in properties:
        if kind == "count":
            counts[value[0]] += value[1]
        elif kind == "largest":
            largest[value[0]] = max(value[1], largest.get(value[0], 0.0))
        elif kind == "said":
            said.append(value)
    yield from sorted(said)
    yield from (f"largest {what}: {value:.3g}" for what, value in sorted(largest.items()))
    yield from (f"{what}: {number}" for what, number in sorted(counts.items()))
