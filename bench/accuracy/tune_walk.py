"""Tune the random walk of the Kalman filter in bench/rivals.py: one quotient of variances for all scenarios.

    python -m bench.accuracy.tune_walk [--seeds 10]

Prints, for each quotient, the geometric mean over all scenarios of the median steady error; the least is the best. The
seeds begin at 1000: other recordings than those of the tables.
"""

import argparse
import math
from collections.abc import Sequence

import numpy as np
from palpate.benchmark import SINGLE, summarise
from palpate.simulation import scenarios

from bench.aligned import contact
from bench.rivals import WALK, kalman_walk, trace

FIRST_SEED = 1000
WALKS = tuple(float(walk) for walk in np.logspace(-2, 3, 21).round(4))


def scores(seeds: int, names: Sequence[str] = SINGLE, walks: Sequence[float] = WALKS) -> dict[float, float]:
    """Return the geometric mean of the errors for each quotient, 1/pF^2."""
    logs = np.zeros(len(walks))
    for name in names:
        traces = []
        for seed in range(FIRST_SEED, FIRST_SEED + seeds):
            run = scenarios.run(name, seed)
            at, output, regressor = contact(run)
            ratios = kalman_walk(output, regressor, np.array(walks))
            traces.append([trace(run, at, ratio) for ratio in ratios.T])
        logs += [math.log(summarise(name, "", found, math.nan).rmse) for found in zip(*traces, strict=True)]
    return dict(zip(walks, np.exp(logs / len(names)).tolist(), strict=True))


def main() -> None:
    """Print the scores."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=10, help="recordings of each scenario")
    seeds = parser.parse_args().seeds
    found = scores(seeds)
    print(f"{len(SINGLE)} scenarios, seeds {FIRST_SEED} to {FIRST_SEED + seeds - 1}\nq / r, 1/pF^2   error, %")
    for walk, error in found.items():
        note = "  least" if error == min(found.values()) else ""
        print(f"{walk:13.4g} {100 * error:10.4f}{note}{'  in the tables' if walk == WALK else ''}")


if __name__ == "__main__":
    main()
