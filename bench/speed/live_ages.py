"""A live measurement on the simulated board in real time, with the time at which each pair passes each stage."""

from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any, Self

import numpy as np
import palpate
from numpy.typing import NDArray
from palpate import Sample, Source, Stream, Tracker
from palpate.samples import settings_for
from palpate.sources.sim import SimSource

STAGES = {
    "alignment": "the ratio is that of the pair before",
    "conversion": "middle to end of the hard conversion",
    "second channel": "until the soft conversion has ended",
    "bus": "until the driver has read the pair",
    "queue": "until the consumer takes it",
    "estimator": "all stages of the scene",
    "Python": "until the loop has the Estimate",
}
"""The stages of a pair, in order, from what its ratio describes to the number in the caller's loop."""

Ages = dict[str, NDArray[np.float64]]


class _Timed(Source):
    """A simulated board; notes the real times of its conversions, and when it gave a pair, ns of its clock."""

    def __init__(self, board: SimSource) -> None:
        self.board = board
        self.times: dict[int, tuple[int, int, int, int]] = {}

    def __enter__(self) -> Self:
        self.board.__enter__()
        return self

    def __iter__(self) -> Iterator[Sample]:
        for sample in self.board:
            given = self.board.clock.now_ns()
            if not sample.status:
                ended = [each for each in self.board.kit.chip.conversions if not each.lost]
                hard, soft = (next(each for each in reversed(ended) if each.pin == pin) for pin in (1, 2))
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
        seqs = [sample.seq for sample in islice(source, pairs)]
    times = np.array([(source.times[seq - 1][0], *source.times[seq]) for seq in seqs[1:]])
    return dict(zip(STAGES, np.diff(times, axis=1).T / 1e6, strict=False))


def live_ages(name: str, *, pairs: int, seed: int) -> tuple[Ages, NDArray[np.float64]]:
    """Measure on the simulated board, in real time.

    Parameters
    ----------
    name : str
        A scenario that the board can follow.
    pairs : int
        Length of the measurement; the scenario may end before.
    seed : int

    Returns
    -------
    dict of str to numpy.ndarray, shape (n,), ms
        Time of each pair in each of `STAGES`; only pairs that have the pair before them.
    numpy.ndarray, shape (n,), ms
        Time from first to last.
    """
    board = _board(name, f"seed={seed}&speed=1")
    source = _Timed(board)
    tracker = _TimedTracker("handheld", **settings_for("handheld", board.describe()))
    tracker.board, tracker.times = board, []
    done: dict[int, int] = {}
    with Stream(source, tracker) as stream:
        for estimate in stream:
            done[estimate.sample.seq] = board.clock.now_ns()
            if len(done) >= pairs and any({seq, seq - 1} <= source.times.keys() for seq in done):
                stream.stop()
        assert not stream.counters.dropped
    # The ratio after pair k is that of the hard reading of pair k - 1.
    passed = [
        (source.times[seq - 1][0], *source.times[seq], *taken, done[seq])
        for seq, taken in zip(done, tracker.times, strict=True)
        if seq - 1 in source.times and seq in source.times
    ]
    times = np.array(passed)
    return dict(zip(STAGES, np.diff(times, axis=1).T / 1e6, strict=True)), (times[:, -1] - times[:, 0]) / 1e6
