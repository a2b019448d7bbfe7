"""Recordings of palpate as Parquet and Arrow files: read back with the same bits, and verified."""

import gzip
import json
import sys
from pathlib import Path

import numpy as np
import palpate
import pyarrow as pa
import pytest
from click.testing import CliRunner, Result
from palpate.cli import main
from palpate.errors import RecordingError
from palpate.recording import check, read, recorded, sidecar
from palpate.recording.exchange.columns_in import OwnColumns
from palpate.recording.exchange.export import convert
from palpate.samples import Status
from palpate.simulation import scenarios
from pyarrow import feather, parquet
from recording_bench import record, sample

SUFFIXES = ("parquet", "arrow", "feather")
DATA = Path("tests/data/four-specimens.csv")


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, [str(each) for each in arguments])


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Return a touch, with a tare, a gap, lost and saturated samples, settings, host stamps and codes."""
    play = scenarios.run("stiff-steady")
    rows = [
        sample(
            i + (5 if i > 200 else 0),
            status=Status.LOST if i == 40 else Status.HARD_SATURATED if i == 50 else Status.OK,
        )
        for i in range(400)
    ]
    for i, row in enumerate(rows):
        rows[i] = row._replace(t_hard_ns=int(play.t_hard_s[i] * 1e9), t_soft_ns=int(play.t_soft_s[i] * 1e9), hard_raw=-1,
                               soft_raw=-1, hard=float(play.hard[i]), soft=float(play.soft[i]))  # fmt: skip
    path = record(tmp_path / "own.csv", rows, name="script", full_scale_pF=40.0, stamps="host")
    found = sidecar.load(path)
    assert found
    found["settings"] = {"scene": "handheld", "threshold": 6.0}
    found["marks"] = [{"seq": 20, "tare": True}, {"seq": 30, "tare": True, "gap": True, "text": "opened again"}]
    sidecar.save(sidecar.sidecar_path(path), found)
    return path


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_there_and_back_is_the_same_recording(own: Path, tmp_path: Path, suffix: str) -> None:
    there, back = tmp_path / f"run.{suffix}", tmp_path / "back.csv"
    assert run("convert", own, "-o", there).exit_code == 0
    assert run("convert", there, "-o", back).exit_code == 0
    assert back.read_bytes() == own.read_bytes()
    before, after = sidecar.load(own), sidecar.load(back)
    assert before
    assert after
    assert {**after, "notes": before["notes"]} == before
    assert [note.split(" by ")[0] for note in after["notes"][-2:]] == [
        "converted from own.csv",
        f"converted from run.{suffix}",
    ]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_every_reader_says_the_same_of_it(own: Path, tmp_path: Path, suffix: str) -> None:
    there = tmp_path / f"run.{suffix}"
    convert(recorded(own), there)
    csv, columns = recorded(own), recorded(there)
    assert isinstance(columns, OwnColumns)
    assert palpate.touches(csv) == palpate.touches(columns) != []
    assert palpate.touches(read(own)) == palpate.touches(read(there)) == palpate.touches([str(there)])[0]
    names = (
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
    assert [getattr(csv, name) for name in names] == [getattr(columns, name) for name in names]
    assert columns.integrity.verified == 400
    mine, other = check(there).as_dict(), check(own).as_dict()
    assert {**mine, "file": ""} == {**other, "file": ""}
    replays = [json.loads(run("replay", path, "--json").stdout) for path in (own, there)]
    assert {**replays[0], "file": ""} == {**replays[1], "file": ""}


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_packed_one_is_the_same(tmp_path: Path, suffix: str) -> None:
    there = tmp_path / f"run.{suffix}"
    convert(recorded(DATA), there)
    packed = tmp_path / f"run.{suffix}.gz"
    packed.write_bytes(gzip.compress(there.read_bytes()))
    found = recorded(packed)
    assert isinstance(found, OwnColumns)
    assert palpate.touches(found) == palpate.touches(recorded(DATA))
    assert found.integrity.verified == 1411


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_row_that_another_program_changed_is_noticed(tmp_path: Path, suffix: str) -> None:
    there = tmp_path / f"run.{suffix}"
    convert(recorded(DATA), there)
    assert read(there).doubts == ()
    table = (parquet if suffix == "parquet" else feather).read_table(there)
    known = palpate.tables.readers.arrow.ArrowFile(there).metadata
    table = table.replace_schema_metadata({b"palpate": known[b"palpate"]})
    status = table.column("seq").to_numpy().copy()
    status[7] += 1
    index = table.schema.get_field_index("seq")
    changed = table.set_column(index, table.schema.field("seq"), pa.array(status))
    write = parquet.write_table if suffix == "parquet" else feather.write_feather
    write(table, there)
    assert read(there).doubts == (), "written again as it was"
    write(changed, there)
    [doubt] = read(there).doubts
    assert doubt.startswith("the rows were changed after they were written")
    assert (run("check", there).exit_code, run("replay", there).exit_code) == (4, 5)
    write(changed.slice(0, 900), there)
    assert any("900 rows in the file, but 1411 were written" in each for each in read(there).doubts)
    assert not check(there, repair=True).clean, "there is nothing to repair"


def test_what_is_no_row_is_refused(tmp_path: Path) -> None:
    there = tmp_path / "run.parquet"
    convert(recorded(DATA), there)
    table = parquet.read_table(there)
    known = parquet.read_metadata(there).metadata
    for name, values, reason in (
        ("seq", pa.array([-1] * len(table)), "run.parquet, line 1: not a row"),
        ("status", pa.array([9] * len(table), pa.uint8()), "not a row of a recording"),
        ("seq", pa.array([None, *range(1, len(table))]), "column seq: got a null in rows 1 to"),
        ("hard_pF", pa.array(["1.5"] * len(table)), "column hard_pF: got .*, allowed: double"),
    ):
        index = table.schema.get_field_index(name)
        other = table.set_column(index, pa.field(name, values.type), values)
        parquet.write_table(other.replace_schema_metadata(known), there)
        with pytest.raises(RecordingError, match=reason):
            read(there)
    parquet.write_table(table.replace_schema_metadata({b"palpate": b"{}"}), there)
    with pytest.raises(RecordingError, match="not the sidecar of a recording"):
        read(there)


def test_rows_without_their_sidecar_say_so(tmp_path: Path) -> None:
    there = tmp_path / "run.parquet"
    convert(recorded(DATA), there)
    parquet.write_table(parquet.read_table(there).replace_schema_metadata(None), there)
    found = read(there)
    assert found.notes == (
        "rows of a recording of palpate without its sidecar: they are not verified; its range, gaps and tares are not known",
    )
    assert np.array_equal(found.hard, read(DATA).hard)


def test_rows_without_their_sidecar_are_checked(tmp_path: Path) -> None:
    there = tmp_path / "run.parquet"
    convert(recorded(DATA), there)
    table = parquet.read_table(there).replace_schema_metadata(None)
    floats = table.set_column(0, "seq", pa.array([None, *range(1, len(table))]))
    status = table.set_column(table.schema.get_field_index("status"), "status", pa.array([300] * len(table)))
    for other, reason in (
        (table.take(list(reversed(range(len(table))))), "newest row first"),
        (pa.concat_tables([table, table]), "line 1412: the time .* goes back by 36.7 s"),
        (floats, "column seq: got float64, allowed: whole numbers"),
        (status, "line 1: column status: got 300, allowed: whole numbers, 0 to 8"),
    ):
        parquet.write_table(other, there)
        with pytest.raises(RecordingError, match=reason):
            read(there)
        assert run("replay", there).exit_code == 4


def test_a_claim_of_many_rows_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = tmp_path / "run.parquet"
    convert(recorded(DATA), there)
    monkeypatch.setattr("palpate.recording.exchange.columns_in.MOST_ROWS", 1000)
    with pytest.raises(RecordingError, match="got 1,411 rows, allowed: 1,000"):
        read(there)


def test_without_pyarrow_the_extra_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = tmp_path / "run.parquet"
    convert(recorded(DATA), there)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    result = run("replay", there)
    assert (result.exit_code, "pip install 'palpate[export]'" in result.stderr) == (6, True), result.stderr
    assert (
        len(
            palpate.read(
                {"t": [0.0, 0.02, 0.04], "C1": [1.0, 1.5, 2.0], "C2": [1.0, 1.25, 1.5]}, unit="pF", time_unit="s"
            )
        )
        == 3
    )
