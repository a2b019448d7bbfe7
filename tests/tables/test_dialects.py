"""Text tables of every dialect: the same numbers, the same names."""

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError
from palpate.tables.cell.numbers import numbers
from palpate.tables.table import Table
from palpate.tables.text.parsing import parse

NAMES = ["time", "hard", "soft"]
BODY = "time,hard,soft\n0,1.5,2\n1,2.5,3\n"


def table(text: str | bytes) -> Table:
    return parse(Path("table.csv"), text if isinstance(text, bytes) else text.encode())


def values(found: Table, *columns: str) -> list[list[float]]:
    return [numbers(found, found.column(column)).tolist() for column in columns]


DIALECTS = [
    BODY,
    BODY.replace(",", ";").replace("\n", "\r\n"),
    "time;hard;soft\n0,0;1,5;2,0\n1,0;2,5;3,0\n",
    "time\thard\tsoft\n0\t1,5\t2\n1\t2,5\t3\n",
    '"time" "hard" "soft"\n"0" 1.5 2\n"1" 2.5 3\n',
    "time,hard,soft\n0,1.5,2,\n1,2.5,3\n",
    "time,hard,soft,\n0,1.5,2\n1,2.5,3\n",
    BODY.replace(",", "|"),
    "time  hard soft\n0  1.5 2\n1  2.5 3\n",
    '"time","hard","soft"\n"0","1.5","2"\n"1","2.5","3"\n',
    '"time","hard","soft"\n0,"1,5",2\n1,"2,5",3\n',
    "\ufeff" + BODY,
    "time , hard , soft ,\n 0 , 1.5 , 2 ,\n 1 , 2.5 , 3 ,\n",
    "Logger 7; made in 2019\n\nRate,45\nGain,2\nChannels,2\nBits,24\n" + BODY,
    "# a comment\n" + BODY,
    "# time hard soft\n0 1.5 2\n1 2.5 3\n",
    "% run 7\n%time,hard,soft\n0,1.5,2\n1,2.5,3\n",
    "! time ; hard ; soft\n0;1.5;2\n1;2.5;3\n",
    "time,hard,soft\n0 1.5 2\n1 2.5 3\n",
    BODY.replace("\n", "\r"),
    "time,hard,soft\n0,1.5e0,2\n1,+2.5,3E0\n",
    BODY.encode("utf-16"),
    BODY.encode("utf-16-le"),
    BODY.encode("utf-16-be"),
    BODY + "\x1a",
    "time,hard,soft,µ\n0,1.5,2,°\n1,2.5,3,°\n".encode("latin-1"),
    "time,hard,soft,€ “a”\n0,1.5,2,°\n1,2.5,3,°\n".encode("cp1252"),
    "sep=;\n" + BODY.replace(",", ";"),
    '"sep=,"\r\n' + BODY,
    "\ufeffsep=\t\n" + BODY.replace(",", "\t"),
    'time,"hard","soft\n"\n0,1.5,2\n1,2.5,3\n',
    "time,hard,soft\n0,1.5,\uff12\n1,\uff12\uff0e\uff15,3\n",
]


@pytest.mark.parametrize("text", DIALECTS)
def test_the_same_table_in_many_dialects(text: str | bytes) -> None:
    found = table(text)
    assert values(found, *NAMES) == [[0, 1], [1.5, 2.5], [2, 3]]
    assert found.notes == []
    assert found.lines[1] == found.lines[0] + 1


@pytest.mark.parametrize(
    ("header", "names"),
    [
        ("time (s) C1 (pF) C2 (pF)", ["time (s)", "C1 (pF)", "C2 (pF)"]),
        ("time  C1 hard  C2 soft", ["time", "C1 hard", "C2 soft"]),
        ("time;C1;C2", ["time", "C1", "C2"]),
    ],
)
def test_names_above_cells_between_blanks(header: str, names: list[str]) -> None:
    found = table(f"{header}\n0 1.5 2\n1 2.5 3\n")
    assert [found.name(column) for column in range(3)] == names
    assert found.header_fits


def test_a_name_with_a_line_end_is_one_name() -> None:
    found = table('time,"C1\n(pF)","C2\n(pF)"\n0,1.5,2\n1,2.5,3\n')
    assert [found.name(column) for column in range(3)] == ["time", "C1 (pF)", "C2 (pF)"]
    assert list(found.lines) == [4, 5]


@pytest.mark.parametrize(
    "row",
    [
        "2026-11-21T12:00:00.026,C1,6.123",
        "2026-11-21 12:00:00.5,C1,6.123",
        "2026-11-21 12:00:00,C1,6.123",
        "12:00:00.5,ok,6.123",
        "11/21/2026 12:00:00 PM,C1,6.123",
        '"21.11.2026 12:00:00,500",C1,6.1234',
    ],
)
def test_dates_and_texts_do_not_hide_a_row(row: str) -> None:
    found = table(f"stamp,id,value\n{row}\n{row}\n{row}\n")
    assert values(found, "value") == [[float(row.rsplit(",", 1)[1])] * 3]
    assert found.columns[0].cells[0] == row.split(",C")[0].split(",ok")[0].strip('"')


def test_one_column_is_a_table() -> None:
    found = table("6.1\n6.2\n6.3\n")
    assert (found.width, values(found, "1")) == (1, [[6.1, 6.2, 6.3]])
    named = table("C1 (pF)\n6,1\n6,2\n")
    assert (named.width, values(named, "C1")) == (1, [[6.1, 6.2]])
    padded = table("6,1234\n6,0234\n")
    assert (padded.width, values(padded, "1")) == (1, [[6.1234, 6.0234]])
    assert table("6,1\n6,2\n").width == 2


def test_rows_of_numbers_above_the_names_are_noted() -> None:
    found = table("2024,1,2\n" + BODY)
    assert len(found) == 2
    assert found.notes == ["1 rows of numbers are above the column names: treated as part of the header"]
    odd = table("hard,soft\nx,6.1\n1,6.1\n2,1\n")
    assert odd.notes == ["line 2 has numbers ('x, 6.1'): treated as part of the header"]


def test_a_title_is_no_part_of_a_name() -> None:
    found = table("Report of run 7,,\n,Ch1,Ch2\nTime (s),C (pF),C (pF)\n0,1,2\n1,2,3\n")
    assert [found.name(column) for column in range(3)] == ["Time (s)", "Ch1 C (pF)", "Ch2 C (pF)"]


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("\n\n", 1, "nothing but blank lines"),
        ("sep=,\n", 1, "nothing but blank lines"),
        ("hello\nworld\n", 1, "no row of numbers"),
        ("0,Mean\nMean\n", 1, "all rows of numbers are those of a summary"),
        (b"\x7fELF\n\0\0", 2, "a zero byte, so this is not a text file"),
        (b"\xff\xfe\x00", 1, "not text"),
        (b"\xff\xfe1\0\n\0\0\0", 2, "a zero byte"),
        ("time,hard,soft\n0,6.1x3,2\n1,1,2\n2,1,2\n", 2, "'6.1x3' in column 2 (hard) is neither a number"),
        ("time,hard,soft\n0,1,2\n1,1\n2,1,2\n", 3, "got 2 cells, allowed: 3, as in the other rows"),
        ("time,hard,soft\n0,1,2\n1,1,2,7\n2,1,2\n", 3, "got 4 cells, allowed: 3, as in the other rows"),
        ("time hard soft temp\n0 1 2 3\n1 2 3\n2 1 2 3\n", 3, "got 3 cells, allowed: 4, as in the other rows"),
        ("t,hard,soft\n0,5,6,123,4,2\n0,6,6,124,4,2\n", 2, "commas separate the cells and are decimal marks"),
        ("t,hard,soft\n0,6,123,4,211\n1,6,124,4,212\n", 2, "commas separate the cells and are decimal marks"),
    ],
)
def test_what_is_no_table_is_refused_with_its_line(text: str | bytes, line: int, reason: str) -> None:
    with pytest.raises(RecordingError) as caught:
        table(text)
    assert caught.value.line == line
    assert reason in str(caught.value)


def test_a_word_behind_a_row_is_a_column_of_its_own() -> None:
    found = table("time,hard,soft\n0,1,2\n1,2,3,tap\n2,3,4\n")
    assert values(found, *NAMES) == [[0, 1, 2], [1, 2, 3], [2, 3, 4]]
    assert list(found.columns[3].cells) == [None, "tap", None]


@given(st.binary(max_size=300))
def test_any_bytes_are_a_table_or_a_recording_error(data: bytes) -> None:
    try:
        found = table(data)
    except RecordingError:
        return
    assert len(found) > 0
    assert {len(column.cells) for column in found.columns} == {len(found)}
    found.describe()


CELLS = st.sampled_from(["0", "1.5", "6,123", "1.234,5", "OL", "", "x", "Mean", "#", "12:00:01", "pF", "6.1 pF", "5%", '"', "time"])  # fmt: skip


@given(st.lists(st.lists(CELLS, min_size=1, max_size=4), max_size=12), st.sampled_from(",;\t| "))
def test_any_cells_are_a_table_or_an_error(rows: list[list[str]], delimiter: str) -> None:
    try:
        found = table("\n".join(delimiter.join(row) for row in rows) + "\n")
    except RecordingError:
        return
    for column in range(found.width):
        with suppress(RecordingError, ValueError):
            assert len(numbers(found, column)) == len(found)


@given(st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=2, max_size=20), st.sampled_from(",;\t| "))
def test_what_is_written_is_read(rows: list[tuple[float, float, float]], delimiter: str) -> None:
    lines = [delimiter.join(NAMES), *(delimiter.join(map(repr, row)) for row in rows)]
    found = table("\n".join(lines) + "\n")
    assert list(zip(*values(found, *NAMES), strict=True)) == rows


@given(st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=2, max_size=20), st.sampled_from(";\t| "))
def test_what_is_written_with_commas_is_read(rows: list[tuple[float, float, float]], delimiter: str) -> None:
    lines = [delimiter.join(NAMES), *(delimiter.join(map(repr, row)) for row in rows)]
    found = table("\n".join(lines).replace(".", ",") + "\n")
    read = [numbers(found, column, "comma").tolist() for column in range(3)]
    assert list(zip(*read, strict=True)) == rows
