"""Number of examples of property tests: for a commit, or ten times that for the nightly run; and the seed of both.

`.ci/nightly` sets PALPATE_NIGHTLY=1, and another PALPATE_SEED in each run.
"""

import os
from random import Random

from hypothesis import settings

NIGHTLY = os.environ.get("PALPATE_NIGHTLY", "0") != "0"
SEED = int(os.environ.get("PALPATE_SEED", "0"))
TIMES = 10 if NIGHTLY else 1


def examples(count: int) -> settings:
    """Return hypothesis settings for this number of examples, ten times as many in the nightly run."""
    return settings(max_examples=count * TIMES)


def random_of(name: str) -> Random:
    """Return random numbers for a test: the same in every run without PALPATE_SEED."""
    return Random(f"{SEED} {name}")
