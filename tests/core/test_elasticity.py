"""Eq. (2), its inverse and its derivative, in Python and in C++."""

import subprocess
from fractions import Fraction
from math import inf, isnan, nan
from pathlib import Path

import palpate
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate.elasticity import SORBOTHANE_MPA, Elasticity
from project import ROOT, need

PROBE = Elasticity(8.5, 1.25, 0.97)
EPS = 2.0**-52


def exact_modulus(probe: Elasticity, ratio: float) -> Fraction:
    rigid, half, soft, r = map(Fraction, (probe.rigid_ratio, probe.half_modulus, probe.soft_ratio, ratio))
    return half * (r - soft) / (rigid - r)


@given(st.floats(0.97, 8.5, exclude_max=True))
def test_modulus_and_slope_are_exact_to_rounding(ratio: float) -> None:
    exact = exact_modulus(PROBE, ratio)
    # Two differences (one of them may cancel, but of given numbers: rounded once), a quotient, a product: 4 roundings.
    assert abs(Fraction(PROBE.modulus(ratio)) - exact) <= 4 * Fraction(EPS) * exact
    left = Fraction(PROBE.rigid_ratio) - Fraction(ratio)
    slope = Fraction(PROBE.half_modulus) * (Fraction(PROBE.rigid_ratio) - Fraction(PROBE.soft_ratio)) / left**2
    assert abs(Fraction(PROBE.slope(ratio)) - slope) <= 6 * Fraction(EPS) * slope


@given(st.floats(0, 1e300))
def test_the_ratio_is_exact_to_rounding_at_both_ends(modulus: float) -> None:
    rigid, half, soft, E = map(Fraction, (PROBE.rigid_ratio, PROBE.half_modulus, PROBE.soft_ratio, modulus))
    exact = (E * rigid + half * soft) / (E + half)
    found = Fraction(PROBE.ratio(modulus))
    # Counted from the nearer end, the part that is added is at most half the span: 5 roundings of it, and the sum's.
    assert abs(found - exact) <= Fraction(EPS) * exact + 3 * Fraction(EPS) * (rigid - soft)
    assert PROBE.soft_ratio <= PROBE.ratio(modulus) <= PROBE.rigid_ratio


def test_as_printed_in_the_paper() -> None:
    probe = Elasticity.of_stiffness(800.0, 100.0)
    for stiffness in (1.0, 100.0, 400.0, 1e5):
        ratio = 800 * (stiffness + 100) / (100 * (stiffness + 800))
        assert probe.modulus(ratio) == pytest.approx(800 * 100 * (ratio - 1) / (800 - ratio * 100), rel=1e-12)
        assert probe.modulus(ratio) == pytest.approx(stiffness, rel=1e-11)
        assert probe.slope(ratio) == pytest.approx(800 * 100 * (800 - 100) / (800 - ratio * 100) ** 2, rel=1e-10)


@given(st.floats(1, 7.9, exclude_min=True))
def test_of_stiffness_costs_half_an_eps_of_the_rigid_ratio(ratio: float) -> None:
    hard, soft = 800.3, 100.7
    k_h, k_s, r = map(Fraction, (hard, soft, ratio))
    exact = k_h * k_s * (r - 1) / (k_h - r * k_s)
    # The quotient, half an eps of k_h / k_s, changes the difference to r by this part of it; the rest is 4 roundings.
    part = Fraction(EPS) / 2 * (k_h / k_s) / (k_h / k_s - r)
    assert (
        abs(Fraction(Elasticity.of_stiffness(hard, soft).modulus(ratio)) - exact)
        <= (2 * part + 4 * Fraction(EPS)) * exact
    )


def test_where_it_has_no_answer() -> None:
    for ratio in (0.96, 8.5, 9.0, nan, inf, -inf):
        for ask in (PROBE.modulus, PROBE.slope):
            with pytest.raises(ValueError, match=r"ratio: got .*, allowed: 0.97 <= ratio < 8.5"):
                ask(ratio)
    for modulus in (-1e-9, nan):
        with pytest.raises(ValueError, match="modulus: got"):
            PROBE.ratio(modulus)
    assert PROBE.ratio(inf) == 8.5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1.0, 2.0), "rigid_ratio: got 1.0"),
        ((inf, 2.0), "rigid_ratio: got inf"),
        ((10.0, 0.0), "half_modulus: got 0.0"),
        ((10.0, nan), "half_modulus: got nan"),
        ((10.0, 2.0, nan), "soft_ratio: got nan"),
    ],
)
def test_a_probe_that_is_none(arguments: tuple[float, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Elasticity(*arguments)


def test_table_1() -> None:
    assert len(SORBOTHANE_MPA) == 10
    assert list(SORBOTHANE_MPA.values()) == sorted(SORBOTHANE_MPA.values())
    assert SORBOTHANE_MPA["70 OO"] == 0.515
    assert sum(SORBOTHANE_MPA.values()) == pytest.approx(18.268)


def test_the_header_gives_the_same_bits(tmp_path: Path) -> None:
    program = tmp_path / "elasticity"
    source = ROOT / "tests" / "cpp" / "elasticity.cpp"
    subprocess.run([need("c++"), "-std=c++17", "-O2", f"-I{palpate.get_include()}", source, "-o", program], check=True)
    lines = subprocess.run([program], capture_output=True, text=True, check=True).stdout.splitlines()
    assert len(lines) == 6
    for line in lines:
        modulus, ratio, back, slope = (float(word) if "n" in word else float.fromhex(word) for word in line.split())
        assert PROBE.ratio(modulus) == ratio
        if modulus < inf:
            assert (PROBE.modulus(ratio), PROBE.slope(ratio)) == (back, slope)
        else:
            assert isnan(back)
            assert isnan(slope)
