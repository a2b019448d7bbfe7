"""What can be measured of the looks of a page: scripts that return what is wrong, as a list; and what axe finds."""

from importlib.resources import files
from pathlib import Path
from typing import Any

from PIL import Image, ImageFilter
from project import need_package

SIDEWAYS = "const page = document.scrollingElement; return Math.max(0, page.scrollWidth - page.clientWidth);"
"""How far the page scrolls sideways, px."""

_SHOWN = """
const shown = (e) => e.checkVisibility({ visibilityProperty: true }) && e.getClientRects().length > 0 && !e.closest(".spoken, dialog:not([open])");
const named = (e) => (e.id ? "#" + e.id : e.tagName.toLowerCase() + "." + e.className) + ": " + e.textContent.trim().slice(0, 40);
const scrolls = (e) => { for (let p = e.parentElement; p; p = p.parentElement) if (/auto|scroll/.test(getComputedStyle(p).overflowY)) return true; return false; };
const texts = [...document.body.querySelectorAll("*")].filter((e) => shown(e) && !e.closest("svg") && [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim()));
"""

CUT = (
    _SHOWN
    + """
const allowed = "#source, #source *, .remark, #nextname span, .plot *";
const wrong = [];
for (const e of texts) {
  if (e.matches(allowed)) continue;
  const box = e.getBoundingClientRect();
  for (let p = e; p && p !== document.body; p = p.parentElement) {
    const style = getComputedStyle(p), edge = p.getBoundingClientRect();
    if (/auto|scroll/.test(style.overflowX)) break;
    if (style.overflowX !== "hidden") continue;
    if (p !== e && /auto|scroll/.test(style.overflowY)) {
      if (box.right > edge.right + 1 || box.left < edge.left - 1) wrong.push(named(e));
      break;
    }
    if (p === e ? e.scrollWidth > e.clientWidth + 1 || e.scrollHeight > e.clientHeight + 2 : box.right > edge.right + 1 || box.bottom > edge.bottom + 2 || box.left < edge.left - 1 || box.top < edge.top - 2) wrong.push(named(e));
  }
  if (box.left < -1 || (!scrolls(e) && box.right > document.documentElement.clientWidth + 1)) wrong.push(named(e));
}
return wrong;"""
)
"""Texts that are cut by an edge: of a box, or of the window."""

SMALL = (
    _SHOWN
    + """
return [...document.querySelectorAll("button, a, input, select, textarea")].filter(shown).map((e) => [e, e.getBoundingClientRect()])
  .filter(([, box]) => box.width < 43.5 || box.height < 43.5).map(([e, box]) => `${named(e)} ${box.width.toFixed(0)} x ${box.height.toFixed(0)}`);"""
)
"""What can be pressed and is smaller than 44 px."""

OVER = """
const boxes = [...document.querySelectorAll("#now *")].filter((e) => e.checkVisibility({ visibilityProperty: true }) && e.clientWidth);
return boxes.filter((e) => e.scrollWidth > e.clientWidth + 1).map((e) => `${e.id}: ${e.scrollWidth} in ${e.clientWidth}`);"""
"""Parts of the main panel that are wider than their boxes."""

CHECKS = {"sideways": SIDEWAYS, "cut": CUT, "over": OVER}  # what holds at every size
NEWEST = """return [...document.querySelectorAll("#touches tr")].filter((e) => !e.hidden).slice(0, 4)
  .map((e) => e.getBoundingClientRect().bottom);"""
"""Lower edges of the head of the table and of the three newest touches, px."""
PLACES = """
const wide = innerWidth >= 1100, always = ["touchplot", "overview", "detail", "touches"], at = ({ left, top, width, height }, id) => [left, top + scrollY, width, id === "touches" && !wide ? 0 : height].map(Math.round);
return Object.fromEntries(always.map((id) => [id, at(document.getElementById(id).getBoundingClientRect(), id)]));"""
"""Left, top, width and height of the charts and tables, px. In one column the table grows, and what is below it moves."""


def audit(driver: Any) -> list[Any]:
    """Return what axe-core finds that is serious or worse."""
    need_package("axe_core_python")
    driver.execute_script((files("axe_core_python") / "axe.min.js").read_text())
    found = driver.execute_async_script("axe.run(document).then((r) => arguments[0](r.violations))")
    return [
        (v["id"], [n["target"] for n in v["nodes"]][:3])
        for v in found
        if v["impact"] in ("serious", "critical")
    ]


CAPITAL = 0.72  # height of a capital, in font sizes
READ_MM = 2000 * 5 * 1.5 * 0.000_290_9  # a letter of 5 strokes of 1.5 arc minutes, 2 m away
PIXEL_MM = 0.225  # of a screen of 13 inches with 1280 pixels
FAR_PX = READ_MM / PIXEL_MM
"""Least height of a capital that an eye of 20/30 reads from 2 m on such a screen, px."""
FAR_TEXTS = ("verb", "reason", "value", "between", "objectname", "remedyhow")
FAR = """
const shown = arguments[0].map((id) => document.getElementById(id)).filter((e) => e.checkVisibility() && e.textContent);
return Object.fromEntries(shown.map((e) => [e.id, parseFloat(getComputedStyle(e).fontSize)]));"""
"""Sizes of the fonts of those that are shown, px."""
CROSSED = """
const boxes = [...document.querySelectorAll("#scale text")].map((e) => [e.textContent, e.getBoundingClientRect()]), wrong = [];
for (const [a, p] of boxes) for (const [b, q] of boxes) if (p !== q && p.left < q.right && p.right > q.left && p.top + 2 < q.bottom - 2 && p.bottom - 2 > q.top + 2) wrong.push(`${a} x ${b}`);
return wrong;"""
"""Texts of the scale that lie over each other."""
OVERLAPS = """
const parts = ["ring", "reading", "remedy", "object", "strip", "line"].map((id) => document.getElementById(id)).filter((e) => e.checkVisibility());
const inside = ["asked", "figure", "between", "scale", "objecthead", "touchslots", "objectmean", "ending", "wizardend", "steps"].map((id) => document.getElementById(id)).filter((e) => e.checkVisibility() && e.clientHeight);
const wrong = [];
for (const group of [parts, inside]) group.forEach((a, i) => group.slice(i + 1).forEach((b) => {
  const p = a.getBoundingClientRect(), q = b.getBoundingClientRect();
  if (p.left + 1 < q.right && p.right - 1 > q.left && p.top + 1 < q.bottom && p.bottom - 1 > q.top) wrong.push(`${a.id} x ${b.id}`);
}));
return wrong;"""
"""Parts of Measure that lie over each other."""


def blurred(path: Path) -> Image.Image:
    """Return a picture of the page as an eye of 20/30 sees it from 2 m: what is 1.5 arc minutes apart runs together."""
    seen_px = 2000 * 1.5 * 0.000_290_9 / PIXEL_MM
    with Image.open(path) as picture:
        return picture.convert("RGB").filter(ImageFilter.GaussianBlur(seen_px / 2))
