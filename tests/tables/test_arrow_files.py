"""Parquet and Arrow files of other programs: only what is used is read, sizes are limited, damage is said."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import polars as pl
import pyarrow as pa
import pytest
from click.testing import CliRunner
from effort import draws, random_of
from palpate.cli import main
from palpate.errors import RecordingError
from palpate.recording import recorded
from palpate.recording.exchange.export import convert
from palpate.simulation import scenarios
from palpate.tables.readers import arrow
from pyarrow import feather, parquet

PLAY = scenarios.run("stiff-steady")
N = len(PLAY.hard)
DATES = np.datetime64("2026-03-01T10:00:00", "ns") + np.rint(PLAY.t_hard_s * 1e9).astype("m8[ns]")
TABLE = pa.table({
    "when": pa.array(DATES, pa.timestamp("ns", "UTC")), "C1": PLAY.hard, "C2": PLAY.soft, "word": ["a", "bc"] * (N // 2) + ["d"] * (N % 2),
    "parts": [[1.0, 2.0]] * N,
})  # fmt: skip


def write(table: Any, path: Path) -> Path:
    if path.suffix == ".parquet":
        parquet.write_table(table, path, row_group_size=150)
    else:
        feather.write_feather(
            table, path, compression={".arrow": "uncompressed", ".feather": "lz4", ".zst": "zstd"}[path.suffix]
        )
    return path


@pytest.mark.parametrize("suffix", ["parquet", "arrow", "feather", "zst"])
def test_files_of_others(tmp_path: Path, suffix: str) -> None:
    path = write(TABLE, tmp_path / f"other.{suffix}")
    found = palpate.read(path)
    assert np.array_equal(found.hard, PLAY.hard)
    assert np.array_equal(found.t_hard_s, (DATES - DATES[0]) / np.timedelta64(1, "s"))
    assert found.zero_utc_ns == 1_772_359_200_000_000_000 + int(DATES[0].astype(int) % 10**9)
    assert found.understood.startswith("time = when, dates (UTC); hard = C1, pF; soft = C2, pF")
    result = CliRunner().invoke(main, ["replay", str(path), "--unit", "pF", "--json"])
    assert result.exit_code == 0, result.stderr
    swapped = palpate.read(path, columns={"hard": 3, "soft": "C1"}, rate=40.0)
    assert np.array_equal(swapped.hard, PLAY.soft)


def test_a_column_that_is_not_used_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []
    column = arrow.ArrowFile.column

    def noted(self: arrow.ArrowFile, index: int) -> Any:
        read.append(index)
        return column(self, index)

    monkeypatch.setattr(arrow.ArrowFile, "column", noted)
    for suffix in ("parquet", "arrow"):
        palpate.read(write(TABLE, tmp_path / f"other.{suffix}"))
        assert sorted(set(read)) == [0, 1, 2]
        read.clear()


def test_a_table_of_polars(tmp_path: Path) -> None:
    pl.from_arrow(TABLE).write_parquet(tmp_path / "polars.parquet")
    pl.from_arrow(TABLE).write_ipc(tmp_path / "polars.arrow")
    for name in ("polars.parquet", "polars.arrow"):
        assert np.array_equal(palpate.read(tmp_path / name).soft, PLAY.soft)


@pytest.mark.parametrize("suffix", ["parquet", "arrow"])
def test_sizes_are_limited_as_they_are_read(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arrow, "LARGEST", 900_000)
    few = pa.table({"t": np.zeros(120_000), "C1": np.ones(120_000), "C2": np.ones(120_000)})
    path = tmp_path / f"equal.{suffix}"
    write(few, path)
    with pytest.raises(RecordingError, match="got 120,000 rows, allowed: 112,500"):
        palpate.read(path)
    long = pa.table({"t": np.arange(100_000) / 40, "C1": np.ones(100_000), "C2": [f"{n:020}" for n in range(100_000)]})
    write(long, path)
    with pytest.raises(RecordingError, match="column C2: got more than 900,000 bytes, the most allowed"):
        palpate.read(path)


@pytest.mark.parametrize("suffix", ["parquet", "arrow"])
def test_no_rows_and_no_file(tmp_path: Path, suffix: str) -> None:
    path = write(TABLE[:0], tmp_path / f"empty.{suffix}")
    with pytest.raises(RecordingError, match="has no rows"):
        palpate.read(path)
    path.write_bytes(path.read_bytes()[:-30])
    with pytest.raises(RecordingError, match="cannot be read"):
        palpate.read(path)


def test_damaged_files_are_refused_or_read(tmp_path: Path) -> None:
    """An abort of the process would end the test; palpate's own files are never changed without a word."""
    files = [write(TABLE, tmp_path / name) for name in ("o.parquet", "o.arrow", "o.zst")]
    for name in ("own.parquet", "own.arrow"):
        convert(recorded("tests/data/four-specimens.csv"), tmp_path / name)
        files.append(tmp_path / name)
    whole = {path: (path.read_bytes(), palpate.read(path)) for path in files}
    rng, seen = random_of("damaged columns"), Counter[str]()
    path = tmp_path / "damaged"
    for _ in range(draws(400)):
        original = rng.choice(files)
        data = bytearray(whole[original][0])
        for _ in range(rng.choice([1, 1, 2, 8])):
            far = rng.randrange(len(data)) if rng.random() < 0.5 else len(data) - 1 - int(rng.expovariate(1 / 300))
            data[max(far, 0)] = rng.randrange(256)
        path.write_bytes(data[: rng.randrange(len(data))] if rng.random() < 0.2 else data)
        try:
            found = palpate.read(path)
        except (RecordingError, ValueError) as error:
            seen[type(error).__name__] += 1
            continue
        same = all(
            np.array_equal(getattr(found, n), getattr(whole[original][1], n), equal_nan=True) for n in ("hard", "soft")
        )
        assert same or found.doubts or found.notes or original.stem == "o"
        seen["doubts" if found.doubts else "same" if same else "other values"] += 1
    assert {"RecordingError", "doubts", "same", "other values"} <= set(seen), seen
