"""Numbers that tests collect in addition to pass or fail: they travel with the reports of the tests, also of workers."""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any


class Tally:
    """Tries, rows and lost rows of each fault; examples of each property; largest deviations; sentences."""

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
