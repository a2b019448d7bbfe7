"""Recordings of palpate as Parquet and Arrow files: read back with the same bits, and verified."""

import gzip
from pathlib import Path
from typing import Any

import palpate
import pyarrow as pa
import pytest
from command_lines import run
from palpate.errors import RecordingError
from palpate.recording import check, read, recorded, sidecar
from palpate.recording.convert import convert
from palpate.recording.csv_reader import RecordingFile
from palpate.samples import Status
from palpate.simulation import scenarios
from project import FOUR
from pyarrow import feather, parquet
from recording_bench import record, sample

SUFFIXES = ("parquet", "arrow", "feather")
SAID = (
    "settings",
    "tares",
    "gap_marks",
    "zero_utc_ns",
    "host_stamps",
    "full_scale_pF",
    "notes",
    "doubts",
    "survey",
)


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Return a touch, with a tare, a gap, lost and saturated samples, settings, host stamps and codes."""
    play = scenarios.run("stiff-steady")
    rows = []
    for i in range(400):
        status = {40: Status.LOST, 50: Status.HARD_SATURATED}.get(i, Status.OK)
        times: Any = {
            "t_hard_ns": int(play.t_hard_s[i] * 1e9),
            "t_soft_ns": int(play.t_soft_s[i] * 1e9),
        }
        values: Any = {
            "hard_raw": -1,
            "soft_raw": -1,
            "hard": float(play.hard[i]),
            "soft": float(play.soft[i]),
        }
        rows.append(sample(i + (5 if i > 200 else 0), status=status)._replace(**times, **values))
    path = record(tmp_path / "own.csv", rows, name="script", full_scale_pF=40.0, stamps="host")
    found = sidecar.load(path)
    assert found
    found["settings"] = {"scene": "handheld", "threshold": 6.0}
    found["marks"] = [
        {"seq": 20, "tare": True},
        {"seq": 30, "tare": True, "gap": True, "text": "opened again"},
    ]
    sidecar.save(sidecar.sidecar_path(path), found)
    return path


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_there_and_back_is_the_same_recording(own: Path, tmp_path: Path, suffix: str) -> None:
    there, back, packed = (
        tmp_path / f"run.{suffix}",
        tmp_path / "back.csv",
        tmp_path / f"run.{suffix}.gz",
    )
    assert run("convert", own, "-o", there).exit_code == 0
    assert run("convert", there, "-o", back).exit_code == 0
    assert back.read_bytes() == own.read_bytes()
    before, after = sidecar.load(own), sidecar.load(back)
    assert before
    assert after
    assert {**after, "notes": before["notes"]} == before
    sources = [note.split(" by ")[0] for note in after["notes"][-2:]]
    assert sources == ["converted from own.csv", f"converted from run.{suffix}"]
    packed.write_bytes(gzip.compress(there.read_bytes()))
    csv, columns, unpacked = recorded(own), recorded(there), recorded(packed)
    assert isinstance(columns, RecordingFile)
    assert palpate.touches(csv) == palpate.touches(columns) == palpate.touches(unpacked) != []
    assert [getattr(csv, name) for name in SAID] == [getattr(columns, name) for name in SAID]
    assert columns.integrity.verified == 400
    assert {**check(there).as_dict(), "file": ""} == {**check(own).as_dict(), "file": ""}


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_row_that_another_program_changed_is_noticed(tmp_path: Path, suffix: str) -> None:
    there = tmp_path / f"run.{suffix}"
    convert(recorded(FOUR), there)
    table = (parquet if suffix == "parquet" else feather).read_table(there)
    write = parquet.write_table if suffix == "parquet" else feather.write_feather
    write(table, there)
    assert read(there).doubts == (), "written again as it was"
    seq = table.column("seq").to_numpy().copy()
    seq[7] += 1
    index = table.schema.get_field_index("seq")
    write(table.set_column(index, table.schema.field("seq"), pa.array(seq)), there)
    [doubt] = read(there).doubts
    assert doubt.startswith("the rows were changed after they were written")
    assert (run("check", there).exit_code, run("replay", there).exit_code) == (4, 5)
    write(table.slice(0, 900), there)
    assert any("900 rows in the file, but 1411 were written" in each for each in read(there).doubts)


def test_what_is_no_row_is_refused(tmp_path: Path) -> None:
    there = tmp_path / "run.parquet"
    convert(recorded(FOUR), there)
    table = parquet.read_table(there)
    for name, values, reason in (
        (
            "seq",
            pa.array([-1] * len(table)),
            "run.parquet, line 2: '-1' is not a valid value for column seq",
        ),
        (
            "status",
            pa.array([9] * len(table), pa.uint8()),
            "is not a valid value for column status",
        ),
        (
            "seq",
            pa.array([None, *range(1, len(table))]),
            "column seq: got float64, allowed: int64 in each row",
        ),
        (
            "hard_pF",
            pa.array(["1.5"] * len(table)),
            "column hard_pF: got .*, allowed: float64 in each row",
        ),
    ):
        index = table.schema.get_field_index(name)
        parquet.write_table(table.set_column(index, pa.field(name, values.type), values), there)
        with pytest.raises(RecordingError, match=reason):
            read(there)
        if name == "status":
            before = there.read_bytes()
            assert (
                "packed or converted file"
                in check(there, repair=True, remove_damage=True).faults[-1]
            )
            assert there.read_bytes() == before
