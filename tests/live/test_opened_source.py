"""Another source in place of the one that the page shows: the demo, a board, a recording."""

import json
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from threading import Event
from typing import Any

import palpate
import pytest
from live_bench import OWN_FILE, client
from live_browser import Browser
from live_server import Live
from page_looks import CUT, SIDEWAYS, audit
from palpate.calibration import Calibration
from palpate.calibration.calibration_file import About
from palpate.calibration.provenance import Provenance
from palpate.cli import live_sources
from palpate.cli.live_sources import LiveOptions, LiveSources
from palpate.live.commands import LiveWorkbench
from palpate.live.opened_source import MOST_LISTED, OpenedSource
from palpate.live.page_commands import RecordCommand, StopCommand
from palpate.live.protocol import RefusedCommand
from palpate.sources.devices import ListedDevice
from project import copied
from recording_bench import soon
from report_session import change
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.keys import Keys

DEMO = "demo:"
NAME = OWN_FILE.name


def options(folder: Path, **more: Any) -> LiveOptions:
    given = {
        "source": DEMO,
        "others": (),
        "reading": {},
        "tracking": {"scene": "handheld"},
        "has_scene": False,
        "scatter": 0.03,
        "accept": (),
        "folder": folder,
    }
    return LiveOptions(**{**given, **more})


def begun(folder: Path, **more: Any) -> OpenedSource:
    """Start the source of a command line."""
    first_page = Event()
    first_page.set()
    sources = LiveSources(options(folder, **more), first_page)
    opened = OpenedSource(sources.build(), sources)
    opened.bench.measurement.start()
    return opened


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[OpenedSource]:
    copied(tmp_path / NAME, OWN_FILE)
    opened = begun(tmp_path)
    yield opened
    opened.close()


@pytest.fixture
def no_board(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_sources, "search_by", lambda *_: ([], ["libusb is missing"]))


def received(socket: Any, type: str, **wanted: Any) -> dict[str, Any]:
    """Return the next message of a kind with these values."""
    while True:
        told = json.loads(socket.receive().get("text") or "{}")
        if told.get("type") == type and wanted.items() <= told.items():
            return dict(told)


def test_a_page_opens_a_recording_and_goes_back(demo: OpenedSource, tmp_path: Path) -> None:
    first = demo.bench
    with client(demo) as page, page.websocket_connect("/ws") as socket:
        received(socket, "hello", kind="live", measurement=1)
        [listed] = received(socket, "recordings")["files"]
        assert listed["name"] == NAME
        assert listed["changed_s"] == (tmp_path / NAME).stat().st_mtime
        socket.send_json({"do": "open", "what": NAME})
        hello = received(socket, "hello", kind="file", measurement=2)
        assert hello["file"]["name"] == NAME
        soon(lambda: not first.measurement.running)
        soon(lambda: not demo.bench.measurement.running)
        assert [touch.ratio for touch in demo.bench.measurement.touches] == [
            touch.ratio for touch in palpate.touches(palpate.read(OWN_FILE))
        ]
        assert received(socket, "done")["message"] == f"{NAME} is open now."
        assert page.get(f"/recording/{NAME}").content == OWN_FILE.read_bytes()
        socket.send_json({"do": "open", "what": "demo"})
        received(socket, "hello", kind="live", measurement=3, source=DEMO, seconds=3.0)
        assert received(socket, "done")["message"] == "demo: is open now."
        soon(lambda: demo.bench.measurement.state == "no contact")


def test_what_is_not_opened(demo: OpenedSource, tmp_path: Path, no_board: None) -> None:
    demo.recordings()
    before = demo.bench
    refusals = {
        f"../{NAME}": f"open: got '../{NAME}', allowed: measure, demo, {NAME}",
        str(tmp_path / NAME): "allowed: measure, demo",
        "measure": "measure: no board is connected; libusb is missing: plug it in; in a terminal",
    }
    for what, text in refusals.items():
        with pytest.raises(RefusedCommand, match=re.escape(text)):
            demo.open(what)
    assert demo.open("demo") == "demo: is open already."
    (tmp_path / NAME).write_text("no recording\n")
    with pytest.raises(palpate.PalpateError):
        demo.open(NAME)
    (tmp_path / NAME).unlink()
    with pytest.raises(palpate.PalpateError, match="cannot be read: No such file"):
        demo.open(NAME)
    assert demo.bench is before
    assert before.measurement.running
    soon(lambda: before.measurement.state == "no contact")
    before.run(RecordCommand("run.csv"))
    assert [one.name for one in demo.recordings().files] == ["run.csv"]
    with pytest.raises(RefusedCommand, match="a recording is running; end the recording first"):
        demo.open("run.csv")
    before.run(StopCommand())


def test_the_newest_recordings_are_listed(tmp_path: Path) -> None:
    opened = begun(tmp_path)
    for number in range(MOST_LISTED + 2):
        path = copied(tmp_path / f"{number}.csv", OWN_FILE)
        os.utime(path, (number, number))
    (tmp_path / "table.csv").write_text("hard,soft\n")  # has no sidecar
    names = [one.name for one in opened.recordings().files]
    assert names == [f"{number}.csv" for number in range(MOST_LISTED + 1, 1, -1)]
    opened.close()


def test_a_board_takes_the_place_of_the_demo(
    demo: OpenedSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    board = "sim:tremor?seed=1"
    monkeypatch.setattr(
        live_sources, "search_by", lambda *_: ([ListedDevice(board, "in place of a board")], [])
    )
    first = demo.bench
    assert demo.open("measure") == f"{board} is open now."
    assert not first.measurement.running
    assert demo.bench.measurement.running
    assert isinstance(demo.bench, LiveWorkbench)
    assert "seconds" not in demo.bench.live.settings
    # what is measured goes on, wherever the search would find it
    monkeypatch.setattr(live_sources, "search_by", lambda *_: ([], []))
    assert demo.open("measure") == f"{board} is open already."


def test_a_recording_that_the_calibration_is_not_for_opens_without_it(tmp_path: Path) -> None:
    path = copied(tmp_path / NAME, OWN_FILE)
    change(path, {"device": {"fingerprint": "61 12 5c 34"}})
    file = tmp_path / "probe.toml"
    about = About(scene="handheld", provenance=Provenance(chips=("66 cc 5c 90",)))
    Calibration.fit([2.0, 3.0, 4.0, 5.0], [0.18, 0.46, 1.0, 2.5], about=about).save(file)
    opened = begun(tmp_path, calibration=Calibration.load(file), calibration_file=file)
    assert opened.bench.hello().calibrated
    opened.recordings()
    message = opened.open(NAME)
    assert re.match(
        f"{NAME} is open now. The calibration is not used: .*the calibration was made with the chip",
        message,
    )
    assert not opened.bench.hello().calibrated
    assert opened.bench.measurement.files.calibration is None
    opened.open("demo")
    assert opened.bench.hello().calibrated
    opened.close()


def test_what_is_recorded_is_closed_and_stays_a_file_of_the_run(tmp_path: Path) -> None:
    opened = begun(tmp_path, record=tmp_path / "run.csv", source="sim:tremor?seed=1")
    measurement = opened.bench.measurement
    soon(lambda: measurement.recorder and measurement.recorder.rows)
    opened.bench.run(StopCommand())
    opened.open("demo")
    state = opened.bench.state()
    assert state.recording is None
    assert [one.name for one in state.files] == ["run.csv", "run.json"]
    assert state.proposed == "run-2.csv"
    opened.close()
    assert not opened.bench.measurement.running


def test_the_start_screen_opens_each_of_the_three(
    serve: Callable[..., Live], page: Browser, tmp_path: Path
) -> None:
    """A recording from the demo and back, with the keyboard; a refusal is in words and changes nothing."""
    copied(tmp_path / NAME, OWN_FILE)
    live = serve("--folder", str(tmp_path), source="demo:")
    page.driver.get(f"{live.address}#start")
    page.until(lambda: NAME in page.text("recordings"))
    assert page.text("board") == "The demo is shown. Measure looks for the board."
    for size, theme in (("phone", "dark"), ("lying", "light"), ("desk", "dark"), ("desk", "light")):
        page.size(size)
        page.theme(theme)
        page.drawn()
        assert not page.run(SIDEWAYS), size
        assert not page.run(CUT), size
        assert not audit(page.driver), (size, theme)
    page.click("startmeasure")
    page.until(lambda: page.text("answer").startswith("measure: no board is connected"))
    assert page["start"].is_displayed()
    page.run("document.querySelector('#recordings button').focus()")
    page.press(Keys.ENTER)
    page.until(lambda: page["lab"].is_displayed() and len(page.all("#touches tr")) > 3)
    assert page.text("source").startswith(NAME)
    page.until(lambda: page.text("answer") == f"{NAME} is open now.")
    assert not page["demo"].is_displayed()
    assert not page["device"].is_displayed()
    page["more"].click()
    page.all("#menu [data-depth=start]")[0].click()
    assert page.text("board") == "A recording is shown. Measure looks for the board."
    page.run("startdemo.focus()")
    page.press(Keys.ENTER)
    page.until(lambda: page["measure"].is_displayed() and page.text("verb") == "Touch")
    assert page.all("#touches tr.touch") == []
    assert page["simulated"].is_displayed()
    ActionChains(page.driver).click_and_hold(page["block-40 A"]).perform()
    page.until(lambda: page.text("verb") == "Lift")
    ActionChains(page.driver).release().perform()
    page.until(lambda: page.text("verb") == "Touch" and "ratio" in page.text("block-40 A"))
    assert not page.complaints()
