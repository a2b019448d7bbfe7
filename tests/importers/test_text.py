"""Text tables: the same numbers and names in every dialect; what is open is asked, what is wrong is refused by line."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate import read
from palpate.errors import RecordingError
from palpate.importers.delimited_text import text_table
from palpate.importers.table import ReadOptions, Table
from palpate.importers.units import to_number

NAMES = ["time", "hard", "soft"]
BODY = "time,hard,soft\n0,1.5,2\n1,2.5,3\n"


def table(text: str | bytes, decimal: str | None = None) -> Table:
    return text_table(
        Path("table.csv"),
        text if isinstance(text, bytes) else text.encode(),
        ReadOptions(decimal=decimal),
    )


def values(found: Table, *columns: str) -> list[list[float]]:
    return [found.column(column).numbers().tolist() for column in columns]


@pytest.mark.parametrize(
    "text",
    [
        BODY,
        '"time" "hard" "soft"\n"0" 1.5 2\n"1" 2.5 3\n',
        "time,hard,soft,\n0,1.5,2,\n1,2.5,3,\n",
        "time,hard,soft\n0,1.5,2,\n1,2.5,3,\n",
        '"time","hard","soft"\n0,"1,5",2\n1,"2,5",3\n',
        "\ufeff" + BODY,
        "time , hard , soft \n 0 , 1.5 , 2 \n 1 , 2.5 , 3 \n",
        "Logger 7; made in 2019\n\nRate,45\nGain,2\nChannels,2\nBits,24\n" + BODY,
        "# time hard soft\n0 1.5 2\n1 2.5 3\n",
        "% run 7\n%time,hard,soft\n0,1.5,2\n1,2.5,3\n",
        "time,hard,soft\n0 1.5 2\n1 2.5 3\n",
        BODY.replace("\n", "\r"),
        BODY + "\x1a",
        BODY.replace("\n1", "\n\n1"),
        "time,hard,soft,µ\n0,1.5,2,°\n1,2.5,3,°\n".encode("latin-1"),
    ],
)
def test_the_same_table_in_many_dialects(text: str | bytes) -> None:
    found = table(text)
    assert values(found, *NAMES) == [[0, 1], [1.5, 2.5], [2, 3]]
    assert found.notes == []


@pytest.mark.parametrize(
    ("header", "row", "names"),
    [
        ("time;C1;C2", "0 1.5 2", ["time", "C1", "C2"]),
        (
            "Report of run 7,,\n,Ch1,Ch2\nTime (s),C (pF),C (pF)",
            "0,1,2",
            ["Time (s)", "Ch1 C (pF)", "Ch2 C (pF)"],
        ),
        ("t;C1;C2\ns;pF;pF", "0;1;2", ["t (s)", "C1 (pF)", "C2 (pF)"]),
        ("Logger 7", "0;1;2", ["column 1", "column 2", "column 3"]),
        (
            "% Model: a.mph\n% Time (s)    C1 (pF)   C2 (pF)",
            "0  1  2",
            ["Time (s)", "C1 (pF)", "C2 (pF)"],
        ),
        ("C1,C2,C1\nMean,Mean,Max", "0,1,2", ["C1 Mean", "C2 Mean", "C1 Max"]),
        ("time;soft;hard", "0;0;1;2", ["column 1", "column 2", "column 3", "column 4"]),
    ],
)
def test_names_of_the_columns(header: str, row: str, names: list[str]) -> None:
    found = table(f"{header}\n{row}\n{row.replace('0', '1', 1)}\n")
    assert [column.name for column in found.columns] == names


def column(
    *cells: str, beside: str = "0", delimiter: str = ";", decimal: str | None = None
) -> list[float]:
    """Return the numbers in the first column of a table."""
    rows = "".join(f"{cell}{delimiter}{beside}\n" for cell in cells)
    found: list[float] = table(f"hard{delimiter}n\n{rows}", decimal).columns[0].numbers().tolist()
    return found


@pytest.mark.parametrize(
    ("cells", "found"),
    [
        (("6.123", "7.123"), [6.123, 7.123]),
        (("0,123", "6,123"), [0.123, 6.123]),
        (("6,1234", "6,123"), [6.1234, 6.123]),
        (("1234,567", "6,123"), [1234.567, 6.123]),
        (("1e5", "1E+05", "-1.5e-3"), [1e5, 1e5, -1.5e-3]),
        (("1,5E3", "2"), [1500, 2]),
        ((".5", "6.", "+1"), [0.5, 6, 1]),
        (
            ("0.1000000000000000055511151231257827", "4.35", "1.7976931348623157e308"),
            [0.1, 4.35, np.nan],
        ),
    ],
)
def test_numbers_with_evidence(cells: tuple[str, ...], found: list[float]) -> None:
    assert column(*cells) == pytest.approx(found, rel=0, abs=0, nan_ok=True)


def test_a_doubtful_mark_is_asked_about() -> None:
    for cells in (("6,123", "7,123"), ("6,123", "OL")):
        with pytest.raises(
            ValueError,
            match=r"decimal: got '[67],123'.* or a thousands separator\?, allowed: decimal",
        ):
            column(*cells)
    assert column("6,123", "7,123", beside="0,5") == [6.123, 7.123], "another column settles it"
    assert column("6,123", "7,123", decimal="comma") == [6.123, 7.123]
    with pytest.raises(
        RecordingError, match=r"'6,123' .* is neither a number with a decimal point"
    ):
        column("6,123", "7,123", decimal="point")


@pytest.mark.parametrize("wrong", ["0x10", "1_0", "1D+05", "6.1x3", "5%", "Mean", "1,234.5"])
def test_a_wrong_cell_is_refused_by_line(wrong: str) -> None:
    cells = ["1.5"] * 60
    cells[45] = wrong
    with pytest.raises((RecordingError, ValueError), match=r"line 47|decimal: got") as caught:
        column(*cells)
    assert wrong in str(caught.value)


@pytest.mark.parametrize("word", ["Mean", "Std dev", "average:", "Max", "Summe"])
def test_a_row_of_sums_is_refused_also_without_times(tmp_path: Path, word: str) -> None:
    rows = "".join(
        f"{6 + n % 7 / 10},{4 + n % 5 / 10},{'touch' if n == 20 else ''}\n" for n in range(60)
    )
    path = tmp_path / "sums.csv"
    cases: list[tuple[str, str, str, dict[str, Any]]] = [
        ("", "", "", {}),
        ("t (s),", "0.1,", ",", {"rate": 40.0}),
    ]
    for header, cell, empty, options in cases:
        body = "".join(f"{cell}{row}\n" for row in rows.splitlines())
        path.write_text(f"{header}C1 (pF),C2 (pF),notes\n{body}")
        assert len(read(path, **options)) == 60
        path.write_text(f"{header}C1 (pF),C2 (pF),notes\n{body}{empty}6.3,4.2,{word}\n")
        with pytest.raises(
            RecordingError, match=f"line 62: '{word}' in column . .notes. looks like a row of sums"
        ):
            read(path, **options)
    path.write_text(
        "C1 (pF),C2 (pF),of\n" + "".join(f"6.{n % 7},4.{n % 5},mean\n" for n in range(60))
    )
    assert len(read(path)) == 60, "each row is a mean"
    path.write_text(f"t (s),C1 (pF),C2 (pF),notes\n{body},6.3,4.2,promedio\n")
    with pytest.raises(
        RecordingError, match=r"line 62: an empty cell in column 1 .* looks like a row of sums"
    ):
        read(path, rate=40.0)


def test_cells_without_a_value() -> None:
    marks = [
        "OL",
        "",
        "nan",
        "∞",
        "-∞",
        "-",
        "N/A",
        "inf",
        "ol",
        "9.9E+37",
        "OVLD",
        "-1e30",
        "None",
    ]
    for other in ("1.5", "1,5"):
        here = [mark for mark in marks if other == "1.5" or "." not in mark]
        found = column(*[other] * 40, *here, *[other] * 3)
        assert np.isfinite(found).tolist() == [True] * 40 + [False] * len(here) + [True] * 3


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("\n\n", 1, "nothing but blank lines"),
        ("hello\nworld\n", 1, "no row of numbers"),
        (b"\x7fELF\n\0\0", None, "not a table that palpate reads"),
        (
            "time,hard,soft\n0,1,2\n1,1\n2,1,2\n3,1,2\n",
            3,
            "got 2 cells, allowed: 3, as in the other rows",
        ),
        (
            "time,hard,soft\n" + "0,1,2\n" * 300 + "1,1\n" * 200,
            2,
            "got 3 cells, allowed: 2, as in the other rows",
        ),
        (
            "time,hard,soft\n0,1,2\n1,1,2,7\n2,1,2\n3,1,2\n",
            3,
            "got 4 cells, allowed: 3, as in the other rows",
        ),
        ("time,hard,soft\n0,1x,2\n1,1,2\n2,1,2\n", 2, "'1x' in column 2"),
        (
            "t hard soft temp\n0 1 2 3\n1 2 3\n2 1 2 3\n3 1 2 3\n",
            3,
            "got 3 cells, allowed: 4, as in the other rows",
        ),
        (
            "t,hard,soft\n0,5,6,123,4,2\n0,6,6,124,4,2\n",
            2,
            "commas separate the cells and are decimal marks",
        ),
        (
            "Mean,Max,Min\ntime (s),C1,C2\n0,1.5,2\n1,2,3\n",
            1,
            "'Mean,Max,Min' above the names is of statistics",
        ),
        ("run 7\n# Min,Mean,Max\n,C1,C2\n0,1.5,2\n1,2,3\n", 2, "take these rows out"),
        ("2024,1,2\ntime,hard,soft\n0,1.5,2\n1,2,3\n2,2,2\n", 2, "'time' in column 1"),
        ('n,hard,soft,note\n0,1,2,"a\nb"\n1,1,2,ok\n2,1,2,ok\n3,1,2,ok\n', 3, ""),
    ],
)
def test_what_is_no_table_is_refused_with_its_line(
    text: str | bytes, line: int | None, reason: str
) -> None:
    with pytest.raises(RecordingError) as caught:
        table(text)
    assert (caught.value.line, reason in str(caught.value)) == (line, True), caught.value


def test_comments_and_an_incomplete_last_row_are_left_out_with_a_note() -> None:
    found = table(BODY + "# pump on\n2,3.5,4\n# off\n3,4.5,5\n4,5.5,6")  # of 6.1, perhaps
    assert found.notes == [
        "the last row is incomplete (no line end): left out",
        "line 4 is no row ('# pump on'), and 1 more lines: left out",
    ]
    assert (values(found, "hard"), list(found.lines)) == ([[1.5, 2.5, 3.5, 4.5]], [2, 3, 5, 7])


def test_to_number() -> None:
    assert (to_number("-1,5e3"), to_number("6.1")) == (-1500, 6.1)
    assert np.isnan([to_number("+OL"), to_number("9.9e37")]).all()
    with pytest.raises(ValueError, match="1_0"):
        to_number("1_0")


CELLS = st.sampled_from(
    [
        "0",
        "1.5",
        "6,123",
        "1.234,5",
        "OL",
        "",
        "x",
        "Mean",
        "#",
        "12:00:01",
        "pF",
        "5%",
        '"',
        "time",
    ]
)
ANY = st.lists(st.lists(CELLS, min_size=1, max_size=4), max_size=12)


@given(st.tuples(ANY, st.sampled_from(",;\t| ")) | st.binary(max_size=300))
def test_any_text_is_a_table_or_an_error(drawn: tuple[list[list[str]], str] | bytes) -> None:
    with suppress(RecordingError, ValueError):
        found = table(
            drawn if isinstance(drawn, bytes) else "\n".join(drawn[1].join(row) for row in drawn[0])
        )
        for each in found.columns:
            with suppress(RecordingError, ValueError):
                assert len(each.numbers()) == len(found) > 0


@given(
    st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=2, max_size=20),
    st.sampled_from(",;\t| "),
    st.booleans(),
)
def test_what_is_written_is_read(
    rows: list[tuple[float, float, float]], delimiter: str, comma: bool
) -> None:
    text = (
        "\n".join([delimiter.join(NAMES), *(delimiter.join(map(repr, row)) for row in rows)]) + "\n"
    )
    comma = comma and delimiter != ","
    found = table(text.replace(".", ",") if comma else text, "comma" if comma else "point")
    assert list(zip(*values(found, *NAMES), strict=True)) == rows
