"""The touches of a running measurement, and of a replay of its recording: the same bits, whatever came in."""

import pickle
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import palpate
import pytest
from palpate import Status, Stream
from palpate.recording import sidecar
from palpate.recording.reading import recorded
from palpate.samples import RETAKEN, samples_of
from palpate.simulation import scenarios
from palpate.sources.playback import FileSource
from palpate.stream.batches import Estimate
from palpate.tracking import tracked
from recording_bench import Scripted, four, measured


def bits(touches: list[palpate.Touch]) -> list[bytes]:
    """Return every bit of touches: pickles hold floats as they are."""
    return [pickle.dumps(touch) for touch in touches]


def told(estimates: Iterable[Estimate]) -> list[palpate.Touch]:
    """Return the touches of a stream, revised ones in place of the first results, from its estimates."""
    known: list[palpate.Touch] = []
    for estimate in estimates:
        if estimate.ended:
            assert not estimate.ended.revised
            known.append(estimate.ended)
        if revised := estimate.revised:
            assert (revised.revised, revised.first_ratio) == (True, known[-1].ratio)
            known[-1] = revised
    return known


@pytest.mark.parametrize(
    ("scene", "settings"),
    [
        ("handheld", {}),
        ("handheld", {"samples": 60, "smallest_shift": 2.0}),
        ("paper", {}),
        ("sliding", {}),
        ("fixed", {}),
    ],
)
@pytest.mark.parametrize("source", ["sim:all?seed=3", "sim:saturating", "script"])
def test_a_replay_has_the_bits_of_the_live_touches(
    tmp_path: Path, source: str, scene: Any, settings: dict[str, Any]
) -> None:
    path = tmp_path / "run.csv"
    given = Scripted(four(), full_scale_pF=4.0) if source == "script" else source
    with Stream(given, scene=scene, record=path, **settings) as stream:
        ended = told(stream)
    assert len(stream.touches) >= 1
    assert any(touch.revised for touch in ended) == (scene in ("handheld", "sliding"))
    assert bits(ended) == bits(stream.touches)[: len(ended)]
    recording = recorded(path)
    assert recording.settings["scene"] == scene
    assert bits(palpate.touches(recording, **recording.settings)) == bits(stream.touches)
    assert bits(palpate.touches(recorded(path), scene=scene, **settings)) == bits(stream.touches)
    assert bits(palpate.touches(palpate.read(path), scene=scene, **settings)) == bits(
        stream.touches
    )
    with Stream(str(path), scene=scene, **settings) as again:
        assert [e.ratio.hex() for e in again][-1] == stream.tracker.ratio.hex()
    assert bits(again.touches) == bits(stream.touches)


def test_a_touch_that_still_runs_ends_with_the_stream() -> None:
    given = four()[:250]
    with Stream(Scripted(given)) as stream:
        batches = list(stream.batches())
    [touch] = stream.touches
    assert "short" in touch.flags
    assert (len(batches[-1].samples), batches[-1].touches) == (0, [touch])


def test_saturated_samples_that_a_tracker_would_not_see_are_refused() -> None:
    given = [s._replace(status=Status.SOFT_SATURATED) if 100 <= s.seq < 150 else s for s in four()]
    stream = measured(Scripted(given))
    assert stream.touches[0].refused >= 40
    stream = measured(Scripted(given, full_scale_pF=0.1))
    assert stream.counters.saturated >= 50


def test_a_replay_tares_where_the_measurement_did(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    ended = list[palpate.Touch]()
    with palpate.Stream("sim:four-specimens?seed=3", record=path) as stream:
        for k, estimate in enumerate(stream):
            if k in (143, 460):
                with pytest.raises(RuntimeError, match="in contact"):
                    stream.tare()
                stream.tare(force=True)
            elif k in (10, 461):
                stream.tare()
            ended += [touch for touch in (estimate.ended,) if touch]
    marks = [mark["seq"] for mark in (sidecar.load(path) or {})["marks"]]
    assert marks == [10, 143, 460, 461]  # where the loop is, not where the reader is
    assert len(ended) == len(stream.touches)  # the one that the tare ended, too
    assert (
        bits(palpate.touches(recorded(path)))
        == bits(stream.touches)
        != bits(palpate.touches(palpate.read(path)))
    )


def test_a_baseline_measured_in_contact_is_told_once_and_counted(tmp_path: Path) -> None:
    """Begins pressed: the channels fall at the release, and the touch after it is right."""
    path = tmp_path / "run.csv"
    messages = list[str]()
    run = scenarios.run("four-specimens", seed=1)
    pressed = [row for row in samples_of(run.block()) if row.t_hard_ns > 4e9]
    stream = measured(Scripted(list(pressed)), record=path, notify=messages.append)
    touches, retaken, _, _ = tracked(recorded(path))
    assert (messages, stream.counters.retaken, retaken) == ([RETAKEN], 1, 1)
    assert bits(touches) == bits(stream.touches)
    assert abs(stream.touches[-1].ratio / run.presses[-1].ratios[0][1] - 1) < 0.01


def test_a_reading_of_one_channel_alone_reaches_the_tracker_live_and_in_a_replay(
    tmp_path: Path,
) -> None:
    run = scenarios.run("lost-10", seed=2)
    path = tmp_path / "run.csv"
    block = run.block()
    alone = np.isfinite(block["hard"]) != np.isfinite(block["soft"])
    assert (alone.sum() > 50, set(block["status"][alone])) == (True, {Status.LOST})
    stream = measured(
        Scripted(list(samples_of(block)), full_scale_pF=run.full_scale_pF), record=path
    )
    assert (
        bits(stream.touches)
        == bits(palpate.touches(recorded(path)))
        == bits(palpate.touches(palpate.read(path)))
    )
    masked = block.copy()
    for name in ("hard", "soft"):
        masked[name][alone] = np.nan
        masked[f"{name}_raw"][alone] = -1
    without = measured(Scripted(list(samples_of(masked)), full_scale_pF=run.full_scale_pF))
    assert bits(without.touches) != bits(stream.touches)


@pytest.mark.parametrize(
    ("stamps", "smoothed"), [("host", True), ("converter", False), (None, False)]
)
def test_a_source_says_whose_its_stamps_are(
    tmp_path: Path, stamps: str | None, smoothed: bool
) -> None:
    path = tmp_path / "run.csv"
    described: dict[str, Any] = {"stamps": stamps} if stamps else {}
    run = scenarios.run("host-stamps", seed=1)
    stream = measured(Scripted(list(samples_of(run.block())), **described), record=path)
    assert stream.tracker.settings["host_stamps"] is smoothed
    recording = recorded(path)
    assert (recording.host_stamps, palpate.read(path).host_stamps) == (smoothed, smoothed)
    assert recording.describe().get("stamps") == stamps
    for again in (recording, palpate.read(path), FileSource(str(path)).recording):
        assert bits(palpate.touches(again)) == bits(stream.touches)
    assert bits(palpate.touches(recording, host_stamps=not smoothed)) != bits(stream.touches)
    with Stream(Scripted([], **described), host_stamps=not smoothed) as stream:
        assert stream.tracker.settings["host_stamps"] is not smoothed
    with Stream(Scripted([], **described), scene="paper") as stream:
        assert "host_stamps" not in stream.tracker.settings
