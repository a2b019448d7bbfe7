"""Number of examples of property tests: for a commit, or ten times that for the nightly run.

`.ci/nightly` sets PALPATE_NIGHTLY=1.
"""

import os

from hypothesis import settings

NIGHTLY = os.environ.get("PALPATE_NIGHTLY", "0") != "0"
TIMES = 10 if NIGHTLY else 1


def examples(count: int) -> settings:
    """Return hypothesis settings for this number of examples, ten times as many in the nightly run."""
    return settings(max_examples=count * TIMES)
