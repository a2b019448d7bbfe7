"""What the listeners of a stream get: all events, in order."""

from pathlib import Path
from typing import Any

import pytest
from palpate import Stream
from palpate.sources.base import Gap
from palpate.stream import Listener
from recording_bench import Scripted, four


class Log(Listener):
    """Writes down each event."""

    def __init__(self) -> None:
        self.events: list[tuple[Any, ...]] = []

    def begun(self, stream: Stream) -> None:
        self.events.append(("begun", stream.counters.read))

    def gap(self, gap: Any) -> None:
        self.events.append(("gap", gap.seq))

    def batch(self, batch: Any) -> None:
        self.events.append(("batch", len(batch.samples)))

    def touch(self, number: int, touch: Any) -> None:
        self.events.append(("touch", number, touch.revised))

    def message(self, text: str) -> None:
        self.events.append(("message", text.partition(":")[0]))

    def ended(self, error: BaseException | None) -> None:
        self.events.append(("ended", error and str(error)))


def test_a_listener_gets_each_event_in_its_order(tmp_path: Path) -> None:
    log, stream = Log(), Stream(Scripted(four(), gaps=[Gap(500, "moved")]), record=tmp_path / "run.csv")
    stream.listen(log)
    with stream:
        samples = sum(len(batch.samples) for batch in stream.batches())
    kinds = [event[0] for event in log.events]
    assert kinds[0] == "begun"
    assert log.events[-1] == ("ended", None)
    assert sum(event[1] for event in log.events if event[0] == "batch") == samples
    gap = kinds.index("gap")
    assert kinds[gap : gap + 2] == ["gap", "message"]
    touches = [event[1:] for event in log.events if event[0] == "touch"]
    assert touches == [(1, False), (1, True), (2, False), (3, False), (3, True), (4, False), (4, True)]
    assert kinds.index("touch") > kinds.index("batch")


def test_the_end_names_the_error_that_ended_it() -> None:
    log, stream = Log(), Stream(Scripted([*four()[:50], ZeroDivisionError("mine")]))
    stream.listen(log)
    stream.source.notify("hello: you")
    with stream, pytest.raises(ZeroDivisionError):
        list(stream.batches())
    assert log.events[0] == ("message", "hello")
    assert log.events[-1] == ("ended", "mine")
