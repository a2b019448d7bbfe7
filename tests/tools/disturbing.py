"""Disturbs a recording that runs: removes, renames, replaces, changes its files."""

import shutil
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from palpate.recording.recorder import Recorder
from palpate.recording.rows import HEADER, format_rows
from palpate.recording.sidecar import load
from palpate.samples import block_of
from recording_bench import sample
from recording_children import wait

ROWS = 200


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
    while not path.with_suffix(".json").is_dir():  # if the recorder writes it again at this very moment, again
        path.with_suffix(".json").unlink()
        with suppress(FileExistsError):
            path.with_suffix(".json").mkdir()


def disturbed(path: Path, act: Callable[[Path], None]) -> Recorder:
    """Record, let something happen, record until the recorder says so and some rows more; close."""
    recorder = Recorder(path, {"name": "x"}, {"scene": "paper"}, ["first"])
    for seq in range(ROWS):
        recorder.push(sample(seq))
    # With its checkpoint: from then on the recorder saves nothing until rows come.
    wait(lambda: ((load(path) or {}).get("checkpoint") or {}).get("rows") == ROWS)
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
