"""Cost and benefit of each stage: time and state of each composition, and the error as one is added after the other.

    python -m bench.accuracy.stages [--seeds 20]

Prints the errors; bench.accuracy.error_vs_time prints both.
"""

import argparse
import itertools
import json
import math
import subprocess
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate import benchmark
from palpate.benchmark import Array, ErrorTrace, Estimate
from palpate.simulation import Simulation, scenarios

from bench.rivals import fixed, paper, rival_trace

BENCH = Path(__file__).parents[1]
NEVER, LEFT_OUT = 1e9, 100.0  # a threshold without alarms; more samples than a CUSUM side has at an alarm


def _handover(**settings: float) -> Estimate:
    def estimate(output: Array, regressor: Array) -> tuple[Array, NDArray[np.bool_]]:
        rows = palpate.HandoverRls(**settings).trace(output, regressor)
        return rows["ratio"], rows["alarm"]

    return estimate


def stage_costs(compiler: str) -> dict[str, dict[str, float]]:
    """Build and run bench/speed/stages.cpp; return what a first pass over new readings takes."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "stages"
        flags = ["-O3", "-std=c++17", f"-I{palpate.get_include()}"]
        subprocess.run([compiler, *flags, str(BENCH / "speed" / "stages.cpp"), "-o", str(program)], check=True)
        found = json.loads(subprocess.run([program], capture_output=True, check=True).stdout)
    names = [name.removeprefix("bytes, ") for name in found if name.startswith("bytes, ")]
    return {
        name: {
            "min_ns": found[name]["min"],
            "median_ns": found[name]["median"],
            "state_bytes": found[f"bytes, {name}"],
        }
        for name in names
    }


def stage_table(costs: dict[str, dict[str, float]]) -> str:
    """Return the time for a reading in each composition of stages, as text."""
    paper = costs["AdaptiveRls"]["min_ns"]
    lines = [f"{'composition':47} min ns  median  / AdaptiveRls  state bytes"]
    for name, c in costs.items():
        ratio = c["min_ns"] / paper
        lines.append(f"{name:47} {c['min_ns']:6.1f} {c['median_ns']:7.1f} {ratio:14.2f} {c['state_bytes']:12.0f}")
    return "\n".join(lines)


SHOWN = (
    *(
        "stiff-steady",
        "tremor",
        "strong-tremor",
        "skew",
        "step-up",
        "slow-drift",
        "relaxing",
        "tilt-ramp",
        "light-touch",
    ),
    *("spikes", "bursts"),
)
STEPS: dict[str, Callable[[Simulation], ErrorTrace]] = {
    "paper": partial(benchmark.bare_trace, paper),
    "+ alignment": partial(rival_trace, paper),
    "one memory": partial(rival_trace, fixed(0.995)),
    "+ noise": partial(rival_trace, _handover(smoothing=1.0, threshold=NEVER)),
    "+ instrument": partial(rival_trace, _handover(threshold=NEVER)),
    "+ detector": partial(rival_trace, _handover(guard=LEFT_OUT)),
    "+ hand-over": partial(rival_trace, _handover()),
    "the scene": partial(benchmark.scene_trace, "handheld"),
}
"""From the paper's estimator to the scene handheld, one part after the other. All but the last know when the press begins."""
KEY = """\
median steady rms error, %, as one part is added after the other; in brackets: error before / error with this part
  paper        its estimator, on readings that are not aligned     + alignment  the matched pair of filters
  one memory   forgetting 0.995 without a switch                   + noise      outliers out; forgets while it drifts
  + instrument in place of least squares                           + detector   whitened CUSUM; an alarm begins anew
  + hand-over  begins with the samples since the CUSUM was 0       the scene    its own gate and baseline"""


def gains(seeds: int) -> dict[str, dict[str, float]]:
    """Return the median steady rms error after each step, for each scenario of SHOWN."""
    found = {}
    for name in SHOWN:
        runs = [scenarios.run(name, seed) for seed in range(seeds)]
        found[name] = {
            step: benchmark.summarise(name, step, map(trace, runs), math.nan).rmse for step, trace in STEPS.items()
        }
    return found


def gains_table(found: dict[str, dict[str, float]]) -> str:
    """Return the errors as text, per cent, each with the factor of its step."""
    lines = [KEY, f"{'':14}" + "".join(f"{step:>18}" for step in next(iter(found.values())))]
    for name, errors in found.items():
        factors = ["", *(f"({before / after:.2f})" for before, after in itertools.pairwise(errors.values()))]
        cells = [f"{100 * error:8.4f} {factor:>9}" for error, factor in zip(errors.values(), factors, strict=True)]
        lines.append(f"{name:14}" + "".join(cells))
    return "\n".join(lines)


def main() -> None:
    """Print the errors."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20, help="recordings of each scenario")
    print(gains_table(gains(parser.parse_args().seeds)))


if __name__ == "__main__":
    main()
