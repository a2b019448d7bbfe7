"""Disks and files that fail: no acknowledged row is lost, no torn one is data, and `check` says what happened."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from fault_table import FILES
from palpate import Sample, Stream, check, read
from palpate.cli import main
from palpate.recording.rows import HEADER
from project import ROOT, need
from recording_bench import Scripted, record, sample
from tally import Tally

LAST = 200  # bytes
_ACKNOWLEDGING = """
import itertools, json, resource, sys, time
from palpate import PalpateError, Sample, Source
from palpate.stream import Stream

class Endless(Source):
    def describe(self):
        return {"name": "endless"}

    def __iter__(self):
        recorder = stream.recorder
        for seq in itertools.count():
            while recorder.rows < seq - 24 and not recorder.error:
                time.sleep(0.001)
            yield Sample(seq, seq * 26_000_000, seq * 26_000_000, -1, -1, 1.5, 2.5)

if limit := int(sys.argv[2]):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
rows, stream = 0, None
try:
    stream = Stream(Endless(), record=sys.argv[1])
    with stream:
        for _ in stream:
            rows = stream.recorder.rows
except PalpateError as error:
    print(json.dumps({"error": str(error), "rows": rows, "counters": stream and stream.counters.as_dict()}))
"""


def told(path: Path) -> str:
    """Return what `palpate check` prints of a recording that is not whole."""
    result = CliRunner().invoke(main, ["check", str(path)])
    assert result.exit_code == 4
    return result.stdout + result.stderr


@pytest.mark.parametrize("ended", [True, False])
def test_cut_at_every_byte_of_its_end(tmp_path: Path, ended: bool, tally: Tally) -> None:
    """What is read is what had been written up to there, and of the row that was hit nothing."""
    whole = record(tmp_path / "whole.csv", [sample(i) for i in range(40)], end=ended)
    data, values = whole.read_bytes(), read(whole).hard.tolist()
    cut = tmp_path / "cut.csv"
    shutil.copy(whole.with_suffix(".json"), cut.with_suffix(".json"))
    for size in range(len(data) - LAST, len(data)):
        cut.write_bytes(data[:size])
        rows = data[: size + 1].count(b"\n") - 1  # a row that lacks its line end only is whole
        report = check(cut)
        assert report.clean is False
        assert report.faults
        assert report.survey.rows == rows
        assert read(cut).hard.tolist() == values[:rows]
        tally.fault(f"cut at a byte of its last {LAST}, {'ended' if ended else 'not ended'}", rows, 0)
    assert f"{'changed' if ended else 'not complete'}: {rows} rows" in told(cut)  # the last line end alone


def acknowledge(path: Path, limit: int, *before: str) -> dict[str, object]:
    """Record in a process of its own, until an error ends it; return what it printed.

    Its source waits for the disk: a slow machine only takes longer.
    """
    command = [*before, sys.executable, "-c", _ACKNOWLEDGING, str(path), str(limit)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    said = json.loads(done.stdout)
    assert isinstance(said, dict)
    return said


def look_at_full(path: Path, said: dict[str, object], what: str, tally: Tally) -> None:
    """See that what was acknowledged is there, and that check tells why there is no more."""
    counters = said["counters"]
    assert isinstance(counters, dict)
    rows = check(path).survey.rows
    assert rows >= int(str(said["rows"])) > 0
    assert counters["read"] == counters["recorded"] + counters["unrecorded"] == counters["delivered"]
    assert counters["unrecorded"] > 0
    assert rows == counters["recorded"]
    assert not path.with_name(path.stem + ".json.new").exists()
    assert "not complete" in told(path)
    tally.fault(what, rows, counters["recorded"] - rows)


def test_a_file_that_may_not_grow(tmp_path: Path, tally: Tally) -> None:
    pytest.importorskip("resource")
    for limit in (3000, 8191, 20_000):
        path = tmp_path / f"{limit}.csv"
        said = acknowledge(path, limit)
        assert "cannot be written: File too large" in str(said["error"])
        look_at_full(path, said, "file may not grow (RLIMIT_FSIZE)", tally)
        assert "the recorder stopped with an error" in told(path)


def test_a_full_disk(tmp_path: Path, tally: Tally) -> None:
    """A small file system of the process's own; what is on it is copied out at the end."""
    unshare, disk = need("unshare"), tmp_path / "disk"
    disk.mkdir()
    for blocks in (3, 4, 6):
        kept = tmp_path / f"{blocks}"
        script = (
            f'mount -t tmpfs -o size={4 * blocks}k tmpfs "{disk}" && shift && "$@"; code=$?; '
            f'rm -rf "{kept}"; cp -r "{disk}" "{kept}"; exit $code'
        )
        inside = [unshare, "--map-root-user", "--mount", "sh", "-c", script, "sh", "--"]
        said = acknowledge(disk / "run.csv", 0, *inside)
        assert "No space left on device" in str(said["error"])
        look_at_full(kept / "run.csv", said, "disk full (tmpfs)", tally)


def test_a_disk_with_no_room_at_all(tmp_path: Path, tally: Tally) -> None:
    pytest.importorskip("resource")
    said = acknowledge(tmp_path / "run.csv", 10)
    assert "cannot be written: File too large" in str(said["error"])
    assert list(tmp_path.iterdir()) == []
    tally.fault("no room for the first byte", 0, 0)


def test_a_folder_that_is_read_only(tmp_path: Path, tally: Tally) -> None:
    """Said before anything is measured; root may write anywhere, so a file system is mounted read-only for it."""
    folder = tmp_path / "fixed"
    folder.mkdir()
    folder.chmod(0o555)
    script = f'mount --bind "{folder}" "{folder}" && mount -o remount,ro,bind "{folder}" && shift && "$@"'
    inside = [need("unshare"), "--map-root-user", "--mount", "sh", "-c", script, "sh", "--"]
    command = [*inside, sys.executable, "-m", "palpate", "record", "sim:", "-o", str(folder / "run.csv")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 4, done.stderr
    assert "cannot be written: " in done.stderr
    assert list(folder.iterdir()) == []
    tally.fault("folder is read-only", 0, 0)


@pytest.mark.parametrize("back_s", [1e-8, 0.02, 5.0, 1e6])
def test_a_clock_that_jumps_back(tmp_path: Path, back_s: float, tally: Tally) -> None:
    rows: list[Sample | Exception] = [sample(i) for i in range(50)]
    back = round(back_s * 1e9) + 26_000_000
    rows += [sample(i)._replace(t_hard_ns=sample(i).t_hard_ns - back) for i in range(50, 100)]
    path = tmp_path / "run.csv"
    with Stream(Scripted(rows, period_s=0.026), record=path) as stream:
        assert [estimate.sample for estimate in stream] == rows
    report = check(path)
    assert report.survey.rows == 100
    assert "time goes back at 1 rows" in report.faults
    assert "time goes back at 1 rows" in told(path)
    tally.fault("clock jumps back", 100, 100 - report.survey.rows)


def test_a_sidecar_that_is_missing_or_of_another_recording(tmp_path: Path, tally: Tally) -> None:
    longer = record(tmp_path / "longer.csv", [sample(i) for i in range(120)])
    open_end = record(tmp_path / "open.csv", [sample(i) for i in range(120)], end=False)
    other = record(tmp_path / "other.csv", [sample(i + 1) for i in range(100)])
    for name, side, message in (
        ("missing", None, "no valid sidecar"),
        ("of a longer one", longer, "100 rows in the file, but 120 were written"),
        ("of one without an end", open_end, "no end in the sidecar"),
        ("of another of this length", other, "the sidecar belongs to another recording"),
    ):
        path = record(tmp_path / f"{name}.csv", [sample(i) for i in range(100)])
        path.with_suffix(".json").unlink(missing_ok=True)
        if side:
            shutil.copy(side.with_suffix(".json"), path.with_suffix(".json"))
        report = check(path)
        assert not report.clean
        assert message in told(path)
        assert len(read(path).hard) == 100
        tally.fault(f"sidecar {name}", 100, 100 - report.survey.rows)


def test_a_row_that_was_changed_is_said(tmp_path: Path) -> None:
    path = record(tmp_path / "run.csv", [sample(i) for i in range(100)])
    data = path.read_text()
    path.write_text(data.replace(",0.0,0\n", ",0.5,0\n", 1) if ",0.0,0\n" in data else data.replace("7", "8", 1))
    assert "the rows were changed" in told(path)
    assert path.read_text().startswith(HEADER)


def test_the_table_has_a_command() -> None:
    assert {Path(name).name for name in FILES} >= {"test_killed.py", Path(__file__).name, "test_stream_load.py"}
    assert all((ROOT / "tests" / name).is_file() for name in FILES)
    assert os.environ.get("PALPATE_MOMENTS", "50").isdecimal()
