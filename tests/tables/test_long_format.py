"""Tables in long format: which column names the channels, and the rows of each."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from palpate.tables.long import id_column, id_columns, spread
from palpate.tables.table import Column, Table


def table(**columns: Any) -> Table:
    size = len(next(iter(columns.values())))
    return Table(Path("long.csv"), [Column((name,), cells) for name, cells in columns.items()], range(2, 2 + size))


TURNS = ["C1", "C2"] * 10
TIMES = [f"{row * 0.013:.3f}" for row in range(20)]
VALUES = [f"{6 + row / 100:.2f}" for row in range(20)]


@pytest.mark.parametrize(
    ("columns", "found"),
    [
        ({"time": TIMES, "what": TURNS, "value": VALUES}, 1),
        ({"channel": ["1", "2"] * 10, "time": TIMES, "value": VALUES}, 0),
        ({"time": TIMES, "Sensor": np.array([3, 4] * 10), "value": VALUES}, 1),
        ({"time": TIMES, "variable": ["hard"] * 10 + ["soft"] * 10, "value": VALUES}, 1),  # pandas.melt
        ({"time": TIMES, "what": ["hard"] * 10 + ["soft"] * 10, "value": VALUES}, None),  # may be states
        ({"time": TIMES, "state": ["ok"] * 19 + ["warn"], "C1": VALUES}, None),
        ({"time": TIMES, "which": ["1", "2"] * 10, "value": VALUES}, None),
        ({"time": TIMES, "C1": VALUES, "C2": VALUES}, None),
        ({"id": [str(row) for row in range(20)], "C1": VALUES, "C2": VALUES}, None),  # numbers of rows
        ({"id": ["C1"] * 20, "C1": VALUES, "C2": VALUES}, None),
        ({"channel": ["1", ""] * 10, "C1": VALUES}, None),
        ({"clock": ["12:00:00", "12:00:01"] * 10, "C1": VALUES}, None),
        ({"C1": ["OL", "OVLD"] * 10, "C2": VALUES}, None),
        ({"ch": ["0.5", "1.5"] * 10, "C2": VALUES}, None),
    ],
)
def test_the_column_that_names_the_channels(columns: dict[str, Any], found: int | None) -> None:
    assert id_column(table(**columns)) == found


def test_columns_that_hold_the_names_that_are_asked_for() -> None:
    long = table(time=TIMES, kind=["raw"] * 20, what=TURNS, copy=TURNS, number=np.array([1, 2] * 10))
    assert id_columns(long, ["C1", "C2"]) == [2, 3]
    assert id_columns(long, {"1", "2"}) == [4]
    assert id_columns(long, ["C1", "C3"]) == []


def test_the_rows_of_a_channel_keep_their_lines_and_positions() -> None:
    parts = spread(table(time=TIMES, what=[*TURNS[:-1], None], value=np.arange(20.0)), 1)
    assert list(parts) == ["C1", "C2", ""]
    assert list(parts["C2"].lines) == list(range(3, 21, 2))
    assert parts["C2"].columns[0].cells == TIMES[1:19:2]
    assert np.asarray(parts["C2"].columns[2].cells).tolist() == list(range(1, 19, 2))
    assert [parts["C1"].name(column) for column in range(3)] == ["time", "what", "value"]
    assert list(parts[""].lines) == [21]


@examples(60)
@given(st.lists(st.sampled_from(["a", "b", "c", "1", ""]), min_size=1, max_size=50))
def test_no_row_is_lost_or_moved(names: list[str]) -> None:
    parts = spread(table(name=names, row=np.arange(len(names))), 0)
    assert list(parts) == list(dict.fromkeys(names))
    rows = {name: np.asarray(part.columns[1].cells).tolist() for name, part in parts.items()}
    assert rows == {name: [row for row, other in enumerate(names) if other == name] for name in parts}
    assert all(list(part.lines) == [row + 2 for row in rows[name]] for name, part in parts.items())
