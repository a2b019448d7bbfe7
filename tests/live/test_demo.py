"""The demo of `palpate live` without a board: the same on any computer, round after round, recorded as simulated."""

import time
from collections.abc import Callable
from pathlib import Path

import palpate
import pytest
from live_bench import Bench
from live_browser import Browser
from live_server import Live
from palpate.live.files import RunFiles
from palpate.live.measurement import LiveMeasurement, opener
from palpate.recording.sidecar import load
from palpate.stream import Batch, Listener
from recording_bench import SampleReader


class Slow(Listener):
    """A computer that stands still now and then."""

    def batch(self, batch: Batch) -> None:
        """Wait."""
        if batch.rows["touch"][-1] and batch.samples["seq"][-1] % 50 == 0:
            time.sleep(0.1)


def test_rounds_of_a_slow_computer_are_those_of_a_fast_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("palpate.sources.sim.time.sleep", lambda _: None)
    source = opener("sim:demo", {"paced": True})
    measurement = LiveMeasurement(
        source, RunFiles(tmp_path / "run.csv"), {"scene": "handheld"}, demo=True
    )
    bench = Bench(measurement, "sim:demo")
    measurement.listeners.append(Slow())
    said = set[tuple[str, str]]()
    measurement.start()
    while measurement.number < 3:
        state = bench.shown()
        said.add((state.now.word, state.line.level))
        time.sleep(0.05)  # half of what the slow computer stands still: no word is missed
    measurement.close()
    assert said == {(word, "note") for word in ("Waiting", "Holding", "Lifting", "Lifted")}
    names, ratios = zip(*((truth.name, truth.ratio) for truth in measurement.truths), strict=True)
    assert names == 2 * ("30 OO", "70 OO", "40 A", "70 A")
    for name, seed in (("run.csv", 0), ("run-2.csv", 1)):
        with palpate.Stream(f"sim:demo?seed={seed}") as stream:
            for _ in stream.batches():
                pass
        assert palpate.touches(tmp_path / name) == stream.touches
        assert not any(touch.flags for touch in stream.touches)
        assert [touch.ratio for touch in stream.touches] == pytest.approx(ratios, rel=0.1)
        told = load(tmp_path / name) or {}
        assert told["device"]["simulated"]["scenario"] == "demo"
        assert [touch["specimen"] for touch in told["session"]["touches"]] == list(names)


def test_it_keeps_to_the_clock() -> None:
    with palpate.open("sim:demo", paced=True) as source:
        begun, samples = time.monotonic(), SampleReader(source)
        first = next(samples)
        last = [next(samples) for _ in range(30)][-1]
    assert time.monotonic() - begun >= (last.t_hard_ns - first.t_hard_ns) / 1e9 - 0.1


def test_the_first_picture_without_a_board(serve: Callable[..., Live], page: Browser) -> None:
    live = serve("--no-token", source="")
    page.driver.get(live.lab)
    page.until(lambda: "±" in page.text("range"))
    shown = page["simulated"].text, page.text("says"), page.text("nexthead"), page.text("nextname")
    assert shown[0] == "Simulation"
    assert shown[1].startswith(
        "● Simulation. A simulated hand touches four specimens, round after round."
    )
    assert shown[2] == "True ratio, 30 OO"
    assert shown[3].startswith("1.601")
    text = page.run("return document.body.innerText")
    for needed in (
        "The ratio of their capacitance changes",
        "± is one standard deviation (k = 1)",
        "palpate doctor",
    ):
        assert needed in text
    assert not any(page[name].is_displayed() for name in ("session", "device"))
    for size in ("phone", "lying", "tablet"):
        page.size(size)
        assert page["simulated"].is_displayed()
