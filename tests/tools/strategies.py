"""Strategies for property tests: parameters and samples that are exact in the type under test."""

from typing import Any

import numpy as np
from hypothesis import strategies as st


def reals(low: float, high: float, width: Any) -> st.SearchStrategy[float]:
    """Floats of a width within [low, high]; 0 in place of values below 2^-40. The ends need not be exact in this width.

    So no product is subnormal, and powers of two scale all results exactly. core/test_extremes.py has the other values.
    """
    return st.floats(low, high, width=width, allow_subnormal=False).map(lambda v: v if abs(v) >= 2.0**-40 else 0.0)


@st.composite
def adaptive_settings(draw: st.DrawFn, width: int) -> dict[str, float]:
    """Parameters of AdaptiveRls, the complete useful range for data of about 1 pF."""
    steady = draw(reals(0.5, 1.0, width))
    threshold = draw(reals(0.0, 4.0, width))
    return {
        "steady": steady,
        "alarmed": draw(reals(0.25, steady, width)),
        "drift": draw(reals(0.0, 0.5, width)),
        "threshold": threshold,
        "clear_level": draw(st.one_of(st.just(0.0), st.just(threshold), reals(0.0, threshold, width))),
        "initial_ratio": draw(reals(-16.0, 16.0, width)),
        "initial_covariance": draw(reals(2.0**-10, 2.0**20, width)),
        "max_covariance": 2.0**20,
    }


@st.composite
def any_samples(draw: st.DrawFn, width: int, max_size: int = 40) -> tuple[list[float], list[float]]:
    """Arbitrary outputs and regressors: independent, of both signs, over six decades, with zeros in between."""
    regressor = st.one_of(st.just(0.0), reals(2.0**-10, 2.0**10, width), reals(-(2.0**10), -(2.0**-10), width))
    pairs = draw(st.lists(st.tuples(reals(-(2.0**10), 2.0**10, width), regressor), min_size=1, max_size=max_size))
    return [output for output, _ in pairs], [x for _, x in pairs]


@st.composite
def touch_samples(draw: st.DrawFn, width: int) -> tuple[list[float], list[float]]:
    """Draw a realistic press: a ratio of 1 to 8 with at most one step, and noise of up to 2 per cent."""
    size = draw(st.integers(20, 120))
    ratios = draw(st.tuples(reals(1.0, 8.0, width), reals(1.0, 8.0, width)))
    step = draw(st.integers(0, size))
    random: Any = draw(st.randoms(use_true_random=False))
    rounded = (lambda v: float(np.float32(v))) if width == 32 else float
    regressor = [rounded(0.25 * min(1.0, (k + 1) / 10) * random.uniform(0.95, 1.05)) for k in range(size)]
    output = [rounded(x * ratios[k >= step] * (1 + 0.02 * random.uniform(-1, 1))) for k, x in enumerate(regressor)]
    return output, regressor
