"""Every button and every key of the page: what the server hears, and what the page then shows."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from live_browser import Browser, browser
from page_cases import CASES
from page_data import MARKS
from page_states import SIZES, Canned, canned, opened, sized
from project import need
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

NOTED = """
window.noted = [];
const marking = document.getElementById("marking");
document.addEventListener("focusout", (event) => event.target.id === "marktext" && noted.push(["let go", marking.hidden]));
new MutationObserver(() => noted.push(["hidden", marking.hidden])).observe(marking, { attributes: true, attributeFilter: ["hidden"] });
"""
"""Notes when the text field of a mark comes, lets the focus go, and goes."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("controls")


@pytest.fixture(scope="module")
def page(folder: Path) -> Iterator[Browser]:
    need("chromium")
    need("chromedriver")
    with browser(folder) as page:
        sized(page, *SIZES["desk"])
        yield page


@pytest.fixture
def idle(page: Browser) -> Iterator[Canned]:
    with canned("idle") as server:
        opened(page, server, "idle")
        yield server


def press(page: Browser, *keys: str) -> None:
    page.driver.switch_to.active_element.send_keys(*keys)


def run(page: Browser, script: str) -> Any:
    return page.driver.execute_script(script)


def heard(page: Browser, server: Canned, command: dict[str, Any]) -> None:
    """Wait until the server has heard a command."""
    page.until(lambda: command in server.heard)


def test_keys_that_are_commands(page: Browser, idle: Canned) -> None:
    keys: list[tuple[str, dict[str, Any]]] = [
        ("t", {"do": "tare"}),
        ("r", {"do": "record"}),
        ("d", {"do": "discard", "touch": 19}),
        ("n", {"do": "specimen", "name": "gel 7"}),
        ("k", {"do": "calibrating", "on": True}),
        ("s", {"do": "noise", "on": True}),
    ]
    for key, command in keys:
        press(page, key)
        heard(page, idle, command)
        assert idle.asked(command["do"]) == [command]
    assert page["noise"].is_displayed()
    press(page, "s")
    heard(page, idle, {"do": "noise", "on": False})
    assert not page["noise"].is_displayed()


def test_keys_of_the_charts(page: Browser, idle: Canned) -> None:
    def window() -> str:
        return str(run(page, "return document.getElementById('timetitle').textContent"))

    live = window()
    press(page, " ")
    page.until(lambda: "Looking back" in page.text("says"))
    for key in (Keys.ARROW_LEFT, "+", "-", Keys.ARROW_RIGHT, "0"):
        before = window()
        press(page, key)
        page.until(lambda before=before: window() != before)
    press(page, "l")
    page.until(lambda: window() == live and "Looking back" not in page.text("says"))
    press(page, "a")
    press(page, "b")
    page.until(lambda: page["readout"].is_displayed())
    press(page, Keys.ESCAPE)
    page.until(lambda: not page["readout"].is_displayed())


def test_keys_that_open_and_close(page: Browser, idle: Canned) -> None:
    for key, name in (("?", "keys"), ("p", "plan"), ("f", "files")):
        press(page, key)
        page.until(lambda name=name: page[name].is_displayed())
        press(page, "r")
        press(page, Keys.ESCAPE)
        page.until(lambda name=name: not page[name].is_displayed())
    assert idle.asked("record") == []
    assert page.driver.switch_to.active_element.get_attribute("id") != "help"
    press(page, "?")
    shown = page.text("keylist")
    for word in ("Tare", "Mark", "Record", "Pause", "Discard", "Next specimen", "Cursors", "Calibrate", "Files"):
        assert word in shown
    press(page, Keys.ESCAPE)


def test_a_button_that_was_pressed_gives_the_keys_back(page: Browser, idle: Canned) -> None:
    page["tare"].click()
    heard(page, idle, {"do": "tare"})
    press(page, " ")
    page.until(lambda: "Looking back" in page.text("says"))
    assert len(idle.asked("tare")) == 1


def test_a_mark_now_with_text_later_or_never(page: Browser, idle: Canned) -> None:
    press(page, "m")
    heard(page, idle, {"do": "mark"})
    page.until(lambda: page["marking"].is_displayed())
    assert page.driver.switch_to.active_element.get_attribute("id") == "marktext"
    page["marktext"].send_keys("wet <b>gel</b>", Keys.ENTER)
    heard(page, idle, {"do": "mark text", "id": 9, "text": "wet <b>gel</b>"})
    assert not page["marking"].is_displayed()
    press(page, "m")
    page.until(lambda: page["marking"].is_displayed())
    press(page, Keys.ESCAPE)
    page.until(lambda: not page["marking"].is_displayed())
    assert len(idle.asked("mark text")) == 1

    rows = page["marks"].find_elements(By.TAG_NAME, "li")
    assert [row.text for row in rows][:2] == ["02:52\nmark: add a text", "02:51\nleft hand"]
    rows[0].find_element(By.TAG_NAME, "button").click()
    page["marktext"].send_keys("later", Keys.ENTER)
    heard(page, idle, {"do": "mark text", "id": len(MARKS), "text": "later"})
    page["note"].send_keys("probe cleaned", Keys.ENTER)
    heard(page, idle, {"do": "note", "text": "probe cleaned"})


def test_an_empty_text_field_gives_the_keys_back_and_goes(page: Browser, idle: Canned) -> None:
    run(page, NOTED)
    press(page, "m")
    page.until(lambda: run(page, "return noted.length") == 3)
    assert run(page, "return noted") == [["hidden", False], ["let go", False], ["hidden", True]]


def test_the_list_of_specimens_typed_and_loaded(page: Browser, idle: Canned, folder: Path) -> None:
    press(page, "p")
    page.until(lambda: page["plan"].is_displayed())
    assert page["list"].get_attribute("value").splitlines()[0] == "70 A; 8.68"
    assert page["operator"].get_attribute("value") == "M. Weber"
    file = folder / "list.csv"
    file.write_text("soft,0.1\nstiff,2\n")
    page["listfile"].send_keys(str(file))
    page.until(lambda: page["list"].get_attribute("value").startswith("soft"))
    page["list"].send_keys("unknown")
    page["wanted"].clear()
    page["wanted"].send_keys("3")
    page["operator"].send_keys(Keys.ENTER)
    text = "soft,0.1\nstiff,2\nunknown"
    heard(page, idle, {"do": "plan", "text": text, "wanted": 3, "title": "gel series 3", "operator": "M. Weber"})
    page["specimens"].find_elements(By.TAG_NAME, "button")[1].click()
    heard(page, idle, {"do": "specimen", "name": "50 A"})
    page["onemore"].click()
    heard(page, idle, {"do": "more"})


def test_a_list_that_is_too_long_is_not_cut(page: Browser, idle: Canned) -> None:
    press(page, "p")
    page.until(lambda: page["plan"].is_displayed())
    run(page, "const list = document.getElementById('list'); list.value = 'specimen; 0.143\\n'.repeat(300)")
    page["list"].send_keys("x")
    page.driver.find_element(By.CSS_SELECTOR, "#plan button.strong").click()
    assert page["plan"].is_displayed()
    assert "4801 characters, allowed: 4000" in page["list"].get_property("validationMessage")
    page.driver.find_element(By.CSS_SELECTOR, "#plan button[value='']").click()
    page.until(lambda: not page["plan"].is_displayed())
    assert not idle.asked("plan")


def test_the_buttons_of_the_session_are_above_a_long_list(page: Browser, idle: Canned) -> None:
    session = idle.state.told["session"]
    many = [{**session["specimens"][0], "name": f"rubber {k}"} for k in range(300)]
    idle.tell("session", **{**session, "specimens": many})
    page.until(lambda: "rubber 299" in page["specimens"].get_property("textContent"))
    below = page["session"].rect["y"] + page["session"].rect["height"]
    for name in ("discard", "onemore", "openplan", "calibrate", "note"):
        assert page[name].rect["y"] + page[name].rect["height"] <= below


def test_any_touch_can_be_assigned_and_left_out(page: Browser, idle: Canned) -> None:
    page.driver.find_element(By.CSS_SELECTOR, "#rows tr[data-touch='17'] button").click()
    page.until(lambda: page.driver.find_elements(By.CSS_SELECTOR, "tr.chosen[data-touch='17']"))
    page.until(lambda: "Touch 17" in page.text("touchtitle"))
    page.driver.find_element(By.CSS_SELECTOR, "tr.chosen select").send_keys("gel 7")
    heard(page, idle, {"do": "assign", "touch": 17, "name": "gel 7"})
    page.driver.find_element(By.CSS_SELECTOR, "tr.chosen td:last-child button").click()
    heard(page, idle, {"do": "discard", "touch": 17})
    press(page, Keys.ESCAPE)
    page.until(lambda: not page.driver.find_elements(By.CSS_SELECTOR, "tr.chosen"))


def test_record_under_the_proposed_name_or_another(page: Browser, idle: Canned) -> None:
    page["openfiles"].click()
    assert page["proposed"].get_attribute("value") == "palpate-2026-11-22-2.csv"
    page["proposed"].send_keys(Keys.CONTROL, "a", Keys.NULL, "gels.csv")  # it keeps the focus: a state changes nothing
    press(page, Keys.ESCAPE)
    page["record"].click()
    heard(page, idle, {"do": "record", "name": "gels.csv"})
    idle.change(CASES["contact"]())
    page.until(lambda: page.text("record").startswith("Recording 03:17 · 7"))
    page["record"].click()
    heard(page, idle, {"do": "stop"})


def test_downloads_and_the_table_as_text(page: Browser, idle: Canned, folder: Path) -> None:
    page["openfiles"].click()
    names = [link.text for link in page["downloads"].find_elements(By.TAG_NAME, "a")]
    assert names == [file["name"] for file in reversed(idle.state.told["state"]["files"])]
    page["downloads"].find_element(By.LINK_TEXT, "probe.toml").click()
    page.until(lambda: (folder / "probe.toml").exists())
    page["csv"].click()
    page.until(lambda: (folder / "touches.csv").exists())
    head, *rows = (folder / "touches.csv").read_text().splitlines()
    assert head.startswith("touch,specimen,start_s,end_s,samples,ratio,")
    assert len(rows) == 19
    ratio = float(rows[0].split(",")[5])
    assert ratio == idle.state.told["touches"]["rows"][0]["ratio"]
    page["copy"].click()
    page.until(lambda: page.text("filesays") != "")
    page["report"].click()
    heard(page, idle, {"do": "report"})


def test_settings_of_the_board(page: Browser, idle: Canned) -> None:
    page["openset"].click()
    page["options"].find_elements(By.TAG_NAME, "select")[0].send_keys("3")
    page["set"].find_element(By.CSS_SELECTOR, "button.strong").click()
    heard(page, idle, {"do": "device", "capf": 3})
    page["centre"].click()
    heard(page, idle, {"do": "centre"})


def test_a_guided_calibration_is_saved_and_used(page: Browser) -> None:
    with canned("calibrate") as server:
        opened(page, server, "calibrate")
        assert "Not enough yet." in page.text("fitwords")
        assert "half_modulus" in page.text("fitwords")

        def button(text: str) -> Any:
            return next(b for b in page["fitwords"].find_elements(By.TAG_NAME, "button") if b.text == text)

        button("Save the calibration").click()
        heard(page, server, {"do": "save calibration"})
        server.tell("calibration", **(server.state.told["calibration"] | {"saved": "probe.toml", "sound": True}))
        page.until(lambda: "Saved as probe.toml" in page.text("fitwords"))
        button("Measure with it").click()
        heard(page, server, {"do": "calibrating", "on": False})
        server.tell("calibration", on=False)
        page.until(lambda: page["touchplot"].is_displayed())


def test_a_refused_tare_can_be_forced(page: Browser) -> None:
    with canned("contact") as server:
        opened(page, server, "contact")
        assert not page["tare"].is_enabled()
        server.tell("refused", message="tare: the probe is in contact; lift it first")
        page.until(lambda: page.text("tare") == "Tare anyway T")
        page["tare"].click()
        heard(page, server, {"do": "tare anyway"})
        page.until(lambda: page.text("tare") == "Tare T" and not page["tare"].is_enabled())
        told = server.state.told
        endless = told["state"] | {"line": told["state"]["line"] | {"what": "endless"}}
        server.change(replace(server.state, told=told | {"state": endless}))
        page.until(lambda: page.text("tare") == "Tare anyway T")


def test_an_ended_measurement_can_begin_again(page: Browser, idle: Canned) -> None:
    told = idle.state.told
    idle.change(replace(idle.state, told=told | {"state": told["state"] | {"state": "ended", "error": "usb: gone"}}))
    page.until(lambda: page["again"].is_displayed())
    assert not page["tare"].is_displayed()
    page["again"].click()
    heard(page, idle, {"do": "again"})


def test_signals_at_the_end_of_a_touch_can_be_switched_off(page: Browser, idle: Canned) -> None:
    def given() -> int:
        return int(run(page, "return document.body.dataset.signals ?? 0"))

    press(page, "?", Keys.ESCAPE)  # a browser lets a page sound only then
    assert given() == 0
    idle.change(CASES["lift"]())
    page.until(lambda: given() == 1)
    assert "flash" in page["state"].get_attribute("class")
    page["sound"].click()
    idle.change(CASES["contact"]())
    idle.change(CASES["flagged"]())
    page.until(lambda: page.text("word") == "Repeat")
    assert given() == 1
    page.driver.refresh()
    page.until(lambda: page.text("word") == "Repeat")
    assert page["sound"].get_attribute("aria-pressed") == "false"
    page["sound"].click()
    assert given() == 1


def test_a_file_can_be_looked_at_and_nothing_is_measured(page: Browser) -> None:
    with canned("file") as server:
        opened(page, server, "file")
        assert [name for name in ("tare", "mark", "record", "pause") if page[name].is_enabled()] == []
        press(page, "t", "m", "r")
        page.driver.find_element(By.CSS_SELECTOR, "#rows tr[data-touch='3'] button").click()
        page.until(lambda: page.text("mainname") == "Modulus, touch 3")
        assert [command["do"] for command in server.heard if command["do"] not in ("view", "trace")] == []
