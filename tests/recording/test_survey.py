"""The counts of a block: in one pass by the core where there is nothing to count, and as numpy counts any other."""

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from effort import draws, random_of
from numpy.typing import NDArray
from palpate._core import OwnRows
from palpate.recording.survey import Survey
from palpate.samples import Block, blank


def blocks(seed: int) -> list[Block]:
    """Return blocks that follow each other, most of them with one thing that is not ordinary, or none."""
    rng = np.random.default_rng(seed)
    rows = blank(int(rng.integers(3, 30)))
    rows["seq"] = np.arange(len(rows)) + 5
    rows["t_hard_ns"] = np.cumsum(rng.integers(0, 3, len(rows))) * 26_000_000
    for name in ("hard", "soft"):
        rows[name], rows[f"{name}_raw"] = rng.uniform(-1, 1, len(rows)), rng.integers(-1, 50, len(rows))
    others: list[tuple[str, NDArray[Any]]] = [
        ("seq", np.array([0, 7, 2**62, 2**63 - 1])),
        ("t_hard_ns", np.array([-1, 2**63 - 1, -(2**63)])),
        ("status", np.array([1, 2, 4, 8])),
        ("hard", np.array([np.nan, np.inf])),
        ("soft", np.array([np.nan, -np.inf])),
        ("hard_raw", np.array([50, 51])),
        ("soft_raw", np.array([50, 51])),
        ("status", np.array([0])),
    ]
    name, values = others[seed % len(others)]
    rows[int(rng.integers(len(rows)))][name] = rng.choice(values)
    return np.split(rows, np.sort(rng.integers(0, len(rows), 3)))


def surveyed(parts: list[Block], marked: frozenset[int]) -> dict[str, object]:
    survey = Survey(largest_code=50, marked=marked)
    for part in parts:
        survey.add(part)
    return asdict(survey)


def test_the_core_counts_as_numpy_does(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, ordinary, count = random_of("surveys"), 0, draws(400)
    for _ in range(count):
        parts = blocks(rng.randrange(10**9))
        marked = frozenset({9} if rng.random() < 0.1 else ())
        found = surveyed(parts, marked)
        ordinary += all(OwnRows().ordinary(part, 50) is not None for part in parts if len(part))
        with monkeypatch.context() as patch:
            patch.setattr(Survey, "_is_ordinary", lambda *_: False)
            assert found == surveyed(parts, marked)
    assert 0.05 * count < ordinary < 0.7 * count
