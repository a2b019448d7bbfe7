"""What the columns of a table mean: channels, units, rates; pairs of two files; what looks wrong."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from effort import examples
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from palpate import read
from palpate.importers.channels import partners
from palpate.importers.table import Option, OptionError
from palpate.importers.table_checks import frozen

ROWS = "".join(f"{i / 40:.3f},{6 + i % 3},{4 + i % 2}\n" for i in range(40))
PERIOD = 0.026
MAP = {"columns": {"hard": 2, "soft": 3}}
Floats = NDArray[np.float64]


def table(folder: Path, header: str, rows: str = ROWS, name: str = "table.csv") -> Path:
    path = folder / name
    path.write_text(f"{header}\n{rows}")
    return path


@pytest.mark.parametrize(
    "header",
    ["t_s,A,B", "t_s,C1 (pF),C3 (pF)", "t_s,value,C2", "t_s,C1 (pF),C2 (pF),C3 (pF)", "t_s,C1,C2,C1", "t_s,C1,C2,C3"],
)  # fmt: skip
def test_other_names_are_asked_for(tmp_path: Path, header: str) -> None:
    rows = ROWS if header.count(",") == 2 else ROWS.replace("\n", ",5\n")
    with pytest.raises(
        ValueError,
        match=r"columns: got none for a table of another program, allowed: hard and soft",
    ):
        read(table(tmp_path, header, rows))


def test_columns_as_a_text_are_refused_with_an_example(tmp_path: Path) -> None:
    columns: Any = "hard=2,soft=3"
    with pytest.raises(OptionError, match=r"got 'hard=2,soft=3', allowed: a mapping, as .*: 2"):
        read(table(tmp_path, "t_s,A,B", ROWS), columns=columns)


def test_names_of_several_header_rows(tmp_path: Path) -> None:
    path = table(
        tmp_path, ",Ch1,,Ch2,\nTime (s),C (pF),D (%),C (pF),D (%)", "0.1,1,5,2,6\n0.2,3,5,4,6\n"
    )
    for hard, soft in (("ch1 C", "Ch2 C (pF)"), ("2", 4)):
        recording = read(path, columns={"hard": hard, "soft": soft})
        assert (recording.hard.tolist(), recording.soft.tolist()) == ([1, 3], [2, 4])
    for wrong, message in (
        ("Ch3", r"'Ch3', no column, allowed: one of 1 \(Time \(s\)\), 2 \(Ch1 C \(pF\)\)"),
        ("D", "'D', the name or position of 2 columns"),
        (0, "got 0, no column"),
        (6, "got 6, no column"),
        (3, "in %"),
    ):
        with pytest.raises(ValueError, match=message):
            read(path, columns={"hard": wrong, "soft": 4})


def scaled(factor_hard: float, factor_soft: float) -> str:
    lines = [line.split(",") for line in ROWS.splitlines()]
    return "".join(
        f"{t},{float(h) * factor_hard!r},{float(s) * factor_soft!r}\n" for t, h, s in lines
    )


@pytest.mark.parametrize(
    ("header", "factors", "note"),
    [
        *[(f"t_s,C1 {unit},C2 {unit}", (factor, factor), "") for unit, factor in
          (("(pF)", 1.0), ("[fF]", 1e3), ("_nF", 1e-3), ("/ aF", 1e6), ("(F)", 1e-12), ("(µF)", 1e-6))],
        ("t_s,C1 (fF),C2", (1e3, 1e3), "no unit in the header of C2: fF, as the other channel"),
        ("t_s,C1 (fF),C2 (pF)", (1e3, 1), ""),
        ("t_s,C1,C2", (1, 1), "no unit in the header of C1: pF assumed, by the size of the values"),
        ("t_s,C1,C2", (1e-12, 1e-12), "no unit in the header of C1: F assumed, by the size of the values"),
    ],
)  # fmt: skip
def test_units(tmp_path: Path, header: str, factors: tuple[float, float], note: str) -> None:
    recording = read(table(tmp_path, header, scaled(*factors)))
    assert recording.hard == pytest.approx([6 + i % 3 for i in range(40)])
    assert recording.soft == pytest.approx([4 + i % 2 for i in range(40)])
    assert recording.notes[:1] == ((note,) if note else ())


@pytest.mark.parametrize(
    ("header", "factors", "options", "message"),
    [
        ("t_s,C1,C2", (20, 20), {}, "unit: got none in the header, and values of about 160 in C1"),
        ("t_s,C1,C2", (0.005, 0.005), {}, "unit: got none in the header, and values of about 0.04"),
        ("t_s,C1 (fF),C2", (1, 1e3), {}, "unit: got about 0.008 pF in C1 and 5 pF in C2"),
        ("t_s,C1 (V),C2 (V)", (1, 1), MAP, "in V, allowed: a capacitance"),
        ("t_s,C1_counts,C2_counts", (1, 1), MAP, "in counts, allowed: .*--unit counts"),
        ("t_s,C1 (0.1 pF),C2", (1, 1), MAP, "in 0.1 pF, allowed: .* without a scale"),
        *[
            (
                "t_s,C1,C2",
                (1, 1),
                {"unit": unit},
                f"unit: got '{unit}', allowed: aF, fF, pF.* or another unit, as N",
            )
            for unit in ("pf", "PF", "pG", "kF", "p", "ppF", "")
        ],
        ("t_s,C1,C2", (1, 1), {"time_unit": "h"}, "time_unit: got 'h', allowed: s, sec, ms"),
        ("t_s,C1,C2", (1, 1), {"rate": 0}, "rate: got 0, allowed: a number above 0"),
        ("t_s,C1,C2", (1, 1), {"decimal": ","}, "decimal: got ',', allowed: point, comma"),
        ("t_s,C1,C2", (1, 1), {"columns": {"hard": 2, "soft": "C1"}}, "for both channels"),
        (
            "t_s,C1,C2",
            (1, 1),
            {"columns": {"hard": 2, "soft": 3, "x": 1}},
            "columns: got hard, soft, x, allowed",
        ),
        (
            "t_s,C1,C2",
            (1, 1),
            {**MAP, "rate": 5, "columns": {**MAP["columns"], "time": 1}},
            "together with a column",
        ),
    ],
)
def test_what_is_asked_or_refused(
    tmp_path: Path, header: str, factors: tuple[float, float], options: dict[str, Any], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        read(table(tmp_path, header, scaled(*factors)), **options)


def test_a_unit_that_the_header_contradicts_is_told(tmp_path: Path) -> None:
    recording = read(table(tmp_path, "t_s,C1 (pF),C2"), unit="fF")
    assert (recording.hard[0], recording.notes) == (
        0.006,
        ("the header of C1 says pF: fF is used, as asked",),
    )


@pytest.mark.parametrize("unit", ["N", "mm", "mV", "nN", "%", "counts", "kilogauss", "1"])
def test_signals_of_another_unit_are_used_as_they_are(tmp_path: Path, unit: str) -> None:
    recording = read(
        table(tmp_path, f"t_s,A ({unit}),B", scaled(1e-6, 1e6)), columns=MAP["columns"], unit=unit
    )
    assert (recording.hard[0], recording.soft[0], recording.unit) == (6e-6, 4e6, unit)
    assert (recording.full_scale_pF, recording.notes) == (np.inf, ())
    assert (
        f"hard = A ({unit}), {unit}" in recording.understood
        or f"hard = A, {unit}" in recording.understood
    )
    told = read(table(tmp_path, "t_s,C1 (pF),C2"), unit=unit).notes
    assert told == (f"the header of C1 says pF: {unit} is used, as asked",)


def test_a_rate_in_place_of_times(tmp_path: Path) -> None:
    recording = read(table(tmp_path, "t_s,hard,soft"), rate=41)
    assert recording.t_soft_s.tolist() == (np.arange(40) / 41).tolist()
    assert "the times of the file are not used: a rate was given" in recording.notes
    untimed = read(table(tmp_path, "n,hard,soft"))
    assert np.isnan(untimed.t_hard_s).all()
    assert "rate unknown" in untimed.understood


def test_a_named_time_wins_over_a_unit_that_may_be_a_minimum(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    rows = "".join(
        f"{k * 0.0004:.4f},{6.9 + k % 7 / 100},{4.6 + k % 5 / 100},{k * 0.025:.3f}\n"
        for k in range(40)
    )
    path.write_text(f"Min,C1 (pF),C2 (pF),time (s)\n{rows}")
    assert read(path).understood.startswith("time = time, s; ")
    path.write_text(f"Min,C1 (pF),C2 (pF),n\n{rows}")
    assert read(path).understood.startswith("time = Min, min; ")


def test_a_capital_t_is_a_temperature(tmp_path: Path) -> None:
    # rises as a time does
    rows = "".join(f"{20 + i / 100:.2f},{6 + i % 3},{4 + i % 2}\n" for i in range(40))
    assert "rate unknown" in read(table(tmp_path, "T,C1,C2", rows)).understood
    assert "time = t" in read(table(tmp_path, "t,C1,C2", rows)).understood


def written(t: Floats, hard: Floats, soft: Floats) -> str:
    return "".join(f"{a:.6f},{b:.6f},{c:.6f}\n" for a, b, c in zip(t, hard, soft, strict=True))


T = np.arange(1000) / 40
HARD, SOFT = 6 + np.sin(T), 4 + np.cos(T)
ROW = np.arange(1000)
TWICE = ROW - (ROW % 10 == 5)


@pytest.mark.parametrize(
    ("change", "note"),
    [
        ({"hard": np.minimum(HARD, 6.5)}, "readings have exactly the largest value, 6.5: is the channel clipped there?"),
        ({"soft": np.maximum(SOFT, 3.5)}, "readings have exactly the smallest value, 3.5: is the channel clipped there?"),
        ({"hard": np.where(ROW % 97 == 5, 0.0, HARD)}, "hard: 11 readings are exactly 0, far from all other readings"),
        ({"hard": np.where(ROW % 97 == 5, -999.0, HARD)}, "hard: 11 readings are exactly -999, far from all other readings"),
        ({"soft": np.where(ROW // 40 == 3, SOFT[120], SOFT)}, "rows 121 to 160 of the samples have exactly"),
        ({"t": T * 10}, "4 pairs a second are unusual"),
        ({"t": np.where(ROW == 500, T - 0.05, T)}, "time goes back at 1 of 1000 rows"),
        ({"t": (ROW + ROW // 10) / 40}, "99 of 1099 rows are missing: the others are 25 ms apart"),
        ({"t": T[TWICE]}, "100 of 1000 rows have the time of the row before"),
    ],
)  # fmt: skip
def test_what_looks_wrong_is_told(tmp_path: Path, change: dict[str, Floats], note: str) -> None:
    found = read(
        table(tmp_path, "t_s,hard,soft", written(**{"t": T, "hard": HARD, "soft": SOFT, **change})),
        unit="pF",
    )
    assert any(note in each for each in found.notes), found.notes
    late = np.where(ROW % 10 == 5, T + 0.025, T)  # in bursts: no row is missing
    told = read(table(tmp_path, "t_s,hard,soft", written(late, HARD, SOFT)), unit="pF").notes
    assert not any("missing" in each for each in told)
    assert read(table(tmp_path, "t_s,hard,soft", written(T, HARD, SOFT)), unit="pF").notes == ()
    if "far from" in note:
        assert np.isnan(found.hard).tolist() == (ROW % 97 == 5).tolist()


def files(
    folder: Path, hard: Floats, soft: Floats, header: str = "t (s),C (pF)"
) -> tuple[Path, Path]:
    """Write a file for each channel, in which the value is the time, and 5."""
    made = [
        table(folder, header, "".join(f"{t:.6f},{t % 3 + 5:.6f}\n" for t in each), name)
        for each, name in ((hard, "a"), (soft, "b"))
    ]
    return made[0], made[1]


def test_a_file_for_each_channel_is_joined_by_time(tmp_path: Path) -> None:
    even = np.arange(100.0) * PERIOD
    later = np.delete(even + 0.3 * PERIOD, [7, 8, 60])[5:]  # begins later, with gaps
    hard, soft = files(tmp_path, even, later)
    found = read(hard, soft=soft)
    assert found.t_soft_s.tolist() == np.round(later, 6).tolist()
    assert np.rint(found.t_hard_s / PERIOD).astype(int).tolist() == [
        *range(5, 7),
        *range(9, 60),
        *range(61, 100),
    ]
    left_out = "8 of 100 hard and 0 of 92 soft readings have no reading of the other channel near in time: left out"
    assert found.notes[:2] == (left_out, "the times of both files are taken as those of one clock")
    with pytest.raises(ValueError, match="allowed: times that overlap"):
        read(hard, soft=files(tmp_path, even, even + 60)[1])
    two = table(tmp_path, "t (s),C (pF),D (pF)")
    with pytest.raises(ValueError, match="got 2 columns that can be"):
        read(hard, soft=two)


def test_channels_with_other_kinds_of_times_are_refused(tmp_path: Path) -> None:
    hard, soft = files(tmp_path, 1_772_000_000 + T, T, "time,C (pF)")
    with pytest.raises(
        ValueError,
        match=r"time: got .* since 1970 .* for hard and .* for soft, allowed: the same kind",
    ):
        read(hard, soft=soft)


def test_a_file_for_each_channel_needs_times_or_a_rate(tmp_path: Path) -> None:
    paths = [table(tmp_path, "C (pF),n", "".join(f"{n % 7 + 1},0\n" for n in range(rows)), name)
             for rows, name in ((60, "a"), (58, "b"))]  # fmt: skip
    columns = {"hard": 1, "soft": 1}
    with pytest.raises(
        ValueError,
        match="time: got none for a channel in a file of its own, allowed: times in both",
    ):
        read(paths[0], soft=paths[1], columns=columns)
    found = read(paths[0], soft=paths[1], columns=columns, rate=40)
    assert found.hard.tolist() == found.soft.tolist() == [n % 7 + 1 for n in range(58)]
    assert found.notes[0].startswith("2 of 60 hard and 0 of 58 soft readings")


@pytest.mark.parametrize("offset", [-0.5, -0.25, 0, 0.1, 0.5])
def test_channels_that_are_read_in_turn_lose_nothing(offset: float) -> None:
    rng = np.random.default_rng(5)
    even = np.arange(500.0) * PERIOD
    hard, soft = (
        even + rng.uniform(-0.05, 0.05, 500) * PERIOD,
        even + (offset + rng.uniform(-0.05, 0.05, 500)) * PERIOD,
    )
    first, second = partners(hard, soft)
    # at half a period, the partner may be the one before or after: one at an end is left
    assert len(first) >= 499
    assert len({*(first - second).tolist()}) == 1
    assert np.abs(hard[first] - soft[second]).max() < PERIOD


readings = st.sets(st.integers(0, 400), min_size=1, max_size=60).map(
    lambda counts: np.array(sorted(counts)) * 1e-3
)


@examples(60)
@given(readings, readings)
def test_any_readings_are_in_one_pair_at_most_and_in_order(hard_s: Floats, soft_s: Floats) -> None:
    for each in partners(hard_s, soft_s):
        assert (np.diff(each) > 0).all()
    assert [each.tolist() for each in partners(hard_s, hard_s)] == [list(range(len(hard_s)))] * 2


@pytest.mark.parametrize("begin", range(200, 210))
def test_a_run_of_equal_readings_is_noticed_wherever_it_begins(begin: int) -> None:
    for length, noticed in ((20, True), (19, False)):
        hard = HARD.copy()
        hard[begin : begin + length] = hard[begin]
        assert bool(frozen("hard", hard, SOFT)) == noticed


def test_an_ambiguity_names_the_option_that_resolves_it(tmp_path: Path) -> None:
    with pytest.raises(OptionError) as caught:
        read(table(tmp_path, "t_s,C1,C2", scaled(20, 20)))
    copied = pickle.loads(pickle.dumps(caught.value))  # from a process of many files
    for error in (caught.value, copied):
        assert error.option is Option.UNIT
        assert str(error).startswith("unit: got none in the header, and values of about 160 in C1")


@pytest.mark.parametrize(
    "header",
    [
        "time,C1,time,C2",
        "Time (s),C1,Time (s),C2",
        "X_Value,C1,X_Value,C2",
        "Time_C1,C1,Time_C2,C2",
    ],
)
def test_each_channel_has_the_times_of_its_own_column(tmp_path: Path, header: str) -> None:
    rows = "".join(
        f"{i / 40:.3f},{6 + i % 3},{i / 40 + 0.013:.3f},{4 + i % 2}\n" for i in range(40)
    )
    found = read(table(tmp_path, header, rows))
    assert found.t_soft_s - found.t_hard_s == pytest.approx(0.013)
    names = header.split(",")
    exchanged = ",".join([names[2], names[3], names[0], names[1]])
    found = read(table(tmp_path, exchanged, rows))
    assert found.t_hard_s - found.t_soft_s == pytest.approx(0.013)
