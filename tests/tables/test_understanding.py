"""What the columns of a table mean."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from palpate import read

ROWS = "".join(f"{i / 40:.3f},{6 + i % 3},{4 + i % 2}\n" for i in range(40))


def table(folder: Path, header: str, rows: str = ROWS) -> Path:
    path = folder / "table.csv"
    path.write_text(f"{header}\n{rows}")
    return path


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("t_s,hard,soft", "time = t, s; hard = hard, pF; soft = soft, pF; 40 pairs a second; 40 rows"),
        ("Time (s),C1 (pF),C2 (pF)", "time = Time, s; hard = C1, pF; soft = C2, pF; 40 pairs a second; 40 rows"),
        ("seconds,CIN2,CIN1", "time = seconds, s; hard = CIN1, pF; soft = CIN2, pF; 40 pairs a second; 40 rows"),
        ("t [s],cap_1,cap_2", "time = t, s; hard = cap_1, pF; soft = cap_2, pF; 40 pairs a second; 40 rows"),
    ],
)
def test_names_that_leave_no_doubt(tmp_path: Path, header: str, said: str) -> None:
    recording = read(table(tmp_path, header))
    assert recording.understood == said
    assert recording.t_hard_s[:2].tolist() == [0, 0.025]


@pytest.mark.parametrize("header", ["t_s,A,B", "t_s,Ch1,Ch2", "t_s,C1 (pF),C3 (pF)", "C1,hard_,x", "t_s,value,C2"])
def test_other_names_are_asked_for(tmp_path: Path, header: str) -> None:
    with pytest.raises(ValueError, match=r"columns: got none for a table of another program, allowed: hard and soft"):
        read(table(tmp_path, header))


def test_a_third_capacitance_leaves_it_open(tmp_path: Path) -> None:
    rows = ROWS.replace("\n", ",5\n")
    with pytest.raises(ValueError, match="columns: got none"):
        read(table(tmp_path, "t_s,C1 (pF),C2 (pF),C3 (pF)", rows))
    assert read(table(tmp_path, "t_s,C1 (pF),C2 (pF),T (C)", rows)).hard[0] == 6
    for header in ("t_s,C1,C2,C1", "t_s,C1,C2,C3"):
        with pytest.raises(ValueError, match="columns: got none"):
            read(table(tmp_path, header, rows))


def scaled(factor_hard: float, factor_soft: float) -> str:
    lines = [line.split(",") for line in ROWS.splitlines()]
    return "".join(f"{t},{float(h) * factor_hard!r},{float(s) * factor_soft!r}\n" for t, h, s in lines)


@pytest.mark.parametrize(
    ("header", "factors", "note"),
    [
        ("t_s,C1 (fF),C2 (fF)", (1e3, 1e3), ""),
        ("t_s,C1 (fF),C2", (1e3, 1e3), "no unit in the header of C2: fF, as that of C1"),
        ("t_s,C1,C2 (nF)", (1e-3, 1e-3), "no unit in the header of C1: nF, as that of C2"),
        ("t_s,C1 (fF),C2 (pF)", (1e3, 1), "the channels have different units: fF and pF"),
        ("t_s,C1,C2", (1, 1), "no unit in the header: pF assumed"),
        ("t_s,C1,C2", (1e-12, 1e-12), "no unit in the header: F assumed, by the size of the values"),
    ],
)
def test_units(tmp_path: Path, header: str, factors: tuple[float, float], note: str) -> None:
    recording = read(table(tmp_path, header, scaled(*factors)))
    assert recording.hard == pytest.approx([6 + i % 3 for i in range(40)])
    assert recording.soft == pytest.approx([4 + i % 2 for i in range(40)])
    assert recording.notes == ((note,) if note else ())


@pytest.mark.parametrize(
    ("header", "factors", "options", "message"),
    [
        ("t_s,C1,C2", (1e3, 1e3), {}, r"unit: got none in the header, and values of about 8e\+03 in C1"),
        ("t_s,C1,C2", (1e-3, 1e-3), {}, "unit: got none in the header"),
        ("t_s,C1 (fF),C2", (1, 1e3), {}, "unit: got about 0.008 pF in C1 and 5 pF in C2"),
        ("t_s,C1 (%),C2 (%)", (1, 1), {}, "in per cent"),
        ("t_s,C1,C2", (1, 1), {"unit": "pf"}, "unit: got 'pf', allowed: aF, fF, pF"),
        ("t_s,C1,C2", (1, 1), {"time_unit": "h"}, "time_unit: got 'h', allowed: s, sec, ms"),
        ("t_s,C1,C2", (1, 1), {"rate": 0}, "rate: got 0, allowed: a number above 0"),
        ("t_s,C1,C2", (1, 1), {"decimal": ","}, "decimal: got ',', allowed: point, comma"),
    ],
)
def test_what_is_asked_or_refused(
    tmp_path: Path, header: str, factors: tuple[float, float], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        read(table(tmp_path, header, scaled(*factors)), **options)


def test_a_rate_in_place_of_times(tmp_path: Path) -> None:
    recording = read(table(tmp_path, "t_s,hard,soft"), rate=41)
    assert recording.t_soft_s.tolist() == (np.arange(40) / 41).tolist()
    assert "the times of the file are not used: a rate was given" in recording.notes
    untimed = read(table(tmp_path, "n,hard,soft"))
    assert np.isnan(untimed.t_hard_s).all()
    assert "rate unknown" in untimed.understood


@pytest.mark.parametrize("form", ["{:.3f}", "{:.0f}"])
def test_a_rate_that_the_times_contradict_is_a_question(tmp_path: Path, form: str) -> None:
    rows = "".join(f"{form.format(i // 25 + i % 25 / 100)},{6 + i % 3},{4 + i % 2}\n" for i in range(200))
    path = table(tmp_path, "t_s,hard,soft", rows)
    counted = 25
    for rate in (0.75 * counted, 1.3 * counted):
        with pytest.raises(
            ValueError, match=rf"rate: got {rate:g}, but 2[45][.0-9]* rows a second by the times of the file"
        ):
            read(path, rate=rate)
    assert len(read(path, rate=1.1 * counted).hard) == 200


def test_clipped_readings_are_told(tmp_path: Path) -> None:
    rows = "".join(f"{i / 40},{min(6 + i * 0.01, 8)},{4 + i * 0.001}\n" for i in range(300))
    [_, note] = read(table(tmp_path, "t_s,hard,soft", rows)).notes
    assert note == "hard: 100 readings have exactly the largest value, 8: is the channel clipped there?"


def test_a_channel_that_is_frozen_is_told(tmp_path: Path) -> None:
    soft = [4 + i * 0.001 + (i % 7) * 0.01 for i in range(300)]
    soft[200:260] = [soft[200]] * 60
    rows = "".join(f"{i / 40},{6 + i * 0.01},{each:.3f}\n" for i, each in enumerate(soft))
    [*_, note] = read(table(tmp_path, "t_s,hard,soft", rows)).notes
    assert note.startswith("soft: rows 201 to 260 of the samples have exactly 4.24, while the other channel changes")


def test_a_pace_that_no_probe_has_is_told(tmp_path: Path) -> None:
    rows = "".join(f"{i * 260},{6 + i % 3},{4 + i % 2}\n" for i in range(60))
    [*_, note] = [note for note in read(table(tmp_path, "t_ms,C1 (pF),C2 (pF)", rows)).notes if "unusual" in note]
    assert note.startswith("3.846 pairs a second are unusual")


def test_a_capital_t_is_a_temperature(tmp_path: Path) -> None:
    rows = "".join(f"{20 + i / 100:.2f},{6 + i % 3},{4 + i % 2}\n" for i in range(40))  # rises as a time does
    assert "rate unknown" in read(table(tmp_path, "T,C1,C2", rows)).understood
    assert "time = t" in read(table(tmp_path, "t,C1,C2", rows)).understood


def test_a_column_of_times_that_does_not_rise_is_refused(tmp_path: Path) -> None:
    rows = "".join(f"5,{6 + i % 3},{4 + i % 2}\n" for i in range(40))
    with pytest.raises(ValueError, match=r"^time: "):
        read(table(tmp_path, "t_s,C1,C2", rows))
