"""Age of a reading on the live page: from the end of its conversion to the frame in which Chromium has drawn it.

    python -m bench.speed.live_frames [--seconds 20] [--rate board 1000 10000]

The page runs in headless Chromium at 60 frames per second. Each sample carries its time, `t_s`, through ring, socket and
page; the source notes when that reading was converted, the server when it sends the row, and the page when the row has
come and when it has drawn it. "board" is the simulated board in real time, read by the real driver: the conversion
is that of the pair's second channel. A number is a source with so many pairs per second.

drawn: the canvas has the sample, in its animation frame. shown: Chromium has presented that frame, by the element timing
of a mark that changes with each drawing; Chromium rounds it to 4 ms. All times are of one clock. Needs Linux, chromium
and chromedriver. On a busy machine: `chrt -r 5 python -m ...`, so that others do not add their time.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from selenium import webdriver

from bench.speed.live_load import Processes

LEGS = (
    "to the ring",
    "to the socket",
    "to the page",
    "to the drawn frame",
    "conversion to drawn",
    "conversion to shown",
)
SETTLING_S = 4.0
PROBE = """
const clock = () => performance.timeOrigin + performance.now();
const noted = { come: [], drawn: [], shown: [] };
let newest = 0, mark;
window.noted = noted;
window.WebSocket = class extends WebSocket {
  constructor(...given) {
    super(...given);
    this.addEventListener("message", ({ data }) => {
      if (typeof data === "string") return;
      const at = clock(), size = new Uint32Array(data, 0, 4)[2];
      if (size) noted.come.push([at, newest = new Float64Array(data, 16, size)[size - 1]]);
    });
  }
};
const draw = () => {
  const t = newest;
  if (!t || t === noted.drawn.at(-1)?.[1]) return;
  noted.drawn.push([clock(), t]);
  mark?.remove();
  mark = document.createElement("i");
  mark.style = "position: fixed; left: 0; top: 0";
  mark.setAttribute("elementtiming", t);
  mark.textContent = "x";
  document.body.append(mark);
};
new PerformanceObserver((list) => {
  for (const { identifier, renderTime } of list.getEntries()) {
    noted.shown.push([performance.timeOrigin + renderTime, Number(identifier)]);
  }
}).observe({ type: "element" });
addEventListener("DOMContentLoaded", async () => {
  const { Charts } = await import("./charts/charts.js"), paint = Charts.prototype.paintTime;
  Charts.prototype.paintTime = function () {
    paint.call(this);
    draw();
  };
});
"""


class Run(NamedTuple):
    """What a run has shown: the legs of each sample, ms, shape (n, 6); and what it cost."""

    legs: NDArray[np.float64]
    frames_per_s: float
    messages_per_s: float
    server: float
    browser: float
    grown_MB: tuple[float, float, float]
    dropped: int
    lost: int


def first_since(times: NDArray[np.float64], events: Any) -> NDArray[np.float64]:
    """Return for each sample the moment of the first event that has reached its time; nan: none has.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        Times of samples, s.
    events : array-like, shape (m, 2)
        Moment, and newest time of a sample that it has reached; both ascending.
    """
    moments, reached = np.array([*events, [np.nan, np.inf]]).T
    return np.asarray(moments[np.searchsorted(reached, times)])


def legs_of(server: Path, page: dict[str, Any]) -> NDArray[np.float64]:
    """Return the legs of all samples that were drawn after the first seconds, ms."""
    made, sent = np.load(server / "made.npy"), np.load(server / "sent.npy")
    made = made[np.searchsorted(made[:, 0], page["drawn"][0][1]) :]
    times = made[:, 0]
    passed = [made[:, 1], made[:, 2], first_since(times, sent)]
    passed += [first_since(times, page[name]) for name in ("come", "drawn", "shown")]
    legs = np.diff(np.array(passed), axis=0)
    every = np.vstack([legs[:4], legs[:4].sum(axis=0), legs.sum(axis=0)]).T
    every = every[made[:, 1] > made[0, 1] + 1e3 * SETTLING_S]
    return np.asarray(every[np.isfinite(every).all(axis=1)])


def opened(address: str) -> webdriver.Chrome:
    """Open the page in Chromium, with the probe."""
    options = webdriver.ChromeOptions()
    for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"):
        options.add_argument(argument)
    options.add_argument("--window-size=1280,1180")
    driver = webdriver.Chrome(options)
    driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": PROBE})
    driver.get(address)
    return driver


def offset_ms(driver: webdriver.Chrome) -> float:
    """Return by how much the page's clock is surely off from this process's one: 0 if a question can explain it."""
    surely: list[float] = []
    for _ in range(20):
        before = time.time() * 1e3
        there = driver.execute_script("return performance.timeOrigin + performance.now()")
        surely.append(max(before - there, there - time.time() * 1e3, 0.0))
    return max(surely)


def heap_MB(driver: webdriver.Chrome) -> float:
    """Return what the page's script holds, after a collection."""
    driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
    return float(driver.execute_cdp_cmd("Runtime.getHeapUsage", {})["usedSize"]) / 1e6


def measure(rate: str, seconds: float) -> Run:
    """Run a server and a page."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "bench.speed.live_noted", rate, folder]
        server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert server.stdout
        driver = opened(server.stdout.readline().strip())
        try:
            time.sleep(SETTLING_S)
            if (off := offset_ms(driver)) > 0.5:
                raise RuntimeError(f"clock: the page's is {off:.1f} ms off, allowed: 0.5")
            both = Processes(server.pid), Processes(driver.service.process.pid)
            begun, cpu, memory = time.monotonic(), [p.cpu_s() for p in both], [p.resident_MB() for p in both]
            heap = heap_MB(driver)
            time.sleep(seconds)
            passed = time.monotonic() - begun
            shares = [(p.cpu_s() - before) / passed for p, before in zip(both, cpu, strict=True)]
            grown = [p.resident_MB() - before for p, before in zip(both, memory, strict=True)]
            grown.append(heap_MB(driver) - heap)
            page = driver.execute_script("return noted")
            counters, lost = (driver.find_element("id", name).text for name in ("counters", "frames"))
        finally:
            driver.quit()
            server.send_signal(2)
            server.wait()
        legs = legs_of(Path(folder), page)
    drawn, come = (np.array(page[name])[:, 0] for name in ("drawn", "come"))
    late = drawn[-1] - 1e3 * seconds
    return Run(
        legs,
        np.count_nonzero(drawn > late) / seconds,
        np.count_nonzero(come > late) / seconds,
        shares[0],
        shares[1],
        (grown[0], grown[1], grown[2]),
        int(counters.split(" dropped")[0]),
        int(lost.split(" frames, ")[1].split()[0]),
    )


def table(rate: str, run: Run) -> str:
    """Return the rows of a run."""
    rows = [
        f"{rate}: {len(run.legs)} samples, {run.frames_per_s:.1f} frames and {run.messages_per_s:.1f} messages a second"
    ]
    for name, leg in zip(LEGS, run.legs.T, strict=True):
        low, median, high = np.percentile(leg, [5, 50, 95])
        rows.append(f"  {name:22} 5 % {low:6.1f}   median {median:6.1f}   95 % {high:6.1f} ms")
    server, browser, heap = run.grown_MB
    rows.append(
        f"  share of a core: server {run.server:.1%}, browser {run.browser:.1%}; {run.dropped} dropped, {run.lost} missed"
    )
    rows.append(f"  memory grown by: server {server:.1f}, browser {browser:.1f}, script {heap:.1f} MB")
    return "\n".join(rows)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--rate", nargs="+", default=["board", "1000", "10000"], help="board, or pairs per second")
    arguments = parser.parse_args()
    for rate in arguments.rate:
        print(table(rate, measure(rate, arguments.seconds)), flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
