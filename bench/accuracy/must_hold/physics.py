"""Touches that do not follow C1 = r C2: drift during the touch, and how often a wrong result has no flag."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf

import numpy as np
from palpate.simulation import Scenario
from palpate.simulation.baseline import Baseline
from palpate.simulation.bumps import Bumps, Gauge

from bench.accuracy.must_hold.presses import (
    DEPTH_PF,
    RATIO,
    START_S,
    Result,
    coverage_of,
    held,
    recordings,
    result,
    rms_row,
)
from bench.accuracy.must_hold.row import Row

SILENT_PERCENT = 5.0
_HARD, _SOFT = Scenario().baselines


def rows(seeds: int) -> Iterator[Row]:
    """Return the rows of this theme."""
    for channel, limit in (("hard", 0.04), ("soft", 0.08)):
        found = results(held(baselines=changed(channel, drift_pF_per_s=3e-4, drift_from_s=START_S)), seeds)
        yield rms_row(f"drift of .3 fF/s in {channel} during the touch", found, limit)
    for name, scene in effects().items():
        found = results(scene, seeds)
        coverage, count = coverage_of(found)
        share = 100 * float(np.mean([r.silent for r in found]))
        error = 100 * float(np.median([r.error for r in found]))
        beside = f"median error {error:.2g} %; flags: {flags(found)}"
        yield Row(f"silent: {name}", share, SILENT_PERCENT, coverage=coverage, intervals=count, beside=beside)


def changed(channel: str, **baseline: float) -> tuple[Baseline, Baseline]:
    """Return the baselines of both channels, with changes in one."""
    return (replace(_HARD, **baseline), _SOFT) if channel == "hard" else (_HARD, replace(_SOFT, **baseline))


def effects() -> dict[str, Scenario]:
    """Return one scenario for each effect and size."""
    found = {"hard bump bottoms out at 75 % of its range": held(bumps=Bumps(bottoms_pF=(0.75 * RATIO * DEPTH_PF, inf)))}
    for depth, share in (("half", 2.0), ("twice", 0.5)):
        curved = Gauge(exponent=0.9, reference_pF=share * DEPTH_PF)
        found[f"soft gauge ~ F^0.9, {depth} as deep as calibrated"] = held(gauges=(Gauge(), curved))
    for first, offset in (("soft", 0.02), ("soft", 0.05), ("soft", 0.10), ("hard", -0.05)):
        found[f"{first} bump reached first, by {100 * abs(offset):g} % of the depth"] = held(bumps=Bumps(offset=offset))
    found["soft bump creeps by 5 %, tau 5 s"] = held(gauges=(Gauge(), Gauge(creep=0.05, creep_s=5.0)))
    for channel, drift_fF in (("soft", 0.03), ("soft", 0.1), ("soft", 0.3), ("soft", 1.0), ("hard", 1.0)):
        baselines = changed(channel, drift_pF_per_s=drift_fF * 1e-3, drift_from_s=START_S)
        found[f"drift of {drift_fF:g} fF/s in {channel} during the touch"] = held(baselines=baselines)
    for channel in ("hard", "soft"):
        found[f"baseline of {channel} jumps by 2 fF in the touch"] = held(
            baselines=changed(channel, jump_pF=2e-3, jump_s=START_S + 3.0)
        )
    return found


def results(scene: Scenario, seeds: int) -> list[Result]:
    """Return the result of each recording of a scenario; the source says if its stamps are the host's."""
    return [result(run, host_stamps=scene.stamps.host_s > 0) for run in recordings(scene, range(seeds))]


def flags(found: Sequence[Result]) -> str:
    """Return the share of the results with each flag, as text."""
    counts = Counter(flag for r in found for flag in r.flags)
    return ", ".join(f"{flag} {100 * n / len(found):.0f} %" for flag, n in counts.most_common()) or "none"
