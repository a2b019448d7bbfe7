"""Every button and every key of the page: what the server hears, and what the page then shows."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from live_browser import Browser
from page_data import MARKS, state
from page_states import Canned
from palpate.live.plan import specimens_of
from palpate.live.protocol import RefusedCommand
from palpate.materials import shore_a_of_modulus
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

Shown = Callable[..., Canned]
LOOKING = "Looking back"


def heard(page: Browser, server: Canned, **command: Any) -> None:
    """Wait until the server has heard a command."""
    page.until(lambda: command in server.heard)


# What is done (pressed: no place; typed into a place; or clicked: no text), and the command that the server hears then.
ORDERS: list[tuple[list[tuple[str, str]], dict[str, Any]]] = [
    ([("", "t")], {"do": "tare"}),
    ([("", "d")], {"do": "discard", "touch": 19}),
    ([("", "n")], {"do": "specimen", "name": "gel 7"}),
    ([("#specimens tr:nth-of-type(2) button", "")], {"do": "specimen", "name": "50 A"}),
    ([("#onemore", "")], {"do": "more"}),
    ([("#note", "probe cleaned\n")], {"do": "note", "text": "probe cleaned"}),
    ([("", "m"), ("#marktext", "wet <b>gel</b>\n")], {"do": "mark text", "id": 9, "text": "wet <b>gel</b>"}),
    ([("#marks li button", ""), ("#marktext", "later\n")], {"do": "mark text", "id": len(MARKS), "text": "later"}),
    ([("#rows tr[data-touch='17'] button", ""), ("tr.chosen select", "gel 7")], {"do": "assign", "touch": 17, "name": "gel 7"}),
    ([("#rows tr[data-touch='17'] button", ""), ("tr.chosen td:last-child button", "")], {"do": "discard", "touch": 17}),
    ([("", "f"), ("#report", "")], {"do": "report"}),
    ([("#device summary", ""), ("#openset", ""), ("#options select", "3"), ("#set button.strong", "")], {"do": "device", "capf": 3}),
    ([("#centre", "")], {"do": "centre"}),
    ([("", "r")], {"do": "record"}),
    ([("", "k")], {"do": "calibrating", "on": True}),
    ([("", "s")], {"do": "noise"}),
]  # fmt: skip


def test_every_order(page: Browser, idle: Canned) -> None:
    for steps, command in ORDERS:
        for place, text in steps:
            if not place:
                page.press(text)
                continue
            page.until(lambda place=place: page.all(place) and page.all(place)[0].is_displayed())
            found = page.all(place)[0]
            found.send_keys(text) if text else found.click()
        page.until(lambda command=command: idle.asked(command["do"])[-1:] == [command])
        page.press(Keys.ESCAPE)
    assert idle.asked("mark") == [{"do": "mark"}]
    marks = [row.text for row in page["marks"].find_elements(By.TAG_NAME, "li")]
    assert marks[:2] == ["02:52\nmark: add a text", "02:51\nleft hand"]


def test_keys_that_open_and_close(page: Browser, idle: Canned) -> None:
    for key, name in (("?", "keys"), ("p", "plan"), ("f", "files")):
        page.press(key)
        page.until(lambda name=name: page[name].is_displayed())
        page.press("r")
        page.press(Keys.ESCAPE)
        page.until(lambda name=name: not page[name].is_displayed())
    assert idle.asked("record") == []
    page["tare"].click()
    heard(page, idle, do="tare")
    page.press(" ")  # a button that was pressed gives the keys back
    page.until(lambda: LOOKING in page.text("says"))
    assert len(idle.asked("tare")) == 1


def test_single_keys_can_be_switched_off(page: Browser, idle: Canned) -> None:
    page.choose("keys", "off")
    page.driver.refresh()  # it is remembered
    page.until(lambda: page.all("#rows button"))
    page.run("document.querySelector('#rows button').focus()")
    page.press("t", "?", Keys.ARROW_DOWN)
    page.until(lambda: page.run("return document.activeElement.textContent") == "18")
    assert not page["keys"].is_displayed()
    page.choose("keys", "on")
    page.press("m")
    page.until(lambda: idle.asked("mark"))
    assert idle.asked("tare") == []


def test_the_list_of_specimens_typed_and_loaded(
    page: Browser, idle: Canned, tmp_path: Path
) -> None:
    """What was typed stays until it is used, also after Esc, and when the page is loaded again."""
    page.press("p")
    page.until(lambda: page["plan"].is_displayed())
    assert page["list"].get_attribute("value").splitlines()[0] == "70 A; 8.68 MPa"
    (tmp_path / "list.csv").write_text("soft,0.1\nstiff,2\n")
    page["listfile"].send_keys(str(tmp_path / "list.csv"))
    page.until(lambda: page["list"].get_attribute("value").startswith("soft"))
    page["list"].clear()
    page["list"].send_keys("soft; 0.1; 5 %")
    page.until(lambda: page["listread"].get_property("textContent") == "0.1 MPa ± 5 %")
    page["list"].clear()
    page["list"].send_keys("soft,0.1\nunknown")
    page["wanted"].clear()
    page["wanted"].send_keys("3")
    page.until(lambda: page["listread"].get_property("textContent") == "0.1 MPa\nnot known")
    page.press(Keys.ESCAPE)
    page.driver.refresh()
    page.until(lambda: page["openplan"].is_displayed() and page.text("sessiontitle"))
    page.click("openplan")  # what was typed is there still
    assert page.text("listwrong") == "Typed before, and not in use yet."
    page["wanted"].send_keys(Keys.ENTER)
    heard(
        page, idle, do="plan", text="soft,0.1\nunknown", unit="MPa", wanted=3, title="gel series 3"
    )
    page.until(lambda: not page["plan"].is_displayed())


def test_a_wrong_list_of_specimens_stays_with_its_reasons(
    page: Browser, idle: Canned, tmp_path: Path
) -> None:
    typed = "soft; 0.1\nstiff; 2,5.1\n\nsoft"
    with pytest.raises(RefusedCommand) as refused:
        specimens_of(typed, 4)
    idle.answers["plan"] = {"type": "refused", "message": str(refused.value)}
    page.press("p")
    page["list"].clear()
    page["list"].send_keys(typed)
    page.all("#plan button.strong")[0].click()
    page.until(
        lambda: "line 2: " in page.text("listwrong") and "line 4: " in page.text("listwrong")
    )
    assert (page["list"].get_property("value"), page["list"].get_property("selectionStart")) == (
        typed,
        10,
    )
    page.until(
        lambda: page["list"].value_of_css_property("background-image").count("gradient") == 2
    )
    del idle.answers["plan"]
    page["list"].send_keys("x")
    assert (page.text("listwrong"), page["list"].get_attribute("aria-invalid")) == ("", "true")
    page.all("#plan button.strong")[0].click()
    page.until(lambda: not page["plan"].is_displayed())


def test_record_under_the_proposed_name_or_another(page: Browser, idle: Canned) -> None:
    page.click("openfiles")
    assert page["proposed"].get_attribute("value") == "palpate-2026-11-22-2.csv"
    # it keeps the focus: a state changes nothing
    page["proposed"].send_keys(Keys.CONTROL, "a", Keys.NULL, "gels.csv")
    page.press(Keys.ESCAPE)
    page["record"].click()
    heard(page, idle, do="record", name="gels.csv")
    idle.change(state("contact"))
    page.until(lambda: page.text("record").startswith("Recording 03:17 · 7"))
    page["record"].click()
    heard(page, idle, do="stop")


def test_settings_are_remembered_and_followed(page: Browser, idle: Canned) -> None:
    """The unit by the page, its lists and its text; the heads of reports by the server."""
    page.press(",")
    page.until(lambda: page["settings"].is_displayed())
    for name, value in (("unit", "kPa"), ("shore", "on")):
        page.choose(name, value)
    page.all("[name=probe]")[0].send_keys("P3, domes 40 A / 6 A", Keys.ENTER)
    heard(
        page,
        idle,
        do="settings",
        unit="kPa",
        shore=True,
        probe="P3, domes 40 A / 6 A",
        site="",
        operator="",
    )
    page.driver.refresh()
    page.until(lambda: page.text("unit") == "kPa" and page.text("number") == "134")
    assert page.text("range").startswith(
        "between 112 and 156 kPa · ratio "
    )  # softer than Shore A reaches
    assert [cell.text for cell in page.all("#specimens td:nth-child(2)")] == [
        "8680",
        "2180",
        "870",
        "289",
        "143",
        "?",
    ]
    heads = page.run(
        "return [...document.querySelectorAll('th.unit')].map((one) => one.textContent)"
    )
    assert heads == ["kPa", "kPa"]
    page.press("p")
    page.until(
        lambda: (
            page["listread"].get_property("textContent").startswith("8680 kPa\n2180 kPa ± 5 %\n")
        )
    )
    assert page["list"].get_property("value").startswith("70 A; 8680 kPa\n50 A; 2180 kPa; 5 %\n")
    table = page.downloads / "touches.csv"
    table.unlink(missing_ok=True)
    page.click("csv")
    page.downloaded("touches.csv")
    first = next(csv.DictReader(table.read_text().splitlines()))
    mega = idle.state.told["touches"]["rows"][0]["modulus"]["value_MPa"]
    assert float(first["modulus_kPa"]) == pytest.approx(1000 * mega)
    assert float(first["shore_A"]) == pytest.approx(shore_a_of_modulus(mega))


def test_the_end_of_a_plan_says_what_is_next(page: Browser, shown: Shown) -> None:
    server = shown("done", depth="measure")
    assert page.text("says").startswith("✓ 24 of 24 done.")
    page["endfile"].click()
    heard(page, server, do="stop")
    page.all("#ending [data-press=openplan]")[0].click()
    page.until(lambda: page["plan"].is_displayed())
    page.press(Keys.ESCAPE)
    page.press("n")
    heard(page, server, do="specimen", name="")


def test_the_text_of_a_mark_is_never_lost(page: Browser, idle: Canned) -> None:
    """A fault takes the row of the line: the field goes on in the list, with its text and the keys; Esc sends it."""
    page.press("m")
    page.until(lambda: page["marking"].is_displayed())
    page["marktext"].send_keys("tare ")
    idle.change(state("unplugged"))
    page.until(lambda: page.text("says").startswith("✕ Unplugged."))
    page.press("rig", Keys.ESCAPE)
    heard(page, idle, do="mark text", id=9, text="tare rig")


def test_downloads_and_the_table_as_text(page: Browser, idle: Canned) -> None:
    page.click("openfiles")
    names = [link.text for link in page["downloads"].find_elements(By.TAG_NAME, "a")]
    assert names == [file["name"] for file in reversed(idle.state.told["state"]["files"])]
    table = page.downloads / "touches.csv"
    table.unlink(missing_ok=True)
    page["csv"].click()
    page.downloaded("touches.csv")
    head, *rows = table.read_text().splitlines()
    assert head.startswith("touch,specimen,start_s,end_s,samples,ratio,")
    assert [float(row.split(",")[5]) for row in rows] == [
        row["ratio"] for row in idle.state.told["touches"]["rows"]
    ]
    page["copy"].click()
    page.until(lambda: page.text("filesays") != "")


def test_a_guided_calibration_is_saved_and_used(page: Browser, shown: Shown) -> None:
    server = shown("calibrate")
    assert "Not enough yet." in page.text("fitwords")
    assert "half-way at" in page.text("fitwords")

    def button(text: str) -> Any:
        return next(one for one in page.all("#fitwords button") if one.text == text)

    button("Save the calibration").click()
    heard(page, server, do="save calibration")
    fit = server.state.told["calibration"]
    look = "Look at touches 5 to 8: 40 A and 60 A seem to be exchanged."
    doubt = "The measured ratio does not rise with the modulus between 1.54 and 3.46 MPa."
    server.tell("calibration", **fit | {"verdict": look, "sound": False, "doubts": [doubt]})
    page.until(lambda: look in page.text("fitwords"))
    assert f"▲ {doubt}" in page.text("fitwords")
    assert "strong" not in button("Save the calibration").get_attribute("class")  # no green light
    assert page.run("return document.getElementById('wizardend').textContent").startswith(look)
    page.choose("unit", "kPa")
    page.until(lambda: "between 1540 and 3460 kPa" in page.text("fitwords"))
    assert look in page.text("fitwords")  # other numbers stay
    page.choose("unit", "MPa")
    server.tell("calibration", **fit | {"saved": "Saved as probe.toml.", "sound": True})
    page.until(lambda: "✓ Saved as probe.toml." in page.text("fitwords"))
    server.tell("calibration", on=False)
    page.until(lambda: page["touchplot"].is_displayed())


def test_a_verification_is_shown_and_kept_by_its_button(page: Browser, idle: Canned) -> None:
    assert not page["verification"].is_displayed()
    text = "gel (1.10 MPa) measures 1.30 MPa: the calibration does not hold any more."
    idle.tell("verification", text=text, agrees=False, kept=False)
    page.until(lambda: page["verify"].is_displayed())
    assert page.text("verificationtext") == text
    page["verify"].click()
    heard(page, idle, do="verify")
    idle.tell("verification", text=text, agrees=False, kept=True)
    page.until(lambda: not page["verify"].is_displayed())
    assert page["verification"].is_displayed()
    idle.tell("verification", text="", agrees=True, kept=False)
    page.until(lambda: not page["verification"].is_displayed())


def test_a_refused_tare_can_be_forced_and_an_ended_measurement_begins_again(
    page: Browser, shown: Shown
) -> None:
    server = shown("contact")
    server.answers["tare"] = {
        "type": "refused",
        "message": "tare: the probe is in contact; lift it first",
    }
    page.press("t")
    page.until(lambda: page.text("answer") == "tare: the probe is in contact; lift it first")
    page.until(lambda: page.text("tare") == "Tare anyway T")
    page["tare"].click()
    heard(page, server, do="tare anyway")
    page.until(lambda: page.text("tare") == "Tare T")
    told = server.state.told["state"]
    server.tell("state", **told | {"line": told["line"] | {"what": "touched"}})
    page.until(lambda: page.text("tare") == "Tare anyway T")
    server.tell("state", **told | {"state": "ended"})
    page.until(lambda: page["again"].is_displayed() and not page["tare"].is_displayed())
    page["again"].click()
    heard(page, server, do="again")


def test_signals_at_the_end_of_a_touch_can_be_switched_off(page: Browser, idle: Canned) -> None:
    def given() -> int:
        return int(page.run("return flashes"))

    page.run("window.flashes = 0; document.all.state.animate = () => flashes++")
    page.press("?", Keys.ESCAPE)  # a browser lets a page sound only then
    assert given() == 0
    idle.change(state("lift"))
    page.until(lambda: given() == 1)
    page.choose("signals", "off")
    idle.change(state("contact"))
    idle.change(state("flagged"))
    page.until(lambda: page.text("word") == "Repeat")
    assert given() == 1
    page.driver.refresh()
    page.until(lambda: page.text("word") == "Repeat")
    assert page.run("return document.querySelector('[name=signals]:checked').value") == "off"


def test_a_file_can_be_looked_at_and_nothing_is_measured(page: Browser, shown: Shown) -> None:
    server = shown("file")
    assert [name for name in ("tare", "mark", "record", "pause") if page[name].is_displayed()] == []
    page.press("t", "m", "r", "d", "k")
    page.all("#rows tr[data-touch='3'] button")[0].click()
    page.until(lambda: page.text("mainname") == "Touch 3")
    assert {command["do"] for command in server.heard} <= {"view", "settings"}
