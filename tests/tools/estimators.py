"""All estimators of the package, for tests that are the same for all of them."""

import palpate
import pytest

ALL = [
    palpate.Rls,
    palpate.AdaptiveRls,
    palpate.HandoverRls,
    palpate.Rls32,
    palpate.AdaptiveRls32,
    palpate.HandoverRls32,
]
every = pytest.mark.parametrize("kind", ALL)
