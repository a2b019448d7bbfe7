"""Numbers that tests collect in addition to pass or fail, over a whole session and all its workers."""

from collections import Counter
from collections.abc import Iterator
from typing import Any


class Tally:
    """Number of examples, largest deviations, and rows written and lost for each fault."""

    def __init__(self) -> None:
        self.examples: Counter[str] = Counter()
        self.largest: dict[str, float] = {}
        self.faults: dict[str, list[int]] = {}
        self.said: list[str] = []

    def say(self, line: str) -> None:
        """Add a line to the output at the end: the output of workers is not visible."""
        self.said.append(line)

    def count(self, what: str) -> None:
        """Count one example of a property."""
        self.examples[what] += 1

    def note(self, what: str, value: float) -> None:
        """Keep the largest value of a name, as a Python float: workers can send no other type."""
        self.largest[what] = max(float(value), self.largest.get(what, 0.0))

    def fault(self, what: str, rows: int, lost: int) -> None:
        """Count one try of a fault: acknowledged rows, and how many of them were lost."""
        self._add_fault(what, [1, int(rows), max(int(lost), 0)])

    def _add_fault(self, what: str, counts: list[int]) -> None:
        known = self.faults.setdefault(what, [0, 0, 0])
        self.faults[what] = [old + new for old, new in zip(known, counts, strict=True)]

    def sent(self) -> dict[str, Any]:
        """Return the numbers as plain values, which a worker can send."""
        return {"examples": dict(self.examples), "largest": self.largest, "faults": self.faults, "said": self.said}

    def add(self, sent: dict[str, Any]) -> None:
        """Add the numbers of a worker."""
        self.examples.update(sent["examples"])
        self.said += sent["said"]
        for what, value in sent["largest"].items():
            self.note(what, value)
        for what, counts in sent["faults"].items():
            self._add_fault(what, counts)

    def fault_lines(self) -> Iterator[str]:
        """Return the table of faults, if there were any."""
        if self.faults:
            yield f"{'':52} {'tries':>6} {'rows':>9} {'lost':>5}"
        for what, (tries, rows, lost) in sorted(self.faults.items()):
            yield f"{what:52} {tries:6} {rows:9} {lost:5}"

    def property_lines(self) -> Iterator[str]:
        """Return the number of examples and the largest deviations, if there were any."""
        if self.examples:
            yield f"hypothesis examples: {self.examples.total()}"
            yield from (f"largest {what}: {value:.3g}" for what, value in sorted(self.largest.items()))
