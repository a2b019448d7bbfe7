"""Recordings that are removed, renamed, replaced or changed while they run: said, and nothing is lost that can be had."""

import os
import random
import re
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from disturbing import (
    ROWS,
    disturbed,
    extend,
    remove,
    remove_folder,
    rename,
    replace,
    rows_text,
    sidecar_is_a_folder,
    write_sidecar,
)
from effort import NIGHTLY
from palpate import RecordingError, Stream, check, read
from palpate.recording import sidecar
from palpate.recording.filelock import is_locked
from palpate.recording.rows import HEADER
from recording_bench import Scripted, sample
from recording_children import AT_ONCE, let_record
from tally import Tally

TIMES = 50 if NIGHTLY else 3

pytestmark = [
    pytest.mark.usefixtures("quick_recorder"),
    pytest.mark.skipif(os.name == "nt", reason="an open file cannot be removed or renamed on this system"),
]

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
    report, document = check(rescued), sidecar.load(rescued)
    assert document
    assert (report.clean, report.faults, report.survey.rows) == (True, (), recorder.rows)
    assert (report.rescued, list(report.findings)) == (True, document["notes"][1:])
    assert set(report.findings) <= set(read(rescued).notes)
    assert not is_locked(rescued)
    assert document["device"] == {"name": "x"}
    assert document["notes"][0] == "first"
    assert re.search(f"^rescued: .*{message}$", document["notes"][-1])
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
        first = f"{recorder.dropped} samples are missing before the first row"
        assert (first in report.findings) == (first in read(recorder.path).notes) == (left == 0 < recorder.dropped)
        tally.fault("file cut while it is recorded", recorder.rows, 0)


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
        acts[child](tmp_path / "all" / f"{child}.csv")
        when[child] = time.time()

    assert let_record("command", tmp_path / "all", seed, disturb, Path.exists) == [4] * AT_ONCE
    lasted: list[float] = []
    for child, act in enumerate(acts):
        path, told = tmp_path / "all" / f"{child}.rescued.csv", tmp_path / "all" / f"{child}.acknowledged"
        assert f"while it was recorded; what could be saved is in {path}" in told.read_text()
        lasted.append(told.stat().st_mtime - when[child])
        report, counters = check(path), (sidecar.load(path) or {})["end"]["counters"]
        assert report.clean
        assert counters["read"] == counters["recorded"] + counters["unrecorded"]
        assert report.survey.rows == counters["recorded"]
        assert counters["unrecorded"] == 0 or act is cut
        tally.fault(f"{act.__name__} a file while it is recorded", counters["read"], counters["unrecorded"])
    tally.say(f"a disturbed recording ends with an error within {max(lasted):.2f} s, {AT_ONCE} at once")
