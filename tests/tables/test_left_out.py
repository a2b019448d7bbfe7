"""Comments, summaries and repeated names are left out and noted; what is not surely one of them is refused."""

from itertools import pairwise
from pathlib import Path

import pytest
from palpate import RecordingError
from palpate.tables.cell.numbers import numbers
from palpate.tables.table import Table
from palpate.tables.text.parsing import parse
from palpate.tables.text.rows import TORN

HEAD = "time,hard,soft\n"
ROWS = "0,1.5,2\n1,2.5,3\n2,3.5,4\n"


def table(text: str) -> Table:
    return parse(Path("table.csv"), text.encode())


@pytest.mark.parametrize(
    ("added", "note"),
    [
        ("Mean,2.5,3\nStd,1,1\nMax,3.5,4\n", "lines 5 to 7 are no samples ('Mean', ...): left out"),
        ("Average:,6.1,4.2\n", "line 5 is no sample ('Average:'): left out"),
        ("Mittelwert,2.5,3\n", "line 5 is no sample ('Mittelwert'): left out"),
        ("\n,2.5,3\n", "line 6 is no sample ('2.5'): left out"),
        (",Mean,3\n", "line 5 is no sample ('Mean'): left out"),
        ("1,2.5,3,Mean\n", "line 5 is no sample ('1'): left out"),
        ("n=3,,\n", "line 5 is no sample ('n=3'): left out"),
        ("Count: 3\n", "line 5 is no sample ('Count: 3'): left out"),
        ("End of data\n", "line 5 is no sample ('End of data'): left out"),
        ("Stopped by user,,\n", "line 5 is no sample ('Stopped by user'): left out"),
        ("Spread,2,2\n", "line 5 is no sample ('Spread'): left out"),
        ("# end\n", "line 5 is a comment ('# end'): left out"),
        ('"# end, of 3"\n', "line 5 is a comment ('# end, of 3'): left out"),
        ("; end\n// of\n% it\n! all\n", "lines 5 to 8 are comments ('; end', ...): left out"),
        (HEAD, "line 5 repeats the column names ('time'): left out"),
        ("#" + HEAD, "line 5 repeats the column names ('#time'): left out"),
    ],
)
def test_rows_at_the_end_that_are_no_samples(added: str, note: str) -> None:
    found = table(HEAD + ROWS + added)
    assert [numbers(found, column).tolist() for column in range(3)] == [[0, 1, 2], [1.5, 2.5, 3.5], [2, 3, 4]]
    assert found.notes == [note]


@pytest.mark.parametrize(
    "added", ["Mean,2.5,3\n", "# a comment\n", HEAD, "Logging was paused\n", "1,2.5,3,Mean\n", "#1,2,3\n"]
)
def test_rows_in_between_that_are_no_samples(added: str) -> None:
    found = table(HEAD + ROWS + added + "3,4.5,5\n4,5.5,6\n")
    assert numbers(found, 0).tolist() == [0, 1, 2, 3, 4]
    assert list(found.lines) == [2, 3, 4, 6, 7]
    [note] = found.notes
    assert note.startswith("line 5 ")


def test_lines_far_apart_are_named_in_one_note() -> None:
    found = table(HEAD + "".join(f"# {i}\n{i},1,2\n" for i in range(8)))
    [note] = found.notes
    assert note == "lines 4, 6, 8, 10, 12 and 2 more are comments ('# 1', ...): left out"


@pytest.mark.parametrize(
    ("wrong", "line", "reason"),
    [
        ("1.5,6.1x3,3\n", 5, "'6.1x3' in column 2 (hard) is neither a number nor an overload mark"),
        ("1.5,Mean,3\n", 5, "'Mean' in column 2 (hard)"),
        ("1O.5,6.1,3\n", 5, "'1O.5' in column 1 (time)"),
        ("Timeout,6.1,3\n", 5, "'Timeout' in column 1 (time)"),
        ("x,y,z\n", 5, "'x' in column 1 (time)"),
        ("6.1x3,,\n", 5, "'6.1x3' in column 1 (time)"),
        ("time,soft,hard\n", 5, "other column names than above: 'time, soft, hard'"),
        ("# time,soft,hard\n", 5, "other column names than above: 'time, soft, hard'"),
        ("1.5,2\n", 5, "got 2 cells, allowed: 3, as in the other rows"),
        ("690\n", 5, "got 1 cells, allowed: 3, as in the other rows"),
    ],
)
def test_what_is_not_surely_left_out_is_refused(wrong: str, line: int, reason: str) -> None:
    with pytest.raises(RecordingError) as caught:  # noqa: PT012
        found = table(HEAD + ROWS + wrong + "3,4.5,5\n4,5.5,6\n")
        for column in range(3):
            numbers(found, column)
    assert caught.value.line == line
    assert reason in str(caught.value)


def test_a_blank_time_in_between_is_a_row() -> None:
    found = table(HEAD + ROWS + ",4.5,5\n4,5.5,6\n")
    assert len(found) == 5
    assert found.notes == []


def test_a_mark_of_no_value_is_no_comment() -> None:
    found = table(HEAD + "#N/A,1.5,2\n" + ROWS)
    assert len(found) == 4
    assert table(HEAD.replace(",", ";") + ";1,5;2\n0;1,5;2\n1;2,5;3\n").lines == [2, 3, 4]


def test_labels_of_all_rows_are_no_summary() -> None:
    rows = [f"{t},{name},{t}.5" for t in range(20) for name in ("Min", "Max")]
    assert len(table("time,id,value\n" + "\n".join(rows) + "\n")) == 40
    found = table("label,time,hard\nA,0,1\nA,1,2\nA,2,3\nMean,,2\n")
    assert (len(found), found.notes) == (3, ["line 5 is no sample ('Mean'): left out"])


@pytest.mark.parametrize("end", ["2,5", "2,5,6", "2,5,6.123", "Mea"])
def test_a_last_row_without_a_line_end_is_left_out(end: str) -> None:
    found = table(HEAD + "0,1,2\n1,3,4\n" + end)
    assert numbers(found, 1).tolist() == [1, 3]
    assert found.notes == ([TORN] if end[0] == "2" else ["line 4 is no sample ('Mea'): left out"])


def test_every_row_is_a_sample_or_in_a_note() -> None:
    """No row of a file with all of these is lost."""
    text = "Logger\n" + HEAD + "# a\n" + ROWS + "Mean,1,2\n" + HEAD + ROWS + "# b\nMean,1,2\nEnd\n"
    found = table(text)
    assert list(found.lines) == [4, 5, 6, 9, 10, 11]
    assert found.notes == [
        "line 12 is a comment ('# b'): left out",
        "lines 7, 13 to 14 are no samples ('Mean', ...): left out",
        "line 8 repeats the column names ('time'): left out",
    ]
    assert all(b > a for a, b in pairwise(found.lines))
