"""A recording as a source: what is wrong with it reaches the user, and a copy of it."""

import time
from pathlib import Path

import numpy as np
import palpate
import pytest
from palpate import Status, Stream, check
from palpate.errors import RecordingError
from recording_bench import killed, measured, record, sample

CHANGED = "were changed after they were written"


def test_a_copy_of_changed_rows_says_so(tmp_path: Path) -> None:
    """All rows are in the copy, and its sidecar says what is wrong with them; read as a table they are not verified."""
    path, copy = (
        record(tmp_path / "run.csv", [sample(i) for i in range(300)]),
        tmp_path / "copy.csv",
    )
    path.write_bytes(path.read_bytes().replace(b"0.026000001", b"0.026000009"))
    stream = Stream(str(path), record=copy)
    with pytest.raises(RecordingError, match=CHANGED), stream:
        list(stream)
    report = check(copy)
    assert (report.survey.rows, report.faults) == (300, ())
    assert report.findings[0].startswith(
        f"the source ended with an error: {path}: the rows {CHANGED}"
    )
    notes = palpate.read(path, columns={"hard": "hard_pF", "soft": "soft_pF"}).notes
    assert notes[0].startswith(
        "a recording of palpate, read as a table of another program: its rows are not verified"
    )


def test_a_copy_of_a_killed_recording(tmp_path: Path) -> None:
    """What cannot be verified is reported; it is no error."""
    path, copy, said = killed(tmp_path / "run.csv", 300, 200), tmp_path / "copy.csv", list[str]()
    measured(str(path), record=copy, notify=said.append)
    assert [text for text in said if "the first 200 of 300 rows are verified" in text]
    assert check(copy).clean


@pytest.mark.parametrize("speed", [None, 10])
def test_a_file_that_is_not_read_to_its_end(tmp_path: Path, speed: float | None) -> None:
    """The checksum is compared at its end: stopped before, a change would not be noticed, and a message says so."""
    path, said = record(tmp_path / "run.csv", [sample(i) for i in range(5000)]), list[str]()
    with Stream(
        palpate.open(str(path), **({"speed": speed} if speed else {})), notify=said.append
    ) as stream:
        next(iter(stream))
    assert said == [f"{path}: not read to its end: its rows are not verified"]
    assert stream.counters.read == stream.counters.delivered < 5000
    stream = measured(str(path), notify=said.append)
    assert (len(said), stream.counters.read) == (1, 5000)


@pytest.mark.parametrize("cell", ["", "nan", "inf"])
@pytest.mark.parametrize("pace", ["", "?speed=1000"])
def test_a_row_without_a_value_is_lost(cell: str, pace: str, tmp_path: Path) -> None:
    rows = [f"{i * 0.026:.3f},{cell if i == 50 else 2.5 + i % 3 / 1000},1.5\n" for i in range(200)]
    (tmp_path / "t.csv").write_text("time_s,hard_pF,soft_pF\n" + "".join(rows))
    messages: list[str] = []
    with Stream(f"{tmp_path / 't.csv'}{pace}", notify=messages.append) as stream:
        found = [estimate.sample for estimate in stream]
    assert [sample.seq for sample in found if sample.status] == [50]
    assert found[50].status == Status.LOST
    assert not any("status" in message for message in messages)


def test_a_played_file_goes_on_where_it_was_when_the_machine_stood_still() -> None:
    """All that is due meanwhile at once would be more than waits for a consumer."""
    with palpate.open("tests/data/four-specimens.csv", speed=60) as source:
        blocks = (item for item in source if isinstance(item, np.ndarray))
        first = next(blocks)
        time.sleep(1.0)  # the whole recording
        second = next(blocks)
    assert len(first) + len(second) < 700
