"""Recordings whose files are removed, renamed, replaced or changed while they run: an error within 2 s, no file overwritten."""

import os
import re
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest
from palpate import RecordingError, check
from palpate.recording import recorder as recorder_module
from palpate.recording.recorder import Recorder
from palpate.recording.sidecar import load
from recording_bench import sample, soon

pytestmark = pytest.mark.skipif(os.name == "nt", reason="an open file cannot be removed or renamed on this system")
ROWS = 200


GONE, CHANGED = "was removed, renamed or moved", r"was changed by another program, from \d+ bytes to \d+,"


def replace(path: Path) -> None:
    path.with_name("other").write_text("precious\n")
    path.with_name("other").rename(path)


def extend(path: Path) -> None:
    with path.open("a") as file:
        file.write("precious\n")


def write_sidecar(path: Path) -> None:
    while path.with_suffix(".json").read_text() != "precious\n":  # the recorder may replace it at this very moment
        path.with_suffix(".json").write_text("precious\n")
        time.sleep(0.1)


DISTURBANCES: list[tuple[Callable[[Path], None], str]] = [
    (Path.unlink, f"run.csv: {GONE}"),
    (replace, "run.csv: was replaced by another file"),
    (extend, f"run.csv: {CHANGED}"),
    (write_sidecar, "run.json: was changed by another program"),
]


@pytest.mark.parametrize(("act", "message"), DISTURBANCES)
def test_it_is_an_error_within_2_s(
    tmp_path: Path, act: Callable[[Path], None], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "SYNC_S", 0.02)
    path = tmp_path / "run" / "run.csv"
    path.parent.mkdir()
    recorder = Recorder(path, {"name": "x"}, {}, ["first"])
    for seq in range(ROWS):
        recorder.push(sample(seq))
    soon(lambda: ((load(path) or {}).get("checkpoint") or {}).get("rows") == ROWS)
    act(path)
    seq, begun = ROWS, time.monotonic()
    while not recorder.error:
        assert time.monotonic() < begun + 2 * 10  # ten times that on a machine that is shared
        recorder.push(sample(seq))
        time.sleep(0.002)
        seq += 1
    assert re.search(f"{message} while it was recorded$", str(recorder.error))
    with suppress(RecordingError):  # the sidecar of another program, or a folder that is gone
        recorder.close()
    assert recorder.rows + recorder.dropped == seq
    if act in (Path.unlink, replace, extend):
        end = (load(path) or {})["end"]
        assert (end["clean"], end["error"]) == (False, str(recorder.error))
    if act in (replace, extend, write_sidecar):
        assert "precious\n" in path.with_suffix(".json" if act is write_sidecar else ".csv").read_text()
    if act is write_sidecar:
        assert check(path).survey.rows >= ROWS


def test_a_removed_sidecar_is_written_again(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    recorder = Recorder(path, {}, {}, ["first"])
    path.with_suffix(".json").unlink()
    recorder.note("second")
    recorder.close()
    assert (load(path) or {})["notes"] == ["first", "second"]
    assert check(path).clean
