"""The demo of `palpate live`: without a board a person presses a simulated probe on the page, and calibrates."""

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event

import palpate
import pytest
from live_browser import Browser
from live_server import Live
from page_looks import CUT, SIDEWAYS, audit
from palpate.live.commands import LiveWorkbench
from palpate.live.measurement import LiveMeasurement, opener
from palpate.live.page_commands import PlanCommand, PressCommand, ReleaseCommand
from palpate.live.run_files import RunFiles
from palpate.recording.sidecar import load
from palpate.sources.demo import SPECIMENS
from recording_bench import soon
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

EXPECTED = ("first baseline", "ready", "slow")  # the last one on a busy computer
SHORT = {"scene": "handheld", "seconds": 1.0}  # touches of a second


def started(source: str, files: RunFiles, first_page: Event | None = None) -> LiveWorkbench:
    """Return the workbench of a measurement that runs."""
    measurement = LiveMeasurement(opener(source, {}), files, SHORT, first_page=first_page)
    bench = LiveWorkbench(measurement, source)
    measurement.start()
    return bench


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[LiveWorkbench]:
    bench = started("demo:", RunFiles(tmp_path / "run.csv"))
    soon(lambda: bench.live.state == "no contact")
    yield bench
    bench.live.close()


def pressed(bench: LiveWorkbench, name: str) -> None:
    """Press on a specimen until the touch is complete, and lift."""
    bench.run(PressCommand(name))
    soon(lambda: bench.live.state == "done")
    bench.run(ReleaseCommand())
    soon(lambda: bench.live.state == "no contact")


def test_the_touches_are_on_what_was_pressed(demo: LiveWorkbench, tmp_path: Path) -> None:
    session = demo.plan.document
    assert [(one.name, one.modulus, one.of) for one in session.specimens] == [
        (name, modulus, 2) for name, modulus in SPECIMENS.items()
    ]
    order = ["40 A", "30 OO"]  # whatever the list asks for
    for name in order:
        pressed(demo, name)
    soon(lambda: len(demo.plan.rows) == 2 and demo.live.touches[1].revised)
    assert [row.specimen for row in demo.plan.rows] == order
    simulation = demo.hello().simulation
    assert simulation
    assert [one.name for one in simulation.specimens] == list(SPECIMENS)
    for touch, truth in zip(demo.live.touches, simulation.truths, strict=True):
        assert touch.ratio == pytest.approx(truth.ratio, rel=2e-3)
    demo.live.close()
    stored = load(tmp_path / "run.csv") or {}
    assert stored["device"]["simulated"]["scenario"].startswith("demo")
    assert [touch["specimen"] for touch in stored["session"]["touches"]] == order


def test_a_recording_that_begins_with_earlier_pairs_says_when(tmp_path: Path) -> None:
    """It begins with the first kept pair, not when Record is pressed."""
    begun_s = time.time()
    bench = started("demo:", RunFiles(None, tmp_path))
    soon(lambda: bench.live.last_s > 3.0)
    bench.live.record("late.csv")
    bench.live.close()
    recording = palpate.read(tmp_path / "late.csv")
    assert recording.t_hard_s[0] < 1.0
    assert recording.zero_utc_ns is not None
    assert begun_s - 1.0 < recording.zero_utc_ns / 1e9 < begun_s + 2.5


def test_what_does_not_press(demo: LiveWorkbench) -> None:
    with pytest.raises(ValueError, match=r"press: got specimen 'gel', allowed: 30 OO, "):
        demo.run(PressCommand("gel"))
    demo.run(ReleaseCommand())  # nothing is pressed
    other = started("sim:four-specimens", RunFiles())
    try:
        with pytest.raises(RuntimeError, match="press: got '40 A', allowed: with the source demo:"):
            other.run(PressCommand("40 A"))
    finally:
        other.live.close()


def test_a_simulation_begins_with_the_first_page_and_says_nothing_before() -> None:
    """It is not silent, which would be a fault; its first touch is not over before anybody looks."""
    first_page = Event()
    bench = started("sim:four-specimens", RunFiles(), first_page)
    until_s = time.monotonic() + 2.5
    while time.monotonic() < until_s:
        bench.look()
        assert bench.state().line.what in EXPECTED
        time.sleep(0.1)
    assert bench.live.last is None
    first_page.set()
    soon(lambda: bench.live.last is not None)
    for _ in range(10):
        bench.look()
        assert bench.state().line.what in EXPECTED
        time.sleep(0.1)
    assert bench.live.last_s < 2.4
    bench.live.close()


def test_the_hand_of_a_session_does_what_is_next(tmp_path: Path) -> None:
    """Also after a touch that is left out: it is repeated, and none is under a wrong specimen."""
    measurement = LiveMeasurement(opener("sim:ten-specimens?speed=6", {}), RunFiles(), {})
    bench = LiveWorkbench(measurement, "sim:ten-specimens")
    measurement.start()
    bench.run(PlanCommand("gel; 1.1\n70 A; 8.68", 2))
    soon(lambda: len(bench.plan.rows) == 1)
    bench.plan.discard(1)
    soon(lambda: len(bench.plan.rows) == 5)
    measurement.close()
    assert [row.specimen for row in bench.plan.rows] == ["gel", "gel", "gel", "70 A", "70 A"]
    for touch in measurement.touches:
        begun = [one for one in measurement.truths if one.start_s < touch.start_s + 0.5]
        assert touch.ratio == pytest.approx(begun[-1].ratio, rel=0.03)
    ratios = [touch.ratio for touch in measurement.touches]
    assert max(ratios[:3]) < 5 < min(ratios[3:5])


def test_a_newcomer_calibrates_with_the_mouse_and_the_keys(
    serve: Callable[..., Live], page: Browser, tmp_path: Path
) -> None:
    live = serve("--no-token", "--touch-seconds", "1", "--folder", str(tmp_path), source="")
    page.driver.get(live.address)
    page.until(lambda: page.text("verb") == "Touch")
    assert page["simulated"].text == "Simulation"
    assert page.text("demowords").startswith("Your mouse is the hand: press and hold one of these")
    page["democalibrate"].click()
    page.until(lambda: page.text("demowords") == "Press and hold 30 OO: touch 1 of 2.")
    names = [name for name in SPECIMENS for _ in range(2)]
    for place, name in enumerate(names):
        block = page[f"block-{name}"]
        keys = place % 2 == 1
        if keys:
            page.run("arguments[0].focus()", block)
            ActionChains(page.driver).key_down(Keys.SPACE).perform()
        else:
            ActionChains(page.driver).click_and_hold(block).perform()
        page.until(lambda: page.text("verb") in ("Lift", "Repeat"))
        assert page.text("demowords") == "Let go: the touch is complete."
        if keys:
            ActionChains(page.driver).key_up(Keys.SPACE).perform()
        else:
            ActionChains(page.driver).release().perform()
        page.until(lambda: page.text("verb") in ("Touch", "Done"))
    page.until(lambda: "Kept in memory: the demo writes no file." in page.text("wizardend"))
    assert page.text("wizardend").startswith("Good: the next objects are known to ±")
    assert list(tmp_path.iterdir()) == []  # no probe.toml
    page.choose("unit", "kPa")
    page.until(lambda: re.search(r"those above \d{4} kPa less well", page.text("wizardend")))
    page.choose("unit", "MPa")
    # the next touch is in MPa, beside the truth
    ActionChains(page.driver).click_and_hold(page["block-40 A"]).perform()
    page.until(lambda: page.text("valueunit") == "MPa")
    page.until(lambda: page.text("verb") == "Lift")
    page.until(lambda: "MPa\ntrue 1.54 MPa" in page.text("block-40 A"))
    ActionChains(page.driver).release().perform()
    assert page["simulated"].is_displayed()
    for size in ("phone", "lying", "small", "screen", "desk"):
        page.size(size)
        page.drawn()
        assert not page.run(SIDEWAYS), size
        cut = [text for text in page.run(CUT) if "block" in text or "demo" in text]
        assert not cut, size
    assert not audit(page.driver)
    assert not page.complaints()
