"""Recordings that are removed, renamed, replaced or changed while they run: said, and nothing is lost that can be had."""

import errno
import os
import random
import re
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from effort import NIGHTLY
from palpate import RecordingError, Stream, check, read
from palpate.recording import recorder as recorder_module
from palpate.recording import rescue, sidecar
from palpate.recording.filelock import is_locked
from palpate.recording.recorder import Recorder
from palpate.recording.rows import HEADER, format_rows
from palpate.recording.sidecar_file import AGAIN
from palpate.samples import block_of
from recording_bench import Scripted, sample
from recording_children import AT_ONCE, let_record
from tally import Tally

TIMES = 50 if NIGHTLY else 3
ROWS = 200

pytestmark = pytest.mark.skipif(os.name == "nt", reason="an open file cannot be removed or renamed on this system")


@pytest.fixture(autouse=True)
def fast(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Sync often, and keep temporary files apart."""
    monkeypatch.setattr(recorder_module, "SYNC_S", 0.02)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    (tmp_path / "temporary").mkdir()
    (tmp_path / "run").mkdir()


def wait(ready: Callable[[], object]) -> None:
    until = time.monotonic() + 30
    while not ready():
        assert time.monotonic() < until
        time.sleep(0.002)


def rows_text(count: int) -> bytes:
    return HEADER.encode() + format_rows(block_of([sample(seq) for seq in range(count)]))


def remove(path: Path) -> None:
    path.unlink()


def rename(path: Path) -> None:
    path.rename(path.with_name("other.csv"))


def replace(path: Path) -> None:
    other = path.with_name("other")
    other.write_text("precious\n")
    other.rename(path)


def extend(path: Path) -> None:
    with path.open("a") as file:
        file.write("precious\n")


def remove_folder(path: Path) -> None:
    away = path.parent.rename(path.parent.with_name("away"))
    shutil.rmtree(away)


def write_sidecar(path: Path) -> None:
    other = path.with_suffix(".json")
    while other.read_text() != "precious\n":  # if the recorder replaces it at this very moment, again
        other.write_text("precious\n")
        time.sleep(0.1)


def sidecar_is_a_folder(path: Path) -> None:
    path.with_suffix(".json").unlink()
    path.with_suffix(".json").mkdir()


DISTURBANCES = [
    (remove, "run.csv: was removed while it was recorded"),
    (rename, r"run.csv: was (renamed to \S+other.csv|removed, renamed or moved) while it was recorded"),
    (replace, "run.csv: was replaced by another file while it was recorded"),
    (extend, r"run.csv: was extended by another program, from \d+ bytes to \d+, while it was recorded"),
    (
        remove_folder,
        r"run.csv: was (removed|renamed to \S+away/run.csv|removed, renamed or moved) while it was recorded",
    ),
    (write_sidecar, "run.json: was changed by another program while it was recorded"),
    (sidecar_is_a_folder, "run.json: was changed by another program while it was recorded"),
]


def disturbed(path: Path, act: Callable[[Path], None]) -> Recorder:
    """Record, let something happen, record until the recorder says so and some rows more; close."""
    recorder = Recorder(path, {"name": "x"}, {"scene": "paper"}, ["first"])
    for seq in range(ROWS):
        recorder.push(sample(seq))
    wait(lambda: recorder.rows == ROWS)
    act(path)
    seq, until = ROWS, time.monotonic() + 30
    while not recorder.error:
        assert time.monotonic() < until
        recorder.push(sample(seq))
        time.sleep(0.002)
        seq += 1
    recorder.mark("behind it", sample(seq - 1))
    for last in range(seq, seq + 10):
        recorder.push(sample(last))
    recorder.close()
    assert recorder.rows + recorder.dropped == seq + 10
    return recorder


@pytest.mark.parametrize(("act", "message"), DISTURBANCES)
def test_all_rows_are_in_the_rescue_recording(tmp_path: Path, act: Callable[[Path], None], message: str) -> None:
    path = tmp_path / "run" / "run.csv"
    recorder = disturbed(path, act)
    rescued = recorder.path
    assert re.search(f"{message}; what could be saved is in {rescued}$", str(recorder.error))
    beside = rescued.parent == path.parent
    assert beside == (act is not remove_folder)
    assert rescued.name == "run.rescued.csv"
    assert rescued.read_bytes() == rows_text(recorder.rows)
    assert recorder.dropped == 0
    report = check(rescued)
    assert (report.clean, report.faults, report.survey.rows) == (True, (), recorder.rows)
    assert not is_locked(rescued)
    document = sidecar.load(rescued)
    assert document
    assert document["device"] == {"name": "x"}
    assert document["notes"][0] == "first"
    assert re.search(f"^rescued: .*{message}$", document["notes"][1])
    assert [mark["text"] for mark in document["marks"]] == ["behind it"]
    assert "error" not in document["end"]


@pytest.mark.parametrize("act", [remove, rename, replace, extend])
def test_the_first_sidecar_says_where_the_rows_are(tmp_path: Path, act: Callable[[Path], None]) -> None:
    path = tmp_path / "run" / "run.csv"
    recorder = disturbed(path, act)
    end = (sidecar.load(path) or {})["end"]
    assert end["clean"] is False
    assert end["error"].endswith(f"while it was recorded; see {recorder.path}")
    if act in (replace, extend):
        assert "precious\n" in path.read_text()
    if act is rename:
        assert path.with_name("other.csv").read_bytes() == rows_text(end["rows"])


@pytest.mark.parametrize("act", [write_sidecar, sidecar_is_a_folder])
def test_the_sidecar_of_another_program_is_left(tmp_path: Path, act: Callable[[Path], None]) -> None:
    path = tmp_path / "run" / "run.csv"
    disturbed(path, act)
    other = path.with_suffix(".json")
    assert list(other.iterdir()) == [] if other.is_dir() else other.read_text() == "precious\n"
    assert path.read_bytes().startswith(rows_text(ROWS))


def test_a_cut_file_loses_only_what_was_cut(tmp_path: Path, tally: Tally) -> None:
    """Of the rows up to the last sync those that are left, and all rows since then."""
    chance = random.Random(17)
    for number in range(TIMES):
        size = chance.randrange(len(rows_text(ROWS)))
        path = tmp_path / "run" / f"{number}.csv"
        recorder = disturbed(path, lambda path, size=size: os.truncate(path, size))  # type: ignore[misc]
        whole = rows_text(ROWS)[:size].rfind(b"\n") + 1
        left = max(rows_text(ROWS)[:whole].count(b"\n") - 1, 0)
        assert re.search(r"was cut by another program, from \d+ bytes to \d+, while", str(recorder.error))
        rows = recorder.path.read_bytes()
        everything = rows_text(recorder.rows + recorder.dropped)
        assert rows[: len(HEADER)].decode() == HEADER
        kept = rows[: len(rows_text(left))]
        assert kept == rows_text(left)
        assert everything.endswith(rows[len(kept) :])  # those behind the gap, without another one
        assert recorder.dropped <= ROWS - left
        report = check(recorder.path)
        assert report.clean
        assert report.survey.lost == recorder.dropped or left == 0
        tally.fault("file cut while it is recorded", recorder.rows, 0)


def test_a_second_rescue_overwrites_nothing(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    for name in ("run.rescued.csv", "run.rescued-2.json"):
        (folder / name).write_text("precious")
    assert disturbed(folder / "run.csv", remove).path.name == "run.rescued-3.csv"
    assert sorted(file.name for file in folder.iterdir()) == [
        "run.json",
        "run.rescued-2.json",
        "run.rescued-3.csv",
        "run.rescued-3.json",
        "run.rescued.csv",
    ]


def test_a_sidecar_that_is_removed_is_written_again(tmp_path: Path) -> None:
    path = tmp_path / "run" / "run.csv"
    recorder = Recorder(path, {}, {}, ["first"])
    path.with_suffix(".json").unlink()
    recorder.push(sample(0))
    wait(path.with_suffix(".json").exists)
    recorder.close()
    assert recorder.error is None
    assert check(path).clean
    assert (sidecar.load(path) or {})["notes"] == ["first", AGAIN]


def fail(number: int) -> Callable[..., Any]:
    def call(*_: Any) -> None:
        raise OSError(number, os.strerror(number))

    return call


def test_a_disk_that_fails_to_sync(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The rows since the last sync are in memory: they are written elsewhere."""
    sync, broken = os.fsync, [errno.EIO]

    def fdatasync(descriptor: int) -> None:
        if broken:
            number = broken.pop()
            raise OSError(number, os.strerror(number))
        sync(descriptor)

    def unplug(_: Path) -> None:
        monkeypatch.setattr(os, "fdatasync", fdatasync, raising=False)

    recorder = disturbed(tmp_path / "run" / "run.csv", unplug)
    assert "run.csv: cannot be written: Input/output error; what could be saved is in" in str(recorder.error)
    assert recorder.path.read_bytes() == rows_text(recorder.rows)
    assert recorder.dropped == 0


def test_a_rescue_that_cannot_begin_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rescue, "RowFile", fail(errno.EROFS))
    recorder = disturbed(tmp_path / "run" / "run.csv", rename)
    assert re.search("renamed .*; no rescue recording could be made: .*Read-only file system", str(recorder.error))
    assert recorder.dropped > 0
    end = (sidecar.load(tmp_path / "run" / "run.csv") or {})["end"]
    assert (end["clean"], end["dropped"], end["error"]) == (False, recorder.dropped, str(recorder.error))


def test_a_rescue_that_fails_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rescue, "fill", fail(errno.ENOSPC))
    with pytest.raises(RecordingError, match=r"was removed .*run.rescued.csv, but not all: .*No space left on device"):
        disturbed(tmp_path / "run" / "run.csv", remove)


def test_a_rescue_that_is_disturbed_is_said(tmp_path: Path) -> None:
    path = tmp_path / "run" / "run.csv"

    def act(path: Path) -> None:
        path.unlink()
        rescued = path.with_name("run.rescued.csv")
        wait(rescued.exists)
        rescued.unlink()

    with pytest.raises(RecordingError, match=r"run.csv: was removed .*, but not all: \S+run.rescued.csv: was removed"):
        disturbed(path, act)


def test_another_working_folder_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path / "run")
    recorder = Recorder("run.csv", {}, {}, [])
    monkeypatch.chdir(tmp_path)
    recorder.push(sample(0))
    wait(lambda: recorder.rows)
    time.sleep(0.1)
    recorder.close()
    assert recorder.error is None
    assert check(tmp_path / "run" / "run.csv").clean


def test_a_stream_ends_with_the_error_and_its_numbers_agree(tmp_path: Path) -> None:
    path = tmp_path / "run" / "run.csv"
    source = Scripted([sample(seq) for seq in range(100_000)])
    source.before = lambda given: path.unlink() if given.seq == 5000 else None
    with (
        pytest.raises(RecordingError, match="was removed while it was recorded"),
        Stream(source, record=path) as stream,
    ):
        for _ in stream:
            pass
    counters = stream.counters
    assert counters.read == counters.recorded + counters.unrecorded == counters.delivered
    assert counters.unrecorded == 0
    assert stream.recorder
    assert len(read(stream.recorder.path).hard) == counters.recorded < 100_000


def cut(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no forks on this system")
@pytest.mark.parametrize("seed", range(20 if NIGHTLY else 1))
def test_the_command_ends_with_an_error(tmp_path: Path, seed: int, tally: Tally) -> None:
    """Exit code 4; every row that was read is in the rescue recording, but those that were cut off."""
    acts = [[remove, rename, replace, cut][(seed + child) % 4] for child in range(AT_ONCE)]
    when: dict[int, float] = {}

    def disturb(child: int, _: int) -> None:
        path = tmp_path / "all" / f"{child}.csv"
        wait(path.exists)
        acts[child](path)
        when[child] = time.time()

    assert let_record("command", tmp_path / "all", seed, disturb, 2.5) == [4] * AT_ONCE
    for child, act in enumerate(acts):
        path, told = tmp_path / "all" / f"{child}.rescued.csv", tmp_path / "all" / f"{child}.acknowledged"
        assert f"while it was recorded; what could be saved is in {path}" in told.read_text()
        tally.note("time from a disturbance to the end of the command, s", told.stat().st_mtime - when[child])
        report, counters = check(path), (sidecar.load(path) or {})["end"]["counters"]
        assert report.clean
        assert counters["read"] == counters["recorded"] + counters["unrecorded"]
        assert report.survey.rows == counters["recorded"]
        assert counters["unrecorded"] == 0 or act is cut
        tally.fault(f"{act.__name__} a file while it is recorded", counters["read"], counters["unrecorded"])
