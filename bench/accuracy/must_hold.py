"""Required results of the scenes handheld and sliding, each with its limit.

    python -m bench.accuracy.must_hold [--seeds 100] [THEME ...]

A row `holds`, FAILS, or is `known` not to hold, with the reason below it. Exit code 1: one FAILS. Needs the extra science.
"""

import argparse
import math
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from math import inf
from typing import Any

import numpy as np
import palpate
from palpate.ad7746.registers import NOISE_PF
from palpate.simulation import Press, Scenario, Simulation, scenarios, simulate
from palpate.simulation.mechanics import Bumps, Gauge
from palpate.simulation.readings import BaselineModel, ConverterModel, Faults, Stamps

from bench.accuracy.bound import Setup, bound
from bench.accuracy.presses import (
    DEPTH_PF,
    PAIR_S,
    RATIO,
    START_S,
    Result,
    afterwards,
    coverage_of,
    held,
    recordings,
    result,
    running,
    spline_ratio,
)
from bench.accuracy.scene_rows import scene_rows
from bench.accuracy.slides import LIGHT_PF, SLIDES, Slide, after_slides, largest_error


@dataclass(frozen=True)
class Row:
    """A required result.

    Attributes
    ----------
    name : str
    value, limit : float
        In `unit`.
    unit : str
    at_least : bool
        The limit is a lower one.
    coverage : float, in [0, 1]
        Share of the nominal 95 % intervals without a flag that hold the truth; nan if there were none.
    intervals : int
        Their number.
    beside : str
        More about the value, as text.
    reason : str
        Why the limit cannot be kept, a sentence; empty where it has to be.
    """

    name: str
    value: float
    limit: float
    unit: str = "%"
    at_least: bool = False
    coverage: float = math.nan
    intervals: int = 0
    beside: str = ""
    reason: str = ""

    @property
    def verdict(self) -> str:
        """Whether it "holds", is "known" not to, with a reason, or "FAILS"."""
        holds = self.value >= self.limit if self.at_least else self.value <= self.limit
        return "holds" if holds else "known" if self.reason else "FAILS"

    def __str__(self) -> str:
        """Return the row as text; a limit that is not kept for a known reason has this reason below."""
        limit = f"{'at least' if self.at_least else 'at most'} {self.limit:.4g} {self.unit}"
        cover = "-" if math.isnan(self.coverage) else f"{100 * self.coverage:.1f} %"
        text = f"{self.verdict} {self.name:68}{self.value:>9.3g}  {limit:>18}  {cover:>7}  {self.beside}"
        return text.rstrip() + (f"\n      {self.reason}" if self.verdict == "known" else "")


def rms_row(name: str, results: Sequence[Result], limit: float, **more: Any) -> Row:
    """Return the row of the rms error, %, with the coverage of the intervals without a flag."""
    coverage, count = coverage_of(results)
    value = 100 * math.sqrt(np.mean([r.error**2 for r in results]))
    return Row(name, value, limit, coverage=coverage, intervals=count, **more)


def between(name: str, coverage: float, low: float, high: float, **more: Any) -> Iterator[Row]:
    """Return the two rows of a coverage with a lower and an upper limit, %."""
    for limit, at_least in ((low, True), (high, False)):
        yield Row(name, 100 * coverage, limit, at_least=at_least, **more)


def lowest_coverage(theme: str, rows: Iterable[Row], enough: int = 20) -> Row:
    """Return the row of the lowest coverage among rows with enough intervals."""
    counted = [row for row in rows if row.intervals >= enough]
    nothing = Row("no row has enough intervals", inf, 0.0, coverage=1.0)
    worst = min(counted, key=lambda row: row.coverage, default=nothing)
    name = f"{theme}: lowest coverage of 95 % intervals without a flag"
    return Row(
        name, 100 * worst.coverage, 90.0, at_least=True, beside=f"{worst.name}; {len(counted)} rows"
    )


def results(scene: Scenario, seeds: int) -> list[Result]:
    """Return the result of each recording of a scenario; the source says if its stamps are the host's."""
    return [
        result(run, host_stamps=scene.stamps.host_s > 0) for run in recordings(scene, range(seeds))
    ]


def flags(found: Sequence[Result]) -> str:
    """Return the share of the results with each flag, as text."""
    counts = Counter(flag for r in found for flag in r.flags)
    return "flags: " + (
        ", ".join(f"{flag} {100 * n / len(found):.0f} %" for flag, n in counts.most_common())
        or "none"
    )


# The touches in the named scenarios. Their errors, beside other estimators: error_vs_time.py.

QUIET = 1.2  # as ContactSettings::quiet of the core


def contacts(seeds: int) -> Iterator[Row]:
    """Return the rows of true, missed and false touches, and of their starts."""
    true = lost = invented = 0
    errors: list[int] = []
    for name, scenario in scenarios.FOLLOWING.items():
        for seed in range(seeds):
            run = scenarios.run(name, seed)
            found = palpate.touches(run, scene="sliding" if name == "sliding" else "handheld")
            true += len(scenario.presses)
            lost += max(0, len(scenario.presses) - len(found))
            invented += max(0, len(found) - len(scenario.presses))
            starts = zip(found, scenario.presses, strict=False)
            errors += [start_error(run, press, touch.start) for touch, press in starts]
    beside = f"of {true}: {lost} lost, {invented} invented"
    yield Row(
        "touches in the named scenarios: lost or invented",
        lost + invented,
        0.0,
        "touches",
        beside=beside,
    )
    share = 100 * float(np.mean(np.abs(errors) <= 3))
    beside = f"from {min(errors)} to {max(errors)}"
    yield Row(
        "starts within 3 pairs, from where a press can be seen",
        share,
        99.9,
        at_least=True,
        beside=beside,
    )


def start_error(run: Simulation, press: Press, start: int) -> int:
    """Return the error of a start, pairs: before the press begins, or after the gate can see it.

    The gate takes the first reading after the last one below 1.2 standard deviations of the noise. Before the press has
    reached that, most readings are below, whatever the estimate: of a light touch these are 3 pairs.
    """
    begins = int(np.searchsorted(run.t_hard_s, press.start_s))
    change = press.depth_pF * press.profile(run.t_hard_s) * (1 + press.ratio(run.t_hard_s))
    seen = begins + int(np.argmax(change[begins:] >= QUIET * NOISE_PF[0] * math.sqrt(2)))
    return start - begins if start < begins else max(0, start - seen)


# The running ratio in a touch, beside the Fisher bound; steps; an object that relaxes.

MOMENTS = (0.2, 0.5, 1.0, 3.0, 6.0)
LIMITS = {
    0.08: (0.09, 0.015, 0.0075, 0.0042, 0.0033),
    0.12: (0.10, 0.016, 0.009, 0.0048, 0.0036),
    0.0: (0.08, 0.0083, 0.0042, 0.0028, 0.0026),
}
"""Tremor -> rms error at each of `MOMENTS`, %."""
STEP_S = 4.0


def in_touch(seeds: int) -> Iterator[Row]:
    """Return the rows of the running ratio."""
    for tremor, limits in LIMITS.items():
        best = 100 * bound(Setup(ratio=RATIO, tremor=tremor), MOMENTS)
        found = zip(
            *[running(run, MOMENTS) for run in recordings(held(tremor), range(seeds))], strict=True
        )
        for moment, limit, least, at_moment in zip(MOMENTS, limits, best, found, strict=True):
            name = f"running ratio, tremor {100 * tremor:g} %, {moment} s after contact"
            yield rms_row(name, at_moment, limit, beside=f"Fisher bound {least:.2g} %")
    for size, within, usual, slowest in ((0.3, 0.03, 5, 9), (0.01, 0.002, 6, 12)):
        scene = held(0.08, press={"ratios": [(0.0, RATIO), (STEP_S, RATIO * (1 + size))]})
        pairs = [follow(run, within) for run in recordings(scene, range(seeds))]
        text = f"step of {100 * size:g} % at 8 % tremor, pairs until within {100 * within:g} %: "
        yield Row(text + "median", float(np.median(pairs)), usual, "pairs")
        yield Row(text + "slowest", float(max(pairs)), slowest, "pairs")
    scene = held(press={"relaxes": 0.2, "relaxation_s": 1.0})
    relaxing = [running(run, [6.0])[0] for run in recordings(scene, range(seeds))]
    yield rms_row("ratio relaxing by 20 %, tau 1 s, 6 s after contact", relaxing, 0.08)


def follow(run: Simulation, within: float) -> int:
    """Return the pairs after the step until the error stays within a limit."""
    rows = scene_rows(run)
    after = (rows["touch"] > 0) & (run.t_hard_s >= run.presses[0].start_s + STEP_S)
    off = np.abs(rows["ratio"][after] / run.true_ratio[after] - 1) > within
    return int(np.flatnonzero(off)[-1]) + 1 if off.any() else 0


# Touches that do not follow C1 = r C2: how often a wrong result has no flag.

SILENT_PERCENT = 5.0
_HARD, _SOFT = Scenario().baselines


def physics(seeds: int) -> Iterator[Row]:
    """Return the rows of drifting baselines, and of silent wrong results."""
    for channel, limit in (("hard", 0.04), ("soft", 0.08)):
        found = results(
            held(baselines=changed(channel, drift_pF_per_s=3e-4, drift_from_s=START_S)), seeds
        )
        yield rms_row(f"drift of .3 fF/s in {channel} during the touch", found, limit)
    for name, scene in effects().items():
        found = results(scene, seeds)
        coverage, count = coverage_of(found)
        share = 100 * float(np.mean([r.silent for r in found]))
        beside = (
            f"median error {100 * float(np.median([r.error for r in found])):.2g} %; {flags(found)}"
        )
        yield Row(
            f"silent: {name}",
            share,
            SILENT_PERCENT,
            coverage=coverage,
            intervals=count,
            beside=beside,
        )


def changed(channel: str, **baseline: float) -> tuple[BaselineModel, BaselineModel]:
    """Return the baselines of both channels, with changes in one."""
    if channel == "hard":
        return (replace(_HARD, **baseline), _SOFT)
    return (_HARD, replace(_SOFT, **baseline))


def effects() -> dict[str, Scenario]:
    """Return one scenario for each effect and size."""
    found = {
        "hard bump bottoms out at 75 % of its range": held(
            bumps=Bumps(bottoms_pF=(0.75 * RATIO * DEPTH_PF, inf))
        )
    }
    for depth, share in (("half", 2.0), ("twice", 0.5)):
        curved = Gauge(exponent=0.9, reference_pF=share * DEPTH_PF)
        found[f"soft gauge ~ F^0.9, {depth} as deep as calibrated"] = held(gauges=(Gauge(), curved))
    for first, offset in (("soft", 0.02), ("soft", 0.05), ("soft", 0.10), ("hard", -0.05)):
        found[f"{first} bump reached first, by {100 * abs(offset):g} % of the depth"] = held(
            bumps=Bumps(offset=offset)
        )
    found["soft bump creeps by 5 %, tau 5 s"] = held(
        gauges=(Gauge(), Gauge(creep=0.05, creep_s=5.0))
    )
    for channel, drift_fF in (
        ("soft", 0.03),
        ("soft", 0.1),
        ("soft", 0.3),
        ("soft", 1.0),
        ("hard", 1.0),
    ):
        baselines = changed(channel, drift_pF_per_s=drift_fF * 1e-3, drift_from_s=START_S)
        found[f"drift of {drift_fF:g} fF/s in {channel} during the touch"] = held(
            baselines=baselines
        )
    for channel in ("hard", "soft"):
        jump = changed(channel, jump_pF=2e-3, jump_s=START_S + 3.0)
        found[f"baseline of {channel} jumps by 2 fF in the touch"] = held(baselines=jump)
    return found


# Faults of the readings: lost conversions, and time stamps of the host.


def readings(seeds: int) -> Iterator[Row]:
    """Return the rows of faults of the readings."""
    host: dict[str, Any] = {
        "converter": ConverterModel(jitter_s=0.0),
        "stamps": Stamps(host_s=0.003),
    }
    scenes = {
        "10 % of the conversions lost": (held(faults=Faults(lost=0.1)), 0.010),
        "30 % of the conversions lost, in runs of 8": (
            held(faults=Faults(lost=0.3, lost_run=8.0)),
            0.03,
        ),
        "host stamps of +-3 ms at 8 % tremor": (held(0.08, **host), 0.015),
    }
    for name, (scene, limit) in scenes.items():
        found = results(scene, seeds)
        yield rms_row(name, found, limit, beside=flags(found))


# A probe that slides from object to object.


def slides(seeds: int) -> Iterator[Row]:
    """Return the rows of the running ratio during a slide, of the results after it, and of a gauge that lags."""
    for depth, depth_pF in (("firm", DEPTH_PF), ("light", LIGHT_PF)):
        for slide in SLIDES:
            name = f"slide of {100 * slide.share:g} % in {slide.duration_s:g} s, {depth}: "
            largest, share, count = largest_error(slide, depth_pF, seeds)
            beside = f"{count} intervals"
            yield Row(name + "largest error", largest, slide.limit(depth_pF))
            yield Row(name + "intervals hold", 100 * share, 60, at_least=True, beside=beside)
    for slide in (Slide(0.0, 1.5, 0.0), *SLIDES):
        share = 100 * slide.share
        name = f"result after a slide of {share:g} % in {slide.duration_s:g} s"
        found = list(after_slides(slide, seeds))
        yield rms_row(name, found, 0.01, beside=flags(found))
        flagged = 100 * float(np.mean([bool(r.flags) for r in found]))
        yield Row(name + ": with a flag", flagged, 0.5, beside=flags(found))
    for lag_s in (0.026, 0.052, 0.1):
        found = list(after_slides(Slide(0.0, 1.5, 0.0), seeds, lag_s))
        share = 100 * float(np.mean([r.silent for r in found]))
        name = f"silent: soft gauge lags {1000 * lag_s:g} ms"
        yield Row(name, share, SILENT_PERCENT, beside=flags(found))


# Healthy touches: their flags, their 95 % intervals, and whether each has a standard error.

FEWEST_PAIRS = 3


def intervals(seeds: int) -> Iterator[Row]:
    """Return the rows of healthy touches, and of AR(1) noise."""
    found = [result(healthy(seed)) for seed in range(10 * seeds)]
    flagged = 100 * float(np.mean([bool(r.flags) for r in found]))
    coverage, count = coverage_of(found)
    yield Row(f"flags on {len(found)} healthy touches", flagged, 0.5, beside=flags(found))
    yield from between(
        f"95 % intervals, {count} healthy touches of 40 pairs and more: hold", coverage, 92, 99
    )
    lengths = [
        (touch.samples, touch.standard_error)
        for seed in range(seeds)
        for touch in palpate.touches(brief(seed))
    ]
    without = [not math.isfinite(error) for samples, error in lengths if samples >= FEWEST_PAIRS]
    name = f"touches of {FEWEST_PAIRS} to {max(lengths)[0]} pairs without a standard error"
    yield Row(name, 100 * float(np.mean(without)), 0.0, beside=f"of {len(without)}")
    for rho in (0.0, 0.5, 0.8):
        yield from between(
            f"95 % intervals, AR(1) noise of rho {rho}: hold", ar1_coverage(rho, 40 * seeds), 93, 97
        )


def healthy(seed: int) -> Simulation:
    """Return a press that follows C1 = r C2: 2 fF to 0.25 pF, 1.1 to 6.6 s, with tremor, hum, spikes and losses."""
    draw = np.random.default_rng([seed, 7])
    depth = 2e-3 * 125 ** draw.uniform()
    faults = Faults(
        pickup_pF=1e-3 * draw.integers(2) * draw.uniform(),
        spikes_per_s=0.5 * draw.integers(2),
        spike_pF=100 * NOISE_PF[0],
        lost=0.05 * draw.integers(2),
    )
    scene = held(
        draw.uniform(0, 0.12),
        press={"depth_pF": depth, "hold_s": draw.uniform(0.6, 6.05)},
        faults=faults,
    )
    [run] = recordings(scene, [seed])
    return run


def brief(seed: int) -> Simulation:
    """Return a press of 0.1 to 1 s."""
    press = {
        "rise_s": 0.05,
        "hold_s": np.random.default_rng([seed, 8]).uniform(0.001, 0.9),
        "fall_s": 0.05,
    }
    [run] = recordings(held(duration_s=4.5, press=press), [seed])
    return run


def ar1_coverage(rho: float, runs: int) -> float:
    """Return the coverage of nominal 95 % intervals in AR(1) noise, at the end of 250 samples, where they are known."""
    random = np.random.default_rng(1)
    hits = 0
    known = 0
    for _ in range(runs):
        noise = np.zeros(450)
        for k, shock in enumerate(random.standard_normal(450)):
            noise[k] = rho * noise[k - 1] + math.sqrt(1 - rho**2) * shock
        regressor = 0.25 * (1 + 0.02 * random.standard_normal(250))
        estimator = palpate.HandoverRls()
        estimator.process(2.5 * regressor + 1e-3 * noise[200:], regressor)
        known += math.isfinite(estimator.standard_error)
        hits += abs(estimator.ratio - 2.5) < 1.96 * estimator.standard_error
    return hits / known


# The probe without contact: drift in both channels, and what a tap leaves behind.


def idle(seeds: int) -> Iterator[Row]:
    """Return the rows of touches lost and invented beside idle readings."""
    lost = invented = 0
    for seed in range(seeds):
        draw = np.random.default_rng([seed, 5])
        drifts = [1e-3 * draw.choice((0.03, 0.1, 0.3)) * draw.choice([-1, 1]) for _ in range(2)]
        baselines = (
            replace(_HARD, drift_pF_per_s=drifts[0]),
            replace(_SOFT, drift_pF_per_s=drifts[1]),
        )
        presses = [Press(start, [(0.0, RATIO)], depth_pF=DEPTH_PF) for start in (2.0, 12.0, 22.0)]
        [run] = recordings(
            replace(held(duration_s=32.0, baselines=baselines), presses=presses), [seed]
        )
        starts = [touch.start_s for touch in palpate.touches(run)]
        true = [any(abs(start - press.start_s) < 0.2 for start in starts) for press in run.presses]
        lost += len(true) - sum(true)
        invented += len(starts) - sum(true)
    name = f"drift up to .3 fF/s in both, {3 * seeds} presses: touches lost or invented"
    yield Row(name, lost + invented, 0.0, "touches", beside=f"{lost} lost, {invented} invented")
    counts = []
    for seed in range(seeds):
        depth = 1e-3 * 0.05 * 20 ** np.random.default_rng([seed, 6]).uniform()
        press = {"depth_pF": depth, "rise_s": 0.03, "hold_s": 0.07, "fall_s": 0.03}
        [run] = recordings(held(duration_s=START_S + 18.13, press=press), [seed])
        counts.append(len(palpate.touches(run)))
    name = "a tap of 5 pairs of 0.05-1 fF, then 18 s of nothing, most"
    yield Row(name, max(counts), 2, "touches", beside=f"mean {np.mean(counts):.2g}")


# False alarms in touches: their interval, compared with the one that was set.

FIRST = 64  # samples of a touch
# pairs
IDLE = 60
RISE = 12
HOLD = 256
FALL = 10


def alarms(seeds: int) -> Iterator[Row]:
    """Return the rows of false alarms in 150 touches a seed."""
    for designed in (5e3, 25e3):
        parts = [tracked(designed, 150, seed) for seed in range(seeds)]
        for text, (samples, found) in zip(
            (f"first {FIRST}", "later"), np.sum(parts, axis=0), strict=True
        ):
            title = f"false-alarm interval / designed {designed:,.0f}, {text} samples"
            beside = f"{found} alarms in {samples:,} samples"
            yield Row(
                title, samples / max(found, 1) / designed, 0.5, "", at_least=True, beside=beside
            )


def tracked(interval: float, touches: int, seed: int) -> list[tuple[int, int]]:
    """Return samples and alarms in the first samples of touches, and later: a steady level, white noise, the scene handheld."""
    rise = 0.5 * (1 - np.cos(np.pi * np.arange(2 * RISE) / (2 * RISE)))
    fall = rise[:: -RISE // FALL][: 2 * FALL]
    force = np.tile(
        DEPTH_PF * np.concatenate([np.zeros(2 * IDLE), rise, np.ones(2 * HOLD), fall]), touches
    )
    values = force + NOISE_PF[0] * np.random.default_rng(seed).standard_normal(len(force))
    values[0::2] += (RATIO - 1) * force[0::2]
    times = PAIR_S / 2 * np.arange(len(force))
    tracker = palpate.Tracker("handheld", false_alarm_interval=interval)
    rows = tracker.process(times[0::2], times[1::2], values[0::2], values[1::2])
    inside = rows[rows["touch"] > 0]
    begins = np.flatnonzero(np.diff(inside["touch"], prepend=0))
    since = np.arange(len(inside)) - np.repeat(begins, np.diff(begins, append=len(inside)))
    parts = [inside["alarm"][since < FIRST], inside["alarm"][since >= FIRST]]
    return [(len(part), int(part.sum())) for part in parts]


# Offline estimation beside its best rival: a spline of the soft channel and least squares.

TIMES = 1.1
ONE_MEMORY = ("soft-steady", "stiff-steady", "near-rigid", "tremor", "strong-tremor", "light-touch", "spikes", "dropouts",
              "tremor-lines", "bursts", "pickup", "lost-10", "lost-runs", "coarse-codes", "jitter", "host-stamps", "skew",
              "slow-converter", "fast-converter", "together")  # fmt: skip
"""Named scenarios of one press with a constant ratio, which the readings follow."""
LOST_IN_BURSTS = (
    "In a few recordings a burst hides the press, or the result is refused with its reason: each is an error of "
    "100 %. The spline knows the press."
)


def offline(seeds: int) -> Iterator[Row]:
    """Return the rows of offline estimation."""
    for name in ONE_MEMORY:
        runs = [simulate(scenarios.SCENARIOS[name], seed) for seed in range(seeds)]
        yield beside_spline(name, runs, host_stamps=scenarios.SCENARIOS[name].stamps.host_s > 0)
    for tremor in (0.0, 0.05, 0.08, 0.12):
        yield beside_spline(
            f"lines, tremor {100 * tremor:g} %", list(recordings(held(tremor), range(seeds)))
        )


def beside_spline(name: str, runs: list[Simulation], *, host_stamps: bool = False) -> Row:
    """Return the row of one scenario: error of the offline result over the error of the rival with the better baseline."""
    ours = rms_row(name, [afterwards(run, host_stamps=host_stamps) for run in runs], inf)
    truth = np.array([run.presses[0].ratios[-1][1] for run in runs])
    splines = [
        np.array([spline_ratio(run, after=after) for run in runs]) for after in (False, True)
    ]
    best = min(100 * math.sqrt(np.mean((spline / truth - 1) ** 2)) for spline in splines)
    return replace(
        ours,
        name=f"offline: error / spline's, {name}",
        value=ours.value / best,
        limit=TIMES,
        unit="",
        beside=f"offline {ours.value:.2g} %",
        reason=LOST_IN_BURSTS if name == "bursts" else "",
    )


THEMES: dict[str, Callable[[int], Iterator[Row]]] = {
    "touches": contacts,
    "running": in_touch,
    "physics": physics,
    "readings": readings,
    "slides": slides,
    "intervals": intervals,
    "idle": idle,
    "alarms": alarms,
    "offline": offline,
}
"""Name -> rows(seeds) of each theme."""
COVERED = ("running", "physics", "readings")
"""Themes in which the intervals of every row have to hold the truth."""


def rows_of(theme: str, seeds: int) -> list[Row]:
    """Return the rows of one theme, with its lowest coverage; arguments are plain, for a process of its own."""
    rows = list(THEMES[theme](seeds))
    return [*rows, lowest_coverage(theme, rows)] if theme in COVERED else rows


def main() -> None:
    """Print the rows."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("themes", nargs="*", choices=[[], *THEMES], help="default: all")
    parser.add_argument("--seeds", type=int, default=100, help="recordings of each row")
    options = parser.parse_args()
    failed = False
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        chosen = options.themes or list(THEMES)
        for rows in pool.map(rows_of, chosen, [options.seeds] * len(chosen)):
            print(*rows, sep="\n", flush=True)
            failed |= any(row.verdict == "FAILS" for row in rows)
    sys.exit(failed)


if __name__ == "__main__":
    main()
