"""Tables of random dialects are read right, asked about, or refused."""

from collections import Counter
from pathlib import Path
from random import Random

from effort import SEED, draws
from random_tables import dialect, outcome  # tests/tools

COUNT = draws(150, 5000)


def test_no_table_is_read_wrong(tmp_path: Path) -> None:
    found: Counter[str] = Counter()
    wrong = []
    for seed in range(SEED, SEED + COUNT):
        way = dialect(Random(seed))
        ends, said = outcome(way, tmp_path)
        found[ends] += 1
        if ends == "wrong":
            wrong.append((seed, way, said))
    assert wrong == []
    assert found["right"] > COUNT / 4, found
