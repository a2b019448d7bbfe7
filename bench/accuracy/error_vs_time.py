"""Error against run time of every estimator, ours and every rival that is installed: a picture, tables and a summary.

    python -m bench.accuracy.error_vs_time [--seeds 200] [--out bench/results]

The picture and the first table have six scenarios. The second table has all, each with a second row: the error of the
result, median, which `handheld` revises after the release; a scenario in which another estimator is better has a line that
names it. Writes error_vs_time.png and .json, which names the commit. Needs the extra science; rivals that loop over samples
need numba to be in the picture. `comparison` measures, `error_picture` draws.
"""

import argparse
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from importlib.util import find_spec
from itertools import groupby
from pathlib import Path

from bench.accuracy import rivals
from bench.accuracy.comparison import PICTURED, Row, measure
from bench.accuracy.error_picture import TIMES, plot
from bench.results_age import RESULTS, about


def rows_table(rows: Iterable[Row]) -> str:
    """Return a header and a line for each row, with an empty line between scenarios."""
    head = "scenario        estimator        rmse %   bias %  alarm %  cover %  pairs to 3 % (slowest)  ns/pair\n"
    return head + "\n\n".join(
        "\n".join(map(_line, some)) for _, some in groupby(rows, lambda row: row.scenario)
    )


def _line(r: Row) -> str:
    if math.isnan(r.pairs_to_3_percent):
        pairs = "-"
    else:
        pairs = f"{r.pairs_to_3_percent:.0f} ({r.slowest_pairs:.0f})"
    cover, ns = (
        "-" if math.isnan(value) else f"{value:.1f}" for value in (100 * r.coverage, r.cost.ns)
    )
    errors = f"{100 * r.rmse:8.4f} {100 * r.bias:8.4f} {100 * r.alarm:8.1f}"
    return f"{r.scenario:15} {r.estimator:14} {errors} {cover:>8} {pairs:>23} {ns:>8}"


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
    "robust GLR +A",
    "IMM +A",
    "DMA +A",
)
REVISED = ", revised"
BETTER = {
    "slow-drift": "The baselines drift against the ratio, and what lags is nearer by chance: see slow-drift-back.",
    **dict.fromkeys(
        ("tilt-walk", "tilt-walk" + REVISED),
        "The ratio moves all the time: what begins anew with a sample at each alarm lags less, and is worse with spikes.",
    ),
    "relaxing"
    + REVISED: "The ratio has just settled when the touch ends: a shorter memory has forgotten more of the way.",
    **dict.fromkeys(
        ("drift-hard", "drift-soft", "drift-both", "thermal", "wander"),
        "Until the release a drift of the baseline is a ratio that moves: what forgets nothing averages it.",
    ),
    "jump": "A jump of a baseline is a step of the ratio until the release.",
    **dict.fromkeys(
        ("creep", "creep" + REVISED),
        "C1 / C2 moves, the ratio does not: what forgets nothing is nearer.",
    ),
    "tilted": "A probe at an angle has another ratio: each estimator is wrong by 2 %, and one on pairs that are not aligned by chance less.",
    "pickup"
    + REVISED: "The correction after the release adds the hum in the baselines before and after.",
}
"""Line of the table -> why another estimator is better there by more than `TIMES`."""


def errors(rows: Iterable[Row]) -> dict[str, dict[str, float]]:
    """Return the errors, %, of each estimator for each line of the table: of each scenario, and of its revised results."""
    found: dict[str, dict[str, float]] = {}
    for row in rows:
        for line, error in ((row.scenario, row.rmse), (row.scenario + REVISED, row.end)):
            found.setdefault(line, {})[row.estimator] = 100 * error
    return found


def best_other(line: Mapping[str, float]) -> str:
    """Return the estimator with the least error on one line, without the scenes handheld and sliding."""
    others = line.keys() - {"handheld scene", "sliding scene"}
    return min(sorted(others), key=lambda name: line[name])


def quotient(line: Mapping[str, float]) -> float:
    """Return the error of the scene handheld over the least of all other estimators on one line."""
    return line["handheld scene"] / line[best_other(line)]


def table(rows: Iterable[Row]) -> str:
    """Return the errors as text: * marks the least of a line."""
    lines = [
        f"{'error, %':25}"
        + "".join(f"{name.removesuffix(' scene'):>15}" for name in COLUMNS)
        + "  / best"
    ]
    for name, line in errors(rows).items():
        least = min(line[column] for column in COLUMNS)
        cells = "".join(f"{line[c]:14.4f}{'*' if line[c] == least else ' '}" for c in COLUMNS)
        times = quotient(line)
        lines.append(f"{name:25}{cells}{times:8.2f}")
        if times > TIMES:
            lines.append(f"{'':25}{best_other(line)} is better. {BETTER.get(name, '')}".rstrip())
    return "\n".join(lines)


def summary(rows: Sequence[Row], seeds: int) -> str:
    """Return the summary as JSON, a line for each line of the table: errors in the order of its columns, per cent."""
    cost = {row.estimator: row.cost for row in rows if row.scenario in PICTURED}
    head = about() | {
        "seeds": seeds,
        "ns": {name: round(spent.ns, 1) for name, spent in cost.items()},
        "ns of the estimator": {name: round(spent.estimator_ns, 1) for name, spent in cost.items()},
        "pairs to 3 %": {
            row.estimator: row.pairs_to_3_percent for row in rows if row.scenario == "step-up"
        },
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
    parser.add_argument(
        "--out", type=Path, default=RESULTS, help="folder for the picture and the summary"
    )
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    if not find_spec("numba"):
        print(
            f"not in the picture without numba, which compiles them: {', '.join(rivals.COMPILED)}"
        )
    rows = measure(options.seeds)
    pictured = [row for name in PICTURED for row in rows if row.scenario == name]
    print(rows_table(pictured), table(rows), sep="\n\n")
    (options.out / "error_vs_time.json").write_text(summary(rows, options.seeds))
    plot(pictured, options.out / "error_vs_time.png")


if __name__ == "__main__":
    main()
