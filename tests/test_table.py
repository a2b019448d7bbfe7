"""Tables as other people's loggers write them."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate import RecordingError, read
from palpate.table import read_table, to_number

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
        "time\thard\tsoft\n0\t1,5\t2\n1\t2,5\t3",
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
    recording = read(write(tmp_path, text), columns=MAP)
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
        ("C (pF)", r"'C \(pF\)', which is at positions 2, 4; give one of these"),
        ("Ch3", r"'Ch3', allowed: 1 \(Time \(s\)\), 2 \(Ch1 C \(pF\)\)"),
        (0, "position 0, allowed: 1 to 5"),
        (6, "position 6, allowed: 1 to 5"),
        (3, "in per cent"),
    ]
    for wrong, message in bad:
        with pytest.raises(ValueError, match=message):
            read(path, columns={"hard": wrong, "soft": 4})


def test_cells_without_a_value_are_kept_as_nan_and_told(tmp_path: Path) -> None:
    rows = "".join(f"{i},{cell},2\n" for i, cell in enumerate(["1", "OL", "", "nan", "-", "#N/A", "inf", "ol", "2"]))
    recording = read(write(tmp_path, "time,hard,soft\n" + rows), columns=MAP)
    assert np.isfinite(recording.hard).tolist() == [True, *[False] * 7, True]
    assert recording.notes == ("7 of 9 rows have no value in a channel: left out",)


def test_times(tmp_path: Path) -> None:
    clock = "timestamp,hard,soft\n2026-11-21 12:00:00.5,1,2\n2026-11-21T12:00:02,1,2\n"
    assert read(write(tmp_path, clock), columns=MAP).t_hard_s.tolist() == [0, 1.5]
    none = read(write(tmp_path, "hard,soft\n1,2\n1,2\n"), columns=MAP)
    assert np.isnan(none.t_hard_s).all()
    back = read(write(tmp_path, "time,hard,soft\n0,1,2\n2,1,2\n1,1,2\n1,1,2\n"), columns=MAP)
    assert back.notes == ("time goes back at 1 of 4 rows: they are taken in the order of the file",)
    named = read(write(tmp_path, "when,hard,soft\n3,1,2\n"), columns={**MAP, "time": "when"})
    assert named.t_hard_s.tolist() == [3]


@pytest.mark.parametrize(
    ("text", "line", "reason"),
    [
        ("", 1, "no row of numbers"),
        ("hello\nworld\n", 2, "no row of numbers"),
        (b"\x7fELF\n\0\0", 2, "a zero byte: not text"),
        (b"\xff\xfe\x00", 1, "not text"),
        ("time,hard,soft\n0,1,2\n1,x,2\n2,1,2\n", 3, "'x' in column 2 (hard) is neither a number"),
        ("time,hard,soft\n0,1,2\n1,1_0,2\n2,1,2\n", 3, "'1_0' in column 2 (hard)"),
        ("time,hard,soft\n0,1,2\n1,1\n2,1,2\n", 3, "2 cells, column 3 is needed"),
        ("time,hard,soft\n0,1,2\nlater,1,2\n", 3, "'later' in column 1 is neither a number nor a date"),
        ("time,hard,soft\n0,1,2\n\n\ntime,hard,soft\n0,1,2\n", 5, "'hard' in column 2 (hard)"),
        ("time,hard,soft\n0,1,2\n1,1\n", 3, "2 cells, column 3 is needed"),
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


def test_a_torn_last_row_is_left_out_and_told(tmp_path: Path) -> None:
    recording = read(write(tmp_path, "time,hard,soft\n0,1,2\n1,3,4\n2,5"), columns=MAP)
    assert recording.hard.tolist() == [1, 3]
    assert recording.notes == ("the last row is torn: left out",)


def test_own_files_need_no_map(tmp_path: Path) -> None:
    text = "seq,t_hard_s,t_soft_s,hard_raw,soft_raw,hard_pF,soft_pF,status\n0,0.5,0.6,9,9,1.5,2.5,0\n"
    recording = read(write(tmp_path, text))
    assert (recording.t_hard_s[0], recording.hard[0], recording.soft[0]) == (0.5, 1.5, 2.5)


@pytest.mark.parametrize(
    ("columns", "unit", "message"),
    [
        (None, None, r"columns: got none .* allowed: hard and soft out of 1 \(time\)"),
        ({"hard": 1}, None, "columns: got hard, allowed: hard, soft"),
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
