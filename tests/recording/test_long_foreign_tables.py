"""A long table of another program is read in parts, and as a whole: same rows, notes, and refusals; in bounded memory."""

import gzip
import io
import sys
import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from effort import draws, random_of
from numpy.typing import NDArray
from palpate import RecordingError
from palpate.recording.foreign import Foreign
from palpate.tables import formats
from palpate.tables.text import clean
from random_tables import dialect, written  # tests/tools

COUNT = draws(40, 600)
SIGNS = ' \t\n\r,;.|"#%+-eE_0195xµ\x00\x1a:/'
ROWS = 1500
Floats = NDArray[np.float64]


@pytest.fixture(autouse=True)
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clean, "HEADS", (1 << 10, 1 << 12, 1 << 14))
    monkeypatch.setattr(clean, "SAMPLES", 12)
    monkeypatch.setattr(clean, "MOST_BELOW", 12)
    monkeypatch.setattr(clean, "PART", 3000)
    monkeypatch.setattr(clean, "FIRST", 400)
    monkeypatch.setattr(formats, "LONG", 1)


def outcome(path: Path, *, whole: bool, **asked: Any) -> tuple[tuple[Any, ...], bool]:
    """Return all that is known of a table and its rows, bit by bit, or why it is not read; and whether in parts."""
    try:
        found = Foreign(path, whole=whole, **asked)
    except (RecordingError, ValueError) as error:
        return (type(error).__name__, str(error)), False
    rows = np.concatenate([*found.blocks()])
    said = found.understood, found.notes, found.unused, found.timed, found.full_scale_pF, found.describe(), found.survey
    return (rows.tobytes(), *said), found.in_parts


def require_alike(path: Path, **asked: Any) -> bool:
    """Compare both ways; return whether the table was read in parts."""
    parts, in_parts = outcome(path, whole=False, **asked)
    whole, _ = outcome(path, whole=True, **asked)
    assert parts == whole
    return in_parts


def test_tables_of_random_dialects_are_read_alike(tmp_path: Path) -> None:
    in_parts = 0
    for seed in range(COUNT):
        path = tmp_path / "table.dat"
        way = replace(dialect(Random(seed)), extra=(), times=Random(seed).choice(["s", "ms", "us", "epoch us", "none"]))
        path.write_bytes(written(way))
        first = 2 if way.times != "none" else 1
        in_parts += require_alike(path, **({"columns": {"hard": first, "soft": first + 1}} if way.asked else {}))
    assert in_parts > COUNT / 20 or COUNT < 20


def table(t: Floats, hard: Floats, soft: Floats, head: str = "time (s),C1 (pF),C2 (pF)\n", form: str = "%.6f") -> bytes:
    """Return a text table."""
    return (head + "".join(f"{form},{form},{form}\n" % row for row in zip(t, hard, soft, strict=True))).encode()


def presses(rows: int = ROWS) -> tuple[Floats, Floats, Floats]:
    """Return times, and two channels with noise, and a press every 4 s."""
    random = np.random.default_rng(1)
    t = np.arange(rows) / 38.4
    press = np.clip(np.sin(2 * np.pi * t / 4), 0, None)
    return t, 6 + 0.5 * press + random.normal(0, 2e-4, rows), 4 + 0.9 * press + random.normal(0, 2e-4, rows)


@pytest.mark.parametrize("place", ["head", "middle", "end"])
@pytest.mark.parametrize("decimals", [3, 6])
def test_one_sign_inserted_anywhere_is_read_alike(place: str, decimals: int, tmp_path: Path) -> None:
    random = random_of(f"long tables {place} {decimals}")
    data = table(*presses(), form=f"%.{decimals}f")
    spans = {"head": (0, 300), "middle": (300, len(data) - 100), "end": (len(data) - 100, len(data))}
    path = tmp_path / "table.csv"
    in_parts = 0
    for number in range(COUNT):
        at, sign = random.randint(*spans[place]), random.choice(SIGNS).encode("utf-8")
        mutated = data[:at] + sign + data[at + random.randint(0, 1) :]
        path.write_bytes(gzip.compress(mutated) if number % 7 == 0 else mutated)
        in_parts += require_alike(path)
    assert in_parts or COUNT < 20


def _at(rows: slice, value: float, channel: int = 1) -> Callable[[list[Floats]], None]:
    def change(columns: list[Floats]) -> None:
        columns[channel][rows] = value

    return change


def _later(row: int, seconds: float) -> Callable[[list[Floats]], None]:
    def change(columns: list[Floats]) -> None:
        columns[0][row:] += seconds

    return change


def _scaled(channel: int, factor: float) -> Callable[[list[Floats]], None]:
    def change(columns: list[Floats]) -> None:
        columns[channel] *= factor

    return change


def _below(most: float) -> Callable[[list[Floats]], None]:
    def change(columns: list[Floats]) -> None:
        columns[1] = np.minimum(columns[1], most)

    return change


def _nothing(columns: list[Floats]) -> None:
    del columns


LATE = slice(1080, 1120)  # in a press
ODD: dict[str, tuple[Callable[[list[Floats]], None], str]] = {
    "frozen": (_at(LATE, 6.123), "is the channel frozen there?"),
    "clipped": (_below(6.49), "is the channel clipped there?"),
    "no value": (_at(slice(900, 1000, 9), 0.0), "taken as no value"),
    "minus": (_at(slice(900, 1000, 9), -999.0), "taken as no value"),
    "overload": (_at(slice(1000, 1001), 9.9e37), "have no value in a channel"),
    "back": (_later(1000, -0.04), "time goes back"),
    "restarted": (_later(1000, -20.0), "was the logger restarted?"),
    "same stamps": (_later(1000, -1 / 38.4), "have the time of the row before"),
    "sizes": (_scaled(1, 1e3), "channels of similar size"),
}
EVEN: dict[str, Callable[[list[Floats]], None]] = {
    "nothing": _nothing,
    "a pause": _later(1000, 7.0),
    "late": _later(0, 1000.0),
    "one spike": _at(slice(1200, 1201), 9.0),
    "slow": _scaled(0, 3.0),
}


def changed(change: Callable[[list[Floats]], None], tmp_path: Path, **how: Any) -> Path:
    """Return a table after a change."""
    columns = [*presses()]
    change(columns)
    t, hard, soft = columns
    path = tmp_path / "table.csv"
    path.write_bytes(table(t, hard, soft, **how))
    return path


def test_what_is_odd_in_the_first_rows_only_is_not_said(tmp_path: Path) -> None:
    path = changed(_nothing, tmp_path, form="%.3f")
    assert require_alike(path)
    path = tmp_path / "few.csv"
    path.write_bytes(table(*presses(400), form="%.3f"))
    assert "clipped" in str(Foreign(path, whole=True).notes)


@pytest.mark.parametrize("odd", ODD)
def test_what_is_odd_after_the_first_rows_is_said_as_of_a_whole_table(odd: str, tmp_path: Path) -> None:
    change, said = ODD[odd]
    path = changed(change, tmp_path)
    assert not require_alike(path)
    assert said in str(outcome(path, whole=False)[0][1:])


@pytest.mark.parametrize("even", EVEN)
@pytest.mark.parametrize("form", ["%.4f", "%.9f"])
@pytest.mark.parametrize("head", ["time (s),C1 (pF),C2 (pF)\n", "time,C1,C2\n", "x,C1 (fF),C2 (fF)\n", ""])
def test_what_is_not_odd_is_read_in_parts(even: str, head: str, form: str, tmp_path: Path) -> None:
    path = changed(EVEN[even], tmp_path, head=head, form=form)
    columns = {} if head else {"columns": {"hard": 2, "soft": 3, "time": 1}}
    assert require_alike(path, **columns)


@pytest.mark.parametrize("asked", [{"unit": "fF"}, {"time_unit": "s"}, {"decimal": "point"}])
def test_what_is_asked_for_is_read_alike(asked: dict[str, Any], tmp_path: Path) -> None:
    assert require_alike(changed(_nothing, tmp_path), **asked)


def test_a_rate_is_asked_for_where_there_are_no_times(tmp_path: Path) -> None:
    path = changed(_nothing, tmp_path, head="x,C1,C2\n")
    assert require_alike(path)
    assert require_alike(path, rate=100.0)
    assert not require_alike(changed(_nothing, tmp_path), rate=38.4)  # beside times


@pytest.mark.parametrize("suffix", [".parquet", ".arrow"])
def test_arrow_columns_are_read_alike(suffix: str, tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    t, hard, soft = presses(200_000)
    path = tmp_path / f"table{suffix}"
    for last, is_sure in ((4.0, True), (None, False), (np.inf, False), (-4.0, False)):
        names = {"time": t, "C1": hard, "C2": [*soft[:-1].tolist(), last], "status": np.zeros(len(t), np.int8)}
        _save(arrow.table(names), path)
        assert require_alike(path) == is_sure


def _save(columns: Any, path: Path) -> None:
    if path.suffix == ".parquet":
        pytest.importorskip("pyarrow.parquet").write_table(columns, path)
    else:
        pytest.importorskip("pyarrow.feather").write_feather(columns, path)


@pytest.mark.parametrize("first", [0, 1, 2, 10])
def test_the_first_batch_of_an_arrow_file_may_be_short(first: int, tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    path = tmp_path / "table.arrow"
    columns = arrow.table(dict(zip(("time", "C1", "C2"), presses(), strict=True)))
    with arrow.OSFile(str(path), "wb") as file, arrow.ipc.new_file(file, columns.schema) as writer:
        writer.write_table(columns.slice(0, first))
        writer.write_batch(columns.slice(first).combine_chunks().to_batches()[0])
    assert require_alike(path) == (first != 1)


def test_the_recording_of_a_table_in_parts_is_the_whole(tmp_path: Path) -> None:
    path = changed(_nothing, tmp_path)
    found = Foreign(path)
    assert found.in_parts
    assert len(found.recording.hard) == ROWS
    assert found.recording.understood == found.understood


@pytest.mark.parametrize("packed", [False, True])
def test_standard_input_is_read_in_parts(packed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data = changed(_nothing, tmp_path).read_bytes()
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(gzip.compress(data) if packed else data)))
    assert require_alike(Path("-"))


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path: Path) -> None:
    path = changed(_nothing, tmp_path)
    found = Foreign(path)
    path.write_bytes(path.read_bytes()[:20_000])
    with pytest.raises(RecordingError, match="has changed while it was read"):
        list(found.blocks())


def test_a_file_that_is_replaced_while_it_is_read_is_refused(tmp_path: Path) -> None:
    path = changed(_nothing, tmp_path)
    found = Foreign(path)
    size = path.stat().st_size
    changed(_at(LATE, 6.123), tmp_path)
    assert path.stat().st_size == size
    with pytest.raises(RecordingError, match="has changed while it was read"):
        list(found.blocks())


def test_a_file_that_grows_while_it_is_read_is_read_as_far_as_it_was(tmp_path: Path) -> None:
    path = changed(_nothing, tmp_path)
    found = Foreign(path)
    with path.open("ab") as file:
        file.write(table(*presses(900), head=""))
    assert sum(len(block) for block in found.blocks()) == ROWS


@pytest.mark.parametrize("rows", [100_000, 150_000, 200_000])
def test_an_arrow_file_that_is_replaced_while_it_is_read_is_refused(rows: int, tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow")
    path = tmp_path / "table.parquet"
    columns = arrow.table(dict(zip(("time", "C1", "C2"), presses(150_000), strict=True)))
    _save(columns, path)
    found = Foreign(path)
    assert found.in_parts
    _save(arrow.concat_tables([columns, columns]).slice(rows - 100_000, rows), path)
    with pytest.raises(RecordingError, match="has changed while it was read"):
        list(found.blocks())


@pytest.fixture
def large_parts(small_parts: None, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(clean, "HEADS", (1 << 13, 1 << 15, 1 << 18))
    monkeypatch.setattr(clean, "PART", 1 << 16)
    yield
    tracemalloc.stop()


@pytest.mark.usefixtures("large_parts")
def test_memory_does_not_grow_with_the_rows(tmp_path: Path) -> None:
    peaks = []
    for rows in (10_000, 40_000):
        path = tmp_path / f"{rows}.csv"
        path.write_bytes(table(*presses(rows)))
        tracemalloc.start()
        found = Foreign(path)
        assert sum(len(block) for block in found.blocks()) == rows
        assert found.in_parts
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 8 * 30_000  # one column of the others
