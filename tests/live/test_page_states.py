"""The page in each of its states: words, places, sizes, contrast, and what a screen reader finds."""

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import page_looks
import pytest
from effort import ALL, NIGHTLY
from live_browser import Browser, browser
from page_cases import CASES
from page_states import SIZES, canned, opened, sized
from project import need
from selenium.webdriver.common.by import By

SEEN = list(SIZES) if ALL else ["desk", "phone"]
THOROUGH = list(CASES) if NIGHTLY else ["contact", "calibrate", "file", "unplugged"]
"""The states that axe looks at, which takes a second each."""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    need("chromium")
    need("chromedriver")
    with browser(tmp_path_factory.mktemp("states")) as page:
        yield page


def run(page: Browser, script: str, *given: str) -> Any:
    return page.driver.execute_script(script, *given)


@pytest.mark.parametrize("name", CASES)
def test_a_state_at_each_size(page: Browser, name: str) -> None:
    """Words; nothing cut, no sideways scrolling; contrast; what is tapped is large enough; the table above the fold."""
    with canned(name) as server:
        sized(page, *SIZES["desk"])
        opened(page, server, name)
        told = server.state.told["state"]
        line, now = told["line"], told["now"]
        looks_back = name == "review"
        assert (page.text("word"), page.text("sub")) == (now["word"], now["sub"])
        assert page["line"].get_attribute("data-level") == ("note" if looks_back else line["level"])
        title = page.driver.title
        assert title.startswith(f"✕ {line['title'][:-1]}" if line["level"] == "fault" else now["word"])
        for number, size in enumerate(SEEN):
            sized(page, *SIZES[size])
            if number % 2:
                page["theme"].parent.execute_script("document.getElementById('theme').click()")
            said = page.text("says")
            assert ("Measuring and recording go on" if looks_back else line["text"]) in said
            assert ("Looking back at " if looks_back else line["title"]) in said
            wrong = {what: run(page, script) for what, script in page_looks.CHECKS.items()}
            if size in ("phone", "lying"):
                wrong["small"] = run(page, page_looks.SMALL)
            if size == "desk":
                wrong["below the fold"] = [bottom for bottom in run(page, page_looks.NEWEST) if bottom > 800]
            assert {what: found for what, found in wrong.items() if found} == {}, size
        if name in THOROUGH:
            assert page_looks.audit(page.driver) == []
            sized(page, *SIZES["desk"])
            assert page_looks.audit(page.driver) == []


@pytest.mark.parametrize("name", ["plan", "files", "set", "keys", "menu", "marking"])
def test_what_opens_over_the_page(page: Browser, name: str) -> None:
    with canned("contact") as server:
        for size in ("phone", "desk"):
            sized(page, *SIZES[size])
            opened(page, server, "contact")
            if name == "menu" and size == "desk":
                continue
            opener = {
                "plan": "openplan",
                "files": "openfiles",
                "set": "openset",
                "keys": "help",
                "menu": "more",
                "marking": "mark",
            }[name]
            page.driver.execute_script("document.getElementById(arguments[0]).click()", opener)
            page.until(lambda: page[name].is_displayed())
            checks = page_looks.CHECKS | ({"small": page_looks.SMALL} if size == "phone" else {})
            assert {what: found for what, script in checks.items() if (found := run(page, script))} == {}
            assert page_looks.audit(page.driver) == []


def test_the_checks_find_what_is_wrong(page: Browser) -> None:
    with canned("contact") as server:
        sized(page, *SIZES["phone"])
        opened(page, server, "contact")
        run(
            page,
            "const s = document.getElementById('sub').style; s.width = '20px'; s.overflow = 'hidden'; s.color = '#3a80c0'",
        )
        run(
            page,
            "document.getElementById('word').style.width = '900px'; document.getElementById('now').style.overflow = 'visible'",
        )
        run(
            page,
            "document.getElementById('more').style.minHeight = '20px'; document.getElementById('more').style.height = '20px'",
        )
        found = {what: run(page, script) for what, script in {**page_looks.CHECKS, "small": page_looks.SMALL}.items()}
        assert found["sideways"] > 0
        assert any(text.startswith("#sub") for text in found["cut"])
        assert any(text.startswith("#sub") for text in found["faint"])
        assert any(text.startswith("#more") for text in found["small"])
        run(
            page,
            "document.getElementById('note').removeAttribute('aria-label'); document.getElementById('note').placeholder = ''",
        )
        assert [rule for rule, _ in page_looks.audit(page.driver)] != []


@pytest.mark.parametrize("size", SEEN)
def test_messages_do_not_move_the_charts(page: Browser, size: str) -> None:
    with canned("contact") as server:
        sized(page, *SIZES[size])
        opened(page, server, "contact")
        before = run(page, page_looks.PLACES)
        for name in ("idle", "lift", "flagged", "unplugged", "saturated", "baseline", "slow"):
            state = CASES[name]()
            server.change(state)
            page.until(lambda state=state: page.text("word") == state.told["state"]["now"]["word"])
            page.until(lambda state=state: state.told["state"]["line"]["text"] in page.text("says"))
            server.tell(
                "refused",
                message="tare: the probe is in contact; lift it first. If nothing is touched, press Tare anyway",
            )
            page.until(lambda: page.text("answer").startswith("tare: the probe"))
            assert run(page, page_looks.PLACES) == before, name


def test_points_stand_in_line(page: Browser) -> None:
    with canned("lift") as server:
        sized(page, *SIZES["desk"])
        opened(page, server, "lift")
        script = """return [3, 4, 5].map((n) => [...document.querySelectorAll(`#rows tr:not([hidden]) td:nth-child(${n}) .pt`)]
            .filter((e) => e.textContent.includes(".")).map((e) => e.querySelector("i").getBoundingClientRect().left.toFixed(1)));"""
        for lefts in run(page, script):
            assert len(lefts) > 10
            assert len(set(lefts)) == 1


def test_the_screen_reader_hears_what_has_settled(page: Browser) -> None:
    with canned("contact") as server:
        sized(page, *SIZES["desk"])
        opened(page, server, "contact")

        def spoken(name: str) -> str:
            return str(run(page, "return document.getElementById(arguments[0]).textContent", name))

        assert spoken("announced") == "Hold: 2.5 s more"
        assert spoken("alarm") == ""
        run(
            page,
            "window.said = 0; new MutationObserver(() => said++).observe(document.getElementById('announced'), { childList: true, characterData: true, subtree: true })",
        )
        told = server.state.told["state"]
        for share in (0.63, 0.64, 0.65):
            server.state.told["state"] = {
                **told,
                "now": {**told["now"], "share": share},
            }  # it is said again each second
            server.tell("state", **server.state.told["state"])
        page.until(lambda: run(page, "return document.querySelector('#bar b').style.width") == "65%")
        assert run(page, "return said") == 0
        server.change(CASES["unplugged"]())
        page.until(lambda: spoken("alarm").startswith("Unplugged. The board at USB 1/4 is gone."))
        assert (
            run(
                page,
                "return document.querySelectorAll('[role=status]').length + document.querySelectorAll('[role=alert]').length",
            )
            == 3
        )


def test_colours_are_remembered(page: Browser) -> None:
    with canned("idle") as server:
        for theme in ("dark", "light"):
            opened(page, server, "idle", theme)
            page.driver.refresh()
            page.until(lambda: page.text("word") == "Touch")
            assert run(page, "return document.documentElement.dataset.theme") == theme


def test_hostile_words_stay_words(page: Browser) -> None:
    with canned("idle") as server:
        opened(page, server, "idle")
        evil = "<img src=x onerror=alert(1)>"
        told = json.loads(json.dumps(server.state.told).replace("30 OO", evil).replace("Ready.", evil))
        server.change(replace(server.state, told=told))
        page.until(lambda: evil in page.text("nextname"))
        assert evil in page.text("says")
        assert evil in page.text("specimens")
        assert page.driver.find_elements(By.TAG_NAME, "img") == []


def test_rows_that_stay_the_same_are_not_made_again(page: Browser) -> None:
    """Of an opened recording with 200 touches, each further touch costs one row; all touches of the file are counted."""
    with canned("file") as server:
        sized(page, *SIZES["desk"])
        opened(page, server, "file")
        told, session = server.state.told["touches"], server.state.told["session"]
        assert str(session["count"]["of"]) in page.text("nextname")
        run(page, "for (const row of document.querySelectorAll('#rows tr[data-touch]')) row.dataset.old = 'yes'")
        last = told["rows"][-1]
        server.tell("touches", **{**told, "rows": [*told["rows"], {**last, "number": last["number"] + 1}]})
        made = "return [...document.querySelectorAll('#rows tr[data-touch]')].map((row) => row.dataset.old ?? 'no')"
        page.until(lambda: len(run(page, made)) == len(told["rows"]) + 1)
        assert run(page, made) == ["no"] + len(told["rows"]) * ["yes"]
