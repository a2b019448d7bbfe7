"""What a message proposes where it is open which columns are the two channels."""

from pathlib import Path

import numpy as np
import pytest
from foreign_files import RATIOS, measurement  # tests/tools
from palpate import read, touches
from palpate.tables.formats import read_table


def written(folder: Path, header: str, cells: str, rows: int = 200) -> Path:
    """Write rows whose cells are the letters of `cells`: t time, n counter, h hard, s soft, T temperature, x text."""
    t, hard, soft = measurement()
    kinds = {
        "t": [f"{each:.3f}" for each in t],
        "n": [str(row) for row in range(len(t))],
        "h": [f"{each:.4f}" for each in hard],
        "s": [f"{each:.4f}" for each in soft],
        "T": [f"{21 + row % 3 / 10:.1f}" for row in range(len(t))],
        "x": ["OK"] * len(t),
    }
    path = folder / "table.csv"
    lines = [",".join(row) for row in zip(*(kinds[letter] for letter in cells), strict=True)][:rows]
    path.write_text("\n".join([*([header] if header else []), *lines, ""]))
    return path


@pytest.mark.parametrize(
    ("header", "cells", "example"),
    [
        ("No.,Time [s],Cp CH1 [pF],D CH1,Cp CH2 [pF],D CH2,Status", "nthTsTx", "hard=3,soft=5"),
        ("Nr.,Zeit,Kapazität hart (pF),Kapazität weich (pF),Temperatur (°C)", "nthsT", "hard=3,soft=4"),
        ("t (s),Cap soft (pF),Cap hard (pF)", "tsh", "hard=3,soft=2"),
        ("Timestamp,Temp (C),RH (%),Cap A,Cap B,Status", "tTThsx", "hard=4,soft=5"),
        ("t (s),hard_status,soft_status,hard_value,soft_value", "tTThs", "hard=4,soft=5"),
        ("t (s),hard (V),soft (V),hard_a (pF),soft_b (pF)", "thshs", "hard=4,soft=5"),
        ("", "nths", "hard=3,soft=4,time=2"),
        ("", "ths", "hard=2,soft=3,time=1"),
        ("", "hs", "hard=1,soft=2"),
    ],
)
def test_columns_that_can_be_channels(tmp_path: Path, header: str, cells: str, example: str) -> None:
    with pytest.raises(ValueError, match="columns: got none") as error:
        read(written(tmp_path, header, cells))
    assert str(error.value).endswith(f"as in --map {example}")


def test_a_file_with_one_channel(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"only cap_pF can be a channel.* --soft FILE$"):
        read(written(tmp_path, "timestamp,cap_pF", "th"))


def long(folder: Path, header: str, names: tuple[str, ...], row: str) -> Path:
    t, hard, soft = measurement()
    path = folder / "long.csv"
    lines = [
        row.format(n=len(names) * number + at, t=each, name=name, value=(h, s, 21.0)[at])
        for number, (each, h, s) in enumerate(zip(t, hard, soft, strict=True))
        for at, name in enumerate(names)
    ]
    path.write_text("\n".join([header, *lines, ""]))
    return path


@pytest.mark.parametrize(
    ("names", "example"),
    [
        (("hard", "soft", "temp"), "hard=hard,soft=soft"),
        (("101", "102"), "hard=101,soft=102"),
        (("0", "1", "2"), "hard=0,soft=1"),
        (("1", "2"), "hard=1,soft=2"),
    ],
)
@pytest.mark.parametrize("index", [False, True])
def test_names_in_a_column(tmp_path: Path, names: tuple[str, ...], example: str, *, index: bool) -> None:
    header, row = "time_s,channel,value", "{t:.3f},{name},{value:.4f}"
    path = long(tmp_path, "Index," * index + header, names, "{n}," * index + row)
    with pytest.raises(ValueError, match=f"as in --map {example}$"):
        read(path)
    recording = read(path, columns=dict(zip(("hard", "soft"), names, strict=False)))
    assert [touch.ratio for touch in touches(recording)] == pytest.approx(RATIOS, rel=5e-3)


def test_a_number_that_is_a_column_and_a_name_is_a_question(tmp_path: Path) -> None:
    path = long(tmp_path, "value,other,channel,time_s", ("1", "2"), "{value:.4f},{value:.3f},{name},{t:.3f}")
    with pytest.raises(ValueError, match="got 1, 2, which are columns as well as names in channel"):
        read(path, columns={"hard": 1, "soft": 2})


def test_a_channel_at_rest_is_no_counter(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    np.savetxt(path, np.column_stack([np.arange(100) / 40, np.full(100, 7), np.full(100, 5)]), delimiter=",")
    with pytest.raises(ValueError, match=r"as in --map hard=2,soft=3,time=1$"):
        read(path)


@pytest.mark.parametrize(
    ("above", "names"),
    [
        ("Sensor,init,OK\nmillis,hard,soft", ["millis", "hard", "soft"]),
        ("Channels,2,2\nY_Unit_Label,pF,pF\nX_Value,Hard,Soft", ["X_Value", "Hard", "Soft"]),
        ("Time,CH1,CH2\n(ms),(fF),(fF)", ["Time (ms)", "CH1 (fF)", "CH2 (fF)"]),
        ("Time,CH1,CH2\nms,pF,fF", ["Time ms", "CH1 pF", "CH2 fF"]),
        ("Time,CH1,CH2\nat,raw,raw", ["Time at", "CH1 raw", "CH2 raw"]),
    ],
)
def test_names_are_those_of_the_lowest_row_that_names_all(tmp_path: Path, above: str, names: list[str]) -> None:
    found = read_table(written(tmp_path, above, "ths"))
    assert [found.name(column) for column in range(3)] == names
