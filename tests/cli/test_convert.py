"""`palpate convert`: nothing is lost, and what is not taken over is said."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import palpate
import pytest
from click.testing import CliRunner, Result
from palpate import Status, check
from palpate.ad7746.datasheet import LAST_CODE, ZERO_CODE, capacitance_pF
from palpate.cli import main
from palpate.recording.own_file import Recorded
from palpate.recording.recorder import Recorder
from palpate.recording.sidecar import load
from palpate.samples import Block
from pyarrow import parquet
from recording_bench import record, sample, tear


def run(*arguments: str | Path) -> Result:
    return CliRunner().invoke(main, [str(a) for a in arguments])


def block(path: Path) -> Block:
    return np.concatenate(list(Recorded(path).blocks()))


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Gaps, a lost sample, a saturated one."""
    rows = [sample(i) for i in (0, 1, 2, 7, 8)] + [
        sample(9, status=Status.LOST),
        sample(10, status=Status.HARD_SATURATED),
    ]
    return record(tmp_path / "own.csv", rows, name="script", full_scale_pF=4.0)


def test_parquet_has_every_bit(own: Path, tmp_path: Path) -> None:
    out = tmp_path / "own.parquet"
    result = run("convert", own, "-o", out)
    assert (result.exit_code, result.stdout) == (0, f"{out}: 7 rows\n")
    assert "1 of 7 rows have no usable value: kept, marked as lost" in result.stderr
    table = parquet.read_table(out)
    before = block(own)
    assert table.column_names == [
        "seq", "t_hard_ns", "t_soft_ns", "hard_raw", "soft_raw", "hard_pF", "soft_pF", "status",
        "t_uncertainty_us",
    ]  # fmt: skip
    for name, column in zip(before.dtype.names or (), table.columns, strict=True):
        assert column.to_numpy().tobytes() == np.ascontiguousarray(before[name]).tobytes(), name
    assert table.schema.field("hard_pF").metadata[b"unit"] == b"pF"
    assert table.schema.field("t_soft_ns").metadata[b"unit"] == b"ns"
    document = json.loads(parquet.read_metadata(out).metadata[b"palpate"])
    known = load(own)
    assert known
    assert {name: document[name] for name in ("device", "started", "versions", "end")} == {
        name: known[name] for name in ("device", "started", "versions", "end")
    }
    assert document["notes"][-1].startswith("converted from own.csv by palpate ")


def test_own_to_own_is_the_same_recording(own: Path, tmp_path: Path) -> None:
    out = tmp_path / "copy.csv"
    assert run("convert", own, "-o", out).exit_code == 0
    assert out.read_bytes() == own.read_bytes()
    assert check(out).clean


def test_long_recordings_come_in_parts(tmp_path: Path) -> None:
    path = record(tmp_path / "long.csv", [sample(i) for i in range(30_000)])
    assert run("convert", path, "-o", tmp_path / "long.parquet").exit_code == 0
    file = parquet.ParquetFile(tmp_path / "long.parquet")
    assert file.num_row_groups > 1
    assert file.metadata.num_rows == 30_000


def test_a_torn_and_endless_recording_says_so(tmp_path: Path) -> None:
    path = record(tmp_path / "torn.csv", [sample(i) for i in range(100)], end=False)
    tear(path, 9)
    result = run("convert", path, "-o", tmp_path / "whole.csv")
    assert (result.exit_code, result.stdout) == (0, f"{tmp_path / 'whole.csv'}: 99 rows\n")
    assert "the last row is incomplete (no line end): left out" in result.stderr
    report = check(tmp_path / "whole.csv")
    assert (report.survey.rows, report.repaired) == (99, True)


TABLE = "time (s),C hard (fF),C soft (fF),T (C)\n" + "".join(
    f"{i * 0.03:.2f},{100 * i},{'OL' if i == 3 else 50 * i},21\n" for i in range(6)
)


def test_another_loggers_table(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(TABLE)
    out = tmp_path / "run.csv"
    result = run("convert", tmp_path / "t.csv", "--map", "hard=C hard,soft=C soft", "-o", out, "--json")
    assert result.exit_code == 0, result.stderr
    document = json.loads(result.stdout)
    assert (document["rows"], document["lost"]) == (6, 1)
    assert "columns left out: T (C)" in document["notes"]
    assert "columns left out: T (C)" in result.stderr
    rows = block(out)
    assert rows["hard"].tolist() == pytest.approx([0.1 * i for i in range(6)])
    assert rows["t_soft_ns"].tolist() == [30_000_000 * i for i in range(6)]
    assert rows["status"].tolist() == [0, 0, 0, int(Status.LOST), 0, 0]
    assert check(out).clean


def test_times_are_not_invented(tmp_path: Path) -> None:
    path, out = tmp_path / "t.csv", tmp_path / "run.csv"
    path.write_text("hard,soft\n" + "1,2\n" * 5)
    asked = ("convert", path, "--map", "hard=1,soft=2", "--unit", "pF", "-o", out)
    result = run(*asked)
    assert (result.exit_code, "rate: got none" in result.stderr) == (2, True)
    assert not out.exists()
    assert run(*asked, "--rate", "40").exit_code == 0
    assert block(out)["t_hard_ns"].tolist() == [25_000_000 * i for i in range(5)]
    path.write_text(TABLE)
    result = run("convert", path, "--map", "hard=2,soft=3", "-o", tmp_path / "b.csv", "--rate", "40")
    assert (result.exit_code, "the times of the file are not used: a rate was given" in result.stderr) == (0, True)
    result = run("convert", path, "--map", "hard=2,soft=3,time=1", "-o", tmp_path / "c.csv", "--rate", "40")
    assert (result.exit_code, "rate: got it together with a column of times" in result.stderr) == (2, True)


def adi(path: Path, codes: list[int], *, header: str = "AD7746\tConv. Time: 62.0 ms\tVdd: 5.0\r\nCAP\tVT\r\n") -> Path:
    path.write_bytes((header + "".join(f"{code:06X}\t80C800\r\n" for code in codes)).encode("latin-1"))
    return path


def test_binary_data_of_both_channels(tmp_path: Path) -> None:
    hard = adi(tmp_path / "Binary Data.txt", [ZERO_CODE, 0x80F720, LAST_CODE])
    soft = adi(tmp_path / "soft.txt", [ZERO_CODE, 0x7FFFFF])
    out = tmp_path / "run.csv"
    result = run("convert", hard, "--soft", soft, "-o", out)
    assert result.exit_code == 0, result.stderr
    for told in ("rows are 0.062 s apart", "it is assumed", "3 and 2 rows", "3 temperatures left out"):
        assert told in result.stderr
    rows = block(out)
    assert rows["hard"].tolist() == [0.0, 0.030890625, capacitance_pF(LAST_CODE)]
    assert rows["status"].tolist() == [0, 0, int(Status.LOST)]
    assert rows["soft_raw"].tolist() == [ZERO_CODE, 0x7FFFFF, -1]
    assert rows["t_hard_ns"].tolist() == [0, 62_000_000, 124_000_000]
    document = load(out)
    assert document
    assert document["device"]["files"][0]["header"]["Conv. Time"] == "62.0 ms"


def test_binary_data_of_one_channel(tmp_path: Path) -> None:
    out = tmp_path / "run.csv"
    result = run("convert", adi(tmp_path / "hard.txt", [LAST_CODE, ZERO_CODE]), "-o", out)
    assert result.exit_code == 0
    assert "no file for the soft channel: every row is marked as lost" in result.stderr
    rows = block(out)
    assert rows["hard_raw"].tolist() == [LAST_CODE, ZERO_CODE]
    assert (rows["status"] == int(Status.LOST)).all()
    assert all(map(math.isnan, rows["soft"].tolist()))


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        (
            "Vdd: 5\n800000\t000000\n80000\t000000\n800000\t000000\n",
            4,
            "line 3: '80000\\t000000' is not a row of codes",
        ),
        ("Vdd: 5\n800000\t000000\nnonsense\n", 4, "line 3"),
        ("Vdd: 5\n800000\t000000\n", 2, "rate: got none"),
        ("Conv. Time: 62.0 ms\n", 2, "rate: got none"),
    ],
)
def test_binary_data_that_is_none(tmp_path: Path, text: str, code: int, message: str) -> None:
    path = tmp_path / "Binary Data.txt"
    path.write_text(text)
    result = run("convert", path, "--soft", path, "-o", tmp_path / "run.csv")
    assert result.exit_code == code
    assert message in result.stderr
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_codes_take_no_columns(tmp_path: Path) -> None:
    path = tmp_path / "Binary Data.txt"
    path.write_text("Conv. Time: 62.0 ms\n800000\t000000\n")
    result = run("convert", path, "--soft", path, "--unit", "fF", "-o", tmp_path / "run.csv")
    assert result.exit_code == 2
    assert "unit: got it for a file of codes, allowed: soft and rate" in result.stderr


def test_a_torn_last_row_of_codes_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "hard.txt"
    path.write_text("Conv. Time: 0,0110 s\n800000\t000000\n800001\t0000")
    result = run("convert", path, "-o", tmp_path / "run.csv")
    assert result.stdout.endswith(": 1 rows\n")
    assert "the last row is incomplete: left out" in result.stderr
    assert "rows are 0.011 s apart" in result.stderr


def test_nothing_is_replaced_unasked(own: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    side = tmp_path / "out.json"
    side.write_text("precious")
    result = run("convert", own, "-o", out)
    assert (result.exit_code, side.read_text(), out.exists()) == (4, "precious", False)
    assert "already exists: choose another name, or use --force" in result.stderr
    assert run("convert", own, "-o", out, "--force").exit_code == 0
    assert check(out).clean
    before = own.read_bytes()
    result = run("convert", own, "-o", own, "--force")
    assert (result.exit_code, own.read_bytes()) == (4, before)
    assert "is an input file" in result.stderr


def test_a_running_recording_is_not_replaced(own: Path, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "running.csv", {}, {}, [])
    recorder.push(sample(0))
    result = run("convert", own, "-o", recorder.path, "--force")
    assert (result.exit_code, "is still being recorded" in result.stderr) == (4, True)
    assert (
        "still being recorded: only the rows written until now"
        in run("convert", recorder.path, "-o", tmp_path / "c.csv").stderr
    )
    recorder.close()
    assert check(recorder.path).clean


def test_a_failure_leaves_nothing(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own.write_text(own.read_text() + "no row\n8,1,1,1,1,1,1,0\n")
    before = {p.name for p in tmp_path.iterdir()}
    for name in ("a.csv", "a.parquet"):
        assert run("convert", own, "-o", tmp_path / name).exit_code == 4
    assert run("convert", own, "-o", tmp_path / "nowhere" / "a.csv").exit_code == 4
    assert run("convert", own, "-o", tmp_path / "a.txt").exit_code == 2
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    result = run("convert", own, "-o", tmp_path / "a.parquet")
    assert (result.exit_code, "pip install 'palpate[export]'" in result.stderr) == (6, True)
    assert {p.name for p in tmp_path.iterdir()} == before


def test_the_touches_are_the_same(tmp_path: Path) -> None:
    path, out = tmp_path / "run.csv", tmp_path / "copy.csv"
    assert run("record", "sim:stiff-steady", "-o", path).exit_code == 0
    assert run("convert", path, "-o", out).exit_code == 0
    assert run("replay", out).stdout == run("replay", path).stdout
    assert palpate.read(out).hard.tobytes() == palpate.read(path).hard.tobytes()
