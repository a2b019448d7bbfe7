"""A clean table is read natively, and as by the reader of all tables: same numbers, notes, and refusals."""

import gzip
import math
from dataclasses import replace
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from effort import draws, random_of
from palpate import RecordingError, read
from palpate._core import CleanRows
from palpate.tables.cell.decimals import is_plain
from palpate.tables.table import Table
from palpate.tables.text import clean
from random_tables import dialect, written  # tests/tools

COUNT = draws(40, 600, at_least=20)
SIGNS = ' \t\n\r,;.|"#%+-eE_0195xµ\x00\x1a:/'
PLACES = ("head", "middle", "end")


def outcome(path: Path, **asked: Any) -> tuple[Any, ...]:
    """Return all that a table is read as, bit by bit, or why it is not."""
    try:
        found = read(path, **asked)
    except (RecordingError, ValueError) as error:
        return type(error).__name__, str(error)
    bits = [getattr(found, name).tobytes() for name in ("t_hard_s", "t_soft_s", "hard", "soft")]
    return (*bits, found.understood, found.notes, found.zero_utc_ns, found.gap_rows)


def both(path: Path, monkeypatch: pytest.MonkeyPatch, **asked: Any) -> tuple[tuple[Any, ...], tuple[Any, ...], bool]:
    """Return what both readers make of a file, and whether the native one read it."""
    native: list[Table | None] = []
    original = clean.clean_table

    def recorded(*given: Any) -> Table | None:
        native.append(original(*given))
        return native[-1]

    with monkeypatch.context() as patch:
        patch.setattr("palpate.tables.formats.clean_table", recorded)
        found = outcome(path, **asked)
        patch.setattr("palpate.tables.formats.clean_table", lambda *_: None)
        return found, outcome(path, **asked), any(native)


@pytest.fixture(autouse=True)
def small_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clean, "HEADS", (1 << 10, 1 << 12, 1 << 14))
    monkeypatch.setattr(clean, "SAMPLES", 12)
    monkeypatch.setattr(clean, "MOST_BELOW", 12)
    monkeypatch.setattr(clean, "PART", 3000)


def test_tables_of_random_dialects_are_read_alike(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read_natively = 0
    for seed in range(COUNT):
        path = tmp_path / "table.dat"
        way = replace(dialect(Random(seed)), extra=()) if seed % 2 else dialect(Random(seed))
        path.write_bytes(written(way))
        first = 2 if way.times != "none" else 1
        asked: dict[str, Any] = {"columns": {"hard": first, "soft": first + 1}} if way.asked else {}
        natively, slowly, was_native = both(path, monkeypatch, **asked)
        assert natively == slowly, way
        read_natively += was_native
    assert read_natively > COUNT / 5


@pytest.fixture(scope="module")
def tables() -> list[bytes]:
    t = np.arange(900) / 38.4
    hard, soft = 6 + 0.1 * np.sin(t), 4 + 0.2 * np.sin(t)
    columns = {
        b"time,C1,C2\n": [f"{a:.4f},{b:.5f},{c:.5f}\n" for a, b, c in zip(t, hard, soft, strict=True)],
        b"Zeit;C1 (pF);C2 (pF)\r\n": [
            f"{a:.3f};{b:.3f};{c:.3f}\r\n".replace(".", ",") for a, b, c in zip(t, hard, soft, strict=True)
        ],
        b"# by a logger\nC1 C2 status\n": [f"{b:7.3f}  {c:.3e} 0\n" for b, c in zip(hard, soft, strict=True)],
        b"date,hard,soft\n": [
            f"2026-11-21T12:00:{s:06.3f}Z,{b:.4f},{c:.4f}\n" for s, b, c in zip(t, hard, soft, strict=True) if s < 60
        ],
    }
    return [head + "".join(rows).encode() for head, rows in columns.items()]


@pytest.mark.parametrize("place", PLACES)
def test_one_sign_inserted_anywhere_is_read_alike(
    place: str, tables: list[bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    random = random_of(f"clean tables {place}")
    read_natively = 0
    for number in range(COUNT):
        data = tables[number % len(tables)]
        spans = {"head": (0, 300), "middle": (300, len(data) - 100), "end": (len(data) - 100, len(data))}
        at, sign = random.randint(*spans[place]), random.choice(SIGNS).encode("utf-8")
        path = tmp_path / "table.csv"
        mutated = data[:at] + sign + data[at + random.randint(0, 1) :]
        path.write_bytes(gzip.compress(mutated) if number % 7 == 0 else mutated)
        natively, slowly, was_native = both(path, monkeypatch)
        assert natively == slowly, (number, at, sign)
        read_natively += was_native
    assert read_natively > COUNT / 20


TAILS = {
    "Mean,6.0,4.0\n": "no sample",
    "# end\n": "comment",
    "\n\n": "",
    "24.1,6.1": "incomplete",
    "time,C1,C2\n24.1,6.0,4.0\n": "column names",
    "24.1,OL,4.0\n": "no value",
}


@pytest.mark.parametrize("tail", TAILS)
def test_the_last_lines_are_those_of_any_table(
    tail: str, tables: list[bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(tables[0] + tail.encode())
    natively, slowly, was_native = both(path, monkeypatch)
    assert natively == slowly
    assert TAILS[tail] in str(natively[5])
    assert was_native == ("OL" not in tail)


@pytest.mark.parametrize("decimal", [None, "point", "comma"])
@pytest.mark.parametrize("packed", [False, True])
def test_a_decimal_mark_that_is_open_is_asked_for(
    decimal: str | None, packed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = "".join(f"{row};{6 + row / 1000:.3f};{4 + row / 1000:.3f}\n".replace(".", ",") for row in range(1, 700))
    path = tmp_path / "table.csv"
    data = f"n;C1;C2\n{rows}".encode()
    path.write_bytes(gzip.compress(data) if packed else data)
    natively, slowly, was_native = both(path, monkeypatch, decimal=decimal)
    assert natively == slowly
    assert was_native
    if decimal is None:
        assert "'6,001' in column 2 (C1), a decimal comma or a thousands separator?" in natively[1]


def test_numbers_are_those_of_float() -> None:
    random = random_of("clean numbers")
    cells = ["".join(random.choice("0123456789.-+eE") for _ in range(random.randint(1, 9))) for _ in range(COUNT * 50)]
    cells += [
        f"{random.gauss(0, 1) * 10 ** random.randint(-300, 300):.{random.randint(0, 17)}e}" for _ in range(COUNT * 20)
    ]
    for mark in ".,":
        for cell in cells:
            rows = CleanRows(["", ""], delimiter=";", decimal="." if mark == "." else ",")
            used, (_, numbers) = rows.read(f"0.5;{cell}\n".replace(".", mark).encode())
            if used:
                assert numbers[0] == float(cell)
            else:
                assert not is_plain(cell) or abs(float(cell)) in (0.0, math.inf)  # beyond the range of a double


@pytest.mark.parametrize(
    ("shapes", "delimiter", "decimal", "message"),
    [([], ",", ".", "shapes: got none"), ([""], "x", ".", "delimiter: got 'x'"), ([""], ",", "", "decimal: got ''")],
)
def test_what_no_table_can_be_is_refused(shapes: list[str], delimiter: str, decimal: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        CleanRows(shapes, delimiter=delimiter, decimal=decimal)


def test_texts_are_those_of_the_file(tables: list[bytes], tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(tables[0] + b"99,5.50,5.5\n# end\n")
    with path.open("rb") as file:
        table = clean.clean_table(path, file)
    assert table is not None
    lines = (tables[0] + b"99,5.50,5.5\n").decode().splitlines()[1:]
    assert [list(row) for row in zip(*(column.cells for column in table.columns), strict=True)] == [
        line.split(",") for line in lines
    ]
    some = table.take(np.array([5, 700, len(lines) - 1]))
    assert list(some.columns[1].cells[:]) == [lines[row].split(",")[1] for row in (5, 700, -1)]
    assert list(some.lines) == [7, 702, len(lines) + 1]


def test_a_value_written_in_two_ways_is_not_clean(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [f"{row / 40:.3f},{6 + row / 1000:.3f},{4 + row / 1000:.3f}\n" for row in range(700)]
    rows.insert(400, rows[400].replace("6.400", "6.40"))
    path = tmp_path / "table.csv"
    path.write_text("time,C1,C2\n" + "".join(rows))
    natively, slowly, was_native = both(path, monkeypatch)
    assert natively == slowly
    assert not was_native


def test_a_file_that_changes_while_it_is_read_is_refused(tables: list[bytes], tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(tables[0])
    with path.open("rb") as file:
        table = clean.clean_table(path, file)
    assert table is not None
    path.write_bytes(tables[0][:5000])
    with pytest.raises(RecordingError, match="has changed while it was read"):
        table.columns[0].cells[-1]


def test_many_lines_above_the_table_are_not_looked_through(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(b"a\n" * 3000 + b"1.5,2.5\n" * 1300)
    natively, slowly, was_native = both(path, monkeypatch)
    assert natively == slowly
    assert "not a recording: no row of numbers" in natively[1]
    assert not was_native
