"""Random unplugging, replacing and moving of the board: no touch after a gap is wrong without a flag.

10,000 schedules in the nightly run; 300 by default.
"""

import os
from pathlib import Path

import palpate
import pytest
from effort import SEED, draws
from gap_plays import TOUCH_S, Play
from palpate import SourceError, Stream
from palpate.recording.foreign import recorded
from tally import Tally

COUNT = int(os.environ.get("PALPATE_GAPS", draws(120, 10_000)))
WORKERS = 6


@pytest.mark.parametrize("worker", range(WORKERS))
def test_a_touch_after_a_gap_is_right_or_has_a_flag(worker: int, tmp_path: Path, tally: Tally) -> None:
    for number in range(worker, COUNT, WORKERS):
        play, path = Play(SEED + number), tmp_path / f"{number}.csv"
        messages: list[str] = []
        failure: SourceError | None = None
        try:
            with Stream(play, record=path, seconds=TOUCH_S, notify=messages.append) as stream:
                for _ in stream.batches():
                    pass
        except SourceError as error:
            failure = error
        assert play.now_s < play.end_s + 60, f"schedule {number}: it hangs"
        assert failure is None, f"schedule {number}: {failure}"
        counters, driver = stream.counters, play.driver.counters
        assert counters.read == counters.delivered == counters.recorded
        last = stream._feeding.last
        assert last is not None
        assert counters.read + counters.lost == last.seq + 1 <= driver.pairs + driver.lost
        recording = recorded(path)
        replayed = palpate.touches(recording, seconds=TOUCH_S)
        assert [t.as_dict() for t in replayed] == [t.as_dict() for t in stream.touches], f"schedule {number}"
        in_memory = palpate.touches(palpate.read(path), seconds=TOUCH_S)
        assert [t.as_dict() for t in in_memory] == [t.as_dict() for t in stream.touches], f"schedule {number}"
        tally.count("schedules with gaps")
        if not recording.gap_marks:
            continue
        for touch in stream.touches:
            tally.count("touches beside gaps, " + ("with a flag" if touch.flags else "without a flag"))
            assert touch.flags or play.is_right(touch), f"schedule {number}: {touch}"
