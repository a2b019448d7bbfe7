"""The charts of the page: what they show, and a pointer on them."""

from typing import Any

from live_browser import Browser
from page_data import ORIGIN_S

Window = tuple[float, float]
SHOWN = """
const { charts } = palpate, { viewport: shown, overview, detail, touchplot, rows, cursors } = charts, { shown: touch } = touchplot;
const drawn = ({ labels, points, canvas: { width, height } }, more) => ({ labels, points, width, height, ...more });
return {
  from: shown.from, to: shown.to, back: palpate.known.looking, end: rows.extent.end, cursors: cursors.values,
  overview: drawn(overview), detail: drawn(detail, { left: detail.left, right: detail.right }),
  touch: { number: touch?.touch.number, scale: touch?.scale },
};
"""
FIRE = """
const [id, type, more] = arguments, place = document.getElementById(id), { left, top, width, height } = place.getBoundingClientRect();
place.setPointerCapture = () => {};
const at = { clientX: left + more.x * width, clientY: top + (more.y ?? 0.6) * height, bubbles: true, cancelable: true, button: 0, pointerId: 1, ...more };
place.dispatchEvent(type === "wheel" ? new WheelEvent(type, at) : new PointerEvent(type, at));
"""


def drawn(page: Browser) -> Any:
    page.drawn()
    return page.run(SHOWN)


def window(page: Browser) -> Window:
    now = drawn(page)
    return now["from"] - ORIGIN_S, now["to"] - ORIGIN_S


def look(page: Browser, begin: float, end: float) -> None:
    page.run(
        "palpate.charts.viewport.show(arguments[0], arguments[1])", begin + ORIGIN_S, end + ORIGIN_S
    )


def fire(page: Browser, place: str, kind: str, x: float, **more: Any) -> None:
    page.run(FIRE, place, kind, {"x": x, **more})


def drag(page: Browser, place: str, begin: float, end: float, **more: Any) -> None:
    fire(page, place, "pointerdown", begin, **more)
    for x in ((begin + end) / 2, end):
        fire(page, place, "pointermove", x, **more)
    fire(page, place, "pointerup", end, **more)


def share_of(page: Browser, place: str, t: float) -> float:
    """Return where a moment is, as a share of the width of a chart."""
    return float(
        page.run(f"return palpate.charts.{place}.x(arguments[0])", t + ORIGIN_S)
        / drawn(page)[place]["width"]
    )


def settled(page: Browser) -> None:
    page.until(lambda: not page.run("return palpate.charts.rows.underWay().length"))
