"""Measure, the first depth of the page: what is read from 2 m, the scale, the object, the wizard, its keys."""

from collections.abc import Callable
from typing import Any

import page_looks
import pytest
from effort import ALL
from live_browser import SIZES, Browser
from page_data import CASES, state
from page_states import Canned
from selenium.webdriver.common.keys import Keys

Shown = Callable[..., Canned]
SEEN = [size for size in SIZES if size != "tablet"] if ALL else ["desk", "phone", "small"]
LOOKS = {
    "sideways": page_looks.SIDEWAYS,
    "cut": page_looks.CUT,
    "crossed": page_looks.CROSSED,
    "overlaps": page_looks.OVERLAPS,
}
TAPPED = ("phone", "lying", "small")  # sizes


def wrong_in(page: Browser, size: str) -> dict[str, Any]:
    """Return what is wrong with the looks of Measure."""
    checks = LOOKS | ({"small": page_looks.SMALL} if size in TAPPED else {})
    return {what: found for what, script in checks.items() if (found := page.run(script))}


def say(server: Canned, kind: str, **document: Any) -> None:
    """Send a message, and send it again with each state."""
    server.state.told[kind] = document
    server.tell(kind, **document)


@pytest.mark.parametrize("name", CASES)
def test_measure_at_each_size(page: Browser, shown: Shown, name: str) -> None:
    """Nothing is cut, crossed or hard to read; at a desk all that matters is read from 2 m."""
    told = shown(name, depth="measure").state.told["state"]
    alarmed = told["now"]["tone"] in ("fault", "caution")
    assert page["remedy"].is_displayed() == alarmed
    assert page["reading"].is_displayed() != alarmed
    if alarmed:
        assert page.text("reason") == told["line"]["title"].removesuffix(".")
        assert page.text("remedyhow").lower() == told["now"]["sub"].lower()
    fonts = page.run(page_looks.FAR, page_looks.FAR_TEXTS)
    assert {name: px for name, px in fonts.items() if px * page_looks.CAPITAL < page_looks.FAR_PX} == {}  # fmt: skip
    for number, size in enumerate(SEEN):
        page.size(size)
        page.theme(("light", "dark")[number % 2])
        page.drawn()
        assert wrong_in(page, size) == {}, size
    assert page_looks.audit(page.driver) == []


def test_the_number_is_large_and_never_cut(page: Browser, shown: Shown) -> None:
    """A quarter of the height of the window; a long one shrinks to its box."""
    server = shown("contact", depth="measure")
    assert float(page.run("return parseFloat(getComputedStyle(figure).fontSize)")) == pytest.approx(200, abs=1)  # fmt: skip
    assert page.text("between") == "between 0.114 and 0.158 MPa"
    told = server.state.told["state"]
    long = {"text": "12345.678 MPa (12345.000 to 12346.000)", "value_MPa": 12345.678, "low_MPa": 12345.0, "high_MPa": 12346.0}  # fmt: skip
    say(server, "state", **told | {"modulus": told["modulus"] | long})
    page.until(lambda: page.text("value") == "12345.678")
    assert wrong_in(page, "desk") == {}
    assert page.run("return figure.scrollWidth <= reading.clientWidth")
    stiffer = {"text": "stiffer than 8.70 MPa", "value_MPa": None, "low_MPa": 8.7, "high_MPa": None}
    say(server, "state", **told | {"modulus": told["modulus"] | stiffer})
    page.until(lambda: page.text("value") == "> 8.70")
    assert page.text("between") == "stiffer than this probe can tell"


def test_beyond_the_scale_is_an_arrow(page: Browser, shown: Shown) -> None:
    server = shown("contact", depth="measure")
    assert len(page.all("#scale .bar")) == 1
    assert page.all("#scale .arrow") == []
    told = server.state.told["state"]
    stiff = {"text": "90.0 MPa (80.0 to 100.0)", "value_MPa": 90.0, "low_MPa": 80.0, "high_MPa": 100.0}  # fmt: skip
    say(server, "state", **told | {"modulus": told["modulus"] | stiff})
    page.until(lambda: len(page.all("#scale .arrow")) == 1)
    assert page.all("#scale .bar") == []
    bar = page.run("return palpate.known.state.modulus.low_MPa")
    assert bar == 80.0
    assert "stiffer than all of it" in page.all("#scale svg")[0].get_attribute("aria-label")


def test_many_long_names_never_lie_over_each_other(page: Browser, shown: Shown) -> None:
    server = shown("contact", depth="measure")
    session = server.state.told["session"]
    one = session["specimens"][0]
    names = ["left lobe of the liver", "right lobe of the liver", *(f"specimen {k}" for k in range(14))]  # fmt: skip
    many = [one | {"name": name, "modulus": 0.2 * 1.15**k} for k, name in enumerate(names)]
    following = {"name": names[1], "modulus": 0.23, "nth": 1, "of": 4}
    say(server, "session", **session | {"specimens": many, "next": following})
    idle = state("idle").told["state"]
    say(server, "state", **idle)
    for size in SIZES:
        page.size(size)
        page.until(lambda: page.text("objectname") == names[1])
        page.drawn()
        assert wrong_in(page, size) == {}, size


def test_a_slot_is_left_out_and_taken_back(page: Browser, shown: Shown) -> None:
    """By a tap, also on a phone; D and Leave out mean the touch that is shown."""
    server = shown("flagged", "phone", depth="measure")
    slots = page.all("#touchslots li")
    assert [slot.get_attribute("class") for slot in slots] == ["done", "out", "here", "", ""]
    page.all("#touchslots button")[0].click()
    page.until(lambda: server.asked("discard") == [{"do": "discard", "touch": 19}])
    page.all("#touchslots button")[1].click()
    page.until(lambda: server.asked("keep") == [{"do": "keep", "touch": 20}])
    page.press("3")
    page.until(lambda: page["leave"].is_displayed())
    assert page.text("leave") == "Take 20 back"
    page.run("""document.querySelector("#rows tr[data-touch='1'] button").click()""")
    page.until(lambda: page.text("leave") == "Leave 1 out")
    page["leave"].click()
    page.until(lambda: server.asked("discard")[-1] == {"do": "discard", "touch": 1})


def test_next_by_key_by_pedal_and_by_pill(page: Browser, shown: Shown) -> None:
    server = shown("idle", depth="measure")
    pills = [one.text for one in page.all("#pills li")]
    assert pills == ["✓ 70 A", "✓ 50 A", "✓ 30 A", "✓ 50 OO", "30 OO", "gel 7"]
    for count, key in enumerate(("n", Keys.ENTER, Keys.PAGE_DOWN), 1):
        page.press(key)
        page.until(lambda count=count: len(server.asked("specimen")) == count)
    assert {one["name"] for one in server.asked("specimen")} == {"gel 7"}
    page.all("#pills button")[1].click()
    page.until(lambda: server.asked("specimen")[-1] == {"do": "specimen", "name": "50 A"})
    page["more"].click()
    page["fullscreen"].click()
    page.until(lambda: page.run("return Boolean(document.fullscreenElement)"))
    page.press(Keys.SHIFT + "f" + Keys.NULL)
    page.until(lambda: page.run("return !document.fullscreenElement"))


def test_the_depths_by_key_and_address(page: Browser, shown: Shown) -> None:
    server = shown("idle", depth="measure")
    for key, name in (("2", "explain"), ("3", "lab"), ("1", "measure")):
        page.press(key)
        page.until(lambda name=name: page[name].is_displayed())
        assert page.driver.current_url == f"{server.address}#{name}"
    page.driver.get(server.address)
    page.driver.refresh()
    page.until(lambda: page.text("verb") == "Touch")
    page["more"].click()
    page.all("#menu [data-depth=start]")[0].click()
    page.until(lambda: page["start"].is_displayed())
    assert page.text("board") == "AD7746 kit, USB 1/4: ready."
    say(server, "recordings", files=[{"name": "gel <i>.csv", "changed_s": 1.8e9}])
    page.until(lambda: page.all("#recordings button"))
    [name, time] = page.all("#recordings button > *")
    assert name.text == "gel <i>.csv"
    assert "2027" in time.text
    assert page_looks.audit(page.driver) == []


def test_the_card_of_the_end_stays_until_it_is_left(page: Browser, shown: Shown) -> None:
    server = shown("done", depth="measure")
    assert page.text("mean") == "Your hand: ± 2.7 % from touch to touch"
    assert "5 of 5 known moduli are in their intervals" in page.text("spread")
    told = server.state.told
    say(server, "session", **told["session"] | {"done": None, "next": None})
    say(server, "state", **state("contact").told["state"])
    page.until(lambda: page.text("verb") == "Hold")
    assert page["ending"].is_displayed()
    page.press("n")
    page.until(lambda: server.asked("specimen") == [{"do": "specimen", "name": ""}])
    page.until(lambda: not page["ending"].is_displayed())


def test_the_wizard_ends_in_a_sentence_and_a_button(page: Browser, shown: Shown) -> None:
    server = shown("calibrate", depth="measure")
    steps = [one.get_attribute("class") for one in page.all("#steps li")]
    assert steps == ["done", "here", ""]
    assert page.text("wizardend").startswith("Not enough yet.")
    assert not page["wizardsave"].is_displayed()
    good = server.state.told["calibration"] | {"sound": True, "verdict": "Good."}
    say(server, "calibration", **good)
    page.until(lambda: page["wizardsave"].is_displayed())
    page["wizardsave"].click()
    page.until(lambda: server.asked("save calibration"))
    say(server, "calibration", **good | {"saved": "Saved as probe.toml."})
    page.until(lambda: page.text("wizardend") == "Good. Saved as probe.toml.")
    session = server.state.told["session"]
    say(server, "session", **session | {"specimens": [], "next": None})
    page.until(lambda: page.all("#steps button"))
    page.all("#steps button")[0].click()
    page.until(lambda: page["plan"].is_displayed())


def test_a_remedy_has_its_button(page: Browser, shown: Shown) -> None:
    server = shown("idle", depth="measure")
    told = server.state.told["state"]
    lost = {
        "now": {"word": "Tare", "sub": "lift the probe, then press T", "tone": "fault", "share": None},
        "line": told["line"] | {"what": "baseline", "level": "fault", "title": "Baseline lost."},
    }  # fmt: skip
    say(server, "state", **told | lost)
    page.until(lambda: page["remedydo"].is_displayed())
    page["remedydo"].click()
    page.until(lambda: server.asked("tare"))
    say(server, "state", **told | {"state": "ended"})
    page.until(lambda: page["againhere"].is_displayed())
    page.press("n")
    page.until(lambda: server.asked("again"))


def test_hostile_names_stay_words_in_measure(page: Browser, shown: Shown) -> None:
    evil = "<img src=x onerror=alert(1)>"
    server = shown("contact", depth="measure")
    session = server.state.told["session"]
    specimens = [one | {"name": evil} for one in session["specimens"]]
    following = session["next"] | {"name": evil}
    say(server, "session", **session | {"specimens": specimens, "next": following})
    say(server, "state", **server.state.told["state"] | {"on": evil})
    page.until(lambda: page.text("objectname") == evil)
    assert page.all("img") == []
