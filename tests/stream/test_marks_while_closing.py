"""Marks, notes and tares from one thread while another one closes the recording."""

import threading
from pathlib import Path
from typing import Any

import pytest
from palpate import Stream, check
from palpate.recording.recorder import Recorder
from palpate.recording.sidecar import load


@pytest.mark.parametrize("name", ["tare", "mark", "note"])
def test_a_recording_is_closed_after_what_is_being_written_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = tmp_path / "run.csv"
    with Stream("sim:four-specimens?seed=1&speed=10", record=path) as stream:
        closing = threading.Thread(target=stream.stop_recording)
        written = Recorder.note if name == "note" else Recorder.mark

        def slow(recorder: Recorder, *given: Any, **more: Any) -> Any:
            closing.start()
            closing.join(0.3)
            return written(recorder, *given, **more)

        next(iter(stream))
        monkeypatch.setattr(Recorder, "note" if name == "note" else "mark", slow)
        order: Any = {
            "tare": lambda: stream.tare(force=True),
            "mark": lambda: stream.mark("x"),
            "note": lambda: stream.note("x"),
        }
        order[name]()
        closing.join()
    document = load(path) or {}
    assert document["notes"] == ["x"] if name == "note" else len(document["marks"]) == 1
    assert check(path).clean
