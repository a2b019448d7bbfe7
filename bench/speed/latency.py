"""Latency: how old a ratio is when Python has it, by stage, and how long a contact takes until it is found.

    python -m bench.speed.latency [--pairs 1000] [--touches 200] [--out bench/results/latency.json]
    python -m bench.speed.latency --table                             print the table of docs/speed.md

The first table is live: the simulated board in real time, read by the real driver, through ring and tracker. The times
of its bus are assumptions (palpate.ad7746.twin.kit), not measured on a board. Its column "idle" is by a virtual clock. It
and the second table, computed from simulated touches, are the same on every machine.
"""

import argparse
import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate.ad7746.datasheet import CONVERSION_S
from palpate.simulation import scenarios
from palpate.simulation.probe import simulate
from palpate.simulation.scenario import Scenario

from bench.results_age import headers_hash
from bench.speed.__main__ import commit, processor
from bench.speed.live_ages import STAGES, board_ages, live_ages

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "bench" / "results" / "latency.json"
MARK, END = "<!-- python -m bench.speed.latency --table -->", "<!-- end -->"

PERCENT = (50, 90, 99, 100)
LIVE = "four-specimens"
GATES = ("stiff-steady", "strong-tremor", "light-touch")


def alignment_pairs() -> float:
    """Return by how many pairs the ratio lags behind the last one: measured on a ratio that rises like a ramp.

    Without memory (steady 0.01) and without the detector the estimator gives the ratio of the last pair, 0.01 pairs late.
    """
    period, slope, touch = 0.026, 0.02, 100
    t_hard = period * np.arange(400)
    t_soft = t_hard + period / 2
    truth = 2 + slope * np.arange(400)
    pressed = np.where(np.arange(400) < touch, 0.0, 1.0)
    tracker = palpate.Tracker("handheld", steady=0.01, threshold=1e9, clip=100.0, samples=None)
    rows = tracker.process(t_hard, t_soft, truth * pressed, pressed)
    return float(np.round(np.median((truth - rows["ratio"])[-200:]) / slope, 1))


def shifted(name: str, share: float) -> Scenario:
    """Return a scenario whose presses begin later by this share of a pair: no press waits for the converter."""
    scenario = scenarios.SCENARIOS[name]
    late = share * scenario.converter.period_s
    return replace(scenario, presses=[replace(press, start_s=press.start_s + late) for press in scenario.presses])


def gate(name: str, touches: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the pairs that a touch needs until it is found, and the time, ms, until the last of them is converted.

    Both count from the moment at which the bumps touch the object. The first ratio comes with the same pair.

    Parameters
    ----------
    name : str
        A scenario.
    touches : int
        Number of seeds; the first touch of each. They begin at all phases of the converter.
    """
    pairs, times = [], []
    for seed in range(touches):
        run = simulate(shifted(name, seed / touches), seed)
        rows = palpate.Tracker("handheld").process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
        found, start = int(rows["contact"].argmax()), run.presses[0].start_s
        assert np.isfinite(rows["ratio"][found])
        pairs.append(found + 1 - int(np.searchsorted(run.t_soft_s, start)))
        times.append(1e3 * (run.t_soft_s[found] + CONVERSION_S[0] / 2 - start))
    return np.array(pairs), np.array(times)


def percentiles(values: NDArray[Any]) -> list[float]:
    """Return the median, the 90th and 99th percentile and the maximum."""
    return [round(float(v), 4) for v in np.percentile(values, PERCENT)]


def measure(pairs: int, touches: int, seed: int) -> dict[str, Any]:
    """Run both parts."""
    ages, together = live_ages(LIVE, pairs=pairs, seed=seed)
    board = board_ages(LIVE, pairs=pairs, seed=seed)
    gates = {name: gate(name, touches) for name in GATES}
    return {
        "pairs": len(together),
        "stages": {name: percentiles(ages[name]) for name in STAGES},
        "together": percentiles(together),
        "board": {name: round(float(np.median(times)), 4) for name, times in board.items()},
        "alignment pairs": alignment_pairs(),
        "touches": touches,
        "gate pairs": {name: percentiles(pairs) for name, (pairs, _) in gates.items()},
        "gate ms": {name: percentiles(times) for name, (_, times) in gates.items()},
    }


def table(found: dict[str, Any]) -> str:
    """Return the table of docs/speed.md."""

    def row(name: str, cells: list[float | None], digits: int) -> str:
        shown = ("" if value is None else f"{value:.{digits}f}" for value in cells)
        return f"| {name} | " + " | ".join(shown) + " |"

    head = ["| | 50 % | 90 % | 99 % | largest |", "|---|---|---|---|---|"]
    busy = f"{found['processors']} processors, load {found['load']:.1f}"
    lines = [
        f"Age of the ratio, ms, {found['pairs']} pairs, {busy}. Idle: without the computer, by the clock of the board.",
        "",
    ]
    lines += ["| | idle | 50 % | 90 % | 99 % | largest |", "|---|---|---|---|---|---|"]
    idle = found["board"]
    for name, values in found["stages"].items():
        lines.append(row(f"{name}: {STAGES[name]}", [idle.get(name), *values], 2))
    lines += [row("together", [sum(idle.values()), *found["together"]], 2), ""]
    lines += [f"From the contact of the bumps until it is found, {found['touches']} touches each:", "", *head]
    for name in found["gate pairs"]:
        lines += [row(f"`{name}`, pairs", found["gate pairs"][name], 0)]
        lines += [row(f"`{name}`, ms", found["gate ms"][name], 0)]
    return "\n".join(lines)


def with_table(text: str, found: dict[str, Any]) -> str:
    """Replace the table between its two marks in the page."""
    before, _, rest = text.partition(MARK)
    return f"{before}{MARK}\n{table(found)}\n{END}{rest.partition(END)[2]}"


def main() -> None:
    """Measure, print and write; or print the table of the last measurement."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--pairs", type=int, default=1000, help="of the live measurement")
    parser.add_argument("--touches", type=int, default=200, help="seeds of each scenario for the gate")
    parser.add_argument("--seed", type=int, default=1, help="of the live measurement")
    parser.add_argument("--out", type=Path, default=RESULTS, help="where the figures go")
    parser.add_argument("--table", action="store_true", help="print the table of docs/speed.md from the file")
    options = parser.parse_args()
    if options.table:
        print(table(json.loads(options.out.read_text())))
        return
    about = {
        "machine": processor(),
        "processors": os.cpu_count(),
        "load": os.getloadavg()[0],
        "palpate": palpate.__version__,
        "commit": commit(),
        "headers": headers_hash(),
    }
    found = about | measure(options.pairs, options.touches, options.seed)
    print(f"{found['machine']}, {found['processors']} processors, load {found['load']:.1f}; commit {found['commit']}")
    print(f"lag of the ratio behind the last pair, by the alignment, in pairs: {found['alignment pairs']:g}\n")
    print(table(found))
    options.out.write_text(json.dumps(found, indent=1) + "\n")
    if options.out == RESULTS:
        page = ROOT / "docs" / "speed.md"
        page.write_text(with_table(page.read_text(), found))


if __name__ == "__main__":
    main()
