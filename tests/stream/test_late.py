"""The flag "late": a computer that is too slow, live and in a replay of what it recorded."""

from collections.abc import Iterator
from pathlib import Path

import palpate
import pytest
from palpate.files import Json
from palpate.samples import Sample
from palpate.sources import SampleSource
from recording_bench import SampleReader


class Thinned(SampleSource):
    """The simulated board, without pairs of its first touch; the next ones are whole."""

    live = False

    def __init__(self, keeps: int, held_s: float) -> None:
        self._board = palpate.open("sim:four-specimens?seed=1")
        self._keeps = keeps
        self._held_s = held_s

    def samples(self) -> Iterator[Sample]:
        """Yield the pairs."""
        idle = list[Sample]()
        for sample in SampleReader(self._board):
            t_s = sample.t_hard_ns / 1e9
            if t_s < 1.9:
                idle.append(sample)
            if self._held_s < t_s < 9.5:  # lifted
                old = idle[sample.seq % len(idle)]
                yield sample._replace(
                    hard_raw=old.hard_raw, soft_raw=old.soft_raw, hard=old.hard, soft=old.soft
                )
            elif not 3 < t_s < 9.5 or sample.seq % self._keeps == 0:
                yield sample

    def describe(self) -> Json:
        """Return what the board says."""
        return dict(self._board.describe())


@pytest.mark.parametrize(("keeps", "held_s", "flags", "said"), [
    (1, 9.0, (), ""),
    (2, 9.0, ("late",), "came in time, as the computer was too slow"),
    (2, 5.0, ("short", "late"), "before its full length: hold the probe longer"),
])  # fmt: skip
def test_a_touch_without_a_fifth_of_its_pairs(
    tmp_path: Path, keeps: int, held_s: float, flags: tuple[str, ...], said: str
) -> None:
    path = tmp_path / "run.csv"
    with palpate.Stream(Thinned(keeps, held_s), record=path) as stream:
        for _ in stream.batches():
            pass
    assert palpate.touches(path) == stream.touches == palpate.touches(palpate.read(path))
    first, *others = stream.touches
    assert first.flags == flags
    assert not any(touch.flags for touch in others)
    assert said in "; ".join(map(str, palpate.advice(first)))
    assert ("hold the probe longer" in "; ".join(map(str, palpate.advice(first)))) == (
        "short" in flags
    )
