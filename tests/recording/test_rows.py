"""The text of a recording: the same bits back, and no line that is half a row."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from palpate import Sample
from palpate.ad7746 import datasheet
from palpate.recording.rows import COLUMNS, EARLIER, RowError, columns_of, format_rows, is_whole, parse_rows, unreadable
from palpate.samples import block_of, samples_of
from tally import Tally

TIMES = st.one_of(st.integers(-(10**12), 10**13), st.integers(-(2**63) + 1, 2**63 - 1))
VALUES = st.one_of(st.floats(allow_nan=False, allow_infinity=False), st.just(math.nan))
PIECES = [
    b" ",
    b"+",
    b"-",
    b"1e5",
    b".",
    b",",
    b"_",
    b"inf",
    b"NAN",
    b"\t",
    b"\x0b",
    b"\x1c",
    b"\0",
    b"\r",
    b"99999999999",
]
CODES = st.integers(0, datasheet.LAST_CODE)


@st.composite
def samples(draw: st.DrawFn) -> Sample:
    hard_raw, soft_raw = draw(st.one_of(st.just(-1), CODES)), draw(st.one_of(st.just(-1), CODES))
    hard, soft = (draw(VALUES) if raw < 0 else datasheet.capacitance_pF(raw) for raw in (hard_raw, soft_raw))
    seq = draw(st.integers(0, 2**63 - 1))
    return Sample(
        seq,
        draw(TIMES),
        draw(TIMES),
        hard_raw,
        soft_raw,
        hard,
        soft,
        draw(st.integers(0, 8)),
        draw(st.integers(-1, 2**31 - 1)),
    )


@given(given_samples=st.lists(samples(), max_size=8))
def test_every_bit_comes_back(given_samples: list[Sample], tally: Tally) -> None:
    tally.count("rows of a recording")
    block = block_of(given_samples)
    data = format_rows(block)
    assert all(is_whole(line) for line in data.splitlines())
    for before, after in zip(given_samples, samples_of(parse_rows(data)), strict=True):
        assert after[:5] == before[:5]
        assert [after.hard.hex(), after.soft.hex()] == [before.hard.hex(), before.soft.hex()]
        assert after[7:] == before[7:]


@given(samples())
def test_a_row_that_lost_any_part_of_its_end_shows_it(sample: Sample) -> None:
    line = format_rows(block_of([sample])).rstrip(b"\n")
    assert is_whole(line)
    assert not any(is_whole(line[:length]) for length in range(len(line)))


@given(samples())
def test_rows_of_an_earlier_version(sample: Sample) -> None:
    """Without the column; cut anywhere, a row of this version is none of that one, and the other way round."""
    line = format_rows(block_of([sample])).rstrip(b"\n")
    cells = line.split(b",")
    earlier = b",".join(cells[:7] + cells[8:])
    assert columns_of([earlier]) == EARLIER
    [after] = samples_of(parse_rows(earlier, EARLIER))
    assert np.array_equal(after[:5], sample[:5])
    assert after[7:] == (sample.status, -1)
    assert not is_whole(earlier)
    assert not is_whole(line, EARLIER)
    assert not any(is_whole(earlier[:length], EARLIER) for length in range(len(earlier)))


def test_a_code_outweighs_the_rounded_value_beside_it() -> None:
    [row] = parse_rows(b"0,0,0,8451872,-1,0.03,0.03,150,0\n")
    assert (row["hard"], row["soft"]) == (0.030890625, 0.03)


def test_empty_cells_of_a_spreadsheet_are_nan() -> None:
    [row] = parse_rows(b"0,0.5,0.6,-1,-1,,,-1,8")
    assert np.isnan([row["hard"], row["soft"]]).all()


@pytest.mark.parametrize(
    ("column", "cell"),
    [
        ("seq", "1.5"),
        ("seq", "9223372036854775808"),
        ("t_hard_s", "nan"),
        ("t_soft_s", "12:00"),
        ("hard_raw", ""),
        ("hard_pF", "OL"),
        ("soft_pF", "1,5"),
        ("t_uncertainty_us", "-2"),
        ("t_uncertainty_us", ""),
        ("status", "9"),
        ("status", "-1"),
        ("status", ""),
    ],
)
def test_what_is_wrong_with_a_row(column: str, cell: str) -> None:
    cells = dict(zip(COLUMNS, ["7", "0.5", "0.6", "8388608", "8388608", "0.0", "0.0", "150", "0"], strict=True))
    good = ",".join(cells.values())
    bad = ",".join({**cells, column: cell}.values())
    with pytest.raises(RowError, match=r"is not a valid value for column|cells, allowed: 9") as caught:
        parse_rows(f"{good}\n{good}\n{bad}\n{good}".encode())
    assert caught.value.number == 2


ROW = b"7,0.500000000,0.600000000,8388608,-1,-0.25,nan,150,0"
MUTATIONS = st.lists(
    st.tuples(st.integers(0, len(ROW)), st.integers(0, 3), st.binary(max_size=2) | st.sampled_from(PIECES)), max_size=4
)


def refusal(data: bytes) -> RowError | None:
    try:
        parse_rows(data)
    except RowError as error:
        return error
    return None


@given(mutations=MUTATIONS)
def test_a_line_is_a_row_for_the_block_parser_and_alone(mutations: list[tuple[int, int, bytes]], tally: Tally) -> None:
    """What one takes the other takes: damage beside a row does not decide whether the row can be read."""
    tally.count("lines that are rows or not")
    line = ROW
    for at, cut, new in mutations:
        line = line[:at] + new + line[at + cut :]
    line = line.replace(b"\n", b"\r")
    error, reason = refusal(ROW + b"\n" + line + b"\n"), unreadable(line.removesuffix(b"\r"))
    assert (error and str(error)) == reason
    assert error is None or error.number == 1
