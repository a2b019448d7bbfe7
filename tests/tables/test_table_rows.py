"""Which rows of a table are readings: repeated rows, and channels that alternate in rows."""

from pathlib import Path

import numpy as np
import pytest
from palpate import read

T = np.arange(200) / 50
HARD, SOFT = 6 + np.arange(200) % 7 / 10, 4 + np.arange(200) % 5 / 10
ROWS = [f"{t:.3f},{hard:.4f},{soft:.4f}" for t, hard, soft in zip(T, HARD, SOFT, strict=True)]


def table(folder: Path, rows: list[str], header: str = "t_s,C1 (pF),C2 (pF)", name: str = "table.csv") -> Path:
    path = folder / name
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


@pytest.mark.parametrize("every", [1, 7])
def test_repeated_rows_are_left_out(tmp_path: Path, every: int) -> None:
    rows = [row for n, row in enumerate(ROWS) for _ in range(1 if n % every else 2)]
    recording = read(table(tmp_path, rows))
    assert recording.t_hard_s.tolist() == T.tolist()
    assert recording.hard.tolist() == HARD.round(4).tolist()
    assert "; 50 pairs a second; 200 rows" in recording.understood
    assert recording.notes == (f"{len(rows) - 200} rows repeat the row before: left out",)


def test_repeated_rows_of_a_data_frame_are_left_out() -> None:
    columns = {"t_s": T, "C1_pF": HARD, "C2_pF": SOFT, "x": np.full(200, np.nan)}
    recording = read({name: np.repeat(values, 2) for name, values in columns.items()})
    assert (recording.hard.tolist(), len(recording.notes)) == (HARD.tolist(), 1)


def test_equal_times_with_other_values_are_told(tmp_path: Path) -> None:
    rows = [row for n, row in enumerate(ROWS) for row in ([row, f"{T[n]:.3f},9,8"] if n % 7 == 0 else [row])]
    recording = read(table(tmp_path, rows))
    assert len(recording.hard) == 229
    assert recording.notes[0].startswith("29 of 229 rows have the time of the row before, and other values")


def test_equal_rows_with_other_times_or_a_counter_stay(tmp_path: Path) -> None:
    assert read(table(tmp_path, [f"{t:.3f},6,4" for t in T])).notes == ()
    rows = [f"{row},{n}" for n, row in enumerate(row for row in ROWS for _ in range(2))]
    assert len(read(table(tmp_path, rows, "t_s,C1 (pF),C2 (pF),n"), rate=100).hard) == 400


def test_rows_of_coarse_stamps_stay(tmp_path: Path) -> None:
    rows = [f"{int(t)},{6 + n // 9},4" for n, t in enumerate(T)]
    with pytest.raises(ValueError, match="50 rows share one"):
        read(table(tmp_path, rows))
    assert len(read(table(tmp_path, rows), rate=50).hard) == 200


def test_channels_that_alternate_in_rows_are_joined(tmp_path: Path) -> None:
    rows = [
        row
        for t, hard, soft in zip(T, HARD, SOFT, strict=True)
        for row in (f"{t:.3f},{hard:.4f},", f"{t + 0.008:.3f},,{soft:.4f}")
    ]
    recording = read(table(tmp_path, rows))
    assert (recording.hard.tolist(), recording.soft.tolist()) == (HARD.round(4).tolist(), SOFT.round(4).tolist())
    assert recording.t_soft_s - recording.t_hard_s == pytest.approx(np.full(200, 0.008))
    assert recording.notes == ("the channels alternate in rows: each has its own times",)


def test_one_clock_is_assumed_for_two_files_that_count_from_a_start(tmp_path: Path) -> None:
    hard, soft = (table(tmp_path, [row[: row.rindex(",")] for row in ROWS], "t_s,C (pF)", name) for name in ("h", "s"))
    assert read(hard, soft=soft).notes == ("the times of both files are taken as those of one clock",)
    dated = [f"2026-03-09T12:00:{row[: row.rindex(',')].zfill(13)}" for row in ROWS]
    hard, soft = (table(tmp_path, dated, "time,C (pF)", name) for name in ("h", "s"))
    assert read(hard, soft=soft).notes == ()
