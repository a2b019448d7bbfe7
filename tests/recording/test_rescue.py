"""A rescue recording that cannot begin or fails is said; disks that fail, and other surroundings of a recorder."""

import errno
import os
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from disturbing import disturbed, remove, rename, rows_text
from palpate import RecordingError, check, read
from palpate.cli import main
from palpate.recording import rescue, sidecar
from palpate.recording.recorder import Recorder
from palpate.recording.rows import HEADER
from recording_bench import sample
from recording_children import wait

pytestmark = [
    pytest.mark.usefixtures("quick_recorder"),
    pytest.mark.skipif(os.name == "nt", reason="an open file cannot be removed or renamed on this system"),
]


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
    assert (sidecar.load(path) or {})["notes"] == ["first", sidecar.AGAIN]
    assert sidecar.AGAIN in read(path).notes
    assert check(path).findings == (sidecar.AGAIN,)


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


def test_a_disk_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was synced stays on that disk; what came since then is in memory, and is saved."""
    monkeypatch.setattr(rescue, "_chunks", lambda _: [])
    monkeypatch.setattr(rescue, "_whole_rows", lambda _: [])
    recorder = disturbed(tmp_path / "run" / "run.csv", rename)
    assert recorder.dropped > 0
    assert rows_text(recorder.rows + recorder.dropped).endswith(recorder.path.read_bytes()[len(HEADER) :])
    document = sidecar.load(recorder.path) or {}
    assert document["end"]["dropped"] == recorder.dropped
    assert document["notes"][-1].startswith(f"rescued: {recorder.dropped} rows are missing: ")
    report, notes = check(recorder.path), read(recorder.path).notes
    for told in (document["notes"][-1], f"{recorder.dropped} samples are missing before the first row"):
        assert told in report.findings
        assert told in notes
    assert f"{recorder.dropped} samples were read, but are not in the file" in report.findings
    result = CliRunner().invoke(main, ["check", str(recorder.path)])
    assert result.exit_code == 5
    assert f": rescued: {recorder.rows} rows" in result.stdout


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
        wait(rescued.with_suffix(".json").exists)  # made after it
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
