"""Cost and benefit of each stage: its run time and state, and the error as one part after the other is added.

    python -m bench.accuracy.stages [--seeds 20]

Prints both tables. Needs a C++ compiler.
"""

import argparse
import itertools
import math
from collections.abc import Callable
from functools import partial

from palpate import HandoverRls
from palpate.simulation import Simulation, scenarios

from bench.accuracy import comparison
from bench.accuracy.comparison import ErrorTrace, pairs_aligned, traced
from bench.speed.calls import measure_native

NEVER = math.inf  # samples from alarm to alarm


def cost_table() -> str:
    """Return what a first pass over new readings takes, by bench/speed/native.cpp."""
    rows = {name: row for name, row in measure_native(100).items() if isinstance(row, dict)}
    lines = [f"{'composition':47} min ns  median  / AdaptiveRls  state bytes"]
    for name, row in rows.items():
        quotient = row["min"] / rows["AdaptiveRls"]["min"]
        lines.append(
            f"{name:47} {row['min']:6.1f} {row['median']:7.1f} {quotient:14.2f} {row['bytes']:12d}"
        )
    return "\n".join(lines)


def _aligned(estimate: comparison.Estimate, run: Simulation) -> ErrorTrace:
    return pairs_aligned(run).trace(estimate)


SHOWN = ("stiff-steady", "tremor", "strong-tremor", "skew", "step-up", "slow-drift", "relaxing", "tilt-ramp",
         "light-touch", "spikes", "bursts")  # fmt: skip
STEPS: dict[str, Callable[[Simulation], ErrorTrace]] = {
    "paper": lambda run: comparison.pairs_as_read(run).trace(comparison.OWN["paper"]),
    "+ alignment": partial(_aligned, comparison.OWN["paper"]),
    "one memory": partial(_aligned, comparison.OWN["fixed 0.995"]),
    "+ windows": partial(_aligned, traced(HandoverRls, smoothing=1.0, false_alarm_interval=NEVER)),
    "+ instrument": partial(_aligned, traced(HandoverRls, false_alarm_interval=NEVER)),
    "+ detectors": partial(_aligned, traced(HandoverRls)),
    "the scene": partial(comparison.scene_trace, "handheld"),
}
"""From the paper's estimator to HandoverRls, one part after the other, and the scene. All but it know when the press begins."""
KEY = """\
median steady rms error, %, as one part is added after the other; in brackets: error before / error with this part
  paper        its estimator, on readings that are not aligned     + alignment  the matched pair of filters
  one memory   forgetting 0.995 without a switch                   + windows    outliers out; reads what agrees
  + instrument in place of least squares                           + detectors  CUSUM and windows cut: HandoverRls
  the scene    its own gate and baseline, and its own estimator, Handover"""


def gains(seeds: int) -> dict[str, dict[str, float]]:
    """Return the median steady rms error after each step, for each scenario of SHOWN."""
    found = {}
    for name in SHOWN:
        runs = [scenarios.run(name, seed) for seed in range(seeds)]
        found[name] = {
            step: comparison.summarise(name, step, map(trace, runs)).rmse
            for step, trace in STEPS.items()
        }
    return found


def gains_table(found: dict[str, dict[str, float]]) -> str:
    """Return the errors as text, per cent, each with the factor of its step."""
    lines = [KEY, f"{'':14}" + "".join(f"{step:>18}" for step in next(iter(found.values())))]
    for name, errors in found.items():
        factors = [
            "",
            *(f"({before / after:.2f})" for before, after in itertools.pairwise(errors.values())),
        ]
        cells = [
            f"{100 * error:8.4f} {factor:>9}"
            for error, factor in zip(errors.values(), factors, strict=True)
        ]
        lines.append(f"{name:14}" + "".join(cells))
    return "\n".join(lines)


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20, help="recordings of each scenario")
    options = parser.parse_args()
    print(cost_table(), gains_table(gains(options.seeds)), sep="\n\n")


if __name__ == "__main__":
    main()
