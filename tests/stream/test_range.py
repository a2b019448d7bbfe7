"""A channel that is outside the range of the converter without a touch: a message says so, and the range can be set again."""

from pathlib import Path
from typing import Any

import palpate
import pytest
from command_lines import run
from palpate import Stream
from palpate.recording.reading import recorded
from palpate.stream import stream as stream_module
from recording_bench import Scripted, four, measured, sample


def jumped(jump_pF: float, at: int = 400) -> list[Any]:
    """Return idle samples of which the hard channel is saturated from one on."""
    rows = [
        sample(i)._replace(hard_raw=-1, soft_raw=-1, hard=idle.hard, soft=idle.soft)
        for i, idle in enumerate(four()[:60] * 13)
    ]
    return [row._replace(hard=row.hard + jump_pF) if row.seq >= at else row for row in rows]


def test_a_channel_that_leaves_the_range_without_a_touch_is_told_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(stream_module, "_BATCH", 100)
    messages: list[str] = []
    with Stream(Scripted(jumped(6.0), full_scale_pF=4.0), notify=messages.append) as stream:
        outside = [stream.out_of_range for _ in stream.batches()]
    assert outside[0] == ()
    assert outside[-1] == ("hard",)
    assert [message[:50] for message in messages] == [
        "hard: outside the range of the converter for 2 s, "
    ]
    stream = measured(Scripted(jumped(6.0, at=750), full_scale_pF=4.0), notify=messages.append)
    assert (stream.out_of_range, len(messages)) == ((), 1)  # 1.3 s


def test_the_range_is_set_again_on_request(tmp_path: Path) -> None:
    """`record --recentre` does it by itself; without, the signal is outside to the end, and a message says so."""
    path = tmp_path / "run.csv"
    fault = "sim:four-specimens?seed=1&fault=overload:5@9.5"
    result = run("record", fault, "-o", path, "--recentre")
    assert result.exit_code == 0
    assert "outside the range of the converter for 2 s" in result.stderr
    [(_, text)] = recorded(path).gap_marks
    assert text.startswith("the range was set again: CAPDAC (7")
    assert text.endswith(", before (41, 27)")
    found = palpate.touches(recorded(path))
    assert [round(touch.start_s) for touch in found][-2:] == [20, 29]
    left = run("record", fault, "-o", tmp_path / "left.csv")
    assert "record --recentre" in left.stderr
    unset = palpate.touches(recorded(tmp_path / "left.csv"))
    assert [round(touch.start_s) for touch in unset if touch.samples] == [2]


def test_centring_is_refused_in_contact_and_where_there_is_no_range() -> None:
    with Stream(Scripted(four())) as stream:
        for estimate in stream:
            if estimate.touch:
                break
        with pytest.raises(RuntimeError, match="in contact, allowed: without contact"):
            stream.centre()
        with pytest.raises(RuntimeError, match="a source that cannot set its range"):
            stream.centre(force=True)
