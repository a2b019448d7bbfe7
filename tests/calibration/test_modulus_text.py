"""Tables of moduli with uncertainties and Shore hardnesses."""

import re
from math import hypot
from pathlib import Path

import pytest
from palpate.calibration.modulus_text import (
    ModulusScale,
    percent_in,
    scale_of,
    uncertainty_column,
)
from palpate.calibration.specimen_files import read_moduli
from palpate.errors import CalibrationError
from palpate.materials import (
    DUROMETER_POINTS,
    RELATION_UNCERTAINTY,
    KnownModulus,
    modulus_of_shore_a,
)


def read(tmp_path: Path, text: str) -> tuple[dict[str, KnownModulus], list[str]]:
    """Return the moduli of a table, and the notes without the path."""
    path = tmp_path / "m.csv"
    path.write_text(text)
    notes: list[str] = []
    moduli = read_moduli(path, notes.append)
    return moduli, [note.removeprefix(f"{path}: ") for note in notes]


@pytest.mark.parametrize(
    ("text", "uncertainty"),
    [
        ("name,MPa,uncertainty %\na,2,5\n", 0.05),
        ("name;E, MPa;u(E), %\na;2;2,5\n", 0.025),
        ("name,modulus_MPa,u_MPa\na,2,0.1\n", 0.05),
        ("name,modulus_kPa,standard uncertainty [MPa]\na,2000,0.1\n", 0.05),
        ("name\tMPa\t± kPa\na\t2\t100\n", 0.05),
        ("name,MPa,sd in percent\na,2,5\n", 0.05),
        ("name,MPa,uncertainty %\na,2,0.1 MPa\n", 0.05),  # the unit of the cell holds
        ("name,MPa,uncertainty %\na,2,\n", None),
        ("name,MPa,uncertainty %\na,2\n", None),
        ("name,MPa,uncertainty %\na,2,0\n", 0.0),
        ("name,MPa\na,2,5 %\n", 0.05),
        ("name,MPa,supplier\na,2,Smooth-On\n", None),
        ("name,E\na,2 MPa\n", None),
        ("a,2000 kPa,5 %\n", 0.05),
    ],
)
def test_the_third_column(tmp_path: Path, text: str, uncertainty: float | None) -> None:
    moduli, _ = read(tmp_path, text)
    assert list(moduli) == ["a"]
    assert moduli["a"].modulus == pytest.approx(2.0)
    assert moduli["a"].uncertainty == pytest.approx(uncertainty)
    assert moduli["a"].common == 0.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,MPa,uncertainty\na,2,5\n", "line 1: got 'uncertainty' without a unit, allowed: %"),
        ("name,MPa,uncertainty psi\na,2,5\n", "line 1: got the unit 'psi'"),
        ("name,MPa,uncertainty % (k=2)\na,2,5\n", "allowed: standard uncertainties (k = 1)"),
        ("name,MPa,U95 %\na,2,5\n", "allowed: standard uncertainties (k = 1)"),
        ("name,MPa,uncertainty 95 %\na,2,5\n", "allowed: standard uncertainties (k = 1)"),
        ("name,MPa,expanded uncertainty %\na,2,5\n", "allowed: standard uncertainties (k = 1)"),
        ("name,MPa\na,2,0.1\n", "line 2: got '0.1' in a third column of unknown meaning"),
        ("name,MPa,height mm\na,2,8\n", "line 2: got '8' in a third column of unknown meaning"),
        ("a,2,0.1\n", "line 1: got '0.1' in a third column of unknown meaning"),
        ("name,MPa,u %\na,2,-5\n", "line 2: got '-5' as a standard uncertainty"),
        ("name,MPa,u %\na,2,high\n", "line 2: got 'high' as a standard uncertainty"),
        ("name,MPa,u %\na,2,nan\n", "line 2: got 'nan' as a standard uncertainty"),
        ("name,MPa,u %\na,2,100\n", "of 2 MPa, allowed: below 100 % of it"),
        ("name,MPa,u MPa\na,2,2\n", "of 2 MPa, allowed: below 100 % of it"),
        ("name,MPa,u in Shore A\na,2,2\n", "points of Shore A only for a hardness"),
    ],
)
def test_a_third_column_that_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CalibrationError, match=re.escape(message)):
        read(tmp_path, text)


@pytest.mark.parametrize(
    "text",
    [
        "name,Shore A\na,50\n",
        "name,hardness_shore_a\na,50\n",
        "name,hardness\na,50 A\n",
        "name,MPa\na,50 Shore A\n",
        "name,MPa\na,Shore A 50\n",
        "a,50A\n",
    ],
)
def test_a_hardness_is_converted_with_its_uncertainty(tmp_path: Path, text: str) -> None:
    moduli, notes = read(tmp_path, text)
    found = moduli["a"]
    assert found == KnownModulus.of_shore_a(50.0)
    assert found.modulus == modulus_of_shore_a(50.0)
    assert notes == []
    # The quotient of differences has the slope to 0.1 %.
    by_point = (modulus_of_shore_a(50.5) - modulus_of_shore_a(49.5)) / found.modulus
    whole = hypot(by_point * DUROMETER_POINTS, RELATION_UNCERTAINTY)
    assert found.whole == pytest.approx(whole, rel=1e-3)
    assert found.own**2 == pytest.approx(
        (by_point * DUROMETER_POINTS) ** 2 + RELATION_UNCERTAINTY**2 / 2, rel=2e-3
    )


def test_moduli_and_hardnesses_in_one_table(tmp_path: Path) -> None:
    moduli, notes = read(tmp_path, "name,modulus\na,0.9\nb,50 A\n")
    assert moduli == {"a": KnownModulus(0.9), "b": KnownModulus.of_shore_a(50.0)}
    assert notes == ["no unit of the moduli is named in its first line, MPa is assumed"]


def test_a_stated_uncertainty_of_a_hardness(tmp_path: Path) -> None:
    """Points replace those of the durometer; a percentage replaces the whole uncertainty."""
    points, _ = read(tmp_path, "name,Shore A,u in Shore A\na,50,1\n")
    assert points == {"a": KnownModulus.of_shore_a(50.0, 1.0)}
    percent, _ = read(tmp_path, "name,Shore A,u %\na,50,10\n")
    assert percent["a"].whole == 0.1
    assert percent["a"].hardness == 50.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name,Shore OO\na,50\n", "no relation between Shore OO and the modulus is known here"),
        ("name,Shore 00\na,50\n", "no relation between Shore OO"),
        ("name,Shore D\na,50\n", "no relation between Shore D"),
        ("name,MPa\na,50 OO\n", "line 2: got '50 OO', allowed: a modulus, or Shore A"),
        ("name,Shore A\na,19\n", "line 2: hardness: got 19, allowed: 20 to 90, Shore A"),
        ("name,MPa\na,95 A\n", "line 2: hardness: got 95, allowed: 20 to 90, Shore A"),
        ("name,MPa from Shore A\na,1\n", "names a unit and a Shore scale, allowed: one of them"),
        ("name,Shore A\na,hard\n", "line 2: got 'hard' as a modulus"),
    ],
)
def test_a_hardness_that_is_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(CalibrationError, match=re.escape(message)):
        read(tmp_path, text)


def test_a_column_that_is_not_used_is_named(tmp_path: Path) -> None:
    _, notes = read(tmp_path, "name,MPa,supplier\na,2,Smooth-On\n")
    assert notes == ["the column 'supplier' is not used"]


@pytest.mark.parametrize("text", ["3000", "1.5", "modulus", "E at 20 C", "specimen of rubber"])
def test_texts_without_a_scale(text: str) -> None:
    assert scale_of(text) == (text, None)


@pytest.mark.parametrize("header", ["supplier", "height, mm", "bulk"])
def test_other_columns(header: str) -> None:
    assert uncertainty_column(header) is None


def test_the_unit_of_a_column_of_uncertainties() -> None:
    assert uncertainty_column("u(E) [GPa]") == ModulusScale(power=3)


@pytest.mark.parametrize(
    ("text", "value"), [("5%", 0.05), ("5 %", 0.05), ("2,5%", 0.025), ("0%", 0.0)]
)
def test_a_percentage(text: str, value: float) -> None:
    assert percent_in(text) == pytest.approx(value)


@pytest.mark.parametrize("text", ["", "5", "0.05", "-1%", "100%", "nan%", "%", "5 MPa", "5%%"])
def test_other_texts_are_no_percentage(text: str) -> None:
    with pytest.raises(ValueError, match="allowed: a standard uncertainty in per cent"):
        percent_in(text)
