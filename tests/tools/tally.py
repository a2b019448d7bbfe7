"""Numbers that tests collect in addition to pass or fail, over a whole session and all its workers."""

from collections import Counter
from collections.abc import Iterator
from typing import Any


class Tally:
    """Tries, rows and lost rows of each fault; examples of each property; largest deviations; sentences."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.largest: dict[str, float] = {}
        self.said: list[str] = []

    def say(self, line: str) -> None:
        """Add a line to the output at the end: the output of workers is not visible."""
        self.said.append(line)

    def count(self, what: str, number: int = 1) -> None:
        """Count examples of a property."""
        self.counts[what] += int(number)

    def note(self, what: str, value: float) -> None:
        """Keep the largest value of a name, as a Python float: workers can send no other type."""
        self.largest[what] = max(float(value), self.largest.get(what, 0.0))

    def fault(self, what: str, rows: int, lost: int) -> None:
        """Count one try of a fault: acknowledged rows, and how many of them were lost."""
        for name, number in {"tries": 1, "rows": rows, "rows lost": max(lost, 0)}.items():
            self.count(f"{what}, {name}", number)

    def add(self, sent: dict[str, Any]) -> None:
        """Add the numbers of a worker, the attributes of its tally."""
        self.counts.update(sent["counts"])
        self.said += sent["said"]
        for what, value in sent["largest"].items():
            self.note(what, value)

    def lines(self) -> Iterator[str]:
        """Return all numbers as text."""
        yield from sorted(self.said)
        yield from (f"largest {what}: {value:.3g}" for what, value in sorted(self.largest.items()))
        yield from (f"{what}: {number}" for what, number in sorted(self.counts.items()))
