"""Error against run time of every estimator, ours and every rival that is installed: a picture, a table and a summary.

    python -m bench.accuracy.error_vs_time [--seeds 200] [--out bench/results]

The picture has four scenarios, as `palpate bench --plot` draws it; the table has all, each with a second row: the error of
the result, median, which `handheld` revises after the release. Writes error_vs_time.png and .json, which names the commit. Run times are measured first, alone. Exit code 1: the scene handheld is worse than another
estimator on a scenario that is not in `BETTER`. Needs the extra science.
"""

import argparse
import json
import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from palpate import benchmark
from palpate.benchmark import Row

from bench.results_age import RESULTS, about

COLUMNS = (
    "handheld scene",
    "paper scene",
    "paper +A",
    "fixed 0.995 +A",
    "fixed 0.9 +A",
    "Kalman walk +A",
    "sum / sum +A",
    "paper tuned +A",
    "restarted +A",
)
REVISED = ", revised"
TIMES = 1.1
BETTER = {
    **dict.fromkeys(
        ("slow-drift", "slow-drift" + REVISED),
        "The baselines drift against the ratio, and what lags is nearer by chance: see slow-drift-back.",
    ),
    **dict.fromkeys(
        ("tilt-walk", "tilt-walk" + REVISED, "rocking"),
        "The ratio moves all the time: what begins anew with a sample at each alarm lags less, and is worse with spikes.",
    ),
    "relaxing"
    + REVISED: "The ratio has just settled when the touch ends: a shorter memory has forgotten more of the way.",
    **dict.fromkeys(
        ("drift-hard", "drift-soft", "drift-both", "thermal", "wander"),
        "Until the release a drift of the baseline is a ratio that moves: what forgets nothing averages it.",
    ),
    "jump": "A jump of a baseline is a step of the ratio until the release.",
    **dict.fromkeys(("creep", "creep" + REVISED), "C1 / C2 moves, the ratio does not: what forgets nothing is nearer."),
    "tilted": "A probe at an angle has another ratio: each estimator is wrong by 2 %, and one on pairs that are not aligned by chance less.",
    "bursts": "A burst of noise is an alarm: the estimate begins anew, with samples of the burst.",
    "pickup" + REVISED: "The correction after the release adds the hum in the baselines before and after.",
    **dict.fromkeys(
        ("fast-converter", "fast-converter" + REVISED), "The baseline remembers 64 readings; the rivals use 2,000."
    ),
}
"""Line of the table -> why another estimator is better there by more than `TIMES`."""


def measure(seeds: int) -> list[Row]:
    """Return the rows of all scenarios; other libraries run on those of the picture only."""
    ns = benchmark.costs()
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # threads of two processes would wait for each other
    with ProcessPoolExecutor(os.cpu_count(), get_context("spawn")) as pool:
        parts = [pool.submit(_on_scenario, name, seeds, ns) for name in benchmark.SINGLE]
        return [row for part in parts for row in part.result()]


def _on_scenario(name: str, seeds: int, ns: dict[str, float]) -> list[Row]:
    bare = benchmark.bare_estimators(libraries=name in benchmark.PLOTTED)
    return benchmark.on_scenario(name, seeds, ns, bare)


def errors(rows: Iterable[Row]) -> dict[str, dict[str, float]]:
    """Return the errors, %, of each estimator for each line of the table: of each scenario, and of its revised results."""
    found: dict[str, dict[str, float]] = {}
    for row in rows:
        for line, error in ((row.scenario, row.rmse), (row.scenario + REVISED, row.end)):
            found.setdefault(line, {})[row.estimator] = 100 * error
    return found


def quotient(line: Mapping[str, float]) -> float:
    """Return the error of the scene handheld over the least of all other estimators on one line."""
    others = [error for name, error in line.items() if name not in ("handheld scene", "sliding scene")]
    return line["handheld scene"] / min(others)


def table(rows: Iterable[Row]) -> str:
    """Return the errors as text: * marks the least of a line."""
    lines = [f"{'error, %':25}" + "".join(f"{name.removesuffix(' scene'):>15}" for name in COLUMNS) + "  / best"]
    for name, line in errors(rows).items():
        least = min(line[column] for column in COLUMNS)
        cells = "".join(f"{line[c]:14.4f}{'*' if line[c] == least else ' '}" for c in COLUMNS)
        times = quotient(line)
        lines.append(f"{name:25}{cells}{times:8.2f}")
        if times > TIMES:
            lines.append(f"{'':25}{BETTER.get(name, 'FAILS: another estimator is better')}")
    return "\n".join(lines)


def summary(rows: Sequence[Row], seeds: int) -> str:
    """Return the summary as JSON, a line for each line of the table: errors in the order of its columns, per cent."""
    head = about() | {
        "seeds": seeds,
        "ns": {row.estimator: round(row.ns, 1) for row in rows if row.scenario in benchmark.PLOTTED},
        "pairs to 3 %": {row.estimator: row.pairs_to_3_percent for row in rows if row.scenario == "step-up"},
    }
    lines = [f"{json.dumps(name)}: {json.dumps(value)}" for name, value in head.items()]
    lines.append(f'"columns": {json.dumps([*COLUMNS, "handheld / best"])}')
    for name, line in errors(rows).items():
        cells = [float(f"{line[column]:.3g}") for column in COLUMNS]
        lines.append(f"{json.dumps(name)}: {json.dumps([*cells, round(quotient(line), 2)])}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=200, help="recordings of each scenario")
    parser.add_argument("--out", type=Path, default=RESULTS, help="folder for the picture and the summary")
    options = parser.parse_args()
    rows = measure(options.seeds)
    pictured = [row for name in benchmark.PLOTTED for row in rows if row.scenario == name]
    print(benchmark.table(pictured), table(rows), sep="\n\n")
    (options.out / "error_vs_time.json").write_text(summary(rows, options.seeds))
    benchmark.plot(pictured, options.out / "error_vs_time.png")
    sys.exit(any(quotient(line) > TIMES and name not in BETTER for name, line in errors(rows).items()))


if __name__ == "__main__":
    main()
