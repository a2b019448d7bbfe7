"""Error against run time of all estimators on all scenarios, cost and benefit of each stage, and required results.

    python -m bench.accuracy.error_vs_time [--seeds 200] [--out bench/results]

Prints the tables; writes error_vs_time.json and error_vs_time.png to the folder. Needs a C++ compiler (for
the cost of each stage) and matplotlib; uses scipy, padasip, river and filterpy if they are installed.
"""

import argparse
import json
import math
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from dataclasses import asdict
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import palpate
from palpate import benchmark
from palpate.simulation import scenarios

from bench.peers import PEERS

BENCH = Path(__file__).parents[1]
SINCE_S = (0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 5.0)


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
    """Print the time for a reading in each composition of stages."""
    paper = costs["AdaptiveRls"]["min_ns"]
    lines = [f"{'composition':47} min ns  median  / AdaptiveRls  state bytes"]
    for name, c in costs.items():
        ratio = c["min_ns"] / paper
        lines.append(f"{name:47} {c['min_ns']:6.1f} {c['median_ns']:7.1f} {ratio:14.2f} {c['state_bytes']:12.0f}")
    return "\n".join(lines)


def without_stages(seeds: int) -> str:
    """Print the error without each stage: the median of the steady rms error, per cent."""
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


def since_contact(seeds: int) -> dict[str, list[float]]:
    """Return the median absolute relative error at SINCE_S after contact, in the scenario "tremor"."""
    runs = [scenarios.run("tremor", seed) for seed in range(seeds)]
    found = {}
    for scene in ("paper", "handheld"):
        traces = [benchmark.scene_trace(scene, run) for run in runs]
        found[scene] = [
            float(np.median([abs(t.error[min(int(np.searchsorted(t.since_s, s)), len(t.error) - 1)]) for t in traces]))
            for s in SINCE_S
        ]
    return found


def contacts(seeds: int) -> tuple[int, int, int, list[int]]:
    """Count true, missed and false touches, with the errors of their starts in pairs (light touches separately)."""
    true = lost = invented = 0
    errors = []
    for name, scenario in scenarios.FOLLOWING.items():
        for seed in range(seeds):
            run = scenarios.run(name, seed)
            found = palpate.touches(run, scene="sliding" if name == "sliding" else "handheld")
            true += len(scenario.presses)
            lost += max(0, len(scenario.presses) - len(found))
            invented += max(0, len(found) - len(scenario.presses))
            for touch, press in zip(found, scenario.presses, strict=False):
                errors.append(int(touch.start - np.searchsorted(run.t_hard_s, press.start_s)))
    return true, lost, invented, errors


def ar1_coverage(runs: int) -> dict[float, float]:
    """Return the coverage of nominal 95 % intervals in white and AR(1) noise, at the end of 250 samples."""
    found = {}
    for rho in (0.0, 0.5, 0.8):
        random, hits = np.random.default_rng(1), 0
        for _ in range(runs):
            noise = np.zeros(450)
            for k, shock in enumerate(random.standard_normal(450)):
                noise[k] = rho * noise[k - 1] + math.sqrt(1 - rho**2) * shock
            regressor = 0.25 * (1 + 0.02 * random.standard_normal(250))
            estimator = palpate.HandoverRls()
            estimator.process(2.5 * regressor + 1e-3 * noise[200:], regressor)
            hits += abs(estimator.ratio - 2.5) < 1.96 * estimator.standard_error
        found[rho] = hits / runs
    return found


def must_hold(rows: list[benchmark.Row], stages: dict[str, dict[str, float]], seeds: int) -> list[str]:
    """Return the required results, each with its number and a verdict."""
    by = {(r.scenario, r.estimator): r for r in rows}

    def verdict(holds: bool, text: str) -> str:
        return f"{'holds' if holds else 'FAILS'}  {text}"

    lines = []
    for name, limit in {"tremor": 5, "strong-tremor": 5, "stiff-steady": 5, "near-rigid": 3}.items():
        hand, paper = by[name, "handheld scene"], by[name, "paper scene"]
        times = paper.rmse / hand.rmse
        lines.append(verdict(times >= limit, f"{name}: steady rmse 1/{times:.0f} of the paper's (at most 1/{limit})"))
        lines.append(
            verdict(hand.alarm < 0.01, f"{name}: alarm {100 * hand.alarm:.2f} % (paper {100 * paper.alarm:.0f} %)")
        )
    for name in ("step-up", "step-down"):
        hand, fast = by[name, "handheld scene"], by[name, "fixed 0.9"]
        holds = hand.pairs_to_3_percent <= min(20, fast.pairs_to_3_percent)
        text = f"{name}: within 3 % after {hand.pairs_to_3_percent:.0f} pairs, at worst {hand.slowest_pairs:.0f}"
        lines.append(verdict(holds, f"{text} (at most 20; lambda 0.9: {fast.pairs_to_3_percent:.0f})"))
    light, spikes = by["light-touch", "handheld scene"], by["spikes", "handheld scene"]
    squares = by.get(("light-touch", "lfilter 0.995"), by["light-touch", "fixed 0.995"])
    lines.append(
        verdict(
            abs(light.bias) < 0.01,
            f"light-touch: bias {100 * light.bias:.2f} % (least squares {100 * squares.bias:.1f} %)",
        )
    )
    lines.append(
        verdict(
            spikes.alarm < 1e-3,
            f"spikes of 100 sigma: rmse {100 * spikes.rmse:.4f} %, alarm {100 * spikes.alarm:.2f} %",
        )
    )
    true, lost, invented, errors = contacts(seeds)
    lines.append(
        verdict(
            lost == invented == 0,
            f"touches in {seeds} recordings of each scenario: {true} true, {lost} lost, {invented} invented",
        )
    )
    share = np.mean(np.abs(errors) <= 3)
    lines.append(
        verdict(bool(share == 1), f"starts within 3 pairs: {100 * share:.2f} %, from {min(errors)} to {max(errors)}")
    )
    for rho, coverage in ar1_coverage(2000).items():
        lines.append(
            verdict(0.93 <= coverage <= 0.97, f"95 % intervals, AR(1) noise of rho {rho}: cover {100 * coverage:.1f} %")
        )
    coverage = by["tremor", "handheld scene"].coverage
    lines.append(verdict(0.9 <= coverage <= 0.98, f"95 % intervals, tremor: cover {100 * coverage:.1f} %"))
    times = stages["scene handheld"]["min_ns"] / stages["AdaptiveRls"]["min_ns"]
    lines.append(
        verdict(times <= 6, f"handheld with all stages: {times:.1f} times AdaptiveRls in ns a reading (at most 6)")
    )
    return lines


def figure(rows: list[benchmark.Row], path: Path) -> None:
    """Plot error against run time, one panel for each of four scenarios."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    shown = ("stiff-steady", "strong-tremor", "step-up", "light-touch")
    names = list(dict.fromkeys(r.estimator for r in rows if math.isfinite(r.ns)))
    figure, axes = plt.subplots(2, 2, figsize=(9, 6.4), sharex=True, layout="constrained")
    markers = dict(zip(names, "sDo^vPX*<>", strict=False))
    colours = dict(zip(names, ["C0", "C3", "C1", "C2", "C9", "C4", "C5", "C6", "C7"], strict=False))
    for ax, scenario in zip(axes.flat, shown, strict=True):
        for r in rows:
            if r.scenario == scenario and math.isfinite(r.ns):
                ours = r.estimator == "handheld scene"
                ax.loglog(r.ns, 100 * r.rmse, markers[r.estimator], ms=10 if ours else 7, label=r.estimator,
                          color=colours[r.estimator], mec="k", mew=0.6)  # fmt: skip
        ax.set_title(scenario, loc="left", fontsize=10)
        ax.grid(visible=True, which="major", alpha=0.3)
        ax.set_axisbelow(True)
    for ax in axes[1]:
        ax.set_xlabel("run time, ns a pair (minimum)")
    for ax in axes[:, 0]:
        ax.set_ylabel("steady error of the ratio, rms, %")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside right upper", fontsize=9)
    figure.suptitle("Error against run time, simulated touches (lower left is better)", fontsize=11)
    figure.savefig(path, dpi=130)


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


def main() -> None:
    """Run, print, write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=200, help="recordings of each scenario")
    parser.add_argument("--out", type=Path, default=BENCH / "results", help="folder for the JSON and the figure")
    arguments = parser.parse_args()
    compiler = os.environ.get("CXX") or shutil.which("c++") or sys.exit("a C++ compiler is needed: none found as c++")
    peers = {name: peer for name, peer in PEERS.items() if find_spec(name)}
    missing = sorted(set(PEERS) - set(peers))
    print(f"{machine(compiler)}\nseeds: {arguments.seeds}; not installed: {', '.join(missing) or 'none'}\n")
    rows = benchmark.compare(arguments.seeds, extra=None)
    if peers:
        rows += peer_rows(peers, min(arguments.seeds, 20))
    rows.sort(key=lambda r: benchmark.SINGLE.index(r.scenario))
    stages = stage_costs(compiler)
    since = since_contact(arguments.seeds)
    holds = must_hold(rows, stages, arguments.seeds)
    print(benchmark.table(rows), end="\n\n")
    print("time since contact, tremor: " + "".join(f"{s:>9} s" for s in SINCE_S))
    for scene, errors in since.items():
        print(f"{scene:28}" + "".join(f"{100 * e:9.4f} %" for e in errors))
    print("", stage_table(stages), "", without_stages(min(arguments.seeds, 50)), "", *holds, sep="\n")
    arguments.out.mkdir(parents=True, exist_ok=True)
    document = {"machine": machine(compiler), "seeds": arguments.seeds, "rows": [asdict(r) for r in rows],
                "since_contact_s": SINCE_S, "error_since_contact": since, "stages": stages, "must_hold": holds}  # fmt: skip
    text = json.dumps(document, indent=1).replace("NaN", "null")
    (arguments.out / "error_vs_time.json").write_text(text + "\n")
    figure(rows, arguments.out / "error_vs_time.png")
    sys.exit(any(line.startswith("FAILS") for line in holds))


def peer_rows(peers: dict[str, Any], seeds: int) -> list[benchmark.Row]:
    """Run other libraries: with fewer seeds, since they take microseconds for each sample."""
    rows = []
    for name, peer in peers.items():
        runs = {scenario: [scenarios.run(scenario, seed) for seed in range(seeds)] for scenario in benchmark.SINGLE}
        run = runs["tremor"][0]
        held = slice(100, 300)
        y, x = run.hard[held] - 0.62, run.soft[held] + 0.41
        ns = benchmark.nanoseconds(partial(peer, y, x), len(y), repeats=5)
        for scenario, all_runs in runs.items():
            traces = (benchmark.bare_trace(peer, r) for r in all_runs)
            rows.append(benchmark.summarise(scenario, name, traces, ns))
    return rows


if __name__ == "__main__":
    main()
