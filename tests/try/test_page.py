"""The page for a browser alone, in Chromium, as a file: what it shows, opens, refuses and measures; no request leaves it."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import page_looks
import palpate
import pytest
from live_browser import Browser, browser
from page_states import SIZES, sized
from palpate import digits
from project import ROOT, need
from try_page import LONG_MS, Trial, labelled, made
from try_reference import reviewed

FOUR = ROOT / "tests" / "data" / "four-specimens.csv"
MOST_BYTES = 150_000


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("try"))


@pytest.fixture(scope="module")
def page(file: Path) -> Iterator[Browser]:
    need("chromium")
    need("chromedriver")
    with browser(file.parent) as page:
        sized(page, *SIZES["desk"])
        yield page


@pytest.fixture
def trial(page: Browser, file: Path) -> Iterator[Trial]:
    """Return the page, newly opened; nothing may have failed in it, and nothing may have been asked for."""
    page.driver.get("about:blank")
    page.driver.get_log("browser")
    page.driver.get_log("performance")
    trial = Trial(page, file)
    trial.open(port=True)
    yield trial
    assert [entry["message"] for entry in page.driver.get_log("browser")] == []
    assert requests(page) <= {trial.address, "about:blank"}
    assert trial.script("return [localStorage.length, sessionStorage.length, document.cookie]") == [0, 0, ""]


def requests(page: Browser) -> set[str]:
    """Return the addresses that were asked for since the last call; what is in the page itself has none."""
    told = [json.loads(entry["message"])["message"] for entry in page.driver.get_log("performance")]
    asked = {one["params"]["request"]["url"] for one in told if one["method"] == "Network.requestWillBeSent"}
    sockets = {one["params"]["url"] for one in told if one["method"] == "Network.webSocketCreated"}
    return {url for url in asked | sockets if not url.startswith("data:")}


def test_it_is_small_and_the_same_sources_give_the_same_bytes(file: Path, tmp_path: Path) -> None:
    assert file.stat().st_size < MOST_BYTES
    assert made(tmp_path).read_bytes() == file.read_bytes()


def test_the_simulated_touches_are_drawn_beside_their_truth(trial: Trial) -> None:
    page = trial.page
    assert page.text("says").startswith("● This is a simulation.")
    known = trial.script("return { truth: palpate.known.truth, rows: palpate.known.touches.rows }")
    assert trial.count == len(known["truth"]) == len(known["rows"]) >= 3
    for truth, row in zip(known["truth"], known["rows"], strict=True):
        assert row["number"] == truth["touch"]
        assert row["ratio"] == pytest.approx(truth["touch_ratio"], rel=0.005)
        assert row["deviation"] == pytest.approx(row["ratio"] / truth["touch_ratio"] - 1)
    drawn = trial.drawn()
    assert drawn["overview"]["points"] > 50
    assert drawn["detail"]["points"] > 200
    assert drawn["touch"]["points"] > 100
    assert page.text("number") == digits.number(known["rows"][-1]["ratio"], known["rows"][-1]["standard_error"])
    trial.script("document.querySelector(\"#rows tr[data-touch='1'] td\").click()")
    assert page.text("truthname") == f"True ratio, {known['truth'][0]['name']}"
    assert page.text("number") == digits.number(known["rows"][0]["ratio"], known["rows"][0]["standard_error"])


def test_a_recording_has_the_bits_and_the_words_of_palpate(trial: Trial) -> None:
    trial.drop(FOUR, FOUR.with_suffix(".json"))
    trial.page.until(lambda: trial.page.text("sub") == FOUR.name)
    wanted = reviewed(FOUR)
    for name, column in trial.columns().items():
        expected = wanted.rows[name]
        assert column.shape == expected.shape
        unknown = np.isnan(expected) if expected.dtype == np.float64 else np.zeros(len(expected), bool)
        assert (np.isnan(column[unknown])).all(), name
        assert (column[~unknown] == expected[~unknown]).all(), name
    rows = trial.script("return palpate.known.touches.rows")
    assert [row["ratio"] for row in rows] == [touch.ratio for touch in palpate.touches(FOUR)]
    assert [row["advice"] for row in rows] == [row["advice"] for row in wanted.touches["rows"]]
    for name in ("word", "sub"):
        assert trial.page.text(name) == wanted.state["now"][name]
    assert wanted.state["line"]["text"] in trial.page.text("says")
    last = palpate.touches(FOUR)[-1]
    assert trial.page.text("number") == digits.number(last.ratio, last.standard_error)
    assert not trial.page["truth"].is_displayed()


def test_a_recording_that_was_cut_is_told(trial: Trial) -> None:
    trial.drop(run_csv=FOUR.read_bytes()[:-9])
    trial.page.until(lambda: trial.page.text("sub") == "run.csv")
    assert "A recording: not verified" in trial.page.text("says")
    told = trial.page.text("messages")
    assert "no sidecar: drop run.json together with run.csv" in told
    assert "bytes after the last complete row, left out" in told


def test_a_recording_that_was_changed_is_told(trial: Trial) -> None:
    changed = FOUR.read_bytes().replace(b"0.6200088", b"0.6200089", 1)
    trial.drop(run_csv=changed, run_json=FOUR.with_suffix(".json").read_bytes())
    trial.page.until(lambda: trial.page.text("sub") == "run.csv")
    assert "the rows were changed after they were written" in trial.page.text("messages")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("table_csv", b"time,a,b\n0,1,2\n1,2,3\n", "palpate live"),
        ("run_csv", b"", "run.csv"),
        ("run_csv", FOUR.read_bytes().replace(b"0.6200088", b"0.62o0088", 1), "run.csv: line 3: got '1,0.026,"),
        ("photo_png", b"\x89PNG\r\n\x1a\n" + bytes(99), "photo.png"),
        ("run_json", b"{}", "NAME.csv"),
    ],
)
def test_what_is_no_recording_is_refused_in_words(trial: Trial, name: str, content: bytes, words: str) -> None:
    before = trial.count
    trial.drop(**{name: content})
    said = trial.refusal()
    assert words in said
    assert "undefined" not in said
    assert "failed" not in said
    assert trial.count == before
    assert trial.page.text("word") == "Demo"


def test_nothing_dropped_and_two_recordings_are_refused(trial: Trial) -> None:
    trial.drop()
    assert "is no file" in trial.refusal()
    trial.drop(FOUR, other_csv=FOUR.read_bytes())
    assert "one" in trial.refusal()


def test_a_port_is_measured_live(trial: Trial) -> None:
    page = trial.page
    lines = labelled(FOUR)
    trial.press("connect")
    page.until(lambda: trial.script("return fake.opened") == {"baudRate": 115200, "bufferSize": 65536})
    trial.feed(["rst:0x1 (POWERON_RESET)", *lines[:200]], LONG_MS)
    page.until(lambda: page.text("word") == "Hold")
    assert page.text("mainname") == "Ratio, touch 1"
    assert float(page.text("number")) > 0
    trial.press("tare")
    assert "Lift the probe" in page.text("answer")
    trial.feed(lines[200:], LONG_MS)
    page.until(lambda: trial.count == len(palpate.touches(FOUR)))
    found = trial.script("return palpate.known.touches.rows.map(({ ratio }) => ratio)")
    assert found == pytest.approx([touch.ratio for touch in palpate.touches(FOUR)], rel=1e-3)
    trial.press("open")  # not while a port is open
    trial.drop(FOUR)
    assert "Disconnect it first" in trial.refusal()
    trial.press("connect")
    page.until(lambda: trial.script("return fake.closed"))
    page.until(lambda: "Connect" in page.text("connect"))
    assert page.text("says").startswith("● Disconnected.")
    trial.press("simulate")
    page.until(lambda: page.text("word") == "Demo")


def test_what_goes_wrong_at_a_port_is_told(trial: Trial) -> None:
    page = trial.page
    lines = labelled(FOUR)
    trial.press("connect")
    page.until(lambda: trial.script("return Boolean(fake.opened)"))
    trial.feed(lines[:50], LONG_MS)
    trial.script("fake.break('FramingError')")
    page.until(lambda: "FramingError" in page.text("answer"))
    trial.feed(lines[50:60], LONG_MS)
    trial.script("fake.now += 4000")
    page.until(lambda: page.text("says").startswith("✕ No data."))
    trial.feed(lines[60:70], LONG_MS)
    page.until(lambda: "No data" not in page.text("says"))
    trial.script("fake.lose()")
    page.until(lambda: page.text("says").startswith("✕ The port is gone."))
    page.until(lambda: "Connect" in page.text("connect"))
    assert "stays here" in page.text("says")
    assert "The port is gone." in page.text("messages")


def test_a_page_that_is_full_says_so(trial: Trial) -> None:
    trial.script("palpate.measuring.most = 40")
    trial.press("connect")
    trial.page.until(lambda: trial.script("return Boolean(fake.opened)"))
    trial.feed(labelled(FOUR)[:41], LONG_MS)  # the first may be a part of a line
    trial.page.until(lambda: trial.page.text("says").startswith("▲ This page is full."))
    assert trial.script("return palpate.store.used") == 40


def test_lines_without_names_are_refused(trial: Trial) -> None:
    trial.press("connect")
    trial.page.until(lambda: trial.script("return Boolean(fake.opened)"))
    trial.feed(["6.92,4.69"] * 30, LONG_MS)
    assert "6.92,4.69" in trial.refusal()
    trial.page.until(lambda: "Connect" in trial.page.text("connect"))
    assert trial.script("return fake.closed")
    assert trial.page.text("says").startswith("✕ The measurement has ended.")


def test_the_simulated_touches_are_played(trial: Trial) -> None:
    page = trial.page
    whole = trial.script("return palpate.known.touches.rows.map(({ ratio }) => ratio)")
    trial.press("play")
    page.until(lambda: page.text("word") == "Wait")
    trial.wait("Hold")
    assert page.text("truthname").startswith("True ratio, ")
    assert "the estimate is " in page.text("off")
    trial.press("pause")
    page.until(lambda: "Looking back" in page.text("says"))
    trial.press("pause")
    trial.wait("Lift")
    while trial.script("return palpate.known.hello.kind") == "live":
        trial.script("fake.now += 3000")
        trial.drawn()
    page.until(lambda: page.text("word") == "Demo")
    assert trial.script("return palpate.known.touches.rows.map(({ ratio }) => ratio)") == whole


def test_a_port_that_is_not_chosen_or_busy(trial: Trial) -> None:
    trial.script("fake.chosen = false")
    trial.press("connect")
    trial.page.until(lambda: trial.page.text("answer") == "No port was chosen.")
    trial.script("Object.assign(fake, { chosen: true, busy: true })")
    trial.press("connect")
    said = trial.refusal()
    assert "2341:0043" in said
    assert "another program" in said


def test_a_browser_without_serial_ports_says_so(page: Browser, file: Path) -> None:
    trial = Trial(page, file)
    trial.open(script="delete Navigator.prototype.serial")
    assert not page["connect"].is_enabled()
    assert "no access to serial ports" in page.text("noport")


def test_the_keys(trial: Trial) -> None:
    page = trial.page
    body = page.driver.find_element("tag name", "body")
    body.send_keys("?")
    shown = {one.text for one in page["keylist"].find_elements("tag name", "kbd")}
    assert {"O", "C", "I", "A", "?"} <= shown
    assert not {"R", "D", "K", "P", "M", "S"} & shown
    trial.script("document.getElementById('keys').close()")
    span = trial.drawn()
    body.send_keys("+")
    closer = trial.drawn()
    assert closer["to"] - closer["from"] < 0.6 * (span["to"] - span["from"])
    body.send_keys("a")
    page.until(lambda: page["readout"].is_displayed())
    body.send_keys("c")
    page.until(lambda: trial.script("return Boolean(fake.opened)"))
    body.send_keys("c")
    page.until(lambda: trial.script("return fake.closed"))
    body.send_keys("i")
    page.until(lambda: page.text("word") == "Demo")


@pytest.mark.parametrize("size", ["desk", "phone"])
def test_looks(trial: Trial, size: str) -> None:
    page = trial.page
    try:
        sized(page, *SIZES[size])
        for theme in ("light", "dark"):
            page.theme(theme)
            wrong: dict[str, Any] = {what: trial.script(script) for what, script in page_looks.CHECKS.items()}
            if size == "phone":
                wrong["small"] = trial.script(page_looks.SMALL)
            assert {what: found for what, found in wrong.items() if found} == {}, theme
        assert page_looks.audit(page.driver) == []
    finally:
        sized(page, *SIZES["desk"])


def test_the_policy_forbids_what_the_page_never_does(page: Browser, file: Path) -> None:
    """The other tests would see a request; this one sees that none could be made."""
    trial = Trial(page, file)
    trial.open()
    page.driver.get_log("browser")
    ask = "fetch(arguments[0]).then(() => arguments[1]('allowed'), () => arguments[1]('refused'))"
    assert page.driver.execute_async_script(ask, trial.address) == "refused"
    assert any("Content Security Policy" in entry["message"] for entry in page.driver.get_log("browser"))
