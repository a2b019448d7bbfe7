"""Recordings and touches as Arrow, pandas and polars data, and back with the same bits."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from palpate import Recording
from palpate.simulation import scenarios
from pyarrow import parquet

PLAY = scenarios.run("stiff-steady")
PLAIN = palpate.read("tests/data/four-specimens.csv")
RICH = dataclasses.replace(
    PLAIN,
    full_scale_pF=30.0,
    host_stamps=True,
    gap_rows=(300, 1000),
    zero_utc_ns=1_772_359_200_123_456_789,
    notes=(),
    doubts=(),
)
HOLED = Recording(
    PLAY.t_hard_s,
    PLAY.t_soft_s,
    np.where(np.arange(len(PLAY.hard)) % 50 == 7, np.nan, PLAY.hard),
    PLAY.soft,
)
UNTIMED = Recording(
    np.full(len(PLAY.hard), np.nan),
    np.full(len(PLAY.hard), np.nan),
    PLAY.hard,
    PLAY.soft,
    zero_utc_ns=5,
)
OUT: dict[str, Callable[[Recording], Any]] = {
    "to_arrow": Recording.to_arrow,
    "to_pandas": Recording.to_pandas,
    "to_polars": Recording.to_polars,
    "pyarrow.table": pa.table,
    "polars.DataFrame": pl.DataFrame,
}
if hasattr(pd.DataFrame, "from_arrow"):  # since pandas 3
    OUT["pandas.DataFrame.from_arrow"] = pd.DataFrame.from_arrow
FIELDS = ("full_scale_pF", "host_stamps", "gap_rows")
EFFECTS = ("offset", "drift", "lag", "curve", "tilt", "shift", "stiffening")


@pytest.mark.parametrize(
    "recording", [PLAIN, RICH, HOLED, UNTIMED], ids=["plain", "rich", "holed", "untimed"]
)
@pytest.mark.parametrize("out", OUT)
def test_a_recording_comes_back_with_the_same_bits(recording: Recording, out: str) -> None:
    back = palpate.read(OUT[out](recording))
    for name in ("t_hard_s", "t_soft_s", "hard", "soft"):
        assert getattr(back, name).tobytes() == getattr(recording, name).tobytes(), name
    assert [getattr(back, name) for name in FIELDS] == [getattr(recording, name) for name in FIELDS]
    assert back.zero_utc_ns == (None if recording is UNTIMED else recording.zero_utc_ns)
    assert palpate.touches(back) == palpate.touches(recording) != []


@pytest.mark.parametrize("out", ["to_arrow", "to_pandas", "to_polars"])
def test_a_part_of_the_rows_keeps_its_gaps_and_epoch(out: str) -> None:
    frame = getattr(RICH, out)()
    back = palpate.read(frame.iloc[700:] if out == "to_pandas" else frame[700:])
    assert (back.gap_rows, back.zero_utc_ns, back.full_scale_pF) == ((300,), RICH.zero_utc_ns, 30.0)


def test_parts_of_different_recordings_are_refused() -> None:
    frame = pl.concat([RICH.to_polars(), dataclasses.replace(RICH, full_scale_pF=8.0).to_polars()])
    with pytest.raises(ValueError, match="got parts of different recordings in one frame"):
        palpate.read(frame)


@pytest.mark.parametrize("scene", ["handheld", "paper"])
def test_touches_are_a_column_for_each_field(scene: Any) -> None:
    touches = palpate.touches(PLAIN, scene=scene)
    records = [touch.as_dict() for touch in touches]
    flat = [name for name in records[0] if name != "effects"]
    for frame in (touches.to_arrow().to_pylist(), touches.to_polars().to_dicts()):
        for row, record in zip(frame, records, strict=True):
            assert set(row) - set(flat) == {f"effect_{name}" for name in EFFECTS}
            assert {name: row[name] for name in flat} == {
                **{name: record[name] for name in flat},
                "flags": " ".join(record["flags"]),
            }
            assert {name: row[f"effect_{name}"] for name in record["effects"]} == record["effects"]
    in_pandas = touches.to_pandas()
    assert in_pandas["ratio"].tolist() == [touch.ratio for touch in touches]
    assert in_pandas["samples"].dtype == "int64"


def edited(**columns: Any) -> pd.DataFrame:
    return PLAIN.to_pandas().assign(**columns)


MIDDLE = np.arange(len(PLAIN.hard)) == 50


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (edited(gap=MIDDLE * 1.0), "gap: got '0.0', allowed: True or False in each row"),
        (edited(status=np.where(MIDDLE, 9, 0)), r"line 51: '9' in column 5 \(status\) is no status, allowed: whole numbers, 0 to 8"),
        (edited(hard_pF=PLAIN.hard > 7), r"'False' in column 3 \(hard_pF\) is neither a number"),
    ],
)  # fmt: skip
def test_wrong_cells_of_an_own_frame_are_refused(frame: pd.DataFrame, message: str) -> None:
    with pytest.raises((ValueError, palpate.errors.RecordingError), match=message):
        palpate.read(frame)


@pytest.mark.parametrize("recording", [PLAIN, RICH, HOLED], ids=["plain", "rich", "holed"])
@pytest.mark.parametrize("way", ["csv", "frame of csv", "xlsx", "parquet"])
def test_a_frame_in_a_file_is_the_same_recording(
    recording: Recording, way: str, tmp_path: Path
) -> None:
    frame, path = recording.to_pandas(), tmp_path / f"frame.{way.split()[-1]}"
    if way == "parquet":
        parquet.write_table(recording.to_arrow(), path)
    elif way == "xlsx":
        frame.drop(columns="utc", errors="ignore").to_excel(path)
    else:
        frame.to_csv(path)
    back = palpate.read(pd.read_csv(path) if way == "frame of csv" else path)
    assert [getattr(back, name) for name in FIELDS] == [getattr(recording, name) for name in FIELDS]
    assert back.zero_utc_ns == (None if way == "xlsx" else recording.zero_utc_ns)
    assert back.hard.tobytes() == recording.hard.tobytes()
    assert palpate.touches(back) == palpate.touches(recording) != []


def test_the_status_of_rows_in_a_frame_is_heeded() -> None:
    rows = pd.read_csv("tests/data/four-specimens.csv")
    found = palpate.read(rows)
    # the text has fewer digits than the codes
    assert np.allclose(found.hard, PLAIN.hard, rtol=0, atol=1e-6)
    assert (
        [touch.start for touch in palpate.touches(rows)]
        == [touch.start for touch in palpate.touches(PLAIN)]
        != []
    )
    rows["status"] = np.where(MIDDLE, 4, 0)
    found = palpate.read(rows)
    assert np.isnan(found.hard).tolist() == MIDDLE.tolist()
    assert found.notes[0] == "1 of 1411 rows have no value in a channel: left out"
    assert found.notes[1].startswith("rows of a recording of palpate without its sidecar")
