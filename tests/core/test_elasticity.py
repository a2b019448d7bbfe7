"""Eq. (2), its inverse and its derivative, in Python and in C++; moduli from Shore hardness."""

from collections.abc import Callable
from fractions import Fraction
from math import inf, nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from numeric import drive
from palpate.elasticity import Elasticity
from palpate.materials import modulus_of_shore_a

PROBE = Elasticity(8.5, 1.25, 0.97)
EPS = 2.0**-52


def exact_modulus(probe: Elasticity, ratio: float) -> Fraction:
    rigid, half, soft, r = map(
        Fraction, (probe.rigid_ratio, probe.half_modulus, probe.soft_ratio, ratio)
    )
    return half * (r - soft) / (rigid - r)


@given(st.floats(0.97, 8.5, exclude_max=True))
def test_modulus_and_slope_are_exact_to_rounding(ratio: float) -> None:
    exact = exact_modulus(PROBE, ratio)
    # Two differences (one of them may cancel, but of given numbers: rounded once), a quotient, a product: 4 roundings.
    assert abs(Fraction(PROBE.modulus(ratio)) - exact) <= 4 * Fraction(EPS) * exact
    left = Fraction(PROBE.rigid_ratio) - Fraction(ratio)
    slope = (
        Fraction(PROBE.half_modulus)
        * (Fraction(PROBE.rigid_ratio) - Fraction(PROBE.soft_ratio))
        / left**2
    )
    assert abs(Fraction(PROBE.slope(ratio)) - slope) <= 6 * Fraction(EPS) * slope


@given(st.floats(0, 1e300))
def test_the_ratio_is_exact_to_rounding_at_both_ends(modulus: float) -> None:
    rigid, half, soft, E = map(
        Fraction, (PROBE.rigid_ratio, PROBE.half_modulus, PROBE.soft_ratio, modulus)
    )
    exact = (E * rigid + half * soft) / (E + half)
    found = Fraction(PROBE.ratio(modulus))
    # Counted from the nearer end, the part that is added is at most half the span: 5 roundings of it, and the sum's.
    assert abs(found - exact) <= Fraction(EPS) * exact + 3 * Fraction(EPS) * (rigid - soft)
    assert PROBE.soft_ratio <= PROBE.ratio(modulus) <= PROBE.rigid_ratio


@pytest.mark.parametrize(
    ("call", "values", "message"),
    [
        (
            PROBE.modulus,
            (0.96, 8.5, 9.0, nan, inf, -inf),
            "ratio: got .*, allowed: 0.97 <= ratio < 8.5",
        ),
        (
            PROBE.slope,
            (0.96, 8.5, 9.0, nan, inf, -inf),
            "ratio: got .*, allowed: 0.97 <= ratio < 8.5",
        ),
        (PROBE.ratio, (-1e-9, nan), "modulus: got"),
        (Elasticity, (1.0, inf, nan), "rigid_ratio: got"),
        (lambda half: Elasticity(10.0, half), (0.0, inf, nan), "half_modulus: got"),
        (lambda soft: Elasticity(10.0, 2.0, soft), (inf, nan), "soft_ratio: got"),
        (modulus_of_shore_a, (0.5, 96.0, nan), "hardness: got .*, allowed: 1 to 95, Shore A"),
        (
            lambda name: modulus_of_shore_a(40, name),
            ("luck",),
            "got 'luck', allowed: gent, ruess, error_function",
        ),
    ],
)
def test_what_has_no_answer(
    call: Callable[[Any], object], values: tuple[Any, ...], message: str
) -> None:
    for value in values:
        with pytest.raises(ValueError, match=message):
            call(value)
    assert PROBE.ratio(inf) == 8.5


def test_the_header_gives_the_same_bits() -> None:
    moduli = [0.0, 0.143, 1.25, 8.68, 1e6, inf]
    for modulus, (ratio, back) in zip(moduli, drive("elasticity", moduli, 2), strict=True):
        assert PROBE.ratio(modulus) == ratio
        if modulus < inf:
            assert PROBE.modulus(ratio) == back
