"""What each rule of `palpate.HandoverRls` gains: the rows that get worse without it.

    python -m bench.accuracy.rules [--seeds 20]

Each line lists a rule, what it does, and the rows that get worse by more than 5 % without it, or "nothing". The lines below it
list the rows that get better without it, and those that may be worse by chance. "No run changes" means that these signals
never need the rule, so they cannot judge it. The estimator is the reference in plain Python, from which `rule_list` removes
one rule at a time; all rules see the same short signals, those of `rule_rows`.

What is measured
  error     rms error of the ratio over a part of the samples, rms over the runs; "largest error" is relative to the ratio
  width     standard error after the last sample, median over the runs, infinite where it is unknown
  alarms    per 1,000 samples, mean over the runs
  runs with a false alarm, never found
            share of the runs
  coverage  share of samples with the true ratio within 1.96 standard errors, mean over the runs; an unknown standard error
            counts as a miss; "known" is the share of standard errors that are known
Errors and widths are compared as a factor, alarms relative to each other; both numbers of alarms are printed. Shares are
compared in percentage points; coverage above 95 % counts as 95 %. A row gets worse if it is also worse in 97.5 % of 400
bootstrap samples of the runs; otherwise it may be chance.
"""

import argparse
import math
import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
import palpate
from numpy.typing import NDArray

from bench.accuracy.rule_list import RULES, Rule, follow, without
from bench.accuracy.rule_rows import WORLDS, Kind, World
from bench.accuracy.signal_worlds import steady

Array = NDArray[np.float64]
LEAST = 0.05
"""Relative, or of all runs or samples: by less a row does not get worse."""
NOMINAL = 0.95
DRAWS = 400
CERTAIN = 0.975
NONE = Rule("none", "nothing is left out")


@dataclass(frozen=True)
class Row:
    """A measure in a world, and its value in each run."""

    title: str
    kind: Kind
    values: Array


@dataclass(frozen=True)
class Change:
    """A row that is not the same without a rule.

    Attributes
    ----------
    text : str
        Row and change.
    size : float
        By how much it is worse, or better.
    certain : bool
    """

    text: str
    size: float
    certain: bool


@dataclass(frozen=True)
class Verdict:
    """What a rule gains.

    Attributes
    ----------
    rule : Rule
    worse, perhaps, better : tuple of Change
        The rows that are worse without it, those that may be, and those that are better, the largest change first.
    is_used : bool
        Whether a value of any run is another one without it.
    """

    rule: Rule
    worse: tuple[Change, ...]
    perhaps: tuple[Change, ...]
    better: tuple[Change, ...]
    is_used: bool

    def __str__(self) -> str:
        """Return it as text."""
        gain = texts(self.worse) or "nothing"
        if not self.is_used:
            gain = "nothing; no run changes"
        lines = [f"{self.rule.name:18} {self.rule.phrase:48} {gain}"]
        if self.better:
            lines.append(f"{'':19}better without it: {texts(self.better)}")
        if self.perhaps:
            lines.append(f"{'':19}worse, perhaps by chance: {texts(self.perhaps)}")
        return "\n".join(lines)


def texts(changes: Iterable[Change]) -> str:
    """Return changes as text."""
    return "; ".join(change.text for change in changes)


def measured(rule: Rule, seeds: int, worlds: Sequence[World] = WORLDS) -> list[Row]:
    """Return all rows of some worlds without a rule."""
    rows = []
    with without(rule):
        for world in worlds:
            rows += rows_of(rule, world, seeds)
    return rows


def rows_of(rule: Rule, world: World, seeds: int) -> list[Row]:
    """Return the rows of a world."""
    runs = []
    for seed in range(seeds * world.runs):
        signals = world.make(seed)
        trace = follow(signals, rule.limits)
        runs.append([one.of(signals, trace, one.part) for one in world.measures])
    rows = []
    for one, values in zip(world.measures, np.transpose(runs), strict=True):
        rows.append(Row(f"{world.name}: {one.name}", one.kind, values))
    return rows


def number(kind: Kind, values: Array) -> float:
    """Return the number of some runs; inf if it is nan."""
    if kind == Kind.RMS:
        found = np.sqrt(np.mean(values**2))
    elif kind == Kind.MEDIAN:
        found = np.median(values)
    else:
        found = np.mean(values)
    return math.inf if math.isnan(found) else float(found)


def loss(kind: Kind, before: float, after: float) -> float:
    """Return by how much a number is worse after than before: relative, or in points where it is a share."""
    if kind == Kind.SHARE:
        return after - before
    if kind == Kind.COVERAGE:
        return min(before, NOMINAL) - min(after, NOMINAL)
    if after == before:
        return 0.0
    return after / before - 1 if before > 0 else math.inf


def loss_of(one: Row, other: Row, runs: NDArray[np.intp] | slice = slice(None)) -> float:
    """Return by how much the second row is worse, in some runs of both."""
    before, after = (number(row.kind, row.values[runs]) for row in (one, other))
    return loss(one.kind, before, after)


def is_certain(one: Row, other: Row) -> bool:
    """Return whether the second row is worse in nearly all draws of runs."""
    random = np.random.default_rng(0)
    size = len(one.values)
    worse = 0
    for _ in range(DRAWS):
        worse += loss_of(one, other, random.integers(size, size=size, dtype=np.intp)) > 0
    return worse >= CERTAIN * DRAWS


def printed(kind: Kind, value: float) -> str:
    """Return the number of a row as text."""
    if kind in (Kind.SHARE, Kind.COVERAGE):
        return f"{100 * value:.0f} %"
    return f"{value:.2g}"


def change_text(before: Row, after: Row) -> str:
    """Return the title of a row, and its change."""
    one, other = (number(row.kind, row.values) for row in (before, after))
    if before.kind == Kind.RATE:
        return f"{before.title} {one:.2g} -> {other:.2g}"
    if before.kind in (Kind.SHARE, Kind.COVERAGE):
        return f"{before.title} {100 * (other - one):+.0f} points"
    factor = other / one if one > 0 else math.inf
    return f"{before.title} x {factor:.2f}"


def verdict_of(rule: Rule, usual: Sequence[Row], rows: Sequence[Row]) -> Verdict:
    """Compare all rows without a rule with the usual ones."""
    worse = []
    better = []
    for before, after in zip(usual, rows, strict=True):
        text = change_text(before, after)
        lost = loss_of(before, after)
        gained = loss_of(after, before)
        if lost > LEAST:
            worse.append(Change(text, lost, is_certain(before, after)))
        elif gained > LEAST and is_certain(after, before):
            better.append(Change(text, gained, certain=True))
    worse.sort(key=lambda change: -change.size)
    better.sort(key=lambda change: -change.size)
    certain = tuple(change for change in worse if change.certain)
    perhaps = tuple(change for change in worse if not change.certain)
    is_used = any(
        not np.array_equal(before.values, after.values, equal_nan=True)
        for before, after in zip(usual, rows, strict=True)
    )
    return Verdict(rule, certain, perhaps, tuple(better), is_used)


def check_reference() -> None:
    """Raise RuntimeError if the reference, with the settings of this bench, is not the compiled estimator."""
    signals = steady(0, 200)
    ratio = palpate.HandoverRls().trace(signals.output, signals.regressor)["ratio"]
    apart = float(np.max(np.abs(follow(signals).ratio - ratio)))
    # 200 samples in double; both ratios are about 2
    if not apart < 1e-9:
        message = (
            f"the reference is {apart:g} from palpate.HandoverRls, at most 1e-9 is allowed: "
            "build the core again, or correct the settings of rule_list.follow"
        )
        raise RuntimeError(message)


def measured_of(place: int, seeds: int) -> list[Row]:
    """Return the rows without the rule at a place of the list; arguments are plain, for a process of its own."""
    return measured(RULES[place], seeds)


def usual_table(rows: Iterable[Row]) -> str:
    """Return the rows with all rules as text."""
    lines = ["with all rules"]
    for row in rows:
        lines.append(f"  {row.title:45} {printed(row.kind, number(row.kind, row.values)):>8}")
    return "\n".join(lines)


def main() -> None:
    """Print the rows with all rules, and what is worse without each rule."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20, help="runs of each row, or a multiple")
    seeds = parser.parse_args().seeds
    if seeds < 1:
        parser.error(f"--seeds is {seeds}; give 1 or more")
    check_reference()
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        usual_rows = pool.submit(measured, NONE, seeds)
        found = pool.map(measured_of, range(len(RULES)), [seeds] * len(RULES))
        usual = usual_rows.result()
        print(usual_table(usual), end="\n\n", flush=True)
        for rule, rows in zip(RULES, found, strict=True):
            print(verdict_of(rule, usual, rows), flush=True)


if __name__ == "__main__":
    main()
