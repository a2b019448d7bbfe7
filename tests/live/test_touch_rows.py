"""The table of touches with thousands of rows: all of them reach the page and its export, and later only what changed."""

import asyncio
import json
from collections.abc import Callable
from typing import Any
from unittest.mock import AsyncMock

import palpate
import pytest
from live_bench import OWN_FILE, Bench, begun
from live_browser import Browser
from page_states import Canned
from palpate.live.client import PageClient
from palpate.live.multiresolution import MultiresolutionRows
from palpate.live.plan import PlannedTouch
from palpate.live.protocol import ShownScatter, TouchesMessage
from recording_bench import soon
from selenium.webdriver.common.keys import Keys

MANY = 4000
SIGHT = """
const box = document.querySelector("#touches .scroll").getBoundingClientRect(), at = document.activeElement.getBoundingClientRect();
return [at.top >= box.top && at.bottom <= box.bottom, document.activeElement.textContent];"""
"""Whether the focus is in sight, and on which touch."""


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Return what a page gets: all touches, then one more, then nothing new after a hello of another page."""
    bench: Bench = begun(
        lambda: palpate.open(str(OWN_FILE)), tmp_path_factory.mktemp("run"), record=False
    )
    measurement, texts = bench.measurement, []
    soon(lambda: not measurement.running)
    bench.obey("plan", text="gel", wanted=99)
    plan: Any = bench.plan
    page = PageClient(None, measurement.levels)  # type: ignore[arg-type]
    many = measurement.touches * (MANY // len(measurement.touches))
    plan.progress.present = [
        PlannedTouch(number, touch, "gel") for number, touch in enumerate(many, 1)
    ]
    measurement.ends = dict.fromkeys(range(1, MANY + 2), 60.0)
    for touches in (many, [*many, many[0]], [*many, many[0]]):
        measurement.touches = touches
        plan.touch(len(touches), touches[-1])
        page.show_touches(bench.table.document())
        assert bench.table.document() is bench.table.document()
        texts.append(page._lacking())
    return texts


def test_a_new_touch_costs_one_row_and_a_change_its_own(told: list[str]) -> None:
    first, more, none = map(json.loads, told)
    assert [row["number"] for row in first["rows"]] == list(range(1, MANY + 1))
    assert [row["number"] for row in more["rows"]] == [MANY + 1]
    assert (more["count"], none["rows"], none["count"]) == (MANY + 1, [], MANY + 1)
    assert max(map(len, told[1:])) < 4096


def test_a_page_that_is_greeted_again_gets_all() -> None:
    socket = AsyncMock()
    page = PageClient(socket, MultiresolutionRows())
    scatter = ShownScatter(0.03, "assumed")
    row: Any = {"number": 1}
    page.show_touches(
        TouchesMessage(
            rows=[row], scatter=scatter, means={}, most_reliable=None, together=None, count=1
        )
    )
    page.send_message("hello", '{"rows": "hello"}')

    async def send() -> None:
        for _ in range(3):
            await page._send_next()

    asyncio.run(send())
    sent = [json.loads(call.args[0])["rows"] for call in socket.send_text.await_args_list]
    assert sent == [[{"number": 1}], "hello", [{"number": 1}]]


@pytest.mark.parametrize("size", ["desk", "phone"])
def test_thousands_of_touches_in_the_page(
    page: Browser, idle: Canned, told: list[str], size: str
) -> None:
    """Few rows are in the document; keys reach each; the export and the charts have all."""
    page.size(size)
    first, more, _ = (dict(json.loads(text)) for text in told)
    idle.tell(first.pop("type"), **first)
    page.until(lambda: page.all(f"#rows tr[data-touch='{MANY}']"))
    assert page.all("#touches table")[0].get_attribute("aria-rowcount") == str(MANY + 1)
    page.run("document.querySelector('#rows button').focus()")
    for key, number in (
        (Keys.END, 1),
        (Keys.ARROW_UP, 2),
        (Keys.HOME, MANY),
        (Keys.PAGE_DOWN, MANY - 10),
    ):
        page.press(key)
        page.until(lambda number=number: page.run(SIGHT)[1] == str(number))
        page.drawn()
        assert page.run(SIGHT)[0] or size == "phone"
        assert len(page.all("#rows tr[data-touch]")) < 150
    idle.tell(more.pop("type"), **more)
    page.until(lambda: page.run("return palpate.known.touches.rows.length") == MANY + 1)
    assert page.run(SIGHT)[1] == str(MANY - 10)  # the focus stays
    assert page.run("return palpate.charts.annotations.all.length") == MANY + 1
    table = page.downloads / "touches.csv"
    table.unlink(missing_ok=True)
    page.click("csv")
    page.downloaded("touches.csv")
    head, *cells = (line.split(",") for line in table.read_text().splitlines())
    lines = [dict(zip(head, line, strict=True)) for line in cells]
    rows = first["rows"] + more["rows"]
    assert [(line["touch"], float(line["ratio"])) for line in lines] == [
        (str(r["number"]), r["ratio"]) for r in rows
    ]
    gel, scatter = more["means"]["gel"], more["scatter"]["share"]
    for line, row in zip(lines, rows, strict=True):
        away = row["ratio"] / gel - 1 if row["specimen"] else None
        assert (float(line["deviation"]) if line["deviation"] else None) == pytest.approx(away)
        assert float(line["uncertainty"]) == pytest.approx(
            (row["own_error"] ** 2 + (scatter * row["ratio"]) ** 2) ** 0.5
        )


HALF = """const scroll = document.querySelector("#touches .scroll"), box = scroll.getBoundingClientRect();
const foot = box.top + scroll.clientHeight - parseFloat(scroll.style.getPropertyValue("--cut")), head = scroll.querySelector("thead").getBoundingClientRect().bottom;
return [...document.querySelectorAll("#rows tr[data-touch]")].map((row) => [row.dataset.touch, row.getBoundingClientRect()])
  .filter(([, { top, bottom }]) => [head, foot].some((edge) => top < edge - 1 && bottom > edge + 1)).map(([number]) => number);"""
"""Touches whose rows an edge of the table cuts."""


def test_the_table_shows_whole_rows_and_no_empty_columns(
    page: Browser, shown: Callable[..., Canned]
) -> None:
    shown("contact")
    for touch in (None, 12, 3, 18):
        page.run("palpate.charts.choose(arguments[0])", touch)
        page.until(lambda: page.run(HALF) == [])
    scroll = "document.querySelector('#touches .scroll').scrollBy(0, 37)"
    page.run(scroll)
    page.until(lambda: page.run(HALF) == [])
    heads = [one.text for one in page.all("#touches th")]
    assert "MPa" in heads
    page.run("palpate.receive('hello', { ...palpate.known.hello, calibrated: false })")
    assert not {"MPa", "95 % interval"} & {one.text for one in page.all("#touches th")}
    words = page.run("return document.getElementById('touches').textContent")
    assert not [word for word in ("revised", "most reliable", "From mean") if word in words]
