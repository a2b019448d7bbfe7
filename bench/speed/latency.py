"""Latency: how old a ratio is when Python has it, by stage, and how long a contact takes until it is found.

    python -m bench.speed.latency [--pairs 1000] [--touches 200] [--out bench/results/latency.json]
    python -m bench.speed.latency --table                             print the table of docs/numbers.md

The first table is live: the simulated board in real time, read by the real driver, through ring and tracker. The times
of its bus are assumptions (palpate.ad7746.simulator.evalboard), not measured on a board. Its column "idle" is by a virtual clock. It
and the second table, computed from simulated touches, are the same on every machine.
"""

import argparse
import json
import math
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any, Self

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate import Sample, Stream, Tracker
from palpate.ad7746.registers import CONVERSION_S
from palpate.samples import Instrument, settings_for
from palpate.simulation import scenarios
from palpate.simulation.probe import Scenario, simulate
from palpate.sources import SampleSource, SourceEvent
from palpate.sources.sim import SimSource

from bench.results_age import RESULTS, about
from bench.speed.__main__ import PAGE, replace_table

OUT = RESULTS / "latency.json"
MARK = "<!-- python -m bench.speed.latency --table -->"
PERCENT = (50, 90, 99, 100)
LIVE = "four-specimens"
LAG = 3  # pairs: 1 of the alignment, 2 for which a reading waits in the screen
GATES = ("stiff-steady", "strong-tremor", "light-touch")


STAGES = {
    "alignment": "the ratio belongs to the third pair before",
    "conversion": "middle to end of the hard conversion",
    "second channel": "until the soft conversion has ended",
    "bus": "until the driver has read the pair",
    "queue": "until the consumer takes it",
    "estimator": "all stages of the scene",
    "Python": "until the loop has the Estimate",
}
"""The stages of a pair, in order, from what its ratio describes to the number in the caller's loop."""

Ages = dict[str, NDArray[np.float64]]


class _Timed(SampleSource):
    """A simulated board; notes the real times of its conversions, and when it gave a pair, ns of its clock."""

    def __init__(self, board: SimSource) -> None:
        self.board = board
        self.times: dict[int, tuple[int, int, int, int]] = {}

    def __enter__(self) -> Self:
        self.board.__enter__()
        return self

    def samples(self) -> Iterator[Sample | SourceEvent]:
        for sample in self.board.samples():
            given = self.board.clock.now_ns()
            if isinstance(sample, Sample) and not sample.status:
                ended = [each for each in self.board.kit.chip.conversions if not each.lost]
                hard, soft = (
                    next(each for each in reversed(ended) if each.pin == pin) for pin in (1, 2)
                )
                assert (hard.code, soft.code) == (sample.hard_raw, sample.soft_raw)
                self.times[sample.seq] = ((hard.begin + hard.end) // 2, hard.end, soft.end, given)
            yield sample

    def describe(self) -> dict[str, Any]:
        return self.board.describe()

    @property
    def counters(self) -> Mapping[str, int]:
        return self.board.counters

    def interrupt(self) -> None:
        self.board.interrupt()

    def close(self) -> None:
        self.board.close()


class _TimedTracker(Tracker):
    """A tracker; notes when it got each pair and when it was done with it, ns."""

    board: SimSource
    times: list[tuple[int, int]]

    def process(self, t_hard: Any, t_soft: Any, hard: Any, soft: Any) -> Any:
        begun = self.board.clock.now_ns()
        rows = super().process(t_hard, t_soft, hard, soft)
        self.times += [(begun, self.board.clock.now_ns())] * len(rows)
        return rows


def _board(name: str, options: str) -> SimSource:
    board = palpate.open(f"sim:{name}?{options}")
    assert isinstance(board, SimSource)
    return board


def board_ages(name: str, *, pairs: int, seed: int) -> Ages:
    """Return the stages up to the bus without the computer: the clock is virtual, so they are the same everywhere.

    Parameters
    ----------
    name : str
        A scenario that the board can follow.
    pairs, seed : int

    Returns
    -------
    dict of str to numpy.ndarray, shape (n,), ms
    """
    with _Timed(_board(name, f"seed={seed}")) as source:
        samples = (item for item in source.samples() if isinstance(item, Sample))
        seqs = [sample.seq for sample in islice(samples, pairs)]
    times = np.array([(source.times[seq - LAG][0], *source.times[seq]) for seq in seqs[LAG:]])
    return dict(zip(STAGES, np.diff(times, axis=1).T / 1e6, strict=False))


def live_ages(
    name: str, *, pairs: int, seed: int, real_time: bool = True
) -> tuple[Ages, NDArray[np.float64]]:
    """Measure on the simulated board, in real time, or by its virtual clock.

    Parameters
    ----------
    name : str
        A scenario that the board can follow.
    pairs : int
        Length of the measurement; the scenario may end before.
    seed : int
    real_time : bool
        False: a virtual clock, with which no pair is late on any computer. It counts only the bus,
        so the stages of the computer mean nothing.

    Returns
    -------
    dict of str to numpy.ndarray, shape (n,), ms
        Time of each pair in each of `STAGES`; only pairs that have those before them.
    numpy.ndarray, shape (n,), ms
        Time from first to last.
    """
    options = f"seed={seed}"
    if real_time:
        options += "&speed=1"
    board = _board(name, options)
    source = _Timed(board)
    settings: Any = settings_for("handheld", Instrument.of(board.describe()))
    tracker = _TimedTracker("handheld", **settings)
    tracker.board = board
    tracker.times = []
    done: dict[int, int] = {}
    with Stream(source, tracker) as stream:
        for estimate in stream:
            done[estimate.sample.seq] = board.clock.now_ns()
            if len(done) >= pairs and any({seq, seq - LAG} <= source.times.keys() for seq in done):
                stream.stop()
        assert not stream.counters.dropped
    # The ratio after pair k belongs to the hard reading of pair k - LAG.
    passed = [
        (source.times[seq - LAG][0], *source.times[seq], *taken, done[seq])
        for seq, taken in zip(done, tracker.times, strict=True)
        if seq - LAG in source.times and seq in source.times
    ]
    times = np.array(passed)
    return dict(zip(STAGES, np.diff(times, axis=1).T / 1e6, strict=True)), (
        times[:, -1] - times[:, 0]
    ) / 1e6


def alignment_pairs() -> float:
    """Return by how many pairs the ratio lags behind the last one: measured on a ratio that rises like a ramp.

    Without memory (steady 0.01) and without the detector the estimator gives the ratio of the last pair, 0.01 pairs late.
    """
    period = 0.026
    slope = 0.02
    touch = 100
    t_hard = period * np.arange(400)
    t_soft = t_hard + period / 2
    truth = 2 + slope * np.arange(400)
    pressed = np.where(np.arange(400) < touch, 0.0, 1.0)
    tracker = palpate.Tracker(
        "handheld", steady=0.01, false_alarm_interval=math.inf, clip=100.0, samples=None
    )
    rows = tracker.process(t_hard, t_soft, truth * pressed, pressed)
    return float(np.round(np.median((truth - rows["ratio"])[-200:]) / slope, 1))


def shifted(name: str, share: float) -> Scenario:
    """Return a scenario whose presses begin later by this share of a pair: no press waits for the converter."""
    scenario = scenarios.SCENARIOS[name]
    late = share * scenario.converter.period_s
    return replace(
        scenario,
        presses=[replace(press, start_s=press.start_s + late) for press in scenario.presses],
    )


def gate(name: str, touches: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the pairs that a touch needs until it is found, and the time, ms, until the last of them is converted.

    Both count from the moment at which the bumps touch the object. The first ratio comes with the same pair.

    Parameters
    ----------
    name : str
        A scenario.
    touches : int
        Number of seeds; the first touch of each. They begin at all phases of the converter.
    """
    pairs = []
    times = []
    for seed in range(touches):
        run = simulate(shifted(name, seed / touches), seed)
        rows = palpate.Tracker("handheld").process(run.t_hard_s, run.t_soft_s, run.hard, run.soft)
        found = int(rows["contact"].argmax())
        start = run.presses[0].start_s
        assert np.isfinite(rows["ratio"][found])
        pairs.append(found + 1 - int(np.searchsorted(run.t_soft_s, start)))
        times.append(1e3 * (run.t_soft_s[found] + CONVERSION_S[0] / 2 - start))
    return np.array(pairs), np.array(times)


def percentiles(values: NDArray[Any]) -> list[float]:
    """Return the median, the 90th and 99th percentile and the maximum."""
    return [round(float(v), 4) for v in np.percentile(values, PERCENT)]


def measure(pairs: int, touches: int, seed: int) -> dict[str, Any]:
    """Run both parts."""
    ages, together = live_ages(LIVE, pairs=pairs, seed=seed)
    board = board_ages(LIVE, pairs=pairs, seed=seed)
    gates = {name: gate(name, touches) for name in GATES}
    return {
        "pairs": len(together),
        "stages": {name: percentiles(ages[name]) for name in STAGES},
        "together": percentiles(together),
        "board": {name: round(float(np.median(times)), 4) for name, times in board.items()},
        "alignment pairs": alignment_pairs(),
        "touches": touches,
        "gate pairs": {name: percentiles(pairs) for name, (pairs, _) in gates.items()},
        "gate ms": {name: percentiles(times) for name, (_, times) in gates.items()},
    }


def table(found: dict[str, Any]) -> str:
    """Return the table of docs/numbers.md."""

    def row(name: str, cells: list[float | None], digits: int) -> str:
        shown = ("" if value is None else f"{value:.{digits}f}" for value in cells)
        return f"| {name} | " + " | ".join(shown) + " |"

    head = ["| | 50 % | 90 % | 99 % | largest |", "|---|---|---|---|---|"]
    busy = f"{found['processors']} processors, load {found['load']:.1f}"
    lines = [
        f"Age of the ratio, ms, {found['pairs']} pairs, {busy}. Idle: without the computer, by the clock of the board.",
        "",
    ]
    lines += ["| | idle | 50 % | 90 % | 99 % | largest |", "|---|---|---|---|---|---|"]
    idle = found["board"]
    for name, values in found["stages"].items():
        lines.append(row(f"{name}: {STAGES[name]}", [idle.get(name), *values], 2))
    lines += [row("together", [sum(idle.values()), *found["together"]], 2), ""]
    lines += [
        f"From the contact of the bumps until it is found, {found['touches']} touches each:",
        "",
        *head,
    ]
    for name in found["gate pairs"]:
        lines += [row(f"`{name}`, pairs", found["gate pairs"][name], 0)]
        lines += [row(f"`{name}`, ms", found["gate ms"][name], 0)]
    return "\n".join(lines)


def main() -> None:
    """Measure, print and write; or print the table of the last measurement."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--pairs", type=int, default=1000, help="of the live measurement")
    parser.add_argument(
        "--touches", type=int, default=200, help="seeds of each scenario for the gate"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the live measurement")
    parser.add_argument("--out", type=Path, default=OUT, help="where the figures go")
    parser.add_argument(
        "--table", action="store_true", help="print the table of docs/numbers.md from the file"
    )
    options = parser.parse_args()
    if options.table:
        print(table(json.loads(options.out.read_text())))
        return
    busy = {"processors": os.cpu_count(), "load": os.getloadavg()[0]}
    found = about() | busy | measure(options.pairs, options.touches, options.seed)
    print(
        f"lag of the ratio behind the last pair, by the screen and the alignment, in pairs: {found['alignment pairs']:g}\n"
    )
    print(table(found))
    lines = (f"{json.dumps(name)}: {json.dumps(value)}" for name, value in found.items())
    options.out.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    if options.out == OUT:
        PAGE.write_text(replace_table(PAGE.read_text(), MARK, table(found)))


if __name__ == "__main__":
    main()
