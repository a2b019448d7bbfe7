"""A recording of 10 h in the page: a canned server for tests, and how fluently it pans.

python tests/tools/chart_pan.py      frames a second (the best of five runs), and the work for a frame, at 2560 x 1440
"""

import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from live_browser import Browser, browser
from page_cases import CASES
from page_data import ORIGIN_S, RATE, State
from page_states import VIEW, Canned, framed, serving, sized, view_of
from palpate.live.feed import ROW, Flag, Rows

HOURS = 10.0
EVERY_S, FROM_S, TO_S = 20.0, 4.0, 12.0
"""A touch in each of these parts of the recording; its begin and end in it."""
NEWEST = 16384
TOUCHES, MARKS = 200, 40
SPANS_S = (30, 600, 7200)
FRAMES, RUNS = 80, 5

CATCH = """
const done = arguments[0];
import("./charts/charts.js").then(({ Charts }) => {
  const paint = Charts.prototype.paintTime;
  window.spent = [];
  Charts.prototype.paintTime = function () {
    const begun = performance.now();
    paint.call(this);
    window.spent.push(performance.now() - begun);
    if (!window.charts) done();
    window.charts = this;
  };
  dispatchEvent(new Event("resize"));
});
"""
PAN = """
const [id, count, done] = arguments, place = document.getElementById(id), { left, top, width, height } = place.getBoundingClientRect();
place.setPointerCapture = () => {};
let x = 0.5 * width, frames = 0, begun = null;
const fire = (type) => place.dispatchEvent(new PointerEvent(type, { bubbles: true, clientX: left + x, clientY: top + 0.6 * height, pointerId: 7, button: 0 }));
window.spent.length = 0;
fire("pointerdown");
const step = (now) => {
  begun ??= now;
  if (frames++ === count) {
    fire("pointerup");
    return done([1000 * count / (now - begun), window.spent.toSorted((a, b) => a - b)[window.spent.length >> 1]]);
  }
  x += Math.floor(frames / 40) % 2 ? 12 : -12;
  fire("pointermove");
  requestAnimationFrame(step);
};
requestAnimationFrame(step);
"""


def long_rows(hours: float = HOURS) -> Rows:
    """Return the rows of a long measurement, with a touch every 20 s."""
    random = np.random.default_rng(3)
    t = np.arange(0, 3600 * hours, 1 / RATE)
    rows = np.zeros(len(t), ROW)
    phase = t % EVERY_S
    rows["t_s"] = t + ORIGIN_S
    rows["soft"] = 0.2 * np.clip(np.minimum(phase - FROM_S, TO_S - phase) / 0.3, 0, 1)
    rows["hard"] = rows["soft"] * (2 + np.floor(t / EVERY_S) % 5)
    for name in ("hard", "soft"):
        rows[name] += random.normal(0, 0.0008, len(t))
    inside = (phase > FROM_S + 0.4) & (phase < TO_S - 0.4)
    for name in ("ratio", "standard_error", "statistic"):
        rows[name] = np.where(inside, {"ratio": 2, "standard_error": 0.01, "statistic": 1}[name], np.nan)
    rows["flags"] = np.where(inside, Flag.CONTACT | Flag.MEASURED, 0)
    return rows


def long_state(rows: Rows) -> State:
    """Return what a page of this recording is told: the newest touches, marks and tares all over it."""
    state = CASES["file"]()
    one, count = state.told["touches"]["rows"][0], int((rows["t_s"][-1] - ORIGIN_S) // EVERY_S)
    touches = [
        {**one, "number": k + 1, "kept": k % 17 > 0, "specimen": f"specimen {k // 4}"}
        | {"start_s": ORIGIN_S + EVERY_S * k + FROM_S + 0.4, "end_s": ORIGIN_S + EVERY_S * k + TO_S - 0.4}
        for k in range(max(0, count - TOUCHES), count)
    ]
    seconds = rows["t_s"][-1] - ORIGIN_S
    marks = [
        {"id": k, "t_s": ORIGIN_S + seconds * (k + 0.3) / MARKS, "text": f"mark {k}: wiped the bumps"}
        for k in range(MARKS)
    ]
    state.told["touches"] = {**state.told["touches"], "rows": touches}
    state.told["events"] = {"marks": marks, "tares": [mark["t_s"] + 9 for mark in marks], "gaps": [], "flags": []}
    state.told["state"] = {**state.told["state"], "end_s": float(rows["t_s"][-1])}
    return replace(state, rows=rows[-NEWEST:], traces=[])


class Long(Canned):
    """A canned server that sends the newest rows, and views of all."""

    def __init__(self, rows: Rows, state: State | None = None) -> None:
        self._all, self._times = rows, rows["t_s"].copy()
        super().__init__(state or long_state(rows))

    def _hear(self, page: Any, command: dict[str, Any]) -> None:
        if command["do"] != "view":
            super()._hear(page, command)
            return
        self.heard.append(command)
        first, last = np.searchsorted(self._times, [command["from_s"], command["to_s"]])
        page.send(framed(command["id"], view_of(self._all[first : last + 1], **command), VIEW))


def visit(page: Browser, server: Canned) -> None:
    """Open the page, and take hold of its charts as `window.charts`."""
    page.driver.get(server.address)
    page.until(lambda: page.text("word") not in ("", "\N{EN DASH}"))
    page.driver.execute_async_script(CATCH)


def task_ms(page: Browser) -> float:
    """Return the time that the page's thread has worked."""
    metrics = page.driver.execute_cdp_cmd("Performance.getMetrics", {})["metrics"]
    return float(1000 * next(one["value"] for one in metrics if one["name"] == "TaskDuration"))


def main() -> int:
    """Print the table."""
    rows = long_rows()
    with tempfile.TemporaryDirectory() as folder, browser(Path(folder)) as page, serving(Long(rows)) as server:
        page.driver.set_script_timeout(300)
        page.driver.execute_cdp_cmd("Performance.enable", {})
        sized(page, 2560, 1440)
        visit(page, server)
        for span in SPANS_S:
            page.driver.execute_script("charts.window.show(18000, 18000 + arguments[0])", span)
            runs = []
            for _ in range(RUNS):
                begun = task_ms(page)
                fps, script = page.driver.execute_async_script(PAN, "detail", FRAMES)
                runs.append((fps, script, (task_ms(page) - begun) / FRAMES))
            fps, script, work = max(runs)
            points = page.driver.execute_script("return charts.geometry().detail.points")
            row = {"window_s": span, "frames_per_s": round(fps, 1), "script_ms": round(script, 1)}
            print(json.dumps({**row, "thread_ms": round(work, 1), "points": points}), flush=True)
        page.driver.get("about:blank")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
