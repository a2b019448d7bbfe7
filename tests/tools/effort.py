"""How much a test that draws its cases tries: as much as a commit may wait for, or ten times that in a night.

`.ci/nightly` sets PALPATE_NIGHTLY=1.
"""

import os

from hypothesis import settings

NIGHTLY = os.environ.get("PALPATE_NIGHTLY", "0") != "0"
TIMES = 10 if NIGHTLY else 1


def examples(count: int) -> settings:
    """Return hypothesis's settings for so many examples, times what the night allows."""
    return settings(max_examples=count * TIMES)
