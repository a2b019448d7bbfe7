"""`palpate convert` and `palpate import`: nothing is lost; what is not taken over or is left open is reported."""

import json
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from command_lines import document, run
from foreign_files import measurement
from palpate import Status, check, files, recorded
from palpate.recording import convert
from palpate.recording.csv_reader import RecordingFile
from palpate.recording.recorder import Recorder
from palpate.recording.sidecar import load
from palpate.samples import Block
from pyarrow import parquet
from recording_bench import killed, record, sample

from bench.soak.memory import written


def block(path: Path) -> Block:
    return np.concatenate(list(RecordingFile(path).blocks()))


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """Gaps, a lost sample, a saturated one."""
    bad = [sample(9, status=Status.LOST), sample(10, status=Status.HARD_SATURATED)]
    return record(
        tmp_path / "own.csv",
        [*map(sample, (0, 1, 2, 7, 8)), *bad],
        name="script",
        full_scale_pF=4.0,
    )


def test_parquet_has_units_and_the_sidecar(own: Path, tmp_path: Path) -> None:
    out = tmp_path / "own.parquet"
    result = run("convert", own, "-o", out)
    assert (result.exit_code, result.stdout) == (0, f"{out}: 7 rows\n")
    assert "1 of 7 rows have no usable value: kept, marked as lost" in result.stderr
    schema = parquet.read_table(out).schema
    assert schema.names[:4] == ["seq", "t_hard_ns", "t_soft_ns", "hard_raw"]
    assert [schema.field(name).metadata[b"unit"] for name in ("hard_pF", "t_soft_ns")] == [
        b"pF",
        b"ns",
    ]
    made, known = json.loads(parquet.read_metadata(out).metadata[b"palpate"]), load(own) or {}
    assert [made[name] == known[name] for name in ("device", "started", "versions", "end")] == [
        True
    ] * 4
    assert made["notes"][-1].startswith("converted from own.csv by palpate ")


def test_parquet_is_written_by_groups_of_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recording of a day needs the memory of one group; the rows and their seal are the same."""
    monkeypatch.setattr(convert, "GROUP", 8192)
    path, out = tmp_path / "long.csv", tmp_path / "long.parquet"
    rows = written(path, hours=1.0)
    tracemalloc.start()
    assert convert.convert(recorded(path), out) == rows
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    metadata = parquet.read_metadata(out)
    sizes = [metadata.row_group(number).num_rows for number in range(metadata.num_row_groups)]
    assert sum(sizes) == rows
    assert max(sizes) <= 8192
    assert len(sizes) >= rows // 8192
    assert peak < path.stat().st_size, "the whole text alone has this size"
    back = tmp_path / "back.csv"
    assert run("convert", out, "-o", back).exit_code == 0
    assert back.read_bytes() == path.read_bytes()
    assert check(back).clean


def test_a_recording_and_its_sidecar_are_both_written_or_none(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = set(tmp_path.iterdir())
    replace = files.replace

    def failing(path: Path, target: Path) -> None:
        if target.suffix == ".json":
            raise OSError(28, "No space left on device", str(target))
        replace(path, target)

    monkeypatch.setattr("palpate.files.replace", failing)
    result = run("convert", own, "-o", tmp_path / "new.csv")
    assert (result.exit_code, set(tmp_path.iterdir())) == (4, before)
    assert "No space left on device" in result.stderr


def test_a_torn_and_endless_recording_says_so(tmp_path: Path) -> None:
    path = killed(tmp_path / "torn.csv", 99, 99, torn=50)
    result = run("convert", path, "-o", tmp_path / "whole.csv")
    assert (result.exit_code, result.stdout) == (5, f"{tmp_path / 'whole.csv'}: 99 rows\n")
    assert "the last row is cut off: its " in result.stderr
    assert check(tmp_path / "whole.csv").repaired


TABLE = "time (s),C hard (fF),C soft (fF),T (C)\n" + "".join(
    f"{i * 0.03:.2f},{100 * i},{'OL' if i == 3 else 50 * i},21\n" for i in range(6)
)


def test_another_loggers_table(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(TABLE)
    out = tmp_path / "run.csv"
    result = run(
        "convert", tmp_path / "t.csv", "--map", "hard=C hard,soft=C soft", "-o", out, "--json"
    )
    assert result.exit_code == 0, result.stderr
    made = json.loads(result.stdout)
    assert (made["rows"], made["lost"], "columns left out: T (C)" in made["notes"]) == (6, 1, True)
    assert "columns left out: T (C)" in result.stderr
    rows = block(out)
    assert rows["hard"].tolist() == pytest.approx([0.1 * i for i in range(6)])
    assert rows["t_soft_ns"].tolist() == [30_000_000 * i for i in range(6)]
    assert rows["status"].tolist() == [0, 0, 0, int(Status.LOST), 0, 0]
    assert check(out).clean


def test_times_are_not_invented(tmp_path: Path) -> None:
    path, out = tmp_path / "t.csv", tmp_path / "run.csv"
    path.write_text("hard,soft\n" + "1,2\n" * 5)
    words = ("convert", path, "--map", "hard=1,soft=2", "--unit", "pF", "-o", out)
    result = run(*words)
    assert (result.exit_code, "rate: got none" in result.stderr) == (2, True)
    assert not out.exists()
    assert run(*words, "--rate", "40").exit_code == 0
    assert block(out)["t_hard_ns"].tolist() == [25_000_000 * i for i in range(5)]
    path.write_text(TABLE)
    result = run(
        "convert", path, "--map", "hard=2,soft=3", "-o", tmp_path / "b.csv", "--rate", "40"
    )
    assert (
        result.exit_code,
        "the times of the file are not used: a rate was given" in result.stderr,
    ) == (0, True)


def test_a_running_recording_is_not_replaced(own: Path, tmp_path: Path) -> None:
    recorder = Recorder(tmp_path / "running.csv", {}, {}, [])
    recorder.push(sample(0))
    result = run("convert", own, "-o", recorder.path, "--force")
    assert (result.exit_code, "is still being recorded" in result.stderr) == (4, True)
    result = run("convert", recorder.path, "-o", tmp_path / "c.csv")
    assert "still being recorded: only the rows written until now" in result.stderr
    recorder.close()
    assert check(recorder.path).clean


def test_nothing_is_replaced_unasked_and_a_copy_is_equal(own: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.csv"
    out.with_suffix(".json").write_text("precious")  # the sidecar is an output, too
    result = run("convert", own, "-o", out)
    assert (result.exit_code, out.with_suffix(".json").read_text(), out.exists()) == (
        4,
        "precious",
        False,
    )
    assert run("convert", own, "-o", out, "--force").exit_code == 0
    assert (check(out).clean, out.read_bytes()) == (True, own.read_bytes())


def test_a_failure_leaves_nothing(own: Path, tmp_path: Path) -> None:
    own.write_text(own.read_text() + "no row\n8,1,1,1,1,1,1,0\n")
    before = {p.name for p in tmp_path.iterdir()}
    for name, code in {"a.csv": 4, "a.parquet": 4, "a.txt": 2}.items():
        assert run("convert", own, "-o", tmp_path / name).exit_code == code
    assert {p.name for p in tmp_path.iterdir()} == before


def test_import_shows_what_is_understood_and_what_is_open(own: Path, tmp_path: Path) -> None:
    path = tmp_path / "other.csv"
    rows = zip(*measurement(), strict=True)
    path.write_text(
        "t (s);A;B\n" + "".join(f"{t:.4f};{1e3 * h:.3f};{1e3 * s:.3f}\n" for t, h, s in rows)
    )
    both = ("--map", "hard=2,soft=3")
    cases: dict[tuple[str, ...], tuple[int, str]] = {
        (): (2, r"    2  A      6900\.(.|\n)*columns: got none"),
        both: (2, "unit: got none"),
        ("--map", "hard=3,soft=2", "--unit", "fF"): (
            0,
            r"\nswapped: the soft channel changed more (.|\n)*\n2 touches",
        ),
        (*both, "--unit", "fF"): (
            0,
            r"hard = A, fF; soft = B, fF; 38.4 pairs .*; 880 rows\n2 touches: ratio 2.0",
        ),
    }
    for options, (code, message) in cases.items():
        result = run("import", path, *options)
        assert (result.exit_code, bool(re.search(message, result.output))) == (code, True), (
            result.output
        )
    options = document("import", path, *both, "--unit", "fF")["asked"]
    assert options == {"columns": {"hard": "2", "soft": "3"}, "unit": "fF"}
    assert run("import", own).exit_code == 2
