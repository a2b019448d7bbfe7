"""Error and run time of all estimators on all scenarios, cost and benefit of each stage, and required results.

    python -m bench.accuracy.error_vs_time [--seeds 200] [--out bench/results]

Prints the tables; writes error_vs_time.json and error_vs_time.png to the folder. Needs a C++ compiler (for
the cost of each stage), scipy and matplotlib; uses padasip, river and filterpy if they are installed. Run times are
measured first, alone; then the simulations run in two processes. Exit code 1: a required result FAILS without a reason.
"""

import argparse
import json
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import palpate
from palpate import benchmark
from palpate.simulation import scenarios

from bench.accuracy import compared, must_hold, since_contact
from bench.accuracy.error_figure import draw
from bench.accuracy.must_hold import earlier, front
from bench.accuracy.stages import gains, gains_table, stage_costs, stage_table
from bench.peers import PEERS
from bench.results_age import headers_hash
from bench.rivals import rival_rows

BENCH = Path(__file__).parents[1]
PROCESSES = 2
PEER_SEEDS = 20  # at most: other libraries take microseconds for each sample


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=200, help="recordings of each scenario")
    parser.add_argument("--out", type=Path, default=BENCH / "results", help="folder for the JSON and the figure")
    arguments = parser.parse_args()
    compiler = os.environ.get("CXX") or shutil.which("c++") or sys.exit("a C++ compiler is needed: none found as c++")
    missing = sorted(name for name in PEERS if not find_spec(name))
    print(f"{machine(compiler)}\nseeds: {arguments.seeds}; not installed: {', '.join(missing) or 'none'}\n")
    found = measure(arguments.seeds, compiler)
    holds = [*found["must_hold"], *earlier.of_table(found["rows"], found["stages"]), *front.of_table(found["rows"])]
    tables = [
        benchmark.table(found["rows"]),
        compared.table(found["rows"]),
        since_contact.table(found["since_contact"]),
    ]
    print(*tables, stage_table(found["stages"]), gains_table(found["gains"]), must_hold.text(holds), sep="\n\n")
    arguments.out.mkdir(parents=True, exist_ok=True)
    document = {"machine": machine(compiler), "headers": headers_hash(), "seeds": arguments.seeds,
                "rows": [asdict(r) for r in found["rows"]], "since_contact_s": since_contact.SINCE_S,
                "since_contact": found["since_contact"], "bounds": found["bounds"], "stages": found["stages"],
                "gains": found["gains"], "must_hold": [asdict(r) | {"verdict": r.verdict} for r in holds]}  # fmt: skip
    text = json.dumps(document, indent=1).replace("NaN", "null").replace("Infinity", "null")
    (arguments.out / "error_vs_time.json").write_text(text + "\n")
    draw(found["rows"], found["bounds"], found["since_contact"], arguments.out / "error_vs_time.png")
    sys.exit(any(row.verdict == "FAILS" for row in holds))


def measure(seeds: int, compiler: str) -> dict[str, Any]:
    """Return everything that is printed: run times first, one after the other, then the errors."""
    ns = benchmark.costs() | dict(peer_costs())
    stages = stage_costs(compiler)
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # threads of two processes would wait for each other
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        themes = [pool.submit(must_hold.rows_of, theme, seeds) for theme in must_hold.THEMES]
        since = pool.submit(since_contact.since_contact, seeds)
        bounds = pool.submit(since_contact.steady_bounds)
        gained = pool.submit(gains, seeds)
        rows: list[Future[list[benchmark.Row]]] = []
        for name in benchmark.SINGLE:
            rows += [pool.submit(benchmark.on_scenario, name, seeds, ns), pool.submit(rival_rows, name, seeds)]
            rows += [pool.submit(peer_rows, name, seeds, ns)]
        return {
            "must_hold": [row for theme in themes for row in theme.result()],
            "rows": [row for part in rows for row in part.result()],
            "since_contact": since.result(),
            "bounds": bounds.result(),
            "stages": stages,
            "gains": gained.result(),
        }


def peers() -> dict[str, Callable[[Any, Any], Any]]:
    """Return the other libraries that are installed."""
    return {name: peer for name, peer in PEERS.items() if find_spec(name)}


def peer_costs() -> Iterator[tuple[str, float]]:
    """Return the run time of other libraries for each pair, ns."""
    run = scenarios.run("tremor", 0)
    y, x = run.hard[100:300] - 0.62, run.soft[100:300] + 0.41
    for name, peer in peers().items():
        yield name, benchmark.nanoseconds(partial(peer, y, x), len(y), repeats=5)


def peer_rows(scenario: str, seeds: int, ns: dict[str, float]) -> list[benchmark.Row]:
    """Return the rows of other libraries on one scenario, with fewer seeds."""
    runs = [scenarios.run(scenario, seed) for seed in range(min(seeds, PEER_SEEDS))]
    return [
        benchmark.summarise(scenario, name, (benchmark.bare_trace(peer, run) for run in runs), ns[name])
        for name, peer in peers().items()
    ]


def machine(compiler: str) -> dict[str, str]:
    """Return the machine and the versions of the measurement."""
    cpu = next(
        (line.split(":")[1].strip() for line in _lines("/proc/cpuinfo") if "model name" in line), platform.processor()
    )
    version = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    git = subprocess.run(
        ["git", "-C", str(BENCH), "rev-parse", "--short", "HEAD"], capture_output=True, text=True, check=False
    )
    return {"cpu": cpu, "compiler": version, "python": platform.python_version(), "commit": git.stdout.strip(),
            "palpate": palpate.__version__}  # fmt: skip


def _lines(path: str) -> list[str]:
    return Path(path).read_text().splitlines() if Path(path).exists() else []


if __name__ == "__main__":
    main()
