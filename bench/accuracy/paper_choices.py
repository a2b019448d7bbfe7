"""What each setting of the paper's algorithm changes: those that the paper gives, and those that are choices.

    python -m bench.accuracy.paper_choices [--seeds 40]

The scene `paper` with one setting changed at a time, on named scenarios: steady error, share of the steady part with an
alarm, pairs to 3 % after a step. The last column has no scene: AdaptiveRls alone gets every change of a recording, and
the column is the rms distance of the ratio from its last value in the press, in the fifth minute without a press.
"""

import argparse
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import palpate
from palpate import benchmark
from palpate.simulation import Simulation, scenarios, simulate
from palpate.simulation.press import Press
from palpate.simulation.scenario import Scenario

Settings = dict[str, float]
NAMES = ("stiff-steady", "tremor", "strong-tremor", "step-up", "slow-drift", "light-touch")
STEP = "step-up"
SHORT = {
    "drift": "d",
    "threshold": "h",
    "clear_level": "cleared at",
    "initial_covariance": "P0",
    "max_covariance": "bound",
}
THRESHOLD = palpate.AdaptiveRls().settings["threshold"]
IDLE = Scenario(presses=[Press(2.0, [(0.0, 2.8)])], duration_s=310.0)
IDLE_SEEDS, LAST_S = 10, 60.0  # at most so many long recordings


@dataclass(frozen=True)
class Row:
    """One choice of settings: its scenarios by name, and the ratio without a press."""

    settings: Settings
    scenarios: dict[str, benchmark.Row]
    wander: float


def choices() -> list[list[Settings]]:
    """Return the settings to compare, in groups."""
    thresholds, drifts = (0.0, 0.01, 0.1, 0.2, 0.5, 1.0), (0.001, 0.005, 0.02, 0.05)
    return [
        [{}, *({"clear_level": level} for level in (0.01, THRESHOLD))],
        [{"threshold": h} for h in thresholds],
        [{"threshold": h, "clear_level": h} for h in thresholds[1:]],
        [{"drift": d} for d in drifts],
        [{"drift": d, "clear_level": THRESHOLD} for d in drifts],
        [{"initial_covariance": p} for p in (1e0, 1e2, 1e4, 1e6, 1e8, 1e10)],
        [{"initial_covariance": p, "max_covariance": p} for p in (1e2, 1e3, 1e4, 1e6)],
    ]


def measure(seeds: int) -> Callable[[Settings], Row]:
    """Simulate the recordings; return the function that measures a choice on them."""
    runs = {name: [scenarios.run(name, seed) for seed in range(seeds)] for name in NAMES}
    idle = [simulate(IDLE, seed) for seed in range(min(seeds, IDLE_SEEDS))]

    def measured(settings: Settings) -> Row:
        traces = {name: (benchmark.scene_trace("paper", run, **settings) for run in runs[name]) for name in NAMES}
        rows = {name: benchmark.summarise(name, "paper", traces[name], math.nan) for name in NAMES}
        return Row(settings, rows, float(np.median([wander(run, settings) for run in idle])))

    return measured


def wander(run: Simulation, settings: Settings) -> float:
    """Return the rms distance of the ratio of AdaptiveRls from its last value in the press, long after it."""
    press = run.presses[0]
    before = run.t_hard_s < press.start_s
    ratio = palpate.AdaptiveRls(**settings).process(
        run.hard - run.hard[before].mean(), run.soft - run.soft[before].mean()
    )
    last = ratio[np.searchsorted(run.t_hard_s, press.start_s + press.rise_s + press.hold_s) - 1]
    late = run.t_hard_s > run.t_hard_s[-1] - LAST_S
    return float(np.sqrt(np.mean((ratio[late] - last) ** 2)))


def table(rows: Iterable[Iterable[Row]]) -> str:
    """Return the groups of rows as text."""
    names = "".join(f"{name:>14}" for name in NAMES)
    lines = [f"{'error %, alarm %':25}{names}  pairs  no press"]
    for group in rows:
        lines += [*map(line, group), ""]
    return "\n".join(lines[:-1])


def line(row: Row) -> str:
    """Return one row of the table."""
    label = ", ".join(f"{SHORT[name]} {value:g}" for name, value in row.settings.items()) or "default"
    cells = "".join(f"{100 * found.rmse:10.4f}{100 * found.alarm:4.0f}" for found in row.scenarios.values())
    return f"{label:25}{cells}{row.scenarios[STEP].pairs_to_3_percent:7.0f}{row.wander:10.2g}"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=40, help="recordings of each scenario")
    measured = measure(parser.parse_args().seeds)
    print(table(map(measured, group) for group in choices()))


if __name__ == "__main__":
    main()
