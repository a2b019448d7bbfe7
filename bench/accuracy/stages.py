"""Cost and benefit of each stage: time and state of each composition, and the error without it."""

import json
import math
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import palpate
from palpate import benchmark
from palpate.simulation import scenarios

BENCH = Path(__file__).parents[1]


def stage_costs(compiler: str) -> dict[str, dict[str, float]]:
    """Build and run bench/speed/stages.cpp."""
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder) / "stages"
        flags = ["-O3", "-std=c++17", f"-I{palpate.get_include()}"]
        subprocess.run([compiler, *flags, str(BENCH / "speed" / "stages.cpp"), "-o", str(program)], check=True)
        found: dict[str, dict[str, float]] = json.loads(
            subprocess.run([program], capture_output=True, check=True).stdout
        )
        return found


def stage_table(costs: dict[str, dict[str, float]]) -> str:
    """Return the time for a reading in each composition of stages, as text."""
    paper = costs["AdaptiveRls"]["min_ns"]
    lines = [f"{'composition':47} min ns  median  / AdaptiveRls  state bytes"]
    for name, c in costs.items():
        ratio = c["min_ns"] / paper
        lines.append(f"{name:47} {c['min_ns']:6.1f} {c['median_ns']:7.1f} {ratio:14.2f} {c['state_bytes']:12.0f}")
    return "\n".join(lines)


def without_stages(seeds: int) -> str:
    """Return the error without each stage, as text: the median of the steady rms error, per cent."""
    hand, bare = palpate.HandoverRls, benchmark.bare_trace

    def estimate(output: Any, regressor: Any) -> Any:
        rows = hand().trace(output, regressor)
        return rows["ratio"], rows["alarm"]

    def squares(output: Any, regressor: Any) -> Any:
        rows = hand(smoothing=1.0).trace(output, regressor)
        return rows["ratio"], rows["alarm"]

    lines = ["scenario        handheld   not aligned, truth's baseline   ... and the last regressor as instrument"]
    for name in ("soft-steady", "tremor", "strong-tremor", "light-touch", "step-down"):
        runs = [scenarios.run(name, seed) for seed in range(seeds)]
        whole = benchmark.summarise(name, "", (benchmark.scene_trace("handheld", r) for r in runs), math.nan)
        unaligned = benchmark.summarise(name, "", (bare(estimate, r) for r in runs), math.nan)
        last = benchmark.summarise(name, "", (bare(squares, r) for r in runs), math.nan)
        lines.append(f"{name:14} {100 * whole.rmse:8.4f} % {100 * unaligned.rmse:21.4f} % {100 * last.rmse:29.4f} %")
    return "\n".join(lines)
