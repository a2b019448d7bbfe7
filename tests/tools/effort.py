"""How many examples, changes and random cases the tests draw; and the seed of all of them.

PALPATE_DRAWS=few, the default, draws a tenth; all: all of them. `.ci/nightly` sets PALPATE_NIGHTLY=1,
ten times those of a commit or as many as a test says, and another PALPATE_SEED in each run.
"""

import os
from random import Random

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
