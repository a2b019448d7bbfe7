"""A recording of 10 h in the page: first picture, all of it, from touch to touch, export of all touches, progress of a report.

    python -m bench.speed.page [--hours 10]

Prints seconds beside their bounds, which are for a quiet machine; exit code 1 if one is exceeded. That the page and its export
have the touches of `palpate.touches` is checked first. Needs the extra live, selenium, chromium and chromedriver.
"""

import argparse
import csv
import json
import shutil
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from typing import Any

import palpate
from selenium import webdriver

from bench.soak.memory import written

BOUNDS_S = {"first picture": 2.5, "whole": 5.0, "next touch": 0.1, "progress of a report": 1.0}
STEP = """
const [done] = arguments, { charts, known } = palpate, before = known.chosen, begin = performance.now();
document.getElementById("after").click();
const look = () => (known.chosen !== before && charts.touchplot.shown?.touch.number === known.chosen && !charts.rows.underWay().length
  ? done((performance.now() - begin) / 1000) : requestAnimationFrame(look));
look();
"""
"""From a key to the touch with its curve and its window, s."""


def waited(holds: Callable[[], Any], begin: float) -> float:
    """Return when something holds, s from the begin."""
    while not holds():
        time.sleep(0.01)
    return time.monotonic() - begin


def measure(path: Path, folder: Path) -> dict[str, float]:
    """Open a recording in a page; return the times."""
    options = webdriver.ChromeOptions()
    found = dict[str, float]()
    for argument in ("headless=new", "no-sandbox", "disable-dev-shm-usage", "window-size=1280,800"):
        options.add_argument(f"--{argument}")
    options.add_experimental_option("prefs", {"download.default_directory": str(folder)})
    touches = palpate.touches(palpate.read(path))
    table = folder / f"{path.stem}-touches.csv"
    command = [
        sys.executable,
        "-m",
        "palpate",
        "live",
        str(path),
        "--no-open",
        "--json",
        "--no-token",
        "--port",
        "0",
    ]
    with webdriver.Chrome(options, webdriver.ChromeService(shutil.which("chromedriver"))) as page:
        page.get("about:blank")
        begin = time.monotonic()
        run = page.execute_script
        with Popen(command, stdout=PIPE, stderr=DEVNULL, text=True) as server, ExitStack() as end:
            end.callback(server.terminate)
            assert server.stdout
            page.get(json.loads(server.stdout.readline())["address"])
            found["first picture"] = waited(
                lambda: run("return globalThis.palpate?.charts.detail.points > 0"), begin
            )
            found["whole"] = waited(
                lambda: run("return palpate.known.touches.rows.length > 0"), begin
            )
            found["next touch"] = statistics.median(
                page.execute_async_script(STEP) for _ in range(21)
            )
            begin = time.monotonic()
            run("document.getElementById('savefound').click()")
            found["export"] = waited(table.exists, begin)
            begin = time.monotonic()
            run("document.getElementById('report').click()")
            found["progress of a report"] = waited(
                lambda: run("return !document.getElementById('progress').hidden"), begin
            )
            begin = time.monotonic()
            run("document.querySelector('#progress button').click()")
            found["report stopped"] = waited(
                lambda: run("return document.getElementById('progress').hidden"), begin
            )
    with table.open() as file:
        if [float(row["ratio"]) for row in csv.DictReader(file)] != [
            touch.ratio for touch in touches
        ]:
            raise RuntimeError(f"{table.name}: not the touches of {path.name}")
    return found


def main() -> None:
    """Print what was measured."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--hours", type=float, default=10)
    with tempfile.TemporaryDirectory() as name:
        rows = written(Path(name) / "run.csv", parser.parse_args().hours)
        found = measure(Path(name) / "run.csv", Path(name))
    print(f"{rows} rows")
    for what, seconds in found.items():
        print(
            f"{what:24} {seconds:7.3f} s{f', at most {BOUNDS_S[what]} s' if what in BOUNDS_S else ''}"
        )
    sys.exit(any(found[what] > bound for what, bound in BOUNDS_S.items()))


if __name__ == "__main__":
    main()
