"""Tables as other people's loggers write them."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate import Recording, RecordingError, read
from palpate.tables.formats import read_table
from palpate.tables.numbers import to_number

MAP = {"hard": "hard", "soft": "soft"}


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    "text",
    [
        "time,hard,soft\n0,1.5,2\n1,2.5,3\n",
        "time;hard;soft\r\n0;1.5;2\r\n1;2.5;3\r\n",
        "time;hard;soft\n0,0;1,5;2,0\n1,0;2,5;3,0\n",
        "time\thard\tsoft\n0\t1,5\t2\n1\t2,5\t3\n",
        '"time" "hard" "soft"\n"0" 1.5 2\n"1" 2.5 3\n',
        "time,hard,soft\n0,1.5,2,\n1,2.5,3\n",
        "time|hard|soft\n0|1.5|2\n1|2.5|3\n",
        "time  hard soft\n0  1.5 2\n1  2.5 3\n",
        '"time","hard","soft"\n"0","1.5","2"\n"1","2.5","3"\n',
        "\ufefftime,hard,soft\n0,1.5,2\n1,2.5,3\n",
        "time , hard , soft ,\n 0 , 1.5 , 2 ,\n 1 , 2.5 , 3 ,\n",
        "Logger 7; made in 2019\n\nRate,45\ntime,hard,soft\n0,1.5,2\n1,2.5,3\n",
        "# a comment\ntime,hard,soft\n0,1.5,2\n# another\n1,2.5,3\n",
        "time,hard,soft\r0,1.5,2\r1,2.5,3\r",
        "time,hard,soft\n0,1.5e0,2\n1,+2.5,3E0\n",
        "time,hard,soft\n0,1.5,2\n1,2.5,3\n".encode("utf-16"),
        "time,hard,soft,µ\n0,1.5,2,°\n1,2.5,3,°\n".encode("latin-1"),
    ],
)
def test_the_same_table_in_many_dialects(tmp_path: Path, text: str | bytes) -> None:
    recording = read(write(tmp_path, text), columns=MAP, unit="pF")
    assert recording.t_hard_s.tolist() == [0, 1]
    assert recording.hard.tolist() == [1.5, 2.5]
    assert recording.soft.tolist() == [2, 3]
    assert recording.notes == ()


@pytest.mark.parametrize(
    ("header", "factor"),
    [
        ("hard (pF)", 1),
        ("hard [fF]", 1e-3),
        ("hard_nF", 1e3),
        ("hard / aF", 1e-6),
        ("hard (F)", 1e12),
        ("hard (µF)", 1e6),
    ],
)
def test_units_in_the_header_are_heeded(tmp_path: Path, header: str, factor: float) -> None:
    path = write(tmp_path, f"t_ms,{header},soft\n0,1,2\n500,3,4\n")
    recording = read(path, columns={"hard": 2, "soft": "soft"})
    assert recording.hard == pytest.approx([factor, 3 * factor], rel=1e-15)
    assert recording.soft.tolist() == [2, 4]
    assert recording.t_hard_s.tolist() == [0, 0.5]
    assert read(path, columns={"hard": 2, "soft": 3}, unit="nF").hard.tolist() == [1e3, 3e3]


def test_names_of_several_header_rows(tmp_path: Path) -> None:
    path = write(tmp_path, ",Ch1,,Ch2,\nTime (s),C (pF),D (%),C (pF),D (%)\n0.1,1,5,2,6\n0.1,3,5,4,6\n")
    pairs: list[tuple[str | int, str | int]]
    pairs = [("Ch1", "Ch2"), ("2", 4), ("Ch1 C (pF)", "Ch2 C"), (2, "ch2")]
    for hard, soft in pairs:
        recording = read(path, columns={"hard": hard, "soft": soft})
        assert (recording.hard.tolist(), recording.soft.tolist()) == ([1, 3], [2, 4])
    bad: list[tuple[str | int, str]]
    bad = [
        ("C (pF)", r"'C \(pF\)', the name of several columns, allowed: one of the positions 2, 4"),
        ("Ch3", r"'Ch3', allowed: 1 \(Time \(s\)\), 2 \(Ch1 C \(pF\)\)"),
        (0, "position 0, allowed: 1 to 5"),
        (6, "position 6, allowed: 1 to 5"),
        (3, "in per cent"),
    ]
    for wrong, message in bad:
        with pytest.raises(ValueError, match=message):
            read(path, columns={"hard": wrong, "soft": 4})


def test_cells_without_a_value_are_kept_as_nan_and_told(tmp_path: Path) -> None:
    rows = "".join(
        f"{i},{cell},2\n"
        for i, cell in enumerate(["1", "OL", "", "nan", "-", "#N/A", "inf", "ol", "9.9E+37", "OVLD", "2"])
    )
    recording = read(write(tmp_path, "time,hard,soft\n" + rows), columns=MAP, unit="pF")
    assert np.isfinite(recording.hard).tolist() == [True, *[False] * 9, True]
    assert recording.notes == ("9 of 11 rows have no value in a channel: left out",)


def test_numbers_above_the_names_are_told(tmp_path: Path) -> None:
    recording = read(write(tmp_path, "2024,1,2\ntime,hard,soft\n0,1,2\n1,3,4\n"), columns=MAP, unit="pF")
    assert recording.hard.tolist() == [1, 3]
    assert recording.notes == ("1 rows of numbers are above the column names: treated as part of the header",)


def test_a_missing_unit_is_told(tmp_path: Path) -> None:
    path = write(tmp_path, "t,hard,soft\n0,1,2\n")
    assert read(path, columns=MAP).notes == ("no unit in the header: pF assumed",)
    assert read(path, columns=MAP, unit="fF").notes == ()


def test_names_need_a_header_as_wide_as_the_rows(tmp_path: Path) -> None:
    path = write(tmp_path, "time,soft,hard\n1,0,1,2\n2,0,1,2\n")
    with pytest.raises(ValueError, match="the header has 3 cells, but the rows have 4"):
        read(path, columns=MAP)
    assert read(path, columns={"hard": 4, "soft": 3}).hard.tolist() == [2, 2]


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("", None, "is empty"),
        ("1\n2\n3\n", 1, "one column, two are needed"),
        ("\n\n", 1, "nothing but blank lines"),
        ("hello\nworld\n", 1, "no row of numbers"),
        (b"\x7fELF\n\0\0", 2, "a zero byte, so this is not a text file"),
        (b"\xff\xfe\x00", 1, "not text"),
        ("time,hard,soft\n0,1,2\n1,x,2\n2,1,2\n", 3, "'x' in column 2 (hard) is neither a number"),
        ("time,hard,soft\n0,1,2\n1,1_0,2\n2,1,2\n", 3, "'1_0' in column 2 (hard)"),
        ("time,hard,soft\n0,1,2\n1,1\n2,1,2\n", 3, "got 2 cells, but column 3 is needed"),
        ('hard;soft\n"12,000.50";"1,0,1"\n', 1, "'hard;soft' is not a number"),
        ("time,hard,soft\n0,1,2\n1,1,2\n2,1,2\n\n\ntime,hard,soft\n0,1,2\n", 7, "'hard' in column 2 (hard)"),
        ("time,hard,soft\n0,1,2\n1,1\n", 3, "got 2 cells, but column 3 is needed"),
    ],
)
def test_what_is_not_a_recording_is_told_with_its_line(
    tmp_path: Path, text: str | bytes, line: int, reason: str
) -> None:
    with pytest.raises(RecordingError) as caught:
        read(write(tmp_path, text), columns=MAP)
    assert caught.value.line == line
    assert reason in str(caught.value)
    assert "table.csv" in str(caught.value)


@pytest.mark.parametrize("end", ["2,5", "2,5,6", "2,5,6.123"])
def test_a_last_row_without_a_line_end_is_left_out_and_told(tmp_path: Path, end: str) -> None:
    recording = read(write(tmp_path, f"time,hard,soft\n0,1,2\n1,3,4\n{end}"), columns=MAP, unit="pF")
    assert recording.hard.tolist() == [1, 3]
    assert recording.notes == ("the last row is incomplete (no line end): left out",)


@pytest.mark.parametrize(
    ("fields", "error", "message"),
    [
        ({"hard": [[1.0, 2.0]]}, ValueError, r"hard: got shape \(1, 2\), allowed: \(2,\)"),
        ({"soft": [1.0]}, ValueError, r"soft: got shape \(1,\), allowed: \(2,\)"),
        ({"t_hard_s": np.array(["a", "b"])}, TypeError, "t_hard_s: got dtype <U1, allowed: real numbers"),
        ({"soft": [1j, 2j]}, TypeError, "soft: got dtype complex128"),
    ],
)
def test_a_recording_checks_its_arrays(fields: dict[str, Any], error: type[Exception], message: str) -> None:
    good: dict[str, Any] = {"t_hard_s": [0, 1], "t_soft_s": [0, 1], "hard": [1, 2], "soft": [3, 4]}
    masked = Recording(**{**good, "hard": np.ma.masked_array([1.0, 99.0], mask=[False, True])})
    assert np.array_equal(masked.hard, [1, np.nan], equal_nan=True)
    with pytest.raises(error, match=message):
        Recording(**{**good, **fields})


def test_own_files_need_no_map(tmp_path: Path) -> None:
    text = "seq,t_hard_s,t_soft_s,hard_raw,soft_raw,hard_pF,soft_pF,status\n0,0.5,0.6,11460608,-1,1.5004,2.5,0\n"
    recording = read(write(tmp_path, text))
    assert (recording.t_hard_s[0], recording.hard[0], recording.soft[0]) == (0.5, 1.5, 2.5)


@pytest.mark.parametrize(
    ("columns", "unit", "message"),
    [
        (None, None, r"columns: got none .* allowed: hard and soft, two of 1 \(time\)"),
        ({"hard": 1}, None, "columns: got hard, allowed: hard, soft"),
        ({"hard": "hard", "soft": "hard"}, None, "columns: got 'hard' for both channels"),
        ({**MAP, "colour": 1}, None, "columns: got 'colour'"),
        (MAP, "pf", "unit: got 'pf', allowed: aF, fF, pF"),
    ],
)
def test_bad_arguments(tmp_path: Path, columns: dict[str, str | int] | None, unit: str | None, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read(write(tmp_path, "time,hard,soft\n0,1,2\n"), columns=columns, unit=unit)


@given(st.binary(max_size=300))
def test_any_bytes_are_a_table_or_a_recording_error(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = write(tmp_path_factory.getbasetemp(), data)
    try:
        table = read_table(path)
    except RecordingError:
        return
    assert table.rows
    table.describe()


@given(st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 3), min_size=2, max_size=20), st.sampled_from(",;\t| "))
def test_what_is_written_is_read(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[float, float, float]], delimiter: str
) -> None:
    lines = [delimiter.join(["time", "hard", "soft"]), *(delimiter.join(map(repr, row)) for row in rows)]
    recording = read(write(tmp_path_factory.getbasetemp(), "\n".join(lines) + "\n"), columns=MAP)
    assert list(zip(recording.t_hard_s, recording.hard, recording.soft, strict=True)) == rows


def test_numbers() -> None:
    assert to_number("-1,5e3") == -1500
    assert math.isnan(to_number("+OL"))
    for wrong in ("1,234,567", "0x10", "1 2", "pF"):
        with pytest.raises(ValueError, match=wrong):
            to_number(wrong)
