"""Decimal marks, groups of digits and units in the cells: read with evidence, asked about, or refused."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError
from palpate.tables.cell.numbers import numbers, to_number
from palpate.tables.table import Column, Table
from palpate.tables.text.parsing import parse
from palpate.tables.units import PICOFARADS


def column(*cells: str, beside: tuple[str, ...] = (), unit: str = "") -> Table:
    columns = [Column(("hard",), list(cells), unit)] + ([Column(("time",), list(beside))] if beside else [])
    return Table(Path("t.csv"), columns, range(2, 2 + len(cells)))


@pytest.mark.parametrize(
    ("cells", "values"),
    [
        (("6.1", "6.123"), [6.1, 6.123]),
        (("6,1", "6,123"), [6.1, 6.123]),
        (("6.123", "7.123"), [6.123, 7.123]),
        (("0,123", "6,123"), [0.123, 6.123]),
        (("6,1234", "6,123"), [6.1234, 6.123]),
        (("1234,567", "6,123"), [1234.567, 6.123]),
        (("1.234,5", "6,1"), [1234.5, 6.1]),
        (("1,234.5", "2,345"), [1234.5, 2345]),
        (("1,234,567", "2,345"), [1234567, 2345]),
        (("1.234.567", "2.345"), [1234567, 2345]),
        (("1'234.5", "1\u2019234.5"), [1234.5, 1234.5]),
        (("1 234,5", "1\u00a0234,5", "1\u2009234,5", "1\u202f234,5"), [1234.5] * 4),
        (("1e5", "1E+05", "-1.5e-3"), [1e5, 1e5, -1.5e-3]),
        (("1,5E3", "2"), [1500, 2]),
        (("1,234e5", "2,5"), [123400, 2.5]),
        ((".5", "6."), [0.5, 6]),
        (("\u22126.1", "\uff16\uff0e\uff11", "+1"), [-6.1, 6.1, 1]),
        (("12", "1'234"), [12, 1234]),
    ],
)
def test_numbers_with_evidence(cells: tuple[str, ...], values: list[float]) -> None:
    assert numbers(column(*cells), 0).tolist() == values


@pytest.mark.parametrize(
    ("cells", "beside", "mark"),
    [
        (("6,123", "7,123"), ("0", "1"), "comma"),
        (("6,123", "7,123"), ("0.5", "1.5"), "comma"),
        (("6,123", "OL"), (), "comma"),
        (("6.123", "7.123"), ("0,5", "1,5"), "point"),
        (("6.123", "7.123"), ("12:00:00,5", "12:00:01,0"), "point"),
    ],
)
def test_a_doubtful_mark_is_asked_about(cells: tuple[str, ...], beside: tuple[str, ...], mark: str) -> None:
    found = column(*cells, beside=beside)
    asks = rf"got '{cells[0]}' in column 1 \(hard\), a decimal {mark} or a thousands separator\? allowed: decimal \"point\""
    with pytest.raises(ValueError, match=asks):
        numbers(found, 0)
    point, comma = (numbers(found, 0, decimal)[0] for decimal in ("point", "comma"))
    assert {point, comma} == {6.123, 6123}
    assert (point if mark == "point" else comma) == 6.123


@pytest.mark.parametrize(
    ("cells", "beside"), [(("6,123", "7,123"), ("0,5", "1,5")), (("6,123", "7,123"), ("12:00:00,5", "12:00:01,0"))]
)
def test_another_column_settles_the_mark(cells: tuple[str, ...], beside: tuple[str, ...]) -> None:
    assert numbers(column(*cells, beside=beside), 0).tolist() == [6.123, 7.123]


@pytest.mark.parametrize(
    ("cells", "line", "reason"),
    [
        (("6.1", "6,1"), 3, "'6,1' in column 1 (hard) is not a number with a decimal point, as other cells"),
        (("6.1", "6,123"), 3, "'6,123' in column 1 (hard) is not a number with a decimal point"),
        (("6,1", "OL", "6.123"), 4, "'6.123' in column 1 (hard) is not a number with a decimal comma"),
        (("6.123", "6,123"), 3, "'6,123' in column 1 (hard) is not a number with a decimal point"),
        (("1", "0x10"), 3, "'0x10' in column 1 (hard) is neither a number nor an overload mark"),
        (("1", "0o17"), 3, "'0o17'"),
        (("1", "1_0"), 3, "'1_0'"),
        (("1", "1 2"), 3, "'1 2'"),
        (("1", "12,34,56"), 3, "'12,34,56'"),
        (("1", "1D+05"), 3, "'1D+05'"),
        (("1", "6.1x3"), 3, "'6.1x3'"),
        (("1", "(6.1)"), 3, "'(6.1)'"),
        (("1", "6.1*"), 3, "is a number with a mark, the meaning of which is not known"),
        (("1", ">6.1"), 3, "is a number with a mark"),
        (("1", "5 %"), 3, "'5 %' in column 1 (hard) is in per cent"),
        (("6.1", "6.1 nF"), 3, "has the unit nF, other cells have another one, or none"),
    ],
)
def test_a_wrong_cell_is_blamed(cells: tuple[str, ...], line: int, reason: str) -> None:
    with pytest.raises(RecordingError) as caught:
        numbers(column(*cells), 0)
    assert caught.value.line == line
    assert reason in str(caught.value)


def test_the_asked_mark_holds_for_every_cell() -> None:
    assert numbers(column("6,123", "6.1234"), 0, "point").tolist() == [6123, 6.1234]
    with pytest.raises(
        RecordingError, match=r"'6\.1' in column 1 \(hard\) is not a number with a decimal comma, as asked"
    ):
        numbers(column("6,123", "6.1"), 0, "comma")


def test_cells_without_a_value() -> None:
    marks = ["OL", "", "nan", "-", "#N/A", "inf", "ol", "9.9E+37", "OVLD", "#REF!", "-1e30"]
    for other in ("1.5", "1,5", "1.234,5"):
        found = numbers(column(other, *marks), 0)
        assert np.isfinite(found).tolist() == [True] + [False] * len(marks)


def test_an_array_is_not_copied() -> None:
    cells = np.array([1.0, 2.0])
    found = numbers(Table(Path("t"), [Column(("a",), cells)], range(2)), 0)
    assert np.shares_memory(found, cells)


def read(text: str) -> Table:
    return parse(Path("t.csv"), text.encode())


@pytest.mark.parametrize("cells", [("6.5 pF", "7.5 pF"), ("6.5pF", "7.5pF"), ("6.5\u00a0pF", "OL", "7.5 pF")])
def test_a_unit_in_every_cell_is_the_unit_of_the_column(cells: tuple[str, ...]) -> None:
    found = read("time;hard\n" + "".join(f"{row};{cell}\n" for row, cell in enumerate(cells)))
    values = numbers(found, 1)
    assert values[np.isfinite(values)].tolist() == [6.5, 7.5]
    assert (found.columns[1].unit, found.unit(1, PICOFARADS), found.notes) == ("pF", "pF", [])


def test_units_in_a_column_of_their_own() -> None:
    for text in ("t hard\n0 6.5 nF\n1 7.5 nF\n", "t,hard,unit\n0,6.5,nF\n1,7.5,nF\n"):
        assert read(text).unit(1, PICOFARADS) == "nF"
    found = read("t,hard,unit\n0,6.5,nF\n1,750,pF\n")
    with pytest.raises(RecordingError, match=r"line 2: '6\.5 nF' in column 2 \(hard\) has the unit nF, other cells"):
        numbers(found, 1)


def test_a_unit_in_the_cells_is_stronger_than_that_of_the_name() -> None:
    found = read("t,hard (nF)\n0,6.5 pF\n1,7.5 pF\n")
    assert found.unit(1, PICOFARADS) == "pF"
    assert found.notes == ["'hard (nF)': its cells have the unit pF, which is used, not nF"]


def test_to_number() -> None:
    assert to_number("-1,5e3") == -1500
    assert math.isnan(to_number("+OL"))
    for wrong in ("1,234,567", "0x10", "1 2", "pF", "1_0"):
        with pytest.raises(ValueError, match=wrong):
            to_number(wrong)


@given(
    st.lists(st.decimals(-99_999, 99_999, places=2, allow_nan=False), min_size=1, max_size=20),
    st.sampled_from([(".", ","), (",", "."), (".", "'"), (",", " "), (",", "\u00a0"), (".", ""), (",", "")]),
)
def test_what_is_written_with_groups_is_read(values: list[object], marks: tuple[str, str]) -> None:
    cells = [f"{value:,}".translate({ord(","): marks[1], ord("."): marks[0]}) for value in values]
    assert numbers(column(*cells), 0).tolist() == [float(str(value)) for value in values]
