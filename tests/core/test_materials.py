"""Moduli from Shore hardness against published values, and against the durometer's own spring."""

import math

import pytest
from palpate.materials import BUMPS_SHORE_A, RELATIONS, modulus_of_shore_a


def test_gent_is_a_punch_and_a_spring() -> None:
    """E ~ force / depth of a flat punch: 0.55 N + 0.075 N S over 2.5 mm (1 - S / 100), whatever its radius.

    Gent's constants are rounded to four digits: 0.1 %.
    """

    def spring(hardness: float) -> float:
        return (0.55 + 0.075 * hardness) / (2.5 * (1 - hardness / 100))

    for hardness in (6, 20, 60, 90):
        expected = spring(hardness) / spring(40)
        assert modulus_of_shore_a(hardness) / modulus_of_shore_a(40) == pytest.approx(expected, rel=2e-3)


def test_the_error_function_is_inverted() -> None:
    for hardness in (1, 6, 40, 95):
        modulus = modulus_of_shore_a(hardness, "error_function")
        assert 100 * math.erf(3.186e-4 * math.sqrt(1e6 * modulus)) == pytest.approx(hardness, rel=1e-9)


@pytest.mark.parametrize(("relation", "quotient"), [("gent", 5.558), ("ruess", 6.295), ("error_function", 48.5)])
def test_the_bumps_of_the_paper(relation: str, quotient: float) -> None:
    hard, soft = (modulus_of_shore_a(hardness, relation) for hardness in BUMPS_SHORE_A)
    assert hard / soft == pytest.approx(quotient, rel=1e-3)


@pytest.mark.parametrize("relation", RELATIONS)
def test_a_harder_rubber_is_stiffer(relation: str) -> None:
    moduli = [modulus_of_shore_a(hardness, relation) for hardness in range(1, 96)]
    assert moduli == sorted(moduli)
    # Around 40 A the relations agree within a factor of 1.5.
    assert 1.3 < modulus_of_shore_a(40, relation) < 2.0


def test_refusals() -> None:
    for hardness in (0.5, 96.0, math.nan):
        with pytest.raises(ValueError, match=rf"hardness: got {hardness}, allowed: 1 to 95, Shore A"):
            modulus_of_shore_a(hardness)
    with pytest.raises(ValueError, match="relation: got 'luck', allowed: gent, ruess, error_function"):
        modulus_of_shore_a(40, "luck")
