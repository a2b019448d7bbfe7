"""Simulated hands: one that a page presses, one that does what a plan asks, and the begin of both."""

import time
from collections.abc import Iterator
from threading import Event, Timer

import numpy as np
import palpate
import pytest
from palpate.elasticity import SORBOTHANE_MPA
from palpate.recording.sidecar import is_simulated
from palpate.samples import Sample
from palpate.simulation.hand import SESSIONS
from palpate.simulation.scenarios import PROBE
from palpate.source_events import SourceEvent
from palpate.sources import sim
from palpate.sources.demo import LONGEST_S, SPECIMENS, DemoOptions, DemoSource
from palpate.sources.simulated_hand import WantedTouch
from palpate.stream import Batch, Listener
from palpate.touch import Touch

HELD_S, APART_S = 7.2, 1.6


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no simulation wait for its clock."""
    monkeypatch.setattr(sim.Pacing, "wait_until", lambda *_: None)


class Pressed(DemoSource):
    """Somebody presses on specimens, one after the other, by the clock of the simulation."""

    def __init__(self, names: list[str], held_s: float = HELD_S) -> None:
        super().__init__(DemoOptions(page=True))
        self.names = names
        self.held_s = held_s

    def samples(self) -> Iterator[Sample | SourceEvent]:
        """Yield the pairs, and press and release at their times."""
        begins_s, releases_s = APART_S, np.inf
        for item in super().samples():
            yield item
            now_s = self.clock.now_ns() / 1e9
            if now_s >= releases_s:
                self.hand.release()
                begins_s, releases_s = now_s + APART_S, np.inf
            elif now_s >= begins_s and not self.names:
                return
            elif now_s >= begins_s:
                self.hand.press(self.names.pop(0))
                begins_s, releases_s = np.inf, now_s + self.held_s


def touches(source: palpate.Source, *listeners: Listener) -> list[Touch]:
    """Return the touches of a source."""
    with palpate.Stream(source) as stream:
        for listener in listeners:
            stream.listen(listener)
        for _ in stream.batches():
            pass
    return stream.touches


def test_a_page_presses_for_as_long_as_it_likes(quick: None) -> None:
    names = ["40 A", "30 OO", "70 A"]
    source = Pressed(names.copy())
    found = touches(source)
    assert [truth.name for truth in source.hand.truths] == names
    for touch, truth in zip(found, source.hand.truths, strict=True):
        assert not touch.flags
        assert touch.start_s == pytest.approx(truth.start_s, abs=0.3)
        # The readings follow the force on this object: the error is that of the noise.
        assert abs(touch.ratio - truth.ratio) < 4 * touch.standard_error + 2e-4
        level = PROBE.ratio(SPECIMENS[truth.name])
        assert truth.ratio == pytest.approx(level, rel=0.1)
        assert truth.ratio != level  # it scatters as that of a hand
    short = touches(Pressed(["40 A"], held_s=2.0))
    assert [str(flag) for touch in short for flag in touch.flags] == ["short"]


def test_the_force_grows_while_it_is_held(quick: None) -> None:
    source = Pressed(["40 A"])
    soft = []
    for item in source:
        if isinstance(item, np.ndarray):
            soft.append(float(item["soft"][0]))
    change = np.array(soft) - np.median(soft[:20])
    pressed = change[change > 0.5 * change.max()]
    assert pressed[-20:].mean() > 1.2 * pressed[:20].mean()
    assert abs(change[-20:]).max() < 1e-3


def test_the_hand_is_tired_in_the_end(quick: None) -> None:
    source = Pressed(["40 A"], held_s=np.inf)
    readings: list[float] = []
    for item in source:
        if isinstance(item, np.ndarray):
            readings.append(float(item["soft"][0]))
            if item["t_hard_ns"][0] > (LONGEST_S + 4) * 1e9:
                break
    assert readings[-1] == pytest.approx(readings[0], abs=1e-3)
    assert max(readings) > readings[0] + 0.1


def test_what_is_refused() -> None:
    source = DemoSource(DemoOptions(page=True))
    with pytest.raises(ValueError, match=r"press: got specimen '40 B', allowed: 30 OO, 70 OO, "):
        source.hand.press("40 B")
    source.hand.release()  # nothing is pressed
    simulated = palpate.open("sim:four-specimens").hand
    assert simulated is not None
    with pytest.raises(
        RuntimeError, match=r"press: got '40 A', allowed: with the source demo: only"
    ):
        simulated.press("40 A")
    with pytest.raises(RuntimeError, match="release: got it, allowed: with the source demo: only"):
        simulated.release()
    with pytest.raises(ValueError, match="demo: got address 'x', allowed: none"):
        palpate.open("demo:x")


def test_without_a_page_nobody_presses_and_it_ends() -> None:
    said: list[str] = []
    with palpate.open("demo:") as source:
        source.notify = said.append
        samples = [item for item in source if isinstance(item, np.ndarray)]
        assert is_simulated(source.describe())
    assert len(samples) > 200
    assert said == ["demo: nobody presses it: it is for the page of `palpate live demo:`"]


class Plan(Listener):
    """Wants touches; the first touch on the second specimen is to be repeated."""

    def __init__(self) -> None:
        self.wanted = ["50 A", "50 A", "gel", "gel", "70 OO"]
        self.moduli = {"gel": 1.1}
        self.last = 0

    def touch(self, number: int, touch: Touch) -> None:
        """Go on to the next one when a touch has ended, but repeat the third."""
        if number == self.last + 1:
            self.last = number
            if number != 3:
                self.wanted.pop(0)

    def following(self) -> WantedTouch | None:
        """Return what is wanted."""
        if not self.wanted:
            return None
        return WantedTouch(self.wanted[0], self.moduli.get(self.wanted[0]))


def test_a_simulated_hand_does_what_is_asked() -> None:
    """Also the repetition of a touch, and nothing after the last one that is wanted."""
    plan = Plan()
    source = palpate.open("sim:ten-specimens?seed=3&speed=8")
    assert source.hand is not None
    source.hand.follow(plan.following)
    stop = Stop(6)
    found = touches(source, plan, stop)
    names = [truth.name for truth in source.hand.truths[: len(found)]]
    assert names[:6] == ["50 A", "50 A", "gel", "gel", "gel", "70 OO"]
    moduli = {**SORBOTHANE_MPA, "gel": 1.1}
    for touch, name, truth in zip(found, names[:6], source.hand.truths, strict=False):
        assert touch.ratio == pytest.approx(PROBE.ratio(moduli[name]), rel=0.12)
        assert touch.ratio == pytest.approx(truth.ratio, rel=0.02)


class Stop(Listener):
    """Ends a measurement after some touches."""

    def __init__(self, touches: int) -> None:
        self.touches = touches
        self.stream: palpate.Stream | None = None

    def begun(self, stream: palpate.Stream) -> None:
        """Keep the stream."""
        self.stream = stream

    def batch(self, batch: Batch) -> None:
        """Stop it when there are enough touches."""
        if self.stream and len(self.stream.touches) >= self.touches:
            self.stream.stop()


def test_it_goes_on_after_its_last_touch_as_long_as_something_is_wanted() -> None:
    planned = len(SESSIONS["two-rounds"].presses)
    counted = Counter(planned + 2)
    source = palpate.open("sim:two-rounds?speed=12")
    assert source.hand is not None
    source.hand.follow(counted.following)
    assert len(touches(source, counted)) == planned + 2


class Counter(Listener):
    """Wants a number of touches of one specimen."""

    def __init__(self, wanted: int) -> None:
        self.wanted = wanted
        self.missing = wanted

    def touch(self, number: int, touch: Touch) -> None:
        """Count a touch."""
        self.missing = self.wanted - number

    def following(self) -> WantedTouch | None:
        """Return what is wanted."""
        return WantedTouch("40 A", None) if self.missing > 0 else None


@pytest.mark.parametrize("comes", [True, False])
def test_a_simulation_begins_with_the_first_page(comes: bool) -> None:
    """Or after a time; its own clock does not run before."""
    begin = Event()
    source = palpate.open("sim:four-specimens?speed=1")
    assert source.hand is not None
    source.hand.wait_for(begin, 20.0 if comes else 2.0)
    if comes:
        Timer(2.0, begin.set).start()
    begun_s = time.monotonic()
    with source:
        assert source.hand.is_waiting
        block = next(item for item in source if isinstance(item, np.ndarray))
        waited_s = time.monotonic() - begun_s
        assert not source.hand.is_waiting
        zero_ns = source.zero_ns
    assert 2.0 <= waited_s < 10
    assert block["t_hard_ns"][0] < 1.9e9
    assert zero_ns is not None
    arrived_ns = zero_ns + int(block["t_soft_ns"][0])
    assert abs(time.monotonic_ns() - arrived_ns) < 2e9


def test_a_simulation_that_waits_can_be_stopped() -> None:
    source = palpate.open("sim:four-specimens?speed=1")
    assert source.hand is not None
    source.hand.wait_for(Event(), 60.0)
    with source:
        Timer(0.3, source.interrupt).start()
        begun_s = time.monotonic()
        assert not [item for item in source if isinstance(item, np.ndarray)]
    assert time.monotonic() - begun_s < 5
