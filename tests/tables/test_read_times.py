"""Times of tables of other programs, from the file to the recording."""

from pathlib import Path

import numpy as np
import pytest
from palpate import RecordingError, read

MAP: dict[str, str | int] = {"hard": "hard", "soft": "soft"}
ASSUMED = "no unit in the header: pF assumed"


def write(folder: Path, header: str, *rows: str) -> Path:
    path = folder / "table.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


@pytest.mark.parametrize(
    ("first", "second", "seconds"),
    [
        ("2026-11-21 12:00:00.5", "2026-11-21T12:00:02", [0, 1.5]),
        ("23:00:00.25", "23:00:01.000", [82800.25, 82801]),
        ("1763726400.5", "1763726402", [0, 1.5]),
        ("1.5", "1.525", [1.5, 1.525]),
        ("21-Nov-2026 12:00:00.5", "21-Nov-2026 12:00:02", [0, 1.5]),
        ("0 days 00:00:01.5", "0 days 00:00:01.525", [1.5, 1.525]),  # durations of pandas
    ],
)
def test_both_channels_have_the_time_of_the_row(tmp_path: Path, first: str, second: str, seconds: list[float]) -> None:
    recording = read(write(tmp_path, "timestamp,hard,soft", f"{first},1,2", f"{second},1,2"), columns=MAP)
    assert recording.t_hard_s.tolist() == recording.t_soft_s.tolist() == seconds
    assert recording.notes == (ASSUMED,)


def test_times_of_the_soft_channel_are_on_the_axis_of_the_hard_channel(tmp_path: Path) -> None:
    rows = [f"{1763726400 + row / 40:.3f},{1763726400.01 + row / 40:.3f},1,2" for row in range(40)]
    recording = read(
        write(tmp_path, "when,then,hard,soft", *rows), columns={**MAP, "time": "when", "soft_time": "then"}
    )
    assert recording.t_hard_s[0] == 0
    assert recording.t_soft_s - recording.t_hard_s == pytest.approx(np.full(40, 0.01), abs=1e-6)
    assert recording.zero_utc_ns == 1763726400 * 10**9


def test_small_steps_back_are_told_and_large_ones_refused(tmp_path: Path) -> None:
    back = read(
        write(tmp_path, "Zeit [ms],hard,soft", "0,1,2", "500,1,2", "750,1,2", "600,1,2", "900,1,2"), columns=MAP
    )
    assert back.t_hard_s.tolist() == [0, 0.5, 0.75, 0.6, 0.9]
    assert "time goes back at 1 of 5 rows: the order of the file is used" in back.notes
    path = write(tmp_path, "Zeit [ms],hard,soft", "0,1,2", "4500,1,2", "5000,1,2", "250,1,2", "500,1,2")
    with pytest.raises(RecordingError, match=r"line 5: the time in column 1 .* goes back by 4\.75 s"):
        read(path, columns=MAP)
    assert read(path, columns=MAP, rate=40).t_hard_s.tolist() == [0, 0.025, 0.05, 0.075, 0.1]


def test_a_table_without_times_has_no_rate(tmp_path: Path) -> None:
    none = read(write(tmp_path, "hard,soft", "1,2", "1,2"), columns=MAP)
    assert np.isnan(none.t_hard_s).all()
    assert "rate unknown" in none.understood
    assert any(note.startswith("no column of times found") for note in none.notes)


@pytest.mark.parametrize("line", ["# Sample rate: 25 Hz", "Abtastrate (Hz),25"])
def test_a_rate_in_the_header_is_proposed(tmp_path: Path, line: str) -> None:
    path = write(tmp_path, line, "C1 (pF),C2 (pF)", *(["1.5,2.5", "2.5,1.5"] * 20))
    recording = read(path)
    assert "rate unknown" in recording.understood
    assert recording.notes[-1] == "the header says 25 samples a second: --rate 25?"
    assert len(read(path, rate=25).notes) == 0


def test_the_unit_of_the_times_may_be_said(tmp_path: Path) -> None:
    path = write(tmp_path, "time,hard,soft", *(f"{row},1,2" for row in range(40)))
    with pytest.raises(ValueError, match="time_unit: got a median step of 1 in column 1"):
        read(path, columns=MAP)
    assert read(path, columns=MAP, time_unit="ms").t_hard_s[1] == 1e-3
    assert "time = time, s;" in read(path, columns=MAP, time_unit="s").understood
