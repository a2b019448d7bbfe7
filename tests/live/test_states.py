"""The page in each of its states: words, places, sizes, contrast, and what a screen reader finds."""

from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import Any

import page_looks
import pytest
from effort import NIGHTLY
from live_browser import Browser, browser
from page_cases import CASES
from page_states import SIZES, Canned, canned, opened, sized
from project import need, need_package

LARGE = [name for name, (width, _) in SIZES.items() if width >= 1280]
THEMES = ("light", "dark")
SEEN = list(SIZES) if NIGHTLY else ["desk", "phone"]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    need("chromium")
    need("chromedriver")
    with browser(tmp_path_factory.mktemp("states")) as page:
        yield page


@pytest.fixture(scope="module", params=list(CASES))
def state(request: pytest.FixtureRequest) -> Iterator[tuple[str, Canned]]:
    with canned(request.param) as server:
        yield request.param, server


def run(page: Browser, script: str) -> Any:
    return page.driver.execute_script(script)


def view(page: Browser, state: tuple[str, Canned], size: str, theme: str = "light") -> None:
    name, server = state
    sized(page, *SIZES[size])
    opened(page, server, name, theme)


@pytest.mark.parametrize("size", SEEN)
def test_each_state_says_what_it_is_and_nothing_is_cut(page: Browser, state: tuple[str, Canned], size: str) -> None:
    name, server = state
    view(page, state, size)
    told = server.state.told["state"]
    line = told["line"]
    assert page.text("word") == told["now"]["word"]
    assert page.text("sub") == told["now"]["sub"]
    if name == "review":
        page.until(lambda: page.text("says").startswith("‖ Looking back at "))
        assert "measuring and recording go on" in page.text("says").lower()
    else:
        assert line["title"] in page.text("says")
        assert line["text"] in page.text("says")
    assert page["line"].get_attribute("data-level") == ("note" if name == "review" else line["level"])
    assert run(page, "return document.title").startswith(f"✕ {line['title'][:-1]}" if line["level"] == "fault" else told["now"]["word"])
    assert run(page, page_looks.SIDEWAYS) == 0
    assert run(page, page_looks.CUT) == []


@pytest.mark.parametrize("theme", THEMES)
def test_contrast_and_accessibility(page: Browser, state: tuple[str, Canned], theme: str) -> None:
    need_package("axe_core_python")
    axe = (files("axe_core_python") / "axe.min.js").read_text()
    for size in SEEN:
        view(page, state, size, theme)
        assert run(page, page_looks.FAINT) == []
        page.driver.execute_script(axe)
        found = page.driver.execute_async_script("axe.run(document).then((r) => arguments[0](r.violations))")
        serious = [(v["id"], [n["target"] for n in v["nodes"]][:3]) for v in found if v["impact"] in ("serious", "critical")]
        assert serious == []


def test_what_can_be_tapped_on_a_phone_is_large_enough(page: Browser, state: tuple[str, Canned]) -> None:
    for size in ("phone", "lying"):
        view(page, state, size)
        assert run(page, page_looks.SMALL) == []
        page["more"].click()
        assert run(page, page_looks.SMALL) == []


def test_the_table_is_above_the_fold(page: Browser, state: tuple[str, Canned]) -> None:
    """At 1280 x 800: its head and the three newest touches, without scrolling."""
    view(page, state, "desk")
    script = "return [...document.querySelectorAll('#touches tr')].filter((e) => !e.hidden).slice(0, 4).map((e) => e.getBoundingClientRect().bottom)"
    assert max(run(page, script)) <= 800


@pytest.mark.parametrize("size", list(SIZES))
def test_messages_do_not_move_the_charts(page: Browser, size: str) -> None:
    with canned("contact") as server:
        sized(page, *SIZES[size])
        opened(page, server, "contact")
        before = run(page, page_looks.PLACES)
        assert len(before) == 6
        for name in ("idle", "lift", "flagged", "unplugged", "saturated", "baseline", "slow"):
            state = CASES[name]()
            server.change(state)
            page.until(lambda state=state: page.text("word") == state.told["state"]["now"]["word"])
            page.until(lambda state=state: state.told["state"]["line"]["text"] in page.text("says"))
            server.tell("refused", message="tare: the probe is in contact; lift it first. If nothing is touched, press Tare anyway")
            page.until(lambda: page.text("answer").startswith("tare: the probe"))
            after = run(page, page_looks.PLACES)
            assert {k: [round(x) for x in v] for k, v in after.items()} == {k: [round(x) for x in v] for k, v in before.items()}, name


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
        spoken = lambda name: run(page, f"return document.getElementById('{name}').textContent")  # noqa: E731
        assert spoken("announced") == "Hold: 2.5 s more"
        assert spoken("alarm") == ""
        run(page, "window.said = 0; new MutationObserver(() => said++).observe(document.getElementById('announced'), { childList: true, characterData: true, subtree: true })")
        told = server.state.told["state"]
        for share in (0.63, 0.64, 0.65):
            server.tell("state", **{**told, "now": {**told["now"], "share": share}})
        page.until(lambda: run(page, "return document.querySelector('#bar b').style.width") == "65%")
        assert run(page, "return said") == 0
        server.change(CASES["unplugged"]())
        page.until(lambda: spoken("alarm").startswith("Unplugged. The board at USB 1/4 is gone."))
        assert run(page, "return document.querySelectorAll('[role=status]').length + document.querySelectorAll('[role=alert]').length") == 3
