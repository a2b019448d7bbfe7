"""The page in each of its states: words, places, sizes, contrast, and what a screen reader finds."""

import json
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import page_looks
import pytest
from effort import ALL, NIGHTLY
from live_browser import SIZES, Browser
from page_data import CASES, state
from page_states import Canned
from palpate.live.app import page_files
from selenium.common.exceptions import TimeoutException

Shown = Callable[..., Canned]
SEEN = list(SIZES) if ALL else ["desk", "phone"]
THOROUGH = list(CASES) if NIGHTLY else ["contact", "calibrate", "file", "unplugged", "flagged"]
"""The states that axe looks at, in light and dark colours, which takes a second each."""
OVER = {
    "plan": "openplan",
    "files": "openfiles",
    "settings": "opensettings",
    "set": "openset",
    "keys": "help",
    "menu": "more",
    "marking": "mark",
}
"""What opens over the page, and the button that opens it."""


def written(page: Browser, name: str) -> str:
    """Return the text of an element, also of one that is not shown."""
    return str(page.run("return document.getElementById(arguments[0]).textContent", name))


def wrong_in(page: Browser, size: str) -> dict[str, Any]:
    """Return what is wrong with the looks of the page."""
    checks = page_looks.CHECKS | (
        {"small": page_looks.SMALL} if size in ("phone", "lying", "small") else {}
    )
    return {what: found for what, script in checks.items() if (found := page.run(script))}


@pytest.mark.parametrize("name", CASES)
def test_a_state_at_each_size(page: Browser, shown: Shown, name: str) -> None:
    """Words; nothing cut, no sideways scrolling; contrast; what is tapped is large enough; the table above the fold."""
    told = shown(name).state.told["state"]
    line, now, looks_back = told["line"], told["now"], name == "review"
    word = ("20", "touches") if name == "file" else (now["word"], now["sub"])
    assert (page.text("word"), page.text("sub")) == word
    assert page["line"].get_attribute("data-level") == ("note" if looks_back else line["level"])
    fault = line["level"] == "fault"
    assert page.driver.title.startswith(f"✕ {line['title'][:-1]}" if fault else now["word"])
    assert max(page.run(page_looks.NEWEST)) <= 800
    for number, size in enumerate(SEEN):
        page.size(size)
        page.theme(("light", "dark")[number % 2])
        assert ("Measuring and recording go on" if looks_back else line["text"]) in page.text(
            "says"
        )
        assert ("Looking back at " if looks_back else line["title"]) in page.text("says")
        assert wrong_in(page, size) == {}, size
        if name in THOROUGH:
            assert page_looks.audit(page.driver) == []


@pytest.mark.parametrize("size", ["phone", "desk"])
def test_what_opens_over_the_page(page: Browser, shown: Shown, size: str) -> None:
    for name, opener in OVER.items():
        if name == "menu" and size == "desk":
            continue
        shown("contact", size)
        page.click(opener)
        page.until(lambda name=name: page[name].is_displayed())
        assert wrong_in(page, size) == {}, name
        if size == "phone" or ALL:
            assert page_looks.audit(page.driver) == [], name


@pytest.mark.parametrize("size", [size for size in SIZES if size != "tablet"])
def test_nothing_is_cut_or_hard_to_read_at_the_six_sizes(
    page: Browser, shown: Shown, size: str
) -> None:
    """In light and dark, with the largest numbers: a ratio with its uncertainty, a modulus with its unit, the end of a plan."""
    for name, unit in (("bare", "MPa"), ("contact", "kPa"), ("done", "MPa")):
        server = shown(name, size)
        page.choose("unit", unit)
        page.choose("shore", "on")
        if name == "bare":
            told = server.state.told
            told["hello"]["calibrated"] = False
            ratio = {
                "state": "contact",
                "ratio": 10.138,
                "standard_error": 0.01,
                "uncertainty": 0.304,
                "uncertainty_from": "assumed",
            }
            server.tell("state", **told["state"] | ratio)
            page.until(lambda: "± 0.30" in page.text("range"))
        for theme in ("light", "dark"):
            page.theme(theme)
            assert (name, theme, wrong_in(page, size)) == (name, theme, {})
            if theme == "dark" or ALL:
                assert page_looks.audit(page.driver) == []


def test_the_checks_find_what_is_wrong(page: Browser, shown: Shown) -> None:
    shown("contact", "phone")
    styles = {
        "sub": "width: 20px; overflow: hidden; color: #3a80c0",
        "word": "width: 900px",
        "now": "overflow: visible",
        "more": "min-height: 20px; height: 20px",
    }
    for name, style in styles.items():
        page.run("document.getElementById(arguments[0]).style = arguments[1]", name, style)
    found = wrong_in(page, "phone")
    assert found["sideways"] > 0
    for what, name in (("cut", "#sub"), ("small", "#more")):
        assert any(text.startswith(name) for text in found[what])
    page.run(
        "const { note } = document.all; note.removeAttribute('aria-label'); note.placeholder = ''"
    )
    assert {name for name, _ in page_looks.audit(page.driver)} >= {"color-contrast", "label"}


def contrast(*colours: str) -> float:
    """Return the contrast of two colours, #rgb or #rrggbb, by WCAG 2."""
    light = []
    for colour in colours:
        digits = colour[1:] if len(colour) == 7 else "".join(2 * digit for digit in colour[1:])
        parts = [int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4)]
        red, green, blue = (
            part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
        )
        light.append(0.2126 * red + 0.7152 * green + 0.0722 * blue)
    return (max(light) + 0.05) / (min(light) + 0.05)


def test_texts_and_lines_stand_out() -> None:
    """Texts by 4.5, lines by 3, in light and dark colours: also those in charts, at which axe does not look."""
    colours: dict[str, str] = {}
    for block in re.findall(r":root[^{]*{([^}]*)}", page_files()["/page.css"][0].decode()):
        colours |= dict(re.findall(r"--([\w-]+): (#\w{3,6});", block))
        for text in ("ink", "quiet", "bad"):
            assert contrast(colours[text], colours["card"]) >= 4.5, text
        for line in ("hard", "soft", "ratio", "past", "edge"):
            assert contrast(colours[line], colours["card"]) >= 3, line
        for fill in ("busy", "good", "caution", "fault"):
            assert contrast(colours[f"on-{fill}"], colours[fill]) >= 4.5, fill
    assert contrast("#000", "#ffffff") == pytest.approx(21)


@pytest.mark.parametrize("size", SEEN)
def test_messages_do_not_move_the_charts(page: Browser, shown: Shown, size: str) -> None:
    server = shown("contact", size)
    before = page.settled(page_looks.PLACES)
    for name in ("idle", "lift", "flagged", "unplugged", "slow"):
        other = state(name)
        server.change(other)
        page.until(lambda other=other: other.told["state"]["line"]["text"] in written(page, "says"))
        for answer in (
            "",
            "tare: the probe is in contact; lift it first. If nothing is touched, press it again",
        ):
            server.tell("refused", message=answer)
            page.until(lambda answer=answer: written(page, "answer") == answer)
            with suppress(TimeoutException):  # state and touches are two messages
                page.until(lambda: page.run(page_looks.PLACES) == before)
            assert page.run(page_looks.PLACES) == before, (name, answer)


def test_the_screen_reader_hears_what_has_settled(page: Browser, shown: Shown) -> None:
    server = shown("contact")

    assert (written(page, "announced"), written(page, "alarm")) == ("Hold: 2.5 s more", "")
    watch = "new MutationObserver(() => said++).observe(document.all.announced, { childList: true, subtree: true })"
    page.run(f"window.said = 0; {watch}")
    told = server.state.told["state"]
    for share in (0.63, 0.64, 0.65):
        # it is sent again each second
        server.state.told["state"] = told | {"now": told["now"] | {"share": share}}
        server.tell("state", **server.state.told["state"])
    page.until(lambda: page.run("return document.querySelector('#bar b').style.width") == "65%")
    assert page.run("return said") == 0
    server.change(state("unplugged"))
    page.until(
        lambda: written(page, "alarm").startswith("Unplugged. The board at USB 1/4 is gone.")
    )
    assert len(page.all("[role=status], [role=alert]")) == 4


def test_colours_are_remembered(page: Browser, shown: Shown) -> None:
    for theme in ("dark", "light"):
        shown("idle", theme=theme)
        page.driver.refresh()
        page.until(lambda: page.text("word") == "Touch")
        assert page.run("return document.documentElement.dataset.theme") == theme


def test_hostile_words_stay_words(page: Browser, idle: Canned) -> None:
    evil = "<img src=x onerror=alert(1)>"
    told = json.loads(json.dumps(idle.state.told).replace("30 OO", evil).replace("Ready.", evil))
    idle.change(replace(idle.state, told=told))
    page.until(lambda: all(evil in page.text(name) for name in ("nextname", "says", "specimens")))
    assert page.all("img") == []
    differ = {
        "most_reliable": 19,
        "together": {"agree": False, "text": f"the 3 touches differ {evil}", "modulus": None},
    }
    idle.tell("touches", **told["touches"] | differ)
    page.until(lambda: evil in page.text("together"))
    assert page["together"].get_attribute("data-agree") == "no"
    assert [row.get_attribute("data-touch") for row in page.all("#rows tr.best")] == ["19"]
    assert page.all("img") == []
